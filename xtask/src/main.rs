//! Project chores: `cargo xtask test`, `tidy`, `generate`, `results`, `verify`, `assets`, `book`, `bench`.

mod assets;
mod book;
mod generated;
mod links;
mod mpi;
mod python;
mod result_charts;
mod results;
mod test;
mod tidy;

use std::path::{Path, PathBuf};
use std::process::{Command, ExitCode, Stdio};

const HELP: &str = "\
cargo xtask test [--locked] [ARGS...]   formatting, tidy, lints, then all tests; ARGS go to `cargo test`
cargo xtask test --mpi [openmpi|mpich]  the tests that run under `mpirun`, with each MPI that is installed, or with that one
cargo xtask test --python [ARGS...]     the Python package, installed by pip (needs Python and a network); ARGS go to pytest
cargo xtask tidy                        who may depend on whom, what the sources may name, whether generated files are fresh
cargo xtask generate                    schema, reference pages, pages of verification/ and docs/results, docs/SUMMARY.md
cargo xtask results [--keep] [RUN...]   makes runs behind the tables of results anew and compares, or lists them; --keep takes what they give, `generate` next
cargo xtask verify [ARGS...]            `sazanami verify`: cases with known results; with `--out verification`, `generate` next
cargo xtask assets                      libraries that reports embed, by npm (needs a network); to change their versions
cargo xtask book                        the book, by mdBook (`cargo install mdbook`)
cargo xtask bench [ARGS...]             `sazanami bench`: kernels and whole steps

Everything is built with the release profile, so that all commands share what is built.";

fn main() -> ExitCode {
    let mut arguments = std::env::args().skip(1);
    let command = arguments.next().unwrap_or_default();
    let rest: Vec<String> = arguments.collect();
    let code = match command.as_str() {
        "test" if rest.iter().any(|argument| argument == "--mpi") => mpi::run(&rest),
        "test" if rest.iter().any(|argument| argument == "--python") => python::run(&rest),
        "test" => test::run(&rest),
        "assets" => assets::run(),
        "book" => book::run(),
        "book-links" => book::preprocess(&rest),
        "results" => results::run(&rest),
        "tidy" => tidy::run(rest.iter().any(|argument| argument == "--locked")),
        "generate" => generated::write(&root()),
        "verify" | "bench" => forward(&command, &rest),
        "" | "help" | "--help" | "-h" => {
            println!("{HELP}");
            0
        }
        unknown => {
            eprintln!("there is no chore `{unknown}`\n\n{HELP}");
            2
        }
    };
    ExitCode::from(code)
}

/// Runs a command of the `sazanami` binary.
fn forward(command: &str, arguments: &[String]) -> u8 {
    let mut cargo = cargo();
    cargo.args(["run", "--release", "--quiet", "--package", "sazanami-cli", "--", command]).args(arguments);
    exit_code(&mut cargo)
}

/// Root of the workspace.
fn root() -> PathBuf {
    let here = Path::new(env!("CARGO_MANIFEST_DIR"));
    here.parent().unwrap_or(here).to_path_buf()
}

/// The cargo that runs this chore, in the root of the workspace.
fn cargo() -> Command {
    let mut cargo = Command::new(std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into()));
    cargo.current_dir(root());
    cargo
}

/// Whether a command can be started and succeeds; what it prints is not shown.
fn succeeds(command: &mut Command) -> bool {
    let command = command.stdout(Stdio::null()).stderr(Stdio::null());
    command.status().is_ok_and(|status| status.success())
}

/// Runs a command to its end and returns its exit code: 127 if it cannot be started, 130 if a signal ended it.
fn exit_code(command: &mut Command) -> u8 {
    match command.status() {
        Ok(status) => status.code().map_or(130, |code| u8::try_from(code).unwrap_or(1)),
        Err(error) => {
            eprintln!("cannot start {command:?}: {error}");
            127
        }
    }
}
