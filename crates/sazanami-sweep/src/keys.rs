//! Keys that vary, the values that they can have, and how these make points.

use std::ops::Range;

/// A value of a key at a point.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Setting {
    /// The value as TOML.
    pub value: String,
    /// Its place in the text of the plan.
    pub(crate) span: Range<usize>,
    /// Whether the plan has this very text there, or only the ends that it lies between.
    pub(crate) is_verbatim: bool,
}

impl Setting {
    /// The value for people: a text without its quotes.
    #[must_use]
    pub fn shown(&self) -> String {
        let inner = self.value.strip_prefix('"').and_then(|text| text.strip_suffix('"'));
        inner.filter(|text| !text.contains(['"', '\\'])).unwrap_or(&self.value).to_owned()
    }
}

/// Values that a key can have.
#[derive(Clone, Debug)]
pub(crate) enum Choices {
    /// One of these.
    Values(Vec<Setting>),
    /// A number between two ends.
    Between(Between),
}

/// Numbers between two ends.
#[derive(Clone, Debug)]
pub(crate) struct Between {
    pub ends: [f64; 2],
    pub unit: String,
    /// Points from end to end; the design of a plan may say it for all keys instead.
    pub count: Option<usize>,
    pub is_logarithmic: bool,
    /// Whether values are rounded to integers.
    pub is_integer: bool,
    /// Whether both ends are written as integers.
    pub has_integer_ends: bool,
    pub span: Range<usize>,
}

/// A key that varies.
#[derive(Clone, Debug)]
pub(crate) struct Key {
    pub path: String,
    pub span: Range<usize>,
    pub choices: Choices,
}

/// Design of experiments: points from the values of several keys.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Design {
    /// Each value of each key with each of the others.
    Product,
    /// The first values of all keys, then the second ones.
    Zip,
    /// Points of a Latin hypercube.
    LatinHypercube { count: usize, seed: u64 },
    /// Points of a Sobol sequence.
    Sobol { count: usize, seed: u64 },
    /// Trajectories on a grid of levels that change one key after the other (Morris 1991).
    Morris { trajectories: usize, levels: usize, seed: u64 },
}

impl Design {
    /// Points for so many keys, where the design says how many.
    pub const fn count(self, keys: usize) -> Option<usize> {
        match self {
            Self::LatinHypercube { count, .. } | Self::Sobol { count, .. } => Some(count),
            Self::Morris { trajectories, .. } => Some(trajectories.saturating_mul(keys + 1)),
            Self::Product | Self::Zip => None,
        }
    }
}

impl Choices {
    /// Values from end to end; 0 where only a design says how many.
    pub fn len(&self) -> usize {
        match self {
            Self::Values(list) => list.len(),
            Self::Between(between) => between.count.unwrap_or_default(),
        }
    }
}
