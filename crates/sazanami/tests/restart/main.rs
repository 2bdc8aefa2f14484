//! An interrupted run goes on to the same bits, whatever interrupted it; damaged checkpoints are distinguished from good ones.

#[allow(dead_code, reason = "every test program uses a part of it")]
mod support;

use std::path::Path;

use sazanami::case::{self, LoadedCase, resolved};
use sazanami::error::{CommandError, exit};
use sazanami::progress::StepLine;
use sazanami::run::{self, RunOptions, RunSummary, Status};
use sazanami::stop::Stop;
use sazanami_io::checkpoint::CheckpointWriter;

use support::{Left, Listener, On, Scratch, checkpoints, go_on, load, start};

/// Grains that fall on each other and slide, in water with a free surface, with steps that grow and shrink;
/// everything that writes is in it.
const SLIDING: &str = r#"
gravity = ["4 m/s^2", "0 m/s^2", "-9.8 m/s^2"]
[domain]
size = ["3 mm", "3 mm", "3 mm"]
cells = [12, 12, 12]
[fluid]
tol_div = 1e-8
dt_first = "2 us"
dt_growth = 1.3
[[liquid]]
region.half_space = { point = ["0 mm", "0 mm", "1 mm"], normal = [0.2, 0, 1] }
allow_touching_grains = true
[[liquid]]
name = "drop"
region.sphere = { diameter = "0.8 mm" }
position = ["1.4 mm", "1.5 mm", "2.5 mm"]
fall = { speed = "1.5 m/s", angle = "20 deg" }
allow_touching_grains = true
[material.sand]
density = "2650 kg/m^3"
[contact.default]
normal_stiffness = "200 N/m"
restitution = 0.3
friction = 0.6
[[grains]]
name = "sand"
shape.spheroid = { diameter = "0.5 mm", length = "0.9 mm" }
contact_spheres = "axis(5)"
material = "sand"
placement.lattice = { lower = ["0 mm", "0 mm", "0 mm"], upper = ["3 mm", "3 mm", "2.1 mm"], counts = [3, 3, 2], velocity = ["0.6 m/s", "0.2 m/s", "-1 m/s"] }
[bed]
porosity_upper = "1 mm"
[erosion]
dr = "0.45 mm"
r_max = "1.5 mm"
[[probe]]
name = "middle"
point = ["1.5 mm", "1.5 mm", "0.7 mm"]
steps = 1
[[probe]]
name = "grain"
body = { population = "sand", index = 4 }
steps = 3
[output]
figures = { at = [] }
series = { steps = 1 }
grains = { every = "0.4 ms" }
[run]
until = "20 ms"
"#;

/// The same, packed first.
const PACKED: &str = r#"
gravity = "9.8 m/s^2"
[domain]
size = ["3.2 mm", "3.2 mm", "3.25 mm"]
cells = [12, 12, 13]
[[liquid]]
region.sphere = { diameter = "0.8 mm" }
gap_above_bed = "0.1 mm"
fall = { speed = "1.5 m/s" }
[material.sand]
density = "2650 kg/m^3"
[contact.default]
normal_stiffness = "100 N/m"
restitution = 0.3
friction = 0.6
[[grains]]
name = "sand"
count = 16
shape.spheroid = { diameter = "0.52 mm", length = "1.27 mm" }
contact_spheres = "axis(9)"
material = "sand"
placement.packed = { lattice = "low", settle_time = "2 ms", friction_scale = 0.5, stop = "time_only" }
[output]
figures = { at = [] }
series = { steps = 1 }
[run]
until = "1 ms"
steps = 8
"#;

const STEPS: u64 = 12;

fn tables(folder: &Path) -> Vec<(String, String)> {
    let mut found = Vec::new();
    for part in [folder.to_owned(), folder.join("probes")] {
        for entry in std::fs::read_dir(part).into_iter().flatten().flatten() {
            let path = entry.path();
            if path.extension().is_some_and(|extension| extension == "csv" || extension == "pvd") {
                let name = path.strip_prefix(folder).expect("the case is sound").to_string_lossy().into_owned();
                found.push((name, std::fs::read_to_string(&path).expect("the case is sound")));
            }
        }
    }
    found.sort();
    found
}

fn assert_same(folder: &Path, expected: &Path, what: &str) {
    let (left, right) = (Left::in_folder(folder), Left::in_folder(expected));
    assert_eq!(left.summary["steps"], right.summary["steps"], "{what}");
    // The state that is not physics holds wall-clock times.
    let sections = |left: &Left| {
        let sections = left.state.sections().filter(|(name, _)| *name != "run/state");
        sections.map(|(name, section)| (name.to_owned(), section.clone())).collect::<Vec<_>>()
    };
    for ((name, a), (other, b)) in sections(&left).into_iter().zip(sections(&right)) {
        assert_eq!(name, other, "{what}");
        assert!(a == b, "{what}: section {name} differs");
    }
    assert_eq!(left.hash(), right.hash(), "{what}");
    for ((name, a), (other, b)) in tables(folder).iter().zip(&tables(expected)) {
        assert_eq!((name, a), (other, b), "{what}");
    }
    for sum in ["worst", "corrections", "limiter", "grain_substeps", "fluid_passes", "momentum", "observables"] {
        assert_eq!(left.summary[sum], right.summary[sum], "{what}: {sum}");
    }
}

