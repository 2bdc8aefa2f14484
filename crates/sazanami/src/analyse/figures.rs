//! Figures of a run from its tables, and where pictures go.

use std::path::{Path, PathBuf};

use sazanami_numerics::Real;
use sazanami_observe::erosion::{Hollow, is_crater};
use serde_json::Value;

use super::output::{Output, undone};
use super::table::Table;
use crate::artist::{Curve, Figure};
use crate::case;
use crate::error::CommandError;
use crate::recorder;
use crate::results::{CASE, CRATER_PROFILES, FIGURES, SERIES};

/// Draws the figures of a run with a crater from its tables.
pub(super) fn draw_figures(folder: &Path, summary: &Value, output: &mut Output) -> Result<(), CommandError> {
    let name = summary["case"].as_str().unwrap_or("run");
    let figures = folder.join(FIGURES);
    std::fs::create_dir_all(&figures).map_err(undone)?;
    let curves = Table::read(&folder.join(CRATER_PROFILES))?.map(|profiles| curves(&profiles)).unwrap_or_default();
    if !curves.is_empty() {
        let title = format!("{name}: smoothed bed surface{}", volume_words(summary));
        output.draw(&Figure::BedProfiles { title: &title, curves: &curves }, &figures.join("profiles.png"))?;
    }
    if let Some(series) = Table::read(&folder.join(SERIES))?.filter(|series| series.len() > 1) {
        let grain_size = case::load(&folder.join(CASE), &[]).ok().and_then(|loaded| loaded.case.erosion);
        let grain_size = grain_size.map_or(0.0, |erosion| erosion.grain_size);
        draw_crater(&series, &format!("{name}: crater{}", volume_words(summary)), grain_size, &figures, output)?;
        draw_momentum(&series, &format!("{name}: momentum"), &figures, output)?;
    }
    list_files(folder, summary)
}

/// `, 61.27 ± 3.04 mm³ below the rim at 15.0 ms` as the summary has it, with what speaks against it; nothing without a crater.
fn volume_words(summary: &Value) -> String {
    let found = &summary["observables"]["erosion"];
    let [volume, half] = ["volume_below_rim_mm3", "volume_below_rim_uncertainty_mm3"].map(|key| found[key].as_f64());
    let doubts = found["volume_below_rim_doubts"].as_str();
    let doubts = doubts.map_or_else(String::new, |doubts| format!(" (not reliable: {doubts})"));
    match (volume, half, summary["time_s"].as_f64()) {
        (Some(volume), Some(half), Some(time)) => {
            format!(", {volume:.2} ± {half:.2} mm³ below the rim at {:.1} ms{doubts}", 1e3 * time)
        }
        _ => String::new(),
    }
}

/// Draws depth and rim of the crater against time.
fn draw_crater(
    series: &Table,
    title: &str,
    grain_size: Real,
    figures: &Path,
    output: &mut Output,
) -> Result<(), CommandError> {
    let [times, depths, mut radii, volumes, excavated] =
        ["time", "crater_depth", "rim_radius", "erosion_volume", "erosion_volume_excavated"]
            .map(|column| series.column(column));
    if !depths.iter().any(|depth| depth.is_finite()) {
        return Ok(());
    }
    // The highest layer is a rim only where there is a crater.
    let noise = volumes.first().copied().filter(|noise| noise.is_finite()).unwrap_or_default();
    for (row, radius) in radii.iter_mut().enumerate() {
        // Tables of older runs lack some.
        let at = |column: &[Real]| column.get(row).copied().unwrap_or_default();
        let hollow = Hollow { volume: at(&volumes), noise, excavated: at(&excavated) };
        if !is_crater(at(&depths), *radius, grain_size, hollow) {
            *radius = Real::NAN;
        }
    }
    let figure = Figure::Crater { title, times: &times, depths_and_radii: [&depths, &radii] };
    output.draw(&figure, &figures.join("crater.png"))
}

/// Draws the parts of the momentum along x3 against time. Walls carry what gravity brings: they are drawn less that.
fn draw_momentum(series: &Table, title: &str, figures: &Path, output: &mut Output) -> Result<(), CommandError> {
    let part = |column: &str| series.column(column);
    let external = ["impulse_walls_on_fluid_3", "impulse_walls_on_grains_3", "impulse_gravity_3"].map(part);
    let sum = (0..external[0].len()).map(|row| external.iter().map(|column| column[row]).sum());
    let parts = [
        ("liquid", part("momentum_liquid_3")),
        ("gas", part("momentum_gas_3")),
        ("grains", part("momentum_grains_3")),
        ("walls and gravity", sum.collect()),
        ("displaced mass", part("impulse_displaced_mass_flux_3")),
        ("residual", part("momentum_residual_3")),
    ];
    if parts[0].1.iter().any(|value| value.is_finite()) {
        let figure = Figure::MomentumBudget { title, times: &part("time"), parts: &parts };
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
