//! Water as moving particles over overlapping grains (DEM-MPS, after Tazaki, Harada, Ikari and Gotoh).
//!
//! An enhanced moving-particle semi-implicit fluid: source of the pressure equation of higher order (HS), Laplacian
//! of higher order (HL), error-compensating source (ECS), corrected gradient (GC) and dynamic stabilisation (DS),
//! all with a Wendland weight. The step is written in [`solver`].

pub mod boundary;
mod coarse;
mod exchange;
pub mod filling;
pub mod free_surface;
pub mod grains;
mod matrix;
mod momentum;
mod neighbours;
mod number_density;
mod operators;
mod particles;
pub mod pressure;
pub mod probe;
mod reductions;
pub mod scheme;
mod shifting;
pub mod snapshot;
pub mod solver;
mod stabilisation;
pub mod stability;
pub mod weight;

pub use exchange::Periods;
pub use momentum::FluidImpulses;
pub use particles::{Kind, Particles, Role, WALL};
