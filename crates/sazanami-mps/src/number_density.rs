//! Sums over the neighbours of each particle: number density, its rate, viscosity, asymmetry.
//!
//! Every particle counts with its bulk volume, that is with `1/eps`, so that in a bed and in clear water the same
//! number density n0 is aimed at.

use sazanami_numerics::{Real, Vector};
use sazanami_parallel::{Rows, for_each_chunk};

use crate::boundary::WallFriction;
use crate::free_surface::COMPANY_RADIUS;
use crate::matrix::Block;
use crate::neighbours::{Neighbours, ROWS};
use crate::particles::Kind;
use crate::scheme::{Kernel, for_kernel};
use crate::weight::{LaplacianForm, SAME, Wendland};

/// What the sums look at in a particle, in one line of the cache.
#[derive(Clone, Copy, Debug, Default)]
#[repr(C, align(64))]
pub(crate) struct Sample {
    /// Place [m].
    position: Vector,
    /// `1/eps`.
    bulk: Real,
    /// Velocity that counts for the change of volume [m/s].
    velocity: Vector,
    /// Rate of `1/eps` along the particle [1/s].
    bulk_rate: Real,
}

impl Sample {
    /// What a neighbour `apart` from here [m] adds to the rate of compression, not yet divided by
    /// [`Calibration::strain`](crate::weight::Calibration).
    #[inline(always)]
    fn compression_by(&self, other: &Self, apart: Vector, weight: Real, slope_over_distance: Real) -> Real {
        let stretch = (other.velocity - self.velocity).dot(apart);
        slope_over_distance * stretch * other.bulk + weight * other.bulk_rate
    }
}

/// Gathers what the sums look at, ghosts included.
pub(crate) fn sample(
    position: &[Vector],
    velocity: &[Vector],
    bulk: &[Real],
    bulk_rate: &[Real],
    into: &mut Vec<Sample>,
) {
    into.resize(position.len(), Sample::default());
    for_each_chunk(&mut into[..], ROWS, |number, into| {
        for (row, sample) in into.iter_mut().enumerate() {
            let a = number * ROWS + row;
            *sample = Sample { position: position[a], bulk: bulk[a], velocity: velocity[a], bulk_rate: bulk_rate[a] };
        }
    });
}

/// Sums at the start of a step.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Crowding {
    /// Number density.
    pub density: Real,
    /// Rate of compression R, about `-div u - eps'/eps` [1/s].
    pub rate: Real,
    /// Laplacian of the velocity [1/(m s)].
    pub laplacian: Vector,
    /// Part of it that comes from walls [1/(m s)].
    pub from_walls: Vector,
}

/// Number density, rate and viscosity of each own particle; `seen` is the velocity that viscosity sees.
pub(crate) fn crowding(
    kernel: &Kernel,
    neighbours: &Neighbours,
    kind: &[Kind],
    samples: &[Sample],
    seen: &[Vector],
    friction: WallFriction,
    into: &mut [Crowding],
) {
    for_kernel!(kernel, crowding_with(kernel, neighbours, kind, samples, seen, friction, into));
}

fn crowding_with<const C4: bool, const CLASSICAL: bool>(
    kernel: &Kernel,
    neighbours: &Neighbours,
    kind: &[Kind],
    samples: &[Sample],
    seen: &[Vector],
    friction: WallFriction,
    into: &mut [Crowding],
) {
    let sums = &kernel.sums;
    neighbours.set(into, |a, near| {
        let (weight, form) = kernel.pair::<C4, CLASSICAL>();
        let square = weight.radius * weight.radius;
        let (mine, s) = (samples[a], seen[a]);
        // Walls do not feel viscosity.
        let viscous = kind[a] == Kind::Fluid;
        let mut density = mine.bulk;
        let mut rate = mine.bulk_rate;
        let (mut laplacian, mut from_walls) = (Vector::ZERO, Vector::ZERO);
        for &b in near {
            let b = b as usize;
            let other = &samples[b];
            let apart = other.position - mine.position;
            let r2 = apart.length_squared();
            if r2 >= square {
                continue;
            }
            let r = r2.sqrt();
            let w = weight.value(r);
            density += w * other.bulk;
            rate += mine.compression_by(other, apart, w, weight.slope_over_distance(r));
            if viscous && (friction == WallFriction::NoSlip || kind[b] == Kind::Fluid) {
                let pull = form.coefficient(&weight, r).0 * other.bulk * (seen[b] - s);
                laplacian += pull;
                if kind[b] != Kind::Fluid {
                    from_walls += pull;
                }
            }
        }
        let (laplacian, from_walls) = (laplacian / sums.laplacian, from_walls / sums.laplacian);
        Crowding { density, rate: rate / sums.strain, laplacian, from_walls }
    });
}

