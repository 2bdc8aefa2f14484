//! Lengths of the steps, as the case and what is due ask for them.

use sazanami_numerics::Real;

use crate::case::meaning::{Case, Solver, StepChoice};

/// A step ends on an output time when it comes this near to it, in parts of the step.
pub const LANDING: Real = 1e-9;

/// Steps in a period of what shakes the box or drives the flow. A body that is free to follow then has the amplitude of its
/// swing to 0.1 %: the sum of `sin` over steps of `T/n` is off by `(pi/n)^2/6`.
pub const STEPS_OF_SWING: Real = 40.0;

/// Name of the limit of steps that end on an output, and of the phase between the steps.
pub const OUTPUT: &str = "output";

/// Name of the limit by [`STEPS_OF_SWING`].
pub const SWING: &str = "swing";

/// Longest step that follows what shakes the box and drives the flow \[s]; `None` where nothing swings.
#[must_use]
pub fn longest_in_swing(case: &Case) -> Option<Real> {
    case.swing_frequency().map(|frequency| (STEPS_OF_SWING * frequency).recip())
}

/// A fixed step length of the case, if it has one \[s].
#[must_use]
pub fn fixed_step(case: &Case) -> Option<Real> {
    match (case.solver, case.fluid.step) {
        (Solver::Mps, _) => case.particles.as_ref().and_then(|particles| particles.dt),
        (Solver::Mics, StepChoice::Fixed(dt)) => Some(dt),
        (Solver::Mics, StepChoice::Adaptive { .. }) => None,
    }
}

/// Length of a step \[s] where something is due in `left` \[s]: `stable` \[s], shortened (never lengthened) so that a step ends
/// exactly then. Two steps share what is left when one would leave a sliver.
#[must_use]
pub fn towards(left: Real, stable: Real) -> Real {
    if left <= stable * (1.0 + LANDING) {
        left
    } else if left < 2.0 * stable {
        0.5 * left
    } else {
        stable
    }
}
