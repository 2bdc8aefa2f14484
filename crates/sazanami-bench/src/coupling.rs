//! Grains on the grid, and the paper's whole case.

use std::sync::Arc;

use sazanami::machine::peak_memory;
use sazanami_mics::grains::Imprint;
use sazanami_mics::solver::Solver;
use sazanami_numerics::geometry::Shape;
use sazanami_numerics::{Real, Vector};
use sazanami_observe::{Body, GatheredBed, bed_profile};
use sazanami_parallel::{Communicator, Solo};
use sazanami_posing::assembly::fluid;
use sazanami_posing::case::meaning::Case;

use crate::beds;
use crate::fluid::Phases;
use crate::machine::floor_of_bytes;
use crate::stopwatch::{Stopwatch, forget_peak};
use crate::timing::Timing;

/// Bytes in a mebibyte.
const MEBI: Real = 1_048_576.0;
/// Number of runs that are timed.
const RUNS: usize = 7;
/// Bytes of a cell's share of a grain: fraction, place and arm.
const SHARE_BYTES: Real = 24.0;
/// Fields that the shares are summed into: solid fraction, density, velocity.
const SUMMED_FIELDS: Real = 5.0;
/// Fields that a step keeps: liquid fraction, pressure, velocity, face velocity.
const KEPT_FIELDS: Real = 8.0;

/// Cells covered by every grain of the paper's bed, anew: all grains have moved by a part of a cell.
pub(crate) fn volume_fractions() -> Result<Timing, String> {
    let paper = beds::paper()?;
    let case = &paper.case;
    let shape = beds::shape(case, case.grains[0].contact_spheres.clone())?;
    let domain = paper.domain()?;
    let engine = paper.engine(&domain, &shape)?;
    let coupling = case.coupling;
    let shapes = [shape];
    let mut imprint = Imprint::new(domain.cells(), coupling.volume_fractions());
    let mut moved = engine.grains().clone();
    let way = 0.05 * domain.grid().spacing.min_element();
    let mut timing = Timing::of_laps(RUNS, |run| {
        let shift = if run % 2 == 0 { way } else { -way };
        moved.position.iter_mut().for_each(|x| *x += Vector::new(0.0, 0.0, shift));
        let watch = Stopwatch::start();
        let report = imprint.update(&domain, &moved, &shapes, None);
        let lap = watch.stop();
        if report.evaluated != moved.owned() {
            return Err(format!("{} of {} grains were evaluated", report.evaluated, moved.owned()));
        }
        Ok(lap)
    })?;
    let shares: usize = (0..moved.owned()).map(|n| imprint.shares(n).len()).sum();
    let covered = imprint.solid_fraction.data().iter().filter(|&&alpha| alpha > 0.0).count();
    timing.size = format!("{} grains, 4 x 4 columns a cell, {shares} shares in {covered} cells", moved.owned());
    let bytes = 2.0 * SHARE_BYTES * shares as Real + 2.0 * 8.0 * SUMMED_FIELDS * covered as Real;
    let (floor, how) = floor_of_bytes(bytes, "shares out and in, five fields in and out where there are grains");
    Ok(timing.with_floor(floor, how))
}

/// A rank's part of the paper's case, built.
pub(crate) fn whole_case(communicator: Box<dyn Communicator>) -> Result<(Case, Solver), String> {
    let paper = beds::paper_on(&*communicator)?;
    let case = paper.case.clone();
    let shapes: Arc<[Shape]> = vec![beds::shape(&case, case.grains[0].contact_spheres.clone())?].into();
    let domain = paper.domain_on(communicator)?;
    let engine = paper.engine(&domain, &shapes[0])?;
    let mut bed = GatheredBed::default();
    bed.gather(&domain, engine.grains(), engine.time());
    let bodies: Vec<Body> = shapes.iter().map(Body::of).collect();
    let height = bed_profile::height_near(&bed.view(&bodies), &case.ground(), case.bed.axis, case.bed.height_radius);
    // Rank 0 alone has gathered the bed.
    let height = domain.max(height.unwrap_or(case.domain.lower.z));
    let boundary = fluid::boundary(&case).map_err(|error| error.to_string())?;
    let solver = fluid::solver(&case, boundary, domain, engine, shapes, height).map_err(|error| error.to_string())?;
    Ok((case, solver))
}

/// Peak of the resident memory while the paper's case is built and steps once.
pub(crate) fn case_memory() -> Result<Timing, String> {
    let before = forget_peak();
    let (case, mut solver) = whole_case(Box::<Solo>::default())?;
    Phases::default().step(&mut solver)?;
    let peak = peak_memory().ok_or("the system does not tell how much memory is taken")?;
    let mebi = |bytes: u64| bytes as Real / MEBI;
    let held = before.map_or_else(|| "an unknown part".to_owned(), |bytes| format!("{:.0} MiB", mebi(bytes)));
    let cells: Real = case.domain.cells.iter().map(|&n| n as Real + 4.0).product();
    let grains = solver.grains().engine().grains().owned();
    let state = cells * KEPT_FIELDS * 8.0 + grains as Real * 250.0;
    Ok(Timing {
        unit: "MiB",
        values: vec![mebi(peak)],
        size: format!(
            "{} cells, {grains} grains of {} spheres; {held} of it held before",
            case.domain.cell_count(),
            solver.grains().shapes()[0].contact_spheres().len()
        ),
        floor: Some(state / MEBI),
        floor_how: "what a step hands to the next: eight fields in double precision, and the grains".into(),
        ..Timing::default()
    })
}

/// Steps of the paper's case from its start.
pub(crate) fn case_step(communicator: Box<dyn Communicator>) -> Result<Timing, String> {
    let (case, mut solver) = whole_case(communicator)?;
    let mut phases = Phases::default();
    let (mut substeps, mut dt) = (0, 0.0);
    let mut timing = Timing::of_laps(3, |run| {
        if run == 1 {
            phases = Phases::default();
        }
        let stepped = phases.step(&mut solver)?;
        substeps = stepped.report.contacts.substeps;
        dt = stepped.dt;
        Ok(stepped.lap)
    })?;
    timing.size = format!(
        "{} cells, {} grains, step {dt:.2e} s of {substeps} sub-steps; {}",
        case.domain.cell_count(),
        solver.domain().sum([solver.grains().engine().grains().owned() as Real])[0],
        phases.in_words()
    );
    timing.floor_how = "see its parts".into();
    Ok(timing)
}
