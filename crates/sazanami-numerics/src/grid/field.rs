//! A quantity on the cells (or on the lower faces of the cells) of a rank's part of the grid.

use std::ops::{Index, IndexMut};

/// Ghost layers on every side of a field.
pub const GHOSTS: usize = 2;

/// Values on the cells of a rank, with [`GHOSTS`] ghost layers on every side.
///
/// `x1` runs fastest, `x3` slowest. A face quantity normal to direction `d` uses the same extents:
/// the value of a cell belongs to its lower face, and the upper face of the last cell is the first
/// ghost value behind it.
#[derive(Clone, Debug, PartialEq)]
pub struct Field<T> {
    cells: [usize; 3],
    data: Vec<T>,
}

impl<T: Copy> Field<T> {
    /// A field of `cells` interior cells, everywhere (ghosts too) equal to `value`.
    #[must_use]
    pub fn new(cells: [usize; 3], value: T) -> Self {
        Self { cells, data: vec![value; cells.iter().map(|n| n + 2 * GHOSTS).product()] }
    }

    /// Number of interior cells in each direction.
    #[must_use]
    pub fn cells(&self) -> [usize; 3] {
        self.cells
    }

    /// Distance in memory between neighbours in each direction.
    #[must_use]
    pub fn strides(&self) -> [usize; 3] {
        let width = self.cells[0] + 2 * GHOSTS;
        [1, width, width * (self.cells[1] + 2 * GHOSTS)]
    }

    /// Place in memory of the cell with local indices; ghosts have indices below 0 or from `n` on.
    #[inline]
    #[must_use]
    pub fn at(&self, i: isize, j: isize, k: isize) -> usize {
        let ghosts = GHOSTS as isize;
        let [_, width, plane] = self.strides();
        ((k + ghosts) * plane as isize + (j + ghosts) * width as isize + (i + ghosts)) as usize
    }

    /// All values, ghosts included.
    #[must_use]
    pub fn data(&self) -> &[T] {
        &self.data
    }

    /// All values, ghosts included.
    pub fn data_mut(&mut self) -> &mut [T] {
        &mut self.data
    }

    /// Sets every value, ghosts included.
    pub fn fill(&mut self, value: T) {
        self.data.fill(value);
    }

    /// The interior values of the row of cells `(.., j, k)`.
    #[must_use]
    pub fn row(&self, j: isize, k: isize) -> &[T] {
        let start = self.at(0, j, k);
        &self.data[start..start + self.cells[0]]
    }
}

impl<T: Copy> Index<[isize; 3]> for Field<T> {
    type Output = T;

    #[inline]
    fn index(&self, [i, j, k]: [isize; 3]) -> &T {
        &self.data[self.at(i, j, k)]
    }
}

impl<T: Copy> IndexMut<[isize; 3]> for Field<T> {
    #[inline]
    fn index_mut(&mut self, [i, j, k]: [isize; 3]) -> &mut T {
        let at = self.at(i, j, k);
        &mut self.data[at]
    }
}
