//! Heights of the interface in columns of cells.
//!
//! In a column along a direction, between a cell full of liquid and one full of gas, the interface stands where the liquid of the
//! cells between, poured into the column, would reach: a mean over the width of the column that is exact however the interface is
//! bent in it. Cummins, Francois and Kothe (2005), Comput. Struct. 83, 425; Popinet (2009), J. Comput. Phys. 228, 5838, section 5.
//!
//! A height is kept in the cell that it lies in and in those below and above, so that a column is looked up from any cell near it. Columns
//! are seven cells around that with the height: where the interface is steep in two directions at once, five do not end. Of the two ghost
//! layers the third cell beyond the end of a rank is fetched by a field of its own.
//!
//! Heights along a wall go on behind it with the slope of the contact angle there: with the height h along x, liquid at smaller x, the
//! distance y from the wall and the third direction z
//!
//! ```text
//! dh/dy = -cot(theta) sqrt(1 + (dh/dz)^2)
//! ```
//!
//! between the first layer of cells and the one behind the wall, so that centred differences in the first have the angle at the wall
//! (Afkhami and Bussmann 2008, Int. J. Numer. Meth. Fluids 57, 453, and 2009, 61, 827). Between a receding and an advancing angle the line of
//! contact stays where it is (`pins.rs`). A column normal to such a wall ends in it where the
//! interface does not reach the wall in the column; where it does, it has no height.

use sazanami_numerics::Real;
use sazanami_numerics::domain::{Domain, Ghost, GhostRules, Location};
use sazanami_numerics::grid::Field;

use super::pins::{self, Pins};
use crate::boundary::{Boundary, Side};
use crate::interface::Wetting;

/// Fractions within this of 0 or 1 end a column.
pub(super) const PURE: Real = 1e-6;
/// Cells that a column reaches on either side of the cell with the height.
const REACH: isize = 3;
/// Cells around that at which a column is looked up: with what is kept in the cells beside, heights as far away as [`REACH`] are found.
const LOOKED_AT: isize = 2;
/// A height on the face between two cells is kept in both, rounding allowed for.
const ON_FACE: Real = 0.5 + 1e-9;
/// Added to a height with the liquid below it, subtracted with the liquid above: no height is zero.
const SHIFT: Real = 4.0;
/// What is behind an open side: neither full nor empty, so that no column ends there.
const NO_END: Real = 0.5;

/// Heights of the interface in the three directions: fields with all ghosts filled.
pub(crate) struct Heights {
    fields: [Field<Real>; 3],
    /// Rules of the ghosts of each.
    rules: [GhostRules; 3],
    /// The same that keep what is behind walls with an angle.
    kept: [GhostRules; 3],
    wetting: Wetting,
    pins: Pins,
    /// Heights along one direction in the cells that they lie in alone.
    own: Field<Real>,
    /// In the first ghost layer along one direction the liquid fraction of the third; then the new places of lines of contact.
    third: Field<Real>,
    third_rules: GhostRules,
}

impl Heights {
    /// Storage without heights.
    pub fn new(domain: &Domain, boundary: &Boundary) -> Self {
        Self {
            fields: std::array::from_fn(|_| domain.field(0.0)),
            rules: [0, 1, 2].map(|d| rules(boundary, d)),
            kept: [0, 1, 2].map(|d| kept_rules(boundary, d)),
            wetting: Wetting::new(domain, boundary),
            pins: Pins::new(domain, boundary),
            own: domain.field(0.0),
            third: domain.field(NO_END),
            third_rules: third_rules(boundary),
        }
    }

    /// Contact angles at the walls.
    pub fn wetting(&self) -> &Wetting {
        &self.wetting
    }

    /// Finds the heights of the liquid fraction `c`, all ghosts filled. Collective.
    pub fn find(&mut self, domain: &Domain, c: &Field<Real>) {
        for d in 0..3 {
            self.fetch_third(domain, c, d);
            self.find_own(domain, c, d);
            domain.fill_halos_to(1, &mut [(&mut self.own, &self.rules[d])]);
            self.keep_beside(domain, d);
        }
        let [f1, f2, f3] = self.fields.each_mut();
        let [r1, r2, r3] = &self.rules;
        domain.fill_halos(&mut [(f1, r1), (f2, r2), (f3, r3)]);
        self.go_on_behind_walls(domain);
    }

