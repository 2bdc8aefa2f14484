//! Liquid bridges: the pull over the gap, momentum and energy, what a bridge carries, cohesion of a heap, and the same bits.

use std::f64::consts::PI;

use sazanami_dem::*;
use sazanami_numerics::domain::Domain;
use sazanami_numerics::grid::Grid;
use sazanami_numerics::snapshot::Snapshot;
use sazanami_numerics::{Quaternion, Random, Real, Vector};
use sazanami_parallel::Solo;

use crate::cloud::{bits_agree, fall};
use crate::support::domain;

const RADIUS: Real = 1e-3;
const PAIR: [Real; 2] = [RADIUS; 2];

/// Water at 20 degrees on clean glass, 1 % of the volume of the balls.
fn water() -> Bridge {
    Bridge::new(0.0728, 0.2, 0.01).expect("the fit was made for it")
}

fn setup(bridge: Option<Bridge>, walls: Vec<Wall>) -> Setup {
    let law = LinearSpringDashpot { damping: Damping::Restitution(0.9), ..LinearSpringDashpot::SAND };
    let interactions = Interactions::uniform(1, law).with_bridge(bridge);
    Setup { interactions, ..crate::support::setup(vec![Body::ball(RADIUS)], law, walls) }
}

/// Two balls that overlap by a part of a radius, the upper at the origin.
fn pair(lower: Grain, upper: Grain, overlap: Real, bridge: Option<Bridge>) -> Engine {
    let at = |grain: Grain, z: Real| Grain { position: Vector::new(0.0, 0.0, z), ..grain };
    let grains = [at(upper, 0.0), at(lower, (overlap - 2.0) * RADIUS)];
    Engine::new(&domain(), setup(bridge, vec![]), &grains).expect("the case is sound")
}

fn ball(id: u64) -> Grain {
    Grain::new(id, 2500.0, Vector::ZERO)
}

fn gap(engine: &Engine) -> Real {
    let places = &engine.grains().position;
    (places[0] - places[1]).length() - 2.0 * RADIUS
}

#[test]
fn the_pull_over_the_gap_is_that_of_the_fit_up_to_rupture() {
    let bridge = water();
    // So heavy that it stays.
    let upper = Grain { mass: Some(1e6), ..ball(0) };
    let lower = Grain { motion: Motion::Prescribed, velocity: Vector::new(0.0, 0.0, -1e-3), ..ball(1) };
    let mut engine = pair(lower, upper, 1e-5, Some(bridge));
    // They are seen to touch.
    engine.advance(&domain(), &Loads::none(), Vector::ZERO, 1e-6, Substeps::Fixed(1)).expect("the case is sound");
    let (mut held, mut free) = (0, 0);
    for _ in 0..400 {
        let step = 1e-3;
        let report = engine
            .advance(&domain(), &Loads::none(), Vector::ZERO, step, Substeps::Fixed(1))
            .expect("the case is sound");
        // The force is that of the middle of the step.
        let middle = gap(&engine) - 0.5e-3 * step;
        if middle < 1e-8 {
            continue;
        }
        let found = engine.grains().contact_force[0];
        let expected = if middle <= bridge.rupture(PAIR) { bridge.force(middle, PAIR) } else { 0.0 };
        assert!((found.z + expected).abs() < 1e-12 * (1.0 + expected), "{middle}: {found} {expected}");
        assert_eq!(report.bridges, usize::from(expected > 0.0));
        let volume = if expected > 0.0 { bridge.volume(PAIR) } else { 0.0 };
        assert!((report.bridge_volume - volume).abs() < 1e-24);
        *(if expected > 0.0 { &mut held } else { &mut free }) += 1;
    }
    assert!(held > 50 && free > 50, "{held} {free}");
    // One that comes near without touching has none: it forms by touch alone.
    let still = Grain { motion: Motion::Fixed, position: Vector::new(0.0, 0.0, -2.05 * RADIUS), ..ball(1) };
    let grains = [ball(0), still];
    let mut near = Engine::new(&domain(), setup(Some(bridge), vec![]), &grains).expect("the case is sound");
    let report =
        near.advance(&domain(), &Loads::none(), Vector::ZERO, 1e-4, Substeps::Auto).expect("the case is sound");
    assert!(report.bridges == 0 && gap(&near) < bridge.rupture(PAIR));
}

