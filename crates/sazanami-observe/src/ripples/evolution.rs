//! Change of ripples in time: growth of their height and migration.

use sazanami_numerics::Real;

use super::metrics::Waves;
use super::{RippleSettings, SurfaceProfile, Unmeasured};
use crate::fit::{line, vertex};

/// Exponential growth, `height = scale exp(rate t)`, fitted by least squares in the logarithm of the height.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Growth {
    /// Rate [1/s], negative where ripples decay.
    pub rate: Real,
    /// Standard error of the rate from the scatter about the law [1/s].
    pub standard_error: Real,
    /// Height of the law at time zero \[m].
    pub scale: Real,
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
        Ok(Self { rate: line.slope, standard_error, scale: line.intercept.exp(), points: line.points })
    }

    /// Height of the law at `time` \[s], in m.
    #[must_use]
    pub fn at(&self, time: Real) -> Real {
        self.scale * (self.rate * time).exp()
    }
}

/// Shift of ripples between two profiles.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Migration {
    /// Shift towards larger x1 \[m]; over the time between, the speed of migration.
    pub shift: Real,
    /// Correlation of the profiles at that shift, 1 for the same ripples.
    pub correlation: Real,
}

/// Shift of ripples from an earlier to a later profile, at the highest correlation of their waves within `range` \[m]
/// for shifts of up to `reach` \[m] to either side. Ripples look the same a wavelength on: `reach` beyond half of one
/// has no meaning.
///
/// # Errors
/// If one of the profiles has no ripples, if they have other places, or if the correlation has no maximum below
/// `reach`.
pub fn migration(
    earlier: &SurfaceProfile,
    later: &SurfaceProfile,
    range: [Real; 2],
    reach: Real,
    settings: &RippleSettings,
) -> Result<Migration, Unmeasured> {
    let (before, after) = (Waves::of(earlier, range, settings)?, Waves::of(later, range, settings)?);
    let ((_, early), (_, late)) = (before.band.inner(), after.band.inner());
    if early.len() != late.len() || (before.start - after.start).abs() > 1e-6 * before.spacing {
        return Err(Unmeasured::TooFewValues { found: late.len(), needed: early.len() });
    }
    let lags = ((reach / before.spacing) as usize).min(early.len() / 2);
    let correlation: Vec<Real> = (-(lags as isize)..=lags as isize).map(|lag| correlation(early, late, lag)).collect();
    let first_highest = |best: usize, n: usize| if correlation[n] > correlation[best] { n } else { best };
    let top = (0..correlation.len()).fold(0, first_highest);
    if top == 0 || top + 1 == correlation.len() {
        return Err(Unmeasured::NoMaximum { reach });
    }
    let highest = vertex(correlation[top - 1], correlation[top], correlation[top + 1]);
    let (part, highest) = highest.unwrap_or((0.0, correlation[top]));
    let shift = (top as Real - lags as Real + part) * before.spacing;
    Ok(Migration { shift, correlation: highest.min(1.0) })
}

/// Correlation of `late`, moved back by `lag` values, with `early`, where both have values.
fn correlation(early: &[Real], late: &[Real], lag: isize) -> Real {
    let step = lag.unsigned_abs();
    let overlap = early.len() - step;
    let (early, late) = if lag >= 0 { (&early[..overlap], &late[step..]) } else { (&early[step..], &late[..overlap]) };
    let product = |a: &[Real], b: &[Real]| a.iter().zip(b).map(|(a, b)| a * b).sum::<Real>();
    product(early, late) / (product(early, early) * product(late, late)).sqrt()
}

#[cfg(test)]
mod tests {
    use std::f64::consts::TAU;

    use super::*;

    #[test]
    fn a_rate_of_growth_is_recovered() {
        let series: Vec<_> = (0..20).map(|n| 0.1 * f64::from(n)).map(|t| (t, 0.2e-3 * (0.7 * t).exp())).collect();
        let growth = Growth::of(&series).expect("it grows");
        assert!((growth.rate - 0.7).abs() < 1e-12 && growth.standard_error < 1e-12 && growth.points == 20);
        assert!((growth.at(1.0) - 0.2e-3 * 0.7_f64.exp()).abs() < 1e-15);
        let steady = Growth::of(&[(0.0, 1e-3), (1.0, 1.1e-3), (2.0, 0.9e-3), (3.0, 1e-3)]).expect("heights");
        assert!(steady.rate.abs() < 2.0 * steady.standard_error, "no growth in scatter: {steady:?}");
        assert!(Growth::of(&[(0.0, 1e-3), (1.0, 2e-3), (2.0, 0.0)]).is_err());
        assert!(Growth::of(&[(1.0, 1e-3), (1.0, 2e-3), (1.0, 2e-3)]).is_err());
    }

    fn ripples(shift: Real) -> SurfaceProfile {
        let height = |x: Real| 1e-3 * (TAU * x / 21e-3).sin() + 0.4e-3 * (TAU * x / 13e-3).cos();
        SurfaceProfile::complete(-0.07, 0.5e-3, (0..281).map(|n| height(-0.07 + 0.5e-3 * f64::from(n) - shift)))
    }

    #[test]
    fn ripples_are_followed_to_either_side() {
        let settings = RippleSettings::of_grains(1e-3, 20e-3);
        for shift in [0.0, 1.7e-3, -3.2e-3] {
            let found = migration(&ripples(0.0), &ripples(shift), [-0.065, 0.065], 8e-3, &settings).expect("ripples");
            assert!((found.shift - shift).abs() < 0.15e-3 && found.correlation > 0.97, "{shift}: {found:?}");
        }
    }

    #[test]
    fn no_shift_is_made_up() {
        let settings = RippleSettings::of_grains(1e-3, 20e-3);
        let flat = SurfaceProfile::complete(-0.07, 0.5e-3, vec![0.01; 281]);
        let to_flat = migration(&ripples(0.0), &flat, [-0.065, 0.065], 8e-3, &settings);
        assert!(matches!(to_flat, Err(Unmeasured::Flat { .. })));
        let beyond = migration(&ripples(0.0), &ripples(6e-3), [-0.065, 0.065], 3e-3, &settings);
        assert_eq!(beyond, Err(Unmeasured::NoMaximum { reach: 3e-3 }));
        let other_places = ripples(0.0).resampled([-0.065, 0.065], 0.4e-3);
        assert!(migration(&ripples(0.0), &other_places, [-0.065, 0.065], 8e-3, &settings).is_err());
    }
}
