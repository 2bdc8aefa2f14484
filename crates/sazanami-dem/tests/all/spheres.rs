//! Spheres of 1 mm with the law of the overlapping method: single contacts, stacks, memory.

use sazanami_dem::*;
use sazanami_numerics::domain::Domain;
use sazanami_numerics::grid::Grid;
use sazanami_numerics::{Random, Real, Vector};

use crate::support::{domain, setup, snapshot_of};

const RADIUS: Real = 0.5e-3;
const STIFFNESS: Real = 400.0;
const GRAVITY: Vector = Vector::new(0.0, 0.0, -9.81);
const LAW: LinearSpringDashpot = LinearSpringDashpot::spheres(STIFFNESS, 0.5, 0.4);

fn engine(law: LinearSpringDashpot, floor: bool, grains: &[Grain]) -> Engine {
    let walls = if floor { crate::support::floor() } else { vec![] };
    Engine::new(&domain(), setup(vec![Body::ball(RADIUS)], law, walls), grains).expect("the case is sound")
}

fn with(e: Real) -> LinearSpringDashpot {
    LinearSpringDashpot::spheres(STIFFNESS, e, 0.4)
}

/// Duration of an impact without tension over `sqrt(m*/K)`: the force vanishes before the overlap does.
fn duration(e: Real) -> Real {
    let gamma = damping_ratio(e, false);
    let s = (1.0 - gamma * gamma).sqrt();
    (std::f64::consts::PI - (2.0 * gamma * s).atan2(s * s - gamma * gamma)) / s
}

/// Two balls that meet at 0.2 m/s, or one that meets the floor at 0.1 m/s, with `steps` in `pi sqrt(m*/K)`: speed after
/// over speed before, the time over which they push, over `sqrt(m*/K)`, and the strongest pull over the strongest push.
fn impact(e: Real, floor: bool, steps: Real) -> [Real; 3] {
    let ball = |id: u64, z: Real, v: Real| Grain { velocity: v * Vector::Z, ..Grain::new(id, 2650.0, z * Vector::Z) };
    let z = RADIUS * (1.0 + 1e-7);
    let grains = if floor { vec![ball(1, z, -0.1)] } else { vec![ball(1, z, -0.1), ball(2, -z, 0.1)] };
    let mut engine = engine(with(e), floor, &grains);
    let mass = engine.grains().mass[0];
    let period = ((if floor { mass } else { 0.5 * mass }) / STIFFNESS).sqrt();
    let h = std::f64::consts::PI * period / steps;
    let (mut time, mut push, mut pull) = (0.0, 0.0_f64, 0.0_f64);
    for _ in 0..(1.5 * steps) as usize {
        engine.advance(&domain(), &Loads::none(), Vector::ZERO, h, Substeps::Fixed(1)).expect("they bounce");
        let force = engine.grains().contact_force[0].z;
        (push, pull) = (push.max(force), pull.max(-force));
        time += if force > 0.0 { h / period } else { 0.0 };
    }
    [engine.grains().velocity[0].z / 0.1, time, pull / push]
}

#[test]
fn impacts_have_the_restitution_and_duration_asked_for() {
    for floor in [false, true] {
        for e in [0.3, 0.5, 0.9, 1.0] {
            let [coarse, _, pull] = impact(e, floor, 20.0);
            let [fine, time, _] = impact(e, floor, 1000.0);
            println!("floor {floor}, e {e}: {coarse} at 20 steps, {fine} at 1000, lasts {time} ({})", duration(e));
            // The dashpot acts with the velocity of half a sub-step ago: an error of first order.
            let middle = impact(e, floor, 50.0)[0];
            assert!((coarse - e).abs() < 1.2e-2 && (fine - e).abs() < 3e-4, "{e}: {coarse} {fine}");
            assert!(e < 0.5 || (middle / e - 1.0).abs() < 5e-3, "{e}: {middle}");
            assert!((time / duration(e) - 1.0).abs() < 1e-2, "{e}: {time}");
            assert_eq!(pull, 0.0);
        }
        // Energy of an impact without loss.
        assert!((impact(1.0, floor, 1000.0)[0].powi(2) - 1.0).abs() < 1e-4);
    }
    // Negative control: half a period is not how long it lasts, and with tension it rebounds otherwise.
    let half = std::f64::consts::PI / (1.0 - damping_ratio(0.5, false).powi(2)).sqrt();
    assert!((impact(0.5, true, 1000.0)[1] / half - 1.0).abs() > 5e-2);
    assert!((restitution(damping_ratio(0.5, false), true) - 0.5).abs() > 2e-2);
}

