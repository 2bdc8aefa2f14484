//! Properties and numerical parameters of the fluid, and what forces it in a step.

use sazanami_numerics::{Real, Vector};

use crate::scheme::{Fluid, Scheme};
use crate::stability::StepLimits;

/// Stopping criterion of the pressure solver.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Tolerance {
    /// Largest residual, as a volume strain per step; less is wanted of slow flows ([`Self::at`]).
    pub strain: Real,
    /// Iterations after which the solver gives up.
    pub most_iterations: usize,
}

/// Courant number below which what is wanted falls with it, so that what the projection leaves stays small beside the flow.
const SLOW: Real = 1e-3;
/// What is wanted of the slowest flows, a volume strain per step.
const LEAST: Real = 1e-10;

impl Tolerance {
    /// The largest residual that is wanted where the fastest particle or grain goes `courant` spacings in a step relative to the walls: what is allowed, in
    /// proportion less below 1e-3, and no less than 1e-10 unless less is allowed.
    #[must_use]
    pub fn at(&self, courant: Real) -> Real {
        self.strain.min((self.strain * courant / SLOW).max(LEAST))
    }
}

impl Default for Tolerance {
    fn default() -> Self {
        Self { strain: 1e-6, most_iterations: 500 }
    }
}

/// Properties and numerical parameters of the fluid.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ParticleSettings {
    /// Fluid properties and particle spacing.
    pub fluid: Fluid,
    /// Scheme and its parameters.
    pub scheme: Scheme,
    /// Limits of the time step.
    pub limits: StepLimits,
    /// Stopping criterion of the pressure solver.
    pub tolerance: Tolerance,
    /// Point at which the hydrostatic part of the pressure is zero \[m].
    pub reference: Vector,
}

/// External forcing of a step.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Forcing {
    /// Body force per mass in the middle of the step, in the frame of the positions [m/s^2].
    pub body_force: Vector,
    /// Part of the body force that stands for a gradient of pressure from outside: on grains it acts by the volume of fluid that they
    /// displace, not by their mass [m/s^2].
    pub by_volume: Vector,
    /// Displacement of the walls at the end of the step, from the start of the run \[m].
    pub wall_displacement: Vector,
    /// Mean velocity of the walls in the step [m/s].
    pub wall_velocity: Vector,
}
