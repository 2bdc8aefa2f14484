//! Interface between a recorder and the observer of a solver.

use sazanami_io::table::{self, Column};
use sazanami_numerics::snapshot::Snapshot;
use sazanami_numerics::{Real, Vector};
use serde_json::{Map, Value};

use super::bed::GatheredGrains;
use super::files::Files;
use crate::case::meaning::{Case, OutputFrame, ProbePlace};
use crate::clock::Clock;
use crate::columns::Quantity;
use crate::job::{Job, RankError, RecordError, Totals};
use crate::state::{Array, WaterState};
use crate::water::Water;

/// A step that was done.
pub(crate) struct DoneStep<'a, W: Water> {
    /// Its length \[s].
    pub dt: Real,
    /// The limit that ruled it: that of the stable length, or the next output.
    pub limit: &'static str,
    /// Length that would have been stable \[s] and the limit that ruled it: the step before it was cut for an output.
    pub stable: (Real, &'static str),
    /// The solver's report of it.
    pub report: &'a W::Report,
}

/// Source of a row of the series.
pub(crate) struct Row<'a, O: Observer> {
    /// Time and number of the step.
    pub clock: &'a Clock,
    /// The last step; absent before the first.
    pub step: Option<&'a DoneStep<'a, O::Water>>,
    /// The grains, gathered on rank 0.
    pub grains: &'a GatheredGrains,
    /// Sums and extremes since the start.
    pub totals: &'a Totals,
    /// The observer, with its last measurement.
    pub observer: &'a O,
}

/// A column of the series of an observer.
pub(crate) type SeriesCell<O> = Quantity<fn(&Row<'_, O>) -> table::Value>;

/// Destination of the output of a time.
pub(crate) struct Output<'a> {
    /// The run.
    pub job: &'a Job<'a>,
    /// Time and number of the step.
    pub clock: &'a Clock,
    /// The files of the run, on rank 0.
    pub files: Option<&'a mut Files>,
}

/// Something that the user should know of.
pub(crate) struct Warning {
    /// Subject: each is reported once.
    pub about: &'static str,
    /// The message, in a sentence.
    pub text: String,
}

/// The parts of the summary that only one of the solvers has.
pub(crate) struct SummaryParts {
    /// Moving particles of fluid; 0 on a grid.
    pub particles: usize,
    /// Residuals of what is conserved.
    pub conservation: Map<String, Value>,
    /// Momentum at present and the impulses since the start.
    pub momentum: Value,
    /// The observables that the case asks for.
    pub observables: Map<String, Value>,
}

/// Keeps the budgets of a run with one of the solvers, measures its observables, and writes what only that solver has.
///
/// Every rank has an observer, since what is written is gathered from all; functions with an [`Output`] are called on all ranks.
pub(crate) trait Observer: Sized + 'static {
    /// The solver that is observed.
    type Water: Water;

    /// Columns of the series, after those that every series begins with.
    const SERIES: &'static [SeriesCell<Self>];
    /// Columns that follow where a crater is evaluated.
    const SERIES_OF_CRATER: &'static [SeriesCell<Self>] = &[];
    /// Columns that follow where the interface has surface tension.
    const SERIES_OF_INTERFACE: &'static [SeriesCell<Self>] = &[];

    /// An observer that has measured nothing yet.
    fn new(job: &Job) -> Self;

    /// The flow begins, or goes on; the grains were gathered.
    fn begin(&mut self, job: &Job, grains: &mut GatheredGrains, water: &mut Self::Water) -> Result<(), RankError>;

    /// Adds a step to the budgets.
    fn add(&mut self, step: &DoneStep<'_, Self::Water>, totals: &mut Totals);

    /// Measures everything at `time` \[s]; the grains were gathered before.
    fn measure(&mut self, grains: &mut GatheredGrains, water: &mut Self::Water, time: Real);

    /// Messages about `case` as the flow begins.
    fn notes(case: &Case) -> Vec<String> {
        Vec::from_iter(of_frame(case))
    }

    /// Warnings to the user from the last measurement.
    fn warnings(&self) -> Vec<Warning>;

    /// The series gets a row of what was measured last, at `time` \[s].
    fn note_row(&mut self, _time: Real) {}

    /// Whether what the run waits for is at rest, by the rows so far. Rank 0 knows.
    fn is_at_rest(&self) -> bool {
        false
    }

    /// Adds what was measured last to the tables beside the series.
    fn tables(&self, clock: &Clock, files: &mut Files) -> Result<(), RecordError>;

    /// Writes the fluid for ParaView.
    fn fields(&self, to: Output, water: &mut Self::Water) -> Result<(), RecordError>;

    /// Displacement \[m] and velocity [m/s] of the tank at a time \[s] in the frame of the engine.
    fn tank(&self, _time: Real) -> [Vector; 2] {
        [Vector::ZERO; 2]
    }

    /// Displacement \[m] and velocity [m/s] of the frame that grains are written in, against that of the engine.
    fn written_frame(&self, job: &Job, clock: &Clock) -> [Vector; 2] {
        job.case.to_written_frame(clock.time()).map(|tank| Vector::ZERO - tank)
    }

    /// The water as arrays at the time of `clock`, on rank 0. Collective.
    fn water_state(&mut self, job: &Job, clock: &Clock, water: &mut Self::Water) -> Option<WaterState>;

    /// Values of the grains that only this solver has, as measured last or after [`Self::water_state`], in the order of
    /// their identifiers.
    fn grain_state(&self) -> Vec<Array> {
        Vec::new()
    }

    /// Draws the pictures of a time, as measured last.
    fn draw(&self, to: Output, water: &Self::Water, grains: &GatheredGrains) -> Result<(), RecordError>;

    /// Headings of the table of a probe, the time first.
    fn probe_headings(place: &ProbePlace) -> Vec<Column>;

    /// Values of each of the probes that are `asked` at `time` \[s], in the order of the headings but the time; an
    /// empty row of the others, and on ranks that do not lead there may be no rows at all. Collective.
    fn probe(&mut self, job: &Job, water: &mut Self::Water, time: Real, asked: &[bool]) -> Vec<Vec<table::Value>>;

    /// Conservation, momentum and observables for the summary.
    fn summary_parts(&self) -> SummaryParts;

    /// Adds what a resumed run needs to a snapshot.
    fn save(&self, snapshot: &mut Snapshot);
}

/// In which frame things are written, where there are two.
pub(super) fn of_frame(case: &Case) -> Option<String> {
    let moves = case.frame.as_ref().is_some_and(|frame| frame.motion.is_some());
    (moves && case.output.frame == OutputFrame::Laboratory).then(|| {
        "fields, grains and probes are written in the frame of the laboratory; series, surfaces, layers and pictures in \
         that of the tank"
            .to_owned()
    })
}
