//! What is told of craters and of splashed grains: beds that are held, grains that leave or come later, boxes that begin anywhere.

use std::path::Path;

use sazanami::analyse::analyse;
use serde_json::Value;

use crate::support::{Left, Listener, On, Scratch, Sketcher, go_on, load, owned, ran, summary};

/// Grains on a held bed in a box that is open all round: one lies, one leaps, one leaps out, one is fed in.
const HELD: &str = include_str!("../cases/craters-held.toml");

/// A drop on a bed of grains, beside the middle of the box.
const DROP: &str = include_str!("../cases/equivalence-drop-on-bed.toml");

/// The listed grains with the velocities of the two that move, in m/s.
fn loose(leaps: [f64; 3], leaves: [f64; 3]) -> String {
    let velocity = |[x, y, z]: [f64; 3]| format!("velocity = [\"{x} m/s\", \"{y} m/s\", \"{z} m/s\"]");
    let grain = |x: f64, rest: &str| format!("{{ position = [\"{x} mm\", \"4.25 mm\", \"6.25 mm\"]{rest} }}");
    let moving = |x: f64, v: [f64; 3]| grain(x, &format!(", {}", velocity(v)));
    format!("grains.1.placement.list=[{}, {}, {}]", grain(4.25, ""), moving(2.25, leaps), moving(7.75, leaves))
}

/// Splashed grains and those that are above the bed at the end, departed and fed grains.
fn counted(left: &Left) -> [u64; 4] {
    let [splash, conservation] = [&left.summary["observables"]["splash"], &left.summary["conservation"]];
    let number = |of: &Value, name: &str| of[name].as_u64().unwrap_or_else(|| panic!("no {name} in {of}"));
    [
        number(splash, "grains"),
        number(splash, "above_now"),
        number(conservation, "departed_grains"),
        number(conservation, "fed_grains"),
    ]
}

#[test]
fn splashed_grains_are_known_when_others_leave_and_come() {
    let scratch = Scratch::new("craters-splash");
    let whole = ran(HELD, &[], &scratch.join("whole"), On::threads(1));
    assert_eq!(counted(&whole), [2, 1, 1, 1]);
    let splash = whole.summary["observables"]["splash"].clone();
    let one = whole.summary["conservation"]["departed_mass"].as_f64().expect("a mass");
    assert!((splash["mass_mg"].as_f64().expect("a mass") / (2e6 * one) - 1.0).abs() < 1e-12, "{splash}");
    // The one that left was splashed before, and is still counted.
    let (splashed, gone) = (whole.column("splashed_grains"), whole.column("departed_grains"));
    assert!(splashed.windows(2).all(|pair| pair[0] <= pair[1]) && gone.last() == Some(&1.0), "{splashed:?} {gone:?}");
    // On two ranks, and from checkpoints before and after it left.
    let ranks = ran(HELD, &[], &scratch.join("ranks"), On::ranks(2, 1));
    assert_eq!(counted(&ranks), counted(&whole));
    let steps = whole.summary["steps"].as_u64().expect("a number");
    for stop in [2, steps - 2] {
        let place = scratch.join(&stop.to_string());
        ran(HELD, &[], &place, On::threads(1).steps(stop));
        go_on(&place, On::threads(1)).0.unwrap_or_else(|error| panic!("{error}"));
        let again = Left::in_folder(&place);
        assert_eq!(again.hash(), whole.hash());
        assert_eq!(again.summary["observables"]["splash"], splash, "from step {stop} of {steps}");
    }
    // Negative control: one that leaves along the bed is no splash.
    let along = loose([0.0, 0.0, 0.2], [0.3, 0.0, 0.0]);
    assert_eq!(counted(&ran(HELD, &[&along], &scratch.join("along"), On::threads(1))), [1, 1, 1, 1]);
}

