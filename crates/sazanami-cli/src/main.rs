//! The command `sazanami`.

#![deny(clippy::print_stdout, clippy::print_stderr)]

#[macro_use]
mod terminal;

mod commands;
mod out_of_memory;
mod ranks;
mod words;

use std::process::ExitCode;
use std::time::Instant;

use clap::Parser;
use sazanami::error::{CommandError, exit};
use sazanami::machine;
use sazanami::progress::duration;
use sazanami_parallel::{JoinError, Launcher, Processes};

use commands::Command;
use terminal::Verbosity;

/// Grains of sand under moving water: resolved grains, two-phase flow, one case file.
#[derive(Debug, Parser)]
#[command(
    name = "sazanami",
    version,
    max_term_width = 100,
    subcommand_required = true,
    arg_required_else_help = true,
    after_help = "Exit codes: 0 done; 1 the run failed; 2 the input or the command line is wrong; 130 stopped by \
                  Ctrl-C, SIGTERM, SIGHUP or SIGUSR1 after writing a checkpoint.\n\n\
                  Example:\n  sazanami run cases/raindrop/quick.toml"
)]
struct Arguments {
    #[command(subcommand)]
    command: Command,
    /// Show warnings and errors only, beside what was asked for
    #[arg(short, long, global = true, conflicts_with = "verbose")]
    quiet: bool,
    /// Show all that is known of each step, and the time and memory that the command took
    #[arg(short, long, global = true)]
    verbose: bool,
}

fn main() -> ExitCode {
    let began = Instant::now();
    out_of_memory::end_by_name();
    terminal::meet_full_files_as_errors();
    let world = sazanami_mpi::join();
    let code = match &world {
        Ok(Some(world)) => ranks::take_part(world.processes(), command),
        Ok(None) => command(None, None),
        Err(refused) => command(None, Some(refused)),
    };
    let code = terminal::end_output(code);
    if terminal::verbosity() == Verbosity::Verbose {
        let memory = machine::peak_memory().map_or_else(String::new, |bytes| format!(", {} MiB at most", bytes >> 20));
        terminal::print_error(format_args!("took {}{memory}", duration(began.elapsed().as_secs_f64())));
    }
    ExitCode::from(code)
}

/// Execution of the command line, on the processes of a launcher if there are any; `refused` says why these cannot work
/// together.
fn command(processes: Option<&Processes>, refused: Option<&JoinError>) -> u8 {
    let arguments = match Arguments::try_parse() {
        Ok(arguments) => arguments,
        Err(error) => return shown(&words::with_what_was_meant(error)),
    };
    match refused {
        Some(refused) if arguments.command.is_shared() => {
            // All processes find the same: one of them says it, if they know which they are.
            if Launcher::seen().and_then(|launcher| launcher.rank).unwrap_or_default() == 0 {
                terminal::error(&CommandError::input(refused.to_string(), refused.help()));
            }
            exit::WRONG_INPUT
        }
        _ => execute(arguments, processes),
    }
}

fn execute(arguments: Arguments, processes: Option<&Processes>) -> u8 {
    terminal::set_verbosity(match (arguments.quiet, arguments.verbose) {
        (true, _) => Verbosity::Quiet,
        (_, true) => Verbosity::Verbose,
        _ => Verbosity::Normal,
    });
    arguments.command.execute(processes).unwrap_or_else(|error| {
        terminal::error(&error);
        error.exit_code()
    })
}

/// Shows help, version, or what is wrong with the command line.
fn shown(error: &clap::Error) -> u8 {
    let code = u8::try_from(error.exit_code()).unwrap_or(exit::WRONG_INPUT);
    match error.print() {
        Err(problem) if problem.kind() != std::io::ErrorKind::BrokenPipe => code.max(exit::FAILED),
        _ => code,
    }
}
