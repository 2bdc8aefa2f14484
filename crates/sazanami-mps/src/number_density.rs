//! Sums over the neighbours of each particle: number density, its rate, viscosity, asymmetry.
//!
//! Every particle counts with its bulk volume, that is with `1/eps`, so that in a bed and in clear water the same
//! number density n0 is aimed at.

use sazanami_numerics::{Real, Vector};

use crate::boundary::WallFriction;
use crate::free_surface::COMPANY_RADIUS;
use crate::matrix::Block;
use crate::neighbours::{Neighbours, ROWS};
use crate::particles::Kind;
use crate::scheme::Kernel;

/// Columns that the sums look at, ghosts included.
#[derive(Clone, Copy)]
pub(crate) struct Columns<'a> {
    pub kind: &'a [Kind],
    /// Places [m].
    pub position: &'a [Vector],
    /// Velocities that count for the change of volume [m/s].
    pub velocity: &'a [Vector],
    /// `1/eps`.
    pub bulk: &'a [Real],
    /// Rate of `1/eps` along the particle [1/s].
    pub bulk_rate: &'a [Real],
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
}

/// Number density, rate and viscosity of each own particle; `seen` is the velocity that viscosity sees.
pub(crate) fn crowding(
    kernel: &Kernel,
    neighbours: &Neighbours,
    columns: &Columns<'_>,
    seen: &[Vector],
    friction: WallFriction,
    into: &mut [Crowding],
) {
    let Columns { kind, position, velocity, bulk, bulk_rate } = *columns;
    let Kernel { scheme, weight, sums } = kernel;
    let square = weight.radius * weight.radius;
    neighbours.set(into, |a, near| {
        let (x, u, s) = (position[a], velocity[a], seen[a]);
        let mut density = bulk[a];
        let mut rate = bulk_rate[a];
        let mut laplacian = Vector::ZERO;
        for &b in near {
            let b = b as usize;
            let apart = position[b] - x;
            let r2 = apart.length_squared();
            if r2 >= square {
                continue;
            }
            let r = r2.sqrt();
            let w = weight.value(r);
            density += w * bulk[b];
            rate += weight.slope(r) * (velocity[b] - u).dot(apart) / r * bulk[b] + w * bulk_rate[b];
            if friction == WallFriction::NoSlip || kind[b] == Kind::Fluid {
                laplacian += scheme.laplacian.coefficient(weight, r).0 * bulk[b] * (seen[b] - s);
            }
        }
        Crowding { density, rate: rate / sums.strain, laplacian: laplacian / sums.laplacian }
    });
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
    columns: &Columns<'_>,
    mobile: &[Real],
    blocks: &mut [Block],
    into: &mut [Prediction],
) {
    let Columns { kind, position, velocity, bulk, bulk_rate } = *columns;
    let Kernel { scheme, weight, sums } = kernel;
    let square = weight.radius * weight.radius;
    let close = (COMPANY_RADIUS * spacing) * (COMPANY_RADIUS * spacing);
    let half = 0.5 / sums.laplacian;
    let into = sazanami_parallel::Rows { data: into, width: ROWS };
    sazanami_parallel::for_each_chunk((blocks, into), 1, |number, (block, into)| {
        let block = &mut block[0];
        block.clear();
        let lists = &neighbours.blocks()[number];
        for (row, entry) in into.data.iter_mut().enumerate() {
            *entry = Prediction::default();
            let near = lists.of(row);
            let a = number * ROWS + row;
            if !near.is_empty() {
                let (x, u, bulk_a) = (position[a], velocity[a], bulk[a]);
                let conductance = 1.0 / bulk_a + mobile[a];
                let mut sum = Prediction { density: bulk_a, rate: bulk_rate[a], ..Prediction::default() };
                for &b in near {
                    let column = b;
                    let b = b as usize;
                    let apart = position[b] - x;
                    let r2 = apart.length_squared();
                    if r2 >= square {
                        continue;
                    }
                    let r = r2.sqrt();
                    let w = weight.value(r) * bulk[b];
                    sum.density += w;
                    sum.rate +=
                        weight.slope(r) * (velocity[b] - u).dot(apart) / r * bulk[b] + weight.value(r) * bulk_rate[b];
                    sum.asymmetry += (w / r) * apart;
                    let (f, cut) = scheme.laplacian.coefficient(weight, r);
                    let c = f * half * (conductance + (1.0 / bulk[b] + mobile[b])) * (bulk_a * bulk[b]);
                    sum.lean += c * apart;
                    match kind[b] {
                        Kind::Fluid => {
                            sum.wet += 1;
                            sum.company += u32::from(r2 < close);
                        }
                        Kind::Wall => {}
                        Kind::Dummy => continue,
                    }
                    block.cut += usize::from(cut);
                    block.columns.push(column);
                    block.coefficients.push(c as f32);
                }
                sum.rate /= sums.strain;
                *entry = sum;
            }
            block.starts[row + 1] = block.columns.len() as u32;
        }
    });
}
