//! Whole steps of moving particles: a wave tank over a bed of spheres, and a dam that breaks.

use std::path::Path;

use sazanami_dem::{Engine, Grain};
use sazanami_mps::solver::{Forcing, Phase, Solver, StepReport};
use sazanami_numerics::Random;
use sazanami_numerics::{Real, Vector};
use sazanami_parallel::Solo;
use sazanami_posing::assembly::grains::member;
use sazanami_posing::assembly::{particles, shared};
use sazanami_posing::case::{self, Case, LoadedCase};
use sazanami_posing::feasible;

use crate::machine::floor_of_bytes;
use crate::stopwatch::{Lap, Stopwatch};
use crate::timing::{Timing, shares, spread};

pub(crate) const GRAVITY: Vector = Vector::new(0.0, 0.0, -9.81);

/// The wave tank of Tazaki et al. Its bed is laid on a lattice, which takes no time to pack.
const TANK: &str = r#"
solver = "mps"
domain = { lower = ["-75 mm", "0 mm", "0 mm"], size = ["150 mm", "20 mm", "35 mm"] }
boundary = { x2 = "periodic", x3_upper = "outflow" }
particles.spacing = "1 mm"
material.glass.density = "2650 kg/m^3"
contact.default = { normal_stiffness = "400 N/m", restitution = 0.5, friction = 0.4 }
grains = { shape.sphere.diameter = "1 mm", count = 33728, placement.packed = {} }
liquid.region.box = { lower = ["-75 mm", "0 mm", "0 mm"], upper = ["75 mm", "20 mm", "20 mm"] }
run.until = "1 s"
"#;
/// Layers of its bed.
const BED_LAYERS: usize = 17;
/// Step in the tank \[s], and the amplitude of its acceleration: 10 mm at 2 Hz [m/s^2].
pub(crate) const TANK_STEP: Real = 2e-4;
const SWAY: Real = 1.58;
/// Body force on the water of the tank [m/s^2].
pub(crate) const SHAKEN: Vector = Vector::new(SWAY, 0.0, GRAVITY.z);
/// Steps in which the water finds its places while it loses a tenth of its speed in each, steps that are not timed
/// and steps that are.
const RELAXATION: usize = 60;
const WARM_UP: usize = 5;
const TANK_STEPS: usize = 15;

/// The dam in a box with walls all around; step \[s]; first and last step that is timed.
const DAM: &str = r#"
solver = "mps"
domain.size = ["100 mm", "40 mm", "80 mm"]
boundary.x3_upper = "outflow"
particles.spacing = "1 mm"
liquid.region.box = { lower = ["0 mm", "0 mm", "0 mm"], upper = ["50 mm", "40 mm", "50 mm"] }
run.until = "1 s"
"#;
pub(crate) const DAM_STEP: Real = 5e-4;
const DAM_STEPS: [usize; 2] = [50, 100];

/// Bytes per pair that a list takes: written once, read by two passes.
const LIST_BYTES: Real = 3.0 * 4.0;
/// Bytes per pair of the pressure equation: column and coefficient.
const COEFFICIENT_BYTES: Real = 8.0;
/// Passes over them besides the iterations: written, diagonal, residual at the beginning and at the end, coarse
/// equation; and columns alone for the gradient and the pushes.
const COEFFICIENT_PASSES: Real = 6.0;

/// The case of a text.
fn posed(text: &str) -> Result<LoadedCase, String> {
    case::parse(Path::new("bench.toml"), text, &[]).map_err(|error| error.to_string())
}

/// The solver of a case with these grains, its water poured between them.
fn poured(loaded: &LoadedCase, grains: &[Grain]) -> Result<Solver, String> {
    let case = &loaded.case;
    let shapes = feasible::shapes_alone(loaded).map_err(|error| error.to_string())?;
    let domain = shared::domain(case, Box::<Solo>::default()).map_err(|error| error.to_string())?;
    let setup = particles::setup(case, &shapes);
    let engine = Engine::new(&domain, setup, grains).map_err(|error| error.to_string())?;
    particles::poured(case, domain, engine, case.domain.lower.z).map_err(|error| error.to_string())
}

/// Spheres of the only population on a centred lattice of solid fraction 0.6, none at its exact place.
fn bed(case: &Case) -> Vec<Grain> {
    let diameter = case.moving_particles().spacing;
    let extent = case.domain.extent() / diameter;
    let edge = 1.204;
    let count = [extent.x, extent.y].map(|length| (length / edge).floor() as usize);
    let size = Vector::new(extent.x / count[0] as Real, extent.y / count[1] as Real, edge);
    let mut random = Random::new(1);
    let mut aside = || random.between(-0.04, 0.04);
    let layer = count[0] * count[1];
    let sphere = |n: usize| {
        let (half, place) = (0.5 * (n / layer % 2) as Real, n % layer);
        let place = Vector::new((place % count[0]) as Real, (place / count[0]) as Real, (n / layer / 2) as Real);
        let place = (place + 0.25 + half) * size + Vector::new(0.0, 0.0, 0.25);
        let jitter = Vector::new(aside(), aside(), aside());
        Grain { position: case.domain.lower + diameter * (place + jitter), ..member(case, 0, n, 1.0) }
    };
    (0..BED_LAYERS * layer).map(sphere).collect()
}

