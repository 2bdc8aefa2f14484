//! One run evaluated again from its newest checkpoint: as its case says, or with other keys.

use std::path::Path;

use sazanami_numerics::Real;
use serde_json::{Value, json};

use super::lines::{number, report};
use super::output::{Output, list_files, undone};
use super::pictures::draw_pictures;
use super::summary_file::{summary, write_evaluation};
use crate::case::{self, CRATERS_EVALUATED, LoadedCase};
use crate::checkpoints::{self, unreadable};
use crate::error::CommandError;
use crate::feasible;
use crate::recorder::{self, Beds, Reevaluated};
use crate::results::{ANALYSIS, CASE};

/// Relative difference of two erosion volumes that are meant to be the same.
const SAME_VOLUME: Real = 1e-9;

/// A checkpoint evaluated again.
struct Reevaluation {
    /// Name of the checkpoint, relative to the folder of results.
    checkpoint: String,
    step: u64,
    /// Simulated time \[s].
    time: Real,
    found: Reevaluated,
}

/// Draws the pictures of a run anew and evaluates its newest checkpoint as its case says; warns where the summary has
/// another erosion volume.
pub(super) fn as_it_was(folder: &Path, output: &mut Output) -> Result<Vec<String>, CommandError> {
    let summary = summary(folder)?;
    list_files(folder, &summary)?;
    if let Err(error) = draw_pictures(folder, &summary, output) {
        output.message(&format!("sections and views were not drawn anew: {error}"));
    }
    let again = evaluate(folder, None, output).unwrap_or_else(|error| {
        output.message(&format!("what the summary says was not found again: {error}"));
        None
    });
    let Some(again) = again else { return Ok(report(&summary, None, folder)) };
    report_step(&again, &summary, output);
    let found = with_observables(&summary, &again.found);
    warn_of_volume(&again, &summary, &found, output);
    Ok(report(&summary, Some(&found), folder))
}

/// Evaluates the newest checkpoint of a run with other keys; what is found goes into a folder of its own.
pub(super) fn with_other_keys(
    folder: &Path,
    overrides: &[String],
    output: &mut Output,
) -> Result<Vec<String>, CommandError> {
    let asked = case::load_evaluated(&folder.join(CASE), overrides, &CRATERS_EVALUATED)?;
    let summary = summary(folder)?;
    let Some(again) = evaluate(folder, Some(&asked), output)? else {
        return Err(CommandError::input(
            format!("`{}` holds no good checkpoint of the flow: there is nothing to evaluate again", folder.display()),
            "run the case with these keys: `sazanami run CASE.toml --set ...`",
        ));
    };
    report_step(&again, &summary, output);
    write(folder, overrides, &summary, &again, output)?;
    list_files(folder, &summary)?;
    Ok(report(&summary, Some(&with_observables(&summary, &again.found)), folder))
}

/// Evaluates the newest good checkpoint in `folder`, as the run did or with the keys of `asked`; `None` if there is
/// none, or none of the flow.
fn evaluate(
    folder: &Path,
    asked: Option<&LoadedCase>,
    output: &mut Output,
) -> Result<Option<Reevaluation>, CommandError> {
    let Some((step, reader)) = checkpoints::newest(folder, output.progress)?.good else { return Ok(None) };
    let run = checkpoints::run_state(&reader)?;
    if !run.flows() {
        return Ok(None);
    }
    let case_file = folder.join(CASE);
    let own = case::load(&case_file, &[])?;
    if !run.is_of(&own) {
        output.message(&format!(
            "warning: `{}` is not the case that this run began with: it was changed since, or another version of \
             sazanami wrote it",
            case_file.display()
        ));
    }
    let shapes = feasible::shapes_alone(&own)?;
    let snapshot = reader.snapshot_of(recorder::is_observed).map_err(unreadable)?;
    let beds = Beds::of(&own.case, &shapes, snapshot)?;
    if asked.is_some() && !beds.know_before() {
        return Err(CommandError::input(
            format!(
                "`{}` does not hold the bed before the impact, as an earlier version wrote it: it cannot be evaluated \
                 with other keys after the run",
                reader.path().display()
            ),
            "analyse it without `--set`, or run the case with these keys",
        ));
    }
    let found = beds.evaluate(&asked.unwrap_or(&own).case, &own.case, &shapes);
    let checkpoint = reader.path().strip_prefix(folder).unwrap_or(reader.path()).display().to_string();
    Ok(Some(Reevaluation { checkpoint, step, time: run.time, found }))
}

/// The summary with what was found in place of its observables.
fn with_observables(summary: &Value, found: &Reevaluated) -> Value {
    let mut again = summary.clone();
    again["observables"] = Value::Object(found.observables());
    again
}

/// Says which step was evaluated, if the summary is of another.
fn report_step(again: &Reevaluation, summary: &Value, output: &mut Output) {
    if summary["steps"].as_u64() != Some(again.step) {
        output.message(&format!(
            "evaluated {}, step {} at {:.3} ms; the summary is of step {}",
            again.checkpoint,
            again.step,
            1e3 * again.time,
            summary["steps"]
        ));
    }
}

/// Warns if the summary has another erosion volume of the same state.
fn warn_of_volume(again: &Reevaluation, summary: &Value, found: &Value, output: &mut Output) {
    // While a run goes on, or where it failed, the last measurement may be older than the checkpoint.
    let is_last = summary["status"] == "finished" || summary["status"] == "stopped";
    if !is_last || summary["steps"].as_u64() != Some(again.step) {
        return;
    }
    let volume = |of: &Value| number(of, &["observables", "erosion", "volume_mm3"]);
    if let (Some(now), Some(then)) = (volume(found), volume(summary))
        && (now - then).abs() > SAME_VOLUME * now.abs().max(then.abs())
    {
        output.message(&format!(
            "warning: the erosion volume found again is {now:.9} mm^3, and the summary of the same step says \
             {then:.9} mm^3"
        ));
    }
}

/// Writes what was found with other keys.
fn write(
    folder: &Path,
    overrides: &[String],
    summary: &Value,
    again: &Reevaluation,
    output: &mut Output,
) -> Result<(), CommandError> {
    let place = folder.join(ANALYSIS);
    std::fs::create_dir_all(&place).map_err(undone)?;
    let found = [
        ("checkpoint".to_owned(), json!(again.checkpoint)),
        ("time_s".to_owned(), json!(again.time)),
        ("steps".to_owned(), json!(again.step)),
        ("observables".to_owned(), Value::Object(again.found.observables())),
    ];
    write_evaluation(&place, overrides, summary, found.into_iter().collect(), output)
}