/// Twice `STEPS` steps in one go, and with a break.
fn goes_on_alike(name: &str, text: &str, overrides: &[&str], ranks: &[usize]) {
    let scratch = Scratch::new(&format!("restart-{name}"));
    let loaded = load(text, overrides);
    for &ranks in ranks {
        let whole = scratch.join(&format!("whole-{ranks}"));
        start(&loaded, &whole, On::ranks(ranks, 1).steps(2 * STEPS)).expect("the case is sound");
        let left = Left::in_folder(&whole);
        assert!(left.column("contacts").iter().any(|&n| n > 0.0), "{name}: nothing touches");
        let dt = left.column("dt");
        assert!(overrides.iter().any(|key| key.contains("dt = ")) || dt[2] != dt[dt.len() - 1]);
        for threads in [[1, 1], [1, 4], [2, 3]] {
            let broken = scratch.join(&format!("broken-{ranks}-{}-{}", threads[0], threads[1]));
            let first = start(&loaded, &broken, On::ranks(ranks, threads[0]).steps(STEPS)).expect("the case is sound");
            assert_eq!((first.status, first.steps), (Status::Stopped, STEPS));
            let at_break = Left::in_folder(&broken);
            assert!(at_break.column("contacts")[STEPS as usize] > 0.0, "{name}: nothing touches at the break");
            let (second, _) = go_on(&broken, On::ranks(ranks, threads[1]).steps(STEPS));
            assert_eq!(second.expect("the case is sound").steps, 2 * STEPS);
            assert_same(&broken, &whole, &format!("{name}, {ranks} ranks, threads {threads:?}"));
        }
    }
}

#[test]
fn a_run_with_live_contacts_and_growing_steps() {
    goes_on_alike("sliding", SLIDING, &[], &[1, 2, 4]);
}

#[test]
fn a_run_with_fixed_steps_and_the_old_pressure_in_the_predictor() {
    let literal = [
        "fluid={ dt = \"50 us\", tol_div = 1e-8 }",
        "fluid.projection=incremental",
        "fluid.convection=velocity_form",
        "coupling.exchange=stress",
        "fluid.vof=thinc_wlic",
    ];
    goes_on_alike("literal", SLIDING, &literal, &[1, 2]);
}

#[test]
fn a_run_with_periodic_sides() {
    let periodic = [
        "boundary.x1=periodic",
        "boundary.x2=periodic",
        // Without sides there is only the floor to meet, and each other: sooner.
        "grains.0.placement.lattice.upper=[\"3 mm\", \"3 mm\", \"1.1 mm\"]",
    ];
    goes_on_alike("periodic", SLIDING, &periodic, &[1, 2]);
}

#[test]
fn a_run_with_open_and_moving_sides_in_a_shaken_frame() {
    let open = [
        "boundary.x1_lower={ inflow = { velocity = [\"0.3 m/s\", \"0 m/s\", \"0 m/s\"] } }",
        "boundary.x1_upper=outflow",
        "boundary.x2_upper={ moving = { velocity = [\"0.5 m/s\", \"0 m/s\", \"0 m/s\"] } }",
        "dem.grain_walls=[\"x1_lower\", \"x1_upper\", \"x2_lower\", \"x2_upper\", \"x3_lower\"]",
        "frame.oscillation={ amplitude = [\"20 m/s^2\", \"0 m/s^2\", \"0 m/s^2\"], frequency = \"300 Hz\" }",
    ];
    goes_on_alike("open", SLIDING, &open, &[1]);
}

#[test]
fn a_forgotten_contact_would_be_noticed() {
    // Negative control: the comparison sees the memory of contacts.
    let scratch = Scratch::new("restart-control");
    let loaded = load(SLIDING, &[]);
    let run = |name: &str, steps| {
        let folder = scratch.join(name);
        start(&loaded, &folder, On::threads(1).steps(steps)).unwrap();
        Left::in_folder(&folder)
    };
    let (a, b) = (run("a", STEPS), run("b", STEPS + 1));
    assert_ne!(a.hash(), b.hash());
    let displacement = a.state.reals("grains/contact.displacement").unwrap();
    assert!(displacement.iter().any(|&d| d != 0.0), "no contact has a memory");
}

/// Stops the run when `after` says so; returns the folder's status.
fn interrupted(loaded: &LoadedCase, folder: &Path, ranks: usize, after: fn(&StepLine) -> bool) {
    let stop = Stop::new();
    let mut listener = Listener { stop: Some(&stop), stop_after: Some(after), ..Listener::default() };
    let options = On::ranks(ranks, 1).options(Some(folder));
    let summary = run::run(loaded, &options, &mut listener, &stop).expect("the case is sound");
    assert!(summary.interrupted);
    assert_eq!((summary.status, summary.exit_code()), (Status::Stopped, exit::STOPPED));
}

