//! Grains that make the surface of the bed: not those in the air, and only those seen from above.

use std::sync::atomic::{AtomicUsize, Ordering};

use sazanami_numerics::{Real, Vector};
use sazanami_parallel::for_each_chunk;

use super::{CountedGrains, ErosionSettings};
use crate::bed::{BedView, GRAINS_AT_ONCE};
use crate::height_map::HeightMap;

/// Highest node of a grain over its centre of mass.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct GrainTop {
    /// Horizontal position of the centre of mass \[m].
    pub x: Real,
    /// Horizontal position of the centre of mass \[m].
    pub y: Real,
    /// Height of the highest node \[m].
    pub height: Real,
}

/// Grains that count for the bed surface, and those in the air: how many, and their volume [m^3].
pub(super) struct SurfaceGrains {
    pub tops: Vec<GrainTop>,
    pub airborne: usize,
    pub airborne_volume: Real,
    /// The bed seen from above.
    pub map: HeightMap,
}

impl SurfaceGrains {
    pub fn of(bed: &BedView, settings: &ErosionSettings) -> Self {
        let bounds = bed.bounds();
        let (of_bed, map) = sort_out(bed, &bounds, settings);
        let counts = match settings.counted {
            CountedGrains::Surface => {
                map.pixels_seen(bed.len()).iter().map(|&n| n >= settings.exposed_pixels).collect()
            }
            CountedGrains::All => vec![true; bed.len()],
        };
        let tops = (0..bed.len())
            .filter(|&grain| counts[grain] && of_bed[grain])
            .map(|grain| GrainTop { x: bed.position[grain].x, y: bed.position[grain].y, height: bounds[grain].1.z })
            .collect();
        let flying = || (0..bed.len()).filter(|&grain| !of_bed[grain] && !bed.held[grain]);
        let airborne_volume = flying().map(|grain| bed.volume_of(grain)).sum();
        Self { tops, airborne: flying().count(), airborne_volume, map }
    }
}

/// Tells which grains belong to the bed, and maps it.
///
/// A grain does not if it belongs to a group of close grains that is neither the largest nor on the floor. A grain that forces move is also in the air
/// if it moves fast without contact, or had no contact for a while and is clear of the bed below it. Held grains and those of given
/// motion are never in the air: those linked to the bed belong to it whatever they touched and however they move, and others, which
/// hang above it or stand beside it, are no part of it.
fn sort_out(bed: &BedView, bounds: &[(Vector, Vector)], settings: &ErosionSettings) -> (Vec<bool>, HeightMap) {
    let linked = linked(bounds, bed.held, settings.grain_size / 4.0, settings.floor);
    let mut map = HeightMap::new(settings.lower, settings.upper, settings.pixel);
    let mut of_bed = linked;
    let (mut in_contact, mut doubtful) = (Vec::new(), Vec::new());
    // Before the first step no grain has had a contact: that says nothing about what lies where.
    let contacts_known = (0..bed.len()).any(|grain| bed.time_since_contact(grain).is_some_and(Real::is_finite));
    for (grain, lies) in of_bed.iter_mut().enumerate() {
        let age = bed.time_since_contact(grain).filter(|_| contacts_known && !bed.held[grain]).unwrap_or(0.0);
        *lies &= age <= settings.touching_within || bed.velocity[grain].length() <= settings.airborne_speed;
        if *lies && age > settings.airborne_after {
            doubtful.push(grain);
        } else if *lies {
            in_contact.push(grain);
        }
    }
    map.add(bed, bounds, &in_contact);
    // All are judged against the grains in contact, so that their order does not matter.
    for &grain in &doubtful {
        let (lower, upper) = bounds[grain];
        let bed_top = map.highest_within([lower.x, lower.y], [upper.x, upper.y]).unwrap_or(settings.floor);
        of_bed[grain] = lower.z <= bed_top + settings.grain_size;
    }
    doubtful.retain(|&grain| of_bed[grain]);
    map.add(bed, bounds, &doubtful);
    (of_bed, map)
}

/// Whether each grain belongs to the bed: to the largest group of grains close to each other, within half a grain size, or to one with
/// free grains that lies on the `floor` \[m].
pub(crate) fn linked_to_bed(bed: &BedView, grain_size: Real, floor: Real) -> Vec<bool> {
    let bounds = bed.bounds();
    linked(&bounds, bed.held, grain_size / 4.0, floor)
}

