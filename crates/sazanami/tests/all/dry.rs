//! Grains in a tank of moving particles without water: they fall as grains do, and no step is paid for water.

use crate::support::{On, Scratch, findings, foretold, load, ran};

/// A bead that falls for 20 ms.
const TANK: &str = include_str!("../cases/dry-tank.toml");

const WATER: &str =
    "[[liquid]]\nregion.box = { lower = [\"0 mm\", \"0 mm\", \"0 mm\"], upper = [\"10 mm\", \"10 mm\", \"3 mm\"] }\n";

#[test]
fn dry_grains_fall_and_pay_for_no_water() {
    let folder = Scratch::new("dry");
    for (name, text) in [("dry", TANK.to_owned()), ("wet", format!("{TANK}{WATER}"))] {
        let is_dry = name == "dry";
        let told = foretold(&load(&text, &[]).case);
        let fluid = told.predicted_s.iter().find(|(part, _)| *part == "fluid").map(|(_, seconds)| *seconds);
        assert_eq!(fluid == Some(0.0), is_dry, "{:?}", told.predicted_s);
        let left = ran(&text, &[], &folder.join(name), On::threads(1));
        // The control: with water there is a pressure to solve for.
        assert_eq!(left.summary["phase_s"]["pressure"].as_f64().unwrap_or_default() == 0.0, is_dry, "{}", left.summary);
        let [time, height] = ["time", "position_3"].map(|column| left.probe("bead").last(column));
        let fallen = 0.5 * 9.81 * time * time;
        assert!((10e-3 - height - fallen).abs() < 0.01 * fallen, "{name}: {height} after {time}");
    }
}

/// Force of the floor over the weight, and the potential energy, of a bead at rest, at the end.
fn at_rest(name: &str, overrides: &[&str], more: &str) -> [f64; 2] {
    let folder = Scratch::new(name);
    let lying = ["grains.0.placement={ list = [{ position = [\"5 mm\", \"5 mm\", \"0.5 mm\"] }] }", "run.until=60 ms"];
    let text = format!("{TANK}{more}");
    let left = ran(&text, &[&lying, overrides].concat(), &folder.join("run"), On::threads(1));
    ["contact_force_over_submerged_weight", "potential_energy"].map(|name| left.last(name))
}

#[test]
fn grains_out_of_water_weigh_what_they_weigh() {
    let mass = 2650.0 * std::f64::consts::PI / 6.0 * 1e-9;
    let [ratio, energy] = at_rest("dry-rest", &[], "");
    assert!((ratio - 1.0).abs() < 1e-3, "{ratio}");
    assert!((energy / (mass * 9.81 * 0.5e-3) - 1.0).abs() < 1e-3, "{energy}");
    // Gravity is tilted by 30 degrees: the floor bears its part along x3.
    let tilted = "gravity=[\"4.905 m/s^2\", \"0 m/s^2\", \"-8.4957 m/s^2\"]";
    let [ratio, _] = at_rest("dry-tilted", &[tilted, "contact.default.friction=0"], "");
    assert!((ratio - 1.0).abs() < 0.02, "{ratio}");
    // Above water that it does not reach: no water is displaced.
    let folder = Scratch::new("dry-above");
    let last = |name: &str, text: &str| {
        ran(text, &["run.until=2 ms"], &folder.join(name), On::threads(1)).last("potential_energy")
    };
    let [head, tail] = ["[material.sand]", "[output]"].map(|at| TANK.split(at).collect::<Vec<_>>());
    let alone = format!("{}[preparation]\ncache = false\n[output]{}{WATER}", head[0], tail[1]);
    let of_bead = last("both", &format!("{TANK}{WATER}")) - last("water", &alone);
    // As if it were under water it had 0.62 of that.
    assert!((of_bead / (mass * 9.81 * 10e-3) - 1.0).abs() < 0.1, "{of_bead}");
    // Under water the bead is lighter by what it displaces.
    let [ratio, _] = at_rest("wet-rest", &["run.until=20 ms"], WATER);
    assert!((ratio - 1.0).abs() < 0.1, "{ratio}");
}

