//! Liquids that the preparation of a tank would move before the run begins.

use sazanami::machine::Machine;
use sazanami_io::vtk::VtkFile;

use crate::support::{On, Scratch, before_run, load, ran};

/// A drop above a bed.
const DROP: &str = include_str!("../cases/prepared-drop.toml");
const AS_PUT: &str = "preparation={ relax_steps = 0, settle = \"0 s\", cache = false }";

/// What is found wrong with the case before it runs.
fn faults(overrides: &[&str]) -> Vec<String> {
    let (runs, found) = before_run(&load(DROP, overrides), &Machine::this());
    if runs { Vec::new() } else { found }
}

#[test]
fn liquids_that_would_fall_before_the_run_are_refused_with_the_way_out() {
    let falls = |overrides: &[&str]| {
        let found = faults(overrides);
        found.iter().any(|fault| fault.contains("`drop` would fall before the run begins"))
    };
    assert!(falls(&[]));
    assert!(falls(&[
        "liquid.0={ name = \"drop\", region = { sphere = { diameter = \"4 mm\", centre = [\"4 mm\", \"4 mm\", \"10 mm\"] } } }"
    ]));
    let moving = "liquid.0.velocity=[\"0 m/s\", \"0 m/s\", \"-1 m/s\"]";
    assert!(falls(&[moving]));
    // Negative controls: what lies on the bed, on other water, or where nothing is prepared or falls.
    for borne in [
        "liquid.0.gap_above_bed=0 mm",
        "liquid.1.region.box.upper=[\"9 mm\", \"9 mm\", \"6 mm\"]",
        AS_PUT,
        "run.packing_only=true",
    ] {
        assert!(faults(&[borne]).is_empty(), "{borne}: {:?}", faults(&[borne]));
    }
    // The way out begins with the drop above the bed.
    let (scratch, fields) = (Scratch::new("prepared-drop"), "output.fields.at=[\"0 s\"]");
    let folder = scratch.join("run");
    let left = ran(DROP, &[AS_PUT, moving, fields], &folder, On::threads(2).steps(1));
    let momentum = left.column("momentum_3")[0];
    assert!((momentum / -33.5e-6 - 1.0).abs() < 0.1, "{momentum}");
    let bed = 1e-3 * left.summary["observables"]["bed"]["height_mm"].as_f64().expect("there is a bed");
    let places = VtkFile::read(&folder.join("fields/fields-000000000.vtp")).and_then(|file| file.doubles("Points"));
    let heights = places.expect("the run left it").into_iter().skip(2).step_by(3).map(|z| z - bed);
    let of_drop: Vec<f64> = heights.filter(|height| *height > 0.0).collect();
    // Particles of a spacing of 1 mm between 2 and 6 mm above it.
    let [lowest, highest] = [f64::min, f64::max].map(|of| of_drop.iter().copied().reduce(of).expect("there is a drop"));
    assert!((1.9e-3..3.1e-3).contains(&lowest) && (4.9e-3..6.1e-3).contains(&highest), "{lowest} {highest}");
}