/// Grains of the largest group linked by boxes that come closer than twice `margin` \[m], and of those with a free grain that come so
/// close to the `floor`: what is `held` alone is a pier or a wall.
fn linked(bounds: &[(Vector, Vector)], held: &[bool], margin: Real, floor: Real) -> Vec<bool> {
    let groups = Groups::of(bounds.len());
    let bins = Bins::of(bounds, 2.0 * margin);
    bins.for_each_pair(|a, b| {
        let (a, b) = if bounds[b].0.x < bounds[a].0.x { (b, a) } else { (a, b) };
        let (lower, upper) = (bounds[a].0 - 2.0 * margin, bounds[a].1 + 2.0 * margin);
        if bounds[b].0.cmplt(upper).all() && bounds[b].1.cmpgt(lower).all() {
            groups.unite(a, b);
        }
    });
    let roots: Vec<usize> = (0..bounds.len()).map(|grain| groups.root(grain)).collect();
    let mut size = vec![0_usize; bounds.len()];
    roots.iter().for_each(|&root| size[root] += 1);
    // The first of the largest groups.
    let bed = (0..size.len()).rev().max_by_key(|&root| size[root]);
    let [mut lies, mut moves] = [(); 2].map(|()| vec![false; bounds.len()]);
    for (grain, &root) in roots.iter().enumerate() {
        lies[root] |= bounds[grain].0.z < floor + 2.0 * margin;
        moves[root] |= !held[grain];
    }
    roots.iter().map(|&root| Some(root) == bed || (lies[root] && moves[root])).collect()
}

/// Groups of linked grains; the smallest number in a group is its root, whatever the order of the links.
struct Groups(Vec<AtomicUsize>);

impl Groups {
    fn of(count: usize) -> Self {
        Self((0..count).map(AtomicUsize::new).collect())
    }

    fn root(&self, mut grain: usize) -> usize {
        loop {
            let next = self.0[grain].load(Ordering::Relaxed);
            if next == grain {
                return grain;
            }
            // Halves the way for those who come later; parents only ever become smaller.
            let after = self.0[next].load(Ordering::Relaxed);
            self.0[grain].fetch_min(after, Ordering::Relaxed);
            grain = after;
        }
    }

    fn unite(&self, a: usize, b: usize) {
        let (mut a, mut b) = (a, b);
        loop {
            (a, b) = (self.root(a), self.root(b));
            if a == b {
                return;
            }
            let (low, high) = (a.min(b), a.max(b));
            if self.0[high].compare_exchange(high, low, Ordering::Relaxed, Ordering::Relaxed).is_ok() {
                return;
            }
        }
    }
}

/// Grains by the cells of a grid that their boxes begin in; cells are so wide that linked grains are neighbours.
struct Bins {
    cells: [usize; 3],
    cell_of: Vec<[usize; 3]>,
    /// Grains in the order of their cells.
    order: Vec<usize>,
    /// First place in that order of each cell, and its end.
    start: Vec<usize>,
}

impl Bins {
    fn of(bounds: &[(Vector, Vector)], gap: Real) -> Self {
        let lower = bounds.iter().fold(Vector::INFINITY, |least, (low, _)| least.min(*low));
        let upper = bounds.iter().fold(Vector::NEG_INFINITY, |most, (low, _)| most.max(*low));
        // A box that begins a longest box and the gap away cannot be linked.
        let longest = bounds.iter().map(|(low, high)| (*high - *low).max_element()).fold(0.0, Real::max);
        let width = ((longest + gap) * (1.0 + 1e-9)).max(Real::MIN_POSITIVE);
        let most = (bounds.len() as Real).cbrt().ceil().max(1.0) * 4.0;
        let cells = [0, 1, 2].map(|d| ((upper[d] - lower[d]) / width).clamp(0.0, most) as usize + 1);
        let widths = [0, 1, 2].map(|d| ((upper[d] - lower[d]) / cells[d] as Real).max(width));
        let cell = |low: Vector| [0, 1, 2].map(|d| (((low[d] - lower[d]) / widths[d]) as usize).min(cells[d] - 1));
        let cell_of: Vec<[usize; 3]> = bounds.iter().map(|(low, _)| cell(*low)).collect();
        let mut bins = Self { cells, cell_of, order: vec![0; bounds.len()], start: Vec::new() };
        let mut start = vec![0; cells.iter().product::<usize>() + 1];
        bins.cell_of.iter().for_each(|&cell| start[bins.place(cell) + 1] += 1);
        (1..start.len()).for_each(|n| start[n] += start[n - 1]);
        let mut next = start.clone();
        for (grain, &cell) in bins.cell_of.iter().enumerate() {
            let place = &mut next[(cell[2] * cells[1] + cell[1]) * cells[0] + cell[0]];
            bins.order[*place] = grain;
            *place += 1;
        }
        bins.start = start;
        bins
    }

