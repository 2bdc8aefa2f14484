//! Start of a run: from the case, from a packed bed, or from a checkpoint.

use std::sync::Arc;

use sazanami_dem::{Body, Engine, Grain, Motion, Packing, Setup};
use sazanami_mics::snapshot::GRAINS;
use sazanami_mics::solver::Solver;
use sazanami_numerics::domain::Domain;
use sazanami_numerics::geometry::Region;
use sazanami_numerics::snapshot::Snapshot;
use sazanami_numerics::{Real, Vector};
use sazanami_posing::assembly::{fluid, grains, particles};
use sazanami_posing::steps::fixed_step;

use super::relaxation::{Relaxation, relax};
use crate::case::meaning::{self, Case, FluidName, GrainPlacement, Placement};
use crate::clock::Clock;
use crate::job::{Job, PACKING, RankError};
use crate::naming::partner;
use crate::recorder::{Observer, Recorder};
use crate::water::mean_flow;

/// Part of its size by which a grain may overlap a gate: round-off.
const TOUCH: Real = 1e-9;

/// The bed to be packed, new or from a checkpoint; `None` if the case packs none.
pub(super) fn packing(job: &Job, domain: &Domain) -> Result<Option<Packing>, RankError> {
    let Some((settings, to_pack)) = grains::to_pack(job.case) else { return Ok(None) };
    let bodies: Vec<Body> = match job.case.solver {
        meaning::Solver::Mics => job.shapes.iter().map(Body::from).collect(),
        meaning::Solver::Mps => particles::bodies(job.case),
    };
    let laws = grains::interactions(job.case);
    let mut packing = match &job.resumed {
        Some(state) => Packing::restore(domain, settings, bodies, laws, &to_pack, PACKING, &state.snapshot)?,
        None => Packing::new(domain, settings, bodies, laws, to_pack)?,
    };
    // These beds are taken up anew, each grain by the rank in whose part it lies.
    if job.case.levels() || job.case.solver == meaning::Solver::Mps {
        packing.own_promptly();
    }
    Ok(Some(packing))
}

/// The clock of the flow.
pub(super) fn clock(job: &Job) -> Clock {
    let clock = Clock::new(fixed_step(job.case));
    match &job.resumed {
        Some(state) if state.run.flows() => clock.at(state.run.time, state.run.step),
        _ => clock,
    }
}

/// The solver, from the case and a packed bed or from a checkpoint; `None` if the run is stopped before.
pub(super) fn solver(
    job: &Job,
    domain: Domain,
    packed: Option<Packing>,
    recorder: &mut Recorder<crate::recorder::GridObserver>,
) -> Result<Option<Solver>, RankError> {
    let case = job.case;
    let boundary = fluid::boundary(case)?;
    let setup = grains::setup(case, &job.shapes);
    let shapes = Arc::clone(&job.shapes);
    if let Some(state) = job.resumed.as_ref().filter(|state| state.run.flows()) {
        let snapshot = &state.snapshot;
        let engine = grains::expecting(case, Engine::restore(&domain, setup, GRAINS, snapshot)?);
        let tension = fluid::surface_tension(case, &domain, &boundary);
        let tension = tension.map(|tension| tension.restore(&domain, snapshot)).transpose()?;
        let (settings, flow) = (fluid::settings(case), fluid::flow(case, &domain));
        let solver = Solver::restore(domain, boundary, settings, flow, engine, shapes, case.coupling, snapshot)?;
        return Ok(Some(solver.with_surface_tension(tension).with_mean_flow(mean_flow(case, Some(snapshot))?)));
    }
    let mut engine = match packed {
        None => match laid(job, &domain, setup, recorder)? {
            Some(engine) => engine,
            None => return Ok(None),
        },
        Some(packing) if case.levels() => {
            let vessel = grains::resting_setup(case, &job.shapes, &setup);
            let engine = levelled(case, &domain, vessel, packing)?;
            match relax(job, &domain, Relaxation::new(engine), recorder)? {
                Some(engine) => unwalled(job, &domain, setup, engine)?,
                None => return Ok(None),
            }
        }
        // Contacts keep their memory: the bed stays as it lies.
        Some(packing) => packing.into_engine(&domain, setup)?,
    };
    if case.packs() {
        engine.insert(&domain, &grains::placed(case, &job.shapes, &job.beds))?;
    }
    let engine = grains::expecting(case, engine);
    within_box(job, &domain, &engine)?;
    let bed_height = recorder.measure_bed(&domain, &engine);
    liquids_fit(job, bed_height)?;
    keep_clear(job, &domain, &engine, bed_height)?;
    Ok(Some(fluid::solver(case, boundary, domain, engine, shapes, bed_height)?))
}

