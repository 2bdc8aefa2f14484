//! The bits of a run depend neither on threads, ranks or the age of lists, nor on an interruption.

use sazanami_dem::*;
use sazanami_numerics::domain::Domain;
use sazanami_numerics::grid::Grid;
use sazanami_numerics::snapshot::Snapshot;
use sazanami_numerics::{Quaternion, Random, Real, Vector};
use sazanami_parallel::{Communicator, Solo, run_ranks, with_threads};

use crate::support::snapshot_of;

const WIDTH: Real = 6e-3;
const GRAVITY: Vector = Vector::new(0.0, 0.0, -500.0);

fn domain(communicator: Box<dyn Communicator>, periodic: bool) -> Domain {
    let grid = Grid::new([24, 16, 8], Vector::ZERO, Vector::new(WIDTH, WIDTH, 8e-3));
    Domain::new(grid, [periodic, periodic, false], communicator).expect("the case is sound")
}

fn bodies() -> Vec<Body> {
    vec![Body::prolate(0.26e-3, 0.635e-3, 9), Body::ball(0.3e-3)]
}

fn setup(periodic: bool, damping: Damping) -> Setup {
    let side = [!periodic; 2];
    let upper = Vector::new(WIDTH, WIDTH, 0.0);
    let mut interactions = Interactions::uniform(2, LinearSpringDashpot { damping, ..LinearSpringDashpot::SAND });
    interactions.set(0, 1, LinearSpringDashpot { friction: 0.3, damping, ..LinearSpringDashpot::SAND });
    Setup {
        bodies: bodies(),
        interactions,
        walls: Wall::of_box(Vector::ZERO, upper, 0, [side, side, [true, false]]),
        region: [Vector::new(-1.0, -1.0, 0.0), Vector::ONE],
        ghost_margin: 0.5e-3,
    }
}

/// Grains of two shapes, materials and sizes that are about to collapse and slide to one side.
fn grains() -> Vec<Grain> {
    let mut random = Random::new(11);
    let mut grains: Vec<Grain> = (0..96)
        .map(|n| Grain {
            shape: (n % 5 == 0).into(),
            material: (n % 3 == 0).into(),
            scale: random.between(0.7, 1.0),
            ..Grain::new(7 * n % 101, 2650.0, Vector::ZERO)
        })
        .collect();
    let mut settings = PackingSettings::new(Vector::ZERO, Vector::new(WIDTH, WIDTH, 1.0));
    settings.lattice = Lattice::Low;
    settings.arrange(&bodies(), &mut grains).expect("the case is sound");
    for grain in &mut grains {
        grain.velocity = Vector::new(0.6, 0.3, -1.5) + random.between(-0.5, 0.5) * Vector::X;
        grain.angular_velocity = Vector::new(random.between(-200.0, 200.0), 50.0, 0.0);
    }
    grains
}

/// State of all grains after `steps` steps of `engine`, from its snapshot on rank 0.
fn run(domain: &Domain, engine: &mut Engine, steps: usize) -> Snapshot {
    for _ in 0..steps {
        engine.advance(domain, &Loads::none(), GRAVITY, 2e-5, Substeps::Fixed(40)).expect("the case is sound");
    }
    snapshot_of(domain, engine)
}

fn alone(periodic: bool, steps: usize) -> Snapshot {
    let domain = domain(Box::new(Solo::default()), periodic);
    let mut engine =
        Engine::new(&domain, setup(periodic, Damping::Restitution(0.5)), &grains()).expect("the case is sound");
    run(&domain, &mut engine, steps)
}

#[test]
fn ranks_and_threads_give_the_same_bits() {
    for periodic in [false, true] {
        let expected = alone(periodic, 150);
        let contacts = expected.u64("dem/contact.low").expect("the case is sound").len();
        assert!(contacts > 20, "{contacts}");
        for (ranks, threads) in [(1, 3), (2, 1), (3, 2), (4, 1), (6, 1)] {
            let found = run_ranks(ranks, threads, |c| {
                let domain = domain(c, periodic);
                let mut engine = Engine::new(&domain, setup(periodic, Damping::Restitution(0.5)), &grains())
                    .expect("the case is sound");
                run(&domain, &mut engine, 150)
            })
            .expect("the case is sound");
            assert!(found[0] == expected, "{ranks} ranks, {threads} threads, periodic {periodic}");
        }
    }
}

