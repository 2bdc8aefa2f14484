//! The step at the start: speeds that can be foreseen, the limits that follow from them, sub-steps and steps.

use std::f64::consts::{PI, TAU};

use sazanami_mics::stability::Limit as GridLimit;
use sazanami_mps::stability::{BODY_FORCE, Limit as ParticleLimit, VISCOUS};
use sazanami_numerics::{Real, Vector};

use super::{LimitReport, PopulationReport, TankReport};
use crate::assembly::fluid;
use crate::case::meaning::{
    BoundarySide, Case, ContactSphereChoice, GrainPlacement, LiquidRegion, PairContact, Particles, Placement,
    Population, Region, Solver, Step, Substeps, TankMotion, ViscosityScheme,
};

/// What makes a speed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Cause {
    /// A liquid of the case: its velocity, or its fall.
    Liquid(usize),
    /// What moves along or comes in through a side.
    Side,
    /// The motion of the frame or the tank.
    Frame,
    /// Grains of a population.
    Grains(usize),
}

/// How a case will go on in time, as far as its start tells.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Pace {
    /// Limits on the step, shortest first.
    pub limits: Vec<LimitReport>,
    /// Step [s].
    pub dt: Real,
    /// Passes of the fluid in a step.
    pub passes: usize,
    /// Sub-steps of the grains in a step.
    pub substeps: usize,
    /// Steps, if they stay as long as the first.
    pub steps: Real,
}

impl Pace {
    /// The pace of a case whose tank makes these waves.
    pub fn of(case: &Case, populations: &[PopulationReport], tank: Option<&TankReport>) -> Self {
        let (mut limits, fixed) = match &case.particles {
            Some(particles) if case.solver == Solver::Mps => of_particles(case, particles, tank),
            _ => of_grid(case, populations),
        };
        limits.retain(|limit| !limit.dt_s.is_nan() && limit.dt_s != Real::INFINITY);
        limits.sort_by(|a, b| a.dt_s.total_cmp(&b.dt_s));
        let ruling = fixed.map_or(0, |name| limits.iter().position(|limit| limit.name == name).unwrap_or(0));
        let dt = limits.get(ruling).map_or(case.run.until, |limit| limit.dt_s);
        let advective = |limit: &&LimitReport| limit.name == GridLimit::Advective.name();
        let pass = limits.iter().find(advective).map_or(Real::INFINITY, |limit| limit.dt_s);
        let in_passes = case.solver == Solver::Mics && fixed.is_some();
        let passes = if in_passes { ((dt / pass).ceil() as usize).max(1) } else { 1 };
        let steps = (case.run.until / dt).ceil().min(case.run.steps.map_or(Real::INFINITY, |n| n as Real));
        limits.iter_mut().enumerate().for_each(|(n, limit)| limit.rules = n == ruling);
        Self { limits, dt, passes, substeps: substeps(case, populations, dt), steps }
    }
}

/// The strongest body force until the end of the run: gravity, less what the frame does at its worst [m/s^2].
pub(crate) fn strongest_force(case: &Case) -> Real {
    let swing = swing(case).map_or(Vector::ZERO, |(amplitude, frequency)| amplitude * (TAU * frequency).powi(2));
    let resting = case.resting_gravity();
    (resting + swing).length().max((resting - swing).length())
}

/// Amplitude [m] and frequency [Hz] of the strongest harmonic in which the tank or its frame swings.
pub(super) fn swing(case: &Case) -> Option<(Vector, Real)> {
    let frame = case.frame.as_ref()?;
    let moved = frame.motion.as_ref().and_then(TankMotion::harmonic);
    moved.or_else(|| {
        let by = frame.oscillation?;
        Some((by.amplitude / (TAU * by.frequency).powi(2), by.frequency))
    })
}