/// The packed grains without those that reach above the level of their population, and with those held that are glued to the floor.
pub(super) fn levelled(case: &Case, domain: &Domain, setup: Setup, packing: Packing) -> Result<Engine, RankError> {
    let bodies = packing.engine().bodies();
    let lying = |grain: Grain| {
        let body = &bodies[grain.shape as usize];
        let glued = grains::after_packing(case, body, grain.shape, grain.scale, grain.position, grain.orientation)?;
        Some(Grain { motion: if glued { Motion::WithWalls } else { grain.motion }, ..grain })
    };
    let left: Vec<Grain> = packing.bed().into_iter().filter_map(lying).collect();
    drop(packing);
    if case.levels() && domain.sum([left.len() as Real])[0] == 0.0 {
        return Err(RankError::NothingBelowLevel);
    }
    Ok(Engine::new(domain, setup, &left)?)
}

/// The grains of a bed between the walls and with the liquid of the run. Where they came to rest between other walls they begin from
/// contacts without memory, and grains beside the bed keep their velocity.
fn unwalled(job: &Job, domain: &Domain, setup: Setup, mut engine: Engine) -> Result<Engine, RankError> {
    if !grains::rests_between_others(job.case) {
        if *engine.interactions() == setup.interactions {
            return Ok(engine);
        }
        let mut snapshot = Snapshot::default();
        engine.snapshot(domain, "", &mut snapshot);
        drop(engine);
        return Ok(Engine::restore(domain, setup, "", &snapshot)?);
    }
    let of_bed = |grain: &Grain| {
        let placement = &job.case.grains[grain.shape as usize].placement;
        matches!(placement, GrainPlacement::Packed(_) | GrainPlacement::Bed(_))
    };
    let mut all = engine.at_rest();
    for (g, grain) in all.iter_mut().enumerate().filter(|(_, grain)| !of_bed(grain)) {
        grain.velocity = engine.grains().velocity[g];
        grain.angular_velocity = engine.grains().angular_velocity(g);
    }
    Ok(Engine::new(domain, setup, &all)?)
}

/// The grains that have a place from the start, come to rest if the case asks for it; `None` if stopped before.
pub(super) fn laid<B: Observer>(
    job: &Job,
    domain: &Domain,
    setup: Setup,
    recorder: &mut Recorder<B>,
) -> Result<Option<Engine>, RankError> {
    let vessel = || grains::resting_setup(job.case, &job.shapes, &setup);
    let waits = job.case.relaxes() || job.case.solver == meaning::Solver::Mps;
    let place = if waits { grains::waiting } else { grains::placed };
    let placed = || place(job.case, &job.shapes, &job.beds);
    let relaxation = match job.resumed.as_ref().filter(|state| state.run.relaxing) {
        Some(state) => Relaxation::restore(domain, vessel(), &state.snapshot)?,
        None if job.case.relaxes() => Relaxation::new(Engine::new(domain, vessel(), &placed())?),
        None => return Ok(Some(Engine::new(domain, setup, &placed())?)),
    };
    let Some(relaxed) = relax(job, domain, relaxation, recorder)? else { return Ok(None) };
    let mut engine = unwalled(job, domain, setup, relaxed)?;
    // Those in a tank of moving particles wait until its water is at rest too.
    if job.case.solver == meaning::Solver::Mics {
        grains::set_in_motion(job.case, domain, &mut engine);
    }
    Ok(Some(engine))
}

