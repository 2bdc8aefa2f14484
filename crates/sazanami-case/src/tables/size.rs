//! `size` of `[[grains]]`: distribution of the size factors.

use sazanami_case_derive::Keys;
use sazanami_numerics::Real;

use crate::read::{At, Context};

/// A factor and its share.
#[derive(Clone, Copy, Debug, PartialEq, Keys)]
pub struct Share {
    /// Factor on lengths.
    #[key(range = Positive)]
    pub factor: Real,
    /// Share by number.
    #[key(range = Positive, default = 1.0)]
    pub weight: Real,
}

/// Distribution of the size factors of a population: a factor on all lengths of a grain.
#[derive(Clone, Debug, PartialEq, Keys)]
pub enum SizeDistribution {
    /// All the same.
    #[key(absent)]
    Equal,
    /// Some factors with their shares by number.
    List(Vec<Share>),
    /// Equally likely between two factors.
    Uniform {
        /// Smallest factor.
        #[key(range = Positive)]
        lower: Real,
        /// Largest factor.
        #[key(range = Positive)]
        upper: Real,
    },
    /// Log-normal, cut off at two factors.
    Lognormal {
        /// Median factor.
        #[key(range = Positive, default = 1.0)]
        median: Real,
        /// Standard deviation of the logarithm.
        #[key(range = Between(0.0, 2.0), example = "0.2 -- the standard deviation of the logarithm")]
        sigma: Real,
        /// Smallest factor.
        #[key(range = Positive, default = median / (3.0 * sigma).exp(), says = "median exp(-3 sigma)")]
        lower: Real,
        /// Largest factor.
        #[key(range = Positive, default = median * (3.0 * sigma).exp(), says = "median exp(3 sigma)")]
        upper: Real,
    },
}

impl SizeDistribution {
    /// Brings shares to a sum of one and checks the order of the ends.
    pub(super) fn check(&mut self, at: &At<'_>, cx: &mut Context<'_>) {
        match self {
            Self::List(list) => {
                if list.is_empty() {
                    cx.report.error(at.span.clone(), "a list of sizes needs at least one").label("this one is empty");
                }
                let total: Real = list.iter().map(|share| share.weight).sum();
                // A sum that is one but for rounding is left alone: what was written is what is used.
                if (total - 1.0).abs() > 1e-12 {
                    list.iter_mut().for_each(|share| share.weight /= total);
                }
            }
            Self::Uniform { lower, upper } | Self::Lognormal { lower, upper, .. } if *lower > *upper => {
                cx.report.error(at.span.clone(), "`lower` lies above `upper`").label("exchange the two");
            }
            _ => {}
        }
    }

    /// Whether sizes are drawn: there are several.
    #[must_use]
    pub fn draws(&self) -> bool {
        let has_width = |lower: Real, upper: Real| upper > lower;
        match self {
            Self::Equal => false,
            Self::List(_) | Self::Uniform { .. } => has_width(self.smallest(), self.largest()),
            Self::Lognormal { sigma, lower, upper, .. } => *sigma > 0.0 && has_width(*lower, *upper),
        }
    }

    /// Largest size factor.
    #[must_use]
    pub fn largest(&self) -> Real {
        match self {
            Self::Equal => 1.0,
            Self::List(list) => list.iter().map(|share| share.factor).fold(0.0, Real::max),
            Self::Uniform { upper, .. } | Self::Lognormal { upper, .. } => *upper,
        }
    }

    /// Smallest size factor.
    #[must_use]
    pub fn smallest(&self) -> Real {
        match self {
            Self::Equal => 1.0,
            Self::List(list) => list.iter().map(|share| share.factor).fold(Real::INFINITY, Real::min),
            Self::Uniform { lower, .. } | Self::Lognormal { lower, .. } => *lower,
        }
    }

    /// Mean size factor.
    #[must_use]
    pub fn mean(&self) -> Real {
        self.mean_power(1)
    }

    /// Mean cube of the size factors: that of the volumes.
    #[must_use]
    pub fn mean_cube(&self) -> Real {
        self.mean_power(3)
    }

    /// Mean of a power of the size factors.
    fn mean_power(&self, power: i32) -> Real {
        match self {
            Self::Equal => 1.0,
            Self::List(list) => {
                let shares: Real = list.iter().map(|share| share.weight).sum();
                list.iter().map(|share| share.weight * share.factor.powi(power)).sum::<Real>() / shares
            }
            Self::Uniform { lower, upper } if upper > lower => {
                let over = f64::from(power + 1);
                (upper.powi(power + 1) - lower.powi(power + 1)) / (over * (upper - lower))
            }
            Self::Uniform { upper, .. } => upper.powi(power),
            Self::Lognormal { median, sigma, lower, upper } if *sigma > 0.0 && upper > lower => {
                // There is next to nothing beyond ten deviations from where the moment lies.
                let [low, high] = [lower, upper].map(|end| (end / median).ln() / sigma);
                let [low, high] = [low.max(-10.0), high.min(10.0 + Real::from(power) * sigma)];
                let weight = |x: Real| (-0.5 * x * x).exp();
                let moment = |x: Real| weight(x) * (median * (sigma * x).exp()).powi(power);
                integral(moment, low, high) / integral(weight, low, high)
            }
            Self::Lognormal { median, lower, upper, .. } => median.clamp(*lower, *upper).powi(power),
        }
    }
}

/// Integral by Simpson's rule, of functions as smooth as a normal distribution a few deviations wide.
fn integral(of: impl Fn(Real) -> Real, low: Real, high: Real) -> Real {
    const HALVES: usize = 500;
    let step = (high - low) / (2 * HALVES) as Real;
    let at = |n: usize| of(low + step * n as Real);
    let sum: Real = (0..HALVES).map(|n| at(2 * n) + 4.0 * at(2 * n + 1) + at(2 * n + 2)).sum();
    sum * step / 3.0
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn means_of_a_cut_log_normal_distribution_are_those_within_its_ends() {
        let cut = |at: Real| SizeDistribution::Lognormal { median: 2.0, sigma: 1.0, lower: 2.0 / at, upper: 2.0 * at };
        // Far ends: Aitchison & Brown (1957), the moments of the whole distribution.
        let whole = cut(1e4);
        for (found, power) in [(whole.mean(), 1), (whole.mean_cube(), 3)] {
            let expected = Real::exp2(power.into()) * (0.5 * Real::from(power * power)).exp();
            assert!((found / expected - 1.0).abs() < 1e-6, "{found}, not {expected}");
        }
        // Ends three deviations away cut the mean cube, which lies there, by half but for a thousandth of the grains.
        let found = cut(3.0_f64.exp()).mean_cube() / whole.mean_cube();
        assert!((found - 0.5 / 0.9973).abs() < 1e-4, "{found}");
        assert!((cut(1.01).mean() / 2.0 - 1.0).abs() < 1e-4);
    }
}