/// Speeds that can be foreseen with what makes them [m/s]: what moves at the start, what falls through the box, and the
/// water of a shaken tank.
pub(crate) fn speeds(case: &Case, tank: Option<&TankReport>) -> Vec<(Cause, Vector)> {
    let mut all: Vec<(Cause, Vector)> = Vec::new();
    for (n, liquid) in case.liquids.iter().enumerate() {
        let falls = Vector::new(0.0, 0.0, (2.0 * case.resting_gravity().length() * fall_of(case, liquid)).sqrt());
        all.push((Cause::Liquid(n), liquid.velocity.abs().max(falls)));
    }
    for side in case.boundary.iter().flatten() {
        if let BoundarySide::Moving { velocity } | BoundarySide::Inflow { velocity, .. } = side {
            all.push((Cause::Side, velocity.abs()));
        }
    }
    if let Some(tank) = tank {
        let axis = Vector::AXES[tank.axis - 1];
        all.push((Cause::Frame, axis * (tank.speed_ratio.min(MOST_AMPLIFIED) * tank.tank_speed)));
    } else if let Some((amplitude, frequency)) = swing(case) {
        // What swings slowly does not get faster than what falls through the box.
        let speed = amplitude.abs() * TAU * frequency;
        let falls = (2.0 * speed * TAU * frequency * case.domain.extent()).map(Real::sqrt);
        all.push((Cause::Frame, speed.min(falls)));
    }
    let grains = |(n, population)| (Cause::Grains(n), fastest_of(population));
    all.extend(case.grains.iter().enumerate().map(grains));
    all
}

/// Speed of the water over that of its tank which no resonance exceeds for long: waves break.
const MOST_AMPLIFIED: Real = 6.0;

/// Height through which a liquid will fall [m].
fn fall_of(case: &Case, liquid: &LiquidRegion) -> Real {
    let extent = case.domain.extent();
    let Placement::Absolute(position) = liquid.placement else { return 0.0 };
    let [low, high] = liquid.region.heights().map(|height| position.z + height - case.domain.lower.z);
    // What fills its layer from side to side on the floor has nothing to fall into.
    let fills = match liquid.region {
        Region::HalfSpace { .. } => low < high && high.is_finite(),
        _ => liquid.region.volume().is_some_and(|volume| volume >= 0.99 * extent.x * extent.y * (high - low)),
    };
    if fills && low <= 0.0 { 0.0 } else { high.clamp(0.0, extent.z) }
}

/// Largest velocity of a population at the start [m/s].
fn fastest_of(population: &Population) -> Vector {
    match &population.placement {
        GrainPlacement::List(list) => list.iter().map(|grain| grain.velocity.abs()).fold(Vector::ZERO, Vector::max),
        GrainPlacement::Lattice(lattice) => lattice.velocity.abs(),
        GrainPlacement::Packed(_) | GrainPlacement::Bed(_) => Vector::ZERO,
    }
}

/// The largest of the speeds that can be foreseen, in each direction: of the fluid, and of the grains [m/s].
fn largest(speeds: &[(Cause, Vector)]) -> [Vector; 2] {
    let is_of_grains = |cause: &Cause| matches!(cause, Cause::Grains(_));
    [false, true].map(|grains| {
        let these = speeds.iter().filter(|(cause, _)| is_of_grains(cause) == grains);
        these.fold(Vector::ZERO, |fastest, (_, speed)| fastest.max(*speed))
    })
}

/// A limit, whether it rules or not.
fn limit(name: &'static str, dt_s: Real, rule: impl Into<String>) -> LimitReport {
    LimitReport { name, dt_s, rule: rule.into(), rules: false }
}

/// The limits on a grid, and the one that rules whatever the others are.
fn of_grid(case: &Case, populations: &[PopulationReport]) -> (Vec<LimitReport>, Option<&'static str>) {
    let spacing = case.domain.spacing();
    let bounds = fluid::settings(case).limits;
    let [flow, grains] = largest(&speeds(case, None));
    let mut limits = vec![limit(
        GridLimit::Advective.name(),
        bounds.courant / (flow / spacing).element_sum(),
        format!("{} / sum of speed over cell edge, speeds {} m/s", bounds.courant, super::number(flow.length(), 3)),
    )];
    if case.fluid.viscosity == ViscosityScheme::Explicit {
        let fluids = [case.fluids.liquid, case.fluids.gas];
        let nu = fluids.map(|fluid| fluid.viscosity / fluid.density).into_iter().fold(0.0, Real::max);
        let inverse = (Vector::ONE / (spacing * spacing)).element_sum();
        limits.push(limit(GridLimit::Viscous.name(), 0.5 / (nu * inverse), "1 / (2 nu sum of 1/dx^2)"));
    }
    limits.push(limit(
        GridLimit::GrainMotion.name(),
        bounds.grain_travel * spacing.min_element() / grains.length(),
        format!("{} of a cell at {} m/s", bounds.grain_travel, super::number(grains.length(), 3)),
    ));
    if let (Substeps::Fixed(n), Some(contact)) = (case.dem.substeps, contact_step(case, populations)) {
        limits.push(limit(GridLimit::Contact.name(), contact * n as Real, format!("{n} sub-steps of {contact:.2e} s")));
    }
    match case.fluid.step {
        Step::Fixed(dt) => {
            limits.push(limit(GridLimit::Fixed.name(), dt, "the case asks for it"));
            (limits, Some(GridLimit::Fixed.name()))
        }
        Step::Adaptive { longest, .. } => {
            limits.push(limit(GridLimit::Maximum.name(), longest, "dt_max of the case"));
            (limits, None)
        }
    }
}

