//! Observables, tables and pictures from what runs wrote.

mod craters;
mod lines;
mod output;
mod pictures;
mod reevaluated;
mod ripples;
mod summary_file;
mod table;

use std::path::{Path, PathBuf};

use serde_json::Value;

use crate::artist::Artist;
use crate::error::CommandError;
use crate::progress::Progress;
use lines::report;
use output::{Output, list_files, undone};
pub(crate) use summary_file::summary;

pub(crate) use ripples::CYCLE_COLUMNS;
pub use ripples::{LayerHistory, layer_history};
pub use table::{Cells, Table};

/// Evaluates one run again, or compares several; returns lines for the terminal.
///
/// One run is evaluated again from its newest good checkpoint of the flow, ripples from the tables that it wrote;
/// `overrides` (`path=value`, of keys under `bed` and `erosion`, or [`crate::case::RIPPLES_EVALUATED`]) say how, and what is then
/// found goes into the folder `analysis` of the run's own. Tables of a comparison go into the folder `out`, the
/// current one unless it is given. An `artist` draws the sections and views of a run on a grid again.
///
/// # Errors
/// If a folder holds no results, or a file cannot be written; if other keys are overridden, or those of several
/// runs, or those of a run that left nothing to be evaluated again.
pub fn analyse(
    folders: &[PathBuf],
    overrides: &[String],
    out: Option<&Path>,
    artist: Option<&dyn Artist>,
    progress: &mut dyn Progress,
) -> Result<Vec<String>, CommandError> {
    let output = &mut Output { artist, progress };
    let is_compared = folders.len() > 1;
    if let Some(out) = out {
        if !is_compared {
            return Err(CommandError::input(
                "`--out` is for the tables of a comparison, and one run is given",
                "leave it out: what is found goes into the folder of the run",
            ));
        }
        std::fs::create_dir_all(out).map_err(undone)?;
    }
    let place = out.unwrap_or(Path::new(""));
    match folders {
        [] => Err(CommandError::input("no folder of results is given", "give one or more folders of runs")),
        [folder] if has_moving_particles(&summary(folder)?) => ripples::of_run(folder, overrides, output),
        [folder] if overrides.is_empty() => reevaluated::as_it_was(folder, output),
        [folder] => reevaluated::with_other_keys(folder, overrides, output),
        many if overrides.is_empty() => {
            let summaries = many.iter().map(|folder| summary(folder)).collect::<Result<Vec<_>, _>>()?;
            let moving = summaries.iter().filter(|summary| has_moving_particles(summary)).count();
            match moving {
                0 => craters::several(many, place, output),
                all if all == many.len() => ripples::several(many, place, output),
                _ => Err(CommandError::input(
                    "craters and ripples cannot be put into one table",
                    "analyse the runs with `solver = \"mics\"` and those with `solver = \"mps\"` apart",
                )),
            }
        }
        many => Err(CommandError::input(
            format!("`--set` changes how one run is evaluated, and {} folders are given", many.len()),
            "analyse them one by one with it, or compare them without it",
        )),
    }
}

/// Findings of a run, as at its end: labels and values with their units. Labels that belong to the one above are indented.
///
/// # Errors
/// If the tables of the run cannot be read.
pub fn findings(folder: &Path, summary: &Value) -> Result<Vec<(String, String)>, CommandError> {
    if has_moving_particles(summary) {
        return ripples::rows_of(folder);
    }
    Ok(lines::rows(summary).into_iter().map(|(label, value)| (label.to_owned(), value)).collect())
}

/// Whether there was liquid in a run, by its summary.
#[must_use]
pub fn has_liquid(summary: &Value) -> bool {
    lines::has_liquid(summary)
}

/// The newest picture of a run that shows its grains: a view, or a tank from the side.
#[must_use]
pub fn newest_view(folder: &Path) -> Option<PathBuf> {
    ["view-", "grains-"].into_iter().find_map(|prefix| output::newest_picture(folder, prefix))
}

/// The newest section of a run through bed and water, with the measures of its crater.
#[must_use]
pub fn newest_section(folder: &Path) -> Option<PathBuf> {
    output::newest_picture(folder, "section-")
}

/// Whether a summary is that of a run with moving particles.
fn has_moving_particles(summary: &Value) -> bool {
    summary["solver"] == "mps"
}

/// Evaluates the tables of a run at its end; returns what its summary says.
///
/// # Errors
/// If the folder holds no results, or a file cannot be written.
pub(crate) fn present(folder: &Path, progress: &mut dyn Progress) -> Result<Vec<String>, CommandError> {
    let summary = summary(folder)?;
    if has_moving_particles(&summary) {
        return ripples::of_run(folder, &[], &mut Output { artist: None, progress });
    }
    list_files(folder, &summary)?;
    Ok(report(&summary, None, folder))
}

#[cfg(test)]
mod tests {
    use super::craters::comparable;
    use super::output::free_path;
    use super::*;
    use crate::progress::Silent;
    use crate::results::SUMMARY;
    use sazanami_numerics::Real;
    use sazanami_observe::erosion::{NOT_AT_REST, REST_UNKNOWN};

