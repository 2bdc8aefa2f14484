//! Tables and figures from what runs wrote.

use std::path::{Path, PathBuf};

use sazanami_io::picture::{ErosionPoint, bed_profiles, crater_history, erosion_against_momentum, momentum_budget};
use sazanami_numerics::Real;
use sazanami_observe::comparison::{Comparison, RunResult};
use serde_json::Value;

use crate::case;
use crate::case::meaning::{FluidName, Region};
use crate::error::{CommandError, Failure};
use crate::progress::Progress;

/// Rows of a table with named columns; empty cells are not a number.
struct Table {
    columns: Vec<String>,
    rows: Vec<Vec<Real>>,
}

impl Table {
    fn read(path: &Path) -> Option<Self> {
        let text = std::fs::read_to_string(path).ok()?;
        let mut lines = text.lines();
        let columns = lines.next()?.split(',').map(|name| name.split(" [").next().unwrap_or(name).to_owned()).collect();
        let rows = lines.map(|line| line.split(',').map(|cell| cell.parse().unwrap_or(Real::NAN)).collect()).collect();
        Some(Self { columns, rows })
    }

    fn column(&self, name: &str) -> Vec<Real> {
        match self.columns.iter().position(|column| column == name) {
            Some(at) => self.rows.iter().map(|row| row.get(at).copied().unwrap_or(Real::NAN)).collect(),
            None => Vec::new(),
        }
    }
}

/// Recomputes what one run tells, or compares several; returns lines for people.
///
/// # Errors
/// If a folder holds no results, or a figure cannot be written.
pub fn analyse(folders: &[PathBuf], progress: &mut dyn Progress) -> Result<Vec<String>, CommandError> {
    match folders {
        [] => Err(CommandError::input("no folder of results is given", "give one or more folders of runs")),
        [folder] => one(folder, progress),
        many => several(many, progress),
    }
}

fn summary(folder: &Path) -> Result<Value, CommandError> {
    let path = folder.join("summary.json");
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
    Failure { kind: "picture", message: error.to_string(), ..Failure::default() }.into()
}

fn one(folder: &Path, progress: &mut dyn Progress) -> Result<Vec<String>, CommandError> {
    let summary = summary(folder)?;
    let name = summary["case"].as_str().unwrap_or("run").to_owned();
    let figures = folder.join("figures");
    std::fs::create_dir_all(&figures).map_err(|error| drawing(&error))?;
    for (file, plot) in line_plots(folder, &name) {
        let path = figures.join(file);
        plot.draw().and_then(|picture| picture.save(&path)).map_err(|error| drawing(&error))?;
        progress.message(&format!("drew {}", path.display()));
    }
    Ok(report(&summary, folder))
}

fn line_plots(folder: &Path, name: &str) -> Vec<(&'static str, sazanami_io::picture::LinePlot)> {
    let mut plots = Vec::new();
    if let Some(profiles) = Table::read(&folder.join("profiles.csv")) {
        let curves = curves(&profiles);
        if !curves.is_empty() {
            plots.push(("profiles.png", bed_profiles(&format!("{name}: smoothed bed surface"), &curves)));
        }
    }
    let Some(series) = Table::read(&folder.join("series.csv")) else { return plots };
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
    let first = profiles.columns.iter().position(|column| column == "height_0");
    let Some(first) = first.filter(|_| count > 0) else { return Vec::new() };
    chosen
        .into_iter()
        .map(|row| {
            let heights = profiles.rows[row].iter().skip(first).enumerate();
            let points = heights.map(|(n, &height)| [(n as Real + 0.5) * layers[row], height]);
            let label = format!("t = {:.1} ms", 1e3 * times[row]);
            (label, points.filter(|point| point[1].is_finite()).collect())
        })
        .collect()
}

fn number(value: &Value, path: &[&str]) -> Option<Real> {
    path.iter().try_fold(value, |value, key| value.get(key)).and_then(Value::as_f64)
}

/// The table at the end of a run.
fn report(summary: &Value, folder: &Path) -> Vec<String> {
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
    row("splashed grains", &["observables", "splash", "grains"], 1.0, "", 0);
    row("  their mass", &["observables", "splash", "mass_mg"], 1.0, "mg", 3);
    row("  farthest from the axis", &["observables", "splash", "farthest_distance_mm"], 1.0, "mm", 2);
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
    let width = rows.iter().map(|(label, _)| label.len()).max().unwrap_or_default();
    let mut lines: Vec<String> = rows.into_iter().map(|(label, value)| format!("{label:<width$}  {value}")).collect();
    if let Some(picture) = newest_picture(folder) {
        lines.push(format!("{:<width$}  {}", "picture", picture.display()));
    }
    lines
}

fn newest_picture(folder: &Path) -> Option<PathBuf> {
    let entries = std::fs::read_dir(folder.join("figures")).ok()?;
    let named =
        |path: &PathBuf, begin: &str| path.file_name().is_some_and(|name| name.to_string_lossy().starts_with(begin));
    let mut paths: Vec<PathBuf> =
        entries.flatten().map(|entry| entry.path()).filter(|path| named(path, "view-")).collect();
    paths.sort();
    paths.pop()
}

/// Axis ratio of the first liquid of a case, horizontal over vertical.
fn axis_ratio(folder: &Path) -> Real {
    let Ok(loaded) = case::load(&folder.join("case.toml"), &[]) else { return 1.0 };
    let drop = loaded.case.liquids.iter().find(|liquid| liquid.fluid == FluidName::Liquid);
    match drop.map(|liquid| &liquid.region) {
        Some(Region::Spheroid { horizontal_diameter, vertical_diameter, .. }) => {
            horizontal_diameter / vertical_diameter
        }
        _ => 1.0,
    }
}

fn several(folders: &[PathBuf], progress: &mut dyn Progress) -> Result<Vec<String>, CommandError> {
    let mut runs = Vec::new();
    let mut lines = Vec::new();
    for folder in folders {
        let summary = summary(folder)?;
        let name =
            folder.file_name().map_or_else(|| folder.display().to_string(), |n| n.to_string_lossy().into_owned());
        let status = summary["status"].as_str().unwrap_or("unknown");
        let erosion = |key: &str| number(&summary, &["observables", "erosion", key]);
        let Some(volume) = erosion("volume_mm3") else {
            lines.push(format!("{name}: {status}, without an erosion volume"));
            continue;
        };
        if status != "finished" {
            lines
                .push(format!("{name}: {status} at {:.3} ms", 1e3 * number(&summary, &["time_s"]).unwrap_or_default()));
        }
        let momentum = summary["momentum"]["initial"]["liquid"][2].as_f64().unwrap_or_default().abs();
        runs.push(RunResult {
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
        });
    }
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
        let path = PathBuf::from("erosion-against-momentum.png");
        let plot = erosion_against_momentum("Erosion volume against momentum", &groups);
        plot.draw().and_then(|picture| picture.save(&path)).map_err(|error| drawing(&error))?;
        progress.message(&format!("drew {}", path.display()));
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
