//! Numerical schemes of the fluid phase, and the choices among them.

use sazanami_numerics::choices;

use crate::advection::Convection;

/// Numerical schemes of the fluid phase; the default is recommended.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Schemes {
    /// Convection of momentum.
    pub convection: Convection,
    /// Time integration of the viscous stress.
    pub viscosity: ViscosityScheme,
    /// Convecting face velocity.
    pub carrier: Carrier,
}

/// Part of the transposed gradient in the stress.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) enum Transposed {
    /// Nothing.
    Left,
    /// All of it: `mu du_j/dx_i`.
    #[default]
    Whole,
    /// The part where the viscosity changes: `mu (du_j/dx_i - delta_ij div u)`. For a velocity without divergence it is
    /// the whole; its divergence is zero to round-off where the viscosity is constant, whatever the velocity.
    AtInterface,
}

/// Time level of the convecting face velocity.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Carrier {
    /// Start of the step.
    #[default]
    Start,
    /// Middle of the step, by extrapolation from the last two: second order in time.
    Middle,
}

choices! {
    /// Time integration of the viscous stress.
    #[derive(Default)]
    pub enum ViscosityScheme {
        /// The stress at the start of the step where the step is so short that this is as accurate as backward Euler, else backward
        /// Euler. Friction on the surfaces of grains is implicit in both.
        #[default]
        Auto = "auto",
        /// Backward Euler.
        Implicit = "implicit",
        /// The stress at the start for half a step before the transport, backward Euler for half a step
        /// after it: second order in time, with `pressure_form = "incremental"`; refused with the full pressure.
        CrankNicolson = "crank_nicolson",
        /// The stress at the start of the step; limits the time step.
        Explicit = "explicit",
        /// No viscous stress.
        Off = "off",
    }
}

choices! {
    /// Initial velocity of cells that a liquid region fills in part.
    #[derive(Default)]
    pub enum DropVelocity {
        /// Mass-averaged: the momentum is that of the liquid.
        #[default]
        Mass = "mass",
        /// The volume fraction times the velocity, as in Yagyu et al. (2015): the momentum of a drop
        /// of 29 cells in diameter comes out 3 % too small.
        Beta = "beta",
    }
}
