//! Volumes of liquids where they are put, and of grains.

use std::f64::consts::PI;

use sazanami_numerics::geometry::RegionFractions;
use sazanami_numerics::grid::Grid;
use sazanami_numerics::{Real, Vector};

use super::{PACKED_SPHERES, ShapeFacts};
use crate::assembly::fluid::origin_of;
use crate::assembly::grains;
use crate::assembly::wetted::PlacedLiquids;
use crate::case::meaning::{Case, GrainPlacement, LiquidRegion, Placement, Population, Region};

/// Solid fraction of a levelled bed of spheres from the floor to half a grain below its level: of the two beds of `cases/ripples`, ten
/// grains high.
const LEVELLED: Real = 0.569;

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

/// Volume of the grains of a bed that is packed or read, after it was levelled [m^3]; of one from a file as `shapes` know it.
fn solid(case: &Case, shapes: &[ShapeFacts]) -> Real {
    let of_population = |(n, population): (usize, &Population)| {
        if let Some(volume) = shapes.get(n).and_then(|facts| facts.bed_volume) {
            return volume;
        }
        let count = levelled(case, population).or(population.count).unwrap_or_default();
        count as Real * population.shape.volume().unwrap_or_default() * population.sizes().mean_cube()
    };
    let in_bed =
        |population: &Population| matches!(population.placement, GrainPlacement::Packed(_) | GrainPlacement::Bed(_));
    case.grains.iter().enumerate().filter(|(_, population)| in_bed(population)).map(of_population).sum()
}

/// Height of the bed of a case, about \[m]; the floor without one. Of a bed from a file nothing is known without its `shapes`.
pub(crate) fn bed_top(case: &Case, shapes: &[ShapeFacts]) -> Real {
    let extent = case.domain.extent();
    case.domain.lower.z + solid(case, shapes) / (PACKED_SPHERES * extent.x * extent.y)
}

/// Volume of each liquid that grains take which lie in it as the run begins, about [m^3]: a bed as far as it lies below the surface, listed grains
/// and those of a lattice where they are, none that are fed in.
pub(super) fn displaced(case: &Case, shapes: &[ShapeFacts]) -> Vec<Real> {
    let bed = bed_top(case, shapes);
    let liquids = PlacedLiquids::of(case, bed);
    let mut displaced = vec![0.0; case.liquids.len()];
    for grain in grains::placed(case, &[], &vec![None; case.grains.len()]) {
        let population = &case.grains[grains::population_of(grain.id).0];
        let volume = population.shape.volume().unwrap_or_default() * grain.scale.powi(3);
        for (liquid, part) in liquids.parts(grain.position, (6.0 * volume / PI).cbrt()) {
            displaced[liquid] += part * volume;
        }
    }
    let (low, high) = (case.domain.lower, case.domain.upper.with_z(bed.min(case.domain.upper.z)));
    for (n, liquid) in case.liquids.iter().enumerate().filter(|_| low.cmplt(high).all()) {
        let (lower, upper) = case.region_of(liquid, origin_of(liquid, case.bed.axis, bed)).geometry().bounds();
        let (lower, upper) = (lower.max(low), upper.min(high));
        if lower.cmpge(upper).any() {
            continue;
        }
        let cells = Grid::new([CELLS; 3], lower, upper);
        let place = |n: usize| [n % CELLS, n / CELLS % CELLS, n / (CELLS * CELLS)].map(|n| n as isize);
        let filled =
            (0..cells.len()).map(place).filter(|&[i, j, k]| liquids.at(cells.centre(i, j, k)) == Some(n)).count();
        displaced[n] += PACKED_SPHERES * cells.cell_volume() * filled as Real;
    }
    displaced
}

/// Grains of a population that stay when its bed is levelled, about: those whose tops lie below the level.
pub(crate) fn levelled(case: &Case, population: &Population) -> Option<usize> {
    let GrainPlacement::Packed(how) = &population.placement else { return None };
    let size = population.shape.size()? * population.sizes().mean();
    let volume = population.shape.volume()? * population.sizes().mean_cube();
    let extent = case.domain.extent();
    let below = how.level? - size;
    let solid = if below < 0.0 { 0.0 } else { LEVELLED * extent.x * extent.y * (below + 0.5 * size) };
    Some(((solid / volume).round() as usize).min(population.count.unwrap_or(usize::MAX)))
}