#[test]
fn another_order_of_identifiers_changes_the_bits() {
    // Negative control of the test above: its comparison does see round-off.
    let domain = domain(Box::new(Solo::default()), false);
    let mut other = grains();
    other.iter_mut().for_each(|g| g.id = 200 - g.id);
    let mut engine = Engine::new(&domain, setup(false, Damping::Restitution(0.5)), &other).expect("the case is sound");
    let found = run(&domain, &mut engine, 150);
    let expected = alone(false, 150);
    let n = other.len();
    let (a, b) = (
        found.vectors("dem/grain.position").expect("the case is sound"),
        expected.vectors("dem/grain.position").expect("the case is sound"),
    );
    assert!((0..n).any(|g| a[n - 1 - g] != b[g]));
}

#[test]
fn an_interrupted_run_goes_on_with_the_same_bits() {
    for periodic in [false, true] {
        let expected = alone(periodic, 160);
        let half = alone(periodic, 80);
        for (ranks, threads) in [(1, 1), (1, 2), (4, 1)] {
            let found = run_ranks(ranks, threads, |c| {
                let domain = domain(c, periodic);
                let nothing = Snapshot::default();
                let from = if domain.communicator().rank() == 0 { &half } else { &nothing };
                let setup = setup(periodic, Damping::Restitution(0.5));
                let mut engine = Engine::restore(&domain, setup, "dem/", from).expect("the case is sound");
                run(&domain, &mut engine, 80)
            })
            .expect("the case is sound");
            assert!(found[0] == expected, "{ranks} ranks, periodic {periodic}");
        }
    }
}

#[test]
fn a_snapshot_without_contacts_does_not_go_on_alike() {
    // Negative control: the memory of contacts matters.
    let mut half = alone(false, 80);
    let displacement = half.reals("dem/contact.displacement").expect("the case is sound").to_vec();
    half.put_reals("dem/contact.displacement", vec![0.0; displacement.len()]);
    let domain = domain(Box::new(Solo::default()), false);
    let setup = setup(false, Damping::Restitution(0.5));
    let mut engine = Engine::restore(&domain, setup, "dem/", &half).expect("the case is sound");
    assert!(run(&domain, &mut engine, 80) != alone(false, 160));
}

#[test]
fn old_lists_give_the_forces_of_new_ones() {
    let domain = domain(Box::new(Solo::default()), true);
    let setup = || setup(true, Damping::Literal { normal: 2.95e-3, tangential: 2.95e-3 });
    let mut old = Engine::new(&domain, setup(), &grains()).expect("the case is sound");
    let mut renewed = Engine::new(&domain, setup(), &grains()).expect("the case is sound");
    for _ in 0..120 {
        let a = run(&domain, &mut old, 1);
        let b = run(&domain, &mut renewed, 1);
        assert!(a == b);
        renewed = Engine::restore(&domain, setup(), "dem/", &b).expect("the case is sound");
    }
}

#[test]
fn balls_that_touch_on_both_sides_of_a_narrow_box_keep_both_contacts_while_they_cross_it() {
    let radius = 0.3e-3;
    let upper = Vector::new(4.2 * radius, WIDTH, 8e-3);
    let grid = Grid::new([2, 16, 8], Vector::ZERO, upper);
    let domain = Domain::new(grid, [true, false, false], Box::<Solo>::default()).expect("the case is sound");
    let setup = || Setup {
        walls: Wall::of_box(Vector::ZERO, upper, 0, [[false; 2], [true; 2], [true, false]]),
        ..setup(true, Damping::Literal { normal: 0.0, tangential: 0.0 })
    };
    // They bounce between each other and each other's image, and go round.
    let ball = |id: u64, x: Real, speed: Real| Grain {
        shape: 1,
        velocity: Vector::new(speed, 0.0, 0.0),
        ..Grain::new(id, 2650.0, Vector::new(x * radius, 3e-3, 3e-3))
    };
    let balls = [ball(0, 1.0, 0.7), ball(1, 3.1, 0.6)];
    let mut old = Engine::new(&domain, setup(), &balls).expect("the case is sound");
    let mut renewed = Engine::new(&domain, setup(), &balls).expect("the case is sound");
    let step = |engine: &mut Engine| {
        engine.advance(&domain, &Loads::none(), Vector::ZERO, 2e-5, Substeps::Auto).expect("no ball is lost")
    };
    let (mut impacts, mut touching, mut renewals) = (0, 0, 0);
    for _ in 0..1500 {
        let report = step(&mut old);
        renewals += report.list_renewals;
        impacts += usize::from(report.contacts > touching);
        touching = report.contacts;
        step(&mut renewed);
        let [a, b] = [&mut old, &mut renewed].map(|engine| snapshot_of(&domain, engine));
        assert!(a == b);
        renewed = Engine::restore(&domain, setup(), "dem/", &b).expect("the case is sound");
    }
    assert!(impacts > 20 && renewals > 20, "{impacts} {renewals}");
}

