//! What the length of a sub-step costs in accuracy: oblique impacts of two equal balls, integrated as the engine does.
//!
//! Two balls that meet are, seen from their middle, each a ball of half the mass at a wall; the impacts run there, with drift by
//! half a sub-step, kick, drift by half a sub-step. The moment within a sub-step at which spheres meet is arbitrary:
//! twelve are tried at each of five angles, and compared with impacts in 500 sub-steps, more where the dashpot damps more than
//! critically. A sub-step is counted in
//! half periods `pi sqrt(m*/K)` of the stiffer spring, `m*` the effective mass at the contact point of a ball.

use std::f64::consts::PI;

use sazanami_numerics::{Real, Vector};

use crate::contact::force::{ConstantLanes, PairConstants, force};
use crate::contact::linear_spring_dashpot::LinearSpringDashpot;
use crate::contact::pair::{ACROSS, give};
use crate::lanes::{Lanes, Lanes3};

/// Angles of impact from the normal \[degrees].
const ANGLES: [Real; 5] = [5.0, 20.0, 30.0, 40.0, 60.0];
/// Moments within a sub-step at which the spheres meet.
const MOMENTS: usize = 12;
/// Overlap over the radius without damping: the lever of friction is shorter by it.
const OVERLAP: Real = 1e-3;
/// Sub-steps in a half period of the stiffer spring for what is taken as right, and what they take at most of the time in which a
/// dashpot stops a ball.
const FINE: Real = 500.0;
const FINE_OF_DASHPOT: Real = 0.05;
/// Half periods of the normal spring after which balls that still touch are taken to stick.
const LONGEST: Real = 30.0;
/// Most sub-steps of an impact, whatever the springs.
const MOST: Real = 1e5;
/// Impacts at once.
const WIDTH: usize = 4;

/// Error of a quantity at the worst angle.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Error {
    /// Magnitude of its mean over the moments within a sub-step at which spheres meet.
    pub mean: Real,
    /// Its largest magnitude.
    pub largest: Real,
}

impl Error {
    fn include(&mut self, errors: &[Real]) {
        let mean = errors.iter().sum::<Real>() / errors.len() as Real;
        self.mean = self.mean.max(mean.abs());
        self.largest = errors.iter().fold(self.largest, |largest, error| largest.max(error.abs()));
    }

    fn max(self, other: Self) -> Self {
        Self { mean: self.mean.max(other.mean), largest: self.largest.max(other.largest) }
    }
}

/// Errors of an impact that come from the length of the sub-step.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ImpactErrors {
    /// Of the coefficient of restitution.
    pub restitution: Error,
    /// Of the speed of the surface by the spin, over the tangential speed before.
    pub spin: Error,
}

impl ImpactErrors {
    /// The larger of each.
    #[must_use]
    pub fn max(self, other: Self) -> Self {
        Self { restitution: self.restitution.max(other.restitution), spin: self.spin.max(other.spin) }
    }

    /// The larger mean error.
    #[must_use]
    pub fn mean(&self) -> Real {
        self.restitution.mean.max(self.spin.mean)
    }
}

/// Impacts of equal balls under a law.
#[derive(Debug)]
pub struct Impacts {
    law: PairConstants,
    ball: Ball,
    /// Sub-step of what is taken as right over the half period of the stiffer spring.
    fine: Real,
    /// Restitution and spin by angle ([`Impact::run`]).
    right: Vec<[Real; 2]>,
}

/// The ball that stands for two.
#[derive(Clone, Copy, Debug)]
struct Ball {
    /// Reduced mass \[kg].
    mass: Real,
    /// \[m].
    radius: Real,
    /// Factor on the dashpots.
    factor: Real,
    /// Half period of the normal spring, and of the stiffer one \[s].
    half_periods: [Real; 2],
}

