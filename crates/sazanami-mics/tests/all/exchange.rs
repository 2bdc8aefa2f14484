//! Balance of momentum: a grain gains what the fluid loses.

use sazanami_dem::{Body, Engine, Grain, Interactions, LinearSpringDashpot, Setup, Substeps};
use sazanami_mics::boundary::{Boundary, Side};
use sazanami_mics::flow::{Flow, Fluids, Schemes};
use sazanami_mics::grains::{Coupling, Exchange};
use sazanami_mics::pressure::Tolerance;
use sazanami_mics::solver::{GridSettings, Solver};
use sazanami_mics::stability::StepLimits;
use sazanami_mics::viscosity::ViscosityScheme;
use sazanami_numerics::domain::Domain;
use sazanami_numerics::geometry::{ContactSphereRule, Shape, SpheroidMesh, VolumeRule};
use sazanami_numerics::grid::Grid;
use sazanami_numerics::{Quaternion, Real, Vector};

const STEP: Real = 2e-3;

/// A spheroid that drifts and spins in a vortex in a closed box, less than a cell wide.
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
    let settings = GridSettings {
        gravity: Vector::ZERO,
        limits: StepLimits::always(STEP),
        tolerance: Tolerance { divergence: 1e-12, ..Tolerance::default() },
        incremental: false,
    };
    let coupling = Coupling { exchange: Exchange::Surface, substeps: Substeps::Fixed(1), ..Coupling::default() };
    Solver::new(domain, boundary, settings, flow, engine, vec![shape].into(), coupling).expect("the case is sound")
}

#[test]
fn a_drifting_spinning_grain_and_the_fluid_keep_their_momentum() {
    let sum = |solver: &Solver, displaced: Real| {
        let stored = solver.momentum();
        stored.liquid + stored.gas + stored.grains + displaced * stored.displaced
    };
    // In steps of 0.01 dx^2 / nu friction acts towards the velocity of the grain at the start, in longer ones this is an unknown.
    // Without viscosity the pressure and what is carried act alone.
    for stiffness in [0.0, 0.01, 0.3, 2.0] {
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
