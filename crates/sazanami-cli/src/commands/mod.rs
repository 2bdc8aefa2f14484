//! The commands, one file each.

mod analyse;
mod bed;
mod bench;
mod calibrate;
mod check;
mod completions;
mod doctor;
mod explain;
mod man;
mod new;
mod report;
mod resume;
pub mod run;
mod sweep;
mod verify;

use clap::Subcommand;
use sazanami::case::units::{Dimension, parse_quantity};
use sazanami::error::CommandError;
use sazanami_parallel::Processes;

/// Subcommands of the program.
#[derive(Debug, Subcommand)]
pub enum Command {
    New(new::New),
    Check(check::Check),
    Explain(explain::Explain),
    Run(run::Run),
    Resume(resume::Resume),
    Analyse(analyse::Analyse),
    Report(report::Report),
    Bed(bed::BedCommand),
    Sweep(sweep::Sweep),
    Calibrate(calibrate::Calibrate),
    Verify(verify::Verify),
    Bench(bench::Bench),
    Doctor(doctor::Doctor),
    Completions(completions::Completions),
    Man(man::Man),
}

impl Command {
    /// Whether the processes of a launcher would each do all of it if they knew nothing of one another.
    pub const fn is_shared(&self) -> bool {
        matches!(self, Self::Run(_) | Self::Resume(_) | Self::Verify(_) | Self::Bench(_))
    }

    /// Does it, on the processes of a launcher if there are any; returns the exit code.
    pub fn execute(self, processes: Option<&Processes>) -> Result<u8, CommandError> {
        match self {
            Self::New(command) => command.execute(),
            Self::Check(command) => command.execute(),
            Self::Explain(command) => command.execute(),
            Self::Run(command) => command.execute(processes),
            Self::Resume(command) => command.execute(processes),
            Self::Analyse(command) => command.execute(),
            Self::Report(command) => command.execute(),
            Self::Bed(command) => command.execute(),
            Self::Sweep(command) => command.execute(),
            Self::Calibrate(command) => command.execute(),
            Self::Verify(command) => command.execute(processes),
            Self::Bench(command) => command.execute(processes),
            Self::Doctor(command) => command.execute(),
            Self::Completions(command) => command.execute(),
            Self::Man(command) => command.execute(),
        }
    }
}

/// A time with its unit, for the command line \[s].
fn time(text: &str) -> Result<f64, String> {
    match parse_quantity(text) {
        Ok((value, dimension)) if dimension == Dimension::new(0, 0, 1, 0) && value >= 0.0 => Ok(value),
        Ok((_, dimension)) if dimension == Dimension::NONE => Err("a time needs a unit, such as \"0.02 s\"".into()),
        Ok(_) => Err("expected a time of zero or more, such as \"0.02 s\"".into()),
        Err(error) => Err(error.message),
    }
}

/// Prints a value as JSON on standard output.
fn print_json(value: &serde_json::Value) {
    outln!("{value:#}");
}

/// The value as JSON.
fn json(value: &impl serde::Serialize) -> Result<serde_json::Value, CommandError> {
    serde_json::to_value(value).map_err(|error| CommandError::Undone(error.to_string()))
}
