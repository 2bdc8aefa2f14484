//! What a box that follows its liquid needs of the rest of a case.

use crate::case::Case;
use crate::driven::is_held;
use crate::presets::Solver;
use crate::read::Context;
use crate::tables::{BoundarySide, FluidName, SIDE_NAMES, place_of_side};

/// Refuses boxes that follow their liquid where something in them would not be what it is outside.
pub fn check(case: &Case, cx: &mut Context<'_>) {
    let Some(frame) = case.frame.as_ref().filter(|_| case.follows_liquid()) else { return };
    let place = cx.places.at("frame.follows");
    let mut refuse = |what: &str, label: &str, help: &str| {
        cx.report.error(place.clone(), what.to_owned()).label(label.to_owned()).help(help.to_owned());
    };
    if case.solver == Solver::Mps {
        refuse(
            "moving particles have no gas that they fall through",
            "this is for `solver = \"mics\"`",
            "leave it out",
        );
        return;
    }
    if case.gravity.z == 0.0 || case.gravity.x != 0.0 || case.gravity.y != 0.0 {
        refuse(
            "a box follows its liquid along x3",
            "there is no gravity along x3, or some along another direction",
            "give `gravity` along x3 alone, or leave this out",
        );
    }
    if frame.motion.is_some() || frame.oscillation.is_some() || frame.acceleration != sazanami_numerics::Vector::ZERO {
        refuse(
            "a box that follows its liquid is not moved otherwise",
            "`frame` has an acceleration or a motion as well",
            "keep one of the two",
        );
    }
    if case.drive.is_some() || case.fluid.carrying_flow.is_some() {
        refuse(
            "in a box that follows its liquid nothing else drives the flow",
            "there is a `drive` or a carrying flow",
            "leave it out",
        );
    }
    if !case.liquids.iter().any(|liquid| liquid.fluid == FluidName::Liquid) {
        refuse("there is no liquid to follow", "the case has no `[[liquid]]`", "add one");
    }
    if case.grains.iter().any(is_held) {
        refuse("grains that are held would fall with the box", "a population does not move freely", "let it be free");
    }
    let along = |d: usize| case.gravity[d] != 0.0;
    let enters = |side: &BoundarySide| matches!(side, BoundarySide::Inflow { .. });
    let lets_in = (0..3).any(|d| along(d) && case.boundary[d].iter().any(enters));
    if !lets_in {
        refuse(
            "no side lets in the fluid that the liquid falls through",
            "none along gravity is an inflow",
            "write `boundary.x3_lower.inflow = { velocity = [\"0 m/s\", \"0 m/s\", \"0 m/s\"], fluid = \"gas\" }` for a fall from rest, and `boundary.x3_upper = \"outflow\"`",
        );
    }
    for (d, upper) in (0..6).map(|n| (n / 2, n % 2)) {
        let (what, label, help) = match case.boundary[d][upper] {
            BoundarySide::NoSlip | BoundarySide::Moving { .. } if !along(d) => {
                ("a wall would fall with the box", "it holds the fluid", "make it `slip` or periodic")
            }
            BoundarySide::NoSlip | BoundarySide::Moving { .. } | BoundarySide::Slip if along(d) && lets_in => (
                "the fluid that the liquid falls through cannot leave",
                "gravity runs across this side, and it is closed",
                "make it `outflow`",
            ),
            BoundarySide::Outflow | BoundarySide::FixedPressure { .. } if !along(d) => (
                "the pressure outside this side is not that of a box that falls",
                "it is open, and gravity runs along it",
                "make it `slip` or periodic",
            ),
            _ => continue,
        };
        let side = place_of_side(&cx.places, d, upper);
        cx.report.error_at(side, what).label(format!("{}: {label}", SIDE_NAMES[d][upper])).help(help);
    }
}
