//! Sand grains, water and air on one grid: multiphase flow with resolved grains (MICS, after
//! Yagyu, Ushijima, Toriu and Aoki 2015).
//!
//! The step is written in [`solver`]; what it is made of: transport of liquid and momentum with the
//! same mass fluxes ([`transport`], [`interface`], [`advection`]), viscosity ([`viscosity`]), gravity, the projection
//! onto a divergence-free velocity ([`pressure`]), and the exchange of momentum with the grains ([`grains`]).
//!
//! The length of a step is the least of what its limits allow, and says which one ruled:
//!
//! ```
//! use sazanami_mics::stability::{Limit, Rates, StepLimits};
//!
//! // A flow that crosses 1000 cells in a second: a Courant number of 0.45 after 0.45 ms.
//! let rates = Rates { advective: 1e3, ..Rates::default() };
//! let step = StepLimits::up_to(1e-2).choose(&rates, None);
//! assert_eq!(step.limit, Limit::Advective);
//! assert!((step.dt - 4.5e-4).abs() < 1e-15);
//! ```

mod acceleration;
pub mod advection;
pub mod ball;
pub mod boundary;
pub mod carrying;
mod diffusion;
mod driving;
pub mod flow;
mod fluids;
pub mod grains;
pub mod interface;
mod mean_gradient;
pub mod mobility;
pub mod momentum;
mod outside;
mod pass;
pub mod pressure;
mod pressure_sides;
mod schemes;
mod slopes;
pub mod snapshot;
pub mod solver;
pub mod stability;
pub mod surface_tension;
pub mod transport;
pub mod viscosity;
