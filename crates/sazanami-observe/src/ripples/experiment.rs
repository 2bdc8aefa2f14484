//! Profiles of a run against profiles read from an experiment.

use sazanami_numerics::Real;

use super::bed_forms::extent;
use super::{BedFormSettings, BedForms, CrestedRipples, Reach, Sides, SurfaceProfile, Unmeasured};

/// Distance of the places at which two profiles are compared \[m].
const SPACING: Real = 1e-3;
/// Shifts in x1 are tried in such steps \[m].
const SHIFT_STEP: Real = 0.05e-3;
/// Least number of places to compare at.
const LEAST_PLACES: usize = 3;

/// Largest shifts of a measured profile as a whole before it is compared, because its origin is known to that accuracy
/// only.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ShiftLimits {
    /// Largest shift in x1 to either side \[m]; 0 if the experiment declares none.
    pub x: Real,
    /// Largest shift in x3 to either side \[m]; 0 if the experiment declares none.
    pub z: Real,
}

/// A profile of a run held against a measured one.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ProfileMatch {
    /// Shift of the measured profile towards larger x1 \[m].
    pub shift_x: Real,
    /// Shift upwards \[m].
    pub shift_z: Real,
    /// Whether the shifts in x1 and x3 are as large as they may be: a better one may lie beyond.
    pub at_limit: [bool; 2],
    /// Mean height of the run less the measured one before the shift in x3 \[m].
    pub offset: Real,
    /// The part of x1 that was compared \[m].
    pub range: [Real; 2],
    /// Number of places compared, 1 mm apart.
    pub places: usize,
    /// Root mean square of the difference of the heights after the shifts \[m].
    pub rmse: Real,
    /// Correlation of the heights; `None` where one of the profiles is level.
    pub correlation: Option<Real>,
    /// Highest minus lowest height of the run \[m].
    pub extent: Real,
    /// Highest minus lowest height measured \[m].
    pub measured_extent: Real,
}

impl ProfileMatch {
    /// Ratio of highest minus lowest, run over experiment: the ratio of wave heights for profiles of the water surface.
    #[must_use]
    pub fn extent_ratio(&self) -> Option<Real> {
        (self.measured_extent > 0.0).then(|| self.extent / self.measured_extent)
    }
}

/// Heights of both profiles at the places compared.
struct Pair {
    range: [Real; 2],
    run: Vec<Real>,
    measured: Vec<Real>,
}

/// Holds a profile of a run against measured points `(x1, x3)` \[m] in the order of x1, over the part of x1 that both
/// cover for every shift allowed. The shift in x1 is the one of least difference, the smaller of two as good.
///
/// # Errors
/// If the profiles have fewer than three places, 1 mm apart, in common, or a gap among them.
pub fn match_profiles(
    run: &SurfaceProfile,
    measured: &[[Real; 2]],
    limits: ShiftLimits,
) -> Result<ProfileMatch, Unmeasured> {
    Ok(best_match(run, measured, limits)?.0)
}

fn best_match(
    run: &SurfaceProfile,
    measured: &[[Real; 2]],
    limits: ShiftLimits,
) -> Result<(ProfileMatch, Pair), Unmeasured> {
    let mut best: Option<(ProfileMatch, Pair)> = None;
    let steps = (limits.x.max(0.0) / SHIFT_STEP + 1e-9).floor() as i32;
    // From no shift outwards, so that the smaller shift is kept.
    let tried = (0..=steps).flat_map(|n| if n == 0 { vec![0] } else { vec![n, -n] });
    for shift in tried.map(|n| Real::from(n) * SHIFT_STEP) {
        let pair = pair(run, measured, limits.x.max(0.0), shift)?;
        let found = compare(&pair, shift, [Real::from(steps) * SHIFT_STEP, limits.z.abs()]);
        if best.as_ref().is_none_or(|(known, _)| found.rmse < known.rmse * (1.0 - 1e-9)) {
            best = Some((found, pair));
        }
    }
    best.ok_or(Unmeasured::TooFewValues { found: 0, needed: LEAST_PLACES })
}

