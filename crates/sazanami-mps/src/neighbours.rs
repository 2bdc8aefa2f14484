//! Bins and neighbour lists.
//!
//! Lists are rebuilt in every step from the order of the particles alone, so that the order of every sum follows from the
//! state: threads and restarts do not change it, ranks only beside the cuts between them. They contain all pairs within
//! the radius of influence at the start of the step or at the predicted positions, and few others.

use std::ops::Range;

use sazanami_numerics::particles::Bins;
use sazanami_numerics::{Real, Vector};
use sazanami_parallel::{SlicesMut, for_each_chunk};

use crate::particles::{Kind, Particles};

/// Particles per block of work.
pub(crate) const ROWS: usize = 64;

/// Neighbours of one block of consecutive particles.
#[derive(Clone, Debug)]
pub(crate) struct Block {
    starts: [u32; ROWS + 1],
    /// Longer than the part in use.
    list: Vec<u32>,
}

impl Default for Block {
    fn default() -> Self {
        Self { starts: [0; ROWS + 1], list: Vec::new() }
    }
}

impl Block {
    /// Number of pairs of all its particles.
    pub fn len(&self) -> usize {
        self.starts[ROWS] as usize
    }

    #[inline(always)]
    pub fn of(&self, row: usize) -> &[u32] {
        &self.list[self.starts[row] as usize..self.starts[row + 1] as usize]
    }
}

/// Margin of the lists beyond the radius of influence, over the particle spacing.
pub(crate) const MARGIN: Real = 0.02;
/// Candidates per SIMD group.
const LANES: usize = 8;

/// Positions for the search in single precision, from a corner of the bins \[m]: an error of 1e-5 of a spacing.
#[derive(Clone, Debug, Default)]
struct Places {
    now: [Vec<f32>; 3],
    then: [Vec<f32>; 3],
}

impl Places {
    fn fill(&mut self, positions: &[Vector], origin: Vector, displacement: impl Fn(usize) -> Vector + Sync) {
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
                let then = now + displacement(a);
                (x[n], y[n], z[n]) = (now.x as f32, now.y as f32, now.z as f32);
                (p[n], q[n], r[n]) = (then.x as f32, then.y as f32, then.z as f32);
            }
        });
    }

    /// Displacement of `a` \[m].
    fn displacement(&self, a: usize) -> f32 {
        (0..3).map(|d| (self.then[d][a] - self.now[d][a]).powi(2)).sum::<f32>().sqrt()
    }

    /// Appends those of `range` that are near `a` to the list, from `end` on; returns the new end.
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

/// Neighbour lists of the own fluid particles and of wall particles beside fluid.
#[derive(Clone, Debug, Default)]
pub(crate) struct Neighbours {
    blocks: Vec<Block>,
    places: Places,
    /// Largest displacement of a fluid particle in and around each bin \[m]; negative where there is none.
    displacements: Vec<f32>,
    spare: Vec<f32>,
    /// Displacement of the walls \[m].
    walls: f32,
    /// Number of own particles that have lists.
    owned: usize,
    /// Number of pairs in the lists.
    pub pairs: usize,
}

impl Neighbours {
    /// Lists the pairs that are nearer than `radius` \[m] now, or after the `displacement` of each fluid particle and of all
    /// `walls` \[m].
    pub fn renew(
        &mut self,
        bins: &Bins,
        particles: &Particles,
        radius: Real,
        walls: Vector,
        displacement: impl Fn(usize) -> Vector + Sync,
    ) {
        let kinds = &particles.kind[..];
        let displacement = |a: usize| if kinds[a] == Kind::Fluid { displacement(a) } else { walls };
        self.walls = walls.length() as f32;
        self.places.fill(&particles.position, bins.lower, displacement);
        self.find_displacements(bins, kinds);
        self.list(bins, particles, radius);
    }

    /// Finds the largest displacement of the fluid near each bin.
    fn find_displacements(&mut self, bins: &Bins, kinds: &[Kind]) {
        let Self { displacements, spare, places, .. } = self;
        let places = &*places;
        displacements.clear();
        displacements.resize(bins.len(), -1.0);
        for_each_chunk(&mut displacements[..], ROWS, |number, displacements| {
            for (n, longest) in displacements.iter_mut().enumerate() {
                let bin = number * ROWS + n;
                let fluid = bins.own(bin).chain(bins.ghosts(bin)).filter(|&a| kinds[a] == Kind::Fluid);
                *longest = fluid.map(|a| places.displacement(a)).fold(-1.0, f32::max);
            }
        });
        // The largest within range, one direction after the other.
        spare.resize(displacements.len(), 0.0);
        for d in 0..3 {
            let stride: usize = bins.count[..d].iter().product();
            let (count, reach) = (bins.count[d], bins.layers[d]);
            let before = &displacements[..];
            for_each_chunk(&mut spare[..], ROWS, |number, longest| {
                for (n, longest) in longest.iter_mut().enumerate() {
                    let bin = number * ROWS + n;
                    let place = bin / stride % count;
                    let first = bin - place.min(reach) * stride;
                    let steps = place.min(reach) + (count - 1 - place).min(reach);
                    *longest = (0..=steps).map(|m| before[first + m * stride]).fold(-1.0, f32::max);
                }
            });
            std::mem::swap(displacements, spare);
        }
    }

    fn list(&mut self, bins: &Bins, particles: &Particles, radius: Real) {
        self.owned = particles.owned;
        self.blocks.resize_with(particles.owned.div_ceil(ROWS), Block::default);
        let Self { blocks, places, displacements, walls, .. } = self;
        let (places, displacements, walls) = (&*places, &*displacements, *walls);
        let (positions, kinds) = (&particles.position[..], &particles.kind[..]);
        let square = (radius * radius) as f32;
        // Allowance for single precision.
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
                let longest = displacements[bins.number(positions[a]) as usize];
                if longest < 0.0 {
                    continue;
                }
                let reach = radius + Real::from(places.displacement(a) + longest.max(walls));
                let begin = end;
                bins.for_each_range(positions[a], reach, |range| end = places.list_near(a, range, square, list, end));
                // Walls without fluid neighbours take part in nothing.
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

    /// Whether there may be fluid within range of a bin.
    pub fn is_wet(&self, bin: u32) -> bool {
        self.displacements[bin as usize] >= 0.0
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

    /// The lists by blocks of consecutive particles.
    pub fn blocks(&self) -> &[Block] {
        &self.blocks
    }
}
