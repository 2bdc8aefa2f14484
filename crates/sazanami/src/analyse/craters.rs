//! Several runs with craters: erosion volume against the momentum of the drop.

use std::collections::HashMap;
use std::path::{Path, PathBuf};

use sazanami_io::table::write_csv;
use sazanami_numerics::Real;
use sazanami_observe::comparison::{Comparison, RunResult, Series};
use sazanami_observe::erosion::RIM_AT_EDGE;

use super::lines::{aligned, number};
use super::output::{Output, free_path, undone};
use super::summary_file::summary;
use super::table::Table;
use crate::case;
use crate::case::meaning::{FluidName, Region};
use crate::error::CommandError;
use crate::results::{CASE, SERIES};

/// Axis ratio of the first liquid of a case, horizontal over vertical.
fn axis_ratio(folder: &Path) -> Real {
    let Ok(loaded) = case::load(&folder.join(CASE), &[]) else { return 1.0 };
    let drop = loaded.case.liquids.iter().find(|liquid| liquid.fluid == FluidName::Liquid);
    match drop.map(|liquid| &liquid.region) {
        Some(Region::Spheroid { horizontal_diameter, vertical_diameter, .. }) => {
            horizontal_diameter / vertical_diameter
        }
        _ => 1.0,
    }
}

/// Relative distance of the ends of runs that are compared.
const SAME_END: Real = 0.01;

/// The end that most runs have, the latest of those that equally many have \[s].
fn common_end(ends: impl Iterator<Item = Real> + Clone) -> Real {
    let alike = |end: Real| ends.clone().filter(|&other| is_same_end(other, end)).count();
    ends.clone().max_by(|&a, &b| alike(a).cmp(&alike(b)).then(a.total_cmp(&b))).unwrap_or_default()
}

fn is_same_end(a: Real, b: Real) -> bool {
    (a - b).abs() <= SAME_END * a.abs().max(b.abs())
}

/// Part of a run at its end in which a crater that has come to rest no longer changes.
const LAST_PART: Real = 0.1;

/// Relative change of the erosion volume over the last part of a run, by its series; `None` where there is no volume.
fn late_change(series: &Table) -> Option<Real> {
    let (times, volumes) = (series.column("time"), series.column("erosion_volume"));
    let (end, last) = (*times.last()?, *volumes.last()?);
    let before = times.iter().rposition(|&time| time <= (1.0 - LAST_PART) * end)?;
    let change = (last - volumes.get(before)?) / last;
    change.is_finite().then_some(change)
}

/// The runs that can be compared, and a line about each that cannot, or that was stopped.
pub(super) fn comparable(folders: &[PathBuf]) -> Result<(Vec<RunResult>, Vec<String>), CommandError> {
    let mut found: Vec<(Real, RunResult)> = Vec::new();
    let mut lines = Vec::new();
    let mut states: HashMap<String, String> = HashMap::new();
    for folder in folders {
        let summary = summary(folder)?;
        let name =
            folder.file_name().map_or_else(|| folder.display().to_string(), |n| n.to_string_lossy().into_owned());
        // One run that is there twice is no scatter.
        if let Some(state) = summary["state_hash"].as_str()
            && let Some(same) = states.insert(state.to_owned(), name.clone())
        {
            lines.push(format!("{name}: left out, it has the bits of {same}"));
            continue;
        }
        let status = summary["status"].as_str().unwrap_or("unknown");
        let end = number(&summary, &["time_s"]).unwrap_or_default();
        if status == "failed" {
            lines.push(format!("{name}: left out, it failed at {:.3} ms", 1e3 * end));
            continue;
        }
        let erosion = |key: &str| number(&summary, &["observables", "erosion", key]);
        let Some(volume) = erosion("volume_mm3") else {
            lines.push(format!("{name}: left out, it is {status} without an erosion volume"));
            continue;
        };
        if status != "finished" {
            lines.push(format!("{name}: {status} at {:.3} ms", 1e3 * end));
        }
        let momentum = &summary["momentum"]["initial"]["liquid"];
        let momentum = (0..3).map(|d| momentum[d].as_f64().unwrap_or_default().powi(2)).sum::<Real>().sqrt();
        let result = RunResult {
            name,
            momentum,
            axis_ratio: axis_ratio(folder),
            volume: 1e-9 * volume,
            uncertainty: 1e-9 * erosion("volume_uncertainty_mm3").unwrap_or_default(),
            noise: 1e-9 * erosion("volume_noise_mm3").unwrap_or_default(),
            below_rim: 1e-9 * erosion("volume_below_rim_mm3").unwrap_or_default(),
            below_rim_uncertainty: 1e-9 * erosion("volume_below_rim_uncertainty_mm3").unwrap_or_default(),
            depth: 1e-3 * erosion("depth_mm").unwrap_or_default(),
            rim_radius: 1e-3 * erosion("rim_radius_mm").unwrap_or_default(),
            splashed: number(&summary, &["observables", "splash", "grains"]).unwrap_or_default() as usize,
            rim_at_edge: summary["observables"]["erosion"]["rim_at_edge"].as_bool().unwrap_or_default(),
            late_change: Table::read(&folder.join(SERIES))?.as_ref().and_then(late_change),
        };
        found.push((end, result));
    }
    let common = common_end(found.iter().map(|&(end, _)| end));
    let (alike, others): (Vec<_>, Vec<_>) = found.into_iter().partition(|&(end, _)| is_same_end(end, common));
    lines.extend(others.into_iter().map(|(end, run)| {
        format!("{}: left out, it ends at {:.3} ms and the others at {:.3} ms", run.name, 1e3 * end, 1e3 * common)
    }));
    Ok((alike.into_iter().map(|(_, run)| run).collect(), lines))
}

