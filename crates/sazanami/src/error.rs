//! Causes for which a command ends other than by success, and their exit codes.

use std::path::PathBuf;

use sazanami_numerics::Real;
use serde::{Deserialize, Serialize};

use crate::case::{CaseError, nearest};

/// Exit codes of the command line.
pub mod exit {
    /// The command did what it was asked.
    pub const DONE: u8 = 0;
    /// The run failed, or its results could not be written.
    pub const FAILED: u8 = 1;
    /// The input or the command line is wrong.
    pub const WRONG_INPUT: u8 = 2;
    /// Stopped by a signal after writing a checkpoint.
    pub const STOPPED: u8 = 130;
}

/// Failure of a run: place, time and last state.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Failure {
    /// Kind in one word, `not_finite`, `grain_escaped`, `overlap`, `pressure`, `disk`, ...
    pub kind: String,
    /// Message, with the grain or cell and its position.
    pub message: String,
    /// Fluid step at which it failed.
    pub step: u64,
    /// Simulated time \[s].
    pub time: Real,
    /// Time-step limit that ruled.
    pub limiter: String,
    /// Rank that failed, where it was one of several.
    pub rank: Option<usize>,
    /// Newest good checkpoint.
    pub checkpoint: Option<PathBuf>,
}

impl std::fmt::Display for Failure {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(formatter, "{}\n  at step {}, time {:.6e} s", self.message, self.step, self.time)?;
        if !self.limiter.is_empty() {
            write!(formatter, ", step length ruled by {}", self.limiter)?;
        }
        if let Some(rank) = self.rank {
            write!(formatter, ", on rank {rank}")?;
        }
        match &self.checkpoint {
            Some(path) => write!(formatter, "\n  last good checkpoint: {}", path.display()),
            None => write!(formatter, "\n  no checkpoint had been written"),
        }
    }
}

/// Why a command did not do what it was asked.
#[derive(Debug, thiserror::Error)]
pub enum CommandError {
    /// The case file is wrong.
    #[error("{0}")]
    Case(Box<CaseError>),
    /// The command line or what it names is wrong.
    #[error("{message}{}", .help.as_ref().map(|help| format!("\n  help: {help}")).unwrap_or_default())]
    Input {
        /// The input that cannot be used, and why.
        message: String,
        /// One thing to do.
        help: Option<String>,
    },
    /// The run failed: physics or machine.
    #[error("{0}")]
    Failed(Box<Failure>),
    /// A picture, a table, a timing or another part of the results, or beside a run, could not be had.
    #[error("{0}")]
    Undone(String),
}

impl CommandError {
    /// Input that cannot be used, with a suggestion.
    #[must_use]
    pub fn input(message: impl Into<String>, help: impl Into<String>) -> Self {
        Self::Input { message: message.into(), help: Some(help.into()) }
    }

    /// A name that is not known, with the nearest that is.
    #[must_use]
    pub fn unknown(what: &str, name: &str, known: &[&str]) -> Self {
        let help = match nearest(name, known.iter().copied()) {
            Some(meant) => format!("did you mean `{meant}`?"),
            None => format!("known: {}", known.join(", ")),
        };
        Self::input(format!("there is no {what} `{name}`"), help)
    }

    /// Exit code of the command.
    #[must_use]
    pub const fn exit_code(&self) -> u8 {
        match self {
            Self::Case(_) | Self::Input { .. } => exit::WRONG_INPUT,
            Self::Failed(_) | Self::Undone(_) => exit::FAILED,
        }
    }
}

impl From<Box<CaseError>> for CommandError {
    fn from(error: Box<CaseError>) -> Self {
        Self::Case(error)
    }
}

impl From<Failure> for CommandError {
    fn from(failure: Failure) -> Self {
        Self::Failed(Box::new(failure))
    }
}
