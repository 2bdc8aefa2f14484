//! A column of water that collapses: Martin and Moyce (1952), Phil. Trans. R. Soc. A 244.

use sazanami_numerics::grid::Grid;
use sazanami_numerics::{Real, Vector};

use super::experiment::{Experiment, ExperimentError};
use sazanami_mics::boundary::{Boundary, Side};
use sazanami_mics::flow::{Fluids, Schemes};

/// Width of the column [m]; it is twice as high.
pub const WIDTH: Real = 0.05715;
/// Acceleration of gravity there [m/s^2].
pub const GRAVITY: Real = 9.81;

/// Time `t sqrt(2 g / a)` and front `z / a` (table 2 of the paper).
pub const FRONT: [[Real; 2]; 15] = [
    [0.41, 1.11],
    [0.84, 1.22],
    [1.19, 1.44],
    [1.43, 1.67],
    [1.63, 1.89],
    [1.83, 2.11],
    [1.98, 2.33],
    [2.20, 2.56],
    [2.32, 2.78],
    [2.51, 3.00],
    [2.65, 3.22],
    [2.83, 3.44],
    [2.98, 3.67],
    [3.11, 3.89],
    [3.33, 4.11],
];

/// Time `t sqrt(g / a)` and height `eta / (2 a)` of the column (table 6 of the paper).
pub const HEIGHT: [[Real; 2]; 17] = [
    [0.56, 0.94],
    [0.77, 0.89],
    [0.93, 0.83],
    [1.08, 0.78],
    [1.28, 0.72],
    [1.46, 0.67],
    [1.66, 0.61],
    [1.84, 0.56],
    [2.00, 0.50],
    [2.21, 0.44],
    [2.45, 0.39],
    [2.70, 0.33],
    [3.06, 0.28],
    [3.44, 0.22],
    [4.20, 0.17],
    [5.25, 0.11],
    [7.40, 0.06],
];

/// How a collapsing column differs from the experiment.
#[derive(Clone, Debug, PartialEq)]
pub struct Collapse {
    /// Root mean square of the relative difference of the front.
    pub front: Real,
    /// Root mean square difference of the height over the initial height.
    pub height: Real,
    /// Added to the experiment's `t sqrt(2 g / a)`, whose origin is uncertain.
    pub shift: Real,
    /// Steps taken.
    pub steps: usize,
    /// Time `t sqrt(2 g / a)`, front and height of the run.
    pub series: Vec<[Real; 3]>,
}

/// The column on cells of its width over `n`, two-dimensional, with slip walls and an open top, until
/// the front has passed the last measured point. The time origin of the experiment may shift by up to 0.2.
///
/// # Errors
/// [`ExperimentError`] if a step fails.
pub fn collapse(n: usize) -> Result<Collapse, ExperimentError> {
    let h = WIDTH / n as Real;
    let cells = [5 * n, 1, 5 * n / 2];
    let grid = Grid::new(cells, Vector::ZERO, h * Vector::from_array(cells.map(|n| n as Real)));
    let mut sides = [[Side::Slip; 2]; 3];
    sides[1] = [Side::Periodic; 2];
    sides[2][1] = Side::FixedPressure { pressure: 0.0, volume_fraction: 0.0 };
    let boundary = Boundary::new(sides).expect("periodic sides stand opposite each other");
    let fluids = Fluids { liquid_density: 998.0, gas_density: 1.2, liquid_viscosity: 1e-3, gas_viscosity: 1.8e-5 };
    let mut run = Experiment::new(grid, boundary, fluids, Schemes::default());
    run.tolerance.divergence = 1e-7;
    let (wide, high) = (n as isize, 2 * n as isize);
    let Experiment { domain, boundary, flow, .. } = &mut run;
    domain.set(&mut flow.volume_fraction, |i, _, k| if i < wide && k < high { 1.0 } else { 0.0 });
    flow.fill_halos(domain, boundary);
    let (mut t, mut dt, mut steps) = (0.0, 1e-5, 0);
    let scale = (2.0 * GRAVITY / WIDTH).sqrt();
    let mut series = vec![[0.0, 1.0, 1.0]];
    while t * scale < 3.6 {
        dt = (0.45 / run.flow.advective_rate(&run.domain)).min(1.2 * dt).min(2e-3);
        run.step(Vector::new(0.0, 0.0, -GRAVITY), dt)?;
        t += dt;
        steps += 1;
        let c = &run.flow.volume_fraction;
        let front = (0..cells[0] as isize).rev().find(|&i| c[[i, 0, 0]] >= 0.5).map_or(0.0, |i| {
            // Half full between this centre and the next.
            let (here, next) = (c[[i, 0, 0]], c[[i + 1, 0, 0]]);
            i as Real + 0.5 + if here > next { (here - 0.5) / (here - next) } else { 0.0 }
        });
        let height: Real = (0..cells[2] as isize).map(|k| c[[0, 0, k]]).sum();
        series.push([t * scale, front / n as Real, height / (2 * n) as Real]);
    }
    let (front, shift) = (-20..=20)
        .map(|shift| Real::from(shift) / 100.0)
        .map(|shift| (rms(&series, 1, &FRONT, 1.0, shift, true), shift))
        .fold((Real::INFINITY, 0.0), |best, next| if next.0 < best.0 { next } else { best });
    let height = rms(&series, 2, &HEIGHT, Real::sqrt(2.0), shift, false);
    Ok(Collapse { front, height, shift, steps, series })
}

/// Root mean square difference of column `column` of the run from the measured points it reaches,
/// whose times are multiplied by `factor` and moved by `shift`.
fn rms(series: &[[Real; 3]], column: usize, measured: &[[Real; 2]], factor: Real, shift: Real, relative: bool) -> Real {
    let (mut sum, mut count) = (0.0, 0);
    for [time, value] in measured {
        let time = time * factor + shift;
        let after = series.partition_point(|row| row[0] < time);
        if after == 0 || after == series.len() {
            continue;
        }
        let (a, b) = (series[after - 1], series[after]);
        let computed = a[column] + (b[column] - a[column]) * (time - a[0]) / (b[0] - a[0]);
        sum += ((computed - value) / if relative { *value } else { 1.0 }).powi(2);
        count += 1;
    }
    (sum / Real::from(count)).sqrt()
}
