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

/// Derivatives of the velocity along each coordinate by least squares [1/s], from weighted sums of products of each
/// coordinate with the velocity, and weighted second `moments`. `None` if there are no neighbours or they do not span the
/// space.
pub(crate) fn velocity_gradient(products: &[Vector; 3], moments: &Symmetric) -> Option<[Vector; 3]> {
    let inverse = inverse(moments, moments[0] + moments[1] + moments[2])?;
    Some([0, 1, 2].map(|d| (0..3).map(|e| inverse.col(d)[e] * products[e]).sum()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn gradients_are_exact_for_linear_velocities_at_a_surface() {
        // Half of a disordered neighbourhood, and the flow u = (2 x + y, 0, z).
        let places = [[1.0, 0.1, -0.2], [-0.9, 0.2, 0.0], [0.1, 1.1, -0.3], [0.0, -1.0, -0.1], [0.2, 0.1, -0.9]];
        let (mut products, mut moments) = ([Vector::ZERO; 3], [0.0; 6]);
        for d in places.map(Vector::from_array) {
            add(&mut moments, 0.7, d);
            let change = Vector::new(2.0 * d.x + d.y, 0.0, d.z);
            products.iter_mut().zip(d.to_array()).for_each(|(product, way)| *product += 0.7 * way * change);
        }
        let found = velocity_gradient(&products, &moments).unwrap();
        let exact = [Vector::new(2.0, 0.0, 0.0), Vector::X, Vector::Z];
        assert!(found.iter().zip(exact).all(|(found, exact)| (*found - exact).length() < 1e-12), "{found:?}");
        // Negative control: over the mean moment, as with complete support, it is not.
        let mean = (moments[0] + moments[1] + moments[2]) / 3.0;
        assert!((products[2] / mean - Vector::Z).length() > 0.1);
        assert!(velocity_gradient(&[Vector::ZERO; 3], &[0.0; 6]).is_none(), "nothing around");
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
