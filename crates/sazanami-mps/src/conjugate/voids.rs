//! Water between grains: weights of pairs by bulk volume, and rates of the void fraction.
//!
//! A particle has the bulk volume `1/eps` and the size `eps^(-1/3)` in those of clear water. Radii grow with the mean size
//! of a pair, and `g_ij` with the mean of `1/eps`, so that `B` is `eps` in a uniform bed. `D_i u = sum (eps_j u_j - eps_i
//! u_i).B_i g_ij/eps_i` is then `div(eps u)/eps`, and its transpose `G_i p = eps_i sum (B_i p_i/eps_i + B_j p_j/eps_j) g_ij` is
//! `grad p`; over `eps_i` it is a force between particles that are both fluid and grains.

use sazanami_numerics::Real;
use sazanami_parallel::for_each_chunk;

use crate::arrangement::Arrangement;
use crate::boundary::Tank;
use crate::context::{Context, Motion, Voids};
use crate::grains::{OverlappingGrains, VoidReport};
use crate::neighbours::ROWS;
use crate::number_density;
use crate::particles::Particles;
use crate::reductions::set_column;

/// Weights of particles and pairs, ghosts included: 1 in clear water.
#[derive(Clone, Copy)]
pub(crate) struct Bulk<'a> {
    /// Whether there is no grain, so that nothing needs to be looked up.
    pub clear: bool,
    /// `1/eps`.
    pub inverse_void: &'a [Real],
    /// `eps^(-1/3)`: distance between particles over the spacing of clear water.
    pub size: &'a [Real],
    /// `eps + (1 - eps) rho/rho_s` where grains give way to the pressure, `eps` elsewhere.
    pub mobility: &'a [Real],
}

impl Bulk<'_> {
    /// Spacing of clear water over the size of a pair, by which distances are scaled.
    #[inline(always)]
    pub fn narrowing(&self, a: usize, b: usize) -> Real {
        if self.clear { 1.0 } else { 2.0 / (self.size[a] + self.size[b]) }
    }

    /// Of `g`, over that of the compact matrix.
    #[inline(always)]
    pub fn share(&self, a: usize, b: usize) -> Real {
        if self.clear { 1.0 } else { 2.0 / (self.mobility[a] + self.mobility[b]) }
    }

    /// Of the compact matrix, the same from both ends.
    #[inline(always)]
    pub fn pair(&self, a: usize, b: usize) -> Real {
        if self.clear {
            return 1.0;
        }
        0.25 * (self.mobility[a] + self.mobility[b]) * (self.inverse_void[a] + self.inverse_void[b])
    }

    /// Of a neighbour in the drift of shifting: the mean bulk volume of the pair over that of `a`. Without it the drift of water
    /// as it should be, of number density `eps/l0^3`, is `-(1/2) grad ln eps`, into the bed; with it none to first order. See
    /// docs/theory/mps.md.
    #[inline(always)]
    pub fn crowd(&self, a: usize, b: usize) -> Real {
        if self.clear { 1.0 } else { 0.5 * (1.0 + self.ratio(b, a)) }
    }

    /// `eps_b/eps_a`.
    #[inline(always)]
    pub fn ratio(&self, a: usize, b: usize) -> Real {
        if self.clear { 1.0 } else { self.inverse_void[a] / self.inverse_void[b] }
    }

    /// Sum of the compact matrix in a uniform bed over that in clear water: motion of fluid and grains under a pressure over
    /// that of the fluid alone.
    #[inline(always)]
    pub fn own(&self, a: usize) -> Real {
        self.mobility[a] * self.inverse_void[a]
    }
}

/// Void fractions at the start of the step, and what they are where fluid and grains move without the new pressure.
#[derive(Debug, Default)]
pub(crate) struct VoidColumns {
    pub start: Voids,
    clear: bool,
    size: Vec<Real>,
    pub mobility: Vec<Real>,
    then: Voids,
    /// `(D eps/Dt)/eps` of each own particle with its velocity at the start of the step, for grains in their motion without
    /// the new pressure [1/s].
    pub rate: Vec<Real>,
}

impl VoidColumns {
    pub fn bulk(&self) -> Bulk<'_> {
        Bulk { clear: self.clear, inverse_void: &self.start.inverse, size: &self.size, mobility: &self.mobility }
    }

    /// Void fractions at the start of the step.
    pub fn at_start(
        &mut self,
        step: &Context<'_>,
        tank: &Tank,
        particles: &Particles,
        near: &mut Arrangement,
        grains: &mut OverlappingGrains,
    ) -> VoidReport {
        let now = (&particles.position[..], &particles.velocity[..]);
        let found = grains.void_fractions(step, tank, particles, now, &mut near.ghosts, &mut self.start);
        self.prepare(particles.owned, grains.is_empty());
        found
    }

    /// Columns that follow from the void fractions at the start; rates of `owned` particles are zero until predicted. It is
    /// `clear` water if there is no grain.
    pub fn prepare(&mut self, owned: usize, clear: bool) {
        self.clear = clear;
        number_density::mobility(&self.start, &mut self.mobility);
        let inverse = &self.start.inverse;
        set_column(&mut self.size, inverse.len(), |a| inverse[a].cbrt());
        self.rate.clear();
        self.rate.resize(owned, 0.0);
    }

    /// Rates at the `predicted` places.
    pub fn predict(
        &mut self,
        step: &Context<'_>,
        tank: &mut Tank,
        particles: &Particles,
        predicted: &Motion,
        grains: &mut OverlappingGrains,
    ) -> VoidReport {
        let Self { then, rate, .. } = self;
        let before = std::mem::replace(&mut tank.displacement, step.forcing.wall_displacement);
        then.clear(particles.owned);
        grains.place(step.domain, tank);
        tank.displacement = before;
        let (cut, least) =
            grains.voids(&particles.kind[..particles.owned], &predicted.position, &particles.velocity, then);
        let then = &*then;
        for_each_chunk(&mut rate[..], ROWS, |number, rate| {
            for (row, rate) in rate.iter_mut().enumerate() {
                let a = number * ROWS + row;
                *rate = -then.inverse_rate[a] / then.inverse[a];
            }
        });
        let cut = step.domain.sum([cut as Real])[0] as usize;
        VoidReport { cut, least: step.domain.min(least) }
    }
}
