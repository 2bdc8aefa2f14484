//! Bins: space cut into equal boxes, in which neighbours are found.

use std::ops::Range;

use sazanami_parallel::{Reduction, for_each_chunk, reduce_over};

use super::columns::MANY;
use crate::domain::Domain;
use crate::{Real, Vector};

/// A rank's part of space and its surroundings, cut into bins.
#[derive(Clone, Debug, Default)]
pub struct Bins {
    /// Lower corner of the first bin \[m].
    pub lower: Vector,
    /// Lower corner before bins were left out \[m].
    origin: Vector,
    /// Number of bins left out below the first one in each direction.
    first: [usize; 3],
    spacing: Vector,
    inverse: Vector,
    /// Number of bins in each direction.
    pub count: [usize; 3],
    /// First own particle of each bin, and one more.
    own: Vec<u32>,
    /// First ghost of each bin, and one more.
    ghosts: Vec<u32>,
    /// Number of bins in each direction that the cut-off spans.
    pub layers: [usize; 3],
    /// Cut-off radius for which the bins were made \[m].
    pub cut_off: Real,
}

impl Bins {
    /// Makes the cells of the domain's grid, and those `cut_off` \[m] around this rank's part of it, the bins.
    pub fn renew(&mut self, domain: &Domain, cut_off: Real) {
        let spacing = domain.grid().spacing;
        let (lower, _) = domain.rank_box(domain.communicator().rank());
        self.layers = std::array::from_fn(|d| (cut_off / spacing[d]).ceil() as usize);
        let margin = Vector::from_array(self.layers.map(|n| n as Real)) * spacing;
        let cells = domain.cells();
        self.count = std::array::from_fn(|d| cells[d] + 2 * self.layers[d]);
        self.begin_at(lower - margin);
        self.cut_off = cut_off;
        self.spacing = spacing;
        self.inverse = spacing.recip();
    }

    /// No bins are left out any more: they begin at `lower` \[m].
    fn begin_at(&mut self, lower: Vector) {
        (self.lower, self.origin, self.first) = (lower, lower, [0; 3]);
    }

    /// Makes boxes with edges no longer than `edge` \[m], in this rank's part and `cut_off` \[m] around it, the bins.
    pub fn cover(&mut self, domain: &Domain, cut_off: Real, edge: Vector) {
        let (lower, upper) = domain.rank_box(domain.communicator().rank());
        let extent = upper - lower + 2.0 * cut_off;
        self.count = std::array::from_fn(|d| ((extent[d] / edge[d]).ceil() as usize).max(1));
        self.begin_at(lower - cut_off);
        self.spacing = extent / Vector::from_array(self.count.map(|n| n as Real));
        self.inverse = self.spacing.recip();
        self.layers = std::array::from_fn(|d| (cut_off * self.inverse[d]).ceil() as usize);
        self.cut_off = cut_off;
    }

    /// Leaves out bins beyond the cut-off round those of the `count` places that are given \[m], if there are many more
    /// bins than places: boxes may be far larger than what is in them. Positions there belong to the nearest bin, which
    /// is out of reach of the places.
    pub fn narrow(&mut self, count: usize, place: impl Fn(usize) -> Option<Vector> + Sync) {
        if self.are_many(count) {
            let [low, high] = ends(count, place);
            self.keep_between(low, high);
        }
    }

    /// The same where ghosts of other ranks are to come: the bins round the places of all ranks are kept, so that what lies on
    /// this rank beside ghosts is not crowded into one bin. All ranks take part.
    pub fn narrow_together(&mut self, domain: &Domain, count: usize, place: impl Fn(usize) -> Option<Vector> + Sync) {
        if domain.max(Real::from(u8::from(self.are_many(count)))) == 0.0 {
            return;
        }
        let [low, high] = ends(count, place);
        let mut far = [-low.x, -low.y, -low.z, high.x, high.y, high.z];
        domain.communicator().all_reduce(&mut far, Reduction::Max);
        self.keep_between(-Vector::from_slice(&far[..3]), Vector::from_slice(&far[3..]));
    }

    /// Whether there are many more bins than places.
    fn are_many(&self, count: usize) -> bool {
        self.len() > Self::PER_PLACE * count + Self::FEW
    }

