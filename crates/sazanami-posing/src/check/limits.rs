//! The step at the start: speeds that can be expected, the limits that follow from them, sub-steps and steps.

use std::f64::consts::TAU;

use sazanami_dem::impact::ImpactErrors;
use sazanami_mics::stability::{
    BODY_FORCE as FALL, GRAIN_FRICTION, INTERFACE_VISCOSITY, Limit as GridLimit, Rates as GridRates, body_force_rate,
    travel,
};
use sazanami_mics::surface_tension::{capillary_rate, entry_rate};
use sazanami_mics::viscosity::{are_unlike, explicit_rate, explicit_rate_of_liquid, explicit_rate_of_thicker};
use sazanami_mps::grains::{DragIntegration, volume};
use sazanami_mps::stability::{BODY_FORCE, DRAG, Limit as ParticleLimit, Rates as ParticleRates, VISCOUS};
use sazanami_numerics::domain::Domain;
use sazanami_numerics::mean_flow::ActsBy;
use sazanami_numerics::{Real, Vector};

use super::reached;
use super::slowing::Slowing;
use super::substeps::{contact_step, impact_errors, mean_of_step, of_step};
use super::volumes::volume_within;
use super::{LimitReport, PopulationReport, TankReport};
use crate::assembly::{fluid, grains, particles};
use crate::case::meaning::{
    BoundarySide, BoxDomain, CarryingFlow, Case, Drive, Exchange, FluidName, GrainPlacement, LiquidRegion, Particles,
    Peak, Placement, Population, Region, Solver, StepChoice, Substeps, TankMotion, ViscosityScheme,
};
use crate::schedule::StepEnds;
use crate::steps::{OUTPUT, STEPS_OF_SWING, SWING, longest_in_swing, towards};

/// Source of a speed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Cause {
    /// A liquid of the case: its velocity, or its fall.
    Liquid(usize),
    /// Motion along a side, or flow in through it.
    Side,
    /// The motion of the frame or the tank.
    Frame,
    /// The initial velocity, with that of the liquids that it is added to.
    InitialVelocity,
    /// The flow that carries the liquid.
    CarryingFlow,
    /// The mean velocity that is held.
    Drive,
    /// A force that never changes, along periodic sides.
    Force,
    /// Grains of a population.
    Grains(usize),
}

/// Limits that the fluid on a grid keeps in a fixed step by several passes.
pub(crate) const OF_PASS: [GridLimit; 4] =
    [GridLimit::Advective, GridLimit::Viscous, GridLimit::Capillary, GridLimit::InterfaceViscosity];

/// Length of the time step and number of steps, estimated from the initial state of a case.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Pace {
    /// Limits on the step, shortest first.
    pub limits: Vec<LimitReport>,
    /// First step \[s].
    pub dt: Real,
    /// Longest step that the limits allow \[s].
    pub stable: Real,
    /// Mean step, which outputs shorten \[s].
    pub mean: Real,
    /// Sub-steps of the grains in the mean step.
    pub mean_substeps: usize,
    /// Passes of the fluid in a step.
    pub passes: usize,
    /// Sub-steps of the grains in a step.
    pub substeps: usize,
    /// Errors of impacts that the length of the sub-steps brings, where grains move.
    pub impact_errors: Option<ImpactErrors>,
    /// Steps, if the limits stay as they are at the first, or follow a liquid that slows down, and outputs end steps where they are due.
    pub steps: Real,
}

