//! Jets of water that falls to and fro in a closed box.

use sazanami_numerics::Real;

use super::vessel::{DOWN, Energy, ExperimentError, GRAVITY, PERIODIC, Vessel, WALLS, kinetic_energy, under};
use sazanami_mps::boundary::WallFriction;
use sazanami_mps::scheme::Scheme;
use sazanami_mps::solver::Solver;

/// Box of the water that falls to and fro, and the water, in spacings of 1 mm.
const BOX: [usize; 3] = [14, 8, 24];
const WATER: [usize; 3] = [6, 8, 10];
/// Time between two reversals of gravity \[s].
const FALL: Real = 0.1;

/// Water in a closed box whose gravity is reversed again and again: it falls, strikes, and shoots up along the walls.
#[derive(Clone, Copy, Debug, Default)]
pub struct ReversedFall {
    /// Steps done: all, or those before a step failed.
    pub steps: usize,
    /// Reversals of gravity.
    pub reversals: usize,
    /// Largest energy over that after the last reversal.
    pub energy: Real,
    /// Largest rise of the energy above the least since the last reversal, over that after it.
    pub rise: Real,
    /// Largest speed over that of a fall through the box.
    pub speed: Real,
}

/// `steps` steps of water in a closed box, 8 particles thick and periodic in y, walls that slip, from a block in a lower corner;
/// gravity changes its direction every tenth of a second, upwards first.
///
/// # Errors
/// [`ExperimentError`] if the vessel makes no sense.
pub fn reversed_fall(steps: usize, scheme: Scheme) -> Result<ReversedFall, ExperimentError> {
    let mut vessel = Vessel::new(BOX, 1e-3, [WALLS, PERIODIC, WALLS]).filled(WATER);
    (vessel.scheme, vessel.friction) = (scheme, WallFriction::Slip);
    let height = vessel.upper.z;
    let mut solver = vessel.solver()?;
    // Kinetic energy and that of height above the side to which water falls.
    let energy = |solver: &Solver, up: Real| {
        let [height] =
            solver.sum_over_fluid(|p, a| [if up > 0.0 { p.position[a].z } else { height - p.position[a].z }]);
        kinetic_energy(solver) + solver.particle_mass() * GRAVITY * height
    };
    let (mut up, mut since) = (-1.0, 0.0);
    let mut seen = Energy::new(energy(&solver, up));
    let mut found = ReversedFall::default();
    while found.steps < steps {
        let force = up * DOWN;
        let dt = solver.stable_step(force).dt.min(FALL - since);
        let Ok(report) = solver.step(dt, &under(force)(0.0, dt), |_| ()) else { break };
        found.steps += 1;
        found.speed = found.speed.max(report.largest_speed / (2.0 * GRAVITY * height).sqrt());
        seen.see(energy(&solver, up));
        found.energy = found.energy.max(seen.last);
        found.rise = found.rise.max(seen.rise);
        since += dt;
        if since >= FALL * (1.0 - 1e-9) {
            (up, since) = (-up, 0.0);
            seen = Energy::new(energy(&solver, up));
            found.reversals += 1;
        }
    }
    Ok(found)
}