/// The heights of both, the measured profile moved by `shift`, at places where there are both for all shifts to
/// `reach`.
fn pair(run: &SurfaceProfile, measured: &[[Real; 2]], reach: Real, shift: Real) -> Result<Pair, Unmeasured> {
    let too_few = |found| Unmeasured::TooFewValues { found, needed: LEAST_PLACES };
    let (Some(first), Some(last)) = (measured.first(), measured.last()) else { return Err(too_few(0)) };
    let covered = run.range();
    let range = [covered[0].max(first[0] + reach), covered[1].min(last[0] - reach)];
    let heights = run.resampled(range, SPACING);
    if heights.len() < LEAST_PLACES {
        return Err(too_few(heights.len()));
    }
    let run = heights.whole()?;
    let measured = (0..heights.len()).map(|n| between(measured, heights.x(n) - shift)).collect();
    Ok(Pair { range: heights.range(), run, measured })
}

/// Height at `x` between points in order; that of the nearest point beyond them.
fn between(points: &[[Real; 2]], x: Real) -> Real {
    let after = points.partition_point(|point| point[0] < x);
    match (after.checked_sub(1).map(|n| points[n]), points.get(after)) {
        (Some(a), Some(b)) => a[1] + (b[1] - a[1]) * (x - a[0]) / (b[0] - a[0]),
        (Some(only), None) => only[1],
        (None, Some(only)) => only[1],
        (None, None) => 0.0,
    }
}

/// Compares heights after a shift in x1 and the best one in x3; the `limits` of both are not negative \[m].
fn compare(pair: &Pair, shift_x: Real, limits: [Real; 2]) -> ProfileMatch {
    let Pair { range, run, measured } = pair;
    let count = run.len() as Real;
    let mean = |values: &[Real]| values.iter().sum::<Real>() / count;
    let (run_mean, measured_mean) = (mean(run), mean(measured));
    let offset = run_mean - measured_mean;
    let shift_z = offset.clamp(-limits[1], limits[1]);
    let is_at = |shift: Real, limit: Real| limit > 0.0 && shift.abs() >= limit * (1.0 - 1e-9);
    let about = |a: &[Real], a_mean: Real, b: &[Real], b_mean: Real| -> Real {
        a.iter().zip(b).map(|(a, b)| (a - a_mean) * (b - b_mean)).sum()
    };
    let (own, other) = (about(run, run_mean, run, run_mean), about(measured, measured_mean, measured, measured_mean));
    let squares: Real = run.iter().zip(measured).map(|(a, b)| (a - b - shift_z).powi(2)).sum();
    // Differences of equal heights are not always zero to the bit.
    let level = 1e-18 * count;
    let is_level = own <= level || other <= level;
    ProfileMatch {
        shift_x,
        shift_z,
        at_limit: [is_at(shift_x, limits[0]), is_at(shift_z, limits[1])],
        offset,
        range: *range,
        places: run.len(),
        rmse: (squares / count).sqrt(),
        correlation: (!is_level).then(|| about(run, run_mean, measured, measured_mean) / (own * other).sqrt()),
        extent: extent(run),
        measured_extent: extent(measured),
    }
}

/// A bed of a run held against a measured one.
#[derive(Clone, Debug, PartialEq)]
pub struct BedMatch {
    /// The profiles as they are.
    pub profiles: ProfileMatch,
    /// Ripples of the run at the places compared.
    pub run: Result<CrestedRipples, Unmeasured>,
    /// Ripples measured, at the same places.
    pub measured: Result<CrestedRipples, Unmeasured>,
    /// Part of the measured crests that have a crest of the run within a quarter of the measured wavelength; about one
    /// half by chance. `None` without ripples.
    pub crests_agree: Option<Real>,
}

impl BedMatch {
    /// Root mean square difference over the measured height of ripples.
    #[must_use]
    pub fn relative_rmse(&self) -> Option<Real> {
        self.measured.as_ref().ok().map(|measured| self.profiles.rmse / measured.height)
    }

