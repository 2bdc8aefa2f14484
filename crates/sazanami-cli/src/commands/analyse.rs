//! `sazanami analyse`: observables, tables and pictures from what runs wrote.

use std::path::PathBuf;

use clap::Args;
use sazanami::analyse::analyse;
use sazanami::error::{CommandError, exit};
use sazanami_picture::Painter;

use crate::terminal::Screen;
use crate::words;

/// Recompute observables, tables and pictures from results, or compare several.
#[derive(Debug, Args)]
#[command(
    long_about = "Recompute observables, tables and pictures from what one run wrote, or compare several runs (crater \
                  volume against momentum; mound, ripples and growth). Charts are drawn by `sazanami report`. A crater is evaluated again from the newest \
                  checkpoint, ripples from the tables of their run; --set changes how, and what is then found goes into \
                  DIR/analysis.",
    after_help = "Example:\n  sazanami analyse runs/drop-20 --set erosion.dr=\"1 mm\"\n  \
                  sazanami analyse runs/drop-20 runs/drop-40 runs/drop-60 runs/drop-80\n  \
                  sazanami analyse runs/tank --set ripples.margin=\"15 mm\""
)]
pub struct Analyse {
    /// Folders of results
    #[arg(required = true, value_name = "DIR")]
    dirs: Vec<PathBuf>,
    /// Evaluate one run with another value (repeatable): craters of a key under `erosion` or `bed`, ripples of
    /// `ripples.margin`, `ripples.grain_size` or under `ripples.measured`
    #[arg(long = "set", value_name = "PATH=VALUE", value_parser = words::OVERRIDE, hide_possible_values = true)]
    overrides: Vec<String>,
    /// Folder for the table of a comparison [default: the current one]
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
}

impl Analyse {
    pub fn execute(self) -> Result<u8, CommandError> {
        if let Some(missing) = self.dirs.iter().find(|dir| !dir.is_dir()) {
            return Err(CommandError::input(
                format!("there is no folder `{}`", missing.display()),
                "give folders that runs wrote their results to",
            ));
        }
        let mut screen = Screen::new();
        let lines = analyse(&self.dirs, &self.overrides, self.out.as_deref(), Some(&Painter), &mut screen)?;
        drop(screen);
        for line in lines {
            outln!("{line}");
        }
        Ok(exit::DONE)
    }
}
