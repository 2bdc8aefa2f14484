//! Grains that are held until a time, by both solvers, and beds that go out as tables and come back.

use std::path::Path;

use crate::support::{Left, On, Scratch, Table, before_run, go_on, load, ran, start};
use sazanami::bed_file::Bed;
use sazanami::machine::Machine;
use sazanami_numerics::Real;

/// Three grains in an empty box, of which the second is held for 2 ms.
const HELD: &str = include_str!("../cases/held-held.toml");

#[test]
fn a_held_grain_falls_from_its_release_on() {
    let scratch = Scratch::new("held");
    for (solver, way) in [("mics", "surface"), ("mics", "stress"), ("mps", "surface")] {
        let (word, exchange) = (format!("solver={solver}"), format!("coupling.exchange={way}"));
        let solver = format!("{solver}-{way}");
        let held = ran(HELD, &[&word, &exchange], &scratch.join(&solver), On::threads(1));
        // The momentum of grains begins with their release, and stands in the budget; as published some is lost.
        let residual = held.summary["conservation"]["momentum_residual_relative"].as_f64();
        assert!(
            residual.is_none_or(|residual| residual < if way == "stress" { 1e-2 } else { 1e-9 }),
            "{solver}: {residual:?}"
        );
        let [times, speeds] = ["time", "largest_grain_speed"].map(|column| held.column(column));
        for (&time, &speed) in times.iter().zip(&speeds).skip(1) {
            let expected = 9.81 * Real::max(time - 2.05e-3, 0.0);
            assert!((speed - expected).abs() <= 5e-3 * expected, "{solver}: {speed} for {expected} at {time}");
        }
        // A step ends at the release. Negative control: without it they fall from the start on.
        let free = [&word, &exchange, "grains.1.release=0 s"];
        let free = ran(HELD, &free, &scratch.join(&format!("{solver}-free")), On::threads(1));
        let speed = free.last("largest_grain_speed");
        assert!((speed / (9.81 * 6e-3) - 1.0).abs() < 5e-3, "{solver}: {speed}");
        // Broken off before the release and just at it, the run comes to the same bits.
        for (n, until) in ["1 ms", "2.05 ms"].into_iter().enumerate() {
            let folder = scratch.join(&format!("{solver}-parts-{n}"));
            let steps = held.series.rows.len() as u64;
            let before = times.iter().filter(|&&time| time < 2.05e-3 * (1.0 - 1e-9)).count() as u64;
            assert!(before < steps, "{until}");
            let first = On::threads(1).steps(if n == 0 { 5 } else { 21 });
            ran(HELD, &[&word, &exchange], &folder, first);
            go_on(&folder, On::threads(2)).0.expect("the run goes on");
            assert_eq!(Left::in_folder(&folder).hash(), held.hash(), "{solver}, {until}");
        }
    }
}

#[test]
fn a_release_within_a_fixed_step_survives_a_restart_behind_it() {
    let scratch = Scratch::new("held-fixed-steps");
    let text = HELD.replace("dt_max", "dt");
    let folder = scratch.join("parts");
    let whole = ran(&text, &["solver=mps"], &scratch.join("whole"), On::threads(1));
    // The step that ends at 2.1 ms holds the release at 2.05 ms; the checkpoint is written before the grains go.
    ran(&text, &["solver=mps"], &folder, On::threads(1).steps(21));
    go_on(&folder, On::threads(1)).0.expect("the run goes on");
    assert_eq!(Left::in_folder(&folder).hash(), whole.hash());
    let speed = whole.last("largest_grain_speed");
    assert!((speed / (9.81 * 3.9e-3) - 1.0).abs() < 5e-3, "{speed}");
}

/// Titles of what is wrong with [`HELD`] under these values, or of its warnings.
fn findings(overrides: &[&str]) -> Vec<String> {
    crate::support::findings(HELD, overrides)
}

