//! Curves through points: the straight line of least squares, the parabola through three.

use sazanami_numerics::Real;

/// Straight line of least squares, `y = intercept + slope x`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Line {
    /// Increase of y for an increase of x by one.
    pub slope: Real,
    /// Value at zero.
    pub intercept: Real,
    /// Standard error of the slope from the scatter about the line; `None` with two points.
    pub standard_error: Option<Real>,
    /// Number of points.
    pub points: usize,
    /// Sum of the squares of the distances of the points from their mean along x.
    pub spread: Real,
}

/// The line through `(x, y)` points; `None` with fewer than two, or where all `x` are the same.
pub fn line(points: &[(Real, Real)]) -> Option<Line> {
    let count = points.len() as Real;
    let mean = |pick: fn(&(Real, Real)) -> Real| points.iter().map(pick).sum::<Real>() / count;
    let (x_mean, y_mean) = (mean(|p| p.0), mean(|p| p.1));
    let spread: Real = points.iter().map(|(x, _)| (x - x_mean).powi(2)).sum();
    if points.len() < 2 || spread <= 0.0 {
        return None;
    }
    let slope = points.iter().map(|(x, y)| (x - x_mean) * (y - y_mean)).sum::<Real>() / spread;
    let misfit: Real = points.iter().map(|(x, y)| (y - y_mean - slope * (x - x_mean)).powi(2)).sum();
    let standard_error = (points.len() > 2).then(|| (misfit / (count - 2.0) / spread).sqrt());
    Some(Line { slope, intercept: y_mean - slope * x_mean, standard_error, points: points.len(), spread })
}

/// Highest point of the parabola through three values one apart: its place, from the middle one on, and its value.
/// `None` if their curvature is not negative.
pub fn vertex(before: Real, middle: Real, after: Real) -> Option<(Real, Real)> {
    let curvature = before - 2.0 * middle + after;
    (curvature < 0.0).then(|| {
        let place = 0.5 * (before - after) / curvature;
        (place, middle - 0.25 * (before - after) * place)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_straight_line_is_recovered_and_its_scatter_told() {
        let exact = line(&[(1.0, 1.0), (2.0, 3.0), (4.0, 7.0)]).unwrap();
        assert!((exact.slope - 2.0).abs() < 1e-14 && (exact.intercept + 1.0).abs() < 1e-14);
        assert!(exact.standard_error.unwrap() < 1e-14 && exact.points == 3);
        // By hand: slope 1, residuals 1/3, -2/3, 1/3, spread 2.
        let scattered = line(&[(0.0, 1.0), (1.0, 1.0), (2.0, 3.0)]).unwrap();
        assert!((scattered.slope - 1.0).abs() < 1e-14 && (scattered.spread - 2.0).abs() < 1e-14);
        assert!((scattered.standard_error.unwrap() - (1.0_f64 / 3.0).sqrt()).abs() < 1e-14);
    }

    #[test]
    fn no_line_without_two_places() {
        assert_eq!(line(&[(0.0, 1.0), (1.0, 2.0)]).unwrap().standard_error, None);
        assert_eq!(line(&[(1.0, 1.0), (1.0, 2.0), (1.0, 2.0)]), None);
        assert_eq!(line(&[(1.0, 1.0)]), None);
        assert_eq!(line(&[]), None);
    }

    #[test]
    fn the_vertex_of_a_parabola_is_exact() {
        let parabola = |x: Real| 2.0 - 3.0 * (x - 0.3).powi(2);
        let (place, value) = vertex(parabola(-1.0), parabola(0.0), parabola(1.0)).unwrap();
        assert!((place - 0.3).abs() < 1e-14 && (value - 2.0).abs() < 1e-14);
        assert_eq!(vertex(1.0, 0.0, 1.0), None);
        assert_eq!(vertex(1.0, 1.0, 1.0), None);
    }
}
