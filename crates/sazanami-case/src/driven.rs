//! What a flow that is driven needs of the rest of a case.

use sazanami_dem::Motion;
use sazanami_numerics::mean_flow::ActsBy;
use sazanami_numerics::{Real, Vector};

use crate::case::Case;
use crate::presets::Solver;
use crate::read::Context;
use crate::tables::{
    BoundarySide, Drive, FluidName, GrainPlacement, LONGEST_STEP, Placement, Population, SIDE_NAMES, place_of_side,
};
use crate::units::rounded;

/// Places in each direction at which liquid is looked for that fills the box.
const SAMPLES: usize = 8;
/// Part of gravity up to which it counts as borne.
const BORNE: Real = 1e-9;

/// Refuses a drive that has no way through the box, or steps too long for it.
pub fn check(case: &Case, cx: &mut Context<'_>) {
    let Some(drive) = case.drive else { return };
    if case.solver == Solver::Mics && case.fluid.carrying_flow.is_some() {
        cx.report
            .error(cx.places.at("drive"), "a carrying flow is not driven")
            .label("its velocity is given")
            .help("leave out `drive` or `fluid.carrying_flow`");
    }
    check_volume(case, &drive, cx);
    check_net_flow(case, &drive, cx);
    let Some(velocity) = drive.mean_velocity else { return };
    for d in (0..3).filter(|&d| velocity[d] != 0.0 && case.boundary[d][0] != BoundarySide::Periodic) {
        cx.report
            .error(
                cx.places.at("drive.mean_velocity"),
                format!("the mean velocity goes through the sides of x{}", d + 1),
            )
            .label(format!("{} and {} are not periodic", SIDE_NAMES[d][0], SIDE_NAMES[d][1]))
            .help(format!("write `boundary.x{} = \"periodic\"`, or a velocity of 0 along x{}", d + 1, d + 1));
    }
    if case.mean_flow().is_some_and(|flow| flow.net) && case.solver == Solver::Mics {
        return;
    }
    check_mean(case, drive.above, cx);
    let longest = match (&case.particles, case.solver) {
        (Some(particles), Solver::Mps) => particles.dt.unwrap_or(particles.dt_max),
        _ => case.fluid.step.longest(),
    };
    if longest > LONGEST_STEP * drive.answer {
        cx.report
            .error(cx.places.at("drive.answer"), "`answer` is shorter than four steps: the force would swing")
            .label(format!("{} s, a step may be {} s long", rounded(drive.answer), rounded(longest)))
            .help(format!("take {} s at least, or shorter steps", rounded(longest / LONGEST_STEP)));
    }
}

/// The height above which the mean is taken lies within the water.
fn check_mean(case: &Case, above: Real, cx: &mut Context<'_>) {
    let (floor, top) = (case.domain.lower.z, case.domain.upper.z);
    let place = cx.places.at("drive.above");
    if above < floor || above >= top {
        let [floor, top] = [floor, top].map(|z| rounded(1e3 * z));
        cx.report
            .error(place, "`above` lies outside the box")
            .label(format!("the box reaches from {floor} mm to {top} mm"))
            .help("choose the height of the top of the bed, or leave it out for all the water");
        return;
    }
    let liquids = case.liquids.iter().filter(|liquid| liquid.fluid == FluidName::Liquid);
    let level = liquids.map(|liquid| liquid.top().unwrap_or(Real::INFINITY));
    if let Some(level) = level.reduce(Real::max).filter(|level| *level <= above) {
        cx.report
            .error(place, "there is no water above `above`: nothing would be held")
            .label(format!("the water reaches up to {} mm", rounded(1e3 * level)))
            .help("choose the height of the top of the bed, or leave it out for all the water");
    }
}

/// A net flow goes through periodic sides and is that of the whole box.
fn check_net_flow(case: &Case, drive: &Drive, cx: &mut Context<'_>) {
    if !case.mean_flow().is_some_and(|flow| flow.net) {
        return;
    }
    if drive.above != case.domain.lower.z {
        cx.report
            .error(cx.places.at("drive.above"), "the net flow is that of the whole box")
            .label("`above` is for the mean velocity of the water")
            .help("leave it out");
    }
    if case.periodic() == [false; 3] {
        cx.report
            .error(cx.places.at("drive.mean_velocity"), "there is no direction along which a net flow is held")
            .label("no sides are periodic")
            .help("leave out `drive`, or write `boundary.x3 = \"periodic\"` or another pair of sides");
    }
}

/// Whether grains of a population do not move by the forces on them.
pub fn is_held(population: &Population) -> bool {
    match &population.placement {
        GrainPlacement::List(list) => list.iter().any(|grain| grain.motion != Motion::Free),
        _ => population.motion != Motion::Free,
    }
}

/// Whether walls or held grains hold a flow along a direction back.
pub fn resists(case: &Case, direction: usize) -> bool {
    let holds = |side: &BoundarySide| matches!(side, BoundarySide::NoSlip | BoundarySide::Moving { .. });
    let has_walls = (0..3).any(|d| d != direction && case.boundary[d].iter().any(holds));
    has_walls || case.grains.iter().any(is_held)
}