#[test]
fn a_signal_during_packing() {
    let loaded = load(PACKED, &[]);
    let scratch = Scratch::new("restart-packing");
    for ranks in [1, 2] {
        let whole = scratch.join(&format!("whole-{ranks}"));
        start(&loaded, &whole, On::ranks(ranks, 1)).unwrap();
        let broken = scratch.join(&format!("broken-{ranks}"));
        interrupted(&loaded, &broken, ranks, |line| line.phase == "packing" && line.step >= 100);
        assert_eq!(support::summary(&broken)["status"], "stopped");
        let memory = support::newest(&broken).snapshot().unwrap();
        assert!(memory.reals("packing/time").unwrap()[0] >= 100.0 * 2e-5 - 1e-9);
        let (outcome, said) = go_on(&broken, On::ranks(ranks, 2));
        assert_eq!(outcome.unwrap().status, Status::Stopped);
        assert!(said.iter().any(|text| text.contains("packed 16 grains")), "{said:#?}");
        assert_same(&broken, &whole, &format!("{ranks} ranks"));
    }
}

#[test]
fn a_bed_that_the_rest_of_the_case_does_not_suit_is_reported_and_kept() {
    let loaded = load(PACKED, &["liquid.0.gap_above_bed=2.9 mm"]);
    let scratch = Scratch::new("restart-unsuited");
    let report = |outcome: Result<RunSummary, CommandError>, folder: &Path| {
        let error = outcome.expect_err("the drop does not fit above the bed");
        assert_eq!(error.exit_code(), exit::WRONG_INPUT, "{error}");
        let kept = format!("placement.bed = {{ file = \"{}\" }}", folder.join("packed.bed").display());
        assert!(error.to_string().contains("does not fit above the bed"), "{error}");
        assert!(error.to_string().contains(&kept), "{error}");
        let left = support::summary(folder);
        assert_eq!((&left["status"], &left["failure"]["kind"]), (&"failed".into(), &"input".into()));
    };
    for ranks in [1, 2] {
        let whole = scratch.join(&format!("whole-{ranks}"));
        report(start(&loaded, &whole, On::ranks(ranks, 1)), &whole);
        let broken = scratch.join(&format!("broken-{ranks}"));
        interrupted(&loaded, &broken, ranks, |line| line.phase == "packing" && line.step >= 100);
        assert_eq!(support::summary(&broken)["status"], "stopped");
        report(go_on(&broken, On::ranks(ranks, 1)).0, &broken);
        // The packing itself is kept as well: nothing is packed twice.
        let (outcome, said) = go_on(&broken, On::ranks(ranks, 1));
        report(outcome, &broken);
        let packed = said.iter().find(|text| text.contains("packed 16 grains")).expect("the bed is measured");
        let words: Vec<&str> = packed.split_whitespace().collect();
        assert!(packed.contains(&format!("since {} s", words[4])), "{packed}");
        assert_eq!(
            std::fs::read(whole.join("packed.bed")).expect("the bed is kept"),
            std::fs::read(broken.join("packed.bed")).expect("the bed is kept")
        );
    }
    // As the message says.
    let bed = scratch.join("whole-1").join("packed.bed");
    let changed = scratch.join("changed");
    start(&load(&on_bed(&bed, ""), &[]), &changed, On::threads(1).steps(1)).unwrap();
    // Negative control: a run that ends well says nothing of a failure, and names its own file for the bed.
    let named = scratch.join("named.bed");
    let fine = scratch.join("fine");
    start(&load(PACKED, &[&format!("output.bed={}", named.display())]), &fine, On::threads(1).steps(1)).unwrap();
    assert_eq!(support::summary(&fine)["failure"], serde_json::Value::Null);
    assert!(named.is_file() && !fine.join("packed.bed").exists());
}

/// The packed case on a bed that is read from a file, with `more` keys of its placement.
fn on_bed(bed: &Path, more: &str) -> String {
    let packed =
        "placement.packed = { lattice = \"low\", settle_time = \"2 ms\", friction_scale = 0.5, stop = \"time_only\" }";
    let placed = format!("placement.bed = {{ file = {:?}{more} }}", bed.display().to_string());
    PACKED.replace(packed, &placed).replace("count = 16\n", "")
}

#[test]
fn signals_during_packing_and_flow_one_after_the_other() {
    let loaded = load(PACKED, &[]);
    let scratch = Scratch::new("restart-signals");
    let whole = scratch.join("whole");
    start(&loaded, &whole, On::threads(2)).unwrap();
    let broken = scratch.join("broken");
    interrupted(&loaded, &broken, 1, |line| line.phase == "packing" && line.step >= 40);
    let later: [fn(&StepLine) -> bool; 2] =
        [|line| line.phase == "packing" && line.step >= 250, |line| line.phase == "flow"];
    for after in later {
        let stop = Stop::new();
        let mut listener = Listener { stop: Some(&stop), stop_after: Some(after), ..Listener::default() };
        run::resume(&broken, &On::threads(1).options(None), &mut listener, &stop).unwrap();
    }
    let (outcome, _) = go_on(&broken, On::threads(1));
    outcome.unwrap();
    assert_same(&broken, &whole, "three breaks");
}

