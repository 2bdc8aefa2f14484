//! Shaken tanks of moving particles: the same bits on any number of threads and after an interruption, one motion in
//! several ways, tanks that are prepared.

mod meaning;

use std::path::{Path, PathBuf};

use sazanami::analyse::analyse;
use sazanami::case::meaning::{Case, TankMotion};
use sazanami::check::{self, CostModel, Known};
use sazanami::error::exit;
use sazanami::machine::Machine;
use sazanami::progress::StepLine;
use sazanami::tanks::{self, Maker};
use sazanami_io::checkpoint::{CheckpointReader, CheckpointWriter};
use sazanami_io::vtk::{Values, VtkFile};
use sazanami_numerics::Real;
use sazanami_test_support::vtk::parse;

use crate::support::{
    Left, Listener, On, Scratch, Sketcher, Table, before_run, go_on, heard, interrupted, load, owned, ran, start,
};

/// A tank of 14 x 8 mm with three layers of grains under as much water, shaken hard.
const TANK: &str = include_str!("../../cases/moving-particles-tank.toml");

/// A bed that slides through both periodic sides of a channel.
const SLIDING: &str = include_str!("../../cases/sliding-bed.toml");

/// Its motion.
const FORMULA: &str = "amplitude = [\"-2 mm\", \"0 mm\", \"0 mm\"]\nfrequency = \"5 Hz\"\nramp = \"0.02 s\"";
const STEPS: u64 = 14;
/// Pressure found so well that runs which sum in another order stay together.
const TIGHT: &str = "particles.tolerance=1e-12";

/// The tank with the motion of a record.
fn recorded(file: &Path) -> String {
    TANK.replace(FORMULA, &format!("file = \"{}\"", file.display()))
}

/// The tank without grains, with `more` tables.
fn water_alone(more: &str) -> String {
    let water = TANK.split("[material.sand]").next().expect("there is one part at least");
    format!("{water}{more}[output]\nfigures = {{ at = [] }}\nfields = {{ at = [] }}\n[run]\nuntil = \"1 s\"\n")
}

fn run_tank(folder: &Path, overrides: &[&str], on: On) -> Left {
    ran(TANK, overrides, folder, on.steps(STEPS))
}

fn near(a: &[Real], b: &[Real], tolerance: Real, what: &str) {
    let scale = a.iter().fold(0.0, |m: Real, x| m.max(x.abs()));
    assert_eq!(a.len(), b.len(), "{what}");
    for (a, b) in a.iter().zip(b) {
        assert!((a - b).abs() <= tolerance * scale || (a.is_nan() && b.is_nan()), "{what}: {a} and {b}");
    }
}

/// The warnings of a changed case.
fn warned(text: &str, change: &[&str]) -> Vec<String> {
    let (runs, found) = before_run(&load(text, change), &Machine::this());
    assert!(runs, "{found:#?}");
    found
}

#[test]
fn threads_ranks_and_interruptions_change_nothing() {
    let scratch = Scratch::new("tank");
    let whole = run_tank(&scratch.join("whole"), &[TIGHT], On::threads(1));
    let threads = run_tank(&scratch.join("threads"), &[TIGHT], On::threads(3));
    assert_eq!(whole.hash(), threads.hash());
    assert_eq!(whole.series, threads.series);
    // Packed on other ranks the bed is another, as contacts differ by round-off: they begin with the same tank.
    let state = format!("preparation.state={}", scratch.join("whole").join("prepared.state").display());
    let ranks = run_tank(&scratch.join("ranks"), &[&state, TIGHT], On::ranks(2, 1));
    for column in ["kinetic_energy_fluid", "kinetic_energy_grains", "potential_energy", "momentum_1", "grain_height"] {
        near(&whole.column(column), &ranks.column(column), 1e-6, column);
    }
    // Stopped after some steps, and while the tank was prepared.
    let folder = scratch.join("parts");
    ran(TANK, &[TIGHT], &folder, On::threads(2).steps(5));
    go_on(&folder, On::threads(1).steps(STEPS - 5)).0.unwrap();
    let parts = Left::in_folder(&folder);
    assert_eq!(whole.hash(), parts.hash());
    assert_eq!(whole.series, parts.series);
    assert_eq!(whole.probes, parts.probes);
    for (phase, after) in [
        ("relax", (|line: &StepLine| line.phase == "relax" && line.step == 4) as fn(&StepLine) -> bool),
        ("settle", |line: &StepLine| line.phase == "settle" && line.time > 2e-4),
    ] {
        let folder = scratch.join(phase);
        let stopped = interrupted(&load(TANK, &[TIGHT]), &On::threads(2).options(Some(&folder)), after);
        assert_eq!(stopped.steps, 0, "{phase}");
        go_on(&folder, On::threads(2).steps(STEPS)).0.unwrap();
        let left = Left::in_folder(&folder);
        assert_eq!(whole.hash(), left.hash(), "{phase}");
        assert_eq!(whole.series, left.series, "{phase}");
    }
}

