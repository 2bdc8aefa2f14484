//! Torque of the fluid on a grain: a spinning sphere, and a spheroid in shear.

use std::f64::consts::{FRAC_PI_2, PI};

use sazanami_dem::{Grain, Motion};
use sazanami_mics::boundary::{Boundary, Side};
use sazanami_mics::stability::StepLimits;
use sazanami_numerics::geometry::{ContactSphereRule, Shape, SpheroidMesh, VolumeRule};
use sazanami_numerics::grid::Grid;
use sazanami_numerics::{Quaternion, Real, Vector};

use super::immersed::ball;
use super::tank::{Tank, single, step};
use crate::measured::Measured;

/// Torque on a sphere of `n` cells to a diameter with constant spin about `axis` in a closed box 5 diameters wide over
/// `8 pi mu R^3 w`, and along the other directions; steps of `viscous` times `dx^2 / nu`.
fn torque(axis: Vector, n: u32, viscous: Real) -> Result<[Real; 2], String> {
    let width = 5.0;
    let grid = Grid::new([5 * n as usize; 3], Vector::ZERO, Vector::splat(width));
    let dt = viscous / Real::from(n * n);
    let mut tank = Tank::new(grid, Boundary::closed(), single(1.0, 1.0), dt);
    tank.limits = StepLimits::always(dt);
    tank.shapes = vec![ball(1.0)?];
    let spin = 0.4;
    let position = Vector::splat(0.5 * width) + Vector::new(0.21, 0.37, 0.13) * grid.spacing;
    let turning = Grain { motion: Motion::Prescribed, angular_velocity: spin * axis, ..Grain::new(0, 2.65, position) };
    tank.grains = vec![turning];
    let mut solver = tank.solver(|domain, boundary, flow| flow.fill_halos(domain, boundary))?;
    let (mut time, until, mut sum, mut duration) = (0.0, 3.0, Vector::ZERO, 0.0);
    while time < until {
        time += step(&mut solver, time, Real::INFINITY)?.0;
        if time > 0.9 * until {
            sum += solver.grains().fluid_torques()[0];
            duration += 1.0;
        }
    }
    let found = -sum / duration / (PI * spin);
    Ok([found.dot(axis), (found - found.dot(axis) * axis).length()])
}

/// Torque of a spinning sphere.
pub(crate) fn spinning_sphere() -> Result<Vec<Measured>, String> {
    let [[along, aside], [oblique, _]] = [torque(Vector::Z, 8, 1.0)?, torque(Vector::ONE.normalize(), 8, 1.0)?];
    let [[short, _], [fine, _]] = [torque(Vector::Z, 8, 0.25)?, torque(Vector::Z, 12, 2.0)?];
    Ok(vec![
        Measured::new("torque over 8 pi mu R^3 w, spin about x3", along),
        Measured::new("torque over 8 pi mu R^3 w, spin about a diagonal", oblique),
        Measured::new("torque over 8 pi mu R^3 w, 12 cells", fine),
        Measured::new("torque across the axis over that about it", aside),
        Measured::new("change with a quarter of the step", (short / along - 1.0).abs()),
    ])
}

/// Jeffery's orbit of the paper's spheroid, lengths in its short axis, times in the reciprocal of the shear rate.
pub(crate) fn jeffery() -> Result<Vec<Measured>, String> {
    Ok(vec![Measured::new("period times shear rate", period()?)])
}

/// Period of the orbit, from half a turn.
fn period() -> Result<Real, String> {
    let ratio = 1.27 / 0.52;
    let size = Vector::new(6.0, 4.0, 6.0);
    let grid = Grid::new([48, 32, 48], Vector::ZERO, size);
    let wall = |sign: Real| Side::Moving { velocity: Vector::X * (sign * 0.5 * size.z) };
    let boundary = Boundary::new([[Side::Periodic; 2], [Side::Periodic; 2], [wall(-1.0), wall(1.0)]])
        .map_err(|error| error.to_string())?;
    // Reynolds number of the long semi-axis 0.1.
    let viscosity = 10.0 * (0.5 * ratio) * (0.5 * ratio);
    let mut tank = Tank::new(grid, boundary, single(1.0, viscosity), 0.02);
    tank.divergence = 1e-7;
    let mesh = SpheroidMesh { rings: 15, segments: 16 };
    let shape = Shape::spheroid(0.5, 0.5 * ratio, mesh, VolumeRule::Preserve, &ContactSphereRule::Axis { count: 9 });
    tank.shapes = vec![shape.map_err(|error| error.to_string())?];
    // The long axis along the gradient.
    let orientation = Quaternion::from_axis_angle(Vector::Y, -FRAC_PI_2);
    let position = 0.5 * size + Vector::new(0.21, 0.37, 0.0) * grid.spacing;
    tank.grains = vec![Grain { orientation, angular_velocity: 0.5 * Vector::Y, ..Grain::new(0, 1.0, position) }];
    let mut solver = tank.solver(|domain, boundary, flow| {
        domain.set(&mut flow.velocity[0], |i, j, k| grid.centre(i, j, k).z - 0.5 * size.z);
        flow.fill_halos(domain, boundary);
    })?;
    let (mut time, mut angle, mut last, mut passed) = (0.0, 0.0, 0.0, [0.0; 2]);
    let marks = [0.5, 0.5 + PI];
    while angle < marks[1] {
        let dt = step(&mut solver, time, 40.0)?.0;
        let axis = solver.grains().engine().grains().orientation[0] * Vector::X;
        let now = axis.x.atan2(axis.z);
        let turned = (now - last + 3.0 * PI).rem_euclid(2.0 * PI) - PI;
        for (mark, passed) in marks.iter().zip(&mut passed) {
            if angle < *mark && angle + turned >= *mark {
                *passed = time + dt * (mark - angle) / turned;
            }
        }
        (time, angle, last) = (time + dt, angle + turned, now);
        if time > 39.0 {
            return Err(format!("the spheroid has turned by {angle} only"));
        }
    }
    let period = 2.0 * (passed[1] - passed[0]);
    Ok(period)
}
