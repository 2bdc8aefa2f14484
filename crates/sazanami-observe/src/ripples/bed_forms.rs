//! Forms of a bed: the mound of the tank's wave, and ripples on it.
//!
//! A standing wave heaps sand under the antinodes of its velocity, beneath the nodes of its surface. Such a mound has harmonics as short as ripples, so that a spectrum in a
//! band of wavelengths measures the mound. The two are told apart: the mound by the highest peak of the whole spectrum,
//! ripples by crests of at least a grain's size in what is left without waves longer than ripples can be, where the flow is
//! strong enough for them.

use sazanami_numerics::Real;

use super::predictors::{LEAST_MOBILITY, LONGEST_OVER_AMPLITUDE};
use super::smoothing::{smoothed, smoothed_around};
use super::trend::{detrended, highest_harmonic, length_of_peak, without_line, without_mean};
use super::{Reach, Sides, SurfaceProfile, Unmeasured};
use crate::fit::vertex;

/// Wavelength that grains make by themselves, over their size: waves that short are smoothed away.
const SHORTEST: Real = 5.0;
/// Longest ripples where nothing is known of the flow \[m].
const LONGEST: Real = 60e-3;
/// Part of the longest ripples at each end of a profile that a mound is not read from.
const ENDS: Real = 0.25;

/// Relief of a bed: root mean square of the part of its profile within `reach` about its parabola of least squares, or about its
/// mean where the ends are joined: a wave that such a bed has once is no trend. All wavelengths \[m].
///
/// # Errors
/// If the part has gaps or fewer than four places.
pub fn relief(profile: &SurfaceProfile, reach: Reach) -> Result<Real, Unmeasured> {
    let values = profile.within(reach.range).whole()?;
    if values.len() < 4 {
        return Err(Unmeasured::TooFewValues { found: values.len(), needed: 4 });
    }
    let rest = match reach.ends {
        Sides::Walls => detrended(&values),
        Sides::Periodic => without_mean(&values),
    };
    Ok((rest.iter().map(|z| z * z).sum::<Real>() / values.len() as Real).sqrt())
}

/// Settings that tell mound and ripples apart.
#[derive(Clone, Debug, PartialEq)]
pub struct BedFormSettings {
    /// Grain size: the least height of a mound and of a crest \[m].
    pub grain_size: Real,
    /// Wavelength that is halved at the long end of ripples \[m].
    pub longest: Real,
    /// Parts of x1 where the flow is strong enough for ripples \[m]; `None` where the flow is not known.
    pub mobile: Option<Vec<[Real; 2]>>,
}

impl BedFormSettings {
    /// For a flow that is not known: waves of up to 60 mm anywhere.
    #[must_use]
    pub fn of_grains(grain_size: Real) -> Self {
        Self { grain_size, longest: LONGEST, mobile: None }
    }

    /// For an orbital amplitude \[m] and the parts of x1 where the mobility number is large enough \[m].
    #[must_use]
    pub fn under(grain_size: Real, amplitude: Real, mobile: Vec<[Real; 2]>) -> Self {
        let longest = (LONGEST_OVER_AMPLITUDE * amplitude).max(2.0 * SHORTEST * grain_size);
        Self { grain_size, longest, mobile: Some(mobile) }
    }

    /// Whether ripples are allowed on the whole profile.
    fn covers(&self, profile: &SurfaceProfile) -> bool {
        let [first, last] = profile.range();
        self.mobile.as_ref().is_none_or(|parts| parts.iter().any(|part| part[0] <= first && last <= part[1]))
    }

    fn allows(&self, x: Real) -> Option<usize> {
        match &self.mobile {
            None => Some(0),
            Some(parts) => parts.iter().position(|part| part[0] <= x && x <= part[1]),
        }
    }
}

/// The largest form of a bed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Mound {
    /// Wavelength of the highest peak of the spectrum \[m].
    pub wavelength: Real,
    /// Highest less lowest place without the waves of ripples \[m].
    pub height: Real,
    /// The highest place \[m].
    pub crest: Real,
}

/// Ripples by their crests.
#[derive(Clone, Debug, PartialEq)]
pub struct CrestedRipples {
    /// Places of the crests \[m].
    pub crests: Vec<Real>,
    /// Mean distance of neighbouring crests \[m].
    pub wavelength: Real,
    /// Standard error of that mean, from the scatter of the distances \[m]; `None` with one distance, and where they go round a
    /// box that is periodic: then the mean is its length over the number of crests.
    pub uncertainty: Option<Real>,
    /// Mean height of the crests above the troughs on both sides \[m].
    pub height: Real,
}

