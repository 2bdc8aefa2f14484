//! Grains carried along by a steady flow over their bed, in a channel periodic along and across.

use sazanami_mps::grains::volume;
use sazanami_mps::scheme::Scheme;
use sazanami_mps::solver::Solver;
use sazanami_numerics::mean_flow::{ActsBy, MeanFlow, MeanFlowSettings};
use sazanami_numerics::{Real, Vector};

use super::settled_bed::SettledBed;
use super::vessel::{DENSITY, DIAMETER, DOWN, ExperimentError, GRAIN_DENSITY, GRAVITY, advance, under};

/// Extent of the channel along and across, thickness of the bed and water above it, in diameters.
const SIZE: [usize; 2] = [24, 8];
const LAYERS: Real = 6.0;
const WATER: Real = 12.0;
/// Roughness of the bed by Nikuradse, in diameters, and von Karman's constant.
const ROUGHNESS: Real = 2.5;
const KARMAN: Real = 0.41;
/// Time in which the driving force answers to the mean velocity \[s].
const ANSWER: Real = 0.05;
/// Part of the time after which is averaged.
const FROM: Real = 0.4;

/// Steady flow over a bed: what it does to the grains.
#[derive(Clone, Copy, Debug, Default)]
pub struct BedLoad {
    /// Mean velocity of the water above the bed [m/s].
    pub speed: Real,
    /// Shear stress on the bed by the force that drives the flow, over `(rho_s - rho) g d` (Shields).
    pub shields: Real,
    /// The same of a turbulent flow of this mean velocity over a rough bed, by the logarithmic law.
    pub shields_by_log_law: Real,
    /// Volume of grains carried in a unit of width and time, over `sqrt((s - 1) g d^3)` (Einstein).
    pub load: Real,
    /// The part of it more than two diameters below the top of the bed.
    pub deep: Real,
    /// The load in the first and in the second half of the average.
    pub halves: [Real; 2],
}

impl BedLoad {
    /// The load by Wong and Parker (2006), `3.97 (theta - 0.0495)^1.5`, at the Shields number of this flow.
    #[must_use]
    pub fn by_wong_and_parker(&self) -> Real {
        3.97 * Real::max(self.shields - 0.0495, 0.0).powf(1.5)
    }
}

/// Volume flux of the grains per width [m^2/s], and that of grains whose centres lie below `level`.
fn flux(solver: &Solver, level: Real) -> [Real; 2] {
    let grains = solver.grains().engine().grains();
    let width = solver.tank().upper - solver.tank().lower;
    let sum = |below: Real| {
        let moved = (0..grains.owned()).filter(|&g| grains.position[g].z < below).map(|g| grains.velocity[g].x);
        moved.sum::<Real>() * volume(DIAMETER) / (width.x * width.y)
    };
    [sum(Real::INFINITY), sum(level)]
}

/// Top of the bed: a quarter of a diameter below the mean crest of the columns of two diameters \[m].
fn top(solver: &Solver) -> Real {
    let grains = solver.grains().engine().grains();
    let width = solver.tank().upper - solver.tank().lower;
    let columns = [width.x, width.y].map(|width| (0.5 * width / DIAMETER).round() as usize);
    let mut crests = vec![0.0; columns[0] * columns[1]];
    for g in 0..grains.owned() {
        let x = grains.unwrapped_position(g);
        let at = [x.x / width.x, x.y / width.y].map(|part| part.rem_euclid(1.0));
        let [i, j] = [0, 1].map(|n| ((at[n] * columns[n] as Real) as usize).min(columns[n] - 1));
        crests[i + j * columns[0]] = Real::max(crests[i + j * columns[0]], x.z + 0.5 * DIAMETER);
    }
    crests.iter().sum::<Real>() / crests.len() as Real - 0.25 * DIAMETER
}

/// The bed under a flow held at the mean velocity that a turbulent flow of `shields` has by the logarithmic law, for `seconds`.
///
/// # Errors
/// [`ExperimentError`] if a step fails.
pub fn bed_load(scheme: Scheme, shields: Real, seconds: Real) -> Result<BedLoad, ExperimentError> {
    let bed = SettledBed {
        scheme,
        size: SIZE,
        layers: LAYERS,
        water: WATER,
        glued: 0.75,
        endless: true,
        ..SettledBed::default()
    };
    let mut solver = bed.solver()?;
    let d = DIAMETER;
    let reduced = (GRAIN_DENSITY / DENSITY - 1.0) * GRAVITY * d;
    let level = top(&solver);
    let depth = bed.depth() - level;
    let mean = (11.0 * depth / (ROUGHNESS * d)).ln() / KARMAN;
    let friction = (shields * reduced).sqrt();
    let law = |z: Real| friction / KARMAN * Real::max(30.0 * (z - level) / (ROUGHNESS * d), 1.0).ln();
    solver.set_velocities(|p, a| law(p.position[a].z) * Vector::X);
    let target = friction * mean;
    let area = (SIZE[0] * SIZE[1]) as Real * d * d;
    let velocity = target * Vector::X;
    solver.hold_mean_flow(MeanFlow::new(MeanFlowSettings {
        velocity,
        held: velocity.to_array().map(|u| u != 0.0),
        net: false,
        above: level,
        area,
        answer: ANSWER,
        rise: 0.0,
        acts_by: ActsBy::Mass,
        beside: Vector::ZERO,
        moves_box: false,
    }));
    let (mut found, mut seen) = (BedLoad::default(), [0.0; 2]);
    let mut last = 0.0;
    advance(&mut solver, [0.0, seconds], under(DOWN), |time, solver, report| {
        let dt = time - last;
        last = time;
        let flow = report.mean_flow.expect("a mean velocity is held");
        let [all, deep] = flux(solver, level - 2.0 * d);
        if time < FROM * seconds {
            return;
        }
        let half = usize::from(time > 0.5 * (1.0 + FROM) * seconds);
        seen[half] += dt;
        found.speed += flow.velocity.x * dt;
        found.shields += flow.stress.x * dt;
        found.halves[half] += all * dt;
        found.deep += deep * dt;
    })?;
    let whole = seen[0] + seen[1];
    let einstein = (reduced * d * d).sqrt();
    found.load = (found.halves[0] + found.halves[1]) / whole / einstein;
    (0..2).for_each(|n| found.halves[n] /= seen[n] * einstein);
    found.deep /= whole * einstein;
    found.speed /= whole;
    found.shields /= whole * DENSITY * reduced;
    found.shields_by_log_law = (found.speed / mean).powi(2) / reduced;
    Ok(found)
}
