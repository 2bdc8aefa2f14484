//! Drag of grains and fluid on each other, in steps longer than its relaxation time.

use sazanami_dem::{Grain, Motion};
use sazanami_mps::boundary::WallFriction;
use sazanami_mps::grains::{DragIntegration, DragParameters, volume};
use sazanami_mps::stability::Limit;
use sazanami_numerics::{Real, Vector};

use crate::support::{Case, GRAVITY, OPEN_TOP, PERIODIC, SPACING, WALLS, under};

/// Void fraction of grains on a cubic lattice 1.2 diameters apart.
pub(crate) const VOID: Real = 1.0 - std::f64::consts::FRAC_PI_6 / 1.728;

/// Held grains on a lattice between a smooth floor and lid, and fluid between them that moves along x1.
pub(crate) fn filter(viscosity: Real, speed: Real) -> Case {
    let mut case = Case::filled([12; 3], [0; 3], [PERIODIC, PERIODIC, WALLS]);
    (case.viscosity, case.friction) = (viscosity, WallFriction::Slip);
    let places = |counts: [u32; 3]| {
        let at = move |n: u32, d: usize| 12.0 * (Real::from(n) + 0.5) / Real::from(counts[d]);
        let all = (0..counts[0] * counts[1] * counts[2])
            .map(move |n| [n % counts[0], n / counts[0] % counts[1], n / (counts[0] * counts[1])]);
        all.map(move |[i, j, k]| SPACING * Vector::new(at(i, 0), at(j, 1), at(k, 2)))
    };
    case.fluid = places([11, 11, 10])
        .map(|position| sazanami_mps::solver::FluidParticle { position, velocity: speed * Vector::X })
        .collect();
    case.grains = (0..)
        .zip(places([10; 3]))
        .map(|(id, x)| Grain { motion: Motion::Fixed, ..Grain::new(id, 2650.0, x) })
        .collect();
    case
}

/// Mean velocity of the fluid along x1 after some steps under a force along x1 [m/s]; `None` if they fail.
fn velocity(case: &Case, force: Real, dt: Real, steps: usize) -> Option<Real> {
    let mut solver = case.solo();
    let speed = case.fluid[0].velocity.x;
    for _ in 0..steps {
        let report = solver.step(dt, &under(force * Vector::X), |_| ()).ok()?.coupling;
        let scale = solver.particle_mass() * case.fluid.len() as Real * (speed + force * dt);
        let residual = (report.drag_on_grains + report.drag_on_fluid).length();
        assert!(residual <= 1e-12 * scale, "{residual} {scale}");
    }
    let [sum, count] = solver.sum_over_fluid(|particles, a| [particles.velocity[a].x, 1.0]);
    Some(sum / count)
}

/// Velocity between held grains at which drag carries a force per mass on the fluid [m/s].
fn balanced(viscosity: Real, force: Real) -> Real {
    let law = DragParameters::recommended(1000.0, 1000.0 * viscosity);
    let grains = (1.0 - VOID) / volume(SPACING);
    let (mut low, mut high) = (0.0, 1.0);
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        let drag = grains * law.coefficient(SPACING, VOID, middle) * middle;
        if drag < VOID * 1000.0 * force { low = middle } else { high = middle }
    }
    low
}

#[test]
fn implicit_drag_stops_a_viscous_liquid_without_overshoot() {
    let (viscosity, speed, dt) = (1e-4, 0.05, 1e-3);
    let mut case = filter(viscosity, speed);
    // The step is several relaxation times.
    let law = DragParameters::recommended(1000.0, 1000.0 * viscosity);
    let rate = law.coefficient(SPACING, VOID, speed) * (1.0 - VOID) / (VOID * 1000.0 * volume(SPACING));
    assert!(dt * rate > 2.0, "{}", dt * rate);
    case.drag_integration = DragIntegration::Implicit;
    let [once, more] = [1, 4].map(|steps| velocity(&case, 0.0, dt, steps).expect("it stops"));
    let expected = speed / (1.0 + dt * rate);
    assert!((once / expected - 1.0).abs() < 0.15, "{once} {expected}");
    assert!(more >= 0.0 && more < 0.1 * once, "{more} {once}");
    // Negative control: with the velocity of the start it turns round, faster than it came.
    case.drag_integration = DragIntegration::Explicit;
    let turned = velocity(&case, 0.0, dt, 1).expect("one step");
    assert!(turned < -speed, "{turned}");
}

#[test]
fn a_driven_liquid_gets_the_same_velocity_with_long_steps() {
    let (viscosity, force, short, long, time) = (1e-4, 2.0, 5e-5, 5e-4, 0.01);
    let of = |drag_integration, dt: Real, force| {
        let case = Case { drag_integration, ..filter(viscosity, 0.0) };
        velocity(&case, force, dt, (time / dt).round() as usize).expect("it flows")
    };
    let reference = of(DragIntegration::Explicit, short, force);
    let found = of(DragIntegration::Implicit, long, force);
    assert!((found / reference - 1.0).abs() < 0.05, "{found} {reference}");
    let balance = reference / balanced(viscosity, force);
    assert!((balance - 1.0).abs() < 0.05, "{balance}");
    // Negative control: a tenth more force.
    let more = of(DragIntegration::Implicit, long, 1.1 * force);
    assert!((more / reference - 1.0).abs() > 0.05, "{more}");
}

