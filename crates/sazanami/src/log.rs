//! `log.txt`: what a command says while it runs, with the time of day, kept beside the results.

use std::fs::{File, OpenOptions};
use std::io::Write as _;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant, SystemTime};

use crate::progress::{Progress, StepLine};

/// Name of the log within the folder of results.
pub const LOG: &str = "log.txt";
/// Time between two lines about steps.
const INTERVAL: Duration = Duration::from_secs(5);

/// Passes on what a command says, and keeps messages and a line about steps every few seconds in `log.txt`.
pub(crate) struct Log<'a> {
    listener: &'a mut dyn Progress,
    path: PathBuf,
    file: Option<File>,
    shown: Option<Instant>,
}

impl<'a> Log<'a> {
    /// A new log in `folder`.
    pub fn create(folder: &Path, listener: &'a mut dyn Progress) -> Self {
        Self::open(folder, listener, OpenOptions::new().create(true).write(true).truncate(true))
    }

    /// Goes on with the log in `folder`.
    pub fn append(folder: &Path, listener: &'a mut dyn Progress) -> Self {
        Self::open(folder, listener, OpenOptions::new().create(true).append(true))
    }

    fn open(folder: &Path, listener: &'a mut dyn Progress, options: &OpenOptions) -> Self {
        let path = folder.join(LOG);
        let mut log = Self { listener, path, file: None, shown: None };
        match options.open(&log.path) {
            Ok(file) => log.file = Some(file),
            Err(error) => log.give_up(&error),
        }
        log
    }

    /// Keeps a line that is shown elsewhere, or not at all, behind the time of day (UTC, ISO 8601).
    pub fn note(&mut self, text: &str) {
        let Some(file) = &mut self.file else { return };
        let now = humantime::format_rfc3339_seconds(SystemTime::now());
        if let Err(error) = file.write_all(format!("{now}  {text}\n").as_bytes()) {
            self.give_up(&error);
        }
    }

    /// A run does not end for want of a log.
    fn give_up(&mut self, error: &std::io::Error) {
        self.file = None;
        self.listener.message(&format!("warning: no log is kept in {}: {error}", self.path.display()));
    }
}

impl Progress for Log<'_> {
    fn step(&mut self, line: &StepLine) {
        if self.file.is_some() && self.shown.is_none_or(|shown| shown.elapsed() >= INTERVAL) {
            self.shown = Some(Instant::now());
            self.note(&line.to_string());
        }
        self.listener.step(line);
    }

    fn message(&mut self, text: &str) {
        self.note(text);
        self.listener.message(text);
    }
}