/// Velocity of a ball at rest after another came along, of this `motion`, from where the second of two ranks is; and
/// all there is. With `fresh` lists are made anew in every step.
fn one_hits_the_other(domain: &Domain, motion: Motion, fresh: bool) -> (Vector, Snapshot) {
    let radius = 0.3e-3;
    let ball = |id: u64, x: Real, speed: Real, motion: Motion| Grain {
        shape: 1,
        motion,
        velocity: Vector::new(speed, 0.0, 0.0),
        ..Grain::new(id, 2650.0, Vector::new(0.5 * WIDTH + x * radius, 3e-3, 3e-3))
    };
    let balls = [ball(0, -1.2, 0.0, Motion::Free), ball(1, 1.0, -1.0, motion)];
    let setup = || setup(false, Damping::Restitution(0.5));
    let mut engine = Engine::new(domain, setup(), &balls).expect("the case is sound");
    let mut snapshot = Snapshot::default();
    for _ in 0..10 {
        if motion == Motion::WithWalls {
            engine.set_wall_velocities(domain, Vector::new(-1.0, 0.0, 0.0));
        }
        engine.advance(domain, &Loads::none(), Vector::ZERO, 2e-5, Substeps::Fixed(40)).expect("no ball is lost");
        snapshot = snapshot_of(domain, &mut engine);
        if fresh {
            engine = Engine::restore(domain, setup(), "dem/", &snapshot).expect("the case is sound");
        }
    }
    let velocities = snapshot.vectors("dem/grain.velocity").map_or(Vector::ZERO, |v| v[0]);
    (velocities, snapshot)
}

#[test]
fn a_ball_at_rest_wakes_whatever_comes_along() {
    let alone = || domain(Box::<Solo>::default(), false);
    for motion in [Motion::Free, Motion::Prescribed, Motion::WithWalls] {
        let (velocity, expected) = one_hits_the_other(&alone(), motion, true);
        assert!(velocity.x < -0.5, "{motion:?}: {velocity}");
        assert!(one_hits_the_other(&alone(), motion, false).1 == expected, "{motion:?}");
        let found = run_ranks(2, 1, |c| one_hits_the_other(&domain(c, false), motion, false)).expect("two ranks start");
        assert!(found[0].1 == expected, "{motion:?} on two ranks");
    }
}

#[test]
fn a_ball_turns_as_it_spins() {
    let domain = domain(Box::<Solo>::default(), true);
    let spin = Vector::new(300.0, -200.0, 100.0);
    // It crosses a side meanwhile, with lists renewed on the way.
    let ball = Grain {
        shape: 1,
        velocity: Vector::new(3.0, 0.0, 0.0),
        angular_velocity: spin,
        ..Grain::new(3, 2650.0, Vector::splat(3e-3))
    };
    let setup = setup(true, Damping::Literal { normal: 0.0, tangential: 0.0 });
    let mut engine = Engine::new(&domain, setup, &[ball]).expect("the case is sound");
    let mut renewals = 0;
    for _ in 0..10 {
        let report = engine.advance(&domain, &Loads::none(), Vector::ZERO, 2e-4, Substeps::Fixed(400));
        renewals += report.expect("the case is sound").list_renewals;
    }
    let expected = Quaternion::from_scaled_axis(spin * engine.time());
    let found = engine.grains().orientation[0];
    assert!(found.dot(expected).abs() > 1.0 - 1e-12, "{found} {expected}");
    assert!(renewals > 0, "{renewals}");
    assert!(found.dot(Quaternion::IDENTITY).abs() < 0.95, "negative control: it does turn");
}

