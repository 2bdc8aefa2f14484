//! The equations that the solvers of this module solve.

use crate::Real;
use crate::domain::{Domain, GhostRules, Row};
use crate::grid::Field;

/// A symmetric 7-point equation for one unknown per cell,
/// `sum over the faces of a cell of c_f (p_C - p_N) = b_C`.
///
/// `p_N` is the value of the neighbour. On an open side (Dirichlet) it is a given value that does not
/// depend on `p_C`, and `c_f` is the coefficient to that value: twice that of an inner face if the
/// value stands on the face. At walls the coefficient is zero.
pub trait Equation: Sync {
    /// Coefficients of the lower faces in `direction` of the cells of `row`, which may be the cells
    /// behind the last in that direction: their lower faces are upper faces of the box or the part.
    fn coefficients(&self, direction: usize, row: Row, into: &mut [Real]);

    /// `b - A p` in the cells of `row`, with `p` given by its values in memory, ghosts filled by
    /// [`Self::fill_ghosts`].
    fn residual(&self, row: Row, p: &[Real], into: &mut [Real]);

    /// Fills the first ghost layer of `p` as [`Self::residual`] needs it.
    fn fill_ghosts(&self, domain: &Domain, p: &mut Field<Real>);

    /// Whether a constant may be added to a solution.
    fn is_singular(&self) -> bool;
}

/// An equation with a stored coefficient on every face.
pub struct FaceEquation<'a> {
    /// Coefficients of the lower faces in each direction.
    pub faces: [&'a Field<Real>; 3],
    /// Right-hand side `b`.
    pub right_hand_side: &'a Field<Real>,
    /// Ghosts of the unknown behind the sides of the box: [`Ghost::Constant`] at open sides, any at
    /// walls.
    ///
    /// [`Ghost::Constant`]: crate::domain::Ghost::Constant
    pub ghosts: &'a GhostRules,
    /// Whether a constant may be added to a solution.
    pub singular: bool,
}

impl Equation for FaceEquation<'_> {
    fn coefficients(&self, direction: usize, row: Row, into: &mut [Real]) {
        into.copy_from_slice(&self.faces[direction].data()[row.shifted(0)]);
    }

    fn residual(&self, row: Row, p: &[Real], into: &mut [Real]) {
        into.copy_from_slice(&self.right_hand_side.data()[row.shifted(0)]);
        let centre = &p[row.shifted(0)];
        for (d, stride) in self.faces[0].strides().into_iter().enumerate() {
            let stride = stride as isize;
            for (face, neighbour) in [(0, -stride), (stride, stride)] {
                let coefficients = &self.faces[d].data()[row.shifted(face)];
                let neighbours = &p[row.shifted(neighbour)];
                for ((into, c), (n, p)) in into.iter_mut().zip(coefficients).zip(neighbours.iter().zip(centre)) {
                    *into += c * (n - p);
                }
            }
        }
    }

    fn fill_ghosts(&self, domain: &Domain, p: &mut Field<Real>) {
        domain.fill_halos_to(1, &mut [(p, self.ghosts)]);
    }

    fn is_singular(&self) -> bool {
        self.singular
    }
}
