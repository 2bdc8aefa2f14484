//! The force of sphere contacts, several at a time.

use sazanami_numerics::{Matrix, Real, Vector};

use super::World;
use super::block::{Contact, Pair};
use super::law::{ConstantLanes, force};
use crate::lanes::{Lanes, Lanes3};
use crate::motion::Frame;

/// Number of contacts worked on at once: a vector register of numbers.
pub(crate) const WIDTH: usize = 4;

/// What a contact does in a sub-step.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Outcome {
    /// Overlap; not positive: the spheres are apart [m].
    pub overlap: Real,
    /// Overlap over the smaller radius.
    pub fraction: Real,
    /// Force on the first grain [N].
    pub force: Vector,
    /// Torque on the first grain [N m].
    pub torque_low: Vector,
    /// Torque on the second grain [N m].
    pub torque_high: Vector,
    /// Tangential displacement afterwards [m].
    pub d_t: Vector,
}

#[inline(always)]
fn times<const W: usize>(rotation: impl Fn(usize) -> Matrix, v: Lanes3<W>) -> Lanes3<W> {
    let axis = |d: usize| Lanes3::from_fn(|l| rotation(l).col(d));
    axis(0) * v.x + axis(1) * v.y + axis(2) * v.z
}

/// Evaluates up to `W` contacts and appends their outcomes.
#[inline]
pub(crate) fn evaluate<const W: usize, const PLAIN: bool>(
    world: &World<'_>,
    pairs: &[Pair],
    contacts: &[Contact],
    dt: Real,
    outcomes: &mut Vec<Outcome>,
) {
    let last = contacts.len() - 1;
    // Surplus lanes repeat the last contact and are dropped.
    let contact: [&Contact; W] = std::array::from_fn(|l| &contacts[l.min(last)]);
    let pair: [&Pair; W] = std::array::from_fn(|l| &pairs[contact[l].pair as usize]);
    let i: [&Frame; W] = std::array::from_fn(|l| &world.frames[pair[l].low as usize]);
    let j: [&Frame; W] = std::array::from_fn(|l| &world.frames[pair[l].high as usize]);
    let scale_i = Lanes::from_fn(|l| i[l].scale);
    let scale_j = Lanes::from_fn(|l| j[l].scale);
    let a = |l: usize| contact[l].a as usize;
    let b = |l: usize| contact[l].b as usize;
    let (body_i, body_j): ([_; W], [_; W]) = (
        std::array::from_fn(|l| &world.bodies[i[l].body as usize]),
        std::array::from_fn(|l| &world.bodies[j[l].body as usize]),
    );
    let radius_a = Lanes::from_fn(|l| body_i[l].radii[a(l)]) * scale_i;
    let radius_b = Lanes::from_fn(|l| body_j[l].radii[b(l)]) * scale_j;
    let to_a = times(|l| i[l].rotation, Lanes3::from_fn(|l| body_i[l].centres[a(l)])) * scale_i;
    let to_b = times(|l| j[l].rotation, Lanes3::from_fn(|l| body_j[l].centres[b(l)])) * scale_j;

    let between = Lanes3::from_fn(|l| j[l].home) - Lanes3::from_fn(|l| i[l].home) + Lanes3::from_fn(|l| pair[l].shift);
    let line = between + to_b - to_a;
    let distance = line.dot(line).sqrt();
    let overlap = radius_a + radius_b - distance;
    let n = line * Lanes::splat(1.0).divided_by(distance);
    let arm_i = to_a + n * (radius_a - overlap * Lanes::splat(0.5));
    let arm_j = arm_i - between;
    let (spin_i, spin_j) = (Lanes3::from_fn(|l| i[l].spin), Lanes3::from_fn(|l| j[l].spin));
    let v_r = Lanes3::from_fn(|l| j[l].velocity) + spin_j.cross(arm_j)
        - Lanes3::from_fn(|l| i[l].velocity)
        - spin_i.cross(arm_i);

    let constants = ConstantLanes::from_fn(|l| (&world.constants[pair[l].law as usize], pair[l].factor));
    let d_t = Lanes3::from_fn(|l| contact[l].d_t);
    let (h, d_t, h_n) = force::<W, PLAIN>(&constants, n, overlap, v_r, d_t, dt);
    let (mut torque_i, mut torque_j) = (arm_i.cross(h), -arm_j.cross(h));
    if !PLAIN {
        let rolling = rolling_torque(&constants, radius_a, radius_b, h_n, spin_j - spin_i);
        torque_i += rolling;
        torque_j += -rolling;
    }
    let fraction = overlap.divided_by(radius_a.min(radius_b));
    outcomes.extend((0..contacts.len().min(W)).map(|l| Outcome {
        overlap: overlap.0[l],
        fraction: fraction.0[l],
        force: h.lane(l),
        torque_low: torque_i.lane(l),
        torque_high: torque_j.lane(l),
        d_t: d_t.lane(l),
    }));
}

/// A torque of constant size against relative spin, on the first body.
#[inline(always)]
pub(crate) fn rolling_torque<const W: usize>(
    c: &ConstantLanes<W>,
    radius_a: Lanes<W>,
    radius_b: Lanes<W>,
    h_n: Lanes<W>,
    spin: Lanes3<W>,
) -> Lanes3<W> {
    let zero = Lanes::splat(0.0);
    let effective = (radius_a * radius_b).divided_by(radius_a + radius_b);
    let rate = spin.dot(spin).sqrt();
    let size = c.rolling * effective * h_n;
    spin * rate.above(zero).select(size.divided_by(rate), zero)
}
