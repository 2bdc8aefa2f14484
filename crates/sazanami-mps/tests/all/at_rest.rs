//! Water at rest stays at rest, and falling water falls.

use crate::support::{Case, GRAVITY, OPEN_TOP, PERIODIC, SPACING, WALLS, jittered, under};
use sazanami_mps::Kind;
use sazanami_mps::boundary::WallFriction;
use sazanami_mps::scheme::Scheme;
use sazanami_mps::solver::{FluidParticle, Solver, StepError};
use sazanami_numerics::{Real, Vector};

fn run(solver: &mut Solver, body_force: Vector, until: Real) -> Real {
    let mut time = 0.0;
    while time < until {
        let dt = solver.stable_step(body_force).dt;
        solver.step(dt, &under(body_force), |_| ()).expect("the step is sound");
        time += dt;
    }
    time
}

fn water() -> Case {
    Case::filled([20, 7, 25], [20, 7, 20], [WALLS, PERIODIC, OPEN_TOP])
}

#[test]
fn a_lattice_of_water_stays_at_rest() {
    let mut solver = Case { scheme: Scheme::published(), ..water() }.solo();
    run(&mut solver, GRAVITY, 0.05);
    // The pressure is solved to 1e-6 a step.
    assert!(solver.largest_speed() < 1e-5, "{}", solver.largest_speed());
    let particles = solver.particles();
    // The pressure vanishes in the middle of the top layer, half a spacing below the reference.
    let expected = -9810.0 * 0.5 * SPACING;
    for a in (0..particles.owned()).filter(|&a| particles.kind[a] == Kind::Fluid) {
        assert!((particles.pressure[a] - expected).abs() < 1e-4 * 9810.0 * 0.02);
    }
}

#[test]
fn disordered_water_comes_to_rest() {
    let mut case = Case::filled([12, 7, 15], [12, 7, 12], [WALLS, PERIODIC, OPEN_TOP]);
    case.fluid = jittered(case.fluid, 0.1);
    let kinetic = |solver: &Solver| {
        let [twice] = solver.sum_over_fluid(|p, a| [p.velocity[a].length_squared()]);
        twice
    };
    let mut solver = case.solo();
    run(&mut solver, GRAVITY, 0.05);
    let early = kinetic(&solver);
    run(&mut solver, GRAVITY, 0.25);
    assert!(kinetic(&solver) < early, "{} {early}", kinetic(&solver));
    // Negative control: let go, the arrangement does move.
    assert!(early > 1e-4 * case.fluid.len() as Real * (9.81 * SPACING), "{early}");
}

#[test]
fn an_isolated_particle_at_a_wall_does_not_disturb_the_pressure() {
    let calm =
        Case { scheme: Scheme::published(), ..Case::filled([24, 7, 16], [8, 7, 6], [WALLS, PERIODIC, OPEN_TOP]) };
    let mut case = calm.clone();
    // Far from the water, on its way into the wall.
    let position = SPACING * Vector::new(23.4, 3.5, 12.2);
    case.fluid.push(FluidParticle { position, velocity: Vector::new(0.5, 0.0, 0.0) });
    let mut solver = case.solo();
    let report =
        solver.step(1e-4, &under(GRAVITY), |_| ()).expect("walls beside an isolated particle have no pressure");
    assert_eq!(report.isolated, 1);
    let particles = solver.particles();
    let far = (0..particles.owned()).filter(|&a| particles.position[a].x > 12.0 * SPACING);
    // Their total pressure is zero: the reduced pressure is minus the hydrostatic one.
    let reference = solver.settings().reference;
    let whole = |a: usize| particles.pressure[a] + 1e3 * GRAVITY.dot(particles.position[a] - reference);
    assert!(far.into_iter().all(|a| whole(a).abs() < 1e-2));
    let expected = calm.solo().step(1e-4, &under(GRAVITY), |_| ()).unwrap().pressure;
    assert_eq!(report.pressure.unknowns, expected.unknowns);
}

