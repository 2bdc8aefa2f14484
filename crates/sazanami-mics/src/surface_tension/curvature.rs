//! Curvature of the interface in the cells that it passes.
//!
//! From the heights in nine columns along the steepest direction in which all nine have one (Cummins, Francois and Kothe 2005, Comput.
//! Struct. 83, 425; second differences along the edges averaged over three rows as by Lopez et al. 2009, Comput. Methods Appl. Mech. Eng.
//! 198, 2555); where none has, from the paraboloid nearest to the heights in all directions around the cell, and where these do not
//! suffice, to the centres of the planes in the cells around it (Popinet 2009, J. Comput. Phys. 228, 5838).

use sazanami_numerics::{Real, Vector};

use super::fit::Paraboloid;
use super::heights::{Heights, PURE};
use crate::interface::{Facet, Neighbourhood, Plane, mixed_normal, neighbourhood};

/// Weight of the rows beside the middle one in second differences.
const ASIDE: Real = 0.2;
/// What the curvature of a cell was found from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Found {
    /// Heights in nine columns.
    Columns,
    /// A paraboloid near heights or planes.
    Fit,
}

/// Largest curvature on a grid with this `spacing` \[m], that of a sphere of a cell's radius [1/m].
pub(super) fn largest_curvature(spacing: Vector) -> Real {
    2.0 / spacing.min_element()
}

/// Directions in which a normal has a component, the largest first, and whether it points up them.
fn steepest_first(normal: [Real; 3]) -> impl Iterator<Item = (usize, bool)> {
    let mut order = [0, 1, 2];
    order.sort_by(|&a, &b| normal[b].abs().total_cmp(&normal[a].abs()));
    order.into_iter().filter(move |&d| normal[d] != 0.0).map(move |d| (d, normal[d] > 0.0))
}

/// The liquid around cells, and where its interface stands.
#[derive(Clone, Copy)]
pub(super) struct Surroundings<'a> {
    pub c: &'a [Real],
    pub heights: &'a Heights,
    pub strides: [isize; 3],
    pub spacing: Vector,
}