#[test]
fn packing_goes_on_after_an_interruption() {
    // Of unlike sizes too, of which the fine grains are made heavier for a while.
    for fine in [1.0, 0.4] {
        packing_goes_on(fine);
    }
}

fn packing_goes_on(fine: Real) {
    let domain = domain(Box::new(Solo::default()), false);
    let settings = PackingSettings {
        lattice: Lattice::Low,
        settling_time: 1e-3,
        step: 1e-4,
        fall_friction: 0.5,
        rest_speed: 0.01,
        rest_energy: 1.0,
        ..PackingSettings::new(Vector::ZERO, Vector::new(WIDTH, WIDTH, 1.0))
    };
    let laws = || Interactions::uniform(1, LinearSpringDashpot::SAND);
    let scale = |id: u64| if id.is_multiple_of(2) { 1.0 } else { fine };
    let templates: Vec<Grain> =
        (0..80).map(|id| Grain { scale: scale(id), ..Grain::new(id, 2650.0, Vector::ZERO) }).collect();
    let again_of = templates.clone();
    let mut packing = Packing::new(&domain, settings.clone(), bodies(), laws(), templates).expect("the case is sound");
    let mut saved = vec![];
    let mut reports = vec![];
    while !matches!(packing.stage(), Stage::Done | Stage::GivenUp) {
        if reports.len() % 40 == 30 {
            let mut snapshot = Snapshot::default();
            packing.snapshot(&domain, "bed/", &mut snapshot);
            saved.push((reports.len(), snapshot));
        }
        reports.push(packing.step(&domain).expect("the case is sound"));
    }
    assert_eq!(packing.stage(), Stage::Done);
    assert!(saved.len() > 1);
    // Each goes on to the next, the last one to the end.
    let snapshot_of = |packing: &mut Packing| {
        let mut snapshot = Snapshot::default();
        packing.snapshot(&domain, "bed/", &mut snapshot);
        snapshot
    };
    let ends = saved.iter().skip(1).map(|(at, snapshot)| (*at, Some(snapshot))).chain([(reports.len(), None)]);
    for ((at, snapshot), (end, expected)) in saved.iter().zip(ends) {
        let mut again = Packing::restore(&domain, settings.clone(), bodies(), laws(), &again_of, "bed/", snapshot)
            .expect("the case is sound");
        for expected in &reports[*at..end] {
            let found = again.step(&domain).expect("the case is sound");
            assert_eq!(
                (found.time, found.mean_speed, found.highest),
                (expected.time, expected.mean_speed, expected.highest)
            );
            assert_eq!(found.stage, expected.stage);
        }
        match expected {
            Some(expected) => assert!(snapshot_of(&mut again) == *expected, "from step {at} to {end}"),
            None => assert_eq!(again.bed(), packing.bed()),
        }
    }
}

#[test]
fn ghosts_give_back_what_they_collected() {
    let sum = |ranks: usize| {
        let parts = run_ranks(ranks, 1, |c| {
            let domain = domain(c, true);
            let mut engine =
                Engine::new(&domain, setup(true, Damping::Restitution(0.5)), &grains()).expect("the case is sound");
            run(&domain, &mut engine, 20);
            let g = engine.grains();
            // Every entry says how much of its x1-x2 square lies in this rank's part: together, all of it.
            let (lower, upper) = domain.rank_box(domain.communicator().rank());
            let mut partial: Vec<[Real; 2]> = (0..g.len())
                .map(|n| {
                    let overlap = |d: usize| {
                        let (a, b) = (g.position[n][d] - 0.4e-3, g.position[n][d] + 0.4e-3);
                        (b.min(upper[d]) - a.max(lower[d])).max(0.0) / 0.8e-3
                    };
                    [overlap(0) * overlap(1), 1.0]
                })
                .collect();
            engine.gather_to_owners(&domain, &mut partial);
            (0..g.owned()).map(|n| (g.id[n], partial[n][0], partial[n][1])).collect::<Vec<_>>()
        })
        .expect("the case is sound");
        parts.into_iter().flatten().collect::<Vec<_>>()
    };
    for ranks in [1, 2, 4, 6] {
        let all = sum(ranks);
        assert_eq!(all.len(), 96);
        assert!(all.iter().all(|(_, area, copies)| (area - 1.0).abs() < 1e-12 && *copies >= 1.0), "{ranks}");
        assert!(all.iter().any(|(_, _, copies)| *copies > 1.0));
    }
}