    /// Keeps the bins between two corners \[m] and those within the cut-off round them; one corner if there are none.
    fn keep_between(&mut self, low: Vector, high: Vector) {
        let (low, high) = if low.cmple(high).all() { (low, high) } else { (self.origin, self.origin) };
        let (low, high) = (self.place(low), self.place(high));
        self.first = std::array::from_fn(|d| low[d].saturating_sub(self.layers[d] + 1));
        self.count = std::array::from_fn(|d| (high[d] + self.layers[d] + 2).min(self.count[d]) - self.first[d]);
        self.lower = self.origin + Vector::from_array(self.first.map(|n| n as Real)) * self.spacing;
    }

    /// Bins for each place, and beside, up to which none is left out.
    const PER_PLACE: usize = 4;
    const FEW: usize = 1 << 16;

    /// Cubes with an edge of at least `edge` \[m] over all `positions`, no more than `most` of them.
    pub fn enclose(&mut self, positions: &[Vector], edge: Real, most: usize) {
        let lower = positions.iter().copied().fold(Vector::INFINITY, Vector::min);
        let upper = positions.iter().copied().fold(Vector::NEG_INFINITY, Vector::max);
        let mut edge = edge;
        let count = |edge: Real| ((upper - lower) / edge).floor().to_array().map(|n| n.max(0.0) + 1.0);
        while count(edge).iter().product::<Real>() > most as Real {
            edge *= 1.3;
        }
        self.begin_at(lower);
        self.spacing = Vector::splat(edge);
        self.inverse = Vector::splat(1.0 / edge);
        self.count = if positions.is_empty() { [1; 3] } else { count(edge).map(|n| n as usize) };
        self.layers = [1; 3];
        self.cut_off = edge;
    }

    /// Coordinates of `position` from the first bin on, in bins.
    #[inline(always)]
    #[must_use]
    pub fn coordinates(&self, position: Vector) -> Vector {
        (position - self.origin) * self.inverse - Vector::from_array(self.first.map(|n| n as Real))
    }

    /// Bin of `position` in each direction; positions beyond the bins belong to the nearest.
    #[inline(always)]
    #[must_use]
    pub fn place(&self, position: Vector) -> [usize; 3] {
        let s = (position - self.origin) * self.inverse;
        std::array::from_fn(|d| (s[d] as u32 as usize).saturating_sub(self.first[d]).min(self.count[d] - 1))
    }

    /// Number of the bin of `position`, x1 fastest.
    #[inline(always)]
    #[must_use]
    pub fn number(&self, position: Vector) -> u32 {
        let [i, j, k] = self.place(position);
        (i + self.count[0] * (j + self.count[1] * k)) as u32
    }

    /// Number of bins.
    #[must_use]
    pub fn len(&self) -> usize {
        self.count.iter().product()
    }

    /// Finds the range of each bin among positions sorted by bin, those of own particles and those of the ghosts behind them.
    pub fn fill(&mut self, own: &[Vector], ghosts: &[Vector]) {
        let mut starts = (std::mem::take(&mut self.own), std::mem::take(&mut self.ghosts));
        self.starts(own, 0, &mut starts.0);
        self.starts(ghosts, own.len(), &mut starts.1);
        (self.own, self.ghosts) = starts;
    }

    fn starts(&self, positions: &[Vector], first: usize, starts: &mut Vec<u32>) {
        starts.resize(self.len() + 1, 0);
        for_each_chunk(&mut starts[..], MANY, |chunk, starts| {
            let bin = (chunk * MANY) as u32;
            let mut at = positions.partition_point(|&x| self.number(x) < bin);
            for (bin, start) in (bin..).zip(starts) {
                at += positions[at..].iter().take_while(|&&x| self.number(x) < bin).count();
                *start = (first + at) as u32;
            }
        });
    }

    /// Whether there are no bins yet.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Own particles of a bin.
    #[must_use]
    pub fn own(&self, bin: usize) -> Range<usize> {
        self.own[bin] as usize..self.own[bin + 1] as usize
    }

    /// Ghosts in a bin.
    #[must_use]
    pub fn ghosts(&self, bin: usize) -> Range<usize> {
        self.ghosts[bin] as usize..self.ghosts[bin + 1] as usize
    }

    /// Calls `body` with ranges of particles that hold all within `radius` \[m] of `position`, in a fixed order; the
    /// radius is no longer than the bins were made for.
    #[inline(always)]
    pub fn for_each_range(&self, position: Vector, radius: Real, mut body: impl FnMut(Range<usize>)) {
        self.for_each_row(position, radius, |row| {
            let own = self.own[row.start] as usize..self.own[row.end] as usize;
            if !own.is_empty() {
                body(own);
            }
            let ghosts = self.ghosts[row.start] as usize..self.ghosts[row.end] as usize;
            if !ghosts.is_empty() {
                body(ghosts);
            }
        });
    }

