//! Shifting moves particles down the concentration gradient and changes nothing else.

use crate::support::{Case, GRAVITY, NOTHING, OPEN_TOP, PERIODIC, SPACING, WALLS, jittered, under};
use sazanami_mps::Kind;
use sazanami_mps::scheme::{Scheme, ShiftingForm, SourceForm, SurfaceForm};
use sazanami_mps::solver::{Solver, StepReport};
use sazanami_numerics::Vector;

const DT: f64 = 2e-4;

fn shifted(case: &Case) -> Case {
    Case { scheme: Scheme { shifting: 0.5, ..case.scheme }, ..case.clone() }
}

fn stepped(case: &Case, body_force: Vector) -> (Solver, StepReport) {
    let mut solver = case.solo();
    let report = solver.step(DT, &under(body_force), |_| ()).expect("the step is sound");
    (solver, report)
}

/// Places and velocities of the fluid by number.
fn fluid(solver: &Solver) -> Vec<(Vector, Vector)> {
    let particles = solver.particles();
    let mut all: Vec<_> = (0..particles.owned())
        .filter(|&a| particles.kind[a] == Kind::Fluid)
        .map(|a| (particles.id[a], (particles.position[a], particles.velocity[a])))
        .collect();
    all.sort_by_key(|(id, _)| *id);
    all.into_iter().map(|(_, state)| state).collect()
}

#[test]
fn a_lattice_between_walls_is_not_shifted() {
    let mut case = shifted(&Case::filled([10, 8, 10], [10, 8, 10], [WALLS, PERIODIC, WALLS]));
    assert!(stepped(&case, GRAVITY).1.largest_shift < 1e-12 * SPACING);
    // Negative control: a displaced particle is shifted back towards its position.
    let away = Vector::new(0.1 * SPACING, 0.0, 0.0);
    let last = case.fluid.len() / 2;
    let home = case.fluid[last].position;
    case.fluid[last].position += away;
    let (solver, report) = stepped(&case, GRAVITY);
    let still = Case { scheme: Scheme { shifting: 0.0, ..case.scheme }, ..case.clone() };
    let without = fluid(&stepped(&still, GRAVITY).0)[last].0;
    assert!(report.largest_shift > 0.005 * SPACING);
    assert!((fluid(&solver)[last].0 - home).length() < 0.95 * (without - home).length());
}

#[test]
fn disorder_decreases_and_velocities_are_unchanged() {
    let mut case = Case::filled([8, 8, 8], [8, 8, 8], [PERIODIC; 3]);
    case.fluid = jittered(case.fluid, 0.2);
    // The flow time scale is finite only where the fluid moves.
    case.fluid.iter_mut().for_each(|particle| particle.velocity = Vector::new(0.25, 0.0, 0.0));
    case.scheme.stabilisation = None;
    // The strain at the start of the second step is what the first one left.
    let second = |case: &Case| {
        let (mut solver, _) = stepped(case, Vector::ZERO);
        let velocities: Vec<Vector> = fluid(&solver).into_iter().map(|(_, u)| u).collect();
        let report = solver.step(DT, &under(Vector::ZERO), |_| ()).expect("the step is sound");
        (velocities, report.strain[1])
    };
    let (before, disorder) = second(&case);
    let (after, evened) = second(&shifted(&case));
    assert!(before == after, "shifting is to leave velocities alone");
    assert!(evened < 0.8 * disorder, "{evened} {disorder}");
}

#[test]
fn particles_near_the_surface_are_not_shifted() {
    let mut case = Case::filled([10, 8, 16], [10, 8, 12], [WALLS, PERIODIC, OPEN_TOP]);
    case.fluid = jittered(case.fluid, 0.1);
    let plain = fluid(&stepped(&case, GRAVITY).0);
    let moved = fluid(&stepped(&shifted(&case), GRAVITY).0);
    let mut counts = [0; 2];
    for (before, after) in plain.iter().zip(&moved) {
        // Particles of the top layer lie at 11.5 spacings.
        let depth = 11.5 - before.0.z / SPACING;
        if depth < 2.5 {
            assert!(before == after, "at a depth of {depth} spacings");
            counts[0] += 1;
        } else if depth > 4.0 {
            counts[1] += usize::from(before != after);
        }
    }
    assert!(counts[0] > 100 && counts[1] > 400, "{counts:?}");
}

