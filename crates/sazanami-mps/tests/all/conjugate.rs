//! The conjugate projection: free fall, rest, grains, frames, threads, restarts, ranks, and what it refuses.

use crate::budget::balance;
use crate::equivalence::{ranks_agree, restart_agrees, threads_agree};
use crate::grains::expected_speed;
use crate::support::{Case, GRAVITY, NOTHING, OPEN_TOP, PERIODIC, SPACING, WALLS, jittered, under};
use sazanami_dem::{Engine, Grain};
use sazanami_mps::filling::layers;
use sazanami_mps::grains::OverlappingGrains;
use sazanami_mps::scheme::Scheme;
use sazanami_mps::solver::{FluidParticle, SetupError, Solver};
use sazanami_numerics::{Real, Vector};
use sazanami_parallel::Solo;

fn worst(solver: &Solver, error: impl Fn(Vector, Vector) -> Real) -> Real {
    let particles = solver.particles();
    let fluid = (0..particles.owned()).filter(|&a| particles.is_fluid(a));
    fluid.map(|a| error(particles.position[a], particles.velocity[a])).fold(0.0, Real::max)
}

#[test]
fn a_block_in_the_air_falls_exactly() {
    let mut case = Case::filled([12, 12, 24], [12, 12, 12], [NOTHING; 3]);
    let fallen = |case: &Case, jitter: Real| {
        let mut solver = Case { fluid: jittered(case.fluid.clone(), jitter), ..case.clone() }.solo();
        for _ in 0..20 {
            solver.step(1e-4, &under(GRAVITY), |_| ()).expect("the step is sound");
        }
        worst(&solver, |_, u| (u / 2e-3 - GRAVITY).length() / GRAVITY.length())
    };
    assert!(fallen(&case, 0.0) < 1e-12, "{:e}", fallen(&case, 0.0));
    // Disordered, but for the relaxation of the number density.
    case.scheme.relaxation = Real::INFINITY;
    assert!(fallen(&case, 0.15) < 1e-12, "{:e}", fallen(&case, 0.15));
    // Negative control: with it the pressure sorts particles that stand too close.
    case.scheme.relaxation = 100.0;
    assert!(fallen(&case, 0.15) > 1e-4, "{:e}", fallen(&case, 0.15));
}

/// Two round drops that meet, their paths a radius apart, where nothing else acts on them.
#[test]
fn drops_that_meet_keep_their_angular_momentum() {
    let mut case = Case::filled([60, 7, 40], [60, 7, 40], [NOTHING, PERIODIC, NOTHING]);
    let middle = SPACING * Vector::new(30.0, 3.5, 20.0);
    let drop =
        |x: Vector, side: Real| ((x - middle) / SPACING - side * Vector::new(9.0, 0.0, 4.0)).with_y(0.0).length() < 8.0;
    case.fluid.retain(|p| drop(p.position, 1.0) || drop(p.position, -1.0));
    for particle in &mut case.fluid {
        particle.velocity.x = 0.1 * (middle.x - particle.position.x).signum();
    }
    case.viscosity = 0.0;
    // About the middle, along x2; without every tenth particle too.
    let turning = |solver: &Solver| {
        solver.sum_over_fluid(|p, a| {
            let about = (p.position[a] - middle).cross(p.velocity[a]).y;
            [about, if p.id[a] % 10 == 0 { 0.0 } else { about }]
        })
    };
    let mut solver = case.solo();
    let [before, _] = turning(&solver);
    for _ in 0..160 {
        solver.step(1e-3, &under(Vector::ZERO), |_| ()).expect("the step is sound");
    }
    let [after, of_fewer] = turning(&solver);
    assert!((after / before - 1.0).abs() < 0.02, "{}", after / before);
    // Negative control: it is not kept where particles are left out.
    assert!((of_fewer / before - 1.0).abs() > 0.05, "{}", of_fewer / before);
}