/// Times steps; what they did is reported with the timing.
#[derive(Default)]
struct Steps {
    timing: Timing,
    /// Processor time of the phases in the order of [`Phase`], or time where the system does not report it, of all timed
    /// steps \[s].
    phases: [Real; 5],
    iterations: usize,
    /// Bytes that have to move in a step.
    bytes: Real,
}

impl Steps {
    /// One step, its time without that of the grains.
    fn step(&mut self, solver: &mut Solver, dt: Real, body_force: Vector, timed: bool) -> Result<StepReport, String> {
        let mut now = (Phase::Neighbours, Stopwatch::start());
        let mut laps: Vec<(Phase, Lap)> = Vec::new();
        let report = self::step(solver, dt, body_force, |phase| {
            laps.push((now.0, now.1.stop()));
            now = (phase, Stopwatch::start());
        })?;
        laps.push((now.0, now.1.stop()));
        if timed {
            let busy = laps.iter().filter_map(|(_, lap)| Some(lap.busy_elsewhere? * lap.wall)).sum::<Real>();
            let fluid = || laps.iter().filter(|(phase, _)| *phase != Phase::Grains);
            let wall: Real = fluid().map(|(_, lap)| lap.wall).sum();
            let cpu = fluid().map(|(_, lap)| lap.cpu).sum::<Option<Real>>();
            let busy = laps.iter().any(|(_, lap)| lap.busy_elsewhere.is_some()).then_some(busy / wall);
            self.timing.add(&Lap { wall, cpu, busy_elsewhere: busy }, 1.0);
            laps.iter().for_each(|(phase, lap)| self.phases[*phase as usize] += lap.cpu.unwrap_or(lap.wall));
            self.iterations += report.pressure.iterations;
            let passes = report.pressure.iterations as Real + COEFFICIENT_PASSES;
            self.bytes += report.pairs as Real * (LIST_BYTES + COEFFICIENT_BYTES * passes);
        }
        Ok(report)
    }

    fn finish(mut self, solver: &Solver, words: &str, last: &StepReport) -> Timing {
        let steps = self.timing.values.len().max(1) as Real;
        let fluid = (0..solver.particles().owned()).filter(|&a| solver.particles().is_fluid(a)).count();
        let [_, median, _] = spread(&self.timing.values).unwrap_or_default();
        let [lists, sums, pressure, _, coupling] = self.phases;
        let shares = shares(&[("lists", lists), ("sums", sums), ("pressure", pressure), ("coupling", coupling)]);
        self.timing.unit = "s";
        self.timing.size = format!(
            "{words}: {fluid} fluid and {} wall particles, {} pairs, {:.1} iterations, {:.3e} fluid particles a \
             second; {shares}",
            solver.particles().owned() - fluid,
            last.pairs,
            self.iterations as Real / steps,
            fluid as Real / median.max(1e-300),
        );
        let (floor, how) = floor_of_bytes(
            self.bytes / steps,
            "lists written once and read twice, coefficients written once and read in every iteration and five \
             other passes; no arithmetic",
        );
        self.timing.with_floor(floor, how)
    }
}

/// A step under a body force.
pub(crate) fn step(
    solver: &mut Solver,
    dt: Real,
    body_force: Vector,
    watch: impl FnMut(Phase),
) -> Result<StepReport, String> {
    let forcing = Forcing { body_force, ..Forcing::default() };
    solver.step(dt, &forcing, watch).map_err(|error| error.to_string())
}

/// A wave tank over a bed of loose spheres, its water at rest, and the number of spheres.
pub(crate) fn tank() -> Result<(Solver, usize), String> {
    let loaded = posed(TANK)?;
    let grains = bed(&loaded.case);
    let mut solver = poured(&loaded, &grains)?;
    solver.grains_mut().freeze(true);
    for _ in 0..RELAXATION {
        step(&mut solver, TANK_STEP, GRAVITY, |_| ())?;
        solver.set_velocities(|particles, a| 0.9 * particles.velocity[a]);
    }
    solver.grains_mut().freeze(false);
    Ok((solver, grains.len()))
}

/// Steps of a wave tank over a bed of loose spheres, without the grains' sub-steps.
pub(crate) fn tank_step() -> Result<Timing, String> {
    let (mut solver, spheres) = tank()?;
    let mut steps = Steps::default();
    let mut report = StepReport::default();
    for n in 0..WARM_UP + TANK_STEPS {
        report = steps.step(&mut solver, TANK_STEP, SHAKEN, n >= WARM_UP)?;
    }
    let words = format!("tank of 150 x 20 x 35 mm, {spheres} spheres, step {TANK_STEP:.0e} s");
    Ok(steps.finish(&solver, &words, &report))
}

/// A dam in a box with walls all around.
pub(crate) fn dam() -> Result<Solver, String> {
    poured(&posed(DAM)?, &[])
}

/// Steps of a dam that breaks.
pub(crate) fn dam_break() -> Result<Timing, String> {
    let mut solver = dam()?;
    let mut steps = Steps::default();
    let mut report = StepReport::default();
    for n in 1..=DAM_STEPS[1] {
        report = steps.step(&mut solver, DAM_STEP, GRAVITY, n >= DAM_STEPS[0])?;
    }
    let words = format!("box of 100 x 40 x 80 mm, steps 50 to 100 of {DAM_STEP:.0e} s");
    Ok(steps.finish(&solver, &words, &report))
}
