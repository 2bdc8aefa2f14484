//! Weighted second-moment matrices of the neighbours of a point.

use sazanami_numerics::{Matrix, Real, Vector};

/// Determinant of the moment matrix over that of full support below which the gradient is not corrected. It bounds the
/// condition number by 78: the largest ratio of three eigenvalues of sum 3 and of this product.
const SINGULAR: Real = 0.05;

/// Symmetric 3 x 3 matrix: 11, 22, 33, 12, 13, 23.
pub(crate) type Symmetric = [Real; 6];

/// Adds `weight d d^T`.
pub(crate) fn add(matrix: &mut Symmetric, weight: Real, d: Vector) {
    let terms = [d.x * d.x, d.y * d.y, d.z * d.z, d.x * d.y, d.x * d.z, d.y * d.z];
    matrix.iter_mut().zip(terms).for_each(|(m, t)| *m += weight * t);
}

/// The matrix with both triangles written out.
pub(crate) fn full(m: &Symmetric) -> Matrix {
    Matrix::from_cols(Vector::new(m[0], m[3], m[4]), Vector::new(m[3], m[1], m[5]), Vector::new(m[4], m[5], m[2]))
}

/// Inverse of the moment matrix unless it is nearly singular; `support` is the sum of the weights.
pub(crate) fn inverse(m: &Symmetric, support: Real) -> Option<Matrix> {
    let matrix = full(m);
    let determinant = matrix.determinant();
    // Strictly larger: without support both sides are zero.
    (determinant > SINGULAR * (support / 3.0).powi(3)).then(|| matrix.inverse())
}

/// Whether all eigenvalues exceed `bound`: what is left without it is positive definite (Sylvester's criterion).
pub(crate) fn eigenvalues_exceed(m: &Symmetric, bound: Real) -> bool {
    let [a, b, c, d, e, f] = [m[0] - bound, m[1] - bound, m[2] - bound, m[3], m[4], m[5]];
    a > 0.0 && a * b - d * d > 0.0 && a * (b * c - f * f) - d * (d * c - e * f) + e * (d * f - b * e) > 0.0
}

/// Slopes of the velocity around a particle by least squares, with their moment matrix, and the rate of the void fraction.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct VelocitySlopes {
    /// Weighted sums of velocity differences times each component of the distance.
    products: [Vector; 3],
    moments: Symmetric,
    /// Weighted sum of the rates of change of `1/eps` [1/s].
    pub voids: Real,
}

impl VelocitySlopes {
    /// Around a particle whose own `1/eps` changes at the rate `voids` [1/s].
    pub fn new(voids: Real) -> Self {
        Self { voids, ..Self::default() }
    }

    /// From weighted sums of products of each coordinate with the velocity, and weighted second moments.
    pub fn of_sums(products: [Vector; 3], moments: Symmetric) -> Self {
        Self { products, moments, voids: 0.0 }
    }

    /// Adds a neighbour at distance `d` \[m] with a velocity `change` [m/s] over it.
    #[inline(always)]
    pub fn add(&mut self, weight: Real, d: Vector, change: Vector) {
        add(&mut self.moments, weight, d);
        let shares = (weight * d).to_array();
        self.products.iter_mut().zip(shares).for_each(|(product, share)| *product += share * change);
    }

    /// The weighted second moments.
    pub fn moments(&self) -> &Symmetric {
        &self.moments
    }

    /// Derivatives of the velocity along each coordinate [1/s]. `None` if there are no neighbours or they do not span the
    /// space.
    pub fn gradient(&self) -> Option<[Vector; 3]> {
        let m = &self.moments;
        let inverse = inverse(m, m[0] + m[1] + m[2])?;
        Some([0, 1, 2].map(|d| (0..3).map(|e| inverse.col(d)[e] * self.products[e]).sum()))
    }

    /// Rate of compression `-div u - (deps/dt)/eps` [1/s], exact for linear velocities; `density` is the number density.
    /// `None` if there are no neighbours or they do not span the space.
    pub fn compression(&self, density: Real) -> Option<Real> {
        let m = &self.moments;
        let inverse = inverse(m, m[0] + m[1] + m[2])?;
        let divergence: Real = (0..3).map(|d| self.products[d].dot(inverse.col(d))).sum();
        Some(self.voids / density - divergence)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn corrected_rates_are_exact_for_linear_velocities_at_a_surface() {
        // Half of a disordered neighbourhood, and the flow u = (2 x + y, 0, z) of divergence 3.
        let places = [[1.0, 0.1, -0.2], [-0.9, 0.2, 0.0], [0.1, 1.1, -0.3], [0.0, -1.0, -0.1], [0.2, 0.1, -0.9]];
        let mut slopes = VelocitySlopes::new(0.0);
        let mut plain = 0.0;
        for d in places.map(Vector::from_array) {
            let change = Vector::new(2.0 * d.x + d.y, 0.0, d.z);
            slopes.add(0.7, d, change);
            plain += 0.7 * change.dot(d);
        }
        assert!((slopes.compression(1.0).unwrap() + 3.0).abs() < 1e-12);
        // Negative control: over the mean moment, as with complete support, it is not.
        let mean: Real = places.iter().map(|d| 0.7 * Vector::from_array(*d).length_squared() / 3.0).sum();
        assert!((plain / mean - 3.0).abs() > 0.1);
        assert!(VelocitySlopes::new(0.0).compression(1.0).is_none(), "nothing around");
        // Voids alone: the rate of 1/eps of all over the number density.
        let voids = VelocitySlopes { voids: 4.0, ..slopes }.compression(2.0).unwrap();
        assert!((voids + 1.0).abs() < 1e-12);
    }

    #[test]
    fn singular_moment_matrices_are_not_inverted() {
        let mut plane = [0.0; 6];
        for d in [Vector::X, Vector::Y, Vector::new(0.6, 0.8, 0.0)] {
            add(&mut plane, 1.0, d);
        }
        assert!(inverse(&plane, 3.0).is_none());
        assert!(inverse(&[0.0; 6], 0.0).is_none(), "with none at all");
        add(&mut plane, 1.0, Vector::Z);
        let found = inverse(&plane, 4.0).unwrap();
        assert!((found * full(&plane) - Matrix::IDENTITY).to_cols_array().iter().all(|v| v.abs() < 1e-12));
    }
}