impl Impacts {
    /// Balls of `radius` \[m] and reduced mass `mass` \[kg], both above zero.
    #[must_use]
    pub fn new(law: &LinearSpringDashpot, mass: Real, radius: Real) -> Self {
        let [normal, tangential] = law.stiffness();
        let half_period = |stiffness: Real| PI * (mass / stiffness).sqrt();
        let ball = Ball {
            mass,
            radius,
            factor: if law.damped_by_mass() { mass.sqrt() } else { 1.0 },
            half_periods: [normal, normal.max(ACROSS * tangential)].map(half_period),
        };
        let given = ANGLES.map(|angle| [angle, 0.5]);
        let [along, across] = law.damping(mass);
        let stops = mass / along.max(ACROSS * across);
        let substep = (ball.half_periods[1] / FINE).min(FINE_OF_DASHPOT * stops);
        let law = PairConstants::new(law, None);
        let right = Impact { ball, given: &given, substep }.run(&law);
        Self { law, ball, fine: substep / ball.half_periods[1], right }
    }

    /// Errors with sub-steps of `factor` half periods of the stiffer spring; of those shorter than what is taken as right,
    /// the errors of the latter.
    #[must_use]
    pub fn errors(&self, factor: Real) -> ImpactErrors {
        let factor = factor.max(self.fine);
        let moments = |angle: Real| (0..MOMENTS).map(move |n| [angle, (n as Real + 0.5) / MOMENTS as Real]);
        let given: Vec<[Real; 2]> = ANGLES.iter().flat_map(|&angle| moments(angle)).collect();
        let substep = factor * self.ball.half_periods[1];
        let found = Impact { ball: self.ball, given: &given, substep }.run(&self.law);
        let mut errors = ImpactErrors::default();
        for (found, right) in found.chunks(MOMENTS).zip(&self.right) {
            let of = |n: usize| found.iter().map(|found| found[n] - right[n]).collect::<Vec<_>>();
            errors.restitution.include(&of(0));
            errors.spin.include(&of(1));
        }
        errors
    }
}

/// Impacts at given angles \[degrees], each at a given part of a sub-step before the end of which the ball meets the wall.
struct Impact<'g> {
    ball: Ball,
    given: &'g [[Real; 2]],
    substep: Real,
}

