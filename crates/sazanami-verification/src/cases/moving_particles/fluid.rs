//! Water without grains.

use crate::particles as experiments;
use crate::particles::dam_break::{Collapse, Column, WIDTH, at, dimensionless, fitted_slope};
use sazanami_mps::scheme::Scheme;
use sazanami_numerics::Real;

use super::said;
use crate::cases::shift::best_shift;
use crate::measured::{Chart, Measured};
use crate::reference::{self, DAM_BREAK, LOBOVSKY, SQUARE_DAM};

/// Mean of error over displacement: errors grow in proportion to it.
fn per_displacement(errors: &[[Real; 2]; 4]) -> Real {
    errors.iter().map(|[a, error]| error / a).sum::<Real>() / 4.0
}

/// Sums on lattices and off them.
pub fn operators() -> Result<Vec<Measured>, String> {
    let lattice = experiments::operators(0.0);
    let mut rows = vec![
        Measured::new("lattice: error of the number density", (lattice.density - 1.0).abs()),
        Measured::new("lattice: error of HS", lattice.divergence_error),
        Measured::new("lattice: error of HL", lattice.laplacian_error),
        Measured::new("lattice: error of HL in the equation (single precision)", lattice.equation_error),
        Measured::new("lattice: error of GC", lattice.gradient_error),
    ];
    let jittered = [0.05, 0.1, 0.2, 0.3].map(|a| (a, experiments::operators(a)));
    let mut compared = |name: &str, of: fn(&experiments::Operators) -> Real| {
        let found = jittered.each_ref().map(|(a, operators)| [*a, of(operators)]);
        rows.push(Measured::new(
            format!("disordered: rms error of {name}, per displacement"),
            per_displacement(&found),
        ));
    };
    compared("n", |o| o.density_error);
    compared("HS", |o| o.divergence_error);
    for (a, found) in &jittered {
        rows.push(Measured::new(format!("disordered by {a}: rms error of n"), found.density_error));
        rows.push(Measured::new(format!("disordered by {a}: rms error of HS"), found.divergence_error));
        rows.push(Measured::new(format!("disordered by {a}: rms error of HL"), found.laplacian_error));
        rows.push(Measured::new(format!("disordered by {a}: rms error of GC"), found.gradient_error));
        rows.push(Measured::new(format!("disordered by {a}: part of negative coefficients"), found.cut));
    }
    let plain = jittered[2].1.plain_gradient_error;
    rows.push(Measured::new("control: error of a gradient of 1 without GC", plain));
    for eps in [0.8, 0.6, 0.4, 0.36] {
        let found = experiments::bulk_weighted(eps);
        rows.push(Measured::new(format!("eps {eps}: n over n0"), found.density));
        rows.push(Measured::new(format!("eps {eps}: HS over exact"), 2.0 * found.divergence));
        rows.push(Measured::new(format!("eps {eps}: HL over exact"), found.laplacian));
    }
    let wrong = experiments::laplacian_by_number_density();
    rows.push(Measured::new("control: HL over n0 instead of N2", wrong));
    Ok(rows)
}

/// The shift of the clock that fits a front best, and its relative root mean square error.
fn best_front(series: &[Collapse], front: &[[Real; 2]], n: Real, length: Real) -> [Real; 2] {
    let unit = n * dimensionless(1.0, length);
    best_shift(0.3, |shift| {
        let off = |row: &[Real; 2]| at(series, (row[0] + shift) / unit, |s| s.front) / length / row[1] - 1.0;
        (front.iter().map(|row| off(row).powi(2)).sum::<Real>() / front.len() as Real).sqrt()
    })
}

/// Slope of a front over the times of a table between `low` and `high`.
fn slope(series: &[Collapse], front: &[[Real; 2]], n: Real, [low, high]: [Real; 2]) -> Real {
    let rows: Vec<[Real; 2]> = front.iter().copied().filter(|row| row[0] > low && row[0] < high).collect();
    let unit = n * dimensionless(1.0, WIDTH);
    let computed: Vec<[Real; 2]> =
        rows.iter().map(|row| [row[0], at(series, row[0] / unit, |s| s.front) / WIDTH]).collect();
    fitted_slope(&computed)
}

/// A front beside its table: `unit` turns seconds into the time of the table, which is shifted by `shift`; lengths are
/// over `length` \[m].
fn front_chart(title: &str, series: &[Collapse], front: &[[Real; 2]], [unit, shift, length]: [Real; 3]) -> Chart {
    let curve: Vec<[Real; 2]> = series.iter().map(|s| [s.time * unit - shift, s.front / length]).collect();
    Chart::new(title, "dimensionless time", "front over width")
        .computed("computed", &curve)
        .reference("measured", front)
}

