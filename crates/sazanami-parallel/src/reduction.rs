//! Sums and extremes over indices with bits that do not depend on the number of threads.

use std::ops::Range;
use std::panic::Location;

use crate::loops::{in_one_go, in_two};
use crate::work_and_span::in_loop;

/// Combines `part(index)` over all indices below `count` along a fixed binary tree.
///
/// `None` if `count` is zero.
#[track_caller]
pub fn reduce_over<T: Send>(
    count: usize,
    part: impl Fn(usize) -> T + Sync,
    combine: impl Fn(T, T) -> T + Sync,
) -> Option<T> {
    fn tree<T: Send>(
        range: Range<usize>,
        least: usize,
        part: &(impl Fn(usize) -> T + Sync),
        combine: &(impl Fn(T, T) -> T + Sync),
    ) -> T {
        if range.len() == 1 {
            return part(range.start);
        }
        let middle = range.start + range.len() / 2;
        let halves = [range.start..middle, middle..range.end];
        // Either way the same tree.
        let shared = range.len() > least;
        let [a, b] = halves.map(|half| move || tree(half, least, part, combine));
        let (a, b) = if shared { in_two(a, b) } else { (a(), b()) };
        combine(a, b)
    }
    let at = Location::caller();
    (count > 0).then(|| in_loop(at, || tree(0..count, in_one_go(count), &part, &combine)))
}

/// Sums `part(index)` over all indices below `count`, element by element.
#[track_caller]
pub fn sum_over<const N: usize>(count: usize, part: impl Fn(usize) -> [f64; N] + Sync) -> [f64; N] {
    reduce_over(count, part, |a, b| std::array::from_fn(|n| a[n] + b[n])).unwrap_or([0.0; N])
}

/// Largest `part(index)` over all indices below `count`; NaN if one is NaN, minus infinity if none.
#[track_caller]
pub fn max_over(count: usize, part: impl Fn(usize) -> f64 + Sync) -> f64 {
    reduce_over(count, part, |a, b| crate::Reduction::Max.combine(a, b)).unwrap_or(f64::NEG_INFINITY)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::with_threads;

    #[test]
    fn sums_have_the_same_bits_for_any_number_of_threads() {
        let sum = || sum_over(1000, |i| [1.0 / (i as f64 + 0.3), (i as f64).sin()]);
        let one = with_threads(1, sum).unwrap();
        assert!([2, 3, 4].iter().all(|&threads| with_threads(threads, sum).unwrap() == one));
        // Negative control: another order of the sum does change the bits.
        let other: f64 = (0..1000).map(|i| 1.0 / (f64::from(i) + 0.3)).sum();
        assert_ne!(other, one[0]);
    }

    #[test]
    fn a_not_a_number_is_not_lost() {
        assert!(max_over(9, |i| if i == 4 { f64::NAN } else { i as f64 }).is_nan());
    }
}
