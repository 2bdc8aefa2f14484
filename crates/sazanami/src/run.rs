//! Running a case and going on with one: what is asked and what comes of it.

use std::path::{Path, PathBuf};
use std::sync::atomic::AtomicBool;

use sazanami_numerics::Real;

use crate::case::LoadedCase;
use crate::check::CostModel;
use crate::error::{CommandError, Failure};
use crate::machine::Machine;
use crate::progress::Progress;
use crate::{feasible, results};

/// How a run ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Status {
    /// Not ended yet.
    Running,
    /// Reached its end.
    Finished,
    /// Stopped by a signal, a number of steps or a time before its end.
    Stopped,
    /// Ended by an error.
    Failed,
}

/// What `run` is asked beyond the case.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct RunOptions {
    /// Folder for the results; absent: the next free `runs/<case>-<n>`.
    pub out: Option<PathBuf>,
    /// Overwrite a folder that is not empty.
    pub force: bool,
    /// Stop at this simulated time [s] (never changes a time step).
    pub until: Option<Real>,
    /// Stop after so many further fluid steps.
    pub steps: Option<u64>,
    /// Threads; absent: as many as the machine has.
    pub threads: Option<usize>,
    /// In-process ranks.
    pub ranks: usize,
}

/// What came of a run.
#[derive(Clone, Debug, PartialEq)]
pub struct RunSummary {
    /// How it ended.
    pub status: Status,
    /// Whether a signal stopped it.
    pub interrupted: bool,
    /// Folder of the results.
    pub folder: PathBuf,
    /// Fluid steps so far.
    pub steps: u64,
    /// Simulated time so far [s].
    pub time: Real,
    /// Wall-clock time of this command [s].
    pub wall: Real,
    /// Lines for people: crater volume, budget, what was written.
    pub lines: Vec<String>,
}

impl RunSummary {
    /// Exit code of the command.
    #[must_use]
    pub const fn exit_code(&self) -> u8 {
        if self.interrupted { crate::error::exit::STOPPED } else { crate::error::exit::DONE }
    }
}

/// Runs a case into a folder of its own until it ends or `stop` is set.
///
/// # Errors
/// If the case cannot run, the folder is refused, or the run fails.
pub fn run(
    loaded: &LoadedCase,
    options: &RunOptions,
    progress: &mut dyn Progress,
    _stop: &AtomicBool,
) -> Result<RunSummary, CommandError> {
    let feasible = feasible::check(loaded, &Machine::this(), &CostModel::default())?;
    let folder = results::prepare(options.out.as_deref(), &loaded.case.name, options.force)?;
    progress.message(&format!("{} shapes, results in {}", feasible.shapes.len(), folder.display()));
    Err(no_engine())
}

/// Goes on from the newest good checkpoint in `folder`.
///
/// # Errors
/// If there is none, or the run fails.
pub fn resume(
    _folder: &Path,
    _options: &RunOptions,
    _progress: &mut dyn Progress,
    _stop: &AtomicBool,
) -> Result<RunSummary, CommandError> {
    Err(no_engine())
}

fn no_engine() -> CommandError {
    Failure { kind: "engine", message: "this build has no solver".into(), ..Default::default() }.into()
}
