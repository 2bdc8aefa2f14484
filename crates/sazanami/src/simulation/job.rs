//! What a run is asked, by whom it is heard, and how it can fail.

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::mpsc::SyncSender;

use sazanami_dem::DemError;
use sazanami_io::table::TableError;
use sazanami_mics::boundary::BoundaryError;
use sazanami_mics::solver::StepError;
use sazanami_mics::stability::Limit;
use sazanami_mps::solver::SetupError;
use sazanami_numerics::Real;
use sazanami_numerics::domain::{FailedElsewhere, LayoutError};
use sazanami_numerics::geometry::Shape;
use sazanami_numerics::snapshot::{Snapshot, SnapshotError};
use sazanami_parallel::ThreadsRefused;
use serde::{Deserialize, Serialize};

use super::mics;
use super::preparation::StateError;
use super::water::StepProblem;
use crate::bed_file::Bed;
use crate::case::meaning::Case;
use crate::case::resolved;
use crate::error::{CommandError, Failure};
use crate::progress::StepLine;
use crate::recorder::{RecordError, Totals};
use crate::results::SERIES;
use crate::run::{RunOptions, Status};
use crate::stop::Stop;

/// What a running command has to say.
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
    /// Simulated time [s].
    pub time: Real,
    /// Fluid steps.
    pub step: u64,
    /// Hash of the case, as the program that began the run found it.
    pub case_hash: String,
    /// That program; absent in checkpoints of earlier ones.
    #[serde(default)]
    pub program: Option<Program>,
    /// Sums and extremes since the start.
    pub totals: Totals,
    /// Step of the last row of the series; absent in checkpoints of earlier versions.
    #[serde(default)]
    pub last_row: Option<u64>,
}

/// Which sazanami.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub(crate) struct Program {
    /// Version.
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
        match &job.resumed {
            Some(state) => {
                Self { case_hash: state.run.case_hash.clone(), program: state.run.program.clone(), ..Self::default() }
            }
            None => Self {
                case_hash: resolved::hash_text(job.case),
                program: Some(Program::this(job.options)),
                ..Self::default()
            },
        }
    }

    /// Whether the flow has begun.
    pub const fn flows(&self) -> bool {
        !self.packing && !self.relaxing && !self.preparing
    }
}

/// A checkpoint that a run goes on from.
#[derive(Debug)]
pub(crate) struct Resumed {
    /// Arrays.
    pub snapshot: Snapshot,
    /// The rest.
    pub run: RunState,
}

/// A run as all its ranks see it.
pub(crate) struct Job<'a> {
    /// The case.
    pub case: &'a Case,
    /// Its resolved copy, to be written; absent where the folder holds it already.
    pub case_text: Option<String>,
    /// Shapes of its populations.
    pub shapes: Arc<[Shape]>,
    /// Beds of the populations that are read from a file.
    pub beds: Vec<Option<Bed>>,
    /// What is asked beyond the case.
    pub options: &'a RunOptions,
    /// Folder of the results.
    pub folder: PathBuf,
    /// A tank with water that was prepared before; none where the run prepares it.
    pub prepared: Option<Snapshot>,
    /// Where the run goes on from.
    pub resumed: Option<Resumed>,
    /// Whom rank 0 tells.
    pub reporter: Reporter,
    /// Set when the run is to end.
    pub stop: &'a Stop,
    /// Threads per rank.
    pub threads: usize,
    /// Simulated time that packing is expected to take [s], if it can be predicted.
    pub packing_time: Option<Real>,
}

impl Job<'_> {
    pub fn is_stopped(&self) -> bool {
        self.stop.is_set()
    }

    /// Tells of a step.
    pub fn report(&self, line: &StepLine) {
        // Nobody listens any more when the command itself has ended: nothing is lost.
        let _ = self.reporter.0.send(Event::Step(*line));
    }

    /// Says a line.
    pub fn say(&self, text: impl Into<String>) {
        let _ = self.reporter.0.send(Event::Message(text.into()));
    }
}

/// How a run ended on a rank.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Ended {
    pub status: Status,
    pub interrupted: bool,
    pub time: Real,
    pub steps: u64,
}