    /// Lets the heights along walls with an angle go on behind them; in the edge of two walls those behind one are mirrored at the other.
    fn go_on_behind_walls(&mut self, domain: &Domain) {
        for d in 0..3 {
            for wall in (0..3).filter(|&wall| wall != d) {
                for side in 0..2 {
                    if let Some(cotangents) = self.wetting.cotangents(wall, side) {
                        self.lean(domain, d, (wall, side), cotangents);
                    }
                }
            }
        }
        self.pins.fill_halos(domain, &self.kept);
        let [f1, f2, f3] = self.fields.each_mut();
        let [r1, r2, r3] = &self.kept;
        if [r1, r2, r3] != self.rules.each_ref() {
            domain.fill_halos(&mut [(f1, r1), (f2, r2), (f3, r3)]);
        }
    }

    /// Moves the mirror image of the heights along `d` in the first layer behind a wall as its angle does, between the advancing and the
    /// receding one with these cotangents.
    fn lean(&mut self, domain: &Domain, d: usize, (wall, side): (usize, usize), [least, most]: [Real; 2]) {
        let (third, spacing) = (3 - d - wall, domain.grid().spacing);
        let [stride, aside, inward] = [d, third, wall].map(|d| domain.strides()[d]);
        let (layer, inward) = if side == 0 { (-1, inward) } else { (domain.cells()[wall] as isize, -inward) };
        let mut range = domain.interior();
        range[wall] = layer..layer + 1;
        let Self { fields, own, third: next, pins, .. } = self;
        let (values, places) = (fields[d].data(), pins.at(d, wall));
        // Slope along the wall in a layer before it, beside a height; with a column missing the slope of the other half.
        let slope = |at: isize, up: bool, h: Real| {
            let beside = |by: isize| nearest(values, stride, at + by, up, h);
            let rise = match [beside(-aside), beside(0), beside(aside)] {
                [Some(low), _, Some(high)] => 0.5 * (high - low),
                [Some(low), Some(middle), None] => middle - low,
                [None, Some(middle), Some(high)] => high - middle,
                _ => return None,
            };
            Some(rise * spacing[d] / spacing[third])
        };
        let per_width = spacing[wall] / spacing[d];
        // How far the interface would move out of the liquid from the first layer to the one behind the wall as it does before it.
        let moves = |at: isize, up: bool, h: Real| {
            let [first, second, third] = [1, 2, 3].map(|n| nearest(values, stride, at + n * inward, up, h));
            let first = first? - second?;
            let by = third.map_or(first, |third| 2.0 * first - (second.unwrap_or(third) - third));
            Some(if up { by } else { -by })
        };
        domain.for_each_row(&range, (own.data_mut(), next.data_mut()), |row, (moved, next)| {
            for ((moved, next), at) in moved.iter_mut().zip(next).zip(row.shifted(0)) {
                *next = 0.0;
                *moved = told(values[at]).map_or(0.0, |(h, up)| {
                    let before = |layer: isize| slope(at as isize + layer * inward, up, h);
                    let on_wall = match [before(1), before(2)] {
                        [Some(first), Some(second)] => first + 0.5 * (first - second),
                        [first, second] => first.or(second).unwrap_or(0.0),
                    };
                    let unit = per_width * on_wall.hypot(1.0);
                    let by = if let Some(places) = places {
                        let to = |place: Real| if up { 2.0 * (place - h) } else { 2.0 * (h - place) };
                        let stands = pins::nearest(places, at as isize, stride, h).map(to);
                        let by = stands.or_else(|| moves(at as isize, up, h)).unwrap_or(0.0);
                        by.clamp(least * unit, most * unit)
                    } else {
                        least * unit
                    };
                    *next = pins::kept(if up { h + 0.5 * by } else { h - 0.5 * by });
                    let h = if up { h + by } else { h - by };
                    // Further away than any column is looked up.
                    if h.abs() < SHIFT { kept(h, up) } else { 0.0 }
                });
            }
        });
        let moved = own.data();
        domain.for_each_row(&range, fields[d].data_mut(), |row, field| {
            field.copy_from_slice(&moved[row.shifted(0)]);
        });
        pins.set(domain, (d, wall), &range, next);
    }

    /// Where lines of contact with two angles stand, for a restart: the direction along the wall, that of the wall, 0, or 1 for those of the
    /// upper wall before the same cells as the lower one, and places before it.
    pub fn pinned(&self, domain: &Domain) -> impl Iterator<Item = ([usize; 3], Field<Real>)> {
        self.pins.before_walls(domain)
    }

    /// Goes on with the places that `read` has for lines of contact with two angles.
    ///
    /// # Errors
    /// That of `read`.
    pub fn pin<E>(
        &mut self,
        domain: &Domain,
        read: impl Fn([usize; 3]) -> Result<Option<Field<Real>>, E>,
    ) -> Result<(), E> {
        for [d, wall, part] in (0..18).map(|n| [n / 6, n / 2 % 3, n % 2]) {
            if self.pins.at(d, wall).is_some()
                && part < pins::parts(domain, wall)
                && let Some(before) = read([d, wall, part])?
            {
                self.pins.resume(domain, [d, wall, part], &before);
            }
        }
        self.pins.fill_halos(domain, &self.kept);
        Ok(())
    }

