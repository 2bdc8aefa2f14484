//! Pairs of fluid particles and their images, with the vectors `g` of every operator, and the compact matrix.

use sazanami_numerics::particles::Bins;
use sazanami_numerics::{Real, Vector};
use sazanami_parallel::{Rows, for_each_chunk};

use super::mirrors::{DIRECTIONS, Mirrors, Turned, seen, turn, way};
use super::voids::Bulk;
use crate::matrix::{Block, Row};
use crate::moments::Symmetric;
use crate::neighbours::{Neighbours, ROWS};
use crate::particles::Kind;
use crate::scheme::Kernel;

/// Part of the radius within which pairs count: nearer to it the vectors vanish in single precision.
const WITHIN: Real = 1.0 - 1e-6;

/// Pairs that are found or measured together.
pub(crate) const LANES: usize = 8;

/// Stands behind the pairs of a block.
const NO_PAIR: [f32; 4] = [0.0, 0.0, 0.0, 1.0];

/// Vectors and images of the pairs of one block, beside the columns and coefficients `2 s` of its [`Block`].
#[derive(Clone, Debug)]
pub(crate) struct PairBlock {
    starts: [u32; ROWS + 1],
    /// First pair of each row with an image.
    images: [u32; ROWS],
    /// `s_ij r_ij` [1/m]: `g_ij`, over the share of fluid and grains that move; and `2 s_ij` [1/m^2]. [`LANES`] more than pairs.
    slopes: Vec<[f32; 4]>,
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
        seen(self.turned, vector)
    }
}

/// Pairs of one particle with their lengths; entries behind the last pair of the particle are those of others.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Group {
    /// `g` [1/m], and a number without meaning.
    pub slope: [[Real; 4]; LANES],
    /// `s` [1/m^2].
    pub stiffness: [Real; LANES],
    /// Way to the neighbour \[m], and a number without meaning.
    pub way: [[Real; 4]; LANES],
    /// Its length \[m].
    pub length: [Real; LANES],
}

impl Group {
    #[inline(always)]
    fn of(slopes: &[[f32; 4]; LANES]) -> Self {
        let slope: [[Real; 4]; LANES] = lanes(|l| slopes[l].map(Real::from));
        let stiffness: [Real; LANES] = lanes(|l| 0.5 * slope[l][3]);
        let inverse: [Real; LANES] = lanes(|l| stiffness[l].recip());
        let way: [[Real; 4]; LANES] = lanes(|l| slope[l].map(|g| inverse[l] * g));
        let square = |[x, y, z, _]: [Real; 4]| x * x + y * y + z * z;
        Self { slope, stiffness, way, length: lanes(|l| square(way[l]).sqrt()) }
    }
}

/// The values of a group; unlike `map` of arrays it is always inlined.
#[inline(always)]
pub(crate) fn lanes<T: Copy + Default>(value: impl Fn(usize) -> T) -> [T; LANES] {
    let mut values = [T::default(); LANES];
    values.iter_mut().enumerate().for_each(|(l, entry)| *entry = value(l));
    values
}

/// Adds `factor vector` to `sum`.
#[inline(always)]
pub(crate) fn add_to(sum: &mut [Real; 4], factor: Real, vector: &[Real; 4]) {
    (0..4).for_each(|l| sum[l] += factor * vector[l]);
}

/// A vector with `fourth` behind it.
#[inline(always)]
pub(crate) fn four(vector: Vector, fourth: Real) -> [Real; 4] {
    [vector.x, vector.y, vector.z, fourth]
}

/// The vector before a fourth number.
#[inline(always)]
pub(crate) fn three([x, y, z, _]: [Real; 4]) -> Vector {
    Vector::new(x, y, z)
}

/// The columns of a symmetric matrix, each with a zero behind it.
#[inline(always)]
pub(crate) fn columns_of(m: &Symmetric) -> [[Real; 4]; 3] {
    [[m[0], m[3], m[4], 0.0], [m[3], m[1], m[5], 0.0], [m[4], m[5], m[2], 0.0]]
}

/// `matrix vector` by columns; the fourth number is zero.
#[inline(always)]
pub(crate) fn product(columns: &[[Real; 4]; 3], vector: &[Real; 4]) -> [Real; 4] {
    let [p, q, r] = columns;
    std::array::from_fn(|l| p[l] * vector[0] + q[l] * vector[1] + r[l] * vector[2])
}

