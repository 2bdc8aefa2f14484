//! Records of a run: series, fields, grains, pictures, checkpoints, summary.
//!
//! Every rank has a recorder, because what is written is gathered from all; rank 0 alone has files.

mod bed;
mod columns;
mod drawing;
mod files;
mod grain_files;
mod mics;
mod mps;
mod observer;
mod page;
mod probing;
mod reevaluated;
mod summary;
mod timetable;
mod watch;

use std::path::{Path, PathBuf};
use std::time::Instant;

use sazanami_dem::{ContactReport, Engine, Packing, PackingReport};
use sazanami_io::checkpoint::CheckpointWriter;
use sazanami_mps::snapshot::GRAINS;
use sazanami_numerics::Real;
use sazanami_numerics::domain::Domain;
use sazanami_numerics::snapshot::Snapshot;
use sazanami_posing::assembly::grains::after_packing;
use sazanami_posing::case::amounts;
use sazanami_posing::steps::fixed_step;

use crate::bed_file::{self, Bed, BedGrain, Recipe};
use crate::case::meaning::{Case, RunEnd};
use crate::clock::Clock;
use crate::error::Failure;
use crate::job::{
    Ending, Job, PACKING, RELAXATION, RUN_STATE, RankError, RankFailure, RecordError, RunState, Status, Totals,
};
use crate::naming::partner;
use crate::progress::StepLine;
use crate::results::PACKED_BED;
use crate::state::State;
use crate::tanks;
use crate::water::Water;

use bed::GatheredGrains;
pub(crate) use bed::LOOSEST;
use columns::{series_headings, series_row};
use files::Files;
use grain_files::GrainStates;
pub(crate) use grain_files::NEVER;
pub(crate) use mics::pictures::{Drawn, bed_surface, scene};
pub(crate) use mics::{GridObserver, drops, erosion_settings};
pub(crate) use mps::{ParticleObserver, closed, form_settings, forms_of, relief_of, surface_json, tank_of};
pub(crate) use observer::{DoneStep, Observer, Warning};
use observer::{Output, Row};
pub(crate) use page::page;
use probing::Reading;
pub(crate) use reevaluated::{Beds, Reevaluated, is_observed};
pub(crate) use summary::{put_failure, put_files, put_ripples};
use timetable::Timetables;
use watch::{PICTURES, SETUP, Watch};

/// Simulated clock in a checkpoint.
const CLOCK: &str = "clock";
/// Section of a tank that is kept: the largest overlap while its bed was packed, over a radius, and how many were deep.
const PACKED: &str = "preparation/packed";

/// Observes a run and writes what is due.
pub(crate) struct Recorder<'a, B: Observer> {
    job: &'a Job<'a>,
    /// Wall-clock time of the phases.
    pub watch: Watch,
    totals: Totals,
    timetables: Timetables,
    grains: GatheredGrains,
    observer: B,
    /// Probes that fall due within the step, as read at its start.
    probed: Reading,
    /// Probes as read at the end of the step before.
    last_probed: Reading,
    files: Option<Files>,
    last_checkpoint: Instant,
    state_hash: Option<u64>,
    /// Time and step observed last.
    reached: (Real, u64),
    /// Limit that ruled the last step.
    limiter: &'static str,
    /// Warnings of the observer that were reported.
    warned: Vec<&'static str>,
}

impl<'a, B: Observer> Recorder<'a, B> {
    /// Gets ready; rank 0 (`leads`) opens the files.
    pub fn open(job: &'a Job<'a>, leads: bool) -> Result<Self, RankError> {
        let totals = job.resumed.as_ref().map_or_else(Totals::default, |state| state.run.totals.clone());
        let resumed_at = job.resumed.as_ref().filter(|state| state.run.flows()).map(|s| (s.run.time, s.run.step));
        let files = if leads { Some(Files::open(job, series_headings::<B>, resumed_at)?) } else { None };
        let now = Instant::now();
        Ok(Self {
            job,
            watch: Watch::start(),
            totals,
            timetables: Timetables::of(job.case),
            grains: GatheredGrains::new(job),
            observer: B::new(job),
            probed: Reading::default(),
            last_probed: Reading::default(),
            files,
            last_checkpoint: now,
            state_hash: None,
            reached: resumed_at.unwrap_or_default(),
            limiter: "",
            warned: Vec::new(),
        })
    }