#[test]
fn momentum_stays_and_energy_goes_with_the_bridge_alone() {
    let bridge = water();
    let work = bridge.energy(bridge.rupture(PAIR), PAIR);
    for (part, breaks) in [(4.0, true), (0.5, false)] {
        // Kinetic energy of the relative motion: m v^2/4 of `part` of the work to break it.
        let mass = 4.0 / 3.0 * PI * RADIUS.powi(3) * 2500.0;
        let speed = (4.0 * part * work / mass).sqrt();
        let lower = Grain { velocity: Vector::new(0.0, 0.0, -speed), ..ball(1) };
        let mut engine = pair(lower, ball(0), 1e-3, Some(bridge));
        let kinetic = |engine: &Engine| (0..2).map(|g| engine.grains().kinetic_energy(g)).sum::<Real>();
        let (mut ruptures, mut before) = (0, None);
        for _ in 0..600 {
            let report = engine
                .advance(&domain(), &Loads::none(), Vector::ZERO, 2e-5, Substeps::Auto)
                .expect("the case is sound");
            let momentum: Vector = engine.grains().velocity.iter().map(|v| mass * *v).sum();
            assert!((momentum.z + mass * speed).abs() < 1e-12 * mass * speed, "{momentum}");
            ruptures += report.ruptures;
            let total = kinetic(&engine) + engine.elastic_energy();
            // Away from the contact, whose dashpot takes.
            if report.contacts > 0 {
                before = None;
            } else if let Some((before, had)) = before {
                let lost: Real = if had != report.bridges { work } else { 0.0 };
                assert!((total - (before - lost) as Real).abs() < 0.01 * work, "{part}: {total} {before} {lost}");
            }
            if report.contacts == 0 && before.is_none_or(|(_, had)| had != report.bridges) {
                before = Some((total, report.bridges));
            }
        }
        assert_eq!(ruptures, usize::from(breaks), "{part}");
    }
}

#[test]
fn a_pendant_ball_holds_by_its_bridge_or_falls() {
    let bridge = water();
    let mass = 4.0 / 3.0 * PI * RADIUS.powi(3) * 2500.0;
    let hangs = |bridge: Option<Bridge>, weight: Real| {
        let mut engine = pair(ball(1), Grain { motion: Motion::Fixed, ..ball(0) }, 1e-5, bridge);
        let gravity = Vector::new(0.0, 0.0, -weight / mass);
        for _ in 0..400 {
            engine.advance(&domain(), &Loads::none(), gravity, 1e-4, Substeps::Auto).expect("the case is sound");
        }
        gap(&engine) < bridge.map_or(0.0, |bridge| bridge.rupture(PAIR))
    };
    let most = bridge.force(0.0, PAIR);
    assert!(hangs(Some(bridge), 0.9 * most) && !hangs(Some(bridge), 1.1 * most));
    // Water holds some 4 weights of a glass ball of 2 mm; without a bridge it falls.
    assert!((3.0..6.0).contains(&(most / (mass * 9.81))), "{}", most / (mass * 9.81));
    assert!(!hangs(None, 0.1 * most));
}

/// Height of the highest ball after a column of balls has come to rest beside a wall.
fn column(bridge: Option<Bridge>) -> Real {
    let grid = Grid::new([16, 4, 16], Vector::ZERO, Vector::new(0.06, 4e-3, 0.04));
    let domain = Domain::solo(grid, [false, true, false]);
    let law = LinearSpringDashpot {
        normal_stiffness: 1e3,
        tangential_stiffness: 1e3,
        damping: Damping::Restitution(0.2),
        friction: 0.3,
        ..LinearSpringDashpot::SAND
    };
    let walls = vec![Wall::at_rest(Vector::ZERO, Vector::Z, 0), Wall::at_rest(Vector::ZERO, Vector::X, 0)];
    let setup = Setup { interactions: Interactions::uniform(1, law).with_bridge(bridge), ..setup(bridge, walls) };
    let mut random = Random::new(3);
    let grains: Vec<Grain> = (0..120)
        .map(|n: u64| {
            let place = Vector::new((n % 5) as Real, (n / 5 % 2) as Real, (n / 10) as Real);
            let off = Vector::new(random.between(0.0, 0.02), 0.0, random.between(0.0, 0.02));
            let position = RADIUS * (Vector::splat(1.01) + 2.02 * place) + RADIUS * off;
            Grain { position, ..Grain::new(n, 2500.0, Vector::ZERO) }
        })
        .collect();
    let mut engine = Engine::new(&domain, setup, &grains).expect("the case is sound");
    for _ in 0..500 {
        let gravity = Vector::new(0.0, 0.0, -9.81);
        engine.advance(&domain, &Loads::none(), gravity, 1e-3, Substeps::Auto).expect("the case is sound");
    }
    (0..engine.grains().owned()).map(|g| engine.grains().position[g].z).fold(0.0, Real::max)
}

