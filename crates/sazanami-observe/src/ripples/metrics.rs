//! Wavelength and height of ripples.

use sazanami_numerics::Real;

use super::band::{Band, detrended};
use super::{SurfaceProfile, Tank, Unmeasured};
use crate::fit::vertex;

/// Part of a profile over which waves are compared with themselves.
const LARGEST_LAG: Real = 0.6;

/// Settings that tell ripples from the rest of a profile.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RippleSettings {
    /// Distance from the end walls that is left out \[m].
    pub margin: Real,
    /// Shortest and longest wave that counts \[m]. Waves longer than the profile never do.
    pub band: [Real; 2],
    /// Part of the profile at each end over which the cosine window rises.
    pub taper: Real,
    /// Root mean square of the waves in the band from which on they are ripples \[m].
    pub least_relief: Real,
}

impl RippleSettings {
    /// The usual evaluation for grains of diameter `grain_size` \[m]: 10 mm off the walls, waves of 5 to 60 mm, a
    /// window that rises over a tenth at each end.
    ///
    /// A level bed is never level to the grain. `across` \[m] is the width over which the surface is an average: that
    /// of the tank for concentration and top layer, that of the slab for the image. A made-up level bed with its top
    /// layer half full showed waves of standard deviation up to `0.41 d sqrt(d / across)` in all three definitions,
    /// 8 to 12 mm long; from `0.5 d sqrt(d / across)` on waves are taken for ripples.
    #[must_use]
    pub fn of_grains(grain_size: Real, across: Real) -> Self {
        let least_relief = 0.5 * grain_size * (grain_size / across).sqrt();
        Self { margin: 10e-3, band: [5e-3, 60e-3], taper: 0.1, least_relief }
    }

    /// The part of x1 \[m] that is looked at in a tank.
    #[must_use]
    pub fn range_in(&self, tank: &Tank) -> [Real; 2] {
        tank.range_inside(self.margin)
    }
}

/// Waves of a profile without its trend, in the band of ripples.
pub(super) struct Waves {
    pub band: Band,
    /// Root mean square without the trend, before the band is taken out \[m].
    pub relief: Real,
    /// Place of the first value \[m].
    pub start: Real,
    pub spacing: Real,
}

impl Waves {
    pub fn of(profile: &SurfaceProfile, range: [Real; 2], settings: &RippleSettings) -> Result<Self, Unmeasured> {
        let part = profile.within(range);
        let values = part.whole()?;
        let [shortest, longest] = settings.band;
        let length = part.len() as Real * part.spacing;
        if length < 4.0 * shortest {
            return Err(Unmeasured::TooShort { length, needed: 4.0 * shortest });
        }
        if 3.0 * part.spacing > shortest {
            return Err(Unmeasured::TooCoarse { spacing: part.spacing, shortest });
        }
        let rest = detrended(&values);
        let relief = root_mean_square(&rest);
        let band = Band::of(&rest, part.spacing, [shortest, longest.min(length)], settings.taper);
        let deviation = band.variance.sqrt();
        if deviation < settings.least_relief || band.centroid.is_none() {
            return Err(Unmeasured::Flat { deviation, least: settings.least_relief });
        }
        Ok(Self { band, relief, start: part.start, spacing: part.spacing })
    }

    /// Places where the waves rise through zero, in spacings from the first value.
    fn rises(&self) -> Vec<Real> {
        let (first, values) = self.band.inner();
        let pairs = values.windows(2).enumerate().filter(|(_, pair)| pair[0] < 0.0 && pair[1] >= 0.0);
        pairs.map(|(n, pair)| (first + n) as Real + pair[0] / (pair[0] - pair[1])).collect()
    }

    /// Highest and lowest value between the first value at or after `from` and the last before `to` [spacings].
    fn extremes(&self, from: Real, to: Real) -> (Real, Real) {
        let part = &self.band.values[from.ceil() as usize..(to.ceil() as usize).max(from.ceil() as usize + 1)];
        let highest = part.iter().copied().fold(Real::NEG_INFINITY, Real::max);
        (highest, part.iter().copied().fold(Real::INFINITY, Real::min))
    }

    /// Places of the crests \[m]: the highest one of each stretch above zero, whole or cut off by the window.
    pub fn crests(&self) -> Vec<Real> {
        let (first, values) = self.band.inner();
        let mut crests = Vec::new();
        let mut highest: Option<usize> = None;
        for (n, &value) in values.iter().enumerate() {
            if value > 0.0 {
                highest = Some(highest.filter(|&at| values[at] >= value).unwrap_or(n));
            }
            if let Some(at) = highest
                && (value <= 0.0 || n + 1 == values.len())
            {
                // A rise that the window cuts off has its crest elsewhere.
                if at > 0 && at + 1 < values.len() {
                    let shift = peak(values, at);
                    crests.push(self.start + ((first + at) as Real + shift) * self.spacing);
                }
                highest = None;
            }
        }
        crests
    }

