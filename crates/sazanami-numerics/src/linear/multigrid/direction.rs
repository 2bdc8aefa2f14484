//! The passes of conjugate gradients over the finest level.

use std::ops::Range;

use sazanami_parallel::{Rows, for_each_chunk};

use super::borders::Borders;
use super::chequerboard::Colours;
use super::level::{BLACK, Frame, LAGS, Level, RED};
use super::measure::{add_sums, largest_of, sums_of};
use super::stencil::{RUN, Source};
use super::wavefront::{Part, Planes};
use super::{Equation, Multigrid};
use crate::Real;
use crate::domain::{Domain, Row};
use crate::grid::{Field, GHOSTS};

/// Direction and steps since the solution was last updated, on the finest level.
pub(crate) struct Direction {
    p: Colours,
    steps: Colours,
    borders: Borders,
}

/// A residual in double precision.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Residual {
    /// Largest magnitude.
    pub largest: Real,
    /// 2-norm.
    pub norm: Real,
    /// Mean of the solution it was evaluated from.
    pub mean: Real,
}

/// Factors that advance the direction and the steps: `p = z - mean + beta p`, then a step of `alpha p`.
#[derive(Clone, Copy, Debug)]
pub(crate) struct DirectionStep {
    pub beta: f32,
    pub mean: f32,
    pub alpha: f32,
    /// Whether there are steps to add to.
    pub keep: bool,
}

impl Direction {
    pub(crate) fn new(multigrid: &Multigrid, domain: &Domain) -> Self {
        let board = *multigrid.board();
        Self { p: board.zeros(), steps: board.zeros(), borders: Borders::new(board, domain) }
    }
}