#[test]
fn a_bed_that_slides_through_periodic_sides_goes_on_with_the_same_bits() {
    let scratch = Scratch::new("sliding");
    for ranks in [1, 2] {
        let (name, on) = (format!("ranks-{ranks}"), || On::ranks(ranks, 2));
        let whole = ran(SLIDING, &[], &scratch.join(&name), on().steps(90));
        for steps in [20, 70] {
            let folder = scratch.join(&format!("{name}-{steps}"));
            ran(SLIDING, &[], &folder, on().steps(steps));
            go_on(&folder, on().steps(90 - steps)).0.unwrap();
            let parts = Left::in_folder(&folder);
            assert_eq!((whole.hash(), &whole.series), (parts.hash(), &parts.series), "{name}, broken at {steps}");
        }
        // It slides: the force has given the bed a speed, and grains have gone round.
        let momentum = whole.column("momentum_1");
        assert!(momentum.last() > Some(&1e-4), "{momentum:?}");
    }
}

#[test]
fn a_tank_made_ready_begins_where_its_maker_began_and_fits_no_other() {
    let scratch = Scratch::new("ready");
    let first = run_tank(&scratch.join("first"), &[], On::threads(2));
    let state = scratch.join("first").join("prepared.state");
    let given = format!("preparation.state={}", state.display());
    // Another motion, and other observations: the tank is the same.
    let folder = scratch.join("again");
    let loaded = load(TANK, &[&given, "ripples.margin=2 mm"]);
    let listener = heard(&loaded, &On::threads(2).steps(STEPS).options(Some(&folder)));
    assert!(listener.lines.iter().all(|line| line.phase == "flow"));
    let again = Left::in_folder(&folder);
    assert_eq!(first.hash(), again.hash());
    // What was deep while the bed was packed is told of the tank.
    let deepest = |left: &Left| left.summary["worst"]["packing_overlap_relative"].as_f64().expect("a number");
    assert!(deepest(&first) > 0.0 && deepest(&again) == deepest(&first), "{} {}", deepest(&first), deepest(&again));
    let expected = |made_ready: bool| {
        let known = Known { made_ready, ..Known::default() };
        let report = check::check(&loaded.case, known, &Machine::this(), 1, &CostModel::default());
        report.predicted_s.iter().map(|(name, _)| *name).collect::<Vec<_>>()
    };
    assert!(tanks::made_ready(&loaded, Maker::default()).unwrap().tank.is_some());
    assert_eq!((expected(false), expected(true)), (vec!["packing", "fluid", "grains"], vec!["fluid", "grains"]));
    let refused = |overrides: &[&str]| {
        let mut all = vec![given.as_str()];
        all.extend(overrides);
        let loaded = load(TANK, &all);
        let outcome = start(&loaded, &scratch.join("other"), On::threads(1).steps(1));
        let error = outcome.expect_err("this tank is another");
        assert_eq!(error.exit_code(), exit::WRONG_INPUT);
        // So does the check of the case, and nothing was written.
        assert_eq!(tanks::made_ready(&loaded, Maker::default()).unwrap_err().to_string(), error.to_string());
        assert!(!scratch.join("other").exists());
        error.to_string()
    };
    // Made by a program that did not know a key yet: its default is as if it stood there, another value is not.
    let made_without = |key: &str| {
        let reader = CheckpointReader::open(&state).unwrap();
        let mut recipe: serde_json::Value = reader.get_json("tank/recipe").unwrap();
        let text = recipe["tank"].as_str().unwrap().to_owned();
        let kept: String = text.lines().filter(|line| !line.starts_with(key)).flat_map(|line| [line, "\n"]).collect();
        assert!(kept.len() < text.len(), "{key} is not in the recipe");
        recipe["tank"] = kept.into();
        let snapshot = reader.snapshot_of(|name| name != "tank/recipe").unwrap();
        let mut writer = CheckpointWriter::new();
        writer.add_snapshot(&snapshot).unwrap();
        writer.add_json("tank/recipe", &recipe).unwrap();
        let path = scratch.join(&format!("without-{key}.state"));
        writer.write_atomic(&path).unwrap();
        tanks::made_ready(&load(TANK, &[&format!("preparation.state={}", path.display())]), Maker::default()).is_ok()
    };
    assert!(made_without("courant") && made_without("tolerance"));
    assert!(!made_without("relax_steps") && !made_without("spacing"));
    let message = refused(&["contact.default.friction=0.3"]);
    assert!(message.contains("the state of another tank") && message.contains("friction = 0.4"), "{message}");
    refused(&["particles.spacing=0.99 mm", "domain.lower=[\"-6.93 mm\",\"0 mm\",\"0 mm\"]"]);
    std::fs::write(&state, "no state").unwrap();
    assert!(refused(&[]).contains("is no state of a tank"));
}

