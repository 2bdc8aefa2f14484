//! A run on one rank: packing or relaxation of a bed, then flow, step by step, until it ends. No physics, no files.

mod feeding;
mod held_flow;
mod preparation;
mod relaxation;
mod releases;
mod start;

use std::time::Instant;

use sazanami_dem::{Packing, Stage};
use sazanami_numerics::Real;
use sazanami_numerics::domain::Domain;
use sazanami_parallel::{Communicator, Reduction};
use sazanami_posing::assembly::grains::named;
use sazanami_posing::assembly::shared;
use sazanami_posing::steps::{OUTPUT, SWING, fixed_step, longest_in_swing};

use self::feeding::Feeding;
use self::held_flow::HeldFlow;
use self::releases::Releases;
use crate::case::Case;
use crate::case::meaning::{ProbePlace, Solver};
use crate::clock::Clock;
use crate::job::{Ending, Job, RankError, RankFailure, Status};
use crate::progress::StepLine;
use crate::recorder::{DoneStep, GridObserver, Observer, ParticleObserver, Recorder};
use crate::state::Due;
use crate::water::Water;

/// What shortens a step that ends where grains are let go or fed in, or a gate opens.
const RELEASE: &str = "release";

/// Runs `job` on one rank of a group.
pub(crate) fn run_rank(communicator: Box<dyn Communicator>, job: &Job) -> Result<Ending, Box<RankFailure>> {
    let domain = shared::domain(job.case, communicator)?;
    match job.case.solver {
        Solver::Mics => recorded::<GridObserver>(job, domain, |domain, packed, recorder| {
            start::solver(job, domain, packed, recorder)
        }),
        Solver::Mps => recorded::<ParticleObserver>(job, domain, |domain, packed, recorder| {
            preparation::solver(job, domain, packed, recorder)
        }),
    }
}

/// Constructor of a run's solver: from a packed bed, if it packs one; `None` if the run is stopped before.
trait Begin<B: Observer>: FnOnce(Domain, Option<Packing>, &mut Recorder<B>) -> Result<Option<B::Water>, RankError> {}

impl<B, F> Begin<B> for F
where
    B: Observer,
    F: FnOnce(Domain, Option<Packing>, &mut Recorder<B>) -> Result<Option<B::Water>, RankError>,
{
}

/// Runs `job` with a recorder from beginning to end.
fn recorded<B: Observer>(job: &Job, domain: Domain, begin: impl Begin<B>) -> Result<Ending, Box<RankFailure>> {
    let recorder = Recorder::<B>::open(job, domain.communicator().rank() == 0);
    let mut recorder = domain.agree(recorder)?;
    let outcome = stages(job, domain, &mut recorder, begin);
    let outcome = outcome.and_then(|ended| recorder.close(&ended).map(|()| ended));
    outcome.map_err(|error| recorder.fail(error))
}

fn stages<B: Observer>(
    job: &Job,
    domain: Domain,
    recorder: &mut Recorder<B>,
    begin: impl Begin<B>,
) -> Result<Ending, RankError> {
    let stopped = Ending { status: Status::Stopped, interrupted: true, time: 0.0, steps: 0 };
    let packed = match &job.resumed {
        Some(state) if !state.run.packing => None,
        _ if preparation::is_ready(job) => None,
        _ => match start::packing(job, &domain)? {
            Some(packing) => match pack(job, &domain, packing, recorder)? {
                Some(packing) => Some(packing),
                None => return Ok(stopped),
            },
            None => None,
        },
    };
    if job.case.run.packing_only {
        return Ok(Ending { status: Status::Finished, interrupted: false, time: 0.0, steps: 0 });
    }
    match begin(domain, packed, recorder)? {
        Some(water) => flow(job, water, recorder),
        None => Ok(stopped),
    }
}

/// Signals from outside that one rank knows of, agreed with all: stop, and write a checkpoint.
fn signals<B: Observer>(domain: &Domain, job: &Job, recorder: &Recorder<B>) -> [bool; 3] {
    let [checkpoint, rest] = [recorder.wants_checkpoint(), recorder.waits_no_longer()].map(u8::from);
    let mut values = [job.stop.number(), checkpoint, rest].map(Real::from);
    domain.communicator().all_reduce(&mut values, Reduction::Max);
    // A signal may reach one process of many.
    job.stop.heard(values[0] as u8);
    values.map(|value| value > 0.0)
}

/// Packs the bed; `None` if the run is stopped before.
fn pack<B: Observer>(
    job: &Job,
    domain: &Domain,
    mut packing: Packing,
    recorder: &mut Recorder<B>,
) -> Result<Option<Packing>, RankError> {
    let start = Instant::now();
    let began = packing.engine().time();
    let until = job.packing_time.unwrap_or(packing.settings().longest);
    loop {
        let [stop, checkpoint, _] = signals(domain, job, recorder);
        if stop || checkpoint {
            recorder.checkpoint_packing(domain, &mut packing)?;
        }
        if stop {
            return Ok(None);
        }
        let (time, length) = (packing.engine().time(), packing.settings().step);
        let step = (time / length).round() as u64 + 1;
        let report = packing
            .step(domain)
            .map_err(|error| RankError::packing_step(job.case, packing.engine().walls(), error, step, time))?;
        recorder.observe_packing(packing.engine(), &report);
        let limiter = match report.stage {
            Stage::Falling => "falling",
            Stage::Settling => "settling",
            Stage::Done | Stage::GivenUp => "done",
        };
        recorder.report(&StepLine {
            phase: "packing",
            step: (report.time / packing.settings().step).round() as u64,
            time: report.time,
            until,
            dt: packing.settings().step,
            limiter,
            substeps: report.contacts.substeps,
            contacts: report.contacts.contacts,
            ..StepLine::default()
        });
        match report.stage {
            Stage::Done => {
                recorder.packed(domain, &packing, &report, start.elapsed().as_secs_f64(), began)?;
                recorder.checkpoint_packing(domain, &mut packing)?;
                return Ok(Some(packing));
            }
            Stage::GivenUp => {
                let help = "raise `time_limit` of the packing, or take it as it then lies with `stop = \"time_only\"`";
                return Err(RankError::NotAtRest { time: report.time, mean_speed: report.mean_speed, help });
            }
            Stage::Falling | Stage::Settling => {}
        }
    }
}

