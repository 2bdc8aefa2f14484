//! Speeds that grains reach in a run: free fall, terminal speed.

use sazanami_numerics::{Real, Vector};

use crate::case::meaning::{Case, FluidName, GrainPlacement, LiquidRegion, Motion, Population};

/// Speed that free grains of a population reach by falling through the box [m/s]: that of their fall in vacuum, at most
/// their terminal speed in the fluid around them. Grains of a bed rest.
pub(super) fn falling(case: &Case, population: &Population) -> Vector {
    if population.motion != Motion::Free && !matches!(population.placement, GrainPlacement::List(_)) {
        return Vector::ZERO;
    }
    let floor = case.domain.lower.z;
    let (height, lowest) = match &population.placement {
        GrainPlacement::List(list) => {
            let free = list.iter().filter(|grain| grain.motion == Motion::Free).map(|grain| grain.position.z);
            (free.clone().fold(floor, Real::max) - floor, free.fold(Real::INFINITY, Real::min))
        }
        GrainPlacement::Lattice(lattice) => (lattice.upper.z - floor, lattice.lower.z),
        GrainPlacement::Fed(feed) => (feed.upper.z - floor, feed.lower.z),
        GrainPlacement::Packed(_) | GrainPlacement::Bed(_) => return Vector::ZERO,
    };
    let gravity = case.resting_gravity().length();
    let fall = (2.0 * gravity * height.max(0.0)).sqrt();
    let terminal = terminal_speed(case, population, gravity, lowest).unwrap_or(Real::INFINITY);
    Vector::new(0.0, 0.0, fall.min(terminal))
}

/// Terminal speed of a sphere of the largest grains' size with the drag of Schiller and Naumann (1935): in the liquid
/// where that reaches above the `lowest` grain \[m], else in the gas [m/s].
fn terminal_speed(case: &Case, population: &Population, gravity: Real, lowest: Real) -> Option<Real> {
    let liquids = case.liquids.iter().filter(|liquid| liquid.fluid == FluidName::Liquid);
    let level = liquids.filter_map(LiquidRegion::top).fold(Real::NEG_INFINITY, Real::max);
    let fluid = if level >= lowest { case.fluid.liquid } else { case.fluid.gas };
    let size = population.shape.size()? * population.sizes().largest();
    let density = match population.mass_override {
        Some(mass) => mass / population.shape.volume()?,
        None => case.material(&population.material)?.density,
    };
    let weight = (density - fluid.density).abs() * gravity * size * 4.0 / (3.0 * fluid.density);
    let drag = |speed: Real| {
        let reynolds = fluid.density * speed * size / fluid.viscosity;
        (24.0 / reynolds * (1.0 + 0.15 * reynolds.powf(0.687))).max(0.44)
    };
    // The drag coefficient times the square of the speed grows with the speed.
    let (mut low, mut high) = (0.0, 1e4);
    for _ in 0..100 {
        let speed = 0.5 * (low + high);
        if drag(speed) * speed * speed < weight { low = speed } else { high = speed }
    }
    Some(high)
}
