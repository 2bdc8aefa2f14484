//! What the tests share.

use sazanami_dem::{Interactions, LinearSpringDashpot, Setup};
use sazanami_mics::flow::Fluids;
use sazanami_numerics::Vector;

/// Their densities [kg/m^3] and viscosities [Pa s], in round numbers.
pub const WATER_AND_AIR: Fluids =
    Fluids { liquid_density: 1e3, gas_density: 1.0, liquid_viscosity: 1e-3, gas_viscosity: 1e-5 };

/// An engine without grains.
pub fn no_grains() -> Setup {
    Setup {
        bodies: Vec::new(),
        interactions: Interactions::uniform(0, LinearSpringDashpot::SAND),
        walls: Vec::new(),
        region: [Vector::NEG_INFINITY, Vector::INFINITY],
        ghost_margin: 0.0,
    }
}