    fn place(&self, [i, j, k]: [usize; 3]) -> usize {
        (k * self.cells[1] + j) * self.cells[0] + i
    }

    /// Calls `body` in parallel for every pair of grains of a cell and its neighbours, once each.
    fn for_each_pair(&self, body: impl Fn(usize, usize) + Sync) {
        let mut grains: Vec<usize> = (0..self.order.len()).collect();
        for_each_chunk(&mut grains[..], GRAINS_AT_ONCE, |_, grains| {
            for &mut a in grains {
                let around = [0, 1, 2].map(|d| {
                    let at = self.cell_of[a][d];
                    at.saturating_sub(1)..(at + 2).min(self.cells[d])
                });
                for (k, j) in around[2].clone().flat_map(|k| around[1].clone().map(move |j| (k, j))) {
                    let (first, last) = (self.place([around[0].start, j, k]), self.place([around[0].end - 1, j, k]));
                    let row = &self.order[self.start[first]..self.start[last + 1]];
                    row.iter().filter(|&&b| a < b).for_each(|&b| body(a, b));
                }
            }
        });
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bed::test_bed::Bed;
    use sazanami_numerics::Random;

    const D: Real = 0.5e-3;

    fn settings() -> ErosionSettings {
        ErosionSettings::recommended([-5e-3; 2], [5e-3; 2], 0.0, D)
    }

    /// Three layers of touching grains over 10 mm x 10 mm, top at 2 mm.
    fn flat() -> Bed {
        Bed::columns(D, 5e-3, 3, |_| 2e-3)
    }

    fn add(bed: &mut Bed, position: Vector, velocity: Vector, time_since_contact: Real) {
        let whole = Bed::new(D, bed.position.iter().copied().chain([position]).collect());
        let mut velocities = bed.velocity.clone();
        velocities.push(velocity);
        let mut times = bed.last_contact.clone().unwrap();
        times.push(1.0 - time_since_contact);
        let held = bed.held.iter().copied().chain([false]).collect();
        *bed = whole;
        bed.held = held;
        bed.velocity = velocities;
        bed.last_contact = Some(times);
    }

    #[test]
    fn groups_are_those_of_all_pairs_on_any_number_of_threads() {
        let mut numbers = Random::new(7);
        let mut random = move || numbers.unit();
        let bounds: Vec<(Vector, Vector)> = (0..600)
            .map(|_| {
                let low = 10.0 * Vector::new(random(), random(), random());
                (low, low + Vector::new(0.3 + random(), 0.3 + random(), 0.3 + random()))
            })
            .collect();
        for margin in [0.0, 0.02, 0.1] {
            let mut group: Vec<usize> = (0..bounds.len()).collect();
            for (a, b) in (0..bounds.len()).flat_map(|a| (0..a).map(move |b| (b, a))) {
                let near = (bounds[a].0 - 2.0 * margin).cmplt(bounds[b].1).all()
                    && (bounds[b].0 - 2.0 * margin).cmplt(bounds[a].1).all();
                let (from, to) = (group[a].max(group[b]), group[a].min(group[b]));
                if near {
                    group.iter_mut().filter(|root| **root == from).for_each(|root| *root = to);
                }
            }
            let size = |root: usize| group.iter().filter(|&&other| other == root).count();
            let bed = (0..bounds.len()).rev().max_by_key(|&root| size(root)).unwrap();
            let expected: Vec<bool> = group.iter().map(|&root| root == bed).collect();
            let found = |held: bool, threads: usize, floor: Real| {
                let held = vec![held; bounds.len()];
                sazanami_parallel::with_threads(threads, || linked(&bounds, &held, margin, floor)).unwrap()
            };
            for threads in [1, 4] {
                assert_eq!(found(false, threads, -1.0), expected);
            }
            assert_eq!(found(true, 1, 1.0), expected, "piers are no bed");
            assert!(expected.contains(&true) && (margin > 0.05 || expected.contains(&false)));
            // With a floor at 1 all groups that reach down to it belong to the bed, and no other.
            let on_floor =
                |root: usize| (0..bounds.len()).any(|n| group[n] == root && bounds[n].0.z < 1.0 + 2.0 * margin);
            let with_floor: Vec<bool> = group.iter().map(|&root| root == bed || on_floor(root)).collect();
            assert_eq!(found(false, 1, 1.0), with_floor);
        }
    }

    fn airborne(bed: &Bed) -> usize {
        bed.view(|view| SurfaceGrains::of(view, &settings()).airborne)
    }

    #[test]
    fn only_the_top_layer_of_a_resting_bed_counts() {
        let bed = flat();
        bed.view(|view| {
            let surface = SurfaceGrains::of(view, &settings());
            assert_eq!((surface.tops.len(), surface.airborne, surface.airborne_volume), (400, 0, 0.0));
            assert!(surface.tops.iter().all(|top| (top.height - 2e-3).abs() < 1e-15));
            let all = SurfaceGrains::of(view, &ErosionSettings { counted: CountedGrains::All, ..settings() });
            assert_eq!(all.tops.len(), 1200);
        });
    }

    #[test]
    fn a_slow_grain_just_above_the_bed_belongs_to_it() {
        let mut bed = flat();
        add(&mut bed, Vector::new(0.0, 0.0, 2e-3 + 0.6 * D), Vector::new(0.0, 0.0, 0.04), 2e-3);
        assert_eq!(airborne(&bed), 0);
    }

    #[test]
    fn grains_in_the_air_do_not_count() {
        let up = Vector::new(0.0, 0.0, 1.0);
        for (height, velocity, time) in [
            (2e-3 + 0.6 * D, 0.06 * up, 1e-4), // fast, just left
            (2e-3 + 4.0 * D, 0.01 * up, 5e-3), // slow at the top of its path
            (2e-3 + 9.0 * D, 1.0 * up, 0.0),   // touches another grain in the air: not linked
        ] {
            let mut bed = flat();
            add(&mut bed, Vector::new(1e-3, 0.0, height), velocity, time);
            assert_eq!(airborne(&bed), 1, "{height} {velocity} {time}");
            if time == 0.0 {
                add(&mut bed, Vector::new(1e-3 + D, 0.0, height), velocity, time);
                assert_eq!(airborne(&bed), 2);
                // Icosahedra in the balls have 2.5361 of the cube of the radius.
                let volume = bed.view(|view| SurfaceGrains::of(view, &settings()).airborne_volume);
                assert!((volume / (2.0 * 2.5361 * (D / 2.0).powi(3)) - 1.0).abs() < 1e-4, "{volume}");
            }
        }
    }

    #[test]
    fn grains_that_are_held_or_moved_are_never_in_the_air() {
        for held in [true, false] {
            let mut bed = flat();
            // They last touched something long ago, and one of them moves.
            bed.last_contact = Some(vec![Real::NEG_INFINITY; bed.position.len()]);
            bed.velocity[0] = Vector::new(0.1, 0.0, 0.0);
            bed.held.fill(held);
            // A free grain lies on them, and is the only one whose contact is known.
            add(&mut bed, Vector::new(0.0, 0.0, 2e-3 + 0.5 * D), Vector::ZERO, 0.0);
            // One more hangs high above them: no part of the bed.
            add(&mut bed, Vector::new(1e-3, 1e-3, 6e-3), Vector::ZERO, Real::INFINITY);
            *bed.held.last_mut().unwrap() = held;
            bed.view(|view| {
                let surface = SurfaceGrains::of(view, &settings());
                if held {
                    assert_eq!(surface.airborne, 0);
                    assert!((400..=401).contains(&surface.tops.len()), "{}", surface.tops.len());
                    assert!(surface.tops.iter().all(|top| top.height < 3e-3));
                } else {
                    // Negative control: free grains without contact are judged by what lies below them.
                    assert!(surface.airborne > 400, "{}", surface.airborne);
                }
            });
        }
    }

    #[test]
    fn without_contacts_only_links_decide() {
        let mut bed = flat();
        add(&mut bed, Vector::new(0.0, 0.0, 4e-3), Vector::ZERO, 0.0);
        for unknown in [None, Some(vec![Real::NEG_INFINITY; bed.position.len()])] {
            bed.last_contact = unknown;
            assert_eq!(airborne(&bed), 1);
        }
    }
}
