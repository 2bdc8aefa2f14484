//! The summary that a run left.

use std::path::Path;

use serde_json::Value;

use crate::error::CommandError;
use crate::results::SUMMARY;

/// Reads the summary in a folder of results.
pub(super) fn summary(folder: &Path) -> Result<Value, CommandError> {
    let path = folder.join(SUMMARY);
    let text = std::fs::read_to_string(&path).map_err(|error| {
        CommandError::input(
            format!("`{}` holds no results: {error}", folder.display()),
            "give the folder that `sazanami run` wrote to",
        )
    })?;
    serde_json::from_str(&text).map_err(|error| {
        CommandError::input(
            format!("{}: {error}", path.display()),
            "the summary is damaged; resume the run to rewrite it",
        )
    })
}
