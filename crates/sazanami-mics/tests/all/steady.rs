//! Steady flows do not depend on the step, whatever the scheme of the viscous stress.

use std::sync::Arc;

use sazanami_dem::Engine;
use sazanami_mics::boundary::{Boundary, Side};
use sazanami_mics::flow::{Flow, Fluids, Schemes};
use sazanami_mics::grains::Coupling;
use sazanami_mics::pressure::Tolerance;
use sazanami_mics::solver::{GridSettings, Solver};
use sazanami_mics::stability::StepLimits;
use sazanami_mics::viscosity::ViscosityScheme;
use sazanami_numerics::domain::Domain;
use sazanami_numerics::grid::Grid;
use sazanami_numerics::{Real, Vector};

use crate::support::no_grains;

/// Cells between the plates, 1 m wide each, and the acceleration along them [m/s^2], so small that a step of 16 s is one pass. The
/// kinematic viscosity is 1 m^2/s.
const CELLS: usize = 16;
const ALONG: Real = 1e-4;

/// Fluid at rest between the plates under that acceleration and a weight across them of 0.1 m/s^2.
fn plates(limits: StepLimits, viscosity: ViscosityScheme, incremental: bool) -> Solver {
    let grid = Grid::new([2, 2, CELLS], Vector::ZERO, Vector::new(2.0, 2.0, CELLS as Real));
    let boundary = Boundary::new([[Side::Periodic; 2], [Side::Periodic; 2], [Side::NoSlip; 2]]).expect("two plates");
    let domain = Domain::solo(grid, boundary.periodic());
    let fluids = Fluids { liquid_density: 2.0, gas_density: 2.0, liquid_viscosity: 2.0, gas_viscosity: 2.0 };
    let flow = Flow::new(&domain, fluids, Schemes { viscosity, ..Schemes::default() });
    let engine = Engine::new(&domain, no_grains(), &[]).expect("an engine without grains");
    let tolerance = Tolerance { divergence: 1e-10, ..Tolerance::default() };
    let settings = GridSettings { gravity: Vector::new(ALONG, 0.0, -0.1), limits, tolerance, incremental };
    Solver::new(domain, boundary, settings, flow, engine, Arc::from([]), Coupling::default()).expect("fluid at rest")
}

/// Largest difference from the parabola between two plates after a long time, in steps of `dt` \[s], over the largest velocity.
/// On the grid the parabola is higher by an eighth of the acceleration times the squared width over the viscosity. With `jolts`
/// the acceleration is twice as large in every other step and zero in between.
fn error(dt: Real, viscosity: ViscosityScheme, incremental: bool, jolts: bool) -> Real {
    let mut solver = plates(StepLimits::always(dt), viscosity, incremental);
    // Twelve times h^2/(pi^2 nu).
    let steps = (12.0 * (CELLS * CELLS) as Real / std::f64::consts::PI.powi(2) / dt).ceil() as usize;
    for n in 0..steps {
        if jolts {
            solver.set_gravity(Vector::new(if n % 2 == steps % 2 { 0.0 } else { 2.0 * ALONG }, 0.0, -0.1));
        }
        let step = solver.stable_step();
        solver.step(step, dt, |_| {}).expect("a slow flow");
    }
    let height = CELLS as Real;
    (0..CELLS as isize).fold(0.0, |worst: Real, k| {
        let z = k as Real + 0.5;
        let exact = 0.5 * ALONG * (z * (height - z) + 0.25);
        worst.max((solver.flow().velocity[0][[0, 0, k]] - exact).abs())
    }) / (ALONG * height * height / 8.0)
}

#[test]
fn the_flow_between_plates_is_the_same_in_steps_of_any_length() {
    for viscosity in [ViscosityScheme::Auto, ViscosityScheme::Implicit, ViscosityScheme::CrankNicolson] {
        for incremental in [false, true] {
            for dt in [1.0, 4.0, 16.0] {
                // In steps of 16 dx^2/nu the trapezoidal rule has hardly damped the shortest waves of the start.
                if viscosity == ViscosityScheme::CrankNicolson && dt > 4.0 {
                    continue;
                }
                let error = error(dt, viscosity, incremental, false);
                assert!(error < 2e-4, "{viscosity:?}, {dt} s, incremental {incremental}: {error:e}");
            }
        }
    }
}

#[test]
fn a_change_of_gravity_adds_half_of_it_over_a_step() {
    // Negative control: the viscous step sees the acceleration of the step before.
    for dt in [0.3, 4.0] {
        let expected = 4.0 * dt / (CELLS * CELLS) as Real;
        let found = error(dt, ViscosityScheme::Implicit, false, true);
        assert!((found / expected - 1.0).abs() < 0.02, "{found} for {expected}");
    }
}

#[test]
fn the_first_step_starts_from_the_pressure_under_gravity() {
    let weighed = |longest: Real| {
        let solver = plates(StepLimits::up_to(longest), ViscosityScheme::Implicit, false);
        let at = |k: isize| solver.pressure()[[0, 0, k]];
        assert!(solver.flow().velocity.iter().all(|u| u.data().iter().all(|&u| u == 0.0)));
        at(0) - at(CELLS as isize - 1)
    };
    for longest in [1e-3, 1.0, 1e3] {
        let found = weighed(longest);
        let expected = 2.0 * 0.1 * (CELLS - 1) as Real;
        assert!((found / expected - 1.0).abs() < 1e-3, "{longest} s: {found} for {expected}");
    }
}
