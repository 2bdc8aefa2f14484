//! The commands as people use them: exit codes, and what is left untouched.

use std::path::Path;
use std::process::{Command, Output};

fn sazanami(folder: &Path, arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_sazanami"))
        .args(arguments)
        .current_dir(folder)
        .output()
        .expect("the command can be started")
}

fn code(output: &Output) -> Option<i32> {
    output.status.code()
}

fn errors(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

#[test]
fn templates_are_written_checked_and_not_overwritten() {
    let folder = tempfile::tempdir().unwrap();
    let listed = sazanami(folder.path(), &["new"]);
    let listed = String::from_utf8_lossy(&listed.stdout).into_owned();
    for template in ["raindrop", "settling_sphere", "dam_break", "packing"] {
        assert!(listed.contains(template), "{listed}");
        assert_eq!(code(&sazanami(folder.path(), &["new", template, "made"])), Some(0), "{template}");
        let case = format!("made/{template}.toml");
        let checked = sazanami(folder.path(), &["check", &case]);
        assert_eq!(code(&checked), Some(0), "{template}: {}", errors(&checked));
    }
    let again = sazanami(folder.path(), &["new", "raindrop", "made"]);
    assert_eq!(code(&again), Some(2));
    assert!(errors(&again).contains("exists already"));
    let unknown = sazanami(folder.path(), &["new", "raindop", "other"]);
    assert_eq!(code(&unknown), Some(2));
    assert!(errors(&unknown).contains("did you mean `raindrop`?"));
    assert!(!folder.path().join("other").exists());
}

#[test]
fn the_schema_is_json() {
    let output = sazanami(Path::new("."), &["new", "--schema"]);
    let schema: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
    assert!(schema["properties"]["domain"].is_object());
}

#[test]
fn results_that_cannot_be_written_are_refused_before_anything_is_touched() {
    let folder = tempfile::tempdir().unwrap();
    sazanami(folder.path(), &["new", "raindrop", "."]);
    let filled = folder.path().join("filled");
    std::fs::create_dir(&filled).unwrap();
    std::fs::write(filled.join("series.csv"), "precious").unwrap();
    let refused = sazanami(folder.path(), &["run", "raindrop.toml", "--out", "filled"]);
    assert_eq!(code(&refused), Some(2), "{}", errors(&refused));
    assert!(errors(&refused).contains("is not empty"));
    assert_eq!(std::fs::read_dir(&filled).unwrap().count(), 1);
    let inside_a_file = sazanami(folder.path(), &["run", "raindrop.toml", "--out", "filled/series.csv/out"]);
    assert_eq!(code(&inside_a_file), Some(2), "{}", errors(&inside_a_file));
    assert_eq!(std::fs::read_to_string(filled.join("series.csv")).unwrap(), "precious");
}

#[test]
fn a_box_too_large_for_memory_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    sazanami(folder.path(), &["new", "raindrop", "."]);
    for command in ["check", "run"] {
        let arguments = [command, "raindrop.toml", "--set", "domain.cells=[200000, 200000, 200000]"];
        let output = sazanami(folder.path(), &arguments);
        assert_eq!(code(&output), Some(2));
        assert!(errors(&output).contains("too large for the memory of this machine"), "{}", errors(&output));
    }
    assert!(!folder.path().join("runs").exists());
}

#[test]
fn the_command_line_is_checked() {
    let folder = tempfile::tempdir().unwrap();
    sazanami(folder.path(), &["new", "raindrop", "."]);
    for arguments in [
        &["run", "raindrop.toml", "--until", "0.02"][..],
        &["run", "raindrop.toml", "--until", "2 mm"],
        &["run", "raindrop.toml", "--until", "1 s", "--steps", "3"],
        &["run", "raindrop.toml", "--threads", "0"],
        &["run", "no_such.toml"],
        &["run", "."],
        &["resume", "no_such_folder"],
        &["analyse", "no_such_folder"],
        &["report", "no_such_folder"],
        &["report", "raindrop.toml"],
        &["report", "."],
        &["report"],
        &["verify", "no_such_case"],
        &["bench", "no_such_bench"],
        &["bench", "scaling", "machine_triad"],
        &["bench", "scaling", "--threads", "2"],
        &["new", "raindrop"],
        &["dance"],
        &[],
    ] {
        let output = sazanami(folder.path(), arguments);
        assert_eq!(code(&output), Some(2), "{arguments:?}: {}", errors(&output));
        assert!(!errors(&output).contains("panicked"), "{arguments:?}");
    }
}

#[test]
fn check_speaks_json() {
    let folder = tempfile::tempdir().unwrap();
    sazanami(folder.path(), &["new", "raindrop", "."]);
    let good = sazanami(folder.path(), &["check", "raindrop.toml", "--json"]);
    let value: serde_json::Value = serde_json::from_slice(&good.stdout).unwrap();
    assert_eq!(value["ok"], true);
    assert_eq!(value["report"]["cells"], serde_json::json!([60, 60, 34]));
    assert_eq!(value["report"]["limits"].as_array().unwrap().iter().filter(|limit| limit["rules"] == true).count(), 1);
    assert!(value["report"]["memory_bytes"].as_f64().unwrap() > 1e6);
    let bad = sazanami(folder.path(), &["check", "raindrop.toml", "--json", "--set", "fluid.clf=0.3"]);
    assert_eq!(code(&bad), Some(2));
    let value: serde_json::Value = serde_json::from_slice(&bad.stdout).unwrap();
    assert_eq!(value["ok"], false);
    assert_eq!(value["findings"][0]["file"], "--set");
    assert_eq!(value["findings"][0]["expected"], "did you mean `cfl`?");
}