#[test]
fn releases_that_mean_nothing_are_told() {
    for (change, words) in [
        ("grains.1.release=6 ms", "held to the end of the run"),
        ("grains.1.motion=fixed", "never move by the forces"),
        (
            "grains.1.placement={ lattice = { counts = [2, 2, 2], velocity = [\"1 m/s\", \"0 m/s\", \"0 m/s\"] } }",
            "have no initial velocity",
        ),
        ("grains.1.release=-1 ms", "`release`"),
        (
            "grains.1.placement={ list = [{ position = [\"4 mm\", \"4 mm\", \"4 mm\"], motion = \"fixed\" }] }",
            "never move by the forces",
        ),
    ] {
        let found = findings(&[change]);
        assert!(found.len() == 1 && found[0].contains(words), "{change}: {found:#?}");
    }
    assert!(findings(&[]).is_empty(), "{:#?}", findings(&[]));
}

/// A bed of spheres that is packed, levelled and glued to the floor.
const PACKED: &str = include_str!("../cases/held-packed.toml");

#[test]
fn a_packed_bed_is_written_as_it_is_used_and_comes_back_from_its_table() {
    let scratch = Scratch::new("bed-table");
    let folder = scratch.join("packed");
    ran(PACKED, &[], &folder, On::threads(1));
    let bed = Bed::read(&folder.join("packed.bed")).expect("it was written");
    let count = load(PACKED, &[]).case.grains[0].count.expect("a number is packed");
    assert!(bed.grains.len() < count && bed.grains.len() > 100, "{} of {count}", bed.grains.len());
    assert!(bed.grains.iter().all(|grain| grain.position.z + 0.5e-3 <= 3e-3));
    assert!(bed.grains.iter().all(|grain| grain.held == (grain.position.z < 0.75e-3)));
    assert!(bed.grains.iter().any(|grain| grain.held));
    let table = scratch.join("bed.csv");
    bed.write(&table).expect("it can be written");
    assert_eq!(Bed::read(&table).expect("it can be read"), bed);
    // A run on either is the same to the last bit, and its glued grains stay.
    let on = |file: &Path, name: &str| {
        let place = format!("grains.0.placement={{ bed = {{ file = \"{}\" }} }}", file.display());
        let run = "run={ until = \"5 ms\" }";
        let none = "preparation={ relax_steps = 0, settle = \"0 s\", cache = false }";
        ran(PACKED, &[&place, run, none], &scratch.join(name), On::threads(1))
    };
    let [binary, text] = [on(&folder.join("packed.bed"), "binary"), on(&table, "text")];
    assert_eq!(binary.hash(), text.hash());
    let held = bed.grains.iter().filter(|grain| grain.held).count();
    let motion = binary.state.u32("grains/grain.motion").expect("it holds them");
    assert_eq!(motion.iter().filter(|&&motion| motion != 0).count(), held);
    // Negative control: a table with one digit changed gives another run.
    let written = std::fs::read_to_string(&table).expect("it can be read");
    let line = written.lines().nth(5).expect("it has rows").to_owned();
    // The seventh decimal of x1: a tenth of a micrometre.
    let at = "sand,1,0.000000".len();
    let digit = line[at..].chars().next().and_then(|digit| digit.to_digit(10)).expect("a decimal");
    let moved = format!("{}{}{}", &line[..at], (digit + 1) % 10, &line[at + 1..]);
    assert!(line.starts_with("sand,1,0.0") && line != moved);
    std::fs::write(&table, written.replace(&line, &moved)).expect("it can be written");
    assert_ne!(on(&table, "moved").hash(), binary.hash());
}

