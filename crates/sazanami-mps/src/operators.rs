//! Corrected gradient of the pressure, and velocities mirrored at no-slip walls.

use sazanami_numerics::{Matrix, Real, Vector};
use sazanami_parallel::for_each_chunk;

use crate::boundary::Tank;
use crate::matrix::Block;
use crate::neighbours::{Bins, ROWS};
use crate::particles::{Kind, Particles, Role};
use crate::scheme::{GradientForm, Kernel};
use crate::weight::COINCIDENT;

/// Determinant of the moment matrix over that of full support below which the gradient is not corrected. It bounds the
/// condition number by 78: the largest ratio of three eigenvalues of sum 3 and of this product.
const SINGULAR: Real = 0.05;

/// Symmetric 3 x 3 matrix: 11, 22, 33, 12, 13, 23.
type Symmetric = [Real; 6];

fn add(matrix: &mut Symmetric, weight: Real, d: Vector) {
    let terms = [d.x * d.x, d.y * d.y, d.z * d.z, d.x * d.y, d.x * d.z, d.y * d.z];
    matrix.iter_mut().zip(terms).for_each(|(m, t)| *m += weight * t);
}

fn full(m: &Symmetric) -> Matrix {
    Matrix::from_cols(Vector::new(m[0], m[3], m[4]), Vector::new(m[3], m[1], m[5]), Vector::new(m[4], m[5], m[2]))
}

/// Inverse of the moment matrix unless it is nearly singular; `support` is the sum of the weights.
fn inverse(m: &Symmetric, support: Real) -> Option<Matrix> {
    let matrix = full(m);
    let determinant = matrix.determinant();
    // Strictly larger: without support both sides are zero.
    (determinant > SINGULAR * (support / 3.0).powi(3)).then(|| matrix.inverse())
}

/// Fields from which the pressure gradient is computed, ghosts included.
pub(crate) struct PressureField<'a> {
    pub pressure: &'a [Real],
    pub position: &'a [Vector],
    pub inverse_void: &'a [Real],
    pub roles: &'a [Role],
    pub kind: &'a [Kind],
    /// Density times the part of the body force whose hydrostatic pressure is split off [N/m^3].
    pub weight_of_fluid: Vector,
}

/// Gradient of the reduced pressure at each own fluid particle, and whether it was left uncorrected. The total pressure
/// gradient at isolated particles is zero.
pub(crate) fn gradient(
    kernel: &Kernel,
    blocks: &mut [Block],
    field: &PressureField<'_>,
    into: &mut [Vector],
    plain: &mut [bool],
) {
    let PressureField { pressure, position, inverse_void, roles, kind, weight_of_fluid } = *field;
    let Kernel { scheme, weight, sums } = kernel;
    let owned = into.len();
    let into = &mut into[..];
    for_each_chunk((into, plain), ROWS, |number, (into, plain)| {
        let (block, weight) = (&blocks[number], *weight);
        for (row, (gradient, plain)) in into.iter_mut().zip(plain).enumerate() {
            let a = number * ROWS + row;
            (*gradient, *plain) = (Vector::ZERO, false);
            if a >= owned || kind[a] != Kind::Fluid {
                continue;
            }
            if roles[a] == Role::Inactive {
                *gradient = -weight_of_fluid;
                continue;
            }
            let (mut matrix, mut sum, mut support) = ([0.0; 6], Vector::ZERO, 0.0);
            for &b in block.row(row).0 {
                let b = b as usize;
                if roles[b] == Role::Inactive {
                    continue;
                }
                let apart = position[b] - position[a];
                let r2 = apart.length_squared();
                let w = weight.value(r2.sqrt()) * inverse_void[b];
                let share = w / r2.max(COINCIDENT);
                support += w;
                add(&mut matrix, share, apart);
                sum += (share * (pressure[b] - pressure[a])) * apart;
            }
            let corrected = match scheme.gradient {
                GradientForm::Corrected => inverse(&matrix, support),
                GradientForm::Classical => Some(Matrix::from_diagonal(Vector::splat(3.0 / sums.others))),
            };
            *gradient = match corrected {
                Some(inverse) => inverse * sum,
                None => {
                    // Too little support for the correction: plain gradient of the total pressure.
                    *plain = true;
                    let whole = sum + full(&matrix) * weight_of_fluid;
                    whole * (3.0 / sums.others) - weight_of_fluid
                }
            };
        }
    });
}

