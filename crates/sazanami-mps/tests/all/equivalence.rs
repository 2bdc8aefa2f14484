//! Results do not depend on threads and restarts, nor on ranks up to rounding.

use crate::support::{Case, GRAVITY, OPEN_TOP, PERIODIC, SPACING, WALLS, jittered, under};
use sazanami_dem::{Engine, Grain, Motion};
use sazanami_mps::grains::{DragIntegration, OverlappingGrains};
use sazanami_mps::snapshot::GRAINS;
use sazanami_mps::solver::{Forcing, Solver};
use sazanami_mps::stability::Limit;
use sazanami_numerics::snapshot::{Section, Snapshot};
use sazanami_numerics::{Real, Vector};
use sazanami_parallel::{Communicator, Solo, run_ranks, with_threads};

const DT: Real = 2e-4;

/// A tank that is shaken, part filled, with some grains falling through the water.
pub fn shaken() -> Case {
    let mut case = Case::filled([16, 8, 14], [10, 8, 8], [WALLS, PERIODIC, OPEN_TOP]);
    case.fluid = jittered(case.fluid, 0.05);
    case.grains = (0..24)
        .map(|id| {
            let place = Vector::new((id % 6) as Real * 1.3 + 1.1, (id / 6) as Real * 2.0 + 0.3, 2.0 + (id % 3) as Real);
            Grain::new(id, 2650.0, SPACING * place)
        })
        .collect();
    case
}

pub fn go_on(solver: &mut Solver, from: usize, steps: usize) {
    for n in from..from + steps {
        let phase = 60.0 * DT * n as Real;
        let forcing = Forcing { body_force: GRAVITY + Vector::new(3.0 * phase.sin(), 0.0, 0.0), ..Forcing::default() };
        solver.open_gates(DT * n as Real);
        solver.step(DT, &forcing, |_| ()).expect("the step is sound");
    }
}

pub fn state(case: &Case, communicator: Box<dyn Communicator>, steps: usize) -> Snapshot {
    let mut solver = case.on(communicator);
    go_on(&mut solver, 0, steps);
    solver.snapshot()
}

/// The state after some steps does not depend on threads.
pub fn threads_agree(case: &Case) {
    let on = |case: &Case, threads: usize| {
        with_threads(threads, || state(case, Box::<Solo>::default(), 12)).expect("the threads are granted")
    };
    let one = on(case, 1);
    assert!(on(case, 2) == one && on(case, 4) == one);
    // Negative control: a particle displaced by 1e-12 m changes the bits.
    let mut other = case.clone();
    other.fluid[5].position.x += 1e-12;
    assert!(on(&other, 1) != one);
}

/// A restart continues with the same bits, and would not without the section `needed` of its state.
pub fn restart_agrees(case: &Case, needed: &str) {
    let whole = state(case, Box::<Solo>::default(), 14);
    let half = state(case, Box::<Solo>::default(), 6);
    let resumed = |half: &Snapshot| {
        let mut solver = restored(case, half);
        go_on(&mut solver, 6, 8);
        solver.snapshot()
    };
    assert!(resumed(&half) == whole);
    let mut forgetful = half.clone();
    let kept = half.reals(needed).expect("it is kept");
    forgetful.put_reals(needed, vec![0.0; kept.len()]);
    assert!(resumed(&forgetful) != whole);
}

/// Ranks give the same state up to rounding.
pub fn ranks_agree(mut case: Case) {
    case.tolerance.strain = 1e-10;
    // Rounding errors grow; after more steps they would change the role of a particle at the surface.
    let one = state(&case, Box::<Solo>::default(), 4);
    for ranks in [2, 3, 4] {
        let states = run_ranks(ranks, 1, |communicator| state(&case, communicator, 4)).expect("the ranks run");
        let (found, name) = difference(&one, &states[0]);
        assert!(found < 1e-5, "{ranks} ranks: {name} differs by {found:e}");
    }
    // Negative control: a particle a hundredth of its spacing elsewhere is no difference of rounding.
    case.fluid[5].position.x += 0.01 * SPACING;
    let (found, name) = difference(&one, &state(&case, Box::<Solo>::default(), 4));
    assert!(found > 1e-4, "{name} differs by {found:e}");
}

#[test]
fn results_do_not_depend_on_threads() {
    threads_agree(&shaken());
}

#[test]
fn a_restart_continues_with_the_same_bits() {
    restart_agrees(&shaken(), "fluid/gradient");
}

#[test]
fn ranks_agree_up_to_rounding() {
    ranks_agree(shaken());
}

/// A box full of water off its lattice, without a grain: nothing fixes the level of its pressure.
fn full() -> Case {
    let mut case = Case::filled([10, 8, 10], [10, 8, 10], [WALLS, PERIODIC, WALLS]);
    case.fluid = jittered(case.fluid, 0.05);
    case
}

