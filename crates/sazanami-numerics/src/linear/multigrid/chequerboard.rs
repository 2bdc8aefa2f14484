//! Storage of cell values with the two colours of a chequerboard apart, so that an update of all
//! cells of one colour runs over contiguous memory.
//!
//! A cell has colour `(i + j + k + parity) & 1` of its local indices, where `parity` makes colours
//! agree between ranks. In a row `(j, k)` the cells of one colour are `i = 2 m + o`, `m = 0, 1, ..`:
//! `o` is the row's offset for that colour. Neighbours of the cell at `m` are of the other colour:
//! at `m` in the rows beside, above and below, and at `m + o - 1`, `m + o` in its own row.

/// Values of the cells of colour 0 and of colour 1, one ghost layer on every side included.
pub(crate) type Colours = [Vec<f32>; 2];

/// Places of cells in [`Colours`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Chequerboard {
    /// Cells of this rank in each direction.
    pub cells: [usize; 3],
    /// Sum of the global indices of the first cell, modulo 2.
    pub parity: usize,
    /// Values in a row of one colour, ghosts included.
    pub width: usize,
}

impl Chequerboard {
    pub(crate) fn new(cells: [usize; 3], start: [usize; 3]) -> Self {
        Self { cells, parity: start.iter().sum::<usize>() & 1, width: cells[0].div_ceil(2) + 2 }
    }

    /// Values in a plane of one colour.
    pub(crate) fn plane(&self) -> usize {
        self.width * (self.cells[1] + 2)
    }

    /// Zero everywhere.
    pub(crate) fn zeros(&self) -> Colours {
        let length = self.plane() * (self.cells[2] + 2);
        [vec![0.0; length], vec![0.0; length]]
    }

    /// Number of the row `(j, k)`, counted over all rows, ghosts included.
    #[inline]
    pub(crate) fn row(&self, j: isize, k: isize) -> usize {
        (k + 1) as usize * (self.cells[1] + 2) + (j + 1) as usize
    }

    /// Place of `m = 0` in the row `(j, k)`.
    #[inline]
    pub(crate) fn first(&self, j: isize, k: isize) -> usize {
        self.row(j, k) * self.width + 1
    }

    /// First local index in x1 of a cell of `colour` in the row `(j, k)`: 0 or 1.
    #[inline]
    pub(crate) fn offset(&self, colour: usize, j: isize, k: isize) -> usize {
        (colour + self.parity).wrapping_add_signed(j + k) & 1
    }

    /// Colour of the cell `(i, j, k)`; also of the cells with offset `i` in the row `(j, k)`.
    #[inline]
    pub(crate) fn colour(&self, i: usize, j: isize, k: isize) -> usize {
        (i + self.parity).wrapping_add_signed(j + k) & 1
    }

    /// Number of cells with this offset in a row.
    #[inline]
    pub(crate) fn length(&self, offset: usize) -> usize {
        (self.cells[0] + 1 - offset) / 2
    }
}
