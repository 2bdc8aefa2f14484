//! `sazanami run`: runs a case.

use std::path::PathBuf;

use clap::Args;
use sazanami::case;
use sazanami::error::CommandError;
use sazanami::results::as_word;
use sazanami::run::{RunOptions, RunSummary, run};
use sazanami_parallel::{Processes, Sums};
use sazanami_picture::Painter;

use super::time;
use crate::terminal::{self, Screen};
use crate::words;

/// Run a case.
#[derive(Debug, Args)]
#[command(
    long_about = "Run a case. Results go to --out, or to runs/<case>-<n>. Ctrl-C, SIGTERM, SIGHUP and \
                  SIGUSR1 end the run with a checkpoint; `sazanami resume` goes on from it. Under `mpirun` send \
                  SIGUSR1: after other signals it leaves no time for a checkpoint.",
    after_help = "Example:\n  sazanami run cases/raindrop/paper.toml --out runs/slow \\\n      \
                  --set liquid.0.fall.speed=\"2.25 m/s\" --until \"0.02 s\""
)]
pub struct Run {
    /// Case file
    case: PathBuf,
    /// Folder for the results (default: the next free runs/<case>-<n>)
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Write into a folder that is not empty
    #[arg(long)]
    force: bool,
    /// Override a value of the case file (repeatable)
    #[arg(long = "set", value_name = "PATH=VALUE", value_parser = words::OVERRIDE, hide_possible_values = true)]
    overrides: Vec<String>,
    #[command(flatten)]
    extent: Extent,
}

/// End of a run, threads and ranks.
#[derive(Debug, Args)]
pub struct Extent {
    /// Stop at this simulated time, with its unit; never changes a time step
    #[arg(long, value_name = "TIME", value_parser = time, conflicts_with = "steps")]
    until: Option<f64>,
    /// Stop after so many further fluid steps
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u64).range(1..))]
    steps: Option<u64>,
    /// Threads (default: all)
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..))]
    threads: Option<u16>,
    /// Ranks within this process; under a launcher of MPI each process is one instead (default: 1; of a run that goes on,
    /// as it was)
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..))]
    ranks: Option<u16>,
    /// Order in which values of ranks are added: `ordered` gives the bits of ranks within one process, `tree` needs
    /// smaller messages on hundreds of ranks (default: ordered; of a run that goes on, as it began)
    #[arg(long, value_name = "ORDER", value_parser = ["ordered", "tree"])]
    sums: Option<String>,
}

impl Extent {
    /// The options of a run.
    pub fn options(&self, out: Option<PathBuf>, force: bool, processes: Option<&Processes>) -> RunOptions {
        RunOptions {
            out,
            force,
            until: self.until,
            steps: self.steps,
            threads: self.threads.map(usize::from),
            ranks: self.ranks.map_or(0, usize::from),
            processes: processes.cloned(),
            sums: self.sums.as_deref().and_then(Sums::of_word),
            ..of_this_program()
        }
    }
}

/// Options common to every run of this program.
pub fn of_this_program() -> RunOptions {
    RunOptions {
        commit: option_env!("SAZANAMI_COMMIT"),
        artist: Some(&Painter),
        report: Some(sazanami_report::at_the_end),
        ..RunOptions::default()
    }
}

impl Run {
    pub fn execute(self, processes: Option<&Processes>) -> Result<u8, CommandError> {
        let loaded = case::load(&self.case, &self.overrides)?;
        let stop = terminal::stop_on_signals()?;
        let mut screen = Screen::new();
        let summary = run(&loaded, &self.extent.options(self.out, self.force, processes), &mut screen, &stop)?;
        drop(screen);
        Ok(exit_code(&summary))
    }
}

/// Tells what came of a run; returns the exit code.
pub fn exit_code(summary: &RunSummary) -> u8 {
    for line in &summary.lines {
        outln!("{line}");
    }
    outln!("results in {}", summary.folder.display());
    if summary.interrupted {
        outln!("go on with `sazanami resume {}`", as_word(&summary.folder));
    }
    summary.exit_code()
}
