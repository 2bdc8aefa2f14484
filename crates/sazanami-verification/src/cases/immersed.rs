//! A sphere in one liquid: added mass and drag.

use sazanami_dem::{Grain, Motion};
use sazanami_mics::boundary::{Boundary, Side};
use sazanami_mics::grains::Exchange;
use sazanami_mics::stability::StepLimits;
use sazanami_numerics::geometry::{ContactSphereRule, Shape, VolumeRule};
use sazanami_numerics::grid::Grid;
use sazanami_numerics::{Real, Vector};

use super::tank::{Tank, down, single, step};
use crate::measured::Measured;

const BOTH: [(&str, Exchange); 2] = [("stress", Exchange::Stress), ("exact", Exchange::Exact)];

fn ball(diameter: Real) -> Result<Shape, String> {
    Shape::sphere(diameter, 3, VolumeRule::Preserve, &ContactSphereRule::Single).map_err(|error| error.to_string())
}

/// Acceleration of a released sphere of relative density `ratio` over gravity: mean over the first 0.05 diameters of
/// travel, in an inviscid liquid in a box 10 diameters wide.
fn release(ratio: Real, exchange: Exchange, cells_per_diameter: usize) -> Result<Real, String> {
    let (diameter, gravity) = (0.01, 9.81);
    let n = 10 * cells_per_diameter;
    let grid = Grid::new([n; 3], Vector::ZERO, Vector::splat(10.0 * diameter));
    let boundary = Boundary::new([[Side::Slip; 2]; 3]).map_err(|error| error.to_string())?;
    let expected = gravity * (ratio - 1.0) / (ratio + 0.5);
    let travel = 0.05 * diameter;
    let dt = (2.0 * travel / expected).sqrt() / 30.0;
    let mut tank = Tank::new(grid, boundary, single(1e3, 0.0), dt).inviscid();
    tank.limits = StepLimits::always(dt);
    tank.exchange = exchange;
    tank.gravity = down(gravity);
    tank.shapes = vec![ball(diameter)?];
    // Off the faces of the cells, as grains are.
    let start = Vector::splat(5.0 * diameter) + Vector::new(0.21, 0.37, 0.13) * grid.spacing;
    tank.grains = vec![Grain::new(0, 1e3 * ratio, start)];
    let mut solver = tank.solver(|domain, boundary, flow| flow.fill_halos(domain, boundary))?;
    let mut time = 0.0;
    for _ in 0..200 {
        time += step(&mut solver, time, Real::INFINITY)?.0;
        let grains = solver.grains().engine().grains();
        if start.z - grains.position[0].z >= travel {
            return Ok(-grains.velocity[0].z / time / gravity);
        }
    }
    Err("the sphere does not fall".to_owned())
}

/// 5.3: added mass of a sphere. The stress integral suits it: the exact exchange moves partly covered cells along.
pub(crate) fn added_mass() -> Result<Vec<Measured>, String> {
    let mut rows = Vec::new();
    for ratio in [1.15, 2.65, 7.8] {
        for (name, exchange) in BOTH {
            let found = release(ratio, exchange, 8)?;
            let quantity = format!("{name}, density ratio {ratio}: acceleration over g");
            rows.push(Measured::new(quantity, found));
            if exchange == Exchange::Stress {
                let off = (found / ((ratio - 1.0) / ratio) - 1.0).abs();
                let quantity = format!("control: ratio {ratio}, distance from no added mass");
                rows.push(Measured::new(quantity, off));
            }
        }
    }
    Ok(rows)
}

/// Steady drag of a fixed sphere.
struct Drag {
    coefficient: Real,
    /// From the momentum that enters and leaves the box.
    outer: Real,
    /// Relative change from the last but one tenth of the run to the last.
    change: Real,
}

/// Uniform flow past a fixed sphere in a box 10 diameters wide, all lengths in diameters, velocities in that of the
/// flow.
fn drag(reynolds: Real, cells_per_diameter: usize, exchange: Exchange, until: Real) -> Result<Drag, String> {
    let n = cells_per_diameter;
    let size = Vector::new(10.0, 10.0, 13.0);
    let cells = size.to_array().map(|l| (l * n as Real).round() as usize);
    let grid = Grid::new(cells, Vector::ZERO, size);
    let mut sides = [[Side::Slip; 2]; 3];
    sides[2] = [Side::Inflow { velocity: Vector::Z, volume_fraction: 0.0 }, Side::Outflow { volume_fraction: 0.0 }];
    let boundary = Boundary::new(sides).map_err(|error| error.to_string())?;
    // At most a tenth of dx^2/nu, as for the settling sphere.
    let longest = (0.1 * reynolds / (n * n) as Real).min(0.4 / n as Real);
    let mut tank = Tank::new(grid, boundary, single(1.0, 1.0 / reynolds), longest);
    tank.divergence = 1e-6;
    tank.exchange = exchange;
    tank.shapes = vec![ball(1.0)?];
    let position = Vector::new(5.0, 5.0, 4.5) + Vector::new(0.21, 0.37, 0.13) * grid.spacing;
    tank.grains = vec![Grain { motion: Motion::Fixed, ..Grain::new(0, 2.65, position) }];
    let mut solver = tank.solver(|domain, boundary, flow| {
        flow.velocity[2].fill(1.0);
        flow.fill_halos(domain, boundary);
    })?;
    // Impulses of the last two tenths of the run: a step cut short at the end would make any single force meaningless.
    let area = 0.125 * std::f64::consts::PI;
    let (mut time, mut sums) = (0.0, [[0.0; 3]; 2]);
    while time < until * (1.0 - 1e-9) {
        let (dt, report) = step(&mut solver, time, until)?;
        time += dt;
        if time > 0.8 * until {
            let sum = &mut sums[usize::from(time > 0.9 * until)];
            let outer = report.impulses.walls_on_fluid + report.impulses.open_sides;
            for (sum, value) in sum.iter_mut().zip([dt, dt * solver.grains().fluid_forces()[0].z, outer.z]) {
                *sum += value;
            }
        }
    }
    let [early, late] = sums.map(|[duration, force, _]| force / duration / area);
    Ok(Drag { coefficient: late, outer: sums[1][2] / sums[1][0] / area, change: (late / early - 1.0).abs() })
}

/// The exact exchange suits drag: the stress integral misses what partly covered cells take.
fn drags(cells_per_diameter: usize, until: Real) -> Result<Vec<Measured>, String> {
    let mut rows = Vec::new();
    for reynolds in [20.0, 100.0] {
        for (name, exchange) in BOTH {
            let found = drag(reynolds, cells_per_diameter, exchange, until)?;
            let name = format!("{name}, Re {reynolds}");
            let over = found.coefficient / found.outer;
            rows.push(Measured::new(format!("{name}: drag coefficient"), found.coefficient));
            rows.push(Measured::new(format!("{name}: force over outer balance"), over));
            rows.push(Measured::new(format!("{name}: change of the force to the last tenth"), found.change));
        }
    }
    Ok(rows)
}

/// 5.4 with 8 cells to a diameter.
pub(crate) fn drag_coarse() -> Result<Vec<Measured>, String> {
    drags(8, 12.0)
}

/// 5.4 with 16 cells to a diameter.
pub(crate) fn drag_fine() -> Result<Vec<Measured>, String> {
    drags(16, 14.0)
}
