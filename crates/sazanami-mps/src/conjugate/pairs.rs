//! Pairs of fluid particles and their images, with the vectors `g` of every operator, and the compact matrix.

use sazanami_numerics::particles::Bins;
use sazanami_numerics::{Real, Vector};
use sazanami_parallel::{Rows, for_each_chunk};

use super::mirrors::{DIRECTIONS, Mirrors, Turned, turn, way};
use super::voids::Bulk;
use crate::matrix::{Block, Row};
use crate::moments::Symmetric;
use crate::neighbours::{Neighbours, ROWS};
use crate::particles::Kind;
use crate::scheme::Kernel;

/// Part of the radius within which pairs count: nearer to it the vectors vanish in single precision.
const WITHIN: Real = 1.0 - 1e-6;

/// Vectors and images of the pairs of one block, beside the columns and coefficients `2 s` of its [`Block`].
#[derive(Clone, Debug)]
pub(crate) struct PairBlock {
    starts: [u32; ROWS + 1],
    /// First pair of each row with an image.
    images: [u32; ROWS],
    /// `s_ij r_ij` [1/m]: `g_ij`, over the share of fluid and grains that move.
    slopes: Vec<[f32; 3]>,
    turned: Vec<Turned>,
    /// `B_i g_ij eps_j/eps_i` [1/m], and the coefficient of the compact matrix [1/m^2].
    own: Vec<[f32; 4]>,
    /// `B_j g_ij eps_i/eps_j` [1/m], which the neighbour holds with the other sign; a zero.
    others: Vec<[f32; 4]>,
}

impl Default for PairBlock {
    fn default() -> Self {
        let (slopes, turned, own, others) = (Vec::new(), Vec::new(), Vec::new(), Vec::new());
        Self { starts: [0; ROWS + 1], images: [0; ROWS], slopes, turned, own, others }
    }
}

/// Signs of a vector at an image, and of a scalar behind it, by the directions turned.
const SIGNS: [[Real; 4]; 8] = {
    let mut signs = [[1.0; 4]; 8];
    let mut n = 0;
    while n < 24 {
        if ((n % 8) >> (n / 8)) & 1 == 1 {
            signs[n % 8][n / 8] = -1.0;
        }
        n += 1;
    }
    signs
};

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
        self.stiffness.recip() * self.slope
    }

    /// A vector of the particle behind as its image has it.
    #[inline(always)]
    pub fn seen(&self, vector: Vector) -> Vector {
        if self.turned == 0 { vector } else { turn(self.turned, vector) }
    }
}

/// `matrix vector`.
#[inline(always)]
pub(crate) fn times(m: &Symmetric, v: Vector) -> Vector {
    Vector::new(
        m[0] * v.x + m[3] * v.y + m[4] * v.z,
        m[3] * v.x + m[1] * v.y + m[5] * v.z,
        m[4] * v.x + m[5] * v.y + m[2] * v.z,
    )
}

/// The pairs of a rank by rows of own particles.
#[derive(Clone, Debug, Default)]
pub(crate) struct Pairs {
    blocks: Vec<PairBlock>,
}

