//! Coarse-grid correction of the pressure equation: particles are aggregated into cells, cells into larger cells.
//!
//! The operator of a level is the Galerkin sum of the finer one over the members of each cell (piecewise constant), in
//! single precision. Residuals of particles are distributed to the surrounding eight cells and corrections interpolated
//! from them with the same trilinear weights. A V-cycle with equal numbers of damped Jacobi sweeps before and after the
//! coarser correction is symmetric, as conjugate gradients require. Each rank corrects its own part.

use std::ops::Range;

use sazanami_numerics::{Real, Vector};
use sazanami_parallel::{Rows, for_each_chunk};

use crate::matrix::{Block, Layout, Row};
use crate::neighbours::ROWS;
use crate::particles::Role;
use crate::reductions::set_column;

/// Neighbours of a cell, itself included.
const STENCIL: usize = 27;
/// Index of the cell itself among them.
const CENTRE: usize = 13;
/// Sweeps before and after the correction.
const SWEEPS: usize = 2;
/// Sweeps on the coarsest level.
const COARSEST_SWEEPS: usize = 16;
/// Damping of a sweep.
const DAMPING: f32 = 0.7;
/// Over-correction factor: the piecewise constant coarse operator is too stiff by about this factor.
const STRETCH: f32 = 1.7;
/// Partial right sides in which residuals of particles are summed, and cells per block of work.
const PARTS: usize = 8;
const CELLS: usize = 1024;
/// The coarsest level has at most this number of cells in each direction.
const FEW: usize = 4;

/// One level: a box of cells with one layer of empty cells around it.
#[derive(Clone, Debug, Default)]
struct Level {
    /// Cells in each direction, without the empty layer.
    count: [usize; 3],
    /// Coefficients by neighbour: `matrix[s][cell]`.
    matrix: Vec<Vec<f32>>,
    /// Reciprocal of the diagonal, damped; zero in empty cells.
    inverse: Vec<f32>,
    right: Vec<f32>,
    value: Vec<f32>,
    next: Vec<f32>,
}

/// Trilinear interpolation at a particle: the first of the eight surrounding cells and the weights, x1 fastest.
#[derive(Clone, Copy, Debug, Default)]
struct Interpolation {
    first: u32,
    shares: [f32; 8],
}

/// The levels above the particles.
#[derive(Clone, Debug, Default)]
pub(crate) struct CoarseGrid {
    levels: Vec<Level>,
    /// Cell of each own particle on the finest level.
    cell: Vec<u32>,
    /// Interpolation of each own unknown.
    between: Vec<Interpolation>,
    /// Partial right sides.
    parts: Vec<f32>,
    /// Coefficients of each cell in double precision.
    sums: Vec<[f64; STENCIL]>,
    /// Index of the neighbour by the difference of cell numbers.
    neighbour: Vec<u8>,
}

/// Rows along x1 of a box of cells with a layer around it.
fn rows(count: [usize; 3]) -> impl Iterator<Item = Range<usize>> {
    let [n1, n2, n3] = count;
    let (b, c) = (n1 + 2, (n1 + 2) * (n2 + 2));
    (0..n3).flat_map(move |k| (0..n2).map(move |j| (k + 1) * c + (j + 1) * b + 1)).map(move |at| at..at + n1)
}

impl Level {
    fn new(count: [usize; 3]) -> Self {
        let cells = count.iter().map(|n| n + 2).product();
        let zeros = || vec![0.0; cells];
        Self {
            count,
            matrix: (0..STENCIL).map(|_| zeros()).collect(),
            inverse: zeros(),
            right: zeros(),
            value: zeros(),
            next: zeros(),
        }
    }

    fn strides(&self) -> [usize; 3] {
        [1, self.count[0] + 2, (self.count[0] + 2) * (self.count[1] + 2)]
    }

    /// Number of the cell at index triple `place`.
    fn cell(&self, place: [usize; 3]) -> usize {
        let strides = self.strides();
        (0..3).map(|d| (place[d] + 1) * strides[d]).sum()
    }

