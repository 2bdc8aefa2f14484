//! What a flow that is driven needs of the rest of a case.

use sazanami_numerics::mean_flow::ActsBy;
use sazanami_numerics::{Real, Vector};

use crate::case::Case;
use crate::presets::Solver;
use crate::read::Context;
use crate::tables::{BoundarySide, Drive, FluidName, Placement, SIDE_NAMES, Step};
use crate::units::rounded;

/// Longest step over the time of the answer; the force swings from one on.
const LONGEST_STEP: Real = 0.25;

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
    check_mean(case, drive.above, cx);
    let longest = match (&case.particles, case.solver) {
        (Some(particles), Solver::Mps) => particles.dt.unwrap_or(particles.dt_max),
        _ => match case.fluid.step {
            Step::Fixed(dt) => dt,
            Step::Adaptive { longest, .. } => longest,
        },
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
    let level =
        case.liquids.iter().filter(|liquid| liquid.fluid == FluidName::Liquid).map(|liquid| match liquid.placement {
            Placement::Absolute(position) => position.z + liquid.region.heights()[1],
            Placement::AboveBed { .. } => Real::INFINITY,
        });
    if let Some(level) = level.reduce(Real::max).filter(|level| *level <= above) {
        cx.report
            .error(place, "there is no water above `above`: nothing would be held")
            .label(format!("the water reaches up to {} mm", rounded(1e3 * level)))
            .help("choose the height of the top of the bed, or leave it out for all the water");
    }
}

/// A gradient of pressure from outside acts on grains that water overlaps, and goes through the box.
fn check_volume(case: &Case, drive: &Drive, cx: &mut Context<'_>) {
    if drive.acts_by == ActsBy::Mass {
        return;
    }
    let place = cx.places.at("drive.acts_by");
    if case.solver == Solver::Mics {
        cx.report
            .error(place, "on the grid the force that drives a flow acts by mass")
            .label("a gradient of pressure from outside needs `solver = \"mps\"`")
            .help("leave out `acts_by`");
        return;
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