/// A tank at rest in which the bed may settle.
const STILL: [&str; 2] = ["frame.motion.amplitude=[\"1 nm\", \"0 mm\", \"0 mm\"]", "preparation.settle=60 ms"];

#[test]
fn a_resting_bed_is_carried_whether_its_lowest_grains_are_glued_or_not() {
    let scratch = Scratch::new("carried");
    for glued in ["", ", glued = \"0.75 mm\""] {
        let packed =
            format!("grains.0.placement.packed={{ level = \"3 mm\", spacing = 1.1, fall_gravity = 1.0{glued} }}");
        let left = run_tank(
            &scratch.join(if glued.is_empty() { "free" } else { "glued" }),
            &[&packed, STILL[0], STILL[1]],
            On::threads(2),
        );
        let carried = &left.column("contact_force_over_submerged_weight")[1..];
        let mean = carried.iter().sum::<Real>() / carried.len() as Real;
        assert!((mean - 1.0).abs() < 0.1, "{glued}: {mean} {carried:?}");
    }
}

#[test]
fn a_series_tells_what_ruled_steps_before_they_were_cut_for_it() {
    let scratch = Scratch::new("cut");
    let left = run_tank(&scratch.join("every"), &["output.series={ every = \"0.37 ms\" }"], On::threads(2));
    let [taken, stable, least] = ["dt", "stable_dt", "least_stable_dt"].map(|name| left.column(name));
    assert!(taken.len() > 3, "{taken:?}");
    for n in 1..taken.len() {
        assert!(taken[n] < stable[n] && least[n] <= stable[n] && least[n] > 0.0, "{taken:?} {stable:?} {least:?}");
    }
    let cut = left.summary["limiter"]["output"].as_u64().unwrap();
    assert!(
        cut as usize >= taken.len() - 1 && !left.series.rows.iter().flatten().any(|cell| cell == "output"),
        "{cut}"
    );
}

