//! Ways of the fluid that a body closes.

use super::Search;
use super::placed::Placed;
use crate::case::meaning::{BoundarySide, GrainPlacement, Motion, SIDE_NAMES};

/// Share of its box round it that a body fills as a block does, and share of a section's width that closes it.
const BLOCK: f64 = 0.99;

impl Search<'_> {
    /// No body may close a section through which fluid has to flow: it would flow through the body.
    pub(super) fn ways_are_free(&mut self, placed: &[Placed]) {
        for grain in placed {
            let GrainPlacement::List(list) = &self.case.grains[grain.population].placement else { continue };
            let listed = &list[grain.index];
            if listed.motion == Motion::Free {
                continue;
            }
            let velocity = listed.velocity;
            let Some(d) = self.closed_section(grain) else { continue };
            let (name, span) = self.name(grain);
            let flow =
                self.case.mean_flow().filter(|flow| flow.held[d] && !flow.moves_box).map(|flow| flow.velocity[d]);
            let open = |side: usize| {
                let side = &self.case.boundary[d][side];
                !matches!(side, BoundarySide::NoSlip | BoundarySide::Slip | BoundarySide::Moving { .. })
            };
            if flow.is_some_and(|flow| flow != velocity[d]) {
                self.report
                    .error(span, format!("{name} closes the way of the flow along x{}", d + 1))
                    .label("it fills the section, and `drive.mean_velocity` asks for a flow through it")
                    .help("make it smaller than the section, or drive the flow by `drive.acceleration`");
            } else if velocity[d] != 0.0
                && let Some(side) = (0..2).find(|&side| !open(side))
            {
                self.report
                    .error(span, format!("{name} moves along x{} and fills the section: the fluid has no way", d + 1))
                    .label(format!("what lies between it and the side {} keeps its volume", SIDE_NAMES[d][side]))
                    .help(format!(
                        "leave a gap beside it, or open that side: `boundary.{} = \"outflow\"`",
                        SIDE_NAMES[d][side]
                    ));
            }
        }
    }

    /// The direction normal to a section of the box that a body fills.
    fn closed_section(&self, grain: &Placed) -> Option<usize> {
        let [low, high] = self.surface(grain);
        let (size, room) = (high - low, self.case.domain.extent());
        let volume = self.shapes[grain.population].volume() * grain.factor.powi(3);
        if volume < BLOCK * size.element_product() {
            return None;
        }
        (0..3).find(|&d| size[d] < BLOCK * room[d] && (0..3).all(|e| e == d || size[e] >= BLOCK * room[e]))
    }
}