/// Particles, bins and kernel of a search for pairs.
pub(crate) struct Search<'a> {
    pub kernel: &'a Kernel,
    pub mirrors: &'a Mirrors<'a>,
    pub bins: &'a Bins,
    pub neighbours: &'a Neighbours,
    pub kind: &'a [Kind],
    pub position: &'a [Vector],
    pub bulk: Bulk<'a>,
    /// Largest size of a pair over the spacing.
    pub widest: Real,
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
                pairs.images[row] = pairs.turned.len() as u32;
                if a < owned && search.kind[a] == Kind::Fluid {
                    search.list(a, search.neighbours.blocks()[number].of(row), (pairs, row), block);
                    let begin = pairs.starts[row] as usize;
                    let row = block.columns[begin..].iter().zip(&block.coefficients[begin..]);
                    let [sum, filled] = row.fold([0.0; 2], |[sum, filled], (&b, &c)| {
                        let (b, c) = (b as usize, Real::from(c));
                        [sum + c, filled + c / search.bulk.pair(a, b)]
                    });
                    let full = 2.0 * support / search.bulk.size[a].powi(2);
                    entry.diagonal = sum + search.bulk.own(a) * (full - filled).max(0.0);
                }
                pairs.starts[row + 1] = pairs.turned.len() as u32;
                block.end_row(row, pairs.turned.len(), 0);
            }
        });
    }

    /// Sets the coefficients of the operators from the matrices `B` of all particles, and their `sums` by whole blocks of
    /// own ones: those of the operators [1/m] and that of the compact matrix [1/m^2]. They are rounded alike from both ends
    /// of a pair. Sets `slope` to `sum (eps_j/eps_i - 1) B_i g_ij`, by whole blocks too [1/m].
    pub fn weigh(
        &mut self,
        blocks: &[Block],
        inverse: &[Symmetric],
        bulk: &Bulk<'_>,
        (sums, slope): (&mut [[Real; 4]], &mut [Vector]),
    ) {
        let rows = (Rows { data: sums, width: ROWS }, Rows { data: slope, width: ROWS });
        let columns = (&mut self.blocks[..], rows.0, rows.1);
        for_each_chunk(columns, 1, |number, (pairs, sums, slope)| {
            let PairBlock { starts, slopes, turned, own, others, .. } = &mut pairs[0];
            let Block { columns, coefficients, .. } = &blocks[number];
            own.resize(slopes.len(), [0.0; 4]);
            others.resize(slopes.len(), [0.0; 4]);
            for (row, (sum, along)) in sums.data.iter_mut().zip(slope.data.iter_mut()).enumerate() {
                (*sum, *along) = ([0.0; 4], Vector::ZERO);
                for n in starts[row] as usize..starts[row + 1] as usize {
                    let (a, b, turned) = (number * ROWS + row, columns[n] as usize, turned[n]);
                    let g = bulk.share(a, b) * Vector::from_array(slopes[n].map(Real::from));
                    let [mine, theirs] = [bulk.ratio(a, b), bulk.ratio(b, a)];
                    let whole = times(&inverse[a], g);
                    *along += (mine - 1.0) * whole;
                    let [x, y, z] = (mine * whole).to_array().map(|k| k as f32);
                    own[n] = [x, y, z, coefficients[n]];
                    (0..4).for_each(|l| sum[l] += Real::from(own[n][l]));
                    let whole = turn(turned, times(&inverse[b], turn(turned, g)));
                    let [x, y, z] = (theirs * whole).to_array().map(|k| k as f32);
                    others[n] = [x, y, z, 0.0];
                }
            }
        });
    }

    /// `sum (f_j - f_a) k_aj` in each component of a field with the values `at`: `k` is `B_a g_aj` and, last, the coefficient
    /// of the compact matrix. Images have the first three turned.
    #[inline(always)]
    pub fn differences(&self, blocks: &[Block], a: usize, at: impl Fn(usize) -> [Real; 4]) -> [Real; 4] {
        let (number, row) = (a / ROWS, a % ROWS);
        let PairBlock { starts, images, own, turned, .. } = &self.blocks[number];
        let [begin, between, end] = [starts[row], images[row], starts[row + 1]].map(|n| n as usize);
        let columns = &blocks[number].columns;
        let here = at(a);
        // Two sums, so that neither waits for the other.
        let mut sums = [[0.0; 4]; 2];
        let add = |sums: &mut [Real; 4], b: u32, k: &[f32; 4]| {
            let there = at(b as usize);
            for l in 0..4 {
                sums[l] += (there[l] - here[l]) * Real::from(k[l]);
            }
        };
        let (twos, rest) = columns[begin..between].as_chunks::<2>();
        let (own_twos, own_rest) = own[begin..between].as_chunks::<2>();
        for (b, k) in twos.iter().zip(own_twos) {
            (0..2).for_each(|n| add(&mut sums[n], b[n], &k[n]));
        }
        rest.iter().zip(own_rest).for_each(|(&b, k)| add(&mut sums[0], b, k));
        let mut sums: [Real; 4] = std::array::from_fn(|l| sums[0][l] + sums[1][l]);
        for n in between..end {
            let (there, k, signs) = (at(columns[n] as usize), &own[n], &SIGNS[usize::from(turned[n] & DIRECTIONS)]);
            for l in 0..4 {
                sums[l] += (signs[l] * there[l] - here[l]) * Real::from(k[l]);
            }
        }
        sums
    }

    /// `sum f_j B_j g_aj` of a field `f`.
    #[inline(always)]
    pub fn gathered(&self, blocks: &[Block], a: usize, field: &[Real]) -> Vector {
        let (number, row) = (a / ROWS, a % ROWS);
        let PairBlock { starts, others, .. } = &self.blocks[number];
        let range = starts[row] as usize..starts[row + 1] as usize;
        let mut sums = [[0.0; 4]; 2];
        let add = |sums: &mut [Real; 4], b: u32, h: &[f32; 4]| {
            let value = field[b as usize];
            for l in 0..4 {
                sums[l] += value * Real::from(h[l]);
            }
        };
        let (twos, rest) = blocks[number].columns[range.clone()].as_chunks::<2>();
        let (others_twos, others_rest) = others[range].as_chunks::<2>();
        for (b, h) in twos.iter().zip(others_twos) {
            (0..2).for_each(|n| add(&mut sums[n], b[n], &h[n]));
        }
        rest.iter().zip(others_rest).for_each(|(&b, h)| add(&mut sums[0], b, h));
        Vector::from_slice(&sums[0][..3]) + Vector::from_slice(&sums[1][..3])
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
    /// Lists the neighbours of `a` in its `row`: particles of the list `near`, then images.
    fn list(&self, a: usize, near: &[u32], (pairs, row): (&mut PairBlock, usize), block: &mut Block) {
        let Self { kernel, mirrors, bins, kind, position, bulk, .. } = *self;
        let (weight, here) = (kernel.weight, position[a]);
        let radius = self.widest * WITHIN * weight.radius;
        let square = (WITHIN * weight.radius).powi(2);
        let gate = mirrors.gate_near(here, radius);
        let mut add = |b: usize, turned: Turned, apart: Vector, pairs: &mut PairBlock| {
            let narrower = bulk.narrowing(a, b);
            let area = narrower * narrower;
            let r2 = apart.length_squared() * area;
            if r2 < square {
                let s = -weight.slope_over_distance(r2.sqrt()) * area / kernel.sums.strain * bulk.pair(a, b);
                block.columns.push(b as u32);
                block.coefficients.push((2.0 * s) as f32);
                pairs.slopes.push((s * apart).to_array().map(|g| g as f32));
                pairs.turned.push(turned);
            }
        };
        let parted = |b: usize| gate.is_some_and(|number| mirrors.gates[number].parts(here, position[b]));
        for b in near.iter().map(|&b| b as usize).filter(|&b| kind[b] == Kind::Fluid && !parted(b)) {
            add(b, 0, position[b] - here, pairs);
        }
        pairs.images[row] = pairs.turned.len() as u32;
        mirrors.near(here, radius, gate, |turned, twice| {
            let image = way(here, here, turned, twice) + here;
            let is_seen = |b: usize| gate.is_none_or(|gate| mirrors.shows(gate, [here, position[b]], turned, twice));
            bins.for_each_range(image, radius, |range| {
                for b in range.filter(|&b| kind[b] == Kind::Fluid && is_seen(b)) {
                    add(b, turned, way(here, position[b], turned, twice), pairs);
                }
            });
        });
    }
}
