//! Friction and its memory on planes.

use sazanami_dem::*;
use sazanami_numerics::snapshot::Snapshot;
use sazanami_numerics::{Real, Vector};

use crate::support::{domain, floor, setup, snapshot_of};

const G: Real = 9.81;
const RADIUS: Real = 0.01;
const STIFFNESS: Real = 1e5;

/// A body on the floor, pressed in as its weight under `gravity` would.
fn on_floor(body: Body, law: LinearSpringDashpot, gravity: Vector, feet: Real, velocity: Vector) -> Engine {
    let mass = 2500.0 * body.volume;
    let lowest = body.centres.iter().zip(&body.radii).map(|(c, r)| c.z - r).fold(0.0, Real::min);
    let height = -lowest + mass * gravity.z / (law.normal_stiffness * feet);
    let grain = Grain { velocity, ..Grain::new(1, 2500.0, Vector::new(0.0, 0.0, height)) };
    Engine::new(&domain(), setup(vec![body], law, floor()), &[grain]).expect("the case is sound")
}

fn law(friction: Real) -> LinearSpringDashpot {
    LinearSpringDashpot {
        normal_stiffness: STIFFNESS,
        tangential_stiffness: STIFFNESS,
        damping: Damping::Restitution(0.3),
        friction,
        ..LinearSpringDashpot::SAND
    }
}

fn slope(degrees: Real) -> Vector {
    let (sine, cosine) = degrees.to_radians().sin_cos();
    G * Vector::new(sine, 0.0, -cosine)
}

#[test]
fn rolling_friction_stops_a_ball() {
    let gravity = Vector::new(0.0, 0.0, -G);
    let law = LinearSpringDashpot { rolling_friction: 0.02, ..law(0.5) };
    let mut engine = on_floor(Body::ball(RADIUS), law, gravity, 1.0, 0.1 * Vector::X);
    engine.set_velocity(0, 0.1 * Vector::X, 0.1 / RADIUS * Vector::Y);
    engine.advance(&domain(), &Loads::none(), gravity, 0.1, Substeps::Fixed(5000)).expect("the case is sound");
    // Torque mu_r R m g against rolling: (7/5) m a = mu_r m g.
    let expected = 0.1 - 5.0 / 7.0 * 0.02 * G * 0.1;
    let found = engine.grains().velocity[0].x;
    assert!((found / expected - 1.0).abs() < 1e-2, "{found} {expected}");
}

/// A cylinder of this radius and four times its length along x2, on the axis of which are nine spheres.
fn roller() -> Body {
    let length = 4.0 * RADIUS;
    let volume = std::f64::consts::PI * RADIUS.powi(2) * length;
    let (along, across) = (0.5 * RADIUS.powi(2), (3.0 * RADIUS.powi(2) + length * length) / 12.0);
    let centre = |n: i32| Real::from(n) / 8.0 * (length - 2.0 * RADIUS) * Vector::Y;
    let centres = (-4..=4).map(centre).collect();
    Body::new(volume, volume * Vector::new(across, along, across), centres, vec![RADIUS; 9], 0.0)
}

#[test]
fn rolling_friction_is_for_balls_others_resist_by_their_shape() {
    let gravity = Vector::new(0.0, 0.0, -G);
    let speed_after = |body: Body, feet: Real| {
        let law = LinearSpringDashpot { rolling_friction: 0.05, ..law(0.5) };
        let mut engine = on_floor(body, law, gravity, feet, 0.1 * Vector::X);
        engine.set_velocity(0, 0.1 * Vector::X, 0.1 / RADIUS * Vector::Y);
        engine.advance(&domain(), &Loads::none(), gravity, 0.1, Substeps::Fixed(5000)).expect("the case is sound");
        engine.grains().velocity[0].x
    };
    let cylinder = speed_after(roller(), 9.0);
    assert!((cylinder / 0.1 - 1.0).abs() < 1e-3, "{cylinder}");
    // Control: a ball under the same law.
    let (ball, expected) = (speed_after(Body::ball(RADIUS), 1.0), 0.1 - 5.0 / 7.0 * 0.05 * G * 0.1);
    assert!((ball / expected - 1.0).abs() < 2e-2, "{ball} {expected}");
}

