//! Findings of a run, found again from its checkpoint, and found otherwise as a run with other keys finds them.

use std::path::{Path, PathBuf};

use sazanami::analyse::analyse;
use sazanami::error::{CommandError, exit};
use sazanami::run::{RunOptions, Status};
use sazanami_io::checkpoint::CheckpointWriter;
use sazanami_numerics::Real;
use sazanami_numerics::snapshot::Snapshot;
use serde_json::Value;

use crate::support::{
    Listener, On, Scratch, Sketcher, Table, checkpoints, go_on, go_on_with, newest, owned, ran, start, summary,
};

/// A shallow bed of beads that a drop falls on; some are thrown up.
const BEADS: &str = include_str!("../cases/analysis-beads.toml");

const STEPS: u64 = 40;

/// Runs the beads in a folder of `scratch`.
fn beads(scratch: &Scratch, name: &str, overrides: &[&str], ranks: usize) -> PathBuf {
    let folder = scratch.join(name);
    ran(BEADS, overrides, &folder, On::ranks(ranks, 1).steps(STEPS));
    folder
}

/// Analyses a folder; returns the table, and what was said.
fn analysed(folder: &Path, overrides: &[&str]) -> (Result<Vec<String>, CommandError>, Vec<String>) {
    let mut listener = Listener::default();
    let outcome = analyse(&[folder.to_owned()], &owned(overrides), None, Some(&Sketcher), &mut listener);
    (outcome, listener.messages)
}

/// Findings of an analysis with other keys.
fn found(folder: &Path, overrides: &[&str]) -> Value {
    analysed(folder, overrides).0.expect("the run can be evaluated again");
    let left = summary(&folder.join("analysis"));
    assert_eq!(left["overrides"], serde_json::json!(overrides));
    assert_eq!(left["steps"], summary(folder)["steps"]);
    assert_eq!(left["time_s"], summary(folder)["time_s"]);
    left["observables"].clone()
}

fn volume(observables: &Value) -> Real {
    observables["erosion"]["volume_mm3"].as_f64().unwrap_or_else(|| panic!("no volume in {observables:#}"))
}

/// Findings of a run, but for the water, which is not looked at again.
fn of_grains(summary: &Value) -> Value {
    let mut found = summary["observables"].clone();
    assert!(found["soaked"]["volume_mm3"].is_number(), "{found}");
    found["soaked"] = serde_json::json!({ "not_evaluated": "the water is not looked at again" });
    found
}

#[test]
fn what_a_run_found_is_found_again() {
    let scratch = Scratch::new("analysis-same");
    for (ranks, mode) in [(1, "surface"), (2, "all")] {
        let folder = beads(&scratch, &format!("run-{ranks}"), &[&format!("erosion.mode={mode}")], ranks);
        let before = summary(&folder);
        assert!(before["observables"]["splash"]["grains"].as_u64() > Some(0), "{}", before["observables"]);
        assert!(volume(&before["observables"]) > 0.0, "{}", before["observables"]);
        let (lines, said) = analysed(&folder, &[]);
        let lines = lines.unwrap();
        assert!(!lines.iter().any(|line| line.contains("summary")), "{lines:#?}");
        assert_eq!(said, Vec::<String>::new());
        assert!(!folder.join("analysis").exists());
        assert_eq!(summary(&folder), before);
        // Keys that say what the case says already.
        let same = ["erosion.dr=0.3 mm", "bed.porosity_upper=\"0.8 mm\""];
        assert_eq!(found(&folder, &same), of_grains(&before));
    }
}

/// Sketches of the sections of a run, in the order of their times.
fn sections(folder: &Path) -> Vec<(PathBuf, String)> {
    let entries = std::fs::read_dir(folder.join("figures")).expect("the run drew").flatten().map(|entry| entry.path());
    let is_section =
        |path: &PathBuf| path.file_name().is_some_and(|name| name.to_string_lossy().starts_with("section-"));
    let mut paths: Vec<PathBuf> = entries.filter(is_section).collect();
    paths.sort();
    paths.into_iter().map(|path| (path.clone(), std::fs::read_to_string(path).expect("the run drew"))).collect()
}