    /// Differences of cell numbers to the neighbours.
    fn offsets(&self) -> [isize; STENCIL] {
        let strides = self.strides();
        std::array::from_fn(|s| (0..3).map(|d| step(s, d) * strides[d] as isize).sum())
    }

    /// Interpolation at `s`, in bins, from those surrounding cells that hold unknowns; from cell `own` alone if hardly any
    /// does.
    fn between(&self, s: Vector, width: [usize; 3], own: u32, corners: &[usize; 8]) -> Interpolation {
        let mut first = 0;
        let mut part = [0.0; 3];
        for (d, stride) in self.strides().into_iter().enumerate() {
            let place = (s[d] / width[d] as Real - 0.5).clamp(-1.0, self.count[d] as Real - 1e-6);
            let low = place.floor();
            part[d] = (place - low) as f32;
            first += (low as isize + 1) as usize * stride;
        }
        let mut shares: [f32; 8] = std::array::from_fn(|n| {
            let share = |d: usize| if n >> d & 1 == 1 { part[d] } else { 1.0 - part[d] };
            if self.inverse[first + corners[n]] > 0.0 { share(0) * share(1) * share(2) } else { 0.0 }
        });
        let all: f32 = shares.iter().sum();
        if all < 0.05 {
            return Interpolation { first: own, shares: std::array::from_fn(|n| if n == 0 { 1.0 } else { 0.0 }) };
        }
        shares.iter_mut().for_each(|share| *share /= all);
        Interpolation { first: first as u32, shares }
    }

    fn set_inverse(&mut self) {
        for (inverse, &diagonal) in self.inverse.iter_mut().zip(&self.matrix[CENTRE]) {
            *inverse = if diagonal > 0.0 { DAMPING / diagonal } else { 0.0 };
        }
    }

    /// `next = right - A value`; with `step`, one damped Jacobi sweep of `value` into `next`.
    fn pass(&mut self, step: bool) {
        let offsets = self.offsets();
        let Self { count, matrix, inverse, right, value, next } = self;
        let [n1, n2, n3] = *count;
        let plane = (n1 + 2) * (n2 + 2);
        let planes = CELLS.div_ceil(plane);
        for_each_chunk(&mut next[plane..(n3 + 1) * plane], planes * plane, |number, next| {
            let first = plane * (1 + number * planes);
            for at in (0..next.len() / plane).flat_map(|k| (1..=n2).map(move |j| k * plane + j * (n1 + 2) + 1)) {
                let into = &mut next[at..at + n1];
                let row = first + at..first + at + n1;
                into.copy_from_slice(&right[row.clone()]);
                for (coefficients, offset) in matrix.iter().zip(offsets) {
                    let values = &value[(row.start as isize + offset) as usize..][..n1];
                    for ((into, c), v) in into.iter_mut().zip(&coefficients[row.clone()]).zip(values) {
                        *into -= c * v;
                    }
                }
                if step {
                    for ((next, inverse), value) in into.iter_mut().zip(&inverse[row.clone()]).zip(&value[row]) {
                        *next = value + inverse * *next;
                    }
                }
            }
        });
    }

    /// One damped Jacobi sweep.
    fn sweep(&mut self) {
        self.pass(true);
        std::mem::swap(&mut self.value, &mut self.next);
    }

    /// First Jacobi sweep, from a zero value.
    fn begin(&mut self) {
        for ((value, inverse), right) in self.value.iter_mut().zip(&self.inverse).zip(&self.right) {
            *value = inverse * right;
        }
    }

    /// Restricts the residual to the coarser level.
    fn restrict(&mut self, above: &mut Self) {
        self.pass(false);
        above.right.fill(0.0);
        for (row, [j, k]) in rows(self.count).zip(places(self.count)) {
            let first = above.cell([0, j / 2, k / 2]);
            for (i, r) in self.next[row].iter().enumerate() {
                above.right[first + i / 2] += r;
            }
        }
    }

