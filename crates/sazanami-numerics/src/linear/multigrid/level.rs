//! One level of the multigrid: its right-hand side, its correction, and the two halves of a cycle.

use std::ops::Range;

use sazanami_parallel::{Rows, for_each_chunk, number_of_threads};

use super::borders::Borders;
use super::chequerboard::{Chequerboard, Colours};
use super::stencil::Stencil;
use super::transfer::Transfer;
use super::wavefront::{Part, Pass, Planes};
use crate::domain::Domain;

/// Lags of stages that follow each other without a gap.
pub(super) const LAGS: [usize; 16] = [0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15];
/// Lag of a stage that runs by itself: slabs may then not touch at a cut, and pairs of planes and
/// rows that make a coarse one stay together.
const ALONE: [usize; 1] = [2];
/// Fewest cells worth a thread of their own.
const LEAST: usize = 20_000;
/// Bytes of the planes in flight that should stay in the cache nearest to a core.
const CACHE: usize = 1_200_000;
/// Bytes of a cell that stay in use while the stages pass.
const PER_CELL: usize = 28;

/// The colour that is relaxed first on the way down and last on the way up.
pub(super) const RED: usize = 0;
/// The other colour.
pub(super) const BLACK: usize = 1;

/// Stages that one pass holds.
#[derive(Clone, Debug)]
pub(super) struct Group {
    /// Numbers of the stages.
    pub stages: Range<usize>,
    lags: [usize; LAGS.len()],
}

impl Group {
    /// `stages` of those that have `lags` in one pass.
    fn of(lags: &[usize], stages: Range<usize>, restricts: bool) -> Self {
        let mut own = [0; LAGS.len()];
        if stages.len() == 1 {
            own[0] = ALONE[0];
        } else {
            // The first of all uses its own plane only; what begins another group reads the planes beside it.
            let begin = usize::from(stages.start > 0);
            for (own, lag) in own.iter_mut().zip(&lags[stages.clone()]) {
                *own = lag - lags[stages.start] + begin;
            }
            if restricts && stages.end == lags.len() {
                // Pairs of planes and rows that make a coarse one stay together.
                let last = &mut own[stages.len() - 1];
                *last = last.next_multiple_of(2);
            }
        }
        Self { stages, lags: own }
    }

    /// Lag of each stage in planes and rows.
    pub(super) fn lags(&self) -> &[usize] {
        &self.lags[..self.stages.len()]
    }
}

/// The unchanging part of a level: operator, neighbours, link to the coarser level.
pub(super) struct Frame {
    pub domain: Domain,
    pub stencil: Stencil,
    pub transfer: Option<Transfer>,
    /// Per direction and coarse index: fine distance over coarse distance of the centres.
    pub factors: [Vec<f32>; 3],
    /// Colours whose residual is not zero after relaxing red, then black.
    pub residual_colours: &'static [usize],
    /// Relaxations of each colour before, and after, the coarse correction.
    pub relaxations: usize,
}

/// Grid of one level, with solution and right-hand side.
pub(super) struct Level {
    pub frame: Frame,
    pub borders: Borders,
    pub x: Colours,
    pub b: Colours,
}

impl Level {
    pub(super) fn new(domain: Domain, relaxations: usize) -> Self {
        let board = Chequerboard::new(domain.cells(), domain.start());
        let cells = domain.grid().cells;
        let seam = (0..3).any(|d| domain.periodic()[d] && cells[d] > 1 && cells[d] % 2 == 1);
        let borders = Borders::new(board, &domain);
        let frame = Frame {
            domain,
            stencil: Stencil::new(board),
            transfer: None,
            factors: Default::default(),
            residual_colours: if seam { &[RED, BLACK] } else { &[RED] },
            relaxations,
        };
        Self { frame, borders, x: board.zeros(), b: board.zeros() }
    }

    pub(super) fn board(&self) -> &Chequerboard {
        &self.frame.stencil.board
    }