#[test]
fn a_bed_can_begin_with_ripples() {
    let scratch = Scratch::new("seeded");
    let tops = |name: &str, ripples: &str| {
        let place =
            format!("grains.0.placement.packed={{ level = \"4 mm\", spacing = 1.1, fall_gravity = 1.0{ripples} }}");
        let folder = scratch.join(name);
        ran(PACKED, &[&place], &folder, On::threads(1));
        let bed = Bed::read(&folder.join("packed.bed")).expect("it was written");
        bed.grains.iter().map(|grain| [grain.position.x, grain.position.z + 0.5e-3]).collect::<Vec<_>>()
    };
    let level = |x: f64| 4e-3 + 1e-3 * (std::f64::consts::TAU * (x - 4e-3) / 8e-3).cos();
    let rippled = tops("rippled", ", ripples = { wavelength = \"8 mm\", height = \"2 mm\" }");
    assert!(rippled.iter().all(|&[x, top]| top <= level(x) + 1e-12));
    let above = |tops: &[[f64; 2]]| tops.iter().filter(|[_, top]| *top > 4e-3).count();
    assert!(above(&rippled) > 10, "{}", above(&rippled));
    // Two lengths add up, each with a crest of its own.
    let sum = |x: f64| {
        let wave = |length: f64, crest: f64| 0.5e-3 * (std::f64::consts::TAU * (x - 4e-3 - crest) / length).cos();
        4e-3 + wave(8e-3, 1e-3) + wave(4e-3, 0.0)
    };
    let both = ", ripples = [{ wavelength = \"8 mm\", height = \"1 mm\", crest = \"1 mm\" }, { wavelength = \"4 mm\", height = \"1 mm\" }]";
    let both = tops("both", both);
    assert!(both.iter().all(|&[x, top]| top <= sum(x) + 1e-12) && above(&both) > 5);
    assert!(both.iter().any(|&[x, top]| top > level(x)), "one of 8 mm alone is another bed");
    // Negative control: the level bed keeps below the mean, and reaches above the troughs.
    let flat = tops("flat", "");
    assert!(above(&flat) == 0 && flat.iter().any(|&[x, top]| top > level(x)));
    for (ripples, words) in [
        ("level = \"1 mm\", ripples = { wavelength = \"8 mm\", height = \"2 mm\" }", "reach below the floor"),
        ("ripples = { wavelength = \"8 mm\", height = \"2 mm\" }", "is not levelled has no ripples"),
        ("level = \"4 mm\", ripples = { wavelength = \"3 mm\", height = \"2 mm\" }", "do not fit"),
        (
            "level = \"4 mm\", ripples = [{ wavelength = \"8 mm\", height = \"5 mm\" }, { wavelength = \"4 mm\", height = \"4 mm\" }]",
            "reach below the floor",
        ),
    ] {
        let change = format!("grains.0.placement.packed={{ {ripples} }}");
        let found = crate::support::findings(PACKED, &["grains.0.count=100", &change]);
        assert!(found.len() == 1 && found[0].contains(words), "{found:#?}");
    }
}

#[test]
fn a_liquid_that_flows_into_a_wall_is_told_with_the_wall() {
    let water = |velocity: &str, lower: &str| {
        format!(
            "liquid=[{{ name = \"water\", velocity = {velocity}, region = {{ box = {{ lower = {lower}, upper = [\"8 mm\", \"4 mm\", \"1 mm\"] }} }} }}]"
        )
    };
    let at_side = "[\"5 mm\", \"1 mm\", \"0 mm\"]";
    for solver in ["solver=mics", "solver=mps"] {
        let found =
            |velocity: &str, more: &[&str]| findings(&[&[solver, &water(velocity, at_side)[..]], more].concat());
        let into = "[\"1 m/s\", \"0 m/s\", \"0 m/s\"]";
        assert!(found(into, &[])[0].contains("`water` flows into the wall x1_upper"), "{:?}", found(into, &[]));
        // Negative controls: away from the wall, along it, out of the box, and round it.
        assert!(found("[\"-1 m/s\", \"0 m/s\", \"0 m/s\"]", &[]).is_empty());
        assert!(found("[\"0 m/s\", \"1 m/s\", \"0 m/s\"]", &[]).is_empty());
        assert!(found(into, &["boundary.x1_upper=outflow"]).is_empty());
        assert!(found(into, &["boundary.x1=periodic"]).is_empty());
    }
    let turning = "fluid.initial_velocity={ rotation = { centre = [\"4 mm\", \"4 mm\", \"4 mm\"], angular_velocity = [\"0 rad/s\", \"100 rad/s\", \"0 rad/s\"] } }";
    let found = findings(&["solver=mics", &water("[\"0 m/s\", \"0 m/s\", \"0 m/s\"]", at_side), turning]);
    assert!(found.iter().any(|title| title.contains("flows into the wall x3_lower")), "{found:?}");
    let backwards = water("[\"-1 m/s\", \"0 m/s\", \"0 m/s\"]", at_side);
    let moving = load(HELD, &["solver=mps", &backwards, "preparation.relax_steps=10"]);
    let (_, lost) = before_run(&moving, &Machine::this());
    assert!(lost.iter().any(|title| title.contains("does not begin with its velocity")), "{lost:?}");
}

