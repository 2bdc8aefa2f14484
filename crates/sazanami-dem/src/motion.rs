//! Translation and rotation of grains (Yagyu et al. (2015), eqs. (7) and (8)).
//!
//! Drift by half a sub-step, kick, drift by half a sub-step: second order, with one evaluation of
//! forces. The orientation follows the angular momentum `L` in the laboratory frame,
//! `w = R I_b^-1 R^T L`, by a midpoint rule in two stages; `L` itself is constant in free flight.

use sazanami_numerics::{Matrix, Quaternion, Real, Vector};
use sazanami_parallel::for_each_chunk;

use crate::grain::{Grains, Motion, ROWS};
use crate::lanes::{Lanes, Lanes3, WIDTH};
use crate::wrench::Wrench;

/// Pose and velocities of a grain as its contacts read them. The rotation is stored apart: balls do not need it.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Pose {
    /// Centre of mass without periodic wrapping \[m].
    pub unwrapped: Vector,
    /// Radius of a ball, see [`crate::Body::is_ball`]; 0 for other grains \[m].
    pub radius: Real,
    /// Velocity of the centre of mass [m/s].
    pub velocity: Vector,
    /// Angular velocity [rad/s].
    pub spin: Vector,
    /// Number of the body.
    pub body: u32,
    /// First of its contact spheres among those of all bodies.
    pub spheres: u32,
    /// Size factor.
    pub scale: Real,
}

/// Constants of a grain's motion.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct MassProperties {
    /// One over mass [1/kg]; 0 if forces do not act.
    pub inverse_mass: Real,
    /// One over the principal moments [1/(kg m^2)].
    pub inverse_inertia: Vector,
    /// Largest distance of a contact sphere's centre from the centre of mass \[m].
    pub arm: Real,
    pub motion: Motion,
    /// Whether the grain is a ball, whose spin does not depend on its orientation.
    pub ball: bool,
}

/// State of consecutive grains during kick and drift, one array element each.
pub(crate) struct Moving<'a> {
    pub mass_properties: &'a [MassProperties],
    pub unwrapped: &'a mut [Vector],
    pub orientation: &'a mut [Quaternion],
    pub velocity: &'a mut [Vector],
    pub angular_momentum: &'a mut [Vector],
    pub poses: &'a mut [Pose],
    pub rotations: &'a mut [Matrix],
    /// Accumulated rotation vectors of balls, whose orientation is updated once per call by [`turn_balls`] \[rad].
    pub turned: &'a mut [Vector],
    /// Accumulated upper bound of the path of the contact spheres' centres \[m].
    pub travel: &'a mut [Real],
}

/// A kick (change of momentum and angular momentum) and the drift (free motion) after it.
#[derive(Clone, Copy, Debug)]
pub(crate) struct KickAndDrift<'a> {
    /// Change of velocity by gravity [m/s].
    pub gravity: Vector,
    /// Impulse and angular impulse of each grain [N s, N m s].
    pub impulses: &'a [Wrench],
    /// Duration of the drift \[s].
    pub time: Real,
}

/// `W` unit quaternions.
#[derive(Clone, Copy)]
struct Orientations<const W: usize> {
    vector: Lanes3<W>,
    scalar: Lanes<W>,
}

/// Columns of `W` rotation matrices.
type Rotations<const W: usize> = [Lanes3<W>; 3];

impl<const W: usize> Orientations<W> {
    #[inline(always)]
    fn from_fn(of: impl Fn(usize) -> Quaternion) -> Self {
        Self { vector: Lanes3::from_fn(|l| of(l).xyz()), scalar: Lanes::from_fn(|l| of(l).w) }
    }

    #[inline(always)]
    fn lane(&self, l: usize) -> Quaternion {
        let vector = self.vector.lane(l);
        Quaternion::from_xyzw(vector.x, vector.y, vector.z, self.scalar.0[l])
    }

    #[inline(always)]
    fn times(self, o: Self) -> Self {
        let (a, b) = (self.vector, o.vector);
        Self { vector: b * self.scalar + a * o.scalar + a.cross(b), scalar: self.scalar * o.scalar - a.dot(b) }
    }

    #[inline(always)]
    fn normalized(self) -> Self {
        let square = self.vector.dot(self.vector) + self.scalar * self.scalar;
        let factor = Lanes::splat(1.0).divided_by(square.sqrt());
        Self { vector: self.vector * factor, scalar: self.scalar * factor }
    }

