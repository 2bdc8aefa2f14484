//! Poses a case in code, runs it, and reads its series, its summary and its fields.
//!
//! `cargo run --release -p sazanami --example settling_sphere`

use std::error::Error;
use std::path::Path;

use sazanami::analyse::Table;
use sazanami::case;
use sazanami::progress::{Progress, StepLine};
use sazanami::run::{RunOptions, run};
use sazanami::stop::{Stop, StopCause};
use sazanami_io::checkpoint::CheckpointFolder;

/// A sphere of glass begins to settle in a small box of water. Texts with units, as in a case file.
fn settling_sphere(diameter_mm: f64) -> String {
    format!(
        r#"
        name = "settling-sphere"
        gravity = "9.81 m/s^2"
        [domain]
        size = ["8 mm", "8 mm", "8 mm"]
        cells = [16, 16, 16]
        [[liquid]]
        region.box = {{ lower = ["0 mm", "0 mm", "0 mm"], upper = ["8 mm", "8 mm", "8 mm"] }}
        allow_touching_grains = true
        [material.glass]
        density = "2500 kg/m^3"
        [contact.default]
        normal_stiffness = "1e3 N/m"
        restitution = 0.5
        [[grains]]
        shape.sphere = {{ diameter = "{diameter_mm} mm" }}
        placement.list = [{{ position = ["4 mm", "4 mm", "5 mm"] }}]
        [output]
        figures = {{ at = [] }}
        series = {{ steps = 1 }}
        [run]
        until = "5 ms"
        "#
    )
}

/// Hears the run, and could end it: here after a thousand steps.
struct Listener<'a>(&'a Stop);

impl Progress for Listener<'_> {
    fn step(&mut self, line: &StepLine) {
        if line.step >= 1000 {
            self.0.set(StopCause::Caller);
        }
    }

    fn message(&mut self, text: &str) {
        println!("{text}");
    }
}

#[allow(dead_code, reason = "a test runs the example without its `main`")]
fn main() -> Result<(), Box<dyn Error>> {
    run_example()
}

/// Poses, runs and reads.
///
/// # Errors
/// If the case is wrong, the run fails, or its files cannot be read.
pub fn run_example() -> Result<(), Box<dyn Error>> {
    let folder = std::env::temp_dir().join(format!("sazanami-example-{}", std::process::id()));
    // The same checks as for a case file: every finding with its line, before anything is allocated.
    let loaded = case::parse(Path::new("settling.toml"), &settling_sphere(2.0), &[])?;
    let options = RunOptions { out: Some(folder.clone()), force: true, ..RunOptions::default() };
    let stop = Stop::new();
    let summary = run(&loaded, &options, &mut Listener(&stop), &stop)?;
    println!("{:?} after {} steps, {} s", summary.status, summary.steps, summary.time);

    // The series: a row per step.
    let series = Table::read(&folder.join("series.csv"))?.ok_or("the run wrote a series")?;
    let (time, sub_steps) = (series.column("time"), series.column("grain_substeps"));
    println!(
        "{} rows to {:.4} s, {} sub-steps in the last",
        time.len(),
        time[time.len() - 1],
        sub_steps[sub_steps.len() - 1]
    );
    assert_eq!(time.last().copied(), Some(summary.time));

    // The fields and the grains of the last checkpoint, to the bit, by name.
    let newest = CheckpointFolder::new(folder.join("checkpoints"), 1).newest_good()?;
    let (_, checkpoint) = newest.good.ok_or("the run wrote a checkpoint")?;
    let state = checkpoint.snapshot()?;
    let upwards = state.reals("fluid/velocity_3")?;
    let (fastest_down, fastest_up) =
        upwards.iter().fold((0.0_f64, 0.0_f64), |(low, high), &w| (low.min(w), high.max(w)));
    println!("water: {fastest_down:.4} to {fastest_up:.4} m/s vertically in {} cells", upwards.len());
    assert!(fastest_down < 0.0 && fastest_up > 0.0, "the sphere sinks, and water gives way upwards");
    std::fs::remove_dir_all(&folder)?;
    Ok(())
}
