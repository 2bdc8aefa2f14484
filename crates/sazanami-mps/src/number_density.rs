//! Number density, its rate of change and the other sums over the neighbours of each particle.
//!
//! A neighbour is weighted by its bulk volume, that is by the inverse void fraction `1/eps`, so that the reference
//! number density n0 is the same in a bed and in clear water.

use sazanami_numerics::{Real, Vector};
use sazanami_parallel::{Rows, for_each_chunk};

use crate::context::Voids;
use crate::matrix::{Block, CLOSE_RADIUS};
use crate::neighbours::{Neighbours, ROWS};
use crate::particles::Kind;
use crate::reductions::set_column;
use crate::scheme::Kernel;
use crate::viscosity::{VelocityLaplacian, ViscousField};
use crate::weight::COINCIDENT;

/// The columns of a particle that sums over pairs read, packed into one cache line.
#[derive(Clone, Copy, Debug, Default)]
#[repr(C, align(64))]
pub(crate) struct Sample {
    /// Position \[m].
    position: Vector,
    /// Inverse void fraction `1/eps`.
    inverse_void: Real,
    /// Velocity [m/s].
    velocity: Vector,
    /// Material rate of change of `1/eps` [1/s].
    inverse_void_rate: Real,
}

impl Sample {
    /// Contribution of a neighbour at distance vector `apart` \[m] to the rate of compression, before division by
    /// [`Calibration::strain`](crate::weight::Calibration).
    #[inline(always)]
    fn compression_by(&self, other: &Self, apart: Vector, weight: Real, slope_over_distance: Real) -> Real {
        let stretch = (other.velocity - self.velocity).dot(apart);
        slope_over_distance * stretch * other.inverse_void + weight * other.inverse_void_rate
    }
}

/// Packs the columns, ghosts included.
pub(crate) fn sample((position, velocity): (&[Vector], &[Vector]), voids: &Voids, into: &mut Vec<Sample>) {
    let Voids { inverse, inverse_rate, .. } = voids;
    set_column(into, position.len(), |a| Sample {
        position: position[a],
        inverse_void: inverse[a],
        velocity: velocity[a],
        inverse_void_rate: inverse_rate[a],
    });
}

/// The mobility `eps + (1 - eps) rho/rho_s` of fluid and grains under a pressure gradient, ghosts included.
pub(crate) fn mobility(voids: &Voids, into: &mut Vec<Real>) {
    set_column(into, voids.inverse.len(), |a| 1.0 / voids.inverse[a] + voids.grain_mobility[a]);
}

/// Sums of a particle at the start of a step.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct NumberDensity {
    /// Number density.
    pub density: Real,
    /// Rate of compression R, an approximation of `-div u - (deps/dt)/eps` [1/s].
    pub rate: Real,
    /// Laplacian of the velocity.
    pub laplacian: VelocityLaplacian,
}

/// Number density, its rate and the Laplacian of the velocity at each own particle.
pub(crate) fn at_start(
    kernel: &Kernel,
    neighbours: &Neighbours,
    samples: &[Sample],
    viscous: &ViscousField<'_>,
    into: &mut Vec<NumberDensity>,
) {
    into.resize(neighbours.owned(), NumberDensity::default());
    let sums = &kernel.sums;
    neighbours.set(into, |a, near| {
        let weight = kernel.weight;
        let square = weight.radius * weight.radius;
        let mine = samples[a];
        // Only fluid feels viscosity.
        let is_fluid = viscous.kind[a] == Kind::Fluid;
        let mut density = mine.inverse_void;
        let mut rate = mine.inverse_void_rate;
        let mut laplacian = VelocityLaplacian::default();
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
            density += w * other.inverse_void;
            rate += mine.compression_by(other, apart, w, weight.slope_over_distance(r));
            if is_fluid {
                laplacian.add(viscous, [a, b], weight.laplacian(r).0, other.inverse_void);
            }
        }
        NumberDensity { density, rate: rate / sums.strain, laplacian: laplacian.normalised(sums.laplacian) }
    });
}

