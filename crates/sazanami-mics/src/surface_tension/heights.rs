//! Heights of the interface in columns of cells.
//!
//! In a column along a direction, between a cell full of liquid and one full of gas, the interface stands where the liquid of the
//! cells between, poured into the column, would reach: a mean over the width of the column that is exact however the interface is
//! bent in it. Cummins, Francois and Kothe (2005), Comput. Struct. 83, 425; Popinet (2009), J. Comput. Phys. 228, 5838, section 5.
//!
//! A height is kept in the cell that it lies in, so that a column is looked up from any cell near it; with columns of five cells
//! around that cell and heights looked up two cells away, two ghost layers are enough.

use sazanami_numerics::Real;
use sazanami_numerics::domain::{Domain, Ghost, GhostRules, Location};
use sazanami_numerics::grid::Field;

use crate::boundary::{Boundary, Side};

/// Fractions within this of 0 or 1 end a column.
pub(super) const PURE: Real = 1e-6;
/// Cells that a column reaches on either side of the cell with the height.
const REACH: isize = 2;
/// A height on the face between two cells is kept in both, rounding allowed for.
const ON_FACE: Real = 0.5 + 1e-9;
/// Added to a height with the liquid below it, subtracted with the liquid above: no height is zero.
const SHIFT: Real = 4.0;

/// Heights of the interface in the three directions: fields with all ghosts filled.
pub(super) struct Heights {
    fields: [Field<Real>; 3],
    /// Rules of the ghosts of each.
    rules: [GhostRules; 3],
}

impl Heights {
    /// Storage without heights.
    pub fn new(domain: &Domain, boundary: &Boundary) -> Self {
        Self { fields: std::array::from_fn(|_| domain.field(0.0)), rules: [0, 1, 2].map(|d| rules(boundary, d)) }
    }

    /// Finds the heights of the liquid fraction `c`, all ghosts filled. Collective.
    pub fn find(&mut self, domain: &Domain, c: &Field<Real>) {
        let (c, strides) = (c.data(), domain.strides());
        let [h1, h2, h3] = self.fields.each_mut().map(Field::data_mut);
        domain.for_each_row(&domain.interior(), (h1, h2, h3), |row, (h1, h2, h3)| {
            for (h, stride) in [h1, h2, h3].into_iter().zip(strides) {
                let ([below, here], above) = ([-stride, 0].map(|by| &c[row.shifted(by)]), &c[row.shifted(stride)]);
                for (i, h) in h.iter_mut().enumerate() {
                    *h = if is_far([below[i], here[i], above[i]]) {
                        0.0
                    } else {
                        height(c, row.start + i, stride).map_or(0.0, |(h, up)| if up { h + SHIFT } else { h - SHIFT })
                    };
                }
            }
        });
        let [f1, f2, f3] = self.fields.each_mut();
        let [r1, r2, r3] = &self.rules;
        domain.fill_halos(&mut [(f1, r1), (f2, r2), (f3, r3)]);
    }

    /// The height along direction `d` that lies in a cell, from the cell's centre, in cells, and whether the liquid is below.
    #[inline]
    pub fn in_cell(&self, d: usize, at: usize) -> Option<(Real, bool)> {
        let value = self.fields[d].data()[at];
        (value != 0.0).then_some(if value > 0.0 { (value - SHIFT, true) } else { (value + SHIFT, false) })
    }

    /// The height in the column along `d` through the cell at `at`, from that cell's centre, that is nearest to `near`, both in cells, and
    /// lies within two cells of that cell; with the liquid below if `up`, else above.
    pub fn in_column(&self, d: usize, at: usize, up: bool, near: Real) -> Option<Real> {
        self.nearest_in_column(d, at, up, near).map(|(h, _)| h)
    }