/// Text after `name: ` in a sketch, up to a comma or a bracket.
fn value<'a>(sketch: &'a str, name: &str) -> &'a str {
    let (_, rest) = sketch.split_once(&format!(" {name}: ")).unwrap_or_else(|| panic!("no {name}"));
    rest.split([',', '}']).next().unwrap_or_default().trim()
}

#[test]
fn pictures_of_a_run_show_the_same_part_of_the_box_and_are_drawn_again() {
    let scratch = Scratch::new("analysis-pictures");
    let every = ["figures", "fields", "grains"].map(|table| format!("output.{table}={{ steps = 10 }}"));
    let keys: Vec<&str> = every.iter().map(String::as_str).chain(["erosion.grain_size=0.2 mm"]).collect();
    let folder = beads(&scratch, "run", &keys, 1);
    let first = sections(&folder);
    assert!(first.len() >= 4, "{}", first.len());
    // The drop reaches up to 2.5 mm at the start, and the box is 4 mm wide.
    for (path, sketch) in &first {
        let top: Real = value(sketch, "top").parse().unwrap();
        assert!((top - 2.66e-3).abs() < 1e-12, "{}: {top}", path.display());
    }
    // No rim without a crater.
    assert_eq!(value(&first[0].1, "crater"), "None");
    let found = summary(&folder)["observables"]["erosion"].clone();
    // The hollow at the end is no crater either: shallower than a grain, or within the noise.
    let of = |key: &str| found[key].as_f64().unwrap();
    assert!(of("depth_mm") <= 0.2 || of("volume_mm3") <= 3.0 * of("volume_noise_mm3"), "{found}");
    assert_eq!(value(&first[first.len() - 1].1, "crater"), "None");
    first.iter().for_each(|(path, _)| std::fs::write(path, "lost").unwrap());
    analysed(&folder, &[]).0.unwrap();
    for ((path, before), (_, after)) in first.iter().zip(sections(&folder)) {
        let head = |sketch: &str| sketch.split(" colouring").next().unwrap_or_default().to_owned();
        assert_eq!(head(before), head(&after), "{}", path.display());
        assert_eq!(value(before, "crater") == "None", value(&after, "crater") == "None", "{}", path.display());
    }
}

/// What was measured, without what is said of it.
fn measured(part: &Value) -> Value {
    let mut part = part.clone();
    if let Some(table) = part.as_object_mut() {
        table.retain(|key, _| !key.ends_with("_doubts"));
    }
    part
}

#[test]
fn other_keys_find_what_a_run_with_them_finds() {
    let scratch = Scratch::new("analysis-other");
    let folder = beads(&scratch, "run", &[], 1);
    let own = summary(&folder)["observables"].clone();
    let all: [(&str, &[&str], &str); 4] = [
        ("dr", &["erosion.dr=0.45 mm"], "erosion"),
        ("mode", &["erosion.mode=all", "erosion.dx=0.5 mm"], "erosion"),
        ("axis", &["erosion.axis=[\"2.2 mm\", \"1.9 mm\"]"], "erosion"),
        ("slab", &["bed.porosity_upper=0.6 mm", "bed.porosity_lower=\"0.1 mm\""], "bed"),
    ];
    for (name, overrides, part) in all {
        let expected = summary(&beads(&scratch, name, overrides, 1))["observables"].clone();
        let again = found(&folder, overrides);
        for part in ["bed", "erosion"] {
            assert_eq!(measured(&again[part]), measured(&expected[part]), "{name}: {part}");
        }
        // Negative control: the key makes a difference.
        assert_ne!(again[part], own[part], "{name}");
        if name == "dr" {
            assert_ne!(volume(&again), volume(&own));
        }
        if name == "axis" {
            // Who was splashed how far is not known for another axis.
            assert!(again["splash"]["not_evaluated"].is_string(), "{again:#}");
        } else {
            assert_eq!(again["splash"], expected["splash"], "{name}");
        }
        let (lines, _) = analysed(&folder, overrides);
        assert!(lines.unwrap().iter().any(|line| line.contains("(summary: ")), "{name}");
        assert_eq!(summary(&folder)["observables"], own, "{name}: the summary of the run stays");
    }
    let listed = summary(&folder)["files"].clone();
    assert!(listed.as_array().unwrap().contains(&"analysis/summary.json".into()), "{listed}");
}

