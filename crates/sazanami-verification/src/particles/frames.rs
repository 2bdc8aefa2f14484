//! The same tank twice: in its own frame with a body force, and in that of the laboratory with walls that move.

use std::f64::consts::PI;

use sazanami_numerics::{Real, Vector};

use super::settled_bed::SettledBed;
use super::vessel::DIAMETER;
use super::vessel::{DOWN, ExperimentError, OPEN_TOP, PERIODIC, SLAB, Vessel, WALLS, fluid, kinetic_energy};
use super::waves::Shaking;
use sazanami_mps::boundary::WallFriction;
use sazanami_mps::scheme::Scheme;
use sazanami_mps::solver::{Forcing, Solver};

/// Steps between two comparisons.
const EVERY: usize = 25;
/// Columns in which profiles are compared.
const COLUMNS: usize = 12;

/// Differences of two frames, each over the root mean square of what is compared.
#[derive(Clone, Copy, Debug, Default)]
pub struct FrameDifference {
    /// Mean velocity along x in the frame of the tank, by columns.
    pub velocity: Real,
    /// The same over the first quarter of the time.
    pub early: Real,
    /// Mean height of the fluid above that at the start, by columns.
    pub height: Real,
    /// Centre of mass from the middle.
    pub centre: Real,
    /// Kinetic energy of the fluid in the frame of the tank.
    pub energy: Real,
    /// Kinetic energy of the grains in the frame of the tank.
    pub bed_energy: Real,
    /// Root mean square height of the bed's upper grains from their mean, at the end.
    pub bed_relief: Real,
    /// Largest displacement of the tank in a step, in spacings: how far the frames could drift apart.
    pub speed: Real,
}

/// Quantities compared at a time.
#[derive(Clone, Debug, Default)]
struct Sample {
    velocity: [Real; COLUMNS],
    height: [Real; COLUMNS],
    centre: Real,
    energy: Real,
    bed_energy: Real,
    bed_relief: Real,
}

impl Sample {
    fn of(solver: &Solver, place: Real, speed: Real) -> Self {
        let (particles, tank) = (solver.particles(), solver.tank());
        let length = tank.upper.x - tank.lower.x;
        let mut sample = Self::default();
        let mut counts: [Real; COLUMNS] = [0.0; COLUMNS];
        for a in fluid(solver) {
            let x = particles.position[a].x - tank.lower.x - place;
            let column = ((x / length * COLUMNS as Real).max(0.0) as usize).min(COLUMNS - 1);
            counts[column] += 1.0;
            sample.velocity[column] += particles.velocity[a].x - speed;
            sample.height[column] += particles.position[a].z;
            sample.centre += x - 0.5 * length;
        }
        let all: Real = counts.iter().sum();
        sample.centre /= all;
        for (n, count) in counts.iter().enumerate() {
            sample.velocity[n] /= count.max(1.0);
            sample.height[n] /= count.max(1.0);
        }
        let [momentum] = solver.sum_over_fluid(|p, a| [p.velocity[a].x]);
        let mass = solver.particle_mass();
        sample.energy = kinetic_energy(solver) - mass * speed * (momentum - 0.5 * all * speed);
        let grains = solver.grains().engine().grains();
        let owned = grains.owned();
        sample.bed_energy =
            (0..owned).map(|g| 0.5 * grains.mass[g] * (grains.velocity[g] - speed * Vector::X).length_squared()).sum();
        if owned > 0 {
            let mut tops = [Real::NEG_INFINITY; COLUMNS];
            for g in 0..owned {
                let x = grains.position[g].x - tank.lower.x - place;
                let column = ((x / length * COLUMNS as Real).max(0.0) as usize).min(COLUMNS - 1);
                tops[column] = tops[column].max(grains.position[g].z);
            }
            let mean = tops.iter().sum::<Real>() / COLUMNS as Real;
            sample.bed_relief = (tops.iter().map(|z| (z - mean).powi(2)).sum::<Real>() / COLUMNS as Real).sqrt();
        }
        sample
    }
}

/// Runs a vessel in steps of `dt` until `end`; in the laboratory's frame with `moving`.
fn run(
    mut solver: Solver,
    shaking: Shaking,
    dt: Real,
    end: Real,
    moving: bool,
) -> Result<Vec<Sample>, ExperimentError> {
    let steps = (end / dt).round() as usize;
    let mut samples = Vec::new();
    for n in 0..steps {
        let to = (n + 1) as Real * dt;
        // Walls move from place to place: their speed jumps between steps, by what the body force is in the tank.
        let place = |step: usize| shaking.motion(step as Real * dt)[0];
        let speed = (place(n + 1) - place(n)) / dt;
        let before = if n > 0 { (place(n) - place(n - 1)) / dt } else { 0.0 };
        let forcing = if moving {
            let [wall_displacement, wall_velocity] = [place(n + 1), speed].map(|part| part * Vector::X);
            Forcing { body_force: DOWN, wall_displacement, wall_velocity, ..Forcing::default() }
        } else {
            Forcing { body_force: DOWN - (speed - before) / dt * Vector::X, ..Forcing::default() }
        };
        solver.step(dt, &forcing, |_| ())?;
        if (n + 1) % EVERY == 0 {
            let [place, speed] = if moving { [shaking.motion(to)[0], speed] } else { [0.0; 2] };
            samples.push(Sample::of(&solver, place, speed));
        }
    }
    Ok(samples)
}

