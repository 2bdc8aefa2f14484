//! Water without grains.

use crate::particles::dam_break::{Collapse, Column, WIDTH, at, dimensionless, fitted_slope};
use crate::particles::{self as experiments, Rest, RestSetup};
use sazanami_mps::scheme::{CONJUGATE_RADIUS, GradientForm, Scheme, SourceForm};
use sazanami_mps::stability::StepLimits;
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

/// Judged quantities of water at rest.
fn rest_rows(name: &str, found: &Rest) -> Vec<Measured> {
    vec![
        Measured::new(format!("{name}: largest error of p after 0.5 s, of rho g H"), found.pressure),
        Measured::new(format!("{name}: largest error of p at the end, of rho g H"), found.pressure_at_end),
        Measured::new(format!("{name}: largest speed at the end, of sqrt(g H)"), found.speed),
        Measured::new(format!("{name}: drift of the surface, in spacings"), found.level.abs()),
        Measured::new(format!("{name}: drift of the mean volume strain"), found.strain.abs()),
        Measured::new(format!("{name}: mean kinetic energy, last over first third"), found.energy),
    ]
}

/// Rest.
pub fn hydrostatics() -> Result<Vec<Measured>, String> {
    let mut rows = Vec::new();
    let cases = [
        ("lattice, 1 mm", 1e-3, 0.0, 0.0),
        ("lattice, 10 mm", 1e-2, 0.0, 0.0),
        ("disordered, 1 mm", 1e-3, 0.0, 0.1),
        ("tilted, 1 mm", 1e-3, 0.16, 0.0),
    ];
    for (name, spacing, tilt, jitter) in cases {
        let seconds = if jitter > 0.0 || tilt > 0.0 { 3.0 } else { 2.5 };
        let setup = RestSetup { spacing, tilt, jitter, seconds, scheme: Scheme::default() };
        let found = experiments::rest(&setup).map_err(said)?;
        rows.extend(rest_rows(name, &found));
    }
    for radius in [2.1, 2.6, 3.1] {
        let found = experiments::plain_pressure_gradient(radius).map_err(said)?;
        let name = format!("control: dp/dz without the reduced pressure, radius {radius}");
        rows.push(Measured::new(name, found));
    }
    Ok(rows)
}

/// Free fall.
pub fn falling_block() -> Result<Vec<Measured>, String> {
    let times = [5e-4, 0.02];
    let found = experiments::falling_block(Scheme::default(), 0.0, &times).map_err(said)?;
    let disordered = experiments::falling_block(Scheme::default(), 0.1, &times).map_err(said)?;
    let uncorrected = Scheme { gradient: GradientForm::Classical, ..Scheme::default() };
    let control = experiments::falling_block(uncorrected, 0.0, &times[..1]).map_err(said)?;
    Ok(vec![
        Measured::new("lattice: rms |a - g|/g in the first step", found[0]),
        Measured::new("lattice: rms |a - g|/g after 20 ms", found[1]),
        Measured::new("disordered: rms |a - g|/g in the first step", disordered[0]),
        Measured::new("disordered: rms |a - g|/g after 20 ms", disordered[1]),
        Measured::new("control: first step without GC", control[0]),
    ])
}

/// Taylor-Green vortices.
pub fn taylor_green() -> Result<Vec<Measured>, String> {
    let courant = StepLimits::default().courant;
    let stabilised = Scheme::default();
    let bare = Scheme { stabilisation: None, ..stabilised };
    let shifted = Scheme { shifting: 0.5, ..bare };
    let mut rows = Vec::new();
    for (name, scheme) in [("DS", stabilised), ("shifting", shifted)] {
        let found = experiments::taylor_green(50, courant, scheme).map_err(said)?;
        let rate = format!("{name}: rate of decay of the largest speed over exact");
        rows.extend([
            Measured::new(rate, found.decay),
            Measured::new(format!("{name}: rms error of the velocity"), found.velocity),
            Measured::new(format!("{name}: collisions"), found.collisions as Real),
        ]);
        for (steps, courant) in [("", courant), (", steps a third as long", courant / 3.0)] {
            let coarse = experiments::taylor_green(25, courant, scheme).map_err(said)?;
            let name = format!("{name}, 25 particles to a side{steps}");
            rows.extend([
                Measured::new(format!("{name}: rate of decay over exact"), coarse.decay),
                Measured::new(format!("{name}: rms error of the velocity"), coarse.velocity),
            ]);
        }
    }
    let clustered = experiments::taylor_green(25, courant, bare).map_err(said)?;
    let name = "25 particles to a side, neither";
    rows.extend([
        Measured::new(format!("{name}: time reached, t U/L"), clustered.time),
        Measured::new(format!("control, {name}: rms error of the velocity"), clustered.velocity),
    ]);
    Ok(rows)
}

