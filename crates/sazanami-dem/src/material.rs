//! How the tangential force of a contact comes about.

use sazanami_numerics::Real;
use sazanami_numerics::choices;

choices! {
    /// How the tangential force of a contact comes about, and with it how long a sub-step may be.
    #[derive(Default)]
    pub enum TangentialForce {
        /// The spring grows from the moment in which the spheres touch and keeps its length as the normal turns, the dashpot acts at the
        /// time of the spring, friction along the force of both; `auto` sub-steps of 0.15 pi sqrt(m*/K), less where the error of an
        /// impact would be above 2.5 %, down to 0.075.
        #[default]
        FromTouch = "from_touch",
        /// Eqs. (5) and (6) of Yagyu et al. (2015): the spring grows by whole sub-steps and is projected as the normal turns, friction
        /// along the sliding velocity (along the force below 1e-12 m/s); `auto` sub-steps of 0.057 pi sqrt(m*/K).
        Published = "published",
    }
}

impl TangentialForce {
    /// Least and most that a sub-step takes of the half period `pi sqrt(m*/K)` of the stiffest contact, where no error is asked for.
    #[must_use]
    pub const fn substep_factors(self) -> [Real; 2] {
        match self {
            Self::Published => [0.057; 2],
            Self::FromTouch => [0.075, 0.15],
        }
    }
}
