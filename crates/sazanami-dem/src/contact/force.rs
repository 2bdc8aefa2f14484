//! The force of a contact from its springs and dashpots: tension, Coulomb friction, history, rolling
//! (Yagyu et al. (2015), eqs. (4)-(6)).
//!
//! ```text
//! h_n = -K_n d_n n + D_n v_n            (without tension: never along +n)
//! h_t =  K_t d_t + D_t v_t              cut to mu |h_n|, d_t then follows the cut force
//! ```
//!
//! With [`TangentialForce::FromTouch`] `d_t` grows by `v_t` times the time for which the spheres have touched: all of a sub-step,
//! or from the moment within it in which they met. Counted from its beginning, the spring starts half a sub-step too long
//! on average, and grains take up too much spin in an oblique impact. Velocities are half a sub-step older than places;
//! the tangential dashpot then acts on that to which its force brings a ball in the meantime:
//! `h_t = (K_t d_t + D_t v_t)/(1 + D_t h/(2 m*))`.
//!
//! Rolling is resisted by a spring and a dashpot too (Ai, Chen, Rotter and Ooi (2011), Powder Technol. 206, 269, type C): with the relative
//! spin `w` and the effective radius `R* = R_1 R_2/(R_1 + R_2)`, the torque on the first body is
//!
//! ```text
//! T = K_r a + D_r w     cut to mu_r R* |h_n|;  da/dt = w + w_m x a, a cut to mu_r R* |h_n|/K_r, where T has no dashpot
//! K_r = min(2.25 mu_r^2, 0.4) K_n R*^2,   D_r = 2 * 0.3 sqrt(I K_r),   I = 7/5 m* R^2
//! ```
//!
//! The turn `a` goes round with the mean spin `w_m` of both; `m*` is the reduced mass and `R` the smaller radius, `I` so that of a ball
//! about its contact. A ball on a spring of 0.4 `K_n R^2` turns as fast as it bounces on `K_n`: rolling asks for no shorter sub-steps. A
//! torque of constant size by itself changes sign in every sub-step where it should hold a ball, which then creeps. Between bodies of several
//! contact spheres each, and between one and a wall, there is no such torque: their shape resists. A ball feels it on them too, and they what it
//! feels.

use sazanami_numerics::{Real, Vector};

use super::linear_spring_dashpot::{Constants, LinearSpringDashpot, Springs};
use super::pair::ACROSS;
use crate::film::{FILM_FACTOR, Film};
use crate::lanes::{Lanes, Lanes3, Mask};
use crate::material::TangentialForce;

/// The law of a pair of materials ready for evaluation.
#[derive(Clone, Copy, Debug)]
pub(crate) struct PairConstants {
    pub springs: Constants,
    friction: Real,
    rolling: Real,
    tension: bool,
    from_touch: bool,
    film: Option<Film>,
}

impl PairConstants {
    /// Elastic energy of the rolling spring of a contact of spheres of these `radii` after this turn \[J].
    pub fn energy_of_turn(&self, radii: [Real; 2], turn: Vector) -> Real {
        if self.rolling == 0.0 {
            return 0.0;
        }
        let constants: ConstantLanes<1> = ConstantLanes::from_fn(|_| (self, 1.0, 0.0));
        let [stiffness] = rolling_stiffness(&constants, radii.map(Lanes::splat)).0;
        0.5 * stiffness * turn.length_squared()
    }

    pub fn new(law: &LinearSpringDashpot, film: Option<Film>) -> Self {
        Self {
            springs: Constants::of(law),
            friction: law.friction,
            rolling: law.rolling_friction,
            tension: law.tension,
            from_touch: law.tangential_force == TangentialForce::FromTouch,
            film,
        }
    }
}

/// The constants of `W` contacts.
pub(crate) struct ConstantLanes<const W: usize> {
    springs: Springs<W>,
    friction: Lanes<W>,
    rolling: Lanes<W>,
    tension: Mask<W>,
    from_touch: Mask<W>,
    give: Lanes<W>,
    film: Option<Film>,
}