    /// Sets the reciprocals of the diagonal from the coefficients.
    pub(super) fn invert_diagonal(&mut self) {
        let Stencil { board, .. } = self.frame.stencil;
        let mut inverse = std::mem::take(&mut self.frame.stencil.inverse);
        let [a, b] = &mut inverse;
        let width = board.plane();
        let stencil = &self.frame.stencil;
        for_each_chunk((Rows { data: a, width }, Rows { data: b, width }), 1, |number, (a, b)| {
            if (1..=board.cells[2]).contains(&number) {
                stencil.invert_diagonal(0, number as isize - 1, a.data);
                stencil.invert_diagonal(1, number as isize - 1, b.data);
            }
        });
        self.frame.stencil.inverse = inverse;
    }

    /// Sets the coefficients of `coarse` from those of this level.
    pub(super) fn coarsen(&self, coarse: &mut Self) {
        let Some(transfer) = &self.frame.transfer else { return };
        let width = 3 * coarse.board().plane();
        let planes = coarse.board().cells[2];
        let [a, b] = &mut coarse.frame.stencil.faces;
        for_each_chunk((Rows { data: a, width }, Rows { data: b, width }), 1, |number, (a, b)| {
            if (1..=planes + 1).contains(&number) {
                transfer.coarsen(&self.frame.stencil, &self.frame.factors, number - 1, [a.data, b.data]);
            }
        });
    }

    /// First half of a cycle: relaxes from zero and hands the residual to the coarse level.
    pub(super) fn descend(&mut self, coarse: &mut Colours) {
        let Self { frame, borders, x, b } = self;
        let Some(transfer) = frame.transfer else { return };
        for group in frame.groups(borders, &LAGS[..=2 * frame.relaxations], true) {
            let mut part = Part {
                arrays: frame.arrays([&mut *x, &mut *b], transfer.planes(coarse)),
                sums: Planes::one_each(&mut []),
            };
            let first = group.stages.start;
            frame.pass(borders, group.lags()).run(&mut part, &|number, plane, rows, part: &mut Part<'_, 6>| {
                frame.descend_stage(borders, first + number, (rows, plane), &mut part.arrays);
            });
            if !borders.still() {
                borders.outside(&frame.domain, x);
            }
        }
    }

    /// Second half of a cycle: adds the coarse correction and relaxes in mirrored order.
    ///
    /// With `previous` (an earlier right-hand side) the last stage also sums, per plane, `b x`,
    /// `previous x`, `x A x` and `x`.
    pub(super) fn ascend(&mut self, coarse: &Colours, measure: Option<(&Colours, &mut [[f64; 4]])>) {
        let Self { frame, borders, x, b } = self;
        let (previous, sums) = measure.map_or((None, &mut [][..]), |(previous, sums)| (Some(previous), sums));
        let count = 2 * frame.relaxations + 1;
        for group in frame.groups(borders, &LAGS[..count + usize::from(previous.is_some())], false) {
            let board = frame.stencil.board;
            let [x0, x1] = &mut *x;
            let mut part = Part {
                arrays: [x0, x1].map(|x| Planes::with_ghosts(x, board.plane(), 1)),
                sums: Planes::one_each(&mut *sums),
            };
            let first = group.stages.start;
            frame.pass(borders, group.lags()).run(&mut part, &|number, plane, rows, part: &mut Part<'_, 2>| {
                let number = first + number;
                if let (true, Some(previous)) = (number == count, previous) {
                    let sums = &mut part.sums.run_mut(plane, 1)[0];
                    frame.measure((rows, plane), [&part.arrays[0], &part.arrays[1]], b, previous, sums);
                } else {
                    frame.ascend_stage(borders, number, (rows, plane), coarse, b, &mut part.arrays);
                }
            });
            if !borders.still() {
                borders.outside(&frame.domain, x);
            }
        }
    }

    /// Sums, per plane, `b x`, `previous x`, `x A x` and `x`.
    pub(super) fn measure(&mut self, previous: &Colours, sums: &mut [[f64; 4]]) {
        let Self { frame, borders, x, b } = self;
        let [x0, x1] = &mut *x;
        let plane = frame.stencil.board.plane();
        let arrays = [x0, x1].map(|x| Planes::with_ghosts(x, plane, 1));
        let mut part = Part { arrays, sums: Planes::one_each(sums) };
        frame.pass(borders, &ALONE).run(&mut part, &|_, plane, rows, part: &mut Part<'_, 2>| {
            let sums = &mut part.sums.run_mut(plane, 1)[0];
            frame.measure((rows, plane), [&part.arrays[0], &part.arrays[1]], b, previous, sums);
        });
    }

    /// Brings all ghosts of `x` up to date.
    pub(super) fn fill_ghosts(&mut self) {
        let Self { frame, borders, x, .. } = self;
        let [n2, n3] = [frame.stencil.board.cells[1], frame.stencil.board.cells[2]];
        let plane = frame.stencil.board.plane();
        let [mut x0, mut x1] = x.each_mut().map(|x| Planes::with_ghosts(x, plane, 1));
        for k in 0..n3 {
            borders.inside([&mut x0, &mut x1], RED, (0..n2, k));
            borders.inside([&mut x0, &mut x1], BLACK, (0..n2, k));
        }
        borders.outside(&frame.domain, x);
    }

    /// Solves a level of a single cell.
    pub(super) fn solve_single(&mut self) {
        for colour in 0..2 {
            for at in 0..self.x[colour].len() {
                self.x[colour][at] = self.b[colour][at] * self.frame.stencil.inverse[colour][at];
            }
        }
    }
}

