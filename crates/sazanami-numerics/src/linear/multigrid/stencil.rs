//! The 7-point operator of one level and its updates, row by row.

use super::chequerboard::{Chequerboard, Colours};
use super::wavefront::Planes;

/// Cells worked on at a time where a row has to be brought into another order.
pub(super) const RUN: usize = 128;

/// Values of a pair of colours for reading: planes of a pass or whole arrays.
pub(super) trait Source {
    /// `length` values from place `at` on.
    fn run(&self, at: usize, length: usize) -> &[f32];
}

impl Source for Planes<'_, f32> {
    #[inline(always)]
    fn run(&self, at: usize, length: usize) -> &[f32] {
        Planes::run(self, at, length)
    }
}

impl Source for Vec<f32> {
    #[inline(always)]
    fn run(&self, at: usize, length: usize) -> &[f32] {
        &self[at..][..length]
    }
}

/// Coefficients of the lower faces, and the reciprocals of the diagonal.
pub(super) struct Stencil {
    /// Layout of the cells.
    pub board: Chequerboard,
    /// Per row of one colour: lower-face coefficients in x1, then x2, then x3.
    pub faces: Colours,
    /// One over the sum of a cell's six coefficients; 0 where that is 0.
    pub inverse: Colours,
}

/// The six slices (x1 lower and upper, x2 lower and upper, x3 lower and upper) that belong to a run
/// of cells of one colour.
type Six<'a> = [&'a [f32]; 6];

impl Stencil {
    pub(super) fn new(board: Chequerboard) -> Self {
        let mut faces = board.zeros();
        for colour in &mut faces {
            colour.resize(3 * colour.len(), 0.0);
        }
        Self { board, faces, inverse: board.zeros() }
    }

    /// Place of the coefficient in `direction` of the cell `m = 0` of the row `(j, k)`.
    #[inline]
    pub(super) fn face(&self, direction: usize, j: isize, k: isize) -> usize {
        (3 * self.board.row(j, k) + direction) * self.board.width + 1
    }

    /// Coefficients of the cells `m0..m0 + length` of `colour` in the row `(j, k)`.
    #[inline(always)]
    fn coefficients(&self, colour: usize, j: isize, k: isize, m0: usize, length: usize) -> Six<'_> {
        let offset = self.board.offset(colour, j, k);
        let own = |d: usize| self.faces[colour].run(self.face(d, j, k) + m0, length);
        let other = |d, j, k, shift: usize| self.faces[1 - colour].run(self.face(d, j, k) + m0 + shift, length);
        [own(0), other(0, j, k, offset), own(1), other(1, j + 1, k, 0), own(2), other(2, j, k + 1, 0)]
    }

    /// Values next to the cells `m0..m0 + length` of `colour` in the row `(j, k)`.
    #[inline(always)]
    fn neighbours<'a>(
        &self,
        other: &'a impl Source,
        colour: usize,
        (j, k): (isize, isize),
        m0: usize,
        length: usize,
    ) -> Six<'a> {
        let Chequerboard { width, .. } = self.board;
        let plane = self.board.plane();
        let offset = self.board.offset(colour, j, k);
        let at = self.board.first(j, k) + m0;
        [
            other.run(at + offset - 1, length),
            other.run(at + offset, length),
            other.run(at - width, length),
            other.run(at + width, length),
            other.run(at - plane, length),
            other.run(at + plane, length),
        ]
    }

    /// `x = b / diagonal` for the cells of `colour` in a row: a relaxation from zero.
    #[inline]
    pub(super) fn relax_from_zero(
        &self,
        colour: usize,
        (j, k): (isize, isize),
        x: &mut Planes<'_, f32>,
        b: &Planes<'_, f32>,
    ) {
        let length = self.board.length(self.board.offset(colour, j, k));
        let at = self.board.first(j, k);
        let inverse = self.inverse[colour].run(at, length);
        let b = b.run(at, length);
        for ((x, b), inverse) in x.run_mut(at, length).iter_mut().zip(b).zip(inverse) {
            *x = b * inverse;
        }
    }

    /// Solves the equations of the cells of `colour` in a row for themselves.
    #[inline]
    pub(super) fn relax(
        &self,
        colour: usize,
        (j, k): (isize, isize),
        x: &mut Planes<'_, f32>,
        other: &Planes<'_, f32>,
        b: &impl Source,
    ) {
        let n = self.board.length(self.board.offset(colour, j, k));
        let at = self.board.first(j, k);
        let [c0, c1, c2, c3, c4, c5] = self.coefficients(colour, j, k, 0, n);
        let [x0, x1, x2, x3, x4, x5] = self.neighbours(other, colour, (j, k), 0, n);
        let inverse = self.inverse[colour].run(at, n);
        let b = b.run(at, n);
        let x = x.run_mut(at, n);
        for m in 0..n {
            let west_east = c0[m].mul_add(x0[m], c1[m].mul_add(x1[m], b[m]));
            let south_north = c2[m].mul_add(x2[m], c3[m] * x3[m]);
            let down_up = c4[m].mul_add(x4[m], c5[m] * x5[m]);
            x[m] = (west_east + (south_north + down_up)) * inverse[m];
        }
    }

    /// `into = A x` for the cells `m0..` of `colour` in a row.
    #[inline(always)]
    pub(super) fn apply(
        &self,
        colour: usize,
        (j, k): (isize, isize),
        m0: usize,
        x: [&impl Source; 2],
        into: &mut [f32],
    ) {
        let n = into.len();
        let [c0, c1, c2, c3, c4, c5] = self.coefficients(colour, j, k, m0, n);
        let [x0, x1, x2, x3, x4, x5] = self.neighbours(x[1 - colour], colour, (j, k), m0, n);
        let x = x[colour].run(self.board.first(j, k) + m0, n);
        for m in 0..n {
            let west_east = c0[m].mul_add(x[m] - x0[m], c1[m] * (x[m] - x1[m]));
            let south_north = c2[m].mul_add(x[m] - x2[m], c3[m] * (x[m] - x3[m]));
            let down_up = c4[m].mul_add(x[m] - x4[m], c5[m] * (x[m] - x5[m]));
            into[m] = west_east + (south_north + down_up);
        }
    }

    /// Sets the reciprocals of the diagonal of plane `k` from the coefficients.
    pub(super) fn invert_diagonal(&self, colour: usize, k: isize, inverse: &mut [f32]) {
        for j in 0..self.board.cells[1] as isize {
            let n = self.board.length(self.board.offset(colour, j, k));
            let [c0, c1, c2, c3, c4, c5] = self.coefficients(colour, j, k, 0, n);
            let at = (j + 1) as usize * self.board.width + 1;
            let inverse = &mut inverse[at..][..n];
            for m in 0..n {
                let diagonal = (c0[m] + c1[m]) + ((c2[m] + c3[m]) + (c4[m] + c5[m]));
                inverse[m] = if diagonal > 0.0 { 1.0 / diagonal } else { 0.0 };
            }
        }
    }
}
