//! Communication with other ranks.

/// Operation by which [`Communicator::all_reduce`] combines the values of the ranks, element by element.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Reduction {
    /// Sum, in the order that [`Sums`] names.
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

/// In which order values of the ranks are combined, which decides the last digits of a sum.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Sums {
    /// In the order of the ranks. Each rank gets the values of all: with `n` values on `p` ranks `8 n p` bytes arrive at
    /// each of them.
    #[default]
    Ordered,
    /// Along a binomial tree: `n` values a message, in twice as many rounds. For groups so large that the values of all
    /// take longer than the rounds.
    Tree,
}

impl Sums {
    /// The order with this word.
    #[must_use]
    pub fn of_word(word: &str) -> Option<Self> {
        [Self::Ordered, Self::Tree].into_iter().find(|sums| sums.word() == word)
    }

    /// The word of the command line and of the summary.
    #[must_use]
    pub const fn word(self) -> &'static str {
        match self {
            Self::Ordered => "ordered",
            Self::Tree => "tree",
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

    /// Gives every rank the bytes of rank 0.
    fn broadcast(&self, bytes: &mut Vec<u8>);

    /// Replaces `values` on every rank by their combination over all ranks: all ranks hold the same bits afterwards,
    /// whatever carries the messages.
    fn all_reduce(&self, values: &mut [f64], reduction: Reduction);

    /// Gives every rank the bytes of every rank, indexed by rank.
    fn all_gather(&self, mine: &[u8], all: &mut Vec<Vec<u8>>);
}
