//! The plane through what the points of a calibration found, and how well it determines the keys.

/// Standard errors of a slope within which it is noise, by the degrees of freedom of the error from 1 on: the quantiles of
/// Student's t that noise passes in one of 20 cases.
const NOISE: [f64; 30] = [
    12.71, 4.30, 3.18, 2.78, 2.57, 2.45, 2.36, 2.31, 2.26, 2.23, 2.20, 2.18, 2.16, 2.14, 2.13, 2.12, 2.11, 2.10, 2.09,
    2.09, 2.08, 2.07, 2.07, 2.06, 2.06, 2.06, 2.05, 2.05, 2.05, 2.04,
];
/// The same where the error is known.
const NOISE_OF_KNOWN: f64 = 1.96;

/// Standard uncertainties of the keys \[parts of their ranges], by the plane of least squares through the `deviations` of the targets
/// \[tolerances] at the `places` \[parts of the ranges]: each target is uncertain by its tolerance and by its standard error among `errors`
/// \[tolerances], which comes from so many degrees of `freedom` (nothing: it is known). Nothing of a key with which no target
/// changes by more than noise does in 19 of 20 cases, of all keys if the targets do not tell them apart, and of one that is
/// uncertain by its whole range or more. What is told of a key holds with those of which nothing is.
pub fn uncertainties(
    places: &[&[f64]],
    deviations: &[Vec<f64>],
    errors: &[f64],
    freedom: Option<usize>,
) -> Vec<Option<f64>> {
    let noise_of_slope =
        freedom.map_or(NOISE_OF_KNOWN, |n| NOISE.get(n.saturating_sub(1)).copied().unwrap_or(NOISE[NOISE.len() - 1]));
    let n = places.first().map_or(0, |place| place.len());
    let nothing = vec![None; n];
    let count = places.len() as f64;
    let middle = |of: &dyn Fn(usize) -> f64| (0..places.len()).map(of).sum::<f64>() / count;
    let centre: Vec<f64> = (0..n).map(|i| middle(&|point| places[point][i])).collect();
    let step = |point: usize, i: usize| places[point][i] - centre[i];
    let products = |of: &dyn Fn(usize) -> f64| (0..places.len()).map(of).sum::<f64>();
    let normal = (0..n).map(|i| (0..n).map(|j| products(&|point| step(point, i) * step(point, j))).collect()).collect();
    let Some(inverse_of_normal) = inverse(normal) else { return nothing };
    // Of each target the slopes that are no noise.
    let slopes = |(t, &error): (usize, &f64)| -> Vec<f64> {
        let right: Vec<f64> = (0..n).map(|j| products(&|point| step(point, j) * deviations[point][t])).collect();
        let slope = |i: usize| (0..n).map(|j| inverse_of_normal[i][j] * right[j]).sum::<f64>();
        let noise = |i: usize| noise_of_slope * error * inverse_of_normal[i][i].max(0.0).sqrt();
        (0..n).map(|i| Some(slope(i)).filter(|slope| slope.abs() > noise(i)).unwrap_or_default()).collect()
    };
    let slopes: Vec<Vec<f64>> = errors.iter().enumerate().map(slopes).collect();
    let told: Vec<usize> = (0..n).filter(|&i| slopes.iter().any(|of| of[i] != 0.0)).collect();
    let information = |i: usize, j: usize| -> f64 {
        slopes.iter().zip(errors).map(|(of, error)| of[i] * of[j] / (1.0 + error * error)).sum()
    };
    let information = told.iter().map(|&i| told.iter().map(|&j| information(i, j)).collect()).collect();
    let Some(covariance) = inverse(information) else { return nothing };
    let mut found = nothing;
    for (place, &i) in told.iter().enumerate() {
        found[i] = Some(covariance[place][place].max(0.0).sqrt()).filter(|uncertainty| *uncertainty < 1.0);
    }
    found
}

