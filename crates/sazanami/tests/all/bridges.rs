//! Liquid bridges in case files: what is refused, and what a run says of them.

use std::path::Path;

use crate::support::{On, Scratch, load, start};

/// Damp spheres that fall on each other in air.
const DAMP: &str = include_str!("../cases/bridges-damp.toml");

fn refusal(changes: &[&str]) -> String {
    let changes: Vec<String> = changes.iter().map(|text| (*text).to_owned()).collect();
    sazanami::case::parse(Path::new("c.toml"), DAMP, &changes).expect_err("refused").to_string()
}

#[test]
fn bridges_that_make_no_sense_are_refused_with_the_way_out() {
    let without = DAMP.replace("surface_tension = \"72.8 mN/m\"", "");
    let missing = sazanami::case::parse(Path::new("c.toml"), &without, &[]).expect_err("refused").to_string();
    assert!(missing.contains("surface_tension"), "{missing}");
    assert!(refusal(&["dem.bridges.surface_tension=72.8 N/m"]).contains("72.8 mN/m"));
    let angle = refusal(&["dem.bridges.contact_angle=60 deg"]);
    assert!(angle.contains("up to 50 degrees"), "{angle}");
    assert!(refusal(&["dem.bridges.liquid_content=0.2"]).contains("liquid_content"));
    let spheroids = refusal(&["grains.0.shape={ spheroid = { diameter = \"0.5 mm\", length = \"1 mm\" } }"]);
    assert!(spheroids.contains("no spheres") && spheroids.contains("beads"), "{spheroids}");
    let wet = DAMP.replace("[run]", "[[liquid]]\nregion.half_space.point = [\"0 mm\", \"0 mm\", \"3 mm\"]\n[run]");
    let under_water = sazanami::case::parse(Path::new("c.toml"), &wet, &[]).expect_err("refused").to_string();
    assert!(under_water.contains("a body of liquid"), "{under_water}");
    // Negative control: the case itself is sound.
    load(DAMP, &[]);
}

#[test]
fn a_run_counts_its_bridges() {
    let scratch = Scratch::new("bridges");
    start(&load(DAMP, &[]), &scratch.join("out"), On::threads(1)).expect("the run ends well");
    let series = std::fs::read_to_string(scratch.join("out/series.csv")).expect("a series");
    let mut lines = series.lines();
    let heading: Vec<&str> = lines.next().expect("a heading").split(',').collect();
    let column = |name: &str| heading.iter().position(|cell| cell.starts_with(name)).expect(name);
    let last: Vec<&str> = lines.last().expect("rows").split(',').collect();
    let value = |name: &str| last[column(name)].parse::<f64>().expect("a number");
    // V = 4 pi/9 w R^3 each.
    let each = 4.0 * std::f64::consts::PI / 9.0 * 0.01 * 0.125e-9;
    assert!(value("liquid_bridges") > 20.0, "{series}");
    assert!((value("bridge_volume") / (value("liquid_bridges") * each) - 1.0).abs() < 1e-9, "{series}");
    // Negative control: grains that are dry have no such columns.
    let dry = DAMP.replace("[dem.bridges]\nsurface_tension = \"72.8 mN/m\"", "");
    start(&load(&dry, &[]), &scratch.join("dry"), On::threads(1)).expect("the run ends well");
    assert!(!std::fs::read_to_string(scratch.join("dry/series.csv")).expect("a series").contains("liquid_bridges"));
}
