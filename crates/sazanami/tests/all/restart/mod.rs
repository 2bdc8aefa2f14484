//! An interrupted run goes on to the same bits, whatever interrupted it; damaged checkpoints are distinguished from good ones.

mod damaged;
mod followed;
mod longer;

use std::path::Path;

use sazanami::case::{self, LoadedCase, resolved};
use sazanami::error::{CommandError, exit};
use sazanami::progress::StepLine;
use sazanami::run::{self, RunOptions, RunSummary, Status};
use sazanami::stop::Stop;
use sazanami_io::checkpoint::CheckpointWriter;

use crate::support::{
    Left, Listener, On, Scratch, checkpoints, findings, go_on, go_on_with, heard, load, newest, ran, start, summary,
};

/// Grains that fall on each other and slide, in water with a free surface, with steps that grow and shrink;
/// everything that writes is in it.
const SLIDING: &str = include_str!("../../cases/restart-sliding.toml");

/// The same, packed first.
const PACKED: &str = include_str!("../../cases/restart-packed.toml");

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
        let left = ran(text, overrides, &whole, On::ranks(ranks, 1).steps(2 * STEPS));
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
fn a_run_with_springs_that_were_softened_before_the_break_and_after_it() {
    for (name, from) in [("softened", "10 us"), ("softened-later", "0.3 ms")] {
        let soften = format!("dem.soften={{ from = \"{from}\", stiffness = 0.3, largest_overlap = 0.5 }}");
        goes_on_alike(name, SLIDING, &[&soften], &[1, 2]);
    }
    // Negative control: springs that were softened tell.
    let scratch = Scratch::new("restart-softened-control");
    let hash = |name: &str, keys: &[&str]| {
        ran(SLIDING, keys, &scratch.join(name), On::threads(1).steps(2 * STEPS)).hash().to_owned()
    };
    let soften = "dem.soften={ from = \"0.3 ms\", stiffness = 0.3, largest_overlap = 0.5 }";
    assert_ne!(hash("soft", &[soften]), hash("hard", &[]));
}