#[test]
fn a_ball_resists_rolling_on_a_body_that_does_not() {
    // Two spheres in a column, the lower one about the centre of mass.
    let column =
        || Body::new(8.4e-6, Vector::splat(1e-9), vec![Vector::ZERO, RADIUS * Vector::Z], vec![RADIUS; 2], 0.0);
    let gravity = Vector::new(0.0, 0.0, -G);
    // Spin about the normal of what stands on a held column, after a twentieth of a second.
    let spin_after = |shape: u32| {
        let bodies = vec![Body::ball(RADIUS), column()];
        let sunk = 2500.0 * bodies[shape as usize].volume * G / STIFFNESS;
        let law = LinearSpringDashpot { rolling_friction: 0.02, ..law(0.5) };
        let held = Grain { shape: 1, motion: Motion::Fixed, ..Grain::new(1, 2500.0, -RADIUS * Vector::Z) };
        let place = (2.0 * RADIUS - sunk) * Vector::Z;
        let stands = Grain { shape, angular_velocity: 3.0 * Vector::Z, ..Grain::new(2, 2500.0, place) };
        let mut engine =
            Engine::new(&domain(), setup(bodies, law, vec![]), &[held, stands]).expect("the case is sound");
        engine.advance(&domain(), &Loads::none(), gravity, 0.05, Substeps::Fixed(2500)).expect("the case is sound");
        engine.grains().angular_velocity(1).z
    };
    // Torque mu_r (R/2) m g on 2/5 m R^2.
    let expected = 3.0 - 0.02 * G / (0.8 * RADIUS) * 0.05;
    let ball = spin_after(0);
    assert!((ball / expected - 1.0).abs() < 0.03, "{ball} {expected}");
    // Control: another column.
    let other = spin_after(1);
    assert!((other / 3.0 - 1.0).abs() < 1e-6, "{other}");
}

/// Four spheres at the corners of a square, too heavy to turn.
fn block() -> Body {
    let at = |x: Real, y: Real| RADIUS * Vector::new(2.0 * x, 2.0 * y, 0.0);
    let centres = vec![at(-1.0, -1.0), at(1.0, -1.0), at(-1.0, 1.0), at(1.0, 1.0)];
    let volume = 4.0 * 4.2e-6;
    Body::new(volume, Vector::splat(1e3 * volume * RADIUS * RADIUS), centres, vec![RADIUS; 4], 0.0)
}

/// Way that the block creeps in a fifth of a second after having settled, over its spheres' diameter, per second.
fn creep(law: LinearSpringDashpot) -> Real {
    let gravity = slope(15.0);
    let mut engine = on_floor(block(), law, gravity, 4.0, Vector::ZERO);
    engine.advance(&domain(), &Loads::none(), gravity, 0.3, Substeps::Fixed(10_000)).expect("the case is sound");
    let before = engine.grains().position[0].x;
    engine.advance(&domain(), &Loads::none(), gravity, 0.2, Substeps::Fixed(7000)).expect("the case is sound");
    (engine.grains().position[0].x - before).abs() / 0.2 / (2.0 * RADIUS)
}

#[test]
fn a_block_sticks_to_a_slope_through_the_memory_of_its_contacts() {
    let sticks = creep(law(0.3));
    assert!(sticks < 1e-6, "{sticks}");
    // Negative control: friction by the dashpot alone creeps.
    let without_spring = LinearSpringDashpot {
        tangential_stiffness: 1e-6,
        damping: Damping::Literal { normal: 10.0, tangential: 10.0 },
        ..law(0.3)
    };
    let creeps = creep(without_spring);
    println!("creep {sticks} with springs, {creeps} without");
    assert!(creeps > 1e-4, "{creeps}");
}

#[test]
fn several_contacts_add_up() {
    let gravity = Vector::new(0.0, 0.0, -G);
    let mut engine = on_floor(block(), law(0.3), gravity, 4.0, Vector::ZERO);
    engine.advance(&domain(), &Loads::none(), gravity, 0.3, Substeps::Fixed(10_000)).expect("the case is sound");
    let g = engine.grains();
    let sunk = (RADIUS - g.position[0].z) * STIFFNESS / (g.mass[0] * G);
    assert!((sunk - 0.25).abs() < 1e-4, "{sunk}");
}

#[test]
fn a_moving_wall_carries_a_ball_along() {
    let gravity = Vector::new(0.0, 0.0, -G);
    let mut engine = on_floor(Body::ball(RADIUS), law(0.5), gravity, 1.0, Vector::ZERO);
    engine.set_wall_velocities(&domain(), Vector::new(0.2, 0.0, 0.05));
    engine.advance(&domain(), &Loads::none(), gravity, 0.4, Substeps::Fixed(20_000)).expect("the case is sound");
    let grains = engine.grains();
    assert!((engine.walls()[0].point.z - 0.02).abs() < 1e-12);
    assert!((grains.position[0].z - 0.03).abs() < 1e-5 && (grains.velocity[0].z - 0.05).abs() < 1e-3);
    // A ball on a belt ends up with two sevenths of its velocity.
    assert!((grains.velocity[0].x - 0.2 * 2.0 / 7.0).abs() < 1e-3, "{}", grains.velocity[0].x);
}

