//! Pairs of fluid particles and their images, with the vectors `g` of every operator, and the compact matrix.

use sazanami_numerics::particles::Bins;
use sazanami_numerics::{Real, Vector};
use sazanami_parallel::{Rows, for_each_chunk};

use super::mirrors::{Mirrors, Turned, turn, way};
use crate::matrix::{Block, Row};
use crate::neighbours::{Neighbours, ROWS};
use crate::particles::Kind;
use crate::scheme::Kernel;

/// Part of the radius within which pairs count: nearer to it the vectors vanish in single precision.
const WITHIN: Real = 1.0 - 1e-6;

/// What the pairs of one block have besides the columns and coefficients `2 s` of its [`Block`].
#[derive(Clone, Debug)]
pub(crate) struct PairBlock {
    starts: [u32; ROWS + 1],
    /// `g_ij = s_ij r_ij` [1/m].
    slopes: Vec<[f32; 3]>,
    turned: Vec<Turned>,
}

impl Default for PairBlock {
    fn default() -> Self {
        Self { starts: [0; ROWS + 1], slopes: Vec::new(), turned: Vec::new() }
    }
}

/// A neighbour of a particle: another one, or an image.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Neighbour {
    /// The particle, or the one behind the image.
    pub particle: usize,
    pub turned: Turned,
    /// `g = s r` [1/m].
    pub slope: Vector,
    /// `s` [1/m^2].
    pub stiffness: Real,
}

impl Neighbour {
    /// Way to the neighbour \[m].
    #[inline(always)]
    pub fn way(&self) -> Vector {
        self.slope / self.stiffness
    }

    /// A vector of the particle behind as its image has it.
    #[inline(always)]
    pub fn seen(&self, vector: Vector) -> Vector {
        if self.turned == 0 { vector } else { turn(self.turned, vector) }
    }
}

/// The pairs of a rank by rows of own particles.
#[derive(Clone, Debug, Default)]
pub(crate) struct Pairs {
    blocks: Vec<PairBlock>,
}

/// Where pairs are looked for.
pub(crate) struct Search<'a> {
    pub kernel: &'a Kernel,
    pub mirrors: &'a Mirrors,
    pub bins: &'a Bins,
    pub neighbours: &'a Neighbours,
    pub kind: &'a [Kind],
    pub position: &'a [Vector],
}

impl Pairs {
    /// Finds the pairs of the fluid, and sets the rows of the compact matrix: `2 s_ij` to every neighbour and, where
    /// neighbours are missing, to pressure zero.
    pub fn renew(&mut self, search: &Search<'_>, blocks: &mut [Block], rows: &mut [Row]) {
        self.blocks.resize_with(blocks.len(), PairBlock::default);
        let support = search.kernel.sums.support;
        let owned = search.neighbours.owned();
        let columns = (blocks, &mut self.blocks[..], Rows { data: rows, width: ROWS });
        for_each_chunk(columns, 1, |number, (block, pairs, rows)| {
            let (block, pairs) = (&mut block[0], &mut pairs[0]);
            block.columns.clear();
            block.coefficients.clear();
            pairs.slopes.clear();
            pairs.turned.clear();
            for (row, entry) in rows.data.iter_mut().enumerate() {
                let a = number * ROWS + row;
                *entry = Row::default();
                if a < owned && search.kind[a] == Kind::Fluid {
                    search.list(a, search.neighbours.blocks()[number].of(row), pairs, block);
                    let begin = pairs.starts[row] as usize;
                    let sum: Real = block.coefficients[begin..].iter().map(|&c| Real::from(c)).sum();
                    entry.diagonal = sum.max(2.0 * support);
                }
                pairs.starts[row + 1] = pairs.turned.len() as u32;
                block.end_row(row, pairs.turned.len(), 0);
            }
        });
    }

    /// Neighbours of own particle `a`.
    #[inline(always)]
    pub fn of<'a>(&'a self, blocks: &'a [Block], a: usize) -> impl Iterator<Item = Neighbour> + Clone + 'a {
        let (number, row) = (a / ROWS, a % ROWS);
        let PairBlock { starts, slopes, turned, .. } = &self.blocks[number];
        let range = starts[row] as usize..starts[row + 1] as usize;
        let (columns, coefficients) = blocks[number].row(row);
        let pairs = columns.iter().zip(coefficients).zip(slopes[range.clone()].iter().zip(&turned[range]));
        pairs.map(|((&b, &c), (g, &turned))| Neighbour {
            particle: b as usize,
            turned,
            slope: Vector::from_array(g.map(Real::from)),
            stiffness: 0.5 * Real::from(c),
        })
    }

    /// Number of pairs.
    pub fn len(&self) -> usize {
        self.blocks.iter().map(|block| block.starts[ROWS] as usize).sum()
    }
}

impl Search<'_> {
    /// Lists the neighbours of `a`: particles of the list `near`, then images.
    fn list(&self, a: usize, near: &[u32], pairs: &mut PairBlock, block: &mut Block) {
        let Self { kernel, mirrors, bins, kind, position, .. } = *self;
        let (weight, here) = (kernel.weight, position[a]);
        let radius = WITHIN * weight.radius;
        let square = radius * radius;
        let mut add = |b: usize, turned: Turned, apart: Vector, pairs: &mut PairBlock| {
            let r2 = apart.length_squared();
            if r2 < square {
                let s = -weight.slope_over_distance(r2.sqrt()) / kernel.sums.strain;
                block.columns.push(b as u32);
                block.coefficients.push((2.0 * s) as f32);
                pairs.slopes.push((s * apart).to_array().map(|g| g as f32));
                pairs.turned.push(turned);
            }
        };
        for b in near.iter().map(|&b| b as usize).filter(|&b| kind[b] == Kind::Fluid) {
            add(b, 0, position[b] - here, pairs);
        }
        mirrors.near(here, radius, |turned, twice| {
            let image = way(here, here, turned, twice) + here;
            bins.for_each_range(image, radius, |range| {
                for b in range.filter(|&b| kind[b] == Kind::Fluid) {
                    add(b, turned, way(here, position[b], turned, twice), pairs);
                }
            });
        });
    }
}