/// Mound and ripples of a bed, told apart.
#[derive(Clone, Debug, PartialEq)]
pub struct BedForms {
    /// The mound, or why there is none.
    pub mound: Result<Mound, Unmeasured>,
    /// The ripples, or why there are none.
    pub ripples: Result<CrestedRipples, Unmeasured>,
}

impl BedForms {
    /// Looks at the part of a profile within `reach`.
    #[must_use]
    pub fn of(profile: &SurfaceProfile, reach: Reach, settings: &BedFormSettings) -> Self {
        let part = profile.within(reach.range);
        let shortest = SHORTEST * settings.grain_size;
        let length = part.len() as Real * part.spacing;
        let values = part.whole().and_then(|values| {
            if length < 2.0 * shortest {
                Err(Unmeasured::TooShort { length, needed: 2.0 * shortest })
            } else {
                Ok(values)
            }
        });
        let values = match values {
            Ok(values) => values,
            Err(problem) => return Self { mound: Err(problem), ripples: Err(problem) },
        };
        let values = match reach.ends {
            Sides::Walls => without_line(&values),
            Sides::Periodic => without_mean(&values),
        };
        let smooth = |half: Real| match reach.ends {
            Sides::Walls => smoothed(&values, part.spacing, half),
            Sides::Periodic => smoothed_around(&values, part.spacing, half),
        };
        let (long, short) = (smooth(settings.longest), smooth(shortest));
        let waves: Vec<Real> = short.iter().zip(&long).map(|(short, long)| short - long).collect();
        Self {
            mound: mound(&part, reach.ends, &values, &long, settings),
            ripples: ripples(&part, reach.ends, &waves, settings),
        }
    }
}

fn mound(
    part: &SurfaceProfile,
    ends: Sides,
    values: &[Real],
    long: &[Real],
    settings: &BedFormSettings,
) -> Result<Mound, Unmeasured> {
    // Parabolas at the ends of a tank have neighbours on one side only and follow ripples there.
    let left_out = match ends {
        Sides::Walls => ((ENDS * settings.longest / part.spacing) as usize).min(long.len() / 8),
        Sides::Periodic => 0,
    };
    let (mut low, mut high) = (left_out, left_out);
    for (n, value) in long.iter().enumerate().take(long.len() - left_out).skip(left_out) {
        low = if *value < long[low] { n } else { low };
        high = if *value > long[high] { n } else { high };
    }
    let (height, least) = (long[high] - long[low], settings.grain_size);
    if height < least {
        return Err(Unmeasured::Level { height, least });
    }
    let wavelength = match ends {
        Sides::Walls => length_of_peak(values, part.spacing, settings.longest),
        Sides::Periodic => highest_harmonic(values, part.spacing, settings.longest),
    };
    let wavelength = wavelength.ok_or(Unmeasured::Level { height: 0.0, least })?;
    Ok(Mound { wavelength, height, crest: part.x(high) })
}

fn ripples(
    part: &SurfaceProfile,
    ends: Sides,
    waves: &[Real],
    settings: &BedFormSettings,
) -> Result<CrestedRipples, Unmeasured> {
    if settings.mobile.as_ref().is_some_and(Vec::is_empty) {
        return Err(Unmeasured::Immobile { least: LEAST_MOBILITY });
    }
    let count = waves.len();
    let found = match ends {
        Sides::Walls => crests(waves, settings.grain_size),
        // Crests of the middle one of three periods.
        Sides::Periodic => crests(&waves.repeat(3), settings.grain_size)
            .into_iter()
            .filter(|(n, _)| (count..2 * count).contains(n))
            .map(|(n, height)| (n - count, height))
            .collect(),
    };
    let place = |n: usize| {
        // A crest between end walls is never the first or the last place.
        let shift = vertex(waves[(n + count - 1) % count], waves[n], waves[(n + 1) % count]);
        part.x(n) + shift.map_or(0.0, |(shift, _)| shift) * part.spacing
    };
    let mut allowed: Vec<(usize, Real, Real)> = found
        .into_iter()
        .filter_map(|(n, height)| settings.allows(place(n)).map(|zone| (zone, place(n), height)))
        .collect();
    let crests = allowed.len();
    // Behind the last crest of a bed that goes on comes its first, where the flow allows ripples on all the way.
    if let (Sides::Periodic, Some(&(zone, x, height))) = (ends, allowed.first())
        && settings.covers(part)
    {
        allowed.push((zone, x + count as Real * part.spacing, height));
    }
    // What is left of bars by the filter stands further apart than ripples do.
    let distances: Vec<Real> = allowed
        .windows(2)
        .filter(|pair| pair[0].0 == pair[1].0)
        .map(|pair| pair[1].1 - pair[0].1)
        .filter(|distance| *distance <= settings.longest)
        .collect();
    if distances.is_empty() {
        let highest = extent(waves);
        return Err(Unmeasured::TooFewCrests { found: crests, least: settings.grain_size, highest });
    }
    allowed.truncate(crests);
    let count = distances.len() as Real;
    let wavelength = distances.iter().sum::<Real>() / count;
    let squares: Real = distances.iter().map(|distance| (distance - wavelength).powi(2)).sum();
    Ok(CrestedRipples {
        wavelength,
        // Round a whole period the distances add up to it, whatever their scatter.
        uncertainty: (distances.len() > 1 && !(ends == Sides::Periodic && distances.len() == crests))
            .then(|| (squares / (count - 1.0) / count).sqrt()),
        height: allowed.iter().map(|crest| crest.2).sum::<Real>() / allowed.len() as Real,
        crests: allowed.into_iter().map(|crest| crest.1).collect(),
    })
}