/// Velocities that enter the viscous term: the own velocity of fluid particles, and at wall particles twice the wall
/// velocity minus the fluid velocity at the mirrored point, from a linear least-squares fit. Only wall particles for
/// which `wet` holds are evaluated.
pub(crate) fn mirrored_velocities(
    kernel: &Kernel,
    tank: &Tank,
    bins: &Bins,
    particles: &Particles,
    wet: impl Fn(usize) -> bool + Sync,
    into: &mut Vec<Vector>,
) {
    into.clear();
    into.extend_from_slice(&particles.velocity);
    let Particles { kind, position, velocity, .. } = particles;
    let weight = &kernel.weight;
    let square = weight.radius * weight.radius;
    let owned = particles.owned;
    for_each_chunk(&mut into[..owned], ROWS, |number, into| {
        for (row, viscous_velocity) in into.iter_mut().enumerate() {
            let a = number * ROWS + row;
            if kind[a] == Kind::Fluid || !wet(a) {
                continue;
            }
            let (at, weight) = (tank.mirrored(position[a]), *weight);
            let mut touched = false;
            bins.for_each_range(position[a], weight.radius, |mut range| {
                let near = |b: usize| kind[b] == Kind::Fluid && (position[b] - position[a]).length_squared() < square;
                touched = touched || range.any(near);
            });
            if !touched {
                continue;
            }
            // Weighted least squares of u + G (x - at): moments 1, x, x x and u, u x.
            let (mut w0, mut w1, mut w2) = (0.0, Vector::ZERO, [0.0; 6]);
            let (mut u0, mut u1) = (Vector::ZERO, [Vector::ZERO; 3]);
            bins.for_each_range(at, weight.radius, |range| {
                for b in range {
                    let apart = position[b] - at;
                    let r2 = apart.length_squared();
                    if r2 < square && kind[b] == Kind::Fluid {
                        let w = weight.value(r2.sqrt());
                        w0 += w;
                        w1 += w * apart;
                        add(&mut w2, w, apart);
                        u0 += w * velocity[b];
                        (0..3).for_each(|d| u1[d] += w * apart[d] * velocity[b]);
                    }
                }
            });
            *viscous_velocity = if w0 > 0.0 {
                // The slope is eliminated; where it is undetermined the fit is the mean.
                let scale = w0 * weight.radius * weight.radius;
                let matrix = full(&w2);
                let value = if matrix.determinant() > 1e-6 * scale.powi(3) {
                    let share = matrix.inverse() * w1;
                    let rest = w0 - share.dot(w1);
                    let moment = share.x * u1[0] + share.y * u1[1] + share.z * u1[2];
                    if rest > 0.05 * w0 { (u0 - moment) / rest } else { u0 / w0 }
                } else {
                    u0 / w0
                };
                2.0 * tank.velocity - value
            } else {
                tank.velocity
            };
        }
    });
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn singular_moment_matrices_are_not_inverted() {
        let mut plane = [0.0; 6];
        for d in [Vector::X, Vector::Y, Vector::new(0.6, 0.8, 0.0)] {
            add(&mut plane, 1.0, d);
        }
        assert!(inverse(&plane, 3.0).is_none());
        assert!(inverse(&[0.0; 6], 0.0).is_none(), "with none at all");
        add(&mut plane, 1.0, Vector::Z);
        let found = inverse(&plane, 4.0).unwrap();
        assert!((found * full(&plane) - Matrix::IDENTITY).to_cols_array().iter().all(|v| v.abs() < 1e-12));
    }
}
