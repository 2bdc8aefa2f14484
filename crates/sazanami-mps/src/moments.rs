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

#[cfg(test)]
mod tests {
    use super::*;

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
