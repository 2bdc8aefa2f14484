//! From a case to what a solver needs.

pub mod box_motion;
pub mod fluid;
pub mod grains;
pub mod particles;
pub mod shapes;
pub mod shared;
pub mod wetted;
