//! Runs with moving particles: ripples, averages over layers and measured profiles, from the tables that they wrote.

mod comparison;
mod cycles;
mod findings;
mod measured;
mod report;
mod tables;

use std::path::Path;

use serde_json::{Map, Value, json};

use super::output::{Output, list_files, undone};
use super::summary_file::write_evaluation;
use crate::case::{self, RIPPLES_EVALUATED};
use crate::error::CommandError;
use crate::recorder;
use crate::results::{ANALYSIS, CASE, CYCLES};
use tables::RunTables;

pub(super) use comparison::several;
pub(crate) use cycles::CYCLE_COLUMNS;
pub use cycles::{LayerHistory, layer_history};

/// Reports what the tables of a run show, evaluated as `overrides` of keys under `ripples` ask. What they show of the whole
/// run goes into its summary, or into one of its own if keys are overridden.
pub(super) fn of_run(folder: &Path, overrides: &[String], output: &mut Output) -> Result<Vec<String>, CommandError> {
    let loaded = case::load_evaluated(&folder.join(CASE), overrides, &RIPPLES_EVALUATED)?;
    let tables = RunTables::read(folder, loaded)?;
    let place = if overrides.is_empty() { folder.to_owned() } else { folder.join(ANALYSIS) };
    std::fs::create_dir_all(&place).map_err(undone)?;
    let layers = layer_history(folder)?;
    let cycles = layers.as_ref().zip(tables.period).map(|(layers, period)| cycles::averages(layers, period));
    if let Some(cycles) = cycles.as_ref().filter(|cycles| !cycles.is_empty()) {
        cycles::write_averages(&place.join(CYCLES), cycles).map_err(undone)?;
    }
    let cycles = cycles.unwrap_or_default();
    let compared = measured::compared(&tables);
    let found = findings::of_history(&tables, &cycles, &compared);
    if overrides.is_empty() {
        keep(folder, &tables.summary, found)?;
    } else {
        let mut ripples = findings::at_the_end(&tables);
        ripples.extend(found);
        let found =
            [("time_s".to_owned(), json!(tables.end())), ("observables".to_owned(), json!({ "ripples": ripples }))];
        write_evaluation(&place, overrides, &tables.summary, found.into_iter().collect(), output)?;
    }
    list_files(folder, &tables.summary)?;
    report::lines(folder, &tables, &cycles, &compared)
}

/// Labels and values of the table at the end of a run, as its own case evaluates it.
pub(super) fn rows_of(folder: &Path) -> Result<Vec<(String, String)>, CommandError> {
    let loaded = case::load(&folder.join(CASE), &[])?;
    let tables = RunTables::read(folder, loaded)?;
    let layers = layer_history(folder)?.zip(tables.period);
    let cycles = layers.map(|(layers, period)| cycles::averages(&layers, period)).unwrap_or_default();
    report::rows(folder, &tables, &cycles, &measured::compared(&tables))
}

/// Puts what was found into the summary of a run that has ended.
fn keep(folder: &Path, summary: &Value, found: Map<String, Value>) -> Result<(), CommandError> {
    if summary["status"] == "running" || found.is_empty() {
        return Ok(());
    }
    recorder::put_ripples(folder, found).map_err(undone)
}
