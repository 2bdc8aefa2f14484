//! Drag, implicit in the sub-steps, and the impulse that the fluid gets back.

use sazanami_dem::*;
use sazanami_numerics::domain::Domain;
use sazanami_numerics::grid::Grid;
use sazanami_numerics::{Random, Real, Vector};
use sazanami_parallel::{Communicator, Solo, run_ranks, with_threads};

const WIDTH: Real = 8e-3;
const RADIUS: Real = 0.5e-3;
const GRAVITY: Vector = Vector::new(0.0, 0.0, -9.81);

/// Drag with a coefficient that grows with the slip: `linear + quadratic |u - v|`.
struct Law {
    fluid: Vec<Vector>,
    linear: Real,
    quadratic: Real,
}

impl Drag for Law {
    fn fluid_velocity(&self, own: usize) -> Vector {
        self.fluid[own]
    }

    fn coefficient(&self, _: usize, slip: Real) -> Real {
        self.linear + self.quadratic * slip
    }
}

fn domain(communicator: Box<dyn Communicator>, periodic: bool) -> Domain {
    let grid = Grid::new([24, 16, 8], Vector::ZERO, Vector::splat(WIDTH));
    Domain::new(grid, [periodic, periodic, false], communicator).expect("the box can be cut")
}

fn alone(periodic: bool) -> Domain {
    domain(Box::new(Solo::default()), periodic)
}

fn setup(walls: Vec<Wall>) -> Setup {
    let law = LinearSpringDashpot::spheres(400.0, 0.5, 0.4);
    crate::support::setup(vec![Body::ball(RADIUS), Body::prolate(0.4e-3, 0.7e-3, 5)], law, walls)
}

/// Balls and spheroids that fly at each other; every seventh does not mind forces.
fn dense_grains() -> Vec<Grain> {
    let mut random = Random::new(3);
    let mut grains: Vec<Grain> = (0..150)
        .map(|n| Grain {
            shape: (n % 4 == 0).into(),
            scale: random.between(0.6, 0.9),
            ..Grain::new(n, 2650.0, Vector::ZERO)
        })
        .collect();
    let settings = PackingSettings::new(Vector::ZERO, Vector::new(WIDTH, WIDTH, 1.0));
    settings.arrange(&setup(vec![]).bodies, &mut grains).expect("the lattice fits");
    for grain in &mut grains {
        grain.velocity = Vector::new(random.between(-1.0, 1.0), random.between(-1.0, 1.0), random.between(-1.0, 1.0));
        grain.motion = match grain.id % 14 {
            0 => Motion::Fixed,
            7 => Motion::Prescribed,
            _ => Motion::Free,
        };
    }
    grains
}

/// Fluid that swirls round the middle of the box, at the grains of this rank.
fn swirl(grains: &Grains) -> Law {
    let at = |p: Vector| Vector::new(-40.0 * (p.y - 0.5 * WIDTH), 40.0 * (p.x - 0.5 * WIDTH), 0.1);
    Law { fluid: (0..grains.owned()).map(|g| at(grains.position[g])).collect(), linear: 2e-5, quadratic: 5e-4 }
}

