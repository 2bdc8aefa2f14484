//! Figures of a run from its tables, and where pictures go.

use std::path::{Path, PathBuf};

use sazanami_numerics::Real;
use sazanami_picture::{LinePlot, Picture, PictureError, bed_profiles, crater_history, momentum_budget};
use serde_json::Value;

use super::table::Table;
use crate::error::CommandError;
use crate::progress::Progress;
use crate::recorder;
use crate::results::{CRATER_PROFILES, FIGURES, SERIES};

/// An error of the file system or of a picture.
pub(super) fn drawing(error: &dyn std::fmt::Display) -> CommandError {
    CommandError::Undone(error.to_string())
}

pub(super) fn draw_figures(folder: &Path, summary: &Value, progress: &mut dyn Progress) -> Result<(), CommandError> {
    let name = summary["case"].as_str().unwrap_or("run").to_owned();
    let figures = folder.join(FIGURES);
    std::fs::create_dir_all(&figures).map_err(|error| drawing(&error))?;
    for (file, plot) in line_plots(folder, &name) {
        save(plot.draw(), &figures.join(file), progress)?;
    }
    list_files(folder, summary)
}

/// Saves what was drawn and says so.
pub(super) fn save(
    picture: Result<Picture, PictureError>,
    path: &Path,
    progress: &mut dyn Progress,
) -> Result<(), CommandError> {
    picture.and_then(|picture| picture.save(path)).map_err(|error| drawing(&error))?;
    progress.message(&format!("drew {}", path.display()));
    Ok(())
}

/// Brings the list of files in the summary up to date.
pub(super) fn list_files(folder: &Path, summary: &Value) -> Result<(), CommandError> {
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
        ("displaced mass", part("impulse_swallowed_3")),
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
    let count = profiles.len();
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

/// The last of the pictures whose names begin with `prefix`.
pub(super) fn newest_picture(folder: &Path, prefix: &str) -> Option<PathBuf> {
    let paths = std::fs::read_dir(folder.join(FIGURES)).ok()?.flatten().map(|entry| entry.path());
    let named = |path: &PathBuf| path.file_name().is_some_and(|name| name.to_string_lossy().starts_with(prefix));
    paths.filter(named).max()
}

/// `name.png`, or the next of `name-2.png`, `name-3.png`, ... that does not exist in `folder`, or so of another
/// `extension`.
pub(super) fn free_path(folder: &Path, name: &str, extension: &str) -> PathBuf {
    let numbered = (2..).map(|n: u32| folder.join(format!("{name}-{n}.{extension}")));
    let mut names = std::iter::once(folder.join(format!("{name}.{extension}"))).chain(numbered);
    names.find(|path| !path.exists()).unwrap_or_else(|| folder.join(name))
}
