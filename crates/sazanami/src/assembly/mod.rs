//! From a case to what a solver needs.

pub(crate) mod fluid;
pub(crate) mod grains;
pub(crate) mod particles;
pub mod shapes;
