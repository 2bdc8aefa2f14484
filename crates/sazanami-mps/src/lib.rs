//! Moving-particle fluid coupled to spherical grains by overlap (DEM-MPS, after Tazaki, Harada, Ikari and Gotoh).
//!
//! The pressure force is the negative transpose of the divergence ([`scheme::ParticleProjection::Conjugate`]); beside it stands the
//! published method, enhanced MPS: higher-order source of the pressure equation (HS), higher-order Laplacian (HL),
//! error-compensating source (ECS), corrected gradient (GC) and dynamic stabilisation (DS). Both have a Wendland C2 weight
//! function. The step is in [`solver`]; equations and their sources are in `docs/theory/mps.md`.
//!
//! A weight function is 1 at the centre and nothing from its radius of influence on:
//!
//! ```
//! use sazanami_mps::weight::Weight;
//!
//! let weight = Weight { radius: 3.1e-3 };
//! assert_eq!(weight.value(0.0), 1.0);
//! assert_eq!(weight.value(3.2e-3), 0.0);
//! assert!(weight.slope(1e-3) < 0.0);
//! ```

mod arrangement;
pub mod boundary;
mod coarse;
mod conjugate;
mod context;
mod error;
pub mod filling;
mod free_surface;
pub mod gates;
mod ghosts;
mod gradient;
pub mod grains;
mod matrix;
mod moments;
mod momentum;
mod motion;
mod neighbours;
mod number_density;
mod particles;
pub mod pouring;
pub mod pressure;
mod pressure_system;
pub mod probe;
mod reductions;
mod report;
pub mod scheme;
mod settings;
pub mod snapshot;
pub mod solver;
mod source;
mod stabilisation;
pub mod stability;
mod surface_test;
mod viscosity;
mod walls;
pub mod weight;

pub use ghosts::Periods;
pub use momentum::FluidImpulses;
pub use particles::{Kind, Particles, Role};
