//! Cubic splines: curves through points with continuous second derivative. At an end at which the points come to rest the slope is zero, at
//! others the second derivative.

use crate::Real;

/// Part of the mean slope of the last piece up to which the slope at its end, by a parabola through three points, counts as none. What is missed
/// then is half of the slope that the curve gains within the piece, no more than a second derivative of zero would miss.
const AT_REST: Real = 1.0 / 3.0;
/// Part of the largest slope between points that is rounding of the points.
const ROUNDING: Real = 1e-3;

/// A curve through points of increasing abscissa.
#[derive(Clone, Debug, PartialEq)]
pub struct Spline {
    x: Vec<Real>,
    y: Vec<Real>,
    /// Second derivative at the points.
    curvature: Vec<Real>,
}

impl Spline {
    /// The curve through the points `(x, y)`; `None` with fewer than two, or if `x` does not increase strictly.
    #[must_use]
    pub fn through(x: &[Real], y: &[Real]) -> Option<Self> {
        let n = x.len();
        if n < 2
            || y.len() != n
            || x.windows(2).any(|pair| pair[0].partial_cmp(&pair[1]) != Some(std::cmp::Ordering::Less))
        {
            return None;
        }
        let length = |piece: usize| x[piece + 1] - x[piece];
        let slope = |piece: usize| (y[piece + 1] - y[piece]) / length(piece);
        let steepest = (0..n - 1).map(|piece| slope(piece).abs()).fold(0.0, Real::max);
        let rests = |end: usize, beside: usize| {
            let (own, next) = (slope(end), slope(beside));
            let at_end = own - (next - own) * length(end) / (length(end) + length(beside));
            own.abs() <= ROUNDING * steepest || at_end * own <= AT_REST * own * own
        };
        let at_rest = if n > 2 { [rests(0, 1), rests(n - 2, n - 3)] } else { [false; 2] };
        // Continuity of the slope at the inner points, and no slope at ends at rest, solved by elimination.
        let mut curvature = vec![0.0; n];
        let mut ratio = vec![0.0; n];
        if at_rest[0] {
            (ratio[0], curvature[0]) = (0.5, 3.0 * slope(0) / length(0));
        }
        for i in 1..n - 1 {
            let (before, after) = (length(i - 1), length(i));
            let jump = slope(i) - slope(i - 1);
            let pivot = 2.0 * (before + after) - before * ratio[i - 1];
            ratio[i] = after / pivot;
            curvature[i] = (6.0 * jump - before * curvature[i - 1]) / pivot;
        }
        if at_rest[1] {
            let own = slope(n - 2);
            curvature[n - 1] = (-6.0 * own / length(n - 2) - curvature[n - 2]) / (2.0 - ratio[n - 2]);
        }
        for i in (0..n - 1).rev() {
            curvature[i] -= ratio[i] * curvature[i + 1];
        }
        Some(Self { x: x.to_vec(), y: y.to_vec(), curvature })
    }

    /// First and last abscissa.
    #[must_use]
    pub fn range(&self) -> [Real; 2] {
        [self.x[0], self.x[self.x.len() - 1]]
    }

    /// Abscissae of the points in a closed range.
    #[must_use]
    pub fn abscissae_within(&self, [first, last]: [Real; 2]) -> &[Real] {
        &self.x[self.x.partition_point(|&x| x < first)..self.x.partition_point(|&x| x <= last)]
    }