impl Surroundings<'_> {
    /// Whether the interface passes the cell at `at` or lies on one of its faces.
    #[inline]
    pub fn has_interface(&self, at: usize) -> bool {
        let c = self.c[at];
        if (PURE..=1.0 - PURE).contains(&c) {
            return true;
        }
        let beside = |by: isize| self.c[(at as isize + by) as usize];
        let is_opposite = |other: Real| if c < PURE { other > 1.0 - PURE } else { other < PURE };
        self.strides.iter().any(|&s| is_opposite(beside(-s)) || is_opposite(beside(s)))
    }

    /// Curvature of the interface in the cell at `at`, positive where the liquid is convex [1/m]; `None` if it cannot be told.
    pub fn curvature(&self, at: usize) -> Option<(Real, Found)> {
        let cells = neighbourhood(self.c, at, self.strides);
        let normal = mixed_normal(&cells)?;
        if let Some(curvature) = self.of_columns(at, normal) {
            return Some((curvature, Found::Columns));
        }
        let curvature = self.of_heights(at, &cells).or_else(|| self.of_planes(at, &cells))?;
        let largest = largest_curvature(self.spacing);
        Some((curvature.clamp(-largest, largest), Found::Fit))
    }

    /// From heights in nine columns, those along the steepest component of the normal first.
    fn of_columns(&self, at: usize, normal: [Real; 3]) -> Option<Real> {
        steepest_first(normal).find_map(|(d, up)| self.of_columns_along(d, at, up))
    }

    /// The cell with the height of a column through the cell at `at`, along the steepest component of the normal in which there is one that
    /// `lends`.
    pub fn lender(&self, at: usize, lends: impl Fn(usize) -> bool) -> Option<usize> {
        let normal = mixed_normal(&neighbourhood(self.c, at, self.strides))?;
        steepest_first(normal)
            .filter_map(|(d, up)| self.heights.nearest_in_column(d, at, up, 0.0).map(|(_, place)| place))
            .find(|&place| lends(place))
    }

    fn of_columns_along(&self, d: usize, at: usize, up: bool) -> Option<Real> {
        let (e, f) = ((d + 1) % 3, (d + 2) % 3);
        let middle = self.heights.in_column(d, at, up, 0.0)?;
        let mut h = [[middle; 3]; 3];
        for (a, h) in (-1..).zip(&mut h) {
            for (b, h) in (-1..).zip(h) {
                if (a, b) != (0, 0) {
                    let column = (at as isize + a * self.strides[e] + b * self.strides[f]) as usize;
                    *h = self.heights.in_column(d, column, up, middle)?;
                }
            }
        }
        let [ed, fd] = [e, f].map(|edge| self.spacing[d] / self.spacing[edge]);
        let along = |h: [[Real; 3]; 3]| h.map(|[low, middle, high]| high - 2.0 * middle + low);
        let mean = |[low, middle, high]: [Real; 3]| (middle + ASIDE * (low + high)) / (1.0 + 2.0 * ASIDE);
        let turned: [[Real; 3]; 3] = std::array::from_fn(|b| std::array::from_fn(|a| h[a][b]));
        let h_e = 0.5 * ed * (h[2][1] - h[0][1]);
        let h_f = 0.5 * fd * (h[1][2] - h[1][0]);
        let h_ee = ed / self.spacing[e] * mean(along(turned));
        let h_ff = fd / self.spacing[f] * mean(along(h));
        let h_ef = 0.25 * ed / self.spacing[f] * (h[2][2] - h[2][0] - h[0][2] + h[0][0]);
        let slope = 1.0 + h_e * h_e + h_f * h_f;
        let bend = h_ee * (1.0 + h_f * h_f) + h_ff * (1.0 + h_e * h_e) - 2.0 * h_ef * h_e * h_f;
        let curvature = bend / (slope * slope.sqrt());
        Some(if up { -curvature } else { curvature })
    }

    /// From the paraboloid nearest to the heights in all directions that lie in the cells around.
    fn of_heights(&self, at: usize, cells: &Neighbourhood) -> Option<Real> {
        let facet = self.facet(cells)?;
        let mut fit = Paraboloid::around(facet.centre - 0.5 * self.spacing, facet.normal, self.spacing.min_element());
        self.for_neighbours(at, |place, at| {
            for d in 0..3 {
                if let Some((h, up)) = self.heights.in_cell(d, at)
                    && (facet.normal[d] > 0.0) == up
                {
                    fit.add(place + Vector::AXES[d] * (h * self.spacing[d]), 1.0);
                }
            }
        });
        fit.curvature()
    }

    /// From the paraboloid nearest to the centres of the planes in the cells around, by their areas.
    fn of_planes(&self, at: usize, cells: &Neighbourhood) -> Option<Real> {
        let own = self.facet(cells)?;
        let mut fit = Paraboloid::around(own.centre - 0.5 * self.spacing, own.normal, self.spacing.min_element());
        let unit = self.spacing.element_product().cbrt().powi(2);
        self.for_neighbours(at, |place, at| {
            if let Some(facet) = self.facet(&neighbourhood(self.c, at, self.strides))
                && facet.normal.dot(own.normal) > 0.0
            {
                fit.add(place + facet.centre - 0.5 * self.spacing, facet.area / unit);
            }
        });
        fit.curvature()
    }

    /// The piece of the interface in the cell in the middle of `cells`.
    pub fn facet(&self, cells: &Neighbourhood) -> Option<Facet> {
        if !(PURE..=1.0 - PURE).contains(&cells[13]) {
            return None;
        }
        Plane::through(cells)?.facet(self.spacing)
    }

    /// Calls `body` with the centre, from that of the cell at `at` \[m], and the place in memory of that cell and its 26 neighbours.
    fn for_neighbours(&self, at: usize, mut body: impl FnMut(Vector, usize)) {
        for n in 0..27 {
            let offset = [n % 3 - 1, n / 3 % 3 - 1, n / 9 - 1];
            let by: isize = offset.iter().zip(self.strides).map(|(o, s)| o * s).sum();
            let place = Vector::from_array(offset.map(|o| o as Real)) * self.spacing;
            body(place, (at as isize + by) as usize);
        }
    }
}
