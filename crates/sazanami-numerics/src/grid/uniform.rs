//! A uniform Cartesian grid over a box, described globally (the same on every rank).

use crate::{Real, Vector};

/// A box divided into equal cells. `x3` (component `z`) points up.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Grid {
    /// Number of cells in each direction.
    pub cells: [usize; 3],
    /// Lower corner of the box \[m].
    pub lower: Vector,
    /// Edge lengths of a cell \[m].
    pub spacing: Vector,
}

impl Grid {
    /// Divides the box from `lower` to `upper` \[m] into `cells` equal cells.
    ///
    /// # Panics
    /// If a direction has no cells or the box no extent; callers check user input before.
    #[must_use]
    pub fn new(cells: [usize; 3], lower: Vector, upper: Vector) -> Self {
        assert!(cells.iter().all(|&n| n > 0), "a grid needs at least one cell in every direction");
        assert!((upper - lower).min_element() > 0.0, "a grid needs a box of positive extent");
        let counts = Vector::new(cells[0] as Real, cells[1] as Real, cells[2] as Real);
        Self { cells, lower, spacing: (upper - lower) / counts }
    }

    /// Upper corner of the box \[m].
    #[must_use]
    pub fn upper(&self) -> Vector {
        self.lower + self.extent()
    }

    /// Edge lengths of the box \[m].
    #[must_use]
    pub fn extent(&self) -> Vector {
        self.spacing * Vector::new(self.cells[0] as Real, self.cells[1] as Real, self.cells[2] as Real)
    }

    /// Shortest and longest edge of a cell among the directions of more than one cell, among all in a single cell \[m]: a slice has nothing to
    /// resolve along the direction of its one cell.
    #[must_use]
    pub fn divided_edges(&self) -> [Real; 2] {
        let divided = || (0..3).filter(|&d| self.cells[d] > 1).map(|d| self.spacing[d]);
        let shortest = divided().reduce(Real::min).unwrap_or(self.spacing.min_element());
        [shortest, divided().reduce(Real::max).unwrap_or(self.spacing.max_element())]
    }

    /// Number of cells across a body of this `width` \[m]: by the longest edge, but for directions of one cell that the body spans.
    #[must_use]
    pub fn cells_across(&self, width: Real) -> Real {
        let counted = (0..3).filter(|&d| self.cells[d] > 1 || self.spacing[d] > width).map(|d| self.spacing[d]);
        width / counted.reduce(Real::max).unwrap_or(self.spacing.max_element())
    }

    /// Volume of a cell [m^3].
    #[must_use]
    pub fn cell_volume(&self) -> Real {
        self.spacing.x * self.spacing.y * self.spacing.z
    }

    /// Area of a cell face with normal along `direction` [m^2].
    #[must_use]
    pub fn face_area(&self, direction: usize) -> Real {
        self.cell_volume() / self.spacing[direction]
    }

    /// Total number of cells.
    #[must_use]
    pub fn len(&self) -> usize {
        self.cells.iter().product()
    }

    /// Whether the grid has no cells (it never has).
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Centre of the cell with global indices `(i, j, k)` \[m]; indices may lie outside the box.
    #[must_use]
    pub fn centre(&self, i: isize, j: isize, k: isize) -> Vector {
        self.lower + self.spacing * Vector::new(i as Real + 0.5, j as Real + 0.5, k as Real + 0.5)
    }

    /// Global indices of the cell that holds `position` (may lie outside the box).
    #[must_use]
    pub fn cell_of(&self, position: Vector) -> [isize; 3] {
        let s = ((position - self.lower) / self.spacing).floor();
        [s.x as isize, s.y as isize, s.z as isize]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_slice_counts_no_cells_along_the_direction_that_a_body_spans() {
        let of = |cells: [usize; 3], upper: Vector| Grid::new(cells, Vector::ZERO, upper);
        let thick = of([100, 1, 100], Vector::new(20.0, 5.0, 20.0));
        assert_eq!(thick.divided_edges(), [0.2, 0.2]);
        // Spheres within the slice, and a cylinder that spans it.
        assert_eq!(thick.cells_across(1.0), 0.2);
        assert_eq!(thick.cells_across(5.0), 25.0);
        let thin = of([100, 1, 50], Vector::new(20.0, 0.02, 20.0));
        assert_eq!((thin.divided_edges(), thin.cells_across(1.6)), ([0.2, 0.4], 4.0));
        // Control: three divided directions count the longest edge, whatever the body.
        assert_eq!(of([100, 10, 100], Vector::new(20.0, 5.0, 20.0)).cells_across(1.0), 2.0);
    }
}