#[test]
fn the_pressure_of_water_that_follows_a_force_is_level_along_it() {
    let scratch = Scratch::new("level");
    let text = water_alone(
        "[preparation]\nrelax_steps = 0\nsettle = \"0 s\"\ncache = false\n[[probe]]\nname = \"along\"\nsteps = 5\n\
         line = { from = [\"-6 mm\", \"3.5 mm\", \"2 mm\"], to = [\"6 mm\", \"3.5 mm\", \"2 mm\"], points = 3 }\n",
    );
    let across = |side: &str| {
        let text = text.replacen("x2 = \"periodic\"", &format!("x2 = \"periodic\"\nx1 = \"{side}\""), 1);
        let sudden = ["frame.motion.ramp=0 s", "frame.motion.phase=90 deg"];
        let left = ran(&text, &sudden, &scratch.join(side), On::threads(1).steps(5));
        let [first, last] = ["pressure_at_0", "pressure_at_2"].map(|name| left.probe("along").last(name));
        (last - first).abs()
    };
    // The tank starts with 2 m/s^2: 12 mm of water between walls build up a pressure against it, between periodic sides none.
    let level = across("periodic");
    assert!(level < 1.0, "{level}");
    // Negative control: walls.
    let slope = across("no_slip");
    assert!(slope > 5.0, "{slope}");
}

/// Added mass and lift.
const FORCES: [&str; 3] = [TIGHT, "overlap.added_mass=zuber", "overlap.lift=mei"];

#[test]
fn added_mass_and_lift_are_kept_through_interruptions_and_written() {
    let scratch = Scratch::new("forces");
    let text = TANK.replace("grains = { at = [] }", "grains = { steps = 14 }");
    let whole = scratch.join("whole");
    let left = ran(&text, &FORCES, &whole, On::threads(1).steps(STEPS));
    assert!(left.summary["conservation"]["drag_exchange_residual_relative"].as_f64().unwrap() < 1e-9);
    assert_eq!(left.summary["particles"]["grains_without_vorticity"].as_u64(), Some(0));
    let parts = scratch.join("parts");
    ran(&text, &FORCES, &parts, On::threads(2).steps(5));
    go_on(&parts, On::threads(1).steps(STEPS - 5)).0.unwrap();
    assert_eq!(left.hash(), Left::in_folder(&parts).hash());
    let file = parse(&whole.join("grains/grains-000000014.vtp"));
    let moves = |name: &str| file.array(name).2.iter().any(|byte| *byte != 0);
    assert!(moves("lift") && moves("added_mass_force"));
    // Negative controls: another motion without them, and no such arrays.
    let plain = scratch.join("plain");
    assert_ne!(left.hash(), ran(&text, &[TIGHT], &plain, On::threads(1).steps(STEPS)).hash());
    let file = std::fs::read(plain.join("grains/grains-000000014.vtp")).unwrap();
    assert!(!String::from_utf8_lossy(&file).contains("added_mass_force"));
    assert!(warned(TANK, &["overlap.added_mass_coefficient=0.4"]).iter().any(|w| w.contains("has no effect")));
}

#[test]
fn grains_with_added_mass_move_alike_in_a_frame_and_with_moving_walls() {
    let scratch = Scratch::new("added mass");
    let on = On::threads(2).steps(4 * STEPS);
    let run = |overrides: &[&str], name: &str| {
        let all: Vec<&str> = FORCES.iter().chain(&["particles.dt=0.05 ms"]).chain(overrides).copied().collect();
        ran(TANK, &all, &scratch.join(name), on)
    };
    let frame = run(&[], "frame");
    let state = format!("preparation.state={}", scratch.join("frame").join("prepared.state").display());
    let moving = run(&["frame.motion.walls=moving", &state], "moving");
    for column in ["momentum_1", "kinetic_energy_grains", "grain_height"] {
        near(&frame.column(column), &moving.column(column), 5e-2, column);
    }
    // Negative control: with another added mass.
    let other = run(&["frame.motion.walls=moving", "overlap.added_mass_coefficient=0"], "other");
    let last = |left: &Left| left.last("kinetic_energy_grains");
    assert!((last(&other) / last(&frame) - 1.0).abs() > 5e-2, "{} {}", last(&other), last(&frame));
}

