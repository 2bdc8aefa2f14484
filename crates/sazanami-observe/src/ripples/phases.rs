//! Averages over cycles of a periodic forcing.

use sazanami_numerics::Real;

use super::Unmeasured;

/// Mean cycle of a series.
#[derive(Clone, Debug, PartialEq)]
pub struct PhaseAverage {
    /// Means at the phases `n / len`, in parts of the period.
    pub mean: Vec<Real>,
    /// Standard deviation of a cycle about these means, in the unit of the series; none of a single one.
    pub deviation: Vec<Option<Real>>,
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

/// Averages values at times \[s] over the last `cycles` of a `period` \[s], at `phases` phases of the cycle, between rows linear between
/// them; phase zero is at time zero.
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
    // Values at the phases of each cycle, between the rows before and after.
    let mut rows: Vec<(Real, Real)> =
        series.iter().map(|&(time, value)| (time / period * phases as Real, value)).collect();
    rows.sort_by(|a, b| a.0.total_cmp(&b.0));
    let end = (last * phases as Real + ROUNDED).floor() as i64;
    let mut values: Vec<Vec<Real>> = vec![Vec::new(); phases];
    for place in end - (cycles * phases) as i64 + 1..=end {
        if let Some(value) = between(&rows, place as Real) {
            values[place.rem_euclid(phases as i64) as usize].push(value);
        }
    }
    if let Some(missing) = values.iter().position(Vec::is_empty) {
        return Err(Unmeasured::PhaseMissing { phase: missing as Real / phases as Real });
    }
    let mean_of = |values: &Vec<Real>| values.iter().sum::<Real>() / values.len() as Real;
    let mean: Vec<Real> = values.iter().map(mean_of).collect();
    let deviation = values.iter().zip(&mean).map(|(values, mean)| {
        let squares: Real = values.iter().map(|value| (value - mean).powi(2)).sum();
        (values.len() > 1).then(|| (squares / (values.len() as Real - 1.0)).sqrt())
    });
    Ok(PhaseAverage { deviation: deviation.collect(), mean, cycles })
}

/// Rounding of places in a cycle, in parts of the distance of phases.
const ROUNDED: Real = 1e-6;

/// Value at `place` between the rows beside it, if these are no farther apart than two phases are.
fn between(rows: &[(Real, Real)], place: Real) -> Option<Real> {
    let after = rows.partition_point(|row| row.0 < place - ROUNDED);
    let &(to, value) = rows.get(after)?;
    if to <= place + ROUNDED {
        return Some(value);
    }
    let &(from, before) = rows.get(after.checked_sub(1)?)?;
    (to - from <= 2.0 + ROUNDED).then(|| before + (value - before) * (place - from) / (to - from))
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
        assert!(found.deviation.iter().all(|d| d.is_some_and(|d| d < 1e-6)) && found.mean.len() == 20);
        // With the first cycles in, the mean is another: the control.
        let all = phase_average(&series(7.0), PERIOD, 14, 20).expect("14 cycles");
        assert!(mean_of_cycle(&all) > 10.0 && all.deviation.iter().all(|d| d.is_some_and(|d| d > 10.0)));
    }

    #[test]
    fn rows_that_fall_between_phases_add_nothing_to_the_scatter() {
        // 25 rows a cycle for 20 phases, cycles that differ by a level of one; 18 rows, and rows that are not even, have a value for each too.
        for (count, uneven) in [(18, 0.0), (20, 0.1)] {
            let time = |n: i32| PERIOD * (f64::from(n) + uneven * f64::from(n % 2)) / f64::from(count);
            let rows: Vec<(Real, Real)> = (0..=10 * count).map(time).map(|t| (t, (TAU * t / PERIOD).sin())).collect();
            let found = phase_average(&rows, PERIOD, 4, 20).expect("ten cycles");
            assert!(found.deviation.iter().all(|d| d.is_some_and(|d| d < 1e-2)), "{count}: {found:?}");
        }
        let rows = (0..=250).map(|n| PERIOD * f64::from(n) / 25.0);
        let of = |level: fn(Real) -> Real| -> Vec<(Real, Real)> {
            rows.clone().map(|t| (t, level(t / PERIOD) + (TAU * t / PERIOD).sin())).collect()
        };
        let same = phase_average(&of(|_| 0.0), PERIOD, 4, 20).expect("ten cycles");
        assert!(same.deviation.iter().all(|d| d.is_some_and(|d| d < 1e-9)), "{same:?}");
        // Within the error of a chord.
        let off = |(n, mean): (usize, &Real)| (mean - (TAU * n as Real / 20.0).sin()).abs();
        assert!(same.mean.iter().enumerate().map(off).fold(0.0, Real::max) < 1e-2, "{same:?}");
        // A level of 0, 1, 2, 3 in the last four cycles has a deviation of the root of 5/3.
        let rising = phase_average(&of(|cycle| (cycle - 1e-9).floor() - 6.0), PERIOD, 4, 20).expect("ten cycles");
        assert!((rising.deviation[10].expect("four cycles") - (5.0_f64 / 3.0).sqrt()).abs() < 1e-9, "{rising:?}");
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
