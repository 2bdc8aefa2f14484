//! Loops over the rows of cells of a rank.

use std::ops::Range;

use sazanami_parallel::{SlicesMut, for_each_chunk, reduce_over};

use super::Domain;
use crate::Real;
use crate::grid::{Field, GHOSTS};

/// A run of neighbouring cells `(first.., j, k)` in x1.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Row {
    /// Local index of the first cell in x1.
    pub first: isize,
    /// Local index in x2.
    pub j: isize,
    /// Local index in x3.
    pub k: isize,
    /// Place in memory of the first cell, the same in all fields of the domain.
    pub start: usize,
    /// Number of cells.
    pub len: usize,
}

impl Row {
    /// Places in memory of the row's cells moved by `shift` values.
    #[inline]
    #[must_use]
    pub fn shifted(&self, shift: isize) -> Range<usize> {
        let start = (self.start as isize + shift) as usize;
        start..start + self.len
    }
}

/// Local index ranges of a block of cells, ghosts allowed.
pub type Range3 = [Range<isize>; 3];

impl Domain {
    /// The interior cells of this rank.
    #[must_use]
    pub fn interior(&self) -> Range3 {
        self.cells.map(|n| 0..n as isize)
    }

    /// The interior cells and `layers` ghost layers on every side.
    #[must_use]
    pub fn interior_and(&self, layers: isize) -> Range3 {
        self.cells.map(|n| -layers..n as isize + layers)
    }

    /// The lower faces normal to `direction` of the interior cells, and the upper face of the last.
    #[must_use]
    pub fn faces(&self, direction: usize) -> Range3 {
        std::array::from_fn(|d| 0..(self.cells[d] + usize::from(d == direction)) as isize)
    }

    /// Distance in memory between neighbours in each direction, the same in all fields.
    #[must_use]
    pub fn strides(&self) -> [isize; 3] {
        let width = self.cells.map(|n| (n + 2 * GHOSTS) as isize);
        [1, width[0], width[0] * width[1]]
    }

    fn row(&self, range: &Range3, j: isize, k: isize) -> Row {
        let [_, width, plane] = self.strides();
        let ghosts = GHOSTS as isize;
        let first = range[0].start;
        let start = ((k + ghosts) * plane + (j + ghosts) * width + first + ghosts) as usize;
        Row { first, j, k, start, len: range[0].len() }
    }

    /// Calls `body(row, slices of that row)` for every row of `range`: read many, write one.
    ///
    /// `slices` are the whole data (ghosts included) of the fields written; planes of x3 are spread
    /// over the threads.
    #[track_caller]
    pub fn for_each_row<S: SlicesMut>(&self, range: &Range3, slices: S, body: impl Fn(Row, S) + Sync) {
        let plane = self.strides()[2] as usize;
        let first = (range[2].start + GHOSTS as isize) as usize;
        let planes = slices.cut(first * plane).1.cut(range[2].len() * plane).0;
        for_each_chunk(planes, plane, |number, mut rest| {
            let k = range[2].start + number as isize;
            let mut reached = (first + number) * plane;
            for j in range[1].clone() {
                let row = self.row(range, j, k);
                let (values, behind) = rest.cut(row.start - reached).1.cut(row.len);
                reached = row.start + row.len;
                rest = behind;
                body(row, values);
            }
        });
    }

    /// Sets every interior value of `field` to `value(i, j, k)` of its local indices.
    #[track_caller]
    pub fn set<T: Copy + Send>(&self, field: &mut Field<T>, value: impl Fn(isize, isize, isize) -> T + Sync) {
        self.for_each_row(&self.interior(), field.data_mut(), |row, values| {
            for (i, v) in values.iter_mut().enumerate() {
                *v = value(i as isize, row.j, row.k);
            }
        });
    }

    /// Sums `part(row)` over the rows of `range` on this rank, in an order that does not depend on
    /// the number of threads.
    #[track_caller]
    pub fn sum_rows<const N: usize>(&self, range: &Range3, part: impl Fn(Row) -> [Real; N] + Sync) -> [Real; N] {
        let add = |a: [Real; N], b: [Real; N]| std::array::from_fn(|n| a[n] + b[n]);
        let plane = |number: usize| {
            let k = range[2].start + number as isize;
            range[1].clone().fold([0.0; N], |sum, j| add(sum, part(self.row(range, j, k))))
        };
        reduce_over(range[2].len(), plane, add).unwrap_or([0.0; N])
    }

    /// Largest `part(row)` over the rows of `range` on this rank; NaN if one is NaN.
    #[track_caller]
    pub fn max_rows(&self, range: &Range3, part: impl Fn(Row) -> Real + Sync) -> Real {
        sazanami_parallel::max_over(range[2].len(), |number| {
            let k = range[2].start + number as isize;
            let max = |a, b| sazanami_parallel::Reduction::Max.combine(a, b);
            range[1].clone().map(|j| part(self.row(range, j, k))).fold(Real::NEG_INFINITY, max)
        })
    }
}
