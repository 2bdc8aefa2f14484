//! What a run would come upon is foreseen before it, and what it would not is not refused.

use std::path::Path;

use sazanami_posing::case::{self, LoadedCase, resolved};
use sazanami_posing::check::{self, CheckReport, CostModel, Known};
use sazanami_posing::feasible::{self, Feasible};
use sazanami_posing::machine::{Machine, MemoryLimit};
use sazanami_posing::schedule::StepEnds;

use crate::absurd_cases;

const RIPPLES: &str = "ripples/quick.toml";
const RAINDROP: &str = "raindrop/quick.toml";
const FEEDING: &str = "../crates/sazanami/tests/cases/feeding-stream.toml";

/// A box of 6 mm with walls and spheres of 1 mm in it, which are put as `placement` says.
fn spheres(placement: &str) -> String {
    format!(
        "[domain]\nsize = [\"6 mm\", \"6 mm\", \"6 mm\"]\ncells = [6, 6, 6]\n[run]\nuntil = \"1 ms\"\n[material.sand]\n\
         density = \"2650 kg/m^3\"\n[[grains]]\nname = \"sand\"\nshape.sphere.diameter = \"1 mm\"\n{placement}\n"
    )
}

fn machine() -> Machine {
    Machine { cpu: "any".into(), cores: 2, memory_available: Some(8 << 30), memory_limit: MemoryLimit::Machine }
}

fn changes(overrides: &[&str]) -> Vec<String> {
    overrides.iter().map(|text| (*text).to_owned()).collect()
}

/// Findings on a text, with labels and advice, and what is known of the case if it can run.
fn posed(text: &str, overrides: &[&str]) -> (Option<(LoadedCase, Feasible)>, String) {
    let told = |all: &case::Diagnostics, source: &case::Source| {
        let one = |found: case::DiagnosticRecord| {
            let [label, help] = [found.expected, found.suggestion].map(Option::unwrap_or_default);
            format!("{} | {label} | {help}\n", found.message)
        };
        all.records(source).into_iter().map(one).collect()
    };
    let loaded = case::parse(Path::new("c.toml"), text, &changes(overrides));
    let found = loaded.and_then(|loaded| {
        let feasible = feasible::check(&loaded, &machine(), &CostModel::default())?;
        Ok((loaded, feasible))
    });
    match found {
        Ok((loaded, feasible)) => {
            let warnings = told(&feasible.warnings, &loaded.source);
            (Some((loaded, feasible)), warnings)
        }
        Err(error) => (None, told(&error.diagnostics, &error.source)),
    }
}

fn refused(text: &str, overrides: &[&str], words: &str) {
    let (feasible, found) = posed(text, overrides);
    assert!(feasible.is_none() && found.contains(words), "{overrides:?}: `{words}` is not in {found}");
}

fn runs(text: &str, overrides: &[&str]) -> (LoadedCase, Feasible) {
    let (feasible, found) = posed(text, overrides);
    feasible.unwrap_or_else(|| panic!("{overrides:?}: {found}"))
}

/// Report of `check` on a text, and the report as text.
fn report(text: &str, overrides: &[&str]) -> (CheckReport, String) {
    let (loaded, feasible) = runs(text, overrides);
    let known = Known { shapes: &feasible.facts, ..Known::default() };
    let report = check::check(&loaded.case, known, &machine(), 2, &CostModel::default());
    let explained = check::explain(&loaded.case, &report);
    (report, explained)
}

/// A case that is shipped.
fn shipped(name: &str, overrides: &[&str]) -> LoadedCase {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../cases").join(name);
    case::load(&path, &changes(overrides)).unwrap_or_else(|error| panic!("{error}"))
}

/// The same with its changes, as `check` reports on it without its shapes.
fn shipped_report(name: &str, overrides: &[&str]) -> CheckReport {
    let loaded = shipped(name, overrides);
    check::check(&loaded.case, Known::default(), &machine(), 2, &CostModel::default())
}

