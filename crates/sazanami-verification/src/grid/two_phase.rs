//! Liquid and gas: layers at rest, a drop in free flight.

use sazanami_numerics::grid::Grid;
use sazanami_numerics::{Real, Vector};

use sazanami_mics::ball::ball;

use super::experiment::{Experiment, ExperimentError};
use sazanami_mics::advection::Convection;
use sazanami_mics::boundary::Boundary;
use sazanami_mics::flow::{DropVelocity, Fluids, Schemes};

/// Water and air as in Yagyu et al. (2015).
pub const WATER_AND_AIR: Fluids =
    Fluids { liquid_density: 1e3, gas_density: 1.0, liquid_viscosity: 1e-3, gas_viscosity: 1e-5 };

/// Gravity of Yagyu et al. (2015) [m/s^2].
pub const GRAVITY: Vector = Vector::new(0.0, 0.0, -9.8);

/// A drop after some time in free flight.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FreeFlight {
    /// Momentum of liquid and gas over that of the drop at the start, less the impulse of gravity on
    /// the drop.
    pub momentum: Real,
    /// Momentum of the liquid alone, the same way.
    pub liquid_momentum: Real,
    /// Way of the drop's centre over the way of a free body.
    pub way: Real,
    /// Change of the liquid volume over the volume, less what was cut with residue.
    pub volume: Real,
    /// Largest part of the liquid fraction out of range.
    pub excess: Real,
}

/// The drop of Yagyu et al. (2015), 5.537 mm at 9 m/s, falling for `time` \[s] through air in a closed
/// box on cells of `width` \[m], with pressure to `tolerance`.
///
/// # Errors
/// [`ExperimentError`] if a step fails.
pub fn drop_in_flight(
    width: Real,
    time: Real,
    convection: Convection,
    tolerance: Real,
) -> Result<FreeFlight, ExperimentError> {
    let extent = Vector::new(13e-3, 13e-3, 20e-3);
    let cells = (extent / width).round();
    let grid = Grid::new([cells.x, cells.y, cells.z].map(|n| n as usize), Vector::ZERO, cells * width);
    let schemes = Schemes { convection, ..Schemes::default() };
    let mut run = Experiment::new(grid, Boundary::closed(), WATER_AND_AIR, schemes);
    run.tolerance.divergence = tolerance;
    let (speed, radius) = (9.0, 0.5 * 5.537e-3);
    let upper = grid.upper();
    let start = Vector::new(0.5 * upper.x, 0.5 * upper.y, upper.z - 1.25 * 2.0 * radius);
    let beta = ball(&run.domain, start, radius, 8);
    run.flow.add_liquid(&run.domain, &run.boundary, &beta, Vector::new(0.0, 0.0, -speed), DropVelocity::Mass);
    let mass = WATER_AND_AIR.liquid_density * run.flow.liquid_volume(&run.domain);
    let volume = run.flow.liquid_volume(&run.domain);
    let height = run.liquid_centre().z;
    run.project(1e-5)?;
    let (mut t, mut clipped, mut excess): (Real, Real, Real) = (0.0, 0.0, 0.0);
    let mut before = Real::INFINITY;
    while t < time {
        let dt = (0.45 / run.flow.advective_rate(&run.domain)).min(1e-5).min(1.2 * before).min(time - t);
        let report = run.step(GRAVITY, dt)?;
        clipped += report.residue.clipped_volume;
        excess = excess.max(report.residue.worst_excess);
        before = dt;
        t += dt;
    }
    let [liquid, gas] = run.flow.momentum(&run.domain).map(|p| p.z);
    let impulse = mass * GRAVITY.z * time;
    let way = height - run.liquid_centre().z;
    Ok(FreeFlight {
        momentum: (liquid + gas - impulse) / (-mass * speed),
        liquid_momentum: (liquid - impulse) / (-mass * speed),
        way: way / (speed * time + 0.5 * -GRAVITY.z * time * time),
        volume: (run.flow.liquid_volume(&run.domain) - volume - clipped) / volume,
        excess,
    })
}