    fn run(parent: &Path, name: &str, status: &str, time: Real, momentum: [Real; 3]) -> PathBuf {
        let folder = parent.join(name);
        std::fs::create_dir_all(&folder).unwrap();
        let summary = serde_json::json!({
            "case": name,
            "status": status,
            "time_s": time,
            "momentum": { "initial": { "liquid": momentum } },
            "observables": { "erosion": { "volume_mm3": 5.0 } },
        });
        std::fs::write(folder.join(SUMMARY), summary.to_string()).unwrap();
        folder
    }

    /// Changes the summary of a run.
    fn change(folder: &Path, how: impl FnOnce(&mut Value)) {
        let mut changed = summary(folder).unwrap();
        how(&mut changed);
        std::fs::write(folder.join(SUMMARY), changed.to_string()).unwrap();
    }

    #[test]
    fn runs_that_failed_or_end_before_their_crater_rests_are_left_out() {
        let place = tempfile::tempdir().unwrap();
        let parent = place.path();
        let folders = [
            run(parent, "straight", "finished", 0.02, [0.0, 0.0, -5e-4]),
            run(parent, "slanted", "stopped", 0.02, [3e-4, 0.0, -4e-4]),
            run(parent, "short", "finished", 0.01, [0.0, 0.0, -5e-4]),
            run(parent, "broken", "failed", 0.02, [0.0, 0.0, -5e-4]),
            run(parent, "rests", "finished", 0.015, [0.0, 0.0, -5e-4]),
        ];
        change(&folders[1], |summary| summary["observables"]["crater_rest"]["at_rest"] = false.into());
        change(&folders[4], |summary| summary["observables"]["crater_rest"]["at_rest"] = true.into());
        let (runs, lines) = comparable(&folders).unwrap();
        let names: Vec<&str> = runs.iter().map(|run| run.name.as_str()).collect();
        assert_eq!(names, ["straight", "slanted", "rests"]);
        // The same bits once more are no scatter.
        let mut twice = folders.to_vec();
        for (name, hash) in [("one", "a"), ("same", "a"), ("other", "b")] {
            let folder = run(parent, name, "finished", 0.02, [0.0, 0.0, -5e-4]);
            change(&folder, |summary| summary["state_hash"] = hash.into());
            twice.push(folder);
        }
        let (all, said) = comparable(&twice).unwrap();
        assert_eq!(all.len(), runs.len() + 2);
        assert!(said.contains(&"same: left out, it has the bits of one".to_owned()), "{said:#?}");
        let doubts: Vec<&str> = runs.iter().map(|run| run.below_rim.doubts.as_str()).collect();
        assert_eq!(doubts, [REST_UNKNOWN, NOT_AT_REST, ""]);
        assert!(runs.iter().all(|run| (run.momentum - 5e-4).abs() < 1e-15), "{runs:?}");
        let left_out: Vec<&String> = lines.iter().filter(|line| line.contains("left out")).collect();
        assert_eq!(left_out.len(), 2, "{lines:#?}");
        assert!(left_out[0].starts_with("broken: ") && left_out[1].starts_with("short: "), "{lines:#?}");
    }

    #[test]
    fn runs_of_which_none_has_a_crater_are_not_compared() {
        let place = tempfile::tempdir().unwrap();
        let folders = ["a", "b"].map(|name| run(place.path(), name, "finished", 0.02, [0.0; 3]));
        let compared = || {
            let mut output = Output { artist: None, progress: &mut Silent };
            craters::several(&folders, place.path(), &mut output)
        };
        // Negative control: with craters.
        assert!(compared().is_ok());
        folders.iter().for_each(|folder| change(folder, |summary| summary["observables"] = Value::Null));
        let error = compared().unwrap_err().to_string();
        assert!(error.contains("none of these runs has a crater") && error.contains("a: left out"), "{error}");
    }

    #[test]
    fn tables_of_comparisons_are_numbered() {
        let folder = tempfile::tempdir().unwrap();
        for expected in ["a.csv", "a-2.csv", "a-3.csv"] {
            let path = free_path(folder.path(), "a");
            assert_eq!(path, folder.path().join(expected));
            std::fs::write(path, "").unwrap();
        }
    }

    #[test]
    fn a_crater_without_a_volume_has_a_line() {
        let place = tempfile::tempdir().unwrap();
        let folder = run(place.path(), "a", "finished", 0.02, [0.0; 3]);
        let reported = |lines: &[String]| lines.iter().any(|line| line.contains("not evaluated: no rim"));
        assert!(!reported(&analyse(std::slice::from_ref(&folder), &[], None, None, &mut Silent).unwrap()));
        std::fs::write(folder.join(SUMMARY), r#"{ "observables": { "erosion": { "not_evaluated": "no rim" } } }"#)
            .unwrap();
        assert!(reported(&analyse(std::slice::from_ref(&folder), &[], None, None, &mut Silent).unwrap()));
    }
}
