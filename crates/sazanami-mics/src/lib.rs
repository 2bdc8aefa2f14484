//! Sand grains, water and air on one grid: multiphase flow with resolved grains (MICS, after
//! Yagyu, Ushijima, Toriu and Aoki 2015).
//!
//! The step is written in [`solver`]; what it is made of: transport of liquid and momentum with the
//! same mass fluxes ([`transport`], [`interface`], [`advection`]), viscosity ([`viscosity`]), the forces on
//! the fluid ([`forces`]), the projection onto a divergence-free velocity ([`pressure`]), and the exchange
//! of momentum with the grains ([`grains`]).

pub mod advection;
pub mod ball;
pub mod boundary;
pub mod flow;
mod fluids;
pub mod forces;
pub mod grains;
pub mod interface;
pub mod momentum;
pub mod pressure;
mod schemes;
pub mod snapshot;
pub mod solver;
pub mod stability;
pub mod transport;
pub mod viscosity;