#[test]
fn water_that_does_not_come_to_rest_names_the_key_whatever_the_grains_lie_on() {
    let scratch = Scratch::new("no-rest");
    let water = "liquid=[{ region = { box = { lower = [\"0 mm\", \"0 mm\", \"0 mm\"], upper = [\"8 mm\", \"8 mm\", \"4 mm\"] } } }]";
    let lattice = "grains.1.placement={ lattice = { upper = [\"8 mm\", \"8 mm\", \"4 mm\"], counts = [4, 4, 2] } }";
    let list = "grains.1.placement.list=[{ position = [\"4.1 mm\", \"4.2 mm\", \"1.3 mm\"] }]";
    for (name, place) in [("lattice", lattice), ("list", list)] {
        let prepared = |steps: &str, speed: &str, folder: &str| {
            let steps = format!("preparation={{ relax_steps = {steps}, speed = \"{speed}\", cache = false }}");
            let changes = ["solver=mps", water, place, &steps[..], "run.steps=1"];
            start(&load(HELD, &changes), &scratch.join(&format!("{name}-{folder}")), On::threads(1))
        };
        let refused = prepared("2", "1e-9 m/s", "short").expect_err("two steps are too few").to_string();
        assert!(refused.contains("did not come to rest"), "{name}: {refused}");
        assert!(refused.contains("preparation.relax_steps"), "{name}: {refused}");
        // Negative control: enough steps.
        prepared("1000", "1 mm/s", "long").unwrap_or_else(|error| panic!("{name}: {error}"));
    }
}

#[test]
fn the_force_on_a_held_body_does_not_follow_its_density() {
    // A sphere of eight cells in a full box of water that is shaken, whatever it is made of.
    let force = |density: &str, shaken: f64| {
        let scratch = Scratch::new(&format!("held-{density}"));
        let overrides = [
            format!("material.glass.density={density} kg/m^3"),
            "grains=[{ name = \"ball\", shape = { sphere = { diameter = \"4 mm\" } }, motion = \"fixed\", \
             placement = { list = [{ position = [\"4 mm\", \"4 mm\", \"4 mm\"] }] } }]"
                .to_owned(),
            "liquid=[{ region = { box = { lower = [\"0 mm\", \"0 mm\", \"0 mm\"], upper = [\"8 mm\", \"8 mm\", \"8 mm\"] } }, allow_touching_grains = true }]".to_owned(),
            "boundary.all=slip".to_owned(),
            format!("frame.oscillation={{ amplitude = [\"{shaken} m/s^2\", \"0 m/s^2\", \"0 m/s^2\"], frequency = \"50 Hz\" }}"),
            "probe=[{ name = \"ball\", body = { population = \"ball\", index = 0 }, every = \"0.2 ms\" }]".to_owned(),
        ];
        let overrides: Vec<&str> = overrides.iter().map(String::as_str).collect();
        ran(HELD, &overrides, &scratch.join("run"), On::threads(1));
        let table = Table::read(&scratch.join("run/probes/ball.csv"));
        let [along, up] = ["fluid_force_1", "fluid_force_3"].map(|name| table.column(name).split_off(3));
        let mean = |forces: &[f64]| forces.iter().sum::<f64>() / forces.len() as f64;
        let largest = |forces: &[f64]| forces.iter().fold(0.0_f64, |most, force| most.max(force.abs()));
        [largest(&along), mean(&up)]
    };
    // Still water in the box: its displaced mass times the acceleration of the box, and times gravity.
    let water = 1e3 * std::f64::consts::PI / 6.0 * 64e-9;
    for density in ["1", "20", "300", "2500"] {
        let [along, up] = force(density, 5.0);
        assert!((along / (5.0 * water) - 1.0).abs() < 0.01, "{density}: {along:e}");
        assert!((up / (9.81 * water) - 1.0).abs() < 0.01, "{density}: {up:e}");
    }
    // Negative control: it is the force of the water, and half of it in a box shaken half as much.
    let [along, _] = force("1", 2.5);
    assert!((along / (2.5 * water) - 1.0).abs() < 0.01, "{along:e}");
}
