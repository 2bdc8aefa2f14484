//! What a flow that is driven needs of the rest of a case.

use sazanami_numerics::Real;

use crate::case::Case;
use crate::presets::Solver;
use crate::read::Context;
use crate::tables::{BoundarySide, SIDE_NAMES, Step};
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
    let (floor, top) = (case.domain.lower.z, case.domain.upper.z);
    if drive.above < floor || drive.above >= top {
        let [floor, top] = [floor, top].map(|z| rounded(1e3 * z));
        cx.report
            .error(cx.places.at("drive.above"), "`above` lies outside the box")
            .label(format!("the box reaches from {floor} mm to {top} mm"))
            .help("choose the height of the top of the bed, or leave it out for all the water");
    }
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
