//! Grains that lie within each other.

use sazanami_dem::{DEEP_OVERLAP, LARGEST_OVERLAP};
use sazanami_numerics::{Real, Vector};

use super::placed::{Origin, Placed, no_corners};
use super::{MOST_ALIKE, Search};

/// Pairs with boxes that meet, for each grain, in which contact spheres are compared.
const MOST_LOOKED_AT: usize = 100;
/// Overlapping pairs that are looked for beside one for each grain.
const MOST_PAIRS: usize = 1000;

/// The box round a grain's contact spheres.
#[derive(Clone, Copy, Debug)]
struct Hull {
    grain: usize,
    lower: Vector,
    upper: Vector,
}

impl Search<'_> {
    /// Grains must not lie within each other.
    pub(super) fn overlaps(&mut self, placed: &[Placed]) {
        // Grains larger than the box stick out of it, which is said already.
        let longest = self.case.domain.extent().length();
        let fits = |grain: &Placed| grain.factor * self.shapes[grain.population].bounding_radius() < longest;
        let settled = |n: &usize| {
            let grain = &placed[*n];
            grain.slack == 0.0 && grain.origin != (Origin::Bed { relaxes: true }) && fits(grain)
        };
        let mut order: Vec<Hull> = (0..placed.len()).filter(settled).map(|n| self.hull(n, &placed[n])).collect();
        order.sort_by(|a, b| a.lower.x.total_cmp(&b.lower.x));
        // More than this many pairs are counted no further: grains far too large for their places all overlap one another.
        let most = MOST_PAIRS + order.len();
        let (mut found, mut looked_at) = (Vec::new(), 0);
        'search: for (rank, a) in order.iter().enumerate() {
            let mut mine = None;
            for b in &order[rank + 1..] {
                if b.lower.x > a.upper.x {
                    break;
                }
                let (lower, upper) = (a.lower.max(b.lower), a.upper.min(b.upper));
                if lower.cmpgt(upper).any() {
                    continue;
                }
                looked_at += 1;
                if looked_at > MOST_LOOKED_AT * (MOST_PAIRS + order.len()) {
                    self.not_all_looked_at();
                    break 'search;
                }
                let mine = mine.get_or_insert_with(|| self.spheres(&placed[a.grain]));
                let overlap = self.overlap(mine, &placed[b.grain], [lower, upper]);
                if overlap > DEEP_OVERLAP {
                    found.push((a.grain.min(b.grain), a.grain.max(b.grain), overlap));
                    if found.len() == most {
                        break 'search;
                    }
                }
            }
        }
        let at_least = if found.len() == most { "at least " } else { "" };
        found.sort_by_key(|&(a, b, _)| (a, b));
        let of_beds =
            |&(a, b, _): &(usize, usize, Real)| [a, b].iter().all(|&n| matches!(placed[n].origin, Origin::Bed { .. }));
        let (within_beds, others): (Vec<_>, Vec<_>) = found.into_iter().partition(of_beds);
        for &(a, b, overlap) in others.iter().take(MOST_ALIKE) {
            self.overlapping(
                [&placed[a], &placed[b]],
                overlap,
                "",
                "move one of the two: contacts are thin against grains",
            );
        }
        if let Some(&(a, b, overlap)) = within_beds.iter().max_by(|a, b| a.2.total_cmp(&b.2)) {
            let more = match within_beds.len() {
                1 => String::new(),
                pairs => format!("; {at_least}{pairs} pairs of the bed by more than {:.0} %", 1e2 * DEEP_OVERLAP),
            };
            let help = "`relax = true` lets the bed come to rest with these contact spheres before the run begins";
            self.overlapping([&placed[a], &placed[b]], overlap, &more, help);
        }
    }

    /// Says that the grains lie so close that not all pairs were looked at.
    fn not_all_looked_at(&mut self) {
        self.report
            .warning(self.loaded.places.near("grains.0.shape"), "the grains are long for the places they are given")
            .label(format!(
                "each comes near more than {MOST_LOOKED_AT} others: overlaps were not looked for in all pairs"
            ))
            .help("check the units of shapes and positions");
    }

    /// Says that two grains overlap.
    fn overlapping(&mut self, [a, b]: [&Placed; 2], overlap: Real, more: &str, help: &str) {
        let (first, _) = self.name(a);
        let (second, span) = self.name(b);
        let label = format!("by {:.0} % of the smaller contact sphere's radius{more}", 1e2 * overlap);
        let title = format!("{second} overlaps {first}");
        if overlap > LARGEST_OVERLAP {
            self.report.error(span, title).label(label).help(help);
        } else {
            self.report.warning(Some(span), title).label(label);
        }
    }

    /// The box round the contact spheres of a grain.
    fn hull(&self, number: usize, grain: &Placed) -> Hull {
        let spheres = self.shapes[grain.population].contact_spheres();
        let [lower, upper] = spheres.centres.iter().zip(&spheres.radii).fold(no_corners(), |[low, high], (&c, &r)| {
            let (centre, radius) = (grain.position + grain.orientation * (grain.factor * c), grain.factor * r);
            [low.min(centre - radius), high.max(centre + radius)]
        });
        Hull { grain: number, lower, upper }
    }

    /// Largest overlap of two grains' contact spheres over the smaller radius, where their hulls meet.
    fn overlap(&self, mine: &[(Vector, Real)], other: &Placed, [lower, upper]: [Vector; 2]) -> Real {
        let near = |&&(centre, radius): &&(Vector, Real)| centre.distance(centre.clamp(lower, upper)) <= radius;
        let mine: Vec<&(Vector, Real)> = mine.iter().filter(near).collect();
        let mut largest: Real = 0.0;
        if mine.is_empty() {
            return largest;
        }
        for (y, s) in self.spheres(other).iter().filter(near) {
            for (x, r) in &mine {
                let squared = x.distance_squared(*y);
                if squared < (r + s) * (r + s) {
                    largest = largest.max((r + s - squared.sqrt()) / r.min(*s));
                }
            }
        }
        largest
    }
}
