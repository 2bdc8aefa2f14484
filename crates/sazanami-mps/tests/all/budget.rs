//! The momentum budget of the fluid closes.

use crate::support::{Case, GRAVITY, OPEN_TOP, PERIODIC, SPACING, WALLS, under};
use sazanami_mps::boundary::WallFriction;
use sazanami_mps::scheme::Scheme;
use sazanami_numerics::{Real, Vector};

/// Momentum gained by the fluid, impulse of the walls, and impulse of body force and grains, over the impulse of gravity.
pub fn balance(case: &Case, body_force: Vector, [from, until]: [Real; 2]) -> [Vector; 3] {
    let mut solver = case.solo();
    let mut before = solver.fluid_momentum();
    let (mut time, mut span, mut walls, mut others) = (0.0, 0.0, Vector::ZERO, Vector::ZERO);
    while time < until {
        let dt = solver.stable_step(body_force).dt;
        let report = solver.step(dt, &under(body_force), |_| ()).expect("the step is sound");
        let of = &report.impulses;
        walls += of.wall_pressure + of.friction + of.contact;
        others += of.body_force + report.coupling.drag_on_fluid - report.coupling.pressure_on_grains;
        time += dt;
        if time < from {
            (before, walls, others) = (solver.fluid_momentum(), Vector::ZERO, Vector::ZERO);
        } else {
            span += dt;
        }
    }
    let scale = solver.particle_mass() * case.fluid.len() as Real * GRAVITY.length() * span;
    [solver.fluid_momentum() - before, walls, others].map(|impulse| impulse / scale)
}

#[test]
fn the_floor_carries_still_water_except_half_a_layer() {
    let case =
        Case { scheme: Scheme::published(), ..Case::filled([20, 7, 25], [20, 7, 20], [WALLS, PERIODIC, OPEN_TOP]) };
    let [gained, walls, others] = balance(&case, GRAVITY, [0.0, 0.02]);
    // The pressure vanishes in the middle of the top layer.
    let residual = gained - walls - others;
    assert!((residual - Vector::new(0.0, 0.0, 0.5 / 20.0)).length() < 1e-5, "{residual}");
    // Negative control: without the walls the residual is the whole weight.
    assert!((gained - others).z > 0.9);
}

#[test]
fn end_walls_hold_water_on_a_slope() {
    let (tilt, layers) = (4.0 / 9.81, 12.0);
    let mut case =
        Case { scheme: Scheme::published(), ..Case::filled([24, 7, 24], [24, 7, 20], [WALLS, PERIODIC, OPEN_TOP]) };
    case.fluid.retain(|p| p.position.z / SPACING < layers + tilt * (p.position.x / SPACING - 12.0));
    let [gained, walls, others] = balance(&case, GRAVITY + Vector::new(4.0, 0.0, 0.0), [0.0, 0.05]);
    // The depth that the walls feel is half a layer short at both ends.
    let expected = Vector::new(-tilt / (2.0 * layers), 0.0, 0.5 / layers);
    let residual = gained - walls - others;
    assert!((residual - expected).length() < 0.003, "{residual} {expected}");
    // Negative control: without the walls.
    assert!((gained - others).x < -0.3);
}

#[test]
fn only_no_slip_walls_exert_friction() {
    let mut case = Case::filled([12, 8, 16], [12, 8, 10], [WALLS, PERIODIC, OPEN_TOP]);
    case.viscosity = 1e-4;
    case.fluid.iter_mut().for_each(|p| p.velocity = Vector::new(0.0, 0.1, 0.0));
    let friction = |case: &Case| {
        let report = case.solo().step(1e-4, &under(GRAVITY), |_| ()).expect("the step is sound");
        report.impulses.friction
    };
    assert!(friction(&case).y < -1e-9, "{}", friction(&case));
    case.friction = WallFriction::Slip;
    assert_eq!(friction(&case), Vector::ZERO);
}

#[test]
fn a_particle_put_back_into_the_box_has_lost_what_is_booked() {
    let mut case =
        Case { scheme: Scheme::published(), ..Case::filled([10, 8, 12], [1, 1, 1], [WALLS, PERIODIC, OPEN_TOP]) };
    case.viscosity = 0.0;
    let lost = |case: &Case| {
        let mut solver = case.solo();
        let report = solver.step(2e-4, &under(GRAVITY), |_| ()).expect("the step is sound");
        assert_eq!(report.clipped, if report.clipping_work == 0.0 { 0 } else { 1 });
        report.clipping_work / solver.particle_mass()
    };
    // Above the open top, where the plane of the wall goes on without particles that would push: it reaches that at 1 m/s,
    // would have been 0.05 mm from it, and stops.
    case.fluid[0].position = SPACING * Vector::new(0.25, 4.0, 14.0);
    case.fluid[0].velocity = -Vector::X;
    assert!((lost(&case) / -0.5 - 1.0).abs() < 1e-9, "{}", lost(&case));
    // Negative control: farther away.
    case.fluid[0].position.x += SPACING;
    assert_eq!(lost(&case), 0.0);
}
