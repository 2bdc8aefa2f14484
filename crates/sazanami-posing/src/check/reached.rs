//! Speeds that grains reach in a run: free fall, terminal speed.

use sazanami_numerics::{Real, Vector};

use crate::case::meaning::{Case, Fluid, FluidName, GrainPlacement, LiquidRegion, Motion, Population, Solver};

/// Speed that free grains of a population reach by falling through the box [m/s]: above the liquid and within it each that of their fall in
/// vacuum, at most their terminal speed there. Grains of a bed rest.
pub(super) fn falling(case: &Case, population: &Population) -> Vector {
    if population.motion != Motion::Free && !matches!(population.placement, GrainPlacement::List(_)) {
        return Vector::ZERO;
    }
    let (floor, top) = (case.domain.lower.z, case.domain.upper.z);
    let highest = match &population.placement {
        GrainPlacement::List(list) => {
            let free = list.iter().filter(|grain| grain.motion == Motion::Free);
            free.map(|grain| grain.position.z).fold(floor, Real::max)
        }
        GrainPlacement::Lattice(lattice) => lattice.upper.z,
        GrainPlacement::Fed(feed) if feed.side.place() == [2, 1] => top,
        GrainPlacement::Fed(feed) => feed.upper.z,
        GrainPlacement::Packed(_) | GrainPlacement::Bed(_) => return Vector::ZERO,
    };
    let liquids = case.liquids.iter().filter(|liquid| liquid.fluid == FluidName::Liquid);
    let level = liquids.filter_map(LiquidRegion::top).fold(floor, Real::max).min(top);
    let gravity = case.resting_gravity().length();
    let through = |height: Real, fluid: Option<Fluid>| {
        let terminal = fluid.and_then(|fluid| terminal_speed(case, population, gravity, fluid));
        (2.0 * gravity * height.max(0.0)).sqrt().min(terminal.unwrap_or(Real::INFINITY))
    };
    // Over moving particles there is no gas.
    let above = through(highest - level, (case.solver == Solver::Mics).then_some(case.fluid.gas));
    let within = through(highest.min(level) - floor, Some(case.fluid.liquid));
    Vector::new(0.0, 0.0, above.max(within))
}

/// Terminal speed in a fluid of a sphere of the largest grains' size with the drag of Schiller and Naumann (1935) [m/s].
fn terminal_speed(case: &Case, population: &Population, gravity: Real, fluid: Fluid) -> Option<Real> {
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
