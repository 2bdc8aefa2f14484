//! Observables, tables and figures from what runs wrote.

mod reevaluated;
mod ripples;

use std::path::{Path, PathBuf};

use sazanami_io::picture::{
    ErosionPoint, LinePlot, Picture, PictureError, bed_profiles, crater_history, erosion_against_momentum,
    momentum_budget,
};
use sazanami_numerics::Real;
use sazanami_observe::comparison::{Comparison, RunResult};
use serde_json::Value;

use crate::case;
use crate::case::meaning::{FluidName, Region};
use crate::error::CommandError;
use crate::progress::Progress;
use crate::recorder;
use crate::results::{CASE, CRATER_PROFILES, FIGURES, SERIES, SUMMARY};

pub(crate) use ripples::CYCLE_COLUMNS;
pub use ripples::layer_history;

/// Rows of a table with named columns.
pub struct Table {
    columns: Vec<String>,
    rows: Vec<String>,
}

impl Table {
    /// Reads the table at `path`; `None` if there is none.
    pub fn read(path: &Path) -> Option<Self> {
        let text = std::fs::read_to_string(path).ok()?;
        let mut lines = text.lines();
        let columns = lines.next()?.split(',').map(|name| name.split(" [").next().unwrap_or(name).to_owned()).collect();
        Some(Self { columns, rows: lines.map(str::to_owned).collect() })
    }

    /// Values of a column, NaN where a cell is empty; none if there is no such column.
    pub fn column(&self, name: &str) -> Vec<Real> {
        self.cells(name).map(value).collect()
    }

    /// Words in a column; none if there is no such column.
    pub fn words(&self, name: &str) -> Vec<&str> {
        self.cells(name).map(|cell| cell.trim_matches('"')).collect()
    }

    /// Whether there are no rows.
    pub fn is_empty(&self) -> bool {
        self.rows.is_empty()
    }

    /// Values of a row.
    fn row(&self, number: usize) -> impl Iterator<Item = Real> {
        self.rows[number].split(',').map(value)
    }

    fn place(&self, name: &str) -> Option<usize> {
        self.columns.iter().position(|column| column == name)
    }

    fn cells(&self, name: &str) -> impl Iterator<Item = &str> {
        let place = self.place(name);
        place.into_iter().flat_map(|at| self.rows.iter().map(move |row| row.split(',').nth(at).unwrap_or_default()))
    }
}

/// Value of a cell; NaN if it is empty.
fn value(cell: &str) -> Real {
    cell.parse().unwrap_or(Real::NAN)
}

