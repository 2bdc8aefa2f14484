//! Particle shifting as fast as the flow deforms, beside free surfaces too, with velocities carried to the shifted places.
//!
//! Particles move down the gradient of their concentration (Lind, Xu, Stansby and Rogers 2012, J. Comput. Phys. 231, 1499)
//! by a diffusion number in proportion to the norm of the velocity gradient at the particle and the step, as Skillen, Lind,
//! Stansby and Rogers (2013, Comput. Methods Appl. Mech. Eng. 265, 163) have it with the speed: nothing moves at rest, nor
//! where the fluid only travels or falls. What lies beyond a free surface is completed by the half space that a flat
//! surface leaves empty; particles at the surface move along it alone (Khayyer, Gotoh and Shimizu 2017, J. Comput. Phys.
//! 332, 236). Away from walls velocities follow the corrected gradient to the new place: linear flows do not change.

use sazanami_numerics::{Real, Vector};
use sazanami_parallel::for_each_chunk;

use crate::arrangement::Arrangement;
use crate::context::{Context, Motion};
use crate::moments::VelocitySlopes;
use crate::neighbours::ROWS;
use crate::number_density::Prediction;
use crate::particles::{Kind, Particles, Role};
use crate::reductions::{largest, sum_of};
use crate::weight::{Calibration, Weight};

/// Rate of shifting over the norm of the velocity gradient, up to which it is one.
const RATE: Real = 20.0;
/// Radius of the concentration over the spacing, whatever that of the scheme: a wider weight hardly tells a pair that is
/// too close, and pairs cluster.
const RADIUS: Real = 2.1;
/// Length of the mean of unit normals around a particle below which they belong to different surfaces.
const AGREEMENT: Real = 0.5;

/// Shift of one particle.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Shift {
    /// \[m]
    displacement: Vector,
    /// Change of velocity to that of the new place [m/s].
    velocity: Vector,
}

/// Shifts of a step; its columns are work space.
#[derive(Debug, Default)]
pub(crate) struct Shifter {
    outward: Vec<Vector>,
    shifts: Vec<Shift>,
}

/// Outcome of shifting, over all ranks.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct ShiftReport {
    /// Largest displacement \[m].
    pub largest: Real,
    /// Change of the kinetic energy \[J].
    pub work: Real,
    /// Change of the momentum [N s].
    pub impulse: Vector,
}

/// Fields that shifts are found from, ghosts included.
struct Columns<'a> {
    kind: &'a [Kind],
    roles: &'a [Role],
    position: &'a [Vector],
    velocity: &'a [Vector],
    inverse_void: &'a [Real],
    /// Unit vectors out of the fluid at surface particles.
    outward: &'a [Vector],
    /// Sum of the weights of the concentration with full support.
    full: Real,
}

/// Fluid or surfaces beside a particle.
enum Beside {
    /// Fluid alone.
    Fluid,
    /// A surface: its outward normal, and its distance along it \[m].
    Surface(Vector, Real),
    /// Surfaces that face different ways: a sheet or a thread, which are not shifted.
    Several,
}

impl Shifter {
    /// Shifts the own particles in `new`; `sums` are those at the predicted positions.
    pub fn shift(
        &mut self,
        step: &Context<'_>,
        particles: &Particles,
        (inverse_void, sums): (&[Real], &[Prediction]),
        near: &mut Arrangement,
        new: &mut Motion,
    ) -> ShiftReport {
        let Particles { kind, role, owned, .. } = particles;
        let (kind, roles, owned) = (&kind[..], &role[..], *owned);
        let Self { outward, shifts } = self;
        let Arrangement { ghosts, neighbours, .. } = near;
        outward.resize(kind.len(), Vector::ZERO);
        for_each_chunk(&mut outward[..owned], ROWS, |number, outward| {
            for (row, outward) in outward.iter_mut().enumerate() {
                let a = number * ROWS + row;
                let at_surface = kind[a] == Kind::Fluid && roles[a] == Role::Dirichlet;
                *outward = if at_surface { -sums[a].asymmetry.normalize_or_zero() } else { Vector::ZERO };
            }
        });
        ghosts.refresh(step.domain, outward);
        new.refresh(step.domain, ghosts);
        let Motion { position, velocity } = new;
        let spacing = step.settings.fluid.spacing;
        let narrow = Weight { radius: RADIUS * spacing, ..step.kernel.weight };
        let full = Calibration::new(&narrow, step.kernel.scheme.laplacian, spacing).number_density;
        let columns = Columns { kind, roles, position, velocity, inverse_void, outward, full };
        shifts.resize(owned, Shift::default());
        neighbours.set(shifts, |a, near| columns.shift_of(step, a, near));
        let shifts = &shifts[..];
        let mass = step.particle_mass();
        let sums = sum_of(owned, |a| {
            let change = shifts[a].velocity;
            let [x, y, z] = (mass * change).to_array();
            [mass * change.dot(velocity[a] + 0.5 * change), x, y, z]
        });
        for_each_chunk((&mut position[..owned], &mut velocity[..owned]), ROWS, |number, (position, velocity)| {
            for ((x, u), shift) in position.iter_mut().zip(velocity).zip(&shifts[number * ROWS..]) {
                *x += shift.displacement;
                *u += shift.velocity;
            }
        });
        new.refresh(step.domain, ghosts);
        let longest = largest(owned, |a| shifts[a].displacement.length_squared()).max(0.0);
        let [work, x, y, z] = step.domain.sum(sums);
        ShiftReport { largest: step.domain.max(longest).sqrt(), work, impulse: Vector::new(x, y, z) }
    }
}

