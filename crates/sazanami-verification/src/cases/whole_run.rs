//! A case run whole, into a folder that goes when it is no longer needed.

use std::path::{Path, PathBuf};

use sazanami_numerics::Real;
use serde_json::Value;

use sazanami::analyse::Table;
use sazanami::case::{self, LoadedCase};
use sazanami::progress::Silent;
use sazanami::run::{RunOptions, run};
use sazanami::stop::Stop;

/// Folder of a finished run.
pub(crate) struct WholeRun {
    folder: PathBuf,
}

impl WholeRun {
    /// Runs `loaded` under a `name` of its own.
    pub fn of(name: &str, loaded: &LoadedCase) -> Result<Self, String> {
        let left = Self { folder: std::env::temp_dir().join(format!("sazanami-{name}-{}", std::process::id())) };
        let options = RunOptions { out: Some(left.folder.clone()), force: true, ranks: 1, ..RunOptions::default() };
        run(loaded, &options, &mut Silent, &Stop::new()).map_err(|error| error.to_string())?;
        Ok(left)
    }

    /// Reads a case from its text with overrides and runs it.
    pub fn of_text(name: &str, text: &str, overrides: &[String]) -> Result<Self, String> {
        let loaded = case::parse(Path::new("case.toml"), text, overrides).map_err(|error| error.to_string())?;
        Self::of(name, &loaded)
    }

    /// Folder of its results.
    pub fn folder(&self) -> &Path {
        &self.folder
    }

    /// Contents of `summary.json`.
    pub fn summary(&self) -> Result<Value, String> {
        let path = self.folder.join(sazanami::results::SUMMARY);
        let text = std::fs::read_to_string(&path).map_err(|error| format!("{}: {error}", path.display()))?;
        serde_json::from_str(&text).map_err(|error| format!("{}: {error}", path.display()))
    }

    /// Columns of one of its tables, by name; NaN where a cell is empty.
    ///
    /// # Errors
    /// If there is no such table or column, or a cell holds what is no finite number.
    pub fn columns<const N: usize>(&self, table: &str, names: [&str; N]) -> Result<[Vec<Real>; N], String> {
        let path = self.folder.join(table);
        let table = Table::read(&path).map_err(|error| error.to_string())?;
        let table = table.ok_or_else(|| format!("there is no table {}", path.display()))?;
        let found = names.map(|name| table.column(name));
        if let Some(n) = found.iter().position(Vec::is_empty) {
            return Err(format!("{} has no column {}", path.display(), names[n]));
        }
        for (name, values) in names.iter().zip(&found) {
            let words = table.words(name);
            if let Some((word, _)) =
                words.iter().zip(values).find(|(word, value)| !value.is_finite() && !word.is_empty())
            {
                return Err(format!("{} has `{word}` in column {name}", path.display()));
            }
        }
        Ok(found)
    }
}

impl Drop for WholeRun {
    fn drop(&mut self) {
        // What cannot be removed stays in the folder for such things.
        let _ = std::fs::remove_dir_all(&self.folder);
    }
}

/// The number at `pointer` of a summary.
pub(crate) fn number(summary: &Value, pointer: &str) -> Result<Real, String> {
    summary.pointer(pointer).and_then(Value::as_f64).ok_or_else(|| format!("the summary has no number at {pointer}"))
}
