//! Motion of the fluid particles: predictor, pressure correction, and the new state.

use sazanami_numerics::domain::Domain;
use sazanami_numerics::{Real, Vector};
use sazanami_parallel::for_each_chunk;

use crate::boundary::Tank;
use crate::context::{Context, Motion};
use crate::error::StepError;
use crate::ghosts::Ghosts;
use crate::grains::OverlappingGrains;
use crate::neighbours::ROWS;
use crate::number_density::NumberDensity;
use crate::particles::{Kind, Particles, Role};
use crate::reductions::{largest, sum_of};
use crate::stability::{self, COMPRESSIBLE};

/// Sum of `part` over the fluid particles of all ranks.
pub(crate) fn sum_over_fluid<const N: usize>(
    domain: &Domain,
    particles: &Particles,
    part: impl Fn(&Particles, usize) -> [Real; N] + Sync,
) -> [Real; N] {
    let fluid = |a: usize| particles.kind[a] == Kind::Fluid;
    domain.sum(sum_of(particles.owned, |a| if fluid(a) { part(particles, a) } else { [0.0; N] }))
}

/// Largest speed relative to a velocity `frame`, over all ranks, of fluid particles with a role in the last step for which `counts` holds [m/s].
pub(crate) fn largest_speed(
    domain: &Domain,
    particles: &Particles,
    frame: Vector,
    counts: impl Fn(Role) -> bool + Sync,
) -> Real {
    let counted = |a: usize| particles.kind[a] == Kind::Fluid && counts(particles.role[a]);
    let speed = |a: usize| (particles.velocity[a] - frame).length_squared();
    let square = largest(particles.owned, |a| if counted(a) { speed(a) } else { 0.0 });
    domain.max(square.max(0.0).sqrt())
}

/// Speed relative to the walls of the fastest fluid particle or grain, over all ranks [m/s].
pub(crate) fn fastest_beside_walls(step: &Context<'_>, particles: &Particles, grains: &OverlappingGrains) -> Real {
    let walls = step.forcing.wall_velocity;
    largest_speed(step.domain, particles, walls, |_| true).max(grains.largest_speed(step.domain, walls))
}

/// See [`stability::flow_time`] \[s].
pub(crate) fn flow_time(step: &Context<'_>, particles: &Particles) -> Real {
    let walls = step.forcing.wall_velocity;
    let speed = |p: &Particles, a: usize| [(p.velocity[a] - walls).length(), 1.0];
    let [speeds, count] = sum_over_fluid(step.domain, particles, speed);
    stability::flow_time(speeds / count.max(1.0), step.forcing.body_force, step.settings.fluid.spacing, step.dt)
}

/// Velocities and positions without the pressure: viscosity, body force and the velocity change `drag` by drag [m/s], if
/// it is known.
pub(crate) fn predict(
    step: &Context<'_>,
    particles: &Particles,
    densities: &[NumberDensity],
    drag: Option<&[Vector]>,
    ghosts: &mut Ghosts,
    predicted: &mut Motion,
) {
    let Context { domain, periods, dt, .. } = *step;
    let (viscosity, body_force) = (step.settings.fluid.viscosity, step.explicit_force());
    let Particles { kind, owned, position: start, velocity: present, .. } = particles;
    predicted.resize(particles.len());
    let columns = (&mut predicted.velocity[..*owned], &mut predicted.position[..*owned]);
    for_each_chunk(columns, ROWS, |number, (velocity, position)| {
        for (row, (u, x)) in velocity.iter_mut().zip(position).enumerate() {
            let a = number * ROWS + row;
            *u = present[a];
            if kind[a] == Kind::Fluid {
                let drag = drag.map_or(Vector::ZERO, |drag| drag[a]);
                *u += dt * (viscosity * densities[a].laplacian.total + body_force) + drag;
            }
            // On exact multiples, so that both particles of a pair across a periodic side get the same distance.
            *x = periods.rounded(start[a] + dt * *u);
        }
    });
    predicted.refresh(domain, ghosts);
}

