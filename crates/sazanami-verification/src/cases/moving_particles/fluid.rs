//! Water without grains.

use crate::particles::dam_break::{Collapse, Column, WIDTH, at, dimensionless, fitted_slope};
use crate::particles::{self as experiments, Rest, RestSetup};
use sazanami_mps::boundary::WallFriction;
use sazanami_mps::scheme::{GradientForm, Scheme, SourceForm};
use sazanami_mps::stability::StepLimits;
use sazanami_numerics::Real;

use super::{CONTROL, EXACT, at_most, said};
use crate::cases::shift::best_shift;
use crate::measured::Measured;

/// Displacement off the lattice and the expected root mean square errors per displacement, in spacings: number
/// density, HS; from 22 to 28 particles at 0.05, 0.1, 0.2 and 0.3 spacings.
const DENSITY_ERRORS: [[Real; 2]; 4] = [[0.05, 0.006], [0.1, 0.019], [0.2, 0.027], [0.3, 0.044]];
const DIVERGENCE_ERRORS: [[Real; 2]; 4] = [[0.05, 0.008], [0.1, 0.016], [0.2, 0.043], [0.3, 0.039]];
/// Void fraction; number density over n0, HS and HL over exact on a lattice that is spread as in a bed.
const SPREAD: [[Real; 4]; 4] =
    [[0.8, 1.001, 0.995, 1.038], [0.6, 1.006, 0.978, 1.007], [0.4, 1.019, 0.995, 0.944], [0.36, 1.021, 1.0, 0.986]];

/// Mean of error over displacement: errors grow in proportion to it.
fn per_displacement(errors: &[[Real; 2]; 4]) -> Real {
    errors.iter().map(|[a, error]| error / a).sum::<Real>() / 4.0
}

/// Sums on lattices and off them.
pub fn operators() -> Result<Vec<Measured>, String> {
    let lattice = experiments::operators(0.0);
    let round_off = 1e-6;
    let mut rows = vec![
        at_most("lattice: error of the number density", (lattice.density - 1.0).abs(), 1e-12),
        at_most("lattice: error of HS", lattice.divergence_error, 1e-12),
        at_most("lattice: error of HL", lattice.laplacian_error, 1e-12),
        at_most("lattice: error of HL in the equation (single precision)", lattice.equation_error, round_off),
        at_most("lattice: error of GC", lattice.gradient_error, 1e-12),
    ];
    let jittered = [0.05, 0.1, 0.2, 0.3].map(|a| (a, experiments::operators(a)));
    let source = "tables on lattices, 22-28 particles";
    let mut compared = |name: &str, table: &[[Real; 2]; 4], of: fn(&experiments::Operators) -> Real| {
        let found = jittered.each_ref().map(|(a, operators)| [*a, of(operators)]);
        let (found, expected) = (per_displacement(&found), per_displacement(table));
        rows.push(Measured::near(
            format!("disordered: rms error of {name}, per displacement"),
            "",
            found,
            expected,
            0.3,
        ));
    };
    compared("n", &DENSITY_ERRORS, |o| o.density_error);
    compared("HS", &DIVERGENCE_ERRORS, |o| o.divergence_error);
    for (n, (a, found)) in jittered.iter().enumerate() {
        let beside = |row: Measured, table: &[[Real; 2]; 4]| {
            Measured { reference: Some(table[n][1]), ..row }.from_source(source)
        };
        let error = Measured::info(format!("disordered by {a}: rms error of n"), "", found.density_error);
        rows.push(beside(error, &DENSITY_ERRORS));
        let error = Measured::info(format!("disordered by {a}: rms error of HS"), "", found.divergence_error);
        rows.push(beside(error, &DIVERGENCE_ERRORS));
        rows.push(Measured::info(format!("disordered by {a}: rms error of HL"), "", found.laplacian_error));
        rows.push(Measured::info(format!("disordered by {a}: rms error of GC"), "", found.gradient_error));
        let cut = Measured::info(format!("disordered by {a}: part of negative coefficients"), "", found.cut);
        rows.push(Measured { reference: Some([0.0, 0.0, 2e-3, 6.5e-3][n]), ..cut }.from_source(source));
    }
    let plain = jittered[2].1.plain_gradient_error;
    rows.push(
        Measured::within("control: error of a gradient of 1 without GC", "", plain, 0.05, 1.0).from_source(CONTROL),
    );
    for [eps, density, divergence, laplacian] in SPREAD {
        let found = experiments::bulk_weighted(eps);
        let row = |name: &str, value: Real, reference: Real| {
            let row = Measured::within(format!("eps {eps}: {name}"), "", value, reference - 1e-3, reference + 1e-3);
            Measured { reference: Some(reference), ..row }.from_source(source)
        };
        rows.push(row("n over n0", found.density, density));
        rows.push(row("HS over exact", 2.0 * found.divergence, divergence));
        rows.push(row("HL over exact", found.laplacian, laplacian));
    }
    let wrong = experiments::laplacian_by_number_density();
    rows.push(Measured::near("control: HL over n0 instead of N2", "", wrong, 1.99, 5e-3).from_source(CONTROL));
    Ok(rows)
}