impl Pace {
    /// The pace from the start on, at the speeds that the case gives: liquids that fall on a bed [slow down](Slowing).
    pub fn at_start(case: &Case, populations: &[PopulationReport]) -> Self {
        let given = given_speeds(case);
        let pace = Self::at(case, populations, largest(&given));
        let stirs = stirs(case);
        let slowing = given.iter().map(|(cause, speed)| match cause {
            Cause::Liquid(n) if stirs => Slowing::of(case, *n, *speed),
            _ => None,
        });
        let slowing: Vec<Option<Slowing>> = slowing.collect();
        if case.solver != Solver::Mics || slowing.iter().all(Option::is_none) {
            return pace;
        }
        let at = |time: Real| {
            let now = given.iter().zip(&slowing);
            let now =
                now.map(|((cause, speed), slowing)| (*cause, *speed * slowing.map_or(1.0, |slowing| slowing.at(time))));
            largest(&now.collect::<Vec<_>>())
        };
        let StepChoice::Adaptive { .. } = case.fluid.step else {
            let impact = slowing.iter().flatten().map(|slowing| slowing.before).fold(0.0, Real::max);
            let passes = Self::at(case, populations, at(impact.min(case.run.until))).passes;
            return Self { passes, ..pace };
        };
        let (steps, end) = Self::steps_slowing(case, populations, at);
        let mean = end / steps;
        Self { mean, mean_substeps: mean_of_step(case, populations, mean, end), steps, ..pace }
    }

    /// Steps to the end of the run with the largest speeds of fluid and grains `at` each time [m/s], and that end \[s].
    fn steps_slowing(case: &Case, populations: &[PopulationReport], at: impl Fn(Real) -> [Vector; 2]) -> (Real, Real) {
        let until = case.run.until;
        let longest = |limits: &[LimitReport]| limits.iter().map(|limit| limit.dt_s).fold(Real::INFINITY, Real::min);
        let (mut stable, mut from) = (Vec::new(), 0.0);
        while from < until {
            let to = (1.2 * from).max(1e-3 * until).min(until);
            let of_grid = longest(&of_grid(case, populations, at(0.5 * (from + to))).0);
            stable.push((to, of_grid.min(longest_in_swing(case).unwrap_or(Real::INFINITY))));
            from = to;
        }
        StepEnds::foretold(case).steps(until, &stable, asked_steps(case))
    }

    /// The pace at the speeds that are reached: liquids fall, the tank makes these waves, grains fall, and the fluid
    /// flows round them.
    pub fn reached(case: &Case, populations: &[PopulationReport], tank: Option<&TankReport>) -> Self {
        let [fluid, grains] = largest(&speeds(case, tank.filter(|_| case.solver == Solver::Mps)));
        let falling = case.grains.iter().map(|population| reached::falling(case, population));
        let grains = falling.fold(grains, Vector::max);
        // The gas goes round a liquid that falls and spreads, about as fast as that.
        let spreads = case.solver == Solver::Mics && case.liquids.iter().any(|l| collapse(case, l) != Vector::ZERO);
        let fluid = if spreads && carrying_flow(case).is_none() { 2.0 * fluid } else { fluid };
        // Fluid on a grid is as fast as the surface that turns in it; beside a sphere an ideal one is half as fast again as the sphere.
        let around = if case.solver == Solver::Mics { begin(populations)[1] } else { 0.0 };
        let turning = Vector::new(1.0, 1.0, 0.0).normalize() * around;
        Self::at(case, populations, [fluid.max(1.5 * grains).max(turning), grains])
    }