/// A square that turns.
pub fn rotating_square() -> Result<Vec<Measured>, String> {
    let found = experiments::turning_patch(50, 2.0, Scheme::default()).map_err(said)?;
    let reference = experiments::turning_patch_pressure();
    let usual = Scheme { source: SourceForm::Classical, ..Scheme::default() };
    let usual = experiments::turning_patch(50, 0.0, usual).map_err(said)?;
    Ok(vec![
        Measured::new("pressure in the middle after the first step, of rho w^2 L^2", found.pressure),
        Measured::new("angular momentum at t w = 2 over that at the start", found.angular_momentum),
        Measured::new(
            "control: angular momentum without every tenth particle, off by",
            (found.angular_momentum_of_fewer - 1.0).abs(),
        ),
        Measured::new("kinetic energy at t w = 2 over that at the start", found.energy.last),
        Measured::new("part of the particles that are isolated", found.splashes),
        Measured::new("farthest particle from the axis, of the side", found.reach),
        Measured::new("collisions", found.collisions as Real),
        Measured::new("control: pressure with the classical source, off by", (usual.pressure / reference - 1.0).abs()),
    ])
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

/// Martin and Moyce, both ratios.
pub fn dam_break() -> Result<(Vec<Measured>, Vec<Chart>), String> {
    let (mut rows, mut charts) = (Vec::new(), Vec::new());
    for (name, ratio) in [("n^2 = 2", 2), ("n^2 = 1", 1)] {
        let (measured, chart, _) = column(name, ratio, Scheme::default())?;
        rows.extend(measured);
        charts.push(chart);
    }
    Ok((rows, charts))
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

/// Lobovsky et al., 600 mm, particles of 12 mm, with the enhanced and the conjugate scheme.
pub fn dam_break_lobovsky() -> Result<(Vec<Measured>, Vec<Chart>), String> {
    let (mut rows, mut charts) = lobovsky("", Scheme::default())?;
    let (others, other_charts) = lobovsky("conjugate: ", Scheme::conjugate(CONJUGATE_RADIUS))?;
    rows.extend(others);
    charts.extend(other_charts);
    let front = reference::history(LOBOVSKY, "front");
    let still = front.iter().filter(|row| row[0] > 0.8).map(|row| (1.0 / row[1] - 1.0).abs());
    rows.push(Measured::new("control: error of a front that stays", still.fold(0.0, Real::max)));
    Ok((rows, charts))
}

/// The column of Lobovsky et al.: front, impulse and peak at the far wall.
fn lobovsky(name: &str, scheme: Scheme) -> Result<(Vec<Measured>, Vec<Chart>), String> {
    let front = reference::history(LOBOVSKY, "front");
    let height = 0.6;
    let column = Column { width: height, across: 50, high: 50, length: 134, scheme };
    let series = column.collapse(0.65).map_err(said)?;
    let unit = dimensionless(1.0, height);
    let late = front.iter().filter(|row| row[0] > 0.8);
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
    ]
    .map(|(what, value)| Measured::new(format!("{name}{what}"), value));
    let impact: Vec<[Real; 2]> = series.iter().map(|state| [state.time, 1e-3 * state.impact]).collect();
    let charts = vec![
        front_chart(&format!("{name}front"), &series, &front, [unit, 0.0, height]),
        Chart::new(&format!("{name}pressure on the lowest sensor"), "time [s]", "pressure [kPa]")
            .computed("computed", &impact),
    ];
    Ok((rows.into(), charts))
}