#[test]
fn sizes_are_drawn_from_a_part_of_the_curve_that_has_some() {
    let text = spheres("placement.lattice = { counts = [3, 3, 3] }");
    let sizes = |keys: &str| format!("grains.0.size.lognormal={{ {keys} }}");
    for none in ["sigma = 0.1, lower = 0.2, upper = 0.5", "sigma = 0, lower = 1.1, upper = 1.2"] {
        refused(&text, &[&sizes(none)], "next to nothing of this log-normal distribution lies between its ends");
    }
    for some in ["sigma = 0.1", "sigma = 0", "sigma = 0.2, lower = 1.2, upper = 1.2", "sigma = 0.1, upper = 0.9"] {
        runs(&text, &[&sizes(some)]);
    }
    let (loaded, _) = runs(&text, &[&sizes("sigma = 0.2, lower = 1.2, upper = 1.2")]);
    assert_eq!(sazanami_posing::assembly::grains::factors(&loaded.case.grains[0], 2), [1.2, 1.2]);
}

#[test]
fn a_periodic_box_has_room_for_the_films_of_its_grains() {
    let ball = spheres("placement.list = [{ position = [\"3 mm\", \"1.6 mm\", \"3 mm\"] }]\n[[liquid]]\nregion.half_space.point = [\"0 m\", \"0 m\", \"7 mm\"]\nallow_touching_grains = true")
        .replace("1 mm\"\nplace", "2 mm\"\nplace");
    let long = |x2: &str| format!("domain.size=[\"6 mm\", \"{x2} mm\", \"6 mm\"]");
    let in_box = |x2: &str, film: &str| posed(&ball, &[&long(x2), "boundary.x2=periodic", film]);
    let (found, told) = in_box("3.24", "dem.film_roughness=auto");
    assert!(found.is_none() && told.contains("too long for the periodic box"), "{told}");
    // The box that is asked for suffices, and is longer than that of a dry sphere.
    let asked = told.split("it has to be ").nth(1).and_then(|rest| rest.split(' ').next()).expect("a length");
    assert!(asked.parse::<f64>().expect("a number") > 3.24, "{told}");
    assert!(in_box(asked, "dem.film_roughness=auto").0.is_some());
    assert!(in_box("3.24", "dem.film_roughness=none").0.is_some(), "negative control");
}

#[test]
fn a_packing_whose_grains_begin_within_each_other_is_foreseen() {
    const WITHIN: &str = "grains that are packed begin within each other";
    let packed = |spacing: &str| spheres(&format!("count = 40\nplacement.packed = {{ spacing = {spacing} }}"));
    // Half a diameter apart: by a radius.
    refused(&packed("0.5"), &[], WITHIN);
    refused(&packed("0.5"), &[], "more than 80 % ends the run");
    let told = |spacing: &str| {
        let (runs, found) = posed(&packed(spacing), &[]);
        assert!(runs.is_some(), "{spacing}: {found}");
        found.contains(WITHIN)
    };
    assert!(told("0.75"), "seven along 6 mm overlap by 0.29 of a radius, which the run bears");
    assert!(!told("0.95") && !told("1.05"));
    // Grains of unlike sizes are scattered, whatever the spacing.
    let sizes = "size.list = [{ factor = 1, weight = 0.5 }, { factor = 0.4, weight = 0.5 }]";
    runs(&spheres(&format!("count = 40\n{sizes}\nplacement.packed = {{ spacing = 0.5 }}")), &[]);
}

#[test]
fn a_displacement_that_the_spacing_of_a_packing_cuts_is_told() {
    const LESS: &str = "grains are displaced by less than `jitter` says";
    let told = |keys: &str| posed(&spheres(&format!("count = 40\nplacement.packed = {{ {keys} }}")), &[]).1;
    let cut = told("jitter = 0.2");
    assert!(cut.contains(LESS) && cut.contains("0.02381 of the distance of neighbours"), "{cut}");
    let none = told("spacing = 0.95, jitter = 0.2");
    assert!(none.contains(LESS) && none.contains("along x3 by 0 of the distance"), "{none}");
    // Negative control: what there is room for, or all but so, and the default.
    for keys in ["", "spacing = 0.95", "spacing = 1.1, jitter = 0.05", "spacing = 2, jitter = 0.2"] {
        assert!(!told(keys).contains(LESS), "{keys}");
    }
}

