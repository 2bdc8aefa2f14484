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

    /// Mean of a power of the size factors; that of the whole distribution where a log-normal one is cut off.
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
            Self::Lognormal { median, sigma, .. } => {
                median.powi(power) * (0.5 * (f64::from(power) * sigma).powi(2)).exp()
            }
        }
    }
}