#[test]
fn one_motion_in_several_ways() {
    let scratch = Scratch::new("motion");
    // Seen from the laboratory the water follows the walls half a step late.
    const SHORT: [&str; 2] = [TIGHT, "particles.dt=0.05 ms"];
    let on = On::threads(2).steps(4 * STEPS);
    let first = ran(TANK, &SHORT, &scratch.join("formula"), on);
    let state = format!("preparation.state={}", scratch.join("formula").join("prepared.state").display());
    let Case { frame: Some(frame), .. } = load(TANK, &[]).case else { panic!("the tank moves") };
    let Some(motion @ TankMotion::Formula { .. }) = frame.motion else { panic!("by a formula") };
    let mut csv = "# a shaken tank\nt_s,x_m\n".to_owned();
    for n in 0..=2000 {
        let time = 5e-4 * Real::from(n);
        csv += &format!("{time},{:?}\n", motion.at(time)[0].x);
    }
    let file = scratch.join("motion.csv");
    std::fs::write(&file, csv).unwrap();
    let text = recorded(&file);
    let run = |text: &str, overrides: &[&str], name: &str| {
        let all: Vec<&str> = SHORT.iter().chain(overrides).copied().chain([state.as_str()]).collect();
        ran(text, &all, &scratch.join(name), on)
    };
    let columns = ["momentum_1", "grain_height", "water_level_highest"];
    let from_file = run(&text, &[], "file");
    // The run has its own copies of what it was given.
    std::fs::remove_file(&file).unwrap();
    go_on(&scratch.join("file"), On::threads(1).steps(1)).0.unwrap();
    let moving = run(TANK, &["frame.motion.walls=moving"], "moving");
    for column in columns {
        near(&first.column(column), &from_file.column(column), 5e-3, &format!("{column} from the file"));
        near(&first.column(column), &moving.column(column), 5e-2, &format!("{column} with moving walls"));
    }
    // The other way round it is another motion.
    let other = run(TANK, &["frame.motion.amplitude=[\"2 mm\",\"0 mm\",\"0 mm\"]"], "other");
    let last = |left: &Left| left.last("momentum_1");
    assert!((last(&first) + last(&other)).abs() < 0.2 * last(&first).abs(), "{} {}", last(&first), last(&other));
}

#[test]
fn what_a_run_leaves_can_be_analysed() {
    let scratch = Scratch::new("leaves");
    let folder = scratch.join("run");
    let measured = "[[ripples.measured]]\ntime = \"2 ms\"\nbed = \"nowhere.csv\"\n[[probe]]";
    let text = TANK.replacen("[[probe]]", measured, 1).replace("fields = { at = [] }", "fields = { steps = 7 }");
    let text = text.replace("grains = { at = [] }", "grains = { steps = 7 }");
    let text = text.replace("figures = { at = [] }", "figures = { steps = 7 }");
    let left = ran(&text, &[], &folder, On::threads(2).steps(STEPS));
    assert!(left.summary["conservation"]["drag_exchange_residual_relative"].as_f64().unwrap() < 1e-9);
    assert!(left.summary["counts"]["fluid_particles"].as_u64().unwrap() > 400);
    let layers = Table::read(&folder.join("layers.csv"));
    assert_eq!(layers.rows.len(), 2 * (STEPS as usize + 1));
    assert!(layers.column("drag_1").iter().filter(|drag| drag.abs() > 0.0).count() > 10);
    for name in ["bed.csv", "water.csv", "probes/gauge.csv", "probes/grain.csv", "prepared.state", "fields.pvd"] {
        assert!(folder.join(name).is_file(), "{name}");
    }
    let sketch = std::fs::read_to_string(folder.join("figures/grains-000000007.png")).unwrap();
    assert!(sketch.starts_with("Tank("), "{sketch:.80}");
    let mut listener = Listener::default();
    let lines = analyse(std::slice::from_ref(&folder), &[], None, Some(&Sketcher), &mut listener).unwrap();
    assert!(lines.iter().any(|line| line.starts_with("bed against") && line.contains("absent")), "{lines:#?}");
    evaluated_otherwise(&folder);
    let both: Vec<PathBuf> = vec![folder.clone(), folder.clone()];
    let lines = analyse(&both, &[], Some(scratch.path()), Some(&Sketcher), &mut listener).unwrap();
    assert_eq!(lines.len(), 3, "{lines:#?}");
    let table = std::fs::read_to_string(scratch.join("ripple-comparison.csv")).unwrap();
    assert!(table.starts_with("run,status,length [m],time [s]") && table.lines().count() == 3, "{table}");
    std::fs::remove_file(folder.join("bed.csv")).unwrap();
    let lines = analyse(&[folder], &[], None, Some(&Sketcher), &mut listener).unwrap();
    assert!(lines.iter().any(|line| line.starts_with("bed.csv: absent")), "{lines:#?}");
}

