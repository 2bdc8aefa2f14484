//! Slow flow through periodic simple cubic arrays of fixed spheres.

use std::f64::consts::PI;

use sazanami_dem::{Grain, Motion};
use sazanami_mics::boundary::Boundary;
use sazanami_mics::stability::StepLimits;
use sazanami_numerics::grid::Grid;
use sazanami_numerics::{Real, Vector};

use super::immersed::ball;
use super::tank::{Tank, single, step};
use crate::measured::Measured;
use crate::reference;

/// Force on a sphere over `6 pi mu a U`, `U` the superficial velocity, in a periodic box that a body force drives;
/// about `cells_per_diameter` cells, steps of `viscous` times `dx^2 / nu`. Lengths in edges
/// of the unit cell; the box holds two in each direction.
fn resistance(solid: Real, cells_per_diameter: Real, viscous: Real) -> Result<Real, String> {
    let diameter = (6.0 * solid / PI).cbrt();
    let n = (cells_per_diameter / diameter).round() as usize;
    let grid = Grid::new([2 * n; 3], Vector::ZERO, Vector::splat(2.0));
    let dt = viscous / (n * n) as Real;
    let mut tank = Tank::new(grid, Boundary::all_periodic(), single(1.0, 1.0), dt);
    tank.limits = StepLimits::always(dt);
    let force = 1e-3;
    tank.gravity = Vector::X * force;
    tank.divergence = 1e-10;
    tank.shapes = vec![ball(diameter)?];
    // In the middle of the unit cells: there are no images of grains beyond the sides in x3.
    for cell in 0..8_u8 {
        let corner = Vector::from_array([0, 1, 2].map(|d| Real::from(cell >> d & 1)));
        let place = corner + Vector::splat(0.5) + Vector::new(0.21, 0.37, 0.13) * grid.spacing;
        tank.grains.push(Grain { motion: Motion::Fixed, ..Grain::new(cell.into(), 2.65, place) });
    }
    let mut solver = tank.solver(|domain, boundary, flow| flow.fill_halos(domain, boundary))?;
    let (mut time, mut before, mut flux) = (0.0, 0.0, 0.0);
    let until = 0.6;
    while time < until {
        time += step(&mut solver, time, Real::INFINITY)?.0;
        let faces = solver.flow().face_velocity[0].data();
        let domain = solver.domain();
        let sum = domain.sum_rows(&domain.interior(), |row| [faces[row.shifted(0)].iter().sum()]);
        before = flux;
        flux = sum[0] / (8 * n * n * n) as Real;
    }
    if (flux / before - 1.0).abs() * until / dt > 1e-2 {
        return Err(format!("the flow is not steady: {before} {flux}"));
    }
    // The body force on the box is the force on its spheres, that of the mean pressure gradient included.
    Ok(force / (3.0 * PI * diameter * flux))
}

/// Drag in simple cubic arrays.
pub(crate) fn grain_arrays() -> Result<Vec<Measured>, String> {
    let mut rows = Vec::new();
    for [solid, expected] in reference::rows(reference::ARRAYS, "simple cubic", ["solid_fraction", "k"]) {
        let found = resistance(solid, 8.0, 1.0)?;
        rows.push(Measured::new(
            format!("simple cubic, solid fraction {solid}: drag over Zick and Homsy"),
            found / expected,
        ));
    }
    let [long, short] = [resistance(0.343, 8.0, 1.0)?, resistance(0.343, 8.0, 0.25)?];
    rows.push(Measured::new("simple cubic, 0.343: change with a quarter of the step", (short / long - 1.0).abs()));
    Ok(rows)
}
