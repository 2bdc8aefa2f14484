//! Balance of linear and angular momentum: a grain gains what the fluid on the cells that it covers has lost.

use sazanami_dem::{Body, Engine, Grain, Interactions, LinearSpringDashpot, Setup, Substeps};
use sazanami_mics::boundary::{Boundary, Side};
use sazanami_mics::flow::{Flow, Fluids, Schemes};
use sazanami_mics::grains::{Coupling, Exchange};
use sazanami_mics::pressure::Tolerance;
use sazanami_mics::solver::{Settings, Solver};
use sazanami_mics::stability::StepLimits;
use sazanami_mics::viscosity::ViscosityScheme;
use sazanami_numerics::domain::Domain;
use sazanami_numerics::geometry::{ContactSphereRule, Shape, SpheroidMesh, VolumeRule};
use sazanami_numerics::grid::Grid;
use sazanami_numerics::{Quaternion, Real, Vector};

const STEP: Real = 2e-3;

/// A spheroid that drifts and spins in a vortex in a closed box. With less than two cells to its short axis it
/// covers no cell whole: all that it holds of the fluid changes by the equations of the fluid alone.
fn spheroid_in_a_vortex(viscosity: Real) -> Solver {
    let grid = Grid::new([12; 3], Vector::ZERO, Vector::splat(12.0));
    let boundary = Boundary::new([[Side::Slip; 2]; 3]).expect("the case is sound");
    let domain = Domain::solo(grid, boundary.periodic());
    let fluids =
        Fluids { liquid_density: 1.0, gas_density: 1.0, liquid_viscosity: viscosity, gas_viscosity: viscosity };
    let schemes = Schemes {
        viscosity: if viscosity > 0.0 { ViscosityScheme::Implicit } else { ViscosityScheme::Off },
        ..Schemes::default()
    };
    let mut flow = Flow::new(&domain, fluids, schemes);
    let turn = std::f64::consts::PI / 12.0;
    domain.set(&mut flow.velocity[0], |i, j, k| {
        let x = turn * grid.centre(i, j, k);
        x.x.sin() * x.y.cos() * (1.0 + 0.5 * x.z.cos())
    });
    domain.set(&mut flow.velocity[1], |i, j, k| {
        let x = turn * grid.centre(i, j, k);
        -x.x.cos() * x.y.sin() * (1.0 + 0.5 * x.z.cos())
    });
    flow.fill_halos(&domain, &boundary);
    let mesh = SpheroidMesh { rings: 5, segments: 6 };
    let shape = Shape::spheroid(0.75, 1.8, mesh, VolumeRule::Preserve, &ContactSphereRule::Axis { count: 5 })
        .expect("the case is sound");
    let grain = Grain {
        orientation: Quaternion::from_axis_angle(Vector::new(0.3, 0.5, -0.2).normalize(), 1.1),
        velocity: Vector::new(0.4, -0.9, 0.6),
        angular_velocity: Vector::new(0.5, 0.3, -0.7),
        ..Grain::new(0, 2.65, Vector::new(4.21, 7.37, 5.13))
    };
    let setup = Setup {
        bodies: vec![Body::from(&shape)],
        interactions: Interactions::uniform(1, LinearSpringDashpot::SAND),
        walls: Vec::new(),
        region: [Vector::ZERO, grid.upper()],
        ghost_margin: 2.0,
    };
    let engine = Engine::new(&domain, setup, &[grain]).expect("the case is sound");
    let settings = Settings {
        gravity: Vector::ZERO,
        limits: StepLimits::always(STEP),
        tolerance: Tolerance { divergence: 1e-12, ..Tolerance::default() },
        incremental: false,
    };
    let coupling = Coupling { exchange: Exchange::Surface, substeps: Substeps::Fixed(1), ..Coupling::default() };
    Solver::new(domain, boundary, settings, flow, engine, vec![shape].into(), coupling).expect("the case is sound")
}