    #[inline(always)]
    fn rotations(self) -> Rotations<W> {
        let one = Lanes::splat(1.0);
        let (q, w) = (self.vector, self.scalar);
        let twice = q + q;
        let (xx, xy, xz) = (q.x * twice.x, q.x * twice.y, q.x * twice.z);
        let (yy, yz, zz) = (q.y * twice.y, q.y * twice.z, q.z * twice.z);
        let (wx, wy, wz) = (w * twice.x, w * twice.y, w * twice.z);
        [
            Lanes3 { x: one - (yy + zz), y: xy + wz, z: xz - wy },
            Lanes3 { x: xy - wz, y: one - (xx + zz), z: yz + wx },
            Lanes3 { x: xz + wy, y: yz - wx, z: one - (xx + yy) },
        ]
    }

    /// Rotation by the vector `angle` (axis times angle).
    ///
    /// Sine and cosine of the half angle are series up to a twentieth of a radian, where they are
    /// exact to round-off.
    #[inline(always)]
    fn turn(angle: Lanes3<W>) -> Self {
        let constant = Lanes::<W>::splat;
        let half = angle * constant(0.5);
        let square = half.dot(half);
        let series = |from: Real, divisors: [Real; 4]| {
            let mut sum = constant(1.0);
            for d in divisors.into_iter().rev() {
                sum = constant(1.0) - square * constant(1.0 / d) * sum;
            }
            sum * constant(from)
        };
        let mut sinc = series(1.0, [6.0, 20.0, 42.0, 72.0]);
        let mut cosine = series(1.0, [2.0, 12.0, 30.0, 56.0]);
        for l in 0..W {
            if square.0[l] >= 2.5e-3 {
                let size = square.0[l].sqrt();
                (sinc.0[l], cosine.0[l]) = (size.sin() / size, size.cos());
            }
        }
        Self { vector: half * sinc, scalar: cosine }
    }
}

/// `R diag(1/I) R^T L`.
#[inline(always)]
fn spins<const W: usize>(r: &Rotations<W>, inverse_inertia: Lanes3<W>, momentum: Lanes3<W>) -> Lanes3<W> {
    r[0] * (inverse_inertia.x * r[0].dot(momentum))
        + r[1] * (inverse_inertia.y * r[1].dot(momentum))
        + r[2] * (inverse_inertia.z * r[2].dot(momentum))
}