#[test]
fn softer_springs_bear_the_same_weight_with_more_overlap_in_fewer_sub_steps() {
    let folder = Scratch::new("softened");
    let lying = ["grains.0.placement={ list = [{ position = [\"5 mm\", \"5 mm\", \"0.5 mm\"] }] }", "run.until=60 ms"];
    // Overlap with the floor [mm], force on the floor over the weight, and sub-steps in a second, before and after 30 ms.
    let of = |name: &str, keys: &[&str]| {
        let left = ran(TANK, &[&lying, keys].concat(), &folder.join(name), On::threads(1));
        let bead = left.probe("bead");
        let (times, heights) = (bead.column("time"), bead.column("position_3"));
        let [series, steps, dt, force] =
            ["time", "grain_substeps", "dt", "contact_force_over_submerged_weight"].map(|name| left.column(name));
        [0.029, 0.0599].map(|at| {
            let [probe, row] =
                [&times, &series].map(|times| times.iter().position(|time| *time >= at).expect("it ran"));
            [0.5 - 1e3 * heights[probe], force[row], steps[row] / dt[row]]
        })
    };
    let series = "output.series={ steps = 1 }";
    let [hard, soft] = of("soft", &[series, "dem.soften={ from = \"30 ms\", stiffness = 0.25 }"]);
    assert!((soft[0] / hard[0] - 4.0).abs() < 0.05, "{hard:?} {soft:?}");
    assert!((hard[1] - 1.0).abs() < 1e-3 && (soft[1] - 1.0).abs() < 1e-2, "{hard:?} {soft:?}");
    assert!((0.4..0.6).contains(&(soft[2] / hard[2])), "{hard:?} {soft:?}");
    // Negative control: with its own springs it lies as it lay.
    let [before, after] = of("hard", &[series]);
    assert!((after[0] / before[0] - 1.0).abs() < 0.05 && before[0] == hard[0], "{before:?} {after:?} {hard:?}");
}

#[test]
fn dry_grains_are_finer_than_the_particles_that_there_are_none_of() {
    let fine = ["grains.0.shape.sphere.diameter=0.3 mm"];
    assert!(findings(TANK, &fine).is_empty(), "{:?}", findings(TANK, &fine));
    // Negative control: water would read too few particles around them.
    let wet = findings(&format!("{TANK}{WATER}"), &fine);
    assert!(wet.iter().any(|found| found.contains("too few particles")), "{wet:?}");
}

#[test]
fn a_dry_bed_in_a_box_that_swings_slowly_and_far_has_no_flow_over_it() {
    let folder = Scratch::new("dry-swing");
    let bed = "grains.0.placement={ lattice = { lower = [\"0 mm\", \"0 mm\", \"0 mm\"], upper = [\"20 mm\", \"10 mm\", \"2 mm\"], \
               counts = [20, 10, 2] } }";
    let swing = "frame.oscillation={ amplitude = [\"1 m/s^2\", \"0 m/s^2\", \"0 m/s^2\"], frequency = \"0.02 Hz\" }";
    let text = TANK
        .replace("[boundary]", "[boundary]\nx1 = \"periodic\"")
        .replace("\"10 mm\", \"10 mm\", \"14 mm\"", "\"20 mm\", \"10 mm\", \"14 mm\"");
    let overrides = [bed, swing, "ripples={}", "run.until=2 ms"];
    let told = findings(&text, &overrides);
    assert!(!told.iter().any(|finding| finding.contains("turbulence")), "{told:?}");
    // By the way of the box, 63 m, ripples could be as long, and the bed was smoothed over as much.
    let left = ran(&text, &overrides, &folder.join("run"), On::threads(1));
    assert!(left.summary["observables"]["ripples"]["flow"].is_null(), "{}", left.summary["observables"]);
}

#[test]
fn what_a_tank_does_not_have_is_left_empty() {
    let folder = Scratch::new("dry-empty");
    let probe = "[[probe]]\nname = \"floor\"\npoint = [\"5 mm\", \"5 mm\", \"0.5 mm\"]\nsteps = 1\n";
    let short = ["run.until=0.5 ms", "preparation.relax_steps=0", "preparation.settle=0 s"];
    let dry = ran(&format!("{TANK}{probe}"), &short, &folder.join("dry"), On::threads(1));
    // Without liquid neither its volume nor its momentum is kept or lost.
    for name in ["liquid_volume_relative_change", "fluid_bulk_volume_relative_change", "momentum_residual_relative"] {
        assert!(dry.summary["conservation"][name].is_null(), "{name}: {}", dry.summary["conservation"]);
    }
    assert!(dry.column("bulk_volume_relative_change").iter().all(|change| change.is_nan()));
    // Water has a pressure once a step has solved for it; its velocity is known before.
    let wet = |name: &str, change: &str| {
        let changes = [&short[..], &[change]].concat();
        ran(&format!("{TANK}{WATER}{probe}"), &changes, &folder.join(name), On::threads(1))
    };
    let left = wet("wet", "preparation.cache=false");
    assert!(left.last("bulk_volume_relative_change").abs() < 1e-2);
    let (pressure, speed) = (left.probe("floor").column("pressure"), left.probe("floor").column("velocity_3"));
    assert!(pressure[0].is_nan() && speed[0] == 0.0, "{pressure:?} {speed:?}");
    assert!(pressure[1..].iter().all(|pressure| (pressure / 24.5 - 1.0).abs() < 0.5), "{pressure:?}");
    // Negative control: where the water came to rest before, its pressure is known.
    let rested = wet("rested", "preparation={ relax_steps = 5, must_rest = false, cache = false }");
    let first = rested.probe("floor").column("pressure")[0];
    assert!((first / 24.5 - 1.0).abs() < 0.5, "{first}");
}