    /// The pace at these largest speeds of fluid and grains [m/s].
    fn at(case: &Case, populations: &[PopulationReport], speeds: [Vector; 2]) -> Self {
        let (mut limits, fixed) = match &case.particles {
            Some(particles) if case.solver == Solver::Mps => of_particles(case, particles, speeds),
            _ => of_grid(case, populations, speeds),
        };
        limits.extend(longest_in_swing(case).map(|longest| {
            limit(SWING, longest, format!("period of the shaking or of the driving over {STEPS_OF_SWING}"))
        }));
        limits.retain(|limit| !limit.dt_s.is_nan() && limit.dt_s != Real::INFINITY);
        let stable = limits.iter().map(|limit| limit.dt_s).reduce(Real::min).unwrap_or(case.run.until);
        let ends = StepEnds::foretold(case);
        let first = ends.next_after(0.0).map_or(stable, |due| towards(due, stable));
        if fixed.is_none() && first < stable {
            let rule =
                "steps end where outputs, checkpoints, grains to be fed in or let go, gates and softer springs are due";
            limits.push(limit(OUTPUT, first, rule));
        }
        limits.sort_by(|a, b| a.dt_s.total_cmp(&b.dt_s));
        let ruling = fixed.map_or(0, |name| limits.iter().position(|limit| limit.name == name).unwrap_or(0));
        let dt = limits.get(ruling).map_or(case.run.until, |limit| limit.dt_s);
        let in_pass = limits.iter().filter(|limit| OF_PASS.map(GridLimit::name).contains(&limit.name));
        let in_pass = in_pass.map(|limit| limit.dt_s);
        let pass = in_pass.fold(Real::INFINITY, Real::min);
        let in_passes = case.solver == Solver::Mics && fixed.is_some();
        let passes = if in_passes { ((dt / pass).ceil() as usize).max(1) } else { 1 };
        let until = case.run.until;
        let (steps, end) = if fixed.is_some() {
            let steps = (until / dt).ceil().min(asked_steps(case));
            (steps, (steps * dt).min(until))
        } else {
            ends.steps(until, &[(until, stable)], asked_steps(case))
        };
        let stable = if fixed.is_some() { dt } else { stable };
        let mean = end / steps;
        limits.iter_mut().enumerate().for_each(|(n, limit)| limit.rules = n == ruling);
        let substeps = of_step(case, populations, dt);
        let impact_errors = (substeps > 0)
            .then(|| impact_errors(case, populations, &grains::interactions(case), dt / substeps as Real))
            .flatten();
        let mean_substeps = mean_of_step(case, populations, mean, end);
        Self { limits, dt, stable, mean, mean_substeps, passes, substeps, impact_errors, steps }
    }
}

/// The strongest body force until the end of the run: gravity, with what the frame and the drive do at their worst [m/s^2].
pub(crate) fn strongest_force(case: &Case) -> Real {
    strongest(case, case.drive)
}

/// The same with this drive.
fn strongest(case: &Case, drive: Option<Drive>) -> Real {
    let driven = drive.and_then(|drive| drive.oscillation).map_or(Vector::ZERO, |swing| swing.amplitude);
    let resting = case.resting_gravity() + drive.map_or(Vector::ZERO, |drive| drive.acceleration);
    let by = |(amplitude, frequency): (Vector, Real)| amplitude * (TAU * frequency).powi(2);
    let [moved, shaken] = swings(case).map(|swing| swing.map_or(Vector::ZERO, by));
    let peak = peaks(case).map_or(Vector::ZERO, |[_, acceleration]| case.tank_at(acceleration.time)[2]);
    let together = |moved: Vector| [shaken + driven, shaken - driven].map(|by| [moved + by, moved - by]);
    let ways = [moved, peak].into_iter().flat_map(|moved| together(moved).into_iter().flatten());
    ways.map(|by| (resting + by).length().max((resting - by).length())).fold(0.0, Real::max)
}

/// Largest speed [m/s] and acceleration [m/s^2] of a tank that moves as recorded, or of the rise of one that moves by a formula.
pub(super) fn peaks(case: &Case) -> Option<[Peak; 2]> {
    Some(case.frame.as_ref()?.motion.as_ref()?.peaks(case.run.until))
}

/// Amplitude \[m] and frequency \[Hz] of the strongest harmonic in which the tank moves, and of that in which its frame is accelerated.
fn swings(case: &Case) -> [Option<(Vector, Real)>; 2] {
    let Some(frame) = case.frame.as_ref() else { return [None; 2] };
    let moved = frame.motion.as_ref().and_then(TankMotion::harmonic);
    [moved, frame.oscillation.map(|by| (by.stroke(), by.frequency))]
}

/// Amplitude \[m] and frequency \[Hz] of the water far from the bed against the box: as the tank, its frame or the drive swings, whichever is
/// fastest.
pub(super) fn swing_of_water(case: &Case) -> Option<(Vector, Real)> {
    let driven = case.drive.and_then(|drive| drive.oscillation).map(|swing| (swing.stroke(), swing.frequency));
    let speed = |(amplitude, frequency): &(Vector, Real)| amplitude.length() * frequency;
    swings(case).into_iter().flatten().chain(driven).max_by(|a, b| speed(a).total_cmp(&speed(b)))
}

/// The flow that carries the liquid in place of one that is solved for.
fn carrying_flow(case: &Case) -> Option<CarryingFlow> {
    case.fluid.carrying_flow.filter(|_| case.solver == Solver::Mics)
}