/// A small bed squeezed together, so that its grains overlap.
fn squeezed(scratch: &Scratch, scale: &str, relax: bool) -> LoadedCase {
    let bed = scratch.join("small.bed");
    if !bed.exists() {
        let name = format!("output.bed={}", bed.display());
        let packing = load(PACKED, &[&name, "run.packing_only=true"]);
        start(&packing, &scratch.join("packed"), On::threads(1)).expect("the case is sound");
    }
    load(&on_bed(&bed, &format!(", scale = {scale}, relax = {relax}")), &[])
}

#[test]
fn grains_of_a_squeezed_bed_part_and_come_to_rest() {
    let scratch = Scratch::new("restart-squeezed");
    let run = |name: &str, ranks: usize, relax: bool| {
        let folder = scratch.join(name);
        start(&squeezed(&scratch, "0.85", relax), &folder, On::ranks(ranks, 1).steps(1)).expect("the case is sound");
        let left = Left::in_folder(&folder);
        let worst = |key: &str| left.summary["worst"][key].as_f64().expect("a number");
        let place = left.state.vectors("grains/grain.position").expect("there are grains");
        (worst("overlap_relative"), worst("grain_speed"), place)
    };
    let (overlap, speed, alone) = run("alone", 1, true);
    println!("overlap {overlap}, speed {speed}");
    assert!(overlap < 0.05 && speed < 0.02, "overlap {overlap}, speed {speed}");
    let (_, _, shared) = run("shared", 3, true);
    let apart = alone.iter().zip(&shared).map(|(a, b)| a.distance(*b)).fold(0.0, f64::max);
    println!("ranks apart by {apart}");
    assert!(alone.len() == 16 && apart < 1e-3 * 0.52e-3, "{apart}");
    // Negative control: as they are squeezed.
    let (overlap, speed, _) = run("squeezed", 1, false);
    println!("overlap {overlap}, speed {speed}");
    assert!(overlap > 0.2 && speed > 0.05, "overlap {overlap}, speed {speed}");
}

#[test]
fn signals_while_a_bed_comes_to_rest() {
    let scratch = Scratch::new("restart-relaxing");
    let loaded = squeezed(&scratch, "0.85", true);
    for ranks in [1, 2] {
        let whole = scratch.join(&format!("whole-{ranks}"));
        start(&loaded, &whole, On::ranks(ranks, 1)).unwrap();
        let broken = scratch.join(&format!("broken-{ranks}"));
        interrupted(&loaded, &broken, ranks, |line| line.limiter == "parting" && line.step >= 5);
        for (breaks, parting) in [(1, 1.0), (2, 0.0)] {
            if breaks == 2 {
                let stop = Stop::new();
                let settling = |line: &StepLine| line.limiter == "settling" && line.phase == "relax";
                let mut listener = Listener { stop: Some(&stop), stop_after: Some(settling), ..Listener::default() };
                let ended = run::resume(&broken, &On::ranks(ranks, 2).options(None), &mut listener, &stop).unwrap();
                assert_eq!((ended.status, ended.exit_code()), (Status::Stopped, exit::STOPPED));
                assert!(listener.lines.iter().all(|line| line.phase == "relax"));
            }
            assert_eq!(support::summary(&broken)["status"], "stopped");
            let memory = support::newest(&broken).snapshot().unwrap();
            assert_eq!(memory.reals("relaxation/state").unwrap()[0], parting);
            // Grains that have parted may touch nothing for a while.
            let displacement = memory.reals("relaxation/contact.displacement").unwrap();
            assert!(parting == 0.0 || displacement.iter().any(|&d| d != 0.0), "no contact has a memory");
        }
        assert_eq!(go_on(&broken, On::ranks(ranks, 1)).0.unwrap().status, Status::Stopped);
        assert_same(&broken, &whole, &format!("{ranks} ranks"));
    }
    // Negative control: the comparison sees how far the bed was squeezed.
    let other = scratch.join("other");
    start(&squeezed(&scratch, "0.851", true), &other, On::threads(1)).unwrap();
    assert_ne!(Left::in_folder(&other).hash(), Left::in_folder(&scratch.join("whole-1")).hash());
}

