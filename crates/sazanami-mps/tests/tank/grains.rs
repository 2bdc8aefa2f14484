//! Grains in water: falling, lying, light.

use sazanami_dem::Grain;
use sazanami_mps::grains::{Closure, volume};
use sazanami_numerics::{Real, Vector};

use crate::support::{Case, GRAVITY, OPEN_TOP, PERIODIC, SPACING, WALLS, under};

/// Speed of a grain that falls through water at rest, from its drag law without added mass [m/s].
fn expected_speed(time: Real) -> Real {
    let closure = Closure::recommended(1000.0, 1e-3);
    let (mass, weight) = (2650.0 * volume(SPACING), 1650.0 * volume(SPACING) * 9.81);
    let (mut speed, steps) = (0.0, 10_000);
    for _ in 0..steps {
        let drag = closure.coefficient(SPACING, 1.0, speed) * speed;
        speed += time / Real::from(steps) * (weight - drag) / mass;
    }
    speed
}

#[test]
fn a_grain_falls_as_its_drag_says_and_the_fluid_gets_what_it_loses() {
    let mut case = Case::filled([14, 14, 26], [14, 14, 24], [PERIODIC, PERIODIC, OPEN_TOP]);
    case.grains = vec![Grain::new(0, 2650.0, SPACING * Vector::new(7.13, 6.4, 21.0))];
    let mut solver = case.solo();
    let (dt, steps) = (2e-4, 300);
    for _ in 0..steps {
        let report = solver.step(dt, &under(GRAVITY), |_| ()).unwrap().coupling;
        let scale = report.drag_on_grains.length();
        assert!((report.drag_on_grains + report.drag_on_fluid).length() <= 1e-12 * scale);
    }
    let found = -solver.grains().engine().grains().velocity[0].z;
    let expected = expected_speed(dt * Real::from(steps));
    assert!((found / expected - 1.0).abs() < 0.03, "{found} {expected}");
    // Negative control: with its own share counted as a neighbour's the drag would be larger by some per cent.
    let own = 1.0 - 0.065;
    let crowded = Closure::recommended(1000.0, 1e-3);
    let ratio = crowded.coefficient(SPACING, own, expected) / crowded.coefficient(SPACING, 1.0, expected);
    assert!(ratio > 1.05);
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

/// Largest speed of a grain in any of some steps [m/s].
fn largest_speed(case: &Case, steps: usize) -> Real {
    let mut solver = case.solo();
    let mut largest: Real = 0.0;
    for _ in 0..steps {
        if solver.step(2e-4, &under(GRAVITY), |_| ()).is_err() {
            return Real::INFINITY;
        }
        let grains = solver.grains().engine().grains();
        largest = grains.velocity.iter().map(|v| v.length()).fold(largest, Real::max);
    }
    largest
}

#[test]
fn light_grains_stay_calm() {
    let mut case = pile(550.0);
    let speed = largest_speed(&case, 150);
    assert!(speed < 0.1, "{speed}");
    // Negative control: with the pressure of the step before they are thrown about.
    case.implicit_pressure_force = false;
    let speed = largest_speed(&case, 150);
    assert!(speed > 0.3, "{speed}");
}
