//! A sphere settling in a tank of oil (ten Cate, Nieuwstad, Derksen and Van den Akker 2002).

use sazanami_dem::Grain;
use sazanami_mics::boundary::Boundary;
use sazanami_mics::grains::Exchange;
use sazanami_numerics::geometry::{ContactSphereRule, Shape, VolumeRule};
use sazanami_numerics::grid::Grid;
use sazanami_numerics::{Real, Vector};

use super::tank::{Tank, down, single, step};
use crate::measured::{Chart, Measured};
use crate::reference;

const DIAMETER: Real = 15e-3;
/// Longest step \[s], a tenth of the shortest time in which the sphere takes up its speed; else the limits decide.
const LONGEST: Real = 4e-3;

/// A run of the experiment.
#[derive(Clone, Copy)]
struct Oil {
    name: &'static str,
    density: Real,
    viscosity: Real,
    /// By when it is reached \[s].
    until: Real,
}

const E1: Oil = Oil { name: "E1", density: 970.0, viscosity: 0.373, until: 1.5 };
const E2: Oil = Oil { name: "E2", density: 965.0, viscosity: 0.212, until: 0.8 };
/// Largest speed of the sphere in it [m/s].
const E2_FASTEST: Real = 0.05718;
const E3: Oil = Oil { name: "E3", density: 962.0, viscosity: 0.113, until: 1.2 };
const E4: Oil = Oil { name: "E4", density: 960.0, viscosity: 0.058, until: 1.05 };

/// Time \[s] and velocity [m/s] of the sphere until `oil.until`, in steps of at most `longest` \[s].
fn fall(oil: Oil, cells_per_diameter: Real, exchange: Exchange, longest: Real) -> Result<Vec<[Real; 2]>, String> {
    let width = DIAMETER / cells_per_diameter;
    let extent = Vector::new(0.1, 0.1, 0.16);
    let grid = Grid::new(extent.to_array().map(|l| (l / width).round() as usize), Vector::ZERO, extent);
    let mut tank = Tank::new(grid, Boundary::closed(), single(oil.density, oil.viscosity), longest);
    tank.exchange = exchange;
    tank.gravity = down(9.81);
    tank.divergence = 1e-6;
    let sphere = Shape::sphere(DIAMETER, 3, VolumeRule::Preserve, &ContactSphereRule::Single);
    tank.shapes = vec![sphere.map_err(|error| error.to_string())?];
    tank.grains = vec![Grain::new(0, 1120.0, Vector::new(0.05, 0.05, 0.1275))];
    let mut solver = tank.solver(|domain, boundary, flow| flow.fill_halos(domain, boundary))?;
    let (mut time, mut history) = (0.0, vec![[0.0; 2]]);
    while time < oil.until * (1.0 - 1e-9) {
        time += step(&mut solver, time, oil.until)?.0;
        history.push([time, solver.grains().engine().grains().velocity[0].z]);
    }
    Ok(history)
}

/// Largest speed, and how much further than up to it and down to the last value the speed travels, over it.
fn peak(history: &[[Real; 2]]) -> [Real; 2] {
    let fastest = history.iter().map(|row| -row[1]).fold(0.0, Real::max);
    let end = -history[history.len() - 1][1];
    let variation: Real = history.windows(2).map(|pair| (pair[1][1] - pair[0][1]).abs()).sum();
    [fastest, (variation - (fastest - end)) / fastest]
}

/// At the given numbers of cells to a diameter.
fn compared(oils: &[Oil], resolutions: &[u32]) -> Result<(Vec<Measured>, Vec<Chart>), String> {
    let (mut rows, mut charts) = (Vec::new(), Vec::new());
    for oil in oils {
        let mut chart = Chart::new(oil.name, "time [s]", "velocity [m/s]");
        for &n in resolutions {
            let history = fall(*oil, n.into(), Exchange::Surface, LONGEST)?;
            let [fastest, variation] = peak(&history);
            rows.push(Measured::new(format!("{}, {n} cells: largest speed", oil.name), fastest));
            rows.push(Measured::new(format!("{}, {n} cells: total variation of the speed", oil.name), variation));
            chart = chart.computed(&format!("{n} cells"), &history);
        }
        let mut measured = reference::rows(reference::SETTLING, oil.name, ["time_s", "velocity_m_per_s"]);
        measured.retain(|row| row[0] <= oil.until);
        charts.push(chart.reference("ten Cate et al.", &measured));
    }
    Ok((rows, charts))
}

/// A settling sphere of 8 cells a diameter, Reynolds numbers 1.5 to 31.9; with a quarter of the step at 4.1 (ten Cate et al. 2002).
pub(crate) fn settling() -> Result<(Vec<Measured>, Vec<Chart>), String> {
    let (mut rows, charts) = compared(&[E1, E2, E3, E4], &[8])?;
    let [fine, _] = peak(&fall(E2, 8.0, Exchange::Surface, 0.25 * LONGEST)?);
    rows.push(Measured::new("E2, 8 cells, a quarter of the step: largest speed", fine));
    Ok((rows, charts))
}

/// The same with 12 cells a diameter.
pub(crate) fn settling_rest() -> Result<(Vec<Measured>, Vec<Chart>), String> {
    compared(&[E1, E2, E3, E4], &[12])
}

/// Narrow spheres at Re 4.1: largest speed over that of the experiment; and what `auto` makes of spheres on both sides of four
/// cells.
pub(crate) fn settling_narrow() -> Result<Vec<Measured>, String> {
    let speed = |cells, exchange| -> Result<Real, String> {
        Ok(peak(&fall(E2, cells, exchange, 0.25 * LONGEST)?)[0] / E2_FASTEST)
    };
    let mut rows = Vec::new();
    for cells in [4.0, 3.0, 2.0] {
        let (surface, exact) = (speed(cells, Exchange::Surface)?, speed(cells, Exchange::Exact)?);
        rows.push(Measured::new(format!("{cells} cells: largest speed over the experiment's"), surface));
        rows.push(Measured::new(format!("{cells} cells, exact: the same"), exact));
    }
    // 25 and 27 cells between the walls: the sphere falls along the centres of cells in both.
    let over = |exchanges: [Exchange; 2]| -> Result<Real, String> {
        Ok(speed(4.05, exchanges[1])? / speed(3.75, exchanges[0])?)
    };
    let alone = over([Exchange::Surface; 2])?;
    rows.push(Measured::new(
        "4.05 cells over 3.75, by itself, over the same with one exchange",
        over([Exchange::Auto; 2])? / alone,
    ));
    // Control: what a change of the exchange there would do.
    let two = over([Exchange::Exact, Exchange::Surface])?;
    rows.push(Measured::new("4.05 cells over 3.75 with back-projection, over the same", two / alone));
    rows.push(Measured::new("4.05 cells over 3.75: largest speed", alone));
    Ok(rows)
}
