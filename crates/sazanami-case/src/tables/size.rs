//! `size` of `[[grains]]`: distribution of the size factors.

use std::cmp::Ordering;

use sazanami_case_derive::Keys;
use sazanami_numerics::Real;

use crate::read::{At, Context};
use crate::units::rounded;

/// Least share of a log-normal distribution between its ends: grains are drawn until one lies there.
const LEAST_SHARE: Real = 1e-3;
/// Deviations from the middle beyond which there is next to nothing of a normal distribution.
const FAR: Real = 10.0;

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

/// A sieve and the share of the mass that passes it.
#[derive(Clone, Copy, Debug, PartialEq, Keys)]
pub struct Sieve {
    /// Width of its openings: factor on lengths.
    #[key(range = Positive)]
    pub factor: Real,
    /// Share of the mass that passes it.
    #[key(range = Between(0.0, 1.0), example = "0.5 -- the share of the mass that passes")]
    pub passing: Real,
}

/// The grains between two sieves, whose mass is spread evenly over the factors.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Fraction {
    lower: Real,
    upper: Real,
    /// Share of the mass.
    mass: Real,
}

impl Fraction {
    /// The fractions of a sieve curve.
    pub fn of(sieves: &[Sieve]) -> impl Iterator<Item = Self> + '_ {
        let between = |pair: &[Sieve]| {
            let mass = pair[1].passing - pair[0].passing;
            (mass > 0.0).then_some(Self { lower: pair[0].factor, upper: pair[1].factor, mass })
        };
        sieves.windows(2).filter_map(between)
    }

    /// Sum of a power of the factors over its grains, which are as many as their mass over the cube of the factor says: up to a constant.
    fn sum(&self, power: i32) -> Real {
        let (lower, upper) = (self.lower, self.upper);
        let over_factors = match power - 2 {
            0 => (upper / lower).ln(),
            power => (upper.powi(power) - lower.powi(power)) / Real::from(power),
        };
        self.mass / (upper - lower) * over_factors
    }

    /// Number of its grains, up to a constant.
    #[must_use]
    pub fn number(&self) -> Real {
        self.sum(0)
    }

    /// Factor that a share `part` of its grains, by number, does not exceed.
    #[must_use]
    pub fn factor(&self, part: Real) -> Real {
        let [lower, upper] = [self.lower, self.upper].map(|end| end.powi(-2));
        (lower - part * (lower - upper)).powf(-0.5)
    }
}

