//! A bed of grains under deep water: held, or loose so that it falls together and stirs the water in it.

use sazanami_dem::{Grain, Motion, Random};
use sazanami_mps::Role;
use sazanami_mps::filling;
use sazanami_mps::grains::volume;
use sazanami_mps::pressure::hydrostatic;
use sazanami_mps::scheme::Scheme;
use sazanami_mps::solver::{FluidParticle, Solver};
use sazanami_numerics::{Real, Vector};

use super::vessel::{DENSITY, DIAMETER, DOWN, ExperimentError, GRAIN_DENSITY, GRAVITY, OPEN_TOP, PERIODIC};
use super::vessel::{Vessel, WALLS, advance, fluid, lattice, under};

/// Box in diameters; depth of the water.
const SIZE: [usize; 3] = [12, 10, 22];
const DEPTH: Real = 17.0;
/// Steps with held grains in which velocities are damped, and by what.
const DAMPED: (usize, Real) = (400, 0.9);

/// A bed to be watched.
#[derive(Clone, Copy, Debug)]
pub struct BedSetup {
    /// Enhancements.
    pub scheme: Scheme,
    /// Grains to an edge of the lattice across, along and up.
    pub grains: [usize; 3],
    /// Height of the lattice in diameters.
    pub height: Real,
    /// Whether grains stay where they are.
    pub held: bool,
    /// Speed of each grain, in any direction, when it is let go [m/s].
    pub stirred: Real,
    /// Time for which it is watched \[s].
    pub seconds: Real,
}

impl BedSetup {
    /// A dense bed that is held, of void fraction 0.46.
    #[must_use]
    pub fn held(scheme: Scheme) -> Self {
        Self { scheme, grains: [12, 10, 9], height: 8.7, held: true, stirred: 0.0, seconds: 0.04 }
    }

    /// A bed of void fraction 0.61, whose grains fall together by a diameter and more when they are let go.
    #[must_use]
    pub fn loose(scheme: Scheme) -> Self {
        Self { scheme, grains: [11, 9, 8], height: 8.8, held: false, stirred: 0.0, seconds: 0.3 }
    }

    /// The loose bed with its grains thrown about.
    #[must_use]
    pub fn stirred(scheme: Scheme) -> Self {
        Self { stirred: 1.3, ..Self::loose(scheme) }
    }
}

/// State of the water in and over a bed in the last tenth of a watch.
#[derive(Clone, Copy, Debug, Default)]
pub struct WateredBed {
    /// Largest difference of the pressure from the hydrostatic of the level of all volumes less its mean, over `rho g H`.
    pub pressure: Real,
    /// Mean difference, over `rho g H`.
    pub mean_pressure: Real,
    /// Force of the pressure on grains over `rho g V`, mean and root mean square about it.
    pub buoyancy: [Real; 2],
    /// Volume strain of the water, mean and root mean square.
    pub strain: [Real; 2],
    /// Speed of the water over `sqrt(g H)`, largest and root mean square.
    pub speed: [Real; 2],
    /// Largest speed of the water over `sqrt(g H)` at any time.
    pub fastest: Real,
    /// Largest part of the water that is isolated, at any time.
    pub isolated: Real,
    /// Rms speed of the grains [m/s].
    pub grains: Real,
    /// Way of the mean grain down, in diameters.
    pub sunk: Real,
    /// Number of steps of the watch.
    pub steps: usize,
}

/// Mean difference of the pressure from the hydrostatic and the largest from that, over `rho g H`; of water that is not
/// isolated.
fn pressure_errors(solver: &Solver, level: Real) -> [Real; 2] {
    let (particles, settings) = (solver.particles(), solver.settings());
    let reduced = solver.reduced_force(DOWN);
    let error = |a: usize| {
        let x = particles.position[a];
        let p = particles.pressure[a] + hydrostatic(DENSITY, reduced, x, settings.reference);
        p - DENSITY * GRAVITY * (level - x.z)
    };
    let water = || fluid(solver).filter(|&a| particles.role[a] != Role::Inactive);
    let (sum, count) = water().map(error).fold((0.0, 0.0), |(sum, count), e| (sum + e, count + 1.0));
    let mean = sum / count;
    let largest = water().map(|a| (error(a) - mean).abs()).fold(0.0, Real::max);
    [mean, largest].map(|e| e / (DENSITY * GRAVITY * DEPTH * DIAMETER))
}

/// Force of the pressure on the grains over `rho g V`, mean and spread.
fn buoyancy(solver: &Solver) -> [Real; 2] {
    let phase = solver.grains();
    let owned = phase.engine().grains().owned();
    let scale = DENSITY * GRAVITY * volume(DIAMETER);
    let one = |g: usize| phase.forces(g)[1].z / scale;
    let mean = (0..owned).map(one).sum::<Real>() / owned as Real;
    let square = (0..owned).map(|g| (one(g) - mean).powi(2)).sum::<Real>() / owned as Real;
    [mean, square.sqrt()]
}