#[test]
fn a_held_bed_is_not_in_the_air_and_lies_as_high_as_it_does() {
    let scratch = Scratch::new("craters-held");
    let found = |name: &str, overrides: &[&str]| {
        let left = ran(HELD, overrides, &scratch.join(name), On::threads(1));
        let observables = &left.summary["observables"];
        let number = |of: &str, name: &str| observables[of][name].as_f64().unwrap_or_else(|| panic!("no {name}"));
        (
            number("erosion", "airborne_grains"),
            number("erosion", "surface_grains"),
            number("erosion", "rim_height_mm"),
            number("soaked", "level_mm"),
        )
    };
    // The one that leaps and the one that is fed in fly; above all others of the upper layer nothing lies but one.
    let (airborne, surface, rim, level) = found("flying", &[]);
    assert_eq!(airborne, 2.0);
    assert!((323.0..=325.0).contains(&surface), "{surface}");
    // Two layers of half a millimetre, over a floor at 5 mm: spheres from above are a sixth of their size lower, and one lies on them.
    for height in [rim, level] {
        assert!((0.8..1.0).contains(&height), "{height}");
    }
    // Negative control: nothing flies where nothing leaps and nothing is fed in.
    let lying = loose([0.0; 3], [0.0; 3]);
    let (airborne, surface, ..) =
        found("lying", &[&lying, "grains.2.placement.fed.from=20 s", "grains.2.placement.fed.until=30 s"]);
    assert_eq!(airborne, 0.0);
    assert!((324.0..=327.0).contains(&surface), "{surface}");
}

#[test]
fn the_crater_is_looked_for_where_the_drop_meets_the_bed() {
    let axes = |overrides: &[&str]| {
        let case = load(DROP, &[&["erosion={ r_max = \"1.4 mm\" }"][..], overrides].concat()).case;
        (case.bed.axis, case.erosion.expect("it is asked for").axis)
    };
    let assert_at = |overrides: &[&str], place: [f64; 2]| {
        let (_, axis) = axes(overrides);
        assert!((0..2).all(|d| (1e3 * axis[d] - place[d]).abs() < 1e-9), "{overrides:?}: {axis:?}, not {place:?} mm");
    };
    assert_at(&[], [2.0, 1.5]);
    // Its middle is 0.8 mm above the bed, and goes nearly as far along x2 meanwhile; or through a periodic side and in again.
    let slanted = ["liquid.0.fall.angle=45 deg", "liquid.0.fall.heading=90 deg"];
    let way = |speed: f64, height: f64| {
        let v = speed * std::f64::consts::FRAC_1_SQRT_2;
        1e3 * v * ((v * v + 2.0 * 9.8 * 1e-3 * height).sqrt() - v) / 9.8
    };
    assert_at(&slanted, [2.0, 1.5 + way(2.0, 0.8)]);
    let beyond = ["liquid.0.gap_above_bed=1.2 mm", "boundary={ all = \"slip\", x2 = \"periodic\" }"];
    assert_at(&[&slanted[..], &beyond].concat(), [2.0, 1.5 + way(2.0, 1.9) - 3.2]);
    // A slow one falls steeper.
    assert_at(&[&slanted[..], &["liquid.0.fall.speed=0.1 m/s"]].concat(), [2.0, 1.5 + way(0.1, 0.8)]);
    assert!((way(0.1, 0.8) - 0.53).abs() < 0.01 && (way(2.0, 0.8) - 0.8).abs() < 0.01);
    // One that has a position is looked for below it.
    let placed = "liquid=[{ region.sphere = { diameter = \"1 mm\" }, position = [\"1 mm\", \"2 mm\", \"3 mm\"], fall.speed = \"2 m/s\" }]";
    assert_at(&[placed], [1.0, 2.0]);
    // Negative controls: a drop in the middle, to the bit; none that falls, and two; beyond a wall; an axis that is given.
    let middle = |overrides: &[&str]| {
        let (bed, axis) = axes(overrides);
        assert_eq!(axis, bed, "{overrides:?}");
    };
    middle(&["liquid.0.offset=[\"0 mm\", \"0 mm\"]"]);
    middle(&["liquid.0.fall.speed=0 m/s"]);
    let two =
        format!("{}, {}]", placed.trim_end_matches(']'), placed.trim_start_matches("liquid=[").trim_end_matches(']'));
    middle(&[&two]);
    middle(&[&slanted[..], &["liquid.0.gap_above_bed=1.2 mm"]].concat());
    assert_at(&["erosion.axis=[\"1.5 mm\", \"1.6 mm\"]"], [1.5, 1.6]);
}