#[test]
fn grains_on_a_prescribed_course_do_not_mind_others() {
    let domain = domain();
    let setup = setup(vec![Body::ball(RADIUS), Body::prolate(RADIUS, 2.0 * RADIUS, 5)], law(0.3), vec![]);
    let spin = Vector::new(3.0, 1.0, -2.0);
    let grains = [
        Grain {
            shape: 1,
            motion: Motion::Prescribed,
            velocity: Vector::X,
            angular_velocity: spin,
            ..Grain::new(1, 2500.0, Vector::ZERO)
        },
        Grain::new(2, 2500.0, Vector::new(0.05, 0.0, 0.0)),
        Grain { motion: Motion::Fixed, ..Grain::new(3, 2500.0, Vector::new(0.2, 0.0, 0.0)) },
    ];
    let mut engine = Engine::new(&domain, setup, &grains).expect("the case is sound");
    let report =
        engine.advance(&domain, &Loads::none(), Vector::ZERO, 0.12, Substeps::Fixed(6000)).expect("the case is sound");
    let g = engine.grains();
    assert!((g.position[0] - Vector::new(0.12, 0.0, 0.0)).length() < 1e-12);
    assert!((g.angular_velocity(0) - spin).length() < 1e-9);
    assert!(g.position[1].x > 0.1 && g.velocity[1].x.abs() > 0.1);
    assert_eq!(g.position[2], Vector::new(0.2, 0.0, 0.0));
    assert!(report.largest_overlap > 0.0);
}

/// Speed at which a ball goes down a slope of 20 degrees at the end of half a second, in sub-steps of this length \[s].
fn down_the_slope(rolling_friction: Real, substep: Real) -> Real {
    let law = LinearSpringDashpot { rolling_friction, ..law(0.6) };
    let mut engine = on_floor(Body::ball(RADIUS), law, slope(20.0), 1.0, Vector::ZERO);
    let advance = |engine: &mut Engine, time: Real| {
        let substeps = Substeps::Fixed((time / substep).round() as usize);
        engine.advance(&domain(), &Loads::none(), slope(20.0), time, substeps).expect("the case is sound");
    };
    advance(&mut engine, 0.4);
    let before = engine.grains().position[0].x;
    advance(&mut engine, 0.1);
    (engine.grains().position[0].x - before) / 0.1
}

#[test]
fn rolling_friction_holds_a_ball_on_a_slope() {
    for friction in [0.4, 0.5, 1.5] {
        for substep in [2e-5, 5e-6] {
            let creeps = down_the_slope(friction, substep).abs();
            assert!(creeps < 1e-10, "{friction} {substep}: {creeps}");
        }
    }
    // Negative control: the tangent of the slope is 0.364. (5/7) g (sin 20 - 0.3 cos 20) t.
    let expected = 5.0 / 7.0 * G * (20.0_f64.to_radians().sin() - 0.3 * 20.0_f64.to_radians().cos()) * 0.45;
    let rolls = down_the_slope(0.3, 2e-5);
    assert!((rolls / expected - 1.0).abs() < 0.01, "{rolls} {expected}");
}

#[test]
fn a_ball_that_rolling_friction_holds_goes_on_from_a_snapshot_bit_by_bit() {
    let law = LinearSpringDashpot { rolling_friction: 0.5, ..law(0.6) };
    let make = || on_floor(Body::ball(RADIUS), law, slope(20.0), 1.0, Vector::ZERO);
    let advance = |engine: &mut Engine| {
        engine.advance(&domain(), &Loads::none(), slope(20.0), 0.002, Substeps::Fixed(100)).expect("the case is sound");
    };
    let mut whole = make();
    advance(&mut whole);
    let middle = snapshot_of(&domain(), &mut whole);
    advance(&mut whole);
    let again = |snapshot: &Snapshot| {
        let setup = setup(vec![Body::ball(RADIUS)], law, floor());
        let mut engine = Engine::restore(&domain(), setup, "dem/", snapshot).expect("the snapshot is whole");
        advance(&mut engine);
        (engine.grains().position[0], engine.grains().angular_velocity(0))
    };
    let expected = (whole.grains().position[0], whole.grains().angular_velocity(0));
    assert_eq!(again(&middle), expected);
    // Negative control: without the turn that its spring has taken up.
    let mut forgetful = Snapshot::default();
    for (name, section) in middle.sections().filter(|(name, _)| !name.ends_with("contact.turn")) {
        forgetful.put(name, section.clone());
    }
    assert_ne!(again(&forgetful), expected);
}

