//! Everything that must hold before a change is done.

use std::io::{BufRead, BufReader};
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

use crate::{cargo, exit_code, succeeds, tidy};

/// Outcome of a stage.
enum Outcome {
    Ran(u8),
    NotInstalled,
}

/// Runs all stages, says how each ended, and returns the largest exit code.
pub fn run(arguments: &[String]) -> u8 {
    let locked = arguments.iter().any(|argument| argument == "--locked");
    let mut closing = Vec::new();
    let warnings = ["clippy", "--release", "--workspace", "--all-targets", "--quiet", "--", "-D", "warnings"];
    let stages = [
        ("fmt", timed(|| component("fmt", &["fmt", "--all", "--", "--check"], locked))),
        ("tidy", timed(|| Outcome::Ran(tidy::run(locked)))),
        ("clippy", timed(|| component("clippy", &warnings, locked))),
        ("doc", timed(|| Outcome::Ran(documentation(locked)))),
        ("tests", timed(|| Outcome::Ran(tests(arguments, &mut closing)))),
    ];
    println!();
    closing.iter().for_each(|line| println!("{line}"));
    println!("{}", total(&closing));
    let mut worst = 0;
    for (name, (outcome, time)) in stages {
        let seconds = time.as_secs();
        match outcome {
            Outcome::Ran(0) => println!("{name}: ok, {seconds} s"),
            Outcome::Ran(code) => println!("{name}: FAILED (exit code {code}), {seconds} s"),
            Outcome::NotInstalled => println!("{name}: skipped, the component is not installed"),
        }
        if let Outcome::Ran(code) = outcome {
            worst = worst.max(code);
        }
    }
    worst
}

/// The outcome of a stage and how long it took.
fn timed(stage: impl FnOnce() -> Outcome) -> (Outcome, Duration) {
    let begin = Instant::now();
    (stage(), begin.elapsed())
}

/// Runs a cargo component where it is installed.
fn component(name: &str, arguments: &[&str], locked: bool) -> Outcome {
    if !succeeds(cargo().args([name, "--version"])) {
        return Outcome::NotInstalled;
    }
    println!("-- {name}");
    let mut command = cargo();
    let lock = (locked && name != "fmt").then_some("--locked");
    command.args(&arguments[..1]).args(lock).args(&arguments[1..]);
    Outcome::Ran(exit_code(&mut command))
}

/// Builds the documentation of all crates; a warning is an error.
fn documentation(locked: bool) -> u8 {
    println!("-- doc");
    let mut command = cargo();
    command.env("RUSTDOCFLAGS", "-D warnings").args(["doc", "--release", "--workspace", "--no-deps", "--quiet"]);
    exit_code(command.args(locked.then_some("--locked")))
}

/// Runs all tests, passing on what they print, and collects the runner's result lines.
fn tests(arguments: &[String], closing: &mut Vec<String>) -> u8 {
    println!("-- tests");
    let mut command = cargo();
    command.args(["test", "--release", "--workspace", "--no-fail-fast"]).args(arguments);
    counted(&mut command, closing)
}

/// Runs a command that runs tests, passing on what it prints, and collects the runner's result lines.
pub fn counted(command: &mut Command, closing: &mut Vec<String>) -> u8 {
    match pass_on(command.stdout(Stdio::piped()), |line| {
        if line.starts_with("test result:") {
            closing.push(line.to_string());
        }
    }) {
        Ok(code) => code,
        Err(error) => {
            eprintln!("the tests cannot be run: {error}");
            127
        }
    }
}

/// Runs a command, prints its lines and shows them to `look`.
fn pass_on(command: &mut Command, mut look: impl FnMut(&str)) -> std::io::Result<u8> {
    let mut child = command.spawn()?;
    if let Some(output) = child.stdout.take() {
        for line in BufReader::new(output).split(b'\n') {
            let line = String::from_utf8_lossy(&line?).into_owned();
            println!("{line}");
            look(&line);
        }
    }
    Ok(child.wait()?.code().map_or(130, |code| u8::try_from(code).unwrap_or(1)))
}

/// Adds up result lines of the test runner.
fn total(closing: &[String]) -> String {
    let count = |what: &str| -> u64 {
        let of_line = |line: &String| -> u64 {
            line.split(['.', ';']).filter_map(|part| part.trim().strip_suffix(what)?.trim().parse::<u64>().ok()).sum()
        };
        closing.iter().map(of_line).sum()
    };
    format!(
        "all test runners together: {} passed; {} failed; {} ignored",
        count("passed"),
        count("failed"),
        count("ignored")
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn result_lines_add_up() {
        let lines = [
            "test result: ok. 44 passed; 0 failed; 1 ignored; 0 measured; 3 filtered out; finished in 0.75s",
            "test result: FAILED. 6 passed; 2 failed; 0 ignored; 0 measured; 0 filtered out; finished in 1.00s",
        ];
        let sum = total(&lines.map(String::from));
        assert_eq!(sum, "all test runners together: 50 passed; 2 failed; 1 ignored");
    }

    #[test]
    fn lines_are_passed_on_with_the_exit_code() {
        let mut seen = Vec::new();
        let mut shell = Command::new("sh");
        shell.args(["-c", "echo one; echo two; exit 3"]).stdout(Stdio::piped());
        assert_eq!(pass_on(&mut shell, |line| seen.push(line.to_string())).unwrap(), 3);
        assert_eq!(seen, ["one", "two"]);
    }
}