#[test]
fn water_between_periodic_sides_follows_a_force_along_them() {
    // With a surface and without.
    for (fill, top) in [(8, OPEN_TOP), (10, WALLS)] {
        let mut case =
            Case { scheme: Scheme::published(), ..Case::filled([10, 8, 10], [10, 8, fill], [PERIODIC, PERIODIC, top]) };
        case.friction = WallFriction::Slip;
        let force = GRAVITY + Vector::new(1.0, -2.0, 0.0);
        let mut solver = case.solo();
        let time = run(&mut solver, force, 0.01);
        let worst = (0..solver.particles().owned())
            .filter(|&a| solver.particles().is_fluid(a))
            .map(|a| (solver.particles().velocity[a] / time - Vector::new(1.0, -2.0, 0.0)).length())
            .fold(0.0, Real::max);
        assert!(worst < 1e-3, "{worst}");
        // Negative control: between walls water cannot follow.
        case.sides[0] = WALLS;
        let mut solver = case.solo();
        run(&mut solver, force, 0.01);
        let [sum, count] = solver.sum_over_fluid(|p, a| [p.velocity[a].x, 1.0]);
        assert!((sum / count / time - 1.0).abs() > 0.1, "{}", sum / count / time);
    }
}

#[test]
fn a_displacement_beyond_the_radius_of_influence_is_an_error() {
    let mut case = Case::filled([12, 7, 16], [12, 7, 6], [WALLS, PERIODIC, OPEN_TOP]);
    let position = SPACING * Vector::new(6.3, 3.5, 12.2);
    case.fluid.push(FluidParticle { position, velocity: Vector::new(0.0, 20.0, 0.0) });
    let mut solver = case.solo();
    match solver.step(2e-4, &under(GRAVITY), |_| ()) {
        Err(StepError::TooFar { distance, limit, .. }) => assert!((distance - 4e-3).abs() < 1e-4 && limit < distance),
        other => panic!("{other:?}"),
    }
    // Negative control: the same displacement in two steps.
    let mut solver = case.solo();
    for _ in 0..2 {
        solver.step(1e-4, &under(GRAVITY), |_| ()).expect("each displacement is within the radius of influence");
    }
}

#[test]
fn a_full_box_has_no_surface() {
    let mut case = Case::filled([8, 8, 8], [8, 8, 8], [PERIODIC; 3]);
    case.fluid = jittered(case.fluid, 0.45);
    let surface = |case: &Case| {
        let report = case.solo().step(1e-4, &under(Vector::ZERO), |_| ()).expect("the step is sound");
        report.surface + report.isolated
    };
    assert_eq!(surface(&case), 0);
    // Negative control: around a hole there is one.
    let middle = SPACING * Vector::splat(4.0);
    case.fluid.retain(|particle| (particle.position - middle).length() > 2.2 * SPACING);
    assert!(surface(&case) > 10, "{}", surface(&case));
}

#[test]
fn a_speed_beyond_incompressible_flow_is_an_error() {
    let mut case = Case::filled([12, 7, 16], [12, 7, 6], [WALLS, PERIODIC, OPEN_TOP]);
    let position = SPACING * Vector::new(6.3, 3.5, 12.2);
    case.fluid.push(FluidParticle { position, velocity: Vector::new(0.0, 160.0, 0.0) });
    match case.solo().step(1e-6, &under(GRAVITY), |_| ()) {
        Err(StepError::TooFast { id, speed, .. }) => assert!(id == 12 * 7 * 6 && (speed - 160.0).abs() < 1e-3),
        other => panic!("{other:?}"),
    }
    // Negative control: not so fast.
    case.fluid.last_mut().expect("there is water").velocity.y = 140.0;
    case.solo().step(1e-6, &under(GRAVITY), |_| ()).expect("water may be that fast");
}
