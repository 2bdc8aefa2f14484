//! Failures of a run on a rank, and the command's report of them.

use std::path::{Path, PathBuf};

use sazanami_dem::{DemError, Wall};
use sazanami_io::checkpoint::CheckpointError;
use sazanami_io::table::TableError;
use sazanami_mics::boundary::BoundaryError;
use sazanami_mics::solver::StepError;
use sazanami_mics::stability::Limit;
use sazanami_mps::solver::SetupError;
use sazanami_numerics::Real;
use sazanami_numerics::domain::{FailedElsewhere, LayoutError};
use sazanami_numerics::snapshot::SnapshotError;
use sazanami_parallel::ThreadsRefused;
use serde::{Deserialize, Serialize};

use crate::bed_file::BedFileError;
use crate::case::amounts::length;
use crate::case::meaning::Case;
use crate::error::{CommandError, Failure};
use crate::naming::{grain_error, grain_kind};
use crate::results::SERIES;
use crate::water::{ELSEWHERE, StepProblem, mics};

/// Something could not be written or drawn.
#[derive(Debug, thiserror::Error)]
pub(crate) enum RecordError {
    /// A table or the summary.
    #[error(transparent)]
    Table(#[from] TableError),
    /// A file for ParaView.
    #[error(transparent)]
    Vtk(#[from] sazanami_io::vtk::VtkError),
    /// A checkpoint of the run.
    #[error(transparent)]
    Checkpoint(#[from] CheckpointError),
    /// The file of a packed bed.
    #[error(transparent)]
    Bed(#[from] BedFileError),
    /// A file or folder.
    #[error("{}: {error}", path.display())]
    Path {
        /// The file or folder.
        path: PathBuf,
        /// Error of the operating system.
        error: std::io::Error,
    },
    /// Rank 0 could not write.
    #[error(transparent)]
    Elsewhere(#[from] FailedElsewhere),
}

impl RecordError {
    /// The failure in one word.
    pub fn kind(&self) -> &'static str {
        match self {
            Self::Table(TableError::NotFinite { .. }) => "not_finite",
            Self::Elsewhere(_) => "elsewhere",
            _ => "disk",
        }
    }
}

/// A state of a tank that does not fit.
#[derive(Clone, Debug, thiserror::Error)]
pub(crate) enum StateError {
    /// Its arrays are not those of this case.
    #[error("the state of the tank does not fit the case: {0}")]
    Restore(#[from] sazanami_mps::snapshot::RestoreError),
    /// Neither are its grains.
    #[error("the grains of the tank's state do not fit the case: {0}")]
    Grains(sazanami_dem::DemError),
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
        "the bed is higher than the box: {grain} reaches up to {}, the box to {}",
        length(*height),
        length(*top)
    )]
    BedTooHigh { grain: String, height: Real, top: Real },
    #[error("no grain of the packed bed lies below its level")]
    NothingBelowLevel,
    #[error("{grain} stands in the gate `{gate}`")]
    GrainInGate { grain: String, gate: String },
    #[error(
        "the liquid `{liquid}` does not fit above the bed: it reaches up to {}, the box to {}",
        length(*height),
        length(*top)
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
    #[error(
        "the water did not come to rest between the grains {state}\n  help: raise `preparation.relax_steps`; if the strain does \
         not fall, look at what was poured: a liquid and grains at the same place, a liquid that nothing bears and falls, a tank narrower \
         than the grains; `preparation.must_rest = false` goes on all the same"
    )]
    WaterNotAtRest { state: String, steps: u64 },
    #[error("the checkpoint does not fit the case: {0}")]
    Snapshot(#[from] SnapshotError),
    #[error(transparent)]
    Record(#[from] RecordError),
    #[error(transparent)]
    Elsewhere(#[from] FailedElsewhere),
}

impl RankError {
    /// A step at `time` \[s] failed while grains packed or came to rest.
    pub fn packing_step(case: &Case, walls: &[Wall], error: DemError, step: u64, time: Real) -> Self {
        Self::PackingStep { message: grain_error(case, walls, &error), error, step, time }
    }

    /// Whether another rank has the reason.
    pub fn is_secondary(&self) -> bool {
        match self {
            Self::Elsewhere(_)
            | Self::Packing(DemError::Elsewhere(_))
            | Self::Snapshot(SnapshotError::Elsewhere(_))
            | Self::State(StateError::Grains(DemError::Elsewhere(_))) => true,
            Self::Record(error) => matches!(error, RecordError::Elsewhere(_)),
            Self::PackingStep { error, .. } => matches!(error, DemError::Elsewhere(_)),
            Self::Start(error) => mics::kind(error) == ELSEWHERE,
            Self::Step { problem, .. } => problem.elsewhere,
            _ => false,
        }
    }

    /// Suggestion where the input is wrong; `None` if the run itself failed.
    fn help(&self) -> Option<&'static str> {
        match self {
            Self::Threads(_) => Some("ask for fewer with `--threads` or `--ranks`"),
            Self::Layout(_) => Some("use fewer ranks or more cells"),
            Self::Boundary(_) => Some("correct the sides in `[boundary]`"),
            Self::LiquidOnGrain { .. } => Some("put the liquid higher, or set `allow_touching_grains = true` for it"),
            Self::BedTooHigh { .. } => {
                Some("make the box higher, take fewer grains, or let the bed come to rest: `stop = \"settled\"`")
            }
            Self::NothingBelowLevel => Some("take a higher `level` for the bed"),
            Self::GrainInGate { .. } => Some("move the grain or the gate: a grain keeps half its size from the plate"),
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

    /// Cause, place and time of the failure; `reached` is the run's last step, its time, and the limit that ruled it.
    pub fn failure(&self, reached: (u64, Real, &'static str)) -> Failure {
        let (step, time, limiter) = match self {
            Self::Step { step, time, limit, .. } => (*step, *time, *limit),
            Self::PackingStep { step, time, .. } => (*step, *time, Limit::Contact.name()),
            Self::WaterNotAtRest { steps, .. } => (*steps, 0.0, "preparation"),
            Self::NotAtRest { time, .. } => (0, *time, Limit::Contact.name()),
            _ => reached,
        };
        Failure {
            kind: self.kind().to_owned(),
            message: self.to_string(),
            step,
            time,
            limiter: limiter.to_owned(),
            rank: None,
            checkpoint: None,
        }
    }

    /// The failure in one word.
    pub fn kind(&self) -> &'static str {
        match self {
            Self::Threads(_)
            | Self::Layout(_)
            | Self::Boundary(_)
            | Self::LiquidOnGrain { .. }
            | Self::BedTooHigh { .. }
            | Self::NothingBelowLevel
            | Self::GrainInGate { .. }
            | Self::LiquidTooHigh { .. }
            | Self::Particles(_)
            | Self::State(_)
            | Self::Snapshot(_) => "input",
            Self::Packing(error) | Self::PackingStep { error, .. } => grain_kind(error),
            Self::NotAtRest { .. } => "packing",
            Self::WaterNotAtRest { .. } => "preparation",
            Self::Record(error) => error.kind(),
            Self::Elsewhere(_) => "elsewhere",
            Self::Start(error) => mics::kind(error),
            Self::Step { problem, .. } => problem.kind,
        }
    }
}

/// A rank's error as it is reported: text, which travels between processes.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(crate) struct RankFailure {
    /// The failure, with place and time.
    pub failure: Failure,
    /// Suggestion where the input is wrong; `None` if the run itself failed.
    help: Option<String>,
    /// Whether the bed that the run packed can be used by a changed case.
    bed_serves: bool,
    /// Whether another rank has the reason.
    pub is_secondary: bool,
    /// Whether it was found before anything was done, see [`RankError::is_at_once`].
    pub is_at_once: bool,
}

impl<E: Into<RankError>> From<E> for Box<RankFailure> {
    /// Before the first step.
    fn from(error: E) -> Self {
        let error = error.into();
        let failure = error.failure((0, 0.0, ""));
        RankFailure::new(&error, failure)
    }
}

impl RankFailure {
    /// `error` with the report of it.
    pub fn new(error: &RankError, failure: Failure) -> Box<Self> {
        let bed_serves = matches!(
            error,
            RankError::LiquidOnGrain { .. } | RankError::BedTooHigh { .. } | RankError::LiquidTooHigh { .. }
        );
        let (is_secondary, is_at_once) = (error.is_secondary(), error.is_at_once());
        Box::new(Self { failure, help: error.help().map(str::to_owned), bed_serves, is_secondary, is_at_once })
    }

    /// Error of the command, with the last good checkpoint and the file of the bed that the run packed.
    pub fn into_command_error(self, checkpoint: Option<PathBuf>, bed: Option<&Path>) -> CommandError {
        match (self.help, bed.filter(|_| self.bed_serves)) {
            (Some(help), Some(bed)) => CommandError::input(
                self.failure.message,
                format!(
                    "{help}; the packed bed is kept: the changed case can read it with \
                     `placement.bed = {{ file = \"{}\" }}`",
                    bed.display()
                ),
            ),
            (Some(help), None) => CommandError::input(self.failure.message, help),
            (None, _) => Failure { checkpoint, ..self.failure }.into(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn heights_are_told_to_four_digits() {
        let high = RankError::BedTooHigh { grain: "grain 12 of `sand`".into(), height: 0.012_345_678_9, top: 0.0121 };
        let expected = "the bed is higher than the box: grain 12 of `sand` reaches up to 12.35 mm, the box to 12.1 mm";
        assert_eq!(high.to_string(), expected);
        let drop = RankError::LiquidTooHigh { liquid: "drop".into(), height: 0.1 / 3.0, top: 0.03 };
        assert!(drop.to_string().ends_with("it reaches up to 33.33 mm, the box to 30 mm"), "{drop}");
    }
}
