//! The uniform Cartesian grid and the fields that live on it.

mod field;
mod uniform;

pub use field::{Field, GHOSTS};
pub use uniform::Grid;
