//! Searches over grains by all threads, with results that do not depend on how many there are.

use sazanami_parallel::{for_each_chunk, reduce_over};

/// Grains that one thread searches in one go.
const CHUNK: usize = 512;

/// The first of `count` grains of which `test` is true.
pub(crate) fn first_where(count: usize, test: impl Fn(usize) -> bool + Sync) -> Option<usize> {
    let of_chunk = |n: usize| (n * CHUNK..count.min((n + 1) * CHUNK)).find(|&g| test(g));
    reduce_over(count.div_ceil(CHUNK), of_chunk, Option::or).flatten()
}

/// Findings in each chunk of grains, kept so that a search allocates nothing after the first.
#[derive(Debug)]
pub(crate) struct Selection<T> {
    chunks: Vec<Vec<T>>,
}

impl<T> Default for Selection<T> {
    fn default() -> Self {
        Self { chunks: Vec::new() }
    }
}

impl<T: Copy + Send> Selection<T> {
    /// Adds what `of` finds of each of `count` grains to `into`, in the order of the grains.
    pub fn collect(&mut self, count: usize, of: impl Fn(usize) -> Option<T> + Sync, into: &mut Vec<T>) {
        let chunks = count.div_ceil(CHUNK);
        if self.chunks.len() < chunks {
            self.chunks.resize_with(chunks, || Vec::with_capacity(CHUNK));
        }
        for_each_chunk(&mut self.chunks[..chunks], 1, |n, found| {
            found[0].clear();
            found[0].extend((n * CHUNK..count.min((n + 1) * CHUNK)).filter_map(&of));
        });
        self.chunks[..chunks].iter().for_each(|found| into.extend_from_slice(found));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn searches_find_what_a_loop_finds_in_its_order() {
        let of = |g: usize| (g % 7 == 3).then_some(g);
        let mut selection = Selection::default();
        for count in [0, 1, 511, 512, 5000, 700] {
            let mut found = Vec::new();
            selection.collect(count, of, &mut found);
            assert_eq!(found, (0..count).filter_map(of).collect::<Vec<_>>());
            assert_eq!(first_where(count, |g| g >= 600), (count > 600).then_some(600));
        }
    }
}