#[test]
fn limits_of_a_command_change_no_step() {
    let scratch = Scratch::new("restart-limits");
    let loaded = load(SLIDING, &["run.until=1 ms"]);
    let whole = scratch.join("whole");
    assert_eq!(start(&loaded, &whole, On::threads(2)).unwrap().status, Status::Finished);
    let times = Left::in_folder(&whole).column("time");
    let middle = 0.5 * (times[7] + times[8]);
    let run = |name: &str, options: RunOptions| {
        let folder = scratch.join(name);
        let stop = Stop::new();
        let options = RunOptions { out: Some(folder.clone()), threads: Some(2), ranks: 1, ..options };
        let ended = run::run(&loaded, &options, &mut Listener::default(), &stop).unwrap();
        assert_eq!(ended.status, Status::Stopped);
        (folder, ended)
    };
    let (until, ended) = run("until", RunOptions { until: Some(middle), ..RunOptions::default() });
    // The first step that reaches the time is whole.
    assert_eq!((ended.steps, ended.time), (8, times[8]));
    let (steps, _) = run("steps", RunOptions { steps: Some(5), ..RunOptions::default() });
    for folder in [until, steps] {
        let (part, all) = (Left::in_folder(&folder), Left::in_folder(&whole));
        assert_eq!(part.series.rows[..], all.series.rows[..part.series.rows.len()]);
        let stop = Stop::new();
        let more = RunOptions { until: Some(0.5e-3), threads: Some(1), ranks: 1, ..RunOptions::default() };
        run::resume(&folder, &more, &mut Listener::default(), &stop).unwrap();
        let (outcome, _) = go_on(&folder, On::threads(1));
        assert_eq!(outcome.unwrap().status, Status::Finished);
        assert_same(&folder, &whole, &folder.display().to_string());
    }
}

/// What can happen to a file.
fn damage(path: &Path, how: &str) {
    let mut bytes = std::fs::read(path).expect("the case is sound");
    let length = bytes.len();
    match how {
        "cut to nothing" => bytes.clear(),
        "cut in the header" => bytes.truncate(20),
        "cut in the middle" => bytes.truncate(length / 2),
        "short of a byte" => bytes.truncate(length - 1),
        "a bit of the header" => bytes[17] ^= 1,
        "a bit of the data" => bytes[length / 3] ^= 0x10,
        "a bit of the index" => bytes[length - 40] ^= 4,
        "something else" => {
            bytes = b"not a checkpoint at all, but long enough to be looked at twice, or thrice".to_vec()
        }
        _ => panic!("unknown damage"),
    }
    std::fs::write(path, bytes).expect("the case is sound");
}

#[test]
fn a_damaged_checkpoint_is_passed_over_for_the_one_before() {
    let scratch = Scratch::new("restart-damage");
    let loaded = load(SLIDING, &["checkpoint.every=0.1 ms", "checkpoint.keep=2"]);
    let whole = scratch.join("whole");
    start(&loaded, &whole, On::threads(1).steps(2 * STEPS)).unwrap();
    let sound = scratch.join("sound");
    start(&loaded, &sound, On::threads(1).steps(STEPS)).unwrap();
    let steps = checkpoints(&sound).steps().unwrap();
    assert_eq!(steps.len(), 2);
    let copy = |name: &str| {
        let folder = scratch.join(name);
        assert!(copy_folder(&sound, &folder));
        folder
    };
    let all = [
        ("cut to nothing", "torn"),
        ("cut in the header", "torn"),
        ("cut in the middle", "torn"),
        ("short of a byte", "torn"),
        ("a bit of the header", "damaged header"),
        ("a bit of the data", "damaged"),
        ("a bit of the index", "damaged index"),
        ("something else", "not a checkpoint"),
    ];
    for (how, word) in all {
        let folder = copy(&how.replace(' ', "-"));
        damage(&checkpoints(&folder).path_of(steps[1]), how);
        let left = 2 * STEPS - steps[0];
        let (outcome, said) = go_on(&folder, On::threads(2).steps(left));
        assert_eq!(outcome.unwrap().steps, 2 * STEPS, "{how}");
        let report = said.iter().find(|text| text.starts_with("skipped")).unwrap_or_else(|| panic!("{how}: {said:#?}"));
        assert!(report.contains(word) && report.contains(&format!("step-{:09}", steps[1])), "{how}: {report}");
        assert!(said.iter().any(|text| text.contains(&format!("from step {}", steps[0]))), "{how}: {said:#?}");
        assert_same(&folder, &whole, how);
    }
    let folder = copy("nothing-left");
    steps.iter().for_each(|&step| damage(&checkpoints(&folder).path_of(step), "cut in the middle"));
    let (outcome, said) = go_on(&folder, On::threads(1));
    let error = outcome.unwrap_err();
    assert_eq!(error.exit_code(), exit::WRONG_INPUT);
    assert!(error.to_string().contains("no good checkpoint"), "{error}");
    assert_eq!(said.iter().filter(|text| text.starts_with("skipped")).count(), 2);
    // Nothing was touched.
    assert_eq!(std::fs::read(folder.join("series.csv")).unwrap(), std::fs::read(sound.join("series.csv")).unwrap());
}

