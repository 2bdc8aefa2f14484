//! Grains whose prescribed motion takes them out of the box.

use sazanami_dem::{Grain, Motion};
use sazanami_numerics::{Real, Vector};

use super::{MOST_ALIKE, Search};
use crate::case::amounts::time;
use crate::case::meaning::{RunEnd, SIDE_NAMES};

/// Times in a run at which the places of grains are looked at.
const TIMES: usize = 1000;

impl Search<'_> {
    /// No grain may be carried through a wall: what is prescribed passes it, and the run ends there if it has not ended before.
    pub(super) fn carried_within(&mut self, grains: &[Grain]) {
        let leaves = |grain: &&Grain| grain.motion == Motion::Prescribed && grain.velocity != Vector::ZERO;
        let found: Vec<_> = grains
            .iter()
            .filter(leaves)
            .filter_map(|grain| Some((grain, self.leaves(grain)?)))
            .take(MOST_ALIKE)
            .collect();
        for (grain, (after, side)) in found {
            let (name, span) = self.name(&self.as_it_lies(grain));
            let title = format!("{name} is carried through the wall {side}");
            let run = &self.case.run;
            let finding = if matches!(run.end, RunEnd::At(_)) && run.steps.is_none() {
                self.report.error(span, title)
            } else {
                self.report.warning(Some(span), title)
            };
            finding
                .label(format!("its centre is there at {}, and the run goes on to {}", time(after), time(run.until)))
                .help("end the run before, give it another velocity, or open the side");
        }
    }

    /// When the centre of a grain that keeps its velocity passes a wall before the end of the run \[s], and which.
    fn leaves(&self, grain: &Grain) -> Option<(Real, &'static str)> {
        let (lower, upper, until) = (self.case.domain.lower, self.case.domain.upper, self.case.run.until);
        (1..=TIMES).map(|n| until * n as Real / TIMES as Real).find_map(|time| {
            let tank = if self.case.walls_move() { self.case.tank_at(time)[0] } else { Vector::ZERO };
            let place = grain.position + time * grain.velocity - tank;
            let beyond = |d: usize, side: usize| if side == 0 { place[d] < lower[d] } else { place[d] > upper[d] };
            let wall =
                (0..6).map(|n| (n / 2, n % 2)).find(|&(d, side)| self.case.holds_grains(d, side) && beyond(d, side));
            wall.map(|(d, side)| (time, SIDE_NAMES[d][side]))
        })
    }
}
