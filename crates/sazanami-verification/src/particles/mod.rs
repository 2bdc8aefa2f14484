//! Experiments on moving particles: programs that set up a vessel, run it and return how far the result is off.

mod bed_load;
mod beds;
mod jets;
mod operators;
mod repose;
mod settled_bed;
mod vessel;

pub use bed_load::{BedLoad, bed_load};
pub use beds::{LatticeVoids, lattice_voids};
pub use jets::{ReversedFall, reversed_fall};
pub use operators::{Operators, bulk_weighted, laplacian_by_number_density, operators};
pub use repose::{Repose, repose};
pub use vessel::{DENSITY, DIAMETER, DOWN, Energy, ExperimentError, GRAIN_DENSITY, GRAVITY, Vessel, advance};