impl Moving<'_> {
    /// Kicks all grains and lets them drift.
    pub fn kick_and_drift(&mut self, step: &KickAndDrift<'_>) {
        let count = self.poses.len();
        let mut at = 0;
        while at < count {
            let ball = self.mass_properties[at].ball;
            let alike = |i: &MassProperties| i.motion == Motion::Free && i.ball == ball;
            let several = at + WIDTH <= count && self.mass_properties[at..at + WIDTH].iter().all(alike);
            if several && ball {
                self.drift_free::<WIDTH, true>(at, step);
            } else if several {
                self.drift_free::<WIDTH, false>(at, step);
            } else {
                match self.mass_properties[at].motion {
                    Motion::Free if ball => self.drift_free::<1, true>(at, step),
                    Motion::Free => self.drift_free::<1, false>(at, step),
                    Motion::Prescribed => self.drift_prescribed(at, step.time),
                    Motion::WithWalls => self.drift_with_walls(at, step.time),
                    Motion::Fixed => {}
                }
            }
            at += if several { WIDTH } else { 1 };
        }
    }

    #[inline(always)]
    fn drift_free<const W: usize, const BALL: bool>(&mut self, at: usize, step: &KickAndDrift<'_>) {
        let time = Lanes::<W>::splat(step.time);
        let mass_properties: [&MassProperties; W] = std::array::from_fn(|l| &self.mass_properties[at + l]);
        let inverse_mass = Lanes::from_fn(|l| mass_properties[l].inverse_mass);
        let inverse_inertia = Lanes3::from_fn(|l| mass_properties[l].inverse_inertia);
        let impulse = Lanes3::from_fn(|l| step.impulses[at + l].force);
        let twist = Lanes3::from_fn(|l| step.impulses[at + l].torque);
        let v = Lanes3::from_fn(|l| self.velocity[at + l]) + impulse * inverse_mass + Lanes3::splat(step.gravity);
        let momentum = Lanes3::from_fn(|l| self.angular_momentum[at + l]) + twist;
        let unwrapped = Lanes3::from_fn(|l| self.unwrapped[at + l]) + v * time;

        let arm = Lanes::from_fn(|l| mass_properties[l].arm);
        let (spin, after) = if BALL {
            let spin = momentum * inverse_inertia.x;
            (0..W).for_each(|l| self.turned[at + l] += (spin * time).lane(l));
            (spin, spin)
        } else {
            let q = Orientations::from_fn(|l| self.orientation[at + l]);
            let first = spins(&q.rotations(), inverse_inertia, momentum);
            let middle = Orientations::turn(first * Lanes::splat(0.5 * step.time)).times(q);
            let spin = spins(&middle.rotations(), inverse_inertia, momentum);
            let q = Orientations::turn(spin * time).times(q).normalized();
            let rotations = q.rotations();
            for l in 0..W {
                self.orientation[at + l] = q.lane(l);
                self.rotations[at + l] =
                    Matrix::from_cols(rotations[0].lane(l), rotations[1].lane(l), rotations[2].lane(l));
            }
            (spin, spins(&rotations, inverse_inertia, momentum))
        };
        let distance = distance(v, spin, arm, unwrapped, step.time);
        for l in 0..W {
            self.unwrapped[at + l] = unwrapped.lane(l);
            self.velocity[at + l] = v.lane(l);
            self.angular_momentum[at + l] = momentum.lane(l);
            let pose = &mut self.poses[at + l];
            pose.unwrapped = unwrapped.lane(l);
            pose.velocity = v.lane(l);
            pose.spin = after.lane(l);
            self.travel[at + l] += distance.0[l];
        }
    }

    /// Drift of a grain that moves with the walls and does not rotate.
    fn drift_with_walls(&mut self, at: usize, time: Real) {
        let velocity = self.velocity[at];
        self.unwrapped[at] += time * velocity;
        self.poses[at].unwrapped = self.unwrapped[at];
        let (unwrapped, arm) = (Lanes3::splat(self.unwrapped[at]), Lanes::splat(self.mass_properties[at].arm));
        let distance = distance(Lanes3::<1>::splat(velocity), Lanes3::splat(Vector::ZERO), arm, unwrapped, time).0[0];
        self.travel[at] += distance;
    }

    /// Moves a grain whose velocity and angular velocity are prescribed.
    fn drift_prescribed(&mut self, at: usize, time: Real) {
        let mass_properties = &self.mass_properties[at];
        let spin = self.poses[at].spin;
        self.unwrapped[at] += time * self.velocity[at];
        let turn: Orientations<1> = Orientations::turn(Lanes3::splat(time * spin));
        let q = turn.times(Orientations::from_fn(|_| self.orientation[at])).normalized();
        self.orientation[at] = q.lane(0);
        let r = q.rotations();
        let rotation = Matrix::from_cols(r[0].lane(0), r[1].lane(0), r[2].lane(0));
        // The momentum turns with the body so that the spin stays.
        self.angular_momentum[at] = rotation * (rotation.transpose() * spin / mass_properties.inverse_inertia);
        let (unwrapped, arm) = (Lanes3::splat(self.unwrapped[at]), Lanes::splat(mass_properties.arm));
        let distance = distance(Lanes3::<1>::splat(self.velocity[at]), Lanes3::splat(spin), arm, unwrapped, time).0[0];
        self.travel[at] += distance;
        let momentum = self.angular_momentum[at];
        self.rotations[at] =
            self.poses[at].set(self.unwrapped[at], self.orientation[at], self.velocity[at], momentum, mass_properties);
    }
}

/// Rotates balls by the accumulated vectors `turned` \[rad], once for all sub-steps of a call: contacts do not depend on
/// the orientation of a ball, which is read between calls only.
pub(crate) fn turn_balls(orientation: &mut [Quaternion], turned: &[Vector]) {
    for_each_chunk(orientation, ROWS, |number, orientation| {
        for (orientation, &angle) in orientation.iter_mut().zip(&turned[number * ROWS..]) {
            if angle != Vector::ZERO {
                let turn: Orientations<1> = Orientations::turn(Lanes3::splat(angle));
                *orientation = turn.times(Orientations::from_fn(|_| *orientation)).normalized().lane(0);
            }
        }
    });
}

