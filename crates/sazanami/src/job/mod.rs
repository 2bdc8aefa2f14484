//! A run as all its ranks see it: what is asked, what its checkpoints keep beside the physics, who listens, and how it
//! can fail.

mod error;
mod totals;

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::mpsc::SyncSender;

use sazanami_numerics::Real;
use sazanami_numerics::geometry::Shape;
use sazanami_numerics::snapshot::Snapshot;
use sazanami_parallel::{Processes, Sums};
use serde::{Deserialize, Serialize};

use crate::artist::Artist;
use crate::bed_file::Bed;
use crate::case::meaning::Case;
use crate::case::{LoadedCase, resolved};
use crate::error::CommandError;
use crate::progress::StepLine;
use crate::state::Showing;
use crate::stop::Stop;

pub(crate) use error::{RankError, RankFailure, RecordError, StateError};
pub(crate) use totals::{CORRECTIONS, PARTICLES, Totals, WORST};

/// Section of a checkpoint with the [`RunState`].
pub(crate) const RUN_STATE: &str = "run/state";
/// Prefix of what a packing writes into a snapshot.
pub(crate) const PACKING: &str = "packing/";
/// Prefix of what a bed on its way to rest writes into a snapshot.
pub(crate) const RELAXATION: &str = "relaxation/";

/// End of a run.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Status {
    /// Still on its way, or killed.
    Running,
    /// Reached the end that the case sets.
    Finished,
    /// Stopped by a signal, a number of steps or a time before its end.
    Stopped,
    /// Ended by an error.
    Failed,
}

/// Writes the report on the run in a folder into it; returns its path.
pub type ReportWriter = fn(&Path) -> Result<PathBuf, CommandError>;

/// Options of a run beyond the case.
#[derive(Clone, Debug, Default)]
pub struct RunOptions {
    /// Folder for the results; absent: the next free `runs/<case>-<n>`.
    pub out: Option<PathBuf>,
    /// Overwrite a folder that is not empty.
    pub force: bool,
    /// Stop at this simulated time \[s] (never changes a time step).
    pub until: Option<Real>,
    /// Stop after so many further fluid steps.
    pub steps: Option<u64>,
    /// Threads; absent: as many as the machine has.
    pub threads: Option<usize>,
    /// Parts that the box is cut into, each with threads of its own within this process; 0 stands for those of the run so far, or 1.
    pub ranks: usize,
    /// The processes of a launcher, each of which is a rank; absent: this process alone.
    pub processes: Option<Processes>,
    /// Order in which the values of ranks are added; absent: that of the run so far, or in the order of the ranks.
    pub sums: Option<Sums>,
    /// The commit that the program was built from, for the summary.
    pub commit: Option<&'static str>,
    /// Who draws the pictures; without an artist there are none.
    pub artist: Option<&'static dyn Artist>,
    /// Writer of the report on a run that ended into its folder; absent: there is none.
    pub report: Option<ReportWriter>,
    /// Who sees the states of the flow while it goes on, and how often; absent: nobody.
    pub showing: Option<Showing>,
}

impl RunOptions {
    /// Parts that the box is cut into within this process.
    fn ranks(&self) -> usize {
        self.ranks.max(1)
    }

    /// Order in which the values of ranks are added.
    pub(crate) fn sums(&self) -> Sums {
        self.sums.unwrap_or_default()
    }
}

/// Who works on a run.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(crate) struct Workers {
    /// Parts that the box is cut into.
    pub ranks: usize,
    /// Threads of each rank.
    pub threads: usize,
    /// Order of sums over the ranks, as [`Sums::word`].
    pub sums: String,
    /// Name of the machine of each rank; empty where all are within one process.
    pub hosts: Vec<String>,
    /// Name and version of the MPI library; absent where all ranks are within one process.
    pub mpi: Option<String>,
}

impl Workers {
    /// Order of sums over the ranks.
    pub fn sums(&self) -> Sums {
        Sums::of_word(&self.sums).unwrap_or_default()
    }

    /// The ranks within one process on a machine of so many processors.
    pub fn of_this_process(options: &RunOptions, cores: usize) -> Self {
        let ranks = options.ranks();
        let threads = options.threads.unwrap_or_else(|| cores.div_ceil(ranks)).max(1);
        Self { ranks, threads, sums: options.sums().word().to_owned(), hosts: Vec::new(), mpi: None }
    }
}

/// Event that a running command reports.
#[derive(Clone, Debug)]
pub(crate) enum Event {
    /// A step is done.
    Step(StepLine),
    /// A line of its own.
    Message(String),
}

/// Takes what rank 0 says to whoever listens.
#[derive(Clone, Debug)]
pub(crate) struct Reporter(pub SyncSender<Event>);

/// The part of a run's state that is not physics: goes into the checkpoint as text.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(crate) struct RunState {
    /// Whether the bed is still being packed.
    pub packing: bool,
    /// Whether a bed from a file is still on its way to rest.
    #[serde(default)]
    pub relaxing: bool,
    /// Whether a bed in water is still being prepared.
    #[serde(default)]
    pub preparing: bool,
    /// Simulated time \[s].
    pub time: Real,
    /// Fluid steps since the start of the flow.
    pub step: u64,
    /// Hash of the case, as the program that began the run found it.
    pub case_hash: String,
    /// Hash of the case whatever its end; absent in checkpoints of earlier versions.
    #[serde(default)]
    pub endless_hash: Option<String>,
    /// The same whatever the end of feeds that end with the run; earlier versions do not have it.
    #[serde(default)]
    pub endless_feed_hash: Option<String>,
    /// That program; absent in checkpoints of earlier ones.
    #[serde(default)]
    pub program: Option<Program>,
    /// Sums and extremes since the start.
    pub totals: Totals,
    /// Step of the last row of the series; absent in checkpoints of earlier versions.
    #[serde(default)]
    pub last_row: Option<u64>,
    /// Order of sums over the ranks, as [`Sums::word`]; absent in checkpoints of earlier versions.
    #[serde(default)]
    pub sums: Option<String>,
    /// What its last bits hang on; absent in what checkpoints of earlier versions began.
    #[serde(default)]
    pub history: Option<History>,
}