/// Heights that the picture of a tank at its start shows \[m].
fn heights_shown(name: &str, text: &str, place: &str) -> [f64; 2] {
    let folder = Scratch::new(name);
    let placed = format!("grains.0.placement={{ list = [{{ position = [\"5 mm\", \"5 mm\", \"{place}\"] }}] }}");
    let wanted = [placed.as_str(), "output.figures={ at = [\"0 s\"] }", "run.until=0.2 ms"];
    ran(text, &wanted, &folder.join("run"), On::threads(1));
    let sketch = std::fs::read_to_string(folder.join("run/figures/grains-000000000.png")).expect("a sketch");
    let (_, rest) = sketch.split_once(" z: [").expect("its heights");
    let (ends, _) = rest.split_once(']').expect("their end");
    let ends: Vec<f64> = ends.split(", ").map(|end| end.parse().expect("a number")).collect();
    [ends[0], ends[1]]
}

#[test]
fn pictures_show_the_highest_grain_with_water_below_it_and_without() {
    let wet = format!("{TANK}{WATER}");
    // 5 mm above the top of a bead of 1 mm.
    for text in [TANK, &wet] {
        let [low, top] = heights_shown("dry-picture", text, "10 mm");
        assert!(low == 0.0 && (top - 15.5e-3).abs() < 1e-9, "{low} to {top}");
    }
    // The control: of a bead in the water the picture ends above that.
    let [_, top] = heights_shown("dry-picture-wet", &wet, "1 mm");
    assert!((top - 8e-3).abs() < 1e-3, "{top}");
}

#[test]
fn a_heap_is_measured_in_the_tank_that_carries_it() {
    let folder = Scratch::new("dry-heap");
    // A ridge of held grains twice as wide as high.
    let grain = |i: i32, j: i32| {
        let (x, y, z) = (20.0 + f64::from(i), 0.5 + f64::from(j), 8.0 - 0.5 * f64::from(i.abs()));
        format!("{{ position = [\"{x} mm\", \"{y} mm\", \"{z} mm\"] }}")
    };
    let places: Vec<String> = (-12..=12).flat_map(|i| (0..8).map(move |j| grain(i, j))).collect();
    let ridge = format!(
        "grains.0={{ shape.sphere.diameter = \"1 mm\", motion = \"fixed\", placement.list = [{}] }}",
        places.join(", ")
    );
    let box_of =
        ["domain.size=[\"40 mm\", \"8 mm\", \"14 mm\"]", "boundary={ x2 = \"periodic\", x3_upper = \"outflow\" }"];
    let angle = |name: &str, more: &[&str]| {
        let heap = ["heap={ shape = \"ridge\", axis = [\"20 mm\", \"4 mm\"] }", "run.until=30 ms", &ridge];
        let left = ran(TANK, &[&box_of[..], &heap, more].concat(), &folder.join(name), On::threads(1));
        let found = &left.summary["observables"]["heap"];
        found["angle_deg"].as_f64().unwrap_or_else(|| panic!("{found}"))
    };
    let at_rest = angle("rest", &[]);
    assert!((at_rest - 0.5f64.atan().to_degrees()).abs() < 2.0, "{at_rest}");
    // The tank is 5 mm aside by then, and moves.
    let motion =
        "frame.motion={ amplitude = [\"6 mm\", \"0 mm\", \"0 mm\"], frequency = \"5 Hz\", walls = \"moving\" }";
    let carried = angle("carried", &[motion]);
    assert!((carried / at_rest - 1.0).abs() < 1e-9, "{carried} for {at_rest}");
    // Negative control: about another line it is another.
    let aside = angle("aside", &["heap.axis=[\"15 mm\", \"4 mm\"]"]);
    assert!((aside / at_rest - 1.0).abs() > 1e-3, "{aside} for {at_rest}");
}