/// Held spheres along the surface of a bed 2 mm high with a hollow 1.6 mm deep that a rim 0.4 mm high is around, in place of all grains.
fn hollow() -> String {
    let places = (0..18 * 18).map(|n| [n / 18, n % 18].map(|m| 0.25 + 0.5 * f64::from(m)));
    let grains: Vec<String> = places
        .map(|[x, y]| {
            let r = (x - 4.5).hypot(y - 4.5);
            let top = if r < 3.0 { 0.8 + 1.6 * (r / 3.0).powi(2) } else { (3.6 - 0.4 * r).max(2.0) };
            format!("{{ position = [\"{x} mm\", \"{y} mm\", \"{} mm\"] }}", 4.75 + top)
        })
        .collect();
    format!(
        "grains=[{{ name = \"bed\", shape.sphere = {{ diameter = \"0.5 mm\", refinement = 1 }}, motion = \"fixed\", \
         placement.list = [{}] }}]",
        grains.join(", ")
    )
}

#[test]
fn of_too_few_rows_nothing_is_said_of_rest() {
    let scratch = Scratch::new("craters-few-rows");
    let found = |every: &str| {
        let keys = [&hollow()[..], "run.until=6 ms", &format!("output.series.every={every}")];
        ran(HELD, &keys, &scratch.join(every), On::threads(1)).summary["observables"].clone()
    };
    let few = found("1 ms");
    let why = few["crater_rest"]["not_evaluated"].as_str().unwrap_or_else(|| panic!("{few:#}"));
    assert!(why.contains("in 7 rows of the series, and rest is judged by 8 or more"), "{why}");
    for volume in ["volume_below_rim", "volume"] {
        assert!(few["erosion"][format!("{volume}_mm3")].as_f64() > Some(10.0), "{few:#}");
        let doubts = few["erosion"][format!("{volume}_doubts")].as_str().unwrap_or_default();
        assert!(!doubts.contains("come to rest"), "{doubts}");
    }
    // Negative control: rows enough.
    let many = found("0.5 ms");
    assert_eq!(many["crater_rest"]["at_rest"], true, "{many:#}");
}

/// Analyses a folder.
fn analysed(folder: &Path, overrides: &[&str]) {
    analyse(&[folder.to_owned()], &owned(overrides), None, Some(&Sketcher), &mut Listener::default())
        .unwrap_or_else(|error| panic!("{overrides:?}: {error}"));
}

/// Splash of a run as an analysis with another key of the bed finds it.
fn splash_again(folder: &Path) -> Value {
    analysed(folder, &["bed.porosity_upper=6.5 mm"]);
    summary(&folder.join("analysis"))["observables"]["splash"].clone()
}

#[test]
fn a_bed_that_all_grains_have_left_has_no_crater_and_no_grain_above_it() {
    let scratch = Scratch::new("craters-emptied");
    let of = |velocity: &str| {
        format!(
            "grains=[{{ name = \"loose\", shape.sphere = {{ diameter = \"0.5 mm\", refinement = 1 }}, placement.list = \
             [{{ position = [\"7.75 mm\", \"4.25 mm\", \"6.25 mm\"], velocity = {velocity} }}] }}]"
        )
    };
    let folder = scratch.join("left");
    let left = ran(HELD, &[&of("[\"0.2 m/s\", \"0 m/s\", \"0.2 m/s\"]")], &folder, On::threads(1));
    let observables = &left.summary["observables"];
    assert_eq!(observables["splash"]["grains"], 1, "{observables}");
    assert_eq!(observables["splash"]["above_now"], 0, "{observables}");
    assert!(observables["erosion"]["not_evaluated"].is_string(), "{observables}");
    assert_eq!(splash_again(&folder), observables["splash"]);
    // Negative control: it is above the bed as long as it is there.
    let there = ran(HELD, &[&of("[\"0 m/s\", \"0 m/s\", \"0.25 m/s\"]")], &scratch.join("there"), On::threads(1));
    assert_eq!(there.summary["observables"]["splash"]["above_now"], 1, "{}", there.summary["observables"]);
}