    /// The same, and the place in memory of the cell that it lies in.
    pub fn nearest_in_column(&self, d: usize, at: usize, up: bool, near: Real) -> Option<(Real, usize)> {
        let (values, stride) = (self.fields[d].data(), self.fields[d].strides()[d] as isize);
        let mut best: Option<(Real, usize)> = None;
        for offset in -REACH..=REACH {
            let place = (at as isize + offset * stride) as usize;
            let value = values[place];
            if value == 0.0 || (value > 0.0) != up {
                continue;
            }
            let h = offset as Real + if up { value - SHIFT } else { value + SHIFT };
            if best.is_none_or(|(best, _)| (h - near).abs() < (best - near).abs()) {
                best = Some((h, place));
            }
        }
        best
    }
}

/// Whether three cells in a row are all full or all empty, so that no column ends beside the middle one.
#[inline]
fn is_far(cells: [Real; 3]) -> bool {
    cells.iter().all(|&c| c > 1.0 - PURE) || cells.iter().all(|&c| c < PURE)
}

/// The one height in the column with this `stride` that lies in the cell at `at`, from its centre, in cells, and whether the liquid is
/// below it. `None` if there is none, or two.
fn height(c: &[Real], at: usize, stride: isize) -> Option<(Real, bool)> {
    let cell = |offset: isize| c[(at as isize + offset * stride) as usize];
    let side = |towards: isize| {
        // The full end lies against `towards`, the empty one in it.
        let full = (0..=REACH).find(|&n| cell(-n * towards) > 1.0 - PURE)?;
        let empty = (0..=REACH).find(|&n| cell(n * towards) < PURE)?;
        // Nothing pure of the other kind may lie between.
        let is_mixed = |n: isize| (PURE..=1.0 - PURE).contains(&cell(n * towards));
        if !(1 - full..empty).all(is_mixed) {
            return None;
        }
        let liquid: Real = (-full..=empty).map(|n| cell(n * towards)).sum();
        let h = liquid - full as Real - 0.5;
        (h.abs() <= ON_FACE).then_some(h)
    };
    match (side(1), side(-1)) {
        (Some(h), None) => Some((h, true)),
        (None, Some(h)) => Some((-h, false)),
        _ => None,
    }
}

/// At walls the liquid is continued as its mirror image, a contact angle of 90 degrees. Behind open sides there are no heights normal to
/// them.
fn rules(boundary: &Boundary, d: usize) -> GhostRules {
    let sides = std::array::from_fn(|direction| {
        boundary.sides()[direction].map(|side| match side {
            Side::NoSlip | Side::Slip | Side::Moving { .. } if direction == d => Ghost::Odd { wall: 0.0 },
            Side::NoSlip | Side::Slip | Side::Moving { .. } | Side::Periodic => Ghost::Even,
            Side::Inflow { .. } | Side::Outflow | Side::FixedPressure { .. } if direction == d => {
                Ghost::Constant { value: 0.0 }
            }
            Side::Inflow { .. } | Side::Outflow | Side::FixedPressure { .. } => Ghost::Nearest,
        })
    });
    GhostRules { location: Location::Cell, sides }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn liquid_between_the_ends_of_a_column_gives_its_height() {
        let up = [1.0, 1.0, 1.0, 0.75, 0.5, 0.0, 0.0, 0.0];
        assert_eq!([2, 3, 4, 5].map(|at| height(&up, at, 1)), [None, None, Some((-0.25, true)), None]);
        let down = [0.0, 0.0, 0.5, 0.75, 1.0, 1.0];
        assert_eq!([2, 3].map(|at| height(&down, at, 1)), [Some((0.25, false)), None]);
        let flat = [1.0, 1.0, 1.0, 0.0, 0.0, 0.0];
        assert_eq!([2, 3].map(|at| height(&flat, at, 1)), [Some((0.5, true)), Some((-0.5, true))]);
    }

    #[test]
    fn columns_that_do_not_end_have_no_height() {
        for column in [[0.9, 0.8, 0.5, 0.2, 0.1], [1.0, 0.5, 0.5, 0.5, 1.0], [0.0, 0.0, 1.0, 0.0, 0.0], [0.0; 5]] {
            assert_eq!(height(&column, 2, 1), None, "{column:?}");
        }
    }
}
