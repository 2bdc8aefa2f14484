//! Sweeps from the command line: side by side, with a run that fails, killed and gone on with.

#![cfg(unix)]

use std::path::Path;
use std::process::{Command, Output, Stdio};
use std::time::{Duration, Instant};

/// A grain and a drop fall within a box.
const CASE: &str = include_str!("../cases/sweep-case.toml");

const PLAN: &str = "case = \"a.toml\"\nside_by_side = 2\n[keys]\n\"fluid.cfl\" = [0.2, 0.3, 0.4]\n";

fn folder(plan: &str) -> tempfile::TempDir {
    let folder = tempfile::tempdir().expect("a folder");
    std::fs::write(folder.path().join("a.toml"), CASE).expect("the case");
    std::fs::write(folder.path().join("plan.toml"), plan).expect("the plan");
    folder
}

fn command(folder: &Path, arguments: &[&str]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_sazanami"));
    command.args(arguments).current_dir(folder);
    command
}

fn sweep(folder: &Path, arguments: &[&str]) -> Output {
    command(folder, &[&["sweep", "plan.toml", "--threads", "1"], arguments].concat()).output().expect("it starts")
}

fn said(output: &Output) -> String {
    format!("{}{}", String::from_utf8_lossy(&output.stdout), String::from_utf8_lossy(&output.stderr))
}

fn table(folder: &Path) -> String {
    std::fs::read_to_string(folder.join("runs/plan/sweep.csv")).unwrap_or_default()
}

#[test]
fn runs_go_side_by_side_and_end_in_one_table() {
    let folder = folder(PLAN);
    let listed = sweep(folder.path(), &["--list"]);
    assert_eq!(listed.status.code(), Some(0), "{}", said(&listed));
    assert!(said(&listed).contains("waiting     001-cfl-0.2  (") && said(&listed).contains("3 runs, 2 at a time"));
    assert!(!folder.path().join("runs").exists(), "a list writes nothing");
    let output = sweep(folder.path(), &[]);
    assert_eq!(output.status.code(), Some(0), "{}", said(&output));
    let text = said(&output);
    let at = |what: &str| text.find(what).unwrap_or_else(|| panic!("no `{what}`:\n{text}"));
    assert!(at("002-cfl-0.3: begins") < at("001-cfl-0.2: finished"), "side by side:\n{text}");
    assert!(text.contains("3 of 3 runs finished, 0 failed, 0 left"), "{text}");
    let rows: Vec<String> = table(folder.path()).lines().map(str::to_owned).collect();
    assert!(rows[0].starts_with("run,status,fluid.cfl,time_s,steps,state_hash,"), "{rows:?}");
    assert!(rows[1].starts_with("001-cfl-0.2,finished,0.2,") && rows.len() == 4, "{rows:?}");
    assert!(folder.path().join("runs/plan/report.html").is_file());
    // Runs that ended are not repeated.
    let (before, again) = (table(folder.path()), sweep(folder.path(), &[]));
    assert!(again.status.success() && !said(&again).contains("begins") && !said(&again).contains("goes on\n"));
    assert_eq!(table(folder.path()), before);
    // Another plan does not write over them; one with more runs does.
    std::fs::write(folder.path().join("plan.toml"), PLAN.replace("0.3", "0.35")).unwrap();
    let refused = sweep(folder.path(), &[]);
    assert_eq!(refused.status.code(), Some(2), "{}", said(&refused));
    assert!(said(&refused).contains("its run 002-cfl-0.3 is not one of this plan"), "{}", said(&refused));
    // Nor does it take their results for its own.
    for arguments in [["--collect"], ["--list"]] {
        let refused = sweep(folder.path(), &arguments);
        assert_eq!(refused.status.code(), Some(2), "{}", said(&refused));
        assert_eq!(table(folder.path()), before);
    }
    let swapped = command(folder.path(), &["run", "plan.toml"]).output().unwrap();
    assert_eq!(swapped.status.code(), Some(2));
    assert!(said(&swapped).contains("this is the plan of a sweep, not a case"), "{}", said(&swapped));
    let swapped = command(folder.path(), &["sweep", "a.toml"]).output().unwrap();
    assert_eq!(swapped.status.code(), Some(2));
    assert!(said(&swapped).contains("this is a case, not the plan of a sweep"), "{}", said(&swapped));
    std::fs::write(folder.path().join("plan.toml"), PLAN.replace("0.4]", "0.4, 0.45]")).unwrap();
    let more = sweep(folder.path(), &[]);
    assert_eq!(more.status.code(), Some(0), "{}", said(&more));
    assert_eq!(said(&more).matches(": begins").count(), 1, "{}", said(&more));
    assert!(table(folder.path()).starts_with(&before));
}