    /// Brings the liquid fraction of the third ghost layer along `d` into the first of `third`: that of a cell in the last layer of a
    /// neighbour, or of the mirror image, is the liquid fraction two cells further in.
    fn fetch_third(&mut self, domain: &Domain, c: &Field<Real>, d: usize) {
        let (c, by, last) = (c.data(), 2 * domain.strides()[d], domain.cells()[d] as isize - 1);
        for (layer, inward) in [(0, by), (last, -by)] {
            let mut range = domain.interior();
            range[d] = layer..layer + 1;
            domain.for_each_row(&range, self.third.data_mut(), |row, third| {
                third.copy_from_slice(&c[row.shifted(inward)]);
            });
        }
        domain.fill_halos_to(1, &mut [(&mut self.third, &self.third_rules)]);
    }

    /// Finds the heights along `d` that lie in the cells.
    fn find_own(&mut self, domain: &Domain, c: &Field<Real>, d: usize) {
        let (c, third, stride) = (c.data(), self.third.data(), domain.strides()[d]);
        let wetting = self.wetting;
        let has_angle = [0, 1].map(|side| wetting.cotangents(d, side).is_some());
        let last = domain.cells()[d] as isize - 1;
        domain.for_each_row(&domain.interior(), self.own.data_mut(), |row, own| {
            let ([below, here], above) = ([-stride, 0].map(|by| &c[row.shifted(by)]), &c[row.shifted(stride)]);
            for (i, own) in own.iter_mut().enumerate() {
                *own = 0.0;
                if is_far([below[i], here[i], above[i]]) {
                    continue;
                }
                let at = (row.start + i) as isize;
                let index = [row.first + i as isize, row.j, row.k][d];
                let cell = |offset: isize| {
                    let behind = [-index - offset, index + offset - last];
                    if let Some(side) = (0..2).find(|&side| has_angle[side] && behind[side] > 0) {
                        let before = if side == 0 { -index } else { last - index };
                        wetting.end(c, (at + before * stride) as usize, d, side)
                    } else if index == 0 && offset == -REACH {
                        third[(at - stride) as usize]
                    } else if index == last && offset == REACH {
                        third[(at + stride) as usize]
                    } else {
                        c[(at + offset * stride) as usize]
                    }
                };
                if let Some((h, up)) = height(cell) {
                    *own = kept(h, up);
                }
            }
        });
    }

    /// Keeps the heights along `d` in the cells that they lie in, and in those without one the nearest of the cells beside.
    fn keep_beside(&mut self, domain: &Domain, d: usize) {
        let (own, stride) = (self.own.data(), domain.strides()[d]);
        domain.for_each_row(&domain.interior(), self.fields[d].data_mut(), |row, field| {
            let ([below, here], above) = ([-stride, 0].map(|by| &own[row.shifted(by)]), &own[row.shifted(stride)]);
            for (i, field) in field.iter_mut().enumerate() {
                *field = if here[i] == 0.0 { nearest_beside(below[i], above[i]) } else { here[i] };
            }
        });
    }

    /// The height along direction `d` that lies in a cell, from the cell's centre, in cells, and whether the liquid is below.
    #[inline]
    pub fn in_cell(&self, d: usize, at: usize) -> Option<(Real, bool)> {
        told(self.fields[d].data()[at]).filter(|(h, _)| h.abs() <= ON_FACE)
    }

    /// The height in the column along `d` through the cell at `at`, from that cell's centre, that is nearest to `near`, both in cells, and
    /// lies within three cells of that cell; with the liquid below if `up`, else above.
    pub fn in_column(&self, d: usize, at: usize, up: bool, near: Real) -> Option<Real> {
        nearest(self.fields[d].data(), self.fields[d].strides()[d] as isize, at as isize, up, near)
    }
}

/// [`Heights::in_column`] of the heights `values` along a direction with this `stride`.
fn nearest(values: &[Real], stride: isize, at: isize, up: bool, near: Real) -> Option<Real> {
    let mut best: Option<Real> = None;
    for offset in -LOOKED_AT..=LOOKED_AT {
        let Some((h, _)) = told(values[(at + offset * stride) as usize]).filter(|&(_, is_up)| is_up == up) else {
            continue;
        };
        let h = offset as Real + h;
        if best.is_none_or(|best| (h - near).abs() < (best - near).abs()) {
            best = Some(h);
        }
    }
    best
}

