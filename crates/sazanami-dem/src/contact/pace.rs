//! Classes of the speed of grains, so that rows of pairs of slow grains are skipped for long beside a fast flier.

use sazanami_numerics::Real;

/// Number of classes.
pub(crate) const PACES: usize = 4;
/// Way within the horizon of the skin, over the bounding radius, from which a grain is of the second class.
const SECOND: Real = 1e-4;
/// Ratio of the limits of the classes.
const RATIO: Real = 10.0;

/// Class of speed of a grain when the lists were built, from the slowest, 0.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) struct Pace(u8);

impl Pace {
    pub const SLOWEST: Self = Self(0);
    pub const FASTEST: Self = Self(PACES as u8 - 1);

    /// The class of a grain that goes `way` \[m] within the horizon of its skin, of bounding radius `size` \[m].
    pub fn new(way: Real, size: Real) -> Self {
        let limits = std::iter::successors(Some(SECOND * size), |limit| Some(RATIO * limit));
        Self(limits.take(PACES - 1).filter(|limit| way >= *limit).count() as u8)
    }

    #[inline(always)]
    pub fn index(self) -> usize {
        usize::from(self.0)
    }
}
