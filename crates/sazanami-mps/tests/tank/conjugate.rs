//! The conjugate projection: free fall, rest, threads, restarts, ranks, and what it refuses.

use crate::equivalence::{ranks_agree, restart_agrees, threads_agree};
use crate::support::{Case, GRAVITY, NOTHING, OPEN_TOP, PERIODIC, SPACING, WALLS, jittered, under};
use sazanami_dem::Grain;
use sazanami_mps::grains::GrainPhase;
use sazanami_mps::scheme::{Projection, Scheme};
use sazanami_mps::solver::{SetupError, Solver};
use sazanami_numerics::{Real, Vector};
use sazanami_parallel::Solo;

fn conjugate(radius: Real) -> Scheme {
    Scheme { projection: Projection::Conjugate, radius, ..Scheme::default() }
}

fn worst(solver: &Solver, error: impl Fn(Vector, Vector) -> Real) -> Real {
    let particles = solver.particles();
    let fluid = (0..particles.owned()).filter(|&a| particles.is_fluid(a));
    fluid.map(|a| error(particles.position[a], particles.velocity[a])).fold(0.0, Real::max)
}

#[test]
fn a_block_in_the_air_falls_exactly() {
    let mut case = Case::filled([12, 12, 24], [12, 12, 12], [NOTHING; 3]);
    case.scheme = conjugate(2.6);
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

#[test]
fn a_lattice_of_water_stays_at_rest_and_the_floor_carries_it() {
    for radius in [2.6, 3.1] {
        let mut case = Case::filled([10, 8, 14], [10, 8, 10], [WALLS, PERIODIC, OPEN_TOP]);
        case.scheme = conjugate(radius);
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
        assert!(speed < 0.31 * 0.02, "{radius}: {speed}");
        assert!((floor / weight - 1.0).abs() < 0.01, "{radius}: {}", floor / weight);
        // The pressure rises by rho g from zero half a spacing above the top layer, to 8 % of one spacing's.
        let sunk = worst(&solver, |x, _| x.z - 9.5 * SPACING) / SPACING;
        assert!(sunk < 0.1, "{radius}: {sunk}");
    }
}

/// Water that sloshes, without grains.
fn sloshing() -> Case {
    let mut case = Case::filled([16, 8, 14], [10, 8, 8], [WALLS, PERIODIC, OPEN_TOP]);
    case.fluid = jittered(case.fluid, 0.05);
    case.scheme = conjugate(2.6);
    case
}

#[test]
fn results_do_not_depend_on_threads_nor_on_restarts() {
    threads_agree(&sloshing());
    restart_agrees(&sloshing(), "fluid/pressure");
}

#[test]
fn ranks_agree_up_to_rounding() {
    ranks_agree(sloshing());
}

#[test]
fn small_radii_and_grains_are_refused() {
    let mut case = Case::filled([10, 8, 14], [10, 8, 10], [WALLS, PERIODIC, OPEN_TOP]);
    case.scheme = conjugate(2.5);
    let solver = |case: &Case| {
        let domain = case.domain(Box::<Solo>::default());
        let engine = sazanami_dem::Engine::new(&domain, case.setup(), &case.grains).expect("sound grains");
        let grains = GrainPhase::new(&domain, engine, case.coupling());
        Solver::new(domain, case.settings(), case.tank(), &case.fluid, grains)
    };
    assert!(matches!(solver(&case), Err(SetupError::ConjugateRadius { .. })));
    case.scheme.radius = 2.6;
    assert!(solver(&case).is_ok());
    case.grains.push(Grain::new(0, 2650.0, SPACING * Vector::splat(3.0)));
    assert!(matches!(solver(&case), Err(SetupError::ConjugateGrains)));
}