    /// Ratio of a measure of the ripples, run over experiment.
    #[must_use]
    pub fn ratio(&self, of: fn(&CrestedRipples) -> Real) -> Option<Real> {
        Some(of(self.run.as_ref().ok()?) / of(self.measured.as_ref().ok()?))
    }
}

/// Holds a bed of a run against measured points `(x1, x3)` \[m], and their ripples against each other, at the places
/// that both cover.
///
/// A shift of half a measured wavelength is the largest that means something; a larger one that is allowed is cut to
/// that.
///
/// # Errors
/// As [`match_profiles`].
pub fn match_bed(
    run: &SurfaceProfile,
    measured: &[[Real; 2]],
    limits: ShiftLimits,
    settings: &BedFormSettings,
) -> Result<BedMatch, Unmeasured> {
    let ripples = |pair: &Pair, heights: &[Real]| {
        let profile = SurfaceProfile::complete(pair.range[0], SPACING, heights.iter().copied());
        BedForms::of(&profile, Reach { range: profile.range(), ends: Sides::Walls }, settings).ripples
    };
    let unmoved = pair(run, measured, 0.0, 0.0)?;
    let half_wave = ripples(&unmoved, &unmoved.measured).map_or(Real::INFINITY, |found| 0.5 * found.wavelength);
    let (profiles, pair) = best_match(run, measured, ShiftLimits { x: limits.x.min(half_wave), ..limits })?;
    let (run, measured) = (ripples(&pair, &pair.run), ripples(&pair, &pair.measured));
    let crests_agree = match (&run, &measured) {
        (Ok(run), Ok(measured)) => agreement(&run.crests, &measured.crests, measured.wavelength / 4.0),
        _ => None,
    };
    Ok(BedMatch { profiles, run, measured, crests_agree })
}

/// Part of the `measured` places that have one of `found` within `reach`.
fn agreement(found: &[Real], measured: &[Real], reach: Real) -> Option<Real> {
    let has_near = |place: &&Real| found.iter().any(|other| (other - **place).abs() <= reach);
    (!measured.is_empty()).then(|| measured.iter().filter(has_near).count() as Real / measured.len() as Real)
}

#[cfg(test)]
mod tests {
    use std::f64::consts::TAU;

    use super::super::made_up::profile;
    use super::*;

    const HEIGHT: fn(&CrestedRipples) -> Real = |ripples| ripples.height;
    const LENGTH: fn(&CrestedRipples) -> Real = |ripples| ripples.wavelength;

    /// Ripples that are not the same a wavelength on.
    fn ripples(x: Real, height: Real) -> Real {
        0.010 + 0.5 * height * ((TAU * x / 20e-3).sin() + 0.3 * (TAU * x / 33e-3).sin())
    }

    /// Uneven readings.
    fn readings(height: impl Fn(Real) -> Real) -> Vec<[Real; 2]> {
        let places = (0..170).map(|n| -0.06 + 0.7e-3 * f64::from(n) + 0.2e-3 * f64::from(n % 3));
        places.filter(|x| *x < 0.06).map(|x| [x, height(x)]).collect()
    }

    fn settings() -> BedFormSettings {
        BedFormSettings::of_grains(1e-3)
    }

    #[test]
    fn the_same_bed_matches_and_another_does_not() {
        let run = profile(|x| ripples(x, 3e-3));
        let same =
            match_bed(&run, &readings(|x| ripples(x, 3e-3)), ShiftLimits::default(), &settings()).expect("a match");
        assert!((same.profiles.shift_x, same.profiles.shift_z.abs() < 1e-5) == (0.0, true));
        assert!(same.profiles.rmse < 0.03e-3 && same.profiles.correlation.expect("ripples") > 0.999, "{same:?}");
        assert!((same.ratio(HEIGHT).expect("ripples") - 1.0).abs() < 0.02 && same.crests_agree == Some(1.0));
        assert!((same.ratio(LENGTH).expect("ripples") - 1.0).abs() < 0.02);
        assert!(same.relative_rmse().expect("ripples") < 0.02 && same.profiles.places >= 115);
        // Upside down: the control.
        let other =
            match_bed(&run, &readings(|x| ripples(x, -3e-3)), ShiftLimits::default(), &settings()).expect("a match");
        assert!(other.profiles.correlation.expect("ripples") < -0.99 && other.crests_agree == Some(0.0), "{other:?}");
    }

