//! Liquids that begin by flowing into a wall beside them, or beside gas that nothing keeps out.

use sazanami_numerics::{Real, Vector};

use crate::case::Case;
use crate::presets::Solver;
use crate::read::Context;
use crate::tables::{BoundarySide, FluidName, LiquidRegion, Placement, SIDE_NAMES};
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
    let outward = if upper == 0 { -1.0 } else { 1.0 };
    let initial = case.fluid.initial_velocity;
    let (mut fastest, mut scale) = (0.0, 0.0);
    for place in places_on_side(case, liquid, d, upper)? {
        let velocity = liquid.velocity + initial.map_or(Vector::ZERO, |initial| initial.at(&case.domain, place));
        fastest = Real::max(fastest, outward * velocity[d]);
        scale = Real::max(scale, velocity.length());
    }
    (fastest > 1e-6 * scale && fastest > 0.0).then_some(fastest)
}

/// Places just within a side of the box at which a liquid is; nothing where its place is not known or it lies beside the box.
fn places_on_side(case: &Case, liquid: &LiquidRegion, d: usize, upper: usize) -> Option<impl Iterator<Item = Vector>> {
    let Placement::Absolute(origin) = liquid.placement else { return None };
    let region = liquid.region.moved(origin).geometry();
    let (lower, extent) = (case.domain.lower, case.domain.extent());
    let (first, last) = region.bounds();
    let (first, last) = (first.max(lower), last.min(case.domain.upper));
    if first.cmpge(last).any() {
        return None;
    }
    // Over what the liquid reaches of the side.
    let at = if upper == 0 { lower[d] + TINY * extent[d] } else { case.domain.upper[d] - TINY * extent[d] };
    let [a, b] = [(d + 1) % 3, (d + 2) % 3];
    let place = move |n: usize| {
        let part = |n: usize| (n as Real + 0.5) / PLACES as Real;
        let mut place = first;
        place[a] += part(n % PLACES) * (last - first)[a];
        place[b] += part(n / PLACES) * (last - first)[b];
        place[d] = at;
        place
    };
    Some((0..PLACES * PLACES).map(place).filter(move |&place| region.contains(place)))
}

/// Warns of sides along gravity that are open to liquid where none lies before them: what comes in is what stands there.
pub fn check_dry_baths(case: &Case, cx: &mut Context<'_>) {
    if case.solver != Solver::Mics {
        return;
    }
    let pull = case.resting_gravity();
    for (d, upper) in (0..3).flat_map(|d| [(d, 0), (d, 1)]) {
        let is_bath = matches!(case.boundary[d][upper], BoundarySide::FixedPressure { fluid: FluidName::Liquid, .. });
        let is_along =
            (0..3).any(|e| e != d && pull[e].abs() >= pull[d].abs() && pull[e] != 0.0 && !case.periodic()[e]);
        let mut liquids = case.liquids.iter().filter(|liquid| liquid.fluid == FluidName::Liquid);
        // Where a liquid above a bed lies is not known yet.
        let may_lie_there = |liquid: &LiquidRegion| {
            !matches!(liquid.placement, Placement::Absolute(_))
                || places_on_side(case, liquid, d, upper).is_some_and(|mut places| places.next().is_some())
        };
        if !is_bath || !is_along || liquids.any(may_lie_there) {
            continue;
        }
        let side = SIDE_NAMES[d][upper];
        cx.report
            .warning(
                cx.places.near(&format!("boundary.{side}")),
                format!("no liquid lies before {side}, which is open to liquid"),
            )
            .label(
                "gas comes in there, with the pressure of that liquid: along gravity it is what stands before a side",
            )
            .help(format!("put a `[[liquid]]` before it, or let the liquid in with `{side} = {{ inflow = ... }}`"));
    }
}

/// Warns of liquid with surface tension at a side open to gas where gravity does not hold it: gas comes in cell by cell.
pub fn check_beside_gas(case: &Case, cx: &mut Context<'_>) {
    let has_tension = case.fluid.surface_tension.is_some_and(|sigma| sigma > 0.0);
    if case.solver != Solver::Mics || !has_tension {
        return;
    }
    let pull = case.resting_gravity();
    let bodies = || case.liquids.iter().enumerate().filter(|(_, liquid)| liquid.fluid == FluidName::Liquid);
    for (d, upper) in (0..3).flat_map(|d| [(d, 0), (d, 1)]) {
        let is_to_gas = matches!(
            case.boundary[d][upper],
            BoundarySide::Outflow | BoundarySide::FixedPressure { fluid: FluidName::Gas, .. }
        );
        // Along the side gravity lets liquid stand outside as well; across it liquid leaves, or lies under the gas.
        let is_held = (0..3).any(|e| pull[e] != 0.0 && !case.periodic()[e]);
        if !is_to_gas || is_held {
            continue;
        }
        let outward = if upper == 0 { -1.0 } else { 1.0 };
        let lies_there = |(_, liquid): &(usize, &LiquidRegion)| {
            outward * liquid.velocity[d] <= 0.0
                && places_on_side(case, liquid, d, upper).is_some_and(|mut places| places.next().is_some())
        };
        if let Some((n, liquid)) = bodies().find(lies_there) {
            let side = SIDE_NAMES[d][upper];
            cx.report
                .warning(
                    cx.places.near(&format!("liquid.{n}.region")),
                    format!("`{}` lies at {side}, behind which there is gas", liquid.name),
                )
                .label("where it draws back gas enters cell by cell, and surface tension pulls at each: energy out of nothing")
                .help(format!(
                    "write `boundary.{side} = {{ fixed_pressure = {{ fluid = \"liquid\" }} }}` if there is liquid outside, or keep the \
                     liquid away from that side"
                ));
        }
    }
}
