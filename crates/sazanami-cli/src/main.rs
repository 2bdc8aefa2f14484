//! The command `sazanami`.

mod commands;
mod terminal;

use std::process::ExitCode;

use clap::Parser;

use commands::Command;

/// Grains of sand under moving water: resolved grains, two-phase flow, one case file.
#[derive(Debug, Parser)]
#[command(
    name = "sazanami",
    version,
    max_term_width = 100,
    subcommand_required = true,
    arg_required_else_help = true,
    after_help = "Exit codes: 0 done; 1 the run failed; 2 the input or the command line is wrong; 130 stopped by \
                  Ctrl-C or SIGTERM after writing a checkpoint.\n\n\
                  Example:\n  sazanami run cases/raindrop/quick.toml"
)]
struct Arguments {
    #[command(subcommand)]
    command: Command,
}

fn main() -> ExitCode {
    let arguments = Arguments::parse();
    match arguments.command.execute() {
        Ok(code) => ExitCode::from(code),
        Err(error) => {
            terminal::error(&error);
            ExitCode::from(error.exit_code())
        }
    }
}