/// Keys of what was gathered are refused; what the others find is kept apart.
fn evaluated_otherwise(folder: &Path) {
    let with = |overrides: &[&str]| {
        analyse(&[folder.to_owned()], &owned(overrides), None, Some(&Sketcher), &mut Listener::default())
    };
    for gathered in ["ripples.layer_thickness=1 m", "ripples.layers=surface", "bed.height_radius=1 mm"] {
        let error = with(&[gathered]).expect_err("the run is over");
        assert!(error.to_string().contains("cannot be changed afterwards"), "{error}");
    }
    assert!(!folder.join("analysis").exists());
    // Two tables of one time, and the bed that was seen from the laboratory.
    let motion = load(TANK, &[]).case.tank_at(2e-3)[0];
    let rows = |at: Real| (0..12).map(|n| -6e-3 + 1e-3 * Real::from(n)).map(move |x| format!("{},0.003\n", x + at));
    let write = |name: &str, head: &str, at: Real| {
        std::fs::write(folder.join(name), format!("{head}x_m,z_m\n{}", rows(at).collect::<String>())).expect("a file");
    };
    write("seen.csv", "# frame: laboratory\n# z_shift_limit_m: 1e-5\n", motion.x);
    write("level.csv", "", 0.0);
    let measured = "ripples.measured=[{time='2 ms',bed='seen.csv'},{time='2 ms',water='level.csv'}]";
    let lines = with(&["ripples.margin=0.5 mm", measured]).expect("these can be changed");
    let told = |what: &str| lines.iter().find(|line| line.starts_with(what)).unwrap_or_else(|| panic!("{lines:#?}"));
    assert!(told("bed against").contains("rmse") && told("water against").contains("wave height ratio"));
    assert!(told("  warning").contains("x3 as far as allowed"), "{lines:#?}");
    let text = std::fs::read_to_string(folder.join("analysis/summary.json")).expect("a summary");
    let found: serde_json::Value = serde_json::from_str(&text).expect("JSON");
    assert_eq!(found["overrides"][0], "ripples.margin=0.5 mm");
    let ripples = &found["observables"]["ripples"];
    assert!(ripples["crested"].is_object() && ripples["relief_mm"].is_number(), "{text}");
    let experiment = ripples["experiment"].as_array().expect("a list");
    let surfaces: Vec<_> = experiment.iter().map(|found| &found["surface"]).collect();
    assert_eq!(surfaces, ["bed", "water"]);
}