/// What is judged of water at rest.
fn rest_rows(name: &str, pressure: Real, found: &Rest) -> Vec<Measured> {
    vec![
        at_most(format!("{name}: largest error of p after 0.5 s, of rho g H"), found.pressure, pressure),
        at_most(format!("{name}: largest error of p at the end, of rho g H"), found.pressure_at_end, pressure),
        at_most(format!("{name}: largest speed at the end, of sqrt(g H)"), found.speed, 1e-3),
        at_most(format!("{name}: drift of the surface, in spacings"), found.level.abs(), 0.1),
        at_most(format!("{name}: drift of the mean volume strain"), found.strain.abs(), 5e-3),
        at_most(format!("{name}: mean kinetic energy, last over first third"), found.energy, 1.0),
    ]
}

/// Rest.
pub fn hydrostatics() -> Result<Vec<Measured>, String> {
    let mut rows = Vec::new();
    let cases = [
        ("lattice, 1 mm", 1e-3, 0.0, 0.0, 5e-3),
        ("lattice, 10 mm", 1e-2, 0.0, 0.0, 5e-3),
        ("disordered, 1 mm", 1e-3, 0.0, 0.1, 0.03),
        ("tilted, 1 mm", 1e-3, 0.16, 0.0, 0.03),
    ];
    for (name, spacing, tilt, jitter, pressure) in cases {
        let seconds = if jitter > 0.0 || tilt > 0.0 { 3.0 } else { 2.5 };
        let found = experiments::rest(&RestSetup { spacing, tilt, jitter, seconds }).map_err(said)?;
        rows.extend(rest_rows(name, pressure, &found));
    }
    for (radius, reference) in [(2.1, 1.0), (2.6, 0.97), (3.1, 0.92)] {
        let found = experiments::plain_pressure_gradient(radius).map_err(said)?;
        let name = format!("control: dp/dz without the reduced pressure, radius {radius}");
        rows.push(Measured::near(name, "", found, reference, 0.01).from_source(CONTROL));
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
        at_most("lattice: rms |a - g|/g in the first step", found[0], 0.02),
        at_most("lattice: rms |a - g|/g after 20 ms", found[1], 0.02),
        Measured::info("disordered: rms |a - g|/g in the first step", "", disordered[0]),
        Measured::info("disordered: rms |a - g|/g after 20 ms", "", disordered[1]),
        Measured::within("control: first step without GC", "", control[0], 0.02, Real::INFINITY).from_source(CONTROL),
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
            Measured::near(rate, "", found.decay, 1.0, 0.05).from_source(EXACT),
            at_most(format!("{name}: rms error of the velocity"), found.velocity, 0.05),
            Measured::info(format!("{name}: collisions"), "", found.collisions as Real),
        ]);
        for (steps, courant) in [("", courant), (", steps a third as long", courant / 3.0)] {
            let coarse = experiments::taylor_green(25, courant, scheme).map_err(said)?;
            let name = format!("{name}, 25 particles to a side{steps}");
            rows.extend([
                Measured::info(format!("{name}: rate of decay over exact"), "", coarse.decay),
                Measured::info(format!("{name}: rms error of the velocity"), "", coarse.velocity),
            ]);
        }
    }
    let clustered = experiments::taylor_green(25, courant, bare).map_err(said)?;
    let name = "25 particles to a side, neither";
    rows.extend([
        Measured::info(format!("{name}: time reached, t U/L"), "", clustered.time),
        Measured::within(
            format!("control, {name}: rms error of the velocity"),
            "",
            clustered.velocity,
            0.05,
            Real::INFINITY,
        )
        .from_source(CONTROL),
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
        Measured::near(
            "pressure in the middle after the first step, of rho w^2 L^2",
            "",
            found.pressure,
            reference,
            0.05,
        )
        .from_source("Colagrossi 2005, double series"),
        Measured::within("angular momentum at t w = 2 over that at the start", "", found.angular_momentum, 0.95, 1.05)
            .from_source("conservation"),
        Measured::within(
            "control: angular momentum without every tenth particle, off by",
            "",
            (found.angular_momentum_of_fewer - 1.0).abs(),
            0.05,
            1.0,
        )
        .from_source(CONTROL),
        Measured::info("part of the particles that fly on their own", "", found.splashes),
        Measured::info("farthest particle from the axis, of the side", "", found.reach),
        Measured::info("collisions", "", found.collisions as Real),
        Measured::within(
            "control: pressure with the classical source, off by",
            "",
            (usual.pressure / reference - 1.0).abs(),
            0.05,
            Real::INFINITY,
        )
        .from_source(CONTROL),
    ])
}

