//! Sub-steps by what acts on a body: cubes with many contact spheres on each face, on planes and on each other.

use sazanami_dem::*;
use sazanami_numerics::domain::Domain;
use sazanami_numerics::grid::Grid;
use sazanami_numerics::snapshot::Snapshot;
use sazanami_numerics::{Real, Vector};
use sazanami_parallel::{Communicator, Solo, run_ranks};

use crate::support::{floor, snapshot_of};

const G: Vector = Vector::new(0.0, 0.0, -9.81);
/// Edge of the cubes \[m].
const EDGE: Real = 0.01;
/// Spheres along an edge, and their radius over it.
const ALONG: usize = 5;
const RADIUS: Real = 0.15;

fn cube() -> Body {
    let at = |i: usize| EDGE * (RADIUS - 0.5 + (1.0 - 2.0 * RADIUS) * i as Real / (ALONG - 1) as Real);
    let places = (0..ALONG.pow(3)).map(|n| [n % ALONG, n / ALONG % ALONG, n / ALONG.pow(2)]);
    let outer = places.filter(|place| place.iter().any(|&i| i == 0 || i == ALONG - 1));
    let centres: Vec<Vector> = outer.map(|place| Vector::from_array(place.map(at))).collect();
    let radii = vec![RADIUS * EDGE; centres.len()];
    let volume = EDGE.powi(3);
    Body::new(volume, Vector::splat(volume * EDGE * EDGE / 6.0), centres, radii, 0.0)
}

fn law(restitution: Real) -> LinearSpringDashpot {
    LinearSpringDashpot {
        normal_stiffness: 1e4,
        tangential_stiffness: 1e4,
        damping: Damping::Restitution(restitution),
        friction: 0.4,
        ..LinearSpringDashpot::SAND
    }
}

fn domain(communicator: Box<dyn Communicator>) -> Domain {
    let grid = Grid::new([16, 12, 8], Vector::ZERO, Vector::new(0.08, 0.06, 0.1));
    Domain::new(grid, [false; 3], communicator).expect("the case is sound")
}

fn setup(restitution: Real) -> Setup {
    let upper = Vector::new(0.08, 0.06, 0.1);
    let walls = Wall::of_box(Vector::ZERO, upper, 0, [[true; 2]; 3]);
    Setup { region: [Vector::ZERO, upper], ..crate::support::setup(vec![cube()], law(restitution), walls) }
}

fn grain(id: u64, place: Vector) -> Grain {
    Grain::new(id, 2000.0, EDGE * place)
}

#[test]
fn the_contacts_that_there_are_shorten_the_sub_step() {
    let domain = domain(Box::<Solo>::default());
    let pressed = |places: &[Vector]| {
        let grains: Vec<Grain> = (0..).zip(places).map(|(id, &place)| grain(id, place)).collect();
        let along = LinearSpringDashpot { tangential_stiffness: 1.0, ..law(0.2) };
        let setup = Setup { interactions: Interactions::uniform(1, along), ..setup(0.2) };
        let mut engine = Engine::new(&domain, setup, &grains).expect("the case is sound");
        let step = engine.contact_time_step();
        engine.advance(&domain, &Loads::none(), G, step, Substeps::Fixed(1)).expect("the case is sound");
        engine.present_time_step(&domain) / engine.contact_time_step()
    };
    let [middle, lowest] = [Vector::new(4.0, 3.0, 5.0), Vector::new(4.0, 3.0, 0.499)];
    assert_eq!([pressed(&[middle]), pressed(&[lowest])], [1.0; 2], "a face on a plane is foreseen");
    // Between two others that move it has twice the contacts of a face, which count twice, with the dashpots of half the mass.
    let tower = [lowest, lowest + 0.999 * Vector::Z, lowest + 1.998 * Vector::Z];
    let found = pressed(&tower);
    assert!((found / (0.5 / (4.0 * 0.25 * 0.5_f64.sqrt())) - 1.0).abs() < 0.1, "{found}");
    // A few contacts at once are stable however they are.
    let ball = |place: Vector| Grain { shape: 1, ..grain(9, place) };
    let both = Setup { bodies: vec![cube(), Body::ball(0.5 * EDGE)], ..setup(0.2) };
    let mut engine = Engine::new(&domain, both, &[ball(lowest)]).expect("the case is sound");
    let step = engine.contact_time_step();
    engine.advance(&domain, &Loads::none(), G, step, Substeps::Fixed(1)).expect("the case is sound");
    assert_eq!(engine.present_time_step(&domain), step);
}

/// Eight cubes that fall into a corner and onto each other, face to face.
fn heap() -> Vec<Grain> {
    let place =
        |id: u64| Vector::splat(0.52) + 1.02 * Vector::new((id % 2) as Real, (id / 2 % 2) as Real, (id / 4) as Real);
    (0..8).map(|id| grain(3 * id % 11, place(id))).collect()
}