    /// Reports a step, on rank 0.
    pub fn report(&self, line: &StepLine) {
        if self.files.is_some() {
            self.job.report(line);
        }
    }

    /// Whether a checkpoint is due by the wall clock.
    pub fn wants_checkpoint(&self) -> bool {
        let every = self.job.case.checkpoint.every_wall;
        self.files.is_some() && every.is_some_and(|every| self.last_checkpoint.elapsed().as_secs_f64() >= every)
    }

    /// Whether what the case waits for has come to rest, on rank 0.
    pub fn waits_no_longer(&self) -> bool {
        self.files.is_some() && self.job.case.run.end == RunEnd::Rest && self.observer.is_at_rest()
    }

    /// Writes what the end of the case would have written. All ranks take part.
    pub fn end_at_rest(&mut self, water: &mut B::Water, clock: &Clock) -> Result<(), RankError> {
        if self.files.is_some() {
            self.job.say(format!("the crater is at rest at {:.4e} s: the run ends", clock.time()));
        }
        let due = self.timetables.due_at_end();
        self.write_due(water, clock, due, None)
    }

    /// Next time at which a step has to end.
    pub fn next_due(&self, case: &Case, now: Real) -> Option<Real> {
        Some(self.timetables.next_after(now).map_or(case.run.until, |due| due.min(case.run.until)))
    }

    /// Takes note of a step of the packing.
    pub fn observe_packing(&mut self, engine: &Engine, report: &PackingReport) {
        self.watch.turn("packing");
        self.warn_of_overlap(engine, &report.contacts, report.time);
        self.totals.note_packing(&report.contacts);
    }

    /// Warns when contacts become deep for the first time, and then whenever there are ten times as many.
    fn warn_of_overlap(&self, engine: &Engine, contacts: &ContactReport, time: Real) {
        let before = self.totals.corrections.deep_contacts;
        let now = before + contacts.deep_contacts;
        let decade = |count: usize| count.checked_ilog10().map_or(0, |power| power + 1);
        if self.files.is_none() || decade(now) == decade(before) {
            return;
        }
        let [a, b] = contacts.largest_overlap_ids.map(|id| partner(self.job.case, engine.walls(), id));
        let limit = engine.largest_overlap_allowed();
        let ends = if limit.is_finite() {
            format!("a run ends at {:.0} %", 1e2 * limit)
        } else {
            "grains of unlike sizes may pass into each other until their bed is stiffened".to_owned()
        };
        self.job.say(format!(
            "warning: {now} contacts so far have become deeper than 20 % of a contact sphere's radius, the deepest of \
             this step by {:.0} % between {a} and {b} at time {}; {ends}",
            1e2 * contacts.largest_overlap,
            amounts::time(time)
        ));
    }

    /// The bed is packed: measures and writes it, so that it is not lost if the rest of the case does not suit it.
    pub fn packed(
        &mut self,
        domain: &Domain,
        packing: &Packing,
        report: &PackingReport,
        wall: Real,
        began: Real,
    ) -> Result<(), RankError> {
        self.watch.turn(SETUP);
        self.grains.gather(domain, packing.engine());
        let outcome = self.files.is_some().then(|| self.report_bed(packing, report, wall, began)).transpose();
        domain.agree(outcome.map_err(RankError::from))?;
        Ok(())
    }