/// Speeds at the start with what makes them [m/s].
fn given_speeds(case: &Case) -> Vec<(Cause, Vector)> {
    if let Some(flow) = carrying_flow(case) {
        return vec![(Cause::CarryingFlow, flow.largest(case.domain.extent()))];
    }
    let initial = case.fluid.initial_velocity;
    let with_initial = |velocity: Vector| match &initial {
        Some(initial) => largest_on(&case.domain, |x| (velocity + initial.at(&case.domain, x)).abs()),
        None => velocity.abs(),
    };
    // A liquid has to answer for its own velocity only; where the initial velocity takes from it, for what is left.
    let own = |liquid: &LiquidRegion| liquid.velocity.abs().min(with_initial(liquid.velocity));
    let liquids = case.liquids.iter().enumerate().map(|(n, liquid)| (Cause::Liquid(n), own(liquid)));
    let moving = case.liquids.iter().map(|liquid| liquid.velocity).chain([Vector::ZERO]);
    let together = initial.map(|_| (Cause::InitialVelocity, moving.map(with_initial).fold(Vector::ZERO, Vector::max)));
    let sides = case.boundary.iter().flatten().filter_map(|side| match side {
        BoundarySide::Inflow { velocity, .. } => Some((Cause::Side, velocity.abs())),
        _ => None,
    });
    let [_, tank, _] = case.tank_at(0.0);
    let held = case.drive.and_then(|drive| drive.mean_velocity).map(|velocity| (Cause::Drive, velocity.abs()));
    let grains = case.grains.iter().enumerate().map(|(n, population)| (Cause::Grains(n), fastest_of(population)));
    liquids.chain(sides).chain([(Cause::Frame, tank.abs())]).chain(held).chain(together).chain(grains).collect()
}

/// Largest speed that a case gives: to liquid, grains or a flow at its beginning, or by a force along periodic sides [m/s].
#[must_use]
pub fn given_speed(case: &Case) -> Real {
    given_speeds(case).iter().map(|(_, speed)| speed.length()).fold(driven(case).length(), Real::max)
}

/// Speed that a force which never changes gives the liquid along periodic sides where no mean velocity is held [m/s]: that of its fall until
/// the end of the run, at most that of laminar flow between the walls that hold it, or above one.
fn driven(case: &Case) -> Vector {
    let force = case.resting_gravity() + case.drive.map_or(Vector::ZERO, |drive| drive.acceleration);
    let (periodic, extent, liquid) = (case.periodic(), case.domain.extent(), case.fluid.liquid);
    let held = case.mean_flow().map_or([false; 3], |flow| flow.held);
    let holds = |side: &BoundarySide| matches!(side, BoundarySide::NoSlip | BoundarySide::Moving { .. });
    // By a force of one, over the kinematic viscosity [s^2].
    let laminar = |across: usize| {
        let part = match case.boundary[across].iter().filter(|side| holds(side)).count() {
            2 => 1.0 / 8.0,
            1 => 1.0 / 2.0,
            _ => Real::INFINITY,
        };
        part * extent[across] * extent[across] * liquid.density / liquid.viscosity
    };
    let is_viscous = case.solver == Solver::Mps || case.fluid.viscosity != ViscosityScheme::Off;
    Vector::from_array([0, 1, 2].map(|d| {
        if !periodic[d] || held[d] || force[d] == 0.0 {
            return 0.0;
        }
        let walls = (0..3).filter(|across| *across != d && is_viscous).map(laminar).fold(Real::INFINITY, Real::min);
        force[d].abs() * case.run.until.min(walls)
    }))
}

/// Largest components of an initial velocity, found at the places among which all of them have their extremes.
fn largest_on(domain: &BoxDomain, velocity: impl Fn(Vector) -> Vector) -> Vector {
    let part = |n: usize, d: usize| (n / 5_usize.pow(d as u32) % 5) as Real / 4.0;
    let place = |n| domain.lower + Vector::from_array([0, 1, 2].map(|d| part(n, d))) * domain.extent();
    (0..125).map(|n| velocity(place(n))).fold(Vector::ZERO, Vector::max)
}

