//! Working on a sweep: its record and lock, its runs, table and array job.

use std::fs::{self, File, OpenOptions, TryLockError};
use std::path::{Path, PathBuf};

use sazanami::case;
use sazanami::case::resolved;
use sazanami::check::bytes;
use sazanami::error::CommandError;
use sazanami::machine;
use sazanami::progress::Progress;
use sazanami::results::CASE;
use sazanami::stop::Stop;
use sazanami_io::replace_file;
use sazanami_io::table::write_json;
use serde::{Deserialize, Serialize};

use crate::pool::{Pool, SideBySide};
use crate::posed::Run;
use crate::sensitivity::SENSITIVITY;
use crate::state::{Progressed, State};
use crate::sweep::{CASES, LOGS, Sweep};
use crate::{sensitivity, slurm, table};

/// Record of the sweep in a folder.
const RECORD: &str = "sweep.json";
/// The points that a calibration tried, so that it goes on where it was.
pub(crate) const TRIED: &str = "calibration.json";
/// Held by the command that works on a sweep.
const LOCK: &str = ".sweep-lock";
/// The script of an array job.
const SCRIPT: &str = "sweep.sbatch";

/// Contents of the record of a sweep.
#[derive(Debug, PartialEq, Eq, Serialize, Deserialize)]
struct Record {
    version: String,
    runs: Vec<RecordedRun>,
}

#[derive(Debug, PartialEq, Eq, Serialize, Deserialize)]
struct RecordedRun {
    name: String,
    case_hash: String,
    settings: Vec<(String, String)>,
}

/// Result of a sweep.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Outcome {
    /// Whether a signal ended it.
    pub interrupted: bool,
    /// Folders of the runs that finished.
    pub finished: Vec<PathBuf>,
    /// Runs that failed, with the cause.
    pub failed: Vec<(String, String)>,
    /// Runs that are neither.
    pub left: usize,
    /// How sensitive the findings are to the keys.
    pub sensitivity: Sensitivity,
}

/// What came of the sensitivity to the keys.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Sensitivity {
    /// The plan does not ask for it.
    NotAsked,
    /// The runs that finished observe nothing.
    NothingFound,
    /// No key changes what they found, or no step of a trajectory has finished on both sides.
    NoEffect,
    /// The table of it.
    Table(PathBuf),
}

impl Sweep {
    /// Runs all that has not ended, as processes of `program`, and writes the table whenever a run has.
    ///
    /// # Errors
    /// If the folder is another sweep's, in use, or cannot be written; if the disk does not hold the results.
    pub fn run(
        &self,
        program: &Path,
        side_by_side: SideBySide,
        retry: bool,
        progress: &mut dyn Progress,
        stop: &Stop,
    ) -> Result<Outcome, CommandError> {
        self.refuse_without_disk(retry)?;
        let _lock = self.prepare()?;
        let pool = Pool { sweep: self, program, side_by_side, retry, stop };
        let unwritable = |error: std::io::Error| self.unwritable(&error);
        let mut written = Ok(());
        let interrupted = pool
            .work(progress, |at_work| {
                let now = table::write(&self.folder, &self.runs, &self.states_beside(at_work));
                written = std::mem::replace(&mut written, Ok(())).and(now);
            })
            .map_err(unwritable)?;
        written.map_err(unwritable)?;
        Ok(Outcome { interrupted, ..self.gather()? })
    }

    /// Writes the table of what there is, and tells it.
    ///
    /// # Errors
    /// If the runs are those of another plan or case, or the table cannot be written.
    pub fn collect(&self) -> Result<Outcome, CommandError> {
        self.refuse_another()?;
        self.gather()
    }