#[test]
fn a_wet_column_stands_where_a_dry_one_falls() {
    let [dry, wet] = [None, Some(water())].map(column);
    println!("{dry} {wet}");
    assert!(wet > 1.3 * dry, "{dry} {wet}");
}

#[test]
fn ranks_threads_and_interruptions_leave_the_bits_alone() {
    let [half, expected] = bits_agree(|| setup(Some(water()), vec![]));
    let marks = half.u32("dem/contact.deep").expect("the snapshot is whole");
    let held_apart = marks.iter().filter(|&marks| marks & 8 == 8).count();
    assert!(held_apart > 5, "{held_apart}");
    // Control: bridges do act.
    let dry = fall(Box::new(Solo::default()), setup(None, vec![]), None, 80);
    let velocities = |of: &Snapshot| of.reals("dem/grain.velocity").expect("the snapshot is whole").to_vec();
    assert!(velocities(&dry) != velocities(&expected));
}

/// Spheroids of the size of sand.
fn spheroids(bridge: Option<Bridge>) -> Setup {
    Setup { bodies: vec![Body::prolate(0.26e-3, 0.635e-3, 9)], ..setup(bridge, vec![]) }
}

#[test]
fn spheroids_are_pulled_through_their_nearest_spheres_as_balls_of_their_volume() {
    let bridge = water();
    let radii = [(0.26e-3_f64.powi(2) * 0.635e-3).cbrt(); 2];
    let longest = bridge.rupture(radii);
    // The lower one lies across, off the middle of the upper one, and goes down.
    let across = Quaternion::from_rotation_y(0.5 * PI);
    let place = Vector::new(0.2e-3, 0.0, -0.875e-3);
    let moves = Grain { motion: Motion::Prescribed, velocity: Vector::new(0.0, 0.0, -1e-3), ..ball(1) };
    let lower = Grain { position: place, orientation: across, ..moves };
    let upper = Grain { mass: Some(1e6), ..ball(0) };
    let mut engine = Engine::new(&domain(), spheroids(Some(bridge)), &[upper, lower]).expect("the case is sound");
    engine.advance(&domain(), &Loads::none(), Vector::ZERO, 1e-6, Substeps::Fixed(1)).expect("the case is sound");
    let body = &spheroids(None).bodies[0];
    let (mut held, mut free) = (0, 0);
    for _ in 0..200 {
        let step = 1e-3;
        let report = engine
            .advance(&domain(), &Loads::none(), Vector::ZERO, step, Substeps::Fixed(1))
            .expect("the case is sound");
        // Nearest of all pairs of spheres at the middle of the step.
        let at = engine.grains().position[1] + Vector::new(0.0, 0.0, 0.5e-3 * step) - engine.grains().position[0];
        let lines = body.centres.iter().zip(&body.radii).flat_map(|(a, ra)| {
            let others = body.centres.iter().zip(&body.radii);
            others.map(move |(b, rb)| (at + across * *b - *a, *a, ra, rb))
        });
        let gaps = lines.map(|(line, a, ra, rb)| (line.length() - ra - rb, line.normalize(), a, ra));
        let (gap, normal, a, ra) = gaps.min_by(|x, y| x.0.total_cmp(&y.0)).expect("there are spheres");
        if gap < 1e-8 {
            continue;
        }
        let pull = if gap <= longest { bridge.force(gap, radii) } else { 0.0 };
        let torque = (a + normal * (ra + 0.5 * gap)).cross(pull * normal);
        let [force, turn] = [engine.grains().contact_force[0], engine.grains().contact_torque[0]];
        assert!((force - pull * normal).length() < 1e-9 * (1e-3 + pull), "{gap}: {force} {pull}");
        assert!((turn - torque).length() < 1e-9 * 1e-3 * (1e-3 + pull), "{gap}: {turn} {torque}");
        // The pull on the other is opposite, in one line with this one.
        let other = engine.grains().contact_force[1];
        let about = turn + engine.grains().contact_torque[1] + at.cross(other);
        assert!((force + other).length() < 1e-18 && about.length() < 1e-18, "{gap}: {other} {about}");
        assert_eq!(report.bridges, usize::from(pull > 0.0));
        *(if pull > 0.0 { &mut held } else { &mut free }) += 1;
    }
    assert!(held > 50 && free > 20, "{held} {free}");
}