/// Lets the grains come to rest.
fn settle(engine: &mut Engine, time: Real) -> ContactReport {
    engine.advance(&domain(), &Loads::none(), GRAVITY, time, Substeps::Auto).expect("they settle")
}

#[test]
fn a_column_of_ten_carries_its_weight() {
    let at = |i: u64| (2 * i + 1) as Real * RADIUS * Vector::Z;
    let grains: Vec<Grain> = (0..10).map(|i| Grain::new(i, 2650.0, at(i))).collect();
    let mut engine = engine(with(0.1), true, &grains);
    settle(&mut engine, 0.5);
    let h = engine.contact_time_step();
    let report = engine.advance(&domain(), &Loads::none(), GRAVITY, h, Substeps::Fixed(1)).expect("they rest");
    let grains = engine.grains();
    let weight = grains.mass[0] * 9.81;
    for i in 0..10 {
        let below = if i == 0 { -RADIUS } else { grains.position[i - 1].z };
        let overlap = 2.0 * RADIUS - (grains.position[i].z - below);
        let expected = (10 - i) as Real * weight / STIFFNESS;
        assert!((overlap / expected - 1.0).abs() < 1e-6, "{i}: {overlap} {expected}");
        // Each carries the next: what its contacts give is its own weight.
        assert!((grains.contact_force[i].z / weight - 1.0).abs() < 1e-6, "{i}: {}", grains.contact_force[i]);
    }
    let on_floor = -report.impulse_on_walls.z / h;
    assert!((on_floor / (10.0 * weight) - 1.0).abs() < 1e-6, "{on_floor}");
    // Negative control: the column as it was put is not yet at rest.
    assert!(2.0 * RADIUS - (at(1) - at(0)).z < 0.01 * weight / STIFFNESS);
}

/// Tangential displacement of the only contact \[m].
fn memory(engine: &mut Engine) -> Vec<Real> {
    let snapshot = snapshot_of(&domain(), engine);
    snapshot.vectors("dem/contact.displacement").expect("contacts are stored").iter().map(|d| d.length()).collect()
}

#[test]
fn memory_ends_with_the_contact() {
    let mut engine = engine(LAW, true, &[Grain::new(1, 2650.0, 0.99 * RADIUS * Vector::Z)]);
    let advance = |engine: &mut Engine, velocity: Vector| {
        engine.set_velocity(0, velocity, Vector::ZERO);
        engine.advance(&domain(), &Loads::none(), Vector::ZERO, 1e-6, Substeps::Fixed(1)).expect("it moves");
        memory(engine)
    };
    let is = |found: &[Real], expected: Real| found.len() == 1 && (found[0] - expected).abs() < 1e-12;
    let along = advance(&mut engine, 1e-3 * Vector::X);
    assert!(is(&along, 1e-9), "{along:?}");
    // Negative control: while the contact lasts it remembers.
    let still = advance(&mut engine, Vector::ZERO);
    assert!(is(&still, 1e-9), "{still:?}");
    assert!(advance(&mut engine, 40.0 * Vector::Z).is_empty(), "lifted it forgets");
    assert!(advance(&mut engine, -40.0 * Vector::Z).is_empty());
    let again = advance(&mut engine, Vector::ZERO);
    assert!(is(&again, 0.0), "{again:?}");
}

#[test]
fn the_tangential_spring_swings_with_the_normal_one() {
    // A ball that sticks and turns: its effective mass at the contact is 2/7 of its mass, so that with K_t/K_n = 2/7
    // the tangential velocity of its surface has turned round when it leaves, if nothing is lost.
    let out = |ratio: Real| {
        let law = LinearSpringDashpot {
            tangential_stiffness: ratio * STIFFNESS,
            damping: Damping::Restitution(1.0),
            friction: 1e3,
            ..LAW
        };
        let velocity = Vector::new(1e-3, 0.0, -0.01);
        let grain = Grain { velocity, ..Grain::new(1, 2650.0, RADIUS * (1.0 + 1e-7) * Vector::Z) };
        let mut engine = engine(law, true, &[grain]);
        let time = std::f64::consts::PI * (engine.grains().mass[0] / STIFFNESS).sqrt();
        engine.advance(&domain(), &Loads::none(), Vector::ZERO, 1.1 * time, Substeps::Fixed(4000)).expect("it bounces");
        let grains = engine.grains();
        assert!(grains.velocity[0].z > 0.0);
        (grains.velocity[0].x - RADIUS * grains.angular_velocity(0).y) / 1e-3
    };
    assert!((out(2.0 / 7.0) + 1.0).abs() < 1e-2, "{}", out(2.0 / 7.0));
    // Negative control: with K_t = K_n it does not come out so.
    assert!((out(1.0) + 1.0).abs() > 0.1, "{}", out(1.0));
}

