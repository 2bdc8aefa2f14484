//! Sums over rows: products in single precision in eight lanes, rows added up in double precision.

use std::ops::Range;

use sazanami_parallel::Reduction;

use super::chequerboard::Colours;
use super::level::{BLACK, Frame, RED};
use super::stencil::{RUN, Source};
use super::wavefront::Planes;

const LANES: usize = 8;

/// Sums of the values that `terms` gives for the places below `count`.
#[inline(always)]
pub(super) fn sums_of<const N: usize>(count: usize, terms: impl Fn(usize) -> [f32; N]) -> [f64; N] {
    let mut lanes = [[0.0f32; LANES]; N];
    let whole = count / LANES * LANES;
    for start in (0..whole).step_by(LANES) {
        for lane in 0..LANES {
            for (lanes, term) in lanes.iter_mut().zip(terms(start + lane)) {
                lanes[lane] += term;
            }
        }
    }
    for at in whole..count {
        for (lanes, term) in lanes.iter_mut().zip(terms(at)) {
            lanes[at - whole] += term;
        }
    }
    lanes.map(|lanes| lanes.iter().map(|&v| f64::from(v)).sum())
}

/// Largest magnitude of `values`; NaN if one is NaN.
#[inline(always)]
pub(super) fn largest_of(values: &[f32]) -> f64 {
    let mut lanes = [0.0f32; LANES];
    let mut faults = 0.0f32;
    let (chunks, rest) = values.as_chunks::<LANES>();
    for chunk in chunks {
        for (lane, v) in lanes.iter_mut().zip(chunk) {
            *lane = lane.max(v.abs());
            faults += v * 0.0;
        }
    }
    for (lane, v) in lanes.iter_mut().zip(rest) {
        *lane = lane.max(v.abs());
        faults += v * 0.0;
    }
    f64::from(lanes.into_iter().fold(faults, |a, b| if a.is_nan() { a } else { a.max(b) }))
}

/// Adds the squares of `values`, `values` and `solution` to `sums`, whose third is the largest
/// magnitude of `values` (NaN if one is NaN).
#[inline]
pub(super) fn add_sums(sums: &mut [f64; 4], values: &[f64], solution: &[f64]) {
    const LANES: usize = 4;
    let mut lanes = [[0.0f64; LANES]; 4];
    let mut add = |lane: usize, v: f64, p: f64| {
        lanes[0][lane] += v * v;
        lanes[1][lane] += v;
        lanes[2][lane] = lanes[2][lane].max(v.abs());
        lanes[3][lane] += p;
    };
    let (values, rest) = values.as_chunks::<LANES>();
    let (solution, rest_of_solution) = solution.as_chunks::<LANES>();
    for (v, p) in values.iter().zip(solution) {
        for lane in 0..LANES {
            add(lane, v[lane], p[lane]);
        }
    }
    for (lane, (v, p)) in rest.iter().zip(rest_of_solution).enumerate() {
        add(lane, *v, *p);
    }
    let [squares, sum, _, total] = lanes.map(|lanes| lanes.iter().sum::<f64>());
    sums[0] += squares;
    sums[1] += sum;
    sums[3] += total;
    // `max` drops NaN, the sum of squares keeps it.
    let largest =
        lanes[2].iter().fold(if squares.is_nan() { f64::NAN } else { 0.0 }, |a: f64, &b| Reduction::Max.combine(a, b));
    sums[2] = Reduction::Max.combine(sums[2], largest);
}

impl Frame {
    /// Adds `b x`, `previous x`, `x A x` and `x` over rows of plane `k` to `sums`.
    #[inline]
    pub(super) fn measure(
        &self,
        (rows, k): (Range<usize>, usize),
        x: [&Planes<'_, f32>; 2],
        b: &Colours,
        previous: &Colours,
        sums: &mut [f64; 4],
    ) {
        let board = &self.stencil.board;
        let k = k as isize;
        for j in rows.map(|j| j as isize) {
            for colour in [RED, BLACK] {
                let length = board.length(board.offset(colour, j, k));
                let at = board.first(j, k);
                for m0 in (0..length).step_by(RUN) {
                    let n = (length - m0).min(RUN);
                    let b = b[colour].run(at + m0, n);
                    let previous = previous[colour].run(at + m0, n);
                    let values = x[colour].run(at + m0, n);
                    let mut product = [0.0f32; RUN];
                    // Red was relaxed last: there `A x` is `b`.
                    let ax = if colour == BLACK || self.residual_colours.len() == 2 {
                        self.stencil.apply(colour, (j, k), m0, x, &mut product[..n]);
                        &product[..n]
                    } else {
                        b
                    };
                    let row = sums_of(n, |m| {
                        let v = values[m];
                        [v * b[m], v * previous[m], v * ax[m], v]
                    });
                    for (sum, row) in sums.iter_mut().zip(row) {
                        *sum += row;
                    }
                }
            }
        }
    }
}
