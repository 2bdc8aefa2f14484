//! Results of a run that has ended, read and checked before anything is made of them.

use std::path::{Path, PathBuf};

use serde_json::Value;

use crate::analyse::Table;
use crate::case::{self, LoadedCase};
use crate::checkpoints;
use crate::error::CommandError;
use crate::lock::FolderLock;
use crate::results::{CASE, SERIES, SUMMARY, as_word};

/// Results in a folder.
#[derive(Debug)]
pub struct Finished {
    /// Folder of the results.
    pub folder: PathBuf,
    /// `summary.json`: what the run was, did and found.
    pub summary: Value,
    /// The case as it was run.
    pub case: LoadedCase,
    /// `series.csv`: a row per observation.
    pub series: Table,
}

impl Finished {
    /// Reads the results in `folder`.
    ///
    /// # Errors
    /// If a run is still writing to it, if it holds no results or those of another version, or if they are damaged.
    pub fn open(folder: &Path) -> Result<Self, CommandError> {
        if !folder.is_dir() {
            return Err(CommandError::input(format!("there is no folder `{}`", folder.display()), GIVE));
        }
        FolderLock::refuse_held(folder)?;
        Self::read(folder)
    }

    /// The same for the run itself, which holds the folder.
    ///
    /// # Errors
    /// As [`Self::open`].
    pub fn read(folder: &Path) -> Result<Self, CommandError> {
        let summary = crate::analyse::summary(folder)?;
        refuse_other(folder, &summary)?;
        let case = case::load(&folder.join(CASE), &[])?;
        let series = folder.join(SERIES);
        let Some(series) = Table::read(&series)? else {
            return Err(CommandError::input(format!("`{}` is missing", series.display()), "run the case again"));
        };
        Ok(Self { series, folder: folder.to_owned(), summary, case })
    }

    /// Name of the results for people: that of their folder.
    #[must_use]
    pub fn name(&self) -> String {
        let folder = std::path::absolute(&self.folder).unwrap_or_else(|_| self.folder.clone());
        folder.file_name().map_or_else(|| self.case.case.name.clone(), |name| name.to_string_lossy().into_owned())
    }

    /// The number at a path in the summary, its keys with dots between, if there is one.
    #[must_use]
    pub fn number(&self, path: &str) -> Option<f64> {
        path.split('.').try_fold(&self.summary, |value, key| value.get(key)).and_then(Value::as_f64)
    }

    /// The newest checkpoint that can be gone on from.
    #[must_use]
    pub fn last_checkpoint(&self) -> Option<PathBuf> {
        checkpoints::last_good(&self.folder)
    }

    /// Another table of the run, if it wrote one.
    ///
    /// # Errors
    /// If it is damaged.
    pub fn table(&self, name: &str) -> Result<Option<Table>, CommandError> {
        Table::read(&self.folder.join(name))
    }
}

const GIVE: &str = "give the folder that `sazanami run` wrote to";

/// Refuses the summary of a run that has not ended, and of another version of the program.
fn refuse_other(folder: &Path, summary: &Value) -> Result<(), CommandError> {
    let place = folder.display();
    let (Some(status), Some(version)) = (summary["status"].as_str(), summary["version"].as_str()) else {
        return Err(CommandError::input(
            format!("{}: it names no status and no version of the program", folder.join(SUMMARY).display()),
            "the summary is damaged; resume the run to rewrite it",
        ));
    };
    let own = env!("CARGO_PKG_VERSION");
    if version != own {
        return Err(CommandError::input(
            format!("`{place}` was written by sazanami {version}, and this is {own}"),
            format!("use sazanami {version} for it, or run its {CASE} again with this one"),
        ));
    }
    if status == "running" {
        return Err(CommandError::input(
            format!("the run in `{place}` broke off before its end"),
            format!("go on with it: `sazanami resume {}`", as_word(folder)),
        ));
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use std::fs;

    use super::*;

    const SMALL: &str = "[domain]\nsize = [\"1 mm\", \"1 mm\", \"2 mm\"]\ncells = [4, 4, 8]\n[run]\nuntil = \"1 ms\"\n";

    fn results(folder: &Path, status: &str, version: &str, series: &str) {
        fs::write(folder.join(CASE), SMALL).unwrap();
        fs::write(folder.join(SUMMARY), format!(r#"{{"status": "{status}", "version": "{version}", "time_s": 0.5}}"#))
            .unwrap();
        fs::write(folder.join(SERIES), series).unwrap();
    }

    #[test]
    fn only_whole_results_of_this_version_are_read() {
        let folder = tempfile::tempdir().unwrap();
        let folder = folder.path();
        let refused = || {
            let error = Finished::open(folder).unwrap_err();
            assert_eq!(error.exit_code(), crate::error::exit::WRONG_INPUT);
            error.to_string()
        };
        let (own, good) = (env!("CARGO_PKG_VERSION"), "step,time [s],limiter\n0,0,cfl\n1,0.5,\n");
        assert!(refused().contains("holds no results"), "{}", refused());
        results(folder, "finished", own, good);
        let found = Finished::open(folder).unwrap();
        assert_eq!(found.number("time_s"), Some(0.5));
        assert_eq!(found.series.headings().nth(1), Some(("time", "s")));
        for (status, version, series, cause) in [
            ("running", own, good, "resume"),
            ("finished", "0.0.1", good, "sazanami 0.0.1"),
            ("finished", own, "step,time [s]\n0,0\n1\n", "series.csv:3"),
            ("finished", own, "step,time [s]\nx,0\n", "series.csv:2"),
            ("finished", own, "", "series.csv: this is empty"),
            ("finished", own, "step,time [s],lim", "series.csv:1: the file ends within this line"),
            ("finished", own, "step,time [s]\n0,0\n1,0.5", "series.csv:3: the file ends within this line"),
        ] {
            results(folder, status, version, series);
            assert!(refused().contains(cause), "{}", refused());
        }
        fs::write(folder.join(SUMMARY), "{\"status\": ").unwrap();
        assert!(refused().contains("the summary is damaged"), "{}", refused());
        fs::write(folder.join(SUMMARY), "{}").unwrap();
        assert!(refused().contains("no version"), "{}", refused());
        results(folder, "finished", own, good);
        fs::remove_file(folder.join(SERIES)).unwrap();
        assert!(refused().contains("series.csv` is missing"), "{}", refused());
        results(folder, "finished", own, good);
        let held = FolderLock::take(folder).unwrap();
        assert!(refused().contains("in use"), "{}", refused());
        drop(held);
        // A command is told that can be copied.
        let spaced = folder.join("my runs");
        fs::create_dir(&spaced).unwrap();
        results(&spaced, "running", own, good);
        let told = Finished::open(&spaced).unwrap_err().to_string();
        assert!(told.contains(&format!("`sazanami resume '{}'`", spaced.display())), "{told}");
        assert!(Finished::open(&folder.join("absent")).unwrap_err().to_string().contains("no folder"));
    }
}
