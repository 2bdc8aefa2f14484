//! Several runs with craters: erosion volume against the momentum of the drop.

use std::collections::HashMap;
use std::path::{Path, PathBuf};

use sazanami_io::table::write_csv;
use sazanami_numerics::{Real, Vector};
use sazanami_observe::comparison::{Comparison, PowerLaw, Repeated, RunResult, Series, Volume};
use sazanami_observe::erosion::{NO_CRATER, NOT_AT_REST, REST_UNKNOWN, RIM_AT_EDGE};

use super::lines::{aligned, number};
use super::output::{Output, free_path, undone};
use super::summary_file::summary;
use crate::case;
use crate::case::meaning::{FluidName, Region};
use crate::error::CommandError;
use crate::results::CASE;

/// Axis ratio of the first liquid of a case that falls, horizontal over vertical; of the first one where none does.
fn axis_ratio(folder: &Path) -> Real {
    let Ok(loaded) = case::load(&folder.join(CASE), &[]) else { return 1.0 };
    let mut drops = loaded.case.liquids.iter().filter(|liquid| liquid.fluid == FluidName::Liquid);
    let drop = drops.clone().find(|drop| drop.velocity != Vector::ZERO).or_else(|| drops.next());
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

/// Doubt about a crater that may change after the end of its run, beside the doubts that are `said` of its volume.
fn unrest(at_rest: Option<bool>, said: &str) -> Option<&'static str> {
    let doubt = match at_rest {
        Some(true) => return None,
        Some(false) => NOT_AT_REST,
        // The run is too short to tell, or has too few rows.
        None => REST_UNKNOWN,
    };
    (![NO_CRATER, NOT_AT_REST].iter().any(|told| said.contains(told))).then_some(doubt)
}

/// The runs that can be compared, and a line about each that cannot, or that was stopped.
pub(super) fn comparable(folders: &[PathBuf]) -> Result<(Vec<RunResult>, Vec<String>), CommandError> {
    let mut found: Vec<(Real, bool, RunResult)> = Vec::new();
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
        if erosion("volume_mm3").is_none() {
            lines.push(format!("{name}: left out, it is {status} without an erosion volume"));
            continue;
        }
        if status != "finished" {
            lines.push(format!("{name}: {status} at {:.3} ms", 1e3 * end));
        }
        let momentum = &summary["momentum"]["initial"]["liquid"];
        let momentum = (0..3).map(|d| momentum[d].as_f64().unwrap_or_default().powi(2)).sum::<Real>().sqrt();
        let at_rest = summary["observables"]["crater_rest"]["at_rest"].as_bool();
        let volume = |key: &str| {
            let of = |what: &str| 1e-9 * erosion(&format!("{key}{what}_mm3")).unwrap_or_default();
            let said = summary["observables"]["erosion"][format!("{key}_doubts")].as_str().unwrap_or_default();
            let doubts: Vec<&str> =
                [said].into_iter().filter(|said| !said.is_empty()).chain(unrest(at_rest, said)).collect();
            Volume { volume: of(""), uncertainty: of("_uncertainty"), noise: of("_noise"), doubts: doubts.join("; ") }
        };
        let result = RunResult {
            name,
            momentum,
            axis_ratio: axis_ratio(folder),
            below_rim: volume("volume_below_rim"),
            cap: volume("volume"),
            depth: 1e-3 * erosion("depth_mm").unwrap_or_default(),
            rim_radius: 1e-3 * erosion("rim_radius_mm").unwrap_or_default(),
            splashed: number(&summary, &["observables", "splash", "grains"]).unwrap_or_default() as usize,
        };
        found.push((end, at_rest == Some(true), result));
    }
    // A crater at rest is what it is at any later time.
    let common = common_end(found.iter().filter(|(_, rests, _)| !rests).map(|&(end, ..)| end));
    let (alike, others): (Vec<_>, Vec<_>) =
        found.into_iter().partition(|&(end, rests, _)| rests || is_same_end(end, common));
    lines.extend(others.into_iter().map(|(end, _, run)| {
        let (end, common) = (1e3 * end, 1e3 * common);
        format!(
            "{}: left out, it ends at {end:.3} ms before its crater rests, and the others at {common:.3} ms",
            run.name
        )
    }));
    Ok((alike.into_iter().map(|(.., run)| run).collect(), lines))
}

