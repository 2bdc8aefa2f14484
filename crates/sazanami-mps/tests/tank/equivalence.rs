//! Threads, restarts and ranks do not change what a solver finds.

use crate::support::{Case, GRAVITY, OPEN_TOP, PERIODIC, SPACING, WALLS, jittered};
use sazanami_dem::{Engine, Grain};
use sazanami_mps::grains::GrainPhase;
use sazanami_mps::snapshot::GRAINS;
use sazanami_mps::solver::{Forcing, Solver};
use sazanami_numerics::snapshot::{Section, Snapshot};
use sazanami_numerics::{Real, Vector};
use sazanami_parallel::{Communicator, Solo, run_ranks, with_threads};

const DT: Real = 2e-4;

/// A tank that is shaken, part filled, with some grains falling through the water.
fn shaken() -> Case {
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

fn go_on(solver: &mut Solver, from: usize, steps: usize) {
    for n in from..from + steps {
        let phase = 60.0 * DT * n as Real;
        let forcing = Forcing { body_force: GRAVITY + Vector::new(3.0 * phase.sin(), 0.0, 0.0), ..Forcing::default() };
        solver.step(DT, &forcing, |_| ()).expect("the step is sound");
    }
}

fn state(case: &Case, communicator: Box<dyn Communicator>, steps: usize) -> Snapshot {
    let mut solver = case.on(communicator);
    go_on(&mut solver, 0, steps);
    solver.snapshot()
}

#[test]
fn threads_do_not_matter() {
    let case = shaken();
    let on = |threads: usize| with_threads(threads, || state(&case, Box::<Solo>::default(), 12));
    let one = on(1);
    assert!(on(2) == one && on(4) == one);
    // Negative control: a particle a hair elsewhere changes the bits.
    let mut other = case.clone();
    other.fluid[5].position.x += 1e-12;
    assert!(with_threads(1, || state(&other, Box::<Solo>::default(), 12)) != one);
}

#[test]
fn a_restart_goes_on_with_the_same_bits() {
    let case = shaken();
    let whole = state(&case, Box::<Solo>::default(), 14);
    let half = state(&case, Box::<Solo>::default(), 6);
    let domain = case.domain(Box::<Solo>::default());
    let engine = Engine::restore(&domain, case.setup(), GRAINS, &half).unwrap();
    let grains = GrainPhase::new(&domain, engine, case.coupling());
    let mut solver = Solver::restore(domain, case.settings(), case.tank(), grains, &half).unwrap();
    go_on(&mut solver, 6, 8);
    assert!(solver.snapshot() == whole);
    // Negative control: without the gradient of the last pressure it goes on otherwise.
    let mut forgetful = half.clone();
    let gradient = half.reals("fluid/gradient").unwrap();
    forgetful.put_reals("fluid/gradient", vec![0.0; gradient.len()]);
    let domain = case.domain(Box::<Solo>::default());
    let engine = Engine::restore(&domain, case.setup(), GRAINS, &half).unwrap();
    let grains = GrainPhase::new(&domain, engine, case.coupling());
    let mut solver = Solver::restore(domain, case.settings(), case.tank(), grains, &forgetful).unwrap();
    go_on(&mut solver, 6, 8);
    assert!(solver.snapshot() != whole);
}

/// Largest difference of two states' numbers over the largest of each section.
fn difference(a: &Snapshot, b: &Snapshot) -> (Real, String) {
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

#[test]
fn ranks_find_the_same() {
    let mut case = shaken();
    case.tolerance.strain = 1e-10;
    // Rounding grows; after some more steps it would decide about a particle at the surface.
    let one = state(&case, Box::<Solo>::default(), 4);
    for ranks in [2, 3, 4] {
        let states = run_ranks(ranks, 1, |communicator| state(&case, communicator, 4)).unwrap();
        let (found, name) = difference(&one, &states[0]);
        assert!(found < 1e-5, "{ranks} ranks: {name} differs by {found:e}");
    }
    // Negative control: a particle a hundredth of its spacing elsewhere is no difference of rounding.
    case.fluid[5].position.x += 0.01 * SPACING;
    let (found, name) = difference(&one, &state(&case, Box::<Solo>::default(), 4));
    assert!(found > 1e-4, "{name} differs by {found:e}");
}
