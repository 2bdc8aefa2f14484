//! Beds from files, and beds that were levelled, come to rest before the run, without fluid.
//!
//! Where the contact spheres of a bed from a file are not those they were packed with they overlap, and would fly apart: they part
//! slowly first.

use sazanami_dem::{ContactReport, DemError, Engine, Loads, Setup, Substeps};
use sazanami_numerics::domain::Domain;
use sazanami_numerics::snapshot::Snapshot;
use sazanami_numerics::{Real, Vector};
use sazanami_posing::assembly::grains;

use super::signals;
use crate::job::{Job, RELAXATION, RankError};
use crate::progress::StepLine;
use crate::recorder::{Observer, Recorder};

/// Step of a relaxation \[s].
const STEP: Real = 2e-5;
/// A bed relaxes for as long as Yagyu et al. (2015) let theirs settle, at least \[s].
const LEAST: Real = 5e-3;
/// Longest relaxation \[s].
const LONGEST: Real = 0.5;
/// Grains that overlap part no faster than this [m/s].
const PARTING_SPEED: Real = 0.05;
/// Part of the speed of parting grains that a sub-step leaves.
const PARTING_DAMPING: Real = 0.98;
/// They have parted when no overlap is deeper than this, over a contact sphere's radius.
const PARTED: Real = 0.05;
/// Mean speed of a bed at rest [m/s].
const AT_REST: Real = 2e-3;

/// A bed on its way to rest.
#[derive(Debug)]
pub(crate) struct Relaxation {
    engine: Engine,
    /// Whether overlapping grains still part.
    parting: bool,
    /// When they had parted \[s].
    parted: Real,
}

impl Relaxation {
    /// Begins with grains as they lie, on a clock that begins at 0.
    pub fn new(mut engine: Engine) -> Self {
        engine.allow_any_overlap(true);
        // The bed is taken up anew, each grain by the rank in whose part it lies.
        engine.own_promptly(true);
        Self { engine, parting: true, parted: 0.0 }
    }

    /// Goes on from a snapshot.
    pub fn restore(domain: &Domain, setup: Setup, snapshot: &Snapshot) -> Result<Self, RankError> {
        let state = snapshot.reals_of(&format!("{RELAXATION}state"), 2)?;
        let (parting, parted) = (state[0] > 0.0, state[1]);
        let mut engine = Engine::restore(domain, setup, RELAXATION, snapshot)?;
        engine.allow_any_overlap(parting);
        engine.own_promptly(true);
        Ok(Self { engine, parting, parted })
    }

    /// The state as a checkpoint keeps it. All ranks take part.
    pub fn snapshot(&mut self, domain: &Domain) -> Snapshot {
        let mut snapshot = Snapshot::default();
        self.engine.snapshot(domain, RELAXATION, &mut snapshot);
        snapshot.put_reals(format!("{RELAXATION}state"), vec![Real::from(u8::from(self.parting)), self.parted]);
        snapshot
    }

    /// Time since the beginning \[s].
    pub fn time(&self) -> Real {
        self.engine.time()
    }

    /// Goes on by a step under `gravity` [m/s^2].
    fn step(&mut self, domain: &Domain, gravity: Vector) -> Result<ContactReport, DemError> {
        if !self.parting {
            return self.engine.advance(domain, &Loads::none(), gravity, STEP, Substeps::Auto);
        }
        let report = self.part(domain, gravity)?;
        self.parting = report.largest_overlap > PARTED;
        self.parted = self.engine.time();
        self.engine.allow_any_overlap(self.parting);
        Ok(report)
    }

    /// A step with limited and damped speeds.
    fn part(&mut self, domain: &Domain, gravity: Vector) -> Result<ContactReport, DemError> {
        let count = self.engine.substeps(domain, STEP, Substeps::Auto);
        let mut report = ContactReport::default();
        for _ in 0..count {
            report = self.engine.advance(domain, &Loads::none(), gravity, STEP / count as Real, Substeps::Fixed(1))?;
            self.engine.limit_speeds(domain, PARTING_SPEED, PARTING_DAMPING);
        }
        Ok(ContactReport { substeps: count, ..report })
    }

    /// Mean speed of the grains [m/s].
    fn mean_speed(&self, domain: &Domain) -> Real {
        let grains = self.engine.grains();
        let speeds: Real = (0..grains.owned()).map(|n| grains.velocity[n].length()).sum();
        let [speeds, count] = domain.sum([speeds, grains.owned() as Real]);
        speeds / count.max(1.0)
    }
}

/// Lets the grains come to rest; `None` if the run is stopped before.
pub(super) fn relax<B: Observer>(
    job: &Job,
    domain: &Domain,
    mut relaxation: Relaxation,
    recorder: &mut Recorder<B>,
) -> Result<Option<Engine>, RankError> {
    let gravity = job.case.resting_gravity();
    relaxation.engine = grains::expecting(job.case, relaxation.engine);
    loop {
        let [stop, checkpoint, _] = signals(domain, job, recorder);
        let (time, mean_speed) = (relaxation.time(), relaxation.mean_speed(domain));
        let at_rest = !relaxation.parting && time - relaxation.parted >= LEAST && mean_speed < AT_REST;
        if stop || checkpoint || at_rest {
            recorder.checkpoint_relaxation(domain, relaxation.snapshot(domain), relaxation.time())?;
        }
        if stop {
            return Ok(None);
        }
        if at_rest {
            relaxation.engine.own_promptly(false);
            return Ok(Some(relaxation.engine));
        }
        if time > LONGEST {
            let help = if job.case.levels() {
                "give its contacts more damping (`restitution`) or friction"
            } else {
                "look at what its grains touch: contacts much stiffer or softer than those it was packed with?"
            };
            return Err(RankError::NotAtRest { time, mean_speed, help });
        }
        let step = (time / STEP).round() as u64 + 1;
        let report = relaxation
            .step(domain, gravity)
            .map_err(|error| RankError::packing_step(job.case, relaxation.engine.walls(), error, step, time))?;
        recorder.report(&StepLine {
            phase: "relax",
            step,
            time: relaxation.time(),
            until: LONGEST,
            dt: STEP,
            limiter: if relaxation.parting { "parting" } else { "settling" },
            substeps: report.substeps,
            contacts: report.contacts,
            ..StepLine::default()
        });
    }
}
