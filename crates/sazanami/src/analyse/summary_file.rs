//! The summary that a run left, and that of an evaluation with other keys.

use std::path::Path;

use serde_json::{Map, Value, json};

use super::output::{Output, undone};
use crate::error::CommandError;
use crate::lock::FolderLock;
use crate::results::SUMMARY;

/// Reads the summary in a folder of results.
pub(crate) fn summary(folder: &Path) -> Result<Value, CommandError> {
    let path = folder.join(SUMMARY);
    let text = std::fs::read_to_string(&path).map_err(|error| {
        if error.kind() == std::io::ErrorKind::NotFound && FolderLock::refuse_held(folder).is_err() {
            return CommandError::input(
                format!("the run in `{}` has written no {SUMMARY} yet", folder.display()),
                "it comes with the first checkpoint and at the end of the run: try again later",
            );
        }
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

/// Writes what an evaluation with `overrides` found of a run into the folder `place`.
pub(super) fn write_evaluation(
    place: &Path,
    overrides: &[String],
    run: &Value,
    found: Map<String, Value>,
    output: &mut Output,
) -> Result<(), CommandError> {
    let mut value = found;
    for key in ["case", "case_hash"] {
        value.insert(key.into(), run[key].clone());
    }
    value.insert("version".into(), env!("CARGO_PKG_VERSION").into());
    value.insert("overrides".into(), json!(overrides));
    let path = place.join(SUMMARY);
    sazanami_io::table::write_json(&path, &Value::Object(value)).map_err(undone)?;
    output.message(&format!("wrote {}", path.display()));
    Ok(())
}