/// Refuses a packed bed that is higher than the box: its own walls had no lid.
pub(super) fn within_box(job: &Job, domain: &Domain, engine: &Engine) -> Result<(), RankError> {
    let top = job.case.domain.upper.z;
    let grains = engine.grains();
    let highest = (0..grains.owned())
        .filter(|_| job.case.holds_grains(2, 1))
        .map(|n| (spheres(engine, n).map(|(centre, radius)| centre.z + radius).fold(Real::NEG_INFINITY, Real::max), n))
        .max_by(|a, b| a.0.total_cmp(&b.0));
    let tolerance = 1e-9 * job.case.domain.extent().max_element();
    let out = highest.filter(|&(height, _)| height > top + tolerance);
    let refused = |(height, n): (Real, usize)| RankError::BedTooHigh { grain: name(job, grains.id[n]), height, top };
    domain.agree(out.map_or(Ok(()), |highest| Err(refused(highest))))
}

/// Refuses grains that stand in a gate.
pub(super) fn clear_of_gates(job: &Job, domain: &Domain, engine: &Engine) -> Result<(), RankError> {
    let grains = engine.grains();
    let found = job.case.gates.iter().find_map(|gate| {
        let plate = gate.plate();
        let within = |n: &usize| spheres(engine, *n).any(|(x, radius)| plate.clearance(x) < radius * (1.0 - TOUCH));
        (0..grains.owned()).find(within).map(|n| (name(job, grains.id[n]), gate.name.clone()))
    });
    domain.agree(found.map_or(Ok(()), |(grain, gate)| Err(RankError::GrainInGate { grain, gate })))
}

/// Refuses liquids that the height of the bed puts outside the box, wholly or in part.
pub(super) fn liquids_fit(job: &Job, bed_height: Real) -> Result<(), RankError> {
    let case = job.case;
    let top = case.domain.upper.z;
    let on_bed = case.liquids.iter().filter(|liquid| matches!(liquid.placement, Placement::AboveBed { .. }));
    for liquid in on_bed {
        let origin = fluid::origin_of(liquid, case.bed.axis, bed_height);
        let height = origin.z + liquid.region.heights()[1];
        if height.is_finite() && height > top {
            return Err(RankError::LiquidTooHigh { liquid: liquid.name.clone(), height, top });
        }
    }
    Ok(())
}

/// Refuses liquids that lie on grains, unless the case allows it.
fn keep_clear(job: &Job, domain: &Domain, engine: &Engine, bed_height: Real) -> Result<(), RankError> {
    let case = job.case;
    let all = engine.grains();
    let touched =
        case.liquids.iter().filter(|liquid| liquid.fluid == FluidName::Liquid && !liquid.allow_touching_grains);
    let found = touched.into_iter().find_map(|liquid| {
        let origin = fluid::origin_of(liquid, case.bed.axis, bed_height);
        let region = case.region_of(liquid, origin).geometry();
        (0..all.owned()).find(|&n| touches(&region, engine, n)).map(|n| (liquid.name.clone(), name(job, all.id[n])))
    });
    domain.agree(found.map_or(Ok(()), |(liquid, grain)| Err(RankError::LiquidOnGrain { liquid, grain })))
}

/// A grain as the case names it.
fn name(job: &Job, id: u64) -> String {
    partner(job.case, &[], id)
}

/// Whether a contact sphere of grain `n` reaches into `region`.
fn touches(region: &Region, engine: &Engine, n: usize) -> bool {
    let grains = engine.grains();
    let body = &engine.bodies()[grains.shape[n] as usize];
    let scale = grains.scale[n];
    if !region.touches_ball(grains.position[n], scale * body.bounding_radius) {
        return false;
    }
    spheres(engine, n).any(|(centre, radius)| region.touches_ball(centre, radius))
}

/// Contact spheres of grain `n` as they lie: centres \[m] and radii \[m].
fn spheres(engine: &Engine, n: usize) -> impl Iterator<Item = (Vector, Real)> {
    let grains = engine.grains();
    let body = &engine.bodies()[grains.shape[n] as usize];
    let (position, orientation, scale) = (grains.position[n], grains.orientation[n], grains.scale[n]);
    let spheres = body.centres.iter().zip(&body.radii);
    spheres.map(move |(&centre, &radius)| (position + orientation * (scale * centre), scale * radius))
}
