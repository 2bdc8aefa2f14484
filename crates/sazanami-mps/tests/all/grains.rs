//! Grains in water: falling, lying, light.

use sazanami_dem::{Grain, Motion};
use sazanami_mps::grains::{DragParameters, volume};
use sazanami_mps::solver::Forcing;
use sazanami_numerics::{Real, Vector};

use crate::support::{Case, GRAVITY, OPEN_TOP, PERIODIC, SPACING, WALLS, jittered, under};

/// Speed of a grain that falls through water at rest, from its drag law without added mass [m/s].
pub fn expected_speed(time: Real) -> Real {
    let law = DragParameters::recommended(1000.0, 1e-3);
    let (mass, weight) = (2650.0 * volume(SPACING), 1650.0 * volume(SPACING) * 9.81);
    let (mut speed, steps) = (0.0, 10_000);
    for _ in 0..steps {
        let drag = law.coefficient(SPACING, 1.0, speed) * speed;
        speed += time / Real::from(steps) * (weight - drag) / mass;
    }
    speed
}

/// Largest momentum of grains and water over that of the grains in 40 steps, in a box periodic all round that falls
/// freely but for a mean pressure gradient of `share` of what bears its weight, void fractions being at least `least_void`; mean
/// velocity of the grains in units of that of the water.
fn borne(share: Real, least_void: Real) -> [Real; 2] {
    let mut case = Case::filled([10; 3], [10; 3], [PERIODIC; 3]);
    case.least_void = least_void;
    case.fluid = jittered(case.fluid, 0.05);
    let place =
        |n: u64| SPACING * Vector::new((n % 2) as Real * 5.0, (n / 2 % 2) as Real * 5.0 + 1.0, (n / 4) as Real * 5.0);
    case.grains = (0..8).map(|n| Grain::new(n, 2650.0, place(n) + SPACING)).collect();
    let (water, solid) = (1e-6 * case.fluid.len() as Real, 8.0 * volume(SPACING));
    // Over the density of the water.
    let by_volume = -share * (water + 2650.0 * solid) / (water + 1e3 * solid) * GRAVITY;
    let mut solver = case.solo();
    let (mut largest, mut velocities, mut bounded) = (0.0, 0.0, 0);
    for _ in 0..40 {
        let forcing = Forcing { body_force: GRAVITY + by_volume, by_volume, ..Forcing::default() };
        let report = solver.step(2e-4, &forcing, |_| ()).expect("the step is sound");
        bounded += report.coupling.limited_voids;
        let grains = solver.grains().engine().grains();
        let own = (0..grains.owned()).map(|g| grains.mass[g] * grains.velocity[g]).sum::<Vector>();
        let water = solver.fluid_momentum();
        largest = Real::max(largest, (own + water).length() / own.length());
        velocities = own.z / water.z;
    }
    assert_eq!(bounded > 0, least_void > 0.9);
    [largest, velocities]
}

#[test]
fn a_mean_pressure_gradient_bears_the_weight_of_water_and_grains() {
    for least_void in [0.3, 0.98] {
        let [rest, counter] = borne(1.0, least_void);
        assert!(rest < 1e-9 && counter < 0.0, "{rest} {counter}");
        // Negative control: half of it bears less.
        let [rest, _] = borne(0.5, least_void);
        assert!(rest > 0.5, "{rest}");
    }
}

/// Drag impulse along x in a step on a grain that is held, of water that moves along x farther than `still` spacings from it alone [N s].
fn dragged_from_afar(smoothing: Real, still: Real) -> Real {
    let centre = SPACING * Vector::splat(7.0);
    let mut case = Case::filled([14, 14, 20], [14, 14, 16], [PERIODIC, PERIODIC, OPEN_TOP]);
    case.smoothing = smoothing;
    case.grains = vec![Grain { motion: Motion::Fixed, ..Grain::new(0, 2650.0, centre) }];
    let mut solver = case.solo();
    let is_near = |x: Vector| (x - centre).length() < still * SPACING;
    solver.set_velocities(|p, a| if is_near(p.position[a]) { Vector::ZERO } else { 0.1 * Vector::X });
    let report = solver.step(1e-5, &under(Vector::ZERO), |_| ()).expect("the step is sound").coupling;
    assert!((report.drag_on_grains + report.drag_on_fluid).length() <= 1e-12 * report.drag_on_grains.length());
    report.drag_on_grains.x
}

#[test]
fn a_grain_reads_the_fluid_within_its_reach_alone() {
    // All of the fluid moves: a mean is the same over any of it.
    let [near, far] = [2.5, 3.5].map(|reach| dragged_from_afar(reach, 0.0));
    assert!(far > 0.0 && (near / far - 1.0).abs() < 1e-9, "{near:e} {far:e}");
    // What moves is beyond the reach.
    let beyond = dragged_from_afar(2.5, 2.5);
    assert!(beyond.abs() < 1e-12 * far, "{beyond:e} {far:e}");
    // Negative controls: a longer reach sees it, and a shorter one what is just within.
    assert!(dragged_from_afar(3.5, 2.5) > 1e-3 * far);
    assert!(dragged_from_afar(2.5, 1.5) > 1e-2 * far);
}

