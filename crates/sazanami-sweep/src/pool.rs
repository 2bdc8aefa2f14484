//! Runs side by side, each in a process of its own: one that crashes takes no other with it, memory comes back with its
//! end, and each has its own signals, folder and log.

use std::fs::{self, OpenOptions};
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

use rustix::process::{Pid, Signal, kill_process};
use sazanami::error::exit;
use sazanami::machine::Machine;
use sazanami::progress::{Progress, duration};
use sazanami::stop::Stop;

use crate::state::State;
use crate::sweep::Sweep;

/// Part of the free memory that runs are given.
const MEMORY: f64 = 0.9;
/// Time between two looks at the processes, and at runs that others hold.
const LOOK: Duration = Duration::from_millis(100);
/// Time between two lines about all runs.
const TOLD: Duration = Duration::from_secs(60);

/// Number of runs at a time, and their threads and ranks.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct SideBySide {
    /// Most runs at a time.
    pub runs: usize,
    /// Number of threads of each run.
    pub threads: usize,
}

impl SideBySide {
    /// Runs at a time of `left` that are to be done on a machine of so many processors: as asked, or as many as there are
    /// processors, because one thread for each run wastes nothing.
    #[must_use]
    pub fn of(asked: Option<usize>, threads: Option<usize>, left: usize, cores: usize) -> Self {
        let most = asked.unwrap_or_else(|| cores / threads.unwrap_or(1).clamp(1, cores));
        let runs = most.min(left).max(1);
        Self { runs, threads: threads.unwrap_or(cores / runs).max(1) }
    }
}

/// A run that a process of ours works on.
struct Active {
    number: usize,
    child: Child,
    began: Instant,
}

/// Work of the pool.
pub struct Pool<'a> {
    pub sweep: &'a Sweep,
    pub program: &'a Path,
    pub side_by_side: SideBySide,
    pub retry: bool,
    pub stop: &'a Stop,
}

impl Pool<'_> {
    /// Runs all that has not ended; `changed` is called when a run has,
    /// with those that are at work. Returns whether a signal ended it before.
    pub fn work(&self, progress: &mut dyn Progress, mut changed: impl FnMut(&[usize])) -> std::io::Result<bool> {
        let runs = self.sweep.runs();
        let memory = Machine::this().memory_available.map_or(f64::INFINITY, |bytes| MEMORY * bytes as f64);
        let is_to_do = |state: &State| !state.is_ended() || (self.retry && matches!(state, State::Failed(_)));
        let mut left: Vec<usize> =
            (0..runs.len()).filter(|&number| is_to_do(&self.sweep.in_folder(number).state)).rev().collect();
        let (mut active, mut held): (Vec<Active>, Vec<usize>) = (Vec::new(), Vec::new());
        let (mut is_told_to_end, mut told) = (false, Instant::now());
        let all = left.len();
        loop {
            while !self.stop.is_set() && active.len() < self.side_by_side.runs {
                let Some(&number) = left.last() else { break };
                let taken: f64 = active.iter().map(|active| runs[active.number].needs.memory).sum();
                if !active.is_empty() && taken + runs[number].needs.memory > memory {
                    break;
                }
                left.pop();
                let name = &runs[number].name;
                if self.sweep.in_folder(number).state == State::Running {
                    progress.message(&format!(
                        "{name}: a process of an earlier command still works on it; it is waited for"
                    ));
                    held.push(number);
                    continue;
                }
                active.push(self.start(number, progress)?);
            }
            if self.stop.is_set() && !is_told_to_end {
                is_told_to_end = true;
                for child in active.iter().map(|active| &active.child) {
                    // One that has ended meanwhile needs no signal.
                    let _ = kill_process(Pid::from_child(child), Signal::TERM);
                }
            }
            let (mut at_work, mut ended) = (Vec::new(), Vec::new());
            for mut active in active {
                match active.child.try_wait()? {
                    None => at_work.push(active),
                    Some(status) => ended.push((active, status.code())),
                }
            }
            active = at_work;
            for (ended, code) in &ended {
                self.tell(ended, *code, progress);
            }
            if !ended.is_empty() {
                changed(&active.iter().map(|active| active.number).collect::<Vec<_>>());
            }
            held.retain(|&number| {
                let state = self.sweep.in_folder(number).state;
                if state != State::Running && is_to_do(&state) {
                    left.push(number);
                }
                state == State::Running
            });
            let waits = !held.is_empty() && !self.stop.is_set();
            if active.is_empty() && !waits && (left.is_empty() || self.stop.is_set()) {
                return Ok(self.stop.is_set() && all > 0);
            }
            if told.elapsed() > TOLD {
                told = Instant::now();
                let done = all - left.len() - active.len() - held.len();
                progress
                    .message(&format!("{done} of {all} runs have ended, {} are at work", active.len() + held.len()));
            }
            std::thread::sleep(LOOK);
        }
    }

    /// Starts a process for a run, or one that goes on with it.
    fn start(&self, number: usize, progress: &mut dyn Progress) -> std::io::Result<Active> {
        let run = &self.sweep.runs()[number];
        let folder = self.sweep.folder_of(number);
        let log = self.sweep.log_of(number);
        if let Some(parent) = log.parent() {
            fs::create_dir_all(parent)?;
        }
        let said = OpenOptions::new().create(true).append(true).open(log)?;
        let mut command = Command::new(self.program);
        let goes_on = folder.join(sazanami::results::CASE).is_file();
        if goes_on {
            command.arg("resume").arg(&folder);
        } else {
            // What a process left that ended before its case was written is nothing to be kept.
            command.arg("run").arg(self.sweep.case_of(number)).arg("--out").arg(&folder).arg("--force");
        }
        command.arg("--threads").arg(self.side_by_side.threads.to_string());
        command.stdin(Stdio::null()).stdout(said.try_clone()?).stderr(said);
        let child = command.spawn()?;
        progress.message(&format!("{}: {}", run.name, if goes_on { "goes on" } else { "begins" }));
        Ok(Active { number, child, began: Instant::now() })
    }

    /// Says how a run ended; one that left no summary of its failure gets it from its log.
    fn tell(&self, active: &Active, code: Option<i32>, progress: &mut dyn Progress) {
        let name = &self.sweep.runs()[active.number].name;
        let took = duration(active.began.elapsed().as_secs_f64());
        let state = self.sweep.progressed(active.number).state;
        let text = match (&state, code) {
            (State::Finished, _) => format!("finished in {took}"),
            (State::Failed(message), _) => format!("failed after {took}: {message}"),
            (_, Some(code)) if code == i32::from(exit::STOPPED) => "stopped with a checkpoint".to_owned(),
            (_, Some(code)) => {
                format!("ended with code {code} after {took}, see {}", self.sweep.log_of(active.number).display())
            }
            (_, None) => format!("was killed after {took}"),
        };
        progress.message(&format!("{name}: {text}"));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn processors_are_shared_among_the_runs() {
        let of = |asked, threads, left, cores| {
            let found = SideBySide::of(asked, threads, left, cores);
            (found.runs, found.threads)
        };
        assert_eq!(of(None, None, 20, 8), (8, 1));
        assert_eq!(of(None, None, 3, 8), (3, 2));
        assert_eq!(of(Some(2), None, 20, 8), (2, 4));
        assert_eq!(of(None, Some(4), 20, 8), (2, 4));
        assert_eq!(of(Some(20), Some(1), 30, 8), (20, 1));
        assert_eq!(of(None, None, 1, 2), (1, 2));
        assert_eq!(of(None, Some(16), 5, 8), (1, 16));
    }
}
