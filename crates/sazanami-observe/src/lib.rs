//! What people came for: crater volume and profile, splashed grains, the state of the bed, budgets
//! of momentum, liquid and energy, and the comparison of several runs.
//!
//! Everything here reads plain slices ([`BedView`]) and returns plain numbers. Nothing is written,
//! and nothing depends on the number of threads or ranks: the caller hands over all grains in the
//! order of their identifiers.

mod bed;
pub mod bed_profile;
pub mod budget;
pub mod comparison;
pub mod erosion;
pub mod height_map;
pub mod splash;

pub use bed::{BedView, Body};

use sazanami_numerics::Real;

/// Horizontal position `(x1, x2)` [m].
pub type Horizontal = [Real; 2];