#[test]
fn linear_drag_is_implicit_euler() {
    let domain = alone(false);
    let (v, u) = (Vector::new(0.1, -0.3, 0.2), Vector::new(0.5, 0.0, -0.1));
    let grain = Grain { velocity: v, ..Grain::new(1, 2650.0, Vector::splat(0.5 * WIDTH)) };
    let mut engine = Engine::new(&domain, setup(vec![]), &[grain]).expect("the case is sound");
    let (h, count) = (1e-5, 40);
    for kappa in [1e-4, 3e-2, 1e3] {
        let start = engine.grains().velocity[0];
        let drag = Law { fluid: vec![u], linear: kappa, quadratic: 0.0 };
        let loads = Loads { drag: Some(&drag), ..Loads::none() };
        let time = h * Real::from(count);
        engine.advance(&domain, &loads, Vector::ZERO, time, Substeps::Fixed(count as usize)).expect("it flies");
        let grains = engine.grains();
        let factor = (1.0 + h * kappa / grains.mass[0]).powi(-count);
        let expected = u + factor * (start - u);
        assert!((grains.velocity[0] - expected).length() < 1e-14, "{kappa}: {} {expected}", grains.velocity[0]);
        let gained = grains.mass[0] * (grains.velocity[0] - start);
        assert!((grains.drag_impulse[0] - gained).length() < 1e-13 * grains.mass[0]);
        // Negative control: the explicit factor is another.
        let explicit = u + (1.0 - h * kappa / grains.mass[0]).powi(count) * (start - u);
        assert!(kappa > 1.0 || (grains.velocity[0] - explicit).length() > 1e-6, "{kappa}");
        // A call without drag forgets the impulse of the last.
        engine.advance(&domain, &Loads::none(), Vector::ZERO, h, Substeps::Fixed(1)).expect("it flies");
        assert_eq!(engine.grains().drag_impulse, [Vector::ZERO]);
        engine.set_velocity(0, v, Vector::ZERO);
    }
}

#[test]
fn added_mass_is_inertia_without_weight() {
    let domain = alone(false);
    let start = Vector::new(0.1, -0.3, 0.2);
    let grain = Grain { velocity: start, ..Grain::new(1, 2650.0, Vector::splat(0.5 * WIDTH)) };
    let held = Grain { motion: Motion::Fixed, ..Grain::new(2, 2650.0, Vector::splat(0.9 * WIDTH)) };
    let (h, kappa, u, force) = (1e-4, 3e-2, 0.5 * Vector::X, 1e-3 * Vector::Y);
    let drag = Law { fluid: vec![u; 2], linear: kappa, quadratic: 0.0 };
    let moved = |added: Real| {
        let mut engine = Engine::new(&domain, setup(vec![]), &[grain, held]).expect("the case is sound");
        let (force, added_mass) = ([force; 2], [added * engine.grains().mass[0]; 2]);
        let loads = Loads { force: &force, added_mass: &added_mass, drag: Some(&drag), ..Loads::none() };
        engine.advance(&domain, &loads, GRAVITY, h, Substeps::Fixed(1)).expect("it flies");
        let grains = engine.grains();
        assert_eq!(grains.velocity[1], Vector::ZERO);
        (grains.velocity[0], grains.drag_impulse[0], grains.mass[0])
    };
    for added in [0.3, 5.0] {
        let (found, impulse, m) = moved(added);
        let whole = (1.0 + added) * m;
        // Implicit Euler: `(m + a)(v' - v)/h = F + m g + kappa (u - v')`.
        let expected = (whole * start + h * (force + m * GRAVITY + kappa * u)) / (whole + h * kappa);
        assert!((found - expected).length() < 1e-14, "{found} {expected}");
        assert!((impulse - h * kappa * (u - expected)).length() < 1e-13 * m);
        // Negative control: without it.
        let (without, ..) = moved(0.0);
        assert!((found - without).length() > 1e-4, "{found} {without}");
    }
}

/// Restitution of a ball that falls on a floor, in the speeds of its first bounce.
fn restitution(added: Real) -> Real {
    let domain = alone(false);
    let mut grain = Grain::new(1, 2650.0, Vector::splat(0.5 * WIDTH));
    grain.velocity = -Vector::Z;
    let floor = Wall::at_rest(Vector::new(0.0, 0.0, 0.4 * WIDTH), Vector::Z, 0);
    let mut engine = Engine::new(&domain, setup(vec![floor]), &[grain]).expect("the case is sound");
    let added_mass = [added * engine.grains().mass[0]];
    let loads = Loads { added_mass: &added_mass, ..Loads::none() };
    for _ in 0..4000 {
        engine.advance(&domain, &loads, Vector::ZERO, 1e-5, Substeps::Auto).expect("it bounces");
    }
    engine.grains().velocity[0].z
}