#[test]
fn a_volume_that_is_not_found_again_is_reported() {
    let scratch = Scratch::new("analysis-volume");
    let folder = beads(&scratch, "run", &[], 1);
    let path = folder.join("summary.json");
    let warned = |factor: Real| {
        let mut changed = summary(&folder);
        changed["observables"]["erosion"]["volume_mm3"] = (factor * volume(&changed["observables"])).into();
        std::fs::write(&path, changed.to_string()).expect("the summary can be changed");
        analysed(&folder, &[]).1.iter().any(|text| text.starts_with("warning: the erosion volume found again"))
    };
    assert!(!warned(1.0 + 1e-12));
    assert!(warned(1.0 + 1e-6));
}

#[test]
fn only_the_evaluation_can_be_changed() {
    let scratch = Scratch::new("analysis-refused");
    let folder = beads(&scratch, "run", &[], 1);
    let refused = |overrides: &[&str]| {
        let error = analysed(&folder, overrides).0.expect_err("this cannot be changed");
        assert_eq!(error.exit_code(), exit::WRONG_INPUT, "{error}");
        error.to_string()
    };
    let speed = refused(&["erosion.dr=0.4 mm", "liquid.0.fall.speed=2 m/s"]);
    assert!(speed.contains("`liquid.0.fall.speed` cannot be changed afterwards"), "{speed}");
    assert!(speed.contains("keys under `bed`, `heap` and `erosion` can be"), "{speed}");
    assert!(refused(&["erosoin.dr=0.4 mm"]).contains("did you mean `erosion`?"));
    assert!(refused(&["erosion.dt=0.4 mm"]).contains("unknown key `dt`"));
    assert!(refused(&["erosion.dr=0.4 s"]).contains("wrong unit"));
    assert!(refused(&["erosion.dr"]).contains("needs an equals sign"));
    let twice = [folder.clone(), folder.clone()];
    let both = analyse(&twice, &owned(&["erosion.dr=0.4 mm"]), None, Some(&Sketcher), &mut Listener::default());
    let both = both.unwrap_err();
    assert_eq!(both.exit_code(), exit::WRONG_INPUT);
    assert!(both.to_string().contains("2 folders are given"), "{both}");
    assert!(!folder.join("analysis").exists());
    // Without a checkpoint there is the summary, and nothing else.
    std::fs::remove_dir_all(folder.join("checkpoints")).unwrap();
    assert!(refused(&["erosion.dr=0.4 mm"]).contains("no good checkpoint of the flow"));
    let (lines, said) = analysed(&folder, &[]);
    assert!(lines.unwrap().iter().any(|line| line.starts_with("erosion volume V")));
    assert!(said.iter().all(|text| text.starts_with("drew")), "{said:#?}");
}

