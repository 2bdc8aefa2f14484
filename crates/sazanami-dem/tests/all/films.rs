//! Liquid films between balls: impacts against closed form and measurements, momentum, energy, and the same bits.

use std::f64::consts::PI;

use sazanami_dem::*;
use sazanami_numerics::snapshot::Snapshot;
use sazanami_numerics::{Real, Vector};
use sazanami_parallel::Solo;

use crate::cloud::{bits_agree, fall};
use crate::support::{domain, floor, snapshot_of};

const RADIUS: Real = 1e-3;
const SPEED: Real = 0.1;
/// Restitution of glass and steel in air.
const DRY: Real = 0.97;
/// Roughness of polished balls over their radius (Joseph et al. 2001), and the radius as outer cut-off.
const ROUGHNESS: Real = 4e-5;
const REACH: Real = 1.0;

fn mass() -> Real {
    4.0 / 3.0 * PI * RADIUS.powi(3) * 2500.0
}

/// The film for which a ball that meets a wall at [`SPEED`] has the Stokes number `St = m v/(6 pi mu R^2)`.
fn film(stokes: Real) -> Film {
    let viscosity = mass() * SPEED / (6.0 * PI * RADIUS * RADIUS * stokes);
    Film { viscosity, roughness: ROUGHNESS * RADIUS, reach: REACH, farthest: Real::INFINITY, bounded: false }
}

fn setup(film: Option<Film>, walls: Vec<Wall>) -> Setup {
    let law = LinearSpringDashpot { damping: Damping::Restitution(DRY), ..LinearSpringDashpot::SAND };
    let interactions = Interactions::uniform(1, law).with_film(film);
    Setup { interactions, ..crate::support::setup(vec![Body::ball(RADIUS)], law, walls) }
}

/// Rebound speed over impact speed of a ball that comes to a wall from beyond the film, back there.
fn rebound(film: Option<Film>) -> Real {
    let domain = domain();
    let start = (1.0 + 1.01 * REACH) * RADIUS;
    let grain = Grain {
        mass: Some(mass()),
        velocity: Vector::new(0.0, 0.0, -SPEED),
        ..Grain::new(1, 1.0, Vector::new(0.0, 0.0, start))
    };
    let mut engine = Engine::new(&domain, setup(film, floor()), &[grain]).expect("the case is sound");
    for _ in 0..600 {
        engine.advance(&domain, &Loads::none(), Vector::ZERO, 1e-3, Substeps::Auto).expect("the case is sound");
        if engine.grains().position[0].z > start {
            break;
        }
    }
    engine.grains().velocity[0].z / SPEED
}

/// Rebound by the momentum `6 pi mu R^2 ln(h_0/eta)` that the film takes on the way in and on the way out.
fn by_passage(stokes: Real) -> Real {
    let taken = (REACH / ROUGHNESS).ln() / stokes;
    (DRY * (1.0 - taken) - taken).max(0.0)
}

#[test]
fn balls_rebound_from_a_wall_as_measured_in_liquids() {
    for stokes in [20.0, 50.0, 150.0, 1000.0] {
        let found = rebound(Some(film(stokes)));
        assert!((found - by_passage(stokes)).abs() < 5e-3, "{stokes}: {found} {}", by_passage(stokes));
        // Mean curve through the measurements of Gondret et al. (2002) by Legendre et al. (2006), whose scatter is 0.1; below
        // a Stokes number of 20 Gondret et al. saw no rebound.
        let measured = (-35.0 / stokes).exp();
        let band = if stokes > 20.0 { 0.1 } else { 0.18 };
        assert!((found / DRY - measured).abs() < band, "{stokes}: {} {measured}", found / DRY);
    }
    // Controls: without a film, and with one of no viscosity, a ball rebounds as in air.
    for none in [None, Some(Film { viscosity: 0.0, ..film(1.0) })] {
        let found = rebound(none);
        assert!((found - DRY).abs() < 5e-3, "{found}");
    }
}

