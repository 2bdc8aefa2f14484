//! Entry pressure of beds of narrow grains: what is refused, how high liquid rises, and the reaction on the grains.

use std::path::Path;

use sazanami::check;
use sazanami_numerics::Real;

use crate::support::{Left, On, Scratch, findings, foretold, go_on, load, ran, refusal};

/// A bed of fixed grains over an open floor, above which the liquid outside stands by 1 mm; 1 mm of it has the entry pressure.
const COLUMN: &str = include_str!("../cases/entry-pressure-column.toml");

/// The same bed beside an open surface.
const VESSEL: &str = include_str!("../cases/entry-pressure-vessel.toml");

/// A drop that falls on free grains.
const DROP: &str = include_str!("../cases/equivalence-drop-on-bed.toml");

/// The key, to be taken away.
const KEY: &str = "entry_pressure = \"981 Pa\"";

/// Half a cell \[m].
const HALF: Real = 0.05e-3;

#[test]
fn entry_pressures_that_make_no_sense_are_refused_with_the_way_out() {
    let large = refusal(COLUMN, &["fluid.entry_pressure=981 kPa"]);
    assert!(large.contains("no bed of grains has an entry pressure of 981000 Pa"), "{large}");
    assert!(large.contains("Pa or kPa") && large.contains("6 sigma cos(theta) (1 - eps)/(eps d)"), "{large}");
    assert!(refusal(COLUMN, &["fluid.entry_pressure=-200 kPa"]).contains("-200000 Pa"));
    for none in ["inf Pa", "nan Pa", "1e400 Pa", "981", "3 mm"] {
        let text = refusal(COLUMN, &[&format!("fluid.entry_pressure={none}")]);
        assert!(text.contains("fluid.entry_pressure"), "{none}: {text}");
    }
    let particles = refusal(COLUMN, &["solver=mps", "particles.spacing=0.1 mm"]);
    assert!(particles.contains("an entry pressure with `solver = \"mps\"`"), "{particles}");
    let incremental = refusal(COLUMN, &["fluid.pressure_form=incremental"]);
    assert!(incremental.contains("pressure_form = \"full\""), "{incremental}");
    let stress = refusal(COLUMN, &["coupling.exchange=stress"]);
    assert!(stress.contains("exchange = \"surface\""), "{stress}");
    let wide =
        refusal(COLUMN, &["grains.0.shape.sphere.diameter=0.4 mm", "grains.0.placement.lattice.counts=[1, 1, 7]"]);
    assert!(wide.contains("no grains narrower than four cells"), "{wide}");
    let flat = refusal(COLUMN, &["domain.cells=[5, 5, 64]"]);
    assert!(flat.contains("cells that are no cubes"), "{flat}");
    let bare = refusal(COLUMN, &["grains=[]"]);
    assert!(bare.contains("an entry pressure without grains"), "{bare}");
    // What is only doubted.
    let fine = findings(COLUMN, &["fluid.entry_pressure=60 kPa"]);
    assert!(fine.iter().any(|title| title.contains("is that of finer pores")), "{fine:?}");
    let dry = findings(VESSEL, &["liquid=[]"]);
    assert!(dry.iter().any(|title| title == "`fluid.entry_pressure` does nothing"), "{dry:?}");
    // Negative control: the case itself is sound, and `check` tells of the grains and of the step.
    assert_eq!(findings(COLUMN, &[]), Vec::<String>::new());
    let loaded = load(COLUMN, &[]);
    let told = check::explain(&loaded.case, &foretold(&loaded.case));
    assert!(told.contains("below four cells beds of it have an entry pressure of 981 Pa"), "{told}");
    assert!(told.contains("4 entry pressure"), "{told}");
}

/// Runs the column; the level in it over that outside, at the end \[m].
fn rise(text: &str, changes: &[&str]) -> Real {
    let scratch = Scratch::new("entry-column");
    let left = ran(text, changes, &scratch.join("out"), On::threads(1));
    assert!(left.last("momentum_residual_relative") < 1e-9, "{}", left.last("momentum_residual_relative"));
    left.probe("inside").last("water_level") - 1e-3
}

