//! The tests that run under `mpirun`, with each MPI that is installed.

use std::process::Command;

use crate::{cargo, succeeds, test};

/// An MPI: its name, the wrapper of its compiler, its launcher with options.
struct Mpi {
    name: &'static str,
    compiler: &'static str,
    launcher: &'static str,
}

/// Debian's names where both are installed.
const KNOWN: [Mpi; 2] = [
    // Each rank on any processor: bound to one, the threads of a rank would share it.
    Mpi { name: "openmpi", compiler: "mpicc.openmpi", launcher: "mpirun.openmpi --bind-to none" },
    Mpi { name: "mpich", compiler: "mpicc.mpich", launcher: "mpirun.mpich" },
];
/// The names of any one that is installed alone.
const PLAIN: Mpi = Mpi { name: "", compiler: "mpicc", launcher: "mpirun" };

const MISSING: &str = "\
error: no MPI is installed, or not its compiler wrapper
  help: on Debian `apt-get install openmpi-bin libopenmpi-dev`, or `apt-get install mpich libmpich-dev`, and a C compiler";

impl Mpi {
    fn is_installed(&self) -> bool {
        let launcher = self.launcher.split_whitespace().next().unwrap_or_default();
        [self.compiler, launcher].into_iter().all(|program| succeeds(Command::new(program).arg("--version")))
    }
}

/// Runs the tests with the MPI of a name, or with all that are installed; returns the largest exit code.
pub fn run(arguments: &[String]) -> u8 {
    let locked = arguments.iter().any(|argument| argument == "--locked");
    let named: Vec<&String> = arguments.iter().filter(|argument| !argument.starts_with('-')).collect();
    if let Some(unknown) = named.iter().find(|name| KNOWN.iter().all(|mpi| mpi.name != ***name)) {
        eprintln!("error: there is no MPI `{unknown}`\n  help: known: openmpi, mpich");
        return 2;
    }
    let wanted = |mpi: &&Mpi| named.is_empty() || named.iter().any(|name| *name == mpi.name);
    let mut found: Vec<&Mpi> = KNOWN.iter().filter(wanted).filter(|mpi| mpi.is_installed()).collect();
    if found.is_empty() && named.is_empty() && PLAIN.is_installed() {
        found.push(&PLAIN);
    }
    if found.is_empty() {
        eprintln!("{MISSING}");
        return 2;
    }
    let mut closing = Vec::new();
    let codes: Vec<u8> = found.into_iter().map(|mpi| with(mpi, locked, &mut closing)).collect();
    println!();
    closing.iter().for_each(|line| println!("{line}"));
    codes.into_iter().max().unwrap_or_default()
}

fn with(mpi: &Mpi, locked: bool, closing: &mut Vec<String>) -> u8 {
    println!("-- tests under {}", mpi.launcher);
    let mut command = cargo();
    command.args(["test", "--release", "--no-fail-fast", "--features", "mpi", "--test", "mpi"]);
    command.args(["--package", "sazanami-mpi", "--package", "sazanami-cli"]);
    command.args(locked.then_some("--locked")).args(["--", "--test-threads=1"]);
    command.env("MPICC", mpi.compiler).env("SAZANAMI_MPIRUN", mpi.launcher);
    test::counted(&mut command, closing)
}