/// Velocities and positions with the pressure.
pub(crate) fn correct(
    step: &Context<'_>,
    particles: &Particles,
    predicted: &Motion,
    ghosts: &mut Ghosts,
    corrected: &mut Motion,
) {
    let (dt, density) = (step.dt, step.settings.fluid.density);
    let Particles { kind, gradient, owned, .. } = particles;
    corrected.resize(particles.len());
    let columns = (&mut corrected.velocity[..*owned], &mut corrected.position[..*owned]);
    for_each_chunk(columns, ROWS, |number, (velocity, position)| {
        for (row, (u, x)) in velocity.iter_mut().zip(position).enumerate() {
            let a = number * ROWS + row;
            (*u, *x) = (predicted.velocity[a], predicted.position[a]);
            if kind[a] == Kind::Fluid {
                let acceleration = -gradient[a] / density;
                *u += dt * acceleration;
                *x += dt * dt * acceleration;
            }
        }
    });
    corrected.refresh(step.domain, ghosts);
}

/// Why the run cannot continue from the new state of own particle `a`, if it cannot.
fn failure(step: &Context<'_>, particles: &Particles, new: &Motion, a: usize) -> Option<StepError> {
    if particles.kind[a] != Kind::Fluid {
        return None;
    }
    let (id, position) = (particles.id[a], particles.position[a]);
    let (x, u) = (new.position[a], new.velocity[a]);
    if !(x.is_finite() && u.is_finite() && particles.pressure[a].is_finite()) {
        let what = if u.is_finite() { "pressure" } else { "velocity" };
        return Some(StepError::NotFinite { id, what, position });
    }
    let (distance, limit) = ((x - position).length(), step.kernel.weight.radius);
    if distance > limit {
        return Some(StepError::TooFar { id, distance, limit, position });
    }
    let speed = u.length();
    (speed > COMPRESSIBLE).then_some(StepError::TooFast { id, speed, position })
}

/// Fluid particles of all ranks that were put back into the box.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Clipped {
    pub count: usize,
    /// Energy that this gave them, kinetic and potential \[J].
    pub work: Real,
}

/// Stores the new state, with fluid particles clipped to the box.
///
/// # Errors
/// [`StepError`] for the first particle of a rank with a value that is not finite, or a displacement or speed out of
/// bounds.
pub(crate) fn finalise(
    step: &Context<'_>,
    tank: &Tank,
    new: &Motion,
    particles: &mut Particles,
) -> Result<Clipped, StepError> {
    let Context { domain, periods, .. } = *step;
    let spacing = step.settings.fluid.spacing;
    let owned = particles.owned;
    let clipped = |kind: Kind, from: Vector, a: usize| {
        let (mut x, mut u) = (new.position[a], new.velocity[a]);
        let moved = kind == Kind::Fluid && tank.clip_from(spacing, from, &mut x, &mut u);
        (x, u, moved)
    };
    let one = |is: bool| if is { 1.0 } else { 0.0 };
    let [failed, count, work] = sum_of(owned, |a| {
        let (x, u, moved) = clipped(particles.kind[a], particles.position[a], a);
        let change = if moved { energy_change(step, [new.position[a], x], [new.velocity[a], u]) } else { 0.0 };
        [one(failure(step, particles, new, a).is_some()), one(moved), change]
    });
    let first = if failed > 0.0 { (0..owned).find_map(|a| failure(step, particles, new, a)) } else { None };
    domain.agree(first.map_or(Ok(()), Err))?;
    let Particles { kind, position, velocity, .. } = particles;
    for_each_chunk((&mut position[..owned], &mut velocity[..owned]), ROWS, |number, (position, velocity)| {
        for (row, (position, velocity)) in position.iter_mut().zip(velocity).enumerate() {
            let a = number * ROWS + row;
            let (x, u, _) = clipped(kind[a], *position, a);
            *position = periods.wrapped(x);
            if kind[a] == Kind::Fluid {
                *velocity = u;
            }
        }
    });
    let [count, work] = domain.sum([count, work]);
    Ok(Clipped { count: count as usize, work: step.particle_mass() * work })
}

/// Change of the energy per mass between two places \[m] and velocities [m/s] [J/kg].
fn energy_change(step: &Context<'_>, place: [Vector; 2], velocity: [Vector; 2]) -> Real {
    let [before, after] = velocity.map(Vector::length_squared);
    0.5 * (after - before) - step.forcing.body_force.dot(place[1] - place[0])
}
