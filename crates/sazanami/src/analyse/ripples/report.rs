//! The table at the end of a run with moving particles.

use std::path::Path;

use sazanami_numerics::Real;
use serde_json::Value;

use super::cycles::{CycleAverage, QUANTITIES};
use super::measured::Compared;
use super::tables::RunTables;
use crate::analyse::lines::{has_liquid, labelled, number, overlap};
use crate::analyse::output::newest_picture;
use crate::analyse::table::Table;
use crate::check::bed_flow;
use crate::error::CommandError;
use crate::progress::{duration, time};
use crate::results::{BED_PROFILES, LAYER_MEANS, SERIES, WATER_PROFILES};

/// A label and what stands beside it.
pub(super) type Row = (String, String);

/// The table at the end of a run, with its newest picture.
pub(super) fn lines(
    folder: &Path,
    tables: &RunTables,
    cycles: &[CycleAverage],
    compared: &[Compared],
) -> Result<Vec<String>, CommandError> {
    let mut rows = rows(folder, tables, cycles, compared)?;
    if let Some(picture) = newest_picture(folder, "grains-") {
        rows.push(("picture".into(), picture.display().to_string()));
    }
    Ok(labelled(&rows))
}

/// Labels and values of that table.
pub(super) fn rows(
    folder: &Path,
    tables: &RunTables,
    cycles: &[CycleAverage],
    compared: &[Compared],
) -> Result<Vec<Row>, CommandError> {
    let series = Table::read(&folder.join(SERIES))?;
    let mut rows = of_run(&tables.summary);
    rows.extend(of_forms(tables));
    rows.extend(of_relief(tables));
    rows.extend(of_layers(cycles));
    rows.extend(of_water(&tables.summary));
    rows.extend(series.as_ref().and_then(above_rim));
    rows.extend(of_scheme(&tables.summary));
    rows.extend(compared.iter().flat_map(Compared::rows));
    rows.extend(absent(folder, tables)?);
    Ok(rows)
}

fn row(label: &str, value: impl Into<String>) -> Row {
    (label.to_owned(), value.into())
}

/// A number of the summary: label, place, how it is told.
type Told<'a> = (&'a str, &'a [&'a str], &'a dyn Fn(Real) -> String);

fn of_run(summary: &Value) -> Vec<Row> {
    let counted = |value: Real| format!("{value:.0}");
    let all: [Told; 7] = [
        ("time simulated", &["time_s"], &time),
        ("steps", &["steps"], &counted),
        ("grain sub-steps", &["grain_substeps"], &counted),
        ("wall-clock time", &["wall_s"], &duration),
        ("fluid particles", &["counts", "fluid_particles"], &counted),
        ("grains", &["counts", "grains"], &counted),
        ("bed: porosity", &["observables", "bed", "porosity"], &|value| format!("{value:.4}")),
    ];
    all.into_iter().filter_map(|(label, path, text)| Some(row(label, text(number(summary, path)?)))).collect()
}

fn of_relief(tables: &RunTables) -> Vec<Row> {
    let mut rows = Vec::new();
    if let Some((_, relief)) = tables.relief.last() {
        rows.push(row("relief of the bed, all wavelengths, rms", format!("{:.3} mm", 1e3 * relief)));
    }
    if let Some((growth, per)) = tables.growth() {
        let text = format!("{:+.3} +- {:.3} 1/s over {} {per}", growth.rate, growth.standard_error, growth.points);
        rows.push(row("  growth", text));
    }
    rows
}

/// Mound and ripples apart, and what the flow would make of a bed.
fn of_forms(tables: &RunTables) -> Vec<Row> {
    let Some(forms) = &tables.forms else { return Vec::new() };
    let mm = |metres: Real| format!("{:.1} mm", 1e3 * metres);
    let mound = forms.mound.map_or_else(
        |problem| format!("none: {problem}"),
        |mound| {
            format!("{} long, {} high, highest at x1 = {}", mm(mound.wavelength), mm(mound.height), mm(mound.crest))
        },
    );
    let ripples = forms.ripples.as_ref().map_or_else(
        |problem| format!("none: {problem}"),
        |found| {
            let error = found.uncertainty.map_or_else(String::new, |error| format!(" +- {}", mm(error)));
            let (count, height) = (found.crests.len(), mm(found.height));
            format!("{count} crests, {}{error} apart, {height} high", mm(found.wavelength))
        },
    );
    let mut rows = vec![row("mound", mound), row("ripples", ripples)];
    if let Some(flow) = bed_flow(&tables.case) {
        let orbit = format!(
            "orbital amplitude {}, mobility number {:.2} (linear theory)",
            mm(flow.orbital_amplitude_m),
            flow.mobility
        );
        let lengths: Vec<String> =
            flow.predicted.iter().map(|one| format!("{} ({})", mm(one.wavelength_m), one.source)).collect();
        rows.extend([row("  flow over the bed", orbit), row("  wavelengths expected", lengths.join(", "))]);
    }
    rows
}

