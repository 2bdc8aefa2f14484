//! A bed in water before its run: the packed bed is levelled, the water poured between its grains and left to come to
//! rest, and the grains let go. What comes of it is kept, and found again by what it was made of.

use sazanami_dem::{Engine, Packing};
use sazanami_mps::grains::OverlappingGrains;
use sazanami_mps::snapshot::GRAINS;
use sazanami_mps::solver::{Forcing, Solver, StepReport};
use sazanami_numerics::domain::Domain;
use sazanami_numerics::snapshot::Snapshot;
use sazanami_numerics::{Real, Vector};
use sazanami_posing::assembly::{grains, particles, wetted};

use super::{signals, start};
use crate::case::meaning::{Case, FluidName, Preparation, RELAX_STEPS};
use crate::clock::END;
use crate::job::{Job, RankError, StateError};
use crate::progress::StepLine;
use crate::recorder::{Observer, ParticleObserver, Recorder};
use crate::water::{self, StepProblem, Water, mps};

/// Section of a checkpoint with the [`Stage`] of a preparation.
const STAGE: &str = "preparation/stage";

/// Strain and speed of water that is far from rest, over those of water at rest.
const FAR: Real = 5.0;

/// Progress of a preparation.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Stage {
    /// Water comes to rest between grains that are held; steps done.
    Relaxing(usize),
    /// Grains are free in water at rest; time done \[s].
    Settling(Real),
    /// The motion may begin.
    Ready,
}

impl Stage {
    fn save(self, snapshot: &mut Snapshot) {
        let values = match self {
            Self::Relaxing(steps) => [0.0, steps as Real],
            Self::Settling(time) => [1.0, time],
            Self::Ready => [2.0, 0.0],
        };
        snapshot.put_reals(STAGE, values.to_vec());
    }

    fn of(snapshot: &Snapshot) -> Result<Self, RankError> {
        let values = snapshot.reals_of(STAGE, 2)?;
        Ok(match values[0] as u8 {
            0 => Self::Relaxing(values[1] as usize),
            1 => Self::Settling(values[1]),
            _ => Self::Ready,
        })
    }
}

/// Whether the tank was prepared by an earlier run, so that nothing has to be packed.
pub(super) fn is_ready(job: &Job) -> bool {
    job.prepared.is_some()
}

/// The solver, from the case and a packed bed, from a state prepared before or from a checkpoint; `None` if the run
/// is stopped before.
pub(super) fn solver(
    job: &Job,
    domain: Domain,
    packed: Option<Packing>,
    recorder: &mut Recorder<ParticleObserver>,
) -> Result<Option<Solver>, RankError> {
    let resumed = job.resumed.as_ref();
    let (mut solver, stage) = if let Some(state) = resumed.filter(|state| state.run.flows()) {
        let mut solver = restored(job, domain, &state.snapshot)?;
        hold_mean_flow(job.case, &mut solver, Some(&state.snapshot))?;
        return Ok(Some(solver));
    } else if let Some(state) = resumed.filter(|state| state.run.preparing) {
        (restored(job, domain, &state.snapshot)?, Stage::of(&state.snapshot)?)
    } else if let Some(prepared) = &job.prepared {
        recorder.note_kept(prepared);
        (restored(job, domain, prepared)?, Stage::Ready)
    } else {
        match poured(job, domain, packed, recorder)? {
            Some(solver) => (solver, first_stage(job.case)),
            None => return Ok(None),
        }
    };
    if stage != Stage::Ready {
        if !make_ready(job, &mut solver, stage, recorder)? {
            return Ok(None);
        }
        recorder.keep_tank(&mut solver)?;
    }
    particles::set_off(job.case, &mut solver);
    hold_mean_flow(job.case, &mut solver, None)?;
    Ok(Some(solver))
}

/// Lets the solver hold the mean velocity of the case, if it has one.
fn hold_mean_flow(case: &Case, solver: &mut Solver, resumed: Option<&Snapshot>) -> Result<(), RankError> {
    if let Some(flow) = water::mean_flow(case, resumed)? {
        solver.hold_mean_flow(flow);
    }
    Ok(())
}

fn first_stage(case: &Case) -> Stage {
    let preparation = &case.preparation;
    match () {
        () if preparation.relax_steps > 0 => Stage::Relaxing(0),
        () if preparation.settle > 0.0 => Stage::Settling(0.0),
        () => Stage::Ready,
    }
}

/// Takes solver and grains from a snapshot.
fn restored(job: &Job, domain: Domain, snapshot: &Snapshot) -> Result<Solver, RankError> {
    let case = job.case;
    let setup = particles::setup(case, &job.shapes);
    let engine = Engine::restore(&domain, setup, GRAINS, snapshot).map_err(StateError::Grains)?;
    let engine = grains::expecting(case, engine);
    let grains = OverlappingGrains::new(&domain, engine, particles::coupling(case));
    let settings = particles::settings(case, particles::level(case, case.domain.lower.z));
    let solver = Solver::restore(domain, settings, case.tank(), grains, snapshot);
    Ok(solver.map_err(StateError::Restore)?)
}