#[test]
fn a_grain_without_moisture_has_no_bridge() {
    let pull = |moisture: Real| {
        let mut engine =
            pair(Grain { motion: Motion::Fixed, ..ball(1) }, Grain { mass: Some(1e6), ..ball(0) }, 1e-9, Some(water()));
        engine.set_moisture(|n, _| if n == 1 { moisture } else { 1.0 });
        let report = engine
            .advance(&domain(), &Loads::none(), Vector::ZERO, 1e-9, Substeps::Fixed(1))
            .expect("the case is sound");
        (report.bridges, engine.grains().contact_force[0].z)
    };
    let [(dry, push), (_, half), (moist, whole)] = [0.0, 0.5, 1.0].map(pull);
    assert!(dry == 0 && moist == 1);
    let expected = water().force(0.0, PAIR);
    assert!((push - whole - expected).abs() < 1e-9 * expected, "{push} {whole} {expected}");
    assert!((push - half - 0.5 * expected).abs() < 1e-9 * expected, "{push} {half} {expected}");
}

#[test]
fn ranks_threads_and_interruptions_leave_the_bits_of_spheroids_alone() {
    let large = || Setup { bodies: vec![Body::prolate(0.6e-3, 1.2e-3, 7)], ..setup(Some(water()), vec![]) };
    let [half, _] = bits_agree(large);
    let marks = half.u32("dem/contact.deep").expect("the snapshot is whole");
    let held_apart = marks.iter().filter(|&marks| marks & 8 == 8).count();
    assert!(held_apart > 5, "{held_apart}");
}

#[test]
fn what_grains_gain_as_they_dry_no_contact_has_given() {
    // A light spring, so that what a bridge holds is much beside all else.
    let law = LinearSpringDashpot {
        normal_stiffness: 50.0,
        tangential_stiffness: 50.0,
        ..setup(None, vec![]).interactions.law(0, 0).to_owned()
    };
    let made = Setup { interactions: Interactions::uniform(1, law).with_bridge(Some(water())), ..setup(None, vec![]) };
    let at = |z: Real| Vector::new(0.0, 0.0, z);
    let lower = Grain { motion: Motion::Fixed, position: at(-1.99 * RADIUS), ..ball(1) };
    let mut engine = Engine::new(&domain(), made, &[ball(0), lower]).expect("the case is sound");
    let advance = |engine: &mut Engine| {
        engine.advance(&domain(), &Loads::none(), at(-9.81), 1e-3, Substeps::Auto).expect("nothing is gained").contacts
    };
    (0..500).for_each(|_| assert_eq!(advance(&mut engine), 1));
    let wet = engine.elastic_energy();
    for n in 0..200 {
        engine.set_moisture(|_, _| 1.0 - Real::from(n + 1) / 200.0);
        advance(&mut engine);
    }
    // Control: as much as the sub-steps of a window must not give.
    let lift = 4.0 / 3.0 * PI * RADIUS.powi(3) * 2500.0 * 9.81 * RADIUS;
    assert!(engine.elastic_energy() - wet > 1e-3 * lift, "{} {wet} {lift}", engine.elastic_energy());
}

#[test]
fn unlike_balls_that_touched_before_they_were_moist_are_held_as_far_as_the_larger_one_asks() {
    let bridge = water();
    let radii = [4.0 * RADIUS, RADIUS];
    let large = Grain { mass: Some(1e6), scale: 4.0, ..ball(0) };
    let small = Grain { motion: Motion::Prescribed, position: Vector::new(0.0, 0.0, -4.999 * RADIUS), ..ball(1) };
    let mut engine = Engine::new(&domain(), setup(Some(bridge), vec![]), &[large, small]).expect("the case is sound");
    let advance = |engine: &mut Engine, time: Real| {
        engine.advance(&domain(), &Loads::none(), Vector::ZERO, time, Substeps::Fixed(1)).expect("the case is sound")
    };
    engine.set_moisture(|_, _| 0.0);
    assert_eq!(advance(&mut engine, 1e-6).bridges, 0);
    engine.set_moisture(|_, _| 1.0);
    assert_eq!(advance(&mut engine, 1e-6).bridges, 1);
    engine.set_velocity(1, Vector::new(0.0, 0.0, -1e-3), Vector::ZERO);
    let (mut longest, mut parted): (Real, bool) = (0.0, false);
    for _ in 0..600 {
        let report = advance(&mut engine, 1e-3);
        let middle = (engine.grains().position[0] - engine.grains().position[1]).length() - 5.0 * RADIUS - 0.5e-6;
        if middle < 1e-8 {
            continue;
        }
        let pull = if middle <= bridge.rupture(radii) { bridge.force(middle, radii) } else { 0.0 };
        let found = engine.grains().contact_force[0].z;
        assert!((found + pull).abs() < 1e-12 * (1.0 + pull), "{middle}: {found} {pull}");
        (longest, parted) = (if report.bridges > 0 { middle } else { longest }, parted || report.bridges == 0);
    }
    // Farther than one between balls as small as the smaller.
    assert!(parted && longest > 1.5 * bridge.rupture(PAIR), "{longest}");
}