/// Rate of compression of wall particle `a` by those among its neighbours `near` that `count` [1/s]; other wall particles,
/// listed or not, move with it and add nothing.
pub(crate) fn rate_by(
    kernel: &Kernel,
    samples: &[Sample],
    a: usize,
    near: &[u32],
    counts: impl Fn(usize) -> bool,
) -> Real {
    let mine = &samples[a];
    let mut rate = mine.bulk_rate;
    for b in near.iter().map(|&b| b as usize).filter(|&b| counts(b)) {
        let apart = samples[b].position - mine.position;
        let r = apart.length();
        let weight = &kernel.weight;
        rate += mine.compression_by(&samples[b], apart, weight.value(r), weight.slope_over_distance(r));
    }
    rate / kernel.sums.strain
}

/// Sums at the predicted places.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Prediction {
    /// Number density.
    pub density: Real,
    /// Rate of compression [1/s].
    pub rate: Real,
    /// Sum of weights times directions.
    pub asymmetry: Vector,
    /// Sum of the pressure equation's coefficients times distances [1/m]: zero where neighbours are complete.
    pub lean: Vector,
    /// Fluid neighbours within 2.1 spacings.
    pub company: u32,
    /// Fluid neighbours.
    pub wet: u32,
}

/// Sums of each own particle at its predicted place, and its coefficients in the pressure equation.
///
/// Those are `f_ij beta_ij/(eps_i eps_j N2)` with the mean `beta_ij` of `eps + mobile`: the operator
/// `div((eps + mobile) grad p)/eps` for fluid in the voids and grains that give way.
#[allow(clippy::too_many_arguments, reason = "columns in, columns out")]
pub(crate) fn prediction(
    kernel: &Kernel,
    spacing: Real,
    neighbours: &Neighbours,
    kind: &[Kind],
    samples: &[Sample],
    conductance: &[Real],
    blocks: &mut [Block],
    into: &mut [Prediction],
) {
    for_kernel!(kernel, prediction_with(kernel, spacing, neighbours, kind, samples, conductance, blocks, into));
}

#[allow(clippy::too_many_arguments, reason = "columns in, columns out")]
fn prediction_with<const C4: bool, const CLASSICAL: bool>(
    kernel: &Kernel,
    spacing: Real,
    neighbours: &Neighbours,
    kind: &[Kind],
    samples: &[Sample],
    conductance: &[Real],
    blocks: &mut [Block],
    into: &mut [Prediction],
) {
    let sums = &kernel.sums;
    let close = (COMPANY_RADIUS * spacing) * (COMPANY_RADIUS * spacing);
    let half = 0.5 / sums.laplacian;
    for_each_chunk((blocks, Rows { data: into, width: ROWS }), 1, |number, (block, into)| {
        let (weight, form) = kernel.pair::<C4, CLASSICAL>();
        let square = weight.radius * weight.radius;
        let (close, half) = (close, half);
        let block = &mut block[0];
        let lists = &neighbours.blocks()[number];
        // No shorter than the lists, and no longer than they ever were.
        for column in [&mut block.columns, &mut block.close] {
            column.resize(column.len().max(lists.len()), 0);
        }
        block.coefficients.resize(block.columns.len(), 0.0);
        let (mut end, mut close_end, mut cuts) = (0, 0, 0);
        for (row, entry) in into.data.iter_mut().enumerate() {
            *entry = Prediction::default();
            let near = lists.of(row);
            let a = number * ROWS + row;
            if !near.is_empty() {
                let (mine, conductance_a) = (samples[a], conductance[a]);
                let mut sum = Prediction { density: mine.bulk, rate: mine.bulk_rate, ..Prediction::default() };
                for &column in near {
                    let b = column as usize;
                    let other = &samples[b];
                    let apart = other.position - mine.position;
                    let r2 = apart.length_squared();
                    if r2 >= square {
                        continue;
                    }
                    let r = r2.sqrt();
                    let value = weight.value(r);
                    let w = value * other.bulk;
                    sum.density += w;
                    sum.rate += mine.compression_by(other, apart, value, weight.slope_over_distance(r));
                    sum.asymmetry += (w / r.max(SAME)) * apart;
                    let (f, cut) = form.coefficient(&weight, r);
                    let c = f * half * (conductance_a + conductance[b]) * (mine.bulk * other.bulk);
                    sum.lean += c * apart;
                    let part = kind[b] != Kind::Dummy;
                    let fluid = kind[b] == Kind::Fluid;
                    sum.wet += u32::from(fluid);
                    sum.company += u32::from(fluid & (r2 < close));
                    cuts += usize::from(cut & part);
                    block.columns[end] = column;
                    block.coefficients[end] = c as f32;
                    end += usize::from(part);
                    block.close[close_end] = column;
                    close_end += usize::from(part & (r2 < close));
                }
                sum.rate /= sums.strain;
                *entry = sum;
            }
            block.end_row(row, end, close_end);
        }
        block.cut = cuts;
    });
}