#[test]
fn a_lattice_of_water_stays_at_rest_and_the_floor_carries_it() {
    let case = Case::filled([10, 8, 14], [10, 8, 10], [WALLS, PERIODIC, OPEN_TOP]);
    let mut solver = case.solo();
    let (mut time, mut floor, mut weight) = (0.0, 0.0, 0.0);
    while time < 0.1 {
        let dt = solver.stable_step(GRAVITY).dt;
        let report = solver.step(dt, &under(GRAVITY), |_| ()).expect("the step is sound");
        time += dt;
        floor += report.impulses.wall_pressure.z;
        weight -= report.impulses.body_force.z;
    }
    // sqrt(g H) is 0.31 m/s.
    let speed = worst(&solver, |_, u| u.length());
    assert!(speed < 0.31 * 0.02, "{speed}");
    assert!((floor / weight - 1.0).abs() < 0.01, "{}", floor / weight);
    // The pressure rises by rho g from zero half a spacing above the top layer, to 8 % of one spacing's.
    let sunk = worst(&solver, |x, _| x.z - 9.5 * SPACING) / SPACING;
    assert!(sunk < 0.1, "{sunk}");
}

/// Water that sloshes, without grains.
fn sloshing() -> Case {
    let mut case = Case::filled([16, 8, 14], [10, 8, 8], [WALLS, PERIODIC, OPEN_TOP]);
    case.fluid = jittered(case.fluid, 0.05);
    case
}

#[test]
fn results_do_not_depend_on_threads_restarts_or_ranks() {
    threads_agree(&sloshing());
    restart_agrees(&sloshing(), "fluid/pressure");
    ranks_agree(sloshing());
}

#[test]
fn a_grain_falls_as_its_drag_says() {
    let mut case = Case::filled([14, 14, 26], [14, 14, 24], [PERIODIC, PERIODIC, OPEN_TOP]);
    case.grains = vec![Grain::new(0, 2650.0, SPACING * Vector::new(7.13, 6.4, 21.0))];
    let (dt, steps) = (2e-4, 100);
    let fallen = |case: &Case| {
        let mut solver = case.solo();
        let mut early = 0.0;
        for n in 0..steps {
            let report = solver.step(dt, &under(GRAVITY), |_| ()).expect("the step is sound").coupling;
            let scale = report.drag_on_grains.length();
            assert!((report.drag_on_grains + report.drag_on_fluid).length() <= 1e-12 * scale);
            if n == 9 {
                early = -solver.grains().engine().grains().velocity[0].z / (10.0 * dt);
            }
        }
        [early, -solver.grains().engine().grains().velocity[0].z]
    };
    let ([early, found], expected) = (fallen(&case), expected_speed(dt * Real::from(steps)));
    // At first by weight and buoyancy; drag takes 1 % of it.
    let expected_early = expected_speed(10.0 * dt) / (10.0 * dt);
    assert!((early / expected_early - 1.0).abs() < 0.02, "{early} {expected_early}");
    assert!((found / expected - 1.0).abs() < 0.03, "{found} {expected}");
    // Negative control: a grain a tenth heavier.
    case.grains[0].density *= 1.1;
    let [_, heavier] = fallen(&case);
    assert!((heavier / expected - 1.0).abs() > 0.03, "{heavier} {expected}");
}

