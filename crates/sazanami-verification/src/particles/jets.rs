//! Jets: one that shears itself in the air, and those of water that falls to and fro in a closed box.

use sazanami_numerics::{Real, Vector};

use super::vessel::{DOWN, Energy, ExperimentError, GRAVITY, OPEN, PERIODIC, SLAB, Vessel, WALLS};
use super::vessel::{advance, kinetic_energy, under};
use sazanami_mps::boundary::WallFriction;
use sazanami_mps::scheme::Scheme;
use sazanami_mps::solver::Solver;

/// Conservation in a jet with a parabolic velocity between free surfaces: inviscid it is steady, with pressure zero.
#[derive(Clone, Copy, Debug)]
pub struct ShearedJet {
    /// Kinetic energy.
    pub energy: Energy,
    /// Largest change of the momentum over the momentum.
    pub momentum: Real,
    /// Root mean square error of the velocity over the root mean square of the exact one.
    pub velocity: Real,
}

/// A jet along x of unit half thickness, `across` particles to it, with the velocity `1 - z^2`, two long and periodic in x and 7
/// particles thick in y, off the lattice by up to a tenth of a spacing, until `t = end`.
///
/// # Errors
/// [`ExperimentError`] if a step fails.
pub fn sheared_jet(across: usize, end: Real, scheme: Scheme) -> Result<ShearedJet, ExperimentError> {
    let spacing = 1.0 / across as Real;
    let thick = 2 * across;
    let mut vessel =
        Vessel::new([thick, SLAB, 2 * thick], spacing, [PERIODIC, PERIODIC, OPEN]).filled([thick, SLAB, thick]);
    vessel.fluid.iter_mut().for_each(|particle| particle.position.z += 1.0);
    (vessel.scheme, vessel.viscosity, vessel.longest) = (scheme, 0.0, 0.15 * spacing);
    vessel.jitter(0.1);
    let exact = |x: Vector| Real::max(1.0 - (x.z - 2.0).powi(2), 0.0) * Vector::X;
    vessel.set_velocity(exact);
    let mut solver = vessel.solver()?;
    let before = solver.fluid_momentum();
    let (mut energy, mut momentum) = (Energy::new(kinetic_energy(&solver)), 0.0);
    advance(&mut solver, [0.0, end], under(Vector::ZERO), |_, solver, _| {
        energy.see(kinetic_energy(solver));
        momentum = Real::max(momentum, (solver.fluid_momentum() - before).length() / before.length());
    })?;
    let [error, scale] = solver.sum_over_fluid(|p, a| {
        let exact = exact(p.position[a]);
        [(p.velocity[a] - exact).length_squared(), exact.length_squared()]
    });
    Ok(ShearedJet { energy, momentum, velocity: (error / scale).sqrt() })
}

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
