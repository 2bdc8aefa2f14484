//! `sazanami verify` as a machine sees it: its exit code.

use std::path::Path;
use std::process::{Command, Output};

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