/// Highest less lowest value.
pub(super) fn extent(values: &[Real]) -> Real {
    let [low, high] = values.iter().fold([Real::MAX, Real::MIN], |[low, high], &v| [low.min(v), high.max(v)]);
    high - low
}

/// Crests that rise by at least `least` \[m] from the trough before and fall as much to the one behind: number of the
/// value, and its height above the mean of both troughs.
fn crests(values: &[Real], least: Real) -> Vec<(usize, Real)> {
    let mut tops = Vec::new();
    let (mut low, mut high) = (0, 0);
    let mut rising: Option<bool> = None;
    for (n, &value) in values.iter().enumerate() {
        high = if value > values[high] { n } else { high };
        low = if value < values[low] { n } else { low };
        if rising != Some(false) && value <= values[high] - least {
            if rising == Some(true) {
                tops.push(high);
            }
            (rising, low) = (Some(false), n);
        } else if rising != Some(true) && value >= values[low] + least {
            (rising, high) = (Some(true), n);
        }
    }
    let lowest = |from: usize, to: usize| values[from..to].iter().copied().fold(Real::INFINITY, Real::min);
    (0..tops.len())
        .map(|n| {
            let before = n.checked_sub(1).map_or(0, |before| tops[before]);
            let behind = tops.get(n + 1).map_or(values.len(), |next| *next);
            (tops[n], values[tops[n]] - 0.5 * (lowest(before, tops[n]) + lowest(tops[n], behind)))
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use std::f64::consts::TAU;

    use super::super::made_up::profile;
    use super::*;

    const D: Real = 1e-3;
    const RANGE: [Real; 2] = [-0.065, 0.065];
    const INSIDE: Reach = Reach { range: RANGE, ends: Sides::Walls };

    /// As under the wave of a tank of 150 mm: an orbital amplitude of 20 mm, grains move over 60 mm in the middle.
    fn settings() -> BedFormSettings {
        BedFormSettings::under(D, 20e-3, vec![[-30e-3, 30e-3]])
    }

    /// A mound 3.6 mm high with two troughs scoured 43 mm from its middle.
    fn mound_at(x: Real) -> Real {
        let u = x / 25e-3;
        3.6e-3 / 1.446 * (1.0 - u * u) * (-0.5 * u * u).exp()
    }

    /// Roughness of a level bed of grains.
    fn rough_at(x: Real) -> Real {
        0.1e-3 * ((TAU * x / 2.3e-3).sin() + (TAU * x / 9.1e-3 + 1.0).sin())
    }

    fn ripple_at(x: Real) -> Real {
        1.25e-3 * (TAU * x / 25e-3).cos()
    }

    #[test]
    fn a_mound_alone_has_no_ripples() {
        let bed = profile(|x| 0.01 + mound_at(x) + rough_at(x));
        let found = BedForms::of(&bed, INSIDE, &settings());
        let mound = found.mound.expect("a mound");
        assert!((mound.wavelength / 87e-3 - 1.0).abs() < 0.2, "{mound:?}");
        assert!((mound.height / 3.6e-3 - 1.0).abs() < 0.15 && mound.crest.abs() < 3e-3, "{mound:?}");
        assert!(matches!(found.ripples, Err(Unmeasured::TooFewCrests { found: 0, highest, .. }) if highest < D));
        // With the long waves left in, the mound is a crest.
        let kept = BedFormSettings { longest: 1.0, ..settings() };
        assert!(matches!(BedForms::of(&bed, INSIDE, &kept).ripples, Err(Unmeasured::TooFewCrests { found: 1, .. })));
    }

    #[test]
    fn ripples_on_a_mound_are_told_from_it() {
        let bed = profile(|x| 0.01 + mound_at(x) + rough_at(x) + ripple_at(x));
        let found = BedForms::of(&bed, INSIDE, &settings());
        let ripples = found.ripples.expect("ripples");
        assert_eq!(ripples.crests.len(), 3, "{ripples:?}");
        assert!((ripples.wavelength / 25e-3 - 1.0).abs() < 0.05, "{ripples:?}");
        assert!(ripples.uncertainty.is_some_and(|error| error < 1e-3), "{ripples:?}");
        assert!((ripples.height / 2.5e-3 - 1.0).abs() < 0.1, "{ripples:?}");
        let mound = found.mound.expect("a mound");
        assert!(
            (mound.wavelength / 87e-3 - 1.0).abs() < 0.2 && (mound.height / 3.6e-3 - 1.0).abs() < 0.15,
            "{mound:?}"
        );
    }

    #[test]
    fn long_bars_are_no_ripples() {
        let x = |n: u32| -0.15 + 0.5e-3 * f64::from(n);
        let bars = |x: Real| 0.02 + 3.5e-3 * (TAU * x / 87e-3).cos();
        let bed = SurfaceProfile::complete(x(0), 0.5e-3, (0..600).map(|n| bars(x(n))));
        let wide = Reach { range: [-0.14, 0.14], ends: Sides::Walls };
        let found = BedForms::of(&bed, wide, &BedFormSettings::of_grains(D));
        assert!(matches!(found.ripples, Err(Unmeasured::TooFewCrests { .. })), "{found:?}");
        assert!((found.mound.expect("bars").wavelength / 87e-3 - 1.0).abs() < 0.1);
        // Negative control: without that bound their rests are crests.
        let kept = BedFormSettings { longest: 0.09, ..BedFormSettings::of_grains(D) };
        assert!(BedForms::of(&bed, wide, &kept).ripples.is_ok());
    }

    #[test]
    fn a_low_mound_under_ripples_keeps_its_wavelength() {
        let bed = profile(|x| 0.01 + 0.4 * mound_at(x) + ripple_at(x));
        let found = BedForms::of(&bed, INSIDE, &settings());
        assert!((found.mound.expect("a mound").wavelength / 87e-3 - 1.0).abs() < 0.25);
    }

    #[test]
    fn a_flat_bed_has_neither() {
        let bed = profile(|x| 0.01 + 0.02 * x + rough_at(x));
        let found = BedForms::of(&bed, INSIDE, &settings());
        assert!(matches!(found.mound, Err(Unmeasured::Level { height, .. }) if height < 0.2e-3), "{found:?}");
        assert!(matches!(found.ripples, Err(Unmeasured::TooFewCrests { found: 0, .. })), "{found:?}");
    }

    #[test]
    fn ripples_without_a_mound_count_where_grains_move() {
        let bed = profile(|x| 0.01 + rough_at(x) + ripple_at(x));
        let everywhere = BedForms::of(&bed, INSIDE, &BedFormSettings::under(D, 20e-3, vec![RANGE]));
        assert_eq!(everywhere.ripples.expect("ripples").crests.len(), 5);
        assert!(everywhere.mound.is_err());
        assert_eq!(BedForms::of(&bed, INSIDE, &settings()).ripples.expect("ripples").crests.len(), 3);
        let unknown = BedForms::of(&bed, INSIDE, &BedFormSettings::of_grains(D));
        assert_eq!(unknown.ripples.expect("ripples").crests.len(), 5);
        let still = BedForms::of(&bed, INSIDE, &BedFormSettings::under(D, 20e-3, Vec::new()));
        assert_eq!(still.ripples, Err(Unmeasured::Immobile { least: LEAST_MOBILITY }));
        // Crests of two zones have no distance from one another.
        let apart = BedFormSettings::under(D, 20e-3, vec![[-30e-3, -10e-3], [10e-3, 30e-3]]);
        assert!(matches!(BedForms::of(&bed, INSIDE, &apart).ripples, Err(Unmeasured::TooFewCrests { found: 2, .. })));
        // Half a grain high they are none.
        let low = profile(|x| 0.01 + 0.2 * ripple_at(x));
        assert!(BedForms::of(&low, INSIDE, &settings()).ripples.is_err());
        let mut broken = bed.clone();
        broken.heights[150] = None;
        assert!(matches!(BedForms::of(&broken, INSIDE, &settings()).mound, Err(Unmeasured::Gap { .. })));
    }

    #[test]
    fn a_bed_whose_ends_are_joined_keeps_the_wave_that_it_has_once() {
        // A period of 66 mm, its crest moved round the seam.
        let around = |number: Real, crest: Real| {
            let x = |n: u32| -32.75e-3 + 0.5e-3 * f64::from(n);
            let z = |x: Real| 0.01 + 3e-3 * (TAU * number * (x - crest) / 66e-3).cos();
            SurfaceProfile::complete(x(0), 0.5e-3, (0..132).map(|n| z(x(n))))
        };
        let joined = Reach { range: [-33e-3, 33e-3], ends: Sides::Periodic };
        let walls = Reach { ends: Sides::Walls, ..joined };
        let settings = BedFormSettings::under(D, 60e-3, vec![joined.range]);
        for crest in [0.0, 14.2e-3, 33e-3] {
            let bed = around(1.0, crest);
            let height = relief(&bed, joined).expect("a relief");
            assert!((height / (3e-3 / Real::sqrt(2.0)) - 1.0).abs() < 1e-9, "{crest}: {height}");
            let found = BedForms::of(&bed, joined, &settings);
            let ripples = found.ripples.expect("a ripple");
            assert!(ripples.crests.len() == 1 && (ripples.wavelength / 66e-3 - 1.0).abs() < 1e-9, "{ripples:?}");
            assert!((ripples.height / 6e-3 - 0.9).abs() < 0.1, "{ripples:?}");
            let off = (ripples.crests[0] - crest).rem_euclid(66e-3);
            assert!(off.min(66e-3 - off) < 0.1e-3, "{crest}: {ripples:?}");
            let three = BedForms::of(&around(3.0, crest), joined, &settings).ripples.expect("ripples");
            assert!(
                three.crests.len() == 3 && three.uncertainty.is_none() && (three.wavelength / 22e-3 - 1.0).abs() < 1e-6,
                "{three:?}"
            );
            // Longer than ripples can be: a mound.
            let mound = BedForms::of(&bed, joined, &BedFormSettings::of_grains(0.2 * D)).mound.expect("a mound");
            assert!((mound.wavelength / 66e-3 - 1.0).abs() < 1e-9, "{mound:?}");
        }
        // Negative control: between end walls a parabola takes most of the wave.
        assert!(relief(&around(1.0, 0.0), walls).is_ok_and(|height| height < 0.6 * 3e-3 / Real::sqrt(2.0)));
        let level = SurfaceProfile::complete(-32.75e-3, 0.5e-3, (0..132).map(|_| 0.01));
        assert!(BedForms::of(&level, joined, &settings).ripples.is_err());
    }

    #[test]
    fn the_wavelength_is_as_sure_as_its_crests_are_even() {
        let everywhere = BedFormSettings::under(D, 20e-3, vec![RANGE]);
        let of = |length: fn(Real) -> Real| {
            let bed = profile(|x| 0.01 + 1.25e-3 * (TAU * x / length(x)).cos());
            BedForms::of(&bed, INSIDE, &everywhere).ripples.expect("ripples")
        };
        let (even, uneven) = (of(|_| 25e-3), of(|x| if x < 0.0 { 20e-3 } else { 25e-3 }));
        assert!(even.uncertainty < Some(0.3e-3), "{even:?}");
        // Crests 20 and 25 mm apart: the control.
        assert!(uneven.uncertainty > Some(0.8e-3) && (uneven.wavelength / 22.5e-3 - 1.0).abs() < 0.1, "{uneven:?}");
    }

    #[test]
    fn a_trend_is_no_relief() {
        let found = |height: Real| {
            let bed = profile(|x| 0.01 + 0.3 * x - 2.0 * x * x + height * (TAU * x / 10e-3).sin());
            relief(&bed, INSIDE).expect("a relief")
        };
        assert!(found(0.0) < 1e-12 && (found(1e-3) * 2.0_f64.sqrt() / 1e-3 - 1.0).abs() < 0.02);
        let mut broken = profile(|_| 0.01);
        broken.heights[150] = None;
        assert!(matches!(relief(&broken, INSIDE), Err(Unmeasured::Gap { .. })));
        let short = Reach { range: [0.0, 1e-3], ..INSIDE };
        assert_eq!(relief(&profile(|_| 0.01), short), Err(Unmeasured::TooFewValues { found: 2, needed: 4 }));
    }
}