    fn report_bed(
        &mut self,
        packing: &Packing,
        report: &PackingReport,
        wall: Real,
        began: Real,
    ) -> Result<(), RecordError> {
        let job = self.job;
        let case = job.case;
        let floor = case.domain.lower.z;
        let (_, found) = self.grains.measure_bed();
        self.grains.measure_heap();
        let slab = [case.bed.porosity_lower, floor + 1e-3 * found.slab_top_mm.unwrap_or_default()];
        let porosity = found.porosity.map_or_else(
            || "no porosity: the slab of `[bed]` lies above the bed".to_owned(),
            |porosity| {
                let [lower, upper] = slab.map(|height| 1e3 * (height - floor));
                format!("porosity {porosity:.4} between {lower:.1} and {upper:.1} mm")
            },
        );
        job.say(format!(
            "packed {} grains in {:.4} s of simulated time ({wall:.0} s of wall-clock time since {began:.4} s): {porosity}, \
             height H_s {:.3} mm, mean speed of the grains {:.2e} m/s ({:.3} m/s in the fall), order of the long axes {:.3}",
            self.grains.count(),
            report.time,
            found.height_mm,
            report.mean_speed,
            report.largest_mean_speed,
            found.lying_order,
        ));
        let grains = self.as_used(packing);
        if case.levels() {
            let (packed, left) = (self.grains.count(), grains.len());
            job.say(format!("levelled: {} of {packed} grains are taken away", packed - left));
            if left == packed {
                job.say("warning: the bed lies below its level, which takes nothing away".to_owned());
            }
        }
        let bed = Bed {
            lower: case.domain.lower,
            upper: case.domain.upper,
            recipe: Recipe {
                case: case.name.clone(),
                case_hash: bed_file::hash_of(case),
                version: env!("CARGO_PKG_VERSION").to_owned(),
                shapes: case.grains.iter().map(|population| population.name.clone()).collect(),
                porosity: found.porosity,
                porosity_slab: slab,
                height: 1e-3 * found.height_mm,
                mean_speed: report.mean_speed,
                largest_mean_speed: report.largest_mean_speed,
                lying_order: found.lying_order,
                time: report.time,
            },
            grains,
        };
        let path = packed_bed(case, &job.folder);
        bed.write(&path)?;
        job.say(format!("bed written to {}", path.display()));
        self.write_summary(Status::Running, None)
    }

    /// The grains of the packed bed as the flow will have them: levelled, and glued where the case says so.
    fn as_used(&self, packing: &Packing) -> Vec<BedGrain> {
        let (case, bodies) = (self.job.case, packing.engine().bodies());
        let lying = self.grains.lying(|shape, scale, position, orientation| {
            let held = after_packing(case, &bodies[shape as usize], shape, scale, position, orientation)?;
            Some(BedGrain { shape, scale, position, orientation, held })
        });
        lying.into_iter().flatten().collect()
    }

    /// Height of the highest node of the bed near the axis, known to all ranks \[m]; the floor if there are no grains.
    pub fn measure_bed(&mut self, domain: &Domain, engine: &Engine) -> Real {
        self.grains.gather(domain, engine);
        let height = if self.files.is_some() { self.grains.measure_bed().0 } else { Real::NEG_INFINITY };
        domain.max(height)
    }

    /// The flow begins, or goes on.
    pub fn begin(&mut self, water: &mut B::Water, clock: &Clock) -> Result<(), RankError> {
        self.reached = (clock.time(), clock.step());
        self.grains.gather(water.domain(), water.engine());
        let resumed = self.job.resumed.as_ref().filter(|state| state.run.flows());
        if let Some(state) = resumed {
            self.grains.restore(&state.snapshot);
        }
        let outcome = self.observer.begin(self.job, &mut self.grains, water);
        water.domain().agree(outcome)?;
        if self.job.options.artist.is_none() && !self.job.case.output.figures.is_empty() {
            self.say("no pictures: the case asks for some, and this program draws none");
        }
        if resumed.is_none() {
            B::notes(self.job.case).iter().for_each(|note| self.say(note));
            self.write_due(water, clock, self.timetables.due_at_start(), None)?;
            self.write_probes(water, clock, clock.time(), &self.timetables.probes_due_at_start())?;
        }
        Ok(())
    }

