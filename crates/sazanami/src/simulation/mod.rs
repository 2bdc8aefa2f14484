//! A run on one rank: packing, then flow, step by step, until it ends. No physics, no files.

mod job;
mod naming;
mod start;

use std::time::Instant;

use sazanami_dem::{Packing, Stage};
use sazanami_mics::solver::{Phase, Solver};
use sazanami_mics::stability::Limit;
use sazanami_numerics::Real;
use sazanami_numerics::domain::Domain;
use sazanami_parallel::{Communicator, Reduction};

use crate::case::meaning::Case;
use crate::clock::Clock;
use crate::progress::StepLine;
use crate::recorder::Recorder;
use crate::run::Status;

pub(crate) use job::{Ended, Event, Job, RankError, RankFailure, Reporter, Resumed, RunState};
pub(crate) use naming::partner;

/// Prefix of what a packing writes into a snapshot.
pub(crate) const PACKING: &str = "packing/";
/// A run ends when this part of its time is left.
const END: Real = 1e-12;

/// Runs `job` on one rank of a group.
pub(crate) fn run_rank(communicator: Box<dyn Communicator>, job: &Job) -> Result<Ended, Box<RankFailure>> {
    let grid = job.case.domain.grid();
    let periodic = crate::assembly::fluid::boundary(job.case)?.periodic();
    let domain = Domain::new(grid, periodic, communicator)?;
    let recorder = Recorder::open(job, domain.communicator().rank() == 0);
    let mut recorder = domain.agree(recorder)?;
    let outcome = stages(job, domain, &mut recorder).and_then(|ended| recorder.close(&ended).map(|()| ended));
    outcome.map_err(|error| recorder.fail(error))
}

fn stages(job: &Job, domain: Domain, recorder: &mut Recorder) -> Result<Ended, RankError> {
    let resumed = job.resumed.as_ref();
    let packed = match resumed {
        Some(state) if !state.run.packing => None,
        _ => match start::packing(job, &domain)? {
            Some(packing) => match pack(job, &domain, packing, recorder)? {
                Ok(packing) => Some(packing),
                Err(ended) => return Ok(ended),
            },
            None => None,
        },
    };
    if job.case.run.packing_only {
        return Ok(Ended { status: Status::Finished, interrupted: false, time: 0.0, steps: 0 });
    }
    let Some(solver) = start::solver(job, domain, packed, recorder)? else {
        return Ok(Ended { status: Status::Stopped, interrupted: true, time: 0.0, steps: 0 });
    };
    flow(job, solver, recorder)
}

/// What one rank knows of the outside, agreed with all: stop, and write a checkpoint.
fn signals(domain: &Domain, job: &Job, recorder: &Recorder) -> [bool; 2] {
    let flag = |set: bool| Real::from(u8::from(set));
    let mut values = [flag(job.is_stopped()), flag(recorder.wants_checkpoint())];
    domain.communicator().all_reduce(&mut values, Reduction::Max);
    values.map(|value| value > 0.0)
}

/// Packs the bed; ends early if the run is stopped.
fn pack(
    job: &Job,
    domain: &Domain,
    mut packing: Packing,
    recorder: &mut Recorder,
) -> Result<Result<Packing, Ended>, RankError> {
    let start = Instant::now();
    let began = packing.engine().time();
    let longest = packing.settings().longest;
    loop {
        let [stop, checkpoint] = signals(domain, job, recorder);
        if stop || checkpoint {
            recorder.checkpoint_packing(domain, &mut packing)?;
        }
        if stop {
            return Ok(Err(Ended { status: Status::Stopped, interrupted: true, time: 0.0, steps: 0 }));
        }
        let (time, length) = (packing.engine().time(), packing.settings().step);
        let step = (time / length).round() as u64 + 1;
        let report = packing.step(domain).map_err(|error| {
            let message = naming::grain_error(job.case, packing.engine().walls(), &error);
            RankError::PackingStep { error, message, step, time }
        })?;
        recorder.observe_packing(packing.engine(), &report);
        let limiter = match report.stage {
            Stage::Falling => "falling",
            Stage::Settling => "settling",
            Stage::Tapping => "tapping",
            Stage::Done | Stage::GivenUp => "done",
        };
        recorder.report(&StepLine {
            phase: "packing",
            step: (report.time / packing.settings().step).round() as u64,
            time: report.time,
            until: longest,
            dt: packing.settings().step,
            limiter,
            substeps: report.contacts.substeps,
            contacts: report.contacts.contacts,
            ..StepLine::default()
        });
        match report.stage {
            Stage::Done => {
                recorder.packed(domain, &packing, &report, start.elapsed().as_secs_f64(), began)?;
                return Ok(Ok(packing));
            }
            Stage::GivenUp => {
                return Err(RankError::NotAtRest { time: report.time, mean_speed: report.mean_speed });
            }
            Stage::Falling | Stage::Settling | Stage::Tapping => {}
        }
    }
}

