//! Limited slopes of the velocity in the donor cell.

use sazanami_numerics::{Real, choices};

choices! {
    /// Slope of the velocity in the donor cell.
    #[derive(Default)]
    pub enum Limiter {
        /// van Leer (1974): harmonic mean of the differences on both sides.
        #[default]
        VanLeer = "van_leer",
        /// Mean of the differences (Fromm): second order, not monotone; for convergence tests.
        Unlimited = "none",
    }
}

/// Limited slope from the differences upwind and downwind of the donor.
pub(crate) trait Slope: Copy + Sync {
    fn slope(self, behind: Real, ahead: Real) -> Real;
}

#[derive(Clone, Copy)]
pub(crate) struct VanLeer;
#[derive(Clone, Copy)]
pub(crate) struct Unlimited;

impl Slope for VanLeer {
    #[inline(always)]
    fn slope(self, a: Real, b: Real) -> Real {
        let product = a * b;
        let slope = 2.0 * product / (a + b);
        if product > 0.0 { slope } else { 0.0 }
    }
}

impl Slope for Unlimited {
    #[inline(always)]
    fn slope(self, a: Real, b: Real) -> Real {
        0.5 * (a + b)
    }
}
