//! Liquids that begin by flowing into a wall beside them.

use sazanami_numerics::{Real, Vector};

use crate::case::Case;
use crate::presets::Solver;
use crate::read::Context;
use crate::tables::{FluidName, LiquidRegion, Placement, SIDE_NAMES};
use crate::units::rounded;

/// Places along each edge of the part of a wall at which a liquid is looked at.
const PLACES: usize = 9;
/// Part of the largest velocity that is round-off, and of the box that lies within a wall.
const TINY: Real = 1e-9;

/// Warns of each liquid that flows into a wall.
pub fn check(case: &Case, cx: &mut Context<'_>) {
    for (n, liquid) in case.liquids.iter().enumerate().filter(|(_, liquid)| liquid.fluid == FluidName::Liquid) {
        for (d, upper) in (0..3).flat_map(|d| [(d, 0), (d, 1)]) {
            let Some(speed) = into_wall(case, liquid, d, upper) else { continue };
            let to = match case.solver {
                Solver::Mics => "the pressure stops it at once, as an impact of the whole liquid",
                Solver::Mps => "its particles pile up there until they are thrown back",
            };
            let key = if liquid.velocity == Vector::ZERO { "fluid.initial_velocity" } else { "liquid" };
            let span = cx.places.near(&if key == "liquid" { format!("liquid.{n}.velocity") } else { key.to_owned() });
            cx.report
                .warning(span, format!("`{}` flows into the wall {} from the start", liquid.name, SIDE_NAMES[d][upper]))
                .label(format!("at {} m/s: {to}", rounded(speed)))
                .help(format!("leave out the velocity along x{}, or leave room between liquid and wall", d + 1));
        }
    }
}

/// Largest speed at which a liquid flows into a wall of the box that it touches [m/s].
fn into_wall(case: &Case, liquid: &LiquidRegion, d: usize, upper: usize) -> Option<Real> {
    if !case.boundary[d][upper].is_wall() {
        return None;
    }
    let Placement::Absolute(origin) = liquid.placement else { return None };
    let region = liquid.region.moved(origin).geometry();
    let (lower, extent) = (case.domain.lower, case.domain.extent());
    let (first, last) = region.bounds();
    let (first, last) = (first.max(lower), last.min(case.domain.upper));
    if first.cmpge(last).any() {
        return None;
    }
    // Just within the wall, over what the liquid reaches of it.
    let wall = if upper == 0 { lower[d] + TINY * extent[d] } else { case.domain.upper[d] - TINY * extent[d] };
    let outward = if upper == 0 { -1.0 } else { 1.0 };
    let [a, b] = [(d + 1) % 3, (d + 2) % 3];
    let initial = case.fluid.initial_velocity;
    let (mut fastest, mut scale) = (0.0, 0.0);
    for n in 0..PLACES * PLACES {
        let part = |n: usize| (n as Real + 0.5) / PLACES as Real;
        let mut place = first;
        place[a] += part(n % PLACES) * (last - first)[a];
        place[b] += part(n / PLACES) * (last - first)[b];
        place[d] = wall;
        if region.contains(place) {
            let velocity = liquid.velocity + initial.map_or(Vector::ZERO, |initial| initial.at(&case.domain, place));
            fastest = Real::max(fastest, outward * velocity[d]);
            scale = Real::max(scale, velocity.length());
        }
    }
    (fastest > 1e-6 * scale && fastest > 0.0).then_some(fastest)
}