#[test]
fn threads_do_not_matter_to_a_packing() {
    let pack = |threads| {
        with_threads(threads, || {
            let domain = domain(Box::new(Solo::default()), false);
            let settings = PackingSettings::new(Vector::ZERO, Vector::new(WIDTH, WIDTH, 1.0));
            let laws = Interactions::uniform(1, LinearSpringDashpot::SAND);
            let templates = (0..64).map(|id| Grain::new(id, 2650.0, Vector::ZERO)).collect();
            let mut packing = Packing::new(&domain, settings, bodies(), laws, templates).expect("the case is sound");
            (0..600).for_each(|_| {
                packing.step(&domain).expect("the case is sound");
            });
            packing.bed()
        })
        .expect("the threads are granted")
    };
    let one = pack(1);
    assert!([2, 4].iter().all(|&threads| pack(threads) == one));
}

#[test]
fn a_bed_four_times_as_large_falls_alike_in_twice_the_time() {
    // Lengths x 4, times x 2, masses x 64, stiffness x 16, dashpots x 32: powers of two leave the bits alone.
    let fall = |length: Real, dashpot: Real, count: usize| {
        let upper = length * Vector::new(WIDTH, WIDTH, 8e-3);
        let domain = Domain::solo(Grid::new([4, 4, 4], Vector::ZERO, upper), [false; 3]);
        let law = LinearSpringDashpot {
            normal_stiffness: 1e4 * length * length,
            tangential_stiffness: 1e4 * length * length,
            damping: Damping::Literal { normal: 2.95e-3 * dashpot, tangential: 2.95e-3 * dashpot },
            ..LinearSpringDashpot::SAND
        };
        let body = Body::prolate(0.26e-3 * length, 0.635e-3 * length, 9);
        let settings = PackingSettings {
            lattice: Lattice::Low,
            step: 1e-4 * length.sqrt(),
            ..PackingSettings::new(Vector::ZERO, upper)
        };
        let grains = (0..60).map(|id| Grain::new(id, 2650.0, Vector::ZERO)).collect();
        let laws = Interactions::uniform(1, law);
        let mut packing = Packing::new(&domain, settings, vec![body], laws, grains).unwrap();
        for _ in 0..count {
            packing.step(&domain).unwrap();
        }
        (packing.bed(), packing.engine().contact_time_step())
    };
    let ((small, short), (large, long)) = (fall(1.0, 1.0, 150), fall(4.0, 32.0, 150));
    assert_eq!(2.0 * short, long);
    for (a, b) in small.iter().zip(&large) {
        assert_eq!((4.0 * a.position, a.orientation), (b.position, b.orientation));
    }
    // Negative control: with the dashpots of another size it is another bed.
    let (other, _) = fall(4.0, 30.0, 150);
    assert!(small.iter().zip(&other).any(|(a, b)| 4.0 * a.position != b.position));
}

