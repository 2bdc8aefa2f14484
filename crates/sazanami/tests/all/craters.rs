//! What is told of craters and of splashed grains: beds that are held, grains that leave or come later, boxes that begin anywhere.

use serde_json::Value;

use crate::support::{Left, On, Scratch, go_on, load, ran};

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
    // Its middle is 0.8 mm above the bed, and goes as far along x2 meanwhile; or through a periodic side and in again.
    let slanted = ["liquid.0.fall.angle=45 deg", "liquid.0.fall.heading=90 deg"];
    assert_at(&slanted, [2.0, 2.3]);
    let beyond = ["liquid.0.gap_above_bed=1.2 mm", "boundary={ all = \"slip\", x2 = \"periodic\" }"];
    assert_at(&[&slanted[..], &beyond].concat(), [2.0, 0.2]);
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