/// Compares runs: a table for the terminal, and as a file in the folder `out`.
pub(super) fn several(folders: &[PathBuf], out: &Path, output: &mut Output) -> Result<Vec<String>, CommandError> {
    let (runs, mut lines) = comparable(folders)?;
    if runs.is_empty() {
        return Err(CommandError::input(
            format!("none of these runs has a crater that can be compared: {}", lines.join("; ")),
            "a sweep has the findings of all runs in its sweep.csv; `sazanami analyse DIR` evaluates a single run",
        ));
    }
    let comparison = Comparison::of(runs);
    let header = Comparison::COLUMNS.map(|(name, _)| name.to_owned());
    let rows = comparison.rows();
    write(&free_path(out, "crater-comparison"), &header, &rows, output)?;
    lines.extend(aligned(&header, &rows));
    lines.extend(comparison.series.iter().flat_map(conclusions));
    Ok(lines)
}

/// Writes the table of a comparison as CSV.
fn write(path: &Path, header: &[String; 14], rows: &[[String; 14]], output: &mut Output) -> Result<(), CommandError> {
    write_csv(path, std::iter::once(header).chain(rows)).map_err(undone)?;
    output.message(&format!("wrote {}", path.display()));
    Ok(())
}

/// The law of a volume through a series, and what counts for none.
fn law_through(series: &Series, what: &str, law: Option<PowerLaw>, of: fn(&RunResult) -> &Volume) -> Vec<String> {
    let shape = format!("D_H/D_V = {:.2}", series.axis_ratio);
    let doubted = series.runs.iter().filter(|run| !of(run).doubts.is_empty());
    let doubted: Vec<String> = doubted.map(|run| format!("{} ({})", run.name, of(run).doubts)).collect();
    let left_out = (!doubted.is_empty()).then(|| format!("{shape}, {what}: no part of a law: {}", doubted.join(", ")));
    let found = match law {
        Some(law) => {
            let error = law.standard_error.map_or_else(String::new, |error| format!(" +- {error:.2}"));
            format!("{shape}: {what} ~ (m v)^{:.2}{error} over {} runs", law.exponent, law.points)
        }
        None => format!("{shape}, {what}: no law: it takes two runs without doubts with different momenta"),
    };
    left_out.into_iter().chain([found]).collect()
}

/// The laws through a series with what counts for none, and the scatter of repeated runs.
fn conclusions(series: &Series) -> Vec<String> {
    let mut lines = law_through(series, "volume below the rim", series.law_below_rim, |run| &run.below_rim);
    lines.extend(law_through(series, "V", series.law_of_cap, |run| &run.cap));
    if series.runs.iter().any(|run| run.cap.doubts.contains(RIM_AT_EDGE)) {
        lines.push(format!("warning: where {RIM_AT_EDGE}, no volume is reliable: make the box wider"));
    }
    for scatter in series.scatter() {
        for (what, repeated) in [("below the rim", scatter.below_rim), ("V", scatter.cap)] {
            let momentum = 1e5 * scatter.momentum;
            let Some(Repeated { mean, deviation, runs }) = repeated else {
                lines.push(format!(
                    "m v = {momentum:.1} g cm/s: {what}: no scatter, fewer than two runs without doubts of it"
                ));
                continue;
            };
            lines.push(format!(
                "m v = {momentum:.1} g cm/s: {what} {:.2} mm^3, deviation {:.2} mm^3 over {runs} runs without doubts of it",
                1e9 * mean,
                1e9 * deviation
            ));
        }
    }
    lines
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn unrest_is_told_once_and_of_craters_alone() {
        assert_eq!(
            [Some(true), Some(false), None].map(|at_rest| unrest(at_rest, "")),
            [None, Some(NOT_AT_REST), Some(REST_UNKNOWN)]
        );
        assert_eq!(unrest(Some(false), &format!("{RIM_AT_EDGE}; {NOT_AT_REST}")), None);
        assert_eq!([Some(false), None].map(|at_rest| unrest(at_rest, NO_CRATER)), [None; 2]);
        // Negative control: another doubt.
        assert_eq!(unrest(None, RIM_AT_EDGE), Some(REST_UNKNOWN));
    }

    #[test]
    fn runs_are_compared_at_the_end_that_most_of_them_have() {
        let common = |ends: &[Real]| common_end(ends.iter().copied());
        assert_eq!(common(&[0.02, 0.045, 0.0451, 0.045, 0.02]), 0.0451);
        // Of equally many the latest.
        assert_eq!((common(&[0.02, 0.045]), common(&[0.045, 0.02, 0.02, 0.0449])), (0.045, 0.045));
        assert_eq!(common(&[]), 0.0);
    }
}