    /// Takes note of a step and writes what is due.
    pub fn observe(
        &mut self,
        water: &mut B::Water,
        clock: &Clock,
        before: Real,
        step: &DoneStep<'_, B::Water>,
    ) -> Result<(), RankError> {
        self.reached = (clock.time(), clock.step());
        self.limiter = step.limit;
        let contacts = B::Water::contacts(step.report);
        self.warn_of_overlap(water.engine(), contacts, clock.time());
        self.totals.note_step(contacts, B::Water::pressure_iterations(step.report));
        self.totals.ruled_by(step.limit);
        self.totals.note_stable_step(step.stable.0);
        self.observer.add(step, &mut self.totals);
        let tolerance = fixed_step(self.job.case).unwrap_or_default();
        let due = self.timetables.due(before, clock, tolerance);
        if due.iter().any(|due| *due) {
            self.write_due(water, clock, due, Some(step))?;
        }
        self.write_probes(water, clock, before, &self.timetables.probes_due(before, clock))?;
        if self.timetables.checkpoint_is_due(before, clock, tolerance) {
            self.checkpoint(water, clock)?;
        }
        Ok(())
    }

    /// Reports the warnings of the observer, each once.
    fn report_warnings(&mut self) {
        if self.files.is_none() {
            return;
        }
        for Warning { about, text } in self.observer.warnings() {
            if !self.warned.contains(&about) {
                self.job.say(format!("warning: at time {} {text}", amounts::time(self.reached.0)));
                self.warned.push(about);
            }
        }
    }

    /// Measures grains and fluid. All ranks take part.
    fn measure(&mut self, water: &mut B::Water, time: Real) {
        self.grains.gather(water.domain(), water.engine());
        self.grains.put_into_tank(water.domain(), self.observer.tank(time));
        self.grains.measure_heap();
        self.observer.measure(&mut self.grains, water, time);
        self.report_warnings();
    }

    /// Writes series, fields, grains and pictures, those that are due.
    fn write_due(
        &mut self,
        water: &mut B::Water,
        clock: &Clock,
        due: [bool; 4],
        step: Option<&DoneStep<'_, B::Water>>,
    ) -> Result<(), RankError> {
        let [series, fields, grains, figures] = due;
        self.measure(water, clock.time());
        let mut outcome = Ok(());
        if series && let Some(files) = &mut self.files {
            let row = Row { clock, step, grains: &self.grains, totals: &self.totals, observer: &self.observer };
            outcome =
                files.row(clock, &series_row(&row, files.parts)).and_then(|()| self.observer.tables(clock, files));
        }
        if series {
            self.observer.note_row(clock.time());
            self.totals.least_stable_step = None;
        }
        if fields {
            let written = self.observer.fields(Output { job: self.job, clock, files: self.files.as_mut() }, water);
            outcome = outcome.and(written);
        }
        if grains {
            let frame = self.observer.written_frame(self.job, clock);
            let [tank, _] = self.observer.tank(clock.time());
            let states = GrainStates::gather(water.domain(), water.engine(), tank, frame);
            if let Some(files) = &mut self.files {
                let own = self.observer.grain_state();
                outcome = outcome.and_then(|()| files.grains(self.job, clock, &states, &own));
            }
        }
        if figures {
            let phase = self.watch.phase();
            self.watch.turn(PICTURES);
            let to = Output { job: self.job, clock, files: self.files.as_mut() };
            let gathered = self.observer.draw(to, water, &self.grains);
            self.watch.turn(phase);
            outcome = outcome.and(gathered);
            self.report_drawing();
        }
        water.domain().agree(outcome.map_err(RankError::from))?;
        Ok(())
    }