/// A height as it is kept.
#[inline]
fn kept(h: Real, up: bool) -> Real {
    if up { h + SHIFT } else { h - SHIFT }
}

/// What is kept as a height, and whether the liquid is below it.
#[inline]
fn told(value: Real) -> Option<(Real, bool)> {
    (value != 0.0).then_some(if value > 0.0 { (value - SHIFT, true) } else { (value + SHIFT, false) })
}

/// The nearer of the heights in the cells below and above, as it is kept.
fn nearest_beside(below: Real, above: Real) -> Real {
    let below = told(below).map(|(h, up)| (h - 1.0, up));
    let above = told(above).map(|(h, up)| (h + 1.0, up));
    let nearest = match (below, above) {
        (Some(below), Some(above)) => Some(if above.0.abs() < below.0.abs() { above } else { below }),
        (below, above) => below.or(above),
    };
    nearest.map_or(0.0, |(h, up)| kept(h, up))
}

/// Whether three cells in a row are all full or all empty, so that no column ends beside the middle one.
#[inline]
fn is_far(cells: [Real; 3]) -> bool {
    cells.iter().all(|&c| c > 1.0 - PURE) || cells.iter().all(|&c| c < PURE)
}

/// The one height that lies in the middle cell of a column, from its centre, in cells, and whether the liquid is below it; `cell` is the
/// liquid fraction of the cells around that. `None` if there is none, or two.
fn height(cell: impl Fn(isize) -> Real) -> Option<(Real, bool)> {
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

/// At walls the liquid is continued as its mirror image, before an angle moves it. Behind open sides there are no heights normal to
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

/// The rules of heights along `d` once those behind walls with an angle are found.
fn kept_rules(boundary: &Boundary, d: usize) -> GhostRules {
    let mut kept = rules(boundary, d);
    for wall in (0..3).filter(|&wall| wall != d) {
        for side in (0..2).filter(|&side| boundary.cotangents(wall, side) != [0.0; 2]) {
            kept.sides[wall][side] = Ghost::Kept;
        }
    }
    kept
}

/// Of the third ghost layer: walls are planes of symmetry.
fn third_rules(boundary: &Boundary) -> GhostRules {
    let sides = boundary.sides().map(|sides| {
        sides.map(|side| match side {
            Side::NoSlip | Side::Slip | Side::Moving { .. } | Side::Periodic => Ghost::Even,
            Side::Inflow { .. } | Side::Outflow | Side::FixedPressure { .. } => Ghost::Constant { value: NO_END },
        })
    });
    GhostRules { location: Location::Cell, sides }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn in_middle<const N: usize>(column: [Real; N], at: isize) -> Option<(Real, bool)> {
        height(|offset| usize::try_from(at + offset).ok().and_then(|n| column.get(n).copied()).unwrap_or(NO_END))
    }

    #[test]
    fn liquid_between_the_ends_of_a_column_gives_its_height() {
        let up = [1.0, 1.0, 1.0, 0.75, 0.5, 0.0, 0.0, 0.0];
        assert_eq!([2, 3, 4, 5].map(|at| in_middle(up, at)), [None, None, Some((-0.25, true)), None]);
        let down = [0.0, 0.0, 0.5, 0.75, 1.0, 1.0];
        assert_eq!([2, 3].map(|at| in_middle(down, at)), [Some((0.25, false)), None]);
        let flat = [1.0, 1.0, 1.0, 0.0, 0.0, 0.0];
        assert_eq!([2, 3].map(|at| in_middle(flat, at)), [Some((0.5, true)), Some((-0.5, true))]);
        let long = [1.0, 0.875, 0.75, 0.5, 0.25, 0.125, 0.0];
        assert_eq!([2, 3, 4].map(|at| in_middle(long, at)), [None, Some((0.0, true)), None]);
    }

    #[test]
    fn columns_that_do_not_end_have_no_height() {
        for column in [
            [0.95, 0.9, 0.8, 0.5, 0.2, 0.1, 0.05],
            [1.0, 1.0, 0.5, 0.5, 0.5, 1.0, 1.0],
            [0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0],
            [0.0; 7],
        ] {
            assert_eq!(in_middle(column, 3), None, "{column:?}");
        }
    }

    #[test]
    fn of_two_heights_beside_a_cell_the_nearer_is_kept() {
        let (below, above) = (kept(0.4, true), kept(-0.45, false));
        assert_eq!(told(nearest_beside(below, 0.0)).map(|(h, up)| ((h * 10.0).round(), up)), Some((-6.0, true)));
        assert_eq!(told(nearest_beside(below, above)).map(|(_, up)| up), Some(false));
        assert_eq!(nearest_beside(0.0, 0.0), 0.0);
    }
}
