//! The table at the end of a run: labels and values for the terminal.

use std::path::Path;

use sazanami_numerics::Real;
use serde_json::Value;

use super::output::newest_picture;
use crate::case::units::with_bar;
use crate::progress::{duration, time};

/// Least part of the liquid that is told to be covered by grains: with their surfaces as bounds of the liquid there is none.
const COVERED: Real = 5e-4;

/// The number at `path` in a JSON value, if there is one.
pub(super) fn number(value: &Value, path: &[&str]) -> Option<Real> {
    path.iter().try_fold(value, |value, key| value.get(key)).and_then(Value::as_f64)
}

/// Largest overlap, as a part `of` a radius, and that of the packing if it was larger.
pub(super) fn overlap(summary: &Value, of: &str) -> Option<String> {
    let value = number(summary, &["worst", "overlap_relative"])?;
    let packing = number(summary, &["worst", "packing_overlap_relative"]).filter(|&packing| packing > value);
    let packing = packing.map(|packing| format!(", {:.1} % while the bed was packed", 1e2 * packing));
    Some(format!("{:.1} % of {of}{}", 1e2 * value, packing.unwrap_or_default()))
}

/// The table at the end of a run. What was `found` again stands before what the summary says, where they differ.
pub(super) fn report(summary: &Value, found: Option<&Value>, folder: &Path) -> Vec<String> {
    let mut rows = rows(found.unwrap_or(summary));
    if found.is_some() {
        let mut written = self::rows(summary);
        for (label, value) in &mut rows {
            let at = written.iter().position(|(other, _)| other == label);
            match at.map(|at| written.remove(at).1) {
                Some(before) if before == *value => {}
                Some(before) => *value = format!("{value} (summary: {before})"),
                None => *value = format!("{value} (summary: none)"),
            }
        }
        rows.extend(written.into_iter().map(|(label, before)| (label, format!("none (summary: {before})"))));
    }
    if let Some(picture) = newest_picture(folder, "view-") {
        rows.push(("picture", picture.display().to_string()));
    }
    labelled(&rows)
}

/// Lines of labels and values, one below the other.
pub(super) fn labelled<L: AsRef<str>>(rows: &[(L, String)]) -> Vec<String> {
    let width = rows.iter().map(|(label, _)| label.as_ref().len()).max().unwrap_or_default();
    rows.iter().map(|(label, value)| format!("{:<width$}  {value}", label.as_ref())).collect()
}