/// Compares runs: a table for the terminal, and as a file in the folder `out`.
pub(super) fn several(folders: &[PathBuf], out: &Path, output: &mut Output) -> Result<Vec<String>, CommandError> {
    let (runs, mut lines) = comparable(folders)?;
    let comparison = Comparison::of(runs);
    let header = Comparison::COLUMNS.map(|(name, _)| name.to_owned());
    let rows = comparison.rows();
    if !rows.is_empty() {
        write(&free_path(out, "crater-comparison"), &header, &rows, output)?;
    }
    lines.extend(aligned(&header, &rows));
    lines.extend(comparison.series.iter().flat_map(conclusions));
    Ok(lines)
}

/// Writes the table of a comparison as CSV.
fn write(path: &Path, header: &[String; 12], rows: &[[String; 12]], output: &mut Output) -> Result<(), CommandError> {
    write_csv(path, std::iter::once(header).chain(rows)).map_err(undone)?;
    output.message(&format!("wrote {}", path.display()));
    Ok(())
}

/// The law through a series with what speaks against it, and the scatter of repeated runs.
fn conclusions(series: &Series) -> Vec<String> {
    let mut lines = Vec::new();
    let left_out: Vec<String> =
        series.runs.iter().filter_map(|run| Some(format!("{} ({})", run.name, run.doubt()?.words()))).collect();
    let shape = format!("D_H/D_V = {:.2}", series.axis_ratio);
    if !left_out.is_empty() {
        lines.push(format!("{shape}: no part of a law: {}", left_out.join(", ")));
        if series.runs.iter().any(|run| run.rim_at_edge) {
            lines.push(format!("warning: where {RIM_AT_EDGE}, V is not reliable: make the box wider"));
        }
    }
    match &series.law {
        Some(law) => {
            let error = law.standard_error.map_or_else(String::new, |error| format!(" +- {error:.2}"));
            lines.push(format!("{shape}: V ~ (m v)^{:.2}{error} over {} runs", law.exponent, law.points));
        }
        None => lines.push(format!("{shape}: no law: it takes two runs at rest with different momenta")),
    }
    for scatter in series.scatter().iter().filter(|scatter| scatter.runs > 1) {
        lines.push(format!(
            "m v = {:.1} g cm/s: {:.2} mm^3 below the rim, deviation {:.2} mm^3; V = {:.2} mm^3, deviation {:.2} mm^3, over {} runs",
            1e5 * scatter.momentum,
            1e9 * scatter.below_rim[0],
            1e9 * scatter.below_rim[1],
            1e9 * scatter.mean,
            1e9 * scatter.deviation,
            scatter.runs
        ));
    }
    lines
}
