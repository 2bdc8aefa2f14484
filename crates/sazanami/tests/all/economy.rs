//! A step of the coupled solver takes no memory once it has run a while.

use std::sync::Arc;

use sazanami_dem::{Body, Bridge, Damping, Engine, Grain, Interactions, LinearSpringDashpot, Setup, Substeps, Wall};
use sazanami_mics::ball::ball;
use sazanami_mics::boundary::Boundary;
use sazanami_mics::flow::{DropVelocity, Flow, Fluids, Schemes};
use sazanami_mics::grains::Coupling;
use sazanami_mics::pressure::Tolerance;
use sazanami_mics::solver::{GridSettings, Solver};
use sazanami_mics::stability::StepLimits;
use sazanami_mics::surface_tension::{Curvature, SurfaceTension};
use sazanami_numerics::domain::Domain;
use sazanami_numerics::geometry::{ContactSphereRule, Shape, SpheroidMesh, VolumeRule};
use sazanami_numerics::grid::Grid;
use sazanami_numerics::{Quaternion, Real, Vector};
use sazanami_parallel::with_threads;
use sazanami_test_support::{allocations_of_thread, bytes_of_thread, trace_allocations};

const WIDTH: Real = 4e-3;

/// Grains on a floor, pressed together by a strong slanted gravity, in shallow water that a drop falls into; with liquid bridges and an
/// entry pressure.
fn solver() -> Solver {
    let domain = Domain::solo(Grid::new([16, 16, 12], Vector::ZERO, Vector::new(WIDTH, WIDTH, 3e-3)), [false; 3]);
    let boundary = Boundary::closed();
    let fluids = Fluids { liquid_density: 1e3, gas_density: 1.0, liquid_viscosity: 1e-3, gas_viscosity: 1e-5 };
    let mut flow = Flow::new(&domain, fluids, Schemes::default());
    let mut beta = domain.field(0.0);
    domain.set(&mut beta, |_, _, k| if k < 3 { 1.0 } else { 0.0 });
    flow.add_liquid(&domain, &boundary, &beta, |_| Vector::ZERO, DropVelocity::Mass);
    let drop = ball(&domain, Vector::new(2.1e-3, 1.9e-3, 2.2e-3), 0.5e-3, 4);
    flow.add_liquid(&domain, &boundary, &drop, |_| Vector::new(0.1, 0.0, -1.0), DropVelocity::Mass);
    let shape = Shape::spheroid(
        0.3e-3,
        0.5e-3,
        SpheroidMesh { rings: 7, segments: 6 },
        VolumeRule::Preserve,
        &ContactSphereRule::Axis { count: 5 },
    )
    .expect("the case is sound");
    let law = LinearSpringDashpot {
        normal_stiffness: 500.0,
        tangential_stiffness: 500.0,
        damping: Damping::Restitution(0.3),
        ..LinearSpringDashpot::SAND
    };
    let upper = Vector::new(WIDTH, WIDTH, 3e-3);
    let setup = Setup {
        bodies: vec![Body::from(&shape)],
        interactions: Interactions::uniform(1, law).with_bridge(Bridge::new(1e-3, 0.0, 0.01)),
        walls: Wall::of_box(Vector::ZERO, upper, 0, [[true; 2], [true; 2], [true, true]]),
        region: [Vector::ZERO, upper],
        ghost_margin: 0.5e-3,
    };
    let grains: Vec<Grain> = (0..32)
        .map(|n: u32| {
            let place = Vector::new(Real::from(n % 4) + 0.5, Real::from(n / 4 % 4) + 0.5, 0.0) * 1e-3;
            let height = if n < 16 { 0.29e-3 } else { 0.86e-3 };
            Grain {
                orientation: Quaternion::from_rotation_z(0.4 * Real::from(n)) * Quaternion::from_rotation_x(1.5),
                ..Grain::new(u64::from(n), 2650.0, place + height * Vector::Z)
            }
        })
        .collect();
    let engine = Engine::new(&domain, setup, &grains).expect("the case is sound");
    let coupling = Coupling { substeps: Substeps::Auto, ..Coupling::default() };
    let settings = GridSettings {
        gravity: Vector::new(3.0, 1.0, -30.0),
        limits: StepLimits::up_to(2e-5),
        tolerance: Tolerance { divergence: 1e-8, max_iterations: 300 },
        incremental: false,
    };
    // Of nothing: the grains move as without it.
    let tension = SurfaceTension::new(&domain, &boundary, 0.0, Curvature::Found).with_entry_pressure(&domain, 0.0);
    Solver::new(domain, boundary, settings, flow, engine, Arc::from([shape]), coupling)
        .expect("the case is sound")
        .with_surface_tension(Some(tension))
}

#[test]
fn a_step_with_grains_in_contact_allocates_nothing() {
    with_threads(1, || {
        let mut solver = solver();
        let mut step = |watched: bool| {
            let stable = solver.stable_step();
            let (count, bytes) = (allocations_of_thread(), bytes_of_thread());
            trace_allocations(watched);
            let report = solver.step(stable, stable.dt, |_| ()).expect("the case is sound");
            trace_allocations(false);
            (allocations_of_thread() - count, bytes_of_thread() - bytes, report.contacts)
        };
        // Until every list has met its longest, that of the contacts that go through a renewal last, and the grains lie on each other.
        let (mut first, mut quiet) = (0, 0);
        for _ in 0..6000 {
            let count = step(false).0;
            first += count;
            quiet = if count == 0 { quiet + 1 } else { 0 };
            if quiet == 1200 {
                break;
            }
        }
        assert!(first > 0, "negative control: the allocator counts");
        let watched = std::env::var_os("SAZANAMI_TELL").is_some();
        let (mut renewals, mut contacts) = (0, 0);
        // With a renewal of the lists at least, which become rare as the grains come to rest.
        let mut steps = 0;
        while steps < 60 || (renewals == 0 && steps < 2000) {
            let (number, (count, bytes, report)) = (steps, step(watched));
            steps += 1;
            contacts += report.contacts;
            renewals += report.list_renewals;
            assert_eq!(count, 0, "step {number} took {bytes} bytes in {count} pieces");
        }
        assert!(contacts > steps * 2, "the grains touch: {contacts} contacts");
        assert!(renewals > 0, "no list was renewed");
        println!("{renewals} renewals, {} contacts a step", contacts / steps);
    })
    .expect("the threads are granted");
}
