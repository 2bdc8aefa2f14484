//! Water and air without grains: a drop in flight, a breaking dam.

use crate::grid::dam_break::{GRAVITY, WIDTH};
use crate::grid::{FreeFlight, drop_in_flight};
use sazanami_mics::advection::Convection;
use sazanami_mics::boundary::{Boundary, FluidName, Side};
use sazanami_mics::flow::{DropVelocity, Flow, Schemes};
use sazanami_numerics::domain::Domain;
use sazanami_numerics::geometry::Region;
use sazanami_numerics::grid::Grid;
use sazanami_numerics::{Quaternion, Real, Vector};

use super::shift::best_shift;
use super::tank::{Tank, WATER_AND_AIR, down, fractions, step};
use crate::measured::{Chart, Measured};
use crate::reference::{DAM_BREAK, history as table};

/// Momentum of a drop over mass times speed on the paper's grid.
fn initial_momentum(semi_axes: Vector, mode: DropVelocity) -> Real {
    let grid = Grid::new([44, 46, 36], Vector::ZERO, Vector::new(8.45e-3, 8.45e-3, 6.818e-3));
    let domain = Domain::solo(grid, [false; 3]);
    let boundary = Boundary::closed();
    let mut flow = Flow::new(&domain, WATER_AND_AIR, Schemes::default());
    let region = Region::Spheroid { centre: 0.5 * grid.extent(), semi_axes, orientation: Quaternion::IDENTITY };
    flow.add_liquid(&domain, &boundary, &fractions(&domain, &region), Vector::new(0.0, 0.0, -9.0), mode);
    let mass = WATER_AND_AIR.liquid_density * flow.liquid_volume(&domain);
    flow.momentum(&domain).into_iter().sum::<Vector>().z / (-9.0 * mass)
}

/// The drop of the raindrop cases falls freely at 9 m/s for 1 ms.
pub(crate) fn falling_drop() -> Result<Vec<Measured>, String> {
    let run = |convection| drop_in_flight(0.38e-3, 1e-3, convection, 1e-12).map_err(|error| error.to_string());
    let FreeFlight { momentum, way, volume, .. } = run(Convection::Consistent)?;
    let plain = run(Convection::VelocityForm)?;
    let mut rows = vec![
        Measured::new("consistent: change of momentum, gravity taken off", (momentum - 1.0).abs()),
        Measured::new("consistent: way of the centre over that of a free body", way),
        Measured::new("change of the liquid volume", volume.abs()),
        Measured::new("control: momentum lost by the velocity form", 1.0 - plain.momentum),
        Measured::new("consistent over velocity-form loss", (1.0 - momentum).abs() / (1.0 - plain.momentum)),
    ];
    let shapes = [("sphere", [2.7685e-3, 2.7685e-3]), ("1.6", [3.24e-3, 2.02e-3]), ("2.0", [3.49e-3, 1.74e-3])];
    for (name, [h, v]) in shapes {
        let axes = Vector::new(h, h, v);
        let beta = initial_momentum(axes, DropVelocity::Beta);
        rows.push(Measured::new(format!("{name}: initial momentum, beta"), beta));
        let mass = initial_momentum(axes, DropVelocity::Mass);
        rows.push(Measured::new(format!("{name}: initial momentum, mass"), mass));
    }
    Ok(rows)
}

/// Time \[s], front over width, height over height at the start.
fn dam(cells_per_width: usize, convection: Convection) -> Result<Vec<[Real; 3]>, String> {
    let width = WIDTH / cells_per_width as Real;
    let cells = [14 * cells_per_width, 1, 5 * cells_per_width / 2];
    let extent = Vector::from_array(cells.map(|n| n as Real)) * width;
    let mut sides = [[Side::Slip; 2]; 3];
    sides[1] = [Side::Periodic; 2];
    sides[2][1] = Side::FixedPressure { pressure: 0.0, fluid: FluidName::Gas };
    let boundary = Boundary::new(sides).map_err(|error| error.to_string())?;
    let mut tank = Tank::new(Grid::new(cells, Vector::ZERO, extent), boundary, WATER_AND_AIR, 1e-3);
    tank.schemes.convection = convection;
    tank.gravity = down(GRAVITY);
    let dam = Vector::new(WIDTH, extent.y, 2.0 * WIDTH);
    let mut solver = tank.solver(|domain, boundary, flow| {
        let beta = fractions(domain, &Region::Box { lower: Vector::ZERO, upper: dam });
        flow.add_liquid(domain, boundary, &beta, Vector::ZERO, DropVelocity::Mass);
    })?;
    let mut history = vec![[0.0, 1.0, 1.0]];
    let (mut time, end) = (0.0, 0.6);
    while time < end * (1.0 - 1e-9) {
        time += step(&mut solver, time, end)?.0;
        let c = &solver.flow().volume_fraction;
        let [n1, _, n3] = cells.map(|n| n as isize);
        // The front runs along the floor: where the lowest row is half full.
        let first = (0..n1).rev().find(|&i| c[[i, 0, 0]] >= 0.5).unwrap_or(0);
        let (here, next) = (c[[first, 0, 0]], if first + 1 < n1 { c[[first + 1, 0, 0]] } else { 0.0 });
        let front = (first as Real + 0.5 + (here - 0.5) / (here - next).max(1e-9)) * width;
        let column: Real = (0..n3).map(|k| c[[0, 0, k]]).sum::<Real>() * width;
        history.push([time, front / WIDTH, column / (2.0 * WIDTH)]);
    }
    Ok(history)
}