/// Two glass beads under a falling drop, for longer than anyone waits.
const LONG: &str = include_str!("../long.toml");

#[test]
fn a_signal_ends_a_run_with_a_checkpoint_to_go_on_from() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("long.toml"), LONG).unwrap();
    let mut run = Command::new(env!("CARGO_BIN_EXE_sazanami"))
        .args(["run", "long.toml", "--out", "out"])
        .current_dir(folder.path())
        .stdout(std::process::Stdio::null())
        .stderr(std::process::Stdio::null())
        .spawn()
        .unwrap();
    let series = folder.path().join("out/series.csv");
    for _ in 0..600 {
        std::thread::sleep(std::time::Duration::from_millis(100));
        if std::fs::read_to_string(&series).is_ok_and(|text| text.lines().count() > 2) {
            break;
        }
    }
    assert!(run.try_wait().unwrap().is_none(), "the run ended before it was stopped");
    // As `timeout` and process groups do it: the same signal twice at once.
    for _ in 0..2 {
        Command::new("kill").args(["-TERM", &run.id().to_string()]).status().unwrap();
    }
    assert_eq!(run.wait().unwrap().code(), Some(130));
    let summary = || -> serde_json::Value {
        serde_json::from_str(&std::fs::read_to_string(folder.path().join("out/summary.json")).unwrap()).unwrap()
    };
    assert_eq!(summary()["status"], "stopped");
    let steps = summary()["steps"].as_u64().unwrap();
    assert!(std::fs::read_dir(folder.path().join("out/checkpoints")).unwrap().count() > 0);
    let resumed = sazanami(folder.path(), &["resume", "out", "--steps", "2"]);
    assert_eq!(code(&resumed), Some(0), "{}", errors(&resumed));
    assert_eq!(summary()["steps"].as_u64(), Some(steps + 2));
}

/// What bash offers for the last of `words`.
fn completed(words: &[&str]) -> String {
    let script = format!(
        "source <(\"$0\" completions bash); COMP_WORDS=({}); COMP_CWORD={}; _sazanami sazanami '{}' '{}'; echo \"${{COMPREPLY[@]}}\"",
        words.iter().map(|word| format!("'{word}'")).collect::<Vec<_>>().join(" "),
        words.len() - 1,
        words[words.len() - 1],
        words[words.len() - 2],
    );
    let output = Command::new("bash").args(["-c", &script, env!("CARGO_BIN_EXE_sazanami")]).output();
    let output = output.expect("bash can be started");
    assert!(output.status.success(), "{}", errors(&output));
    String::from_utf8_lossy(&output.stdout).trim().to_owned()
}

#[test]
fn shells_complete_templates_keys_and_cases() {
    assert_eq!(completed(&["sazanami", "new", "rain"]), "raindrop");
    assert_eq!(completed(&["sazanami", "explain", "fluid.tol"]), "fluid.tol_div");
    assert_eq!(completed(&["sazanami", "run", "case.toml", "--set", "fluid.tol"]), "fluid.tol_div=");
    assert_eq!(completed(&["sazanami", "check", "case.toml", "--set", "grains.0.cou"]), "grains.0.count=");
    assert_eq!(completed(&["sazanami", "verify", "layers-at"]), "layers-at-rest");
    assert_eq!(completed(&["sazanami", "new", "zzz"]), "");
    for shell in ["zsh", "fish"] {
        let output = sazanami(Path::new("."), &["completions", shell]);
        let text = String::from_utf8_lossy(&output.stdout).into_owned();
        assert!(text.contains("raindrop") && text.contains("fluid.tol_div"), "{shell}");
    }
}

#[test]
fn manual_pages_are_printed_and_written() {
    let printed = sazanami(Path::new("."), &["man"]);
    let page = String::from_utf8_lossy(&printed.stdout).into_owned();
    assert!(page.contains(".TH sazanami 1") && page.contains("resume") && page.contains("Exit codes"), "{page}");
    let folder = tempfile::tempdir().unwrap();
    assert_eq!(code(&sazanami(folder.path(), &["man", "--out", "man1"])), Some(0));
    for name in ["sazanami.1", "sazanami-run.1", "sazanami-check.1"] {
        let text = std::fs::read_to_string(folder.path().join("man1").join(name)).unwrap();
        assert!(text.contains(".SH"), "{name}");
    }
    std::fs::write(folder.path().join("file"), "").unwrap();
    assert_eq!(code(&sazanami(folder.path(), &["man", "--out", "file/man1"])), Some(2));
}

#[test]
fn a_command_that_there_is_not_gets_the_one_that_was_meant() {
    let said = |arguments: &[&str]| {
        let output = sazanami(Path::new("."), arguments);
        assert_eq!(code(&output), Some(2), "{arguments:?}");
        errors(&output)
    };
    for (arguments, meant) in [
        (&["chek", "case.toml"][..], "'check'"),
        (&["rn"], "'run'"),
        (&["analyze"], "'analyse'"),
        (&["plot"], "'report'"),
        (&["restart"], "'resume'"),
        (&["help", "chek"], "'check'"),
        (&["drop.toml"], "`sazanami run drop.toml`"),
    ] {
        let text = said(arguments);
        assert!(text.contains("tip: ") && text.contains(meant), "{arguments:?}: {text}");
    }
    assert!(!said(&["dance"]).contains("tip: "));
}
