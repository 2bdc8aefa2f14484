//! Gusts: what grains feel of turbulence beyond the flow that the particles resolve.
//!
//! With the friction velocity `u = sqrt(nu_t sqrt(2 S:S))` read at a grain, the water there moves by
//! `u (xi_3 - xi_1, xi_2, xi_1)` along the flow, across and upwards beside the flow that is resolved, so that
//! `<u'w'> = -u^2` is the stress that the eddies bear (Maurin et al. 2015, Phys. Fluids 27, 113302). The numbers `xi` of a grain are
//! normal and forgotten over `T = 0.33 l/u`, each as `d xi = -xi dt/T + sqrt(2/T) dW`, with the mixing length `l` of the largest
//! eddies: these carry most of the energy down to the bed, and pass over it in about depth over mean velocity.
//! The noise follows from the identifier of the grain and the number of its steps: the same for any number of threads and ranks, and
//! after a restart.

use std::f64::consts::TAU;

use sazanami_numerics::Random;
use sazanami_numerics::{Real, Vector};

use super::OverlappingGrains;
use super::kept::{GUST, set_vector, vector};
use crate::boundary::Tank;
use crate::context::Context;
use crate::particles::Particles;
use crate::reductions::{for_each_entry, set_column};

/// Time in which a gust is forgotten, over the mixing length of the largest eddies and the friction velocity.
const MEMORY: Real = 0.33;

/// Three normal numbers that follow from the identifier of a grain and the number of its steps (Box and Muller 1958).
fn normal(id: u64, steps: u64) -> Vector {
    let mut random = Random::new(Random::new(id).bits() ^ steps);
    let mut one = || (-2.0 * (1.0 - random.unit()).ln()).sqrt() * (TAU * random.unit()).cos();
    Vector::new(one(), one(), one())
}

/// The velocity of a gust [m/s] of numbers `xi` in a flow that goes along `flow` over the walls, of this friction velocity [m/s].
fn gust(xi: Vector, flow: Vector, friction_velocity: Real) -> Vector {
    let along = Vector::new(flow.x, flow.y, 0.0).normalize_or(Vector::X);
    friction_velocity * ((xi.z - xi.x) * along + xi.y * Vector::Z.cross(along) + xi.x * Vector::Z)
}

impl OverlappingGrains {
    /// Gusts at the own grains after the fluid was interpolated there; the square of the friction velocity at each particle
    /// and ghost [m^2/s^2] is the first component of `eddies`, the mixing length of the largest ones `longest` \[m].
    pub(crate) fn add_gusts(
        &mut self,
        step: &Context<'_>,
        tank: &Tank,
        particles: &Particles,
        inverse_void: &[Real],
        (eddies, longest): (&[Vector], Real),
    ) {
        if !self.is_active() {
            return;
        }
        self.read_anew(step, particles, inverse_void, |a| eddies[a]);
        let mut readings = std::mem::take(&mut self.readings);
        let grains = self.engine.grains();
        set_column(&mut readings, grains.owned(), |g| self.reading(tank, grains.position[g]));
        self.readings = readings;
        let Self { engine, around, readings, places, .. } = self;
        let (grains, readings) = (engine.grains(), &readings[..]);
        let owned = grains.owned();
        set_column(places, owned, |g| {
            let last = vector(&grains.attached[g], GUST);
            let square = readings[g].velocity.x / readings[g].share;
            if !(square > 0.0 && longest > 0.0) {
                return last;
            }
            let kept = (-step.dt * square.sqrt() / (MEMORY * longest)).exp();
            kept * last + (1.0 - kept * kept).sqrt() * normal(grains.id[g], grains.attached[g][GUST + 3] as u64)
        });
        let numbers = &places[..];
        for_each_entry(&mut around[..owned], |g, around| {
            let square = readings[g].velocity.x / readings[g].share;
            if square > 0.0 {
                around.gust = gust(numbers[g], around.velocity - step.forcing.wall_velocity, square.sqrt());
            }
        });
        for_each_entry(&mut engine.attached_mut()[..owned], |g, kept| {
            set_vector(kept, GUST, numbers[g]);
            kept[GUST + 3] += 1.0;
        });
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn gusts_bear_the_stress_of_the_eddies() {
        let (flow, u, steps) = (Vector::new(0.3, -0.4, 0.1), 0.05, 200_000_u32);
        let mut xi = Vector::ZERO;
        let mut sums = [0.0; 5];
        let along = Vector::new(0.6, -0.8, 0.0);
        for n in 0..steps {
            xi = 0.5 * xi + (0.75_f64).sqrt() * normal(7, n.into());
            let gust = gust(xi, flow, u);
            let (a, w) = (gust.dot(along), gust.z);
            let across = gust.dot(Vector::Z.cross(along));
            [a * w, a * a, across * across, w * w, a].iter().zip(&mut sums).for_each(|(one, sum)| *sum += one);
        }
        let [stress, streamwise, across, upwards, mean] = sums.map(|sum| sum / Real::from(steps));
        let over = |value: Real| value / (u * u);
        assert!((over(stress) + 1.0).abs() < 0.03, "{}", over(stress));
        assert!((over(streamwise) - 2.0).abs() < 0.05, "{}", over(streamwise));
        assert!((over(across) - 1.0).abs() < 0.03 && (over(upwards) - 1.0).abs() < 0.03);
        assert!(mean.abs() < 0.02 * u, "{mean}");
        // Negative control: the other way the stress is that of a flow turned round.
        assert!((gust(xi, -flow, u).dot(along) + gust(xi, flow, u).dot(along)).abs() < 1e-12);
        // Another grain has other gusts.
        assert_ne!(normal(7, 3), normal(8, 3));
        assert_ne!(normal(7, 2), normal((1 << 32) + 7, 3), "the same number in another population");
    }
}