#[test]
fn lattices_are_looked_at_as_they_are_drawn() {
    let lattice = |keys: &str| spheres(&format!("placement.lattice = {{ counts = [5, 5, 5]{keys} }}"));
    refused(&lattice(", jitter = 0.5"), &[], "overlaps grain");
    runs(&lattice(", jitter = 0.05"), &[]);
    // Those that are held may overlap each other, and the run lets them.
    runs(
        &lattice(", jitter = 0.4"),
        &[
            "grains.0.motion=fixed",
            "grains.0.shape.sphere.diameter=1.15 mm",
            "boundary={ all = \"periodic\" }",
            "gravity=0 m/s^2",
        ],
    );
    // A block that is higher than wide shakes its grains out of the floor and the lid, by some seeds.
    let high = spheres("placement.lattice = { counts = [3, 3, 2], jitter = 0.5 }");
    let sides = ["domain.size=[\"6 mm\", \"6 mm\", \"20 mm\"]", "boundary.x1=periodic", "boundary.x2=periodic"];
    let sticks_out = |seed: &usize| {
        let seed = format!("grains.0.seed={seed}");
        posed(&high, &[&sides[..], &[&seed]].concat()).1.contains("sticks out of the box")
    };
    let found = (0..12).filter(sticks_out).count();
    assert!((1..12).contains(&found), "{found}");
    // Sizes as they are drawn, of which the largest there could be is 2.5 mm.
    let drawn = spheres("size.lognormal = { sigma = 0.3 }\nplacement.lattice = { counts = [2, 2, 2] }");
    let small = "domain.size=[\"4 mm\", \"4 mm\", \"4 mm\"]";
    runs(&drawn, &[small]);
    refused(&drawn, &[small, "grains.0.shape.sphere.diameter=2 mm"], "sticks out of the box");
}

#[test]
fn grains_overlap_across_periodic_sides_too() {
    let pair = |x: &str| {
        let at = |x: &str| format!("{{ position = [\"{x} mm\", \"3 mm\", \"3 mm\"] }}");
        spheres(&format!("placement.list = [{}, {}]", at("0.2"), at(x)))
    };
    refused(&pair("5.8"), &["boundary.x1=periodic"], "grain 1 of `sand` overlaps grain 0 of `sand`");
    let (_, found) = posed(&pair("5.8"), &["boundary.x1=periodic"]);
    assert_eq!(found.matches("overlaps").count(), 1, "{found}");
    assert!(!posed(&pair("5.1"), &["boundary.x1=periodic"]).1.contains("overlaps"), "negative control");
}

#[test]
fn populations_that_are_packed_have_to_fit_into_the_box_together() {
    // 250 spheres are 0.61 of the box.
    let two = spheres("count = 250\nplacement.packed = {}")
        + "[[grains]]\nname = \"grit\"\nshape.sphere.diameter = \"1 mm\"\ncount = 250\nplacement.packed = {}\n";
    refused(&two, &[], "`sand` and `grit` do not fit into the box together | 500 grains");
    runs(&two, &["grains.1.count=10"]);
    refused(&two, &["grains.0.count=1", "grains.1.count=400"], "do not fit");
}

#[test]
fn grains_above_a_bed_are_measured_by_its_level_and_its_drawn_sizes() {
    let above = |packed: &str, height: &str| {
        spheres(&format!("count = 200\n{packed}"))
            + &format!(
                "[[grains]]\nname = \"stone\"\nmotion = \"fixed\"\nshape.sphere.diameter = \"1 mm\"\nplacement.list = [{{ position = [\"3 mm\", \"3 mm\", \"{height} mm\"] }}]\n"
            )
    };
    const LIES: &str = "lies where other grains are packed";
    refused(&above("placement.packed = {}", "5"), &[], LIES);
    runs(&above("placement.packed = { level = \"3 mm\" }", "5"), &[]);
    refused(&above("placement.packed = { level = \"3 mm\" }", "3"), &[], LIES);
    // 40 spheres with a mean cube of 3 make a bed of 4 mm; each as large as the largest there can be, one of some 100 mm.
    let drawn = "size.lognormal = { sigma = 0.5 }\nplacement.packed = {}";
    let box_ = ["domain.size=[\"6 mm\", \"6 mm\", \"30 mm\"]", "grains.0.count=40"];
    runs(&above(drawn, "25"), &box_);
    refused(&above(drawn, "3"), &box_, LIES);
}

#[test]
fn a_grain_of_a_list_that_moves_is_too_light_by_itself() {
    let light = |motions: [&str; 2]| {
        let [of_all, own] = motions;
        spheres(&format!("motion = \"{of_all}\"\nplacement.list = [{{ position = [\"3 mm\", \"3 mm\", \"3 mm\"], motion = \"{own}\" }}]\n[[liquid]]\nregion.half_space.point = [\"0 m\", \"0 m\", \"1 mm\"]"))
            .replace("2650", "200")
            .replace("[6, 6, 6]", "[24, 24, 24]")
    };
    refused(&light(["fixed", "free"]), &[], "`sand` is too light");
    runs(&light(["free", "fixed"]), &[]);
}