    /// Calls `body` with ranges of bins along x1 that hold all within `radius` \[m] of `position`, in a fixed order.
    #[inline(always)]
    pub fn for_each_row(&self, position: Vector, radius: Real, mut body: impl FnMut(Range<usize>)) {
        // A little more, so that round-off loses nothing at the radius itself.
        let radius = radius * (1.0 + 1e-9);
        let s = self.coordinates(position);
        let low = self.place(position - radius);
        let high = self.place(position + radius);
        let end = Vector::from_array(self.count.map(|n| n as Real));
        let inside = s.max(Vector::ZERO).min(end);
        // Distance to the row of bins `n` in direction `d`; the outermost bins go on without end.
        let apart = |n: usize, d: usize| {
            let n = Real::from(n as u32);
            (n - inside[d]).max(inside[d] - (n + 1.0)).max(0.0) * self.spacing[d]
        };
        let square = radius * radius;
        for k in low[2]..=high[2] {
            let rest = square - apart(k, 2) * apart(k, 2);
            for j in low[1]..=high[1] {
                let rest = rest - apart(j, 1) * apart(j, 1);
                if rest < 0.0 {
                    continue;
                }
                let half = rest.sqrt() * self.inverse.x;
                let last = self.count[0] - 1;
                let row = self.count[0] * (j + self.count[1] * k);
                let first = row + ((s.x - half) as u32 as usize).min(last);
                let last = row + ((s.x + half) as u32 as usize).min(last) + 1;
                body(first..last);
            }
        }
    }
}

/// Smallest and largest coordinates of the `count` places that are given \[m].
fn ends(count: usize, place: impl Fn(usize) -> Option<Vector> + Sync) -> [Vector; 2] {
    let nothing = [Vector::INFINITY, Vector::NEG_INFINITY];
    let part = |n: usize| place(n).map_or(nothing, |x| [x, x]);
    reduce_over(count, part, |a, b| [a[0].min(b[0]), a[1].max(b[1])]).unwrap_or(nothing)
}

/// Particles by bin, whatever their order is.
#[derive(Clone, Debug, Default)]
pub struct BinIndex {
    bins: Bins,
    starts: Vec<u32>,
    sorted: Vec<u32>,
    bin_of: Vec<u32>,
}

impl BinIndex {
    /// Most bins per particle; larger regions get larger bins.
    const MOST: usize = 4;

    /// Sorts particles at `positions` \[m] into cubes with an edge of at least `edge` \[m].
    pub fn sort(&mut self, positions: &[Vector], edge: Real) {
        let Self { bins, starts, sorted, bin_of } = self;
        bins.enclose(positions, edge, Self::MOST * positions.len() + 64);
        starts.clear();
        starts.resize(bins.len() + 1, 0);
        bin_of.clear();
        bin_of.extend(positions.iter().map(|&position| bins.number(position)));
        bin_of.iter().for_each(|&bin| starts[bin as usize + 1] += 1);
        for bin in 1..starts.len() {
            starts[bin] += starts[bin - 1];
        }
        sorted.clear();
        sorted.resize(positions.len(), 0);
        for (particle, &bin) in bin_of.iter().enumerate().rev() {
            let next = starts[bin as usize + 1] - 1;
            starts[bin as usize + 1] = next;
            sorted[next as usize] = particle as u32;
        }
        // Filling backwards has moved every start one bin up.
        for bin in 1..starts.len() {
            starts[bin - 1] = starts[bin];
        }
        if let Some(end) = starts.last_mut() {
            *end = positions.len() as u32;
        }
    }

