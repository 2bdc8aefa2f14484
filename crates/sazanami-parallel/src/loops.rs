//! Loops over disjoint parts, spread over the threads of the pool of this rank.

use std::panic::Location;

use crate::work_and_span::{fork, in_loop, recorded_threads};

/// The operating system refused to start the threads.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ThreadsRefused {
    threads: usize,
    reason: String,
    /// The rank that was refused them, where processes are ranks.
    rank: Option<usize>,
}

impl ThreadsRefused {
    pub(crate) fn new(threads: usize, reason: &impl std::error::Error) -> Self {
        Self { threads, reason: reason.to_string(), rank: None }
    }

    pub(crate) fn on_rank(rank: usize, threads: usize, reason: String) -> Self {
        Self { threads, reason, rank: Some(rank) }
    }

    pub(crate) fn reason(&self) -> &str {
        &self.reason
    }
}

impl std::fmt::Display for ThreadsRefused {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "the operating system refused {} threads", self.threads)?;
        self.rank.map_or(Ok(()), |rank| write!(f, " to rank {rank}"))?;
        write!(f, ": {}", self.reason)
    }
}

impl std::error::Error for ThreadsRefused {}

/// Runs `work` in a pool of its own with `threads` threads (0: as many as the machine offers).
///
/// # Errors
/// [`ThreadsRefused`], before `work` begins.
pub fn with_threads<T: Send>(threads: usize, work: impl FnOnce() -> T + Send) -> Result<T, ThreadsRefused> {
    Ok(pool_of(threads)?.install(work))
}

/// A pool of so many threads.
pub(crate) fn pool_of(threads: usize) -> Result<rayon::ThreadPool, ThreadsRefused> {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
    pool.map_err(|reason| ThreadsRefused::new(threads, &reason))
}

/// Number of threads of the current pool, or that loops are recorded for.
#[must_use]
pub fn number_of_threads() -> usize {
    recorded_threads().unwrap_or_else(rayon::current_num_threads)
}

/// Runs two pieces of work, at the same time if a thread is free.
#[track_caller]
pub fn join<A: Send, B: Send>(a: impl FnOnce() -> A + Send, b: impl FnOnce() -> B + Send) -> (A, B) {
    in_loop(Location::caller(), || in_two(a, b))
}

/// Runs two parts of a loop.
pub(crate) fn in_two<A: Send, B: Send>(a: impl FnOnce() -> A + Send, b: impl FnOnce() -> B + Send) -> (A, B) {
    if recorded_threads().is_some() { fork(a, b) } else { rayon::join(a, b) }
}

/// Pieces that a loop is cut into for each thread: enough to even out their costs.
const PIECES: usize = 32;

/// Number of consecutive parts, of `count`, that one task of a loop does: handing a part to another thread has a cost.
pub(crate) fn in_one_go(count: usize) -> usize {
    match number_of_threads() {
        1 => count,
        threads => count / (PIECES * threads),
    }
    .max(1)
}

/// One or several mutable slices of equal length that are cut together.
pub trait SlicesMut: Sized + Send {
    /// Common length.
    fn length(&self) -> usize;
    /// Cuts all slices at `middle`.
    fn cut(self, middle: usize) -> (Self, Self);
}

impl<T: Send> SlicesMut for &mut [T] {
    fn length(&self) -> usize {
        self.len()
    }

    fn cut(self, middle: usize) -> (Self, Self) {
        self.split_at_mut(middle)
    }
}

/// A mutable slice seen as rows of `width` elements: its length is its number of rows.
pub struct Rows<'a, T> {
    /// All elements, row by row.
    pub data: &'a mut [T],
    /// Elements in a row.
    pub width: usize,
}

impl<T: Send> SlicesMut for Rows<'_, T> {
    fn length(&self) -> usize {
        self.data.len() / self.width
    }

    fn cut(self, middle: usize) -> (Self, Self) {
        let (a, b) = self.data.split_at_mut(middle * self.width);
        (Self { data: a, width: self.width }, Self { data: b, width: self.width })
    }
}

