//! Observations of a run: crater volume and profile, splashed grains, the state of the bed, the slope of a heap,
//! ripples, budgets of momentum and liquid, and the comparison of several runs.
//!
//! Everything here reads plain slices ([`BedView`]) and returns plain numbers. Nothing is written,
//! and nothing depends on the number of threads or ranks: all grains are looked at in the order of
//! their identifiers, on rank 0 ([`GatheredBed`]).
//!
//! The law through crater volumes of several runs:
//!
//! ```
//! use sazanami_observe::comparison::PowerLaw;
//!
//! let law = PowerLaw::fit([(1.0, 3.0), (2.0, 12.0), (4.0, 48.0)]).unwrap();
//! assert!((law.exponent - 2.0).abs() < 1e-12 && (law.at(3.0) - 27.0).abs() < 1e-9);
//! ```

mod bed;
pub mod bed_profile;
pub mod budget;
pub mod comparison;
pub mod erosion;
pub mod fit;
mod gathered;
mod ground;
pub mod heap;
pub mod height_map;
pub mod ripples;
pub mod splash;

pub use bed::{BedView, Body};
pub use gathered::{BedColumns, GatheredBed};
pub use ground::Ground;

use sazanami_numerics::Real;

/// Horizontal position `(x1, x2)` \[m].
pub type Horizontal = [Real; 2];