/// Why a run ended before its time on a rank.
#[derive(Debug, thiserror::Error)]
pub(crate) enum RankError {
    #[error(transparent)]
    Threads(#[from] ThreadsRefused),
    #[error(transparent)]
    Layout(#[from] LayoutError),
    #[error(transparent)]
    Boundary(#[from] BoundaryError),
    /// A liquid lies on grains that were not known before the bed was packed or read.
    #[error("the liquid `{liquid}` touches {grain} at the start")]
    LiquidOnGrain { liquid: String, grain: String },
    #[error(
        "the bed is higher than the box: {grain} reaches up to {:.4} mm, the box to {:.4} mm",
        height * 1e3,
        top * 1e3
    )]
    BedTooHigh { grain: String, height: Real, top: Real },
    #[error(
        "the liquid `{liquid}` does not fit above the bed: it reaches up to {:.4} mm, the box to {:.4} mm",
        height * 1e3,
        top * 1e3
    )]
    LiquidTooHigh { liquid: String, height: Real, top: Real },
    /// A step of the flow failed.
    #[error("{}", problem.message)]
    Step { problem: StepProblem, step: u64, time: Real, limit: &'static str },
    /// A step of the packing failed.
    #[error("{message}")]
    PackingStep { error: DemError, message: String, step: u64, time: Real },
    #[error(transparent)]
    Start(#[from] StepError),
    /// Water as moving particles could not be put into its tank.
    #[error(transparent)]
    Particles(#[from] SetupError),
    /// Nor taken from a state of it.
    #[error(transparent)]
    State(#[from] StateError),
    #[error("{0}")]
    Packing(#[from] DemError),
    #[error(
        "the bed did not come to rest within {time} s: its mean speed is still {mean_speed:.2e} m/s\n  help: {help}"
    )]
    NotAtRest { time: Real, mean_speed: Real, help: &'static str },
    #[error("the checkpoint does not fit the case: {0}")]
    Snapshot(#[from] SnapshotError),
    #[error(transparent)]
    Record(#[from] RecordError),
    #[error(transparent)]
    Elsewhere(#[from] FailedElsewhere),
}

impl RankError {
    /// A step before the run failed, with grains and water that come to rest.
    pub fn preparing(
        case: &Case,
        solver: &sazanami_mps::solver::Solver,
        error: &sazanami_mps::solver::StepError,
        step: u64,
        time: Real,
    ) -> Self {
        Self::Step { problem: super::mps::problem(case, solver, error), step, time, limit: "preparation" }
    }

    /// Whether another rank has the reason.
    pub fn is_secondary(&self) -> bool {
        match self {
            Self::Elsewhere(_) | Self::Packing(DemError::Elsewhere(_)) => true,
            Self::Record(error) => matches!(error, RecordError::Elsewhere(_)),
            Self::PackingStep { error, .. } => matches!(error, DemError::Elsewhere(_)),
            Self::Start(error) => mics::is_elsewhere(error),
            Self::Step { problem, .. } => problem.elsewhere,
            _ => false,
        }
    }

    /// What to do about it where the input is wrong; `None` if the run itself failed.
    fn help(&self) -> Option<&'static str> {
        match self {
            Self::Threads(_) => Some("ask for fewer with `--threads` or `--ranks`"),
            Self::Layout(_) => Some("use fewer ranks or more cells"),
            Self::Boundary(_) => Some("correct the sides in `[boundary]`"),
            Self::LiquidOnGrain { .. } => Some("put the liquid higher, or set `allow_touching_grains = true` for it"),
            Self::BedTooHigh { .. } => {
                Some("make the box higher, take fewer grains, or let the bed come to rest: `stop = \"settled\"`")
            }
            Self::LiquidTooHigh { .. } => {
                Some("make the box higher or the bed lower; the resting bed is lower if `stop = \"settled\"`")
            }
            Self::Particles(_) => Some("change the tank or the particle spacing"),
            Self::State(_) => {
                Some("leave out `state` under `[preparation]`, or resume with the case the run began with")
            }
            Self::Snapshot(_) | Self::Packing(DemError::Snapshot(_)) => Some("resume with the case the run began with"),
            _ => None,
        }
    }

    /// Whether it was found before anything was done: a run that was to go on is what it was.
    pub fn is_at_once(&self) -> bool {
        let no_state = matches!(self, Self::State(_) | Self::Snapshot(_) | Self::Packing(DemError::Snapshot(_)));
        // The series is opened first, the other tables when there is something for them.
        let is_first = |path: &Path| path.file_name().is_some_and(|name| name == SERIES);
        let other_table = match self {
            Self::Record(RecordError::Table(TableError::OtherColumns { path, .. })) => is_first(path),
            _ => false,
        };
        no_state || other_table || matches!(self, Self::Threads(_) | Self::Layout(_) | Self::Boundary(_))
    }

    /// What the command says of it; `bed` is the file of the bed that the run packed.
    fn into_command_error(self, failure: Failure, bed: Option<&Path>) -> CommandError {
        let on_bed = matches!(self, Self::LiquidOnGrain { .. } | Self::BedTooHigh { .. } | Self::LiquidTooHigh { .. });
        match (self.help(), bed.filter(|_| on_bed)) {
            (Some(help), Some(bed)) => CommandError::input(
                failure.message,
                format!(
                    "{help}; the packed bed is kept: the changed case can read it with \
                     `placement.bed = {{ file = \"{}\" }}`",
                    bed.display()
                ),
            ),
            (Some(help), None) => CommandError::input(failure.message, help),
            (None, _) => failure.into(),
        }
    }

    /// What failed, where and when; `reached` is the run's last step, its time, and the limit that ruled it.
    pub fn failure(&self, reached: (u64, Real, &'static str)) -> Failure {
        let (step, time, limiter) = match self {
            Self::Step { step, time, limit, .. } => (*step, *time, *limit),
            Self::PackingStep { step, time, .. } => (*step, *time, Limit::Contact.name()),
            Self::NotAtRest { time, .. } => (0, *time, Limit::Contact.name()),
            _ => reached,
        };
        Failure { kind: self.kind(), message: self.to_string(), step, time, limiter, checkpoint: None }
    }

    /// The failure in one word.
    pub fn kind(&self) -> &'static str {
        match self {
            Self::Threads(_)
            | Self::Layout(_)
            | Self::Boundary(_)
            | Self::LiquidOnGrain { .. }
            | Self::BedTooHigh { .. }
            | Self::LiquidTooHigh { .. }
            | Self::Particles(_)
            | Self::State(_)
            | Self::Snapshot(_) => "input",
            Self::Packing(error) | Self::PackingStep { error, .. } => grain_kind(error),
            Self::NotAtRest { .. } => "packing",
            Self::Record(error) => error.kind(),
            Self::Elsewhere(_) => "elsewhere",
            Self::Start(error) => mics::kind(error),
            Self::Step { problem, .. } => problem.kind,
        }
    }
}

/// A rank's error, with what is to be said of it.
#[derive(Debug)]
pub(crate) struct RankFailure {
    pub error: RankError,
    pub failure: Failure,
}

impl<E: Into<RankError>> From<E> for Box<RankFailure> {
    /// Before the first step.
    fn from(error: E) -> Self {
        let error = error.into();
        let failure = error.failure((0, 0.0, ""));
        Self::new(RankFailure { error, failure })
    }
}

impl RankFailure {
    /// What the command says, with the last good checkpoint and the file of the bed that the run packed.
    pub fn into_command_error(self, checkpoint: Option<PathBuf>, bed: Option<&Path>) -> CommandError {
        self.error.into_command_error(Failure { checkpoint, ..self.failure }, bed)
    }
}

/// The failure of grains in one word.
pub(super) fn grain_kind(error: &DemError) -> &'static str {
    match error {
        DemError::NotFinite { .. } => "not_finite",
        DemError::GrainEscaped { .. } => "grain_escaped",
        DemError::OverlapTooLarge { .. } => "overlap",
        DemError::BoxTooShort { .. } | DemError::BadGrain { .. } | DemError::Snapshot(_) => "input",
        DemError::Elsewhere(_) => "elsewhere",
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn heights_are_told_in_millimetres() {
        let high = RankError::BedTooHigh { grain: "grain 12 of `sand`".into(), height: 0.012_345_678_9, top: 0.0121 };
        let expected =
            "the bed is higher than the box: grain 12 of `sand` reaches up to 12.3457 mm, the box to 12.1000 mm";
        assert_eq!(high.to_string(), expected);
        let drop = RankError::LiquidTooHigh { liquid: "drop".into(), height: 0.1 / 3.0, top: 0.03 };
        assert!(drop.to_string().ends_with("it reaches up to 33.3333 mm, the box to 30.0000 mm"), "{drop}");
    }
}