/// Kinetic energy, spins, and angular momenta about the origin of two balls.
struct Rolling {
    energy: Real,
    spin: [Vector; 2],
    angular_momentum: Vector,
}

/// Two balls of these `radii` \[m] on the x axis that roll upon each other without slip, pressed together by a force \[N] and at a speed of
/// approach [m/s], at the start and after each hundredth of a second.
fn upon_each_other(rolling_friction: Real, radii: [Real; 2], press: Real, approach: Real, rows: usize) -> Vec<Rolling> {
    let law = LinearSpringDashpot { rolling_friction, ..law(0.5) };
    let apart = radii[0] + radii[1] - press / STIFFNESS;
    // The surfaces have one velocity where they touch.
    let grains = [-1.0, 1.0].map(|side: Real| {
        let radius = radii[usize::from(side > 0.0)];
        Grain {
            scale: radius / RADIUS,
            velocity: -0.5 * side * approach * Vector::X,
            angular_velocity: side * 3.0 * RADIUS / radius * Vector::Y,
            ..Grain::new(if side < 0.0 { 1 } else { 2 }, 2500.0, Vector::new(0.5 * side * apart, 0.0, 0.0))
        }
    });
    let setup = setup(vec![Body::ball(RADIUS)], law, vec![]);
    let mut engine = Engine::new(&domain(), setup, &grains).expect("the case is sound");
    let force = [press * Vector::X, -press * Vector::X];
    let state = |engine: &Engine| {
        let g = engine.grains();
        let inertia = |n: usize| 0.4 * g.mass[n] * radii[n] * radii[n];
        let momentum = |n: usize| g.mass[n] * g.position[n].cross(g.velocity[n]) + inertia(n) * g.angular_velocity(n);
        Rolling {
            energy: g.kinetic_energy(0) + g.kinetic_energy(1),
            spin: [g.angular_velocity(0), g.angular_velocity(1)],
            angular_momentum: momentum(0) + momentum(1),
        }
    };
    let mut found = vec![state(&engine)];
    for _ in 0..rows {
        let loads = Loads { force: &force, ..Loads::none() };
        engine.advance(&domain(), &loads, Vector::ZERO, 0.01, Substeps::Fixed(1000)).expect("the case is sound");
        found.push(state(&engine));
    }
    found
}

#[test]
fn rolling_friction_stops_balls_that_roll_upon_each_other() {
    let rows = upon_each_other(0.02, [RADIUS; 2], 0.05, 0.0, 80);
    let mass = 2500.0 * 4.0 / 3.0 * std::f64::consts::PI * RADIUS.powi(3);
    // A torque of mu_r N R/2 on either.
    let slowing = 0.02 * 0.05 * RADIUS * 0.5 / (0.4 * mass * RADIUS * RADIUS);
    for (n, pair) in rows.windows(2).enumerate() {
        let (spin, expected) = (pair[1].spin, 3.0 - slowing * 0.01 * (n + 1) as Real);
        assert!((spin[0] + spin[1]).length() < 1e-9, "{n}: {spin:?}");
        // Then their springs hold them, and swing.
        if expected > 0.1 {
            assert!((spin[1].y - expected).abs() < 0.03 && pair[1].energy < pair[0].energy, "{n}: {spin:?} {expected}");
        }
    }
    let rest = rows[80].spin[1].length();
    assert!(rest < 1e-6, "{rest}");
    // Negative control.
    let free = upon_each_other(0.0, [RADIUS; 2], 0.05, 0.0, 80);
    assert!(free.iter().all(|row| (row.spin[1].y - 3.0).abs() < 1e-6), "{}", free[80].spin[1]);
}

#[test]
fn rolling_friction_keeps_the_angular_momentum_of_unequal_balls_and_takes_energy() {
    let radii = [0.6 * RADIUS, RADIUS];
    let rows = upon_each_other(0.2, radii, 0.0, 0.2, 1);
    let own = 0.4 * 2500.0 * 4.0 / 3.0 * std::f64::consts::PI * RADIUS.powi(5) * rows[0].spin[1].y;
    let drift = (rows[1].angular_momentum - rows[0].angular_momentum).length() / own;
    assert!(drift < 1e-11, "{drift}");
    // Control: the spins of both changed, and more energy is lost than without.
    let change = [0, 1].map(|n| (rows[1].spin[n] - rows[0].spin[n]).length() / rows[0].spin[n].length());
    assert!(change.iter().all(|change| *change > 0.1), "{change:?}");
    let without = upon_each_other(0.0, radii, 0.0, 0.2, 1);
    assert!(rows[1].energy < without[1].energy && without[1].energy < rows[0].energy);
}
