//! Growth of a bed's relief in time.

use sazanami_numerics::Real;

use super::Unmeasured;
use crate::fit::line;

/// Exponential growth, `height ~ exp(rate t)`, fitted by least squares in the logarithm of the height.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Growth {
    /// Rate [1/s], negative where ripples decay.
    pub rate: Real,
    /// Standard error of the rate from the scatter about the law [1/s].
    pub standard_error: Real,
    /// Number of heights used.
    pub points: usize,
}

impl Growth {
    /// Fits heights \[m] at times \[s]; those that are not positive are left out.
    ///
    /// # Errors
    /// With fewer than three heights at different times.
    pub fn of(series: &[(Real, Real)]) -> Result<Self, Unmeasured> {
        let logs: Vec<(Real, Real)> = series.iter().filter(|(_, h)| *h > 0.0).map(|&(t, h)| (t, h.ln())).collect();
        let too_few = Unmeasured::TooFewValues { found: logs.len().min(2), needed: 3 };
        let line = line(&logs).ok_or(too_few)?;
        let standard_error = line.standard_error.ok_or(too_few)?;
        Ok(Self { rate: line.slope, standard_error, points: line.points })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_rate_of_growth_is_recovered() {
        let series: Vec<_> = (0..20).map(|n| 0.1 * f64::from(n)).map(|t| (t, 0.2e-3 * (0.7 * t).exp())).collect();
        let growth = Growth::of(&series).expect("it grows");
        assert!((growth.rate - 0.7).abs() < 1e-12 && growth.standard_error < 1e-12 && growth.points == 20);
        let steady = Growth::of(&[(0.0, 1e-3), (1.0, 1.1e-3), (2.0, 0.9e-3), (3.0, 1e-3)]).expect("heights");
        assert!(steady.rate.abs() < 2.0 * steady.standard_error, "no growth in scatter: {steady:?}");
        assert!(Growth::of(&[(0.0, 1e-3), (1.0, 2e-3), (2.0, 0.0)]).is_err());
        assert!(Growth::of(&[(1.0, 1e-3), (1.0, 2e-3), (1.0, 2e-3)]).is_err());
    }
}