/// How a run came about, of what its last bits hang on: threads and breaks are not part of it.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(crate) struct History {
    /// Numbers of ranks that worked on it, one after another.
    pub ranks: Vec<usize>,
    /// Orders of their sums, as [`Sums::word`].
    pub sums: Vec<String>,
    /// Programs that worked on it.
    pub programs: Vec<String>,
    /// Ends of its case that were put off \[s].
    pub ends: Vec<Real>,
}

impl History {
    /// That of a run which goes on with such workers.
    fn on(mut self, workers: &Workers, program: &Program) -> Self {
        self.ranks.push(workers.ranks);
        self.sums.push(workers.sums.clone());
        self.programs.push(program.to_string());
        self.ranks.dedup();
        self.sums.dedup();
        self.programs.dedup();
        self
    }
}

/// The version of sazanami that began a run.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub(crate) struct Program {
    /// Version of the package.
    pub version: String,
    /// Commit that it was built from.
    pub commit: String,
}

impl Program {
    /// This program, as the command line knows it.
    pub fn this(options: &RunOptions) -> Self {
        Self { version: env!("CARGO_PKG_VERSION").into(), commit: options.commit.unwrap_or("unknown commit").into() }
    }
}

impl std::fmt::Display for Program {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(formatter, "sazanami {} ({})", self.version, self.commit)
    }
}

impl RunState {
    /// The beginning of a run's state: its case and the program that began it.
    pub fn of(job: &Job) -> Self {
        let this = Program::this(job.options);
        let (case_hash, program, before) = match &job.resumed {
            Some(Resumed { run, .. }) => (run.case_hash.clone(), run.program.clone(), run.history.clone()),
            None => (resolved::hash_text(job.case), Some(this.clone()), Some(History::default())),
        };
        let endless_hash = Some(resolved::hash_of_any_length(job.case));
        let endless_feed_hash = Some(resolved::hash_of_any_feed(job.case));
        // A run at its end is shown again, and makes no step.
        let stands =
            job.resumed.as_ref().is_some_and(|state| state.run.flows() && state.run.time >= job.case.run.until);
        let history = if stands { before } else { before.map(|history| history.on(&job.workers, &this)) };
        let sums = Some(job.workers.sums.clone());
        Self { case_hash, endless_hash, endless_feed_hash, program, sums, history, ..Self::default() }
    }

    /// Whether `loaded` is the case of this run, or that case with another end, of feeds that end with it too.
    pub fn is_of(&self, loaded: &LoadedCase) -> bool {
        let endless = self.endless_hash.as_ref();
        resolved::has_hash(loaded, &self.case_hash)
            || endless.is_some_and(|hash| resolved::has_hash_of_any_length(loaded, hash))
            || self.endless_feed_hash.as_ref().is_some_and(|hash| resolved::hash_of_any_feed(&loaded.case) == *hash)
    }

    /// Number of ranks that worked on it last, if the checkpoint knows it.
    pub fn ranks(&self) -> Option<usize> {
        self.history.as_ref()?.ranks.last().copied()
    }

    /// Order of sums over the ranks, if the checkpoint knows it.
    pub fn sums(&self) -> Option<Sums> {
        Sums::of_word(self.sums.as_ref()?)
    }

    /// Whether the flow has begun.
    pub const fn flows(&self) -> bool {
        !self.packing && !self.relaxing && !self.preparing
    }
}

/// A checkpoint that a run goes on from.
#[derive(Debug)]
pub(crate) struct Resumed {
    /// Its arrays: physics and observers.
    pub snapshot: Snapshot,
    /// Everything else.
    pub run: RunState,
}

/// A run as all its ranks see it.
pub(crate) struct Job<'a> {
    /// The case to be run, cross-checked.
    pub case: &'a Case,
    /// Its resolved copy, to be written; absent where the folder holds it already.
    pub case_text: Option<String>,
    /// Shapes of its populations.
    pub shapes: Arc<[Shape]>,
    /// Beds of the populations that are read from a file.
    pub beds: Vec<Option<Bed>>,
    /// Hashes of what the files hold that populations and liquids name, when they were read.
    pub files: Vec<String>,
    /// Options beyond the case.
    pub options: &'a RunOptions,
    /// Folder of the results.
    pub folder: PathBuf,
    /// A tank with water that was prepared before; none where the run prepares it.
    pub prepared: Option<Snapshot>,
    /// State that the run goes on from.
    pub resumed: Option<Resumed>,
    /// Who hears what rank 0 reports.
    pub reporter: Reporter,
    /// Set when the run is to end.
    pub stop: &'a Stop,
    /// Its ranks and their threads.
    pub workers: Workers,
    /// Simulated time that packing is expected to take \[s], if it can be predicted.
    pub packing_time: Option<Real>,
}

impl Job<'_> {
    /// Reports a step that is done.
    pub fn report(&self, line: &StepLine) {
        // Nobody listens any more when the command itself has ended: nothing is lost.
        let _ = self.reporter.0.send(Event::Step(*line));
    }

    /// Reports a line of text.
    pub fn say(&self, text: impl Into<String>) {
        let _ = self.reporter.0.send(Event::Message(text.into()));
    }
}

/// End of a run on a rank: status, time \[s] and steps.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct Ending {
    pub status: Status,
    pub interrupted: bool,
    pub time: Real,
    pub steps: u64,
}