impl Transfer {
    /// The planes of a coarse array, to be cut together with those of the fine level.
    pub(super) fn planes<'a>(&self, coarse: &'a mut Colours) -> [Planes<'a, f32>; 2] {
        let [c0, c1] = coarse;
        [c0, c1].map(|c| Planes::with_ghosts(c, self.coarse.plane(), self.ratio[2]))
    }
}

impl Frame {
    /// Groups of stages that one pass holds: those of least cost, or one by one where ghosts change in between. `lags`
    /// are those of one pass that holds all; `restricts` says that the last stage makes planes of the coarser level.
    pub(super) fn groups(
        &self,
        borders: &Borders,
        lags: &[usize],
        restricts: bool,
    ) -> impl Iterator<Item = Group> + use<> {
        let count = lags.len();
        let mut table = [0; LAGS.len()];
        table[..count].copy_from_slice(lags);
        let groups = move |size: usize| {
            (0..count)
                .step_by(size)
                .map(move |first| Group::of(&table[..count], first..(first + size).min(count), restricts))
        };
        // A pass moves the level once through the caches, which takes about as long as the arithmetic of a stage.
        let cost = |size: &usize| -> f64 {
            let of = |group: Group| (1 + group.stages.len()) as f64 / self.slabs(group.lags()) as f64;
            groups(*size).map(of).sum()
        };
        let least = (1..=count).rev().min_by(|a, b| cost(a).total_cmp(&cost(b))).unwrap_or(1);
        groups(if borders.still() { least } else { 1 })
    }

    /// Slabs of planes that a pass is cut into, for threads; each is higher than the seam beside it.
    fn slabs(&self, lags: &[usize]) -> usize {
        let [n1, rows, planes] = self.stencil.board.cells;
        let deepest = lags.last().copied().unwrap_or(0);
        (n1 * rows * planes / LEAST).min(planes / (2 * deepest + 4)).clamp(1, number_of_threads())
    }