#[test]
fn liquid_rises_in_a_bed_as_far_as_its_entry_pressure_bears_it() {
    let rises = [[981.0, 1e-3], [1350.0, 1350.0 / 981e3], [-600.0, -600.0 / 981e3]];
    for [pressure, exact] in rises {
        let found = rise(COLUMN, &[&format!("fluid.entry_pressure={pressure} Pa")]);
        println!("{pressure} Pa: {found:.3e} m for {exact:.3e} m");
        assert!((found - exact).abs() < HALF, "{pressure} Pa: {found} for {exact}");
    }
    // Negative control: without it, and with one that is none, the two levels are one.
    let without = [rise(&COLUMN.replace(KEY, ""), &[]), rise(COLUMN, &["fluid.entry_pressure=0 Pa"])];
    assert!(without.iter().all(|rise| rise.abs() < HALF), "{without:?}");
}

#[test]
fn a_bed_draws_liquid_from_an_open_surface_beside_it_and_holds_it_out() {
    let scratch = Scratch::new("entry-vessel");
    let run = |name: &str, text: &str, changes: &[&str]| {
        let left = ran(text, changes, &scratch.join(name), On::threads(1));
        // What bears it hangs on the grains.
        assert!(left.last("momentum_residual_relative") < 1e-9, "{}", left.last("momentum_residual_relative"));
        let level = |name: &str| left.probe(name).last("water_level");
        let rise = 0.5 * (level("inside") + level("between")) - level("outside");
        println!("{name}: {rise:.3e} m");
        rise
    };
    let wetted = run("wetted", VESSEL, &[]);
    // At the side of the bed, where the entry pressure fades, liquid runs down.
    assert!((wetted - 1e-3).abs() < 2.0 * HALF, "{wetted}");
    let full = "liquid.0.region.half_space.point=[\"0 m\", \"0 m\", \"1.8 mm\"]";
    let repelled = run("repelled", VESSEL, &["fluid.entry_pressure=-981 Pa", full]);
    assert!((repelled + 1e-3).abs() < 2.0 * HALF, "{repelled}");
    // Negative control.
    let level = run("level", &VESSEL.replace(KEY, ""), &[]);
    assert!(level.abs() < HALF, "{level}");
}

/// The drop on a higher bed.
fn drop_on_bed(changes: &[&str], folder: &Path, on: On) -> Left {
    let bed = [
        "output.figures={ at = [] }",
        "output.series={ steps = 2 }",
        "domain={ size = [\"3.6 mm\", \"3.2 mm\", \"5 mm\"], cells = [18, 16, 25] }",
        "grains.0.count=70",
        "run.steps=60",
        "contact.\"sand/sand\".normal_stiffness=1000 N/m",
        "fluid.entry_pressure=600 Pa",
    ];
    ran(DROP, &[&bed[..], changes].concat(), folder, on)
}

#[test]
fn free_grains_get_the_reaction_with_the_same_bits_on_threads_and_after_a_restart() {
    let scratch = Scratch::new("entry-drop");
    let whole = drop_on_bed(&[], &scratch.join("whole"), On::threads(1).steps(60));
    let residual = whole.column("momentum_residual_relative").into_iter().fold(0.0, Real::max);
    println!("{residual:.1e}");
    assert!(residual < 1e-8, "{residual}");
    let threads = drop_on_bed(&[], &scratch.join("threads"), On::threads(2).steps(60));
    assert_eq!((threads.hash(), &threads.series), (whole.hash(), &whole.series));
    let parts = scratch.join("parts");
    drop_on_bed(&[], &parts, On::threads(1).steps(37));
    go_on(&parts, On::threads(2).steps(23)).0.expect("the run goes on");
    assert_eq!(Left::in_folder(&parts).hash(), whole.hash());
    // Negative control: it draws the drop in, and the grains feel it.
    let without = drop_on_bed(&["fluid.entry_pressure=0 Pa"], &scratch.join("without"), On::threads(1).steps(60));
    for name in ["momentum_liquid_3", "momentum_grains_3"] {
        let [with, without] = [&whole, &without].map(|left| left.last(name) / left.last("time"));
        println!("{name}: {with:.3e} {without:.3e}");
        assert!((with / without - 1.0).abs() > 0.01, "{name}: {with} {without}");
    }
}
