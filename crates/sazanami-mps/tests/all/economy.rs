//! A step allocates nothing after the first ones.

use sazanami_dem::{Body, Engine, Grain, Interactions, LinearSpringDashpot, Setup, Substeps, Wall};
use sazanami_mps::boundary::{Side, Tank, WallFriction};
use sazanami_mps::gates::Gate;
use sazanami_mps::grains::{
    AddedMass, AddedMassForm, DragIntegration, DragParameters, Lift, OverlapSettings, OverlappingGrains,
};
use sazanami_mps::pressure::Tolerance;
use sazanami_mps::scheme::{Fluid, Scheme};
use sazanami_mps::solver::{FluidParticle, Forcing, ParticleSettings, Solver};
use sazanami_mps::stability::StepLimits;
use sazanami_numerics::domain::Domain;
use sazanami_numerics::grid::Grid;
use sazanami_numerics::{Real, Vector};
use sazanami_parallel::with_threads;
use sazanami_test_support::allocations_of_thread;

const SPACING: Real = 1e-3;

const NO_FORCES: (AddedMassForm, Lift) = (AddedMassForm::None, Lift::None);

/// Water with some grains between two walls a `length` apart, periodic in x2, with a gate half-way if there is one.
fn tank(scheme: Scheme, length: usize, gate: Option<Gate>, (form, lift): (AddedMassForm, Lift)) -> Solver {
    let upper = SPACING * Vector::new(length as Real, 8.0, 14.0);
    let sides = [[Side::Wall; 2], [Side::Periodic; 2], [Side::Wall, Side::Open]];
    let tank =
        Tank { gates: gate.into_iter().collect(), ..Tank::new(Vector::ZERO, upper, sides, WallFriction::NoSlip) };
    let mut walls = Wall::of_box(Vector::ZERO, upper, 0, sides.map(|sides| sides.map(|side| side == Side::Wall)));
    walls.extend(gate.map(|gate| Wall::plate(gate.place * Vector::X, Vector::X, 0, gate.edges)));
    let domain = Domain::solo(Grid::new([length / 2, 4, 8], Vector::ZERO, upper), [false, true, false]);
    let setup = Setup {
        bodies: vec![Body::ball(0.5 * SPACING)],
        interactions: Interactions::uniform(1, LinearSpringDashpot::spheres(400.0, 0.5, 0.4)),
        walls,
        region: [Vector::splat(-1.0), Vector::ONE],
        ghost_margin: 3.6 * SPACING,
    };
    let at = |n: usize, step: Real| (n as Real + 0.5) * step;
    let grains: Vec<Grain> = (0..24)
        .map(|n| Grain::new(n as u64, 2650.0, SPACING * Vector::new(at(n % 6, 2.0), at(n / 6, 2.0), 0.6)))
        .collect();
    let coupling = OverlapSettings {
        drag: DragParameters::recommended(1000.0, 1e-3),
        smoothing: 3.0 * SPACING,
        least_void: 0.3,
        drag_integration: DragIntegration::Explicit,
        added_mass: AddedMass { form, coefficient: 0.5 },
        lift,
        substeps: Substeps::Auto,
    };
    let engine = Engine::new(&domain, setup, &grains).expect("sound grains");
    let phase = OverlappingGrains::new(&domain, engine, coupling);
    let place =
        |n: usize| SPACING * Vector::new(at(n % length, 1.0), at(n / length % 8, 1.0), at(n / (8 * length), 1.0));
    let fluid: Vec<FluidParticle> =
        (0..length * 8 * 9).map(|n| FluidParticle { position: place(n), velocity: Vector::ZERO }).collect();
    let settings = ParticleSettings {
        fluid: Fluid { density: 1000.0, viscosity: 1e-6, spacing: SPACING },
        scheme,
        limits: StepLimits::default(),
        tolerance: Tolerance::default(),
        reference: Vector::new(0.0, 0.0, 9.0 * SPACING),
    };
    Solver::new(domain, settings, tank, &fluid, phase).expect("a sound tank")
}

/// After 200 steps, or when the gate has gone: until then more and more pairs meet through it.
fn a_step_allocates_nothing(scheme: Scheme, length: usize, gate: Option<Gate>, forces: (AddedMassForm, Lift)) {
    let warm = if gate.is_some() { 800 } else { 200 };
    let allocations = with_threads(1, || {
        let mut solver = tank(scheme, length, gate, forces);
        // To and fro, so that every list has met its longest.
        let mut step = |n: usize| {
            let sway = Vector::new(2.0 * (0.3 * n as Real).sin(), 0.0, -9.81);
            let forcing = Forcing { body_force: sway, ..Forcing::default() };
            solver.open_gates(2e-4 * n as Real);
            solver.step(2e-4, &forcing, |_| ()).expect("the step is sound");
        };
        let begin = allocations_of_thread();
        step(0);
        // Negative control: the first step does.
        assert!(allocations_of_thread() > begin);
        (1..warm).for_each(&mut step);
        let before = allocations_of_thread();
        (warm..warm + 20).for_each(&mut step);
        allocations_of_thread() - before
    })
    .expect("the threads are granted");
    assert_eq!(allocations, 0);
}

#[test]
fn a_step_of_the_published_scheme_allocates_nothing_after_some() {
    a_step_allocates_nothing(Scheme::published(), 12, None, NO_FORCES);
}

#[test]
fn a_step_with_a_gate_that_rises_allocates_nothing_after_some() {
    let gate = Gate::closed(0, 8.0 * SPACING, [0.0, 14.0 * SPACING], 0.0, Some(0.1));
    a_step_allocates_nothing(Scheme::default(), 16, Some(gate), NO_FORCES);
}

#[test]
fn a_step_with_added_mass_and_lift_allocates_nothing_after_some() {
    a_step_allocates_nothing(Scheme::default(), 12, None, (AddedMassForm::Zuber, Lift::Mei));
}
