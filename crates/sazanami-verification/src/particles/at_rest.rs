//! Water that has no reason to move, and water that falls freely.

use sazanami_numerics::{Real, Vector};

use super::vessel::{DENSITY, DOWN, ExperimentError, GRAVITY, OPEN, OPEN_TOP, PERIODIC, SLAB, Vessel, WALLS};
use super::vessel::{advance, fluid, kinetic_energy, under, zero_above_surface};
use sazanami_mps::Role;
use sazanami_mps::pressure::hydrostatic;
use sazanami_mps::scheme::Scheme;
use sazanami_mps::solver::Solver;

/// Layers of water.
const LAYERS: usize = 20;
/// When the pressure is looked at \[s].
const FIRST: Real = 0.5;
/// Steps in which velocities are damped, and by what, before rest is judged.
const RELAXATION: (usize, Real) = (500, 0.9);

/// Water in a box of 20 x 7 (periodic) x 20 spacings.
#[derive(Clone, Copy, Debug)]
pub struct RestSetup {
    /// Particle spacing \[m].
    pub spacing: Real,
    /// Body force in x over gravity; the surface lies across the sum.
    pub tilt: Real,
    /// Random displacement off the lattice, in spacings.
    pub jitter: Real,
    /// Time of observation after the relaxation \[s].
    pub seconds: Real,
    /// Enhancements.
    pub scheme: Scheme,
}

/// Motion of water at rest.
#[derive(Clone, Copy, Debug, Default)]
pub struct Rest {
    /// Largest difference from the hydrostatic pressure after half a second, over that of the depth.
    pub pressure: Real,
    /// The same at the end.
    pub pressure_at_end: Real,
    /// Largest speed in the first half second, over `sqrt(g H)`.
    pub first_speed: Real,
    /// Largest speed in the last third of the watch, over `sqrt(g H)`.
    pub speed: Real,
    /// Root mean square of the speed there.
    pub mean_speed: Real,
    /// Change of the mean height of the particles at the surface, in spacings.
    pub level: Real,
    /// Change of the mean volume strain.
    pub strain: Real,
    /// Mean kinetic energy in the last third over that in the first.
    pub energy: Real,
}

/// Largest difference of the pressure from the hydrostatic, over that of the depth, and the level, both along `up`.
fn hydrostatics(solver: &Solver, body_force: Vector) -> [Real; 2] {
    let up = -body_force.normalize();
    let weight = DENSITY * body_force.length();
    let particles = solver.particles();
    let surface = |p: &sazanami_mps::Particles, a: usize| if p.role[a] == Role::Dirichlet { 1.0 } else { 0.0 };
    let [height, count] = solver.sum_over_fluid(|p, a| [surface(p, a) * up.dot(p.position[a]), surface(p, a)]);
    let level = height / count;
    let settings = solver.settings();
    let reduced_force = solver.reduced_force(body_force);
    let above = zero_above_surface(solver);
    let error = |a: usize| {
        let x = particles.position[a];
        let p = particles.pressure[a] + hydrostatic(DENSITY, reduced_force, x, settings.reference);
        (p - weight * (level + above - up.dot(x))).abs()
    };
    let worst = fluid(solver).map(error).fold(0.0, Real::max);
    [worst / (weight * LAYERS as Real * settings.fluid.spacing), level]
}

/// Water at rest under a body force.
///
/// # Errors
/// [`ExperimentError`] if a step fails.
pub fn rest(setup: &RestSetup) -> Result<Rest, ExperimentError> {
    let RestSetup { spacing, tilt, jitter, seconds, scheme } = *setup;
    let body_force = Vector::new(tilt * GRAVITY, 0.0, -GRAVITY);
    let rise = (0.5 * tilt.abs() * LAYERS as Real).ceil() as usize;
    let size = [LAYERS, SLAB, LAYERS + rise + 5];
    let mut vessel = Vessel::new(size, spacing, [WALLS, PERIODIC, OPEN_TOP]).filled([LAYERS, SLAB, LAYERS + rise]);
    vessel.reference = spacing * Vector::new(0.5 * LAYERS as Real, 0.0, LAYERS as Real);
    vessel.scheme = scheme;
    let (reference, surface) = (vessel.reference, body_force);
    vessel.fluid.retain(|particle| surface.dot(particle.position - reference) > 0.0);
    vessel.jitter(jitter);
    vessel.scheme = scheme;
    let mut solver = vessel.solver()?;
    let scale = (GRAVITY * LAYERS as Real * spacing).sqrt();
    let mut found = Rest::default();
    advance(&mut solver, [0.0, FIRST], under(body_force), |_, solver, _| {
        found.first_speed = found.first_speed.max(solver.largest_speed() / scale);
    })?;
    found.pressure = hydrostatics(&solver, body_force)[0];
    if jitter > 0.0 || tilt != 0.0 {
        for _ in 0..RELAXATION.0 {
            let dt = solver.stable_step(body_force).dt;
            solver.step(dt, &under(body_force)(0.0, dt), |_| ())?;
            solver.set_velocities(|p, a| RELAXATION.1 * p.velocity[a]);
        }
    }
    let before = hydrostatics(&solver, body_force)[1];
    let (mut strain, mut energy): ([Option<Real>; 2], [Real; 2]) = ([None; 2], [0.0; 2]);
    let mut counts = [0.0; 2];
    advance(&mut solver, [0.0, seconds], under(body_force), |time, solver, report| {
        strain = [strain[0].or(Some(report.strain[0])), Some(report.strain[0])];
        let third = (3.0 * time / seconds * (1.0 - 1e-9)) as usize;
        if third != 1 {
            energy[third / 2] += kinetic_energy(solver);
            counts[third / 2] += 1.0;
        }
        if third == 2 {
            found.speed = found.speed.max(solver.largest_speed() / scale);
        }
    })?;
    let after = hydrostatics(&solver, body_force);
    found.pressure_at_end = after[0];
    found.level = (after[1] - before) / spacing;
    found.strain = strain[1].unwrap_or(0.0) - strain[0].unwrap_or(0.0);
    let [first, last] = [energy[0] / counts[0], energy[1] / counts[1]];
    found.energy = last / first;
    let [mass] = solver.sum_over_fluid(|_, _| [0.5 * solver.particle_mass()]);
    found.mean_speed = (last / mass).sqrt() / scale;
    Ok(found)
}

/// Root mean square of the difference of the acceleration of a falling block of water from gravity, over gravity, after
/// each of `times` \[s]; its particles lie on a lattice, or off it by `jitter` spacings.
///
/// # Errors
/// [`ExperimentError`] if a step fails.
pub fn falling_block(scheme: Scheme, jitter: Real, times: &[Real]) -> Result<Vec<Real>, ExperimentError> {
    let mut vessel = Vessel::new([12, 12, 24], 1e-3, [OPEN; 3]).filled([12; 3]);
    vessel.scheme = scheme;
    vessel.jitter(jitter);
    let mut solver = vessel.solver()?;
    let (mut errors, mut time) = (Vec::new(), 0.0);
    for &end in times {
        advance(&mut solver, [time, end], under(DOWN), |_, _, _| ())?;
        time = end;
        let wrong = |velocity: Vector| (velocity / time - DOWN).length_squared() / DOWN.length_squared();
        let [sum, count] = solver.sum_over_fluid(|p, a| [wrong(p.velocity[a]), 1.0]);
        errors.push((sum / count).sqrt());
    }
    Ok(errors)
}