/// Inverse of a small matrix by elimination with pivots; nothing if it has none.
fn inverse(mut a: Vec<Vec<f64>>) -> Option<Vec<Vec<f64>>> {
    let n = a.len();
    let mut b: Vec<Vec<f64>> = (0..n).map(|i| (0..n).map(|j| f64::from(u8::from(i == j))).collect()).collect();
    let largest = a.iter().flatten().fold(0.0, |most: f64, value| most.max(value.abs()));
    for column in 0..n {
        let pivot = (column..n).max_by(|&i, &j| a[i][column].abs().total_cmp(&a[j][column].abs()))?;
        if a[pivot][column].abs() <= 1e-12 * largest {
            return None;
        }
        a.swap(column, pivot);
        b.swap(column, pivot);
        let scale = a[column][column];
        a[column].iter_mut().chain(&mut b[column]).for_each(|value| *value /= scale);
        for row in (0..n).filter(|&row| row != column) {
            let factor = a[row][column];
            for j in 0..n {
                a[row][j] -= factor * a[column][j];
                b[row][j] -= factor * b[column][j];
            }
        }
    }
    Some(b)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn matrices_are_inverted() {
        let found = inverse(vec![vec![0.0, 2.0], vec![4.0, 1.0]]).unwrap();
        assert_eq!(found, [[-0.125, 0.25], [0.5, 0.0]]);
        assert_eq!(inverse(vec![vec![1.0, 2.0], vec![2.0, 4.0]]), None);
    }

    #[test]
    fn keys_are_as_uncertain_as_their_targets() {
        let places: [&[f64]; 4] = [&[0.3, 0.3], &[0.7, 0.3], &[0.3, 0.7], &[0.5, 0.5]];
        // The first target changes by 20 tolerances over the range of the first key, the second one by 10 over that of both.
        let found: Vec<Vec<f64>> = places.iter().map(|p| vec![20.0 * p[0] - 8.0, 10.0 * (p[0] + p[1]) - 5.0]).collect();
        let of = |errors: [f64; 2]| uncertainties(&places, &found, &errors, None);
        let near = |found: Option<f64>, expected: f64| found.is_some_and(|found| (found - expected).abs() < 1e-12);
        let sure = of([0.0, 0.0]);
        assert!(near(sure[0], 0.05) && near(sure[1], 0.1_f64.hypot(0.05)), "{sure:?}");
        let scattered = of([0.75, 0.0]);
        assert!(near(scattered[0], 0.0625) && near(scattered[1], 0.1_f64.hypot(0.0625)), "{scattered:?}");
        // Control: the second target is lost in noise, and with it the second key.
        let lost = of([0.0, 2.0]);
        assert!(near(lost[0], 0.05) && lost[1].is_none(), "{lost:?}");
        assert_eq!(of([9.0, 9.0]), [None, None]);
        // One target for two keys, points in a line, a slope so flat that the tolerance spans the range.
        let one: Vec<Vec<f64>> = found.iter().map(|of| of[1..].to_vec()).collect();
        assert_eq!(uncertainties(&places, &one, &[0.0], None), [None, None]);
        assert_eq!(uncertainties(&[&[0.3], &[0.3]], &[vec![1.0], vec![2.0]], &[0.0], None), [None]);
        assert_eq!(uncertainties(&[&[0.3], &[0.7]], &[vec![0.1], vec![0.4]], &[0.0], None), [None]);
    }

    #[test]
    fn noise_determines_no_key() {
        // Two thousand calibrations of points that nothing but noise tells apart: one in 20 is taken for more.
        let mut random = sazanami_numerics::Random::new(7);
        let mut drawn = || (0..12).map(|_| random.unit()).sum::<f64>() - 6.0;
        // Two points of three seeds, as in a first simplex: the error is estimated from four degrees of freedom.
        let places: [&[f64]; 2] = [&[0.3], &[0.7]];
        let mut taken = |slope: f64, freedom: Option<usize>| {
            let fits = (0..2000).filter(|_| {
                let draws: Vec<[f64; 3]> =
                    places.iter().map(|place| [0; 3].map(|_| slope * place[0] + 3.0 * drawn())).collect();
                let means = draws.iter().map(|of| of.iter().sum::<f64>() / 3.0);
                let found: Vec<Vec<f64>> = means.map(|mean| vec![mean]).collect();
                let squares = draws.iter().zip(&found).flat_map(|(of, mean)| of.map(|x| (x - mean[0]).powi(2)));
                let error = (squares.sum::<f64>() / 4.0 / 3.0).sqrt();
                uncertainties(&places, &found, &[error], freedom)[0].is_some()
            });
            fits.count()
        };
        let (noise, told) = (taken(0.0, Some(4)), taken(80.0, Some(4)));
        assert!(noise <= 130 && told >= 1900, "{noise} of noise, {told} of a key that matters");
        // Negative control: as if the error were known.
        let lax = taken(0.0, None);
        assert!(lax > 160, "{lax}");
    }
}
