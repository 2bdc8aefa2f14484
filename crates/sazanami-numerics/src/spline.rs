//! Natural cubic splines: curves through points with continuous second derivative, which is zero at the ends.

use crate::Real;

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
        // Continuity of the slope at the inner points, solved by elimination.
        let mut curvature = vec![0.0; n];
        let mut ratio = vec![0.0; n];
        for i in 1..n - 1 {
            let (before, after) = (x[i] - x[i - 1], x[i + 1] - x[i]);
            let jump = (y[i + 1] - y[i]) / after - (y[i] - y[i - 1]) / before;
            let pivot = 2.0 * (before + after) - before * ratio[i - 1];
            ratio[i] = after / pivot;
            curvature[i] = (6.0 * jump - before * curvature[i - 1]) / pivot;
        }
        for i in (1..n - 1).rev() {
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
    fn straight_lines_stay_straight_beyond_their_ends() {
        let spline = Spline::through(&[0.0, 1.0, 3.0], &[1.0, 2.0, 4.0]).unwrap();
        for x in [-1.0, 0.5, 2.0, 5.0] {
            assert!((spline.at(x)[0] - (1.0 + x)).abs() < 1e-14);
        }
        assert!(Spline::through(&[0.0, 0.0], &[1.0, 2.0]).is_none());
        assert!(Spline::through(&[0.0], &[1.0]).is_none());
    }
}
