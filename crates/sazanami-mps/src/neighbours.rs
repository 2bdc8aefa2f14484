//! Bins and neighbour lists.
//!
//! Lists are made anew in every step, from the order of the particles alone, so that the order of every sum
//! follows from the state: threads and restarts do not change it, and ranks only beside the cuts between them. They hold all pairs within the radius of
//! influence at the start of the step or at the predicted places, and few others.

use std::ops::Range;

use sazanami_numerics::particles::Bins;
use sazanami_numerics::{Real, Vector};
use sazanami_parallel::{SlicesMut, for_each_chunk};

use crate::particles::{Kind, Particles};

/// Particles per block of work.
pub(crate) const ROWS: usize = 64;

/// Neighbours of some consecutive particles.
#[derive(Clone, Debug)]
pub(crate) struct Block {
    starts: [u32; ROWS + 1],
    /// Longer than what is in use.
    list: Vec<u32>,
}

impl Default for Block {
    fn default() -> Self {
        Self { starts: [0; ROWS + 1], list: Vec::new() }
    }
}

impl Block {
    /// Pairs of all its particles.
    pub fn len(&self) -> usize {
        self.starts[ROWS] as usize
    }

    #[inline(always)]
    pub fn of(&self, row: usize) -> &[u32] {
        &self.list[self.starts[row] as usize..self.starts[row + 1] as usize]
    }
}

/// By how much lists reach farther than the radius of influence, over the particle spacing.
pub(crate) const MARGIN: Real = 0.02;
/// Candidates that are looked at in one go.
const LANES: usize = 8;

/// Places for the search in single precision, from a corner of the bins [m]: an error of 1e-5 of a spacing.
#[derive(Clone, Debug, Default)]
struct Places {
    now: [Vec<f32>; 3],
    then: [Vec<f32>; 3],
}

impl Places {
    fn fill(&mut self, positions: &[Vector], origin: Vector, way: impl Fn(usize) -> Vector + Sync) {
        for column in self.now.iter_mut().chain(&mut self.then) {
            column.resize(positions.len() + LANES, 0.0);
        }
        let count = positions.len();
        let [x, y, z] = self.now.each_mut().map(|column| &mut column[..count]);
        let [p, q, r] = self.then.each_mut().map(|column| &mut column[..count]);
        for_each_chunk((x, y, z, p, q, r), ROWS, |number, (x, y, z, p, q, r)| {
            for n in 0..x.len() {
                let a = number * ROWS + n;
                let now = positions[a] - origin;
                let then = now + way(a);
                (x[n], y[n], z[n]) = (now.x as f32, now.y as f32, now.z as f32);
                (p[n], q[n], r[n]) = (then.x as f32, then.y as f32, then.z as f32);
            }
        });
    }

    /// Length of the way of `a` [m].
    fn way(&self, a: usize) -> f32 {
        (0..3).map(|d| (self.then[d][a] - self.now[d][a]).powi(2)).sum::<f32>().sqrt()
    }

    /// Writes those of `range` that are near to `a` into the list from `end` on; the new end.
    #[inline(never)]
    fn list_near(&self, a: usize, range: Range<usize>, square: f32, list: &mut Vec<u32>, end: usize) -> usize {
        let lanes = range.len().next_multiple_of(LANES);
        if list.len() < end + lanes + LANES {
            list.resize((2 * list.len()).max(end + lanes + LANES), 0);
        }
        let [x, y, z] = self.now.each_ref().map(|column| column[range.start..][..lanes].as_chunks::<LANES>().0);
        let [p, q, r] = self.then.each_ref().map(|column| column[range.start..][..lanes].as_chunks::<LANES>().0);
        let now = self.now.each_ref().map(|column| column[a]);
        let then = self.then.each_ref().map(|column| column[a]);
        let into = &mut list[end..end + lanes + LANES];
        let mut at = 0;
        for (group, ((((x, y), z), (p, q)), r)) in x.iter().zip(y).zip(z).zip(p.iter().zip(q)).zip(r).enumerate() {
            let mut near = [0_u32; LANES];
            for l in 0..LANES {
                let (x, y, z) = (x[l] - now[0], y[l] - now[1], z[l] - now[2]);
                let (p, q, r) = (p[l] - then[0], q[l] - then[1], r[l] - then[2]);
                near[l] = u32::from((x * x + y * y + z * z).min(p * p + q * q + r * r) < square);
            }
            let first = range.start + LANES * group;
            let into = &mut into[at..at + LANES];
            let mut found = 0;
            for (l, near) in near.into_iter().enumerate() {
                let b = first + l;
                into[found % LANES] = b as u32;
                found += (near as usize) & usize::from(b < range.end) & usize::from(b != a);
            }
            at += found;
        }
        end + at
    }
}

/// Neighbour lists of the own particles that are fluid, or wall beside fluid.
#[derive(Clone, Debug, Default)]
pub(crate) struct Neighbours {
    blocks: Vec<Block>,
    places: Places,
    /// Longest way of a fluid particle in and around each bin [m]; negative where there is none.
    ways: Vec<f32>,
    spare: Vec<f32>,
    /// Way of the walls [m].
    walls: f32,
    /// Own particles.
    owned: usize,
    /// Pairs listed.
    pub pairs: usize,
}

