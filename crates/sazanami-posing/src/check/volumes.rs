//! Volumes of liquids where they are put, and of grains.

use sazanami_numerics::geometry::RegionFractions;
use sazanami_numerics::grid::Grid;
use sazanami_numerics::{Real, Vector};

use super::PACKED_SPHERES;
use crate::case::meaning::{Case, GrainPlacement, LiquidRegion, Placement, Population, Region};

/// Cells along each edge of a region without a formula: its volume is then known to about a thousandth.
const CELLS: usize = 24;

/// Volume of a liquid within the box [m^3]; `None` where it has no formula and only the bed will tell its place.
pub(crate) fn volume_within(case: &Case, liquid: &LiquidRegion) -> Option<Real> {
    let Placement::Absolute(position) = liquid.placement else { return liquid.region.volume() };
    let (lower, upper) = (case.domain.lower, case.domain.upper);
    let between = |low: Vector, high: Vector| (high.min(upper) - low.max(lower)).max(Vector::ZERO).element_product();
    let region = match case.region_of(liquid, position) {
        Region::Box { lower, upper } => return Some(between(lower, upper)),
        region => region.geometry(),
    };
    let own = liquid.region.moved(position).geometry();
    let (first, last) = own.bounds();
    let repeats = case.periodic().map(|periodic| periodic && !liquid.region.is_sampled());
    let is_whole = |d: usize| {
        first[d] >= lower[d] && last[d] <= upper[d] || repeats[d] && last[d] - first[d] < case.domain.extent()[d]
    };
    let (low, high) = region.bounds();
    let room = between(low, high);
    if let Some(volume) = own.volume().filter(|_| (0..3).all(is_whole)) {
        return Some(volume);
    } else if room <= 0.0 {
        return Some(0.0);
    }
    let cells = RegionFractions::new(&region, &Grid::new([CELLS; 3], low.max(lower), high.min(upper)), 2);
    let place = |n: usize| [n % CELLS, n / CELLS % CELLS, n / (CELLS * CELLS)].map(|n| n as isize);
    let filled: Real = (0..CELLS.pow(3)).map(place).map(|[i, j, k]| cells.fraction(i, j, k)).sum();
    Some(room * filled / CELLS.pow(3) as Real)
}

/// Volume of the grains, after a bed was levelled [m^3].
pub(super) fn solid(case: &Case) -> Real {
    let of_population = |population: &Population| {
        let count = levelled(case, population).or(population.count).unwrap_or_default();
        count as Real * population.shape.volume().unwrap_or_default() * population.sizes().mean_cube()
    };
    case.grains.iter().map(of_population).sum()
}

/// Grains of a population that stay when its bed is levelled, about: those whose tops lie below the level.
pub(crate) fn levelled(case: &Case, population: &Population) -> Option<usize> {
    let GrainPlacement::Packed(how) = &population.placement else { return None };
    let size = population.shape.size()? * population.sizes().mean();
    let volume = population.shape.volume()? * population.sizes().mean_cube();
    let extent = case.domain.extent();
    let solid = PACKED_SPHERES * extent.x * extent.y * (how.level? - size).max(0.0);
    Some(((solid / volume).round() as usize).min(population.count.unwrap_or(usize::MAX)))
}
