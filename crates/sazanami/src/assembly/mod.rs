//! From a case to what a solver needs.

pub mod fluid;
pub mod grains;
pub(crate) mod particles;
pub mod shapes;
pub(crate) mod shared;
