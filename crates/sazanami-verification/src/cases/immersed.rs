//! A sphere in one liquid: added mass and drag.

use sazanami_dem::{Grain, Motion};
use sazanami_mics::boundary::{Boundary, FluidName, Side};
use sazanami_mics::grains::Exchange;
use sazanami_mics::stability::StepLimits;
use sazanami_numerics::geometry::{ContactSphereRule, Shape, VolumeRule};
use sazanami_numerics::grid::Grid;
use sazanami_numerics::{Real, Vector};

use super::tank::{Tank, down, single, step};
use crate::measured::Measured;

/// Place of a sphere's centre on the grid, in cells from a corner: off their faces, as grains are.
const PLACE: Vector = Vector::new(0.21, 0.37, 0.13);

pub(super) fn ball(diameter: Real) -> Result<Shape, String> {
    Shape::sphere(diameter, 3, VolumeRule::Preserve, &ContactSphereRule::Single).map_err(|error| error.to_string())
}

/// Acceleration of a released sphere of relative density `ratio` over gravity: mean over the first 0.05 diameters of
/// travel, about `steps` steps, in an inviscid liquid in a box 6 diameters wide, 8 cells to a diameter.
fn release(ratio: Real, exchange: Exchange, steps: u32) -> Result<Real, String> {
    let (diameter, gravity, width) = (0.01, 9.81, 6.0);
    let grid = Grid::new([48; 3], Vector::ZERO, Vector::splat(width * diameter));
    let boundary = Boundary::new([[Side::Slip; 2]; 3]).map_err(|error| error.to_string())?;
    let expected = gravity * (ratio - 1.0).abs() / (ratio + 0.5);
    let travel = 0.05 * diameter;
    let dt = (2.0 * travel / expected).sqrt() / Real::from(steps);
    let mut tank = Tank::new(grid, boundary, single(1e3, 0.0), dt).inviscid();
    tank.limits = StepLimits::always(dt);
    tank.exchange = exchange;
    tank.gravity = down(gravity);
    tank.shapes = vec![ball(diameter)?];
    let start = Vector::splat(0.5 * width * diameter) + PLACE * grid.spacing;
    tank.grains = vec![Grain::new(0, 1e3 * ratio, start)];
    let mut solver = tank.solver(|domain, boundary, flow| flow.fill_halos(domain, boundary))?;
    let mut time = 0.0;
    for _ in 0..3 * steps {
        time += step(&mut solver, time, Real::INFINITY)?.0;
        let grains = solver.grains().engine().grains();
        if (start.z - grains.position[0].z).abs() >= travel {
            return Ok(-grains.velocity[0].z / time / gravity);
        }
    }
    Err("the sphere does not move".to_owned())
}

/// Added mass of a sphere, from lighter than the liquid to steel in water.
pub(crate) fn added_mass() -> Result<Vec<Measured>, String> {
    let mut rows = Vec::new();
    for ratio in [0.5, 1.15, 2.65, 7.8] {
        let coarse = release(ratio, Exchange::Surface, 30)?;
        let fine = release(ratio, Exchange::Surface, 120)?;
        for (steps, found) in [(30, coarse), (120, fine)] {
            rows.push(Measured::new(format!("density ratio {ratio}, {steps} steps: acceleration over g"), found));
        }
        rows.push(Measured::new(format!("density ratio {ratio}: change by the step"), (fine / coarse - 1.0).abs()));
        let off = (coarse / ((ratio - 1.0) / ratio) - 1.0).abs();
        rows.push(Measured::new(format!("control: ratio {ratio}, distance from no added mass"), off));
    }
    rows.push(Measured::new("stress, density ratio 2.65: acceleration over g", release(2.65, Exchange::Stress, 30)?));
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

/// A fixed sphere in uniform flow; lengths in diameters, velocities in that of the flow.
#[derive(Clone, Copy)]
struct Stream {
    reynolds: Real,
    cells_per_diameter: usize,
    exchange: Exchange,
}

impl Stream {
    /// Drag at the end of a run of 8 diameters of travel, in a box 6 diameters wide.
    fn drag(self) -> Result<Drag, String> {
        let (n, width, until) = (self.cells_per_diameter, 6.0, 8.0);
        let size = Vector::new(width, width, width + 3.0);
        let cells = size.to_array().map(|l| (l * n as Real).round() as usize);
        let grid = Grid::new(cells, Vector::ZERO, size);
        let mut sides = [[Side::Slip; 2]; 3];
        sides[2] = [Side::Inflow { velocity: Vector::Z, fluid: FluidName::Gas }, Side::Outflow];
        let boundary = Boundary::new(sides).map_err(|error| error.to_string())?;
        // The Courant number decides.
        let longest = 0.3 / n as Real;
        let mut tank = Tank::new(grid, boundary, single(1.0, 1.0 / self.reynolds), longest);
        tank.divergence = 1e-6;
        tank.exchange = self.exchange;
        tank.shapes = vec![ball(1.0)?];
        let position = Vector::new(0.5, 0.5, 0.5) * width - Vector::Z * 0.5 + PLACE * grid.spacing;
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
}

/// Drag of a sphere that acts by its surface.
fn measured(cells_per_diameter: &[usize]) -> Result<Vec<Measured>, String> {
    let mut rows = Vec::new();
    for reynolds in [20.0, 100.0] {
        for &cells_per_diameter in cells_per_diameter {
            let name = format!("Re {reynolds}, {cells_per_diameter} cells");
            let found = Stream { reynolds, cells_per_diameter, exchange: Exchange::Surface }.drag()?;
            rows.push(Measured::new(format!("{name}: drag coefficient"), found.coefficient));
            rows.push(Measured::new(format!("{name}: force over outer balance"), found.coefficient / found.outer));
            rows.push(Measured::new(format!("{name}: change of the force to the last tenth"), found.change));
        }
    }
    Ok(rows)
}

/// Drag of a fixed sphere of 8 cells to a diameter.
pub(crate) fn drag() -> Result<Vec<Measured>, String> {
    let mut rows = measured(&[8])?;
    let stress = Stream { reynolds: 20.0, cells_per_diameter: 8, exchange: Exchange::Stress };
    rows.push(Measured::new("stress, Re 20: drag coefficient", stress.drag()?.coefficient));
    Ok(rows)
}

/// The same with 12 and 16 cells to a diameter.
pub(crate) fn drag_fine() -> Result<Vec<Measured>, String> {
    measured(&[12, 16])
}
