//! The report on several runs, side by side.

use std::collections::BTreeSet;
use std::path::PathBuf;

use sazanami::analyse;
use sazanami::case::values;
use sazanami::error::CommandError;
use sazanami::finished::Finished;

use crate::charts::{self, Chart, Curve, Curves};
use crate::html::Html;
use crate::typeset::typeset;
use crate::{amounts, answer, page};

/// A run with its name and the values of its keys.
struct Side<'a> {
    run: &'a Finished,
    name: String,
    values: std::collections::BTreeMap<String, String>,
}

/// Report on several runs side by side, as HTML.
pub fn page(runs: &[Finished]) -> Result<String, CommandError> {
    // Files of a run lie in its own folder.
    let own = |run: &Finished, value: String| value.replace(&format!("{}/", run.folder.display()), "");
    let own_values =
        |run: &Finished| values(&run.case).into_iter().map(|(key, value)| (key, own(run, value))).collect();
    let named = runs.iter().zip(names(runs));
    let sides: Vec<Side> = named.map(|(run, name)| Side { run, name, values: own_values(run) }).collect();
    let title = format!("{} runs side by side", sides.len());
    let keys = differing(&sides);
    let answers = answers(&sides, &keys);
    let histories = overlaid(&sides)?;
    page::page(&title, None, |html| {
        html.raw("<header>");
        html.element("h1", &[], &title);
        page::contents(
            html,
            &[("answer", "Answer"), ("parameters", "Parameters"), ("charts", "Charts"), ("warnings", "Warnings")],
        );
        html.close("header");
        html.section("answer", "Answer");
        found(html, &sides)?;
        page::charts(html, 0, &answers);
        html.close("section");
        parameters(html, &sides, &keys);
        html.section("charts", "Charts");
        page::charts(html, answers.len(), &histories);
        html.close("section");
        page::warnings(html, &warnings(&sides));
        Ok(answers.into_iter().chain(histories).collect())
    })
}

/// Names of runs: the shortest ends of the paths of their folders that differ, with a number behind what is still equal.
fn names(runs: &[Finished]) -> Vec<String> {
    let absolute = |run: &Finished| std::path::absolute(&run.folder).unwrap_or_else(|_| run.folder.clone());
    let paths: Vec<PathBuf> = runs.iter().map(absolute).collect();
    let name = |(run, path): (&Finished, &PathBuf)| {
        let parts: Vec<_> = path.components().collect();
        let ends = (2..=parts.len()).map(|count| parts[parts.len() - count..].iter().collect::<PathBuf>());
        let is_shared = |end: &PathBuf| paths.iter().any(|other| other != path && other.ends_with(end));
        let last = PathBuf::from(run.name());
        let mut ends = std::iter::once(last).chain(ends);
        ends.find(|end| !is_shared(end)).unwrap_or_else(|| path.clone()).display().to_string()
    };
    let all: Vec<String> = runs.iter().zip(&paths).map(name).collect();
    let equal = |name: &String, among: &[String]| among.iter().filter(|other| *other == name).count();
    let numbered = |(n, name): (usize, &String)| match equal(name, &all) {
        1 => name.clone(),
        _ => format!("{name} ({})", equal(name, &all[..=n])),
    };
    all.iter().enumerate().map(numbered).collect()
}

/// Findings of the runs, a column each.
fn found(html: &mut Html, sides: &[Side]) -> Result<(), CommandError> {
    let of = |side: &Side| analyse::findings(&side.run.folder, &side.run.summary);
    let all = sides.iter().map(of).collect::<Result<Vec<_>, _>>()?;
    let mut labels: Vec<&String> = Vec::new();
    for (label, _) in all.iter().flatten() {
        if !labels.contains(&label) {
            labels.push(label);
        }
    }
    let cell = |findings: &Vec<(String, String)>, label: &String| {
        findings.iter().find(|(own, _)| own == label).map_or("–".to_owned(), |(_, value)| typeset(value))
    };
    let row = |label: &&String| std::iter::once(typeset(label)).chain(all.iter().map(|own| cell(own, label))).collect();
    let rows: Vec<Vec<String>> = labels.iter().map(row).collect();
    html.table("What the runs found", &headings("", sides), &rows);
    Ok(())
}

fn headings<'a>(first: &'a str, sides: &'a [Side]) -> Vec<&'a str> {
    std::iter::once(first).chain(sides.iter().map(|side| side.name.as_str())).collect()
}

/// Names of cases differ without meaning.
const NAMES: [&str; 2] = ["name", "title"];

/// Keys whose values differ between the runs.
fn differing(sides: &[Side]) -> Vec<String> {
    let all: BTreeSet<&String> = sides.iter().flat_map(|side| side.values.keys()).collect();
    let differs = |key: &&String| sides.iter().any(|side| side.values.get(*key) != sides[0].values.get(*key));
    all.into_iter().filter(differs).filter(|key| !NAMES.contains(&key.as_str())).cloned().collect()
}

/// The section on the keys that differ.
fn parameters(html: &mut Html, sides: &[Side], keys: &[String]) {
    html.section("parameters", "Parameters that differ");
    if keys.is_empty() {
        html.raw("<p>None: the runs have the same case.</p>\n");
    } else {
        let cell = |side: &Side, key: &String| {
            side.values.get(key).map_or("–".to_owned(), |value| amounts::of_key(key, value))
        };
        let row = |key: &String| std::iter::once(key.clone()).chain(sides.iter().map(|side| cell(side, key))).collect();
        let rows: Vec<Vec<String>> = keys.iter().map(row).collect();
        html.table("Keys whose values are not the same in all runs", &headings("key", sides), &rows);
    }
    html.close("section");
}

