//! `sazanami resume`: goes on with a run.

use std::path::PathBuf;

use clap::Args;
use sazanami::error::CommandError;
use sazanami::run::resume;
use sazanami_parallel::Processes;

use super::run::{Extent, exit_code};
use crate::terminal::{self, Screen};

/// Go on from the newest good checkpoint in DIR.
#[derive(Debug, Args)]
#[command(
    long_about = "Go on from the newest good checkpoint in DIR, or from the beginning if the run ended before it wrote \
                  one. A torn or corrupted checkpoint is skipped, with a word \
                  about it. The result has the bits of an uninterrupted run, for any number of threads.",
    after_help = "Example:\n  sazanami resume runs/paper-1 --until \"0.19 s\""
)]
pub struct Resume {
    /// Folder of the results
    dir: PathBuf,
    #[command(flatten)]
    extent: Extent,
}

impl Resume {
    pub fn execute(self, processes: Option<&Processes>) -> Result<u8, CommandError> {
        if !self.dir.is_dir() {
            return Err(CommandError::input(
                format!("there is no folder `{}`", self.dir.display()),
                "give the folder that a run wrote its results to",
            ));
        }
        let stop = terminal::stop_on_signals()?;
        let mut screen = Screen::new();
        let summary = resume(&self.dir, &self.extent.options(None, false, processes), &mut screen, &stop)?;
        drop(screen);
        Ok(exit_code(&summary))
    }
}
