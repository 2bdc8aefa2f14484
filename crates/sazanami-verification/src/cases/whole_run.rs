//! A case run whole, into a folder that goes when it is no longer needed.

use std::path::PathBuf;

use sazanami::analyse::Table;
use sazanami::progress::Silent;
use sazanami::run::{RunOptions, run};
use sazanami::saved;
use sazanami::state::{Array, Values, WaterState};
use sazanami::stop::Stop;
use sazanami_numerics::Real;
use sazanami_posing::case::LoadedCase;

/// The table that is made of the files of fields: a row for each, and of an array of the cells the integral over the box of its distance
/// from the first file.
const FIELDS: &str = "fields";

/// Folder of a finished run.
pub(crate) struct WholeRun {
    folder: PathBuf,
}

impl WholeRun {
    /// Runs `loaded` under a `name` of its own.
    pub fn of(name: &str, loaded: &LoadedCase) -> Result<Self, String> {
        let left = Self { folder: std::env::temp_dir().join(format!("sazanami-{name}-{}", std::process::id())) };
        let options = RunOptions { out: Some(left.folder.clone()), force: true, ranks: 1, ..RunOptions::default() };
        run(loaded, &options, &mut Silent, &Stop::new()).map_err(|error| error.to_string())?;
        Ok(left)
    }

    /// Columns of one of its tables, by name, of all its rows or those of a layer (`layers.csv upper`); NaN where a cell is
    /// empty.
    ///
    /// # Errors
    /// If there is no such table or column, or a cell holds what is no finite number.
    pub fn columns<const N: usize>(&self, table: &str, names: [&str; N]) -> Result<[Vec<Real>; N], String> {
        if table == FIELDS {
            return self.fields(names);
        }
        let (table, layer) = match table.split_once(".csv ") {
            Some((_, layer)) => (&table[..table.len() - layer.len() - 1], Some(layer)),
            None => (table, None),
        };
        let path = self.folder.join(table);
        let table = Table::read(&path).map_err(|error| error.to_string())?;
        let table = table.ok_or_else(|| format!("there is no table {}", path.display()))?;
        let found = names.map(|name| table.column(name));
        if let Some(n) = found.iter().position(Vec::is_empty) {
            return Err(format!("{} has no column {}", path.display(), names[n]));
        }
        for (name, values) in names.iter().zip(&found) {
            let words = table.words(name);
            if let Some((word, _)) =
                words.iter().zip(values).find(|(word, value)| !value.is_finite() && !word.is_empty())
            {
                return Err(format!("{} has `{word}` in column {name}", path.display()));
            }
        }
        let Some(layer) = layer else { return Ok(found) };
        let layers = table.words("layer");
        let of_layer = |values: Vec<Real>| {
            values.into_iter().zip(&layers).filter(|(_, other)| **other == layer).map(|(value, _)| value).collect()
        };
        Ok(found.map(of_layer))
    }

    /// Columns of [`FIELDS`].
    fn fields<const N: usize>(&self, names: [&str; N]) -> Result<[Vec<Real>; N], String> {
        let mut first = None;
        let mut found = names.map(|_| Vec::new());
        for saved in saved::times(&self.folder).map_err(|error| error.to_string())? {
            let state = saved::state(&saved).map_err(|error| error.to_string())?;
            let Some(WaterState::Grid { grid, arrays }) = state.water else { continue };
            let first = first.get_or_insert_with(|| arrays.clone());
            for (name, column) in names.iter().zip(&mut found) {
                let values = |arrays: &[Array]| match arrays.iter().find(|array| array.name == *name)?.values {
                    Values::F64(ref values) => Some(values.clone()),
                    _ => None,
                };
                column.push(match (values(first), values(&arrays)) {
                    _ if *name == "time" => state.time,
                    (Some(a), Some(b)) => {
                        grid.cell_volume() * a.iter().zip(&b).map(|(a, b)| (b - a).abs()).sum::<Real>()
                    }
                    _ => return Err(format!("the files of fields have no {name} in double precision")),
                });
            }
        }
        if first.is_none() {
            return Err("the run wrote no fields of a grid".into());
        }
        Ok(found)
    }
}

impl Drop for WholeRun {
    fn drop(&mut self) {
        // What cannot be removed stays in the folder for such things.
        let _ = std::fs::remove_dir_all(&self.folder);
    }
}
