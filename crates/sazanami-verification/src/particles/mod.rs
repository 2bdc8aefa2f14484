//! Experiments on moving particles: programs that set up a vessel, run it and return how far the result is off.

mod beds;
mod jets;
mod operators;
mod vessel;

pub use beds::{LatticeVoids, lattice_voids};
pub use jets::{ReversedFall, reversed_fall};
pub use operators::{Operators, bulk_weighted, laplacian_by_number_density, operators};
pub use vessel::{DOWN, Vessel};