/// Whether liquid moves through gas from the start: the projection of the first velocities then makes the gas go round
/// it, about as fast and in more than one direction at once.
pub(super) fn stirs(case: &Case) -> bool {
    let moves = |liquid: &LiquidRegion| liquid.velocity != Vector::ZERO;
    carrying_flow(case).is_none() && case.liquids.iter().any(|liquid| moves(liquid) && !fills(case, liquid))
}

/// Whether a liquid leaves no room to gas.
fn fills(case: &Case, liquid: &LiquidRegion) -> bool {
    volume_within(case, liquid).is_some_and(|v| v >= 0.99 * case.domain.extent().element_product())
}

/// Whether liquid and gas, each with its viscosity, are in the box as a run begins; two liquids that fill it together count as if gas were between.
fn has_interface(case: &Case) -> bool {
    let is_implicit = !matches!(case.fluid.viscosity, ViscosityScheme::Off | ViscosityScheme::Explicit);
    if !is_implicit || !are_unlike(&fluid::fluids(case)) {
        return false;
    }
    // What fills the box before a region is put in, and whether there are both already.
    let (_, both) = case.liquids.iter().fold((FluidName::Gas, false), |(filling, both), region| {
        if fills(case, region) {
            (region.fluid, false)
        } else {
            (filling, both || region.fluid != filling && volume_within(case, region) != Some(0.0))
        }
    });
    both
}

/// Steps after which a run ends in any case.
fn asked_steps(case: &Case) -> Real {
    case.run.steps.map_or(Real::INFINITY, |n| n as Real)
}

/// Speeds that can be expected with what makes them [m/s]: what moves at the start, what falls through the box, what
/// sides draw along, and the water of a shaken tank.
pub(crate) fn speeds(case: &Case, tank: Option<&TankReport>) -> Vec<(Cause, Vector)> {
    let mut all = given_speeds(case);
    if carrying_flow(case).is_some() {
        return all;
    }
    let moving = |side: &BoundarySide| match side {
        BoundarySide::Moving { velocity } => Some((Cause::Side, velocity.abs())),
        _ => None,
    };
    all.extend(case.boundary.iter().flatten().filter_map(moving));
    all.push((Cause::Force, driven(case)));
    for (cause, speed) in &mut all {
        let more = match *cause {
            Cause::Liquid(n) => collapse(case, &case.liquids[n]),
            Cause::Frame => {
                let [_, velocity, _] = peaks(case).map_or([Vector::ZERO; 3], |[fastest, _]| case.tank_at(fastest.time));
                of_frame(case, tank).max(velocity.abs())
            }
            Cause::Side
            | Cause::InitialVelocity
            | Cause::CarryingFlow
            | Cause::Drive
            | Cause::Force
            | Cause::Grains(_) => Vector::ZERO,
        };
        // What cannot be reckoned is refused later.
        *speed = if more.is_nan() { more } else { speed.max(more) };
    }
    all
}

/// Speed of a liquid that falls and spreads [m/s]: that of its fall, and along the floor that of the front of a dam break
/// (Ritter 1892), twice the speed of long waves of its height, where there is room for it, or of its way down a slope.
fn collapse(case: &Case, liquid: &LiquidRegion) -> Vector {
    let (extent, gravity) = (case.domain.extent(), case.constant_force_by_mass().length());
    let fall = fall_of(case, liquid);
    let is_free = |d: usize| match &liquid.region {
        Region::Box { lower, upper } => upper[d] - lower[d] < 0.99 * extent[d],
        _ => true,
    };
    let front = |d: usize| if is_free(d) { 2.0 * (gravity * fall).sqrt() } else { 0.0 };
    let along = |d: usize| front(d).max((2.0 * gravity * slide_of(case, liquid, d)).sqrt());
    Vector::new(along(0), along(1), (2.0 * gravity * fall).sqrt())
}

/// Height through which a liquid will move along a direction, from 0, in which gravity slants, until its surface is level \[m].
fn slide_of(case: &Case, liquid: &LiquidRegion, d: usize) -> Real {
    let (gravity, length) = (case.constant_force_by_mass().abs(), case.domain.extent()[d]);
    let stays = case.periodic()[d] || matches!(liquid.placement, Placement::AboveBed { .. }) || fills(case, liquid);
    if stays || gravity[d] == 0.0 { 0.0 } else { length * (gravity[d] / gravity.z).min(1.0) }
}

