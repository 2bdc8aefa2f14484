//! Bins and neighbour lists.
//!
//! Lists are made anew in every step, from the order of the particles alone, so that the order of every sum
//! follows from the state: threads, restarts and ranks do not change it.

use sazanami_numerics::domain::Domain;
use sazanami_numerics::{Real, Vector};
use sazanami_parallel::{SlicesMut, for_each_chunk};

use crate::particles::{Kind, Particles};

/// Particles per block of work.
pub(crate) const ROWS: usize = 64;

/// A rank's part of space and its surroundings, cut into bins.
#[derive(Clone, Debug, Default)]
pub(crate) struct Bins {
    lower: Vector,
    inverse: Vector,
    pub count: [usize; 3],
    /// First own particle of each bin, and one more.
    own: Vec<u32>,
    /// First ghost of each bin, and one more.
    ghosts: Vec<u32>,
    /// Bins in each direction that a list looks at on either side.
    pub reach: [usize; 3],
}

impl Bins {
    /// Makes the cells of the domain's grid, and those `reach` [m] around this rank's part of it, the bins.
    pub fn renew(&mut self, domain: &Domain, reach: Real) {
        let spacing = domain.grid().spacing;
        let (lower, _) = domain.rank_box(domain.communicator().rank());
        self.reach = std::array::from_fn(|d| (reach / spacing[d]).ceil() as usize);
        let margin = Vector::from_array(self.reach.map(|n| n as Real)) * spacing;
        let cells = domain.cells();
        self.count = std::array::from_fn(|d| cells[d] + 2 * self.reach[d]);
        self.lower = lower - margin;
        self.inverse = spacing.recip();
    }

    /// Place of `position`; those beyond the bins belong to the nearest.
    #[inline(always)]
    pub fn place(&self, position: Vector) -> [usize; 3] {
        let s = (position - self.lower) * self.inverse;
        std::array::from_fn(|d| (s[d].max(0.0) as usize).min(self.count[d] - 1))
    }

    /// Number of the bin of `position`, x1 fastest.
    #[inline(always)]
    pub fn number(&self, position: Vector) -> u32 {
        let [i, j, k] = self.place(position);
        (i + self.count[0] * (j + self.count[1] * k)) as u32
    }

    /// Number of bins.
    pub fn len(&self) -> usize {
        self.count.iter().product()
    }

    /// Takes note of where the bins begin among sorted places, ghosts behind the own.
    pub fn fill(&mut self, own: &[Vector], ghosts: &[Vector]) {
        let mut starts = (std::mem::take(&mut self.own), std::mem::take(&mut self.ghosts));
        self.starts(own, 0, &mut starts.0);
        self.starts(ghosts, own.len(), &mut starts.1);
        (self.own, self.ghosts) = starts;
    }

    fn starts(&self, positions: &[Vector], first: usize, starts: &mut Vec<u32>) {
        starts.clear();
        starts.resize(self.len() + 1, 0);
        for &x in positions {
            starts[self.number(x) as usize + 1] += 1;
        }
        starts[0] = first as u32;
        for n in 1..starts.len() {
            starts[n] += starts[n - 1];
        }
    }

    /// Own particles of a bin.
    pub fn own(&self, bin: usize) -> std::ops::Range<usize> {
        self.own[bin] as usize..self.own[bin + 1] as usize
    }

    /// Calls `body` with ranges of particles that hold all within reach of `position`, in a fixed order.
    #[inline(always)]
    pub fn for_each_range(&self, position: Vector, mut body: impl FnMut(std::ops::Range<usize>)) {
        let place = self.place(position);
        let low: [usize; 3] = std::array::from_fn(|d| place[d].saturating_sub(self.reach[d]));
        let high: [usize; 3] = std::array::from_fn(|d| (place[d] + self.reach[d]).min(self.count[d] - 1));
        for k in low[2]..=high[2] {
            for j in low[1]..=high[1] {
                let row = self.count[0] * (j + self.count[1] * k);
                let (first, last) = (row + low[0], row + high[0] + 1);
                body(self.own[first] as usize..self.own[last] as usize);
                let ghosts = self.ghosts[first] as usize..self.ghosts[last] as usize;
                if !ghosts.is_empty() {
                    body(ghosts);
                }
            }
        }
    }
}

/// Neighbours of some consecutive particles.
#[derive(Clone, Debug)]
pub(crate) struct Block {
    starts: [u32; ROWS + 1],
    list: Vec<u32>,
}

impl Default for Block {
    fn default() -> Self {
        Self { starts: [0; ROWS + 1], list: Vec::new() }
    }
}

impl Block {
    #[inline(always)]
    pub fn of(&self, row: usize) -> &[u32] {
        &self.list[self.starts[row] as usize..self.starts[row + 1] as usize]
    }
}

/// Neighbour lists of the own fluid and wall particles.
#[derive(Clone, Debug, Default)]
pub(crate) struct Neighbours {
    blocks: Vec<Block>,
    /// Candidates within the list's radius.
    pub pairs: usize,
}

impl Neighbours {
    /// Lists all particles within `radius` [m] of each.
    pub fn renew(&mut self, bins: &Bins, particles: &Particles, radius: Real) {
        let square = radius * radius;
        self.blocks.resize_with(particles.owned.div_ceil(ROWS), Block::default);
        let (positions, kinds) = (&particles.position[..], &particles.kind[..]);
        for_each_chunk(&mut self.blocks[..], 1, |number, block| {
            let Block { starts, list } = &mut block[0];
            list.clear();
            let first = number * ROWS;
            for row in 0..ROWS {
                let a = first + row;
                if a < particles.owned && kinds[a] != Kind::Dummy {
                    let centre = positions[a];
                    bins.for_each_range(centre, |range| {
                        let mut at = list.len();
                        list.resize(at + range.len(), 0);
                        for b in range {
                            list[at] = b as u32;
                            let near = (positions[b] - centre).length_squared() < square && b != a;
                            at += usize::from(near);
                        }
                        list.truncate(at);
                    });
                }
                starts[row + 1] = list.len() as u32;
            }
        });
        self.pairs = self.blocks.iter().map(|block| block.list.len()).sum();
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