    /// Shift \[m] of the first maximum of the correlation of the waves with themselves, past its first negative value.
    fn correlation_maximum(&self) -> Result<Real, Unmeasured> {
        let (_, values) = self.band.inner();
        let lags = (LARGEST_LAG * values.len() as Real) as usize;
        let product = |a: &[Real], b: &[Real]| a.iter().zip(b).map(|(a, b)| a * b).sum::<Real>();
        let correlation: Vec<Real> = (0..lags)
            .map(|lag| {
                let (early, late) = (&values[..values.len() - lag], &values[lag..]);
                product(early, late) / (product(early, early) * product(late, late)).sqrt()
            })
            .collect();
        let reach = lags as Real * self.spacing;
        let negative = correlation.iter().position(|&c| c < 0.0).ok_or(Unmeasured::NoMaximum { reach })?;
        let is_highest = |n: &usize| correlation[*n] > 0.0 && correlation[*n] >= correlation[n - 1];
        let top = (negative.max(1)..lags.saturating_sub(1))
            .find(|n| is_highest(n) && correlation[*n] > correlation[n + 1])
            .ok_or(Unmeasured::NoMaximum { reach })?;
        Ok((top as Real + peak(&correlation, top)) * self.spacing)
    }
}

/// Place of the maximum near the highest value `at`, from there on, in distances of the values.
fn peak(values: &[Real], at: usize) -> Real {
    vertex(values[at - 1], values[at], values[at + 1]).map_or(0.0, |(place, _)| place)
}

fn root_mean_square(values: &[Real]) -> Real {
    (values.iter().map(|z| z * z).sum::<Real>() / values.len() as Real).sqrt()
}

/// Root mean square of the part of a profile within `range` \[m] without its trend, all wavelengths \[m]: of a level bed
/// too.
///
/// # Errors
/// If the part is empty or has gaps.
pub fn relief(profile: &SurfaceProfile, range: [Real; 2]) -> Result<Real, Unmeasured> {
    let values = profile.within(range).whole()?;
    if values.len() < 4 {
        return Err(Unmeasured::TooFewValues { found: values.len(), needed: 4 });
    }
    Ok(root_mean_square(&detrended(&values)))
}

/// Measures of the ripples of a profile.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ripples {
    /// Root mean square of the profile without its trend, all wavelengths \[m].
    pub relief: Real,
    /// Standard deviation of the waves in the band \[m].
    pub deviation: Real,
    /// Wavelength at the centre of the spectrum, its zeroth over its first moment in wavenumbers \[m].
    pub spectral_wavelength: Real,
    /// Mean distance from one rise through zero to the next \[m].
    pub crossing_wavelength: Result<Real, Unmeasured>,
    /// Shift of the first maximum of the profile's correlation with itself \[m].
    pub correlation_wavelength: Result<Real, Unmeasured>,
    /// Mean height from crest to trough of the waves between one rise through zero and the next \[m].
    pub crest_to_trough: Result<Real, Unmeasured>,
    /// Number of such waves.
    pub waves: usize,
}

impl Ripples {
    /// Measures the part of a profile within `range` \[m].
    ///
    /// # Errors
    /// If the profile is too short (less than four of the shortest waves), too coarse, has gaps, or is flat.
    pub fn of(profile: &SurfaceProfile, range: [Real; 2], settings: &RippleSettings) -> Result<Self, Unmeasured> {
        Ok(Self::of_waves(&Waves::of(profile, range, settings)?))
    }

    pub(super) fn of_waves(waves: &Waves) -> Self {
        let rises = waves.rises();
        let whole = rises.len().saturating_sub(1);
        let needs_wave = |value: Real| {
            if whole > 0 { Ok(value / whole as Real) } else { Err(Unmeasured::TooFewWaves { found: whole, needed: 1 }) }
        };
        let heights = rises.windows(2).map(|ends| waves.extremes(ends[0], ends[1]));
        let length = rises.last().zip(rises.first()).map_or(0.0, |(last, first)| last - first);
        Self {
            relief: waves.relief,
            deviation: waves.band.variance.sqrt(),
            spectral_wavelength: waves.band.centroid.unwrap_or(Real::INFINITY),
            crossing_wavelength: needs_wave(length * waves.spacing),
            correlation_wavelength: waves.correlation_maximum(),
            crest_to_trough: needs_wave(heights.map(|(highest, lowest)| highest - lowest).sum()),
            waves: whole,
        }
    }

    /// Height from the standard deviation, `2 sqrt(2) sigma`: that from crest to trough of a sine \[m].
    #[must_use]
    pub fn height(&self) -> Real {
        8.0_f64.sqrt() * self.deviation
    }

    /// Steepness: height from crest to trough over wavelength, both of the waves between rises through zero.
    ///
    /// # Errors
    /// If there is no whole wave.
    pub fn steepness(&self) -> Result<Real, Unmeasured> {
        Ok(self.crest_to_trough? / self.crossing_wavelength?)
    }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::TAU;

