//! The contact laws of all pairs of materials.

use sazanami_numerics::Real;

use super::context::Reach;
use super::force::PairConstants;
use super::linear_spring_dashpot::LinearSpringDashpot;
use crate::body::Body;
use crate::bridge::Bridge;
use crate::film::Film;

/// The contact laws of all pairs of materials. Walls are made of a material too.
#[derive(Clone, Debug, PartialEq)]
pub struct Interactions {
    materials: usize,
    laws: Vec<LinearSpringDashpot>,
    /// Dashpots of each law at a unit of reduced mass: with a coefficient of restitution they take an iteration to find.
    dashpots: Vec<[Real; 2]>,
    film: Option<Film>,
    bridge: Option<Bridge>,
    allowed_error: Option<Real>,
}

impl Interactions {
    /// The same law between all of `materials` materials.
    #[must_use]
    pub fn uniform(materials: usize, law: LinearSpringDashpot) -> Self {
        let count = materials * materials;
        Self {
            materials,
            laws: vec![law; count],
            dashpots: vec![law.damping(1.0); count],
            film: None,
            bridge: None,
            allowed_error: None,
        }
    }

    /// The same laws with a liquid film between spheres that do not touch, or without.
    #[must_use]
    pub fn with_film(self, film: Option<Film>) -> Self {
        Self { film, ..self }
    }

    /// The same laws with liquid bridges between grains, or without.
    #[must_use]
    pub fn with_bridge(self, bridge: Option<Bridge>) -> Self {
        Self { bridge, ..self }
    }

    /// The same laws with sub-steps as long as this mean error of restitution and spin lets them be, or as usual
    /// (see [`crate::stability`]).
    #[must_use]
    pub fn with_allowed_error(self, allowed_error: Option<Real>) -> Self {
        Self { allowed_error, ..self }
    }

    /// Mean error of restitution and spin that sub-steps may bring.
    #[must_use]
    pub fn allowed_error(&self) -> Option<Real> {
        self.allowed_error
    }

    /// The liquid film between spheres.
    #[must_use]
    pub fn film(&self) -> Option<&Film> {
        self.film.as_ref()
    }

    /// The liquid bridges between grains.
    #[must_use]
    pub fn bridge(&self) -> Option<&Bridge> {
        self.bridge.as_ref()
    }

    /// Gap up to which films act.
    pub(crate) fn reach(&self) -> Reach {
        let [over_radius, farthest] = self.film.map_or([0.0; 2], |film| [film.reach, film.farthest]);
        Reach { over_radius, farthest }
    }

    /// How far from its surface something else than a touch may act on a grain, beside another that reaches as far as its own asks \[m].
    #[must_use]
    pub fn margin(&self, body: &Body, scale: Real) -> Real {
        let bridge = self.bridge.map_or(0.0, |bridge| bridge.margin(body.volume_radius * scale));
        // Balls alone have films.
        let film = if body.is_ball() { 0.5 * self.reach().of(body.radii[0] * scale) } else { 0.0 };
        bridge.max(film)
    }

    /// Whether every choice is the usual one, for which shorter formulas suffice.
    pub(crate) fn plain(&self) -> bool {
        self.film.is_none() && self.laws.iter().all(LinearSpringDashpot::plain)
    }

    /// Sets the law between two materials.
    ///
    /// # Panics
    /// If there is no such material.
    pub fn set(&mut self, a: u32, b: u32, law: LinearSpringDashpot) {
        for (a, b) in [(a, b), (b, a)] {
            let at = self.index(a, b);
            self.laws[at as usize] = law;
            self.dashpots[at as usize] = law.damping(1.0);
        }
    }

    /// The law between two materials.
    #[must_use]
    pub fn law(&self, a: u32, b: u32) -> &LinearSpringDashpot {
        &self.laws[self.index(a, b) as usize]
    }

    /// Normal and tangential dashpot by law `index` of grains of reduced mass `mass` \[kg] [N s/m].
    pub(crate) fn dashpots(&self, index: usize, mass: Real) -> [Real; 2] {
        let root = if self.laws[index].damped_by_mass() { mass.sqrt() } else { 1.0 };
        self.dashpots[index].map(|dashpot| root * dashpot)
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
    pub(crate) fn laws(&self) -> &[LinearSpringDashpot] {
        &self.laws
    }

    /// The same ready for evaluation.
    pub(crate) fn constants(&self) -> Vec<PairConstants> {
        self.laws.iter().map(|law| PairConstants::new(law, self.film)).collect()
    }

    /// Changes every stiffness by a factor; restitution stays as it is.
    pub fn scale_stiffness(&mut self, factor: Real) {
        self.laws.iter_mut().for_each(|law| *law = law.with_stiffness_times(factor));
        self.dashpots = self.laws.iter().map(|law| law.damping(1.0)).collect();
    }

    /// The least normal stiffness of any pair [N/m].
    #[must_use]
    pub fn least_stiffness(&self) -> Real {
        self.laws.iter().map(|law| law.normal_stiffness).fold(Real::INFINITY, Real::min)
    }

    /// Changes every friction coefficient by a factor.
    pub fn scale_friction(&mut self, factor: Real) {
        self.laws.iter_mut().for_each(|law| *law = law.with_friction_times(factor));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn softer_springs_have_their_own_dashpots() {
        let mut laws = Interactions::uniform(2, LinearSpringDashpot::SAND);
        let before = laws.dashpots(0, 1e-6);
        laws.scale_stiffness(0.01);
        let found = laws.dashpots(0, 1e-6);
        for (found, before) in found.iter().zip(before) {
            // With the same restitution they go as the root of the stiffness.
            assert!((found / before - 0.1).abs() < 1e-12, "{found} {before}");
        }
    }
}