#[test]
fn a_grain_is_borne_by_the_water_that_it_displaces() {
    let mut case = Case::filled([14, 14, 20], [14, 14, 18], [PERIODIC, PERIODIC, OPEN_TOP]);
    case.grains = vec![Grain::new(0, 2650.0, SPACING * Vector::new(7.13, 6.4, 9.0))];
    let submerged = |times: Real| -9.81 * (2650.0 - 1000.0 * times) / 2650.0;
    let mut solver = case.solo();
    // From rest, before drag counts: what pressure and weight make of it.
    let (dt, steps) = (1e-4, 10);
    for _ in 0..steps {
        solver.step(dt, &under(GRAVITY), |_| ()).unwrap();
    }
    let acceleration = solver.grains().engine().grains().velocity[0].z / (dt * Real::from(steps));
    assert!((acceleration / submerged(1.0) - 1.0).abs() < 0.03, "{acceleration} {}", submerged(1.0));
    // Negative control: no buoyancy, or twice as much.
    assert!([0.0, 2.0].iter().all(|&times| (acceleration / submerged(times) - 1.0).abs() > 0.3));
}

#[test]
fn glued_grains_go_with_the_walls() {
    let mut case = Case::filled([16, 8, 12], [10, 8, 6], [WALLS, PERIODIC, OPEN_TOP]);
    case.fluid.iter_mut().for_each(|p| p.position.x += 3.0 * SPACING);
    case.fluid.retain(|p| p.position.z > 1.2 * SPACING);
    let glued = |n: u64, motion: Motion| Grain {
        motion,
        ..Grain::new(n, 2650.0, SPACING * Vector::new(3.7 + 1.1 * (n % 8) as Real, 0.6 + 1.1 * (n / 8) as Real, 0.5))
    };
    let mut ways = |motion: Motion| {
        case.grains = (0..56).map(|n| glued(n, motion)).collect();
        let mut solver = case.solo();
        let (dt, steps) = (2e-4, 50);
        let speed = 0.1 * Vector::X;
        for n in 1..=steps {
            let wall_displacement = Real::from(n) * dt * speed;
            let forcing =
                Forcing { body_force: GRAVITY, wall_displacement, wall_velocity: speed, ..Forcing::default() };
            solver.step(dt, &forcing, |_| ()).unwrap();
        }
        let grains = solver.grains().engine().grains();
        let way = |n: usize| grains.unwrapped_position(n).x - case.grains[grains.id[n] as usize].position.x;
        (0..grains.owned()).map(way).fold([Real::INFINITY, Real::NEG_INFINITY], |[a, b], way| [a.min(way), b.max(way)])
    };
    let [least, most] = ways(Motion::WithWalls);
    assert!((least - 1e-3).abs() < 1e-12 && (most - 1e-3).abs() < 1e-12, "{least} {most}");
    // Negative control: fixed in the frame of the positions.
    assert_eq!(ways(Motion::Fixed), [0.0, 0.0]);
}

/// A few layers of grains under water, not yet settled.
fn pile(density: Real) -> Case {
    let mut case = Case::filled([12, 8, 14], [12, 8, 11], [WALLS, PERIODIC, OPEN_TOP]);
    case.fluid.retain(|p| {
        ((p.position.x / SPACING + 2.0 * p.position.y / SPACING) as usize).is_multiple_of(2) || p.position.z > 4e-3
    });
    case.grains = (0..11 * 7 * 3)
        .map(|id| {
            let at = |n: u64, step: Real| (n as Real + 0.5) * step;
            let place = Vector::new(at(id % 11, 12.0 / 11.0), at(id / 11 % 7, 8.0 / 7.0), at(id / 77, 1.02));
            Grain::new(id, density, SPACING * place)
        })
        .collect();
    case
}

/// Largest speed of a grain in any of some steps under `gravity` [m/s].
fn largest_speed(case: &Case, gravity: Vector, steps: usize) -> Real {
    let mut solver = case.solo();
    let mut largest: Real = 0.0;
    for _ in 0..steps {
        if solver.step(2e-4, &under(gravity), |_| ()).is_err() {
            return Real::INFINITY;
        }
        let grains = solver.grains().engine().grains();
        largest = grains.velocity.iter().map(|v| v.length()).fold(largest, Real::max);
    }
    largest
}

#[test]
fn light_grains_stay_calm() {
    let case = pile(550.0);
    let speed = largest_speed(&case, GRAVITY, 150);
    assert!(speed < 0.1, "{speed}");
    // Negative control: twenty times as much lift throws them about.
    let speed = largest_speed(&case, 20.0 * GRAVITY, 150);
    assert!(speed > 0.3, "{speed}");
}