#[test]
fn only_folders_of_runs_can_be_gone_on_with() {
    let scratch = Scratch::new("restart-nothing");
    for folder in [scratch.join("missing"), scratch.path().to_owned()] {
        let (outcome, _) = go_on(&folder, On::threads(1));
        assert_eq!(outcome.unwrap_err().exit_code(), exit::WRONG_INPUT);
    }
}

#[test]
fn a_run_without_a_checkpoint_begins_again_from_its_case() {
    let scratch = Scratch::new("restart-begin-again");
    let whole = scratch.join("whole");
    start(&load(SLIDING, &["run.until=0.1 ms"]), &whole, On::threads(1)).unwrap();
    // What a run that was killed before its first checkpoint leaves: its case, a part of its series, a torn file.
    let killed = scratch.join("killed");
    std::fs::create_dir_all(killed.join("checkpoints")).unwrap();
    std::fs::copy(whole.join("case.toml"), killed.join("case.toml")).unwrap();
    std::fs::write(killed.join("series.csv"), "time [s],dt [s]\n0,1e-").unwrap();
    std::fs::write(killed.join("log.txt"), "2026-11-22T18:30:00Z  sazanami 0.1.0\n").unwrap();
    std::fs::write(killed.join("checkpoints/.unfinished-x"), "half").unwrap();
    std::fs::write(killed.join(".sazanami-lock"), "process 1, since 2026-11-22T18:30:00Z\n").unwrap();
    let (outcome, said) = go_on(&killed, On::threads(1));
    assert_eq!(outcome.unwrap().status, Status::Finished);
    assert!(said.iter().any(|text| text.contains("begins again from the case")), "{said:#?}");
    assert_eq!(Left::in_folder(&killed).hash(), Left::in_folder(&whole).hash());
    assert_eq!(Left::in_folder(&killed).series.rows.len(), Left::in_folder(&whole).series.rows.len());
    let log = std::fs::read_to_string(killed.join("log.txt")).unwrap();
    assert!(log.starts_with("2026-11-22T18:30:00Z  sazanami 0.1.0\n"), "{log}");
    assert!(!killed.join("checkpoints/.unfinished-x").exists() && !killed.join(".sazanami-lock").exists());
}

#[test]
fn a_wrong_command_leaves_a_run_as_it_is() {
    let scratch = Scratch::new("restart-wrong");
    let folder = scratch.join("run");
    start(&load(SLIDING, &["run.until=0.1 ms"]), &folder, On::threads(1)).unwrap();
    let before = support::summary(&folder);
    assert_eq!(before["status"], "finished");
    for file in ["log.txt", "figures/momentum.png"] {
        assert!(before["files"].as_array().unwrap().contains(&file.into()), "{file}: {}", before["files"]);
    }
    // More ranks than there are columns of cells.
    let error = go_on(&folder, On::ranks(500, 1)).0.unwrap_err();
    assert_eq!(error.exit_code(), exit::WRONG_INPUT, "{error}");
    assert_eq!(support::summary(&folder), before);
    // A case that was changed, and put back.
    let case = folder.join("case.toml");
    let text = std::fs::read_to_string(&case).unwrap();
    let steeper = text.replace("\"-9.8 m/s^2\"", "\"-9.9 m/s^2\"");
    assert_ne!(steeper, text);
    std::fs::write(&case, steeper).unwrap();
    let error = go_on(&folder, On::threads(1)).0.unwrap_err();
    assert_eq!(error.exit_code(), exit::WRONG_INPUT);
    assert!(error.to_string().contains("is not the case that this run began with"), "{error}");
    assert_eq!(support::summary(&folder), before);
    std::fs::write(&case, text).unwrap();
    assert_eq!(go_on(&folder, On::threads(2)).0.unwrap().status, Status::Finished);
}

/// Makes the run in `folder` one of a program that knew fewer keys and columns, and perhaps recorded which it was.
fn made_older(folder: &Path, key: &str, program: serde_json::Value) {
    let path = folder.join("series.csv");
    let table = std::fs::read_to_string(&path).expect("the run left it");
    let at = table.lines().next().and_then(|header| header.split(',').position(|name| name.starts_with("stable_dt")));
    let at = at.expect("there is such a column");
    let fewer = |line: &str| {
        let fields = line.split(',').enumerate().filter(|(n, _)| *n != at).map(|(_, field)| field);
        fields.collect::<Vec<_>>().join(",") + "\n"
    };
    std::fs::write(&path, table.lines().map(fewer).collect::<String>()).expect("the run left it");
    let path = folder.join("case.toml");
    let text = std::fs::read_to_string(&path).expect("the run left it");
    let older: String = text.lines().filter(|line| !line.starts_with(key)).flat_map(|line| [line, "\n"]).collect();
    assert!(older.len() < text.len(), "{key} is not in the copy");
    std::fs::write(&path, &older).expect("the run left it");
    let reader = support::newest(folder);
    let mut state: serde_json::Value = reader.get_json("run/state").expect("the run left it");
    state["case_hash"] = format!("{:016x}", resolved::hash_of_copy(&older)).into();
    state["program"] = program;
    let snapshot = reader.snapshot_of(|name| name != "run/state").expect("the run left it");
    let mut writer = CheckpointWriter::new();
    writer.add_snapshot(&snapshot).expect("the run left it");
    writer.add_json("run/state", &state).expect("the run left it");
    writer.write_atomic(reader.path()).expect("the run left it");
}