impl Impact<'_> {
    /// Restitution, and speed of the surface by the spin over the tangential speed before.
    fn run(&self, law: &PairConstants) -> Vec<[Real; 2]> {
        self.given.chunks(WIDTH).flat_map(|given| self.some(law, given)).collect()
    }

    /// Those of up to [`WIDTH`] impacts. The wall is `x3 = 0`; balls come from above along x1.
    fn some(&self, law: &PairConstants, given: &[[Real; 2]]) -> Vec<[Real; 2]> {
        let Ball { mass, radius, factor, half_periods: [half_period, _] } = self.ball;
        let h = self.substep;
        let inverse_inertia = (ACROSS - 1.0) / (mass * radius * radius);
        let constants = ConstantLanes::<WIDTH>::from_fn(|_| (law, factor, give([mass.recip(), 0.0])));
        let speed = OVERLAP * radius * PI / half_period;
        let of = |lane: usize| {
            let [angle, moment] = given[lane.min(given.len() - 1)];
            let (sine, cosine) = angle.to_radians().sin_cos();
            (Vector::new(speed * sine, 0.0, -speed * cosine), moment)
        };
        let normal = Lanes3::splat(-Vector::Z);
        let radii = [radius, Real::INFINITY].map(Lanes::splat);
        let mut velocity = Lanes3::from_fn(|l| of(l).0);
        let mut spin = Lanes3::splat(Vector::ZERO);
        // Heights over that at which the ball touches.
        let mut height = Lanes::from_fn(|l| -of(l).0.z * h * of(l).1);
        let mut d_t = Lanes3::splat(Vector::ZERO);
        let kick = Lanes::splat(h / mass);
        let turn = Lanes::splat(h * inverse_inertia);
        let zero = Lanes::splat(0.0);
        let none = Lanes3::splat(Vector::ZERO);
        let up = |v: Lanes3<WIDTH>| Lanes::from_fn(|l| v.lane(l).z);
        for n in 0..(LONGEST * half_period / h).min(MOST) as usize {
            height = height + up(velocity) * Lanes::splat(h);
            let touches = (-height).above(zero);
            if !touches.any() && n > 0 {
                break;
            }
            let arm = normal * (Lanes::splat(radius) + height * Lanes::splat(0.5));
            let at_contact = velocity + spin.cross(arm);
            let (on_ball, stretched, _) =
                force::<WIDTH, false>(&constants, normal, (-height, radii, Lanes::splat(1.0)), -at_contact, d_t, h);
            let on_ball = touches.select3(on_ball, none);
            d_t = touches.select3(stretched, none);
            velocity += on_ball * kick;
            spin += arm.cross(on_ball) * turn;
        }
        let after = |l: usize| {
            let before = of(l).0;
            [-velocity.lane(l).z / before.z, spin.lane(l).y * radius / before.x]
        };
        (0..given.len()).map(after).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::contact::linear_spring_dashpot::{Damping, LinearSpringDashpot};
    use crate::stability::USUAL_ERROR;

    /// Mass of a grain whose restitution at a wall is 0.929 \[kg].
    const MASS: Real = 3.93e-7;

    fn impacts(law: LinearSpringDashpot) -> Impacts {
        Impacts::new(&law, MASS, 3.5e-4)
    }

    #[test]
    fn the_papers_sand_bears_twice_0_075_and_not_six_times() {
        let sand = impacts(LinearSpringDashpot::SAND);
        let [one, two, three, six] = [1.0, 2.0, 3.0, 6.0].map(|times| sand.errors(0.075 * times));
        assert!(one.spin.mean < 2e-3 && two.spin.mean < 0.012 && three.spin.mean < 0.035, "{one:?} {two:?} {three:?}");
        assert!([one, two, three].iter().all(|errors| errors.restitution.mean < 1e-3), "{one:?} {two:?} {three:?}");
        assert!(two.restitution.largest < 0.011 && two.mean() < USUAL_ERROR, "{two:?}");
        assert!(six.mean() > 5.0 * USUAL_ERROR, "negative control: {six:?}");
        // Of the second order: the mean error grows faster than the sub-step.
        assert!(
            three.spin.mean > 2.0 * two.spin.mean && one.spin.largest < two.spin.largest,
            "{one:?} {two:?} {three:?}"
        );
    }

    #[test]
    fn what_is_right_has_the_restitution_of_the_law_and_no_error() {
        for e in [0.3, 0.929] {
            let law = LinearSpringDashpot { damping: Damping::Restitution(e), ..LinearSpringDashpot::SAND };
            let found = impacts(law);
            assert!(found.right.iter().all(|[found, _]| (found - e).abs() < 2e-3), "{e}: {:?}", found.right);
            assert!(found.errors(1.0 / FINE).mean() < 2e-4, "{:?}", found.errors(1.0 / FINE));
        }
        // Without friction there is no spin; a wall that holds stops the surface: 2/7 of the tangential speed are left.
        let of = |friction: Real| {
            impacts(LinearSpringDashpot {
                friction,
                damping: Damping::Literal { normal: 0.0, tangential: 0.0 },
                ..LinearSpringDashpot::SAND
            })
            .right
        };
        assert!(of(0.0).iter().all(|[e, spin]| *spin == 0.0 && (e - 1.0).abs() < 1e-4), "{:?}", of(0.0));
        // Sliding throughout, at 60 degrees with a friction of 0.1: 2.5 mu (1 + e) cot(60).
        let slid = of(0.1)[4][1] / (2.5 * 0.1 * 2.0 / 60.0_f64.to_radians().tan());
        assert!((slid - 1.0).abs() < 2e-3, "{slid}");
    }

    #[test]
    fn damping_and_tension_cost_accuracy() {
        let at = |law: LinearSpringDashpot| impacts(law).errors(0.15);
        let damped = LinearSpringDashpot { damping: Damping::Restitution(0.3), ..LinearSpringDashpot::SAND };
        let pulls = LinearSpringDashpot { tension: true, ..LinearSpringDashpot::SAND };
        let [sand, damped, pulls] = [LinearSpringDashpot::SAND, damped, pulls].map(at);
        assert!(damped.restitution.mean > 10.0 * sand.restitution.mean, "{damped:?} {sand:?}");
        assert!(pulls.spin.mean > 1.5 * sand.spin.mean, "{pulls:?} {sand:?}");
    }
}
