//! What a run leaves behind: series, fields, grains, pictures, checkpoints, summary.
//!
//! Every rank has a recorder, because what is written is gathered from all; rank 0 alone has files.

mod again;
mod files;
mod observers;
mod pace;
mod pictures;
mod probes;
mod summary;
mod timetable;
mod totals;

use std::path::PathBuf;
use std::time::{Duration, Instant};

use sazanami_dem::{ContactReport, Engine, Packing, PackingReport};
use sazanami_io::checkpoint::{CheckpointError, CheckpointWriter};
use sazanami_mics::snapshot::GRAINS;
use sazanami_mics::solver::{Solver, StepReport};
use sazanami_mics::stability::Limit;
use sazanami_numerics::Real;
use sazanami_numerics::domain::Domain;
use sazanami_numerics::snapshot::Snapshot;

use crate::bed_file::{Bed, BedFileError, Lying, Recipe};
use crate::case::meaning::Case;
use crate::clock::Clock;
use crate::error::Failure;
use crate::progress::StepLine;
use crate::run::Status;
use crate::simulation::{Ended, Job, PACKING, RankError, RankFailure, RunState, fixed_step, partner};

pub(crate) use again::{Beds, FoundAgain, is_observed};
use files::Files;
use observers::Observers;
use pace::Pace;
pub(crate) use summary::{put_failure, put_files};
use timetable::Timetables;
pub use totals::Totals;
use totals::{SETUP, Watch};

/// Sections of a checkpoint that are not physics.
const RUN_STATE: &str = "run/state";
/// Simulated clock in a checkpoint.
const CLOCK: &str = "clock";