/// Walls that hold water by its viscosity.
pub fn viscous_walls() -> Result<Vec<Measured>, String> {
    let channel = experiments::poiseuille(20, WallFriction::NoSlip).map_err(said)?;
    let layer = experiments::stokes_layer(4, WallFriction::NoSlip).map_err(said)?;
    let slip = experiments::stokes_layer(4, WallFriction::Slip).map_err(said)?;
    Ok(vec![
        Measured::near("Poiseuille, 20 layers: speed in the middle over exact", "", channel.centre, 1.0, 0.03)
            .from_source(EXACT),
        Measured::info("Poiseuille, 20 layers: rms error of the profile", "", channel.profile),
        at_most("Stokes layer of 4 spacings: rms error of the velocity", layer, 0.05),
        Measured::within("control: Stokes layer at walls that slip", "", slip, 0.05, Real::INFINITY)
            .from_source(CONTROL),
    ])
}

/// Time `t sqrt(g/a)` times `n`, front over `a`, for columns of heights `n^2` a (Martin and Moyce 1952, table 2; the
/// first from `verification/dam-break/measured.csv`, both in `verification/mps-dam-break`).
const FRONT_TWO: [[Real; 2]; 15] = crate::grid::dam_break::FRONT;
const FRONT_ONE: [[Real; 2]; 16] = [
    [0.43, 1.11],
    [0.62, 1.22],
    [0.80, 1.44],
    [0.97, 1.67],
    [1.14, 1.89],
    [1.29, 2.11],
    [1.45, 2.33],
    [1.62, 2.56],
    [1.76, 2.78],
    [1.93, 3.00],
    [2.07, 3.22],
    [2.24, 3.44],
    [2.40, 3.67],
    [2.71, 4.11],
    [3.04, 4.56],
    [3.32, 5.00],
];

/// The shift of the clock that fits a front best, and its relative root mean square error.
fn best_front(series: &[Collapse], front: &[[Real; 2]], n: Real, length: Real) -> [Real; 2] {
    let unit = n * dimensionless(1.0, length);
    best_shift(0.3, |shift| {
        let off = |row: &[Real; 2]| at(series, (row[0] + shift) / unit, |s| s.front) / length / row[1] - 1.0;
        (front.iter().map(|row| off(row).powi(2)).sum::<Real>() / front.len() as Real).sqrt()
    })
}

/// Slope of a front over the times of a table between `low` and `high`, and that of the table.
fn slopes(series: &[Collapse], front: &[[Real; 2]], n: Real, [low, high]: [Real; 2]) -> [Real; 2] {
    let rows: Vec<[Real; 2]> = front.iter().copied().filter(|row| row[0] > low && row[0] < high).collect();
    let unit = n * dimensionless(1.0, WIDTH);
    let computed: Vec<[Real; 2]> =
        rows.iter().map(|row| [row[0], at(series, row[0] / unit, |s| s.front) / WIDTH]).collect();
    [fitted_slope(&computed), fitted_slope(&rows)]
}

