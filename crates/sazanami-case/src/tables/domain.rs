//! `[domain]`: the box and its cells.

use sazanami_case_derive::Keys;
use sazanami_numerics::grid::Grid;
use sazanami_numerics::{Real, Vector};

use super::read_by;
use crate::presets::Solver;
use crate::read::{Context, Table};

/// The box and its cells.
#[derive(Clone, Debug, Keys)]
#[keys(check = Self::check)]
struct DomainKeys {
    /// Lower corner.
    #[key(unit = "m", default = Vector::ZERO, says = "the origin")]
    lower: Vector,
    /// Edges, instead of `upper`.
    #[key(unit = "m")]
    size: Option<Vector>,
    /// Upper corner, instead of `size`.
    #[key(unit = "m")]
    upper: Option<Vector>,
    /// Cells in x1, x2, x3; any number, and they need not be cubes. Rows of cells go along x1: a slice of one cell is computed several times as
    /// fast across x2 as across x1. Not needed for `solver = "mps"`.
    cells: Option<[usize; 3]>,
}

/// The box and its division into cells.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BoxDomain {
    /// Lower corner \[m].
    pub lower: Vector,
    /// Upper corner \[m].
    pub upper: Vector,
    /// Cells in each direction.
    pub cells: [usize; 3],
}

read_by!(BoxDomain, DomainKeys);

impl Default for BoxDomain {
    /// A box of which nothing is known: every comparison with it passes.
    fn default() -> Self {
        Self { lower: Vector::NAN, upper: Vector::NAN, cells: [0; 3] }
    }
}

impl DomainKeys {
    fn check(&mut self, table: &Table<'_>, cx: &mut Context<'_>) {
        match (self.upper, self.size) {
            (Some(_), Some(_)) => {
                cx.report
                    .error(table.span(), "`upper` and `size` say the same thing twice")
                    .label("this box has both")
                    .help("keep one of the two");
                self.upper = Some(Vector::NAN);
            }
            (None, None) => {
                let help = "add `size = [\"33.8 mm\", \"33.8 mm\", \"25 mm\"]`, or `upper`";
                cx.missing(Some(table.span()), "size", help);
            }
            _ => {}
        }
        if self.cells.is_none() && cx.known.solver == Solver::Mics {
            cx.missing(Some(table.span()), "cells", "add `cells = [64, 64, 64]`");
        }
        if self.edges().min_element() <= 0.0 {
            let place = if self.size.is_some() { "size" } else { "upper" };
            cx.report
                .error(table.place(place), "the box has no extent")
                .label("every edge has to be above zero")
                .help("`upper` lies above `lower` in x1, x2 and x3");
            // Whatever lies in the box would be outside of it.
            self.upper = Some(Vector::NAN);
        }
    }

    fn edges(&self) -> Vector {
        self.corner() - self.lower
    }

    fn corner(&self) -> Vector {
        self.upper.or(self.size.map(|size| self.lower + size)).unwrap_or(Vector::NAN)
    }

    fn meaning(self, _: &mut Context<'_>) -> Option<BoxDomain> {
        Some(BoxDomain { lower: self.lower, upper: self.corner(), cells: self.cells.unwrap_or([0; 3]) })
    }

    fn of(domain: &BoxDomain) -> Self {
        Self { lower: domain.lower, size: None, upper: Some(domain.upper), cells: Some(domain.cells) }
    }
}

impl BoxDomain {
    /// The grid of the box.
    #[must_use]
    pub fn grid(&self) -> Grid {
        Grid::new(self.cells, self.lower, self.upper)
    }

    /// Shortest and longest edge of a cell among the directions that are divided \[m], as [`Grid::divided_edges`].
    #[must_use]
    pub fn divided_edges(&self) -> [Real; 2] {
        self.unchecked().divided_edges()
    }

    /// Number of cells across a body of this `width` \[m], as [`Grid::cells_across`].
    #[must_use]
    pub fn cells_across(&self, width: Real) -> Real {
        self.unchecked().cells_across(width)
    }

    /// The grid of a box that may have no cells.
    fn unchecked(&self) -> Grid {
        Grid { cells: self.cells, lower: self.lower, spacing: self.spacing() }
    }

    /// Edges of the box \[m].
    #[must_use]
    pub fn extent(&self) -> Vector {
        self.upper - self.lower
    }

    /// Edges of a cell \[m].
    #[must_use]
    pub fn spacing(&self) -> Vector {
        self.extent() / Vector::new(self.cells[0] as Real, self.cells[1] as Real, self.cells[2] as Real)
    }

    /// Number of cells.
    #[must_use]
    pub fn cell_count(&self) -> usize {
        self.cells.iter().fold(1, |count: usize, &n| count.saturating_mul(n))
    }

    /// Centre of the box in x1 and x2 \[m].
    #[must_use]
    pub fn middle(&self) -> [Real; 2] {
        let centre: Vector = 0.5 * (self.lower + self.upper);
        [centre.x, centre.y]
    }

    /// Whether a point lies outside \[m].
    #[must_use]
    pub fn excludes(&self, point: Vector) -> bool {
        (0..3).any(|d| self.excludes_along(d, [point[d]; 2]))
    }

    /// Whether a range in a direction reaches out by more than rounding, as of `lower` and `size` to `upper` \[m].
    pub(crate) fn excludes_along(&self, direction: usize, [from, to]: [Real; 2]) -> bool {
        let (lower, upper) = (self.lower[direction], self.upper[direction]);
        let rounding = 1e-12 * (lower.abs() + upper.abs());
        from < lower - rounding || to > upper + rounding
    }

    /// From where to where it reaches, for messages.
    pub(crate) fn reaches(&self) -> String {
        format!("the box reaches from {} to {}", super::millimetres(self.lower), super::millimetres(self.upper))
    }
}