/// An upper bound of the path that the centre of any contact sphere goes in `time`; the last term covers the
/// round-off of the positions themselves.
#[inline(always)]
fn distance<const W: usize>(
    v: Lanes3<W>,
    spin: Lanes3<W>,
    arm: Lanes<W>,
    unwrapped: Lanes3<W>,
    time: Real,
) -> Lanes<W> {
    let speed = v.dot(v).sqrt() + spin.dot(spin).sqrt() * arm;
    let size = unwrapped.x.abs() + unwrapped.y.abs() + unwrapped.z.abs() + arm;
    speed * Lanes::splat(time * (1.0 + 1e-9)) + size * Lanes::splat(4e-16)
}

impl Pose {
    /// Sets position and motion from the state of grain or ghost `g`; see [`Self::set`].
    pub fn follow(&mut self, grains: &Grains, g: usize, mass_properties: &MassProperties) -> Matrix {
        self.set(
            grains.unwrapped[g],
            grains.orientation[g],
            grains.velocity[g],
            grains.angular_momentum[g],
            mass_properties,
        )
    }

    /// Sets position and motion from a grain's state. Returns the rotation from body to laboratory coordinates; for
    /// balls the identity, whatever their orientation.
    pub fn set(
        &mut self,
        unwrapped: Vector,
        orientation: Quaternion,
        velocity: Vector,
        momentum: Vector,
        mass_properties: &MassProperties,
    ) -> Matrix {
        self.unwrapped = unwrapped;
        self.velocity = velocity;
        if mass_properties.ball {
            self.spin = momentum * mass_properties.inverse_inertia.x;
            Matrix::IDENTITY
        } else {
            let r = Orientations::<1>::from_fn(|_| orientation).rotations();
            self.spin = spins(&r, Lanes3::splat(mass_properties.inverse_inertia), Lanes3::splat(momentum)).lane(0);
            Matrix::from_cols(r[0].lane(0), r[1].lane(0), r[2].lane(0))
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::body::Body;

    #[test]
    fn a_turn_is_what_the_axis_and_angle_say() {
        for angle in [1e-9, 1e-3, 0.04, 0.0999, 0.1001, 1.0, 3.0] {
            let axis = Vector::new(1.0, -2.0, 0.5).normalize();
            let turn: Orientations<1> = Orientations::turn(Lanes3::splat(axis * angle));
            let v = turn.vector.lane(0);
            let found = Quaternion::from_xyzw(v.x, v.y, v.z, turn.scalar.0[0]);
            assert!((found - Quaternion::from_axis_angle(axis, angle)).length() < 3e-16, "{angle}");
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
        let mass_properties = MassProperties {
            inverse_mass: 1.0,
            inverse_inertia: inertia.recip(),
            arm: body.centre_radius,
            motion: Motion::Free,
            ball: false,
        };
        // Five grains in the same state: four in one set of lanes, one by itself.
        let (mut orientations, mut momenta) = ([orientation; 5], [momentum; 5]);
        let mut poses = [Pose { spin: rotation * spin_body, ..Pose::default() }; 5];
        let mut rotations = [rotation; 5];
        let energy = 0.5 * momentum.dot(poses[0].spin);
        let (time, steps) = (1e-5, 10_000);
        for _ in 0..steps {
            let mut moving = Moving {
                mass_properties: &[mass_properties; 5],
                unwrapped: &mut [Vector::ZERO; 5],
                orientation: &mut orientations,
                velocity: &mut [Vector::ZERO; 5],
                angular_momentum: &mut momenta,
                poses: &mut poses,
                rotations: &mut rotations,
                turned: &mut [Vector::ZERO; 5],
                travel: &mut [0.0; 5],
            };
            moving.kick_and_drift(&KickAndDrift { gravity: Vector::ZERO, impulses: &[Wrench::default(); 5], time });
        }
        assert_eq!(momenta, [momentum; 5]);
        assert_eq!(orientations, [orientations[0]; 5]);
        let pose = &poses[4];
        assert!((0.5 * momentum.dot(pose.spin) / energy - 1.0).abs() < 1e-6);
        // The equator of the spin turns in the body frame at (I_axial/I_trans - 1) w_3.
        let found = rotations[4].transpose() * pose.spin;
        let rate = (inertia.z / inertia.x - 1.0) * spin_body.z;
        let angle = rate * time * Real::from(steps);
        let expected = 30.0 * Vector::new(angle.cos(), angle.sin(), 0.0) + Vector::new(0.0, 0.0, 100.0);
        assert!((rate / spin_body.z + 0.71284).abs() < 1e-5);
        assert!((found - expected).length() / 100.0 < 1e-4, "{found} {expected}");
    }
}
