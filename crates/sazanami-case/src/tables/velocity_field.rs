//! `[fluid.initial_velocity]` and `[fluid.carrying_flow]`: velocity fields given by formulas over the whole box of edges
//! L1, L2, L3, with x1, x2, x3 from its lower corner.

use std::f64::consts::PI;

use sazanami_case_derive::{Keys, keys_of};
pub use sazanami_mics::carrying::CarryingFlow;
use sazanami_numerics::{Real, Vector};

use super::BoxDomain;

/// Velocity at the start.
#[derive(Clone, Copy, Debug, PartialEq, Keys)]
pub enum InitialVelocity {
    /// The same everywhere.
    Uniform {
        /// Velocity.
        #[key(unit = "m/s")]
        velocity: Vector,
    },
    /// Rotation as a rigid body.
    Rotation {
        /// A point of the axis.
        #[key(unit = "m")]
        centre: Vector,
        /// Angular velocity.
        #[key(unit = "rad/s")]
        angular_velocity: Vector,
    },
    /// Vortices of Taylor and Green in x1 and x3: stream function `U L1/(2 pi) sin(2 pi x1/L1) sin(2 pi x3/L3)`.
    TaylorGreen {
        /// Largest velocity U along x3.
        #[key(unit = "m/s")]
        speed: Real,
    },
    /// A single vortex in x1 and x3: stream function `U L1/pi sin^2(pi x1/L1) sin^2(pi x3/L3)`.
    Vortex {
        /// Largest velocity U along x3.
        #[key(unit = "m/s")]
        speed: Real,
    },
    /// Plane strain in x1 and x3: `A (x1 - c1)` along x1 and `-A (x3 - c3)` along x3.
    Strain {
        /// A point at rest.
        #[key(unit = "m")]
        centre: Vector,
        /// Rate of strain A.
        #[key(unit = "Hz")]
        rate: Real,
    },
}

impl InitialVelocity {
    /// The velocity at `x` in a box [m/s].
    #[must_use]
    pub fn at(&self, domain: &BoxDomain, x: Vector) -> Vector {
        let extent = domain.extent();
        let place = PI * (x - domain.lower) / extent;
        // u1 = -d psi/d x3, u3 = d psi/d x1.
        let plane = |speed: Real, u1: Real, u3: Real| speed * Vector::new(-extent.x / extent.z * u1, 0.0, u3);
        match *self {
            Self::Uniform { velocity } => velocity,
            Self::Rotation { centre, angular_velocity } => angular_velocity.cross(x - centre),
            Self::Strain { centre, rate } => rate * (x - centre) * Vector::new(1.0, 0.0, -1.0),
            Self::TaylorGreen { speed } => {
                let ([s1, c1], [s3, c3]) = (sin_cos(2.0 * place.x), sin_cos(2.0 * place.z));
                plane(speed, s1 * c3, c1 * s3)
            }
            Self::Vortex { speed } => {
                let ([s1, c1], [s3, c3]) = (sin_cos(place.x), sin_cos(place.z));
                plane(speed, s1 * s1 * 2.0 * s3 * c3, 2.0 * s1 * c1 * s3 * s3)
            }
        }
    }
}

fn sin_cos(angle: Real) -> [Real; 2] {
    [angle.sin(), angle.cos()]
}

/// A flow that carries the liquid and is not solved for.
#[keys_of(CarryingFlow)]
enum CarryingFlow {
    /// The same velocity everywhere.
    Uniform {
        /// Velocity.
        #[key(unit = "m/s")]
        velocity: Vector,
    },
    /// Reversed vortex of Rider & Kothe (1998) in x1 and x3: stream function
    /// `U L1/pi sin^2(pi x1/L1) sin^2(pi x3/L3) cos(pi t/T)`.
    ReversedVortex {
        /// Largest velocity U in a square box.
        #[key(unit = "m/s")]
        speed: Real,
        /// Time T after which all liquid is back.
        #[key(unit = "s", range = Positive)]
        period: Real,
    },
    /// Deformation of LeVeque (1996): `u1 = 2 U sin^2(pi x1/L1) sin(2 pi x2/L2) sin(2 pi x3/L3) cos(pi t/T)`, the others alike
    /// with -1 for 2, and times L2/L1 and L3/L1 in a box that is no cube, so that it stays free of divergence.
    Deformation {
        /// Half the largest velocity along x1.
        #[key(unit = "m/s")]
        speed: Real,
        /// Time T after which all liquid is back.
        #[key(unit = "s", range = Positive)]
        period: Real,
    },
}
