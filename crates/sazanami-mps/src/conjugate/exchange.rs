//! What neighbours exchange without the pressure: viscosity, damping of the motion that is not linear, mean gradients.

use sazanami_numerics::{Matrix, Real, Vector};
use sazanami_parallel::for_each_chunk;

use super::pairs::{Neighbour, Pairs};
use super::voids::Bulk;
use crate::boundary::WallFriction;
use crate::matrix::Block;
use crate::neighbours::ROWS;
use crate::particles::Kind;
use crate::scheme::Kernel;
use crate::weight::COINCIDENT;

/// What a particle receives from its neighbours.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Received {
    /// Laplacian of the velocity [1/(m s)].
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
}

/// Sets what each own fluid particle receives.
pub(crate) fn exchange(
    kernel: &Kernel,
    friction: WallFriction,
    (pairs, blocks): (&Pairs, &[Block]),
    fields: &Fields<'_>,
    into: &mut [Received],
) {
    let Fields { kind, velocity, gradient, bulk } = *fields;
    let (weight, form, sums) = (kernel.weight, kernel.scheme.laplacian, kernel.sums);
    let [per_laplacian, per_density] = [sums.laplacian, sums.number_density].map(Real::recip);
    for_each_chunk(into, ROWS, |number, into| {
        for (row, into) in into.iter_mut().enumerate() {
            let a = number * ROWS + row;
            *into = Received::default();
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
                // The image of a wall that holds the fluid moves against it.
                let image = if held { -velocity[b] } else { pair.seen(velocity[b]) };
                let stiffness = form.coefficient(&weight, r).0 * narrower * narrower;
                into.laplacian += stiffness * per_laplacian * (image - velocity[a]);
                let other = seen(&pair, &gradient[b]);
                total += w;
                mean += w * other;
                let along = narrower * r.max(COINCIDENT).recip() * apart;
                let speed = (pair.seen(velocity[b]) - velocity[a]).dot(along);
                let rest = speed - 0.5 * along.dot((gradient[a] + other) * apart);
                let least = if rest.abs() < speed.abs() { rest } else { speed };
                // Signs are hard to foretell: no branch.
                let least = if rest * speed > 0.0 { least } else { 0.0 };
                into.damping += w * per_density * least * along;
            }
            let mean = mean * total.recip();
            let twice = mean + mean.transpose();
            into.strain = twice.to_cols_array().iter().map(|v| v * v).sum::<Real>().sqrt();
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
