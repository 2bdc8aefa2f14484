//! The tests of the Python package, on the wheel that `pip install` makes of it.

use std::path::{Path, PathBuf};
use std::process::Command;

use crate::{cargo, exit_code, root, succeeds};

const NO_PYTHON: &str = "\
error: there is no Python of version 3.9 or newer
  help: on Debian `apt-get install python3 python3-venv`; or name one: `PYTHON=/path/to/python3 cargo xtask test --python`";

const NO_VENV: &str = "\
error: a virtual environment for the tests could not be made
  help: on Debian `apt-get install python3-venv`";

const NO_PACKAGES: &str = "\
error: the package could not be built and installed
  help: pip fetches maturin, NumPy and pytest from PyPI: is there a network? The error of the build stands above";

/// Checks formatting and lints of the extension, installs the package into a virtual environment of its own under `target`
/// and runs its tests; `rest` goes to pytest. Returns the exit code.
pub fn run(rest: &[String]) -> u8 {
    let place = root().join("python");
    let Some(python) = python() else {
        eprintln!("{NO_PYTHON}");
        return 2;
    };
    for (stage, arguments) in [
        ("fmt", &["fmt", "--", "--check"][..]),
        ("clippy", &["clippy", "--release", "--quiet", "--locked", "--", "-D", "warnings"]),
    ] {
        println!("-- {stage} of the extension");
        let code = exit_code(of_python(cargo().args(arguments).current_dir(&place)));
        if code != 0 {
            return code;
        }
    }
    let target = root().join("target/python");
    let venv = target.join("venv");
    println!("-- Python package, installed into {}", venv.display());
    if exit_code(Command::new(python).args(["-m", "venv"]).arg(&venv)) != 0 {
        eprintln!("{NO_VENV}");
        return 2;
    }
    let mut pip = Command::new(program(&venv, "python"));
    pip.args(["-m", "pip", "install", "--quiet", "--disable-pip-version-check", "--force-reinstall", "--no-deps"]);
    let mut needed = Command::new(program(&venv, "python"));
    needed.args(["-m", "pip", "install", "--quiet", "--disable-pip-version-check", "./python[test]"]);
    for command in [&mut needed, pip.arg("./python")] {
        if exit_code(of_python(command.current_dir(root()))) != 0 {
            eprintln!("{NO_PACKAGES}");
            return 2;
        }
    }
    let own: Vec<&String> =
        rest.iter().filter(|argument| !["--python", "--locked"].contains(&argument.as_str())).collect();
    println!("-- types");
    let mut mypy = Command::new(program(&venv, "mypy"));
    mypy.arg("--config-file").arg(place.join("pyproject.toml")).args(["--package", "sazanami"]);
    let types = exit_code(mypy.current_dir(&target));
    println!("-- tests in Python");
    let tests = exit_code(Command::new(program(&venv, "pytest")).args(own).current_dir(&place));
    types.max(tests)
}

/// Builds of the extension have a folder of their own: nothing that builds with Rust alone is built again for them.
fn of_python(command: &mut Command) -> &mut Command {
    command.env("CARGO_TARGET_DIR", root().join("target/python"))
}

/// A Python that is new enough.
fn python() -> Option<String> {
    let named = std::env::var("PYTHON").ok();
    let candidates = named.map_or_else(|| vec!["python3".to_owned(), "python".to_owned()], |name| vec![name]);
    let is_new = ["-c", "import sys; sys.exit(sys.version_info < (3, 9))"];
    candidates.into_iter().find(|name| succeeds(Command::new(name).args(is_new)))
}

/// A program of a virtual environment.
fn program(venv: &Path, name: &str) -> PathBuf {
    if cfg!(windows) { venv.join("Scripts").join(name) } else { venv.join("bin").join(name) }
}