/// Value `column` of a history at `time`, linear between steps.
fn at(history: &[[Real; 3]], time: Real, column: usize) -> Real {
    let after = history.partition_point(|row| row[0] < time).clamp(1, history.len() - 1);
    let [a, b] = [history[after - 1], history[after]];
    a[column] + (b[column] - a[column]) * ((time - a[0]) / (b[0] - a[0])).clamp(0.0, 1.0)
}

fn rms(values: impl ExactSizeIterator<Item = Real>) -> Real {
    let count = values.len() as Real;
    (values.map(|v| v * v).sum::<Real>() / count).sqrt()
}

/// Errors of front (relative) and column (of the height at the start) with the experiment's clock shifted by `shift`.
fn dam_errors(history: &[[Real; 3]], shift: Real) -> [Real; 2] {
    let front = |time: Real| at(history, (time + shift) / (2.0 * GRAVITY / WIDTH).sqrt(), 1);
    let height = |time: Real| at(history, (time + shift) / (GRAVITY / WIDTH).sqrt(), 2);
    [
        rms(table(DAM_BREAK, "front").iter().map(|row| front(row[0]) / row[1] - 1.0)),
        rms(table(DAM_BREAK, "column").iter().map(|row| height(row[0]) - row[1])),
    ]
}

/// The dam break of Martin and Moyce.
pub(crate) fn dam_break() -> Result<(Vec<Measured>, Vec<Chart>), String> {
    let history = dam(24, Convection::Consistent)?;
    let [front, column] = [0, 1].map(|n| best_shift(0.2, |shift| dam_errors(&history, shift)[n]));
    let still = dam_errors(&[[0.0, 1.0, 1.0], [1.0, 1.0, 1.0]], 0.0);
    let rows = vec![
        Measured::new("rms error of the front", front[1]),
        Measured::new("shift of the clock allowed for it, up to 0.2 t sqrt(2g/a)", front[0]),
        Measured::new("rms error of the column, of its first height", column[1]),
        Measured::new("shift of the clock allowed for it, up to 0.2 t sqrt(g/a)", column[0]),
        Measured::new("rms error of the front without a shift", dam_errors(&history, 0.0)[0]),
        Measured::new("control: error of a front that stays", still[0]),
    ];
    let curve = |rate: Real, shift: Real, n: usize| -> Vec<[Real; 2]> {
        history.iter().map(|row| [row[0] * rate - shift, row[n]]).collect()
    };
    let chart = |title: &str, ordinate: &str, [rate, shift]: [Real; 2], n: usize, quantity: &str| {
        let reached = table(DAM_BREAK, quantity);
        let last = reached.last().map_or(0.0, |row| row[0]) + 0.3;
        let curve: Vec<[Real; 2]> = curve(rate, shift, n).into_iter().filter(|row| row[0] < last).collect();
        Chart::new(title, "dimensionless time, clock shifted", ordinate)
            .computed("computed", &curve)
            .reference("Martin and Moyce", &reached)
    };
    let rates = [2.0, 1.0].map(|factor: Real| (factor * GRAVITY / WIDTH).sqrt());
    let charts = vec![
        chart("Front", "front over width", [rates[0], front[0]], 1, "front"),
        chart("Column", "height over its first", [rates[1], column[0]], 2, "column"),
    ];
    Ok((rows, charts))
}