impl<const W: usize> ConstantLanes<W> {
    /// Constants by lane, each with its factor on the dashpots and how its grains give ([`super::pair::give`]).
    #[inline(always)]
    pub fn from_fn<'a>(of: impl Fn(usize) -> (&'a PairConstants, Real, f32)) -> Self {
        Self {
            springs: Springs::from_fn(|l| {
                let (constants, factor, _) = of(l);
                (&constants.springs, factor)
            }),
            friction: Lanes::from_fn(|l| of(l).0.friction),
            rolling: Lanes::from_fn(|l| of(l).0.rolling),
            tension: Mask(std::array::from_fn(|l| of(l).0.tension)),
            from_touch: Mask(std::array::from_fn(|l| of(l).0.from_touch)),
            give: Lanes::from_fn(|l| Real::from(of(l).2)),
            film: of(0).0.film,
        }
    }

    /// Leaves rolling friction to contacts of which a body at least is `round`: others resist rolling by their shape.
    #[inline(always)]
    pub fn roll_where(&mut self, round: impl Fn(usize) -> bool) {
        if self.rolling.above(Lanes::splat(0.0)).any() {
            self.rolling = Lanes::from_fn(|l| if round(l) { self.rolling.0[l] } else { 0.0 });
        }
    }
}

/// Force on body i, the new tangential displacement and the size of the normal force, at overlap `d_n` of spheres of
/// these `radii`: of the contact, or of the film where `d_n` is negative, which is as viscous as its `wetness`, a factor, says. `PLAIN` leaves
/// out films and the rarer options.
#[inline(always)]
pub(crate) fn force<const W: usize, const PLAIN: bool>(
    c: &ConstantLanes<W>,
    n: Lanes3<W>,
    (d_n, radii, wetness): (Lanes<W>, [Lanes<W>; 2], Lanes<W>),
    v_r: Lanes3<W>,
    d_t: Lanes3<W>,
    dt: Real,
) -> (Lanes3<W>, Lanes3<W>, Lanes<W>) {
    let contact = contact_force::<W, PLAIN>(c, n, d_n, v_r, d_t, dt);
    let Some(film) = c.film.as_ref().filter(|_| !PLAIN) else { return contact };
    let zero = Lanes::splat(0.0);
    let touches = d_n.above(zero);
    let none = Lanes3::splat(Vector::ZERO);
    let apart = film_force(c, film, n, (d_n, radii, wetness), v_r, dt);
    let (h, d_t, h_n) = contact;
    (touches.select3(h, none) + apart, touches.select3(d_t, none), touches.select(h_n, zero))
}

/// Force of the film alone on body i; none where the spheres overlap.
#[inline(always)]
fn film_force<const W: usize>(
    c: &ConstantLanes<W>,
    film: &Film,
    n: Lanes3<W>,
    (d_n, radii, wetness): (Lanes<W>, [Lanes<W>; 2], Lanes<W>),
    v_r: Lanes3<W>,
    dt: Real,
) -> Lanes3<W> {
    let speed_n = v_r.dot(n);
    // Half a sub-step over the reduced mass [s/kg].
    let half = c.give * Lanes::splat(dt / ACROSS);
    let most = |l: usize| if film.bounded { 0.5 * FILM_FACTOR / half.0[l] } else { Real::INFINITY };
    let damping = Lanes::from_fn(|l| {
        (wetness.0[l] * film.damping(-d_n.0[l], speed_n.0[l] * dt, radii.map(|r| r.0[l]))).min(most(l))
    });
    // At the time of the places, half a sub-step after that of the velocities.
    let later = Lanes::splat(1.0) + damping * half;
    n * (speed_n * damping.divided_by(later))
}

/// The same of a contact alone.
#[inline(always)]
fn contact_force<const W: usize, const PLAIN: bool>(
    c: &ConstantLanes<W>,
    n: Lanes3<W>,
    d_n: Lanes<W>,
    v_r: Lanes3<W>,
    d_t: Lanes3<W>,
    dt: Real,
) -> (Lanes3<W>, Lanes3<W>, Lanes<W>) {
    let zero = Lanes::splat(0.0);
    let springs = c.springs;
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
        stretch = c.from_touch.select(stretch, Lanes::splat(1.0));
    }
    let touch = c.from_touch.any();
    let grows = if touch { time_in_touch(c, d_n, speed_n, dt) } else { Lanes::splat(dt) };
    let d_t = turned * stretch + v_t * grows;

    let one = Lanes::splat(1.0);
    let later = c.from_touch.select(one + springs.tangential_damping * c.give * Lanes::splat(dt), one);
    let mut h_t = d_t * springs.tangential_stiffness + v_t * springs.tangential_damping;
    if touch {
        h_t = h_t * one.divided_by(later);
    }
    let limit = c.friction * h_n.abs();
    let square = h_t.dot(h_t);
    let slips = square.above(limit * limit);
    if !slips.any() {
        return (n * h_n + h_t, d_t, h_n.abs());
    }
    let mut cut = h_t * limit.divided_by(square.sqrt());
    if !PLAIN {
        let speed = v_t.dot(v_t).sqrt();
        let along = Mask(std::array::from_fn(|l| !c.from_touch.0[l] && speed.0[l] >= 1e-12));
        cut = along.select3(v_t * limit.divided_by(speed), cut);
    }
    let h_t = slips.select3(cut, h_t);
    let uncut = if touch { cut * later } else { cut };
    let d_t = slips.select3((uncut - v_t * springs.tangential_damping) * springs.tangential_compliance, d_t);
    (n * h_n + h_t, d_t, h_n.abs())
}

