//! Points with values, sorted into bins for weighted sums over neighbourhoods.
//!
//! Bins are short along x1, and entries are stored in SIMD groups; each row of bins starts a new group, so that a sum runs
//! over whole groups: entries beyond the radius have zero weight. The order of entries, within bins too, is fixed.

use std::cmp::Ordering;

use sazanami_numerics::domain::Domain;
use sazanami_numerics::particles::Bins;
use sazanami_numerics::{Real, Vector};
use sazanami_parallel::for_each_chunk;

use crate::gates::{Gate, near};
use crate::neighbours::ROWS;
use crate::weight::Weight;

/// Entries per SIMD group.
pub(super) const LANES: usize = 4;
pub(super) type Lanes = [Real; LANES];

/// Edges of the bins over the radius: few rows, and few entries beyond the radius at their ends.
const EDGES: Vector = Vector::new(0.08, 0.7, 0.7);
/// Coordinate of empty entries \[m].
const FAR: Real = 1e30;
/// Marks a point without a bin and an empty entry.
const NONE: u32 = u32::MAX;
/// Groups listed before they are summed.
const LIST: usize = 128;
/// Groups of a row listed at once.
const RUN: usize = 8;
/// Points per block of work.
const MANY: usize = 1024;

/// `value` of every lane.
#[inline(always)]
pub(super) fn lanes(value: impl FnMut(usize) -> Real) -> Lanes {
    std::array::from_fn(value)
}

/// Geometry of a group relative to a position.
pub(super) struct Pair {
    /// Distance vectors from the members to the position \[m].
    pub apart: [Lanes; 3],
    /// Weight `w(r)` of each member.
    pub weight: Lanes,
    /// `w'(r)/r` [1/m^2].
    pub slope: Lanes,
}

/// Points, each with `N` values of which the first three are its coordinates \[m].
#[derive(Clone, Debug, Default)]
pub(super) struct Binned<const N: usize> {
    /// Radius of the sums \[m].
    radius: Real,
    bins: Bins,
    /// First entry of each bin, and one more.
    starts: Vec<u32>,
    /// First and last occupied bin along x1 over all rows within the radius of a row.
    extents: Vec<[u32; 2]>,
    spare: Vec<[u32; 2]>,
    /// Bin of each point.
    bin: Vec<u32>,
    /// Point of each entry.
    entries: Vec<u32>,
    groups: Vec<[Lanes; N]>,
}

impl<const N: usize> Binned<N> {
    /// Stores those of `count` points that have a position \[m], with their values; within a bin in the given `order`.
    pub fn fill(
        &mut self,
        domain: &Domain,
        radius: Real,
        count: usize,
        place: impl Fn(usize) -> Option<Vector> + Sync,
        order: impl Fn(usize, usize) -> Ordering,
        numbers: impl Fn(usize) -> [Real; N] + Sync,
    ) {
        let Self { bins, starts, bin, entries, groups, .. } = self;
        self.radius = radius;
        bins.cover(domain, radius, radius * EDGES);
        bins.narrow(count, &place);
        bin.resize(count, NONE);
        for_each_chunk(&mut bin[..], MANY, |number, bin| {
            for (n, bin) in bin.iter_mut().enumerate() {
                *bin = place(number * MANY + n).map_or(NONE, |x| bins.number(x));
            }
        });
        starts.clear();
        starts.resize(bins.len() + 1, 0);
        bin.iter().filter(|&&bin| bin != NONE).for_each(|&bin| starts[bin as usize] += 1);
        let mut end = 0;
        for row in starts[..bins.len()].chunks_mut(bins.count[0]) {
            for start in row {
                end += std::mem::replace(start, end);
            }
            end = end.next_multiple_of(LANES as u32);
        }
        starts[bins.len()] = end;
        entries.clear();
        entries.resize(end as usize, NONE);
        for (n, &bin) in bin.iter().enumerate().filter(|(_, bin)| **bin != NONE) {
            let at = &mut starts[bin as usize];
            entries[*at as usize] = n as u32;
            *at += 1;
        }
        // The start of each bin has moved to its end.
        let mut end = 0;
        for row in starts[..bins.len()].chunks_mut(bins.count[0]) {
            for start in row {
                let first = std::mem::replace(start, end);
                if first - end > 1 {
                    entries[end as usize..first as usize].sort_unstable_by(|&a, &b| order(a as usize, b as usize));
                }
                end = first;
            }
            end = end.next_multiple_of(LANES as u32);
        }
        groups.resize(entries.len() / LANES, [[0.0; LANES]; N]);
        self.set(numbers);
        self.find_extents();
    }

