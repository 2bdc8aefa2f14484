//! Liquid bridges in case files: what is refused, and what a run says of them.

use std::path::Path;

use crate::support::{Left, On, Scratch, findings, go_on, load, ran, refusal};

/// Damp spheres that fall on each other in air.
const DAMP: &str = include_str!("../cases/bridges-damp.toml");

#[test]
fn bridges_that_make_no_sense_are_refused_with_the_way_out() {
    let without = DAMP.replace("surface_tension = \"72.8 mN/m\"", "");
    let missing = refusal(&without, &[]);
    assert!(missing.contains("surface_tension"), "{missing}");
    assert!(refusal(DAMP, &["dem.bridges.surface_tension=72.8 N/m"]).contains("72.8 mN/m"));
    let told = findings(DAMP, &["dem.bridges.surface_tension=72.8 N/m"]);
    assert_eq!(told.iter().filter(|text| text.contains("surface tension")).count(), 1, "{told:?}");
    let angle = refusal(DAMP, &["dem.bridges.contact_angle=60 deg"]);
    assert!(angle.contains("up to 50 degrees"), "{angle}");
    assert!(refusal(DAMP, &["dem.bridges.liquid_content=0.2"]).contains("liquid_content"));
    let wet = format!("solver = \"mps\"\n{DAMP}")
        .replace("[run]", "[[liquid]]\nregion.half_space.point = [\"0 mm\", \"0 mm\", \"3 mm\"]\n[run]");
    let under_water = refusal(&wet, &[]);
    assert!(under_water.contains("moving particles of water"), "{under_water}");
    let dry = refusal(DAMP, &["dem.bridges.damp=false"]);
    assert!(dry.contains("dry and stay so"), "{dry}");
    let grid = wet.replace("solver = \"mps\"", "");
    let unsaid = refusal(&grid, &[]);
    assert!(unsaid.contains("whether the grains are damp") && unsaid.contains("damp = false"), "{unsaid}");
    let two = ["dem.bridges.damp=false", "fluid.surface_tension=50 mN/m"];
    assert!(findings(&grid, &two).iter().any(|told| told.contains("another liquid")));
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

/// Spheroids, two cells wide, in a box filled with water up to a level.
fn partly_in_water(level: &str, damp: bool, folder: &Path, on: On) -> Left {
    let wet = DAMP
        .replace("cells = [4, 2, 4]", "cells = [16, 8, 16]")
        .replace("all = \"slip\"\nx2 = \"periodic\"", "all = \"no_slip\"\nx2 = \"periodic\"")
        .replace("[run]", &format!("[[liquid]]\nregion.half_space.point = [\"0 mm\", \"0 mm\", \"{level}\"]\nallow_touching_grains = true\n[run]"));
    let damp = format!("dem.bridges.damp={damp}");
    let shape = "grains.0.shape={ spheroid = { diameter = \"1 mm\", length = \"1.3 mm\" } }";
    let lattice = "grains.0.placement={ packed = {} }";
    let fast = ["run.until=4 ms", "output.series={ every = \"1 ms\" }", "contact.default.normal_stiffness=500 N/m"];
    let overrides = [&[damp.as_str(), shape, lattice, "grains.0.count=100"][..], &fast].concat();
    ran(&wet, &overrides, folder, on)
}

#[test]
fn grains_that_water_has_been_about_are_moist_where_it_is_not_now() {
    let scratch = Scratch::new("moist");
    let of = |level, damp, name: &str| {
        let left = partly_in_water(level, damp, &scratch.join(name), On::threads(1));
        [left.last("liquid_bridges"), left.last("contacts")]
    };
    // The bed is some 3 mm high.
    let [all, contacts] = of("0.4 mm", true, "damp");
    let [some, _] = of("0.4 mm", false, "dry");
    let [none, _] = of("7.9 mm", true, "drowned");
    assert!(contacts > 100.0 && all > 0.5 * contacts && some > 0.0 && some < 0.5 * all, "{all} {some} {contacts}");
    assert_eq!(none, 0.0);
}

#[test]
fn what_grains_remember_of_the_water_outlives_interruptions_and_ranks() {
    let scratch = Scratch::new("moist-bits");
    let of = |name: &str, on| partly_in_water("2 mm", false, &scratch.join(name), on);
    let expected = of("solo", On::threads(1));
    assert!(expected.last("liquid_bridges") > 20.0);
    assert_eq!(of("threads", On::threads(2)).hash(), expected.hash());
    // Sums over a grain that lies on two ranks are rounded otherwise.
    let bridges = |left: &Left| left.column("liquid_bridges").split_off(1);
    let [ranks, one] = [&of("ranks", On::ranks(2, 1)), &expected].map(bridges);
    assert!(ranks.len() == one.len() && ranks.iter().zip(&one).all(|(a, b)| (a - b).abs() < 3.0), "{ranks:?} {one:?}");
    let stopped = of("stopped", On::threads(1).steps(4));
    assert_ne!(stopped.hash(), expected.hash());
    let (outcome, _) = go_on(&scratch.join("stopped"), On::threads(1));
    outcome.expect("the run goes on");
    assert_eq!(Left::in_folder(&scratch.join("stopped")).hash(), expected.hash());
}