/// The bed before its grains are let go.
fn posed(setup: &BedSetup) -> Result<Solver, ExperimentError> {
    let d = DIAMETER;
    let mut vessel = Vessel::new(SIZE, d, [WALLS, PERIODIC, OPEN_TOP]);
    (vessel.scheme, vessel.longest) = (setup.scheme, 2e-4);
    vessel.reference = Vector::new(0.0, 0.0, DEPTH * d);
    let [n1, n2, n3] = setup.grains.map(|n| n as Real);
    let cell = Vector::new(vessel.upper.x / n1, vessel.upper.y / n2, setup.height * d / n3);
    let mut random = Random::new(3);
    let mut way = || 0.05 * d * random.between(-1.0, 1.0);
    let motion = if setup.held { Motion::Fixed } else { Motion::Free };
    let places = lattice(setup.grains).map(|place| cell * place + Vector::new(way(), way(), way()));
    let grains = places.enumerate().map(|(n, x)| Grain { motion, ..Grain::new(n as u64, GRAIN_DENSITY, x) });
    vessel.grains = grains.collect();
    let domain = vessel.domain();
    let mut phase = vessel.grain_phase(&domain)?;
    phase.place(&domain, &vessel.tank());
    let mean = |z: Real| {
        let across = Vector::new(vessel.upper.x / 40.0, vessel.upper.y / 32.0, 0.0);
        let places = lattice([40, 32, 1]).map(|s| s * across + z * Vector::Z);
        places.map(|x| phase.void_fraction(x)).sum::<Real>() / 1280.0
    };
    let places = filling::layers(vessel.lower, vessel.upper, DEPTH * d, d, mean);
    vessel.fluid = places.into_iter().map(|position| FluidParticle { position, velocity: Vector::ZERO }).collect();
    let mut solver = vessel.solver()?;
    solver.grains_mut().freeze(true);
    for _ in 0..DAMPED.0 {
        let dt = solver.stable_step(DOWN).dt;
        solver.step(dt, &under(DOWN)(0.0, dt), |_| ())?;
        solver.set_velocities(|p, a| DAMPED.1 * p.velocity[a]);
    }
    solver.set_velocities(|_, _| Vector::ZERO);
    solver.grains_mut().freeze(false);
    if setup.stirred > 0.0 {
        throw(&mut solver, setup.stirred);
    }
    Ok(solver)
}

/// Gives each grain a velocity of `speed` [m/s] in a direction of its own.
fn throw(solver: &mut Solver, speed: Real) {
    let (engine, domain) = solver.engine_mut();
    for g in 0..engine.grains().owned() {
        let mut random = Random::new(engine.grains().id[g]);
        let mut way = || random.between(-1.0, 1.0);
        engine.set_velocity(g, speed * Vector::new(way(), way(), way()).normalize_or_zero(), Vector::ZERO);
    }
    engine.refresh_ghosts(domain);
}

/// A bed under water, after its grains are let go.
///
/// # Errors
/// [`ExperimentError`] if a step fails.
pub fn watered_bed(setup: &BedSetup) -> Result<WateredBed, ExperimentError> {
    let mut solver = posed(setup)?;
    let d = DIAMETER;
    let (grains, [count]) = (setup.grains.iter().product::<usize>() as Real, solver.sum_over_fluid(|_, _| [1.0]));
    let width = solver.tank().upper - solver.tank().lower;
    let level = (count * d.powi(3) + grains * volume(d)) / (width.x * width.y);
    let height = |solver: &Solver| {
        let grains = solver.grains().engine().grains();
        (0..grains.owned()).map(|g| grains.position[g].z).sum::<Real>() / grains.owned() as Real
    };
    let (before, wave) = (height(&solver), (GRAVITY * DEPTH * d).sqrt());
    let (mut found, mut seen) = (WateredBed::default(), 0.0);
    advance(&mut solver, [0.0, setup.seconds], under(DOWN), |time, solver, report| {
        found.steps += 1;
        found.fastest = found.fastest.max(report.largest_speed / wave);
        found.isolated = found.isolated.max(report.isolated as Real / count);
        if time < 0.9 * setup.seconds {
            return;
        }
        seen += 1.0;
        let [mean, largest] = pressure_errors(solver, level);
        found.pressure = found.pressure.max(largest);
        found.mean_pressure += mean;
        let [squares] = solver.sum_over_fluid(|p, a| [p.velocity[a].length_squared()]);
        found.speed[0] = found.speed[0].max(report.largest_speed / wave);
        found.speed[1] += (squares / count).sqrt() / wave;
        let moving = solver.grains().engine().grains();
        let square = (0..moving.owned()).map(|g| moving.velocity[g].length_squared()).sum::<Real>();
        found.grains += (square / grains).sqrt();
        let pushed = buoyancy(solver);
        (0..2).for_each(|n| {
            found.buoyancy[n] += pushed[n];
            found.strain[n] += report.strain[n];
        });
    })?;
    let WateredBed { mean_pressure, buoyancy: [mean, spread], strain: [s, rms], speed: [_, slow], grains, .. } =
        &mut found;
    [mean_pressure, mean, spread, s, rms, slow, grains].into_iter().for_each(|sum| *sum /= seen);
    found.sunk = (before - height(&solver)) / d;
    Ok(found)
}