#[test]
fn a_run_of_an_older_program_goes_on_and_a_changed_case_does_not() {
    let scratch = Scratch::new("restart-older");
    let bed = scratch.join("small.bed");
    let name = format!("output.bed={}", bed.display());
    start(&load(PACKED, &[&name, "run.packing_only=true"]), &scratch.join("packed"), On::threads(1)).unwrap();
    let report =
        |said: &[String]| said.iter().filter(|text| text.contains("began this run")).cloned().collect::<Vec<_>>();
    // With a file that is named, of which the folder is no part of the hash, and without.
    for (name, text) in [("sliding", SLIDING.to_owned()), ("bed", on_bed(&bed, ""))] {
        let folder = scratch.join(name);
        start(&load(&text, &[]), &folder, On::threads(1).steps(1)).unwrap();
        let copy = std::fs::read_to_string(folder.join("case.toml")).unwrap();
        let own = case::load(&folder.join("case.toml"), &[]).unwrap();
        assert_eq!(resolved::hash_of_copy(&copy), resolved::hash(&own.case), "{name}");
        assert!(report(&go_on(&folder, On::threads(1).steps(1)).1).is_empty());

        made_older(&folder, "torque_arm", serde_json::Value::Null);
        let (outcome, said) = go_on(&folder, On::threads(1).steps(1));
        outcome.unwrap();
        assert!(report(&said)[0].contains("an earlier version of sazanami began this run"), "{said:#?}");
        let program = serde_json::json!({ "version": "0.0.1", "commit": "abc" });
        made_older(&folder, "drop_velocity", program.clone());
        for _ in 0..2 {
            let (outcome, said) = go_on(&folder, On::threads(1).steps(1));
            outcome.unwrap();
            assert!(report(&said)[0].contains("sazanami 0.0.1 (abc) began this run"), "{said:#?}");
        }
        let state: serde_json::Value = support::newest(&folder).get_json("run/state").unwrap();
        assert_eq!(state["program"], program);

        // What was changed is refused, whoever began the run.
        let older = std::fs::read_to_string(folder.join("case.toml")).unwrap();
        std::fs::write(folder.join("case.toml"), older.replace("friction = 0.6", "friction = 0.5")).unwrap();
        let error = go_on(&folder, On::threads(1).steps(1)).0.unwrap_err();
        assert!(error.exit_code() == exit::WRONG_INPUT && error.to_string().contains("changed since"), "{error}");
    }
}

#[test]
fn a_run_goes_on_without_the_bed_it_began_with() {
    let scratch = Scratch::new("restart-bed");
    let bed = scratch.join("small.bed");
    let name = format!("output.bed={}", bed.display());
    start(&load(PACKED, &[&name, "run.packing_only=true"]), &scratch.join("packed"), On::threads(2)).unwrap();
    let text = on_bed(&bed, "");
    let folder = scratch.join("run");
    start(&load(&text, &[]), &folder, On::threads(1).steps(3)).unwrap();
    std::fs::remove_file(&bed).unwrap();
    let moved = scratch.join("moved");
    std::fs::rename(&folder, &moved).unwrap();
    assert_eq!(go_on(&moved, On::threads(1).steps(2)).0.unwrap().steps, 5);
    // Begun anew in its own folder it finds the copy there.
    let again = RunOptions { force: true, ..On::threads(1).steps(1).options(Some(&moved)) };
    let stop = Stop::new();
    let kept = case::load(&moved.join("case.toml"), &[]).unwrap();
    run::run(&kept, &again, &mut Listener::default(), &stop).unwrap();
    let copy = "inputs/grains-0/bed/small.bed";
    let listed = |copy: &str| support::summary(&moved)["files"].as_array().unwrap().contains(&copy.into());
    assert!(listed(copy));
    // Negative control: the copy is what it needs.
    std::fs::rename(moved.join(copy), scratch.join("small.bed")).unwrap();
    assert_eq!(go_on(&moved, On::threads(1)).0.unwrap_err().exit_code(), exit::WRONG_INPUT);
    // Another case in the same folder leaves no copy of what it does not name.
    std::fs::rename(scratch.join("small.bed"), moved.join(copy)).unwrap();
    run::run(&load(SLIDING, &[]), &again, &mut Listener::default(), &stop).unwrap();
    assert!(!listed(copy) && !moved.join("inputs").exists());
}