/// A column of Martin and Moyce `ratio` times as high as wide: what is judged of it, its front, and its states.
pub(super) fn column(
    name: &str,
    ratio: usize,
    scheme: Scheme,
) -> Result<(Vec<Measured>, Chart, Vec<Collapse>), String> {
    let across = 16;
    let front = &reference::history([SQUARE_DAM, DAM_BREAK][ratio - 1], "front");
    let n = Real::from(ratio as u32).sqrt();
    let column = Column { width: WIDTH, across, high: ratio * across, length: 6 * across, scheme };
    let last = front[front.len() - 1][0] + 0.35;
    let series = column.collapse(last / (n * dimensionless(1.0, WIDTH))).map_err(said)?;
    let [shift, error] = best_front(&series, front, n, WIDTH);
    let clock = format!("{name}: shift of the clock allowed for it, up to 0.3 n t sqrt(g/a)");
    let slope = slope(&series, front, n, [1.4, 3.33]);
    let mut rows = vec![
        Measured::new(format!("{name}: rms error of the front"), error),
        Measured::new(clock, shift),
        Measured::new(format!("{name}: slope of the front, 1.4 < T < 3.3"), slope),
    ];
    let scale = [n * dimensionless(1.0, WIDTH), shift, WIDTH];
    let chart = front_chart(&format!("Front, {name}, clock shifted"), &series, front, scale);
    if ratio == 2 {
        let height = |row: &[Real; 2]| {
            let time = row[0] / dimensionless(1.0, WIDTH);
            at(&series, time, |s| s.height) / (2.0 * WIDTH) - row[1]
        };
        let table = &reference::history(DAM_BREAK, "column")[..11];
        let error = (table.iter().map(|row| height(row).powi(2)).sum::<Real>() / table.len() as Real).sqrt();
        rows.push(Measured::new(format!("{name}: rms error of the column, of its first height"), error));
        let still = [Collapse { front: WIDTH, ..series[0] }, Collapse { time: 1.0, front: WIDTH, ..series[0] }];
        let [_, control] = best_front(&still, front, n, WIDTH);
        rows.push(Measured::new("control: error of a front that stays", control));
    }
    Ok((rows, chart, series))
}

/// Lobovsky et al., 600 mm, particles of 12 mm: front, impulse and peak at the far wall.
pub fn dam_break_lobovsky() -> Result<(Vec<Measured>, Vec<Chart>), String> {
    let front = reference::history(LOBOVSKY, "front");
    let height = 0.6;
    let column = Column { width: height, across: 50, high: 50, length: 134, scheme: Scheme::default() };
    let series = column.collapse(0.65).map_err(said)?;
    let unit = dimensionless(1.0, height);
    let late = front.iter().filter(|row| row[0] > 0.8);
    let still = late.clone().map(|row| (1.0 / row[1] - 1.0).abs());
    let worst = late.map(|row| (at(&series, row[0] / unit, |s| s.front) / height / row[1] - 1.0).abs());
    // Until the end of the rise and the decay that are reported, 7 and 104 ms.
    let first = series.iter().find(|state| state.impact > 500.0).map_or(Real::INFINITY, |state| state.time);
    let pairs = series.windows(2).filter(|pair| pair[1].time > first && pair[1].time < first + 0.111);
    // Of 12.74 mbar s.
    let impulse: Real = pairs.map(|p| 0.5 * (p[0].impact + p[1].impact) * (p[1].time - p[0].time)).sum();
    let peak = series.iter().map(|state| state.impact).fold(0.0, Real::max);
    let rows = [
        ("largest error of the front after t sqrt(g/H) = 0.8", worst.fold(0.0, Real::max)),
        ("impulse on the lowest sensor", impulse),
        ("largest pressure on the lowest sensor", peak),
        ("control: error of a front that stays", still.fold(0.0, Real::max)),
    ]
    .map(|(what, value)| Measured::new(what, value));
    let impact: Vec<[Real; 2]> = series.iter().map(|state| [state.time, 1e-3 * state.impact]).collect();
    let charts = vec![
        front_chart("front", &series, &front, [unit, 0.0, height]),
        Chart::new("pressure on the lowest sensor", "time [s]", "pressure [kPa]").computed("computed", &impact),
    ];
    Ok((rows.into(), charts))
}
