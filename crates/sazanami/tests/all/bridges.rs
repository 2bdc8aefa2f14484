//! Liquid bridges in case files: what is refused, and what a run says of them.

use crate::support::{On, Scratch, load, ran, refusal};

/// Damp spheres that fall on each other in air.
const DAMP: &str = include_str!("../cases/bridges-damp.toml");

#[test]
fn bridges_that_make_no_sense_are_refused_with_the_way_out() {
    let without = DAMP.replace("surface_tension = \"72.8 mN/m\"", "");
    let missing = refusal(&without, &[]);
    assert!(missing.contains("surface_tension"), "{missing}");
    assert!(refusal(DAMP, &["dem.bridges.surface_tension=72.8 N/m"]).contains("72.8 mN/m"));
    let angle = refusal(DAMP, &["dem.bridges.contact_angle=60 deg"]);
    assert!(angle.contains("up to 50 degrees"), "{angle}");
    assert!(refusal(DAMP, &["dem.bridges.liquid_content=0.2"]).contains("liquid_content"));
    let spheroids = refusal(DAMP, &["grains.0.shape={ spheroid = { diameter = \"0.5 mm\", length = \"1 mm\" } }"]);
    assert!(spheroids.contains("no spheres") && spheroids.contains("beads"), "{spheroids}");
    let wet = DAMP.replace("[run]", "[[liquid]]\nregion.half_space.point = [\"0 mm\", \"0 mm\", \"3 mm\"]\n[run]");
    let under_water = refusal(&wet, &[]);
    assert!(under_water.contains("a body of liquid"), "{under_water}");
    // Negative control: the case itself is sound.
    load(DAMP, &[]);
}

#[test]
fn a_run_counts_its_bridges() {
    let scratch = Scratch::new("bridges");
    let damp = ran(DAMP, &[], &scratch.join("out"), On::threads(1));
    let [bridges, volume] = ["liquid_bridges", "bridge_volume"].map(|name| damp.last(name));
    // V = 4 pi/9 w R^3 each.
    let each = 4.0 * std::f64::consts::PI / 9.0 * 0.01 * 0.125e-9;
    assert!(bridges > 20.0, "{bridges}");
    assert!((volume / (bridges * each) - 1.0).abs() < 1e-9, "{volume} {bridges}");
    // Negative control: grains that are dry have no such columns.
    let dry = DAMP.replace("[dem.bridges]\nsurface_tension = \"72.8 mN/m\"", "");
    let dry = ran(&dry, &[], &scratch.join("dry"), On::threads(1));
    assert!(!dry.series.columns.iter().any(|name| name == "liquid_bridges"));
}