#[test]
fn a_run_that_fails_is_marked_and_the_others_go_on() {
    let plan = "case = \"a.toml\"\n[keys]\n\"fluid.pressure_iterations\" = [1, 500]\n";
    let folder = folder(plan);
    let output = sweep(folder.path(), &[]);
    assert_eq!(output.status.code(), Some(1), "{}", said(&output));
    let rows = table(folder.path());
    assert!(rows.contains("\n001-pressure_iterations-1,failed,1,"), "{rows}\n{}", said(&output));
    assert!(rows.contains("\n002-pressure_iterations-500,finished,500,"), "{rows}\n{}", said(&output));
    // It stays failed, unless it is to be tried again.
    let again = sweep(folder.path(), &[]);
    assert!(again.status.code() == Some(1) && !said(&again).contains("goes on\n"), "{}", said(&again));
    let retried = sweep(folder.path(), &["--retry"]);
    assert!(retried.status.code() == Some(1) && said(&retried).contains(": goes on"), "{}", said(&retried));
}

#[test]
fn a_sweep_that_was_killed_goes_on_to_the_same_table() {
    let plan = format!("{PLAN}[set]\n\"run.steps\" = 500\n");
    let whole = folder(&plan);
    let output = sweep(whole.path(), &[]);
    assert_eq!(output.status.code(), Some(0), "{}", said(&output));
    for signal in ["-TERM", "-KILL"] {
        let broken = folder(&plan);
        let mut child = command(broken.path(), &["sweep", "plan.toml", "--threads", "1"])
            .stdout(Stdio::null())
            .stderr(Stdio::null())
            .spawn()
            .unwrap();
        let began = Instant::now();
        let checkpoints = broken.path().join("runs/plan/002-cfl-0.3/checkpoints");
        while !checkpoints.is_dir() && began.elapsed() < Duration::from_secs(100) {
            std::thread::sleep(Duration::from_millis(20));
        }
        assert!(Command::new("kill").args([signal, &child.id().to_string()]).status().unwrap().success());
        let code = child.wait().unwrap().code();
        if signal == "-TERM" {
            assert_eq!(code, Some(130));
            assert!(table(broken.path()).contains(",broken off,"), "{}", table(broken.path()));
        }
        let resumed = sweep(broken.path(), &[]);
        assert_eq!(resumed.status.code(), Some(0), "{}", said(&resumed));
        assert_eq!(table(broken.path()), table(whole.path()), "{}", said(&resumed));
    }
}

#[test]
fn what_cannot_run_is_refused_before_anything_does() {
    let folder = folder("case = \"a.toml\"\n[keys]\n\"fluid.clf\" = [0.2, 0.3]\n");
    let output = sweep(folder.path(), &[]);
    assert_eq!(output.status.code(), Some(2), "{}", said(&output));
    assert!(said(&output).contains("--> plan.toml:3:") && said(&output).contains("did you mean `cfl`?"));
    assert!(!folder.path().join("runs").exists());
    // More than the disk holds.
    let much = "case = \"a.toml\"\n[set]\n\"output.fields\" = { every = \"1e-9 s\" }\n\"run.steps\" = 1000000000\n\
                [keys]\n\"fluid.cfl\" = [0.2, 0.3]\n";
    std::fs::write(folder.path().join("plan.toml"), much).unwrap();
    let output = sweep(folder.path(), &[]);
    assert_eq!(output.status.code(), Some(2), "{}", said(&output));
    assert!(said(&output).contains("do not fit onto the disk"), "{}", said(&output));
    assert!(!folder.path().join("runs").exists());
}

#[test]
fn an_array_job_runs_each_case_by_its_number() {
    let folder = folder(PLAN);
    let output = sweep(folder.path(), &["--slurm"]);
    assert_eq!(output.status.code(), Some(0), "{}", said(&output));
    let script = folder.path().join("runs/plan/sweep.sbatch");
    let text = std::fs::read_to_string(&script).unwrap();
    assert!(text.contains("#SBATCH --array=1-3%2\n") && text.contains("#SBATCH --cpus-per-task=1\n"), "{text}");
    // The second task, twice: the second time it finds a run that ended.
    for _ in 0..2 {
        let mut task = Command::new("bash");
        task.arg(&script).env("SLURM_ARRAY_TASK_ID", "2").env("SLURM_CPUS_PER_TASK", "1");
        let ran = task.output().unwrap();
        assert!(ran.status.success(), "{}", said(&ran));
    }
    let collected = sweep(folder.path(), &["--collect"]);
    assert_eq!(collected.status.code(), Some(0), "{}", said(&collected));
    assert!(said(&collected).contains("1 of 3 runs finished, 0 failed, 2 left"), "{}", said(&collected));
    assert!(table(folder.path()).contains("\n002-cfl-0.3,finished,0.3,"), "{}", table(folder.path()));
}