#[test]
fn water_faster_than_gravity_explains_is_warned_of_once() {
    let scratch = Scratch::new("fast");
    let warnings = |gravity: &str| {
        let options = On::threads(2).options(Some(&scratch.join(&gravity.replace('/', "_"))));
        // 5 mm of water, shaken at up to 0.25 m/s.
        let changes = [
            &format!("gravity={gravity}"),
            "frame.motion.amplitude=[\"8 mm\", \"0 mm\", \"0 mm\"]",
            "frame.motion.ramp=0.01 s",
            "liquid.0.region.box.upper=[\"7 mm\", \"8 mm\", \"5 mm\"]",
            "run.until=0.03 s",
        ];
        let said = heard(&load(&water_alone(""), &changes), &options).messages;
        said.into_iter().filter(|text| text.contains("water has reached")).collect::<Vec<_>>()
    };
    // Five times sqrt(g H) of the box is 0.08 m/s.
    let found = warnings("0.02 m/s^2");
    assert!(found.len() == 1 && found[0].contains("more than 0.08 m/s"), "{found:?}");
    // Negative control: here it is 1.9 m/s.
    assert_eq!(warnings("9.81 m/s^2"), Vec::<String>::new());
}

#[test]
fn lift_beside_the_edge_of_the_water_is_a_number() {
    // Grains that a front of water reaches have one or two particles near them, which tell no vorticity.
    let text = "solver = \"mps\"\ndomain.size = [\"60 mm\", \"18 mm\", \"20 mm\"]\nparticles.spacing = \"2 mm\"\n\
                boundary = { all = \"no_slip\", x3_upper = \"outflow\" }\nmaterial.s.density = \"2500 kg/m^3\"\n\
                overlap = { lift = \"mei\", smoothing = \"8 mm\" }\nfluid.initial_velocity.uniform.velocity = [\"0.05 m/s\", \"0 m/s\", \"0 m/s\"]\n\
                output = { fields = { at = [] }, grains = { at = [] }, figures = { at = [] } }\nrun.until = \"8 ms\"\npreparation.cache = false\n\
                [[liquid]]\nregion.box = { lower = [\"0 m\", \"0 m\", \"0 m\"], upper = [\"30 mm\", \"18 mm\", \"10 mm\"] }\n\
                [[grains]]\nshape.sphere.diameter = \"3 mm\"\n\
                placement.lattice = { lower = [\"30 mm\", \"0 mm\", \"0 mm\"], upper = [\"42 mm\", \"18 mm\", \"3 mm\"], counts = [4, 5, 1] }\n";
    let scratch = Scratch::new("lift-at-the-edge");
    for lift in ["mei", "saffman"] {
        let left = ran(text, &[&format!("overlap.lift={lift}")], &scratch.join(lift), On::threads(1));
        let fastest = left.column("largest_grain_speed").into_iter().skip(1).fold(0.0, Real::max);
        assert!(fastest < 0.2, "{lift}: {fastest}");
    }
}

#[test]
fn fields_of_particles_have_the_precision_asked_for() {
    let scratch = Scratch::new("precision");
    let text = water_alone("[preparation]\nrelax_steps = 0\nsettle = \"0 s\"\ncache = false\n");
    let written = |precision: &str| {
        let overrides = ["output.fields.at=[\"0 s\"]".to_owned(), format!("output.precision={precision}")];
        let folder = scratch.join(precision);
        ran(&text, &overrides.each_ref().map(String::as_str), &folder, On::threads(1).steps(1));
        let file = VtkFile::read(&folder.join("fields/fields-000000000.vtp")).unwrap();
        let is_double = |name: &str| matches!(file.values(name).unwrap().1, Values::F64(_));
        let widths = ["Points", "velocity", "pressure", "void_fraction"].map(is_double);
        (widths, file.doubles("Points").unwrap())
    };
    let ((double, exact), (single, rounded)) = (written("double"), written("single"));
    assert!(double.iter().all(|&double| double), "{double:?}");
    let apart = exact.iter().zip(&rounded).map(|(a, b)| (a - b).abs()).fold(0.0, Real::max);
    assert!(apart > 0.0 && apart < 1e-8, "{apart}");
    // Negative control: by default four bytes.
    assert!(!single.iter().any(|&double| double), "{single:?}");
}
