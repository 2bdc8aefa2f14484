//! Communication with other ranks.

/// How [`Communicator::all_reduce`] combines the values of the ranks, element by element.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Reduction {
    /// Sum in the order of the ranks.
    Sum,
    /// Largest value.
    Max,
    /// Smallest value.
    Min,
}

impl Reduction {
    /// Combines two values.
    #[must_use]
    pub fn combine(self, a: f64, b: f64) -> f64 {
        match self {
            Self::Sum => a + b,
            // `f64::max` drops NaN; a NaN met on one rank must be seen on all.
            Self::Max if a.is_nan() || a > b => a,
            Self::Min if a.is_nan() || a < b => a,
            Self::Max | Self::Min => b,
        }
    }
}

/// A group of ranks that run the same program on parts of one problem.
///
/// Messages between two ranks with the same tag arrive in the order they were sent. Every method
/// but `rank`, `size` and `send` may wait for other ranks.
pub trait Communicator: Send + Sync {
    /// Number of this rank, from 0.
    fn rank(&self) -> usize;

    /// Number of ranks.
    fn size(&self) -> usize;

    /// Sends `bytes` to rank `to` without waiting for it to receive. A rank may send to itself.
    fn send(&self, to: usize, tag: u32, bytes: &[u8]);

    /// Waits for the next message with `tag` from rank `from`; `into` then holds exactly its bytes.
    fn receive(&self, from: usize, tag: u32, into: &mut Vec<u8>);

    /// Replaces `values` on every rank by their combination over all ranks, taken in rank order:
    /// all ranks hold the same bits afterwards.
    fn all_reduce(&self, values: &mut [f64], reduction: Reduction);

    /// Gives every rank the bytes of every rank, indexed by rank.
    fn all_gather(&self, mine: &[u8], all: &mut Vec<Vec<u8>>);
}
