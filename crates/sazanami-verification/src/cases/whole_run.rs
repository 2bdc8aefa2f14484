//! A case run whole, into a folder that goes when it is no longer needed, or is kept.

use std::path::{Path, PathBuf};

use sazanami::analyse::Table;
use sazanami::progress::Silent;
use sazanami::run::{RunOptions, resume, run};
use sazanami::saved;
use sazanami::state::{Array, Values, WaterState};
use sazanami::stop::Stop;
use sazanami_numerics::Real;
use sazanami_posing::case::{LoadedCase, resolved};
use serde_json::Value;

/// The table that is made of the files of fields: a row for each, and of an array of the cells the integral over the box of its distance
/// from the first file.
const FIELDS: &str = "fields";

/// How the runs of cases are made.
#[derive(Clone, Copy, Debug)]
pub struct Manner<'a> {
    /// Ends them early once it is set.
    pub stop: &'a Stop,
    /// Where they are kept, each in `<case>/<number>`; those that are there, of the same case and version of the program, are taken if they have
    /// finished, or gone on with if they can. A program that was changed and has the same version is not told apart.
    pub keep: Option<&'a Path>,
}

impl<'a> Manner<'a> {
    /// Runs that are not kept.
    #[must_use]
    pub const fn passing(stop: &'a Stop) -> Self {
        Self { stop, keep: None }
    }
}

/// Folder of a finished run.
pub(crate) struct WholeRun {
    folder: PathBuf,
    is_kept: bool,
}

/// The word in which `summary.json` of a folder has the state of its run, if that was of this case and by this version of the program.
fn status_in(folder: &Path, loaded: &LoadedCase) -> Option<String> {
    let text = std::fs::read_to_string(folder.join("summary.json")).ok()?;
    let summary: Value = serde_json::from_str(&text).ok()?;
    let is_same = summary["case_hash"] == resolved::hash_text(&loaded.case).as_str()
        && summary["version"] == env!("CARGO_PKG_VERSION");
    summary["status"].as_str().filter(|_| is_same).map(str::to_owned)
}

impl WholeRun {
    /// Runs `loaded`, number `n` of the case `name`, on one thread: several cases share the processors.
    ///
    /// # Errors
    /// If it cannot run, fails, or is stopped before its end.
    pub fn of(name: &str, n: usize, loaded: &LoadedCase, manner: Manner<'_>) -> Result<Self, String> {
        let passing = || std::env::temp_dir().join(format!("sazanami-{name}-{n}-{}", std::process::id()));
        let folder = manner.keep.map_or_else(passing, |keep| keep.join(name).join(n.to_string()));
        let left = Self { folder, is_kept: manner.keep.is_some() };
        let options = RunOptions { threads: Some(1), ranks: 1, ..RunOptions::default() };
        let gone_on = match status_in(&left.folder, loaded).as_deref().filter(|_| left.is_kept) {
            Some("finished") => return Ok(left),
            // Without a checkpoint that can be read it begins anew.
            Some("running" | "stopped") => resume(&left.folder, &options, &mut Silent, manner.stop).ok(),
            _ => None,
        };
        let anew = || {
            let options = RunOptions { out: Some(left.folder.clone()), force: true, ..options };
            run(loaded, &options, &mut Silent, manner.stop)
        };
        let ended = gone_on.map_or_else(anew, Ok).map_err(|error| error.to_string())?;
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
        if !self.is_kept {
            // What cannot be removed stays in the folder for such things.
            let _ = std::fs::remove_dir_all(&self.folder);
        }
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
        let whole = WholeRun::of("one-thread", 0, &loaded, Manner::passing(&Stop::new())).unwrap();
        let threads = |folder: &Path| {
            let summary = std::fs::read_to_string(folder.join("summary.json")).unwrap();
            serde_json::from_str::<serde_json::Value>(&summary).unwrap()["machine"]["threads"].clone()
        };
        let series = |folder: &Path| std::fs::read(folder.join("series.csv")).unwrap();
        assert_eq!(threads(&whole.folder), 1);
        // The control: two threads are told as two, and measure the same.
        let other = WholeRun { folder: whole.folder.with_extension("two"), is_kept: false };
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
            let ours = format!("sazanami-stopped-0-{}", std::process::id());
            place.filter(|entry| entry.file_name().to_string_lossy() == ours).count()
        };
        let whole = WholeRun::of("stopped", 0, &loaded, Manner::passing(&stop)).unwrap();
        assert_eq!(left(), 1);
        drop(whole);
        stop.set(sazanami::stop::StopCause::Caller);
        assert!(
            WholeRun::of("stopped", 0, &loaded, Manner::passing(&stop)).is_err_and(|error| error.contains("stopped"))
        );
        assert_eq!(left(), 0);
    }

    #[test]
    fn a_kept_run_is_taken_or_gone_on_with_where_it_is_of_the_same_case() {
        let keep = std::env::temp_dir().join(format!("sazanami-kept-{}", std::process::id()));
        let loaded = |overrides: &[&str]| {
            let overrides = [&["run.until=20 ms"], overrides].concat().into_iter().map(str::to_owned);
            case::parse(Path::new("case.toml"), COLUMN, &overrides.collect::<Vec<_>>())
                .unwrap_or_else(|error| panic!("{error}"))
        };
        let of = |overrides: &[&str], stop: &Stop| {
            let loaded = loaded(overrides);
            WholeRun::of("column", 3, &loaded, Manner { stop, keep: Some(&keep) }).map(drop)
        };
        let folder = keep.join("column/3");
        let hash = || status_and_hash(&folder).1;
        let stop = Stop::new();
        stop.set(sazanami::stop::StopCause::Caller);
        assert!(of(&[], &stop).is_err());
        // Stopped after some steps it goes on with them.
        let some = RunOptions { out: Some(folder.clone()), force: true, steps: Some(2), ..RunOptions::default() };
        run(&loaded(&[]), &some, &mut Silent, &Stop::new()).unwrap_or_else(|error| panic!("{error}"));
        assert_eq!(status_and_hash(&folder).0, "stopped");
        of(&[], &Stop::new()).expect("it goes on");
        let log = std::fs::read_to_string(folder.join("log.txt")).unwrap();
        assert!(log.contains("going on from step 2"), "{log}");
        let (first, begun) = (hash(), std::fs::metadata(folder.join("series.csv")).unwrap().modified().unwrap());
        assert_eq!(status_and_hash(&folder).0, "finished");
        // It is there: nothing has to run, not even where everything is stopped.
        of(&[], &stop).expect("it has finished");
        assert_eq!(std::fs::metadata(folder.join("series.csv")).unwrap().modified().unwrap(), begun);
        // Negative control: another case is run anew.
        of(&["gravity=1.62 m/s^2"], &Stop::new()).expect("the case is sound");
        assert_ne!(hash(), first);
        std::fs::remove_dir_all(&keep).unwrap();
    }

    fn status_and_hash(folder: &Path) -> (String, String) {
        let summary: Value = serde_json::from_slice(&std::fs::read(folder.join("summary.json")).unwrap()).unwrap();
        let word = |key: &str| summary[key].as_str().unwrap_or_default().to_owned();
        (word("status"), word("case_hash"))
    }
}
