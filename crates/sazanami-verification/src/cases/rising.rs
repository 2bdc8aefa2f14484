//! A free sphere that moves through the grid: heavier and lighter than the liquid.

use sazanami_dem::Grain;
use sazanami_mics::boundary::{Boundary, Side};
use sazanami_numerics::grid::Grid;
use sazanami_numerics::{Real, Vector};

use super::immersed::ball;
use super::tank::{Tank, down, largest, single, step};
use crate::measured::{Chart, Measured};

/// Box in diameters.
const SIZE: [Real; 3] = [5.0, 5.0, 12.0];

/// Time and upward velocity of a sphere of relative density `ratio` in a box with slip sides, 8 cells to a diameter:
/// lengths in diameters, velocities in that at which the drag of Clift et al. at Reynolds number `reynolds` balances
/// its weight.
fn history(ratio: Real, reynolds: Real, drag: Real, until: Real) -> Result<Vec<[Real; 2]>, String> {
    let grid = Grid::new([40, 40, 96], Vector::ZERO, Vector::from_array(SIZE));
    let mut sides = [[Side::Slip; 2]; 3];
    sides[2] = [Side::NoSlip; 2];
    let boundary = Boundary::new(sides).map_err(|error| error.to_string())?;
    let mut tank = Tank::new(grid, boundary, single(1.0, 1.0 / reynolds), 0.05);
    tank.gravity = down(0.75 * drag / (ratio - 1.0).abs());
    tank.divergence = 1e-6;
    tank.shapes = vec![ball(1.0)?];
    let z = if ratio < 1.0 { 1.5 } else { SIZE[2] - 1.5 };
    let position = Vector::new(0.5 * SIZE[0], 0.5 * SIZE[1], z) + Vector::new(0.21, 0.37, 0.13) * grid.spacing;
    tank.grains = vec![Grain::new(0, ratio, position)];
    let mut solver = tank.solver(|domain, boundary, flow| flow.fill_halos(domain, boundary))?;
    let (mut time, mut history) = (0.0, vec![[0.0; 2]]);
    while time < until * (1.0 - 1e-9) {
        time += step(&mut solver, time, until)?.0;
        history.push([time, solver.grains().engine().grains().velocity[0].z]);
    }
    Ok(history)
}

/// Largest speed, and the total variation of the speed over it.
fn variation(history: &[[Real; 2]]) -> [Real; 2] {
    let fastest = largest(history.iter().map(|row| row[1].abs()));
    let travelled: Real = history.windows(2).map(|pair| (pair[1][1] - pair[0][1]).abs()).sum();
    let end = history[history.len() - 1][1].abs();
    [fastest, (travelled - (fastest - end)) / fastest]
}

/// Noise of the speed of a sphere that settles across about fifty cells at Reynolds numbers about 20 and 100.
pub(crate) fn moving_sphere() -> Result<(Vec<Measured>, Vec<Chart>), String> {
    let (mut rows, mut charts) = (Vec::new(), Vec::new());
    for (reynolds, drag) in [(20.0, 2.7056), (100.0, 1.0875)] {
        let history = history(1.5, reynolds, drag, 8.5)?;
        let [fastest, variation] = variation(&history);
        rows.push(Measured::new(format!("Re {reynolds}: total variation of the speed over its peak"), variation));
        rows.push(Measured::new(format!("Re {reynolds}: largest speed over that of Clift et al."), fastest));
        charts.push(Chart::new(&format!("Re {reynolds}"), "time", "velocity").computed("8 cells", &history));
    }
    Ok((rows, charts))
}

/// Spheres lighter than the liquid rise and come to rest below a lid.
pub(crate) fn light_sphere() -> Result<(Vec<Measured>, Vec<Chart>), String> {
    let (mut rows, mut chart) = (Vec::new(), Chart::new("Re 20", "time", "velocity"));
    for ratio in [0.7, 0.5, 0.3, 0.1] {
        let history = history(ratio, 20.0, 2.7056, 20.0)?;
        let [fastest, _] = variation(&history);
        let end = largest(history.iter().filter(|row| row[0] > 18.0).map(|row| row[1].abs()));
        rows.push(Measured::new(format!("ratio {ratio}: largest speed over that of Clift et al."), fastest));
        rows.push(Measured::new(format!("ratio {ratio}: largest speed below the lid at the end"), end));
        chart = chart.computed(&format!("ratio {ratio}"), &history);
    }
    Ok((rows, vec![chart]))
}
