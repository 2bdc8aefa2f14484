//! Grains that stick out of the box.

use sazanami_dem::{DEEP_OVERLAP, LARGEST_OVERLAP};
use sazanami_numerics::{Real, Vector};

use super::placed::{Origin, Placed, no_corners};
use super::{MOST_ALIKE, Search};
use crate::case::amounts::length;
use crate::case::meaning::{GrainPlacement, SIDE_NAMES};

/// Side of the box out of which a grain stands, and the depth.
#[derive(Clone, Copy, Debug)]
struct Outside {
    direction: usize,
    side: usize,
    /// \[m]
    depth: Real,
}

impl std::fmt::Display for Outside {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(formatter, "{} beyond the side {}", length(self.depth), SIDE_NAMES[self.direction][self.side])
    }
}

/// Part of its size by which a grain may overlap a gate: round-off.
const TOUCH: Real = 1e-9;

impl Search<'_> {
    /// No grain that the case puts may stand in a gate.
    pub(super) fn clear_of_gates(&mut self, placed: &[Placed]) {
        let in_gate = |grain: &Placed| {
            let spheres = self.spheres(grain);
            let stands = |plate: &sazanami_mps::gates::Gate| {
                spheres.iter().any(|&(x, radius)| plate.clearance(x) < radius * (1.0 - TOUCH))
            };
            self.case.gates.iter().find(|gate| stands(&gate.plate())).map(|gate| gate.name.clone())
        };
        let found: Vec<(Placed, String)> =
            placed.iter().filter_map(|grain| Some((*grain, in_gate(grain)?))).take(MOST_ALIKE).collect();
        for (grain, gate) in found {
            let (name, span) = self.name(&grain);
            self.report
                .error(span, format!("{name} stands in the gate `{gate}`"))
                .label("a grain keeps half its size from the plate")
                .help("move the grain or the gate");
        }
    }

    /// No grain may stick out of a wall.
    pub(super) fn within_box(&mut self, placed: &[Placed]) {
        let tolerance = 1e-9 * self.case.domain.extent().max_element();
        let mut found = 0;
        let mut of_beds: Vec<Vec<(usize, Outside)>> = vec![Vec::new(); self.case.grains.len()];
        for (number, grain) in placed.iter().enumerate() {
            let Some(out) = self.outside(grain, tolerance) else { continue };
            if let Origin::Bed { .. } = grain.origin {
                of_beds[grain.population].push((number, out));
                continue;
            }
            found += 1;
            if found <= MOST_ALIKE {
                let (name, span) = self.name(grain);
                self.report
                    .error(span, format!("{name} sticks out of the box"))
                    .label(out.to_string())
                    .help("move the grain, or enlarge the box");
            }
        }
        for (population, list) in of_beds.iter().enumerate() {
            let Some((number, worst)) = list.iter().max_by(|a, b| a.1.depth.total_cmp(&b.1.depth)) else { continue };
            self.bed_outside(population, list.len(), &placed[*number], *worst);
        }
    }

    /// Says that grains of a bed lie outside the box.
    fn bed_outside(&mut self, population: usize, count: usize, worst: &Placed, out: Outside) {
        let (name, span) = self.name(worst);
        let finding = if count == 1 {
            self.report.error(span, format!("{name} sticks out of the box")).label(out.to_string())
        } else {
            let title =
                format!("{count} grains of the bed of `{}` stick out of the box", self.case.grains[population].name);
            self.report.error(span, title).label(format!("{name} the most: {out}"))
        };
        if let (GrainPlacement::Bed(file), Some(bed)) =
            (&self.case.grains[population].placement, &self.beds[population])
        {
            let size = file.scale * (bed.upper - bed.lower);
            finding.help(format!(
                "the bed was packed in a box of {} x {} x {} (times `scale`): take one as large",
                length(size.x),
                length(size.y),
                length(size.z)
            ));
        }
    }

    /// Largest depth by which a grain stands out of the box, and the side; `None` if it lies within.
    ///
    /// Grains put by hand may not do so at all. Those of a bed press against the sides, and their contact spheres
    /// need not be those they were packed with: they may overlap a side as far as they may overlap each other.
    fn outside(&self, grain: &Placed, tolerance: Real) -> Option<Outside> {
        let (lower, upper) = (self.case.domain.lower, self.case.domain.upper);
        let shape = &self.shapes[grain.population];
        let spheres = shape.contact_spheres().bounding_radius();
        let radius = shape.exact().map_or(shape.bounding_radius(), |exact| spheres.max(exact.bounding_radius()));
        let reach = Vector::splat(grain.factor * radius);
        let ball = [grain.position - reach, grain.position + reach];
        let corners = if (ball[0] - lower).min(upper - ball[1]).min_element() >= 0.0 {
            ball
        } else {
            match grain.origin {
                Origin::Bed { relaxes } => {
                    let share = if relaxes { LARGEST_OVERLAP } else { DEEP_OVERLAP };
                    let top = if relaxes { share } else { 0.0 };
                    self.spheres(grain).iter().fold(no_corners(), |[low, high], &(centre, radius)| {
                        let room = Vector::new(share, share, top);
                        [low.min(centre - radius * (1.0 - share)), high.max(centre + radius * (Vector::ONE - room))]
                    })
                }
                Origin::Case => {
                    let [low, mut high] = self.surface(grain);
                    // The run refuses contact spheres above the lid.
                    for (centre, radius) in self.spheres(grain) {
                        high.z = high.z.max(centre.z + radius);
                    }
                    [low, high]
                }
            }
        };
        let depth = |d: usize, side: usize| if side == 0 { lower[d] - corners[0][d] } else { corners[1][d] - upper[d] };
        (0..6)
            .map(|n| Outside { direction: n % 3, side: n / 3, depth: depth(n % 3, n / 3) })
            .filter(|out| out.depth > tolerance && self.case.holds_grains(out.direction, out.side))
            .max_by(|a, b| a.depth.total_cmp(&b.depth))
    }
}