#[test]
fn steps_end_where_grains_are_fed_in_and_let_go() {
    let ends = |overrides: &[&str]| {
        let case = shipped(FEEDING, overrides).case;
        let [foretold, written] = [StepEnds::foretold(&case), StepEnds::of(&case)];
        let times = |ends: &StepEnds| {
            let next = |now: &f64| ends.next_after(*now);
            std::iter::successors(ends.next_after(0.0), next).take_while(|time| *time < 0.9 * case.run.until).count()
        };
        [times(&foretold), times(&written)]
    };
    // At 8.3 and 16.7 ms, then every 2 ms from 3 to 19 ms.
    let [some, none] = ends(&[]);
    assert_eq!(some, none + 2);
    let [more, none] = ends(&["grains.0.placement.fed.rate=500 Hz", "grains.0.placement.fed.from=3 ms"]);
    assert_eq!(more, none + 9);
    let still = |release: &str| {
        let text = spheres(&format!("{release}placement.list = [{{ position = [\"3 mm\", \"3 mm\", \"3 mm\"] }}]"));
        StepEnds::foretold(&runs(&text, &["output.series={ at = [] }"]).0.case).next_after(0.0)
    };
    assert_eq!(still("release = \"0.4 ms\"\n"), Some(0.4e-3));
    assert_ne!(still(""), Some(0.4e-3), "negative control");
    // They count as steps.
    let steps = |rate: &str| {
        shipped_report(FEEDING, &["fluid.dt_max=1 s", "output.series={ at = [] }", "probe=[]", rate]).steps
    };
    let [few, many] = [50, 600].map(|rate| steps(&format!("grains.0.placement.fed.rate={rate} Hz")));
    assert!(many >= few + 4.0, "{few} {many}");
}

#[test]
fn the_water_of_a_shaken_tank_stands_on_its_bed() {
    let depth = |placement: &str| {
        let change = format!("grains.0.placement={placement}");
        let changes = [&change[..], "grains.0.count=14439"];
        shipped_report(RIPPLES, if placement.is_empty() { &[] } else { &changes })
            .particles
            .and_then(|particles| particles.tank)
            .expect("waves")
            .depth_m
    };
    let is_near = |found: f64, expected: f64| (found - expected).abs() < 1e-9;
    assert!(is_near(depth(""), 10e-3));
    // 14,439 spheres of 1 mm over 120 x 9 mm make 11.7 mm of bed in 20 mm of water.
    let bed = 14_439.0 * std::f64::consts::PI / 6.0 * 1e-9 / (0.6 * 0.12 * 9e-3);
    assert!(is_near(depth("{ packed = {} }"), 20e-3 - bed), "{}", depth("{ packed = {} }"));
    // The same number in a file, half as large each in volume.
    let file = tempfile::Builder::new().suffix(".csv").tempfile().expect("a file");
    let row = |n: u32| {
        let [i, j, k] = [n % 100, n / 100 % 8, n / 800].map(f64::from);
        format!("{},{},{},0.5\n", 1e-3 * (i - 50.0), 1e-3 * (j + 0.5), 1e-3 * (0.5 + 0.5 * k))
    };
    let rows: String = (0..8000).map(row).collect();
    std::fs::write(file.path(), format!("x1_m,x2_m,x3_m,size_factor\n{rows}")).expect("it is written");
    let read = depth(&format!("{{ bed = {{ file = \"{}\" }} }}", file.path().display()));
    assert!(is_near(read, 20e-3 - bed * 8000.0 / 14_439.0 / 8.0), "{read}");
    // Without gravity there are no waves.
    let waves = |changes: &[&str]| {
        let tank = "../verification/mps-shaken-tank/case.toml";
        shipped_report(tank, changes).particles.and_then(|particles| particles.tank).is_some()
    };
    assert!(!waves(&["gravity=0 m/s^2"]) && waves(&[]));
}

