//! Contacts and motion of settled grains.

use std::sync::OnceLock;

use sazanami_dem::{ContactReport, Damping, Engine, LinearSpringDashpot, Loads, Substeps};
use sazanami_numerics::domain::Domain;
use sazanami_numerics::{Real, Vector};
use sazanami_posing::case::meaning::ContactSphereChoice;

use crate::beds::{self, Paper};
use crate::machine::floor_of_bytes;
use crate::stopwatch::Stopwatch;
use crate::timing::Timing;

/// Milliseconds in a second.
const MILLI: Real = 1e3;
/// Sub-steps in a run, and runs.
const SUBSTEPS: usize = 100;
const RUNS: usize = 7;
/// State of a grain that every sub-step reads and writes: position, velocity, orientation, angular momentum,
/// 13 numbers each way; and its mass and inertia, 4 more to read.
const GRAIN_BYTES: Real = (2.0 * 13.0 + 4.0) * 8.0;
/// Memory of a contact: its tangential displacement read and written, its two spheres read.
const CONTACT_BYTES: Real = (2.0 * 3.0 + 1.0) * 8.0;

/// The shells of the paper.
const SHELL: ContactSphereChoice = ContactSphereChoice::Shell { count: 75, radius: None };

/// The paper's bed with shells of 75 spheres.
pub(crate) fn shell75() -> Result<Timing, String> {
    static ONCE: OnceLock<Result<Timing, String>> = OnceLock::new();
    ONCE.get_or_init(|| in_bed(&beds::paper()?)).clone()
}

fn in_bed(paper: &Paper) -> Result<Timing, String> {
    let shape = beds::shape(&paper.case, SHELL)?;
    let domain = paper.domain()?;
    let mut engine = paper.engine(&domain, &shape)?;
    let dt = engine.contact_time_step();
    let words = format!("{} spheres each", shape.contact_spheres().len());
    time_substeps(&domain, &mut engine, paper.case.gravity, dt, &words)
}

/// Equal spheres with a soft linear law: 30 layers of 1 mm on 31.8 mm square, 100 N/m, sub-steps of 1e-5 s.
pub(crate) fn spheres() -> Result<Timing, String> {
    let law = LinearSpringDashpot {
        normal_stiffness: 100.0,
        tangential_stiffness: 70.0,
        damping: Damping::Restitution(0.5),
        friction: 0.6,
        ..LinearSpringDashpot::SAND
    };
    let (domain, mut engine) = beds::spheres(1e-3, law, ([31.8e-3; 2], [4; 2]), 30_600, false)?;
    let dt = engine.contact_time_step().min(1e-5);
    time_substeps(&domain, &mut engine, Vector::new(0.0, 0.0, -9.8), dt, "equal spheres of 1 mm, K_n = 100 N/m")
}

/// The bed of a wave tank: ten layers of spheres of 1 mm on 0.15 m x 0.02 m, 400 N/m.
pub(crate) fn tank() -> Result<Timing, String> {
    let law = LinearSpringDashpot::spheres(400.0, 0.5, 0.4);
    let (domain, mut engine) = beds::spheres(1e-3, law, ([0.15, 0.02], [8, 1]), 34_000, true)?;
    let dt = engine.contact_time_step();
    let words = "equal spheres of 1 mm, K_n = 400 N/m, walls across x1";
    time_substeps(&domain, &mut engine, Vector::new(0.0, 0.0, -9.8), dt, words)
}

fn time_substeps(
    domain: &Domain,
    engine: &mut Engine,
    gravity: Vector,
    dt: Real,
    words: &str,
) -> Result<Timing, String> {
    let speed = beds::settle(engine, domain, gravity, dt)?;
    let mut timing = Timing { unit: "ms", ..Timing::default() };
    let mut report = ContactReport::default();
    let mut renewals = 0;
    for _ in 0..RUNS {
        let watch = Stopwatch::start();
        report = engine
            .advance(domain, &Loads::none(), gravity, dt * SUBSTEPS as Real, Substeps::Fixed(SUBSTEPS))
            .map_err(|error| error.to_string())?;
        timing.add(&watch.stop(), MILLI / SUBSTEPS as Real);
        renewals += report.list_renewals;
    }
    let count = engine.grains().owned();
    let bytes = count as Real * GRAIN_BYTES + report.contacts as Real * CONTACT_BYTES;
    let (floor, how) = floor_of_bytes(bytes, "state of every grain and memory of every contact, once in and out");
    timing.size = format!(
        "{count} grains, {words}; {} contacts, mean speed {speed:.1e} m/s, a list lasts {:.0} sub-steps",
        report.contacts,
        (SUBSTEPS * RUNS) as Real / renewals.max(1) as Real
    );
    Ok(timing.with_floor(MILLI * floor, how))
}

/// Time to pack the paper's bed: its sub-steps, as many as the shipped bed took, at the price of one in the settled bed.
pub(crate) fn packing_bed() -> Result<Timing, String> {
    let paper = beds::paper()?;
    let shape = beds::shape(&paper.case, SHELL)?;
    let engine = paper.engine(&paper.domain()?, &shape)?;
    let dt = engine.contact_time_step();
    let substeps = (paper.bed.recipe.time / dt).ceil();
    let substep = shell75()?;
    let scaled = |values: &[Real]| values.iter().map(|value| value / MILLI * substeps).collect::<Vec<Real>>();
    Ok(Timing {
        unit: "s",
        values: scaled(&substep.values),
        cpu: scaled(&substep.cpu),
        size: format!(
            "{} grains, {substeps:.0} sub-steps of {dt:.2e} s to {:.4} s; an upper estimate: grains in flight cost less",
            engine.grains().owned(),
            paper.bed.recipe.time
        ),
        floor: substep.floor.map(|floor| floor / MILLI * substeps),
        floor_how: format!("so many times that of a sub-step: {}", substep.floor_how),
        busy_elsewhere: substep.busy_elsewhere,
    })
}
