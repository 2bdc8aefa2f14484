//! The force of a linear spring and dashpot with Coulomb friction (Yagyu et al. (2015), eqs. (4)-(6)).
//!
//! With `n` from body i to body j, `v_r` the velocity of j relative to i at the contact point and
//! `d_n` the overlap, the force on i is `h_n + h_t`:
//!
//! ```text
//! h_n = -K_n d_n n + D_n v_n            (without tension: never along +n)
//! h_t =  K_t d_t + D_t v_t              cut to mu |h_n|, d_t then follows the cut force
//! ```
//!
//! The printed sign of `D_t` would feed energy in; it is `+` here because `d_t` grows with `v_t`.

use sazanami_numerics::Real;

use crate::lanes::{Lanes, Lanes3, Mask};
use crate::material::{ContactLaw, HistoryRotation, SlipDirection};

/// Constants of a contact, ready for use.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Constants {
    pub normal_stiffness: Real,
    pub tangential_stiffness: Real,
    /// One over the tangential stiffness; 0 if there is none.
    pub tangential_compliance: Real,
    pub normal_damping: Real,
    pub tangential_damping: Real,
    pub friction: Real,
    pub rolling: Real,
    pub tension: bool,
    pub slip_along_velocity: bool,
    pub projected_only: bool,
    /// Whether the dashpots are to be multiplied by the root of the reduced mass.
    pub by_mass: bool,
}

impl Constants {
    pub fn new(law: &ContactLaw) -> Self {
        let ([normal_damping, tangential_damping], by_mass) = law.dashpots();
        let k = law.tangential_stiffness;
        Self {
            normal_stiffness: law.normal_stiffness,
            tangential_stiffness: k,
            tangential_compliance: if k > 0.0 { 1.0 / k } else { 0.0 },
            normal_damping,
            tangential_damping,
            friction: law.friction,
            rolling: law.rolling_friction,
            tension: law.tension,
            slip_along_velocity: law.slip_direction == SlipDirection::Velocity,
            projected_only: law.history == HistoryRotation::Projected,
            by_mass,
        }
    }

    /// Whether every choice is the usual one, so that the shorter formulas do.
    pub fn plain(&self) -> bool {
        !self.tension && !self.slip_along_velocity && !self.projected_only && self.rolling == 0.0
    }
}

/// The constants of `W` contacts.
pub(crate) struct ConstantLanes<const W: usize> {
    normal_stiffness: Lanes<W>,
    tangential_stiffness: Lanes<W>,
    tangential_compliance: Lanes<W>,
    normal_damping: Lanes<W>,
    tangential_damping: Lanes<W>,
    friction: Lanes<W>,
    pub rolling: Lanes<W>,
    tension: Mask<W>,
    slip_along_velocity: Mask<W>,
    projected_only: Mask<W>,
}

impl<const W: usize> ConstantLanes<W> {
    /// Constants by lane, each with its factor on the dashpots.
    #[inline(always)]
    pub fn from_fn<'a>(of: impl Fn(usize) -> (&'a Constants, Real)) -> Self {
        let lanes = |f: fn(&Constants, Real) -> Real| {
            Lanes::from_fn(|l| {
                let (constants, factor) = of(l);
                f(constants, factor)
            })
        };
        Self {
            normal_stiffness: lanes(|c, _| c.normal_stiffness),
            tangential_stiffness: lanes(|c, _| c.tangential_stiffness),
            tangential_compliance: lanes(|c, _| c.tangential_compliance),
            normal_damping: lanes(|c, f| c.normal_damping * f),
            tangential_damping: lanes(|c, f| c.tangential_damping * f),
            friction: lanes(|c, _| c.friction),
            rolling: lanes(|c, _| c.rolling),
            tension: Mask(std::array::from_fn(|l| of(l).0.tension)),
            slip_along_velocity: Mask(std::array::from_fn(|l| of(l).0.slip_along_velocity)),
            projected_only: Mask(std::array::from_fn(|l| of(l).0.projected_only)),
        }
    }
}

/// Force on body i and the new tangential displacement. `PLAIN` leaves out the rarer options.
#[inline(always)]
pub(crate) fn force<const W: usize, const PLAIN: bool>(
    c: &ConstantLanes<W>,
    n: Lanes3<W>,
    d_n: Lanes<W>,
    v_r: Lanes3<W>,
    d_t: Lanes3<W>,
    dt: Real,
) -> (Lanes3<W>, Lanes3<W>, Lanes<W>) {
    let zero = Lanes::splat(0.0);
    let speed_n = v_r.dot(n);
    let v_t = v_r - n * speed_n;
    // Along n: positive would pull.
    let mut h_n = c.normal_damping * speed_n - c.normal_stiffness * d_n;
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

    let h_t = d_t * c.tangential_stiffness + v_t * c.tangential_damping;
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
    let d_t = slips.select3((cut - v_t * c.tangential_damping) * c.tangential_compliance, d_t);
    (n * h_n + h_t, d_t, h_n.abs())
}
