//! What a recorder asks of the books of a solver.

use sazanami_io::table::Column;
use sazanami_numerics::Real;
use sazanami_numerics::snapshot::Snapshot;
use serde_json::{Map, Value};

use super::bed::GrainsSeen;
use super::files::Files;
use super::{RecordError, Totals};
use crate::case::meaning::Case;
use crate::clock::Clock;
use crate::simulation::{Job, RankError, Water};

/// A step that was done.
pub(crate) struct Step<'a, W: Water> {
    /// Its length [s].
    pub dt: Real,
    /// The limit that ruled it: that of the stable length, or the next output.
    pub limit: &'static str,
    /// Length that would have been stable [s] and the limit that ruled it: the step before it was cut for an output.
    pub stable: (Real, &'static str),
    /// What it did.
    pub report: &'a W::Report,
}

/// Something that people should know of.
pub(crate) struct Worry {
    /// What it is about: each is told of once.
    pub about: &'static str,
    /// In a sentence.
    pub text: String,
}

/// What books have to tell for the summary.
pub(crate) struct Account {
    /// Particles of fluid.
    pub particles: usize,
    /// What was kept of what should be.
    pub conservation: Value,
    /// Where the momentum went.
    pub momentum: Value,
    /// What the case asked for.
    pub observables: Map<String, Value>,
}

/// Keeps books of a run with one of the solvers, and writes what only that solver has.
///
/// Every rank has books, since what is written is gathered from all; functions with `files` are called on all ranks,
/// with files on rank 0 only.
pub(crate) trait Books: Sized {
    /// The solver.
    type Water: Water;

    /// Empty books.
    fn new(job: &Job) -> Self;

    /// The flow begins, or goes on; the grains were looked at.
    fn begin(&mut self, job: &Job, seen: &mut GrainsSeen, water: &mut Self::Water) -> Result<(), RankError>;

    /// Books of a step what only this solver has.
    fn add(&mut self, step: &Step<'_, Self::Water>, totals: &mut Totals);

    /// Looks at everything at `time` [s]; the grains were looked at.
    fn look(&mut self, seen: &mut GrainsSeen, water: &mut Self::Water, time: Real);

    /// What is to be said as the flow of `case` begins.
    fn notes(_case: &Case) -> Vec<String> {
        Vec::new()
    }

    /// What was found at the last look that people should know of.
    fn worries(&self) -> Vec<Worry>;

    /// Columns of the series.
    fn columns() -> Vec<Column>;

    /// Adds rows to the series and other tables, by the last look.
    fn rows(
        &self,
        clock: &Clock,
        step: Option<&Step<'_, Self::Water>>,
        seen: &GrainsSeen,
        totals: &Totals,
        files: &mut Files,
    ) -> Result<(), RecordError>;

    /// Writes the fluid for ParaView.
    fn fields(
        &self,
        job: &Job,
        water: &mut Self::Water,
        clock: &Clock,
        files: Option<&mut Files>,
    ) -> Result<(), RecordError>;

    /// Writes the grains for ParaView, by the last look: their surfaces, unless there are simpler ways.
    fn grains(&self, job: &Job, clock: &Clock, seen: &GrainsSeen, files: &mut Files) -> Result<(), RecordError> {
        files.grains(clock, seen, &job.shapes)
    }

    /// Draws the pictures of a time, by the last look.
    fn draw(
        &self,
        job: &Job,
        water: &Self::Water,
        clock: &Clock,
        files: Option<&mut Files>,
        seen: &GrainsSeen,
    ) -> Result<(), RecordError>;

    /// Writes a row for every probe that is `due`.
    fn probe(
        &mut self,
        job: &Job,
        water: &mut Self::Water,
        clock: &Clock,
        due: &[bool],
        files: Option<&mut Files>,
    ) -> Result<(), RecordError>;

    /// For the summary.
    fn account(&self) -> Account;

    /// Adds what a resumed run needs to a snapshot.
    fn save(&self, snapshot: &mut Snapshot);
}