#[test]
fn the_log_holds_what_was_said() {
    let scratch = Scratch::new("restart-log");
    let folder = scratch.join("run");
    start(&load(SLIDING, &[]), &folder, On::ranks(2, 1).steps(2)).unwrap();
    let first = std::fs::read_to_string(folder.join("log.txt")).unwrap();
    assert_eq!(first.lines().filter(|line| line.contains("Z  flow ")).count(), 1, "{first}");
    assert!(first.contains("Z  stopped after 2 steps, as asked, at step 2, "), "{first}");
    // The time of day stands before each message: 2026-11-22T18:30:00Z.
    let is_dated = |line: &str| line.len() > 22 && line.as_bytes()[10] == b'T' && &line[19..22] == "Z  ";
    assert!(first.lines().filter(|line| !line.starts_with(' ')).all(is_dated), "{first}");
    let said = go_on(&folder, On::threads(1).steps(2)).1;
    let both = std::fs::read_to_string(folder.join("log.txt")).unwrap();
    let added = both.strip_prefix(&first).expect("the log of the first command stays");
    assert!(said.iter().any(|text| text.starts_with("going on from step 2")));
    for text in &said {
        assert!(added.lines().any(|line| line.ends_with(text.as_str())), "`{text}` is not in:\n{added}");
    }
}

#[test]
fn probes_keep_their_own_schedules() {
    let scratch = Scratch::new("restart-probes");
    let folder = scratch.join("run");
    let more = "[[probe]]\nname = \"as the series\"\npoint = [\"1 mm\", \"1 mm\", \"1 mm\"]\n\
                [[probe]]\nname = \"never\"\nat = []\npoint = [\"1 mm\", \"1 mm\", \"1 mm\"]\n[output]\n";
    let text = SLIDING.replace("[output]\n", more).replace("series = { steps = 1 }", "series = { steps = 2 }");
    start(&load(&text, &[]), &folder, On::threads(1).steps(6)).unwrap();
    let left = Left::in_folder(&folder);
    let steps = |name: &str| {
        let found = left.probes.iter().find(|(file, _)| *file == format!("{name}.csv"));
        found.map(|(_, table)| table.column("step"))
    };
    assert_eq!(steps("middle"), Some(vec![0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0]));
    assert_eq!(steps("grain"), Some(vec![0.0, 3.0, 6.0]));
    assert_eq!(steps("as the series"), Some(left.column("step")));
    assert_eq!(steps("never"), None);
    assert_eq!(left.column("step"), [0.0, 2.0, 4.0, 6.0]);
}

fn copy_folder(from: &Path, to: &Path) -> bool {
    std::fs::create_dir_all(to).expect("the case is sound");
    for entry in std::fs::read_dir(from).expect("the case is sound") {
        let path = entry.expect("the case is sound").path();
        let place = to.join(path.file_name().expect("the case is sound"));
        if path.is_dir() {
            copy_folder(&path, &place);
        } else {
            std::fs::copy(&path, &place).expect("the case is sound");
        }
    }
    true
}

#[test]
fn damaged_lists_and_tables_do_not_stop_a_run() {
    let scratch = Scratch::new("restart-tables");
    let loaded = load(SLIDING, &["output.series.steps=1", "output.grains.every=\"0.05 ms\""]);
    let [sound, damaged] = ["sound", "damaged"].map(|name| scratch.join(name));
    start(&loaded, &sound, On::threads(1).steps(STEPS)).unwrap();
    assert!(copy_folder(&sound, &damaged));
    let warned =
        |said: &[String], about: &str| said.iter().any(|line| line.starts_with("warning: ") && line.contains(about));
    let (outcome, said) = go_on(&sound, On::threads(1).steps(STEPS));
    outcome.unwrap();
    // Negative control: of sound files nothing is said.
    assert!(!["grains.pvd", "series.csv", "middle.csv"].iter().any(|about| warned(&said, about)), "{said:#?}");
    std::fs::write(damaged.join("grains.pvd"), "<DataSet no list").unwrap();
    std::fs::write(damaged.join("probes/middle.csv"), "not a table\n1,2,3\n").unwrap();
    let series = std::fs::read_to_string(damaged.join("series.csv")).unwrap();
    let kept = series.lines().count() / 2;
    let cut: usize = series.lines().take(kept).map(|line| line.len() + 1).sum();
    std::fs::write(damaged.join("series.csv"), &series[..cut + 7]).unwrap();
    let (outcome, said) = go_on(&damaged, On::threads(1).steps(STEPS));
    outcome.unwrap();
    for about in ["grains.pvd", "series.csv", "middle.csv"] {
        assert!(warned(&said, about), "{about}: {said:#?}");
    }
    assert!(damaged.join("probes/middle.csv.damaged").is_file());
    let [whole, left] = [&sound, &damaged].map(|folder| Left::in_folder(folder));
    assert_eq!(whole.hash(), left.hash());
    // What was lost stays lost, and what comes after follows what was kept.
    let rows = |left: &Left| left.series.rows.iter().map(|row| row[0].clone()).collect::<Vec<_>>();
    let lost = series.lines().count() - kept;
    assert_eq!(rows(&left).len() + lost, rows(&whole).len());
    assert_eq!(rows(&left)[kept - 1..], rows(&whole)[kept - 1 + lost..]);
}
