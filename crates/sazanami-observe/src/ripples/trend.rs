//! A profile without its trend, and the wavelength of its highest spectral peak.

use std::f64::consts::{PI, TAU};

use sazanami_numerics::Real;

use crate::fit::{Line, line, vertex};

/// Period of the spectrum over the length of the profile.
const PADDING: usize = 4;

/// Takes the parabola of least squares off evenly spaced values.
pub(super) fn detrended(values: &[Real]) -> Vec<Real> {
    let count = values.len();
    let place = |n: usize| n as Real - 0.5 * (count as Real - 1.0);
    let mean_square = (0..count).map(|n| place(n).powi(2)).sum::<Real>() / count as Real;
    // Polynomials orthogonal over the places: the fit of one does not change that of another.
    let polynomials: [&dyn Fn(usize) -> Real; 3] = [&|_| 1.0, &place, &|n| place(n).powi(2) - mean_square];
    let mut rest = values.to_vec();
    for polynomial in polynomials {
        let product: Real = rest.iter().enumerate().map(|(n, value)| value * polynomial(n)).sum();
        let square: Real = (0..count).map(|n| polynomial(n).powi(2)).sum();
        if square > 0.0 {
            rest.iter_mut().enumerate().for_each(|(n, value)| *value -= product / square * polynomial(n));
        }
    }
    rest
}

/// Takes the straight line of least squares off evenly spaced values.
pub(super) fn without_line(values: &[Real]) -> Vec<Real> {
    let points: Vec<(Real, Real)> = values.iter().enumerate().map(|(n, value)| (n as Real, *value)).collect();
    let rest = |(n, value): (Real, Real), line: Line| value - line.intercept - line.slope * n;
    line(&points).map_or_else(|| values.to_vec(), |line| points.iter().map(|point| rest(*point, line)).collect())
}

/// Takes the mean off.
pub(super) fn without_mean(values: &[Real]) -> Vec<Real> {
    let mean = values.iter().sum::<Real>() / values.len().max(1) as Real;
    values.iter().map(|value| value - mean).collect()
}

/// Length \[m] of the highest of the waves that values `spacing` \[m] apart, which repeat, have a whole number of, down to
/// `shortest` \[m]; `None` for values that are all the same.
pub(super) fn highest_harmonic(values: &[Real], spacing: Real, shortest: Real) -> Option<Real> {
    let count = values.len();
    let square = |wave: usize| {
        let of = |function: fn(Real) -> Real| {
            let angle = |n: usize| TAU * (wave * n % count) as Real / count as Real;
            values.iter().enumerate().map(|(n, value)| value * function(angle(n))).sum::<Real>()
        };
        of(Real::sin).powi(2) + of(Real::cos).powi(2)
    };
    let length = count as Real * spacing;
    let last = ((length / shortest) as usize).clamp(1, (count / 4).max(1));
    let squares: Vec<(usize, Real)> = (1..=last).map(|wave| (wave, square(wave))).collect();
    let highest = squares.iter().max_by(|a, b| a.1.total_cmp(&b.1))?;
    (highest.1 > 0.0).then(|| length / highest.0 as Real)
}

/// Wavelength \[m] of the highest peak of the spectrum of values `spacing` \[m] apart, waves from `shortest` \[m] to twice the
/// profile; `None` for values that are all the same.
pub(super) fn length_of_peak(values: &[Real], spacing: Real, shortest: Real) -> Option<Real> {
    let count = values.len();
    let weights = window(count, 0.1);
    let mean =
        values.iter().zip(&weights).map(|(value, weight)| value * weight).sum::<Real>() / weights.iter().sum::<Real>();
    let period = 2 * PADDING * count;
    let strength = |wave: usize| {
        let of = |function: fn(Real) -> Real| {
            let angle = |n: usize| TAU * (wave * n % period) as Real / period as Real;
            (0..count).map(|n| weights[n] * (values[n] - mean) * function(angle(n))).sum::<Real>()
        };
        of(Real::sin).powi(2) + of(Real::cos).powi(2)
    };
    // From twice the profile to the shortest wave, of four values at least.
    let last = ((period as Real * spacing / shortest) as usize).clamp(PADDING + 1, period / 4);
    let strengths: Vec<Real> = (PADDING..=last).map(strength).collect();
    let top = (0..strengths.len()).max_by(|a, b| strengths[*a].total_cmp(&strengths[*b]))?;
    let near = |n: usize| strengths.get(n).copied().unwrap_or(0.0);
    let shift = top.checked_sub(1).and_then(|before| vertex(near(before), near(top), near(top + 1)));
    let wave = (PADDING + top) as Real + shift.map_or(0.0, |(shift, _)| shift);
    (strengths[top] > 0.0).then(|| period as Real * spacing / wave)
}

/// Cosine window: rises over the part `taper` of the values at each end, one between.
fn window(count: usize, taper: Real) -> Vec<Real> {
    let rise = taper * count as Real;
    let weight = |n: usize| {
        let from_end = n.min(count - 1 - n) as Real + 0.5;
        if from_end < rise { 0.5 - 0.5 * (PI * from_end / rise).cos() } else { 1.0 }
    };
    (0..count).map(weight).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_parabola_is_taken_off_and_nothing_else() {
        let wave = |n: usize| (TAU * n as Real / 10.0).sin();
        let bare: Vec<Real> = (0..80).map(wave).collect();
        let bent: Vec<Real> = (0..80).map(|n| wave(n) + 3.0 - 0.2 * n as Real + 0.01 * (n * n) as Real).collect();
        let (a, b) = (detrended(&bare), detrended(&bent));
        assert!(a.iter().zip(&b).all(|(a, b)| (a - b).abs() < 1e-11));
        assert!(detrended(&[1.0, 4.0, 9.0]).iter().all(|rest| rest.abs() < 1e-14));
        // A cubic stays.
        let cubic: Vec<Real> = (0..80).map(|n| (n as Real - 40.0).powi(3)).collect();
        assert!(detrended(&cubic).iter().any(|rest| rest.abs() > 1e3));
        assert_eq!(detrended(&[]), Vec::<Real>::new());
    }
}