impl Multigrid {
    /// Evaluates the residual of `p` and sets the finest right-hand side to it, times `scale` and
    /// (if the equation is singular) less its mean. With `previous`, that right-hand side of the
    /// iteration before moves along with what changes.
    pub(crate) fn evaluate(
        &mut self,
        domain: &Domain,
        equation: &impl Equation,
        p: &Field<Real>,
        scale: Real,
        previous: Option<&mut Colours>,
        sums: &mut [[f64; 4]],
    ) -> Residual {
        let level = self.finest();
        let Level { frame, b, .. } = level;
        let board = frame.stencil.board;
        let width = board.plane();
        let [b0, b1] = &mut *b;
        let moved = previous.is_some();
        let [p0, p1] = match previous {
            Some([p0, p1]) => [&mut p0[..], &mut p1[..]],
            None => [&mut [][..], &mut []],
        };
        let mut part =
            Part { arrays: [b0, b1, p0, p1].map(|a| Planes::with_ghosts(a, width, 1)), sums: Planes::one_each(sums) };
        let scale32 = scale as f32;
        for_planes(frame, &mut part, &|k, part: &mut Part<'_, 4>| {
            let mut sums = [0.0; 4];
            for_runs(frame, k, |row| {
                let mut values = [0.0; RUN];
                let values = &mut values[..row.len];
                equation.residual(row, p.data(), values);
                add_sums(&mut sums, values, &p.data()[row.shifted(0)]);
                let [b0, b1, p0, p1] = &mut part.arrays;
                for offset in 0..2 {
                    let colour = board.colour(offset, row.j, row.k);
                    let n = (row.len + 1 - offset) / 2;
                    let at = board.first(row.j, row.k) + row.first as usize / 2;
                    let (b, previous) = if colour == RED { (&mut *b0, &mut *p0) } else { (&mut *b1, &mut *p1) };
                    let b = b.run_mut(at, n);
                    let values = values[offset..].iter().step_by(2);
                    if moved {
                        let previous = previous.run_mut(at, n);
                        for ((b, previous), v) in b.iter_mut().zip(previous).zip(values) {
                            let value = *v as f32 * scale32;
                            *previous += value - *b;
                            *b = value;
                        }
                    } else {
                        b.iter_mut().zip(values).for_each(|(b, v)| *b = *v as f32 * scale32);
                    }
                }
            });
            part.sums.run_mut(k, 1)[0] = sums;
        });
        let [squares, sum, largest, total] = reduce(domain, sums);
        let mean = sum / domain.grid().len() as Real;
        if equation.is_singular() && mean.abs() > 1e-9 * largest {
            let mean = (mean * scale) as f32;
            for colour in b {
                for_each_chunk(&mut colour[..], width, |_, plane| plane.iter_mut().for_each(|b| *b -= mean));
            }
        }
        Residual { largest, norm: squares.sqrt(), mean: total / domain.grid().len() as Real }
    }

    /// Adds the steps, times `factor`, to `p`, and subtracts `offset`.
    pub(crate) fn add_steps(&self, steps: &Direction, factor: Real, offset: Real, p: &mut Field<Real>) {
        let board = *self.board();
        let [n1, n2, n3] = board.cells;
        let width = p.strides()[2];
        let data = &mut p.data_mut()[GHOSTS * width..][..n3 * width];
        for_each_chunk(Rows { data, width }, 1, |k, values| {
            for j in 0..n2 {
                let row = &mut values.data[(j + GHOSTS) * (n1 + 2 * GHOSTS) + GHOSTS..][..n1];
                let (j, k) = (j as isize, k as isize);
                let length = n1.div_ceil(2);
                let [even, odd] = [0, 1].map(|o| steps.steps[board.colour(o, j, k)].run(board.first(j, k), length));
                for (pair, (even, odd)) in row.chunks_mut(2).zip(even.iter().zip(odd)) {
                    pair[0] += f64::from(*even) * factor - offset;
                    if let Some(last) = pair.get_mut(1) {
                        *last += f64::from(*odd) * factor - offset;
                    }
                }
            }
        });
    }

    /// Forms the new direction, steps along it, and sets the finest right-hand side to the new
    /// residual; `previous` takes the old one. With `descend` the first half of a cycle follows in
    /// the same pass. Returns the new residual.
    pub(crate) fn advance(
        &mut self,
        domain: &Domain,
        direction: &mut Direction,
        previous: &mut Colours,
        step: DirectionStep,
        descend: bool,
        sums: &mut [[f64; 4]],
    ) -> Residual {
        let (level, next) = self.finest_and_next();
        std::mem::swap(previous, &mut level.b);
        let next = next.filter(|_| descend);
        let Level { frame, borders, x, b } = level;
        sums.fill([0.0; 4]);
        let mut none: Colours = Default::default();
        let (coarse, descending) = match next {
            Some(next) => (&mut next.b, 2 * frame.relaxations + 1),
            None => (&mut none, 0),
        };
        let mut lags = [0; LAGS.len()];
        lags[..2].copy_from_slice(&LAGS[..2]);
        lags[2..].copy_from_slice(&LAGS[1..LAGS.len() - 1]);
        for group in frame.groups(borders, &lags[..2 + descending], descending > 0) {
            let plane = frame.stencil.board.plane();
            let coarse = match &frame.transfer {
                Some(transfer) => transfer.planes(coarse),
                None => coarse.each_mut().map(|c| Planes::with_ghosts(c, plane, 1)),
            };
            let [x0, x1, b0, b1, c0, c1] = frame.arrays([&mut *x, &mut *b], coarse);
            let Direction { p, steps, borders: outer } = &mut *direction;
            let [p0, p1] = p.each_mut().map(|p| Planes::with_ghosts(p, plane, 1));
            let [s0, s1] = steps.each_mut().map(|s| Planes::with_ghosts(s, plane, 1));
            let mut part =
                Part { arrays: [x0, x1, b0, b1, c0, c1, p0, p1, s0, s1], sums: Planes::one_each(&mut *sums) };
            let first = group.stages.start;
            frame.pass(borders, group.lags()).run(&mut part, &|number, k, rows, part: &mut Part<'_, 10>| {
                let [x0, x1, b0, b1, c0, c1, p0, p1, s0, s1] = &mut part.arrays;
                match first + number {
                    0 => frame.new_direction(outer, step, (rows, k), [x0, x1], [p0, p1]),
                    1 => {
                        let sums = &mut part.sums.run_mut(k, 1)[0];
                        frame.take_step(step, (rows, k), [p0, p1], previous, [b0, b1], [s0, s1], sums);
                    }
                    number => {
                        let _ = (c0, c1);
                        frame.descend_stage(borders, number - 2, (rows, k), &mut part.arrays);
                    }
                }
            });
            if !borders.still() {
                if first == 0 {
                    direction.borders.outside(domain, &mut direction.p);
                } else if first > 1 {
                    borders.outside(domain, x);
                }
            }
        }
        let [squares, _, largest, _] = reduce(domain, sums);
        Residual { largest, norm: squares.sqrt(), mean: 0.0 }
    }
}

