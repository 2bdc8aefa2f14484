//! The force of a contact from its springs and dashpots: tension, Coulomb friction, history, rolling
//! (Yagyu et al. (2015), eqs. (4)-(6)).
//!
//! ```text
//! h_n = -K_n d_n n + D_n v_n            (without tension: never along +n)
//! h_t =  K_t d_t + D_t v_t              cut to mu |h_n|, d_t then follows the cut force
//! ```

use sazanami_numerics::Real;

use super::model::ContactModel;
use crate::lanes::{Lanes, Lanes3, Mask};
use crate::material::{HistoryRotation, SlipDirection};

/// The law of a pair of materials ready for evaluation.
#[derive(Clone, Copy, Debug)]
pub(crate) struct PairConstants<M: ContactModel> {
    pub model: M::Constants,
    friction: Real,
    rolling: Real,
    tension: bool,
    slip_along_velocity: bool,
    projected_only: bool,
}

impl<M: ContactModel> PairConstants<M> {
    pub fn new(law: &M) -> Self {
        let options = law.options();
        Self {
            model: law.constants(),
            friction: options.friction,
            rolling: options.rolling_friction,
            tension: options.tension,
            slip_along_velocity: options.slip_direction == SlipDirection::Velocity,
            projected_only: options.history == HistoryRotation::Projected,
        }
    }
}

/// The constants of `W` contacts.
pub(crate) struct ConstantLanes<M: ContactModel, const W: usize> {
    model: M::Lanes<W>,
    friction: Lanes<W>,
    rolling: Lanes<W>,
    tension: Mask<W>,
    slip_along_velocity: Mask<W>,
    projected_only: Mask<W>,
}

impl<M: ContactModel, const W: usize> ConstantLanes<M, W> {
    /// Constants by lane, each with its factor on the dashpots.
    #[inline(always)]
    pub fn from_fn<'a>(of: impl Fn(usize) -> (&'a PairConstants<M>, Real)) -> Self {
        Self {
            model: M::lanes(|l| {
                let (constants, factor) = of(l);
                (&constants.model, factor)
            }),
            friction: Lanes::from_fn(|l| of(l).0.friction),
            rolling: Lanes::from_fn(|l| of(l).0.rolling),
            tension: Mask(std::array::from_fn(|l| of(l).0.tension)),
            slip_along_velocity: Mask(std::array::from_fn(|l| of(l).0.slip_along_velocity)),
            projected_only: Mask(std::array::from_fn(|l| of(l).0.projected_only)),
        }
    }
}

/// Force on body i, the new tangential displacement and the size of the normal force, at overlap `d_n` of spheres of
/// these `radii`. `PLAIN` leaves out the rarer options.
#[inline(always)]
pub(crate) fn force<M: ContactModel, const W: usize, const PLAIN: bool>(
    c: &ConstantLanes<M, W>,
    n: Lanes3<W>,
    (d_n, radii): (Lanes<W>, [Lanes<W>; 2]),
    v_r: Lanes3<W>,
    d_t: Lanes3<W>,
    dt: Real,
) -> (Lanes3<W>, Lanes3<W>, Lanes<W>) {
    let zero = Lanes::splat(0.0);
    let springs = M::springs(&c.model, d_n, radii);
    let speed_n = v_r.dot(n);
    let v_t = v_r - n * speed_n;
    // Along n: positive would pull.
    let mut h_n = springs.normal_damping * speed_n - springs.normal_stiffness * d_n;
    let without_pull = h_n.min(zero);
    h_n = if PLAIN { without_pull } else { c.tension.select(h_n, without_pull) };

    // The spring turns with the normal and keeps its length.
    let length = d_t.dot(d_t);
    let turned = d_t - n * d_t.dot(n);
    let left = turned.dot(turned);
    let mut stretch = left.above(length * Lanes::splat(1e-20)).select(length.divided_by(left).sqrt(), zero);
    if !PLAIN {
        stretch = c.projected_only.select(Lanes::splat(1.0), stretch);
    }
    let d_t = turned * stretch + v_t * Lanes::splat(dt);

    let h_t = d_t * springs.tangential_stiffness + v_t * springs.tangential_damping;
    let limit = c.friction * h_n.abs();
    let square = h_t.dot(h_t);
    let slips = square.above(limit * limit);
    if !slips.any() {
        return (n * h_n + h_t, d_t, h_n.abs());
    }
    let mut cut = h_t * limit.divided_by(square.sqrt());
    if !PLAIN {
        let speed = v_t.dot(v_t).sqrt();
        let along = Mask(std::array::from_fn(|l| c.slip_along_velocity.0[l] && speed.0[l] >= 1e-12));
        cut = along.select3(v_t * limit.divided_by(speed), cut);
    }
    let h_t = slips.select3(cut, h_t);
    let d_t = slips.select3((cut - v_t * springs.tangential_damping) * springs.tangential_compliance, d_t);
    (n * h_n + h_t, d_t, h_n.abs())
}

/// A torque of constant size against relative spin, on the first body.
#[inline(always)]
pub(crate) fn rolling_torque<M: ContactModel, const W: usize>(
    c: &ConstantLanes<M, W>,
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