    use super::*;

    const RANGE: [Real; 2] = [-0.065, 0.065];

    fn settings() -> RippleSettings {
        RippleSettings::of_grains(1e-3, 20e-3)
    }

    /// A profile over a tank of 150 mm.
    fn profile(height: impl Fn(Real) -> Real) -> SurfaceProfile {
        let x = |n: u32| -0.07475 + 0.5e-3 * f64::from(n);
        SurfaceProfile::complete(x(0), 0.5e-3, (0..300).map(|n| height(x(n))))
    }

    fn off(value: Real, exact: Real) -> Real {
        (value / exact - 1.0).abs()
    }

    #[test]
    fn sines_have_their_length_and_height() {
        for (length, height) in [(12e-3, 1e-3), (20e-3, 3e-3), (31e-3, 2e-3)] {
            // On a bed that is bent as a whole and rough by a tenth of the height at 2 mm.
            let bed = profile(|x| {
                let rough = 0.1 * height * (TAU * x / 2e-3).sin();
                0.010 + 0.02 * x - 0.4 * x * x + 0.5 * height * (TAU * x / length + 0.7).sin() + rough
            });
            let found = Ripples::of(&bed, RANGE, &settings()).expect("ripples");
            let lengths = [Ok(found.spectral_wavelength), found.crossing_wavelength, found.correlation_wavelength]
                .map(|l| l.expect("waves"));
            assert!(lengths.iter().all(|&l| off(l, length) < 0.04), "{length}: {lengths:?}");
            let crests = found.crest_to_trough.expect("whole waves");
            assert!(off(crests, height) < 0.08 && off(found.height(), height) < 0.05, "{height}: {found:?}");
            let steepness = found.steepness().expect("whole waves");
            assert!(off(steepness, height / length) < 0.1, "{steepness}");
            let exact = (0.125 * height * height * (1.0 + 0.04)).sqrt();
            assert!(off(found.relief, exact) < 0.06, "{} {exact}", found.relief);
        }
    }

    #[test]
    fn the_height_of_a_trend_is_no_height() {
        let trend = profile(|x| 0.01 + 0.3 * x - 2.0 * x * x);
        assert!(
            matches!(Ripples::of(&trend, RANGE, &settings()), Err(Unmeasured::Flat { deviation, .. }) if deviation < 1e-12)
        );
        let message = Unmeasured::Flat { deviation: 1.23e-4, least: 2e-4 }.to_string();
        assert!(message.contains("0.123 mm (rms), below the 0.200 mm"), "{message}");
        let rough = profile(|x| 1e-3 * (TAU * x / 2e-3).sin());
        assert!(matches!(Ripples::of(&rough, RANGE, &settings()), Err(Unmeasured::Flat { .. })));
    }

    #[test]
    fn what_cannot_be_measured_says_why() {
        let sine = profile(|x| 1e-3 * (TAU * x / 20e-3).sin());
        let short = Ripples::of(&sine, [0.0, 0.015], &settings());
        assert!(
            matches!(short, Err(Unmeasured::TooShort { length, .. }) if (length - 0.015).abs() < 1e-9),
            "{short:?}"
        );
        let coarse = sine.resampled(RANGE, 4e-3);
        assert!(matches!(Ripples::of(&coarse, RANGE, &settings()), Err(Unmeasured::TooCoarse { .. })));
        let mut broken = sine.clone();
        broken.heights[150] = None;
        assert!(matches!(Ripples::of(&broken, RANGE, &settings()), Err(Unmeasured::Gap { at }) if at.abs() < 0.5e-3));
        // One crest in the middle has no second rise through zero and no second crest.
        let hump = profile(|x| 2e-3 * (-(x / 8e-3).powi(2)).exp());
        let few = Ripples::of(&hump, [-0.02, 0.02], &settings()).expect("a relief");
        assert_eq!(few.crossing_wavelength, Err(Unmeasured::TooFewWaves { found: 0, needed: 1 }));
        assert!(matches!(few.correlation_wavelength, Err(Unmeasured::NoMaximum { .. })), "{few:?}");
        assert_eq!(few.steepness(), Err(Unmeasured::TooFewWaves { found: 0, needed: 1 }));
    }

    #[test]
    fn crests_are_where_they_are() {
        let sine = profile(|x| 1e-3 * (TAU * x / 20e-3).cos());
        let waves = Waves::of(&sine, RANGE, &settings()).expect("ripples");
        let crests = waves.crests();
        assert_eq!(crests.len(), 5, "{crests:?}");
        assert!(
            crests.iter().zip([-0.04, -0.02, 0.0, 0.02, 0.04]).all(|(a, b): (&Real, Real)| (a - b).abs() < 1e-3),
            "{crests:?}"
        );
    }
}
