//! The history of a contact as it is sent and stored.

use sazanami_numerics::Real;

/// The history of a sphere contact between two grains, the lower identifier first, or between a
/// grain and a wall: as it is sent and stored.
#[derive(Clone, Copy, Debug, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
pub(crate) struct ContactRecord {
    pub low: u64,
    /// Identifier of the other grain, or [`crate::WALL`] plus the number of the wall.
    pub high: u64,
    /// Periodic image of the second grain relative to the first, both without wrapping.
    pub image: [i32; 3],
    pub a: u16,
    pub b: u16,
    /// Some of [`Self::DEEP`], [`Self::APART`], [`Self::BRIDGED`] and [`Self::NO_CONTACT`].
    pub marks: u64,
    pub d_t: [Real; 3],
    pub turn: [Real; 3],
}

impl ContactRecord {
    /// It has been counted as deeper than the warning limit.
    pub const DEEP: u64 = 1;
    /// The film alone acts.
    pub const APART: u64 = 2;
    /// A liquid bridge holds the grains.
    pub const BRIDGED: u64 = 4;
    /// The bridge alone: its spheres are no contact.
    pub const NO_CONTACT: u64 = 8;

    pub fn marks(deep: bool, apart: bool, bridged: bool) -> u64 {
        u64::from(deep) * Self::DEEP + u64::from(apart) * Self::APART + u64::from(bridged) * Self::BRIDGED
    }

    pub fn is(&self, mark: u64) -> bool {
        self.marks & mark != 0
    }

    pub fn key(&self) -> (u64, u64, [i32; 3], u16, u16) {
        (self.low, self.high, self.image, self.a, self.b)
    }
}
