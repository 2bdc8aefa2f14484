//! Between a level and the next coarser one: sums of residuals, copies of corrections, averages of
//! coefficients.
//!
//! Two neighbouring cells (the last alone, if their number is odd) make a coarse cell in every
//! direction that is coarsened.

use std::ops::Range;

use super::chequerboard::{Chequerboard, Colours};
use super::stencil::{RUN, Source, Stencil};
use super::wavefront::Planes;

/// Number of cells that make a coarse cell in each direction (1 or 2), and the layout of the coarse cells.
#[derive(Clone, Copy, Debug)]
pub(super) struct Transfer {
    pub ratio: [usize; 3],
    pub coarse: Chequerboard,
}

impl Transfer {
    /// Fine indices that make the coarse index `at` in `direction`, of `cells` fine cells.
    fn fine(&self, direction: usize, at: usize, cells: usize) -> Range<usize> {
        let ratio = self.ratio[direction];
        (at * ratio).min(cells)..((at + 1) * ratio).min(cells)
    }

    /// Adds the residual of the cells of `colours` in fine plane `k` to the coarse right-hand side,
    /// for the coarse rows that hold the fine `rows`.
    #[inline]
    pub(super) fn restrict(
        &self,
        stencil: &Stencil,
        (rows, k): (Range<usize>, usize),
        colours: &[usize],
        x: [&Planes<'_, f32>; 2],
        b: [&Planes<'_, f32>; 2],
        coarse: [&mut Planes<'_, f32>; 2],
    ) {
        let [into0, into1] = coarse;
        let board = &stencil.board;
        let plane = k / self.ratio[2];
        let first = k.is_multiple_of(self.ratio[2]);
        for row in rows.start / self.ratio[1]..rows.end.div_ceil(self.ratio[1]) {
            for start in (0..self.coarse.cells[0]).step_by(RUN) {
                let count = (self.coarse.cells[0] - start).min(RUN);
                let mut sums = [0.0f32; RUN];
                for j in self.fine(1, row, board.cells[1]) {
                    for &colour in colours {
                        self.add_residual(stencil, colour, (j as isize, k as isize), start, count, x, b, &mut sums);
                    }
                }
                for offset in 0..2 {
                    let n = (count + 1 - offset) / 2;
                    let colour = self.coarse.colour(offset, row as isize, plane as isize);
                    let at = self.coarse.first(row as isize, plane as isize) + start / 2;
                    let into = if colour == 0 { into0.run_mut(at, n) } else { into1.run_mut(at, n) };
                    let sums = sums[offset..].iter().step_by(2);
                    if first {
                        into.iter_mut().zip(sums).for_each(|(into, sum)| *into = *sum);
                    } else {
                        into.iter_mut().zip(sums).for_each(|(into, sum)| *into += sum);
                    }
                }
            }
        }
    }

    #[inline]
    #[expect(clippy::too_many_arguments, reason = "the inside of `restrict`, cut out for its length")]
    fn add_residual(
        &self,
        stencil: &Stencil,
        colour: usize,
        (j, k): (isize, isize),
        start: usize,
        count: usize,
        x: [&Planes<'_, f32>; 2],
        b: [&Planes<'_, f32>; 2],
        sums: &mut [f32; RUN],
    ) {
        let board = &stencil.board;
        let offset = board.offset(colour, j, k);
        let (m0, most) = if self.ratio[0] == 2 { (start, count) } else { (start / 2, (count + 1 - offset) / 2) };
        let n = board.length(offset).saturating_sub(m0).min(most);
        let mut residual = [0.0f32; RUN];
        let residual = &mut residual[..n];
        stencil.apply(colour, (j, k), m0, x, residual);
        for (r, b) in residual.iter_mut().zip(b[colour].run(board.first(j, k) + m0, n)) {
            *r = b - *r;
        }
        if self.ratio[0] == 2 {
            sums.iter_mut().zip(residual.iter()).for_each(|(sum, r)| *sum += r);
        } else {
            sums[offset..].iter_mut().step_by(2).zip(residual.iter()).for_each(|(sum, r)| *sum += r);
        }
    }

    /// Adds the coarse correction to the cells of `colour` in the fine row `(j, k)`.
    #[inline]
    pub(super) fn correct(
        &self,
        board: &Chequerboard,
        colour: usize,
        (j, k): (usize, usize),
        coarse: &Colours,
        x: &mut Planes<'_, f32>,
    ) {
        let (row, plane) = ((j / self.ratio[1]) as isize, (k / self.ratio[2]) as isize);
        let (j, k) = (j as isize, k as isize);
        let offset = board.offset(colour, j, k);
        for start in (0..self.coarse.cells[0]).step_by(RUN) {
            let count = (self.coarse.cells[0] - start).min(RUN);
            let at = self.coarse.first(row, plane) + start / 2;
            let [even, odd] = [0, 1].map(|o| coarse[self.coarse.colour(o, row, plane)].run(at, count.div_ceil(2)));
            let (m0, most) = if self.ratio[0] == 2 { (start, count) } else { (start / 2, (count + 1 - offset) / 2) };
            let n = board.length(offset).saturating_sub(m0).min(most);
            let x = x.run_mut(board.first(j, k) + m0, n);
            if self.ratio[0] == 2 {
                for (pair, (even, odd)) in x.chunks_mut(2).zip(even.iter().zip(odd)) {
                    pair[0] += even;
                    if let Some(last) = pair.get_mut(1) {
                        *last += odd;
                    }
                }
            } else {
                let correction = if offset == 0 { even } else { odd };
                x.iter_mut().zip(correction).for_each(|(x, c)| *x += c);
            }
        }
    }

    /// Coefficients of coarse plane `k` (up to and including the ghost plane above the last): the
    /// sum of those of the fine faces, divided by how much farther apart the centres are.
    pub(super) fn coarsen(&self, fine: &Stencil, factors: &[Vec<f32>; 3], k: usize, into: [&mut [f32]; 2]) {
        let [into0, into1] = into;
        let [n1, n2, n3] = self.coarse.cells;
        let width = self.coarse.width;
        let fine_cells = fine.board.cells;
        for j in 0..=n2 {
            for direction in 0..3 {
                if (j == n2 && direction != 1) || (k == n3 && direction != 2) {
                    continue;
                }
                // The fine faces that make a coarse one: one layer along its normal, all cells across it.
                let span = |d: usize, at: usize| {
                    let first = (at * self.ratio[d]).min(fine_cells[d]);
                    if d == direction { first..first + 1 } else { self.fine(d, at, fine_cells[d]) }
                };
                let (rows, planes) = (span(1, j), span(2, k));
                let last = if direction == 0 { n1 + 1 } else { n1 };
                for start in (0..last).step_by(RUN) {
                    let count = (last - start).min(RUN);
                    let mut sums = [0.0f32; RUN];
                    for plane in planes.clone() {
                        for row in rows.clone() {
                            self.add_coefficients(
                                fine,
                                direction,
                                (row as isize, plane as isize),
                                start,
                                &mut sums[..count],
                            );
                        }
                    }
                    for (n, sum) in sums[..count].iter_mut().enumerate() {
                        *sum *= factors[direction][[start + n, j, k][direction]];
                    }
                    for offset in 0..2 {
                        let n = (count + 1 - offset) / 2;
                        let colour = self.coarse.colour(offset, j as isize, k as isize);
                        let at = (3 * (j + 1) + direction) * width + 1 + start / 2;
                        let into = if colour == 0 { &mut into0[at..][..n] } else { &mut into1[at..][..n] };
                        into.iter_mut().zip(sums[offset..].iter().step_by(2)).for_each(|(into, sum)| *into = *sum);
                    }
                }
            }
        }
    }

    /// Adds the coefficients in `direction` of the fine row `(j, k)` that belong to the coarse cells
    /// from `start` on.
    fn add_coefficients(
        &self,
        fine: &Stencil,
        direction: usize,
        (j, k): (isize, isize),
        start: usize,
        sums: &mut [f32],
    ) {
        let board = &fine.board;
        let at = fine.face(direction, j, k);
        // One value beyond the last cell: the upper wall face.
        let length = board.width - 1;
        let [even, odd] = [0, 1].map(|o| fine.faces[board.colour(o, j, k)].run(at, length));
        if self.ratio[0] == 1 {
            for (n, sum) in sums.iter_mut().enumerate() {
                let i = start + n;
                *sum += if i & 1 == 0 { even[i / 2] } else { odd[i / 2] };
            }
        } else if direction == 0 {
            let cells = board.cells[0];
            for (n, (sum, even)) in sums.iter_mut().zip(&even[start..]).enumerate() {
                // The upper face of a last cell that stands alone.
                *sum += if 2 * (start + n) > cells { odd[cells / 2] } else { *even };
            }
        } else {
            for (sum, (even, odd)) in sums.iter_mut().zip(even[start..].iter().zip(&odd[start..])) {
                *sum += even + odd;
            }
        }
    }
}
