//! Shifting moves particles down the concentration gradient and changes nothing else.

use crate::support::{Case, GRAVITY, OPEN_TOP, PERIODIC, SPACING, WALLS, jittered, under};
use sazanami_mps::Kind;
use sazanami_mps::scheme::Scheme;
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