#[test]
fn a_full_box_agrees_over_threads_and_ranks_and_after_a_restart() {
    threads_agree(&full());
    restart_agrees(&full(), "fluid/pressure");
    ranks_agree(full());
}

/// A solver restored from a snapshot on ranks.
fn restored_on(case: &Case, state: &Snapshot, communicator: Box<dyn Communicator>) -> Solver {
    let domain = case.domain(communicator);
    let grains = if case.grains.is_empty() {
        OverlappingGrains::none(&domain).expect("no grains")
    } else {
        let engine = Engine::restore(&domain, case.setup(), GRAINS, state).expect("a sound state of the grains");
        OverlappingGrains::new(&domain, engine, case.coupling())
    };
    Solver::restore(domain, case.settings(), case.tank(), grains, state).expect("a sound state of the fluid")
}

/// A solver restored from a snapshot.
pub fn restored(case: &Case, state: &Snapshot) -> Solver {
    restored_on(case, state, Box::<Solo>::default())
}

/// Grains that cross the cuts between the ranks belong to the rank where they lie, before a restart and after it.
#[test]
fn a_restart_on_ranks_continues_with_the_same_bits() {
    let mut case = shaken();
    let cut = case.domain(Box::<Solo>::default()).grid().extent().x / 2.0;
    for (n, grain) in case.grains.iter_mut().enumerate() {
        grain.position.x = cut + SPACING * (0.37 * (n % 5) as Real - 0.7);
        grain.position.z = SPACING * (1.0 + 1.1 * (n % 6) as Real);
        grain.velocity.x = 0.05 * (n as Real - 12.0);
    }
    for ranks in [2, 4] {
        let on = |steps: usize| run_ranks(ranks, 1, |c| state(&case, c, steps)).unwrap().swap_remove(0);
        let [begun, half, whole] = [on(0), on(9), on(24)];
        let side = |state: &Snapshot| -> Vec<bool> {
            state.vectors("grains/grain.position").unwrap().iter().map(|x| x.x < cut).collect()
        };
        assert!(side(&begun) != side(&half) && side(&half) != side(&whole), "grains cross");
        let resumed = run_ranks(ranks, 1, |c| {
            let mut solver = restored_on(&case, &half, c);
            go_on(&mut solver, 9, 15);
            solver.snapshot()
        });
        let (found, name) = difference(&whole, &resumed.unwrap()[0]);
        assert!(found == 0.0, "{ranks} ranks: {name} differs by {found:e}");
    }
}

#[test]
fn a_restart_continues_while_grains_cross_a_periodic_side_in_fast_flow() {
    let mut case = shaken();
    let swirl = |x: Vector| Vector::new(0.2 * (700.0 * x.z).sin(), 0.5, 0.1 * (500.0 * x.x).cos());
    case.fluid.iter_mut().for_each(|p| p.velocity = swirl(p.position));
    // Pairs that touch across the side, or will.
    let grain = |n: u64| {
        let place = Vector::new(1.0 + 1.02 * (n % 8) as Real, [7.7, 0.65][n as usize / 8 % 2], 1.0 + (n / 16) as Real);
        Grain { velocity: Vector::new(0.0, 0.4, 0.0), ..Grain::new(n, 2650.0, SPACING * place) }
    };
    case.grains = (0..48).map(grain).collect();
    let mut solver = case.solo();
    let mut states = Vec::new();
    let mut crossings = 0;
    let across = |solver: &Solver| {
        let grains = solver.grains().engine().grains();
        let mut places: Vec<(u64, Real)> = (0..grains.owned()).map(|g| (grains.id[g], grains.position[g].y)).collect();
        places.sort_by_key(|place| place.0);
        places
    };
    for n in 0..24 {
        states.push(solver.snapshot());
        let before = across(&solver);
        go_on(&mut solver, n, 1);
        let jump = |(a, b): (&(u64, Real), &(u64, Real))| (a.1 - b.1).abs() > 4.0 * SPACING;
        crossings += before.iter().zip(&across(&solver)).filter(|pair| jump(*pair)).count();
    }
    assert!(crossings > 20, "{crossings}");
    let whole = solver.snapshot();
    for from in [3, 10, 15, 23] {
        let mut solver = restored(&case, &states[from]);
        go_on(&mut solver, from, 24 - from);
        assert!(solver.snapshot() == whole, "from step {from}");
    }
    // Negative control: one step left out.
    let mut solver = restored(&case, &states[10]);
    go_on(&mut solver, 11, 13);
    assert!(solver.snapshot() != whole);
}

