//! Volumes of liquids where they are put.

use sazanami_numerics::geometry::RegionFractions;
use sazanami_numerics::grid::Grid;
use sazanami_numerics::{Real, Vector};

use crate::case::meaning::{Case, LiquidRegion, Placement, Region};

/// Cells along each edge of a region without a formula: its volume is then known to about a thousandth.
const CELLS: usize = 24;

/// Volume of a liquid within the box [m^3]; `None` where it has no formula and only the bed will tell its place.
pub(super) fn volume_within(case: &Case, liquid: &LiquidRegion) -> Option<Real> {
    let Placement::Absolute(position) = liquid.placement else { return liquid.region.volume() };
    let (lower, upper) = (case.domain.lower, case.domain.upper);
    let between = |low: Vector, high: Vector| (high.min(upper) - low.max(lower)).max(Vector::ZERO).element_product();
    let region = match liquid.region.moved(position) {
        Region::Box { lower, upper } => return Some(between(lower, upper)),
        region => region.geometry(),
    };
    let (low, high) = region.bounds();
    let room = between(low, high);
    let is_inside = low.cmpge(lower).all() && high.cmple(upper).all();
    if let Some(volume) = region.volume().filter(|_| is_inside) {
        return Some(volume);
    } else if room <= 0.0 {
        return Some(0.0);
    }
    let cells = RegionFractions::new(&region, &Grid::new([CELLS; 3], low.max(lower), high.min(upper)), 2);
    let place = |n: usize| [n % CELLS, n / CELLS % CELLS, n / (CELLS * CELLS)].map(|n| n as isize);
    let filled: Real = (0..CELLS.pow(3)).map(place).map(|[i, j, k]| cells.fraction(i, j, k)).sum();
    Some(room * filled / CELLS.pow(3) as Real)
}
