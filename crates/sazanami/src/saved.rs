//! States in the files that a run wrote for ParaView, read back.

use std::path::{Path, PathBuf};

use sazanami_io::vtk::{ReadError, SeriesEntry, VtkFile, read_series};
use sazanami_numerics::grid::Grid;
use sazanami_numerics::{Real, Vector};

use crate::error::CommandError;
use crate::results::{FIELD_SERIES, GRAIN_SERIES};
use crate::state::{Array, State, Values, WaterState};

/// Files of a run at one time.
#[derive(Clone, Debug, PartialEq)]
pub struct SavedTime {
    /// Simulated time \[s].
    pub time: Real,
    /// The grains as points.
    pub grains: Option<PathBuf>,
    /// File with the fields or particles of the water.
    pub water: Option<PathBuf>,
}

/// The times at which the run in `folder` wrote grains, water or both, in their order.
///
/// # Errors
/// If a list of files is damaged.
pub fn times(folder: &Path) -> Result<Vec<SavedTime>, CommandError> {
    let series = |name: &str| read_series(&folder.join(name)).map_err(refused);
    let path = |entry: &SeriesEntry| Some(folder.join(&entry.file));
    let entry = |entry: &SeriesEntry| SavedTime { time: entry.time, grains: path(entry), water: None };
    let mut times: Vec<SavedTime> = series(GRAIN_SERIES)?.iter().map(entry).collect();
    for water in series(FIELD_SERIES)? {
        match times.iter_mut().find(|known| known.time == water.time) {
            Some(known) => known.water = path(&water),
            None => times.push(SavedTime { time: water.time, grains: None, water: path(&water) }),
        }
    }
    times.sort_by(|a, b| a.time.total_cmp(&b.time));
    Ok(times)
}

/// Reads what was written at a time.
///
/// # Errors
/// If a file is missing or damaged.
pub fn state(saved: &SavedTime) -> Result<State, CommandError> {
    let grains = saved.grains.as_deref().map(|path| points(&VtkFile::read(path)?)).transpose().map_err(refused)?;
    let water = saved.water.as_deref().map(|path| water(&VtkFile::read(path)?)).transpose().map_err(refused)?;
    let state = State { time: saved.time, step: None, grains: grains.unwrap_or_default(), water };
    if is_whole(&state) {
        return Ok(state);
    }
    let files: Vec<String> =
        [&saved.grains, &saved.water].into_iter().flatten().map(|path| path.display().to_string()).collect();
    Err(CommandError::input(format!("{}: an array is shorter than the others", files.join(" or ")), AGAIN))
}

const AGAIN: &str = "the results are damaged: take them from a copy, or run the case again";

/// Positions and arrays of points.
fn points(file: &VtkFile) -> Result<Vec<Array>, ReadError> {
    let (components, values) = file.values("Points")?;
    let mut arrays = vec![Array { name: "position".into(), components, values }];
    arrays.extend(named(file)?);
    Ok(arrays)
}

fn named(file: &VtkFile) -> Result<Vec<Array>, ReadError> {
    let array = |name: &str| {
        let (components, values) = file.values(name)?;
        Ok(Array { name: name.to_owned(), components, values })
    };
    file.names().map(array).collect()
}

/// Cells of a grid, or particles.
fn water(file: &VtkFile) -> Result<WaterState, ReadError> {
    let Ok(extent) = file.numbers::<6>("ImageData", "WholeExtent") else {
        return Ok(WaterState::Particles { arrays: points(file)? });
    };
    let [lower, spacing] = ["Origin", "Spacing"].map(|name| file.numbers::<3>("ImageData", name).map(Vector::from));
    let cells = [0, 1, 2].map(|d| (extent[2 * d + 1] - extent[2 * d]).max(0.0) as usize);
    let grid = Grid { cells, lower: lower?, spacing: spacing? };
    Ok(WaterState::Grid { grid, arrays: named(file)? })
}

fn refused(error: ReadError) -> CommandError {
    CommandError::input(error.to_string(), AGAIN)
}

/// Whether every array has a value for each grain, cell or particle.
fn is_whole(state: &State) -> bool {
    let count = |arrays: &[Array]| arrays.first().map_or(0, rows);
    let alike = |arrays: &[Array], count: usize| arrays.iter().all(|array| rows(array) == count);
    let water = match &state.water {
        Some(WaterState::Grid { grid, arrays }) => alike(arrays, grid.len()),
        Some(WaterState::Particles { arrays }) => alike(arrays, count(arrays)),
        None => true,
    };
    water && alike(&state.grains, count(&state.grains))
}

fn rows(array: &Array) -> usize {
    Values::len(&array.values) / array.components.max(1)
}