impl Neighbours {
    /// Lists the pairs that are nearer than `radius` [m] now, or when each fluid particle has gone its `way` and all
    /// `walls` theirs [m].
    pub fn renew(
        &mut self,
        bins: &Bins,
        particles: &Particles,
        radius: Real,
        walls: Vector,
        way: impl Fn(usize) -> Vector + Sync,
    ) {
        let kinds = &particles.kind[..];
        let way = |a: usize| if kinds[a] == Kind::Fluid { way(a) } else { walls };
        self.walls = walls.length() as f32;
        self.places.fill(&particles.position, bins.lower, way);
        self.find_ways(bins, kinds);
        self.list(bins, particles, radius);
    }

    /// Finds the longest ways of the fluid near each bin.
    fn find_ways(&mut self, bins: &Bins, kinds: &[Kind]) {
        let Self { ways, spare, places, .. } = self;
        let places = &*places;
        ways.clear();
        ways.resize(bins.len(), -1.0);
        for_each_chunk(&mut ways[..], ROWS, |number, ways| {
            for (n, longest) in ways.iter_mut().enumerate() {
                let bin = number * ROWS + n;
                let fluid = bins.own(bin).chain(bins.ghosts(bin)).filter(|&a| kinds[a] == Kind::Fluid);
                *longest = fluid.map(|a| places.way(a)).fold(-1.0, f32::max);
            }
        });
        // The longest within reach, one direction after the other.
        spare.resize(ways.len(), 0.0);
        for d in 0..3 {
            let stride: usize = bins.count[..d].iter().product();
            let (count, reach) = (bins.count[d], bins.layers[d]);
            let before = &ways[..];
            for_each_chunk(&mut spare[..], ROWS, |number, longest| {
                for (n, longest) in longest.iter_mut().enumerate() {
                    let bin = number * ROWS + n;
                    let place = bin / stride % count;
                    let first = bin - place.min(reach) * stride;
                    let steps = place.min(reach) + (count - 1 - place).min(reach);
                    *longest = (0..=steps).map(|m| before[first + m * stride]).fold(-1.0, f32::max);
                }
            });
            std::mem::swap(ways, spare);
        }
    }

    fn list(&mut self, bins: &Bins, particles: &Particles, radius: Real) {
        self.owned = particles.owned;
        self.blocks.resize_with(particles.owned.div_ceil(ROWS), Block::default);
        let Self { blocks, places, ways, walls, .. } = self;
        let (places, ways, walls) = (&*places, &*ways, *walls);
        let (positions, kinds) = (&particles.position[..], &particles.kind[..]);
        let square = (radius * radius) as f32;
        // What single precision may take off.
        let radius = radius * (1.0 + 1e-4);
        for_each_chunk(&mut blocks[..], 1, |number, block| {
            let Block { starts, list } = &mut block[0];
            let mut end = 0;
            for row in 0..ROWS {
                let a = number * ROWS + row;
                starts[row + 1] = end as u32;
                if a >= particles.owned || kinds[a] == Kind::Dummy {
                    continue;
                }
                let longest = ways[bins.number(positions[a]) as usize];
                if longest < 0.0 {
                    continue;
                }
                let reach = radius + Real::from(places.way(a) + longest.max(walls));
                let begin = end;
                bins.for_each_range(positions[a], reach, |range| end = places.list_near(a, range, square, list, end));
                // A wall that no water touches has no part in anything.
                if kinds[a] == Kind::Wall && list[begin..end].iter().all(|&b| kinds[b as usize] != Kind::Fluid) {
                    end = begin;
                }
                starts[row + 1] = end as u32;
            }
        });
        self.pairs = self.blocks.iter().map(Block::len).sum();
    }

    /// Number of own particles.
    pub fn owned(&self) -> usize {
        self.owned
    }

    /// Whether there may be fluid within reach of what lies in a bin.
    pub fn is_wet(&self, bin: u32) -> bool {
        self.ways[bin as usize] >= 0.0
    }

    /// Sets an entry of `column` for every own particle from its neighbours.
    pub fn set<T: Send>(&self, column: &mut [T], value: impl Fn(usize, &[u32]) -> T + Sync) {
        self.for_each(column, |a, near, entry| entry[0] = value(a, near));
    }

    /// Calls `body` with every own particle, its neighbours and its entries in `columns`.
    pub fn for_each<S: SlicesMut>(&self, columns: S, body: impl Fn(usize, &[u32], S) + Sync) {
        for_each_chunk(columns, ROWS, |number, columns| {
            let block = &self.blocks[number];
            let mut rest = columns;
            for row in 0..rest.length() {
                let (entry, behind) = rest.cut(1);
                rest = behind;
                body(number * ROWS + row, block.of(row), entry);
            }
        });
    }

    /// Blocks of lists with the number of their first particle.
    pub fn blocks(&self) -> &[Block] {
        &self.blocks
    }
}
