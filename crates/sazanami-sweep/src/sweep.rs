//! The runs of a sweep, and what lies in its folder.

use std::fs;
use std::path::{Path, PathBuf};

use sazanami::error::CommandError;
use sazanami::machine::Machine;

use crate::plan::Plan;
use crate::posed::{self, Run};
use crate::state::{self, Progressed, State};

/// Cases of the runs, and what their processes said.
pub(crate) const CASES: &str = "cases";
pub(crate) const LOGS: &str = "logs";

/// A sweep with all its cases, and the folder it is in.
#[derive(Debug)]
pub struct Sweep {
    plan: Plan,
    pub(crate) folder: PathBuf,
    pub(crate) runs: Vec<Run>,
}

impl Sweep {
    /// Poses the cases of a plan and checks all of them; writes nothing. What they need is for runs on `threads` threads.
    ///
    /// # Errors
    /// If one of the cases cannot run.
    pub fn pose(plan: Plan, folder: &Path, threads: usize) -> Result<Self, CommandError> {
        let runs = posed::runs(&plan, &Machine::this(), threads)?;
        Ok(Self { plan, folder: folder.to_owned(), runs })
    }

    /// Plan that the sweep carries out.
    #[must_use]
    pub const fn plan(&self) -> &Plan {
        &self.plan
    }

    /// Folder of all its files.
    #[must_use]
    pub fn folder(&self) -> &Path {
        &self.folder
    }

    /// One run for each point and seed.
    #[must_use]
    pub fn runs(&self) -> &[Run] {
        &self.runs
    }

    /// Folder of the results of a run.
    pub(crate) fn folder_of(&self, number: usize) -> PathBuf {
        self.folder.join(&self.runs[number].name)
    }

    /// The case file of a run.
    pub(crate) fn case_of(&self, number: usize) -> PathBuf {
        self.folder.join(CASES).join(format!("{}.toml", self.runs[number].name))
    }

    /// File of the output of a run's process.
    pub(crate) fn log_of(&self, number: usize) -> PathBuf {
        self.folder.join(LOGS).join(format!("{}.txt", self.runs[number].name))
    }

    /// Progress of a run by the contents of its folder.
    pub(crate) fn in_folder(&self, number: usize) -> Progressed {
        state::of(&self.folder_of(number), self.runs[number].most_steps)
    }

    /// Progress of a run. One that its process refused before it began has failed, too.
    #[must_use]
    pub fn progressed(&self, number: usize) -> Progressed {
        let mut found = self.in_folder(number);
        if found.state == State::Waiting
            && let Some(cause) = fs::read_to_string(self.log_of(number)).ok().and_then(|log| refusal(&log))
        {
            found.state = State::Failed(cause);
        }
        found
    }

    /// Progress of all runs.
    #[must_use]
    pub fn states(&self) -> Vec<Progressed> {
        self.states_beside(&[])
    }

    /// The same where processes of ours are `at_work`: asking whether a folder is held would get in their way.
    pub(crate) fn states_beside(&self, at_work: &[usize]) -> Vec<Progressed> {
        let of = |number: usize| match at_work.contains(&number) {
            true => Progressed { state: State::Running, summary: serde_json::Value::Null },
            false => self.progressed(number),
        };
        (0..self.runs.len()).map(of).collect()
    }

    /// Runs that have not ended.
    #[must_use]
    pub fn left(&self, retry: bool) -> usize {
        let is_left = |found: &Progressed| !found.state.is_ended() || (retry && found.state != State::Finished);
        self.states().iter().filter(|found| is_left(found)).count()
    }
}

/// The error that a process ended with.
fn refusal(log: &str) -> Option<String> {
    let mut lines = log.lines().rev().take_while(|line| !line.starts_with("results in "));
    lines.find_map(|line| line.strip_prefix("error:")).map(|cause| cause.trim().to_owned())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_errors_at_the_end_are_causes() {
        assert_eq!(refusal("error: no file\n = help: make one\n"), Some("no file".into()));
        let finished = "error: full\nerror of the momentum budget, relative  3.0e-9\nresults in runs/a\n";
        assert_eq!(refusal(finished), None);
    }
}
