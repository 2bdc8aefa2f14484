//! `sazanami check`: reads, validates and explains a case without running it.

use std::path::PathBuf;

use clap::Args;
use sazanami::case::{self, CaseError};
use sazanami::check;
use sazanami::error::{CommandError, exit};
use sazanami::examine::{Examined, examine};
use sazanami::progress::Progress as _;
use serde_json::json;

use super::print_json;
use crate::terminal::Screen;
use crate::words;

/// Read, validate and explain a case without running it.
#[derive(Debug, Args)]
#[command(
    long_about = "Read, validate and explain a case without running it: resolution, counts, each limit on the time step \
                  and which one rules, memory, disk, predicted cost and run time on this machine. Exit code 0 if the \
                  case can run.",
    after_help = "Example:\n  sazanami check cases/raindrop/quick.toml --set domain.cells=\"[80, 80, 80]\""
)]
pub struct Check {
    /// Case file
    case: PathBuf,
    /// Override a value of the case file (repeatable)
    #[arg(long = "set", value_name = "PATH=VALUE", value_parser = words::OVERRIDE, hide_possible_values = true)]
    overrides: Vec<String>,
    /// Predict the cost on so many threads (default: all); with --ranks, of each rank
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..))]
    threads: Option<u16>,
    /// Show how it is shared among so many ranks: parts, balance of cells and grains, time, memory of a rank, levels of
    /// multigrid, and how many ranks can share it
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..))]
    ranks: Option<u32>,
    /// Print the findings and the report as JSON
    #[arg(long)]
    json: bool,
}

impl Check {
    pub fn execute(self) -> Result<u8, CommandError> {
        let ranks = self.ranks.map(|ranks| ranks as usize);
        let examined = case::load(&self.case, &self.overrides).map_err(CommandError::from).and_then(|loaded| {
            let threads = self.threads.map(usize::from);
            examine(&loaded, threads, ranks, option_env!("SAZANAMI_COMMIT")).map(|examined| (loaded, examined))
        });
        let (loaded, Examined { report, warnings, messages }) = match examined {
            Ok(examined) => examined,
            Err(CommandError::Case(error)) if self.json => {
                print_json(&json!({ "ok": false, "findings": findings(&error)? }));
                return Ok(exit::WRONG_INPUT);
            }
            Err(error) => return Err(error),
        };
        if self.json {
            let findings = super::json(&warnings.records(&loaded.source))?;
            print_json(&json!({ "ok": true, "findings": findings, "report": super::json(&report)? }));
        } else {
            let mut screen = Screen::new();
            screen.warnings(&warnings, &loaded.source);
            messages.iter().for_each(|text| screen.message(text));
            out!("{}", check::explain(&loaded.case, &report));
        }
        Ok(exit::DONE)
    }
}

fn findings(error: &CaseError) -> Result<serde_json::Value, CommandError> {
    super::json(&error.diagnostics.records(&error.source))
}
