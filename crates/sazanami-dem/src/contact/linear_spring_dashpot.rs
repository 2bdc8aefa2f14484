//! The contact law by itself, a linear spring and dashpot (Yagyu et al. (2015), eqs. (4)-(6)): its springs and dashpots, and the
//! limits that follow from them.
//!
//! With `n` from body i to body j, `v_r` the velocity of j relative to i at the contact point, `d_n` the overlap and
//! `d_t` the tangential displacement, the force on i is `h_n + h_t` with
//!
//! ```text
//! h_n = -K_n d_n n + D_n v_n,    h_t = K_t d_t + D_t v_t
//! ```
//!
//! `K_n`, `D_n`, `K_t` and `D_t` are constants of the two materials and masses. The printed sign of `D_t` would feed energy
//! in; it is `+` here because `d_t` grows with `v_t`. Tension, friction, rotation of the displacement and rolling are in
//! [`super::force`].

use std::fmt::{Display, Formatter, Result};

use sazanami_numerics::Real;

use crate::lanes::Lanes;
use crate::material::TangentialForce;

/// Dashpot of a contact.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Damping {
    /// Coefficients as they stand [N s/m].
    Literal {
        /// Normal coefficient `D_n` [N s/m].
        normal: Real,
        /// Tangential coefficient `D_t` [N s/m].
        tangential: Real,
    },
    /// From the restitution coefficient of a central impact and the reduced mass of the two grains
    /// (Kawaguchi et al., 1992): `D = 2 gamma sqrt(m K)`.
    Restitution(
        /// Restitution coefficient, above 0 and at most 1.
        Real,
    ),
    /// The normal dashpot as with `Restitution`, the tangential one a multiple of it.
    RestitutionAndRatio {
        /// Restitution coefficient, above 0 and at most 1.
        restitution: Real,
        /// Tangential coefficient over the normal one, `D_t/D_n`.
        tangential: Real,
    },
}

/// A linear spring and dashpot with Coulomb friction.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LinearSpringDashpot {
    /// Normal stiffness `K_n` [N/m].
    pub normal_stiffness: Real,
    /// Tangential stiffness `K_t` [N/m].
    pub tangential_stiffness: Real,
    /// Dashpots.
    pub damping: Damping,
    /// Friction coefficient, static and kinetic.
    pub friction: Real,
    /// Whether the dashpot may pull the grains together when they part.
    pub tension: bool,
    /// How the tangential force comes about.
    pub tangential_force: TangentialForce,
    /// Coefficient of the largest torque against rolling of bodies with one contact sphere, in units of normal force and effective radius; 0: none.
    pub rolling_friction: Real,
}

impl LinearSpringDashpot {
    /// Dashpots of the paper's sand [N s/m].
    pub const SAND_DASHPOT: Real = 2.95e-3;
    /// The law of the paper's sand: 1e4 N/m, 2.95e-3 N s/m, 0.6, without tension.
    pub const SAND: Self = Self {
        normal_stiffness: 1.0e4,
        tangential_stiffness: 1.0e4,
        damping: Damping::Literal { normal: Self::SAND_DASHPOT, tangential: Self::SAND_DASHPOT },
        friction: 0.6,
        tension: false,
        tangential_force: TangentialForce::FromTouch,
        rolling_friction: 0.0,
    };

    /// The law of Tazaki et al.'s spheres: without tension, `K_t/K_n = D_t/D_n = 2/7`. With this ratio the
    /// tangential half period of a solid sphere is that of the normal spring. `normal_stiffness` [N/m].
    #[must_use]
    pub const fn spheres(normal_stiffness: Real, restitution: Real, friction: Real) -> Self {
        Self {
            normal_stiffness,
            tangential_stiffness: 2.0 / 7.0 * normal_stiffness,
            damping: Damping::RestitutionAndRatio { restitution, tangential: 2.0 / 7.0 },
            friction,
            ..Self::SAND
        }
    }

    /// Whether every choice is the usual one, for which shorter formulas suffice.
    pub(crate) fn plain(&self) -> bool {
        !self.tension && self.tangential_force == TangentialForce::FromTouch && self.rolling_friction == 0.0
    }

    /// Normal and tangential stiffness [N/m]: the contact sub-step must resolve them.
    #[must_use]
    pub fn stiffness(&self) -> [Real; 2] {
        [self.normal_stiffness, self.tangential_stiffness]
    }

    /// Normal and tangential dashpot of contacts of grains of reduced mass `mass` \[kg] [N s/m].
    #[must_use]
    pub fn damping(&self, mass: Real) -> [Real; 2] {
        let (dashpots, by_mass) = self.dashpots();
        let root = if by_mass { mass.sqrt() } else { 1.0 };
        dashpots.map(|dashpot| root * dashpot)
    }

