//! Runs that go on beyond the end of their case.

use super::*;

/// A lid that drags liquid along, in adaptive steps.
const DRAGGED: &str = include_str!("../../cases/longer-dragged.toml");

fn until(time: f64, ranks: usize) -> RunOptions {
    RunOptions { until: Some(time), ..On::ranks(ranks, 1).options(None) }
}

#[test]
fn a_finished_run_goes_on_to_a_later_end() {
    let scratch = Scratch::new("longer");
    for ranks in [1, 2] {
        let (folder, whole) = (scratch.join(&format!("longer-{ranks}")), scratch.join(&format!("whole-{ranks}")));
        // The first end is a time of output, so that no step ends there that would not otherwise.
        assert_eq!(start(&load(DRAGGED, &[]), &folder, On::ranks(ranks, 1)).unwrap().status, Status::Finished);
        let (outcome, said) = go_on_with(&folder, &until(5e-3, ranks));
        assert_eq!(outcome.unwrap().status, Status::Finished);
        assert!(said.iter().any(|text| text.contains("the case now ends at 0.005 s")), "{said:#?}");
        let as_long = ran(DRAGGED, &["run.until=\"5 ms\""], &whole, On::ranks(ranks, 1));
        assert_same(&folder, &whole, "a run that was lengthened");
        let case_of = |folder: &Path| std::fs::read_to_string(folder.join("case.toml")).unwrap();
        assert_eq!(case_of(&folder), case_of(&whole));
        let longer = Left::in_folder(&folder);
        assert_eq!(longer.summary["history"]["ends_s"], serde_json::json!([0.003]));
        assert_eq!(longer.summary["case_hash"], as_long.summary["case_hash"]);
        let times = longer.column("time");
        assert_eq!(times.last(), Some(&5e-3));
        assert!(times.windows(2).all(|pair| pair[0] < pair[1]), "no row stands twice: {times:?}");
    }
}

#[test]
fn an_end_later_than_that_of_the_case_is_said() {
    let scratch = Scratch::new("longer-said");
    let said = |name: &str, until: Option<f64>| {
        let options = RunOptions { out: Some(scratch.join(name)), until, ..On::threads(1).options(None) };
        let said = heard(&load(DRAGGED, &[]), &options).messages;
        assert_eq!(summary(&scratch.join(name))["status"], "finished");
        said.iter().any(|text| text.contains("`--set run.until=\"0.009 s\"` lengthens it"))
    };
    assert!(said("later", Some(9e-3)));
    // Negative control: an end that the case has, or none.
    assert!(!said("none", None));
}

#[test]
fn a_run_that_broke_off_just_after_it_was_lengthened_goes_on() {
    let scratch = Scratch::new("longer-broken");
    let folder = scratch.join("run");
    start(&load(DRAGGED, &[]), &folder, On::threads(1)).unwrap();
    let file = folder.join("case.toml");
    let text = std::fs::read_to_string(&file).unwrap();
    let ends = |time: &str| text.replace("until = \"0.003 s\"", &format!("until = \"{time}\""));
    assert_ne!(ends("0.004 s"), text);
    std::fs::write(&file, ends("0.004 s")).unwrap();
    assert_eq!(go_on(&folder, On::threads(1)).0.unwrap().status, Status::Finished);
    assert_eq!(Left::in_folder(&folder).column("time").last(), Some(&4e-3));
    // Negative control: another case is not the same run at any length.
    std::fs::write(&file, ends("0.006 s").replace("[6, 6, 6]", "[6, 6, 8]")).unwrap();
    let error = go_on(&folder, On::threads(1)).0.unwrap_err();
    assert!(error.to_string().contains("it was changed since"), "{error}");
}