/// Martin and Moyce, both ratios.
pub fn dam_break() -> Result<Vec<Measured>, String> {
    let source = "Martin and Moyce 1952";
    let across = 16;
    let mut rows = Vec::new();
    for (name, ratio, front) in [("n^2 = 2", 2, &FRONT_TWO[..]), ("n^2 = 1", 1, &FRONT_ONE[..])] {
        let n = Real::from(ratio as u32).sqrt();
        let column = Column { width: WIDTH, across, high: ratio * across, length: 6 * across };
        let last = front[front.len() - 1][0] + 0.35;
        let series = column.collapse(last / (n * dimensionless(1.0, WIDTH))).map_err(said)?;
        let [shift, error] = best_front(&series, front, n, WIDTH);
        rows.push(Measured::within(format!("{name}: rms error of the front"), "", error, 0.0, 0.1).from_source(source));
        let clock = format!("{name}: shift of the clock allowed for it, up to 0.3 n t sqrt(g/a)");
        rows.push(Measured::info(clock, "", shift));
        let [slope, expected] = slopes(&series, front, n, [1.4, 3.33]);
        if ratio == 2 {
            let row = Measured::near(format!("{name}: slope of the front, 1.4 < T < 3.3"), "", slope, 1.32, 0.15);
            rows.push(row.from_source(source));
        } else {
            let row = Measured::info(format!("{name}: slope of the front, 1.4 < T < 3.3"), "", slope);
            rows.push(Measured { reference: Some(expected), ..row }.from_source(source));
        }
        if ratio == 2 {
            let height = |row: &[Real; 2]| {
                let time = row[0] / dimensionless(1.0, WIDTH);
                at(&series, time, |s| s.height) / (2.0 * WIDTH) - row[1]
            };
            let table = &crate::grid::dam_break::HEIGHT[..11];
            let error = (table.iter().map(|row| height(row).powi(2)).sum::<Real>() / table.len() as Real).sqrt();
            rows.push(Measured::info(format!("{name}: rms error of the column, of its first height"), "", error));
            let still = [Collapse { front: WIDTH, ..series[0] }, Collapse { time: 1.0, front: WIDTH, ..series[0] }];
            let [_, control] = best_front(&still, front, n, WIDTH);
            rows.push(
                Measured::within("control: error of a front that stays", "", control, 0.1, 1.0).from_source(CONTROL),
            );
        }
    }
    Ok(rows)
}

/// Time `t sqrt(g/H)` and front `1 + x/H` of a column of 600 mm (Lobovsky et al. 2014).
const FRONT_600: [[Real; 2]; 6] = [[0.25, 1.19], [0.50, 1.40], [0.77, 1.64], [1.00, 1.89], [1.24, 2.20], [1.50, 2.55]];

/// Lobovsky et al., 600 mm, particles of 12 mm.
pub fn dam_break_lobovsky() -> Result<Vec<Measured>, String> {
    let source = "Lobovsky et al. 2014";
    let height = 0.6;
    let column = Column { width: height, across: 50, high: 50, length: 134 };
    let series = column.collapse(0.65).map_err(said)?;
    let unit = dimensionless(1.0, height);
    let late = FRONT_600.iter().filter(|row| row[0] > 0.8);
    let worst = late.map(|row| (at(&series, row[0] / unit, |s| s.front) / height / row[1] - 1.0).abs());
    let mut rows = vec![
        Measured::within(
            "largest error of the front after t sqrt(g/H) = 0.8",
            "",
            worst.fold(0.0, Real::max),
            0.0,
            0.1,
        )
        .from_source(source),
    ];
    // Until the end of the rise and the decay that are reported, 7 and 104 ms.
    let first = series.iter().find(|state| state.impact > 500.0).map_or(Real::INFINITY, |state| state.time);
    let pairs = series.windows(2).filter(|pair| pair[1].time > first && pair[1].time < first + 0.111);
    let impulse: Real = pairs.map(|p| 0.5 * (p[0].impact + p[1].impact) * (p[1].time - p[0].time)).sum();
    // 12.74 mbar s.
    rows.push(
        Measured {
            reference: Some(1274.0),
            ..Measured::within("impulse on the lowest sensor", "Pa s", impulse, 637.0, 2548.0)
        }
        .from_source(source),
    );
    let peak = series.iter().map(|state| state.impact).fold(0.0, Real::max);
    rows.push(
        Measured { reference: Some(18569.0), ..Measured::info("largest pressure on the lowest sensor", "Pa", peak) }
            .from_source(source),
    );
    let still = FRONT_600.iter().filter(|row| row[0] > 0.8).map(|row| (1.0 / row[1] - 1.0).abs());
    rows.push(
        Measured::within("control: error of a front that stays", "", still.fold(0.0, Real::max), 0.1, 1.0)
            .from_source(CONTROL),
    );
    Ok(rows)
}
