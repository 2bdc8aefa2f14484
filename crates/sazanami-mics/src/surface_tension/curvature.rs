//! Curvature of the interface in the cells that it passes.
//!
//! From the heights in nine columns along the steepest direction in which all nine have one (Cummins, Francois and Kothe 2005, Comput.
//! Struct. 83, 425; second differences along the edges averaged over three rows as by Lopez et al. 2009, Comput. Methods Appl. Mech. Eng.
//! 198, 2555); where none has, from the paraboloid nearest to the heights along the direction in which most have one, if there are six;
//! else from that nearest to the heights in all directions around the cell, and where these do not suffice, to the centres of the planes
//! in the cells around it (Popinet 2009, J. Comput. Phys. 228, 5838).

use sazanami_numerics::domain::Domain;
use sazanami_numerics::grid::Grid;
use sazanami_numerics::{Real, Vector};

use super::columns::HeightColumns;
use super::fit::Paraboloid;
use super::heights::{Heights, PURE};
use crate::interface::{Facet, Neighbourhood, Plane, Wetting, mixed_normal};

/// What the curvature of a cell was found from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum CurvatureSource {
    /// Heights in nine columns.
    Columns,
    /// A paraboloid near fewer heights or planes.
    Fit,
}

/// Largest curvature on a grid, that of a sphere of a cell's radius [1/m].
pub(super) fn largest_curvature(grid: &Grid) -> Real {
    2.0 / grid.divided_edges()[0]
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
    pub wetting: &'a Wetting,
    pub strides: [isize; 3],
    pub spacing: Vector,
    /// Largest curvature [1/m].
    largest: Real,
}

impl<'a> Surroundings<'a> {
    /// Those of the liquid fraction `c` with these heights.
    pub fn new(domain: &Domain, c: &'a [Real], heights: &'a Heights) -> Self {
        let (strides, grid) = (domain.strides(), domain.grid());
        let largest = largest_curvature(grid);
        Self { c, heights, wetting: heights.wetting(), strides, spacing: grid.spacing, largest }
    }

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
    pub fn curvature(&self, at: usize) -> Option<(Real, CurvatureSource)> {
        let cells = self.wetting.neighbourhood(self.c, at);
        let normal = mixed_normal(&cells)?;
        let mut most: Option<HeightColumns> = None;
        for (d, up) in steepest_first(normal) {
            let Some(columns) = HeightColumns::around(self.heights, at, d, up, self.strides) else { continue };
            if let Some(curvature) = columns.curvature(self.spacing) {
                return Some((curvature, CurvatureSource::Columns));
            }
            if most.as_ref().is_none_or(|most| columns.count() > most.count()) {
                most = Some(columns);
            }
        }
        let curvature = most
            .and_then(|columns| columns.fit(self.spacing))
            .or_else(|| self.of_heights(at, &cells))
            .or_else(|| self.of_planes(at, &cells))?;
        let largest = self.largest;
        Some((curvature.clamp(-largest, largest), CurvatureSource::Fit))
    }

    /// From the paraboloid nearest to the heights in all directions that lie in the cells around; behind walls with an angle not those
    /// normal to them.
    fn of_heights(&self, at: usize, cells: &Neighbourhood) -> Option<Real> {
        let facet = self.facet(cells)?;
        let mut fit = Paraboloid::around(facet.centre - 0.5 * self.spacing, facet.normal, self.spacing.min_element());
        self.for_neighbours(at, |place, at| {
            let behind = self.wetting.behind(at);
            for d in (0..3).filter(|&d| behind != Some(d)) {
                if let Some((h, up)) = self.heights.in_cell(d, at)
                    && (facet.normal[d] > 0.0) == up
                {
                    fit.add(place + Vector::AXES[d] * (h * self.spacing[d]), 1.0);
                }
            }
        });
        fit.curvature()
    }

    /// From the paraboloid nearest to the centres of the planes in the cells around, by their areas; behind walls with an angle there are
    /// none.
    fn of_planes(&self, at: usize, cells: &Neighbourhood) -> Option<Real> {
        let own = self.facet(cells)?;
        let mut fit = Paraboloid::around(own.centre - 0.5 * self.spacing, own.normal, self.spacing.min_element());
        let unit = self.spacing.element_product().cbrt().powi(2);
        self.for_neighbours(at, |place, at| {
            if self.wetting.behind(at).is_none()
                && let Some(facet) = self.facet(&self.wetting.neighbourhood(self.c, at))
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
