//! Profiles smoothed by parabolas of least squares about every place.

use sazanami_numerics::Real;

/// Standard deviation of the weights over the wavelength that is halved: `exp(-s)(1 + s) = 1/2` for `s = (k sigma)^2/2`.
const WIDTH: Real = 0.2916;
/// Weights beyond so many standard deviations are nothing.
const REACH: Real = 4.0;
/// Wavelength that is halved over the length of values that repeat from which on nothing but the mean of them is left, to a thousandth.
const ALL: Real = 4.0;

/// Evenly spaced values, `spacing` \[m] apart, of which waves of length `half` \[m] keep half of their height and
/// longer ones more: at each place the parabola of least squares under Gaussian weights. It reproduces parabolas, ends
/// of the profile included.
pub(super) fn smoothed(values: &[Real], spacing: Real, half: Real) -> Vec<Real> {
    let sigma = WIDTH * half / spacing;
    let reach = (REACH * sigma).ceil() as usize;
    let count = values.len();
    let at = |n: usize| {
        let (mut m, mut b) = ([0.0; 5], [0.0; 3]);
        for (j, &value) in values.iter().enumerate().take((n + reach + 1).min(count)).skip(n.saturating_sub(reach)) {
            let t = (j as Real - n as Real) / sigma;
            let mut weight = (-0.5 * t * t).exp();
            for p in 0..5 {
                m[p] += weight;
                if p < 3 {
                    b[p] += weight * value;
                }
                weight *= t;
            }
        }
        let minors = [m[2] * m[4] - m[3] * m[3], m[2] * m[3] - m[1] * m[4], m[1] * m[3] - m[2] * m[2]];
        let determinant: Real = (0..3).map(|p| m[p] * minors[p]).sum();
        let constant: Real = (0..3).map(|p| b[p] * minors[p]).sum();
        // Fewer than three places within the weights leave the value as it is.
        if determinant > 1e-12 * m[0] * m[2] * m[4] { constant / determinant } else { values[n] }
    };
    (0..count).map(at).collect()
}

/// The same of values that repeat.
pub(super) fn smoothed_around(values: &[Real], spacing: Real, half: Real) -> Vec<Real> {
    let count = values.len();
    let half = half.min(ALL * count as Real * spacing);
    let reach = (REACH * WIDTH * half / spacing).ceil() as usize;
    let more: Vec<Real> = (0..count + 2 * reach).map(|n| values[(n + count * reach - reach) % count]).collect();
    smoothed(&more, spacing, half)[reach..reach + count].to_vec()
}

#[cfg(test)]
mod tests {
    use std::f64::consts::TAU;

    use super::*;

    #[test]
    fn parabolas_stay_and_waves_keep_their_share() {
        let parabola: Vec<Real> = (0..120).map(|n| 3.0 + 0.2 * Real::from(n) - 0.01 * Real::from(n * n)).collect();
        let found = smoothed(&parabola, 1.0, 40.0);
        assert!(parabola.iter().zip(&found).all(|(a, b)| (a - b).abs() < 1e-8), "{found:?}");
        for (length, share) in [(40.0, 0.5), (20.0, 0.0094), (100.0, 0.970)] {
            let wave: Vec<Real> = (0..601).map(|n| (TAU * (Real::from(n) - 300.0) / length).cos()).collect();
            let kept = smoothed(&wave, 1.0, 40.0)[300];
            assert!((kept - share).abs() < 2e-3, "{length}: {kept}");
        }
        assert_eq!(smoothed(&[1.0, 5.0], 1.0, 0.1), [1.0, 5.0]);
    }

    #[test]
    fn of_waves_that_repeat_only_the_mean_is_left_however_long_those_that_stay() {
        let wave: Vec<Real> = (0..48).map(|n| 2.0 + (TAU * Real::from(n) / 48.0).cos()).collect();
        for half in [4.0 * 48.0, 1e9] {
            let mean = smoothed_around(&wave, 1.0, half);
            assert!(mean.iter().all(|value| (value - 2.0).abs() < 1e-3), "{half}: {mean:?}");
        }
        // Negative control: a wave as long as what is halved stays by half.
        assert!((smoothed_around(&wave, 1.0, 48.0)[0] - 2.5).abs() < 5e-3);
    }
}