/// The limits for moving particles, and the one that rules whatever the others are.
fn of_particles(
    case: &Case,
    particles: &Particles,
    tank: Option<&TankReport>,
) -> (Vec<LimitReport>, Option<&'static str>) {
    let (spacing, courant) = (particles.spacing, particles.courant);
    let [flow, grains] = largest(&speeds(case, tank)).map(Vector::length);
    let at = |speed: Real| format!("{courant} of the particle spacing at {} m/s, foreseen", super::number(speed, 3));
    let sizes = case.grains.iter().filter_map(|p| Some(p.shape.size()? * p.size.smallest()));
    let smallest = sizes.fold(Real::INFINITY, Real::min);
    let nu = case.fluids.liquid.viscosity / case.fluids.liquid.density;
    let mut limits = vec![
        limit(ParticleLimit::Advective.name(), courant * spacing / flow, at(flow)),
        limit(
            ParticleLimit::GrainMotion.name(),
            courant * smallest / grains,
            format!("{courant} of the smallest grain at {} m/s, foreseen", super::number(grains, 3)),
        ),
        limit(
            ParticleLimit::BodyForce.name(),
            BODY_FORCE * (spacing / strongest_force(case)).sqrt(),
            format!("{BODY_FORCE} sqrt(spacing / body force)"),
        ),
        limit(ParticleLimit::Viscous.name(), VISCOUS * spacing * spacing / nu, format!("{VISCOUS} spacing^2 / nu")),
    ];
    match particles.dt {
        Some(dt) => {
            limits.push(limit(ParticleLimit::Fixed.name(), dt, "the case asks for it"));
            (limits, Some(ParticleLimit::Fixed.name()))
        }
        None => {
            limits.push(limit(ParticleLimit::Longest.name(), particles.dt_max, "dt_max of the case"));
            (limits, None)
        }
    }
}

/// Largest ratio of a grain's mass to the effective mass of a contact, for a spheroid like the paper's.
const OFF_CENTRE: Real = 5.28;

/// Contacts of a population.
fn contacts_of<'c>(case: &'c Case, population: &Population) -> impl Iterator<Item = &'c PairContact> {
    let material = population.material.clone();
    case.contacts.iter().filter(move |pair| pair.a == material || pair.b == material)
}

/// The larger stiffness of a contact [N/m].
fn stiffness(pair: &PairContact) -> Real {
    pair.law.normal_stiffness.max(pair.law.tangential_stiffness)
}

/// The stiffest contact that grains of the case have.
pub(crate) fn stiffest_contact(case: &Case) -> Option<&PairContact> {
    let all = case.grains.iter().flat_map(|population| contacts_of(case, population));
    all.max_by(|a, b| stiffness(a).total_cmp(&stiffness(b)))
}

/// Longest sub-step the contacts allow [s].
pub(super) fn contact_step(case: &Case, populations: &[PopulationReport]) -> Option<Real> {
    let step = |(population, report): (&Population, &PopulationReport)| {
        let mass = report.mass_kg? * population.size.smallest().powi(3);
        let stiffest = contacts_of(case, population).map(stiffness).fold(0.0, Real::max);
        // A single sphere is never hit off its centre.
        let lever = if population.contact_spheres == ContactSphereChoice::Single { 1.0 } else { OFF_CENTRE };
        Some(sazanami_dem::stability::SUBSTEP_FACTOR * PI * (0.5 * mass / lever / stiffest).sqrt())
    };
    case.grains.iter().zip(populations).filter_map(step).reduce(Real::min)
}

fn substeps(case: &Case, populations: &[PopulationReport], dt: Real) -> usize {
    if case.grains.is_empty() {
        return 0;
    }
    match case.dem.substeps {
        Substeps::Fixed(n) => n,
        Substeps::Auto => contact_step(case, populations).map_or(1, |step| (dt / step).ceil() as usize).max(1),
    }
}