#[test]
fn the_strongest_force_is_that_of_all_that_shakes_the_box() {
    let longest = |changes: &[&str]| {
        let report = shipped_report(RIPPLES, changes);
        report.limits.iter().find(|limit| limit.name == "body_force").expect("a limit").dt_s
    };
    let (plain, sudden) = (
        longest(&[]),
        longest(&[
            "frame.motion={ amplitude = [\"10 mm\", \"0 m\", \"0 m\"], frequency = \"2 Hz\", phase = \"90 deg\", ramp = \"1 ms\" }",
        ]),
    );
    // 6 A/ramp^2 beside 9.8 m/s^2.
    let amplitude = 10e-3;
    let expected = (9.81_f64.hypot(6.0 * amplitude / 1e-6) / 9.81).sqrt().recip();
    assert!((sudden / plain / expected - 1.0).abs() < 0.1, "{sudden} {plain} {expected}");
    let shaken =
        longest(&["frame.oscillation={ amplitude = [\"300 m/s^2\", \"0 m/s^2\", \"0 m/s^2\"], frequency = \"5 Hz\" }"]);
    assert!((0.1..0.3).contains(&(shaken / plain)), "{shaken} {plain}");
    assert!((longest(&["frame.motion.ramp=2 s"]) / plain - 1.0).abs() < 0.05, "negative control");
}

#[test]
fn a_fixed_step_makes_passes_where_thick_liquid_meets_gas() {
    let half = "[domain]\nsize = [\"6 mm\", \"6 mm\", \"6 mm\"]\ncells = [12, 12, 12]\n[run]\nuntil = \"1 ms\"\n[fluid.liquid]\n\
                density = \"1260 kg/m^3\"\nkinematic_viscosity = \"1e-2 m^2/s\"\n[[liquid]]\nregion.half_space.point = [\"0 m\", \"0 m\", \"3 mm\"]\n";
    let adaptive = report(half, &[]).0;
    let limit = adaptive.limits.iter().find(|limit| limit.name == "interface_viscosity").expect("a limit").dt_s;
    let fixed = |parts: f64| posed(half, &[&format!("fluid.dt={:e} s", parts * limit)]).1;
    assert!(!fixed(3.0).contains("fixed step"), "{}", fixed(3.0));
    assert!(fixed(30.0).contains("passes in each") || fixed(30.0).contains("longer than"), "{}", fixed(30.0));
}

#[test]
fn files_have_names() {
    for (case, key) in [(RAINDROP, "output.bed"), ("raindrop/small.toml", "grains.0.placement.bed.file")] {
        let found = absurd_cases::findings(case, &[&format!("{key}=\"\"")]);
        assert!(!found.0 && found.1.iter().any(|text| text.contains("names no file")), "{key}: {found:?}");
    }
    assert!(absurd_cases::findings(RAINDROP, &["output.bed=\"some.bed\""]).0);
}

#[test]
fn a_tank_that_is_accelerated_has_no_place_in_the_laboratory() {
    let file = tempfile::NamedTempFile::new().expect("a file");
    let profile = |frame: &str| {
        std::fs::write(file.path(), format!("{frame}x_m,z_m\n-0.05,0.01\n0,0.01\n0.05,0.01\n")).expect("it is written");
        let measured = format!("ripples={{ measured = [{{ time = \"1 s\", bed = \"{}\" }}] }}", file.path().display());
        absurd_cases::findings(RIPPLES, &[&measured, "frame.acceleration=[\"0.1 m/s^2\", \"0 m/s^2\", \"0 m/s^2\"]"])
    };
    let (fine, found) = profile("# frame: laboratory\n");
    assert!(!fine && found.iter().any(|text| text.contains("cannot be brought into this tank")), "{found:?}");
    assert!(profile("").1.iter().all(|text| !text.contains("cannot be brought")), "negative control");
}

#[test]
fn bubbles_may_surround_grains_wherever_they_are_put() {
    let wet = |fluid: &str| {
        spheres(&format!(
            "placement.list = [{{ position = [\"3 mm\", \"3 mm\", \"3 mm\"] }}]\n[[liquid]]\nregion.half_space.point = [\"0 m\", \"0 m\", \"5 mm\"]\nallow_touching_grains = true\n[[liquid]]\nname = \"ball\"\nfluid = \"{fluid}\"\nposition = [\"3 mm\", \"3 mm\", \"3 mm\"]\nregion.sphere.diameter = \"3 mm\""
        ))
    };
    runs(&wet("gas"), &[]);
    refused(&wet("liquid"), &[], "`ball` touches grains");
}