fn of_layers(cycles: &[CycleAverage]) -> Vec<Row> {
    let text = |quantity: &str| {
        let [upper, lower] = CycleAverage::half_ranges(cycles, quantity)?;
        let name = quantity.trim_end_matches("_1").replace('_', " ");
        let ratio = upper / lower;
        Some((format!("  {name}, half range, upper / lower"), format!("{upper:.3e} / {lower:.3e} = {ratio:.2}")))
    };
    QUANTITIES.into_iter().filter_map(text).collect()
}

/// What belongs to the water, if there is any.
fn of_water(summary: &Value) -> Vec<Row> {
    let mut rows = Vec::new();
    if !has_liquid(summary) {
        return rows;
    }
    if let Some(extent) = number(summary, &["observables", "water", "highest_less_lowest_mm"]) {
        rows.push(row("water surface, highest less lowest", format!("{extent:.2} mm")));
    }
    for (label, key) in [
        ("bulk volume of the water, change", "fluid_bulk_volume_relative_change"),
        ("drag given and taken, residual", "drag_exchange_residual_relative"),
    ] {
        if let Some(value) = number(summary, &["conservation", key]) {
            rows.push(row(label, if value == 0.0 { "0".to_owned() } else { format!("{value:+.2e}") }));
        }
    }
    rows.extend(momentum_residual(&summary["conservation"]["fluid_momentum_residual_relative"]));
    rows
}

/// Part of the water's momentum that is not accounted for, over the impulse of the body force: direction by direction,
/// or of all of them together, as earlier versions wrote it.
fn momentum_residual(residual: &Value) -> Option<Row> {
    let one = |value: &Value| value.as_f64().map_or("no such force".into(), |value| format!("{value:.1e}"));
    let text = match residual {
        Value::Array(parts) => {
            let named = parts.iter().enumerate().map(|(d, part)| format!("x{} {}", d + 1, one(part)));
            named.collect::<Vec<_>>().join(", ")
        }
        Value::Number(_) => one(residual),
        _ => return None,
    };
    Some(row("momentum of the water, residual over body force", text))
}

/// The most water that stood above the rim of an open tank, if the run looked and there was any.
fn above_rim(series: &Table) -> Option<Row> {
    let most = series.column("particles_above_rim").into_iter().fold(0.0, Real::max);
    (most > 0.0).then(|| row("water above the rim, at most", format!("{most:.0} particles")))
}

fn of_scheme(summary: &Value) -> Vec<Row> {
    let mut rows = Vec::new();
    let has_liquid = has_liquid(summary);
    if let Some(value) = number(summary, &["particles", "worst_strain_rms"]).filter(|_| has_liquid) {
        rows.push(row("largest volume strain, rms", format!("{:.2} %", 1e2 * value)));
    }
    rows.extend(overlap(summary, "a radius").map(|value| row("largest overlap of grains", value)));
    if !has_liquid {
        return rows;
    }
    let counted = ["clipped", "collisions", "limited_voids", "uncorrected_gradients"]
        .map(|key| number(summary, &["particles", key]));
    if let [Some(clipped), Some(collisions), Some(voids), Some(plain)] = counted {
        let text = format!("{clipped:.0}, {collisions:.0}, {voids:.0}, {plain:.0}");
        rows.push(row("put back, bounced, voids limited, uncorrected", text));
    }
    rows
}

/// A line for each table that the run should have left and did not.
fn absent(folder: &Path, tables: &RunTables) -> Result<Vec<Row>, CommandError> {
    let observes = tables.case.ripples.is_some();
    let expected = [
        (BED_PROFILES, observes, "no mound, no ripples, no growth"),
        (WATER_PROFILES, true, "no surface of the water"),
        (LAYER_MEANS, observes, "no averages over layers"),
        (SERIES, true, "nothing of single steps"),
    ];
    let mut rows = Vec::new();
    for (name, _, lost) in expected.into_iter().filter(|(_, expected, _)| *expected) {
        if Table::read(&folder.join(name))?.is_none_or(|table| table.is_empty()) {
            rows.push(row(&format!("{name}: absent or empty"), lost));
        }
    }
    Ok(rows)
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::*;

    #[test]
    fn a_tank_without_water_has_no_lines_of_water() {
        let told = |change: Value| {
            let summary = json!({
                "conservation": { "liquid_volume_relative_change": change, "drag_exchange_residual_relative": 0.0,
                                  "fluid_momentum_residual_relative": [null, null, null] },
                "worst": { "overlap_relative": 0.01 },
                "particles": { "worst_strain_rms": 0.0, "clipped": 0, "collisions": 0, "limited_voids": 0, "uncorrected_gradients": 0 },
            });
            of_water(&summary).into_iter().chain(of_scheme(&summary)).map(|(label, _)| label).collect::<Vec<_>>()
        };
        assert_eq!(told(Value::Null), ["largest overlap of grains"]);
        // The control: with water there are all.
        assert_eq!(told(json!(1e-4)).len(), 5);
    }
}
