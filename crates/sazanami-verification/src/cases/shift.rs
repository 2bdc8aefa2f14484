//! The time shift that an experiment is allowed.

use sazanami_numerics::Real;

/// The shift of a clock, no more than `most` either way, with the least `error`, and that error. It is the error that is
/// judged: the shift is what is allowed for it.
pub fn best_shift(most: Real, error: impl Fn(Real) -> Real) -> [Real; 2] {
    let steps = (most / 0.005).round() as i32;
    let tried = (-steps..=steps).map(|n| 0.005 * Real::from(n)).map(|shift| [shift, error(shift)]);
    tried.fold([0.0, Real::INFINITY], |best, now| if now[1] < best[1] { now } else { best })
}