    /// Shows grains and water as they are to whoever watches the run. All ranks take part.
    pub fn show(&mut self, water: &mut B::Water, clock: &Clock) {
        let Some(showing) = &self.job.options.showing else { return };
        let of_water = self.observer.water_state(self.job, clock, water);
        let frame = self.observer.written_frame(self.job, clock);
        let [tank, _] = self.observer.tank(clock.time());
        let states = GrainStates::gather(water.domain(), water.engine(), tank, frame);
        if self.files.is_none() {
            return;
        }
        let mut grains = Vec::new();
        if !self.job.case.grains.is_empty() {
            grains = states.arrays_of_state();
            grains.extend(self.observer.grain_state());
        }
        showing.to.see(State { time: clock.time(), step: Some(clock.step()), grains, water: of_water });
    }

    /// Writes a checkpoint of the flow and the summary.
    pub fn checkpoint(&mut self, water: &mut B::Water, clock: &Clock) -> Result<(), RankError> {
        let mut snapshot = water.snapshot();
        self.observer.save(&mut snapshot);
        self.grains.save(&mut snapshot);
        let state = RunState { step: clock.step(), ..RunState::default() };
        self.save(water.domain(), snapshot, clock.time(), state)
    }

    /// Writes a checkpoint of the packing.
    pub fn checkpoint_packing(&mut self, domain: &Domain, packing: &mut Packing) -> Result<(), RankError> {
        let mut snapshot = Snapshot::default();
        packing.snapshot(domain, PACKING, &mut snapshot);
        self.save(domain, snapshot, packing.engine().time(), RunState { packing: true, ..RunState::default() })
    }

    /// Writes a checkpoint of a bed on its way to rest.
    pub fn checkpoint_relaxation(&mut self, domain: &Domain, snapshot: Snapshot, time: Real) -> Result<(), RankError> {
        self.save(domain, snapshot, time, RunState { relaxing: true, ..RunState::default() })
    }

    /// Writes a checkpoint of a tank that is being prepared; `stage` adds how far it has come.
    pub fn checkpoint_preparation(
        &mut self,
        water: &mut B::Water,
        stage: impl FnOnce(&mut Snapshot),
    ) -> Result<(), RankError> {
        let mut snapshot = water.snapshot();
        stage(&mut snapshot);
        self.save(water.domain(), snapshot, 0.0, RunState { preparing: true, ..RunState::default() })
    }

    /// Keeps a tank that was prepared, for later runs.
    pub fn keep_tank(&mut self, water: &mut B::Water) -> Result<(), RankError> {
        let mut snapshot = water.snapshot();
        let deepest = self.totals.worst.packing_overlap_relative;
        snapshot.put_reals(PACKED, vec![deepest, self.totals.corrections.deep_contacts as Real]);
        let outcome = if self.files.is_some() { tanks::keep(self.job, &snapshot) } else { Ok(()) };
        Ok(water.domain().agree(outcome)?)
    }

    /// Counts what the bed of a tank that was kept had while it was packed; tanks of earlier versions do not tell.
    pub fn note_kept(&mut self, tank: &Snapshot) {
        if let Ok([deepest, deep_contacts]) = tank.reals(PACKED) {
            self.totals.worst.packing_overlap_relative = *deepest;
            self.totals.corrections.deep_contacts = *deep_contacts as usize;
        }
    }

    /// Reports a line, on rank 0.
    pub fn say(&self, text: &str) {
        if self.files.is_some() {
            self.job.say(text);
        }
    }

    /// Writes a checkpoint and the summary. `time` is that of the clock that runs, of the flow or of the grains before
    /// it \[s]; `state` holds its phase and step.
    fn save(&mut self, domain: &Domain, mut snapshot: Snapshot, time: Real, state: RunState) -> Result<(), RankError> {
        // A run that goes on from a checkpoint does not draw what was due before it. Whoever stops a run may not wait for pictures.
        if !self.job.stop.is_set() {
            let phase = self.watch.phase();
            self.finish_drawing();
            self.watch.turn(phase);
        }
        self.watch.empty_into(&mut self.totals);
        snapshot.put_reals(CLOCK, vec![time]);
        self.last_checkpoint = Instant::now();
        let outcome = self.write_checkpoint(&snapshot, state);
        domain.agree(outcome.map_err(RankError::from))?;
        Ok(())
    }

