//! Jets of water that falls to and fro in a closed box. A case file poses the water; gravity that changes its direction again and again is
//! none that a case has.

use std::error::Error;
use std::path::Path;

use sazanami_dem::Engine;
use sazanami_mps::solver::{Forcing, Solver};
use sazanami_numerics::Real;
use sazanami_parallel::Solo;
use sazanami_posing::assembly::{particles, shared};
use sazanami_posing::case;

use super::vessel::{Energy, kinetic_energy};

/// The water in its box.
const CASE: &str = include_str!("../../verification/mps-jets/water.toml");
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

/// `steps` steps of the water under gravity that changes its direction every tenth of a second, upwards first, with these keys of its
/// case changed.
///
/// # Errors
/// If the case cannot be posed.
pub fn reversed_fall(steps: usize, overrides: &[String]) -> Result<ReversedFall, Box<dyn Error>> {
    let case = case::parse(Path::new("verification/mps-jets/water.toml"), CASE, overrides)?.case;
    let domain = shared::domain(&case, Box::<Solo>::default())?;
    let engine = Engine::new(&domain, particles::setup(&case, &[]), &[])?;
    let mut solver = particles::poured(&case, domain, engine, case.domain.lower.z)?;
    let (height, gravity) = (case.domain.upper.z, case.gravity.length());
    // Kinetic energy and that of height above the side to which water falls.
    let energy = |solver: &Solver, up: Real| {
        let [height] =
            solver.sum_over_fluid(|p, a| [if up > 0.0 { p.position[a].z } else { height - p.position[a].z }]);
        kinetic_energy(solver) + solver.particle_mass() * gravity * height
    };
    let (mut up, mut since) = (-1.0, 0.0);
    let mut seen = Energy::new(energy(&solver, up));
    let mut found = ReversedFall::default();
    while found.steps < steps {
        let force = up * case.gravity;
        let dt = solver.stable_step(force).dt.min(FALL - since);
        let Ok(report) = solver.step(dt, &Forcing { body_force: force, ..Forcing::default() }, |_| ()) else { break };
        found.steps += 1;
        found.speed = found.speed.max(report.largest_speed / (2.0 * gravity * height).sqrt());
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
