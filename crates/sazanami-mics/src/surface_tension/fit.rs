//! The paraboloid nearest to points of the interface, and its curvature (Popinet 2009, J. Comput. Phys. 228, 5838, sections 5.3-5.5).

use sazanami_numerics::{Real, Vector};

/// Coefficients of `z = a0 x^2 + a1 y^2 + a2 x y + a3 x + a4 y + a5`.
const COEFFICIENTS: usize = 6;
/// Least pivot of the equations, over the number of points: fewer points than coefficients, or points in a line, do not tell a curvature.
const LEAST_PIVOT: Real = 1e-4;

/// Points near one of the interface, each with a weight, in the frame of the normal there.
pub(super) struct Paraboloid {
    origin: Vector,
    axes: [Vector; 3],
    scale: Real,
    matrix: [[Real; COEFFICIENTS]; COEFFICIENTS],
    right: [Real; COEFFICIENTS],
    weight: Real,
}

impl Paraboloid {
    /// No points yet, around `origin` \[m] with the unit `normal` out of the liquid; `scale` is a length of the order of their distances
    /// \[m].
    pub fn around(origin: Vector, normal: Vector, scale: Real) -> Self {
        let (along, across) = normal.any_orthonormal_pair();
        Self::in_frame(origin, [along, across, normal], scale)
    }

    /// The same in a frame with the third of these `axes` for the normal.
    pub fn in_frame(origin: Vector, axes: [Vector; 3], scale: Real) -> Self {
        Self {
            origin,
            axes,
            scale,
            matrix: [[0.0; COEFFICIENTS]; COEFFICIENTS],
            right: [0.0; COEFFICIENTS],
            weight: 0.0,
        }
    }

    /// Adds a point \[m].
    pub fn add(&mut self, point: Vector, weight: Real) {
        let [x, y, z] = self.axes.map(|axis| axis.dot(point - self.origin) / self.scale);
        let terms = [x * x, y * y, x * y, x, y, 1.0];
        for (n, a) in terms.iter().enumerate() {
            for (m, b) in terms.iter().enumerate() {
                self.matrix[n][m] += weight * a * b;
            }
            self.right[n] += weight * a * z;
        }
        self.weight += weight;
    }

    /// Curvature at the origin, positive where the liquid is convex [1/m]; `None` if the points do not tell.
    pub fn curvature(self) -> Option<Real> {
        let [a0, a1, a2, a3, a4, _] = solve(self.matrix, self.right, LEAST_PIVOT * self.weight)?;
        let (slope, bend) = (1.0 + a3 * a3 + a4 * a4, a0 * (1.0 + a4 * a4) + a1 * (1.0 + a3 * a3) - a2 * a3 * a4);
        Some(-2.0 * bend / (slope * slope.sqrt()) / self.scale)
    }
}

/// Solves by elimination with the largest pivots; `None` if one is below `least`.
fn solve<const N: usize>(mut a: [[Real; N]; N], mut b: [Real; N], least: Real) -> Option<[Real; N]> {
    for n in 0..N {
        let pivot = (n..N).max_by(|&i, &j| a[i][n].abs().total_cmp(&a[j][n].abs()))?;
        let size = a[pivot][n].abs();
        if size.is_nan() || size <= least {
            return None;
        }
        a.swap(n, pivot);
        b.swap(n, pivot);
        for row in n + 1..N {
            let factor = a[row][n] / a[n][n];
            (n..N).for_each(|m| a[row][m] -= factor * a[n][m]);
            b[row] -= factor * b[n];
        }
    }
    for n in (0..N).rev() {
        let known: Real = (n + 1..N).map(|m| a[n][m] * b[m]).sum();
        b[n] = (b[n] - known) / a[n][n];
    }
    Some(b)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_paraboloid_is_found_exactly_whatever_its_frame() {
        let normal = Vector::new(0.3, -0.5, 0.8).normalize();
        let (along, across) = normal.any_orthonormal_pair();
        let (origin, scale) = (Vector::new(1.0, 2.0, 3.0), 1e-3);
        let mut fit = Paraboloid::around(origin, normal, scale);
        for n in 0..12 {
            let (x, y) = (1e-3 * (f64::from(n) * 2.4).cos(), 1.3e-3 * (f64::from(n) * 1.7).sin());
            let z = -90.0 * x * x - 40.0 * y * y + 25.0 * x * y;
            fit.add(origin + along * x + across * y + normal * z, 1.0 + f64::from(n % 3));
        }
        let curvature = fit.curvature().unwrap();
        assert!((curvature / 260.0 - 1.0).abs() < 1e-10, "{curvature}");
    }

    #[test]
    fn points_in_a_line_tell_no_curvature() {
        let mut fit = Paraboloid::around(Vector::ZERO, Vector::Z, 1.0);
        (0..20).for_each(|n| fit.add(Vector::new(f64::from(n) * 0.1 - 1.0, 0.0, 0.0), 1.0));
        assert_eq!(fit.curvature(), None);
    }
}
