//! Flows that a body force drives through periodic sides, by both solvers: the force that holds a mean velocity is the friction.

#[allow(dead_code, reason = "every test program uses a part of it")]
mod support;

use std::path::Path;

use sazanami_numerics::Real;
use support::{Left, On, Scratch, go_on, load, start};

/// A viscous liquid between two plates 4 mm apart, at a mean velocity of 10 mm/s along x1.
const PLATES: &str = r#"
gravity = "0 m/s^2"
[domain]
size = ["4 mm", "4 mm", "4 mm"]
cells = [4, 4, 16]
[boundary]
x1 = "periodic"
x2 = "periodic"
[drive]
mean_velocity = ["10 mm/s", "0 m/s", "0 m/s"]
answer = "5 ms"
[fluid]
dt_max = "1 ms"
[fluid.liquid]
density = "1000 kg/m^3"
kinematic_viscosity = "1e-3 m^2/s"
[[liquid]]
region.box = { lower = ["0 mm", "0 mm", "0 mm"], upper = ["4 mm", "4 mm", "4 mm"] }
[particles]
spacing = "0.5 mm"
dt_max = "1 ms"
[output]
figures = { at = [] }
fields = { at = [] }
series = { every = "1 ms" }
[run]
until = "100 ms"
"#;

fn left(folder: &Path, overrides: &[&str], steps: Option<u64>) -> Left {
    start(&load(PLATES, overrides), folder, On { steps, ..On::threads(1) }).unwrap_or_else(|error| panic!("{error}"));
    Left::in_folder(folder)
}

/// The last value of a column.
fn last(left: &Left, column: &str) -> Real {
    *left.column(column).last().expect("the series has rows")
}

#[test]
fn the_force_between_plates_is_that_of_poiseuille() {
    let scratch = Scratch::new("plates");
    for (solver, tolerance) in [("mics", 0.01), ("mps", 0.05)] {
        let word = format!("solver={solver}");
        // 12 nu U / h^2.
        let expected = 12.0 * 1e-3 * 0.01 / 16e-6;
        let flow = left(&scratch.join(solver), &[&word], None);
        let (speed, force) = (last(&flow, "mean_velocity_1"), last(&flow, "driving_acceleration_1"));
        assert!((speed / 0.01 - 1.0).abs() < 1e-3, "{solver}: {speed}");
        assert!((force / expected - 1.0).abs() < tolerance, "{solver}: {force} for {expected}");
        assert_eq!((last(&flow, "driving_acceleration_2"), last(&flow, "driving_acceleration_3")), (0.0, 0.0));
        let stress = last(&flow, "driving_stress_1");
        assert!((stress / (1000.0 * 4e-3 * force) - 1.0).abs() < 1e-9, "{solver}: {stress}");
        // The force stands in the momentum budget, which closes.
        let residual = flow.summary["conservation"]["momentum_residual_relative"].as_f64().expect("a number");
        assert!(residual < 0.01, "{solver}: {residual}");
        // Negative control: half the viscosity takes half the force, and without a velocity to be held nothing moves.
        let thin = left(&scratch.join("thin"), &[&word, "fluid.liquid.kinematic_viscosity=5e-4 m^2/s"], None);
        let force = last(&thin, "driving_acceleration_1");
        assert!((force / (0.5 * expected) - 1.0).abs() < tolerance, "{solver}: {force} for {}", 0.5 * expected);
        let still = left(&scratch.join("still"), &[&word, "drive={ acceleration = [\"0 m/s^2\", \"0 m/s^2\", \"0 m/s^2\"] }"], Some(20));
        assert!(!still.series.columns.iter().any(|column| column == "mean_velocity_1"));
        assert!(last(&still, "kinetic_energy_fluid") < 1e-20);
    }
}

#[test]
fn a_constant_force_begins_with_the_run() {
    let scratch = Scratch::new("pushed");
    for solver in ["mics", "mps"] {
        let word = format!("solver={solver}");
        let pushed = "drive={ acceleration = [\"3 m/s^2\", \"0 m/s^2\", \"0 m/s^2\"] }";
        let free = "boundary.x3=periodic";
        let flow = left(&scratch.join(solver), &[&word, pushed, free, "run.until=10 ms"], None);
        // Nothing holds the liquid: it moves at 30 mm/s.
        let (mass, speed): (Real, Real) = (1000.0 * 64e-9, 3.0 * 0.01);
        let energy = last(&flow, "kinetic_energy_fluid");
        assert!((energy / (0.5 * mass * speed * speed) - 1.0).abs() < 1e-6, "{solver}: {energy}");
    }
}

#[test]
fn a_restart_goes_on_with_the_force_as_it_was() {
    let scratch = Scratch::new("driven-restart");
    for solver in ["mics", "mps"] {
        let word = format!("solver={solver}");
        let whole = left(&scratch.join(&format!("{solver}-whole")), &[&word], Some(20));
        let folder = scratch.join(&format!("{solver}-parts"));
        left(&folder, &[&word], Some(8));
        go_on(&folder, On::threads(2).steps(12)).0.expect("the run goes on");
        let parts = Left::in_folder(&folder);
        assert_eq!(whole.hash(), parts.hash(), "{solver}");
        assert_eq!(whole.series, parts.series, "{solver}");
        assert!(last(&whole, "driving_acceleration_1") != 0.0);
    }
}

/// Titles of what is wrong with the case.
fn refused(overrides: &[&str]) -> Vec<String> {
    let overrides: Vec<String> = overrides.iter().map(|text| (*text).to_owned()).collect();
    match sazanami::case::parse(Path::new("case.toml"), PLATES, &overrides) {
        Ok(_) => Vec::new(),
        Err(error) => error.diagnostics.records(&error.source).iter().map(|record| record.message.clone()).collect(),
    }
}

#[test]
fn flows_that_cannot_be_driven_are_refused() {
    let velocity = |x3: &str| format!("drive.mean_velocity=[\"10 mm/s\", \"0 m/s\", \"{x3}\"]");
    for (change, words) in [
        (velocity("1 mm/s"), "goes through the sides of x3"),
        ("boundary.x1=no_slip".to_owned(), "goes through the sides of x1"),
        ("drive.mean_velocity=[\"0 m/s\", \"0 m/s\", \"0 m/s\"]".to_owned(), "a mean velocity of zero is not held"),
        ("drive.above=4 mm".to_owned(), "`above` lies outside the box"),
        ("drive.answer=3 ms".to_owned(), "shorter than four steps"),
        ("drive={}".to_owned(), "mean_velocity"),
    ] {
        for solver in ["solver=mics", "solver=mps"] {
            let found = refused(&[&change, solver]);
            assert!(found.len() == 1 && found[0].contains(words), "{change}, {solver}: {found:#?}");
        }
    }
    assert!(refused(&[&velocity("0 m/s")]).is_empty());
}
