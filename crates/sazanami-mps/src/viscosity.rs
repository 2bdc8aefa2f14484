//! Viscosity: velocities mirrored at no-slip walls, and the Laplacian of the velocity.
//!
//! The Laplacian is summed in the loop of [`crate::number_density::at_start`], which visits the same pairs.

use sazanami_numerics::particles::Bins;
use sazanami_numerics::{Real, Vector};
use sazanami_parallel::for_each_chunk;

use crate::arrangement::Arrangement;
use crate::boundary::{Tank, WallFriction};
use crate::context::Context;
use crate::moments::{add, full};
use crate::neighbours::ROWS;
use crate::particles::{Kind, Particles};
use crate::scheme::Kernel;

/// Velocities and condition at walls of the viscous term.
#[derive(Clone, Copy)]
pub(crate) struct ViscousField<'a> {
    /// Velocities, at no-slip walls mirrored ones (see [`mirrored_velocities`]) [m/s].
    pub velocity: &'a [Vector],
    pub kind: &'a [Kind],
    pub friction: WallFriction,
}

/// Laplacian of the velocity at a particle.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct VelocityLaplacian {
    /// Laplacian [1/(m s)].
    pub total: Vector,
    /// Contribution of wall particles [1/(m s)].
    pub from_walls: Vector,
}

impl VelocityLaplacian {
    /// Adds neighbour `b` of fluid particle `a`, of inverse void fraction `inverse_void`, with the coefficient of the pair
    /// before normalisation [1/m^2].
    #[inline(always)]
    pub fn add(&mut self, field: &ViscousField<'_>, [a, b]: [usize; 2], coefficient: Real, inverse_void: Real) {
        let fluid = field.kind[b] == Kind::Fluid;
        if field.friction == WallFriction::NoSlip || fluid {
            let term = coefficient * inverse_void * (field.velocity[b] - field.velocity[a]);
            self.total += term;
            if !fluid {
                self.from_walls += term;
            }
        }
    }

    /// Divides by the normalisation of the Laplacian.
    #[inline(always)]
    pub fn normalised(self, laplacian: Real) -> Self {
        Self { total: self.total / laplacian, from_walls: self.from_walls / laplacian }
    }
}

/// The field of the viscous term at the start of the step; `mirrored` is work space.
pub(crate) fn field<'a>(
    step: &Context<'_>,
    tank: &Tank,
    particles: &'a Particles,
    near: &mut Arrangement,
    mirrored: &'a mut Vec<Vector>,
) -> ViscousField<'a> {
    let friction = tank.common_friction();
    let velocity = if step.settings.fluid.viscosity > 0.0 && friction == WallFriction::NoSlip {
        let Arrangement { ghosts, bins, neighbours, bin } = near;
        mirrored_velocities(step.kernel, tank, bins, particles, |a| neighbours.is_wet(bin[a]), mirrored);
        ghosts.refresh(step.domain, mirrored);
        &mirrored[..]
    } else {
        &particles.velocity[..]
    };
    ViscousField { velocity, kind: &particles.kind, friction }
}

/// Velocities that enter the viscous term: the own velocity of fluid particles, and at wall particles twice the wall
/// velocity minus the fluid velocity at the mirrored point, from a linear least-squares fit. Only wall particles for
/// which `wet` holds are evaluated.
fn mirrored_velocities(
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