/// The same for the matrix of an image, by that of the particle behind.
#[inline]
pub(crate) fn product_at_image(turned: Turned, columns: &[[Real; 4]; 3], vector: &[Real; 4]) -> [Real; 4] {
    let there = four(turn(turned, three(*vector)), 0.0);
    four(turn(turned, three(product(columns, &there))), 0.0)
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
            pairs.slopes.extend_from_slice(&[NO_PAIR; LANES]);
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
            let columns = &blocks[number].columns;
            own.resize(columns.len(), [0.0; 4]);
            others.resize(columns.len(), [0.0; 4]);
            for (row, (sum, along)) in sums.data.iter_mut().zip(slope.data.iter_mut()).enumerate() {
                (*sum, *along) = ([0.0; 4], Vector::ZERO);
                let a = number * ROWS + row;
                let range = starts[row] as usize..starts[row + 1] as usize;
                if range.is_empty() {
                    continue;
                }
                let here = columns_of(&inverse[a]);
                let pairs = columns[range.clone()].iter().zip(&slopes[range.clone()]).zip(&turned[range.clone()]);
                let into = own[range.clone()].iter_mut().zip(&mut others[range]);
                for (((&b, slope), &turned), (own, other)) in pairs.zip(into) {
                    let b = b as usize;
                    let [share, mine, theirs] = [bulk.share(a, b), bulk.ratio(a, b), bulk.ratio(b, a)];
                    let g = slope.map(|g| share * Real::from(g));
                    let whole = product(&here, &g);
                    if !bulk.clear {
                        *along += (mine - 1.0) * three(whole);
                    }
                    let [x, y, z, _] = whole.map(|k| (mine * k) as f32);
                    *own = [x, y, z, slope[3]];
                    (0..4).for_each(|l| sum[l] += Real::from(own[l]));
                    let there = columns_of(&inverse[b]);
                    let whole = if turned == 0 { product(&there, &g) } else { product_at_image(turned, &there, &g) };
                    *other = whole.map(|k| (theirs * k) as f32);
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

    /// `sum f_j B_j g_aj` of a field `f`, and zero: a sum that callers use, so that all four are taken at once.
    #[inline(always)]
    pub fn gathered(&self, blocks: &[Block], a: usize, field: &[Real]) -> [Real; 4] {
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
        std::array::from_fn(|l| sums[0][l] + sums[1][l])
    }

    /// Neighbours of own particle `a`.
    #[inline(always)]
    pub fn of<'a>(&'a self, blocks: &'a [Block], a: usize) -> impl Iterator<Item = Neighbour> + Clone + 'a {
        let (number, row) = (a / ROWS, a % ROWS);
        let PairBlock { starts, slopes, turned, .. } = &self.blocks[number];
        let range = starts[row] as usize..starts[row + 1] as usize;
        let pairs = blocks[number].row(row).0.iter().zip(&slopes[range.clone()]).zip(&turned[range]);
        pairs.map(|((&b, slope), &turned)| {
            let [x, y, z, c] = slope.map(Real::from);
            Neighbour { particle: b as usize, turned, slope: Vector::new(x, y, z), stiffness: 0.5 * c }
        })
    }

    /// Calls `body` with the neighbours of own particle `a`, some at a time and in order: numbers of particles, how images are
    /// turned, and lengths.
    #[inline(always)]
    pub fn for_each_group(&self, blocks: &[Block], a: usize, mut body: impl FnMut(&[u32], &[Turned], &Group)) {
        let (number, row) = (a / ROWS, a % ROWS);
        let PairBlock { starts, slopes, turned, .. } = &self.blocks[number];
        let columns = &blocks[number].columns;
        let end = starts[row + 1] as usize;
        for begin in (starts[row] as usize..end).step_by(LANES) {
            let range = begin..end.min(begin + LANES);
            if let Some(slopes) = slopes[begin..].first_chunk::<LANES>() {
                body(&columns[range.clone()], &turned[range], &Group::of(slopes));
            }
        }
    }

    /// Number of pairs.
    pub fn len(&self) -> usize {
        self.blocks.iter().map(|block| block.starts[ROWS] as usize).sum()
    }
}

impl Search<'_> {
    /// `s` of a pair at a scaled distance of this `square`, of this `area` and bulk volume.
    #[inline(always)]
    fn stiffness(&self, square: Real, area: Real, volume: Real) -> Real {
        -self.kernel.weight.slope_over_distance(square.sqrt()) * area / self.kernel.sums.strain * volume
    }

    /// Lists the neighbours of `a` in its `row`: particles of the list `near`, then images.
    fn list(&self, a: usize, near: &[u32], (pairs, row): (&mut PairBlock, usize), block: &mut Block) {
        let Self { kernel, mirrors, bins, kind, position, bulk, .. } = *self;
        let (weight, here) = (kernel.weight, position[a]);
        let radius = self.widest * WITHIN * weight.radius;
        let square = (WITHIN * weight.radius).powi(2);
        let gate = mirrors.gate_near(here, radius);
        let parted = |b: usize| gate.is_some_and(|number| mirrors.gates[number].parts(here, position[b]));
        for near in near.chunks(LANES) {
            self.list_group(a, near, square, parted, pairs, block);
        }
        pairs.turned.resize(pairs.slopes.len(), 0);
        pairs.images[row] = pairs.turned.len() as u32;
        let mut add = |b: usize, turned: Turned, apart: Vector| {
            let narrower = bulk.narrowing(a, b);
            let area = narrower * narrower;
            let r2 = apart.length_squared() * area;
            if r2 < square {
                let s = self.stiffness(r2, area, bulk.pair(a, b));
                block.columns.push(b as u32);
                block.coefficients.push((2.0 * s) as f32);
                pairs.slopes.push(four(s * apart, 2.0 * s).map(|g| g as f32));
                pairs.turned.push(turned);
            }
        };
        mirrors.near(here, radius, gate, |turned, twice| {
            let image = way(here, here, turned, twice) + here;
            let is_seen = |b: usize| gate.is_none_or(|gate| mirrors.shows(gate, [here, position[b]], turned, twice));
            bins.for_each_range(image, radius, |range| {
                for b in range.filter(|&b| kind[b] == Kind::Fluid && is_seen(b)) {
                    add(b, turned, way(here, position[b], turned, twice));
                }
            });
        });
    }

    /// Lists those of at most [`LANES`] particles `near` that are fluid, not `parted` from `a` and nearer than the root of
    /// `square` \[m].
    #[inline(always)]
    fn list_group(
        &self,
        a: usize,
        near: &[u32],
        square: Real,
        parted: impl Fn(usize) -> bool,
        pairs: &mut PairBlock,
        block: &mut Block,
    ) {
        let Self { kind, position, bulk, .. } = *self;
        let mut numbers = [a as u32; LANES];
        numbers[..near.len()].copy_from_slice(near);
        let apart = lanes(|l| position[numbers[l] as usize] - position[a]);
        let fluid = lanes(|l| kind[numbers[l] as usize] == Kind::Fluid);
        let (mut area, mut volume) = ([1.0; LANES], [1.0; LANES]);
        if !bulk.clear {
            let narrower = lanes(|l| bulk.narrowing(a, numbers[l] as usize));
            area = lanes(|l| narrower[l] * narrower[l]);
            volume = lanes(|l| bulk.pair(a, numbers[l] as usize));
        }
        let r2 = lanes(|l| apart[l].length_squared() * area[l]);
        let s = lanes(|l| self.stiffness(r2[l], area[l], volume[l]));
        let begin = block.columns.len();
        block.columns.extend_from_slice(&[0; LANES]);
        block.coefficients.extend_from_slice(&[0.0; LANES]);
        pairs.slopes.extend_from_slice(&[NO_PAIR; LANES]);
        let into = begin..begin + LANES;
        let (columns, coefficients) = (&mut block.columns[into.clone()], &mut block.coefficients[into.clone()]);
        let (slopes, mut found) = (&mut pairs.slopes[into], 0);
        for (l, &b) in numbers.iter().enumerate() {
            let at = found % LANES;
            columns[at] = b;
            coefficients[at] = (2.0 * s[l]) as f32;
            slopes[at] = four(s[l] * apart[l], 2.0 * s[l]).map(|g| g as f32);
            let counts = (l < near.len()) & (r2[l] < square) & fluid[l];
            found += usize::from(counts && !parted(b as usize));
        }
        block.columns.truncate(begin + found);
        block.coefficients.truncate(begin + found);
        pairs.slopes.truncate(begin + found);
    }
}
