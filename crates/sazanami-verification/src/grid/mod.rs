//! Experiments on the grid: programs that run a flow with a known answer and return how far the result is off.

pub mod dam_break;
mod experiment;
mod prescribed;
mod single_phase;
mod two_phase;

pub use experiment::{Experiment, ExperimentError};
pub use prescribed::{ShapeError, deformation, reversed_vortex, translation};
pub use single_phase::{
    CavityError, Reynolds, TimeOrder, VortexError, cavity, slip_box_vortex, taylor_green, taylor_green_in_time,
};
pub use two_phase::{FreeFlight, GRAVITY, WATER_AND_AIR, drop_in_flight};