/// Balls of three sizes and two materials that collapse between walls, after some steps. With `others` the engine
/// knows of another body too, which no grain has.
fn balls(domain: &Domain, rolling_friction: Real, others: bool) -> Snapshot {
    let law = |friction| LinearSpringDashpot { rolling_friction, ..LinearSpringDashpot::spheres(400.0, 0.5, friction) };
    let mut interactions = Interactions::uniform(2, law(0.4));
    interactions.set(0, 1, law(0.2));
    let mut random = Random::new(5);
    let mut grains: Vec<Grain> = (0..120)
        .map(|n| Grain {
            material: (n % 3 == 0).into(),
            scale: [0.7, 0.85, 1.0][n as usize % 3],
            ..Grain::new(7 * n % 127, 2650.0, Vector::ZERO)
        })
        .collect();
    let settings = PackingSettings::new(Vector::ZERO, Vector::new(WIDTH, WIDTH, 1.0));
    settings.arrange(&[Body::ball(0.3e-3)], &mut grains).expect("the lattice fits");
    for grain in &mut grains {
        grain.velocity = Vector::new(0.6, 0.3, -0.5) + random.between(-0.5, 0.5) * Vector::X;
        grain.angular_velocity = Vector::new(random.between(-200.0, 200.0), 50.0, 0.0);
    }
    let side = [!domain.periodic()[0]; 2];
    let mut bodies = vec![Body::ball(0.3e-3)];
    bodies.extend(others.then(|| Body::prolate(0.26e-3, 0.635e-3, 9)));
    let setup = Setup {
        bodies,
        interactions,
        walls: Wall::of_box(Vector::ZERO, Vector::new(WIDTH, WIDTH, 0.0), 0, [side, side, [true, false]]),
        region: [Vector::new(-1.0, -1.0, 0.0), Vector::ONE],
        ghost_margin: 0.5e-3,
    };
    let mut engine = Engine::new(domain, setup, &grains).expect("the case is sound");
    for _ in 0..100 {
        engine.advance(domain, &Loads::none(), GRAVITY, 1e-4, Substeps::Fixed(40)).expect("they fall");
    }
    snapshot_of(domain, &mut engine)
}

#[test]
fn balls_alone_have_the_bits_of_balls_among_others() {
    let solo = |periodic| domain(Box::new(Solo::default()), periodic);
    for (periodic, rolling) in [(false, 0.0), (true, 0.0), (true, 0.05)] {
        let expected = balls(&solo(periodic), rolling, true);
        assert!(expected.u64("dem/contact.low").expect("there is a list of contacts").len() > 50);
        assert!(balls(&solo(periodic), rolling, false) == expected);
        for (ranks, threads) in [(1, 2), (2, 1), (4, 2)] {
            let found = run_ranks(ranks, threads, |c| balls(&domain(c, periodic), rolling, false)).expect("they fall");
            assert!(found[0] == expected, "{ranks} ranks, {threads} threads, periodic {periodic}, rolling {rolling}");
        }
        // Negative control: the comparison sees another torque against rolling.
        assert!(balls(&solo(periodic), rolling + 1e-12, false) != expected);
    }
}

#[test]
fn all_images_in_the_vicinity_have_an_entry_however_old_lists_are() {
    let domain = domain(Box::new(Solo::default()), true);
    let margin = 2e-3;
    let setup = Setup { ghost_margin: margin, ..setup(true, Damping::Restitution(0.5)) };
    let mut engine = Engine::new(&domain, setup, &grains()).expect("the case is sound");
    let key = |id: u64, place: Vector| (id, place.to_array().map(Real::to_bits));
    let mut beyond_corners = 0;
    for _ in 0..20 {
        run(&domain, &mut engine, 1);
        let (known, grains) = (engine.vicinity(&domain, margin), engine.grains());
        let mut found: Vec<_> = (0..grains.len())
            .filter(|&g| known.contains(grains.position[g]))
            .map(|g| key(grains.id[g], grains.position[g]))
            .collect();
        let mut expected = Vec::new();
        for g in 0..grains.owned() {
            for [a, b] in [-1, 0, 1].into_iter().flat_map(|a| [-1, 0, 1].map(|b| [a, b])) {
                let image = grains.image(g);
                let place = engine.image_position(grains.unwrapped_position(g), [image[0] + a, image[1] + b, image[2]]);
                if known.contains(place) {
                    expected.push(key(grains.id[g], place));
                } else if (place - Vector::new(0.5 * WIDTH, 0.5 * WIDTH, place.z)).abs().max_element()
                    < 0.5 * WIDTH + margin
                {
                    // Negative control: the box round the part has more, which lists need not have.
                    let has =
                        (0..grains.len()).any(|n| key(grains.id[n], grains.position[n]) == key(grains.id[g], place));
                    beyond_corners += usize::from(!has);
                }
            }
        }
        found.sort_unstable();
        expected.sort_unstable();
        assert!(found == expected, "{} of {} images", found.len(), expected.len());
        assert!(found.len() > grains.owned() + 20);
    }
    assert!(beyond_corners > 0);
}
