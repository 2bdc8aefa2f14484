//! Flows without walls: decaying vortices, a turning patch, drops that collide.

use std::f64::consts::PI;

use sazanami_numerics::{Real, Vector};

use super::vessel::{Energy, ExperimentError, OPEN, PERIODIC, SLAB, Vessel};
use super::vessel::{advance, kinetic_energy, under};
use sazanami_mps::Role;
use sazanami_mps::scheme::Scheme;

/// Differences of decaying vortices from the solution of Taylor and Green (1937).
#[derive(Clone, Copy, Debug)]
pub struct Vortices {
    /// Rate of decay of the largest speed over the exact one.
    pub decay: Real,
    /// Root mean square error of the velocity over the root mean square of the exact one.
    pub velocity: Real,
}

/// Largest speed over the first one from which on vortices have burst.
const BURST: Real = 10.0;

/// Vortices of Reynolds number 100 in a periodic box of `count` x 7 x `count` particles until `t U/L` = 0.5 or they
/// burst, in steps in which no particle moves by more than `courant` spacings.
///
/// # Errors
/// [`ExperimentError`] if a step fails.
pub fn taylor_green(count: usize, courant: Real, scheme: Scheme) -> Result<Vortices, ExperimentError> {
    let (reynolds, end) = (100.0, 0.5);
    let rate = -8.0 * PI * PI / reynolds;
    let spacing = 1.0 / count as Real;
    let exact = |x: Vector, t: Real| {
        let (x, z) = (2.0 * PI * x.x, 2.0 * PI * x.z);
        (rate * t).exp() * Vector::new(-x.cos() * z.sin(), 0.0, x.sin() * z.cos())
    };
    let mut vessel = Vessel::new([count, SLAB, count], spacing, [PERIODIC; 3]).filled([count, SLAB, count]);
    vessel.viscosity = 1.0 / reynolds;
    vessel.scheme = scheme;
    vessel.longest = courant * spacing;
    vessel.set_velocity(|x| exact(x, 0.0));
    let mut solver = vessel.solver()?;
    let first = solver.largest_speed();
    let mut time = 0.0;
    while time < end && solver.largest_speed() < BURST * first {
        let dt = solver.stable_step(Vector::ZERO).dt.min(end - time);
        solver.step(dt, &under(Vector::ZERO)(time, time + dt), |_| ())?;
        time += dt;
    }
    let [error, scale] = solver.sum_over_fluid(|p, a| {
        let exact = exact(p.position[a], time);
        [(p.velocity[a] - exact).length_squared(), exact.length_squared()]
    });
    Ok(Vortices { decay: (solver.largest_speed() / first).ln() / (rate * time), velocity: (error / scale).sqrt() })
}

/// Measures of a square patch of water turning in the air.
#[derive(Clone, Copy, Debug)]
pub struct TurningPatch {
    /// Angular momentum at the end over that at the start.
    pub angular_momentum: Real,
    /// The same without every tenth particle.
    pub angular_momentum_of_fewer: Real,
    /// Part of the particles that flew on their own at the end.
    pub splashes: Real,
    /// Kinetic energy.
    pub energy: Energy,
}

