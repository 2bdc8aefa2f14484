//! Collective operations, written once over messages between two ranks: the same bits, whatever carries them.

use std::sync::{Mutex, PoisonError};

use crate::communicator::{Communicator, Reduction, Sums};

/// Tags of messages that belong to collective operations; MPI guarantees tags up to 32,767.
const COLLECT: u32 = 32_000;
const TREE_UP: u32 = 32_001;
const TREE_DOWN: u32 = 32_002;

/// Bytes of the length before a block.
const LENGTH: usize = size_of::<u64>();

/// Messages between two ranks, as [`Communicator`] has them: those from one rank with one tag arrive in the order in which they were
/// sent. Tags are at most 32,767.
pub trait Transport: Send + Sync {
    /// Number of this rank, from 0.
    fn rank(&self) -> usize;
    /// Number of ranks.
    fn size(&self) -> usize;
    /// Sends a message, without waiting for its receiver; its bytes may change as soon as this returns.
    fn send(&self, to: usize, tag: u32, bytes: &[u8]);
    /// Waits for the next message from `from` with `tag`. `false` if a rank has failed meanwhile: `into` has no meaning then, and what
    /// carries the messages can name the failure.
    #[must_use]
    fn receive(&self, from: usize, tag: u32, into: &mut Vec<u8>) -> bool;
}

/// Marks the panic of a rank that ended because another one had failed.
pub(crate) struct FailedElsewhere;

/// Memory that collective operations keep.
#[derive(Default)]
struct Scratch {
    blocks: Vec<u8>,
    arrived: Vec<u8>,
    ends: Vec<usize>,
}

/// Ranks that exchange messages by `T`.
pub(crate) struct Ranks<T> {
    transport: T,
    sums: Sums,
    scratch: Mutex<Scratch>,
}

impl<T: Transport> Ranks<T> {
    pub fn new(transport: T, sums: Sums) -> Self {
        Self { transport, sums, scratch: Mutex::default() }
    }

    /// Gathers a block of bytes from each rank: block `b` of the outcome is that of rank `rank + b`, counted round the
    /// group, and ends at `ends[b]`.
    ///
    /// In round `k` each rank passes on what it has to the rank `2^k` before it (Bruck et al., IEEE Trans. Parallel
    /// Distrib. Syst. 8, 1997, 1143-1156): as many rounds as a tree has, for any number of ranks.
    fn collect(&self, mine: &[u8], scratch: &mut Scratch) {
        let (rank, size) = (self.rank(), self.size());
        let Scratch { blocks, arrived, ends } = scratch;
        blocks.clear();
        ends.clear();
        append(mine, blocks, ends);
        let mut distance = 1;
        while distance < size {
            let wanted = distance.min(size - distance);
            self.send((rank + size - distance) % size, COLLECT, &blocks[..ends[wanted - 1]]);
            self.receive((rank + distance) % size, COLLECT, arrived);
            let mut rest = &arrived[..];
            while let Some((length, tail)) = rest.split_first_chunk::<LENGTH>() {
                let (block, tail) = tail.split_at(u64::from_ne_bytes(*length) as usize);
                append(block, blocks, ends);
                rest = tail;
            }
            distance *= 2;
        }
    }

    /// Combines the values of all ranks along a binomial tree, and hands the outcome down along it.
    fn along_tree(&self, values: &mut [f64], reduction: Reduction, bytes: &mut Vec<u8>) {
        let (rank, size) = (self.rank(), self.size());
        let mut reach = 1;
        while reach < size && rank & reach == 0 {
            if rank + reach < size {
                self.receive(rank + reach, TREE_UP, bytes);
                values
                    .iter_mut()
                    .zip(reals(bytes))
                    .for_each(|(value, other)| *value = reduction.combine(*value, other));
            }
            reach *= 2;
        }
        bytes.clear();
        bytes.extend_from_slice(bytemuck::cast_slice(values));
        if rank > 0 {
            self.send(rank - reach, TREE_UP, bytes);
        }
        self.broadcast(bytes);
        values.iter_mut().zip(reals(bytes)).for_each(|(value, other)| *value = other);
    }
}

impl<T: Transport> Communicator for Ranks<T> {
    fn rank(&self) -> usize {
        self.transport.rank()
    }

    fn size(&self) -> usize {
        self.transport.size()
    }

    fn send(&self, to: usize, tag: u32, bytes: &[u8]) {
        self.transport.send(to, tag, bytes);
    }

    fn receive(&self, from: usize, tag: u32, into: &mut Vec<u8>) {
        if !self.transport.receive(from, tag, into) {
            // Without the words of a panic: the rank that failed says why.
            std::panic::resume_unwind(Box::new(FailedElsewhere));
        }
    }

    fn broadcast(&self, bytes: &mut Vec<u8>) {
        let (rank, size) = (self.rank(), self.size());
        // The distance to the rank above in a binomial tree; the ranks below are nearer.
        let mut reach = if rank == 0 { size.next_power_of_two() } else { 1 << rank.trailing_zeros() };
        if rank > 0 {
            self.receive(rank - reach, TREE_DOWN, bytes);
        }
        while reach > 1 {
            reach /= 2;
            if rank + reach < size {
                self.send(rank + reach, TREE_DOWN, bytes);
            }
        }
    }

    fn all_reduce(&self, values: &mut [f64], reduction: Reduction) {
        let mut scratch = self.scratch.lock().unwrap_or_else(PoisonError::into_inner);
        if self.sums == Sums::Tree {
            return self.along_tree(values, reduction, &mut scratch.arrived);
        }
        self.collect(bytemuck::cast_slice(values), &mut scratch);
        let (rank, size) = (self.rank(), self.size());
        let of = |from: usize| reals(block((from + size - rank) % size, &scratch));
        values.iter_mut().zip(of(0)).for_each(|(value, first)| *value = first);
        for from in 1..size {
            values.iter_mut().zip(of(from)).for_each(|(value, other)| *value = reduction.combine(*value, other));
        }
    }

    fn all_gather(&self, mine: &[u8], all: &mut Vec<Vec<u8>>) {
        let mut scratch = self.scratch.lock().unwrap_or_else(PoisonError::into_inner);
        self.collect(mine, &mut scratch);
        let (rank, size) = (self.rank(), self.size());
        all.resize(size, Vec::new());
        for (from, bytes) in all.iter_mut().enumerate() {
            bytes.clear();
            bytes.extend_from_slice(block((from + size - rank) % size, &scratch));
        }
    }
}

/// Adds a block, preceded by its length.
fn append(block: &[u8], blocks: &mut Vec<u8>, ends: &mut Vec<usize>) {
    blocks.extend_from_slice(&(block.len() as u64).to_ne_bytes());
    blocks.extend_from_slice(block);
    ends.push(blocks.len());
}

/// Block `number` of those collected.
fn block(number: usize, scratch: &Scratch) -> &[u8] {
    let start = if number == 0 { 0 } else { scratch.ends[number - 1] };
    &scratch.blocks[start + LENGTH..scratch.ends[number]]
}

/// Reads `f64` values from bytes of any alignment.
fn reals(bytes: &[u8]) -> impl Iterator<Item = f64> + '_ {
    bytes.chunks_exact(size_of::<f64>()).map(bytemuck::pod_read_unaligned)
}