/// Momentum of the grain less that of the fluid on what it covers, and the same about the origin; with `arms` of the
/// covered parts or of the centre of the grain.
fn exchanged(solver: &Solver, arms: Real) -> [Vector; 2] {
    let grains = solver.grains().engine().grains();
    let (at, p) = (grains.unwrapped_position(0), grains.mass[0] * grains.velocity[0]);
    let mut sums = [p, grains.angular_momentum[0] + at.cross(p)];
    let (flow, volume) = (solver.flow(), solver.domain().grid().cell_volume());
    for share in solver.grains().covered().shares(0) {
        assert!(share.fraction < 0.99, "a cell is covered whole");
        let cell = share.at as usize;
        let u = Vector::from_array([0, 1, 2].map(|d| flow.velocity[d].data()[cell]));
        let held = share.fraction * volume * flow.density.data()[cell] * u;
        sums[0] -= held;
        sums[1] -= (at + arms * share.arm()).cross(held);
    }
    sums
}

#[test]
fn a_drifting_spinning_grain_and_the_fluid_exchange_momentum_exactly() {
    let mut solver = spheroid_in_a_vortex(0.0);
    let [start, control] = [1.0, 0.0].map(|arms| exchanged(&solver, arms));
    let grains = solver.grains().engine().grains();
    let first = [grains.velocity[0], grains.angular_momentum[0]];
    let (mut linear, mut angular): (Real, Real) = (0.0, 0.0);
    for _ in 0..50 {
        let step = solver.stable_step();
        solver.step(step, STEP, |_| ()).expect("the case is sound");
        let now = exchanged(&solver, 1.0);
        linear = linear.max((now[0] - start[0]).length() / start[0].length());
        angular = angular.max((now[1] - start[1]).length() / start[1].length());
    }
    let wrong = (exchanged(&solver, 0.0)[1] - control[1]).length() / control[1].length();
    let grains = solver.grains().engine().grains();
    let changed = [
        (grains.velocity[0] - first[0]).length() / first[0].length(),
        (grains.angular_momentum[0] - first[1]).length() / first[1].length(),
    ];
    println!("linear {linear:e}, angular {angular:e}, control {wrong:e}, exchanged {changed:?}");
    assert!(linear < 1e-10 && angular < 1e-10);
    // Negative control: forces at the centre of the grain do not balance, and much is exchanged.
    assert!(wrong > 1e-6 && changed.iter().all(|&part| part > 1e-3));
}

#[test]
fn friction_loses_no_momentum() {
    let sum = |solver: &Solver, displaced: Real| {
        let stored = solver.momentum();
        stored.liquid + stored.gas + stored.grains + displaced * stored.displaced
    };
    // In steps of 0.01 dx^2 / nu friction acts towards the velocity of the grain at the start, in longer ones this is an unknown.
    for stiffness in [0.01, 0.3, 2.0] {
        let mut solver = spheroid_in_a_vortex(stiffness / STEP);
        let (start, control) = (sum(&solver, -1.0), sum(&solver, 0.0));
        let first = solver.momentum().grains;
        let mut walls = Vector::ZERO;
        for _ in 0..20 {
            let step = solver.stable_step();
            walls += solver.step(step, STEP, |_| ()).expect("the case is sound").impulses.walls_on_fluid;
        }
        let lost = (sum(&solver, -1.0) - start - walls).length() / first.length();
        let wrong = (sum(&solver, 0.0) - control - walls).length() / first.length();
        let changed = (solver.momentum().grains - first).length() / first.length();
        println!("{stiffness} dx^2 / nu: lost {lost:e}, control {wrong:e}, exchanged {changed:e}");
        assert!(lost < 1e-10);
        // Negative control: without the fluid on the covered part the sum changes, and much is exchanged.
        assert!(wrong > 1e-3 && changed > 1e-2);
    }
}