impl Columns<'_> {
    /// Fluid or surfaces beside particle `a`.
    fn surface(&self, step: &Context<'_>, a: usize, near: &[u32]) -> Beside {
        let weight = step.kernel.weight;
        let (mut normal, mut way, mut weights) = (self.outward[a], Vector::ZERO, self.outward[a].length_squared());
        for &b in near {
            let b = b as usize;
            if self.roles[b] == Role::Dirichlet {
                let apart = self.position[b] - self.position[a];
                let w = weight.value(apart.length());
                normal += w * self.outward[b];
                way += w * apart;
                weights += w;
            }
        }
        if weights <= 0.0 {
            return Beside::Fluid;
        }
        if normal.length() < AGREEMENT * weights {
            return Beside::Several;
        }
        let normal = normal.normalize_or_zero();
        Beside::Surface(normal, way.dot(normal) / weights + 0.5 * step.settings.fluid.spacing)
    }

    fn shift_of(&self, step: &Context<'_>, a: usize, near: &[u32]) -> Shift {
        let Self { kind, roles, position, velocity, inverse_void, .. } = *self;
        if kind[a] != Kind::Fluid || roles[a] == Role::Inactive {
            return Shift::default();
        }
        let surface = match self.surface(step, a, near) {
            Beside::Fluid => None,
            Beside::Surface(normal, distance) => Some((normal, distance)),
            Beside::Several => return Shift::default(),
        };
        let (kernel, spacing) = (step.kernel, step.settings.fluid.spacing);
        let weight = kernel.weight;
        let narrow = Weight { radius: RADIUS * spacing, ..weight };
        let square = weight.radius * weight.radius;
        let (mut gradient, mut slopes, mut beside_wall) = (Vector::ZERO, VelocitySlopes::default(), false);
        for &b in near {
            let b = b as usize;
            let apart = position[b] - position[a];
            let r2 = apart.length_squared();
            let fluid = kind[b] == Kind::Fluid;
            // Walls above the surface face no fluid.
            let beyond = surface.is_some_and(|(normal, distance)| !fluid && apart.dot(normal) > distance);
            if r2 >= square || beyond || fluid && roles[b] == Role::Inactive {
                continue;
            }
            let r = r2.sqrt();
            gradient -= (narrow.slope_over_distance(r) * inverse_void[b]) * apart;
            beside_wall |= !fluid;
            if fluid {
                let slope = -weight.slope_over_distance(r) * inverse_void[b];
                slopes.add(slope, apart, velocity[b] - velocity[a]);
            }
        }
        let Some(velocity_gradient) = slopes.gradient() else { return Shift::default() };
        if let Some((normal, distance)) = surface {
            gradient += (narrow.beyond(distance) / spacing.powi(3)) * normal;
            if roles[a] == Role::Dirichlet {
                gradient -= gradient.dot(normal) * normal;
            }
        }
        let norm = velocity_gradient.iter().map(|slope| slope.length_squared()).sum::<Real>().sqrt();
        let share = kernel.scheme.shifting * (RATE * norm * step.dt).min(1.0);
        let displacement = -(share * 0.25 * narrow.radius * narrow.radius / self.full) * gradient;
        // Beside a wall the gradient would extrapolate from one side: what it adds feeds on itself.
        let carried = if beside_wall { Vector::ZERO } else { displacement };
        let change = velocity_gradient.iter().zip(carried.to_array()).map(|(slope, way)| way * *slope).sum();
        Shift { displacement, velocity: change }
    }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::PI;

    use super::*;
    use crate::weight::Wendland;

    #[test]
    fn the_half_space_beyond_a_surface_is_integrated() {
        for family in [Wendland::C2, Wendland::C4] {
            let weight = Weight { family, radius: 2.6 };
            for distance in [0.0, 0.5, 1.7, 2.5] {
                let count = 4000;
                let dr = (weight.radius - distance) / Real::from(count);
                let radii = (0..count).map(|n| distance + (Real::from(n) + 0.5) * dr);
                let sum: Real = radii.map(|r| 2.0 * PI * weight.value(r) * r * dr).sum();
                assert!((weight.beyond(distance) - sum).abs() < 1e-5 * weight.beyond(0.0), "{family:?} {distance}");
            }
            assert!(weight.beyond(2.6) == 0.0 && weight.beyond(3.0) == 0.0);
        }
    }
}
