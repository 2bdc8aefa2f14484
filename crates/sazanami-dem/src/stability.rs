//! The limit on the contact sub-step, the one authority that the engine, `check` and `feasible` ask.
//!
//! A contact of stiffness `K` between grains of effective mass `m*` oscillates with half period `pi sqrt(m*/K)`. A force
//! off the centre of mass also turns a grain: at its contact point a grain of mass `m` has the effective mass `m/l` with
//! the leverage `l` of [`Body::leverage`], which is 1 along and 3.5 across the normal for a ball. A liquid film damps at the
//! rate `D/m*`, `D` the coefficient of [`crate::Film`] at the roughness.

use std::f64::consts::PI;

use sazanami_numerics::Real;
use sazanami_numerics::domain::Domain;

use crate::body::Body;
use crate::contact::laws::Interactions;
use crate::film::Film;

/// Longest sub-step times the rate `D/m*` at which a film brings a ball to rest at a wall, at the roughness. A grain among twelve
/// equal ones is stable up to twice this.
const FILM_FACTOR: Real = 0.15;

/// The smallest effective masses at contact points of the grains of each material.
#[derive(Clone, Debug, PartialEq)]
pub struct EffectiveMasses {
    /// Largest reciprocal of the effective mass along and across the normal, by material; 0: no grain [1/kg].
    inverse: Vec<[Real; 2]>,
    /// Largest radius of a contact sphere, by material \[m].
    radius: Vec<Real>,
    /// Largest square of that of a grain over its mass, by material [m^2/kg].
    square: Vec<Real>,
}

impl EffectiveMasses {
    /// No grains yet, of any of `materials` materials.
    #[must_use]
    pub fn new(materials: usize) -> Self {
        Self { inverse: vec![[0.0; 2]; materials], radius: vec![0.0; materials], square: vec![0.0; materials] }
    }

    /// Takes a grain into account that forces move: its body times `scale`, with its `mass` \[kg].
    ///
    /// # Panics
    /// If there is no such material.
    pub fn add(&mut self, body: &Body, scale: Real, mass: Real, material: u32) {
        let radius = body.radii.iter().copied().fold(0.0, Real::max) * scale;
        let largest = &mut self.radius[material as usize];
        *largest = largest.max(radius);
        let square = &mut self.square[material as usize];
        *square = square.max(radius * radius / mass);
        let leverage = body.leverage();
        let worst = &mut self.inverse[material as usize];
        (0..2).for_each(|d| worst[d] = worst[d].max(leverage[d] / mass));
    }

    /// Takes the grains of all ranks into account.
    pub fn over_ranks(&mut self, domain: &Domain) {
        for value in self.inverse.iter_mut().flatten().chain(&mut self.radius).chain(&mut self.square) {
            *value = domain.max(*value);
        }
    }

    /// Longest sub-step that resolves every contact of these grains with each other and with walls of any of the
    /// materials, [`crate::ContactStart::substep_factor`] times `pi sqrt(m*/K)`, and the film between
    /// them \[s]; infinite without grains.
    #[must_use]
    pub fn longest_substep(&self, interactions: &Interactions) -> Real {
        let materials = interactions.materials();
        let mut longest = Real::INFINITY;
        for a in 0..materials {
            for b in 0..materials {
                // A wall has no curvature: the effective radius of a contact is at most that of its larger sphere.
                let radius = self.radius[a].max(self.radius[b]);
                let law = interactions.law(a as u32, b as u32);
                let [normal, tangential] = law.stiffness(radius);
                let sum = |d: usize| self.inverse[a][d] + self.inverse[b][d];
                let square = Real::max(normal * sum(0), tangential * sum(1));
                if square > 0.0 {
                    longest = longest.min(law.options().contact_start.substep_factor() * PI / square.sqrt());
                }
                // R*^2/m* of two spheres is at most the larger R^2/m, which is that at a wall.
                let damping = interactions.film().map_or(0.0, Film::largest_damping);
                let rate = damping * self.square[a].max(self.square[b]);
                if rate > 0.0 {
                    longest = longest.min(FILM_FACTOR / rate);
                }
            }
        }
        longest
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::contact::linear_spring_dashpot::LinearSpringDashpot;
    use crate::material::ContactStart;

    #[test]
    fn two_balls_are_limited_by_their_tangential_spring() {
        let law = LinearSpringDashpot { normal_stiffness: 1e4, tangential_stiffness: 1e4, ..LinearSpringDashpot::SAND };
        let mut masses = EffectiveMasses::new(1);
        assert_eq!(masses.longest_substep(&Interactions::uniform(1, law)), Real::INFINITY);
        masses.add(&Body::ball(1e-3), 1.0, 2e-6, 0);
        let expected = 0.075 * PI * (2e-6 / (2.0 * 3.5 * 1e4_f64)).sqrt();
        let found = masses.longest_substep(&Interactions::uniform(1, law));
        assert!((found / expected - 1.0).abs() < 1e-12, "{found} {expected}");
        let softer = LinearSpringDashpot { tangential_stiffness: 1e3, ..law };
        let found = masses.longest_substep(&Interactions::uniform(1, softer));
        assert!((found / (expected * 3.5_f64.sqrt()) - 1.0).abs() < 1e-12, "then by the normal one: {found}");
        let from_the_sub_step = LinearSpringDashpot { contact_start: ContactStart::SubStep, ..law };
        let found = masses.longest_substep(&Interactions::uniform(1, from_the_sub_step));
        assert!((found / expected - 0.057 / 0.075).abs() < 1e-12, "{found} {expected}");
    }
}
