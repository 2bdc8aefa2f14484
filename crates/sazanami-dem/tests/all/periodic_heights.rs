//! A box that is periodic along x3 too: contacts across its upper side, on any number of ranks and after an interruption.

use sazanami_dem::*;
use sazanami_numerics::domain::Domain;
use sazanami_numerics::grid::Grid;
use sazanami_numerics::{Random, Real, Vector};
use sazanami_parallel::{Communicator, Solo, run_ranks};

use crate::support::snapshot_of;

/// Edge of the box \[m].
const EDGE: Real = 4e-3;

fn domain(communicator: Box<dyn Communicator>, periodic: [bool; 3]) -> Domain {
    Domain::new(Grid::new([12; 3], Vector::ZERO, Vector::splat(EDGE)), periodic, communicator).expect("it can be cut")
}

fn setup() -> Setup {
    let plain = crate::support::setup(vec![Body::ball(0.4e-3)], LinearSpringDashpot::SAND, vec![]);
    Setup { ghost_margin: 1e-3, ..plain }
}

/// `vector` with its components moved on by `turns` directions.
fn turned(vector: Vector, turns: usize) -> Vector {
    let [x, y, z] = vector.to_array();
    [Vector::new(x, y, z), Vector::new(y, z, x), Vector::new(z, x, y)][turns]
}

/// A loose lattice that streams upwards along x3 with random speeds, all directions moved on by `turns`.
fn grains(turns: usize) -> Vec<Grain> {
    let mut random = Random::new(3);
    (0..64)
        .map(|n| {
            let place = Vector::new((n % 4) as Real, (n / 4 % 4) as Real, (n / 16) as Real) + 0.45;
            let shake = Vector::from_array(std::array::from_fn(|_| random.between(-0.05, 0.05)));
            let speed = Vector::from_array(std::array::from_fn(|_| random.between(-1.0, 1.0)));
            Grain {
                velocity: turned(speed + 2.0 * Vector::Z, turns),
                ..Grain::new(n as u64, 2650.0, turned((place + shake) * 0.25 * EDGE, turns))
            }
        })
        .collect()
}

fn run(domain: &Domain, engine: &mut Engine, steps: usize) {
    for _ in 0..steps {
        engine.advance(domain, &Loads::none(), Vector::ZERO, 2e-5, Substeps::Fixed(20)).expect("nothing is lost");
    }
}

/// Positions after 2 ms.
fn streamed(periodic: [bool; 3], turns: usize) -> Vec<Vector> {
    let domain = domain(Box::<Solo>::default(), periodic);
    let mut engine = Engine::new(&domain, setup(), &grains(turns)).expect("the grains fit");
    run(&domain, &mut engine, 100);
    snapshot_of(&domain, &mut engine).vectors("dem/grain.position").expect("it holds them")
}

fn apart(a: &[Vector], b: &[Vector]) -> Real {
    a.iter().zip(b).map(|(a, b)| (*a - *b).length()).fold(0.0, Real::max) / EDGE
}

#[test]
fn all_directions_of_a_periodic_box_are_alike() {
    let upwards = streamed([true; 3], 0);
    for turns in [1, 2] {
        let along: Vec<Vector> = streamed([true; 3], turns).into_iter().map(|x| turned(x, 3 - turns)).collect();
        assert!(apart(&upwards, &along) < 1e-7, "{turns}: {}", apart(&upwards, &along));
    }
    // Negative control: without images along x3 the grains at its ends miss each other.
    assert!(apart(&upwards, &streamed([true, true, false], 0)) > 1e-3);
}

#[test]
fn ranks_and_an_interruption_change_no_bit_of_contacts_across_x3() {
    let whole = |communicator: Box<dyn Communicator>| {
        let domain = domain(communicator, [true; 3]);
        let mut engine = Engine::new(&domain, setup(), &grains(0)).expect("the grains fit");
        run(&domain, &mut engine, 60);
        snapshot_of(&domain, &mut engine)
    };
    let expected = whole(Box::<Solo>::default());
    for ranks in [2, 4] {
        assert!(run_ranks(ranks, 1, whole).expect("it runs")[0] == expected, "{ranks} ranks");
    }
    // Some contact crosses x3 at the break.
    let domain = domain(Box::<Solo>::default(), [true; 3]);
    let mut engine = Engine::new(&domain, setup(), &grains(0)).expect("the grains fit");
    let mut steps = 0;
    let at_break = loop {
        run(&domain, &mut engine, 1);
        steps += 1;
        let snapshot = snapshot_of(&domain, &mut engine);
        if snapshot.u32("dem/contact.image_3").expect("x3 is periodic").iter().any(|&image| image != 0) {
            break snapshot;
        }
        assert!(steps < 50, "no contact crosses x3");
    };
    let mut engine = Engine::restore(&domain, setup(), "dem/", &at_break).expect("the snapshot fits");
    run(&domain, &mut engine, 60 - steps);
    assert!(snapshot_of(&domain, &mut engine) == expected);
}
