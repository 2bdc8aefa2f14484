//! Reports on runs: one page of HTML that holds all it shows and opens from disk without a network.
//!
//! [`of_run`] makes the page of a run in its folder, [`comparison`] that of several runs side by side.

mod amounts;
mod answer;
mod budgets;
mod charts;
mod compared;
mod html;
mod mesh;
mod page;
mod run;
mod typeset;
mod view;

use std::io::Write as _;
use std::path::{Path, PathBuf};

use sazanami::error::CommandError;
use sazanami::finished::Finished;
use sazanami::results::REPORT;
use sazanami_io::replace_file;

/// Writes the report on the run in `folder` into it; returns its path.
///
/// # Errors
/// If the folder holds no results that can be read, or the file cannot be written.
pub fn of_run(folder: &Path) -> Result<PathBuf, CommandError> {
    written(&folder.join(REPORT), &run::page(&Finished::open(folder)?)?)
}

/// The same at the end of the run itself, which still holds the folder.
///
/// # Errors
/// As [`of_run`].
pub fn at_the_end(folder: &Path) -> Result<PathBuf, CommandError> {
    written(&folder.join(REPORT), &run::page(&Finished::read(folder)?)?)
}

/// Writes a report on several runs into the folder `out`; returns its path.
///
/// # Errors
/// As [`of_run`].
pub fn comparison(folders: &[PathBuf], out: &Path) -> Result<PathBuf, CommandError> {
    let runs = folders.iter().map(|folder| Finished::open(folder)).collect::<Result<Vec<_>, _>>()?;
    std::fs::create_dir_all(out).map_err(|error| unwritable(out, &error))?;
    written(&out.join(REPORT), &compared::page(&runs)?)
}

fn written(path: &Path, page: &str) -> Result<PathBuf, CommandError> {
    replace_file(path, |file| file.write_all(page.as_bytes())).map_err(|error| unwritable(path, &error))?;
    Ok(path.to_owned())
}

fn unwritable(path: &Path, error: &std::io::Error) -> CommandError {
    CommandError::Undone(format!("the report cannot be written to `{}`: {error}", path.display()))
}