#[test]
fn unequal_balls_share_an_impact_by_their_masses() {
    // Sizes, densities and materials of their own, in one contact: momentum and restitution decide.
    let mut interactions = Interactions::uniform(2, with(1.0));
    interactions.set(0, 1, with(0.5));
    let setup = Setup { interactions, ..setup(vec![Body::ball(RADIUS)], LAW, vec![]) };
    let small = Grain { velocity: 0.2 * Vector::X, ..Grain::new(1, 2650.0, Vector::ZERO) };
    let place = RADIUS * (2.5 + 1e-6) * Vector::X;
    let large = Grain { scale: 1.5, material: 1, ..Grain::new(2, 1400.0, place) };
    let mut engine = Engine::new(&domain(), setup, &[small, large]).expect("the case is sound");
    engine.advance(&domain(), &Loads::none(), Vector::ZERO, 1e-3, Substeps::Fixed(4000)).expect("they meet");
    let grains = engine.grains();
    let [m, n] = [grains.mass[0], grains.mass[1]];
    let (common, relative) = (m * 0.2 / (m + n), 0.5 * 0.2);
    let expected = [common - n / (m + n) * relative, common + m / (m + n) * relative];
    assert!((grains.velocity[0].x - expected[0]).abs() < 1e-4, "{} {expected:?}", grains.velocity[0]);
    assert!((grains.velocity[1].x - expected[1]).abs() < 1e-4, "{} {expected:?}", grains.velocity[1]);
}

#[test]
fn a_contact_across_a_periodic_side_counts_once() {
    let edge = 10.0 * RADIUS;
    let domain = Domain::solo(Grid::new([4; 3], Vector::ZERO, Vector::splat(edge)), [true, true, false]);
    let setup = setup(vec![Body::ball(RADIUS)], with(1.0), vec![]);
    let depth = 0.01 * RADIUS;
    let centre = Vector::splat(0.5 * edge);
    let low = Grain::new(1, 2650.0, centre.with_x(0.2 * RADIUS));
    let high = Grain::new(2, 2650.0, centre.with_x(edge - 1.8 * RADIUS + depth));
    let mut engine = Engine::new(&domain, setup, &[low, high]).expect("the case is sound");
    // Short enough that they hardly move.
    let report = engine.advance(&domain, &Loads::none(), Vector::ZERO, 1e-12, Substeps::Fixed(1)).expect("they touch");
    assert_eq!((report.pairs, report.contacts), (1, 1));
    let [stiffness, _] = engine.interactions().law(0, 0).stiffness();
    let expected = 0.5 * stiffness * depth * depth;
    assert!((engine.elastic_energy() / expected - 1.0).abs() < 1e-6, "{} {expected}", engine.elastic_energy());
}

#[test]
fn pairs_of_all_sizes_are_those_of_comparing_all() {
    let mut random = Random::new(7);
    // From one to two hundred, most of them small: eight classes of size and a rest.
    let grains: Vec<Grain> = (0..900)
        .map(|id| {
            let scale = 200.0_f64.powf(random.unit().powi(3)) * 0.04;
            let place = Vector::new(random.unit(), random.unit(), random.unit()) * 20e-3;
            Grain { scale, ..Grain::new(id, 2650.0, place) }
        })
        .collect();
    let touch = |a: &Grain, b: &Grain| a.position.distance(b.position) < RADIUS * (a.scale + b.scale);
    let expected: usize = (0..grains.len()).map(|n| grains[..n].iter().filter(|b| touch(&grains[n], b)).count()).sum();
    let mut engine = engine(LAW, false, &grains);
    engine.allow_any_overlap(true);
    let report = engine.advance(&domain(), &Loads::none(), Vector::ZERO, 1e-12, Substeps::Fixed(1)).expect("no limit");
    assert_eq!(report.pairs, expected);
    assert!(expected > 500, "{expected}");
}
