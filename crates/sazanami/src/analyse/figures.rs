//! Figures of a run from its tables, and where pictures go.

use std::path::{Path, PathBuf};

use sazanami_numerics::Real;
use serde_json::Value;

use super::output::{Output, undone};
use super::table::Table;
use crate::artist::{Curve, Figure};
use crate::error::CommandError;
use crate::recorder;
use crate::results::{CRATER_PROFILES, FIGURES, SERIES};

/// Draws the figures of a run with a crater from its tables.
pub(super) fn draw_figures(folder: &Path, summary: &Value, output: &mut Output) -> Result<(), CommandError> {
    let name = summary["case"].as_str().unwrap_or("run");
    let figures = folder.join(FIGURES);
    std::fs::create_dir_all(&figures).map_err(undone)?;
    let curves = Table::read(&folder.join(CRATER_PROFILES)).map(|profiles| curves(&profiles)).unwrap_or_default();
    if !curves.is_empty() {
        let figure = Figure::BedProfiles { title: &format!("{name}: smoothed bed surface"), curves: &curves };
        output.draw(&figure, &figures.join("profiles.png"))?;
    }
    if let Some(series) = Table::read(&folder.join(SERIES)).filter(|series| series.len() > 1) {
        draw_histories(&series, name, &figures, output)?;
    }
    list_files(folder, summary)
}

/// Draws crater and momentum against time.
fn draw_histories(series: &Table, name: &str, figures: &Path, output: &mut Output) -> Result<(), CommandError> {
    let times = &series.column("time");
    let is_known = |values: &[Real]| values.iter().any(|value| value.is_finite());
    let [depths, radii] = ["crater_depth", "rim_radius"].map(|column| series.column(column));
    if is_known(&depths) {
        let title = &format!("{name}: crater");
        let figure = Figure::Crater { title, times, depths_and_radii: [&depths, &radii] };
        output.draw(&figure, &figures.join("crater.png"))?;
    }
    let part = |column: &str| series.column(column);
    let walls: Vec<Real> =
        part("impulse_walls_on_fluid_3").iter().zip(part("impulse_walls_on_grains_3")).map(|(a, b)| a + b).collect();
    let parts = [
        ("liquid", part("momentum_liquid_3")),
        ("gas", part("momentum_gas_3")),
        ("grains", part("momentum_grains_3")),
        ("walls", walls),
        ("gravity", part("impulse_gravity_3")),
        ("displaced mass", part("impulse_swallowed_3")),
        ("residual", part("momentum_residual_3")),
    ];
    if is_known(&parts[0].1) {
        let figure = Figure::MomentumBudget { title: &format!("{name}: momentum"), times, parts: &parts };
        output.draw(&figure, &figures.join("momentum.png"))?;
    }
    Ok(())
}

/// Brings the list of files in the summary up to date.
pub(super) fn list_files(folder: &Path, summary: &Value) -> Result<(), CommandError> {
    // A run that is still on its way writes its summary itself.
    if summary["status"] != "running" {
        recorder::put_files(folder).map_err(undone)?;
    }
    Ok(())
}

/// Bed profiles at the start, at the end, and at a few times between.
fn curves(profiles: &Table) -> Vec<Curve> {
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