impl Frame {
    /// `p = z - mean + beta p`.
    #[inline]
    fn new_direction(
        &self,
        borders: &Borders,
        step: DirectionStep,
        (rows, k): (Range<usize>, usize),
        z: [&mut Planes<'_, f32>; 2],
        p: [&mut Planes<'_, f32>; 2],
    ) {
        let board = &self.stencil.board;
        let DirectionStep { beta, mean, .. } = step;
        for colour in [RED, BLACK] {
            for j in rows.clone().map(|j| j as isize) {
                let at = board.first(j, k as isize);
                let n = board.length(board.offset(colour, j, k as isize));
                let z = z[colour].run(at, n);
                let p = p[colour].run_mut(at, n);
                if beta == 0.0 {
                    p.iter_mut().zip(z).for_each(|(p, z)| *p = z - mean);
                } else {
                    p.iter_mut().zip(z).for_each(|(p, z)| *p = beta.mul_add(*p, z - mean));
                }
            }
        }
        let [p0, p1] = p;
        borders.inside([p0, p1], RED, (rows.clone(), k));
        borders.inside([p0, p1], BLACK, (rows, k));
    }

    /// Adds `alpha p` to the steps, subtracts `alpha A p` from the residual, and sums its squares and
    /// finds the largest.
    #[inline]
    #[expect(clippy::too_many_arguments, reason = "one pass touches all vectors of the method")]
    fn take_step(
        &self,
        step: DirectionStep,
        (rows, k): (Range<usize>, usize),
        p: [&mut Planes<'_, f32>; 2],
        previous: &Colours,
        b: [&mut Planes<'_, f32>; 2],
        steps: [&mut Planes<'_, f32>; 2],
        sums: &mut [f64; 4],
    ) {
        let board = &self.stencil.board;
        let k = k as isize;
        let [p0, p1] = p;
        let p = [&*p0, &*p1];
        for j in rows.map(|j| j as isize) {
            for colour in [RED, BLACK] {
                let length = board.length(board.offset(colour, j, k));
                for m0 in (0..length).step_by(RUN) {
                    let n = (length - m0).min(RUN);
                    let at = board.first(j, k) + m0;
                    let mut product = [0.0f32; RUN];
                    let product = &mut product[..n];
                    self.stencil.apply(colour, (j, k), m0, p, product);
                    let b = b[colour].run_mut(at, n);
                    for ((b, old), product) in b.iter_mut().zip(previous[colour].run(at, n)).zip(product) {
                        *b = (-step.alpha).mul_add(*product, *old);
                    }
                    let b = &*b;
                    let [squares] = sums_of(n, |m| [b[m] * b[m]]);
                    sums[0] += squares;
                    sums[2] = sazanami_parallel::Reduction::Max.combine(sums[2], largest_of(b));
                    let p = p[colour].run(at, n);
                    let steps = steps[colour].run_mut(at, n);
                    if step.keep {
                        steps.iter_mut().zip(p).for_each(|(s, p)| *s = step.alpha.mul_add(*p, *s));
                    } else {
                        steps.iter_mut().zip(p).for_each(|(s, p)| *s = step.alpha * p);
                    }
                }
            }
        }
    }
}

/// Runs `body` for all planes, in parallel.
fn for_planes<const N: usize>(frame: &Frame, part: &mut Part<'_, N>, body: &(impl Fn(usize, &mut Part<'_, N>) + Sync)) {
    let planes = frame.stencil.board.cells[2];
    let slabs = planes.min(sazanami_parallel::number_of_threads());
    let pass = super::wavefront::Pass { planes, rows: 1, tile: 1, slabs, lags: &[0] };
    pass.run(part, &|_, k, _, part: &mut Part<'_, N>| body(k, part));
}

/// Calls `body` for the rows of plane `k` of a field, cut into runs.
fn for_runs(frame: &Frame, k: usize, mut body: impl FnMut(Row)) {
    let [n1, n2, _] = frame.stencil.board.cells;
    for j in 0..n2 {
        for first in (0..n1).step_by(RUN) {
            let len = (n1 - first).min(RUN);
            let start = ((k + GHOSTS) * (n2 + 2 * GHOSTS) + j + GHOSTS) * (n1 + 2 * GHOSTS) + first + GHOSTS;
            body(Row { first: first as isize, j: j as isize, k: k as isize, start, len });
        }
    }
}

/// Adds up the sums of the planes (of the third of them: the largest), over all ranks.
fn reduce(domain: &Domain, sums: &[[f64; 4]]) -> [Real; 4] {
    let mut total = [0.0; 4];
    for plane in sums {
        for (n, (total, plane)) in total.iter_mut().zip(plane).enumerate() {
            *total = if n == 2 { sazanami_parallel::Reduction::Max.combine(*total, *plane) } else { *total + plane };
        }
    }
    let [a, b, c] = domain.sum([total[0], total[1], total[3]]);
    [a, b, domain.max(total[2]), c]
}