    /// Sets the values of the points, which are where they were.
    pub fn set(&mut self, numbers: impl Fn(usize) -> [Real; N] + Sync) {
        let entries = &self.entries[..];
        for_each_chunk(&mut self.groups[..], ROWS, |number, groups| {
            for (n, group) in groups.iter_mut().enumerate() {
                for (l, &n) in entries[LANES * (ROWS * number + n)..][..LANES].iter().enumerate() {
                    let numbers = if n == NONE { nothing() } else { numbers(n as usize) };
                    group.iter_mut().zip(numbers).for_each(|(lanes, number)| lanes[l] = number);
                }
            }
        });
    }

    fn find_extents(&mut self) {
        let Self { bins, extents, spare, bin, .. } = self;
        let [along, rows, layers] = bins.count;
        extents.clear();
        extents.resize(rows * layers, [NONE, 0]);
        for &bin in bin.iter().filter(|bin| **bin != NONE) {
            let [first, last] = &mut extents[bin as usize / along];
            let place = (bin as usize % along) as u32;
            (*first, *last) = ((*first).min(place), (*last).max(place));
        }
        for (stride, count, reach) in [(1, rows, bins.layers[1]), (rows, layers, bins.layers[2])] {
            spare.clear();
            spare.extend((0..rows * layers).map(|row| {
                let place = row / stride % count;
                let (low, high) = (place.saturating_sub(reach), (place + reach).min(count - 1));
                (low..=high)
                    .map(|n| extents[row - place * stride + n * stride])
                    .fold([NONE, 0], |a, b| [a[0].min(b[0]), a[1].max(b[1])])
            }));
            std::mem::swap(extents, spare);
        }
    }

    /// Whether a point may lie within the radius of `x` \[m].
    #[inline(always)]
    pub fn is_near(&self, x: Vector) -> bool {
        let [i, j, k] = self.bins.place(x);
        let [first, last] = self.extents[j + self.bins.count[1] * k];
        let reach = self.bins.layers[0];
        i + reach >= first as usize && i <= last as usize + reach
    }

    /// As [`Self::sum`], over the points on the same side of the gates \[m]; terms are scaled by the weight alone.
    #[inline(always)]
    pub fn sum_beside<const S: usize>(
        &self,
        gates: &[Gate],
        x: Vector,
        terms: impl Fn(&Pair, &[Lanes; N]) -> [Lanes; S],
    ) -> [Real; S] {
        let Some(gate) = near(gates, x, self.radius) else { return self.sum(x, terms) };
        self.sum(x, |pair, values| {
            let is_seen = |l: usize| !gate.parts(x, Vector::new(values[0][l], values[1][l], values[2][l]));
            let weight = lanes(|l| if is_seen(l) { pair.weight[l] } else { 0.0 });
            terms(&Pair { apart: pair.apart, weight, slope: pair.slope }, values)
        })
    }

    /// Sums `terms` over all points within the radius of `x` \[m]; they must vanish with the weight.
    #[inline(always)]
    pub fn sum<const S: usize>(&self, x: Vector, terms: impl Fn(&Pair, &[Lanes; N]) -> [Lanes; S]) -> [Real; S] {
        let mut sums = [[0.0; LANES]; S];
        let (mut list, mut length) = ([0; LIST], 0);
        self.bins.for_each_row(x, self.radius, |row| {
            let mut first = self.starts[row.start] / LANES as u32;
            let end = self.starts[row.end].div_ceil(LANES as u32);
            // A full run is written whether it is needed or not: cheaper than a branch.
            while first < end {
                if length + RUN > LIST {
                    add(&self.groups, &list[..length], self.radius, x, &terms, &mut sums);
                    length = 0;
                }
                list[length..length + RUN].iter_mut().zip(first..).for_each(|(entry, group)| *entry = group);
                length += RUN.min((end - first) as usize);
                first += RUN as u32;
            }
        });
        add(&self.groups, &list[..length], self.radius, x, &terms, &mut sums);
        sums.map(|[a, b, c, d]| (a + b) + (c + d))
    }
}