#[test]
fn drag_and_pressure_of_falling_grains_close_the_budget() {
    let mut case = Case::filled([12, 8, 24], [12, 8, 20], [WALLS, PERIODIC, OPEN_TOP]);
    let places = (0..11 * 7 * 4).map(|id: u64| {
        let at = |n: u64, step: Real| (n as Real + 0.5) * step;
        (id, SPACING * Vector::new(at(id % 11, 12.0 / 11.0), at(id / 11 % 7, 8.0 / 7.0), 6.0 + at(id / 77, 1.5)))
    });
    case.grains = places.map(|(id, place)| Grain::new(id, 2650.0, place)).collect();
    // Water that fills what the grains leave.
    let domain = case.domain(Box::<Solo>::default());
    let engine = Engine::new(&domain, case.setup(), &case.grains).expect("sound grains");
    let mut phase = OverlappingGrains::new(&domain, engine, case.coupling());
    phase.place(&domain, &case.tank());
    let mean = |z: Real| {
        let place =
            |n: usize| SPACING * Vector::new((n % 12) as Real + 0.5, (n / 12) as Real + 0.5, 0.0) + z * Vector::Z;
        (0..96).map(|n| phase.void_fraction(place(n))).sum::<Real>() / 96.0
    };
    let places = layers(Vector::ZERO, case.upper(), 20.0 * SPACING, SPACING, mean);
    case.fluid = places.into_iter().map(|position| FluidParticle { position, velocity: Vector::ZERO }).collect();
    let [gained, walls, others] = balance(&case, GRAVITY, [0.03, 0.06]);
    let residual = gained - walls - others;
    assert!(residual.length() < 0.01, "{residual}");
    // Negative control: without the impulses of the grains.
    assert!((gained - walls).z + 1.0 < -0.08, "{gained} {walls}");
}

#[test]
fn water_and_grains_move_alike_in_every_frame() {
    let mut case = Case::filled([14, 14, 14], [8, 8, 8], [NOTHING; 3]);
    case.fluid.iter_mut().for_each(|p| p.position += 3.0 * SPACING);
    let grain = |n: u64| {
        let place = Vector::new((n % 3) as Real, (n / 3 % 3) as Real, (n / 9) as Real) * 1.4 + 5.6;
        Grain { velocity: Vector::new(0.01 * (n % 4) as Real, 0.0, 0.02), ..Grain::new(n, 2650.0, SPACING * place) }
    };
    let speeds = |fluid: Vector, grains: Vector| {
        let mut case = case.clone();
        case.fluid.iter_mut().for_each(|p| p.velocity = fluid);
        case.grains = (0..18).map(grain).map(|g| Grain { velocity: g.velocity + grains, ..g }).collect();
        let mut solver = case.solo();
        for _ in 0..5 {
            solver.step(1e-4, &under(GRAVITY), |_| ()).expect("the step is sound");
        }
        let found = solver.grains().engine().grains();
        let mut all: Vec<(u64, Vector)> = (0..18).map(|g| (found.id[g], found.velocity[g] - grains)).collect();
        all.sort_by_key(|grain| grain.0);
        all
    };
    let apart = |a: &[(u64, Vector)], b: &[(u64, Vector)]| {
        a.iter().zip(b).map(|(a, b)| (a.1 - b.1).length()).fold(0.0, Real::max)
    };
    // Slow enough that the time scale of the flow is that of gravity.
    let frame = Vector::new(0.03, -0.02, 0.04);
    let rest = speeds(Vector::ZERO, Vector::ZERO);
    let moving = apart(&rest, &speeds(frame, frame));
    assert!(moving < 1e-7, "{moving:e}");
    // Negative control: the grains alone are faster.
    let alone = apart(&rest, &speeds(Vector::ZERO, frame));
    assert!(alone > 1e-3, "{alone:e}");
}

#[test]
fn small_radii_and_boxes_are_refused() {
    let mut case = Case::filled([10, 8, 14], [10, 8, 10], [WALLS, PERIODIC, OPEN_TOP]);
    case.scheme = Scheme::conjugate(2.5);
    let solver = |case: &Case| case.tried_on(Box::<Solo>::default());
    assert!(matches!(solver(&case), Err(SetupError::ConjugateRadius { .. })));
    case.scheme.radius = 3.1;
    assert!(solver(&case).is_ok());
    // Between grains the radius is larger.
    case.grains.push(Grain::new(0, 2650.0, SPACING * Vector::splat(3.0)));
    assert!(matches!(solver(&case), Err(SetupError::BoxTooShort { .. })));
    case.scheme.radius = 2.6;
    assert!(solver(&case).is_ok());
}