    pub(super) fn pass<'a>(&self, borders: &Borders, lags: &'a [usize]) -> Pass<'a> {
        let [n1, rows, planes] = self.stencil.board.cells;
        let deepest = lags.last().copied().unwrap_or(0);
        let tile = CACHE / (PER_CELL * n1 * (deepest + 2)) / 2 * 2;
        let tile = if borders.rows_wrap() { rows } else { tile.max(deepest + 8) / 2 * 2 };
        Pass { planes, rows, tile, slabs: self.slabs(lags), lags }
    }

    /// `[x, b, coarse]` as planes.
    pub(super) fn arrays<'a>(&self, own: [&'a mut Colours; 2], coarse: [Planes<'a, f32>; 2]) -> [Planes<'a, f32>; 6] {
        let plane = self.stencil.board.plane();
        let [[x0, x1], [b0, b1]] = own;
        let [x0, x1, b0, b1] = [x0, x1, b0, b1].map(|a| Planes::with_ghosts(a, plane, 1));
        let [c0, c1] = coarse;
        [x0, x1, b0, b1, c0, c1]
    }

    /// Stage of [`Level::descend`]: red from zero, black, red, black, .., residual.
    #[inline]
    pub(super) fn descend_stage(
        &self,
        borders: &Borders,
        number: usize,
        (rows, k): (Range<usize>, usize),
        arrays: &mut [Planes<'_, f32>],
    ) {
        let [x0, x1, b0, b1, c0, c1, ..] = arrays else { return };
        if number == 2 * self.relaxations {
            if let Some(transfer) = &self.transfer {
                transfer.restrict(&self.stencil, (rows, k), self.residual_colours, [x0, x1], [b0, b1], [c0, c1]);
            }
        } else if number == 0 {
            for j in rows.clone() {
                self.stencil.relax_from_zero(RED, (j as isize, k as isize), x0, b0);
            }
            borders.inside([&mut *x0, &mut *x1], RED, (rows.clone(), k));
            if self.residual_colours.len() == 2 {
                // Across a seam black meets black: what an earlier cycle left there must not take part.
                let board = &self.stencil.board;
                for j in rows.clone().map(|j| j as isize) {
                    let n = board.length(board.offset(BLACK, j, k as isize));
                    x1.run_mut(board.first(j, k as isize), n).fill(0.0);
                }
                borders.inside([x0, x1], BLACK, (rows, k));
            }
        } else {
            self.relax(borders, number % 2, (rows, k), [x0, x1], [b0, b1]);
        }
    }

    /// Stage of [`Level::ascend`]: correction of red, then black, red, black, red, ..
    #[inline]
    fn ascend_stage(
        &self,
        borders: &Borders,
        number: usize,
        (rows, k): (Range<usize>, usize),
        coarse: &Colours,
        b: &Colours,
        arrays: &mut [Planes<'_, f32>; 2],
    ) {
        let [x0, x1] = arrays;
        if number > 0 {
            self.relax(borders, number % 2, (rows, k), [x0, x1], [&b[0], &b[1]]);
        } else if let Some(transfer) = &self.transfer {
            for j in rows.clone() {
                transfer.correct(&self.stencil.board, RED, (j, k), coarse, x0);
            }
            borders.inside([x0, x1], RED, (rows.clone(), k));
            if self.residual_colours.len() == 2 {
                for j in rows.clone() {
                    transfer.correct(&self.stencil.board, BLACK, (j, k), coarse, x1);
                }
                borders.inside([x0, x1], BLACK, (rows, k));
            }
        }
    }

    #[inline]
    fn relax<S: super::stencil::Source>(
        &self,
        borders: &Borders,
        colour: usize,
        (rows, k): (Range<usize>, usize),
        x: [&mut Planes<'_, f32>; 2],
        b: [&S; 2],
    ) {
        let [x0, x1] = x;
        for j in rows.clone().map(|j| j as isize) {
            let (own, other) = if colour == 0 { (&mut *x0, &*x1) } else { (&mut *x1, &*x0) };
            self.stencil.relax(colour, (j, k as isize), own, other, b[colour]);
        }
        borders.inside([x0, x1], colour, (rows, k));
    }
}