/// Speed of the water in the waves of its tank, or in a frame that swings [m/s].
fn of_frame(case: &Case, tank: Option<&TankReport>) -> Vector {
    if let Some(tank) = tank {
        return Vector::AXES[tank.axis - 1] * (tank.speed_ratio.min(MOST_AMPLIFIED) * tank.tank_speed);
    }
    swing_of_water(case).map_or(Vector::ZERO, |(amplitude, frequency)| {
        // What swings slowly does not get faster than what falls through the box.
        let speed = amplitude.abs() * TAU * frequency;
        speed.min((2.0 * speed * TAU * frequency * case.domain.extent()).map(Real::sqrt))
    })
}

/// Speed of the water over that of its tank which no resonance exceeds for long: waves break.
const MOST_AMPLIFIED: Real = 6.0;

/// Height through which a liquid will fall \[m].
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
        GrainPlacement::Fed(feed) => feed.velocity.abs(),
        GrainPlacement::Packed(_) | GrainPlacement::Bed(_) => Vector::ZERO,
    }
}

/// Whether free grains act on a viscous fluid by their surfaces.
fn rubs(case: &Case) -> bool {
    case.fluid.viscosity != ViscosityScheme::Off
        && case.coupling.exchange == Exchange::Surface
        && case.grains.iter().any(Population::has_free_grains)
}

/// How fast surfaces of grains cover space as they begin, and how fast the fastest of their points is at most [m/s].
fn begin(populations: &[PopulationReport]) -> [Real; 2] {
    populations.iter().fold([0.0; 2], |a, report| [0, 1].map(|n| Real::max(a[n], report.begins[n])))
}

/// Largest angular velocity that a grain is given [rad/s].
fn fastest_turn(case: &Case) -> Real {
    let lists = case.grains.iter().filter_map(|population| match &population.placement {
        GrainPlacement::List(list) => Some(list),
        _ => None,
    });
    lists.flatten().map(|grain| grain.angular_velocity.length()).fold(0.0, Real::max)
}

/// The largest of the speeds that can be expected, in each direction: of the fluid, and of the grains [m/s].
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

/// Middle extent of the widest grain that moves and whose shape is known \[m].
fn widest(case: &Case, populations: &[PopulationReport]) -> Real {
    let of_population = |(population, report): (&Population, &PopulationReport)| {
        let sizes = population.sizes();
        let middle = population.shape.middle().or(report.size_m.map(|size| size / sizes.smallest()));
        middle.filter(|_| population.moves()).map(|middle| middle * sizes.largest())
    };
    case.grains.iter().zip(populations).filter_map(of_population).fold(0.0, Real::max)
}

