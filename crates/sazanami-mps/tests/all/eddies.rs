//! Eddy viscosity by the mixing length: its force, its length over floor, bed and below a lid, threads, ranks and restarts.

use crate::equivalence::{ranks_agree, restart_agrees, shaken, threads_agree};
use crate::support::{Case, NOTHING, OPEN_TOP, PERIODIC, SPACING, WALLS, under};
use sazanami_dem::{Grain, Motion};
use sazanami_mps::boundary::Side;
use sazanami_mps::scheme::Turbulence;
use sazanami_mps::solver::Forcing;
use sazanami_numerics::{Real, Vector};

const KARMAN: Real = 0.41;
/// Shear rate of the water [1/s].
const SHEAR: Real = 20.0;

/// Water over a floor, 12 spacings deep.
fn water(top: [Side; 2]) -> Case {
    let mut case = Case::filled([10, 10, 12], [10, 10, 12], [PERIODIC, PERIODIC, top]);
    case.scheme.turbulence = Turbulence::MixingLength;
    case
}

/// Largest viscosity in a step of sheared water, and its velocities along x1 after it by height.
fn sheared(case: &Case, dt: Real) -> (Real, Vec<[Real; 2]>) {
    let mut solver = case.solo();
    solver.set_velocities(|p, a| SHEAR * p.position[a].z * Vector::X);
    let report = solver.step(dt, &under(Vector::ZERO), |_| ()).expect("the step is sound");
    let particles = solver.particles();
    let fluid = (0..particles.owned()).filter(|&a| particles.is_fluid(a));
    (report.largest_viscosity, fluid.map(|a| [particles.position[a].z, particles.velocity[a].x]).collect())
}

#[test]
fn a_uniform_shear_gains_what_the_mixing_length_says() {
    // div(l^2 S grad u) with l = kappa z and u = S z: 2 kappa^2 z S^2.
    let (dt, case) = (1e-4, water(OPEN_TOP));
    let mut laminar = case.clone();
    laminar.scheme.turbulence = Turbulence::None;
    let [with, without] = [&case, &laminar].map(|case| sheared(case, dt).1);
    let mut looked_at = 0;
    for ([z, u], [_, plain]) in with.iter().zip(&without).filter(|([z, _], _)| (4e-3..8e-3).contains(z)) {
        let expected = dt * 2.0 * KARMAN * KARMAN * z * SHEAR * SHEAR;
        assert!(((u - plain) / expected - 1.0).abs() < 1e-3, "{z} {u} {plain} {expected}");
        // Negative control: without eddies nothing acts on a uniform shear.
        assert!((plain - SHEAR * z).abs() < 1e-3 * expected);
        looked_at += 1;
    }
    assert_eq!(looked_at, 400);
}

#[test]
fn the_length_grows_from_the_floor_and_the_bed_and_is_bounded_by_the_lid() {
    let laminar = 1e-6;
    // The distance that the largest viscosity comes from, in spacings.
    let reach = |case: &Case| ((sheared(case, 1e-5).0 - laminar) / SHEAR).sqrt() / KARMAN / SPACING;
    let open = reach(&water(OPEN_TOP));
    assert!((open - 11.5).abs() < 1e-3, "the highest particles: {open}");
    let closed = reach(&water(WALLS));
    assert!((closed - 5.5).abs() < 0.3, "the middle: {closed}");
    // A bed four diameters thick of a solid fraction of 0.52, held.
    let mut bed = water(OPEN_TOP);
    bed.grains = (0..400)
        .map(|n| {
            let place = Vector::from_array([n % 10, n / 10 % 10, n / 100].map(|n| n as Real + 0.5));
            Grain { motion: Motion::Fixed, ..Grain::new(n as u64, 2650.0, SPACING * place) }
        })
        .collect();
    bed.fluid.retain(|p| p.position.z > 4.0 * SPACING);
    let above = reach(&bed);
    assert!((above - 7.5).abs() < 0.35, "above the bed: {above}");
    // Negative control: grains too few to be a bed leave most of the length.
    let mut few = bed.clone();
    few.grains.retain(|grain| grain.id % 4 == 0);
    assert!(reach(&few) > above + 1.5, "{}", reach(&few));
    // Walls that have gone round a periodic box in part, as those of a tank that swings, leave the bed where it lies.
    let mut gone = bed.solo();
    gone.set_velocities(|p, a| SHEAR * p.position[a].z * Vector::X);
    let forcing = Forcing { wall_displacement: 6.3 * SPACING * (Vector::X - Vector::Y), ..under(Vector::ZERO) };
    let found = gone.step(1e-5, &forcing, |_| ()).expect("the step is sound").largest_viscosity;
    let found = ((found - laminar) / SHEAR).sqrt() / KARMAN / SPACING;
    assert!((found / above - 1.0).abs() < 1e-6, "{found} {above}");
    let mut slip = water(OPEN_TOP);
    (slip.sides[0], slip.fluid) = (NOTHING, slip.fluid.into_iter().filter(|p| p.position.z > 1e-3).collect());
    assert!(reach(&slip) > 11.0, "open sides bound nothing");
}

#[test]
fn eddies_do_not_depend_on_threads_ranks_and_restarts() {
    let mut case = shaken();
    case.scheme.turbulence = Turbulence::MixingLength;
    threads_agree(&case);
    restart_agrees(&case, "fluid/gradient");
    ranks_agree(case);
}

#[test]
fn eddies_limit_the_step_and_a_restart_knows() {
    let case = water(OPEN_TOP);
    let mut solver = case.solo();
    solver.set_velocities(|p, a| 10.0 * SHEAR * p.position[a].z * Vector::X);
    let before = solver.stable_step(Vector::ZERO).dt;
    solver.step(1e-6, &under(Vector::ZERO), |_| ()).expect("the step is sound");
    let after = solver.stable_step(Vector::ZERO);
    assert!(after.dt < 0.9 * before, "{before} {after:?}");
    let resumed = crate::equivalence::restored(&case, &solver.snapshot());
    assert_eq!(resumed.stable_step(Vector::ZERO), after);
}

#[test]
fn gusts_take_grains_to_and_fro_and_keep_momentum() {
    let mut case = shaken();
    case.grains.iter_mut().for_each(|grain| grain.motion = Motion::Fixed);
    let drag = |turbulence: Turbulence| {
        let mut case = case.clone();
        case.scheme.turbulence = turbulence;
        let mut solver = case.solo();
        solver.set_velocities(|p, a| SHEAR * p.position[a].z * Vector::X);
        let mut across = Vec::new();
        for _ in 0..6 {
            let report = solver.step(2e-4, &under(Vector::ZERO), |_| ()).expect("the step is sound").coupling;
            assert!((report.drag_on_grains + report.drag_on_fluid).length() <= 1e-12 * report.drag_on_grains.length());
            across.push(report.drag_on_grains.y / report.drag_on_grains.x);
        }
        across
    };
    // The flow is along x1 alone: what pushes across are gusts, not the same from step to step.
    let with = drag(Turbulence::MixingLength);
    assert!(with.iter().any(|&part| part.abs() > 0.02) && with[1] != with[2], "{with:?}");
    // Negative control.
    let without = drag(Turbulence::None);
    assert!(without.iter().all(|&part| part.abs() < 0.01), "{without:?}");
}