#[test]
fn splashed_grains_are_found_again_through_periodic_sides() {
    let scratch = Scratch::new("craters-periodic");
    // The nearest image of the grain at 7.75 mm lies 2.25 mm from the axis.
    let keys = [
        "boundary={ all = \"outflow\", x1 = \"periodic\", x3_lower = \"slip\" }",
        "erosion={ axis = [\"1 mm\", \"4.5 mm\"], r_max = \"4 mm\" }",
        &loose([0.0; 3], [0.0, 0.0, 0.2]),
    ];
    let folder = scratch.join("run");
    let splash = ran(HELD, &keys, &folder, On::threads(1)).summary["observables"]["splash"].clone();
    let farthest = splash["farthest_distance_mm"].as_f64().unwrap_or_else(|| panic!("{splash}"));
    assert!((2.2..2.5).contains(&farthest), "{splash}");
    assert_eq!(splash_again(&folder), splash);
}

/// Lowest point of the surface of the bed in the sketch of the last section of a run \[m].
fn lowest_drawn(folder: &Path) -> f64 {
    let entries = std::fs::read_dir(folder.join("figures")).expect("the run drew").flatten().map(|entry| entry.path());
    let last = entries.filter(|path| path.display().to_string().contains("section-")).max().expect("it drew sections");
    let sketch = std::fs::read_to_string(last).expect("a sketch");
    let (_, points) = sketch.split_once(" now: [[").expect("a surface");
    let (points, _) = points.split_once("]]").expect("an end");
    let height = |point: &str| point.split_once(", ").and_then(|(_, height)| height.parse().ok()).expect("a height");
    points.split("], [").map(height).fold(f64::INFINITY, f64::min)
}

#[test]
fn a_held_bed_is_drawn_again_as_it_was() {
    let scratch = Scratch::new("craters-drawn");
    let every = ["figures", "fields", "grains"].map(|table| format!("output.{table}={{ every = \"10 ms\" }}"));
    let without_id = "output.grain_arrays=[\"population\", \"scale\", \"mass\", \"orientation\", \"velocity\", \"time_since_contact\"]";
    for (name, arrays) in [("all", None), ("no-id", Some(without_id))] {
        let folder = scratch.join(name);
        let keys: Vec<&str> = every.iter().map(String::as_str).chain(arrays).collect();
        ran(HELD, &keys, &folder, On::threads(1));
        let before = lowest_drawn(&folder);
        // Two layers of half a millimetre over a floor at 5 mm.
        assert!(before > 5.7e-3, "{name}: {before}");
        for entry in std::fs::read_dir(folder.join("figures")).expect("the run drew").flatten() {
            std::fs::write(entry.path(), "lost").expect("it can be lost");
        }
        analysed(&folder, &[]);
        let after = lowest_drawn(&folder);
        assert!((after - before).abs() < 1e-6, "{name}: {after}, not {before}");
    }
}

#[test]
fn pictures_are_not_drawn_again_without_the_bed_before_the_impact() {
    let scratch = Scratch::new("craters-kept");
    let kept = |name: &str, times: &str| {
        let every = ["figures", "fields", "grains"].map(|table| format!("output.{table}={{ {times} }}"));
        let folder = scratch.join(name);
        ran(HELD, &every.each_ref().map(String::as_str), &folder, On::threads(1));
        let figures =
            || std::fs::read_dir(folder.join("figures")).expect("the run drew").flatten().map(|entry| entry.path());
        figures().for_each(|path| std::fs::write(path, "as it was").expect("a file"));
        analysed(&folder, &[]);
        figures().filter(|path| std::fs::read(path).is_ok_and(|text| text == b"as it was")).count()
    };
    assert!(kept("late", "at = [\"10 ms\"]") > 0);
    // Control: with the bed at the start all are drawn.
    assert_eq!(kept("all", "at = [\"0 s\", \"10 ms\"]"), 0);
}