/// A layer of free grains in a viscous liquid.
fn suspension(drag_integration: DragIntegration) -> Case {
    let mut case = Case::filled([10, 8, 12], [10, 8, 10], [WALLS, PERIODIC, OPEN_TOP]);
    (case.viscosity, case.drag_integration) = (1e-4, drag_integration);
    case.fluid
        .retain(|p| p.position.z > 4e-3 || (((p.position.x + p.position.z) / SPACING) as usize).is_multiple_of(2));
    let at = |n: u64, step: Real| (n as Real + 0.5) * step;
    case.grains = (0..9 * 7 * 4)
        .map(|id| {
            Grain::new(id, 2650.0, SPACING * Vector::new(at(id % 9, 1.1), at(id / 9 % 7, 8.0 / 7.0), at(id / 63, 1.02)))
        })
        .collect();
    case
}

#[test]
fn free_grains_in_a_viscous_liquid_stay_calm_and_momentum_is_kept() {
    let fastest = |drag_integration| {
        let mut solver = suspension(drag_integration).solo();
        let mut largest: Real = 0.0;
        for _ in 0..60 {
            let Ok(report) = solver.step(4e-4, &under(GRAVITY), |_| ()) else { return Real::INFINITY };
            let coupling = report.coupling;
            let scale = coupling.drag_on_grains.length();
            assert!((coupling.drag_on_grains + coupling.drag_on_fluid).length() <= 1e-11 * scale);
            largest = largest.max(report.largest_speed);
        }
        largest
    };
    let calm = fastest(DragIntegration::Implicit);
    assert!(calm < 0.1, "{calm}");
    // Negative control.
    assert!(fastest(DragIntegration::Explicit) > 1.0);
}

#[test]
fn drag_limits_the_first_step() {
    let of = |drag_integration, speed| {
        let mut case = filter(1e-4, speed);
        (case.drag_integration, case.limits.longest) = (drag_integration, 1e-2);
        case.solo().stable_step(Vector::ZERO)
    };
    let step = of(DragIntegration::Explicit, 0.0);
    let law = DragParameters::recommended(1000.0, 0.1);
    let rate = law.relaxation_rate(SPACING, 2650.0 * volume(SPACING), VOID, 0.0);
    assert!(step.limit == Limit::Drag && (step.dt * rate / 0.5 - 1.0).abs() < 0.1, "{step:?} {rate}");
    assert!(of(DragIntegration::Implicit, 0.0).limit != Limit::Drag);
}

#[test]
fn grains_that_are_let_go_do_not_lengthen_the_step() {
    let mut case = filter(1e-4, 0.5);
    case.limits.longest = 1e-2;
    // All are free but a few that are far from the others.
    case.grains.retain(|grain| grain.id < 300 || grain.id >= 998);
    case.grains.iter_mut().filter(|grain| grain.id < 300).for_each(|grain| grain.motion = Motion::Free);
    let steps = |let_go: bool| {
        let mut solver = case.solo();
        let first = solver.stable_step(Vector::ZERO);
        solver.step(1e-6, &under(Vector::ZERO), |_| ()).expect("the step is sound");
        let count = solver.release(|id| let_go && id >= 998).expect("the grains are sound");
        assert_eq!(count, if let_go { 2 } else { 0 });
        [first, solver.stable_step(Vector::ZERO)]
    };
    let ([at_rest, kept], [_, after]) = (steps(false), steps(true));
    // In fluid at rest drag would allow longer steps than in that which flows.
    assert!(kept.limit == Limit::Drag && kept.dt < 0.9 * at_rest.dt, "{kept:?} {at_rest:?}");
    assert_eq!(after, kept);
}

#[test]
fn grains_that_are_held_stand_still_whatever_their_velocity() {
    let rest = |velocity: Vector, held: bool| {
        let mut case = suspension(DragIntegration::Explicit);
        case.grains.iter_mut().for_each(|grain| grain.velocity = velocity);
        let mut solver = case.solo();
        solver.grains_mut().freeze(held);
        let stable = solver.stable_step(GRAVITY);
        for _ in 0..3 {
            solver.step(1e-4, &under(GRAVITY), |_| ()).expect("the step is sound");
        }
        let places = (0..solver.particles().owned()).map(|a| solver.particles().position[a]).collect::<Vec<_>>();
        (stable, places, solver.grains().engine().grains().velocity[0])
    };
    let fast = Vector::new(0.3, 0.1, -0.2);
    let ([still, moving], [free, thrown]) =
        ([Vector::ZERO, fast].map(|u| rest(u, true)), [Vector::ZERO, fast].map(|u| rest(u, false)));
    assert!(still.0 == moving.0 && still.1 == moving.1 && moving.2 == fast, "{:?} {:?}", still.0, moving.0);
    // Negative control: grains that move stir the water.
    assert!(free.1 != thrown.1 && free.0 != thrown.0);
}