    #[test]
    fn shifts_are_found_within_their_limits_only() {
        let run = profile(|x| ripples(x, 3e-3));
        let moved = readings(|x| ripples(x + 2.3e-3, 3e-3) - 1.1e-3);
        let found = |x: Real, z: Real| match_profiles(&run, &moved, ShiftLimits { x, z }).expect("a match");
        let free = found(5e-3, 5e-3);
        assert!((free.shift_x - 2.3e-3).abs() < 0.06e-3 && (free.shift_z - 1.1e-3).abs() < 0.03e-3, "{free:?}");
        assert!(free.rmse < 0.05e-3 && free.at_limit == [false; 2]);
        let none = found(0.0, 0.0);
        assert!((none.shift_x, none.shift_z, none.at_limit) == (0.0, 0.0, [false; 2]) && none.rmse > 0.5e-3);
        assert!((none.offset - 1.1e-3).abs() < 0.1e-3, "{none:?}");
        let little = found(1e-3, 0.4e-3);
        assert_eq!(little.at_limit, [true; 2]);
        assert!((little.shift_x - 1e-3).abs() < 1e-9 && (little.shift_z - 0.4e-3).abs() < 1e-12);
        // Half a wavelength is the most that a bed is moved.
        let bed = match_bed(&run, &moved, ShiftLimits { x: 40e-3, z: 40e-3 }, &settings()).expect("a match");
        assert!((bed.profiles.shift_x - 2.3e-3).abs() < 0.06e-3 && bed.profiles.places > 90, "{bed:?}");
    }

    #[test]
    fn gentler_and_longer_ripples_have_their_ratios() {
        let run = profile(|x| 0.010 + 0.9e-3 * (TAU * x / 24e-3).sin());
        let measured = readings(|x| 0.010 + 1.5e-3 * (TAU * x / 20e-3).sin());
        let found = match_bed(&run, &measured, ShiftLimits::default(), &settings()).expect("a match");
        assert!((found.ratio(HEIGHT).expect("ripples") - 0.6).abs() < 0.03, "{:?}", found.ratio(HEIGHT));
        assert!((found.ratio(LENGTH).expect("ripples") - 1.2).abs() < 0.04, "{:?}", found.ratio(LENGTH));
        let level = match_bed(&run, &readings(|_| 0.010), ShiftLimits::default(), &settings()).expect("a match");
        assert_eq!((level.ratio(HEIGHT), level.crests_agree, level.profiles.correlation), (None, None, None));
        assert!(matches!(level.measured, Err(Unmeasured::TooFewCrests { .. })));
    }

    #[test]
    fn wave_heights_have_a_ratio() {
        let water = |height: Real| move |x: Real| 0.020 + 0.5 * height * (TAU * x / 0.15).sin();
        let found =
            match_profiles(&profile(water(8e-3)), &readings(water(10e-3)), ShiftLimits::default()).expect("a match");
        assert!((found.extent_ratio().expect("waves") - 0.8).abs() < 0.01);
    }

    #[test]
    fn profiles_apart_are_not_compared() {
        let run = profile(|x| ripples(x, 3e-3));
        let far = [[0.5, 0.0], [0.6, 0.0], [0.7, 0.0]];
        assert!(matches!(
            match_profiles(&run, &far, ShiftLimits::default()),
            Err(Unmeasured::TooFewValues { found: 0, .. })
        ));
        assert!(match_profiles(&run, &[], ShiftLimits::default()).is_err());
        let mut broken = run.clone();
        broken.heights[150] = None;
        let measured = readings(|x| ripples(x, 3e-3));
        assert!(matches!(match_profiles(&broken, &measured, ShiftLimits::default()), Err(Unmeasured::Gap { .. })));
    }
}