/// Root mean square of `a - b` over that of `a` less its mean, over all samples.
fn difference<const N: usize>(a: &[Sample], b: &[Sample], part: impl Fn(&Sample) -> [Real; N]) -> Real {
    let values = |samples: &[Sample]| samples.iter().flat_map(&part).collect::<Vec<_>>();
    let (a, b) = (values(a), values(b));
    let mean = a.iter().sum::<Real>() / a.len() as Real;
    let scale: Real = a.iter().map(|a| (a - mean).powi(2)).sum();
    let error: Real = a.iter().zip(&b).map(|(a, b)| (a - b).powi(2)).sum();
    (error / scale).sqrt()
}

fn compare(still: &[Sample], moving: &[Sample], shaking: Shaking, dt: Real, spacing: Real) -> FrameDifference {
    let last = |samples: &[Sample]| samples.last().map_or(0.0, |sample| sample.bed_relief);
    fn early(samples: &[Sample]) -> &[Sample] {
        &samples[..samples.len() / 4]
    }
    let bed = last(still);
    let total = |samples: &[Sample]| samples.iter().map(|sample| sample.bed_energy).sum::<Real>();
    FrameDifference {
        velocity: difference(still, moving, |s| s.velocity),
        early: difference(early(still), early(moving), |s| s.velocity),
        height: difference(still, moving, |s| s.height),
        centre: difference(still, moving, |s| [s.centre]),
        energy: difference(still, moving, |s| [s.energy]),
        bed_energy: if bed > 0.0 { total(moving) / total(still) - 1.0 } else { 0.0 },
        bed_relief: if bed > 0.0 { last(moving) / bed - 1.0 } else { 0.0 },
        speed: shaking.amplitude * shaking.rate * dt / spacing,
    }
}

/// The motion of the tank: 10 mm at 2 Hz, grown within half a second.
const SHAKING: Shaking = Shaking { amplitude: 0.01, rate: 4.0 * PI, ramp: 0.5 };

/// Speed that one particle has at the start of a run which is compared with one where it has none [m/s].
const NUDGE: Real = 1e-9;

/// The two frames compared, and the tank's frame with itself after a nudge: what disorder makes of nothing.
fn by_frame_and_by_chance(
    solver: impl Fn() -> Result<Solver, ExperimentError>,
    [dt, end, spacing]: [Real; 3],
) -> Result<[FrameDifference; 2], ExperimentError> {
    let still = run(solver()?, SHAKING, dt, end, false)?;
    let moving = run(solver()?, SHAKING, dt, end, true)?;
    let mut nudged = solver()?;
    nudged.set_velocities(|p, a| p.velocity[a] + if p.id[a] == 0 { NUDGE * Vector::X } else { Vector::ZERO });
    let nudged = run(nudged, SHAKING, dt, end, false)?;
    Ok([&moving, &nudged].map(|other| compare(&still, other, SHAKING, dt, spacing)))
}

/// Water alone, `layers` particles in a depth of 10 mm, in a tank of 120 mm, until `end` \[s]: the frames compared, and
/// one of them with itself after a nudge of 1 nm/s to one particle.
///
/// # Errors
/// [`ExperimentError`] if a step fails.
pub fn frames(scheme: Scheme, layers: usize, end: Real) -> Result<[FrameDifference; 2], ExperimentError> {
    let spacing = 0.01 / layers as Real;
    let along = (0.12 / spacing).round() as usize;
    let mut vessel =
        Vessel::new([along, SLAB, 2 * layers + 4], spacing, [WALLS, PERIODIC, OPEN_TOP]).filled([along, SLAB, layers]);
    (vessel.friction, vessel.scheme) = (WallFriction::Slip, scheme);
    vessel.margin = 2.0 * SHAKING.amplitude;
    let dt = 0.05 * spacing / 0.3;
    by_frame_and_by_chance(|| vessel.solver(), [dt, end, spacing])
}

/// A bed of 4 diameters, the lowest glued to the floor, under 6 diameters of water in a tank of `length` diameters, until `end` \[s];
/// as in [`frames`].
///
/// # Errors
/// [`ExperimentError`] if a step fails.
pub fn frames_with_bed(scheme: Scheme, length: usize, end: Real) -> Result<[FrameDifference; 2], ExperimentError> {
    let dt = 2e-4;
    let size = [length, SLAB + 1];
    let margin = 2.0 * SHAKING.amplitude;
    let bed = SettledBed { scheme, size, layers: 4.0, water: 6.0, margin, glued: 0.75, ..SettledBed::default() };
    by_frame_and_by_chance(|| bed.solver(), [dt, end, DIAMETER])
}
