//! Runs with moving particles: ripples, averages over layers and measured profiles, from the tables that they wrote.

mod comparison;
mod cycles;
mod findings;
mod measured;
mod report;
mod surfaces;
mod tables;

use std::path::Path;

use serde_json::{Map, Value, json};

use super::figures::list_files;
use super::output::{Output, undone};
use super::summary_file::write_evaluation;
use crate::artist::{Figure, RippleHistory};
use crate::case::meaning::{Case, LayerReference};
use crate::case::{self, RIPPLES_EVALUATED};
use crate::error::CommandError;
use crate::recorder::{self, weight_of_grain};
use crate::results::{ANALYSIS, CASE, CYCLES, FIGURES};
use tables::RunTables;

pub(super) use comparison::several;
pub(crate) use cycles::CYCLE_COLUMNS;
pub use cycles::layer_history;

/// Figures of a run.
const LAYERS_FIGURE: &str = "layers.png";
const GROWTH_FIGURE: &str = "growth.png";
const PROFILES_FIGURE: &str = "profiles.png";

/// Draws the figures of a run and reports what its tables show, evaluated as `overrides` of keys under `ripples` ask. What
/// the tables show of the whole run goes into its summary, or into one of its own if keys are overridden.
pub(super) fn of_run(folder: &Path, overrides: &[String], output: &mut Output) -> Result<Vec<String>, CommandError> {
    let loaded = case::load_evaluated(&folder.join(CASE), overrides, &RIPPLES_EVALUATED)?;
    let tables = RunTables::read(folder, loaded)?;
    let figures = if overrides.is_empty() { folder.join(FIGURES) } else { folder.join(ANALYSIS) };
    std::fs::create_dir_all(&figures).map_err(undone)?;
    for name in [LAYERS_FIGURE, GROWTH_FIGURE, PROFILES_FIGURE] {
        // Figures of an earlier call would stand beside other values.
        let _ = std::fs::remove_file(figures.join(name));
    }
    let name = tables.summary["case"].as_str().unwrap_or("run").to_owned();
    let layers = layer_history(folder)?;
    let cycles = layers.as_ref().zip(tables.period).map(|(layers, period)| cycles::averages(layers, period));
    if let Some(cycles) = cycles.as_ref().filter(|cycles| !cycles.is_empty()) {
        let place = if overrides.is_empty() { folder } else { &figures };
        cycles::write_averages(&place.join(CYCLES), cycles).map_err(undone)?;
    }
    if let Some(history) = &layers {
        let names = layer_names(&tables.case);
        let weight = weight_of_grain(&tables.case);
        let figure = Figure::Layers {
            title: &format!("{name}: averages over the layers of the bed"),
            history,
            layers: names.each_ref().map(String::as_str),
            submerged_weight: (weight > 0.0).then_some(weight),
        };
        output.draw(&figure, &figures.join(LAYERS_FIGURE))?;
    }
    let history = history(&name, &tables);
    if history.height.len() > 1 {
        let figure = Figure::RippleGrowth { title: &format!("{name}: growth of ripples"), runs: &[history] };
        output.draw(&figure, &figures.join(GROWTH_FIGURE))?;
    }
    surfaces::draw(&name, std::slice::from_ref(&tables), &figures.join(PROFILES_FIGURE), output)?;
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
        write_evaluation(&figures, overrides, &tables.summary, found.into_iter().collect(), output)?;
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

fn history(name: &str, tables: &RunTables) -> RippleHistory {
    let measured = || tables.ripples.iter().filter_map(|(time, ripples)| Some((*time, ripples.as_ref().ok()?)));
    RippleHistory {
        label: name.to_owned(),
        height: measured().map(|(time, ripples)| [time, ripples.height()]).collect(),
        wavelength: measured().map(|(time, ripples)| [time, ripples.spectral_wavelength]).collect(),
        measured: false,
    }
}

fn layer_names(case: &Case) -> [String; 2] {
    let Some(ripples) = &case.ripples else { return ["upper".into(), "lower".into()] };
    let thickness = 1e3 * ripples.layer_thickness;
    match ripples.layers {
        LayerReference::Surface => [format!("upper {thickness} mm"), format!("next {thickness} mm")],
        LayerReference::Floor | LayerReference::Initial => {
            [format!("{thickness} to {} mm above the floor", 2.0 * thickness), format!("below {thickness} mm")]
        }
    }
}
