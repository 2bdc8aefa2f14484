//! The checkpoints in a folder of results, read back.

use std::path::{Path, PathBuf};

use sazanami_io::checkpoint::{CheckpointError, CheckpointFolder, CheckpointReader, NewestCheckpoint};

use crate::error::CommandError;
use crate::job::{RUN_STATE, RunState};
use crate::progress::Progress;
use crate::results::CHECKPOINTS;

/// The newest good checkpoint in a folder of results, with a message about each that is skipped.
pub(crate) fn newest(folder: &Path, progress: &mut dyn Progress) -> Result<NewestCheckpoint, CommandError> {
    let newest = within(folder).newest_good().map_err(unreadable)?;
    skipped(&newest).for_each(|text| progress.message(&format!("warning: {text}")));
    Ok(newest)
}

/// File of the newest good checkpoint, if there is one.
pub(crate) fn last_good(folder: &Path) -> Option<PathBuf> {
    within(folder).newest_good().ok()?.good.map(|(_, reader)| reader.path().to_owned())
}

/// A line about each checkpoint that was skipped.
pub(crate) fn skipped(newest: &NewestCheckpoint) -> impl Iterator<Item = String> {
    newest.skipped.iter().map(|(path, error)| format!("skipped {}: {error}", path.display()))
}

/// Gives those that were skipped as damaged another name, so that they do not count among the checkpoints that are kept.
pub(crate) fn put_aside(newest: &NewestCheckpoint) {
    let is_damaged = |error: &CheckpointError| {
        use CheckpointError::{DamagedHeader, DamagedIndex, DamagedSection, NotACheckpoint, Torn};
        matches!(
            error,
            DamagedHeader { .. } | DamagedIndex { .. } | DamagedSection { .. } | NotACheckpoint { .. } | Torn { .. }
        )
    };
    for (path, _) in newest.skipped.iter().filter(|(path, error)| path.is_file() && is_damaged(error)) {
        let mut aside = path.clone().into_os_string();
        aside.push(".damaged");
        // One that stays is skipped again.
        let _ = std::fs::rename(path, aside);
    }
}

/// Reads the state that is not physics.
pub(crate) fn run_state(reader: &CheckpointReader) -> Result<RunState, CommandError> {
    reader.get_json(RUN_STATE).map_err(unreadable)
}

/// The error of a command that needs a checkpoint which cannot be read.
pub(crate) fn unreadable(error: CheckpointError) -> CommandError {
    CommandError::input(error.to_string(), "start the case again with `sazanami run`")
}

fn within(folder: &Path) -> CheckpointFolder {
    CheckpointFolder::new(folder.join(CHECKPOINTS), 1)
}
