//! Exchange between neighbours without the pressure: viscosity, damping of non-linear motion, mean gradients.
//!
//! A pair parts by `m = (u_j - u_i).e - e.(L_i + L_j) r/2` faster than the velocity gradients `L` of its particles let it.
//! The damping is the negative gradient of `sum (w/n0) m^2/2` over all pairs with respect to the velocities: that of `m` itself
//! pulls along the pair, that of `L` acts as a stress does. It takes energy only, and keeps momentum and angular momentum.

use sazanami_numerics::{Matrix, Real, Vector};
use sazanami_parallel::for_each_chunk;

use super::mirrors::gate_of;
use super::pairs::{Neighbour, Pairs, times};
use super::voids::Bulk;
use crate::boundary::WallFriction;
use crate::gates::Gate;
use crate::matrix::Block;
use crate::moments::{Symmetric, add};
use crate::neighbours::ROWS;
use crate::particles::Kind;
use crate::scheme::Kernel;
use crate::weight::COINCIDENT;

/// Sums over the neighbours of a particle.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Received {
    /// Laplacian of the velocity, with eddies `div((1 + nu_t/nu) grad u)` [1/(m s)].
    pub laplacian: Vector,
    /// Velocity change by damping for a damping number of 1 [m/s].
    pub damping: Vector,
    /// Rate of strain of the mean of the neighbours' velocity gradients, Frobenius norm of twice its symmetric part [1/s].
    pub strain: Real,
}

/// Fields of all particles, ghosts included.
#[derive(Clone, Copy)]
pub(crate) struct Fields<'a> {
    pub kind: &'a [Kind],
    /// Velocities relative to the walls [m/s].
    pub velocity: &'a [Vector],
    /// Velocity gradients [1/s].
    pub gradient: &'a [Matrix],
    pub bulk: Bulk<'a>,
    pub gates: &'a [Gate],
    /// Eddy viscosity over that of the fluid, if there is one.
    pub eddies: Option<&'a [Real]>,
}

/// Sets what each own fluid particle receives, its damping without the part of the gradients, and its stress
/// `sum (w/n0) m e r^T` [m^2/s], for [`add_stress`].
pub(crate) fn exchange(
    kernel: &Kernel,
    friction: WallFriction,
    (pairs, blocks): (&Pairs, &[Block]),
    fields: &Fields<'_>,
    (into, stress): (&mut [Received], &mut [Symmetric]),
) {
    let Fields { kind, velocity, gradient, bulk, gates, eddies } = *fields;
    let (weight, sums) = (kernel.weight, kernel.sums);
    let [per_laplacian, per_density] = [sums.laplacian, sums.number_density].map(Real::recip);
    for_each_chunk((into, stress), ROWS, |number, (into, stress)| {
        for (row, (into, stress)) in into.iter_mut().zip(stress).enumerate() {
            let a = number * ROWS + row;
            (*into, *stress) = (Received::default(), [0.0; 6]);
            if kind[a] != Kind::Fluid {
                continue;
            }
            let (mut mean, mut total) = (gradient[a], 1.0);
            for pair in pairs.of(blocks, a) {
                let Neighbour { particle: b, turned, .. } = pair;
                let apart = pair.way();
                let narrower = bulk.narrowing(a, b);
                let r = apart.length() * narrower;
                let w = weight.value(r);
                let held = turned != 0 && friction == WallFriction::NoSlip;
                // At a wall that holds the water eddies are gone.
                let eddies = eddies.filter(|_| !held);
                let thicker = eddies.map_or(1.0, |eddies| 1.0 + 0.5 * (eddies[a] + eddies[b]));
                // The image of a wall that holds the fluid moves against it.
                let image = match gate_of(turned) {
                    Some(gate) if held => Vector::new(0.0, 0.0, 2.0 * gates[gate].velocity) - velocity[b],
                    None if held => -velocity[b],
                    _ => pair.seen(velocity[b]),
                };
                let stiffness = thicker * weight.laplacian(r).0 * narrower * narrower;
                into.laplacian += stiffness * per_laplacian * (image - velocity[a]);
                let other = seen(&pair, &gradient[b]);
                total += w;
                mean += w * other;
                let along = narrower * r.max(COINCIDENT).recip() * apart;
                let change = pair.seen(velocity[b]) - velocity[a] - 0.5 * (gradient[a] + other) * apart;
                let pull = w * per_density * change.dot(along);
                into.damping += pull * along;
                add(stress, pull * r / narrower, along);
            }
            let mean = mean * total.recip();
            let twice = mean + mean.transpose();
            into.strain = twice.to_cols_array().iter().map(|v| v * v).sum::<Real>().sqrt();
        }
    });
}

/// Adds to the damping of each own fluid particle what the velocity gradients have to do with it: with the stress `Q`,
/// `-1/2 sum (Q_i B_i + Q_j B_j) g_ij`. Ghosts of `stress` are up to date.
pub(crate) fn add_stress(
    (pairs, blocks): (&Pairs, &[Block]),
    (kind, bulk): (&[Kind], &Bulk<'_>),
    (stress, inverse): (&[Symmetric], &[Symmetric]),
    into: &mut [Received],
) {
    let of = |a: usize, slope: Vector| times(&stress[a], times(&inverse[a], slope));
    for_each_chunk(into, ROWS, |number, into| {
        for (row, into) in into.iter_mut().enumerate() {
            let a = number * ROWS + row;
            if kind[a] != Kind::Fluid {
                continue;
            }
            let (mut slopes, mut there) = (Vector::ZERO, Vector::ZERO);
            for pair in pairs.of(blocks, a) {
                let slope = bulk.share(a, pair.particle) * pair.slope;
                slopes += slope;
                there += pair.seen(of(pair.particle, pair.seen(slope)));
            }
            into.damping -= 0.5 * (of(a, slopes) + there);
        }
    });
}

/// The gradient at an image.
#[inline(always)]
fn seen(pair: &Neighbour, gradient: &Matrix) -> Matrix {
    if pair.turned == 0 {
        return *gradient;
    }
    let turned = Matrix::from_cols(pair.seen(gradient.x_axis), pair.seen(gradient.y_axis), pair.seen(gradient.z_axis));
    let rows = turned.transpose();
    Matrix::from_cols(pair.seen(rows.x_axis), pair.seen(rows.y_axis), pair.seen(rows.z_axis)).transpose()
}
