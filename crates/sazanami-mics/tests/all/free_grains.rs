//! Free grains under friction that is stiff: their speed does not ring, whatever the step.

use sazanami_dem::{Body, Damping, Engine, Grain, Interactions, LinearSpringDashpot, Setup, Wall};
use sazanami_mics::boundary::{Boundary, Side};
use sazanami_mics::flow::{Flow, Fluids, Schemes};
use sazanami_mics::grains::{Coupling, Exchange};
use sazanami_mics::pressure::Tolerance;
use sazanami_mics::solver::{GridSettings, Solver};
use sazanami_mics::stability::StepLimits;
use sazanami_mics::viscosity::ViscosityScheme;
use sazanami_numerics::domain::Domain;
use sazanami_numerics::geometry::{ContactSphereRule, Shape, VolumeRule};
use sazanami_numerics::grid::Grid;
use sazanami_numerics::{Real, Vector};

/// A sphere at this height in a box of 10 x 10 x 24 cells of width 1, gravity 0.02, kinematic viscosity 1.
fn sphere(diameter: Real, ratio: Real, step: Real, height: Real) -> Solver {
    let grid = Grid::new([10, 10, 24], Vector::ZERO, Vector::new(10.0, 10.0, 24.0));
    let boundary =
        Boundary::new([[Side::Periodic; 2], [Side::Periodic; 2], [Side::NoSlip; 2]]).expect("the case is sound");
    let domain = Domain::solo(grid, boundary.periodic());
    let fluids = Fluids { liquid_density: 1.0, gas_density: 1.0, liquid_viscosity: 1.0, gas_viscosity: 1.0 };
    let schemes = Schemes { viscosity: ViscosityScheme::Implicit, ..Schemes::default() };
    let mut flow = Flow::new(&domain, fluids, schemes);
    flow.volume_fraction.fill(1.0);
    flow.fill_halos(&domain, &boundary);
    let shape =
        Shape::sphere(diameter, 3, VolumeRule::Preserve, &ContactSphereRule::Single).expect("the case is sound");
    let grain = Grain::new(0, ratio, Vector::new(5.13, 4.87, height));
    let damping = Damping::Restitution(0.5);
    let law = LinearSpringDashpot {
        normal_stiffness: 10.0,
        tangential_stiffness: 10.0,
        damping,
        ..LinearSpringDashpot::SAND
    };
    let setup = Setup {
        bodies: vec![Body::from(&shape)],
        interactions: Interactions::uniform(1, law),
        walls: vec![Wall::at_rest(Vector::ZERO, Vector::Z, 0)],
        region: [Vector::ZERO, grid.upper()],
        ghost_margin: 2.0,
    };
    let engine = Engine::new(&domain, setup, &[grain]).expect("the case is sound");
    let settings = GridSettings {
        gravity: Vector::new(0.0, 0.0, -0.02),
        limits: StepLimits::always(step),
        tolerance: Tolerance { divergence: 1e-9, ..Tolerance::default() },
        incremental: false,
    };
    let coupling = Coupling { exchange: Exchange::Surface, ..Coupling::default() };
    Solver::new(domain, boundary, settings, flow, engine, vec![shape].into(), coupling).expect("the case is sound")
}

/// Downward speeds of a settling sphere in `count` steps of `step`.
fn settle(diameter: Real, ratio: Real, step: Real, count: u32) -> Vec<Real> {
    let mut solver = sphere(diameter, ratio, step, 14.21);
    let speeds = (0..count).map(|_| {
        let next = solver.stable_step();
        solver.step(next, step, |_| ()).expect("the case is sound");
        -solver.grains().engine().grains().velocity[0].z
    });
    speeds.collect()
}

/// Sum of the changes of the speed from the fifth step on over that from there to the end, as a part of the last one.
fn excess(speeds: &[Real]) -> Real {
    let (late, last) = (&speeds[5..], speeds[speeds.len() - 1]);
    let variation: Real = late.windows(2).map(|pair| (pair[1] - pair[0]).abs()).sum();
    (variation - (last - late[0]).abs()) / last.abs()
}

#[test]
fn the_speed_of_a_narrow_grain_does_not_ring_in_long_steps() {
    // Step over dx^2 / nu. Without the velocity as an unknown both ring or leave the box.
    for (diameter, ratio) in [(1.5, 2.65), (2.5, 0.5)] {
        let right = settle(diameter, ratio, 0.25, 240)[239];
        for step in [1.0, 4.0] {
            let speeds = settle(diameter, ratio, step, (60.0 / step) as u32);
            let (last, excess) = (speeds[speeds.len() - 1], excess(&speeds));
            println!("{diameter} cells, density ratio {ratio}, step {step}: {:.4}, {excess:.4}", last / right);
            assert!((last / right - 1.0).abs() < 0.04 && excess < 0.04);
        }
    }
    // Negative control: a speed that rings by a hundredth is noticed.
    let ringing: Vec<Real> = (0..40).map(|n| 1.0 + if n % 2 == 0 { 0.01 } else { -0.01 }).collect();
    assert!(excess(&ringing) > 0.3);
}

#[test]
fn a_grain_that_lies_on_the_floor_does_not_push_the_water() {
    // Its weight is borne by the floor: the friction must not see it.
    let fastest = |height: Real| {
        let mut solver = sphere(2.5, 2.65, 1.0, height);
        for _ in 0..100 {
            let next = solver.stable_step();
            solver.step(next, 1.0, |_| ()).expect("the case is sound");
        }
        let cells = (0..2400_isize).map(|n| [n % 10, n / 10 % 10, n / 100]);
        let speeds = cells.flat_map(|cell| solver.flow().velocity.each_ref().map(|u| u[cell].abs()));
        speeds.fold(solver.grains().engine().grains().velocity[0].length(), Real::max)
    };
    let (lying, settling) = (fastest(1.26), fastest(14.21));
    println!("lying {lying:e}, settling {settling:e}");
    // What is left is the swirl of its fall by 0.01 cells, which decays. The control: the same weight in the water moves it.
    assert!(lying < 0.02 * settling && settling > 5e-3);
}
