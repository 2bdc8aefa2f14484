//! Averages over cycles of a periodic forcing.

use sazanami_numerics::Real;

use super::Unmeasured;

/// Mean cycle of a series.
#[derive(Clone, Debug, PartialEq)]
pub struct PhaseAverage {
    /// Means at the phases `n / len`, in parts of the period.
    pub mean: Vec<Real>,
    /// Standard deviation of the values about these means, in the unit of the series.
    pub deviation: Vec<Real>,
    /// Number of cycles averaged over.
    pub cycles: usize,
}

impl PhaseAverage {
    /// Half of the way from the lowest to the highest mean.
    #[must_use]
    pub fn half_range(&self) -> Real {
        let highest = self.mean.iter().copied().fold(Real::NEG_INFINITY, Real::max);
        0.5 * (highest - self.mean.iter().copied().fold(Real::INFINITY, Real::min))
    }
}

/// Averages values at times \[s] over the last `cycles` of a `period` \[s], at `phases` phases of the cycle. A value
/// counts for the phase it is nearest to; phase zero is at time zero.
///
/// # Errors
/// If the series lasts fewer cycles, or if a phase has no value.
pub fn phase_average(
    series: &[(Real, Real)],
    period: Real,
    cycles: usize,
    phases: usize,
) -> Result<PhaseAverage, Unmeasured> {
    let last = series.iter().map(|(time, _)| time / period).fold(Real::NEG_INFINITY, Real::max);
    let first = series.iter().map(|(time, _)| time / period).fold(Real::INFINITY, Real::min);
    // A series of one cycle ends one phase before it would begin again.
    let slack = 1.0 / phases.max(1) as Real;
    let found = (last - first).max(0.0);
    if cycles == 0 || phases == 0 || series.is_empty() || found + slack < cycles as Real * (1.0 - 1e-9) {
        return Err(Unmeasured::TooFewCycles { found: if series.is_empty() { 0.0 } else { found }, needed: cycles });
    }
    let mut sums = vec![(0.0, 0.0, 0_u32); phases];
    let recent = |time: &Real| time / period > last - cycles as Real + 1e-6;
    for &(time, value) in series.iter().filter(|(time, _)| recent(time)) {
        let phase = (time / period).rem_euclid(1.0) * phases as Real;
        let sum = &mut sums[phase.round() as usize % phases];
        *sum = (sum.0 + value, sum.1 + value * value, sum.2 + 1);
    }
    if let Some(missing) = sums.iter().position(|sum| sum.2 == 0) {
        return Err(Unmeasured::PhaseMissing { phase: missing as Real / phases as Real });
    }
    let mean: Vec<Real> = sums.iter().map(|(sum, _, count)| sum / Real::from(*count)).collect();
    let spread = sums.iter().zip(&mean).map(|((_, squares, n), mean)| squares / Real::from(*n) - mean * mean);
    Ok(PhaseAverage { deviation: spread.map(|s| s.max(0.0).sqrt()).collect(), mean, cycles })
}

/// Mean over each whole cycle of a `period` \[s] from time zero on: the end of the cycle \[s] and the mean of the values
/// at its times, its beginning left out and its end included. Cycles that the series enters late or leaves early are
/// left out.
#[must_use]
pub fn cycle_averages(series: &[(Real, Real)], period: Real) -> Vec<(Real, Real)> {
    let cycle = |time: Real| (time / period - 1e-6).ceil() as i64;
    let (Some(first), Some(last)) = (series.first(), series.last()) else { return Vec::new() };
    let whole = cycle(first.0) + i64::from(cycle(first.0) as Real * period - first.0 < 0.9 * period && first.0 > 0.0);
    let ended = (last.0 / period + 1e-6).floor() as i64;
    series
        .chunk_by(|a, b| cycle(a.0) == cycle(b.0))
        .filter(|part| cycle(part[0].0) >= whole.max(1) && cycle(part[0].0) <= ended)
        .map(|part| {
            let mean = part.iter().map(|(_, value)| value).sum::<Real>() / part.len() as Real;
            (cycle(part[0].0) as Real * period, mean)
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use std::f64::consts::TAU;

    use super::*;

    const PERIOD: Real = 0.5;

    /// A cycle that settles: the first two seconds are different.
    fn series(end: Real) -> Vec<(Real, Real)> {
        let steps = (end / PERIOD * 20.0).round() as u32;
        let value = |t: Real| if t < 2.0 - 1e-9 { 50.0 } else { 1.0 + 3.0 * (TAU * (t / PERIOD - 0.2)).cos() };
        (0..=steps).map(|n| PERIOD * f64::from(n) / 20.0).map(|t| (t, value(t))).collect()
    }

    #[test]
    fn the_last_cycles_are_averaged() {
        let found = phase_average(&series(7.0), PERIOD, 4, 20).expect("14 cycles");
        let mean_of_cycle = |average: &PhaseAverage| average.mean.iter().sum::<Real>() / average.mean.len() as Real;
        assert!((mean_of_cycle(&found) - 1.0).abs() < 1e-12 && (found.half_range() - 3.0).abs() < 1e-12);
        // The highest value comes a fifth of the cycle in.
        assert!((found.mean[4] - 4.0).abs() < 1e-12, "{found:?}");
        assert!(found.deviation.iter().all(|&d| d < 1e-6) && found.mean.len() == 20);
        // With the first cycles in, the mean is another: the control.
        let all = phase_average(&series(7.0), PERIOD, 14, 20).expect("14 cycles");
        assert!(mean_of_cycle(&all) > 10.0 && all.deviation.iter().all(|&d| d > 10.0));
    }

    #[test]
    fn too_short_or_too_coarse_a_series_says_so() {
        let short = phase_average(&series(1.5), PERIOD, 4, 20);
        assert_eq!(short, Err(Unmeasured::TooFewCycles { found: 3.0, needed: 4 }));
        assert!(matches!(phase_average(&series(7.0), PERIOD, 4, 60), Err(Unmeasured::PhaseMissing { .. })));
        assert!(matches!(phase_average(&[], PERIOD, 4, 20), Err(Unmeasured::TooFewCycles { .. })));
    }

    #[test]
    fn cycles_are_averaged_one_by_one() {
        let averages = cycle_averages(&series(3.6), PERIOD);
        assert_eq!(averages.len(), 7);
        assert!((averages[0].0 - 0.5).abs() < 1e-12 && (averages[6].0 - 3.5).abs() < 1e-12);
        assert!((averages[2].1 - 50.0).abs() < 1e-9 && (averages[5].1 - 1.0).abs() < 1e-9);
        let late: Vec<_> = series(3.0).into_iter().filter(|(t, _)| *t > 0.2).collect();
        assert!((cycle_averages(&late, PERIOD)[0].0 - 1.0).abs() < 1e-12, "the cycle entered late is left out");
        assert!(cycle_averages(&[], PERIOD).is_empty());
    }
}
