//! `sazanami report`: what runs found, in one page of HTML.

use std::path::{Path, PathBuf};

use clap::Args;
use sazanami::error::{CommandError, exit};

/// Write a report on a run, or on several side by side.
#[derive(Debug, Args)]
#[command(
    long_about = "Write a report: one HTML file that opens in any browser without a network. That of one run goes into \
                  its folder, as at the end of a run; that of several shows them side by side.",
    after_help = "Example:\n  sazanami report runs/drop-20\n  \
                  sazanami report runs/drop-20 runs/drop-40 runs/drop-60 --out runs/compared"
)]
pub struct Report {
    /// Folders of results
    #[arg(required = true, value_name = "DIR")]
    dirs: Vec<PathBuf>,
    /// Folder for the report on several runs [default: the current one]
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
}

impl Report {
    pub fn execute(self) -> Result<u8, CommandError> {
        let path = match (self.dirs.as_slice(), &self.out) {
            ([dir], None) => sazanami_report::of_run(dir)?,
            ([_], Some(_)) => {
                return Err(CommandError::input(
                    "`--out` is for the report on several runs, and one is given",
                    "leave it out: the report goes into the folder of the run",
                ));
            }
            (several, out) => sazanami_report::comparison(several, out.as_deref().unwrap_or(Path::new(".")))?,
        };
        outln!("wrote {}", path.display());
        Ok(exit::DONE)
    }
}
