//! Ways of the fluid that a body closes.

use super::Search;
use super::placed::Placed;
use crate::case::meaning::{BoundarySide, GrainPlacement, Motion, SIDE_NAMES};

/// Share of its bounding box from which a body counts as a block.
const BLOCK: f64 = 0.99;

impl Search<'_> {
    /// No body placed by a list may close a section through which fluid has to flow at another velocity: it would flow through the body.
    pub(super) fn ways_are_free(&mut self, placed: &[Placed]) {
        for grain in placed {
            let GrainPlacement::List(list) = &self.case.grains[grain.population].placement else { continue };
            let listed = &list[grain.index];
            let Some(d) = self.closed_section(grain) else { continue };
            let own = match listed.motion {
                Motion::Free | Motion::WithWalls => continue,
                Motion::Fixed => 0.0,
                Motion::Prescribed => listed.velocity[d],
            };
            let held =
                self.case.mean_flow().filter(|flow| flow.held[d] && !flow.moves_box).map(|flow| flow.velocity[d]);
            // What lies before a side that is not open moves as that side has it.
            let before = |side: usize| match &self.case.boundary[d][side] {
                BoundarySide::Inflow { velocity, .. } => Some((velocity[d], SIDE_NAMES[d][side])),
                BoundarySide::Periodic => None,
                side if side.is_open() => None,
                _ => Some((0.0, SIDE_NAMES[d][side])),
            };
            let of_sides = (0..2).filter_map(before).find(|(velocity, _)| *velocity != own);
            let reason = match (held.filter(|held| *held != own), of_sides) {
                (Some(held), _) => format!("`drive.mean_velocity` asks for {held} m/s through it"),
                (None, Some((velocity, side))) => {
                    format!("the side {side} holds what lies between them at {velocity} m/s")
                }
                (None, None) => continue,
            };
            let (name, span) = self.name(grain);
            self.report
                .error(
                    span,
                    format!(
                        "{name} fills the section normal to x{} and moves at {own} m/s: the fluid has no way",
                        d + 1
                    ),
                )
                .label(reason)
                .help("leave a gap of a cell beside it, or open a side");
        }
    }

    /// The direction normal to a section of the box that a body fills, to half a cell on either side, between sides that are closed.
    fn closed_section(&self, grain: &Placed) -> Option<usize> {
        let [low, high] = self.surface(grain);
        let (size, room, cell) = (high - low, self.case.domain.extent(), self.case.domain.grid().spacing);
        let volume = self.shapes[grain.population].volume() * grain.factor.powi(3);
        if volume < BLOCK * size.element_product() {
            return None;
        }
        let is_closed =
            |e: usize| room[e] - size[e] < cell[e] && !self.case.boundary[e].iter().any(BoundarySide::is_open);
        (0..3).find(|&d| room[d] - size[d] >= cell[d] && (0..3).all(|e| e == d || is_closed(e)))
    }
}