/// Steps through the flow.
fn flow(job: &Job, mut solver: Solver, recorder: &mut Recorder) -> Result<Ended, RankError> {
    let case = job.case;
    let mut clock = start::clock(job);
    let first = clock.step();
    recorder.watch.enter(None);
    recorder.begin(&mut solver, &clock)?;
    let end = |clock: &Clock| clock.time() >= case.run.until * (1.0 - END);
    let enough = |clock: &Clock| {
        job.options.steps.is_some_and(|steps| clock.step() >= first + steps)
            || case.run.steps.is_some_and(|steps| clock.step() >= steps as u64)
            || job.options.until.is_some_and(|until| clock.time() >= until * (1.0 - END))
    };
    loop {
        let [stop, checkpoint] = signals(solver.domain(), job, recorder);
        let finished = end(&clock);
        let stopped = enough(&clock);
        if checkpoint || stop || finished || stopped {
            recorder.checkpoint(&mut solver, &clock)?;
        }
        if finished || stopped || stop {
            let status = if finished { Status::Finished } else { Status::Stopped };
            let interrupted = stop && !finished && !stopped;
            recorder.end(&mut solver, &clock);
            return Ok(Ended { status, interrupted, time: clock.time(), steps: clock.step() });
        }
        let due = recorder.next_due(case, clock.time());
        let stable = solver.stable_step();
        let dt = clock.next_step(stable.dt, due);
        let limit = if dt < stable.dt { Limit::Output } else { stable.limit };
        if case.frame.is_some() {
            solver.set_gravity(case.effective_gravity(clock.time() + 0.5 * dt));
        }
        recorder.watch.enter(None);
        let (step, time) = (clock.step() + 1, clock.time());
        let report = solver.step(stable, dt, |phase| recorder.watch.enter(Some(phase))).map_err(|error| {
            let message = naming::step_error(case, solver.grains().engine().walls(), &error);
            RankError::Step { error: Box::new(error), message, step, time, limit }
        })?;
        recorder.watch.enter(None);
        let before = clock.time();
        clock.advance(dt, due);
        recorder.observe(&mut solver, &clock, before, dt, limit, &report)?;
        let until = job.options.until.map_or(case.run.until, |until| until.min(case.run.until));
        let remaining = recorder.remaining(&clock, until);
        recorder.report(&StepLine {
            phase: "flow",
            step: clock.step(),
            time: clock.time(),
            until: case.run.until,
            dt,
            limiter: limit.name(),
            pressure_iterations: report.pressure.iterations,
            substeps: report.contacts.substeps,
            contacts: report.contacts.contacts,
            remaining,
        });
    }
}

/// Names of the phases of a step in results.
pub(crate) fn phase_name(phase: Option<Phase>) -> &'static str {
    match phase {
        Some(Phase::Fluid) => "fluid",
        Some(Phase::Pressure) => "pressure",
        Some(Phase::Grains) => "grains",
        Some(Phase::Coupling) => "coupling",
        None => "output",
    }
}

/// A fixed step length of the case, if it has one [s].
pub(crate) fn fixed_step(case: &Case) -> Option<Real> {
    match case.fluid.step {
        crate::case::meaning::Step::Fixed(dt) => Some(dt),
        crate::case::meaning::Step::Adaptive { .. } => None,
    }
}
