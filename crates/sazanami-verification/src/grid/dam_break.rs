//! A column of water that collapses: Martin and Moyce (1952), Phil. Trans. R. Soc. A 244.

use sazanami_numerics::grid::Grid;
use sazanami_numerics::{Real, Vector};

use super::experiment::{Experiment, ExperimentError};
use crate::reference::{DAM_BREAK, history};
use sazanami_mics::boundary::{Boundary, FluidName, Side};
use sazanami_mics::flow::{Fluids, Schemes};

/// Width of the column \[m]; it is twice as high.
pub const WIDTH: Real = 0.05715;
/// Acceleration of gravity there [m/s^2].
pub const GRAVITY: Real = 9.81;

/// Differences of a collapsing column from the experiment.
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
    sides[2][1] = Side::FixedPressure { pressure: 0.0, fluid: FluidName::Gas };
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
    let [fronts, heights] = ["front", "column"].map(|quantity| history(DAM_BREAK, quantity));
    let (front, shift) = (-20..=20)
        .map(|shift| Real::from(shift) / 100.0)
        .map(|shift| (rms(&series, 1, &fronts, 1.0, shift, true), shift))
        .fold((Real::INFINITY, 0.0), |best, next| if next.0 < best.0 { next } else { best });
    let height = rms(&series, 2, &heights, Real::sqrt(2.0), shift, false);
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
