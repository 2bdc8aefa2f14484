//! Experiments on moving particles: programs that set up a vessel, run it and return how far the result is off.

mod bed_load;
mod bed_stress;
mod beds;
mod fluidised;
mod jets;
mod operators;
mod repose;
mod settled_bed;
mod suspended;
mod vessel;

pub use bed_load::{BedLoad, bed_load};
pub use bed_stress::{BedStress, bed_stress, started_flow};
pub use beds::{LatticeVoids, RestingBed, dry_bed, lattice_voids, resting_bed};
pub use fluidised::{BedOnSieve, FluidisedBed};
pub use jets::{ReversedFall, reversed_fall};
pub use operators::{Operators, bulk_weighted, laplacian_by_number_density, operators};
pub use repose::{Repose, repose};
pub use suspended::{HinderedSettling, hindered_settling, settling_speed};
pub use vessel::{DENSITY, DIAMETER, DOWN, Energy, ExperimentError, GRAIN_DENSITY, GRAVITY, Vessel, advance};
