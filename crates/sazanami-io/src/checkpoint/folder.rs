//! The checkpoints of a run.

use std::fs;
use std::io;
use std::path::{Path, PathBuf};

use super::{CheckpointError, CheckpointReader, CheckpointWriter};
use crate::replace::UNFINISHED;

/// A folder of checkpoints `step-000001234.ckpt`, of which the newest are kept.
#[derive(Clone, Debug)]
pub struct CheckpointFolder {
    folder: PathBuf,
    keep: usize,
}

/// The checkpoint to go on from, and those that could not be used.
#[derive(Debug)]
pub struct NewestCheckpoint {
    /// Newest good checkpoint with its step, if there is one.
    pub good: Option<(u64, CheckpointReader)>,
    /// Newer ones that are torn or damaged, newest first.
    pub skipped: Vec<(PathBuf, CheckpointError)>,
}

impl CheckpointFolder {
    /// Checkpoints in `folder`, which need not exist yet, of which the newest `keep` (at least one) stay.
    #[must_use]
    pub fn new(folder: impl Into<PathBuf>, keep: usize) -> Self {
        Self { folder: folder.into(), keep: keep.max(1) }
    }

    /// The folder.
    #[must_use]
    pub fn path(&self) -> &Path {
        &self.folder
    }

    /// File of the checkpoint after `step`.
    #[must_use]
    pub fn path_of(&self, step: u64) -> PathBuf {
        self.folder.join(format!("step-{step:09}.ckpt"))
    }

    /// Steps that have a file, oldest first, good or not.
    ///
    /// # Errors
    /// If the folder exists but cannot be read.
    pub fn steps(&self) -> Result<Vec<u64>, CheckpointError> {
        let cannot_read = |source| CheckpointError::Read { path: self.folder.clone(), source };
        let entries = match fs::read_dir(&self.folder) {
            Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(Vec::new()),
            entries => entries.map_err(cannot_read)?,
        };
        let mut steps = Vec::new();
        for entry in entries {
            let name = entry.map_err(cannot_read)?.file_name();
            steps.extend(name.to_str().and_then(step_of));
        }
        steps.sort_unstable();
        Ok(steps)
    }

    /// Looks for the newest checkpoint that is good from end to end.
    ///
    /// # Errors
    /// If the folder exists but cannot be read.
    pub fn newest_good(&self) -> Result<NewestCheckpoint, CheckpointError> {
        let mut skipped = Vec::new();
        for step in self.steps()?.into_iter().rev() {
            let path = self.path_of(step);
            match CheckpointReader::open(&path) {
                Ok(reader) => return Ok(NewestCheckpoint { good: Some((step, reader)), skipped }),
                Err(reason) => skipped.push((path, reason)),
            }
        }
        Ok(NewestCheckpoint { good: None, skipped })
    }

    /// Writes the checkpoint after `step`, and only when it is safely in place removes those before it that are one
    /// too many. Returns its path and length \[bytes].
    ///
    /// # Errors
    /// If the file system refuses; the checkpoints there are then untouched.
    pub fn write(&self, step: u64, checkpoint: &CheckpointWriter) -> Result<(PathBuf, u64), CheckpointError> {
        let path = self.path_of(step);
        fs::create_dir_all(&self.folder).map_err(|source| CheckpointError::Write { path: path.clone(), source })?;
        let length = checkpoint.write_atomic(&path)?;
        self.prune(step)?;
        Ok((path, length))
    }

    /// Removes the oldest checkpoints up to `newest` and what crashes left behind. Later ones, which a run that went
    /// back further has not reached again, do not count.
    fn prune(&self, newest: u64) -> Result<(), CheckpointError> {
        let remove = |path: PathBuf| match fs::remove_file(&path) {
            Err(error) if error.kind() == io::ErrorKind::NotFound => Ok(()),
            result => result.map_err(|source| CheckpointError::Prune { path, source }),
        };
        let mut steps = self.steps()?;
        steps.retain(|&step| step <= newest);
        for &step in &steps[..steps.len().saturating_sub(self.keep)] {
            remove(self.path_of(step))?;
        }
        let entries = fs::read_dir(&self.folder);
        for entry in entries.into_iter().flatten().flatten() {
            if entry.file_name().to_string_lossy().starts_with(UNFINISHED) {
                remove(entry.path())?;
            }
        }
        Ok(())
    }
}

fn step_of(name: &str) -> Option<u64> {
    let digits = name.strip_prefix("step-")?.strip_suffix(".ckpt")?;
    if digits.len() >= 9 && digits.bytes().all(|digit| digit.is_ascii_digit()) { digits.parse().ok() } else { None }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_names_of_checkpoints_are_steps() {
        assert_eq!(step_of("step-000001234.ckpt"), Some(1234));
        assert_eq!(step_of("step-12345678901.ckpt"), Some(12_345_678_901));
        for other in
            ["step-1234.ckpt", "step-00000123x.ckpt", "step-+00001234.ckpt", "step-000001234.ckpt~", "case.toml"]
        {
            assert_eq!(step_of(other), None);
        }
    }
}