#[test]
fn a_film_of_little_wetness_is_that_of_a_liquid_as_much_less_viscous() {
    // Sub-steps in which the film of the whole viscosity is cut to what they bear, and that of a hundredth is not.
    let thick = Film { bounded: true, ..film(0.5) };
    let speed = |film: Film, wetness: Real| {
        let domain = domain();
        let grain = Grain {
            mass: Some(mass()),
            velocity: Vector::new(0.0, 0.0, -SPEED),
            ..Grain::new(1, 1.0, Vector::new(0.0, 0.0, 1.05 * RADIUS))
        };
        let mut engine = Engine::new(&domain, setup(Some(film), floor()), &[grain]).expect("the case is sound");
        for _ in 0..4 {
            engine.wetness_mut().fill(wetness);
            engine.advance(&domain, &Loads::none(), Vector::ZERO, 1e-4, Substeps::Fixed(2)).expect("the case is sound");
        }
        engine.grains().velocity[0].z
    };
    let thin = Film { viscosity: 0.01 * thick.viscosity, ..thick };
    let [wet, of_thin, whole] = [speed(thick, 0.01), speed(thin, 1.0), speed(thick, 1.0)];
    assert!((wet / of_thin - 1.0).abs() < 1e-12, "{wet} {of_thin}");
    // Controls: the whole film is cut, to less than the hundredfold of the thin one, and does more.
    assert!(
        (whole + SPEED) > 1.5 * (of_thin + SPEED) && (whole + SPEED) < 50.0 * (of_thin + SPEED),
        "{whole} {of_thin}"
    );
}

/// Two balls of unlike masses that meet head on, once they are out of the film again: their velocities, what each step left of momentum
/// and energy, and the largest energy beside that of the start.
fn meeting(film: Option<Film>) -> ([Real; 2], Real, bool) {
    let domain = domain();
    let masses = [mass(), 2.0 * mass()];
    let ball = |n: usize, x: Real, v: Real| Grain {
        mass: Some(masses[n]),
        velocity: Vector::new(v, 0.0, 0.0),
        ..Grain::new(n as u64, 1.0, Vector::new(x, 0.0, 0.0))
    };
    let apart = (1.0 + 0.51 * REACH) * RADIUS;
    let grains = [ball(0, -apart, 2.0 * SPEED), ball(1, apart, -SPEED)];
    let mut engine = Engine::new(&domain, setup(film, vec![]), &grains).expect("the case is sound");
    let velocities = |engine: &Engine| [0, 1].map(|n| engine.grains().velocity[n].x);
    let kinetic = |v: [Real; 2]| 0.5 * (masses[0] * v[0] * v[0] + masses[1] * v[1] * v[1]);
    let (mut drift, mut loses) = (0.0, true);
    let mut before = kinetic(velocities(&engine));
    let start = before;
    for _ in 0..2000 {
        let report =
            engine.advance(&domain, &Loads::none(), Vector::ZERO, 1e-5, Substeps::Auto).expect("the case is sound");
        let v = velocities(&engine);
        drift = Real::max(drift, (masses[0] * v[0] + masses[1] * v[1]).abs() / (mass() * SPEED));
        let energy = kinetic(v);
        // Springs hold energy for a while.
        loses &= if report.contacts == 0 && engine.elastic_energy() == 0.0 && before < start {
            energy <= before || before == 0.0
        } else {
            energy + engine.elastic_energy() <= start * (1.0 + 1e-12)
        };
        before = if report.contacts == 0 && engine.elastic_energy() == 0.0 { energy } else { start };
        let places = &engine.grains().position;
        if places[1].x - places[0].x > 2.0 * apart {
            break;
        }
    }
    (velocities(&engine), drift, loses)
}

#[test]
fn two_balls_keep_their_momentum_and_gain_no_energy() {
    // Effective radius R/2, effective mass 2/3 m, speed of approach 3 v: the Stokes number is 8 times that at a wall.
    let stokes = 15.0;
    let (v, drift, loses) = meeting(Some(film(stokes)));
    assert!(drift < 1e-9 && loses, "{drift} {loses}");
    let found = (v[1] - v[0]) / (3.0 * SPEED);
    assert!((found - by_passage(8.0 * stokes)).abs() < 5e-3, "{found} {}", by_passage(8.0 * stokes));
    // Control: as in air without a film.
    let (v, ..) = meeting(None);
    assert!(((v[1] - v[0]) / (3.0 * SPEED) - DRY).abs() < 5e-3);
}

