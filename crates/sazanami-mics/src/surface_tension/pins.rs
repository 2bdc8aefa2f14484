//! Lines of contact that stand still between a receding and an advancing angle.
//!
//! Where a line of contact stands on a wall is remembered. The interface goes on behind the wall through that place, which gives it the
//! angle there; only where that is larger than the advancing or smaller than the receding one does the line move, to where it has that one
//! (Fang, Hidrovo, Wang, Eaton and Goodson 2008, Int. J. Multiphase Flow 34, 690). A flow that shears the liquid beside the wall past its
//! line of contact so bends the interface until surface tension holds the liquid, as in a drop that hangs on a pane.

use sazanami_numerics::Real;
use sazanami_numerics::domain::{Domain, GhostRules, Range3};
use sazanami_numerics::grid::Field;

use crate::boundary::Boundary;

/// Added to a place, so that none is zero.
const SHIFT: Real = 8.0;
/// Largest distance between an interface in the first layer and the place of its line of contact, in cells.
const REACH: Real = 4.0;

/// Places of the lines of contact in which interfaces along a direction meet walls normal to another.
pub(super) struct Pins {
    /// In the layer behind the wall, from the middle of the cell in cells; no field where no wall has two angles.
    fields: [[Option<Field<Real>>; 3]; 3],
}

impl Pins {
    pub fn new(domain: &Domain, boundary: &Boundary) -> Self {
        let has_two = |wall: usize| (0..2).map(|side| boundary.cotangents(wall, side)).any(|[a, b]| a != b);
        let field = |d: usize, wall: usize| (d != wall && has_two(wall)).then(|| domain.field(0.0));
        Self { fields: std::array::from_fn(|d| std::array::from_fn(|wall| field(d, wall))) }
    }

    /// Those along `d` at walls normal to `wall`, by place in memory.
    pub fn at(&self, d: usize, wall: usize) -> Option<&[Real]> {
        self.fields[d][wall].as_ref().map(Field::data)
    }

    /// Takes those along `d` in the layer `range` behind a wall normal to `wall` from `next`; [`Self::fill_halos`] is to follow.
    pub fn set(&mut self, domain: &Domain, (d, wall): (usize, usize), range: &Range3, next: &Field<Real>) {
        if let Some(field) = &mut self.fields[d][wall] {
            domain.for_each_row(range, field.data_mut(), |row, field| {
                field.copy_from_slice(&next.data()[row.shifted(0)]);
            });
        }
    }

    /// Fills the ghosts of those along each direction by its rules `kept`. Collective: of ranks that touch none of the walls too.
    pub fn fill_halos(&mut self, domain: &Domain, kept: &[GhostRules; 3]) {
        for (fields, kept) in self.fields.iter_mut().zip(kept) {
            fields.iter_mut().flatten().for_each(|field| domain.fill_halos_to(1, &mut [(field, kept)]));
        }
    }

    /// All of them with the direction, the wall and the part of each, brought before the wall: for a restart.
    pub fn before_walls(&self, domain: &Domain) -> impl Iterator<Item = ([usize; 3], Field<Real>)> {
        self.fields
            .iter()
            .enumerate()
            .flat_map(|(d, fields)| fields.iter().enumerate().map(move |(wall, field)| (d, wall, field)))
            .filter_map(|(d, wall, field)| Some((d, wall, field.as_ref()?)))
            .flat_map(|(d, wall, from)| (0..parts(domain, wall)).map(move |part| ([d, wall, part], from)))
            .map(|([d, wall, part], from)| {
                let mut before = domain.field(0.0);
                for (layer, by) in layers(domain, wall, part) {
                    domain.for_each_row(&layer, before.data_mut(), |row, before| {
                        before.copy_from_slice(&from.data()[row.shifted(by)]);
                    });
                }
                ([d, wall, part], before)
            })
    }

    /// Goes on with the places along `d` that a restart gives the cells before walls normal to `wall`; [`Self::fill_halos`] is to follow.
    pub fn resume(&mut self, domain: &Domain, [d, wall, part]: [usize; 3], before: &Field<Real>) {
        for (mut layer, by) in layers(domain, wall, part) {
            layer[wall] = layer[wall].start + by.signum()..layer[wall].end + by.signum();
            let mut next = domain.field(0.0);
            domain.for_each_row(&layer, next.data_mut(), |row, next| {
                next.copy_from_slice(&before.data()[row.shifted(-by)])
            });
            self.set(domain, (d, wall), &layer, &next);
        }
    }
}

/// Fields that take the places before walls normal to `wall`: one, or one for each side where both are before the same layer of cells.
pub(super) fn parts(domain: &Domain, wall: usize) -> usize {
    if domain.grid().cells[wall] == 1 { 2 } else { 1 }
}

/// The first and the last layer of cells along `wall`, those that are in field `part` of [`parts`], and how far on in memory what lies
/// behind the walls is.
fn layers(domain: &Domain, wall: usize, part: usize) -> impl Iterator<Item = (Range3, isize)> {
    let last = domain.cells()[wall] as isize - 1;
    let all = [(0, -1), (last, 1)].into_iter().skip(part).take(3 - parts(domain, wall));
    all.map(move |(layer, sign)| {
        let mut range = domain.interior();
        range[wall] = layer..layer + 1;
        (range, sign * domain.strides()[wall])
    })
}

/// Of the places `pins` in the cell at `at` and those beside it at a distance `stride`, the nearest to `h`, from that cell's middle in cells.
pub(super) fn nearest(pins: &[Real], at: isize, stride: isize, h: Real) -> Option<Real> {
    let place = |by: isize| {
        Some(pins[(at + by * stride) as usize]).filter(|&pin| pin != 0.0).map(|pin| pin - SHIFT + by as Real)
    };
    [0, -1, 1]
        .into_iter()
        .filter_map(place)
        .filter(|pin| (pin - h).abs() < REACH)
        .min_by(|a, b| (a - h).abs().total_cmp(&(b - h).abs()))
}

/// A place from the middle of its cell, in cells, as it is kept.
pub(super) fn kept(place: Real) -> Real {
    place + SHIFT
}