/// Takes the sections that `gone` names out of the newest checkpoint; returns its step.
fn thin_out(folder: &Path, gone: impl Fn(&str) -> bool) -> u64 {
    let all = newest(folder).snapshot().expect("the run left it");
    let mut kept = Snapshot::default();
    all.sections().filter(|(name, _)| !gone(name)).for_each(|(name, section)| kept.put(name, section.clone()));
    assert!(kept.sections().count() < all.sections().count(), "nothing was taken out");
    let mut writer = CheckpointWriter::new();
    writer.add_snapshot(&kept).expect("a checkpoint can be written");
    let steps = checkpoints(folder).steps().expect("the run left it");
    let step = *steps.last().expect("there is a checkpoint");
    writer.write_atomic(&checkpoints(folder).path_of(step)).expect("a checkpoint can be written");
    step
}

#[test]
fn a_checkpoint_without_the_bed_before_the_impact_goes_on_and_is_found_again() {
    let scratch = Scratch::new("analysis-earlier");
    let folder = beads(&scratch, "run", &[], 1);
    let before = summary(&folder);
    thin_out(&folder, |name| name.starts_with("observe/before_impact/"));
    let (lines, said) = analysed(&folder, &[]);
    assert!(!lines.unwrap().iter().any(|line| line.contains("summary")));
    assert!(said.iter().all(|text| text.starts_with("drew")), "{said:#?}");
    let error = analysed(&folder, &["erosion.dr=0.4 mm"]).0.unwrap_err();
    assert_eq!(error.exit_code(), exit::WRONG_INPUT);
    assert!(error.to_string().contains("does not hold the bed before the impact"), "{error}");
    let (resumed, _) = go_on(&folder, On::threads(1).steps(2));
    assert_eq!(resumed.unwrap().status, Status::Stopped);
    let whole = scratch.join("whole");
    ran(BEADS, &[], &whole, On::threads(1).steps(STEPS + 2));
    assert_ne!(summary(&folder)["state_hash"], before["state_hash"]);
    for part in ["state_hash", "observables"] {
        assert_eq!(summary(&folder)[part], summary(&whole)[part], "{part}");
    }
}

#[test]
fn a_run_that_was_resumed_is_found_again_too() {
    let scratch = Scratch::new("analysis-resumed");
    let folder = beads(&scratch, "run", &[], 2);
    go_on(&folder, On::threads(1).steps(3)).0.unwrap();
    assert_eq!(found(&folder, &["erosion.mode=surface"]), of_grains(&summary(&folder)));
}

#[test]
fn a_damaged_checkpoint_is_passed_over_with_a_word() {
    let scratch = Scratch::new("analysis-damaged");
    let folder = beads(&scratch, "run", &[], 1);
    let steps = checkpoints(&folder).steps().unwrap();
    std::fs::write(checkpoints(&folder).path_of(steps[1]), "torn").unwrap();
    let (lines, said) = analysed(&folder, &[]);
    lines.unwrap();
    assert!(said.iter().any(|text| text.starts_with("warning: skipped")), "{said:#?}");
    assert!(said.iter().any(|text| text.contains(&format!("step {} at", steps[0]))), "{said:#?}");
    assert_eq!(said.iter().filter(|text| text.contains("warning")).count(), 1, "{said:#?}");
}

#[test]
fn whether_a_crater_rests_is_known_by_its_run_and_said_of_every_evaluation() {
    let scratch = Scratch::new("analysis-unrest");
    // The hollow is deeper than such a grain.
    let folder = beads(&scratch, "run", &["erosion.grain_size=0.05 mm"], 1);
    let doubts = |of: &Value| of["erosion"]["volume_below_rim_doubts"].as_str().unwrap_or_default().to_owned();
    let is_doubted = |of: &Value| doubts(of).contains("the crater has not come to rest");
    assert!(is_doubted(&summary(&folder)["observables"]), "{}", summary(&folder)["observables"]);
    assert!(is_doubted(&found(&folder, &["erosion.dr=0.45 mm"])));
    // Negative control: what is no crater by the size of the grains does not come to rest.
    let shallow = found(&folder, &["erosion.grain_size=0.5 mm"]);
    assert!(doubts(&shallow).contains("no crater") && !is_doubted(&shallow), "{shallow:#}");
}

