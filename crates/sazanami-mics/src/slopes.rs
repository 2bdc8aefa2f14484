//! Velocity on a face from the donor cell and the cells on both sides of it.

use sazanami_numerics::Real;

/// What the velocity gains from the donor's centre to where it leaves through a face.
pub(crate) trait Slope: Copy + Sync {
    /// From the differences upwind and downwind of the donor; `weight` is `(1 - c)/2` for the part `c` of the donor that leaves, or
    /// zero for no slope.
    fn gain(self, weight: Real, behind: Real, ahead: Real) -> Real;
}

/// Third order in space and time where the flow is even (QUICKEST; Leonard 1979, Comput. Methods Appl. Mech. Eng. 19, 59,
/// [doi:10.1016/0045-7825(79)90034-3](https://doi.org/10.1016/0045-7825(79)90034-3)). Not limited: a limiter flattens the crests beside
/// curved surfaces, and what it takes from the flow there is form drag.
#[derive(Clone, Copy)]
pub(crate) struct ThirdOrder;

/// Harmonic mean of the differences, none at extremes (van Leer 1974): for slopes across an interface.
#[derive(Clone, Copy)]
pub(crate) struct VanLeer;

impl Slope for ThirdOrder {
    #[inline(always)]
    fn gain(self, weight: Real, a: Real, b: Real) -> Real {
        weight * (b - (2.0 / 3.0) * (1.0 - weight) * (b - a))
    }
}

impl Slope for VanLeer {
    #[inline(always)]
    fn gain(self, weight: Real, a: Real, b: Real) -> Real {
        let product = a * b;
        let slope = 2.0 * product / (a + b);
        weight * if product > 0.0 { slope } else { 0.0 }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_mean_of_what_leaves_is_exact_for_quadratic_velocities() {
        // Means over the cells [-1, 0], [0, 1] (the donor) and [1, 2], and over the part of the donor that leaves.
        let mean = |from: Real, to: Real| {
            let whole = |x: Real| 0.3 * x + 0.7 * x * x + 1.1 * x * x * x / 3.0;
            (whole(to) - whole(from)) / (to - from)
        };
        let [behind, donor, ahead] = [-1.0, 0.0, 1.0].map(|x| mean(x, x + 1.0));
        for c in [1e-6, 0.2, 0.45, 1.0] {
            let error = |slope: &dyn Fn(Real, Real, Real) -> Real| {
                donor + slope(0.5 * (1.0 - c), donor - behind, ahead - donor) - mean(1.0 - c, 1.0)
            };
            assert!(error(&|w, a, b| ThirdOrder.gain(w, a, b)).abs() < 1e-9, "{c}");
            // Negative control.
            assert!(c == 1.0 || error(&|w, a, b| VanLeer.gain(w, a, b)).abs() > 0.01, "{c}");
        }
    }
}
