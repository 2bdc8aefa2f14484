//! Properties that all contact laws have: friction, tension, history of the tangential displacement, rolling.

use sazanami_numerics::Real;
use sazanami_numerics::choices;

choices! {
    /// Direction of the friction force of a contact that slips.
    #[derive(Default)]
    pub enum SlipDirection {
        /// Along the tangential force of spring and dashpot.
        #[default]
        Force = "force",
        /// Along the tangential velocity, as eq. (6) is written; along the force below 1e-12 m/s.
        Velocity = "velocity",
    }
}

choices! {
    /// Tangential displacement as the normal rotates.
    #[derive(Default)]
    pub enum HistoryRotation {
        /// It is projected onto the new tangent plane and keeps its length.
        #[default]
        LengthKept = "length_kept",
        /// It is projected only.
        Projected = "projected",
    }
}

choices! {
    /// From when on the tangential spring of a new contact grows, and with it how long a sub-step may be.
    #[derive(Default)]
    pub enum ContactStart {
        /// From the beginning of the sub-step in which the spheres meet; `auto` sub-steps of 0.057 pi sqrt(m*/K).
        SubStep = "sub_step",
        /// From the moment in which they touch, and the tangential dashpot acts at the time of the spring; `auto` sub-steps of
        /// 0.15 pi sqrt(m*/K), less where the error of an impact would be above 2.5 %, down to 0.075.
        #[default]
        Touch = "touch",
    }
}

impl ContactStart {
    /// Least and most that a sub-step takes of the half period `pi sqrt(m*/K)` of the stiffest contact, where no error is asked for.
    #[must_use]
    pub const fn substep_factors(self) -> [Real; 2] {
        match self {
            Self::SubStep => [0.057; 2],
            Self::Touch => [0.075, 0.15],
        }
    }
}

/// Parameters that every contact law has besides its springs and dashpots.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ContactOptions {
    /// Friction coefficient, static and kinetic.
    pub friction: Real,
    /// Coefficient of a constant torque against rolling, in units of the effective radius; 0: none.
    pub rolling_friction: Real,
    /// Whether the dashpot may pull the grains together when they part.
    pub tension: bool,
    /// Direction of friction in slip.
    pub slip_direction: SlipDirection,
    /// Rotation of the tangential displacement with the normal.
    pub history: HistoryRotation,
    /// Beginning of a contact's tangential spring.
    pub contact_start: ContactStart,
}

impl ContactOptions {
    /// Whether every choice is the usual one, for which shorter formulas suffice.
    pub(crate) fn plain(&self) -> bool {
        !self.tension
            && self.slip_direction == SlipDirection::Force
            && self.history == HistoryRotation::LengthKept
            && self.rolling_friction == 0.0
    }
}
