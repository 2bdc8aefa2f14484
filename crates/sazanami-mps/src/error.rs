//! Errors in setting up a solver and in a step.

use sazanami_dem::DemError;
use sazanami_numerics::domain::FailedElsewhere;
use sazanami_numerics::{Real, Vector};

use crate::boundary::LatticeError;
use crate::pressure::PressureError;
use crate::stability::COMPRESSIBLE;

/// A step could not be completed.
#[derive(Clone, Debug, thiserror::Error)]
pub enum StepError {
    /// The pressure equation was not solved.
    #[error(transparent)]
    Pressure(#[from] PressureError),
    /// A particle has a NaN or infinite value.
    #[error("fluid particle {id} has a {what} that is not finite at ({:.4e}, {:.4e}, {:.4e}) m", position.x, position.y, position.z)]
    NotFinite {
        /// Identifier of the particle.
        id: u64,
        /// Name of the quantity.
        what: &'static str,
        /// Position at the start of the step \[m].
        position: Vector,
    },
    /// A particle moved farther in a step than its radius of influence.
    #[error("fluid particle {id} moved {:.3} mm in the step, farther than its radius of influence of {:.3} mm, from ({:.4e}, {:.4e}, {:.4e}) m", 1e3 * distance, 1e3 * limit, position.x, position.y, position.z)]
    TooFar {
        /// Identifier of the particle.
        id: u64,
        /// Distance moved \[m].
        distance: Real,
        /// Radius of influence \[m].
        limit: Real,
        /// Position at the start of the step \[m].
        position: Vector,
    },
    /// A particle exceeds the speed up to which water is incompressible.
    #[error("fluid particle {id} moves at {speed:.4e} m/s at ({:.4e}, {:.4e}, {:.4e}) m; flow faster than {COMPRESSIBLE} m/s is not incompressible: the run is unstable", position.x, position.y, position.z)]
    TooFast {
        /// Identifier of the particle.
        id: u64,
        /// Its speed [m/s].
        speed: Real,
        /// Position at the start of the step \[m].
        position: Vector,
    },
    /// The grains could not be advanced.
    #[error(transparent)]
    Grains(#[from] DemError),
    /// Another rank failed.
    #[error(transparent)]
    Elsewhere(#[from] FailedElsewhere),
}

/// A solver could not be set up.
#[derive(Clone, Debug, thiserror::Error)]
pub enum SetupError {
    /// The wall lattice does not fit the box.
    #[error(transparent)]
    Lattice(#[from] LatticeError),
    /// A periodic length is less than twice the radius of influence.
    #[error("the box is {:.3} mm long in x{}, where it is periodic; at least {:.3} mm, twice the radius of influence, is needed", 1e3 * length, direction + 1, 1e3 * needed)]
    BoxTooShort {
        /// Direction, from 0.
        direction: usize,
        /// Length of the box \[m].
        length: Real,
        /// Least length \[m].
        needed: Real,
    },
    /// The radius of influence is out of range.
    #[error("a radius of influence of {radius} particle spacings is outside 2.1 to 3.6")]
    Radius {
        /// Radius over the spacing.
        radius: Real,
    },
    /// The radius of influence is too small for the conjugate scheme.
    #[error(
        "a radius of influence of {radius} particle spacings is below {}, the least of the conjugate scheme",
        crate::scheme::CONJUGATE_RADIUS
    )]
    ConjugateRadius {
        /// Radius over the spacing.
        radius: Real,
    },
    /// Gates in another scheme.
    #[error("gates are for the conjugate scheme: walls of the enhanced one are layers of particles")]
    Gates,
    /// Gates that are too many, normal to several directions, or too near to each other or a wall.
    #[error("gates are at most {}, normal to one direction, and keep {:.3} mm from each other and from walls", crate::gates::MOST_GATES, 1e3 * room)]
    GatesTooNear {
        /// Least distance \[m].
        room: Real,
    },
}
