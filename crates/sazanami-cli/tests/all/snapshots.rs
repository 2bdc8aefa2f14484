//! Help texts and the findings on wrong case files, compared with `expected/`.
//!
//! `SAZANAMI_BLESS=1 cargo test -p sazanami-cli` writes the expected texts anew.

use std::path::{Path, PathBuf};
use std::process::{Command, Output};

fn tests() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests")
}

fn sazanami(folder: &Path, arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_sazanami"))
        .args(arguments)
        .current_dir(folder)
        .env_remove("COLUMNS")
        .output()
        .expect("the command can be started")
}

/// Exit code, standard output and error output as one text that is the same on every machine.
fn transcript(folder: &Path, arguments: &[&str]) -> String {
    let output = sazanami(folder, arguments);
    let text = |bytes: &[u8]| {
        let text = String::from_utf8_lossy(bytes).replace(&folder.display().to_string(), "<here>");
        text.lines().map(str::trim_end).collect::<Vec<_>>().join("\n")
    };
    format!(
        "$ sazanami {}\n{}\n{}\n[exit {}]\n",
        arguments.join(" "),
        text(&output.stdout),
        text(&output.stderr),
        output.status.code().map_or_else(|| "by a signal".into(), |code| code.to_string())
    )
}

fn compare(name: &str, text: &str) -> Result<(), String> {
    let path = tests().join("expected").join(name);
    if std::env::var_os("SAZANAMI_BLESS").is_some() {
        std::fs::write(&path, text).expect("expected texts can be written");
        return Ok(());
    }
    let expected = std::fs::read_to_string(&path).unwrap_or_default();
    if expected == text {
        return Ok(());
    }
    Err(format!("{name} differs (SAZANAMI_BLESS=1 accepts it)\n--- expected\n{expected}\n--- found\n{text}"))
}

#[test]
fn help_is_as_expected() {
    let mut wrong = Vec::new();
    wrong.extend(compare("help.txt", &transcript(&tests(), &["--help"])).err());
    for command in [
        "new",
        "check",
        "explain",
        "run",
        "resume",
        "analyse",
        "bed",
        "report",
        "sweep",
        "calibrate",
        "verify",
        "bench",
        "doctor",
        "completions",
        "man",
    ] {
        let text = transcript(&tests(), &[command, "--help"]);
        assert!(text.contains("Example:\n  sazanami "), "no example for {command}:\n{text}");
        wrong.extend(compare(&format!("help_{command}.txt"), &text).err());
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

#[test]
fn wrong_cases_are_refused_with_place_and_suggestion() {
    let folder = tests().join("wrong");
    let mut files: Vec<PathBuf> = std::fs::read_dir(&folder)
        .expect("wrong cases are there")
        .map(|entry| entry.expect("a folder can be listed").path())
        .filter(|path| path.extension().is_some_and(|extension| extension == "toml"))
        .collect();
    files.sort();
    assert!(files.len() >= 15, "{} wrong cases", files.len());
    let mut wrong = Vec::new();
    for file in files {
        let name = file.file_name().expect("it has a name").to_string_lossy().into_owned();
        let text = transcript(&folder, &["check", &name]);
        assert!(text.contains("[exit 2]"), "{name} is not refused:\n{text}");
        assert!(text.contains(&format!("--> {name}:")), "{name}: no place is named:\n{text}");
        wrong.extend(compare(&format!("wrong_{}.txt", name.trim_end_matches(".toml")), &text).err());
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

#[test]
fn errors_in_overrides_point_to_the_override() {
    let folder = tests().join("../../../cases/raindrop");
    let text = transcript(
        &folder,
        &[
            "check",
            "quick.toml",
            "--set",
            "fluid.cfl=fast",
            "--set",
            "liquid.0.fall.speed=9 mm",
            "--set",
            "fluid.viscositys=auto",
        ],
    );
    compare("wrong_overrides.txt", &text).unwrap_or_else(|difference| panic!("{difference}"));
    assert!(text.contains("--set:1:"));
}