#[test]
fn why_there_are_no_sensitivities_is_said() {
    let said_of = |set: &str, key: &str| {
        let plan = format!("case = \"a.toml\"\npoints = {{ morris = {{ trajectories = 1 }} }}\n{set}[keys]\n{key}\n");
        let folder = folder(&plan);
        let output = sweep(folder.path(), &[]);
        assert_eq!(output.status.code(), Some(0), "{}", said(&output));
        (said(&output), folder.path().join("runs/plan/sensitivity.csv").exists())
    };
    let inert = "\"contact.default.restitution\" = { from = 0.2, to = 0.4 }";
    let (nothing, is_there) = said_of("", inert);
    assert!(nothing.contains("no run has findings: no sensitivities; observe something") && !is_there, "{nothing}");
    let (same, is_there) = said_of("[set]\n\"heap\" = { shape = \"cone\" }\n", inert);
    assert!(same.contains("no sensitivities: no finding changes with a key") && !is_there, "{same}");
    // Negative control: the time that a run reaches is a finding too.
    let (told, is_there) = said_of("", "\"run.until\" = { from = \"2 ms\", to = \"8 ms\" }");
    assert!(told.contains("elementary effects of the keys in") && !told.contains("no sensitivities"), "{told}");
    assert!(is_there);
}

fn calibrate(folder: &Path) -> Output {
    command(folder, &["calibrate", "plan.toml"]).output().expect("it starts")
}

/// The simulated time that a run reached is the end that its case sets: the answer is known.
const CALIBRATION: &str = "case = \"a.toml\"\nside_by_side = 2\n[keys]\n\"run.until\" = { from = \"0.5 ms\", to = \"8.5 ms\" }\n\
                           [targets]\n\"time_s\" = { value = 4e-3, tolerance = 5e-5 }\n";

#[test]
fn a_calibration_finds_the_value_whose_answer_is_known() {
    let folder = folder(CALIBRATION);
    std::fs::write(folder.path().join("a.toml"), CASE.replace("steps = 40\n", "")).unwrap();
    let refused = sweep(folder.path(), &[]);
    assert!(refused.status.code() == Some(2) && said(&refused).contains("has targets"), "{}", said(&refused));
    let output = calibrate(folder.path());
    assert_eq!(output.status.code(), Some(0), "{}", said(&output));
    let text = String::from_utf8_lossy(&output.stdout).into_owned();
    let value: f64 = text
        .strip_prefix("run.until = ")
        .and_then(|rest| rest.split_once(" ms (standard uncertainty 0.05, nothing of the scatter between seeds in it)"))
        .and_then(|(value, _)| value.parse().ok())
        .unwrap_or_else(|| panic!("{text}"));
    assert!((value - 4.0).abs() <= 0.05 && text.contains("the targets are met after "), "{text}");
    // The same command finds the same without another run.
    let again = calibrate(folder.path());
    assert_eq!(String::from_utf8_lossy(&again.stdout), text);
    assert!(!said(&again).contains("begins"), "{}", said(&again));
}

#[test]
fn targets_out_of_reach_and_unknown_are_told() {
    // Beyond the range: control that a verdict is not always good.
    let far = CALIBRATION.replace("value = 4e-3", "value = 20e-3").replace("case =", "most_runs = 5\ncase =");
    let folder = folder(&far);
    std::fs::write(folder.path().join("a.toml"), CASE.replace("steps = 40\n", "")).unwrap();
    let output = calibrate(folder.path());
    assert_eq!(output.status.code(), Some(1), "{}", said(&output));
    assert!(said(&output).contains("the targets are not met after 5 runs"), "{}", said(&output));
    std::fs::write(folder.path().join("plan.toml"), CALIBRATION.replace("\"time_s\"", "\"time_m\"")).unwrap();
    std::fs::remove_dir_all(folder.path().join("runs")).unwrap();
    // By the first run, before any other, and without another one when it is asked again.
    let runs = || {
        let begun = std::fs::read_dir(folder.path().join("runs/plan")).unwrap().flatten();
        begun.filter(|entry| entry.path().join("summary.json").exists()).count()
    };
    for command in ["first", "second"] {
        let output = calibrate(folder.path());
        assert_eq!(output.status.code(), Some(2), "{}", said(&output));
        assert!(said(&output).contains("no finding `time_m`") && said(&output).contains("did you mean `time_s`?"));
        assert_eq!(runs(), 1, "{command}: {}", said(&output));
    }
    // Negative control: with a target that it finds the others are made beside this run.
    std::fs::write(folder.path().join("plan.toml"), CALIBRATION).unwrap();
    let output = calibrate(folder.path());
    assert!(output.status.code() == Some(0) && runs() > 1, "{}", said(&output));
}

#[test]
fn a_calibration_over_other_keys_is_refused() {
    let folder = folder(CALIBRATION);
    std::fs::create_dir_all(folder.path().join("runs/plan")).unwrap();
    std::fs::write(folder.path().join("runs/plan/calibration.json"), "[[0.5, 0.25], [0.5, 0.75]]").unwrap();
    let output = calibrate(folder.path());
    assert_eq!(output.status.code(), Some(2), "{}", said(&output));
    assert!(said(&output).contains("holds a search over 2 keys, and this plan has 1"), "{}", said(&output));
}
