//! For each of this rank's grains, the pairs that act in which it comes second, by the identifier of
//! the first: with them the sum over its partners has one order on every rank.

use super::block::Block;
use super::counters::Counters;
use crate::wrench::Wrench;

#[derive(Clone, Copy, Debug, Default)]
struct IncomingPair {
    block: u32,
    pair: u32,
    rank: u32,
}

/// Pairs that act by second grain; see the module.
#[derive(Clone, Debug, Default)]
pub(crate) struct Incoming {
    /// First place of each grain, and the number of places.
    starts: Vec<u32>,
    counts: Vec<u32>,
    entries: Vec<IncomingPair>,
    order: Vec<(u64, [i16; 3], u32, u32)>,
}

impl Incoming {
    /// Ranks the pairs of new blocks within their second grain, and enters those that act.
    pub fn rebuild(&mut self, blocks: &mut [Block], ids: &[u64], owned: usize) {
        self.starts.clear();
        self.starts.resize(owned + 1, 0);
        for pair in blocks.iter().flat_map(|b| &b.pairs) {
            if (pair.high as usize) < owned {
                self.starts[pair.high as usize + 1] += 1;
            }
        }
        for g in 0..owned {
            self.starts[g + 1] += self.starts[g];
        }
        let places = self.starts[owned] as usize;
        self.counts.clear();
        self.counts.resize(owned, 0);
        self.entries.clear();
        self.entries.resize(places, IncomingPair::default());
        // Rows of own grains come in the order of identifiers; those of other ranks' grains break it.
        self.order.clear();
        self.order.resize(places, (0, [0; 3], 0, 0));
        for (b, block) in blocks.iter().enumerate() {
            for (p, pair) in block.pairs.iter().enumerate() {
                let high = pair.high as usize;
                if high < owned {
                    let at = (self.starts[high] + self.counts[high]) as usize;
                    self.order[at] = (ids[pair.low as usize], pair.image, b as u32, p as u32);
                    self.counts[high] += 1;
                }
            }
        }
        for g in 0..owned {
            let row = &mut self.order[self.starts[g] as usize..self.starts[g + 1] as usize];
            if !row.is_sorted() {
                row.sort_unstable();
            }
            self.counts[g] = 0;
            for (rank, &(_, _, block, p)) in row.iter().enumerate() {
                let rank = rank as u32;
                let holder = &mut blocks[block as usize];
                holder.rank[p as usize] = rank;
                if holder.pairs[p as usize].acts() {
                    let at = self.starts[g] + self.counts[g];
                    self.entries[at as usize] = IncomingPair { block, pair: p, rank };
                    self.counts[g] += 1;
                }
            }
        }
    }

    /// Enters and removes the pairs that began or ceased to act, in the blocks whose counters report changes.
    pub fn follow(&mut self, blocks: &[Block], block_counters: &[Counters]) {
        for (b, (block, _)) in
            blocks.iter().zip(block_counters).enumerate().filter(|(_, (_, counters))| counters.changes > 0)
        {
            for &p in &block.changes {
                let pair = &block.pairs[p as usize];
                let g = pair.high as usize;
                let Some(count) = self.counts.get_mut(g) else { continue };
                let row = &mut self.entries[self.starts[g] as usize..self.starts[g + 1] as usize];
                let rank = block.rank[p as usize];
                let at = row[..*count as usize].partition_point(|e| e.rank < rank);
                if pair.acts() {
                    row.copy_within(at..*count as usize, at + 1);
                    row[at] = IncomingPair { block: b as u32, pair: p, rank };
                    *count += 1;
                } else {
                    row.copy_within(at + 1..*count as usize, at);
                    *count -= 1;
                }
            }
        }
    }

    /// Sum of the actions on own grain `g` of the pairs in which it is second, and whether any of them touches: where some act
    /// `apart` not all do.
    #[inline(always)]
    pub fn total(&self, blocks: &[Block], g: usize, apart: bool) -> (Wrench, bool) {
        let start = self.starts[g] as usize;
        let mut total = Wrench::default();
        for entry in &self.entries[start..start + self.counts[g] as usize] {
            total += blocks[entry.block as usize].on_high[entry.pair as usize];
        }
        (total, if apart { self.touching(blocks, g) > 0 } else { self.counts[g] > 0 })
    }

    /// Block and number in it of each such pair that acts, in order.
    pub fn visit(&self, g: usize, mut pair: impl FnMut(usize, usize)) {
        let start = self.starts[g] as usize;
        let entries = &self.entries[start..start + self.counts[g] as usize];
        entries.iter().for_each(|entry| pair(entry.block as usize, entry.pair as usize));
    }

    /// Number of such pairs that touch.
    pub fn touching(&self, blocks: &[Block], g: usize) -> usize {
        let start = self.starts[g] as usize;
        let entries = &self.entries[start..start + self.counts[g] as usize];
        entries.iter().filter(|entry| blocks[entry.block as usize].pairs[entry.pair as usize].meets()).count()
    }
}
