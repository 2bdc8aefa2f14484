//! Output of an evaluation: pictures by an artist, messages to whoever listens, names of files.

use std::path::{Path, PathBuf};

use serde_json::Value;

use crate::artist::{Artist, Figure};
use crate::error::CommandError;
use crate::progress::Progress;
use crate::recorder;
use crate::results::FIGURES;

/// The artist and the listener of an evaluation.
pub(super) struct Output<'a> {
    pub(super) artist: Option<&'a dyn Artist>,
    pub(super) progress: &'a mut dyn Progress,
}

impl Output<'_> {
    /// Draws a figure and says so; nothing without an artist.
    pub(super) fn draw(&mut self, figure: &Figure, path: &Path) -> Result<(), CommandError> {
        if let Some(artist) = self.artist {
            artist.draw(figure, path).map_err(undone)?;
            self.message(&format!("drew {}", path.display()));
        }
        Ok(())
    }

    pub(super) fn message(&mut self, text: &str) {
        self.progress.message(text);
    }
}

/// An error of the file system or of an artist.
pub(super) fn undone(error: impl std::fmt::Display) -> CommandError {
    CommandError::Undone(error.to_string())
}

/// Brings the list of files in the summary up to date.
pub(super) fn list_files(folder: &Path, summary: &Value) -> Result<(), CommandError> {
    // A run that is still on its way writes its summary itself.
    if summary["status"] != "running" {
        recorder::put_files(folder).map_err(undone)?;
    }
    Ok(())
}

/// The last of the pictures whose names begin with `prefix`.
pub(super) fn newest_picture(folder: &Path, prefix: &str) -> Option<PathBuf> {
    let paths = std::fs::read_dir(folder.join(FIGURES)).ok()?.flatten().map(|entry| entry.path());
    let named = |path: &PathBuf| path.file_name().is_some_and(|name| name.to_string_lossy().starts_with(prefix));
    paths.filter(named).max()
}

/// `name.csv`, or the next of `name-2.csv`, `name-3.csv`, ... that does not exist in `folder`.
pub(super) fn free_path(folder: &Path, name: &str) -> PathBuf {
    let numbered = (2..).map(|n: u32| folder.join(format!("{name}-{n}.csv")));
    let mut names = std::iter::once(folder.join(format!("{name}.csv"))).chain(numbered);
    names.find(|path| !path.exists()).unwrap_or_else(|| folder.join(name))
}
