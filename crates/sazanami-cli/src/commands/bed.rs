//! `sazanami bed`: beds in files, between the binary form and a table and back.

use std::path::PathBuf;

use clap::Args;
use sazanami::bed_file::Bed;
use sazanami::error::{CommandError, exit};

/// Write a bed from a file as a table (CSV), or a table as a bed.
#[derive(Debug, Args)]
#[command(
    long_about = "Write the bed in a file (`packed.bed` of a run, or what `output.bed` names) as another file: a table with a row \
                  for each grain where its name ends in `.csv`, the binary form else. Both can be read by \
                  `placement.bed.file`, and hold the same to the last bit.",
    after_help = "Example:\n  sazanami bed runs/bed-1/packed.bed --out bed.csv\n  sazanami bed bed.csv --out bed.bed"
)]
pub struct BedCommand {
    /// The bed
    #[arg(value_name = "FILE")]
    file: PathBuf,
    /// File to be written
    #[arg(long, value_name = "FILE")]
    out: PathBuf,
}

impl BedCommand {
    pub fn execute(self) -> Result<u8, CommandError> {
        let refused = |help: &'static str| {
            move |error: sazanami::bed_file::BedFileError| CommandError::input(error.to_string(), help)
        };
        let bed = Bed::read(&self.file)
            .map_err(refused("name a bed that a run wrote, or a table whose name ends in .csv"))?;
        bed.write(&self.out).map_err(refused("choose another place for `--out`"))?;
        outln!("wrote {} grains to {}", bed.grains.len(), self.out.display());
        Ok(exit::DONE)
    }
}