    /// Value, slope and second derivative at `x`; beyond the ends the curve goes on straight.
    #[must_use]
    pub fn at(&self, x: Real) -> [Real; 3] {
        let last = self.x.len() - 1;
        let piece = self.x.partition_point(|&known| known <= x).clamp(1, last);
        let inside = x.clamp(self.x[0], self.x[last]);
        let (x0, x1, m0, m1) = (self.x[piece - 1], self.x[piece], self.curvature[piece - 1], self.curvature[piece]);
        let h = x1 - x0;
        let (a, b) = ((x1 - inside) / h, (inside - x0) / h);
        let (y0, y1) = (self.y[piece - 1], self.y[piece]);
        let value = a * y0 + b * y1 + ((a.powi(3) - a) * m0 + (b.powi(3) - b) * m1) * h * h / 6.0;
        let slope = (y1 - y0) / h + ((3.0 * b * b - 1.0) * m1 - (3.0 * a * a - 1.0) * m0) * h / 6.0;
        [value + slope * (x - inside), slope, a * m0 + b * m1]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_smooth_curve_is_followed_with_its_derivatives() {
        let x: Vec<Real> = (0..=200).map(|n| 0.01 * n as Real).collect();
        let y: Vec<Real> = x.iter().map(|x| (3.0 * x).sin()).collect();
        let spline = Spline::through(&x, &y).unwrap();
        for at in [0.503, 1.0, 1.377] {
            let [value, slope, curvature] = spline.at(at);
            assert!((value - (3.0 * at).sin()).abs() < 1e-8);
            assert!((slope - 3.0 * (3.0 * at).cos()).abs() < 1e-5);
            assert!((curvature + 9.0 * (3.0 * at).sin()).abs() < 2e-3);
        }
    }

    #[test]
    fn what_begins_and_ends_at_rest_has_no_slope_there() {
        let tau = std::f64::consts::TAU;
        let curve = |rows: i32, of: &dyn Fn(Real) -> Real| {
            let x: Vec<Real> = (0..=rows).map(|n| n as Real / rows as Real).collect();
            Spline::through(&x, &x.iter().map(|&x| of(x)).collect::<Vec<_>>()).unwrap()
        };
        // From rest with an acceleration, with none, after a pause, and a step that is written with four digits; with few rows and many.
        let swing = |x: Real| 1.0 - (tau * x).cos();
        let smooth = |x: Real| x.powi(3) * (1.0 - x).powi(3);
        let paused = |x: Real| (x - 0.3).max(0.0).powi(2) * (0.8 - x).max(0.0).powi(2);
        let written = |x: Real| (1e4 * swing(x)).round() * 1e-4;
        for rows in [8, 25, 200] {
            for of in [&swing as &dyn Fn(Real) -> Real, &smooth, &paused, &written] {
                let spline = curve(rows, of);
                assert!(spline.at(0.0)[1].abs() < 1e-12 && spline.at(1.0)[1].abs() < 1e-12, "{rows}");
                assert!(spline.at(-0.5)[0].abs() < 1e-12, "{rows}");
            }
        }
        // The slope between is that of the swing too, from the first piece on.
        let spline = curve(50, &swing);
        for x in [0.005, 0.01, 0.1, 0.99] {
            assert!((spline.at(x)[1] - tau * (tau * x).sin()).abs() < 1e-3 * tau, "{x}");
        }
        // Negative control: what moves at its ends keeps its slope there.
        let (wave, parabola) = (|x: Real| (tau * x).sin(), |x: Real| 0.3 * x + x * x);
        for of in [&wave as &dyn Fn(Real) -> Real, &parabola] {
            let (spline, step) = (curve(50, of), 1e-6);
            let exact = (of(step) - of(0.0)) / step;
            assert!((spline.at(0.0)[1] / exact - 1.0).abs() < 0.05, "{} {exact}", spline.at(0.0)[1]);
        }
    }

    #[test]
    fn straight_lines_stay_straight_beyond_their_ends() {
        let spline = Spline::through(&[0.0, 1.0, 3.0], &[1.0, 2.0, 4.0]).unwrap();
        for x in [-1.0, 0.5, 2.0, 5.0] {
            assert!((spline.at(x)[0] - (1.0 + x)).abs() < 1e-14);
        }
        assert!(Spline::through(&[0.0, 0.0], &[1.0, 2.0]).is_none());
        assert!(Spline::through(&[0.0], &[1.0]).is_none());
    }
}