    /// Writes a checkpoint and the summary, on rank 0.
    fn write_checkpoint(&mut self, snapshot: &Snapshot, state: RunState) -> Result<(), RecordError> {
        let Some(files) = &self.files else { return Ok(()) };
        let RunState { case_hash, endless_hash, endless_feed_hash, program, sums, history, .. } =
            RunState::of(self.job);
        let known = RunState { case_hash, endless_hash, endless_feed_hash, program, sums, history, ..state };
        let state = RunState { time: self.reached.0, totals: self.totals.clone(), last_row: files.last_row(), ..known };
        let mut writer = CheckpointWriter::new();
        writer.add_snapshot(snapshot)?;
        let hash = writer.content_hash(is_physical);
        writer.add_json(RUN_STATE, &state)?;
        files.checkpoints.write(state.step, &writer)?;
        // Whoever finds it in the summary knows that a checkpoint was written.
        self.state_hash = Some(hash);
        self.write_summary(Status::Running, None)
    }

    /// Measures the end of the flow.
    pub fn end(&mut self, water: &mut B::Water, clock: &Clock) {
        self.reached = (clock.time(), clock.step());
        self.measure(water, clock.time());
    }

    /// Waits for the pictures that are still being drawn.
    fn finish_drawing(&mut self) {
        self.watch.turn(PICTURES);
        if let Some(files) = &mut self.files {
            files.drawing.finish();
        }
        self.report_drawing();
    }

    /// Warns of pictures that could not be drawn.
    fn report_drawing(&self) {
        let failures = self.files.iter().flat_map(|files| files.drawing.failures());
        failures.for_each(|problem| self.job.say(format!("warning: {problem}")));
    }

    /// The run has ended well.
    pub fn close(&mut self, ended: &Ending) -> Result<(), RankError> {
        self.finish_drawing();
        self.watch.empty_into(&mut self.totals);
        if self.files.is_some() {
            self.write_summary(ended.status, None)?;
        }
        Ok(())
    }

    /// The run has failed: says so in the summary, if that can still be written.
    pub fn fail(&mut self, error: RankError) -> Box<RankFailure> {
        self.finish_drawing();
        self.watch.empty_into(&mut self.totals);
        let (time, step) = self.reached;
        let failure = error.failure((step, time, self.limiter));
        if self.job.resumed.is_some() && error.is_at_once() {
            // A wrong command: the run it was to go on with is what it was.
            return RankFailure::new(&error, failure);
        }
        if let Err(problem) = self.write_summary(Status::Failed, Some(&failure)) {
            self.job.say(format!("the summary could not be written: {problem}"));
        }
        RankFailure::new(&error, failure)
    }

    fn write_summary(&mut self, status: Status, failure: Option<&Failure>) -> Result<(), RecordError> {
        let Some(files) = &self.files else { return Ok(()) };
        let present = summary::Present {
            status,
            failure,
            time: self.reached.0,
            steps: self.reached.1,
            totals: &self.totals,
            grains_by_shape: &self.grains.grains_by_shape(self.job.shapes.len()),
            bed: self.grains.found.as_ref(),
            heap: self.grains.heap.as_ref(),
            parts: self.observer.summary_parts(),
            state_hash: self.state_hash,
        };
        summary::write(&self.job.folder, &files.fixed, &present)?;
        Ok(())
    }
}

/// Whether a section of a checkpoint is part of the physical state: all but what the observers keep.
fn is_physical(section: &str) -> bool {
    section == CLOCK || ["fluid/", GRAINS, PACKING, RELAXATION].iter().any(|prefix| section.starts_with(prefix))
}

/// File of the bed that a run into `folder` packs.
pub(crate) fn packed_bed(case: &Case, folder: &Path) -> PathBuf {
    case.output.bed.clone().unwrap_or_else(|| folder.join(PACKED_BED))
}