#[test]
fn a_run_with_fixed_steps_and_the_old_pressure_in_the_predictor() {
    let literal = [
        "fluid={ dt = \"50 us\", tol_div = 1e-8 }",
        "fluid.pressure_form=incremental",
        "fluid.convection=velocity_form",
        "coupling.exchange=stress",
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

/// A box full of liquid in a frame that swings, whose acceleration limits the steps.
const FULL: &str = "gravity = \"1 m/s^2\"\ndomain = { size = [\"0.12 m\", \"0.12 m\", \"0.12 m\"], cells = [12, 12, 12] }\n\
    fluid.dt_max = \"1 s\"\nframe.oscillation = { amplitude = [\"20 m/s^2\", \"0 m/s^2\", \"0 m/s^2\"], frequency = \"1 Hz\" }\n\
    [[liquid]]\nregion.half_space.point = [\"0 m\", \"0 m\", \"0.2 m\"]\n[run]\nuntil = \"0.4 s\"\n";

#[test]
fn a_run_whose_steps_hang_on_a_force_that_changes() {
    let scratch = Scratch::new("restart-full");
    let (whole, broken) = (scratch.join("whole"), scratch.join("broken"));
    let left = ran(FULL, &[], &whole, On::threads(1));
    ran(FULL, &[], &broken, On::threads(1).steps(STEPS));
    go_on(&broken, On::threads(2)).0.expect("the case is sound");
    assert_same(&broken, &whole, "steps by a force that changes");
    let limited = left.summary["limiter"]["body_force"].as_u64().expect("a number");
    assert!(limited > 10, "{limited}");
}

#[test]
fn a_forgotten_contact_would_be_noticed() {
    // Negative control: the comparison sees the memory of contacts.
    let scratch = Scratch::new("restart-control");
    let run = |name: &str, steps| ran(SLIDING, &[], &scratch.join(name), On::threads(1).steps(steps));
    let (a, b) = (run("a", STEPS), run("b", STEPS + 1));
    assert_ne!(a.hash(), b.hash());
    let displacement = a.state.reals("grains/contact.displacement").unwrap();
    assert!(displacement.iter().any(|&d| d != 0.0), "no contact has a memory");
}

/// Stops a run into `folder` after the step for which `after` says so.
fn interrupted(loaded: &LoadedCase, folder: &Path, ranks: usize, after: fn(&StepLine) -> bool) {
    crate::support::interrupted(loaded, &On::ranks(ranks, 1).options(Some(folder)), after);
}

/// Goes on with the run in `folder` and stops it after the step for which `after` says so.
fn interrupted_again(folder: &Path, on: On, after: fn(&StepLine) -> bool) -> (RunSummary, Vec<StepLine>) {
    let stop = Stop::new();
    let mut listener = Listener { stop: Some(&stop), stop_after: Some(after), ..Listener::default() };
    let ended = run::resume(folder, &on.options(None), &mut listener, &stop).expect("the case is sound");
    (ended, listener.lines)
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
        assert_eq!(summary(&broken)["status"], "stopped");
        let memory = newest(&broken).snapshot().unwrap();
        assert!(memory.reals("packing/time").unwrap()[0] >= 100.0 * 2e-5 - 1e-9);
        let (outcome, said) = go_on(&broken, On::ranks(ranks, 2));
        assert_eq!(outcome.unwrap().status, Status::Stopped);
        assert!(said.iter().any(|text| text.contains("packed 16 grains")), "{said:#?}");
        assert_same(&broken, &whole, &format!("{ranks} ranks"));
    }
}

#[test]
fn a_bed_that_the_rest_of_the_case_does_not_suit_is_reported_and_kept() {
    let loaded = load(PACKED, &["liquid.0.gap_above_bed=2.3 mm"]);
    let scratch = Scratch::new("restart-unsuited");
    let report = |outcome: Result<RunSummary, CommandError>, folder: &Path| {
        let error = outcome.expect_err("the drop does not fit above the bed");
        assert_eq!(error.exit_code(), exit::WRONG_INPUT, "{error}");
        let kept = format!("placement.bed = {{ file = \"{}\" }}", folder.join("packed.bed").display());
        assert!(error.to_string().contains("does not fit above the bed"), "{error}");
        assert!(error.to_string().contains(&kept), "{error}");
        let left = summary(folder);
        assert_eq!((&left["status"], &left["failure"]["kind"]), (&"failed".into(), &"input".into()));
    };
    for ranks in [1, 2] {
        let whole = scratch.join(&format!("whole-{ranks}"));
        report(start(&loaded, &whole, On::ranks(ranks, 1)), &whole);
        let broken = scratch.join(&format!("broken-{ranks}"));
        interrupted(&loaded, &broken, ranks, |line| line.phase == "packing" && line.step >= 100);
        assert_eq!(summary(&broken)["status"], "stopped");
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
    assert_eq!(summary(&fine)["failure"], serde_json::Value::Null);
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
        interrupted_again(&broken, On::threads(1), after);
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
        // A mean speed of 2 mm/s, which is rest, lets the fastest of sixteen grains have 32 mm/s.
        assert!(!relax || worst("grain_speed") < 0.032, "{}", worst("grain_speed"));
        let overlap = worst("overlap_relative");
        let [place, velocity] = ["position", "velocity"]
            .map(|name| left.state.vectors(&format!("grains/grain.{name}")).expect("there are grains"));
        let mean_speed = velocity.iter().map(|v| v.length()).sum::<f64>() / velocity.len() as f64;
        (overlap, mean_speed, place)
    };
    let (overlap, speed, alone) = run("alone", 1, true);
    println!("overlap {overlap}, speed {speed}");
    assert!(overlap < 0.05 && speed < 2e-3, "overlap {overlap}, speed {speed}");
    let (_, _, shared) = run("shared", 3, true);
    let apart = alone.iter().zip(&shared).map(|(a, b)| a.distance(*b)).fold(0.0, f64::max);
    println!("ranks apart by {apart}");
    assert!(alone.len() == 16 && apart < 1e-3 * 0.52e-3, "{apart}");
    // Negative control: as they are squeezed.
    let (overlap, speed, _) = run("squeezed", 1, false);
    println!("overlap {overlap}, speed {speed}");
    assert!(overlap > 0.2 && speed > 2e-2, "overlap {overlap}, speed {speed}");
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
                let settling = |line: &StepLine| line.limiter == "settling" && line.phase == "relax";
                let (ended, lines) = interrupted_again(&broken, On::ranks(ranks, 2), settling);
                assert_eq!((ended.status, ended.exit_code()), (Status::Stopped, exit::STOPPED));
                assert!(lines.iter().all(|line| line.phase == "relax"));
            }
            assert_eq!(summary(&broken)["status"], "stopped");
            let memory = newest(&broken).snapshot().unwrap();
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
fn a_series_ends_where_the_case_ends_and_not_where_a_command_stops() {
    let scratch = Scratch::new("restart-series");
    let fixed = "fluid={ dt = \"50 us\", tol_div = 1e-8 }";
    // The last row after fourteen steps: of the time, of the steps of the case, and of both at once, which is one row.
    for (name, end, every, steps) in [
        ("time", "run.until=0.7 ms", "{ steps = 5 }", [0, 5, 10, 14].as_slice()),
        ("steps", "run.steps=14", "{ every = \"0.3 ms\" }", &[0, 6, 12, 14]),
        ("both", "run.until=0.7 ms", "{ every = \"0.35 ms\", steps = 7 }", &[0, 7, 14]),
    ] {
        let keys = [fixed, end, &format!("output.series={every}")];
        let [whole, broken] = ["whole", "broken"].map(|part| scratch.join(&format!("{name}-{part}")));
        let rows = |folder: &Path, on: On| -> Vec<u64> {
            ran(SLIDING, &keys, folder, on).column("step").iter().map(|step| *step as u64).collect()
        };
        assert_eq!(rows(&whole, On::threads(1)), steps, "{name}");
        // Negative control: where a command stops there is no row.
        assert_eq!(rows(&broken, On::threads(1).steps(13)), steps[..steps.len() - 1], "{name}");
        go_on(&broken, On::threads(1)).0.expect("the run goes on");
        assert_same(&broken, &whole, name);
    }
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
        let options = RunOptions { out: Some(folder.clone()), threads: Some(2), ranks: 1, ..options };
        let ended = run::run(&loaded, &options, &mut Listener::default(), &Stop::new()).unwrap();
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
        let more = RunOptions { until: Some(0.5e-3), threads: Some(1), ranks: 1, ..RunOptions::default() };
        go_on_with(&folder, &more).0.unwrap();
        let (outcome, _) = go_on(&folder, On::threads(1));
        assert_eq!(outcome.unwrap().status, Status::Finished);
        assert_same(&folder, &whole, &folder.display().to_string());
    }
}