#[test]
fn a_bed_that_is_levelled_at_a_layer_keeps_a_layer() {
    // 200 spheres over 36 mm^2; a layer of them, as loose as a bed, is some 20 to 30.
    let left = |level: &str| {
        let text = spheres(&format!("count = 200\nplacement.packed = {{ level = \"{level} mm\" }}"));
        report(&text, &[]).0.populations[0].levelled.expect("some")
    };
    assert!((18..=32).contains(&left("1.1")), "{}", left("1.1"));
    assert!((50..=75).contains(&left("2.1")), "{}", left("2.1"));
}

#[test]
fn closed_sides_that_hold_no_grains_are_told() {
    let text = spheres("placement.list = [{ position = [\"3 mm\", \"3 mm\", \"3 mm\"] }]");
    const ENDS: &str = "grains that get through x1_upper end the run";
    let walls = "dem.grain_walls=[\"x1_lower\", \"x2_lower\", \"x2_upper\", \"x3_lower\", \"x3_upper\"]";
    assert!(report(&text, &[walls]).1.contains(ENDS));
    assert!(!report(&text, &[]).1.contains(ENDS));
    let open = report(&text, &[walls, "boundary.x1_upper=outflow"]).1;
    assert!(open.contains("grains leave through x1_upper") && !open.contains(ENDS), "{open}");
}

#[test]
fn a_feed_that_begins_after_the_run_is_told_so() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../sazanami/tests/cases/feeding-stream.toml");
    let text = std::fs::read_to_string(path).expect("it is there");
    let late = ["grains.0.placement.fed.from=70 ms"];
    refused(
        &text.replace("until = \"20 ms\"\n", ""),
        &late,
        "the feed begins after the end of the run | the run ends at 0.065 s",
    );
    refused(&text, &late, "the feed ends before it begins");
}

#[test]
fn a_layer_slides_where_gravity_slants() {
    let layer = "[domain]\nsize = [\"60 mm\", \"6 mm\", \"20 mm\"]\ncells = [60, 6, 20]\n[run]\nuntil = \"0.1 s\"\n[[liquid]]\nregion.half_space.point = [\"0 m\", \"0 m\", \"10 mm\"]\n";
    let most = |changes: &[&str]| report(layer, changes).0.most_steps;
    let along = "gravity=[\"9.81 m/s^2\", \"0 m/s^2\", \"0 m/s^2\"]";
    let flat = most(&[]);
    assert!(most(&[along]) > 2.0 * flat, "{} {flat}", most(&[along]));
    assert!(most(&[along, "boundary.x1=periodic"]) < most(&[along]), "negative control");
}

#[test]
fn the_hash_of_a_copy_knows_no_folders_of_regions() {
    let copy = |folder: &str| {
        resolved::hash_of_copy(&format!(
            "[[liquid]]\nregion = {{ union = [{{ file = {{ file = \"{folder}a \\\"b\\\".vti\", angle = 0 }} }}, {{ file = {{ file = '{folder}c.vti' }} }}] }}\n"
        ))
    };
    assert_eq!(copy("/one/place/"), copy("/another/"));
    let other = "[[liquid]]\nregion = { file = { file = \"/one/c.vti\" } }\n";
    let is_same = |text: &str| resolved::hash_of_copy(other) == resolved::hash_of_copy(text);
    assert!(is_same(&other.replace("/one/", "")) && !is_same(&other.replace("c.vti", "d.vti")));
}

/// Water between two walls, periodic along x2.
const CHANNEL: &str = "solver = \"mps\"\n[domain]\nsize = [\"10 mm\", \"6 mm\", \"6 mm\"]\n[boundary]\nx1 = \"no_slip\"\nx2 = \"periodic\"\n\
                       x3 = \"slip\"\n[particles]\nspacing = \"1 mm\"\ndt_max = \"1 ms\"\n[[liquid]]\n\
                       region.box = { lower = [\"0 mm\", \"0 mm\", \"0 mm\"], upper = [\"10 mm\", \"6 mm\", \"6 mm\"] }\n\
                       [run]\nuntil = \"0.3 s\"\n";

