//! Output of an evaluation: figures by an artist, messages to whoever listens.

use std::path::Path;

use crate::artist::{Artist, Figure};
use crate::error::CommandError;
use crate::progress::Progress;

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