/// A line of the table at the end of a run: label, place in the summary, factor to the unit, unit, digits.
struct Line(&'static str, &'static [&'static str], Real, &'static str, usize);

const OF_STEPS: &[Line] =
    &[Line("time steps", &["steps"], 1.0, "", 0), Line("contact sub-steps", &["grain_substeps"], 1.0, "", 0)];

const OF_BED: &[Line] = &[
    Line("bed: porosity", &["observables", "bed", "porosity"], 1.0, "", 4),
    Line("bed: height H_s", &["observables", "bed", "height_mm"], 1.0, "mm", 3),
];

const OF_CRATER: &[Line] = &[
    Line("crater depth H below the rim", &["observables", "erosion", "depth_mm"], 1.0, "mm", 3),
    Line("rim radius L", &["observables", "erosion", "rim_radius_mm"], 1.0, "mm", 3),
    Line("volume below the initial surface", &["observables", "erosion", "volume_excavated_mm3"], 1.0, "mm^3", 2),
    Line("volume above the initial surface", &["observables", "erosion", "volume_rim_mm3"], 1.0, "mm^3", 2),
];

const NOISE_BELOW_RIM: Line = Line(NOISE, &["observables", "erosion", "volume_below_rim_noise_mm3"], 1.0, "mm^3", 2);

const NOISE_OF_CAP: Line =
    Line("  V of the same bed before the impact", &["observables", "erosion", "volume_noise_mm3"], 1.0, "mm^3", 2);

const OF_SPLASH: &[Line] = &[
    Line("splashed grains", &["observables", "splash", "grains"], 1.0, "", 0),
    Line("  mass", &["observables", "splash", "mass_mg"], 1.0, "mg", 2),
    Line("  farthest from the axis", &["observables", "splash", "farthest_distance_mm"], 1.0, "mm", 2),
];

/// Residuals: label, field of `conservation`.
const RESIDUALS: [(&str, &str); 2] = [
    ("error of the liquid volume, relative", "liquid_volume_relative_change"),
    ("error of the momentum budget, relative", "momentum_residual_relative"),
];

impl Line {
    fn of(&self, summary: &Value) -> Option<Row> {
        let &Self(label, path, factor, unit, digits) = self;
        let value = number(summary, path)?;
        Some((label, format!("{:.digits$} {unit}", factor * value).trim_end().to_owned()))
    }
}

/// A label and what stands beside it.
pub(super) type Row = (&'static str, String);

/// Labels and values of the table.
pub(super) fn rows(summary: &Value) -> Vec<Row> {
    let of = |lines: &'static [Line]| lines.iter().filter_map(|line| line.of(summary));
    let of_part = |part: &str| &summary["observables"][part];
    let [erosion, crater_rest, splash] = ["erosion", "crater_rest", "splash"].map(of_part);
    // The answer first, then what it rests on.
    let mut rows: Vec<Row> = Vec::new();
    rows.extend(slope(of_part("heap")).map(|value| ("angle of the heap", value)));
    rows.extend(volume(erosion, "volume_below_rim").map(|value| (BELOW_RIM, value)));
    rows.extend(NOISE_BELOW_RIM.of(summary));
    rows.extend(rest(crater_rest));
    if erosion["not_evaluated"].is_null() {
        rows.extend(volume(erosion, "volume").map(|value| (CAP, value)));
    }
    rows.extend(NOISE_OF_CAP.of(summary));
    rows.extend(by_layers(erosion).map(|value| ("  by the layers of the paper", value)));
    rows.extend(of(OF_CRATER).chain(of(OF_SPLASH)));
    if let Some(problem) = splash["not_evaluated"].as_str() {
        rows.push(("splashed grains", format!("not evaluated: {problem}")));
    }
    rows.extend(number(summary, &["time_s"]).map(|seconds| ("simulated time", time(seconds))));
    rows.extend(of(OF_STEPS));
    rows.extend(number(summary, &["wall_s"]).map(|seconds| ("wall-clock time", duration(seconds))));
    rows.extend(of(OF_BED));
    for (label, key) in RESIDUALS {
        rows.extend(number(summary, &["conservation", key]).map(|value| (label, format!("{value:.1e}"))));
    }
    let soaked = number(summary, &["conservation", "wet_liquid_volume_relative_change"]);
    let has_grains = number(summary, &["counts", "grains"]).is_some_and(|grains| grains > 0.0);
    rows.extend(
        soaked
            .filter(|value| has_grains && value.abs() >= COVERED)
            .map(|value| ("liquid covered by grains", format!("{:.1} % of the liquid volume", 0.0 - 1e2 * value))),
    );
    rows.extend(overlap(summary, "the smaller radius").map(|value| ("largest overlap of contact spheres", value)));
    rows
}

const BELOW_RIM: &str = "volume below the plane of the rim";
const CAP: &str = "erosion volume V, eq. (14)";
const NOISE: &str = "  same bed before the impact (noise)";

/// The slope of a heap with its standard error, and how fast the grains still move.
fn slope(heap: &Value) -> Option<String> {
    if let Some(problem) = heap["not_evaluated"].as_str() {
        return Some(format!("not evaluated: {problem}"));
    }
    let [angle, error, speed] = ["angle_deg", "angle_uncertainty_deg", "mean_speed"].map(|key| number(heap, &[key]));
    Some(format!("{:.1} +- {:.1} degrees, mean speed {:.1e} m/s", angle?, error?, speed?))
}

/// A volume of the crater with its uncertainty, and what speaks against it.
fn volume(erosion: &Value, key: &str) -> Option<String> {
    if let Some(problem) = erosion["not_evaluated"].as_str() {
        return Some(format!("not evaluated: {problem}"));
    }
    let volume = number(erosion, &[&format!("{key}_mm3")])?;
    let uncertainty = number(erosion, &[&format!("{key}_uncertainty_mm3")]);
    let amount = uncertainty.map_or_else(|| format!("{volume:.2}"), |bar| with_bar(volume, bar).join(" +- "));
    let doubts = erosion[&format!("{key}_doubts")].as_str();
    let caution = doubts.map_or_else(String::new, |doubts| format!(" (not reliable: {doubts})"));
    Some(format!("{amount} mm^3{caution}"))
}

/// The volume by layers, with the digits of the uncertainty of V where that is known.
fn by_layers(erosion: &Value) -> Option<String> {
    let volume = number(erosion, &["volume_by_layers_mm3"])?;
    let bar = number(erosion, &["volume_uncertainty_mm3"]);
    let [volume, _] = with_bar(volume, bar.unwrap_or_default());
    Some(format!("{volume} mm^3"))
}

/// Whether there was liquid in a run, by its summary.
pub(super) fn has_liquid(summary: &Value) -> bool {
    let has_volume = number(summary, &["conservation", "liquid_volume_relative_change"]).is_some();
    let has_particles = number(summary, &["counts", "fluid_particles"]).is_some_and(|count| count > 0.0);
    let momentum = summary["momentum"]["now"]["liquid"].as_array();
    has_volume || has_particles || momentum.into_iter().flatten().any(|part| part.as_f64() != Some(0.0))
}

/// Since when the volume below the rim stays as it is, where the crater has come to rest, or why that is not known.
fn rest(crater_rest: &Value) -> Option<Row> {
    if let Some(problem) = crater_rest["not_evaluated"].as_str() {
        return Some(("  crater at rest", format!("not evaluated: {problem}")));
    }
    let since = number(crater_rest, &["within_uncertainty_since_s"]).filter(|_| crater_rest["at_rest"] == true)?;
    Some(("  crater at rest since", time(since)))
}

/// Rows in columns of equal width, aligned to the right.
pub(super) fn aligned<const N: usize>(header: &[String; N], rows: &[[String; N]]) -> Vec<String> {
    let all = || std::iter::once(header).chain(rows);
    let widths: [usize; N] = std::array::from_fn(|n| all().map(|row| row[n].chars().count()).max().unwrap_or_default());
    all()
        .map(|row| row.iter().zip(widths).map(|(cell, width)| format!("{cell:>width$}")).collect::<Vec<_>>().join("  "))
        .collect()
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::{has_liquid, overlap, rows};

    #[test]
    fn the_overlap_of_the_packing_is_told_where_it_was_deeper() {
        let told = |worst| overlap(&json!({ "worst": worst }), "a radius");
        assert_eq!(told(json!({ "overlap_relative": 0.041 })), Some("4.1 % of a radius".into()));
        let packed = told(json!({ "overlap_relative": 0.041, "packing_overlap_relative": 0.077 }));
        assert_eq!(packed, Some("4.1 % of a radius, 7.7 % while the bed was packed".into()));
        let shallow = told(json!({ "overlap_relative": 0.041, "packing_overlap_relative": 0.01 }));
        assert_eq!(shallow, Some("4.1 % of a radius".into()));
        assert_eq!(told(json!({ "packing_overlap_relative": 0.077 })), None);
    }

    #[test]
    fn times_and_volumes_have_the_digits_that_are_known() {
        let erosion = json!({ "volume_mm3": 140.31, "volume_uncertainty_mm3": 13.2, "volume_by_layers_mm3": 109.14 });
        let rest = json!({ "at_rest": true, "within_uncertainty_since_s": 0.039 });
        let summary =
            json!({ "time_s": 0.071, "wall_s": 163.04, "observables": { "erosion": erosion, "crater_rest": rest } });
        let rows = rows(&summary);
        for (label, expected) in [
            ("erosion volume V, eq. (14)", "140 +- 13 mm^3"),
            ("  by the layers of the paper", "109 mm^3"),
            ("  crater at rest since", "39 ms"),
            ("simulated time", "71 ms"),
            ("wall-clock time", "2 min 43 s"),
        ] {
            assert_eq!(rows.iter().find(|row| row.0 == label).map(|row| row.1.as_str()), Some(expected), "{label}");
        }
    }

    #[test]
    fn a_run_has_liquid_if_it_began_with_some_or_has_some_now() {
        let without =
            json!({ "conservation": { "liquid_volume_relative_change": null }, "counts": { "fluid_particles": 0 } });
        assert!(!has_liquid(&without));
        assert!(has_liquid(&json!({ "conservation": { "liquid_volume_relative_change": 0.0 } })));
        assert!(has_liquid(&json!({ "counts": { "fluid_particles": 3 } })));
        let flowed_in = |part: f64| json!({ "momentum": { "now": { "liquid": [0.0, 0.0, part] } } });
        assert!(has_liquid(&flowed_in(-1e-9)) && !has_liquid(&flowed_in(0.0)));
    }
}
