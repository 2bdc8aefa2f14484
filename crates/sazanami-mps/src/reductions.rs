//! Loops, sums and maxima over the particles or grains of a rank, in blocks: the same bits for any number of threads.

use sazanami_numerics::Real;
use sazanami_parallel::{for_each_chunk, max_over, sum_over};

use crate::neighbours::ROWS;

/// Makes `column` the values of the first `count`.
pub(crate) fn set_column<T: Clone + Default + Send>(
    column: &mut Vec<T>,
    count: usize,
    value: impl Fn(usize) -> T + Sync,
) {
    column.resize(count, T::default());
    for_each_entry(column, |n, entry| *entry = value(n));
}

/// Calls `body` with the number of each entry of a column and the entry.
pub(crate) fn for_each_entry<T: Send>(column: &mut [T], body: impl Fn(usize, &mut T) + Sync) {
    for_each_chunk(column, ROWS, |number, column| {
        column.iter_mut().enumerate().for_each(|(row, entry)| body(number * ROWS + row, entry));
    });
}

/// Maximum of `value` over the first `count`; minus infinity if there are none.
pub(crate) fn largest(count: usize, value: impl Fn(usize) -> Real + Sync) -> Real {
    let part = |n: usize| (n * ROWS..((n + 1) * ROWS).min(count)).map(&value).fold(Real::NEG_INFINITY, Real::max);
    max_over(count.div_ceil(ROWS), part)
}

/// Sum of `part` over the first `count`, along a fixed tree.
pub(crate) fn sum_of<const N: usize>(count: usize, part: impl Fn(usize) -> [Real; N] + Sync) -> [Real; N] {
    sum_over(count.div_ceil(ROWS), |n| {
        (n * ROWS..((n + 1) * ROWS).min(count)).fold([0.0; N], |mut total, a| {
            total.iter_mut().zip(part(a)).for_each(|(total, part)| *total += part);
            total
        })
    })
}