#[test]
fn a_ball_with_added_mass_bounces_as_a_heavier_one() {
    let [dry, wet] = [0.0, 1.0].map(restitution);
    assert!(dry > 0.1 && wet > 1.05 * dry, "{dry} {wet}");
}

#[test]
fn a_ball_falls_at_its_terminal_velocity() {
    let domain = alone(false);
    let ball = Grain::new(1, 2650.0, Vector::splat(0.5 * WIDTH));
    let mut engine = Engine::new(&domain, setup(vec![]), &[ball]).expect("the case is sound");
    let drag = Law { fluid: vec![Vector::ZERO], linear: 0.0, quadratic: 3.5e-4 };
    let loads = Loads { drag: Some(&drag), ..Loads::none() };
    let speed = (engine.grains().mass[0] * 9.81 / drag.quadratic).sqrt();
    let mut half = None;
    for n in 1..=2000 {
        engine.advance(&domain, &loads, GRAVITY, 2e-4, Substeps::Fixed(20)).expect("it falls");
        if -engine.grains().velocity[0].z > 0.5 * speed && half.is_none() {
            half = Some(2e-4 * Real::from(n));
        }
    }
    assert!((engine.grains().velocity[0].z / -speed - 1.0).abs() < 1e-12, "{}", engine.grains().velocity[0]);
    // v = v_t tanh(g t/v_t)
    let expected = speed / 9.81 * 0.5_f64.atanh();
    assert!((half.expect("it reaches half") - expected).abs() < 3e-4, "{half:?} {expected}");
}

#[test]
fn grains_and_fluid_together_keep_their_momentum() {
    let domain = alone(false);
    let mut engine = Engine::new(&domain, setup(vec![]), &dense_grains()).expect("the case is sound");
    let momentum = |grains: &Grains| {
        let free = (0..grains.owned()).filter(|&g| grains.motion[g] == Motion::Free);
        free.map(|g| grains.mass[g] * grains.velocity[g]).sum::<Vector>()
    };
    let size: Real = (0..150).map(|g| engine.grains().mass[g] * engine.grains().velocity[g].length()).sum();
    // Without the grains that forces do not move: those take momentum through contacts.
    let mut free: Vec<Grain> = dense_grains();
    free.retain(|g| g.motion == Motion::Free);
    let mut closed = Engine::new(&domain, setup(vec![]), &free).expect("the case is sound");
    let (mut contacts, mut worst, mut control) = (0, 0.0_f64, 0.0_f64);
    for _ in 0..40 {
        let before = momentum(closed.grains());
        let drag = swirl(closed.grains());
        let loads = Loads { drag: Some(&drag), ..Loads::none() };
        contacts += closed.advance(&domain, &loads, GRAVITY, 1e-4, Substeps::Auto).expect("they fly").contacts;
        let grains = closed.grains();
        let weight = 1e-4 * GRAVITY * grains.mass.iter().sum::<Real>();
        let given: Vector = grains.drag_impulse.iter().sum();
        let change = momentum(grains) - before - weight;
        worst = worst.max((change - given).length() / size);
        // Negative control: the impulse of the last velocities alone is another.
        let kappa = |g: usize, u: Vector| drag.coefficient(g, (u - grains.velocity[g]).length());
        let late = |g: usize| 1e-4 * kappa(g, drag.fluid[g]) * (drag.fluid[g] - grains.velocity[g]);
        control = control.max((change - (0..grains.owned()).map(late).sum::<Vector>()).length() / size);
    }
    println!("momentum closes to {worst:e} (explicit sum {control:e}), {contacts} contacts");
    assert!(contacts > 20 && worst < 1e-13 && control > 1e-6, "{contacts} {worst} {control}");

    // What does not move still holds the fluid back: h kappa (u - v).
    let drag = swirl(engine.grains());
    let loads = Loads { drag: Some(&drag), ..Loads::none() };
    engine.advance(&domain, &loads, GRAVITY, 1e-4, Substeps::Auto).expect("they fly");
    let grains = engine.grains();
    let mut held = 0;
    for g in (0..grains.owned()).filter(|&g| grains.motion[g] != Motion::Free) {
        let slip = drag.fluid[g] - grains.velocity[g];
        let expected = 1e-4 * drag.coefficient(g, slip.length()) * slip;
        assert!((grains.drag_impulse[g] - expected).length() < 1e-12 * expected.length());
        held += 1;
    }
    assert!(held > 10);
}