#[test]
fn a_film_is_no_contact() {
    let domain = domain();
    let at = |id: u64, x: Real| Grain::new(id, 2500.0, Vector::new(x, 0.0, 0.0));
    let state = |x: Real| {
        let grains = [at(1, 0.0), Grain { velocity: Vector::new(-1e-3, 0.0, 0.0), ..at(2, x) }];
        let mut engine = Engine::new(&domain, setup(Some(film(50.0)), vec![]), &grains).expect("the case is sound");
        let report =
            engine.advance(&domain, &Loads::none(), Vector::ZERO, 1e-6, Substeps::Fixed(1)).expect("the case is sound");
        // Nor is it one to new lists, those after an interruption among them.
        let snapshot = snapshot_of(&domain, &mut engine);
        let again =
            Engine::restore(&domain, setup(Some(film(50.0)), vec![]), "dem/", &snapshot).expect("the case is sound");
        assert_eq!([0, 1].map(|n| engine.touched_grains(n)), [0, 1].map(|n| again.touched_grains(n)));
        let grains = engine.grains();
        let moved = grains.velocity[0].x != 0.0;
        (
            moved,
            report.contacts,
            [0, 1].map(|n| engine.touched_grains(n)),
            [0, 1].map(|n| grains.last_contact[n] > -1.0),
        )
    };
    assert_eq!(state(2.01 * RADIUS), (true, 0, [0, 0], [false; 2]));
    // Controls: beyond the film nothing acts, and balls that overlap touch.
    assert_eq!(state(3.01 * RADIUS), (false, 0, [0, 0], [false; 2]));
    assert_eq!(state(1.999 * RADIUS), (true, 1, [1, 1], [true; 2]));
}

#[test]
fn ranks_threads_and_interruptions_leave_the_bits_alone() {
    let film = Some(Film { viscosity: 1e-2, roughness: 2e-6, reach: 0.3, farthest: Real::INFINITY, bounded: false });
    let [half, expected] = bits_agree(|| setup(film, vec![]));
    let reals = |snapshot: &Snapshot, name: &str| snapshot.reals(name).expect("the snapshot is whole").to_vec();
    let in_films = |snapshot: &Snapshot| {
        let displacements = reals(snapshot, "dem/contact.displacement");
        displacements.chunks(3).filter(|d| *d == [0.0; 3]).count()
    };
    assert!(in_films(&half) > 20 && in_films(&expected) > 20, "{} {}", in_films(&half), in_films(&expected));
    // Control: the film does act.
    let dry = fall(Box::new(Solo::default()), setup(None, vec![]), None, 80);
    assert!(reals(&dry, "dem/grain.velocity") != reals(&expected, "dem/grain.velocity"));
}

#[test]
fn the_sub_step_resolves_the_film() {
    let longest = |film: Option<Film>| {
        let interactions = setup(film, vec![]).interactions;
        let mut masses = stability::EffectiveMasses::new(&interactions);
        masses.add(&Body::ball(RADIUS), 1.0, mass(), 0);
        masses.longest_substep().shortest()
    };
    let rate = SPEED / (20.0 * ROUGHNESS * RADIUS);
    assert!((longest(Some(film(20.0))) * rate / 0.15 - 1.0).abs() < 1e-12);
    // Controls: none, and a thin liquid, for which the springs count.
    assert_eq!(longest(Some(film(5e4))), longest(None));
    assert!(longest(None) > longest(Some(film(20.0))));
}

#[test]
fn films_that_make_no_sense_are_refused() {
    let grain = [Grain::new(3, 2650.0, Vector::ZERO)];
    let refusal = |film: Film, body: Body| {
        let setup = Setup { bodies: vec![body], ..setup(Some(film), vec![]) };
        Engine::new(&domain(), setup, &grain).map_or_else(|error| error.to_string(), |_| String::new())
    };
    let sound = film(50.0);
    assert_eq!(refusal(sound, Body::ball(RADIUS)), "");
    assert!(refusal(Film { roughness: 0.0, ..sound }, Body::ball(RADIUS)).contains("above zero"));
    assert!(refusal(Film { reach: 1e-6, ..sound }, Body::ball(RADIUS)).contains("grain 3 has no film"));
    assert!(refusal(sound, Body::prolate(0.26e-3, 0.635e-3, 9)).contains("grain 3 has no film"));
}