/// Recomputes what one run tells, or compares several; returns lines for people.
///
/// One run is evaluated again from its newest good checkpoint of the flow, ripples from the tables that it wrote;
/// `overrides` (`path=value`, of keys under `bed` and `erosion`, or [`case::RIPPLES_EVALUATED`]) say how, and what is then
/// found goes into the folder `analysis` of the run's own.
///
/// # Errors
/// If a folder holds no results, or a figure cannot be written; if other keys are overridden, or those of several
/// runs, or those of a run that left nothing to be evaluated otherwise.
pub fn analyse(
    folders: &[PathBuf],
    overrides: &[String],
    progress: &mut dyn Progress,
) -> Result<Vec<String>, CommandError> {
    match folders {
        [] => Err(CommandError::input("no folder of results is given", "give one or more folders of runs")),
        [folder] if has_moving_particles(&summary(folder)?) => ripples::of_run(folder, overrides, progress),
        [folder] if overrides.is_empty() => reevaluated::as_it_was(folder, progress),
        [folder] => reevaluated::otherwise(folder, overrides, progress),
        many if overrides.is_empty() => {
            let summaries = many.iter().map(|folder| summary(folder)).collect::<Result<Vec<_>, _>>()?;
            let moving = summaries.iter().filter(|summary| has_moving_particles(summary)).count();
            match moving {
                0 => several(many, progress),
                all if all == many.len() => ripples::several(many, progress),
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

/// Whether a summary is that of a run with moving particles.
fn has_moving_particles(summary: &Value) -> bool {
    summary["solver"] == "mps"
}

fn summary(folder: &Path) -> Result<Value, CommandError> {
    let path = folder.join(SUMMARY);
    let text = std::fs::read_to_string(&path).map_err(|error| {
        CommandError::input(
            format!("`{}` holds no results: {error}", folder.display()),
            "give the folder that `sazanami run` wrote to",
        )
    })?;
    serde_json::from_str(&text).map_err(|error| {
        CommandError::input(
            format!("{}: {error}", path.display()),
            "the summary is damaged; resume the run to rewrite it",
        )
    })
}

fn drawing(error: &dyn std::fmt::Display) -> CommandError {
    CommandError::Undone(error.to_string())
}

/// Draws the figures of a run from its tables; returns what its summary says.
///
/// # Errors
/// If the folder holds no results, or a figure cannot be written.
pub(crate) fn present(folder: &Path, progress: &mut dyn Progress) -> Result<Vec<String>, CommandError> {
    let summary = summary(folder)?;
    if has_moving_particles(&summary) {
        return ripples::of_run(folder, &[], progress);
    }
    draw_figures(folder, &summary, progress)?;
    Ok(report(&summary, None, folder))
}

fn draw_figures(folder: &Path, summary: &Value, progress: &mut dyn Progress) -> Result<(), CommandError> {
    let name = summary["case"].as_str().unwrap_or("run").to_owned();
    let figures = folder.join(FIGURES);
    std::fs::create_dir_all(&figures).map_err(|error| drawing(&error))?;
    for (file, plot) in line_plots(folder, &name) {
        save(plot.draw(), &figures.join(file), progress)?;
    }
    list_files(folder, summary)
}

/// Saves what was drawn and says so.
fn save(picture: Result<Picture, PictureError>, path: &Path, progress: &mut dyn Progress) -> Result<(), CommandError> {
    picture.and_then(|picture| picture.save(path)).map_err(|error| drawing(&error))?;
    progress.message(&format!("drew {}", path.display()));
    Ok(())
}

/// Brings the list of files in the summary up to date.
fn list_files(folder: &Path, summary: &Value) -> Result<(), CommandError> {
    // A run that is still on its way writes its summary itself.
    if summary["status"] != "running" {
        recorder::put_files(folder).map_err(|error| drawing(&error))?;
    }
    Ok(())
}

fn line_plots(folder: &Path, name: &str) -> Vec<(&'static str, LinePlot)> {
    let mut plots = Vec::new();
    if let Some(profiles) = Table::read(&folder.join(CRATER_PROFILES)) {
        let curves = curves(&profiles);
        if !curves.is_empty() {
            plots.push(("profiles.png", bed_profiles(&format!("{name}: smoothed bed surface"), &curves)));
        }
    }
    let Some(series) = Table::read(&folder.join(SERIES)) else { return plots };
    let times = series.column("time");
    if times.len() < 2 {
        return plots;
    }
    let depths = series.column("crater_depth");
    if depths.iter().any(|depth| depth.is_finite()) {
        let rims = series.column("rim_radius");
        plots.push(("crater.png", crater_history(&format!("{name}: crater"), &times, &depths, &rims)));
    }
    let part = |column: &str| series.column(column);
    let walls: Vec<Real> =
        part("impulse_walls_on_fluid_3").iter().zip(part("impulse_walls_on_grains_3")).map(|(a, b)| a + b).collect();
    let named = [
        ("liquid", part("momentum_liquid_3")),
        ("gas", part("momentum_gas_3")),
        ("grains", part("momentum_grains_3")),
        ("walls", walls),
        ("gravity", part("impulse_gravity_3")),
        ("swallowed", part("impulse_swallowed_3")),
        ("residual", part("momentum_residual_3")),
    ];
    if named[0].1.iter().any(|value| value.is_finite()) {
        let parts: Vec<(&str, &[Real])> = named.iter().map(|(label, values)| (*label, values.as_slice())).collect();
        plots.push(("momentum.png", momentum_budget(&format!("{name}: momentum"), "x₃", &times, &parts)));
    }
    plots
}

/// Bed profiles at the start, at the end, and at a few times between.
fn curves(profiles: &Table) -> Vec<(String, Vec<[Real; 2]>)> {
    const BETWEEN: usize = 3;
    let count = profiles.rows.len();
    let mut chosen: Vec<usize> = (0..=BETWEEN + 1).map(|n| n * count.saturating_sub(1) / (BETWEEN + 1)).collect();
    chosen.dedup();
    let (times, layers) = (profiles.column("time"), profiles.column("layer"));
    let Some(first) = profiles.place("height_0").filter(|_| count > 0) else { return Vec::new() };
    chosen
        .into_iter()
        .map(|row| {
            let heights = profiles.row(row).skip(first).enumerate();
            let points = heights.map(|(n, height)| [(n as Real + 0.5) * layers[row], height]);
            let label = format!("t = {:.1} ms", 1e3 * times[row]);
            (label, points.filter(|point| point[1].is_finite()).collect())
        })
        .collect()
}

fn number(value: &Value, path: &[&str]) -> Option<Real> {
    path.iter().try_fold(value, |value, key| value.get(key)).and_then(Value::as_f64)
}

/// The table at the end of a run. What was `found` again stands before what the summary says, where they differ.
fn report(summary: &Value, found: Option<&Value>, folder: &Path) -> Vec<String> {
    let mut rows = rows(found.unwrap_or(summary));
    if found.is_some() {
        let mut said = self::rows(summary);
        for (label, value) in &mut rows {
            let at = said.iter().position(|(other, _)| other == label);
            match at.map(|at| said.remove(at).1) {
                Some(before) if before == *value => {}
                Some(before) => *value = format!("{value} (summary: {before})"),
                None => *value = format!("{value} (summary: none)"),
            }
        }
        rows.extend(said.into_iter().map(|(label, before)| (label, format!("none (summary: {before})"))));
    }
    if let Some(picture) = newest_picture(folder, "view-") {
        rows.push(("picture", picture.display().to_string()));
    }
    labelled(&rows)
}

/// Lines of labels and values, one below the other.
fn labelled<L: AsRef<str>>(rows: &[(L, String)]) -> Vec<String> {
    let width = rows.iter().map(|(label, _)| label.as_ref().len()).max().unwrap_or_default();
    rows.iter().map(|(label, value)| format!("{:<width$}  {value}", label.as_ref())).collect()
}

/// Labels and values of the table.
fn rows(summary: &Value) -> Vec<(&'static str, String)> {
    let mut rows: Vec<(&str, String)> = Vec::new();
    let mut row = |label: &'static str, path: &[&str], factor: Real, unit: &str, digits: usize| {
        if let Some(value) = number(summary, path) {
            rows.push((label, format!("{:.digits$} {unit}", factor * value)));
        }
    };
    row("time simulated", &["time_s"], 1e3, "ms", 3);
    row("steps", &["steps"], 1.0, "", 0);
    row("grain sub-steps", &["grain_substeps"], 1.0, "", 0);
    row("wall-clock time", &["wall_s"], 1.0, "s", 1);
    row("bed: porosity", &["observables", "bed", "porosity"], 1.0, "", 4);
    row("bed: height H_s", &["observables", "bed", "height_mm"], 1.0, "mm", 3);
    let erosion = |key: &'static str| ["observables", "erosion", key];
    row("erosion volume V, eq. (14)", &erosion("volume_mm3"), 1.0, "mm^3", 3);
    row("  uncertainty of V", &erosion("volume_uncertainty_mm3"), 1.0, "mm^3", 3);
    row("  V of the bed before (noise)", &erosion("volume_noise_mm3"), 1.0, "mm^3", 3);
    row("  V with the rim from a parabola", &erosion("volume_refined_mm3"), 1.0, "mm^3", 3);
    row("  volume below the rim plane", &erosion("volume_direct_mm3"), 1.0, "mm^3", 3);
    row("  excavated below the first surface", &erosion("volume_excavated_mm3"), 1.0, "mm^3", 3);
    row("  heaped up above it", &erosion("volume_rim_mm3"), 1.0, "mm^3", 3);
    row("crater depth H", &erosion("depth_mm"), 1.0, "mm", 3);
    row("rim radius L", &erosion("rim_radius_mm"), 1.0, "mm", 3);
    let not_evaluated = summary["observables"]["erosion"]["not_evaluated"].as_str();
    if let Some(problem) = not_evaluated {
        rows.push(("erosion volume V, eq. (14)", format!("not evaluated: {problem}")));
    }
    let mut row = |label: &'static str, path: &[&str], factor: Real, unit: &str, digits: usize| {
        if let Some(value) = number(summary, path) {
            rows.push((label, format!("{:.digits$} {unit}", factor * value)));
        }
    };
    row("splashed grains", &["observables", "splash", "grains"], 1.0, "", 0);
    row("  their mass", &["observables", "splash", "mass_mg"], 1.0, "mg", 3);
    row("  farthest from the axis", &["observables", "splash", "farthest_distance_mm"], 1.0, "mm", 2);
    if let Some(problem) = summary["observables"]["splash"]["not_evaluated"].as_str() {
        rows.push(("splashed grains", format!("not evaluated: {problem}")));
    }
    for (label, key) in [
        ("liquid volume, relative change", "liquid_volume_relative_change"),
        ("  outside grains", "wet_liquid_volume_relative_change"),
        ("momentum residual, relative", "momentum_residual_relative"),
    ] {
        if let Some(value) = number(summary, &["conservation", key]) {
            rows.push((label, format!("{value:.2e}")));
        }
    }
    if let Some(value) = number(summary, &["worst", "overlap_relative"]) {
        rows.push(("largest overlap of contact spheres", format!("{:.1} % of a radius", 100.0 * value)));
    }
    rows
}

/// The last of the pictures whose names begin with `prefix`.
fn newest_picture(folder: &Path, prefix: &str) -> Option<PathBuf> {
    let paths = std::fs::read_dir(folder.join(FIGURES)).ok()?.flatten().map(|entry| entry.path());
    let named = |path: &PathBuf| path.file_name().is_some_and(|name| name.to_string_lossy().starts_with(prefix));
    paths.filter(named).max()
}

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

/// The end that most runs have, the latest of those that equally many have [s].
fn common_end(ends: impl Iterator<Item = Real> + Clone) -> Real {
    let alike = |end: Real| ends.clone().filter(|&other| is_same_end(other, end)).count();
    ends.clone().max_by(|&a, &b| alike(a).cmp(&alike(b)).then(a.total_cmp(&b))).unwrap_or_default()
}

fn is_same_end(a: Real, b: Real) -> bool {
    (a - b).abs() <= SAME_END * a.abs().max(b.abs())
}

/// `name.png`, or the next of `name-2.png`, `name-3.png`, ... that does not exist in `folder`, or so of another
/// `extension`.
fn free_path(folder: &Path, name: &str, extension: &str) -> PathBuf {
    let numbered = (2..).map(|n: u32| folder.join(format!("{name}-{n}.{extension}")));
    let mut names = std::iter::once(folder.join(format!("{name}.{extension}"))).chain(numbered);
    names.find(|path| !path.exists()).unwrap_or_else(|| folder.join(name))
}

/// The runs that can be compared, and a line about each that cannot, or that was stopped.
fn comparable(folders: &[PathBuf]) -> Result<(Vec<RunResult>, Vec<String>), CommandError> {
    let mut found: Vec<(Real, RunResult)> = Vec::new();
    let mut lines = Vec::new();
    for folder in folders {
        let summary = summary(folder)?;
        let name =
            folder.file_name().map_or_else(|| folder.display().to_string(), |n| n.to_string_lossy().into_owned());
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
            volume_direct: 1e-9 * erosion("volume_direct_mm3").unwrap_or_default(),
            depth: 1e-3 * erosion("depth_mm").unwrap_or_default(),
            rim_radius: 1e-3 * erosion("rim_radius_mm").unwrap_or_default(),
            splashed: number(&summary, &["observables", "splash", "grains"]).unwrap_or_default() as usize,
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

fn several(folders: &[PathBuf], progress: &mut dyn Progress) -> Result<Vec<String>, CommandError> {
    let (runs, mut lines) = comparable(folders)?;
    let comparison = Comparison::of(runs);
    let groups: Vec<(String, Vec<ErosionPoint>)> = comparison
        .series
        .iter()
        .map(|series| {
            let points = series.runs.iter().map(|run| ErosionPoint {
                momentum: run.momentum,
                volume: run.volume,
                uncertainty: run.uncertainty,
            });
            (format!("D_{{H}}/D_{{V}} = {:.1}", series.axis_ratio), points.collect())
        })
        .collect();
    if !groups.is_empty() {
        let path = free_path(Path::new(""), "erosion-against-momentum", "png");
        save(erosion_against_momentum("Erosion volume against momentum", &groups).draw(), &path, progress)?;
    }
    lines.extend(aligned(&Comparison::COLUMNS.map(str::to_owned), &comparison.rows()));
    for series in &comparison.series {
        if let Some(law) = &series.law {
            let error = law.standard_error.map_or_else(String::new, |error| format!(" +- {error:.2}"));
            lines.push(format!("D_H/D_V = {:.2}: V ~ (m v)^{:.2}{error}", series.axis_ratio, law.exponent));
        }
        for scatter in series.scatter().iter().filter(|scatter| scatter.runs > 1) {
            lines.push(format!(
                "m v = {:.1} g cm/s: V = {:.2} mm^3, deviation {:.2} mm^3 over {} runs",
                1e5 * scatter.momentum,
                1e9 * scatter.mean,
                1e9 * scatter.deviation,
                scatter.runs
            ));
        }
    }
    Ok(lines)
}

fn aligned<const N: usize>(header: &[String; N], rows: &[[String; N]]) -> Vec<String> {
    let all = || std::iter::once(header).chain(rows);
    let widths: [usize; N] = std::array::from_fn(|n| all().map(|row| row[n].chars().count()).max().unwrap_or_default());
    all()
        .map(|row| row.iter().zip(widths).map(|(cell, width)| format!("{cell:>width$}")).collect::<Vec<_>>().join("  "))
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::progress::Silent;

    fn scratch(name: &str) -> PathBuf {
        let folder = std::env::temp_dir().join(format!("sazanami-analyse-{name}-{}", std::process::id()));
        let _ = std::fs::remove_dir_all(&folder);
        std::fs::create_dir_all(&folder).unwrap();
        folder
    }

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

    #[test]
    fn runs_that_failed_or_end_elsewhere_are_left_out() {
        let parent = scratch("several");
        let folders = [
            run(&parent, "straight", "finished", 0.02, [0.0, 0.0, -5e-4]),
            run(&parent, "slanted", "stopped", 0.02, [3e-4, 0.0, -4e-4]),
            run(&parent, "short", "finished", 0.01, [0.0, 0.0, -5e-4]),
            run(&parent, "broken", "failed", 0.02, [0.0, 0.0, -5e-4]),
        ];
        let (runs, lines) = comparable(&folders).unwrap();
        let names: Vec<&str> = runs.iter().map(|run| run.name.as_str()).collect();
        assert_eq!(names, ["straight", "slanted"]);
        assert!(runs.iter().all(|run| (run.momentum - 5e-4).abs() < 1e-15), "{runs:?}");
        let left_out: Vec<&String> = lines.iter().filter(|line| line.contains("left out")).collect();
        assert_eq!(left_out.len(), 2, "{lines:#?}");
        assert!(left_out[0].starts_with("broken: ") && left_out[1].starts_with("short: "), "{lines:#?}");
        std::fs::remove_dir_all(&parent).unwrap();
    }

    #[test]
    fn pictures_are_numbered() {
        let folder = scratch("numbers");
        for expected in ["a.png", "a-2.png", "a-3.png"] {
            let path = free_path(&folder, "a", "png");
            assert_eq!(path, folder.join(expected));
            std::fs::write(path, "").unwrap();
        }
        std::fs::remove_dir_all(&folder).unwrap();
    }

    #[test]
    fn a_crater_without_a_volume_has_a_line() {
        let folder = run(&scratch("crater"), "a", "finished", 0.02, [0.0; 3]);
        let told = |lines: &[String]| lines.iter().any(|line| line.contains("not evaluated: no rim"));
        assert!(!told(&analyse(std::slice::from_ref(&folder), &[], &mut Silent).unwrap()));
        let path = folder.join(SUMMARY);
        std::fs::write(&path, r#"{ "observables": { "erosion": { "not_evaluated": "no rim" } } }"#).unwrap();
        assert!(told(&analyse(std::slice::from_ref(&folder), &[], &mut Silent).unwrap()));
        std::fs::remove_dir_all(folder.parent().unwrap()).unwrap();
    }
}