    /// Adds the interpolated correction of the coarser level.
    fn prolong(&mut self, above: &Self) {
        for (row, [j, k]) in rows(self.count).zip(places(self.count)) {
            let first = above.cell([0, j / 2, k / 2]);
            for (i, value) in self.value[row].iter_mut().enumerate() {
                *value += STRETCH * above.value[first + i / 2];
            }
        }
        // Empty cells hold no unknown.
        for (value, inverse) in self.value.iter_mut().zip(&self.inverse) {
            if *inverse == 0.0 {
                *value = 0.0;
            }
        }
    }

    /// Galerkin sum of the finer level's coefficients.
    fn gather(&mut self, below: &Self) {
        self.matrix.iter_mut().for_each(|column| column.fill(0.0));
        for (row, [j, k]) in rows(below.count).zip(places(below.count)) {
            for (i, from) in row.enumerate() {
                let place = [i, j, k];
                let cell = self.cell(place.map(|n| n / 2));
                for (s, coefficients) in below.matrix.iter().enumerate() {
                    let far: [isize; 3] = std::array::from_fn(|d| {
                        (place[d] as isize + step(s, d)).div_euclid(2) - (place[d] / 2) as isize
                    });
                    self.matrix[number(far)][cell] += coefficients[from];
                }
            }
        }
        self.set_inverse();
    }
}

/// Step to neighbour `s` in direction `d`: -1, 0 or 1.
fn step(s: usize, d: usize) -> isize {
    (s / [1, 3, 9][d] % 3) as isize - 1
}

/// Index of the neighbour `far` cells away.
fn number(far: [isize; 3]) -> usize {
    ((far[0] + 1) + 3 * (far[1] + 1) + 9 * (far[2] + 1)) as usize
}

/// Indices in x2 and x3 of the rows of a box of cells.
fn places(count: [usize; 3]) -> impl Iterator<Item = [usize; 2]> {
    (0..count[2]).flat_map(move |k| (0..count[1]).map(move |j| [j, k]))
}

impl CoarseGrid {
    /// Builds all levels from the equation of this step.
    pub fn assemble(&mut self, layout: &Layout<'_>, blocks: &[Block], rows: &[Row]) {
        let Layout { bins, roles, owned, .. } = *layout;
        // Cells as wide as the list radius: neighbours lie in adjacent cells.
        let width = bins.layers;
        let count: [usize; 3] = std::array::from_fn(|d| bins.count[d].div_ceil(width[d]));
        self.size(count);
        let Self { levels, cell, sums, neighbour, between, .. } = self;
        let finest = &mut levels[0];
        let places = bins.count;
        cell.clear();
        cell.extend(layout.bin.iter().map(|&bin| {
            let bin = bin as usize;
            let place = [bin % places[0], bin / places[0] % places[1], bin / (places[0] * places[1])];
            finest.cell(std::array::from_fn(|d| place[d] / width[d])) as u32
        }));
        let strides = finest.strides();
        let (corner, plane) = (strides[0] + strides[1] + strides[2], strides[2]);
        sums.clear();
        sums.resize(finest.right.len(), [0.0; STENCIL]);
        for_each_chunk(&mut sums[plane..(count[2] + 1) * plane], plane, |k, sums| {
            let layer = places[0] * places[1] * width[2];
            for bin in k * layer..((k + 1) * layer).min(bins.len()) {
                for a in bins.own(bin).filter(|&a| rows[a].diagonal > 0.0) {
                    let sum = &mut sums[cell[a] as usize - (k + 1) * plane];
                    sum[CENTRE] += rows[a].diagonal;
                    let (columns, coefficients) = blocks[a / ROWS].row(a % ROWS);
                    for (&b, &c) in columns.iter().zip(coefficients) {
                        let b = b as usize;
                        if b < owned && roles[b] == Role::Unknown {
                            let far = (cell[b] as usize + corner).wrapping_sub(cell[a] as usize);
                            // Pairs from cells farther apart, brought together by drag, are left out.
                            if let Some(entry) = neighbour.get(far).and_then(|&s| sum.get_mut(s as usize)) {
                                *entry -= f64::from(c);
                            }
                        }
                    }
                }
            }
        });
        let sums = &sums[..];
        for_each_chunk(&mut finest.matrix[..], 1, |s, column| {
            column[0].iter_mut().zip(sums).for_each(|(c, sum)| *c = sum[s] as f32);
        });
        finest.set_inverse();
        let corners = corners(finest.strides());
        let finest = &*finest;
        set_column(between, owned, |a| {
            if rows[a].diagonal > 0.0 {
                finest.between(bins.coordinates(layout.place[a]), width, cell[a], &corners)
            } else {
                Interpolation::default()
            }
        });
        for n in 1..levels.len() {
            let (below, above) = levels.split_at_mut(n);
            above[0].gather(&below[n - 1]);
        }
    }