/// Refuses boxes in which everything falls for ever, warns of those in which only friction ends the fall.
pub fn check_fall(case: &Case, cx: &mut Context<'_>) {
    if case.solver == Solver::Mics && case.fluid.carrying_flow.is_some() {
        return;
    }
    let pull = case.resting_gravity() + case.drive.map_or(Vector::ZERO, |drive| drive.acceleration);
    let gravity = case.resting_gravity();
    let held = case.mean_flow().map_or([false; 3], |flow| flow.held);
    for d in (0..3)
        .filter(|&d| case.periodic()[d] && !held[d] && gravity[d] != 0.0 && pull[d].abs() > BORNE * gravity.length())
    {
        let along = format!("along x{}", d + 1);
        let place = place_of_side(&cx.places, d, 0);
        let mut way_out = format!("give x{} walls, or leave out gravity {along}", d + 1);
        if open_side(case).is_none() {
            way_out.insert_str(
                0,
                "hold the net flow with `drive.mean_velocity = [\"0 m/s\", \"0 m/s\", \"0 m/s\"]`: a gradient of the pressure then \
                 bears the weight; or ",
            );
        }
        if !resists(case, d) {
            cx.report
                .error_at(place, format!("everything falls {along} without end"))
                .label("these sides are periodic, and nothing bears the weight or holds the flow back")
                .help(way_out);
        } else if pull[d].abs() >= pull.abs().max_element() && !case.grains.iter().any(is_held) {
            cx.report
                .warning(
                    place,
                    if case.grains.is_empty() {
                        format!("the fluid falls {along} against friction alone")
                    } else {
                        format!("grains and fluid fall {along} together")
                    },
                )
                .label("these sides are periodic, and friction alone holds the flow back")
                .help(way_out);
        }
    }
    if case.mean_flow().is_some_and(|flow| {
        let weight = |d: usize| flow.held[d] && pull[d].abs() >= pull.abs().max_element() && pull[d] != 0.0;
        !flow.moves_box
            && flow.acts_by == ActsBy::Mass
            && (0..3).any(weight)
            && case.grains.iter().any(Population::has_free_grains)
    }) {
        cx.report
            .warning(
                cx.places.near("drive"),
                "the force that holds the mean velocity bears the weight of the grains as well",
            )
            .label("by mass it acts on them as on the water: they do not settle")
            .help("write `drive.acts_by = \"volume\"`");
    }
}

/// A side of a grid past which no mean gradient of the pressure goes: the pressure beyond it is that of fluid at rest, and is not higher
/// behind one end of a periodic direction than behind the other.
fn open_side(case: &Case) -> Option<&'static str> {
    let mut sides = SIDE_NAMES.as_flattened().iter().zip(case.boundary.as_flattened());
    sides.find(|(_, side)| case.solver == Solver::Mics && side.is_open()).map(|(name, _)| *name)
}

/// A gradient of pressure from outside goes through the box.
fn check_volume(case: &Case, drive: &Drive, cx: &mut Context<'_>) {
    if drive.acts_by == ActsBy::Mass {
        return;
    }
    let place = cx.places.at("drive.acts_by");
    let (lower, extent) = (case.domain.lower, case.domain.extent());
    let regions: Vec<_> = case
        .liquids
        .iter()
        .filter_map(|liquid| match liquid.placement {
            Placement::Absolute(origin) if liquid.fluid == FluidName::Liquid => {
                Some(case.region_of(liquid, origin).geometry())
            }
            _ => None,
        })
        .collect();
    let place_of = |n: usize| {
        let part = |d: u32| (((n / SAMPLES.pow(d)) % SAMPLES) as Real + 0.5) / SAMPLES as Real;
        lower + extent * Vector::new(part(0), part(1), part(2))
    };
    let is_full = (0..SAMPLES.pow(3)).map(place_of).all(|place| regions.iter().any(|region| region.contains(place)));
    let acts = drive.acceleration != Vector::ZERO
        || drive.oscillation.is_some()
        || drive.mean_velocity.is_some_and(|velocity| velocity != Vector::ZERO);
    if let Some(side) = open_side(case).filter(|_| acts || drive.mean_velocity.is_some()) {
        let by_mass =
            if drive.mean_velocity == Some(Vector::ZERO) { "leave out `drive`" } else { "write `acts_by = \"mass\"`" };
        cx.report
            .error(place, format!("a mean gradient of the pressure ends at {side}, which is open"))
            .label(
                "beyond it the pressure is that of fluid at rest: fluid would shoot through the periodic sides there",
            )
            .help(format!("{by_mass}, or close {side}"));
        return;
    }
    if case.solver == Solver::Mics && acts && !is_full {
        cx.report
            .warning(Some(place.clone()), "the gas is driven by this gradient of the pressure too")
            .label(format!(
                "it acts on every volume alike: gas is driven {} times as hard as the liquid",
                rounded(case.fluid.liquid.density / case.fluid.gas.density)
            ))
            .help("leave out `acts_by` for a force by mass, as gravity along a slope, or fill the box with liquid");
    }
    let swing = drive.oscillation.map_or(Vector::ZERO, |swing| swing.amplitude);
    for d in (0..3).filter(|&d| case.boundary[d][0] != BoundarySide::Periodic) {
        if drive.acceleration[d] != 0.0 || swing[d] != 0.0 {
            cx.report
                .error(place.clone(), format!("a gradient of pressure along x{} does nothing", d + 1))
                .label(format!("{} and {} are not periodic: the sides bear it", SIDE_NAMES[d][0], SIDE_NAMES[d][1]))
                .help(format!("write `boundary.x{} = \"periodic\"`, or leave out `acts_by`", d + 1));
        }
    }
}