/// A square of `count` x `count` particles, 7 thick and periodic in y, that turns with unit rate until `t w = end`
/// (Colagrossi 2005).
///
/// # Errors
/// [`ExperimentError`] if a step fails.
pub fn turning_patch(count: usize, end: Real, scheme: Scheme) -> Result<TurningPatch, ExperimentError> {
    let spacing = 1.0 / count as Real;
    // Arms grow to about twice the half diagonal.
    let room = 2 * count;
    let mut vessel =
        Vessel::new([room + count, SLAB, room + count], spacing, [OPEN, PERIODIC, OPEN]).filled([count, SLAB, count]);
    let shift = 0.5 * room as Real * spacing * Vector::new(1.0, 0.0, 1.0);
    let centre = shift + Vector::new(0.5, 0.0, 0.5);
    vessel.fluid.iter_mut().for_each(|particle| particle.position += shift);
    vessel.scheme = scheme;
    vessel.viscosity = 0.0;
    vessel.longest = 0.15 * spacing;
    vessel.set_velocity(|x| Vector::new(x.z - centre.z, 0.0, centre.x - x.x));
    let mut solver = vessel.solver()?;
    let momentum = |p: &sazanami_mps::Particles, a: usize| {
        let (x, u) = (p.position[a] - centre, p.velocity[a]);
        x.z * u.x - x.x * u.z
    };
    let [before] = solver.sum_over_fluid(|p, a| [momentum(p, a)]);
    let first = kinetic_energy(&solver);
    let mut energy = Energy::new(first);
    advance(&mut solver, [0.0, end], under(Vector::ZERO), |_, solver, _| energy.see(kinetic_energy(solver)))?;
    let [after, after_of_fewer, alone, all] = solver.sum_over_fluid(|p, a| {
        let alone = if p.role[a] == Role::Inactive { 1.0 } else { 0.0 };
        let momentum = momentum(p, a);
        [momentum, if p.id[a] % 10 == 0 { 0.0 } else { momentum }, alone, 1.0]
    });
    let [angular_momentum, angular_momentum_of_fewer] = [after, after_of_fewer].map(|sum| sum / before);
    let splashes = alone / all;
    Ok(TurningPatch { angular_momentum, angular_momentum_of_fewer, splashes, energy })
}

/// Conservation in two drops that collide off their centres; nothing but themselves acts on them.
#[derive(Clone, Copy, Debug)]
pub struct CollidedDrops {
    /// Kinetic energy.
    pub energy: Energy,
    /// Largest momentum over the sum of the first momenta of both.
    pub momentum: Real,
    /// Angular momentum at the end over that at the start.
    pub angular_momentum: Real,
    /// The same without every tenth particle.
    pub angular_momentum_of_fewer: Real,
}

/// Two round drops of unit radius, `across` particles to it and 7 thick, that meet with unit speeds, their paths a radius
/// apart, until `t = end`.
///
/// # Errors
/// [`ExperimentError`] if a step fails.
pub fn colliding_drops(across: usize, end: Real, scheme: Scheme) -> Result<CollidedDrops, ExperimentError> {
    let spacing = 1.0 / across as Real;
    let size = [10 * across, SLAB, 8 * across];
    let mut vessel = Vessel::new(size, spacing, [OPEN, PERIODIC, OPEN]).filled(size);
    let middle = Vector::new(5.0, 0.0, 4.0);
    let away = Vector::new(1.0 + spacing, 0.0, 0.5);
    let flat = Vector::new(1.0, 0.0, 1.0);
    let is_in = |x: Vector, side: Real| ((x - middle - side * away) * flat).length() < 1.0;
    vessel.fluid.retain(|particle| is_in(particle.position, 1.0) || is_in(particle.position, -1.0));
    (vessel.scheme, vessel.viscosity, vessel.longest) = (scheme, 0.0, 0.15 * spacing);
    vessel.set_velocity(|x| if x.x < middle.x { Vector::X } else { -Vector::X });
    let mut solver = vessel.solver()?;
    let turning = |p: &sazanami_mps::Particles, a: usize| {
        let (x, u) = (p.position[a] - middle, p.velocity[a]);
        x.z * u.x - x.x * u.z
    };
    let [before, speeds] = solver.sum_over_fluid(|p, a| [turning(p, a), p.velocity[a].length()]);
    let scale = speeds * solver.particle_mass();
    let (mut energy, mut momentum) = (Energy::new(kinetic_energy(&solver)), 0.0);
    advance(&mut solver, [0.0, end], under(Vector::ZERO), |_, solver, _| {
        energy.see(kinetic_energy(solver));
        momentum = Real::max(momentum, solver.fluid_momentum().length() / scale);
    })?;
    let sums = solver.sum_over_fluid(|p, a| {
        let turning = turning(p, a);
        [turning, if p.id[a] % 10 == 0 { 0.0 } else { turning }]
    });
    let [angular_momentum, angular_momentum_of_fewer] = sums.map(|sum| sum / before);
    Ok(CollidedDrops { energy, momentum, angular_momentum, angular_momentum_of_fewer })
}