    /// Coefficient of restitution of a central impact of two grains of reduced mass `mass` \[kg].
    #[must_use]
    pub fn restitution(&self, mass: Real) -> Real {
        restitution(self.damping(mass)[0] / (2.0 * (mass * self.normal_stiffness).sqrt()), self.tension)
    }

    /// Whether dashpots are proportional to the square root of the reduced mass.
    pub(crate) fn damped_by_mass(&self) -> bool {
        !matches!(self.damping, Damping::Literal { .. })
    }

    /// The same law without friction and without resistance to rolling.
    #[must_use]
    pub fn without_friction(self) -> Self {
        Self { friction: 0.0, rolling_friction: 0.0, ..self }
    }

    /// The same law with its friction coefficient times `factor`.
    #[must_use]
    pub fn with_friction_times(self, factor: Real) -> Self {
        Self { friction: factor * self.friction, ..self }
    }

    /// The same law with its stiffness times `factor`, and the same restitution.
    #[must_use]
    pub fn with_stiffness_times(mut self, factor: Real) -> Self {
        self.normal_stiffness *= factor;
        self.tangential_stiffness *= factor;
        if let Damping::Literal { normal, tangential } = &mut self.damping {
            *normal *= factor.sqrt();
            *tangential *= factor.sqrt();
        }
        self
    }

    /// Dashpots `(D_n, D_t)` of this law, and whether they are still to be multiplied by the square
    /// root of the reduced mass.
    fn dashpots(&self) -> ([Real; 2], bool) {
        match self.damping {
            Damping::Literal { normal, tangential } => ([normal, tangential], false),
            Damping::Restitution(e) => {
                let gamma = damping_ratio(e, self.tension);
                let of = |stiffness: Real| 2.0 * gamma * stiffness.sqrt();
                ([of(self.normal_stiffness), of(self.tangential_stiffness)], true)
            }
            Damping::RestitutionAndRatio { restitution, tangential } => {
                let normal = 2.0 * damping_ratio(restitution, self.tension) * self.normal_stiffness.sqrt();
                ([normal, tangential * normal], true)
            }
        }
    }
}

impl Display for LinearSpringDashpot {
    fn fmt(&self, f: &mut Formatter<'_>) -> Result {
        let short = |value: Real| format!("{value:.3e}").parse::<Real>().unwrap_or(value);
        write!(f, "stiffness {} N/m, ", short(self.normal_stiffness))?;
        match self.damping {
            Damping::Literal { normal, .. } => write!(f, "dashpot {} N s/m", short(normal))?,
            Damping::Restitution(restitution) | Damping::RestitutionAndRatio { restitution, .. } => {
                write!(f, "restitution {restitution}")?;
            }
        }
        write!(f, ", friction {}", self.friction)
    }
}

/// Restitution coefficient of a linear spring and dashpot with damping ratio `gamma`.
///
/// With tension the contact lasts half a period; without, it ends when the force vanishes.
#[must_use]
pub fn restitution(gamma: Real, tension: bool) -> Real {
    let square = 1.0 - gamma * gamma;
    let s = square.abs().sqrt().max(1e-8);
    let phase = match (tension, square > 0.0) {
        (true, true) => std::f64::consts::PI,
        (false, true) => std::f64::consts::PI - (2.0 * gamma * s).atan2(s * s - gamma * gamma),
        // Overdamped: with tension the grains never part.
        (true, false) => return 0.0,
        (false, false) => (2.0 * gamma * s / (gamma * gamma + s * s)).atanh(),
    };
    (-(gamma / s) * phase).exp()
}

/// Damping ratio that gives the restitution coefficient `e` (0 < e <= 1).
#[must_use]
pub fn damping_ratio(e: Real, tension: bool) -> Real {
    let logarithm = e.ln();
    let with_tension = -logarithm / (std::f64::consts::PI.powi(2) + logarithm * logarithm).sqrt();
    if tension || e >= 1.0 {
        return with_tension.max(0.0);
    }
    // Without tension restitution falls monotonically with gamma, from 1 at 0.
    let (mut low, mut high) = (0.0, 1e3);
    for _ in 0..100 {
        let middle = 0.5 * (low + high);
        if restitution(middle, false) > e { low = middle } else { high = middle }
    }
    0.5 * (low + high)
}

/// Constants of a pair of materials.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Constants {
    normal_stiffness: Real,
    tangential_stiffness: Real,
    /// One over the tangential stiffness; 0 if there is none.
    tangential_compliance: Real,
    normal_damping: Real,
    tangential_damping: Real,
}