/// Identifiers of the grains that probes watch.
fn probed(case: &Case) -> impl Iterator<Item = u64> {
    case.probes.iter().filter_map(|probe| match &probe.place {
        ProbePlace::Body { population, index } => Some(named(case, population, *index)),
        _ => None,
    })
}

/// Steps through the flow.
fn flow<B: Observer>(job: &Job, mut water: B::Water, recorder: &mut Recorder<B>) -> Result<Ending, RankError> {
    let case = job.case;
    let mut clock = start::clock(job);
    let first = clock.step();
    water.put(clock.time());
    water.watch_contacts(probed(case));
    recorder.watch.turn(OUTPUT);
    recorder.begin(&mut water, &clock)?;
    let mut shown = job.options.showing.as_ref().map(|showing| Due::new(showing.every, first, clock.time()));
    if shown.as_mut().is_some_and(|due| due.note(first)) {
        recorder.show(&mut water, &clock);
    }
    let enough = |clock: &Clock| {
        job.options.steps.is_some_and(|steps| clock.step() >= first + steps)
            || case.run.steps.is_some_and(|steps| clock.step() >= steps as u64)
            || job.options.until.is_some_and(|until| clock.has_reached(until))
    };
    let mut releases = Releases::of(case, clock.time());
    let mut feeding = Feeding::of(case, &water);
    let mut held_flow = HeldFlow::of(case);
    let swing = longest_in_swing(case).filter(|_| fixed_step(case).is_none());
    loop {
        let [stop, checkpoint, at_rest] = signals(water.domain(), job, recorder);
        let finished = at_rest || clock.has_reached(case.run.until);
        if at_rest && !clock.has_reached(case.run.until) {
            recorder.end_at_rest(&mut water, &clock)?;
        }
        let stopped = enough(&clock);
        if checkpoint || stop || finished || stopped {
            recorder.checkpoint(&mut water, &clock)?;
        }
        if finished || stopped || stop {
            if shown.as_mut().is_some_and(|due| due.note(clock.step())) {
                recorder.show(&mut water, &clock);
            }
            if let Some(waiting) = feeding.waiting(clock.time()).filter(|_| finished || stopped) {
                recorder.say(&waiting);
            }
            let status = if finished { Status::Finished } else { Status::Stopped };
            let interrupted = stop && !finished && !stopped;
            recorder.end(&mut water, &clock);
            return Ok(Ending { status, interrupted, time: clock.time(), steps: clock.step() });
        }
        releases.let_go(job, &mut water, clock.time())?;
        feeding.feed(case, &mut water, clock.time(), clock.step())?;
        let output = recorder.next_due(case, clock.time());
        let due = releases.next(output).into_iter().chain(feeding.next(clock.time())).reduce(Real::min);
        let next = water.stable_step(case, clock.time());
        let stable @ (longest, ruling) = match (B::Water::length(next), swing) {
            ((stable, _), Some(swing)) if swing < stable => (swing, SWING),
            (length, _) => length,
        };
        let dt = clock.next_step(longest, due);
        let limit = match dt < longest {
            true if due == output => OUTPUT,
            true => RELEASE,
            false => ruling,
        };
        recorder.watch.turn(OUTPUT);
        let (step, time) = (clock.step() + 1, clock.time());
        let mut after = clock;
        after.advance(dt, due);
        recorder.before_step(&mut water, &clock, &after);
        let report = water
            .advance(case, time, next, dt, |phase| recorder.watch.turn(phase))
            .and_then(|report| held_flow.watch(dt, B::Water::mean_flow(&report)).map(|()| report))
            .map_err(|problem| RankError::Step { problem, step, time, limit })?;
        recorder.watch.turn(OUTPUT);
        clock = after;
        water.put(clock.time());
        recorder.observe(&mut water, &clock, time, &DoneStep { dt, limit, stable, report: &report })?;
        if shown.as_mut().is_some_and(|due| due.is_due(clock.step(), time, clock.time())) {
            recorder.show(&mut water, &clock);
        }
        let last_step =
            job.options.steps.map(|steps| first + steps).into_iter().chain(case.run.steps.map(|n| n as u64));
        let by_steps = last_step.map(|last| clock.time() + dt * last.saturating_sub(clock.step()) as Real);
        let until = by_steps.chain(job.options.until).fold(case.run.until, Real::min);
        let contacts = B::Water::contacts(&report);
        recorder.report(&StepLine {
            phase: "flow",
            step: clock.step(),
            time: clock.time(),
            until,
            dt,
            limiter: limit,
            pressure_iterations: B::Water::pressure_iterations(&report),
            substeps: contacts.substeps,
            contacts: contacts.contacts,
            ..StepLine::default()
        });
    }
}