#[test]
fn a_run_that_cannot_go_on_says_why() {
    let scratch = Scratch::new("longer-refused");
    let folder = scratch.join("run");
    start(&load(DRAGGED, &[]), &folder, On::threads(1)).unwrap();
    let before = std::fs::read(folder.join("summary.json")).unwrap();
    let refused = |options: RunOptions, cause: &str| {
        let error = go_on_with(&folder, &options).0.unwrap_err();
        assert_eq!(error.exit_code(), exit::WRONG_INPUT, "{error}");
        assert!(error.to_string().contains(cause), "{error}");
    };
    refused(until(2e-3, 1), "cannot go back to 0.002 s");
    refused(On::threads(1).steps(5).options(None), "its case ends at 0.003 s");
    assert_eq!(std::fs::read(folder.join("summary.json")).unwrap(), before, "nothing was touched");
    let counted = scratch.join("counted");
    let heard = heard(&load(DRAGGED, &["run.steps=3"]), &On::threads(1).options(Some(&counted)));
    let told =
        |messages: &[String]| messages.iter().filter(|text| text.contains("stopped")).cloned().collect::<Vec<_>>();
    let ended = told(&heard.messages);
    assert!(ended.len() == 1 && ended[0].contains("stopped by `run.steps` of the case at step 3"), "{ended:?}");
    let error = go_on_with(&counted, &until(4e-3, 1)).0.unwrap_err();
    assert!(error.to_string().contains("ends after 3 steps whatever the time"), "{error}");
    // Without a wish its results are presented again, with the reason for which it ends: an array job may begin a task twice.
    let (outcome, messages) = go_on(&counted, On::threads(1));
    assert_eq!(outcome.unwrap().steps, 3);
    let ended = told(&messages);
    assert!(ended.len() == 1 && ended[0].contains("stopped by `run.steps` of the case at step 3"), "{ended:?}");
    // Presenting the results of a finished run again is no wish for more.
    let steps = Left::in_folder(&folder).summary["steps"].as_u64();
    assert_eq!(Some(go_on(&folder, On::threads(1)).0.unwrap().steps), steps);
}

/// Water in a tank that moves as a record says, in steps that the swing limits.
const SWUNG: &str = "solver = \"mps\"\ngravity = \"9.81 m/s^2\"\ndomain.size = [\"80 mm\", \"80 mm\", \"120 mm\"]\n\
                     boundary = { x1 = \"slip\", x2 = \"periodic\", x3_lower = \"no_slip\", x3_upper = \"outflow\" }\n\
                     particles = { spacing = \"10 mm\", dt_max = \"20 ms\" }\nrun.until = \"0.2 s\"\n\
                     output = { series = { every = \"50 ms\" }, fields = { at = [] }, figures = { at = [] } }\n[[liquid]]\n\
                     region.half_space = { point = [\"0 mm\", \"0 mm\", \"80 mm\"] }\n";

#[test]
fn a_tank_that_moves_by_a_record_goes_on_in_the_steps_of_the_longer_run() {
    let scratch = Scratch::new("longer-swung");
    let record = scratch.join("record.csv");
    let place = |time: f64| 2e-3 * (std::f64::consts::TAU * 5.0 * time).sin();
    let rows = (0..=400).map(|n| 1e-3 * f64::from(n)).map(|time| format!("{time:.3},{:e}\n", place(time)));
    std::fs::write(&record, format!("t_s,x_m\n{}", rows.collect::<String>())).unwrap();
    let moved = format!("frame.motion.file={}", record.display());
    let [parts, whole] = ["parts", "whole"].map(|name| scratch.join(name));
    start(&load(SWUNG, &[&moved]), &parts, On::threads(1)).unwrap();
    assert_eq!(go_on_with(&parts, &until(0.4, 1)).0.unwrap().status, Status::Finished);
    let as_long = ran(SWUNG, &[&moved, "run.until=0.4 s"], &whole, On::threads(1));
    assert_same(&parts, &whole, "a run that was lengthened");
    // The swing does rule steps.
    assert!(
        as_long.summary["limiter"]["swing"].as_u64().is_some_and(|steps| steps > 20),
        "{}",
        as_long.summary["limiter"]
    );
}