/// Distribution of the size factors of a population: a factor on all lengths of a grain.
#[derive(Clone, Debug, PartialEq, Keys)]
pub enum SizeDistribution {
    /// All the same.
    #[key(absent)]
    Equal,
    /// Some factors with their shares by number.
    List(Vec<Share>),
    /// A sieve curve: the share of the mass that passes each sieve, from 0 at the first to 1 at the last, straight between them.
    Sieves(Vec<Sieve>),
    /// Equally likely between two factors.
    Uniform {
        /// Smallest factor.
        #[key(range = Positive)]
        lower: Real,
        /// Largest factor.
        #[key(range = Positive)]
        upper: Real,
    },
    /// Log-normal, cut off at two factors, between which a thousandth of it lies at least; one size where the two are equal.
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
            Self::Sieves(sieves) => {
                let rises = |pair: &[Sieve]| pair[0].factor < pair[1].factor && pair[0].passing <= pair[1].passing;
                let ends = [sieves.first(), sieves.last()].map(|end| end.map(|sieve| sieve.passing));
                if ends != [Some(0.0), Some(1.0)] || !sieves.windows(2).all(rises) {
                    cx.report
                        .error(at.span.clone(), "this is no sieve curve")
                        .label("sieves in the order of their size, the first passed by nothing (0) and the last by all (1)")
                        .help("for example [{ factor = 0.5, passing = 0 }, { factor = 1, passing = 0.6 }, { factor = 2, passing = 1 }]");
                    *self = Self::Equal;
                }
            }
            Self::Uniform { lower, upper } | Self::Lognormal { lower, upper, .. }
                if (*lower).partial_cmp(upper).is_none_or(Ordering::is_gt) =>
            {
                // What could not be read is no number, and has been reported.
                if lower > upper {
                    cx.report.error(at.span.clone(), "`lower` lies above `upper`").label("exchange the two");
                }
                *self = Self::Equal;
            }
            Self::Lognormal { median, sigma, lower, upper } if *upper > *lower => {
                let share = share_between([*lower, *upper].map(|end| (end / *median).ln() / *sigma));
                if share < LEAST_SHARE {
                    cx.report
                        .error(at.span.clone(), "next to nothing of this log-normal distribution lies between its ends")
                        .label(format!(
                            "{} % of it lie between {} and {}",
                            rounded(1e2 * share),
                            rounded(*lower),
                            rounded(*upper)
                        ))
                        .help("put `lower` and `upper` about `median`, or write `size.uniform` between the two");
                    *self = Self::Equal;
                }
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
            Self::List(_) | Self::Sieves(_) | Self::Uniform { .. } => has_width(self.smallest(), self.largest()),
            Self::Lognormal { sigma, lower, upper, .. } => *sigma > 0.0 && has_width(*lower, *upper),
        }
    }

    /// Largest size factor.
    #[must_use]
    pub fn largest(&self) -> Real {
        match self {
            Self::Equal => 1.0,
            Self::List(list) => list.iter().map(|share| share.factor).fold(0.0, Real::max),
            Self::Sieves(sieves) => Fraction::of(sieves).last().map_or(1.0, |fraction| fraction.upper),
            Self::Uniform { upper, .. } | Self::Lognormal { upper, .. } => *upper,
        }
    }

    /// Smallest size factor.
    #[must_use]
    pub fn smallest(&self) -> Real {
        match self {
            Self::Equal => 1.0,
            Self::List(list) => list.iter().map(|share| share.factor).fold(Real::INFINITY, Real::min),
            Self::Sieves(sieves) => Fraction::of(sieves).next().map_or(1.0, |fraction| fraction.lower),
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
            Self::Sieves(sieves) => {
                let sum = |power: i32| Fraction::of(sieves).map(|fraction| fraction.sum(power)).sum::<Real>();
                sum(power) / sum(0)
            }
            Self::Uniform { lower, upper } if upper > lower => {
                let over = f64::from(power + 1);
                (upper.powi(power + 1) - lower.powi(power + 1)) / (over * (upper - lower))
            }
            Self::Uniform { upper, .. } => upper.powi(power),
            Self::Lognormal { median, sigma, lower, upper } if *sigma > 0.0 && upper > lower => {
                // There is next to nothing farther from where the moment lies.
                let [low, high] = [lower, upper].map(|end| (end / median).ln() / sigma);
                let [low, high] = [low.max(-FAR), high.min(FAR + Real::from(power) * sigma)];
                let weight = |x: Real| (-0.5 * x * x).exp();
                let moment = |x: Real| weight(x) * (median * (sigma * x).exp()).powi(power);
                integral(moment, low, high) / integral(weight, low, high)
            }
            Self::Lognormal { median, lower, upper, .. } => median.clamp(*lower, *upper).powi(power),
        }
    }
}

/// Share of a normal distribution between two ends, from its middle and over its standard deviation: a deviation of zero has it all in the
/// middle.
fn share_between([low, high]: [Real; 2]) -> Real {
    // An end in the middle of a distribution without width is no number.
    let (low, high) = (low.max(-FAR), high.min(FAR));
    let weight = |x: Real| (-0.5 * x * x).exp();
    if low < high { integral(weight, low, high) / std::f64::consts::TAU.sqrt() } else { 0.0 }
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

    #[test]
    fn grains_of_a_sieve_curve_have_its_mass_between_any_two_sizes() {
        let sieves =
            [(0.5, 0.0), (1.0, 0.25), (1.5, 0.25), (2.0, 1.0)].map(|(factor, passing)| Sieve { factor, passing });
        // Quantiles of the numbers, weighted by volume, against the curve.
        let (mut below_one, mut below, mut all) = (0.0, 0.0, 0.0);
        let total: Real = Fraction::of(&sieves).map(|fraction| fraction.number()).sum();
        let parts = 20_000;
        for fraction in Fraction::of(&sieves) {
            for n in 0..parts {
                let factor = fraction.factor((Real::from(n) + 0.5) / Real::from(parts));
                let mass = factor.powi(3) * fraction.number() / total / Real::from(parts);
                all += mass;
                below_one += if factor < 1.0 { mass } else { 0.0 };
                below += if factor < 1.75 { mass } else { 0.0 };
            }
        }
        assert!(
            (below_one / all - 0.25).abs() < 1e-4 && (below / all - 0.625).abs() < 1e-4,
            "{below_one} {below} {all}"
        );
        let curve = SizeDistribution::Sieves(sieves.to_vec());
        assert!((curve.mean_cube() / all - 1.0).abs() < 1e-6);
        assert!((curve.smallest(), curve.largest()) == (0.5, 2.0) && curve.draws() && curve.mean() < 1.0);
    }
}
