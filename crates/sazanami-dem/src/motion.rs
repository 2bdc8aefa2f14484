//! Translation and rotation of grains (Yagyu et al. (2015), eqs. (7) and (8)).
//!
//! Drift by half a sub-step, kick, drift by half a sub-step: second order, with one evaluation of
//! forces. The orientation follows the angular momentum `L` in the laboratory frame,
//! `w = R I_b^-1 R^T L`, by a midpoint rule in two stages; `L` itself is constant in free flight.

use sazanami_numerics::{Matrix, Quaternion, Real, Vector};

use crate::body::spin;
use crate::grain::Motion;

/// Where the material of a grain is and how it moves: what contact needs to know.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Frame {
    /// Centre of mass without periodic wrapping [m].
    pub home: Vector,
    /// Body to laboratory coordinates.
    pub rotation: Matrix,
    /// Velocity of the centre of mass [m/s].
    pub velocity: Vector,
    /// Angular velocity [rad/s].
    pub spin: Vector,
    /// Size factor.
    pub scale: Real,
    /// Number of the body.
    pub body: u32,
    /// Number of the material.
    pub material: u32,
}

/// Constants of a grain's motion.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Inert {
    /// One over mass [1/kg]; 0 if forces do not act.
    pub inverse_mass: Real,
    /// One over the principal moments [1/(kg m^2)].
    pub inverse_inertia: Vector,
    /// Largest distance of a contact sphere's centre from the centre of mass [m].
    pub arm: Real,
    pub motion: Motion,
}

/// Position, orientation and momenta.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Pose {
    pub home: Vector,
    pub orientation: Quaternion,
    pub velocity: Vector,
    pub angular_momentum: Vector,
}

/// Rotation by the vector `angle` (axis times angle).
///
/// Sine and cosine of the half angle are series up to a twentieth of a radian, where they are exact
/// to round-off.
fn turn(angle: Vector) -> Quaternion {
    let half = 0.5 * angle;
    let square = half.length_squared();
    let (sinc, cosine) = if square < 2.5e-3 {
        let sinc = 1.0 - square / 6.0 * (1.0 - square / 20.0 * (1.0 - square / 42.0 * (1.0 - square / 72.0)));
        let cosine = 1.0 - square / 2.0 * (1.0 - square / 12.0 * (1.0 - square / 30.0 * (1.0 - square / 56.0)));
        (sinc, cosine)
    } else {
        let size = square.sqrt();
        (size.sin() / size, size.cos())
    };
    Quaternion::from_xyzw(half.x * sinc, half.y * sinc, half.z * sinc, cosine)
}

/// Moves a grain freely for `time`, updates its frame, and returns a bound of the way that the
/// centre of any of its contact spheres has gone [m].
#[inline]
pub(crate) fn drift(pose: &mut Pose, inert: &Inert, frame: &mut Frame, time: Real) -> Real {
    if inert.motion == Motion::Fixed {
        return 0.0;
    }
    pose.home += time * pose.velocity;
    let start = spin(&frame.rotation, inert.inverse_inertia, pose.angular_momentum);
    let angular = if inert.motion == Motion::Prescribed {
        start
    } else {
        let middle = Matrix::from_quat((turn(0.5 * time * start) * pose.orientation).normalize());
        spin(&middle, inert.inverse_inertia, pose.angular_momentum)
    };
    pose.orientation = (turn(time * angular) * pose.orientation).normalize();
    frame.home = pose.home;
    frame.rotation = Matrix::from_quat(pose.orientation);
    if inert.motion == Motion::Prescribed {
        // The spin is what is prescribed; the momentum turns with the body.
        pose.angular_momentum = frame.rotation * (frame.rotation.transpose() * angular / inert.inverse_inertia);
    }
    frame.velocity = pose.velocity;
    frame.spin = spin(&frame.rotation, inert.inverse_inertia, pose.angular_momentum);
    // The last term covers the round-off of the positions themselves.
    time * (pose.velocity.length() + angular.length() * inert.arm) * (1.0 + 1e-9)
        + 4e-16 * (pose.home.abs().max_element() + inert.arm)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::body::Body;

    #[test]
    fn a_turn_is_what_the_axis_and_angle_say() {
        for angle in [1e-9, 1e-3, 0.04, 0.0999, 0.1001, 1.0, 3.0] {
            let axis = Vector::new(1.0, -2.0, 0.5).normalize();
            let (found, expected) = (turn(axis * angle), Quaternion::from_axis_angle(axis, angle));
            assert!((found - expected).length() < 3e-16, "{angle}");
        }
    }

    #[test]
    fn free_rotation_keeps_momentum_and_energy() {
        let body = Body::prolate(0.26e-3, 0.635e-3, 9);
        let inertia = 2650.0 * body.inertia;
        let orientation = Quaternion::from_axis_angle(Vector::new(0.3, 0.5, -0.2).normalize(), 1.1);
        let rotation = Matrix::from_quat(orientation);
        let spin_body = Vector::new(30.0, 0.0, 100.0);
        let momentum = rotation * (inertia * spin_body);
        let mut pose = Pose { home: Vector::ZERO, orientation, velocity: Vector::ZERO, angular_momentum: momentum };
        let inert = Inert {
            inverse_mass: 1.0,
            inverse_inertia: inertia.recip(),
            arm: body.centre_radius,
            motion: Motion::Free,
        };
        let mut frame = Frame { rotation, spin: rotation * spin_body, ..Frame::default() };
        let energy = 0.5 * momentum.dot(frame.spin);
        let (time, steps) = (1e-5, 10_000);
        for _ in 0..steps {
            drift(&mut pose, &inert, &mut frame, time);
        }
        assert_eq!(pose.angular_momentum, momentum);
        assert!((0.5 * momentum.dot(frame.spin) / energy - 1.0).abs() < 1e-6);
        // The equator of the spin turns in the body frame at (I_axial/I_trans - 1) w_3.
        let found = frame.rotation.transpose() * frame.spin;
        let rate = (inertia.z / inertia.x - 1.0) * spin_body.z;
        let angle = rate * time * Real::from(steps);
        let expected = 30.0 * Vector::new(angle.cos(), angle.sin(), 0.0) + Vector::new(0.0, 0.0, 100.0);
        assert!((rate / spin_body.z + 0.71284).abs() < 1e-5);
        assert!((found - expected).length() / 100.0 < 1e-4, "{found} {expected}");
    }
}