#[test]
fn a_changed_case_is_reported_and_one_that_does_not_fit_is_not_evaluated() {
    let scratch = Scratch::new("analysis-changed");
    let folder = beads(&scratch, "run", &[], 1);
    let path = folder.join("case.toml");
    let text = std::fs::read_to_string(&path).unwrap();
    std::fs::write(&path, text.replace("\"-9.8 m/s^2\"", "\"-9.9 m/s^2\"")).unwrap();
    let (lines, said) = analysed(&folder, &[]);
    lines.unwrap();
    assert!(said.iter().any(|text| text.contains("is not the case that this run began with")), "{said:#?}");
    let start = text.find("[[grains]]").unwrap();
    let second = start + 1 + text[start + 1..].find("[[grains]]").unwrap();
    let end = second + text[second..].find("[bed]").unwrap();
    std::fs::write(&path, format!("{}{}", &text[..second], &text[end..])).unwrap();
    let (lines, said) = analysed(&folder, &[]);
    assert!(lines.unwrap().iter().any(|line| line.starts_with("erosion volume V")));
    assert!(said.iter().any(|text| text.contains("a shape that the case does not have")), "{said:#?}");
    assert_eq!(analysed(&folder, &["erosion.dr=0.4 mm"]).0.unwrap_err().exit_code(), exit::WRONG_INPUT);
}

#[test]
fn a_run_until_rest_ends_when_its_crater_has_kept_for_ten_milliseconds() {
    let scratch = Scratch::new("analysis-rest");
    let case = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../cases/raindrop/small.toml");
    let run = |name: &str, latest: &str| {
        let folder = scratch.join(name);
        // Faster than the case, whose crater is as deep as a grain is wide: as deep as one has to be. How long it creeps is chance.
        let faster = "liquid.0.fall.speed=7 m/s".into();
        let ends = format!("run={{until=\"rest\",latest=\"{latest}\"}}");
        let overrides = [ends, "output.figures.at=[]".into(), faster];
        let loaded = sazanami::case::load(&case, &overrides).unwrap_or_else(|error| panic!("{error}"));
        start(&loaded, &folder, On::threads(2)).unwrap();
        let summary = summary(&folder);
        let rest = &summary["observables"]["crater_rest"];
        let end = summary["time_s"].as_f64().unwrap();
        let since = rest["within_uncertainty_since_s"].as_f64().unwrap_or(Real::NAN);
        let series = Table::read(&folder.join("series.csv"));
        (end, since, rest["at_rest"] == true, series.column("erosion_volume_below_rim"))
    };
    let (end, since, rests, volumes) = run("rest", "150 ms");
    assert!(rests && end < 0.149 && end - since > 0.0099, "{end} {since}");
    // Ten milliseconds of rows, a millisecond each, within 3 % of the last.
    let last = *volumes.last().unwrap();
    assert!(volumes.iter().rev().take(11).all(|volume| (volume / last - 1.0).abs() < 0.03), "{volumes:?}");
    // It does not go on by itself, and says how it would.
    let open = || On::threads(1).options(None);
    for options in [RunOptions { until: Some(0.2), ..open() }, RunOptions { steps: Some(5), ..open() }] {
        let error = go_on_with(&scratch.join("rest"), &options).0.unwrap_err();
        assert_eq!(error.exit_code(), exit::WRONG_INPUT);
        assert!(error.to_string().contains("this run has come to rest at"), "{error}");
    }
    // Negative control: long before its crater rests the run ends by its latest time, and goes on to a later one.
    assert!(end > 0.025, "{end}");
    let (end, _, rests, _) = run("latest", "15 ms");
    assert!(!rests && (end - 15e-3).abs() < 1e-9, "{end}");
    assert_eq!(
        go_on_with(&scratch.join("latest"), &RunOptions { until: Some(15.2e-3), ..open() }).0.unwrap().status,
        Status::Finished
    );
}