/// Adds `terms` of the listed groups to `sums`. Not inlined: then the sums are stored, which lets the compiler vectorise
/// whole lanes, square roots included.
#[inline(never)]
fn add<const N: usize, const S: usize>(
    groups: &[[Lanes; N]],
    list: &[u32],
    radius: Real,
    x: Vector,
    terms: &impl Fn(&Pair, &[Lanes; N]) -> [Lanes; S],
    sums: &mut [Lanes; S],
) {
    let weight = Weight { radius };
    let mut total = *sums;
    for &n in list {
        let group = &groups[n as usize];
        let apart = [lanes(|l| x.x - group[0][l]), lanes(|l| x.y - group[1][l]), lanes(|l| x.z - group[2][l])];
        let [p, q, r] = &apart;
        let square = lanes(|l| p[l] * p[l] + q[l] * q[l] + r[l] * r[l]);
        let r = lanes(|l| square[l].sqrt());
        let (value, slope) = (lanes(|l| weight.value(r[l])), lanes(|l| weight.slope_over_distance(r[l])));
        let pair = Pair { apart, weight: value, slope };
        let terms = terms(&pair, group);
        for (total, term) in total.iter_mut().zip(&terms) {
            *total = lanes(|l| total[l] + term[l]);
        }
    }
    *sums = total;
}

/// Values of an empty entry.
fn nothing<const N: usize>() -> [Real; N] {
    std::array::from_fn(|n| if n < 3 { FAR } else { 0.0 })
}

#[cfg(test)]
mod tests {
    use sazanami_numerics::grid::Grid;

    use super::*;
    use sazanami_numerics::Random;

    const RADIUS: Real = 0.3;

    /// Points in a box of edge 2 and around it, each with a value.
    fn points() -> Vec<[Real; 4]> {
        let mut numbers = Random::new(3);
        let mut random = move || numbers.unit();
        (0..3000).map(|_| [3.0 * random() - 0.5, 1.6 * random(), 3.0 * random() - 0.5, random()]).collect()
    }

    fn binned(points: &[[Real; 4]]) -> Binned<4> {
        let domain = Domain::solo(Grid::new([4; 3], Vector::ZERO, Vector::splat(2.0)), [false; 3]);
        let place = |n: usize| Vector::from_slice(&points[n][..3]);
        let mut binned = Binned::default();
        let order = |a: usize, b: usize| points[a][3].total_cmp(&points[b][3]);
        binned.fill(&domain, RADIUS, points.len(), |n| (points[n][3] > 0.1).then(|| place(n)), order, |n| points[n]);
        binned
    }

    fn sum(binned: &Binned<4>, x: Vector) -> [Real; 2] {
        binned.sum(x, |pair, [.., number]| {
            [lanes(|l| pair.weight[l] * number[l]), lanes(|l| pair.slope[l] * pair.apart[0][l] * number[l])]
        })
    }

    #[test]
    fn sums_run_over_all_points_within_the_radius() {
        let points = points();
        let binned = binned(&points);
        let (mut near, mut far) = (0, 0);
        let weight = Weight { radius: RADIUS };
        for [x, y, z, _] in &points[..400] {
            let x = Vector::new(*x, 2.0 * y, *z);
            let mut expected = [0.0; 2];
            for thing in points.iter().filter(|thing| thing[3] > 0.1) {
                let apart = x - Vector::from_slice(&thing[..3]);
                expected[0] += weight.value(apart.length()) * thing[3];
                expected[1] += weight.slope_over_distance(apart.length()) * apart.x * thing[3];
            }
            let found = sum(&binned, x);
            assert!((found[0] - expected[0]).abs() < 1e-13 && (found[1] - expected[1]).abs() < 1e-12);
            assert!(binned.is_near(x) || expected[0] == 0.0);
            near += usize::from(expected[0] > 0.0);
            far += usize::from(!binned.is_near(x));
        }
        assert!(near > 200 && far > 20, "{near} {far}");
    }

    #[test]
    fn sums_do_not_depend_on_the_order_of_the_points() {
        let points = points();
        let mut turned = points.clone();
        turned.reverse();
        let (one, other) = (binned(&points), binned(&turned));
        let same = |other: &Binned<4>| {
            let at = |n: usize| Vector::from_slice(&points[n][..3]);
            (0..200).all(|n| sum(&one, at(n)) == sum(other, at(n)))
        };
        assert!(same(&other));
        // Negative control: a shift by 1e-12 does.
        turned.iter_mut().for_each(|thing| thing[0] += 1e-12);
        assert!(!same(&binned(&turned)));
    }
}