/// A block in the air, shifted as fast as it deforms; its pressure stays zero in linear flows without divergence.
fn block_in_the_air(velocity: impl Fn(Vector) -> Vector, jitter: f64) -> Case {
    let mut case = Case::filled([20, 8, 20], [10, 8, 10], [NOTHING, PERIODIC, NOTHING]);
    case.fluid = jittered(case.fluid, jitter);
    let room = 5.0 * SPACING * Vector::new(1.0, 0.0, 1.0);
    for particle in &mut case.fluid {
        particle.position += room;
        particle.velocity = velocity(particle.position - Vector::splat(10.0 * SPACING));
    }
    case.viscosity = 0.0;
    case.scheme = Scheme {
        source: SourceForm::Corrected,
        surface_test: SurfaceForm::Cone,
        stabilisation: None,
        relaxation: f64::INFINITY,
        shifting: 0.5,
        shifting_form: ShiftingForm::Strain,
        ..Scheme::default()
    };
    case
}

#[test]
fn nothing_is_shifted_by_strain_at_rest_or_where_water_only_travels() {
    let travelling = Vector::new(0.3, 0.0, -0.2);
    for velocity in [Vector::ZERO, travelling] {
        let (_, report) = stepped(&block_in_the_air(|_| velocity, 0.2), Vector::ZERO);
        assert!(report.largest_shift < 1e-9 * SPACING, "{velocity}: {}", report.largest_shift);
    }
    // Negative control: the same disorder in a flow that stretches.
    let (_, report) = stepped(&block_in_the_air(|x| 20.0 * Vector::new(x.x, 0.0, -x.z), 0.2), Vector::ZERO);
    assert!(report.largest_shift > 1e-3 * SPACING, "{}", report.largest_shift);
}

#[test]
fn velocities_of_a_linear_flow_are_carried_to_the_shifted_places() {
    // So slow that what a step leaves of its divergence is below the tolerance of the pressure.
    let rate = 0.1;
    let case = block_in_the_air(|x| rate * Vector::new(x.x, 0.0, -x.z), 0.2);
    let still = Case { scheme: Scheme { shifting: 0.0, ..case.scheme }, ..case.clone() };
    let (solver, report) = stepped(&case, Vector::ZERO);
    let (plain, moved) = (fluid(&stepped(&still, Vector::ZERO).0), fluid(&solver));
    // Positions have moved for a step, velocities not: the field over the new places.
    let flow = |x: Vector| rate * Vector::new(x.x / (1.0 + rate * DT), 0.0, -x.z / (1.0 - rate * DT));
    let (mut carried, mut kept) = (0.0_f64, 0.0_f64);
    for (before, after) in plain.iter().zip(&moved) {
        let way = after.0 - before.0;
        carried = carried.max((after.1 - before.1 - flow(way)).length());
        kept = kept.max(flow(way).length());
    }
    assert!(carried < 1e-6 * kept && kept > 1e-10, "{carried} {kept}");
    let change: Vector = moved.iter().zip(&plain).map(|(after, before)| after.1 - before.1).sum();
    let impulse = solver.particle_mass() * change;
    assert!((report.shifting_impulse - impulse).length() < 1e-9 * solver.particle_mass() * kept);
    assert!(report.impulses.contact.length() < 1e-5 * impulse.length(), "no wall has touched the water");
}

#[test]
fn particles_at_a_flat_surface_are_shifted_along_it() {
    // The second row of a lattice, moved up by a quarter, pushes the first one, which may not leave the surface.
    let mut case = block_in_the_air(|x| 20.0 * Vector::new(x.x, 0.0, -x.z), 0.0);
    let second = |x: Vector| (x.z / SPACING - 13.5).abs() < 0.01;
    case.fluid.iter_mut().filter(|particle| second(particle.position)).for_each(|particle| {
        particle.position.z += 0.25 * SPACING;
    });
    let still = Case { scheme: Scheme { shifting: 0.0, ..case.scheme }, ..case.clone() };
    let (plain, moved) = (fluid(&stepped(&still, Vector::ZERO).0), fluid(&stepped(&case, Vector::ZERO).0));
    let ways = |row: f64| {
        let inside = |x: Vector| (x.x / SPACING - 10.0).abs() < 2.0;
        let near = move |x: Vector| (x.z / SPACING - row).abs() < 0.2 && inside(x);
        let pairs = plain.iter().zip(&moved).filter(move |(before, _)| near(before.0));
        pairs.map(|(before, after)| (after.0 - before.0).z / SPACING).collect::<Vec<_>>()
    };
    assert!(ways(14.5).iter().all(|way| way.abs() < 1e-6) && !ways(14.5).is_empty(), "{:?}", ways(14.5));
    // Negative control: the row below goes back, and downwards.
    assert!(ways(13.75).iter().all(|&way| way < -1e-4) && !ways(13.75).is_empty(), "{:?}", ways(13.75));
}
