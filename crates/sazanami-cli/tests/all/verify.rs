//! `sazanami verify` as a machine sees it: its exit code.

use std::path::Path;
use std::process::{Command, Output};
use std::time::{Duration, Instant};

fn verify(arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_sazanami")).arg("verify").args(arguments).output().expect("the program starts")
}

/// `expected.toml` of a case with a change, in a folder of its own.
fn doctored(case: &str, from: &str, to: &str) -> tempfile::TempDir {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("../../verification/{case}/expected.toml"));
    let text = std::fs::read_to_string(path).expect("the case is there");
    assert!(text.contains(from), "{from}");
    let folder = tempfile::tempdir().expect("a folder");
    std::fs::create_dir(folder.path().join(case)).expect("a folder");
    std::fs::write(folder.path().join(case).join("expected.toml"), text.replacen(from, to, 1)).expect("a file");
    folder
}

fn code_with(from: &str, to: &str) -> (Option<i32>, String) {
    code_of("restitution", from, to)
}

fn code_of(case: &str, from: &str, to: &str) -> (Option<i32>, String) {
    let folder = doctored(case, from, to);
    let output = verify(&[case, "--expected", folder.path().to_str().expect("a path of plain text")]);
    (
        output.status.code(),
        String::from_utf8_lossy(&output.stdout).into_owned() + &String::from_utf8_lossy(&output.stderr),
    )
}

#[test]
fn what_is_as_recorded_ends_with_zero() {
    assert_eq!(verify(&["restitution"]).status.code(), Some(0));
}

/// Negative controls: a band that is missed, a quantity that nobody measures, one that nobody expects; files that cannot
/// judge are wrong input.
#[test]
fn what_is_worse_than_recorded_ends_with_one() {
    let (code, text) = code_with("band = [0.499, 0.501]", "band = [0.51, 0.52]");
    assert!(code == Some(1) && text.contains("MISS"), "{code:?}: {text}");
    // What programs measure; of a case file the same is wrong input.
    let (code, text) = code_of("mps-void-fraction", "interior of a lattice", "inside of a lattice");
    assert!(code == Some(1) && text.contains("NOT MEASURED") && text.contains("NOT EXPECTED"), "{code:?}: {text}");
    let miss = "band = [0.6, 0.7]\nknown_miss = { band = [0.55, 0.6], reason = \"doctored\" }";
    let (code, text) = code_with("band = [0.499, 0.501]", miss);
    assert!(code == Some(1) && text.contains("REGRESSION"), "{code:?}: {text}");
    let miss = "band = [0.6, 0.7]\nknown_miss = { band = [0.499, 0.6], reason = \"doctored\" }";
    let (code, text) = code_with("band = [0.499, 0.501]", miss);
    assert!(code == Some(0) && text.contains("known miss"), "{code:?}: {text}");
    let (code, text) = code_with("band = [0.499, 0.501]", "");
    assert!(code == Some(2) && text.contains("neither a band nor informational"), "{code:?}: {text}");
}

#[test]
fn pages_are_written_where_they_are_asked_for() {
    let folder = tempfile::tempdir().expect("a folder");
    let out = folder.path().to_str().expect("a path of plain text");
    assert_eq!(verify(&["restitution", "oblique-impact", "--out", out]).status.code(), Some(0));
    for file in ["restitution/measured.json", "restitution/figure.svg", "oblique-impact/README.md"] {
        assert!(folder.path().join(file).is_file(), "{file}");
    }
}

fn text(output: &Output) -> String {
    String::from_utf8_lossy(&output.stdout).into_owned() + &String::from_utf8_lossy(&output.stderr)
}

