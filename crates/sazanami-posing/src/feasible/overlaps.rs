//! Grains that lie within each other.

use std::collections::HashSet;

use sazanami_dem::{Body, DEEP_OVERLAP, LARGEST_OVERLAP};
use sazanami_numerics::particles::BinIndex;
use sazanami_numerics::{Real, Vector};

use super::placed::{Origin, Placed, no_corners};
use super::{MOST_ALIKE, Search};
use crate::assembly::grains;
use crate::case::meaning::{GrainPlacement, LatticePlacement};
use crate::check::ShapeFacts;

/// Pairs with boxes that meet, for each grain, in which contact spheres are compared.
const MOST_LOOKED_AT: usize = 100;
/// Pairs of boxes that are compared, for each grain.
const MOST_COMPARED: usize = 10_000;
/// Overlapping pairs that are looked for beside one for each grain.
const MOST_PAIRS: usize = 1000;

/// The box round a grain's contact spheres.
#[derive(Clone, Copy, Debug)]
struct Hull {
    grain: usize,
    lower: Vector,
    upper: Vector,
}

impl Hull {
    fn extent(&self) -> Real {
        (self.upper - self.lower).max_element()
    }
}

/// Outcome of a search for pairs.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Outcome {
    All,
    /// The caller has seen enough.
    Enough,
    /// So many boxes lie in one place that not all were compared.
    TooMany,
}

/// Calls `visit` with each pair of boxes that meet, the longer one first, and the part they share, until that returns false.
/// Compares no more than `most` pairs.
fn meeting(hulls: &mut [Hull], most: usize, mut visit: impl FnMut(&Hull, &Hull, [Vector; 2]) -> bool) -> Outcome {
    hulls.sort_by(|a, b| b.extent().total_cmp(&a.extent()).then(a.grain.cmp(&b.grain)));
    let corners: Vec<Vector> = hulls.iter().map(|hull| hull.lower).collect();
    let mean = hulls.iter().map(Hull::extent).sum::<Real>() / hulls.len().max(1) as Real;
    let mut index = BinIndex::default();
    index.sort(&corners, mean.max(Real::MIN_POSITIVE));
    let (mut compared, mut near) = (0, Vec::new());
    for (rank, a) in hulls.iter().enumerate() {
        // A shorter one that reaches its box begins no farther below it than it is long.
        near.clear();
        index.visit(a.lower - a.extent(), a.upper, |b| near.push(b as usize));
        compared += near.len();
        if compared > most {
            return Outcome::TooMany;
        }
        near.retain(|&b| b > rank);
        near.sort_unstable();
        for b in near.iter().map(|&b| &hulls[b]) {
            let (lower, upper) = (a.lower.max(b.lower), a.upper.min(b.upper));
            if lower.cmple(upper).all() && !visit(a, b, [lower, upper]) {
                return Outcome::Enough;
            }
        }
    }
    Outcome::All
}