/// The limits on a grid, and the one that rules whatever the others are.
fn of_grid(
    case: &Case,
    populations: &[PopulationReport],
    [flow, grains]: [Vector; 2],
) -> (Vec<LimitReport>, Option<&'static str>) {
    let (spacing, bounds) = (case.domain.spacing(), fluid::settings(case).limits);
    let explicit = case.fluid.viscosity == ViscosityScheme::Explicit;
    let fixed = match case.dem.substeps {
        Substeps::Fixed(n) => {
            contact_step(case, populations, &grains::wet_interactions(case)).map(|contact| (n, contact))
        }
        Substeps::Auto => None,
    };
    let travel = travel(widest(case, populations) / spacing.min_element()).min(bounds.courant);
    let (fluids, grid) = (fluid::fluids(case), case.domain.grid());
    let capillary = [
        fluid::surface_tension_coefficient(case).map_or(0.0, |sigma| capillary_rate(sigma, &fluids, &grid)),
        fluid::entry_pressure(case).map_or(0.0, |pressure| entry_rate(pressure, &fluids, &grid)),
    ];
    let rates = match carrying_flow(case) {
        // The solver has the same on its faces, and nothing else limits it.
        Some(carrying) => GridRates {
            advective: carrying.rate(&Domain::solo(case.domain.grid(), [false; 3])),
            ..GridRates::default()
        },
        None => GridRates {
            advective: (flow / spacing).element_sum(),
            viscous: if explicit { explicit_rate(&fluid::fluids(case), spacing) } else { 0.0 },
            capillary: capillary[0].max(capillary[1]),
            body_force: body_force_rate(
                Vector::Z
                    * strongest_force(case)
                        .max(strongest(case, case.drive.filter(|drive| drive.acts_by == ActsBy::Mass))),
                spacing,
            ),
            grain_motion: grains.length().max(begin(populations)[0]) / (travel * spacing.min_element()),
            grain_turn: fastest_turn(case),
            grain_friction: if rubs(case) { explicit_rate_of_liquid(&fluid::fluids(case), spacing) } else { 0.0 },
            interface_viscosity: if has_interface(case) { explicit_rate_of_thicker(&fluids, spacing) } else { 0.0 },
            contact: fixed.map_or(0.0, |(n, contact)| 1.0 / (n as Real * contact)),
        },
    };
    let speed = |of: Vector| super::number(of.length(), 3);
    let rule = |of: GridLimit| match of {
        GridLimit::Advective => {
            let part = if stirs(case) { "; about half of that once the liquid has set the gas in motion" } else { "" };
            format!("{} / sum of speed over cell edge, speeds {} m/s{part}", bounds.courant, speed(flow))
        }
        GridLimit::Viscous => "1 / (2 nu sum of 1/dx^2)".to_owned(),
        GridLimit::Capillary if capillary[1] > capillary[0] => {
            "sqrt(pi (rho_l + rho_g) dx^2 / (4 entry pressure))".to_owned()
        }
        GridLimit::Capillary => "sqrt((rho_l + rho_g) dx^3 / (4 pi sigma))".to_owned(),
        GridLimit::BodyForce => format!("{FALL} sqrt(cell edge / body force)"),
        GridLimit::GrainMotion => {
            let fastest = grains.length().max(begin(populations)[0]);
            format!("{} of a cell at {} m/s", super::number(travel, 2), super::number(fastest, 3))
        }
        GridLimit::GrainTurn => format!("{} rad at {} rad/s", bounds.grain_turn, super::number(fastest_turn(case), 3)),
        GridLimit::GrainFriction => format!("{GRAIN_FRICTION} / (2 nu sum of 1/dx^2) of the liquid"),
        GridLimit::InterfaceViscosity => {
            format!("{INTERFACE_VISCOSITY} / (2 nu sum of 1/dx^2) of the thicker fluid, where liquid and gas meet")
        }
        GridLimit::Contact => fixed.map_or(String::new(), |(n, contact)| format!("{n} sub-steps of {contact:.2e} s")),
        // No rate sets these.
        GridLimit::Growth | GridLimit::Maximum | GridLimit::Fixed => String::new(),
    };
    let mut limits: Vec<LimitReport> =
        bounds.bounds(&rates).into_iter().map(|(dt, of)| limit(of.name(), dt, rule(of))).collect();
    match case.fluid.step {
        StepChoice::Fixed(dt) => {
            limits.push(limit(GridLimit::Fixed.name(), dt, "the case asks for it"));
            (limits, Some(GridLimit::Fixed.name()))
        }
        StepChoice::Adaptive { longest, .. } => {
            limits.push(limit(GridLimit::Maximum.name(), longest, "dt_max of the case"));
            (limits, None)
        }
    }
}

