//! Momentum budget of the fluid.
//!
//! In a step the fluid gains `M b dt` from the body force, `sum p A n dt` from the pressure on the walls, the wall part of
//! `sum m nu lap(u) dt` from wall friction, and the impulses that keep particles off the walls; drag and pressure force of
//! the grains are in the report of the coupling. Forces between fluid particles should cancel: repulsion does, viscosity
//! does where the void fraction is uniform, the corrected gradient only as far as it is consistent, and the pressure
//! vanishes at the centres of surface particles, half a spacing below the actual surface. The residual of the budget
//! measures how well the forces on particles add up to those on walls and grains.

use sazanami_numerics::Vector;

use crate::context::Context;
use crate::motion::sum_over_fluid;
use crate::number_density::{NumberDensity, Prediction};
use crate::particles::{Kind, Particles, Role};
use crate::pressure::hydrostatic;
use crate::reductions::sum_of;
use crate::walls::Walls;

/// External impulses on the fluid in a step, or since the start [N s].
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct FluidImpulses {
    /// Impulse of the body force and of a mean pressure gradient.
    pub body_force: Vector,
    /// Impulse of the walls by pressure.
    pub wall_pressure: Vector,
    /// Impulse of the walls by friction.
    pub friction: Vector,
    /// Impulse of the walls by repulsion, collisions and clipping to the box.
    pub contact: Vector,
}

/// External impulses on the fluid in a step, without those of repulsion, collisions and clipping [N s], over all ranks;
/// `position` is the predicted one \[m].
pub(crate) fn impulses(
    step: &Context<'_>,
    particles: &Particles,
    walls: &Walls,
    densities: &[NumberDensity],
    predicted: &[Prediction],
    position: &[Vector],
) -> FluidImpulses {
    let Context { settings, forcing, reduced_force, .. } = *step;
    let Particles { kind, role, pressure, id, owned, .. } = particles;
    let (fluid, mass) = (settings.fluid, step.particle_mass());
    let volume = mass / fluid.density;
    let total = sum_of(*owned, |a| {
        let [body, friction, wall] = match kind[a] {
            Kind::Fluid => {
                let friction = mass * fluid.viscosity * densities[a].laplacian.from_walls;
                [mass * forcing.body_force - volume * forcing.pressure_gradient, friction, Vector::ZERO]
            }
            Kind::Wall if role[a] != Role::Inactive => {
                // Total pressure on the face, half a spacing in front of the particle.
                let area = walls.area(id[a]);
                let face = position[a] + 0.5 * fluid.spacing * area.normalize_or_zero();
                let rest = |force: Vector, from: Vector| hydrostatic(fluid.density, force, face, from);
                let beyond = rest(forcing.body_force - reduced_force, position[a]);
                let total = pressure[a] + rest(reduced_force, settings.reference) + beyond;
                // No tension at dry walls.
                let total = if step.is_dry_wall(kind[a], predicted[a].density) { total.max(0.0) } else { total };
                [Vector::ZERO, Vector::ZERO, total * area]
            }
            Kind::Wall | Kind::Dummy => [Vector::ZERO; 3],
        };
        [body.x, body.y, body.z, friction.x, friction.y, friction.z, wall.x, wall.y, wall.z]
    });
    let total = step.domain.sum(total).map(|sum| step.dt * sum);
    FluidImpulses {
        body_force: Vector::from_slice(&total[..3]),
        friction: Vector::from_slice(&total[3..6]),
        wall_pressure: Vector::from_slice(&total[6..]),
        contact: Vector::ZERO,
    }
}

/// Momentum of the fluid with a `velocity` of each particle [m/s], over all ranks [N s].
pub(crate) fn momentum(step: &Context<'_>, particles: &Particles, velocity: &[Vector]) -> Vector {
    step.particle_mass() * Vector::from_array(sum_over_fluid(step.domain, particles, |_, a| velocity[a].to_array()))
}