    /// Calls `visit` for all particles in bins that the box from `lower` to `upper` \[m] meets.
    pub fn visit(&self, lower: Vector, upper: Vector, mut visit: impl FnMut(u32)) {
        let (a, b) = (self.bins.place(lower), self.bins.place(upper));
        for k in a[2]..=b[2] {
            for j in a[1]..=b[1] {
                let row = (k * self.bins.count[1] + j) * self.bins.count[0];
                let range = self.starts[row + a[0]] as usize..self.starts[row + b[0] + 1] as usize;
                self.sorted[range].iter().for_each(|&particle| visit(particle));
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use sazanami_parallel::run_ranks;

    use super::*;
    use crate::Random;
    use crate::grid::Grid;

    /// Numbers of the positions within `radius` of `x`, by the bins or by looking at all.
    fn near(bins: Option<&Bins>, positions: &[Vector], x: Vector, radius: Real) -> Vec<usize> {
        let mut found = Vec::new();
        let within = |n: &usize| positions[*n].distance(x) < radius;
        match bins {
            Some(bins) => bins.for_each_range(x, radius, |range| found.extend(range.filter(within))),
            None => found.extend((0..positions.len()).filter(within)),
        }
        found.sort_unstable();
        found
    }

    #[test]
    fn a_long_box_has_bins_only_where_there_is_something() {
        let domain = Domain::solo(Grid::new([40_000, 8, 8], Vector::ZERO, Vector::new(40_000.0, 8.0, 8.0)), [false; 3]);
        let mut numbers = Random::new(7);
        let mut random = move || numbers.unit();
        let mut positions: Vec<Vector> =
            (0..500).map(|_| Vector::new(9000.0 + 12.0 * random(), 8.0 * random(), 8.0 * random())).collect();
        let mut bins = Bins::default();
        bins.renew(&domain, 1.4);
        let whole = bins.len();
        // Few places in many bins; where there are as many places as that none is left out.
        bins.narrow(whole, |n| positions.get(n).copied());
        assert_eq!((bins.len(), bins.lower), (whole, Vector::splat(-2.0)));
        bins.narrow(positions.len(), |n| Some(positions[n]));
        assert!(bins.len() < 3000 && whole > 5_000_000, "{} of {whole}", bins.len());
        positions.sort_by_key(|&x| bins.number(x));
        // The latter half are ghosts.
        let (own, ghosts) = positions.split_at(250);
        let (mut own, mut ghosts) = (own.to_vec(), ghosts.to_vec());
        own.sort_by_key(|&x| bins.number(x));
        ghosts.sort_by_key(|&x| bins.number(x));
        bins.fill(&own, &ghosts);
        let mut met = 0;
        for n in 0..500 {
            // About the places, far from all of them, and beyond the box.
            let x = if n % 10 == 0 { Vector::splat(1e5 * (random() - 0.5)) } else { positions[n] };
            let expected = near(None, &positions, x, 1.4);
            assert_eq!(near(Some(&bins), &positions, x, 1.4), expected, "{x}");
            met += expected.len();
        }
        assert!(met > 2000, "{met}");
        // Nothing at all: a single corner of the box is left.
        bins.renew(&domain, 1.4);
        bins.narrow(0, |_| None);
        assert!(bins.len() <= 1000, "{}", bins.len());
    }

    #[test]
    fn what_lies_beside_ghosts_is_not_crowded_into_one_bin() {
        // A long tank whose liquid ends at the cut between two ranks; walls all along its floor.
        let cells = [4000, 8, 8];
        let crowd = |together: bool| {
            let parts = run_ranks(2, 1, |communicator| {
                let upper = Vector::from_array(cells.map(|n| n as Real));
                let domain = Domain::new(Grid::new(cells, Vector::ZERO, upper), [false; 3], communicator).unwrap();
                let (lower, upper) = domain.rank_box(domain.communicator().rank());
                let along = |n: usize, count: usize, height: Real| {
                    Vector::new(lower.x + (n as Real + 0.5) / count as Real * (upper.x - lower.x), 4.0, height)
                };
                let cut = if lower.x > 0.0 { lower.x } else { upper.x };
                let liquid = (0..2000).map(|n| along(n, 2000, 0.5)).filter(|x| (cut - 10.0..cut).contains(&x.x));
                let liquid: Vec<Vector> = liquid.collect();
                let mut bins = Bins::default();
                bins.renew(&domain, 1.4);
                let place = |n: usize| liquid.get(n).copied();
                if together {
                    bins.narrow_together(&domain, liquid.len(), place);
                } else {
                    bins.narrow(liquid.len(), place);
                }
                // Walls within reach of the liquid, which share their bin with no more than what lies there.
                let beside = bins.number(Vector::new(cut + 1.3, 4.0, -0.5));
                let walls = (0..2000).map(|n| along(n, 2000, -0.5)).filter(|&x| bins.number(x) == beside).count();
                (bins.len(), walls, lower.x > 0.0)
            });
            let (bins, walls, _) = parts.unwrap().into_iter().find(|part| part.2).unwrap();
            (bins, walls)
        };
        let (bins, walls) = crowd(true);
        assert!(bins < 2000 && walls <= 2, "{bins} {walls}");
        // Negative control: each rank by its own liquid, of which the second has none.
        let (bins, walls) = crowd(false);
        assert!(walls > 1000, "{bins} {walls}");
    }
}