/// The limits for moving particles, and the one that rules whatever the others are.
fn of_particles(case: &Case, how: &Particles, speeds: [Vector; 2]) -> (Vec<LimitReport>, Option<&'static str>) {
    let (spacing, courant) = (how.spacing, how.courant);
    let [flow, grains] = speeds.map(Vector::length);
    let sizes = case.grains.iter().filter_map(|p| Some(p.shape.size()? * p.sizes().smallest()));
    let smallest = sizes.fold(Real::INFINITY, Real::min);
    let viscosity = case.fluid.liquid.viscosity / case.fluid.liquid.density;
    let speed = |of: Real| format!("at {} m/s, expected", super::number(of, 3));
    let rule = |of: ParticleLimit| match of {
        ParticleLimit::Advective => format!("{courant} of the particle spacing {}", speed(flow)),
        ParticleLimit::GrainMotion => format!("{courant} of the smallest grain {}", speed(grains)),
        ParticleLimit::BodyForce => format!("{BODY_FORCE} sqrt(spacing / body force)"),
        ParticleLimit::Viscous => format!("{VISCOUS} spacing^2 / nu"),
        ParticleLimit::Drag => {
            format!("{DRAG} of the time in which drag stops grains in liquid at rest")
        }
        _ => String::new(),
    };
    let rates = ParticleRates {
        advective: flow / spacing,
        grain_motion: grains / smallest,
        drag: drag_rate(case).unwrap_or(0.0),
    };
    let bounds = particles::settings(case, 0.0).limits;
    let force = Vector::new(0.0, 0.0, strongest_force(case));
    let mut limits: Vec<LimitReport> = bounds
        .bounds(&rates, force, spacing, viscosity)
        .into_iter()
        .map(|bound| limit(bound.limit.name(), bound.dt, rule(bound.limit)))
        .collect();
    match how.dt {
        Some(dt) => {
            limits.push(limit(ParticleLimit::Fixed.name(), dt, "the case asks for it"));
            (limits, Some(ParticleLimit::Fixed.name()))
        }
        None => {
            limits.push(limit(ParticleLimit::Longest.name(), how.dt_max, "dt_max of the case"));
            (limits, None)
        }
    }
}

/// Rate at which drag stops the smallest grains in liquid at rest, as densely as they are placed [1/s]; `None` where it is no limit.
fn drag_rate(case: &Case) -> Option<Real> {
    let coupling = particles::coupling(case);
    let rate = |population: &Population| {
        let d = population.shape.size()? * population.sizes().smallest();
        let mass = case.material(&population.material)?.density * volume(d);
        let solid = solid_fraction(&population.placement, d, coupling.smoothing);
        let eps = (1.0 - solid).max(coupling.least_void);
        Some(coupling.drag.relaxation_rate(d, mass, eps, 0.0)).filter(|rate| rate.is_finite())
    };
    let rates = case.grains.iter().filter_map(rate);
    rates
        .reduce(Real::max)
        .filter(|_| coupling.drag_integration == DragIntegration::Explicit && !case.liquids.is_empty())
}

/// Solid fraction that a sphere of diameter `d` \[m] meets of the others, smoothed over a radius \[m], where they are placed.
fn solid_fraction(placement: &GrainPlacement, d: Real, smoothing: Real) -> Real {
    let among = |count: usize, [lower, upper]: [Vector; 2]| {
        let room = (upper - lower + 2.0 * smoothing).element_product();
        (count.saturating_sub(1) as Real * volume(d) / room).min(super::PACKED_SPHERES)
    };
    match placement {
        GrainPlacement::Packed(_) | GrainPlacement::Bed(_) => super::PACKED_SPHERES,
        GrainPlacement::Fed(_) => 0.0,
        GrainPlacement::Lattice(block) => among(block.counts.iter().product(), [block.lower, block.upper]),
        GrainPlacement::List(grains) => {
            let places = grains.iter().map(|grain| [grain.position; 2]);
            among(grains.len(), places.reduce(|[a, b], [c, e]| [a.min(c), b.max(e)]).unwrap_or_default())
        }
    }
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::super::population_reports;
    use super::*;

    #[test]
    fn falling_bodies_shorten_the_step_that_is_reached() {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../cases/templates/settling_sphere.toml");
        let case = crate::case::load(&path, &[]).unwrap().case;
        let populations = population_reports(&case, &[]);
        let (start, reached) = (Pace::at_start(&case, &populations), Pace::reached(&case, &populations, None));
        assert!(reached.dt <= start.dt && reached.steps >= start.steps, "{} {}", reached.dt, start.dt);
        let speed = reached::falling(&case, &case.grains[0]).z;
        assert!(speed > 0.0 && speed < (2.0 * case.gravity.length() * case.domain.extent().z).sqrt());
    }
}
