//! Slow flow through periodic simple cubic and face-centred arrays of fixed spheres.

use std::f64::consts::PI;

use sazanami_dem::{Grain, Motion};
use sazanami_mics::boundary::Boundary;
use sazanami_mics::grains::Exchange;
use sazanami_mics::stability::StepLimits;
use sazanami_numerics::grid::Grid;
use sazanami_numerics::{Real, Vector};

use super::tank::{Tank, ball, single, step};
use crate::measured::Measured;
use crate::reference;

/// A periodic array of equal spheres; lengths in edges of its unit cell.
#[derive(Clone, Copy)]
struct Array {
    /// Centres in the unit cell.
    centres: &'static [[Real; 3]],
    solid_fraction: Real,
    /// About so many cells to a diameter.
    cells_per_diameter: Real,
    /// Steps over `dx^2 / nu`.
    viscous: Real,
}

const SIMPLE_CUBIC: &[[Real; 3]] = &[[0.5, 0.5, 0.5]];
const FACE_CENTRED: &[[Real; 3]] = &[[0.25, 0.25, 0.25], [0.75, 0.75, 0.25], [0.75, 0.25, 0.75], [0.25, 0.75, 0.75]];

impl Array {
    fn diameter(&self) -> Real {
        (6.0 * self.solid_fraction / (PI * self.centres.len() as Real)).cbrt()
    }

    /// Two unit cells in each direction, which a body `force` drives; `n` cells to an edge.
    fn tank(&self, n: usize, force: Real) -> Result<Tank, String> {
        let grid = Grid::new([2 * n; 3], Vector::ZERO, Vector::splat(2.0));
        let dt = self.viscous / (n * n) as Real;
        let mut tank = Tank::new(grid, Boundary::all_periodic(), single(1.0, 1.0), dt);
        tank.limits = StepLimits::always(dt);
        tank.exchange = Exchange::Surface;
        tank.gravity = Vector::X * force;
        tank.divergence = 1e-10;
        tank.shapes = vec![ball(self.diameter())?];
        let cells = (0..2).flat_map(|k| [0, 1].map(|j| [0, 1].map(|i| Vector::new(i.into(), j.into(), k.into()))));
        for corner in cells.flatten() {
            for &centre in self.centres {
                let place = corner + Vector::from_array(centre) + Vector::new(0.21, 0.37, 0.13) * grid.spacing;
                let id = tank.grains.len() as u64;
                tank.grains.push(Grain { motion: Motion::Fixed, ..Grain::new(id, 2.65, place) });
            }
        }
        Ok(tank)
    }

    /// Force on a sphere over `6 pi mu a U`, `U` the superficial velocity.
    fn resistance(self) -> Result<Real, String> {
        let diameter = self.diameter();
        let n = (self.cells_per_diameter / diameter).round() as usize;
        let force = 1e-3;
        let mut solver = self.tank(n, force)?.solver(|domain, boundary, flow| flow.fill_halos(domain, boundary))?;
        let dt = self.viscous / (n * n) as Real;
        let (mut time, mut before, mut flux) = (0.0, 0.0, 0.0);
        // At least so long that the pressure reaches through closed faces.
        let until = (100.0 / (n * n) as Real).max(0.6);
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
        Ok(force / (self.centres.len() as Real * 3.0 * PI * diameter * flux))
    }
}

/// Drag in simple cubic arrays of about 8 cells to a diameter, and in face-centred ones from 8 cells to less than two;
/// and what a step four times shorter changes.
pub(crate) fn grain_arrays() -> Result<Vec<Measured>, String> {
    let mut rows = Vec::new();
    for (name, centres, widths) in
        [("simple cubic", SIMPLE_CUBIC, &[8.0][..]), ("face-centred", FACE_CENTRED, &[8.0, 4.0, 2.7, 2.0, 1.3][..])]
    {
        for [solid_fraction, expected] in reference::rows(reference::ARRAYS, name, ["solid_fraction", "k"]) {
            for &cells_per_diameter in widths {
                let array = Array { centres, solid_fraction, cells_per_diameter, viscous: 1.0 };
                let array_name = format!("{name}, solid fraction {solid_fraction}, {cells_per_diameter} cells");
                let found = array.resistance()?;
                let short = Array { viscous: 0.25, ..array }.resistance()?;
                rows.push(Measured::new(format!("{array_name}: drag over Zick and Homsy"), found / expected));
                let change = (short / found - 1.0).abs();
                rows.push(Measured::new(format!("{array_name}: change with a quarter of the step"), change));
            }
        }
    }
    Ok(rows)
}