impl Constants {
    /// Those of a law.
    pub fn of(law: &LinearSpringDashpot) -> Self {
        let ([normal_damping, tangential_damping], _) = law.dashpots();
        let k = law.tangential_stiffness;
        Self {
            normal_stiffness: law.normal_stiffness,
            tangential_stiffness: k,
            tangential_compliance: if k > 0.0 { 1.0 / k } else { 0.0 },
            normal_damping,
            tangential_damping,
        }
    }

    /// Elastic energy of the normal and of the tangential spring \[J] at an overlap and a tangential displacement \[m].
    pub fn energy(&self, overlap: Real, stretch: Real) -> [Real; 2] {
        [0.5 * (self.normal_stiffness * overlap * overlap), 0.5 * self.tangential_stiffness * (stretch * stretch)]
    }
}

/// Springs and dashpots of `W` contacts.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Springs<const W: usize> {
    /// `K_n` [N/m].
    pub normal_stiffness: Lanes<W>,
    /// `D_n` [N s/m].
    pub normal_damping: Lanes<W>,
    /// `K_t` [N/m].
    pub tangential_stiffness: Lanes<W>,
    /// `1/K_t`, 0 without a tangential spring [m/N].
    pub tangential_compliance: Lanes<W>,
    /// `D_t` [N s/m].
    pub tangential_damping: Lanes<W>,
}

impl<const W: usize> Springs<W> {
    /// Constants by lane, each with a factor on its dashpots: the root of the reduced mass [kg^(1/2)] or 1.
    #[inline(always)]
    pub fn from_fn<'a>(of: impl Fn(usize) -> (&'a Constants, Real)) -> Self {
        let lanes = |f: fn(&Constants, Real) -> Real| {
            Lanes::from_fn(|l| {
                let (constants, factor) = of(l);
                f(constants, factor)
            })
        };
        Self {
            normal_stiffness: lanes(|c, _| c.normal_stiffness),
            tangential_stiffness: lanes(|c, _| c.tangential_stiffness),
            tangential_compliance: lanes(|c, _| c.tangential_compliance),
            normal_damping: lanes(|c, f| c.normal_damping * f),
            tangential_damping: lanes(|c, f| c.tangential_damping * f),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn damping_ratios_match_the_worked_values() {
        assert!((damping_ratio(0.5, true) - 0.21545).abs() < 5e-6);
        assert!((damping_ratio(0.5, false) - 0.25528).abs() < 5e-6);
        assert!((restitution(0.21545, false) - 0.5503).abs() < 1e-4);
        assert_eq!(damping_ratio(1.0, false), 0.0);
        let ([normal, tangential], by_mass) = LinearSpringDashpot::spheres(400.0, 0.5, 0.4).dashpots();
        assert!((normal - 2.0 * 0.25528 * 20.0).abs() < 2e-4 && by_mass);
        assert!((tangential / normal - 2.0 / 7.0).abs() < 1e-15);
        assert!((restitution(damping_ratio(0.05, false), false) - 0.05).abs() < 1e-9);
    }

    #[test]
    fn without_a_ratio_the_tangential_dashpot_is_that_of_the_root_of_the_stiffnesses() {
        let law = |damping| LinearSpringDashpot { damping, ..LinearSpringDashpot::spheres(400.0, 0.5, 0.4) };
        let given = |tangential| law(Damping::RestitutionAndRatio { restitution: 0.5, tangential }).dashpots().0;
        let found = law(Damping::Restitution(0.5)).dashpots().0;
        let same = |a: [Real; 2]| (0..2).all(|n| (a[n] / found[n] - 1.0).abs() < 1e-14);
        assert!(same(given((2.0_f64 / 7.0).sqrt())));
        // Negative control: the ratio of the stiffnesses themselves is another.
        assert!(!same(given(2.0 / 7.0)));
    }

    #[test]
    fn the_restitution_of_an_impact_follows_from_any_damping() {
        let law = LinearSpringDashpot { damping: Damping::Restitution(0.5), ..LinearSpringDashpot::SAND };
        assert!((law.restitution(1e-6) - 0.5).abs() < 1e-9 && (law.restitution(1e-3) - 0.5).abs() < 1e-9);
        let normal = 2.0 * damping_ratio(0.5, false) * (1e-6 * law.normal_stiffness).sqrt();
        let literal = LinearSpringDashpot { damping: Damping::Literal { normal, tangential: 0.0 }, ..law };
        assert!((literal.restitution(1e-6) - 0.5).abs() < 1e-9);
        assert!(literal.restitution(1e-5) > 0.6, "negative control: a heavier grain is damped less");
    }
}
