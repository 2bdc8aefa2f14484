//! Experiments on the grid: programs that carry a liquid by a given flow and return how far the result is off.

mod prescribed;

pub use prescribed::{ShapeError, deformation, reversed_vortex, translation};
