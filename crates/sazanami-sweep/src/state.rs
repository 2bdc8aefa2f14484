//! Progress of a run by the contents of its folder.

use std::path::Path;

use sazanami::results::{self, CASE, SUMMARY};
use serde_json::Value;

/// Progress of a run.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum State {
    /// Not begun.
    Waiting,
    /// A process works on it.
    Running,
    /// Begun; a signal or the end of the machine stopped it.
    BrokenOff,
    /// Done.
    Finished,
    /// Ended by an error.
    Failed(String),
}

impl State {
    /// The state in one word.
    #[must_use]
    pub const fn word(&self) -> &'static str {
        match self {
            Self::Waiting => "waiting",
            Self::Running => "running",
            Self::BrokenOff => "broken off",
            Self::Finished => "finished",
            Self::Failed(_) => "failed",
        }
    }

    /// Whether nothing more is to be done for it.
    #[must_use]
    pub const fn is_ended(&self) -> bool {
        matches!(self, Self::Finished | Self::Failed(_))
    }
}

/// State of a run, and what its summary says.
#[derive(Clone, Debug)]
pub struct Progressed {
    /// Progress.
    pub state: State,
    /// The summary; `null` where there is none.
    pub summary: Value,
}

/// Reads how far the run in `folder` has come, whose case ends it after `most_steps` if it says so.
pub fn of(folder: &Path, most_steps: Option<u64>) -> Progressed {
    let text = std::fs::read_to_string(folder.join(SUMMARY)).unwrap_or_default();
    let summary: Value = serde_json::from_str(&text).unwrap_or_default();
    let has_all_steps = most_steps.is_some_and(|most| summary["steps"].as_u64() >= Some(most));
    let state = if results::is_in_use(folder) {
        State::Running
    } else {
        match summary["status"].as_str() {
            Some("finished") => State::Finished,
            Some("stopped") if has_all_steps => State::Finished,
            Some("failed") => State::Failed(summary["failure"]["message"].as_str().unwrap_or_default().to_owned()),
            _ if folder.join(CASE).is_file() => State::BrokenOff,
            _ => State::Waiting,
        }
    };
    Progressed { state, summary }
}
