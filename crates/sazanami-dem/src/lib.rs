//! Grains as rigid bodies in contact (discrete element method): spheres fixed to bodies of any shape,
//! springs, dashpots and friction between them, and beds packed from them.
//!
//! [`Engine`] moves grains; [`Packing`] makes beds. Fluids act through [`Loads`]. A grain belongs to
//! the rank whose part of the domain holds its centre of mass; copies on other ranks and periodic
//! images are ghosts. Every sum has an order given by identifiers, so that the bits of a run depend
//! neither on threads, nor on ranks, nor on the age of neighbour lists.
//!
//! The damping of a contact from its coefficient of restitution, and back:
//!
//! ```
//! use sazanami_dem::{damping_ratio, restitution};
//!
//! let gamma = damping_ratio(0.5, true);
//! assert!((restitution(gamma, true) - 0.5).abs() < 1e-9);
//! ```

mod body;
mod bridge;
mod contact;
mod engine;
mod error;
mod face;
mod film;
mod ghosts;
mod grain;
pub mod impact;
mod lanes;
mod material;
mod modes;
mod motion;
mod packing;
mod selection;
mod snapshot;
pub mod stability;
mod wall;
mod wrench;

pub use body::Body;
pub use bridge::Bridge;
pub use contact::public::*;
pub use engine::{
    Arrivals, ContactReport, Departures, Drag, Engine, LARGEST_OVERLAP, Loads, Setup, Substeps, Vicinity,
};
pub use error::DemError;
pub use face::{Bumps, Face};
pub use film::Film;
pub use grain::{ATTACHED, Grain, Grains, Motion};
pub use material::TangentialForce;
pub use packing::{Kind, Lattice, Packing, PackingReport, PackingSettings, Softness, Stage, TILT, lying_order};
pub use sazanami_numerics::particles::WALL;
pub use wall::Wall;