/// The part of a sub-step `dt` \[s] in which spheres that now overlap by `d_n` have touched, at a rate `speed_n` of
/// parting: less than all of it only where they met within the sub-step.
#[inline(always)]
fn time_in_touch<const W: usize>(c: &ConstantLanes<W>, d_n: Lanes<W>, speed_n: Lanes<W>, dt: Real) -> Lanes<W> {
    let dt = Lanes::splat(dt);
    let met = (-speed_n * dt).above(d_n);
    if met.any() { c.from_touch.select(met.select((-d_n).divided_by(speed_n), dt), dt) } else { dt }
}

/// Rolling stiffness over `K_n R*^2` at a rolling friction of 1, and its largest.
const ROLLING_STIFFNESS: [Real; 2] = [2.25, 0.4];
/// Damping ratio of the rolling spring.
const ROLLING_DAMPING: Real = 0.3;

fn effective_radius<const W: usize>([a, b]: [Lanes<W>; 2]) -> Lanes<W> {
    (a * b).divided_by(a + b)
}

/// Stiffness of the rolling springs of contacts of spheres of these `radii` [N m].
#[inline(always)]
fn rolling_stiffness<const W: usize>(c: &ConstantLanes<W>, radii: [Lanes<W>; 2]) -> Lanes<W> {
    let [factor, most] = ROLLING_STIFFNESS.map(Lanes::splat);
    let effective = effective_radius(radii);
    (factor * c.rolling * c.rolling).min(most) * c.springs.normal_stiffness * effective * effective
}

/// Torque of the rolling springs on the first bodies [N m] and their turns afterwards, none where nothing presses the bodies
/// together: spheres of these `radii`, a normal force `h_n` and the spins of both bodies.
#[inline(always)]
pub(crate) fn roll<const W: usize>(
    c: &ConstantLanes<W>,
    radii: [Lanes<W>; 2],
    h_n: Lanes<W>,
    [first, second]: [Lanes3<W>; 2],
    turn: Lanes3<W>,
    dt: Real,
) -> (Lanes3<W>, Lanes3<W>) {
    let (zero, one, none) = (Lanes::splat(0.0), Lanes::splat(1.0), Lanes3::splat(Vector::ZERO));
    if !c.rolling.above(zero).any() {
        return (none, none);
    }
    let spin = second - first;
    let mean = (first + second) * Lanes::splat(0.5);
    let turn = turn + (spin + mean.cross(turn)) * Lanes::splat(dt);
    let limit = c.rolling * effective_radius(radii) * h_n;
    let stiffness = rolling_stiffness(c, radii);
    // Between bodies that forces do not move there is no damping, and nothing for it to act on.
    let mass = c.give.above(zero).select(Lanes::splat(0.5 * ACROSS).divided_by(c.give), zero);
    let inertia = mass * Lanes::splat(ACROSS / (ACROSS - 1.0));
    let smaller = radii[0].min(radii[1]);
    let damping = (inertia * stiffness).sqrt() * smaller * Lanes::splat(2.0 * ROLLING_DAMPING);
    let cut = |torque: Lanes3<W>| {
        let square = torque.dot(torque);
        let slips = square.above(limit * limit);
        (slips, slips.select3(torque * limit.divided_by(square.sqrt()), torque))
    };
    let (slips, held) = cut(turn * stiffness);
    let turn = slips.select3(held * one.divided_by(stiffness), turn);
    let (_, damped) = cut(held + spin * damping);
    let presses = limit.above(zero);
    (presses.select3(slips.select3(held, damped), none), presses.select3(turn, none))
}
