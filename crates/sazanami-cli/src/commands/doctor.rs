//! `sazanami doctor`: what this program finds on this machine.

use clap::Args;
use sazanami::doctor;
use sazanami::error::{CommandError, exit};

use super::print_json;

/// Say what this program finds on this machine.
#[derive(Debug, Args)]
#[command(
    long_about = "Say what this program finds on this machine: version and build, processor and instruction set, cores \
                  and threads, memory and the limits set to it, memory bandwidth, disk and writable folders, and what is \
                  built in. Exit code 1 if something keeps a run from working.",
    after_help = "Example:\n  sazanami doctor --json"
)]
pub struct Doctor {
    /// Print the findings as JSON
    #[arg(long)]
    json: bool,
}

impl Doctor {
    pub fn execute(self) -> Result<u8, CommandError> {
        let findings = doctor::examine(option_env!("SAZANAMI_COMMIT"), sazanami_mpi::name_of_library().as_deref());
        if self.json {
            print_json(&super::json(&findings)?);
        } else {
            for finding in &findings {
                outln!("{:<4} {:<20} {}", finding.state, finding.what, finding.found);
            }
        }
        let is_well = findings.iter().all(|finding| finding.state != doctor::State::Bad);
        Ok(if is_well { exit::DONE } else { exit::FAILED })
    }
}
