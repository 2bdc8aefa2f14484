//! `sazanami verify`: verification and validation cases.

use clap::Args;
use sazanami::error::{CommandError, exit};
use sazanami_verification::catalogue::CASES;
use sazanami_verification::verify::{self, Verdict};

use super::print_json;
use crate::terminal::Screen;

/// Run verification and validation cases.
#[derive(Debug, Args)]
#[command(
    long_about = "Run verification and validation cases: a table of measured value, reference, band and verdict. All of \
                  it takes an hour or less on two cores; --long adds what takes longer. Exit code 1 if a band is missed.",
    after_help = "Example:\n  sazanami verify layers-at-rest falling-drop --json"
)]
pub struct Verify {
    /// Cases (default: all)
    #[arg(value_name = "NAME")]
    names: Vec<String>,
    /// Add what takes longer than the hour
    #[arg(long)]
    long: bool,
    /// List the cases and do nothing else
    #[arg(long)]
    list: bool,
    /// Print one array of rows as JSON
    #[arg(long)]
    json: bool,
}

impl Verify {
    pub fn execute(self) -> Result<u8, CommandError> {
        if self.list {
            for case in CASES {
                outln!("{:<28} {}{}", case.name, case.about, if case.long { " (long)" } else { "" });
            }
            return Ok(exit::DONE);
        }
        let mut screen = Screen::new();
        let rows = verify::verify(CASES, &self.names, self.long, &mut screen)?;
        drop(screen);
        if self.json {
            print_json(&super::json(&rows)?);
        } else {
            out!("{}", verify::table(&rows));
        }
        let missed = rows.iter().any(|row| row.verdict == Verdict::Fail);
        Ok(if missed { exit::FAILED } else { exit::DONE })
    }
}