#[test]
fn what_a_force_along_periodic_sides_makes_is_foreseen() {
    let most = |force: &str, changes: &[&str]| report(CHANNEL, &[&[force], changes].concat()).0.most_steps;
    let by_drive = "drive.acceleration=[\"0 m/s^2\", \"10 m/s^2\", \"0 m/s^2\"]";
    // It falls freely in so short a time: at 3 m/s a step is 0.05 ms long. A run took 3054 steps.
    let steps = most(by_drive, &[]);
    assert!((3054.0..6200.0).contains(&steps), "{steps}");
    for force in [
        "gravity=[\"0 m/s^2\", \"10 m/s^2\", \"0 m/s^2\"]",
        "frame.acceleration=[\"0 m/s^2\", \"-10 m/s^2\", \"0 m/s^2\"]",
    ] {
        assert_eq!(most(force, &[]), steps, "{force}");
    }
    // A thick liquid gets to g h^2/(8 nu) = 1.25 mm/s and no further.
    let thick = "fluid.liquid={ density = \"1000 kg/m^3\", kinematic_viscosity = \"0.1 m^2/s\" }";
    assert!(most(by_drive, &[thick]) < 1.1 * most("gravity=0 m/s^2", &[thick]));
    // Negative control: a mean velocity that is held.
    let held = "drive={ acceleration = [\"0 m/s^2\", \"10 m/s^2\", \"0 m/s^2\"], mean_velocity = [\"0 m/s\", \"1 mm/s\", \"0 m/s\"] }";
    assert!(most(held, &["gravity=[\"0 m/s^2\", \"1 m/s^2\", \"0 m/s^2\"]"]) < 0.3 * steps);
}

/// 6 mm of water in a shaft of 160 mm.
const SHAFT: &str = "solver = \"mps\"\ngravity = \"9.81 m/s^2\"\n[domain]\nsize = [\"8 mm\", \"8 mm\", \"160 mm\"]\n[boundary]\nx1 = \"periodic\"\n\
                     x2 = \"periodic\"\nx3_lower = \"slip\"\nx3_upper = \"outflow\"\n[particles]\nspacing = \"1 mm\"\ndt_max = \"1 ms\"\n\
                     [[liquid]]\nregion.half_space = { point = [\"0 mm\", \"0 mm\", \"6 mm\"] }\n[material.m]\ndensity = \"2650 kg/m^3\"\n\
                     [contact.default]\nnormal_stiffness = \"400 N/m\"\nrestitution = 0.5\n[[grains]]\nshape.sphere.diameter = \"1 mm\"\n\
                     count = 2\n[output]\nseries = { every = \"5 ms\" }\nfields = { at = [] }\nfigures = { at = [] }\n[run]\nuntil = \"0.2 s\"\n";

#[test]
fn grains_that_fall_through_the_air_are_foreseen_beside_others_under_water() {
    let most = |placement: &str| {
        let list = placement.starts_with('[');
        let key = if list { "list" } else { "fed" };
        let text = if list { SHAFT.replace("count = 2\n", "") } else { SHAFT.to_owned() };
        report(&text, &[&format!("grains.0.placement.{key}={placement}")]).0.most_steps
    };
    let (high, low) =
        ("{ position = [\"4 mm\", \"4 mm\", \"155 mm\"] }", "{ position = [\"2 mm\", \"2 mm\", \"0.5 mm\"] }");
    // Runs took 1084 and 1196 steps.
    let both = most(&format!("[{high}, {low}]"));
    assert!((1084.0..5000.0).contains(&both), "{both}");
    let fed = most("{ side = \"x3_upper\", rate = \"20 Hz\", velocity = [\"0 m/s\", \"0 m/s\", \"-0.1 m/s\"] }");
    assert!((1196.0..5000.0).contains(&fed), "{fed}");
    // Negative control: under water alone.
    let sunk = most(&format!("[{low}]"));
    assert!(sunk < 0.5 * both, "{sunk} {both}");
}