    fn gather(&self) -> Result<Outcome, CommandError> {
        let states = self.states();
        table::write(&self.folder, &self.runs, &states).map_err(|error| self.unwritable(&error))?;
        let sensitivity = self.write_sensitivity(&states).map_err(|error| self.unwritable(&error))?;
        let mut outcome =
            Outcome { interrupted: false, finished: Vec::new(), failed: Vec::new(), left: 0, sensitivity };
        for (number, found) in states.into_iter().enumerate() {
            match found.state {
                State::Finished => outcome.finished.push(self.folder_of(number)),
                State::Failed(cause) => outcome.failed.push((self.runs[number].name.clone(), cause)),
                State::Waiting | State::Running | State::BrokenOff => outcome.left += 1,
            }
        }
        Ok(outcome)
    }

    /// Writes how sensitive the findings are to the keys, where the plan asks for it and runs tell something.
    fn write_sensitivity(&self, states: &[Progressed]) -> std::io::Result<Sensitivity> {
        let Some(places) = self.plan().trajectories() else { return Ok(Sensitivity::NotAsked) };
        let keys: Vec<&str> = self.plan().keys.iter().map(|key| key.path.as_str()).collect();
        let rows = sensitivity::rows(&keys, &places, states);
        if sensitivity::write(&self.folder, &rows)? {
            return Ok(Sensitivity::Table(self.folder.join(SENSITIVITY)));
        }
        let observes = |found: &Progressed| {
            found.state == State::Finished
                && found.summary["observables"].as_object().is_some_and(|all| !all.is_empty())
        };
        Ok(if states.iter().any(observes) { Sensitivity::NoEffect } else { Sensitivity::NothingFound })
    }

    /// The table as rows of cells, the heading first.
    #[must_use]
    pub fn rows(&self) -> Vec<Vec<String>> {
        table::rows(&self.runs, &self.states())
    }

    /// Writes the cases and the script of an array job of Slurm; returns the script's path.
    ///
    /// # Errors
    /// As [`Self::run`].
    pub fn write_slurm(
        &self,
        program: &Path,
        side_by_side: Option<usize>,
        threads: usize,
    ) -> Result<PathBuf, CommandError> {
        let _lock = self.prepare()?;
        let path = self.folder.join(SCRIPT);
        fs::create_dir_all(self.folder.join(LOGS)).map_err(|error| self.unwritable(&error))?;
        let text = slurm::script(self, program, side_by_side, threads);
        self.write(&path, &text)?;
        Ok(path)
    }

    /// Refuses a sweep whose results the disk does not hold.
    fn refuse_without_disk(&self, retry: bool) -> Result<(), CommandError> {
        let states = self.states();
        let left = self
            .runs
            .iter()
            .zip(&states)
            .filter(|(_, found)| !found.state.is_ended() || retry && found.state != State::Finished);
        let (count, needed) = left.fold((0, 0.0), |(count, sum), (run, _)| (count + 1, sum + run.needs.disk));
        let Some(free) = machine::free_disk(&self.folder).filter(|&free| needed > free as f64) else { return Ok(()) };
        Err(CommandError::input(
            format!(
                "the results of {count} runs do not fit onto the disk: about {}, of which {} are free",
                bytes(needed),
                bytes(free as f64)
            ),
            "write fewer fields, grains and checkpoints (`[set]` of the plan), take fewer runs, or choose another disk with --out",
        ))
    }

    /// Makes the folder, or refuses one that is something else's; writes the cases. Holds the sweep until the end.
    fn prepare(&self) -> Result<Option<File>, CommandError> {
        self.refuse_another_plan()?;
        let unwritable = |error: std::io::Error| self.unwritable(&error);
        fs::create_dir_all(self.folder.join(CASES)).map_err(unwritable)?;
        let lock = self.lock()?;
        self.refuse_other_cases()?;
        for (number, run) in self.runs.iter().enumerate() {
            self.write(&self.case_of(number), &run.text)?;
        }
        write_json(&self.folder.join(RECORD), &self.record())
            .map_err(|error| CommandError::Undone(error.to_string()))?;
        Ok(lock)
    }