/// Rate of compression at wall particle `a` by those of its neighbours `near` for which `counts` holds [1/s]; other wall
/// particles move with it and contribute nothing.
pub(crate) fn rate_by(
    kernel: &Kernel,
    samples: &[Sample],
    a: usize,
    near: &[u32],
    counts: impl Fn(usize) -> bool,
) -> Real {
    let mine = &samples[a];
    let mut rate = mine.inverse_void_rate;
    for b in near.iter().map(|&b| b as usize).filter(|&b| counts(b)) {
        let apart = samples[b].position - mine.position;
        let r = apart.length();
        let weight = &kernel.weight;
        rate += mine.compression_by(&samples[b], apart, weight.value(r), weight.slope_over_distance(r));
    }
    rate / kernel.sums.strain
}

/// Sums of a particle at its predicted position.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Prediction {
    /// Number density.
    pub density: Real,
    /// Rate of compression [1/s].
    pub rate: Real,
    /// Sum of weights times unit vectors to the neighbours.
    pub asymmetry: Vector,
    /// First-moment deficit: sum of the pressure coefficients times distance vectors [1/m]; zero with complete support.
    pub moment_deficit: Vector,
    /// Number of fluid neighbours within 2.1 spacings.
    pub neighbour_count: u32,
    /// Number of fluid neighbours within the radius of influence.
    pub fluid_neighbours: u32,
}

/// Columns of the pairs at the predicted positions, ghosts included.
#[derive(Clone, Copy)]
pub(crate) struct PredictedPairs<'a> {
    pub kind: &'a [Kind],
    pub samples: &'a [Sample],
    /// `eps + (1 - eps) rho/rho_s`.
    pub mobility: &'a [Real],
}

/// Sums of each own particle at its predicted position, and its coefficients in the pressure equation.
///
/// These are `f_ij beta_ij/(eps_i eps_j N2)` with the pair's mean `beta_ij` of the `mobility`
/// `eps + (1 - eps) rho/rho_s`: the operator `div(mobility grad p)/eps` for fluid in the voids of grains that are
/// accelerated by the same pressure gradient.
pub(crate) fn prediction(
    kernel: &Kernel,
    spacing: Real,
    neighbours: &Neighbours,
    pairs: &PredictedPairs<'_>,
    blocks: &mut [Block],
    into: &mut Vec<Prediction>,
) {
    into.resize(blocks.len() * ROWS, Prediction::default());
    let PredictedPairs { kind, samples, mobility } = *pairs;
    let sums = &kernel.sums;
    let close = (CLOSE_RADIUS * spacing) * (CLOSE_RADIUS * spacing);
    let half = 0.5 / sums.laplacian;
    for_each_chunk((blocks, Rows { data: &mut into[..], width: ROWS }), 1, |number, (block, into)| {
        let weight = kernel.weight;
        let square = weight.radius * weight.radius;
        let (close, half) = (close, half);
        let block = &mut block[0];
        let lists = &neighbours.blocks()[number];
        // At least as long as the lists; never shortened, so that nothing is allocated again.
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
                let (mine, mobility_a) = (samples[a], mobility[a]);
                let mut sum =
                    Prediction { density: mine.inverse_void, rate: mine.inverse_void_rate, ..Prediction::default() };
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
                    let w = value * other.inverse_void;
                    sum.density += w;
                    sum.rate += mine.compression_by(other, apart, value, weight.slope_over_distance(r));
                    sum.asymmetry += (w / r.max(COINCIDENT)) * apart;
                    let (f, cut) = weight.laplacian(r);
                    let c = f * half * (mobility_a + mobility[b]) * (mine.inverse_void * other.inverse_void);
                    sum.moment_deficit += c * apart;
                    let part = kind[b] != Kind::Dummy;
                    let fluid = kind[b] == Kind::Fluid;
                    sum.fluid_neighbours += u32::from(fluid);
                    sum.neighbour_count += u32::from(fluid & (r2 < close));
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
