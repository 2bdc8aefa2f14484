//! Distributions of grain sizes.

use sazanami_numerics::Real;

use super::Context;
use crate::case::meaning::SizeDistribution;
use crate::case::schema::SizeText;
use crate::case::value::Range1;
use crate::case::written::At;

impl Context<'_> {
    pub(super) fn size_distribution(&mut self, At { value, span }: &At<SizeText>) -> SizeDistribution {
        let values = &mut self.values;
        match value {
            SizeText::List(shares) => {
                if shares.is_empty() {
                    values.report.error(span.clone(), "a list of sizes needs at least one").label("this one is empty");
                }
                let mut list = Vec::new();
                for At { value, span } in shares {
                    let factor = values.optional_number(value.factor.as_ref(), "factor", Range1::Positive);
                    if factor.is_none() {
                        values.missing(Some(span), "factor", "add `factor = 1.0`");
                    }
                    let weight = values.number(value.weight.as_ref(), "weight", Range1::Positive, 1.0);
                    list.push([factor.unwrap_or(Real::NAN), weight]);
                }
                let total: Real = list.iter().map(|share| share[1]).sum();
                for share in &mut list {
                    // A sum that is one but for rounding is left alone: what was written is what is used.
                    if (total - 1.0).abs() > 1e-12 {
                        share[1] /= total;
                    }
                }
                SizeDistribution::List(list)
            }
            SizeText::Uniform(u) => {
                let lower = values.number(u.lower.as_ref(), "lower", Range1::Positive, Real::NAN);
                let upper = values.number(u.upper.as_ref(), "upper", Range1::Positive, Real::NAN);
                for (key, missing) in [("lower", u.lower.is_none()), ("upper", u.upper.is_none())] {
                    if missing {
                        values.missing(Some(span), key, &format!("add `{key} = 1.0`"));
                    }
                }
                if lower > upper {
                    values.report.error(span.clone(), "`lower` lies above `upper`").label("exchange the two");
                }
                SizeDistribution::Uniform { lower, upper }
            }
            SizeText::Lognormal(l) => {
                let median = values.number(l.median.as_ref(), "median", Range1::Positive, 1.0);
                let sigma = values.optional_number(l.sigma.as_ref(), "sigma", Range1::Between(0.0, 2.0));
                if sigma.is_none() {
                    values.missing(Some(span), "sigma", "add `sigma = 0.2`, the standard deviation of the logarithm");
                }
                let sigma = sigma.unwrap_or(Real::NAN);
                let reach = (3.0 * sigma).exp();
                let lower = values.number(l.lower.as_ref(), "lower", Range1::Positive, median / reach);
                let upper = values.number(l.upper.as_ref(), "upper", Range1::Positive, median * reach);
                if lower > upper {
                    values.report.error(span.clone(), "`lower` lies above `upper`").label("exchange the two");
                }
                SizeDistribution::Lognormal { median, sigma, lower, upper }
            }
        }
    }
}