    fn record(&self) -> Record {
        let run = |run: &Run| RecordedRun {
            name: run.name.clone(),
            case_hash: run.hash.clone(),
            settings: run.settings.clone(),
        };
        Record { version: env!("CARGO_PKG_VERSION").to_owned(), runs: self.runs.iter().map(run).collect() }
    }

    /// Refuses a folder with runs of another plan or case than this.
    ///
    /// # Errors
    /// If it has some, or holds something else.
    pub fn refuse_another(&self) -> Result<(), CommandError> {
        self.refuse_another_plan()?;
        self.refuse_other_cases()
    }

    /// Refuses a folder that is something else's, or another plan's.
    fn refuse_another_plan(&self) -> Result<(), CommandError> {
        let path = self.folder.join(RECORD);
        match fs::read_to_string(&path) {
            Ok(text) => self.refuse_other(&path, &text, &self.record()),
            Err(_) if is_filled(&self.folder) => Err(CommandError::input(
                format!("`{}` is not empty, and no sweep is in it", self.folder.display()),
                "choose another folder with --out",
            )),
            Err(_) => Ok(()),
        }
    }

    /// Refuses a folder whose sweep has other runs; a sweep may be given more of them at its end.
    fn refuse_other(&self, path: &Path, text: &str, own: &Record) -> Result<(), CommandError> {
        let there: Record = serde_json::from_str(text).map_err(|error| {
            CommandError::input(
                format!("{}: {error}", path.display()),
                "the record of the sweep is damaged: choose another folder with --out",
            )
        })?;
        for (number, run) in there.runs.iter().enumerate() {
            if own.runs.get(number) != Some(run) {
                return Err(CommandError::input(
                    format!(
                        "`{}` holds the runs of another plan or case: its run {} is not one of this plan",
                        self.folder.display(),
                        run.name
                    ),
                    "put plan and case back as they were (runs may be added at the end), or choose another folder with \
                     --out",
                ));
            }
        }
        Ok(())
    }

    /// Refuses folders of runs with another case than the plan says.
    fn refuse_other_cases(&self) -> Result<(), CommandError> {
        for (number, run) in self.runs.iter().enumerate() {
            let folder = self.folder_of(number);
            let Ok(there) = case::load(&folder.join(CASE), &[]) else { continue };
            if !resolved::has_hash(&there, &run.hash) {
                return Err(CommandError::input(
                    format!("`{}` holds a run of another case than the plan says", folder.display()),
                    "move it elsewhere, so that its run is made anew, or choose another folder with --out",
                ));
            }
        }
        Ok(())
    }

    fn lock(&self) -> Result<Option<File>, CommandError> {
        let open = OpenOptions::new().write(true).create(true).truncate(false).open(self.folder.join(LOCK));
        let file = open.map_err(|error| self.unwritable(&error))?;
        match file.try_lock() {
            Ok(()) => Ok(Some(file)),
            Err(TryLockError::WouldBlock) => Err(CommandError::input(
                format!("another command works on the sweep in `{}`", self.folder.display()),
                "wait for its end, or choose another folder with --out",
            )),
            // Some network file systems know no locks.
            Err(TryLockError::Error(_)) => Ok(None),
        }
    }

    fn write(&self, path: &Path, text: &str) -> Result<(), CommandError> {
        use std::io::Write as _;
        replace_file(path, |file| file.write_all(text.as_bytes())).map_err(|error| self.unwritable(&error))
    }

    fn unwritable(&self, error: &std::io::Error) -> CommandError {
        CommandError::Undone(format!("the sweep in `{}` cannot go on: {error}", self.folder.display()))
    }
}

fn is_filled(folder: &Path) -> bool {
    let is_own = |name: &std::ffi::OsStr| name == TRIED;
    fs::read_dir(folder).is_ok_and(|entries| entries.flatten().any(|entry| !is_own(&entry.file_name())))
}