/// State of every grain after some steps in a swirl: identifier, velocity, impulse of the drag.
fn stirred(domain: &Domain, factor: Real) -> Vec<(u64, Vector, Vector)> {
    let mut engine = Engine::new(domain, setup(crate::support::floor()), &dense_grains()).expect("the case is sound");
    for _ in 0..60 {
        let mut drag = swirl(engine.grains());
        drag.quadratic *= factor;
        drag.linear *= factor;
        let loads = Loads { drag: Some(&drag), ..Loads::none() };
        engine.advance(domain, &loads, GRAVITY, 2e-4, Substeps::Fixed(20)).expect("they fly");
        // A corrected force afterwards, as from a new pressure.
        let grains = engine.grains();
        let impulses: Vec<Vector> = (0..grains.owned()).map(|g| 1e-3 * grains.drag_impulse[g]).collect();
        engine.apply_impulses(domain, &impulses);
    }
    let grains = engine.grains();
    (0..grains.owned()).map(|g| (grains.id[g], grains.velocity[g], grains.drag_impulse[g])).collect()
}

#[test]
fn drag_has_the_same_bits_on_any_ranks_and_threads() {
    for periodic in [false, true] {
        let expected = stirred(&alone(periodic), 1.0);
        assert!(expected.iter().all(|(.., impulse)| *impulse != Vector::ZERO));
        for threads in [2, 3] {
            let found = with_threads(threads, || stirred(&alone(periodic), 1.0));
            assert!(found.expect("the threads are granted") == expected, "{threads} threads");
        }
        for ranks in [2, 4, 6] {
            let parts = run_ranks(ranks, 1, |c| stirred(&domain(c, periodic), 1.0)).expect("the case is sound");
            let mut found: Vec<_> = parts.into_iter().flatten().collect();
            found.sort_by_key(|f| f.0);
            assert!(found == expected, "{ranks} ranks, periodic {periodic}");
        }
        // Negative control: the comparison sees a change of round-off size.
        assert!(stirred(&alone(periodic), 1.0 + 1e-15) != expected);
    }
}

#[test]
fn a_drag_of_nothing_changes_no_bits() {
    let domain = alone(false);
    let run = |drag: Option<&dyn Drag>| {
        let mut engine = Engine::new(&domain, setup(vec![]), &dense_grains()).expect("the case is sound");
        engine.advance(&domain, &Loads { drag, ..Loads::none() }, GRAVITY, 4e-3, Substeps::Auto).expect("they fly");
        (engine.grains().velocity.clone(), engine.grains().orientation.clone())
    };
    let still = Law { fluid: vec![Vector::ZERO; 150], linear: 0.0, quadratic: 0.0 };
    let nearly = Law { fluid: vec![Vector::ZERO; 150], linear: 1e-12, quadratic: 0.0 };
    assert!(run(Some(&still)) == run(None));
    assert!(run(Some(&nearly)) != run(None));
}

#[test]
fn impulses_move_free_grains_only() {
    let domain = alone(false);
    let mut engine = Engine::new(&domain, setup(vec![]), &dense_grains()).expect("the case is sound");
    let before = engine.grains().clone();
    let impulse = Vector::new(1e-7, 0.0, -2e-7);
    engine.apply_impulses(&domain, &[impulse; 150]);
    let after = engine.grains();
    for g in 0..after.owned() {
        let expected = if before.motion[g] == Motion::Free { impulse / before.mass[g] } else { Vector::ZERO };
        assert!((after.velocity[g] - before.velocity[g] - expected).length() < 1e-15);
        assert_eq!(after.angular_momentum[g], before.angular_momentum[g]);
    }
}