    /// Allocates the levels for a box of cells.
    fn size(&mut self, count: [usize; 3]) {
        if self.levels.first().is_some_and(|level| level.count == count) {
            return;
        }
        self.levels.clear();
        let mut count = count;
        loop {
            self.levels.push(Level::new(count));
            if count.iter().all(|&n| n <= FEW) {
                break;
            }
            count = count.map(|n| n.div_ceil(2));
        }
        let finest = &self.levels[0];
        let corner: usize = finest.strides().iter().sum();
        self.neighbour.clear();
        self.neighbour.resize(2 * corner + 1, STENCIL as u8);
        for (s, offset) in finest.offsets().into_iter().enumerate() {
            self.neighbour[(corner as isize + offset) as usize] = s as u8;
        }
    }

    /// Coarse correction `z = P B P^T r` of every own particle.
    pub fn correct(&mut self, layout: &Layout<'_>, r: &[Real], z: &mut [Real]) {
        let Self { levels, between, parts, .. } = self;
        let finest = &mut levels[0];
        let corners = corners(finest.strides());
        let cells = finest.right.len();
        parts.resize(PARTS * cells, 0.0);
        let length = between.len().div_ceil(PARTS);
        let among = &*between;
        for_each_chunk(Rows { data: &mut parts[..], width: cells }, 1, |number, part| {
            part.data.fill(0.0);
            let range = (number * length).min(among.len())..((number + 1) * length).min(among.len());
            for (between, r) in among[range.clone()].iter().zip(&r[range]).filter(|(_, r)| **r != 0.0) {
                for (corner, share) in corners.iter().zip(between.shares) {
                    part.data[between.first as usize + corner] += share * *r as f32;
                }
            }
        });
        for_each_chunk(&mut finest.right[..], CELLS, |number, right| {
            for (n, right) in right.iter_mut().enumerate() {
                *right = (0..PARTS).map(|part| parts[part * cells + number * CELLS + n]).sum();
            }
        });
        cycle(levels);
        let value = &levels[0].value;
        let (roles, owned, between) = (layout.roles, layout.owned, &*between);
        for_each_chunk(z, ROWS, |number, z| {
            for (n, z) in z.iter_mut().enumerate() {
                let a = number * ROWS + n;
                *z = 0.0;
                if a < owned && roles[a] == Role::Unknown {
                    let Interpolation { first, shares } = between[a];
                    let sum: f32 = corners.iter().zip(shares).map(|(c, share)| share * value[first as usize + c]).sum();
                    *z = Real::from(STRETCH * sum);
                }
            }
        });
    }
}

/// Differences of cell numbers from the first of eight cells to each.
fn corners(strides: [usize; 3]) -> [usize; 8] {
    std::array::from_fn(|n| (0..3).map(|d| (n >> d & 1) * strides[d]).sum())
}

/// A symmetric V-cycle over `levels`, from zero.
fn cycle(levels: &mut [Level]) {
    let Some((level, above)) = levels.split_first_mut() else { return };
    level.begin();
    if above.is_empty() {
        (1..COARSEST_SWEEPS).for_each(|_| level.sweep());
        return;
    }
    (1..SWEEPS).for_each(|_| level.sweep());
    level.restrict(&mut above[0]);
    cycle(above);
    level.prolong(&above[0]);
    (0..SWEEPS).for_each(|_| level.sweep());
}
