//! Friction that the particles add to the water's own: over a bed that is held, and beside a wall where a flow begins.

use sazanami_mps::scheme::Scheme;
use sazanami_mps::solver::{Forcing, Solver};
use sazanami_numerics::mean_flow::{ActsBy, MeanFlow, MeanFlowSettings};
use sazanami_numerics::{Real, Vector};

use super::bed_load::top;
use super::settled_bed::SettledBed;
use super::vessel::{DENSITY, DIAMETER, DOWN, ExperimentError, GRAIN_DENSITY, GRAVITY, PERIODIC, Vessel, WALLS};
use super::vessel::{advance, fluid, under};

/// Mean velocity of the water [m/s].
const SPEED: Real = 0.371;
/// Extent of the channel along and across, thickness of the bed and water above it, in diameters.
const SIZE: [usize; 2] = [12, 12];
const LAYERS: Real = 4.0;
const WATER: Real = 8.0;
/// Time from the laminar profile on, and that after which is averaged \[s].
const TIME: Real = 0.25;
const FROM: Real = 0.1;
/// Kinematic viscosity of the liquid in the channel, whose layer above the bed is resolved [m^2/s].
const VISCOSITY: Real = 1e-5;

/// Laminar flow over a bed that is held.
#[derive(Clone, Copy, Debug, Default)]
pub struct BedStress {
    /// Shear stress on the bed by the force that drives the flow, over `(rho_s - rho) g d` (Shields).
    pub shields: Real,
    /// The same of a film of this mean velocity over a smooth floor, `3 nu U/h`.
    pub of_film: Real,
    /// Mean velocity of the water one to two and a half diameters below the top of the bed, over the friction velocity.
    pub pore: Real,
}

/// A film of liquid over a bed that is held, at a given mean velocity, from its laminar profile; particles of `spacing`
/// diameters. Means from 0.1 to 0.25 s.
///
/// # Errors
/// [`ExperimentError`] if a step fails.
pub fn bed_stress(scheme: Scheme, spacing: Real) -> Result<BedStress, ExperimentError> {
    let bed = SettledBed {
        scheme,
        spacing: Some(spacing),
        viscosity: Some(VISCOSITY),
        size: SIZE,
        layers: LAYERS,
        water: WATER,
        glued: 2.0 * LAYERS,
        endless: true,
        ..SettledBed::default()
    };
    let mut solver = bed.solver()?;
    let (level, d) = (top(&solver), DIAMETER);
    let depth = bed.depth() - level;
    let profile = |z: Real| 1.5 * SPEED * (1.0 - (1.0 - ((z - level) / depth).clamp(0.0, 1.0)).powi(2));
    solver.set_velocities(|p, a| profile(p.position[a].z) * Vector::X);
    solver.hold_mean_flow(MeanFlow::new(MeanFlowSettings {
        velocity: SPEED * Vector::X,
        held: [true, false, false],
        net: false,
        above: level,
        area: (SIZE[0] * SIZE[1]) as Real * d * d,
        answer: 0.05,
        rise: 0.0,
        acts_by: ActsBy::Mass,
        beside: Vector::ZERO,
        moves_box: false,
    }));
    let (mut last, mut seen, mut stress, mut below) = (0.0, 0.0, 0.0, [0.0; 2]);
    advance(&mut solver, [0.0, TIME], under(DOWN), |time, solver, report| {
        let dt = time - last;
        last = time;
        if time < FROM {
            return;
        }
        seen += dt;
        stress += dt * report.mean_flow.expect("a mean velocity is held").stress.x;
        let [sum, count] = solver.sum_over_fluid(|p, a| {
            let deep = (level - p.position[a].z) / d;
            if (1.0..2.5).contains(&deep) { [p.velocity[a].x, 1.0] } else { [0.0; 2] }
        });
        below = [below[0] + dt * sum, below[1] + dt * count];
    })?;
    let stress = stress / seen;
    let reduced = (GRAIN_DENSITY - DENSITY) * GRAVITY * d;
    Ok(BedStress {
        shields: stress / reduced,
        of_film: 3.0 * DENSITY * VISCOSITY * SPEED / depth / reduced,
        pore: below[0] / below[1] / (stress / DENSITY).sqrt(),
    })
}

/// Spacings between the walls of a flow that begins, and from a wall to the plane where its friction is looked at.
const BETWEEN: usize = 24;
const AWAY: usize = 2;

/// Means of the velocity along x in the layers of a spacing from a wall to the middle, of both halves [m/s].
fn layers(solver: &Solver) -> [Real; BETWEEN / 2] {
    let (mut sums, particles) = ([[0.0; 2]; BETWEEN / 2], solver.particles());
    for a in fluid(solver) {
        let layer = (particles.position[a].z / DIAMETER).clamp(0.0, BETWEEN as Real - 0.5) as usize;
        let sum = &mut sums[layer.min(BETWEEN - 1 - layer)];
        *sum = [sum[0] + particles.velocity[a].x, sum[1] + 1.0];
    }
    sums.map(|[sum, count]| sum / count.max(1.0))
}

/// Viscosity of the particles two spacings from no-slip walls, over `U l0`: water of one velocity `U` between two walls, whose
/// momentum beyond a plane falls by the stress there, over the slope of its velocity; means from 0.15 to 0.3 s. (Farther away
/// that slope is nothing: at three spacings `exp(-10)` of that at the wall.)
///
/// # Errors
/// [`ExperimentError`] if a step fails.
pub fn started_flow(scheme: Scheme) -> Result<Real, ExperimentError> {
    let size = [12, 8, BETWEEN];
    let mut vessel = Vessel::new(size, DIAMETER, [PERIODIC, PERIODIC, WALLS]).filled(size);
    vessel.scheme = scheme;
    vessel.set_velocity(|_| SPEED * Vector::X);
    let mut solver = vessel.solver()?;
    let still = |_: Real, _: Real| Forcing::default();
    advance(&mut solver, [0.0, 0.15], still, |_, _, _| ())?;
    let momentum = |layers: &[Real]| DIAMETER * layers[AWAY..].iter().sum::<Real>();
    let (before, mut last, mut slopes) = (layers(&solver), 0.15, 0.0);
    advance(&mut solver, [0.15, 0.3], still, |time, solver, _| {
        let now = layers(solver);
        slopes += (time - last) * (now[AWAY] - now[AWAY - 1]) / DIAMETER;
        last = time;
    })?;
    let lost = momentum(&before) - momentum(&layers(&solver));
    Ok((lost / slopes - vessel.viscosity) / (SPEED * DIAMETER))
}