/// State after some steps, and the sub-steps in each.
fn run(domain: &Domain, engine: &mut Engine, steps: usize) -> (Snapshot, Vec<usize>) {
    let step = |_| {
        engine
            .advance(domain, &Loads::none(), Vector::splat(-9.81), 1e-3, Substeps::Auto)
            .expect("the case is sound")
            .substeps
    };
    let substeps = (0..steps).map(step).collect();
    (snapshot_of(domain, engine), substeps)
}

#[test]
fn ranks_threads_and_interruptions_give_the_same_sub_steps_and_bits() {
    let whole = |c: Box<dyn Communicator>| {
        let domain = domain(c);
        let mut engine = Engine::new(&domain, setup(0.2), &heap()).expect("the case is sound");
        run(&domain, &mut engine, 40)
    };
    let expected = whole(Box::<Solo>::default());
    let fewest = expected.1.iter().min().expect("steps");
    assert!(expected.1.iter().any(|count| count > fewest), "contacts shorten some: {:?}", expected.1);
    for (ranks, threads) in [(1, 3), (2, 1), (4, 2)] {
        let found = run_ranks(ranks, threads, whole).expect("the case is sound");
        assert!(found[0].0 == expected.0, "{ranks} ranks, {threads} threads");
        assert!(found.iter().all(|(_, substeps)| *substeps == expected.1), "{ranks} ranks, {threads} threads");
    }
    let found = run_ranks(2, 1, |c| {
        let domain = domain(c);
        let mut engine = Engine::new(&domain, setup(0.2), &heap()).expect("the case is sound");
        let (half, _) = run(&domain, &mut engine, 31);
        let mut engine = Engine::restore(&domain, setup(0.2), "dem/", &half).expect("the case is sound");
        run(&domain, &mut engine, 9)
    })
    .expect("the case is sound");
    assert!(found[0].0 == expected.0 && found[0].1 == expected.1[31..]);
}

#[test]
fn contacts_that_drive_are_named_on_every_rank() {
    let outcome = |restitution: Real, substeps: Substeps| {
        run_ranks(2, 1, move |c| {
            let domain = domain(c);
            let grains = [grain(5, Vector::new(6.0, 3.0, 0.51)), grain(8, Vector::new(2.0, 3.0, 4.0))];
            let mut engine = Engine::new(&domain, setup(restitution), &grains).expect("the case is sound");
            let step = |_| {
                engine.advance(&domain, &Loads::none(), G, 1e-3, substeps).map(|report| report.contact_work.unwrap())
            };
            (0..100).map(step).collect::<Result<Vec<Real>, DemError>>()
        })
        .expect("the ranks run")
    };
    let driven = outcome(0.2, Substeps::Fixed(8));
    let named = |result: &Result<Vec<Real>, DemError>| matches!(result, Err(DemError::EnergyGained { id: 5, time, .. }) if *time > 0.0);
    assert!(driven.iter().any(named) && driven.iter().all(Result::is_err), "{driven:?}");
    // Negative control: with the sub-steps that it asks for it loses what it had, and nothing more.
    let rests = outcome(0.2, Substeps::Auto);
    let work: Real = rests[0].as_ref().expect("it rests").iter().sum();
    assert!(work < 0.0, "{work}");
}

#[test]
fn work_of_loads_drag_and_moving_walls_is_not_that_of_contacts() {
    let domain = domain(Box::<Solo>::default());
    let body = || Grain { velocity: Vector::new(0.1, 0.0, 0.2), ..grain(1, Vector::new(3.0, 3.0, 3.0)) };
    // A force, a torque, gravity and an added mass, without contact.
    let mut engine = Engine::new(&domain, setup(0.5), &[body()]).expect("the case is sound");
    let loads = Loads {
        force: &[Vector::new(0.01, -0.02, 0.03)],
        torque: &[Vector::new(0.0, 1e-6, 0.0)],
        added_mass: &[1e-3],
        drag: None,
    };
    let before = engine.grains().kinetic_energy(0);
    let report = engine.advance(&domain, &loads, G, 2e-3, Substeps::Auto).expect("the case is sound");
    let gained = engine.grains().kinetic_energy(0) - before;
    let work = report.contact_work.expect("it is booked");
    assert!(work.abs() < 1e-9 * gained.abs(), "{work} of {gained}");
    // A wall that comes up under a cube gives it its energy through the contacts, which lose some.
    let mut rising = setup(0.5);
    rising.walls = floor();
    let mut engine =
        Engine::new(&domain, rising, &[grain(1, Vector::new(3.0, 3.0, 0.501))]).expect("the case is sound");
    engine.set_wall_velocities(&domain, 0.2 * Vector::Z);
    let mut work = 0.0;
    for _ in 0..60 {
        let report = engine.advance(&domain, &Loads::none(), G, 1e-3, Substeps::Auto).expect("no gain");
        work += report.contact_work.expect("it is booked");
    }
    let lifted = 2000.0 * EDGE.powi(3) * (0.5 * 0.2_f64.powi(2) + 9.81 * 0.2 * 0.06);
    assert!((work / lifted - 1.0).abs() < 0.05, "{work}, not {lifted}");
}