/// A bed of two layers in a fast flow, of which the lower is glued: most grains beside the periodic sides have images
/// beyond them.
fn bed_in_a_jet() -> Case {
    let mut case = Case::filled([16, 8, 12], [16, 8, 9], [WALLS, PERIODIC, OPEN_TOP]);
    case.fluid.retain(|p| p.position.z > 2.0 * SPACING);
    let jet = |x: Vector| Vector::new(0.1 * (900.0 * x.y).sin(), 0.25 * (400.0 * x.x).cos(), 0.0);
    case.fluid.iter_mut().for_each(|p| p.velocity = jet(p.position));
    case.grains = (0..15 * 7 * 2)
        .map(|n| {
            let place = Vector::new(0.6 + 1.04 * (n % 15) as Real, 0.3 + 1.13 * (n / 15 % 7) as Real, 0.5);
            let motion = if n < 15 * 7 { Motion::WithWalls } else { Motion::Free };
            let place = place + (n / 105) as Real * Vector::new(0.1, 0.2, 1.0);
            let velocity = if motion == Motion::Free { jet(SPACING * place) } else { Vector::ZERO };
            Grain { motion, velocity, ..Grain::new(n, 2650.0, SPACING * place) }
        })
        .collect();
    case
}

/// A step of a tank whose walls move by `amplitude` \[m], seen from the laboratory.
fn shake(solver: &mut Solver, n: usize, amplitude: Real) {
    let rate = 60.0;
    let at = |n: usize| rate * DT * n as Real;
    let forcing = Forcing {
        body_force: GRAVITY,
        wall_displacement: amplitude * at(n + 1).sin() * Vector::X,
        wall_velocity: amplitude * (at(n + 1).sin() - at(n).sin()) / DT * Vector::X,
        ..Forcing::default()
    };
    solver.step(DT, &forcing, |_| ()).expect("the step is sound");
}

#[test]
fn a_restart_at_any_step_continues_above_a_bed_in_a_moving_tank() {
    let case = bed_in_a_jet();
    let known = |solver: &Solver| solver.grains().engine().grains().len();
    for amplitude in [0.0, 0.5 * SPACING] {
        let mut solver = case.solo();
        let mut before = solver.snapshot();
        let mut chances = 0;
        for n in 0..40 {
            let mut other = restored(&case, &before);
            // Restored and continued solver may know different ghosts.
            chances += usize::from(known(&other) != known(&solver));
            shake(&mut solver, n, amplitude);
            shake(&mut other, n, amplitude);
            before = solver.snapshot();
            assert!(other.snapshot() == before, "{amplitude} m, from step {n}");
        }
        assert!(chances > 10, "{chances}");
        // Negative control: another step.
        let mut other = restored(&case, &before);
        shake(&mut solver, 40, amplitude);
        shake(&mut other, 41, amplitude + 1e-6);
        assert!(other.snapshot() != solver.snapshot());
    }
}

/// Largest difference of two states' numbers over the largest of each section.
pub fn difference(a: &Snapshot, b: &Snapshot) -> (Real, String) {
    let mut worst = (0.0, String::new());
    for ((name, a), (_, b)) in a.sections().zip(b.sections()) {
        match (a, b) {
            (Section::F64(a), Section::F64(b)) => {
                assert_eq!(a.len(), b.len(), "{name}");
                let scale = a.iter().fold(1e-12, |m: Real, v| m.max(v.abs()));
                let found = a.iter().zip(b).fold(0.0, |m: Real, (a, b)| m.max((a - b).abs())) / scale;
                if found > worst.0 {
                    worst = (found, name.to_owned());
                }
            }
            _ => assert!(a == b, "{name}"),
        }
    }
    worst
}

/// Grains in dry air feel no drag: the rate of fluid at rest limits the first step alone, also after a restart.
#[test]
fn dry_grains_are_limited_by_drag_in_the_first_step_alone() {
    let mut case = crate::drag::filter(1e-4, 0.0);
    (case.drag_integration, case.limits.longest) = (DragIntegration::Explicit, 1e-2);
    case.fluid.retain(|particle| particle.position.z < 3.0 * SPACING);
    case.grains.retain(|grain| grain.position.z > 8.0 * SPACING);
    let mut solver = case.solo();
    let first = solver.stable_step(Vector::ZERO);
    assert_eq!(first.limit, Limit::Drag);
    assert_eq!(restored(&case, &solver.snapshot()).stable_step(Vector::ZERO).dt.to_bits(), first.dt.to_bits());
    solver.step(1e-5, &under(Vector::ZERO), |_| ()).expect("a sound step");
    let next = solver.stable_step(Vector::ZERO);
    assert!(next.limit != Limit::Drag && next.dt > first.dt, "{next:?} {first:?}");
    assert_eq!(restored(&case, &solver.snapshot()).stable_step(Vector::ZERO).dt.to_bits(), next.dt.to_bits());
}