/// Grains where they lie, and water between and above them.
fn poured(
    job: &Job,
    domain: Domain,
    packed: Option<Packing>,
    recorder: &mut Recorder<ParticleObserver>,
) -> Result<Option<Solver>, RankError> {
    let case = job.case;
    let setup = particles::setup(case, &job.shapes);
    let engine = match packed {
        Some(packing) => {
            let mut engine = start::levelled(case, &domain, setup, packing)?;
            engine.insert(&domain, &grains::waiting(case, &job.shapes, &job.beds))?;
            engine
        }
        None => match start::laid(job, &domain, setup, recorder)? {
            Some(engine) => engine,
            None => return Ok(None),
        },
    };
    let engine = grains::expecting(case, engine);
    start::within_box(job, &domain, &engine)?;
    start::clear_of_gates(job, &domain, &engine)?;
    let bed_height = recorder.measure_bed(&domain, &engine);
    start::liquids_fit(job, bed_height)?;
    let grains = particles::overlapping_grains(case, &domain, engine);
    let particles::Poured { particles: fluid, asked } = particles::fill(case, &domain, &grains, bed_height);
    if case.has_liquid() {
        recorder.say(&format!("poured {} particles of water", fluid.len()));
    }
    let off = fluid.len() as Real - asked;
    if off.abs() > particles::OFF * asked {
        recorder.say(&format!(
            "warning: {:.1} particles of water were asked for: the volume poured is {:.0} % off; finer particles come nearer",
            asked,
            1e2 * off.abs() / asked
        ));
    }
    let as_put = case.liquids.iter().enumerate().any(|(n, liquid)| {
        liquid.fluid == FluidName::Liquid
            && (case.sets_in_motion(liquid) || wetted::hangs(case, n, bed_height, bed_height))
    });
    if !fluid.is_empty() && !case.grains.is_empty() && case.preparation.relax_steps == 0 && !as_put {
        recorder.say(&format!(
            "the water starts as it was poured between the grains: with `preparation.relax_steps = {RELAX_STEPS}` it comes to \
             rest first, the grains held"
        ));
    }
    Ok(Some(particles::solver(case, domain, &fluid, grains, bed_height)?))
}

/// Lets water and grains come to rest; returns whether they did, or the run was stopped before.
fn make_ready(
    job: &Job,
    solver: &mut Solver,
    mut stage: Stage,
    recorder: &mut Recorder<ParticleObserver>,
) -> Result<bool, RankError> {
    let case = job.case;
    let how = &case.preparation;
    // Along periodic sides nothing bears water at rest: its fall begins with the run.
    let periodic = case.periodic().map(|periodic| if periodic { 0.0 } else { 1.0 });
    let gravity = case.resting_gravity() * Vector::from_array(periodic);
    let forcing = Forcing { body_force: gravity, ..Forcing::default() };
    let mut steps = 0;
    loop {
        let [stop, checkpoint, _] = signals(Water::domain(solver), job, recorder);
        if stop || checkpoint {
            recorder.checkpoint_preparation(solver, |snapshot| stage.save(snapshot))?;
        }
        if stop {
            return Ok(false);
        }
        solver.grains_mut().freeze(matches!(stage, Stage::Relaxing(_)));
        let stable = Solver::stable_step(solver, gravity);
        let (name, dt, done, until) = match stage {
            // In steps as long as this one.
            Stage::Relaxing(done) => {
                ("relax", stable.dt, done as Real * stable.dt, how.relax_steps as Real * stable.dt)
            }
            Stage::Settling(done) => ("settle", stable.dt.min(how.settle - done), done, how.settle),
            Stage::Ready => return Ok(true),
        };
        steps += 1;
        let report = solver
            .step(dt, &forcing, |_| ())
            .map_err(|error| not_prepared(mps::problem(case, solver, &error), steps, done))?;
        recorder.report(&StepLine {
            phase: name,
            step: steps,
            time: done,
            until,
            dt,
            limiter: stable.limit.name(),
            pressure_iterations: report.pressure.iterations,
            substeps: report.contacts.substeps,
            contacts: report.contacts.contacts,
            ..StepLine::default()
        });
        stage = next(how, solver, stage, dt, &report, recorder)?;
    }
}

fn not_prepared(problem: StepProblem, step: u64, time: Real) -> RankError {
    RankError::Step { problem, step, time, limit: "preparation" }
}

/// The stage after a step.
///
/// # Errors
/// If the water is still far from rest when it should have come to it.
fn next<B: Observer>(
    how: &Preparation,
    solver: &mut Solver,
    stage: Stage,
    dt: Real,
    report: &StepReport,
    recorder: &Recorder<B>,
) -> Result<Stage, RankError> {
    let after_rest = |solver: &mut Solver| {
        solver.set_velocities(|_, _| Vector::ZERO);
        solver.grains_mut().freeze(false);
        if how.settle > 0.0 { Stage::Settling(0.0) } else { Stage::Ready }
    };
    Ok(match stage {
        Stage::Relaxing(done) => {
            let done = done + 1;
            // Spray falls whatever the rest of the water does.
            let speed = solver.largest_speed_together();
            let state = || {
                format!(
                    "after {done} steps with the grains held: volume strain {:.2} % (root mean square), largest speed \
                     {:.2} mm/s",
                    1e2 * report.strain[1],
                    1e3 * speed
                )
            };
            let at_rest = report.strain[1] < how.strain && speed < how.speed;
            if at_rest && done > 1 {
                recorder.say(&format!("the water is at rest {}", state()));
                return Ok(after_rest(solver));
            }
            if done >= how.relax_steps {
                let far = report.strain[1] > FAR * how.strain || speed > FAR * how.speed;
                if far && how.must_rest {
                    return Err(RankError::WaterNotAtRest { state: state(), steps: done as u64 });
                }
                recorder.say(&format!(
                    "warning: the water is not at rest {}; asked for {:.2} % and {:.2} mm/s",
                    state(),
                    1e2 * how.strain,
                    1e3 * how.speed
                ));
                return Ok(after_rest(solver));
            }
            solver.set_velocities(|particles, a| how.damping * particles.velocity[a]);
            Stage::Relaxing(done)
        }
        Stage::Settling(done) if done + dt >= how.settle * (1.0 - END) => Stage::Ready,
        Stage::Settling(done) => Stage::Settling(done + dt),
        Stage::Ready => Stage::Ready,
    })
}
