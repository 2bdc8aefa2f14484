//! Contact laws between materials (Yagyu et al. (2015), eqs. (4)-(6)).

use sazanami_numerics::Real;
use sazanami_numerics::choices;

/// How the dashpot of a contact is given.
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
    /// What the turning of the normal does to the tangential displacement.
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
    /// What several simultaneous sphere contacts of one pair of grains add up to.
    #[derive(Default)]
    pub enum Multiplicity {
        /// All of them act in full.
        #[default]
        Sum = "sum",
        /// Stiffness and damping are divided by their number.
        Average = "average",
        /// Only the deepest acts.
        Deepest = "deepest",
    }
}

/// The contact law of a pair of materials.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ContactLaw {
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
    /// Direction of friction in slip.
    pub slip_direction: SlipDirection,
    /// Turning of the tangential displacement with the normal.
    pub history: HistoryRotation,
    /// Effect of several sphere contacts in one pair of grains.
    pub multiplicity: Multiplicity,
    /// Coefficient of a constant torque against rolling, in units of the effective radius; 0: none.
    pub rolling_friction: Real,
}

impl ContactLaw {
    /// The law of the paper's sand: 1e4 N/m, 2.95e-3 N s/m, 0.6, without tension.
    pub const SAND: Self = Self {
        normal_stiffness: 1.0e4,
        tangential_stiffness: 1.0e4,
        damping: Damping::Literal { normal: 2.95e-3, tangential: 2.95e-3 },
        friction: 0.6,
        tension: false,
        slip_direction: SlipDirection::Force,
        history: HistoryRotation::LengthKept,
        multiplicity: Multiplicity::Sum,
        rolling_friction: 0.0,
    };

    /// The law of spheres with linear springs: without tension, `K_t/K_n = D_t/D_n = 2/7`. With this ratio the
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

    /// Dashpots `(D_n, D_t)` of this law, and whether they are still to be multiplied by the square
    /// root of the reduced mass.
    pub(crate) fn dashpots(&self) -> ([Real; 2], bool) {
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

/// The contact laws of all pairs of materials. Walls are made of a material too.
#[derive(Clone, Debug, PartialEq)]
pub struct Interactions {
    materials: usize,
    laws: Vec<ContactLaw>,
}

impl Interactions {
    /// The same law between all of `materials` materials.
    #[must_use]
    pub fn uniform(materials: usize, law: ContactLaw) -> Self {
        Self { materials, laws: vec![law; materials * materials] }
    }

    /// Sets the law between two materials.
    ///
    /// # Panics
    /// If there is no such material.
    pub fn set(&mut self, a: u32, b: u32, law: ContactLaw) {
        for (a, b) in [(a, b), (b, a)] {
            let at = self.index(a, b);
            self.laws[at as usize] = law;
        }
    }

    /// The law between two materials.
    #[must_use]
    pub fn law(&self, a: u32, b: u32) -> &ContactLaw {
        &self.laws[self.index(a, b) as usize]
    }

    /// Number of materials.
    #[must_use]
    pub fn materials(&self) -> usize {
        self.materials
    }

    pub(crate) fn index(&self, a: u32, b: u32) -> u32 {
        a * self.materials as u32 + b
    }

    /// All laws, by [`Self::index`].
    pub(crate) fn laws(&self) -> &[ContactLaw] {
        &self.laws
    }

    /// Changes every friction coefficient by a factor.
    pub fn scale_friction(&mut self, factor: Real) {
        self.laws.iter_mut().for_each(|law| law.friction *= factor);
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
        let ([normal, tangential], by_mass) = ContactLaw::spheres(400.0, 0.5, 0.4).dashpots();
        assert!((normal - 2.0 * 0.25528 * 20.0).abs() < 2e-4 && by_mass);
        assert!((tangential / normal - 2.0 / 7.0).abs() < 1e-15);
        assert!((restitution(damping_ratio(0.05, false), false) - 0.05).abs() < 1e-9);
    }
}