impl<S: SlicesMut, const N: usize> SlicesMut for [S; N] {
    fn length(&self) -> usize {
        self.first().map_or(0, S::length)
    }

    fn cut(self, middle: usize) -> (Self, Self) {
        let mut behind = self.map(Some);
        let before = std::array::from_fn(|n| {
            let slices = behind[n].take().expect("each is cut once");
            let (before, rest) = slices.cut(middle);
            behind[n] = Some(rest);
            before
        });
        (before, behind.map(|slices| slices.expect("each has a rest")))
    }
}

macro_rules! slices_mut_for_tuple {
    ($($name:ident . $index:tt),+) => {
        impl<$($name: SlicesMut),+> SlicesMut for ($($name,)+) {
            fn length(&self) -> usize {
                let length = self.0.length();
                $(debug_assert_eq!(self.$index.length(), length);)+
                length
            }

            fn cut(self, middle: usize) -> (Self, Self) {
                let halves = ($(self.$index.cut(middle),)+);
                (($(halves.$index.0,)+), ($(halves.$index.1,)+))
            }
        }
    };
}
slices_mut_for_tuple!(A.0);
slices_mut_for_tuple!(A.0, B.1);
slices_mut_for_tuple!(A.0, B.1, C.2);
slices_mut_for_tuple!(A.0, B.1, C.2, D.3);
slices_mut_for_tuple!(A.0, B.1, C.2, D.3, E.4);
slices_mut_for_tuple!(A.0, B.1, C.2, D.3, E.4, F.5);
slices_mut_for_tuple!(A.0, B.1, C.2, D.3, E.4, F.5, G.6);
slices_mut_for_tuple!(A.0, B.1, C.2, D.3, E.4, F.5, G.6, H.7);

/// Cuts `slices` into chunks of `chunk` elements (the last may be shorter) and calls
/// `body(number of the chunk, chunk)` for each, in parallel.
#[track_caller]
pub fn for_each_chunk<S: SlicesMut>(slices: S, chunk: usize, body: impl Fn(usize, S) + Sync) {
    /// Number of elements in a chunk, and of chunks in one go.
    #[derive(Clone, Copy)]
    struct Sizes {
        chunk: usize,
        least: usize,
    }

    fn split<S: SlicesMut>(mut slices: S, first: usize, sizes: Sizes, body: &(impl Fn(usize, S) + Sync)) {
        let Sizes { chunk, least } = sizes;
        let chunks = slices.length().div_ceil(chunk);
        if chunks > least {
            let middle = chunks / 2;
            let (a, b) = slices.cut(middle * chunk);
            in_two(|| split(a, first, sizes, body), || split(b, first + middle, sizes, body));
            return;
        }
        for number in first..first + chunks {
            let end = chunk.min(slices.length());
            let (now, later) = slices.cut(end);
            body(number, now);
            slices = later;
        }
    }
    let chunk = chunk.max(1);
    let least = in_one_go(slices.length().div_ceil(chunk));
    in_loop(Location::caller(), || split(slices, 0, Sizes { chunk, least }, &body));
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_chunk_is_visited_once_with_its_number() {
        for threads in [1, 2, 4] {
            let mut a: Vec<usize> = vec![0; 103];
            let mut b: Vec<f64> = vec![0.0; 206];
            with_threads(threads, || {
                for_each_chunk((&mut a[..], Rows { data: &mut b, width: 2 }), 10, |number, (a, b)| {
                    for (offset, (a, b)) in a.iter_mut().zip(b.data.chunks_mut(2)).enumerate() {
                        *a += number * 10 + offset;
                        b[1] += *a as f64;
                    }
                });
            })
            .unwrap();
            assert!(a.iter().enumerate().all(|(i, &v)| v == i));
            assert!(b.chunks(2).enumerate().all(|(i, v)| v == [0.0, i as f64]));
        }
    }
}
