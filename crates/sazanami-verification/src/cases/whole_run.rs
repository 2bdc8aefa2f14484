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
    /// Runs `loaded` under a `name` of its own, on one thread: several cases share the processors.
    ///
    /// # Errors
    /// If it cannot run, fails, or `stop` is set before its end.
    pub fn of(name: &str, loaded: &LoadedCase, stop: &Stop) -> Result<Self, String> {
        let left = Self { folder: std::env::temp_dir().join(format!("sazanami-{name}-{}", std::process::id())) };
        let out = Some(left.folder.clone());
        let options = RunOptions { out, force: true, threads: Some(1), ranks: 1, ..RunOptions::default() };
        let ended = run(loaded, &options, &mut Silent, stop).map_err(|error| error.to_string())?;
        if ended.interrupted { Err("it was stopped before its end".into()) } else { Ok(left) }
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

#[cfg(test)]
mod tests {
    use std::path::Path;

    use sazanami_posing::case;

    use super::*;

    /// Water that falls in a column for a few steps.
    const COLUMN: &str = "gravity = \"9.81 m/s^2\"\n[domain]\nsize = [\"4 mm\", \"4 mm\", \"8 mm\"]\ncells = [4, 4, 8]\n\
                          [[liquid]]\nregion.box = { lower = [\"0 mm\", \"0 mm\", \"0 mm\"], upper = [\"2 mm\", \"4 mm\", \"4 mm\"] }\n\
                          [output]\nfields = { at = [] }\nfigures = { at = [] }\n[run]\nuntil = \"2 ms\"\n";

    #[test]
    fn a_case_takes_one_thread_and_has_the_values_of_any_number() {
        let loaded = case::parse(Path::new("case.toml"), COLUMN, &[]).unwrap_or_else(|error| panic!("{error}"));
        let whole = WholeRun::of("one-thread", &loaded, &Stop::new()).unwrap();
        let threads = |folder: &Path| {
            let summary = std::fs::read_to_string(folder.join("summary.json")).unwrap();
            serde_json::from_str::<serde_json::Value>(&summary).unwrap()["machine"]["threads"].clone()
        };
        let series = |folder: &Path| std::fs::read(folder.join("series.csv")).unwrap();
        assert_eq!(threads(&whole.folder), 1);
        // The control: two threads are told as two, and measure the same.
        let other = WholeRun { folder: whole.folder.with_extension("two") };
        let options =
            RunOptions { out: Some(other.folder.clone()), force: true, threads: Some(2), ..RunOptions::default() };
        run(&loaded, &options, &mut Silent, &Stop::new()).unwrap_or_else(|error| panic!("{error}"));
        assert_eq!((threads(&other.folder), series(&other.folder)), (2.into(), series(&whole.folder)));
    }

    #[test]
    fn a_run_that_is_stopped_leaves_nothing() {
        let loaded = case::parse(Path::new("case.toml"), COLUMN, &[]).unwrap_or_else(|error| panic!("{error}"));
        let stop = Stop::new();
        let left = || {
            let place = std::fs::read_dir(std::env::temp_dir()).unwrap().flatten();
            let ours = format!("sazanami-stopped-{}", std::process::id());
            place.filter(|entry| entry.file_name().to_string_lossy() == ours).count()
        };
        let whole = WholeRun::of("stopped", &loaded, &stop).unwrap();
        assert_eq!(left(), 1);
        drop(whole);
        stop.set(sazanami::stop::StopCause::Caller);
        assert!(WholeRun::of("stopped", &loaded, &stop).is_err_and(|error| error.contains("stopped")));
        assert_eq!(left(), 0);
    }
}