/// A value as a number with its unit: that of a text with a unit, a bare number, or the length of a vector.
fn quantity(value: &str) -> Option<(f64, String)> {
    let (values, unit) = amounts::quantities(value)?;
    let value =
        if let [value] = values[..] { value } else { values.iter().map(|value| value * value).sum::<f64>().sqrt() };
    Some((value, unit))
}

/// A number of the answer that is shown against keys: its name, unit, factor to that unit, and where it and its uncertainty are.
struct Answer(&'static str, &'static str, f64, [&'static str; 2]);

const ANSWERS: [Answer; 3] = [
    Answer(
        "Volume below the plane of the rim",
        "m^3",
        1e-9,
        ["erosion.volume_below_rim_mm3", "erosion.volume_below_rim_uncertainty_mm3"],
    ),
    Answer("Erosion volume V", "m^3", 1e-9, ["erosion.volume_mm3", "erosion.volume_uncertainty_mm3"]),
    Answer("Angle of the heap", "degrees", 1.0, ["heap.angle_deg", "heap.angle_uncertainty_deg"]),
];

/// Numbers of the answer against each key that differs and is a number, where every run has them.
fn answers(sides: &[Side], keys: &[String]) -> Vec<Chart> {
    const MOST: usize = 4;
    let point = |key: &String, side: &Side, Answer(_, _, factor, paths): &Answer| {
        let (x, unit) = quantity(side.values.get(key)?)?;
        let [value, half] = paths.map(|path| side.run.number(&format!("observables.{path}")));
        let bars = vec![factor * half.unwrap_or_default()];
        let curve = Curve { bars, ..Curve::new(side.name.clone(), vec![factor * value?]) };
        Some((unit, Curves { x: vec![x], curves: vec![curve] }))
    };
    let of = |key: &String, answer: &Answer| {
        let points: Vec<(String, Curves)> = sides.iter().map(|side| point(key, side, answer)).collect::<Option<_>>()?;
        let unit = points.first()?.0.clone();
        let tables = points.into_iter().map(|(_, table)| table).collect();
        let title = format!("{} against {key}", answer.0);
        Some(Chart { points: true, ..Chart::new(&title, [key, &unit], answer.1, tables) })
    };
    ANSWERS.iter().flat_map(|answer| keys.iter().filter_map(move |key| of(key, answer)).take(MOST)).collect()
}

/// The columns that several runs share and people compare, a chart each.
const COMPARED: [&str; 13] = [
    "crater_depth",
    "rim_radius",
    "erosion_volume_below_rim",
    "erosion_volume",
    "mound_height",
    "mound_wavelength",
    "ripple_crest_height",
    "ripple_crest_spacing",
    "bed_relief",
    "largest_grain_speed",
    "kinetic_energy_fluid",
    "kinetic_energy_grains",
    "momentum_residual_relative",
];

/// Histories and last profiles of all runs over one another.
fn overlaid(sides: &[Side]) -> Result<Vec<Chart>, CommandError> {
    let mut found = Vec::new();
    found.extend(last_profiles(sides)?);
    for column in COMPARED {
        let own = |side: &Side| {
            let chart = charts::of_columns(&side.run.series, &charts::capitalised(column), &[column], 1)?;
            Some(chart.named(&side.name))
        };
        found.extend(joined(sides.iter().filter_map(own)));
    }
    Ok(found)
}

/// The bed at the end of each run.
fn last_profiles(sides: &[Side]) -> Result<Option<Chart>, CommandError> {
    use sazanami::results::{BED_PROFILES, CRATER_PROFILES};
    let mut own = Vec::new();
    for side in sides {
        let crater = side.run.table(CRATER_PROFILES)?.and_then(|table| charts::crater_profiles(&table));
        let bed = side.run.table(BED_PROFILES)?;
        let bed = bed.and_then(|table| charts::tank_profiles("Surface of the bed", &table, "z_concentration"));
        own.extend(crater.or(bed).map(|mut chart| {
            chart.title = format!("{}: end of each run", chart.title);
            chart.tables = chart.tables.split_off(chart.tables.len().saturating_sub(1));
            chart.named(&side.name)
        }));
    }
    Ok(joined(own.into_iter()))
}

/// One chart of the curves of several.
fn joined(mut charts: impl Iterator<Item = Chart>) -> Option<Chart> {
    let mut first = charts.next()?;
    for chart in charts {
        first.every = first.every.max(chart.every);
        first.tables.extend(chart.tables);
    }
    Some(first)
}

fn warnings(sides: &[Side]) -> Vec<String> {
    let mut found = Vec::new();
    for side in sides {
        let broke_off = answer::how_it_broke_off(side.run).map(|(verdict, _)| verdict);
        found.extend(
            broke_off
                .into_iter()
                .chain(answer::warnings(side.run, ""))
                .map(|warning| format!("{}: {warning}", side.name)),
        );
    }
    let ends: Vec<f64> = sides.iter().filter_map(|side| side.run.number("time_s")).collect();
    let [least, most] = [f64::min, f64::max].map(|of| ends.iter().copied().reduce(of).unwrap_or_default());
    if most - least > 0.01 * most {
        found.push("The runs end at different times.".into());
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quantities_have_their_units() {
        assert_eq!(quantity("\"0.003 m\""), Some((0.003, "m".into())));
        assert_eq!(quantity("0.45"), Some((0.45, String::new())));
        assert_eq!(quantity("[\"3.0 m/s\", \"0.0 m/s\", \"-4.0 m/s\"]"), Some((5.0, "m/s".into())));
        assert_eq!(quantity("\"plic\""), None);
    }
}
