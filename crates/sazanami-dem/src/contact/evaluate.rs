//! The force of sphere contacts, several at a time.

use sazanami_numerics::{Matrix, Real, Vector};

use super::context::ContactContext;
use super::force::{ConstantLanes, PairConstants, force, roll};
use super::pair::{Contact, Pair};
use crate::lanes::{Lanes, Lanes3};
use crate::motion::Pose;

/// Overlaps, forces, torques and tangential displacements of `W` contacts in a sub-step.
pub(crate) struct ContactForces<const W: usize> {
    /// Overlap; not positive: the spheres are apart, with a film between them at most \[m].
    pub overlap: Lanes<W>,
    /// Overlap over the smaller radius.
    pub fraction: Lanes<W>,
    /// Force on the first grain \[N].
    pub force: Lanes3<W>,
    /// Torque on the first grain [N m].
    pub torque_low: Lanes3<W>,
    /// Torque on the second grain [N m].
    pub torque_high: Lanes3<W>,
    /// Tangential displacement afterwards \[m].
    pub d_t: Lanes3<W>,
    /// New turn of the rolling springs, none where the usual laws have none \[rad].
    pub turn: Lanes3<W>,
}

/// `W` contact spheres.
struct Spheres<const W: usize> {
    /// From the grain's centre of mass \[m].
    offset: Lanes3<W>,
    radius: Lanes<W>,
}

impl<const W: usize> Spheres<W> {
    #[inline(always)]
    fn new<const BALLS: bool>(
        context: &ContactContext<'_>,
        grains: [u32; W],
        poses: [&Pose; W],
        number: impl Fn(usize) -> u16,
    ) -> Self {
        if BALLS {
            return Self { offset: Lanes3::splat(Vector::ZERO), radius: Lanes::from_fn(|l| poses[l].radius) };
        }
        let sphere: [&[Real; 4]; W] =
            std::array::from_fn(|l| &context.spheres[poses[l].spheres as usize + number(l) as usize]);
        let scale = Lanes::from_fn(|l| poses[l].scale);
        let component = |d: usize| Lanes::from_fn(|l| sphere[l][d]);
        // As many as poses: one check of bounds serves both.
        let rotations = &context.rotations[..context.poses.len()];
        let rotations: [&Matrix; W] = std::array::from_fn(|l| &rotations[grains[l] as usize]);
        let axis = |d: usize| Lanes3::from_fn(|l| rotations[l].col(d));
        let offset = axis(0) * component(0) + axis(1) * component(1) + axis(2) * component(2);
        Self { offset: offset * scale, radius: component(3) * scale }
    }
}

/// Evaluates one to `W` contacts; surplus lanes repeat the last. `BALLS` has the same bits where all bodies are balls.
#[inline(always)]
pub(crate) fn evaluate<const W: usize, const PLAIN: bool, const BALLS: bool>(
    context: &ContactContext<'_>,
    laws: &[PairConstants],
    (pairs, contacts): (&[Pair], &[Contact]),
    dt: Real,
) -> ContactForces<W> {
    let last = contacts.len() - 1;
    let contact: [&Contact; W] = std::array::from_fn(|l| &contacts[l.min(last)]);
    let pair: [&Pair; W] = std::array::from_fn(|l| &pairs[contact[l].pair as usize]);
    // Branches come first: what is computed before one would have to be put aside.
    let shift = if pair.iter().any(|p| p.image != [0; 3]) {
        Lanes3::from_fn(|l| pair[l].shift(context.period))
    } else {
        Lanes3::splat(Vector::ZERO)
    };
    let mut constants = if laws.len() == 1 {
        ConstantLanes::from_fn(|l| (&laws[0], pair[l].factor, pair[l].give))
    } else {
        ConstantLanes::from_fn(|l| (&laws[pair[l].law as usize], pair[l].factor, pair[l].give))
    };
    let (low, high) = (pair.map(|p| p.low), pair.map(|p| p.high));
    let i: [&Pose; W] = std::array::from_fn(|l| &context.poses[low[l] as usize]);
    let j: [&Pose; W] = std::array::from_fn(|l| &context.poses[high[l] as usize]);
    let a = Spheres::new::<BALLS>(context, low, i, |l| contact[l].a);
    let b = Spheres::new::<BALLS>(context, high, j, |l| contact[l].b);

    let between = Lanes3::from_fn(|l| j[l].unwrapped) - Lanes3::from_fn(|l| i[l].unwrapped) + shift;
    let line = if BALLS { between } else { between + b.offset - a.offset };
    let distance = line.dot(line).sqrt();
    let overlap = a.radius + b.radius - distance;
    let n = line * Lanes::splat(1.0).divided_by(distance);
    let lever = n * (a.radius - overlap * Lanes::splat(0.5));
    let arm_i = if BALLS { lever } else { a.offset + lever };
    let arm_j = arm_i - between;
    let (spin_i, spin_j) = (Lanes3::from_fn(|l| i[l].spin), Lanes3::from_fn(|l| j[l].spin));
    let v_r = Lanes3::from_fn(|l| j[l].velocity) + spin_j.cross(arm_j)
        - Lanes3::from_fn(|l| i[l].velocity)
        - spin_i.cross(arm_i);

    let d_t = Lanes3::from_fn(|l| contact[l].d_t);
    let radii = [a.radius, b.radius];
    let wetness = if PLAIN {
        Lanes::splat(1.0)
    } else {
        Lanes::from_fn(|l| context.wetness[low[l] as usize].min(context.wetness[high[l] as usize]))
    };
    let (h, d_t, h_n) = force::<W, PLAIN>(&constants, n, (overlap, radii, wetness), v_r, d_t, dt);
    let (mut torque_low, mut torque_high) = (arm_i.cross(h), -arm_j.cross(h));
    let mut turn = Lanes3::splat(Vector::ZERO);
    if !PLAIN {
        if !BALLS {
            constants.roll_where(|l| context.is_round(i[l]) || context.is_round(j[l]));
        }
        let rolling;
        (rolling, turn) = roll(&constants, radii, h_n, [spin_i, spin_j], Lanes3::from_fn(|l| contact[l].turn), dt);
        torque_low += rolling;
        torque_high += -rolling;
    }
    let fraction = overlap.divided_by(a.radius.min(b.radius));
    ContactForces { overlap, fraction, force: h, torque_low, torque_high, d_t, turn }
}