/// Something could not be written or drawn.
#[derive(Debug, thiserror::Error)]
pub enum RecordError {
    /// A table or the summary.
    #[error(transparent)]
    Table(#[from] sazanami_io::table::TableError),
    /// A file for ParaView.
    #[error(transparent)]
    Vtk(#[from] sazanami_io::vtk::VtkError),
    /// A checkpoint.
    #[error(transparent)]
    Checkpoint(#[from] CheckpointError),
    /// A picture.
    #[error(transparent)]
    Picture(#[from] sazanami_io::picture::PictureError),
    /// A bed.
    #[error(transparent)]
    Bed(#[from] BedFileError),
    /// A file or folder.
    #[error("{}: {error}", path.display())]
    Path {
        /// Which.
        path: PathBuf,
        /// What the system says.
        error: std::io::Error,
    },
    /// Rank 0 could not write.
    #[error(transparent)]
    Elsewhere(#[from] sazanami_numerics::domain::FailedElsewhere),
}

impl RecordError {
    /// The failure in one word.
    pub fn kind(&self) -> &'static str {
        match self {
            Self::Table(sazanami_io::table::TableError::NotFinite { .. }) => "not_finite",
            Self::Elsewhere(_) => "elsewhere",
            _ => "disk",
        }
    }
}

/// Keeps the books of a run and writes what is due.
pub(crate) struct Recorder<'a> {
    job: &'a Job<'a>,
    /// Measures the phases.
    pub watch: Watch,
    totals: Totals,
    timetables: Timetables,
    observers: Observers,
    files: Option<Files>,
    pace: Pace,
    last_checkpoint: Instant,
    state_hash: Option<u64>,
    /// Time and step last seen.
    reached: (Real, u64),
    /// Limit that ruled the last step.
    limiter: &'static str,
    /// Whether it was said that the crater cannot be evaluated.
    told_of_crater: bool,
}

impl<'a> Recorder<'a> {
    /// Gets ready; rank 0 (`leads`) opens the files.
    pub fn open(job: &'a Job<'a>, leads: bool) -> Result<Self, RankError> {
        let totals = job.resumed.as_ref().map_or_else(Totals::default, |state| state.run.totals.clone());
        let resumed_at = job.resumed.as_ref().filter(|state| !state.run.packing).map(|s| (s.run.time, s.run.step));
        let files = if leads { Some(Files::open(job, resumed_at)?) } else { None };
        let now = Instant::now();
        Ok(Self {
            job,
            watch: Watch::start(),
            totals,
            timetables: Timetables::of(job.case),
            observers: Observers::new(job),
            files,
            pace: Pace::from(0.0),
            last_checkpoint: now,
            state_hash: None,
            reached: resumed_at.unwrap_or_default(),
            limiter: "",
            told_of_crater: false,
        })
    }

    /// Tells of a step: rank 0 speaks for all.
    pub fn report(&self, line: &StepLine) {
        if self.files.is_some() {
            self.job.report(line);
        }
    }

    /// Whether a checkpoint is due by the wall clock.
    pub fn wants_checkpoint(&self) -> bool {
        let every = self.job.case.checkpoint.every_wall.map(Duration::from_secs_f64);
        self.files.is_some() && every.is_some_and(|every| self.last_checkpoint.elapsed() >= every)
    }

    /// Next time at which a step has to end.
    pub fn next_due(&self, case: &Case, now: Real) -> Option<Real> {
        Some(self.timetables.next_after(now).map_or(case.run.until, |due| due.min(case.run.until)))
    }

    /// Wall-clock time left [s].
    pub fn remaining(&mut self, clock: &Clock, until: Real) -> Option<Real> {
        self.pace.seconds_for(clock.time(), until)
    }

    /// Takes note of a step of the packing.
    pub fn observe_packing(&mut self, engine: &Engine, report: &PackingReport) {
        self.watch.turn("packing");
        self.warn_of_overlap(engine, &report.contacts, report.time);
        let worst = &mut self.totals.worst;
        worst.overlap_relative = worst.overlap_relative.max(report.contacts.largest_overlap);
        worst.grain_speed = worst.grain_speed.max(report.contacts.largest_speed);
        self.totals.tidied.deep_contacts += report.contacts.deep_contacts;
    }

    /// Warns when contacts become deep for the first time, and then whenever there are ten times as many.
    fn warn_of_overlap(&self, engine: &Engine, contacts: &ContactReport, time: Real) {
        let before = self.totals.tidied.deep_contacts;
        let now = before + contacts.deep_contacts;
        let decade = |count: usize| count.checked_ilog10().map_or(0, |power| power + 1);
        if self.files.is_none() || decade(now) == decade(before) {
            return;
        }
        let [a, b] = contacts.largest_overlap_ids.map(|id| partner(self.job.case, engine.walls(), id));
        self.job.say(format!(
            "warning: {now} contacts so far have become deeper than 20 % of a contact sphere's radius, the deepest of \
             this step by {:.0} % between {a} and {b} at time {time:.4e} s; a run ends at 80 %",
            1e2 * contacts.largest_overlap
        ));
    }

    /// The bed is packed: measures it, and writes it if the case asks for it.
    pub fn packed(
        &mut self,
        domain: &Domain,
        packing: &Packing,
        report: &PackingReport,
        wall: Real,
        began: Real,
    ) -> Result<(), RankError> {
        self.watch.turn(SETUP);
        self.observers.gather(domain, packing.engine());
        let outcome = self.files.is_some().then(|| self.tell_of_bed(report, wall, began)).transpose();
        domain.agree(outcome.map_err(RankError::from))?;
        Ok(())
    }

    fn tell_of_bed(&mut self, report: &PackingReport, wall: Real, began: Real) -> Result<(), RecordError> {
        let job = self.job;
        let case = job.case;
        let floor = case.domain.lower.z;
        let found = self.observers.measure_bed();
        job.say(format!(
            "packed {} grains in {:.4} s of simulated time ({:.0} s of wall clock from {began:.4} s on): porosity {:.4} \
             between {:.1} and {:.1} mm, H_s {:.3} mm, mean speed {:.2e} m/s ({:.3} m/s at most), order of lying axes {:.3}",
            self.observers.count(),
            report.time,
            wall,
            found.porosity,
            1e3 * (case.bed.porosity_slab[0] - floor),
            1e3 * (case.bed.porosity_slab[1] - floor),
            found.height_mm,
            report.mean_speed,
            report.largest_mean_speed,
            found.lying_order,
        ));
        if let Some(path) = &case.output.bed {
            let bed = Bed {
                lower: case.domain.lower,
                upper: case.domain.upper,
                recipe: Recipe {
                    case: case.name.clone(),
                    case_hash: Recipe::hash_of(case),
                    version: env!("CARGO_PKG_VERSION").to_owned(),
                    shapes: case.grains.iter().map(|population| population.name.clone()).collect(),
                    porosity: found.porosity,
                    porosity_slab: case.bed.porosity_slab,
                    height: 1e-3 * found.height_mm,
                    mean_speed: report.mean_speed,
                    largest_mean_speed: report.largest_mean_speed,
                    lying_order: found.lying_order,
                    time: report.time,
                },
                grains: self.observers.lying(|shape, scale, position, orientation| Lying {
                    shape,
                    scale,
                    position,
                    orientation,
                }),
            };
            bed.write(path)?;
            job.say(format!("bed written to {}", path.display()));
        }
        self.write_summary(Status::Running, None)
    }

    /// Height of the highest node of the bed near the axis, known to all ranks [m]; the floor if there are no grains.
    pub fn measure_bed(&mut self, domain: &Domain, engine: &Engine) -> Real {
        self.observers.gather(domain, engine);
        let height = if self.files.is_some() { self.observers.bed_height() } else { Real::NEG_INFINITY };
        if self.files.is_some() {
            self.observers.measure_bed();
        }
        domain.max(height)
    }

    /// The flow begins, or goes on.
    pub fn begin(&mut self, solver: &mut Solver, clock: &Clock) -> Result<(), RankError> {
        self.pace = Pace::from(clock.time());
        self.reached = (clock.time(), clock.step());
        let outcome = self.observers.begin(self.job, solver);
        solver.domain().agree(outcome)?;
        if self.job.resumed.as_ref().is_none_or(|state| state.run.packing) {
            self.write_due(solver, clock, self.timetables.due_at_start(), None)?;
            self.write_probes(solver, clock, &self.timetables.probes_due_at_start())?;
        }
        Ok(())
    }

    /// Takes note of a step and writes what is due.
    pub fn observe(
        &mut self,
        solver: &mut Solver,
        clock: &Clock,
        before: Real,
        dt: Real,
        limit: Limit,
        report: &StepReport,
    ) -> Result<(), RankError> {
        self.reached = (clock.time(), clock.step());
        self.limiter = limit.name();
        self.warn_of_overlap(solver.grains().engine(), &report.contacts, clock.time());
        self.totals.add(report, limit);
        self.observers.add(report);
        let tolerance = fixed_step(self.job.case).unwrap_or_default();
        let due = self.timetables.due(before, clock, tolerance);
        if due.iter().any(|due| *due) {
            self.write_due(solver, clock, due, Some((dt, limit, report)))?;
        }
        self.write_probes(solver, clock, &self.timetables.probes_due(before, clock, tolerance))?;
        if self.timetables.checkpoint_is_due(before, clock, tolerance) {
            self.checkpoint(solver, clock)?;
        }
        Ok(())
    }

    /// Writes a row for each probe that is due.
    fn write_probes(&mut self, solver: &mut Solver, clock: &Clock, due: &[bool]) -> Result<(), RankError> {
        if due.contains(&true) {
            // A probe between cells of two ranks looks at both.
            solver.fill_halos();
            let outcome = probes::record(self.job, solver, clock, due, self.files.as_mut());
            solver.domain().agree(outcome.map_err(RankError::from))?;
        }
        Ok(())
    }

    /// Says once that the crater cannot be evaluated, and why.
    fn tell_of_crater(&mut self) {
        if self.files.is_none() || self.told_of_crater {
            return;
        }
        if let Some(problem) = &self.observers.findings().no_erosion {
            self.job.say(format!(
                "warning: the crater cannot be evaluated at time {:.4e} s: {problem}; the run goes on, and its columns \
                 stay empty until it can",
                self.reached.0
            ));
            self.told_of_crater = true;
        }
    }

    /// Writes series, fields, grains and pictures, those that are due.
    fn write_due(
        &mut self,
        solver: &mut Solver,
        clock: &Clock,
        due: [bool; 4],
        step: Option<(Real, Limit, &StepReport)>,
    ) -> Result<(), RankError> {
        let [series, fields, grains, figures] = due;
        self.observers.look(solver);
        self.tell_of_crater();
        let mut outcome = Ok(());
        if series && let Some(files) = &mut self.files {
            outcome = files.row(clock, step, &self.observers, &self.totals);
        }
        if fields {
            let written = files::fields(solver, clock, self.files.as_mut());
            outcome = outcome.and(written);
        }
        if grains && let Some(files) = &mut self.files {
            outcome = outcome.and_then(|()| files.grains(clock, &self.observers, &self.job.shapes));
        }
        if figures {
            let written = pictures::draw(self.job, solver, clock, self.files.as_mut(), &self.observers);
            outcome = outcome.and(written);
        }
        solver.domain().agree(outcome.map_err(RankError::from))?;
        Ok(())
    }

    /// Writes a checkpoint of the flow and the summary.
    pub fn checkpoint(&mut self, solver: &mut Solver, clock: &Clock) -> Result<(), RankError> {
        self.watch.empty_into(&mut self.totals);
        let mut snapshot = solver.snapshot();
        self.observers.save(&mut snapshot);
        snapshot.put_reals(CLOCK, vec![clock.time()]);
        self.last_checkpoint = Instant::now();
        let outcome = if self.files.is_some() { self.write_checkpoint(&snapshot, clock.step(), false) } else { Ok(()) };
        solver.domain().agree(outcome.map_err(RankError::from))?;
        Ok(())
    }

    /// Writes a checkpoint of the packing.
    pub fn checkpoint_packing(&mut self, domain: &Domain, packing: &mut Packing) -> Result<(), RankError> {
        self.watch.empty_into(&mut self.totals);
        let mut snapshot = Snapshot::default();
        packing.snapshot(domain, PACKING, &mut snapshot);
        snapshot.put_reals(CLOCK, vec![packing.engine().time()]);
        self.last_checkpoint = Instant::now();
        let outcome = if self.files.is_some() { self.write_checkpoint(&snapshot, 0, true) } else { Ok(()) };
        domain.agree(outcome.map_err(RankError::from))?;
        Ok(())
    }

    fn write_checkpoint(&mut self, snapshot: &Snapshot, step: u64, packing: bool) -> Result<(), RecordError> {
        let state = RunState {
            packing,
            time: self.reached.0,
            step,
            case_hash: format!("{:016x}", crate::case::resolved::hash(self.job.case)),
            totals: self.totals.clone(),
        };
        let mut writer = CheckpointWriter::new();
        writer.add_snapshot(snapshot)?;
        self.state_hash = Some(writer.content_hash(is_physical));
        writer.add_json(RUN_STATE, &state)?;
        if let Some(files) = &self.files {
            files.checkpoints.write(step, &writer)?;
        }
        self.write_summary(Status::Running, None)
    }

    /// Last looks at the end of the flow.
    pub fn end(&mut self, solver: &mut Solver, clock: &Clock) {
        self.observers.look(solver);
        self.reached = (clock.time(), clock.step());
        self.tell_of_crater();
    }

    /// The run has ended well.
    pub fn close(&mut self, ended: &Ended) -> Result<(), RankError> {
        self.watch.empty_into(&mut self.totals);
        if self.files.is_some() {
            self.write_summary(ended.status, None)?;
        }
        Ok(())
    }

    /// The run has failed: says so in the summary, if that can still be written.
    pub fn fail(&mut self, error: RankError) -> Box<RankFailure> {
        self.watch.empty_into(&mut self.totals);
        let (time, step) = self.reached;
        let failure = error.failure((step, time, self.limiter));
        if self.job.resumed.is_some() && error.is_input() {
            // A wrong command: the run it was to go on with is what it was.
            return Box::new(RankFailure { error, failure });
        }
        if let Err(problem) = self.write_summary(Status::Failed, Some(&failure)) {
            self.job.say(format!("the summary could not be written: {problem}"));
        }
        Box::new(RankFailure { error, failure })
    }

    fn write_summary(&mut self, status: Status, failure: Option<&Failure>) -> Result<(), RecordError> {
        let Some(files) = &self.files else { return Ok(()) };
        let present = summary::Present {
            status,
            failure,
            time: self.reached.0,
            steps: self.reached.1,
            totals: &self.totals,
            grains_by_shape: &self.observers.grains_by_shape(self.job.shapes.len()),
            budget: self.observers.budget(),
            findings: self.observers.findings(),
            state_hash: self.state_hash,
        };
        summary::write(&self.job.folder, &files.fixed, &present)?;
        Ok(())
    }
}

/// Whether a section of a checkpoint is part of the physical state: all but the books of the observers.
fn is_physical(section: &str) -> bool {
    section == CLOCK || ["fluid/", GRAINS, PACKING].iter().any(|prefix| section.starts_with(prefix))
}

/// Reads the state that is not physics from a checkpoint.
pub(crate) fn run_state(reader: &sazanami_io::checkpoint::CheckpointReader) -> Result<RunState, CheckpointError> {
    reader.get_json(RUN_STATE)
}