#[test]
fn grains_that_are_carried_through_a_wall_are_refused() {
    let carried = spheres(
        "motion = \"prescribed\"\nplacement.list = [{ position = [\"3 mm\", \"3 mm\", \"3 mm\"], velocity = [\"1 m/s\", \"0 m/s\", \"0 m/s\"] }]",
    );
    refused(&carried, &["run.until=4 ms"], "grain 0 of `sand` is carried through the wall x1_upper");
    refused(&carried, &["run.until=4 ms"], "its centre is there at 3.004 ms, and the run goes on to 4 ms");
    // Where the run may end sooner it is warned of.
    let (feasible, found) = posed(&carried, &["run.until=4 ms", "run.steps=3"]);
    assert!(feasible.is_some() && found.contains("is carried through the wall x1_upper"), "{found}");
    // Negative controls: a run that ends before, and sides that let it through.
    runs(&carried, &["run.until=2.9 ms"]);
    runs(&carried, &["run.until=4 ms", "boundary.x1=periodic"]);
    runs(&carried, &["run.until=4 ms", "boundary.x1_upper=outflow"]);
    // What moves sideways at one end and leaves at the other.
    let back = "grains.0.placement.list.0.velocity=[\"0 m/s\", \"-1 m/s\", \"0 m/s\"]";
    refused(&carried, &["run.until=4 ms", back], "through the wall x2_lower");
}

#[test]
fn the_surfaces_of_grains_that_turn_are_foreseen() {
    let turning = |shape: &str, turn: &str| {
        format!(
            "[domain]\nsize = [\"24 mm\", \"24 mm\", \"24 mm\"]\ncells = [24, 24, 24]\n[[liquid]]\nallow_touching_grains = true\n\
             region.box = {{ lower = [\"0 mm\", \"0 mm\", \"0 mm\"], upper = [\"24 mm\", \"24 mm\", \"24 mm\"] }}\n[material.s]\n\
             density = \"2650 kg/m^3\"\n[[grains]]\nmotion = \"prescribed\"\nshape.{shape}\nplacement.list = [{{ position = \
             [\"12 mm\", \"12 mm\", \"12 mm\"], angular_velocity = [\"0 rad/s\", \"{turn}\", \"0 rad/s\"] }}]\n[run]\nuntil = \"10 ms\"\n"
        )
    };
    let plate = turning("box = { size = [\"14 mm\", \"14 mm\", \"4 mm\"] }", "400 rad/s");
    let (found, text) = report(&plate, &[]);
    // A fifth of a cell at 2.8 m/s, the speed of the edge along the normal of the face; a run took 140 steps.
    let motion = found.limits.iter().find(|limit| limit.name == "grain_motion").expect("it moves");
    assert!((motion.dt_s / (0.2e-3 / (400.0 * 7e-3)) - 1.0).abs() < 1e-9, "{motion:?}");
    assert!((100.0..280.0).contains(&found.steps), "{} {text}", found.steps);
    // A ball does not cover space as it turns, but takes the fluid along: 93 steps.
    let (ball, _) = report(&turning("sphere.diameter = \"16 mm\"", "400 rad/s"), &[]);
    assert!((93.0..280.0).contains(&ball.most_steps), "{}", ball.most_steps);
    // Negative controls: a plate that slides as fast without a turn is as before, and one that turns slowly.
    let slides = "grains.0.placement.list=[{ position = [\"12 mm\", \"12 mm\", \"12 mm\"], velocity = [\"0 m/s\", \"0 m/s\", \"0.1 m/s\"] }]";
    let (slid, _) = report(&plate, &[slides]);
    assert!(slid.most_steps < 30.0, "{}", slid.most_steps);
    let (slow, _) = report(&turning("sphere.diameter = \"16 mm\"", "1 rad/s"), &[]);
    assert!(slow.most_steps < 30.0, "{}", slow.most_steps);
    refused(&turning("sphere.diameter = \"3 mm\"", "1e9 rad/s"), &[], "this moves faster than sound in water");
}

#[test]
fn many_files_take_their_time() {
    let text = spheres("placement.lattice = { counts = [3, 3, 3] }");
    let files = |schedule: &str| {
        let (found, _) =
            report(&text, &["fluid.dt=1 us", &format!("output={{ {schedule}, figures = {{ at = [] }} }}")]);
        found.predicted_s.into_iter().find(|(part, _)| *part == "files").map(|(_, seconds)| seconds)
    };
    let nothing = "grains = { at = [] }, fields = { at = [] }";
    let model = CostModel::default();
    // 1000 steps: a field and the list of them each.
    let fields = files("grains = { at = [] }, fields = { steps = 1 }").expect("there are many");
    assert!((1990.0..2010.0).contains(&(fields / model.file)), "{fields}");
    assert!(
        files("grains = { every = \"1 us\" }, fields = { at = [] }")
            .is_some_and(|seconds| seconds > 1900.0 * model.file)
    );
    // Negative control.
    assert_eq!(files(nothing), None);
}