impl Search<'_> {
    /// Grains must not lie within each other, nor within what lies across a periodic side.
    pub(super) fn overlaps(&mut self, lying: &[Placed]) {
        // Grains larger than the box stick out of it, which is said already.
        let longest = self.case.domain.extent().length();
        let fits = |grain: &Placed| grain.factor * self.shapes[grain.population].bounding_radius() < longest;
        let settled = |grain: &&Placed| grain.origin != (Origin::Bed { relaxes: true }) && fits(grain);
        let mut placed: Vec<Placed> = lying.iter().filter(settled).copied().collect();
        let own = placed.len();
        placed.extend((0..own).flat_map(|n| self.images(&placed[n])).collect::<Vec<_>>());
        let mut hulls: Vec<Hull> = placed.iter().enumerate().map(|(n, grain)| self.hull(n, grain)).collect();
        // More than this many pairs are counted no further: grains far too large for their places all overlap one another.
        let most = MOST_PAIRS + hulls.len();
        let (mut found, mut looked_at) = (Vec::new(), 0);
        let mut mine = (usize::MAX, Vec::new());
        // Such grains stand where they are whatever they overlap.
        let held_at_random = |hull: &Hull| {
            let population = &self.case.grains[placed[hull.grain].population];
            let is_random = |on: &LatticePlacement| on.jitter > 0.0 || on.random_orientation;
            matches!(&population.placement, GrainPlacement::Lattice(on) if is_random(on))
                && !population.has_free_grains()
        };
        let outcome = meeting(&mut hulls, MOST_COMPARED * most, |a, b, shared| {
            if held_at_random(a) && held_at_random(b) {
                return true;
            }
            looked_at += 1;
            if looked_at > MOST_LOOKED_AT * most {
                return false;
            }
            if mine.0 != a.grain {
                mine = (a.grain, self.spheres(&placed[a.grain]));
            }
            let overlap = self.overlap(&mine.1, &placed[b.grain], shared);
            if overlap > DEEP_OVERLAP {
                found.push((a.grain.min(b.grain), a.grain.max(b.grain), overlap));
            }
            found.len() < most
        });
        if outcome == Outcome::TooMany || looked_at > MOST_LOOKED_AT * most {
            self.not_all_looked_at();
        }
        let at_least = if found.len() == most { "at least " } else { "" };
        // A pair of images is that of their grains.
        let name = |n: usize| (placed[n].population, placed[n].index);
        found.sort_by_cached_key(|&(a, b, _)| (a >= own, b >= own, a, b));
        let mut seen = HashSet::new();
        found.retain(|&(a, b, _)| name(a) != name(b) && seen.insert([name(a).min(name(b)), name(a).max(name(b))]));
        let of_beds =
            |&(a, b, _): &(usize, usize, Real)| [a, b].iter().all(|&n| matches!(placed[n].origin, Origin::Bed { .. }));
        let (within_beds, others): (Vec<_>, Vec<_>) = found.into_iter().partition(of_beds);
        for &(a, b, overlap) in others.iter().take(MOST_ALIKE) {
            let on_lattice =
                |n: usize| matches!(self.case.grains[placed[n].population].placement, GrainPlacement::Lattice(_));
            let help = if on_lattice(a) && on_lattice(b) {
                "place fewer on the lattice, take less `jitter` or a larger block: contacts are thin against grains"
            } else {
                "move one of the two: contacts are thin against grains"
            };
            self.overlapping([&placed[a], &placed[b]], overlap, "", help);
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

    /// Grains that are packed must not begin so far within each other that the packing ends at once. Those across periodic sides lie as far
    /// apart as others.
    pub(super) fn packed_apart(&mut self, facts: &[ShapeFacts]) {
        let spacing = |n: usize| match &self.case.grains[n].placement {
            GrainPlacement::Packed(how) => Some((n, how.spacing)),
            _ => None,
        };
        // From a spacing of 1 on they begin apart.
        let closer = |(_, spacing): &(usize, Real)| *spacing < 1.0;
        let Some((first, _)) = (0..facts.len()).find_map(spacing).filter(closer) else { return };
        let bodies: Vec<Body> = facts.iter().filter_map(|facts| facts.body.clone()).collect();
        let Some((settings, mut grains)) = grains::to_pack(self.case) else { return };
        // That the box is too narrow is said already.
        if settings.arrange(&bodies, &mut grains).is_err() {
            return;
        }
        let placed: Vec<Placed> = grains.iter().map(|grain| self.as_it_lies(grain)).collect();
        let Some((a, b, overlap)) = self.deepest(&placed).filter(|(.., overlap)| *overlap > DEEP_OVERLAP) else {
            return;
        };
        let [(one, _), (other, _)] = [a, b].map(|n| self.name(&placed[n]));
        let label = format!("{other} overlaps {one} by {:.0} % of the smaller contact sphere's radius", 1e2 * overlap);
        let title = "grains that are packed begin within each other";
        let span = self.loaded.places.at(&format!("grains.{first}.placement.packed.spacing"));
        let finding = if overlap > LARGEST_OVERLAP {
            let most = format!("{label}, more than {:.0} % ends the run", 1e2 * LARGEST_OVERLAP);
            self.report.error(span, title).label(most)
        } else {
            self.report.warning(Some(span), title).label(label)
        };
        finding.help("leave out `spacing`, or take 1 or more: their springs throw them apart");
    }

    /// The deepest overlap of two grains over the smaller contact sphere's radius, as far as they are looked through, and the two; the search
    /// ends with one that ends the run.
    fn deepest(&self, placed: &[Placed]) -> Option<(usize, usize, Real)> {
        let mut hulls: Vec<Hull> = placed.iter().enumerate().map(|(n, grain)| self.hull(n, grain)).collect();
        let most = MOST_PAIRS + hulls.len();
        let (mut found, mut looked_at): (Option<(usize, usize, Real)>, usize) = (None, 0);
        let mut mine = (usize::MAX, Vec::new());
        meeting(&mut hulls, MOST_COMPARED * most, |a, b, shared| {
            if mine.0 != a.grain {
                mine = (a.grain, self.spheres(&placed[a.grain]));
            }
            let overlap = self.overlap(&mine.1, &placed[b.grain], shared);
            if found.is_none_or(|(.., deepest)| overlap > deepest) {
                found = Some((a.grain, b.grain, overlap));
            }
            looked_at += 1;
            overlap <= LARGEST_OVERLAP && looked_at < MOST_LOOKED_AT * most
        });
        found
    }

    /// Says that the grains lie so close that not all pairs were looked at.
    fn not_all_looked_at(&mut self) {
        self.report
            .warning(self.loaded.places.near("grains.0.shape"), "the grains are long for the places they are given")
            .label(format!(
                "each comes near more than {MOST_LOOKED_AT} others, or {MOST_COMPARED} lie about it: overlaps were not looked for \
                 in all pairs"
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

    /// A grain where periodic sides that it reaches through show it again.
    fn images(&self, grain: &Placed) -> Vec<Placed> {
        let (domain, Hull { lower, upper, .. }) = (&self.case.domain, self.hull(0, grain));
        let mut images = vec![*grain];
        for d in (0..3).filter(|&d| self.case.periodic()[d]) {
            let before = images.clone();
            let ways = [(lower[d] < domain.lower[d], 1.0), (upper[d] > domain.upper[d], -1.0)];
            for (_, sign) in ways.into_iter().filter(|(reaches, _)| *reaches) {
                let shift = sign * domain.extent()[d] * Vector::AXES[d];
                images.extend(before.iter().map(|image| Placed { position: image.position + shift, ..*image }));
            }
        }
        images.split_off(1)
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

#[cfg(test)]
mod tests {
    use super::*;
    use sazanami_numerics::Random;

    fn hull(grain: usize, middle: Vector, edges: Vector) -> Hull {
        Hull { grain, lower: middle - 0.5 * edges, upper: middle + 0.5 * edges }
    }

    #[test]
    fn pairs_of_boxes_are_those_of_comparing_all() {
        let mut numbers = Random::new(11);
        let mut random = move || numbers.unit();
        let mut hulls: Vec<Hull> = (0..500)
            .map(|n| {
                let middle = Vector::new(10.0 * random(), 10.0 * random(), 10.0 * random());
                // From small to far larger, long ones among them.
                let size = 0.2 * 20.0_f64.powf(random().powi(4));
                hull(n, middle, size * Vector::new(1.0, 0.3 + random(), 1.0))
            })
            .collect();
        let meet = |a: &Hull, b: &Hull| a.lower.max(b.lower).cmple(a.upper.min(b.upper)).all();
        let all = hulls.clone();
        let mut expected: Vec<(usize, usize)> = (0..500).flat_map(|a| (0..a).map(move |b| (b, a))).collect();
        expected.retain(|&(a, b)| meet(&all[a], &all[b]));
        expected.sort_unstable();
        let mut found = Vec::new();
        let outcome = meeting(&mut hulls, usize::MAX, |a, b, _| {
            found.push((a.grain.min(b.grain), a.grain.max(b.grain)));
            true
        });
        found.sort_unstable();
        assert_eq!((outcome, &found), (Outcome::All, &expected));
        assert!(found.len() > 200, "{}", found.len());
    }

    #[test]
    fn columns_are_looked_through_in_proportion_to_their_grains() {
        for up in 0..3 {
            let count = 50_000;
            let at = |n: usize| Vector::AXES[up] * n as Real + 0.3 * Vector::splat((n % 3) as Real);
            let mut column: Vec<Hull> = (0..count).map(|n| hull(n, at(n), Vector::splat(0.9))).collect();
            assert_eq!(meeting(&mut column, 30 * count, |_, _, _| true), Outcome::All, "{up}");
        }
        // Boxes that all lie in one place are not compared without end.
        let mut heap: Vec<Hull> = (0..2000).map(|n| hull(n, Vector::ZERO, Vector::ONE)).collect();
        assert_eq!(meeting(&mut heap, 30 * 2000, |_, _, _| true), Outcome::TooMany);
    }
}