#[test]
fn a_place_that_takes_no_pages_is_refused_before_and_told_with_the_table_after() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = |name: &str| folder.path().join(name).to_str().expect("a path of plain text").to_owned();
    std::fs::write(path("file"), "").expect("a file");
    let refused = verify(&["restitution", "--out", &path("file")]);
    let told = text(&refused);
    assert!(refused.status.code() == Some(2) && told.contains("nothing can be written to"), "{told}");
    assert!(!told.contains("quantities"), "{told}");
    // What shows only after the run: the folder of a case is a file. The other case is written.
    std::fs::create_dir(path("out")).expect("a folder");
    std::fs::write(path("out/restitution"), "").expect("a file");
    let partly = verify(&["restitution", "bouncing", "--out", &path("out")]);
    let told = text(&partly);
    assert!(partly.status.code() == Some(1) && told.contains("out/restitution: "), "{told}");
    assert!(String::from_utf8_lossy(&partly.stdout).contains(" quantities: "), "{told}");
    assert!(Path::new(&path("out/bouncing/measured.json")).is_file());
}

#[test]
fn a_choice_of_nothing_and_a_folder_of_other_cases_are_wrong_input() {
    let folder = doctored("restitution", "band = [0.499, 0.501]", "band = [0.51, 0.52]");
    let held = folder.path().to_str().expect("a path of plain text");
    let absent = format!("{held}/absent");
    for (arguments, cause) in [
        (&["falling-drop", "--subset"][..], "`falling-drop` is not among"),
        (&["restitution", "--expected", &absent], "there is no folder"),
        (&["bouncing", "--expected", held], "holds none of the chosen cases"),
        (&["--list", "--expected", &absent], "there is no folder"),
    ] {
        let refused = verify(arguments);
        let told = text(&refused);
        assert!(refused.status.code() == Some(2) && told.contains(cause), "{arguments:?}: {told}");
    }
    // The controls: a case of the subset, and one that the folder holds, are judged.
    assert_eq!(verify(&["restitution", "--subset"]).status.code(), Some(0));
    assert_eq!(verify(&["restitution", "bouncing", "--expected", held]).status.code(), Some(1));
}

/// A signal ends the run of a case; what was judged before is told, and no folder is left.
#[cfg(unix)]
#[test]
fn an_interrupted_command_tells_what_was_judged_and_leaves_nothing() {
    let place = tempfile::tempdir().expect("a folder");
    let names = || {
        let found = std::fs::read_dir(place.path()).expect("the folder is there").flatten();
        found.map(|entry| entry.file_name().to_string_lossy().into_owned()).collect::<Vec<_>>()
    };
    let mut command = Command::new("env");
    command.args(["--default-signal=TERM", env!("CARGO_BIN_EXE_sazanami"), "verify"]);
    command.args(["restitution", "falling-drop", "--jobs", "2"]).env("TMPDIR", place.path());
    let child = command.stdout(std::process::Stdio::piped()).stderr(std::process::Stdio::piped()).spawn();
    let child = child.expect("the program starts");
    let began = Instant::now();
    // The drop falls, and the other case has gone.
    let is_so = |names: &[String]| names.len() == 1 && names[0].starts_with("sazanami-falling-drop-");
    let mut since = None;
    while since.is_none_or(|since: Instant| since.elapsed() < Duration::from_secs(1)) {
        assert!(began.elapsed() < Duration::from_secs(100), "{:?}", names());
        since = if is_so(&names()) { since.or_else(|| Some(Instant::now())) } else { None };
        std::thread::sleep(Duration::from_millis(20));
    }
    let sent = Command::new("kill").args(["-TERM", &child.id().to_string()]).status();
    assert!(sent.is_ok_and(|status| status.success()));
    let output = child.wait_with_output().expect("it ends");
    let told = text(&output);
    assert_eq!(output.status.code(), Some(130), "{told}");
    assert!(told.contains("1 of 2 cases had been judged") && !told.contains("FAILED"), "{told}");
    assert!(String::from_utf8_lossy(&output.stdout).contains("\nrestitution "), "{told}");
    assert_eq!(names(), Vec::<String>::new());
}
