//! Pairs of neighbouring grains and the contacts of their spheres.

use sazanami_numerics::{Real, Vector};

/// Overlap over the smaller contact sphere's radius above which a contact is counted as deep.
pub const DEEP_OVERLAP: Real = 0.2;

/// Two grains near each other.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Pair {
    /// The grain with the lower identifier.
    pub low: u32,
    pub high: u32,
    /// Factor on the dashpots.
    pub factor: Real,
    /// Periodic image of the second grain relative to the first.
    pub image: [i16; 3],
    /// Number of the contact law.
    pub law: u16,
    /// Whether it has contacts, those of a film among them.
    pub touching: bool,
    /// Whether the film alone acts between its spheres, which do not touch.
    pub apart: bool,
    /// Whether a liquid bridge holds it.
    pub bridged: bool,
    /// First of its contacts, if it touches.
    pub contacts: u32,
    /// Number of its contacts.
    pub count: u32,
    /// See [`give`].
    pub give: f32,
}

/// Leverage of a ball across the normal: 1 plus the square of its radius over that of gyration.
pub(crate) const ACROSS: Real = 3.5;

/// Half the reciprocal of the effective mass across the normal in a contact of balls with these reciprocal masses, 0 of
/// what forces do not move: by how much a tangential force changes their velocity within half a sub-step [1/kg]. Read
/// with [`crate::TangentialForce::FromTouch`].
pub(crate) fn give(inverse_masses: [Real; 2]) -> f32 {
    (0.5 * ACROSS * (inverse_masses[0] + inverse_masses[1])) as f32
}

impl Pair {
    /// Whether anything acts between its grains.
    #[inline(always)]
    pub fn acts(&self) -> bool {
        self.touching || self.bridged
    }

    /// Whether its grains touch.
    #[inline(always)]
    pub fn meets(&self) -> bool {
        self.touching && !self.apart
    }

    /// From the second grain's unwrapped position to its periodic image \[m].
    #[inline(always)]
    pub fn shift(&self, period: Vector) -> Vector {
        Vector::from_array(self.image.map(Real::from)) * period
    }
}

/// Two spheres that touch.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Contact {
    /// Pair of grains, within the block.
    pub pair: u32,
    pub a: u16,
    pub b: u16,
    pub deep: bool,
    /// Tangential displacement \[m].
    pub d_t: Vector,
    /// Relative turn that the rolling spring has taken up \[rad].
    pub turn: Vector,
}

impl Contact {
    pub fn key(&self) -> (u32, u16, u16) {
        (self.pair, self.a, self.b)
    }
}

/// Merges what was `found`, in order, into an ordered list; `merged` is work space.
pub(crate) fn insert_in_order<T: Copy, K: Ord>(
    list: &mut Vec<T>,
    found: &[T],
    merged: &mut Vec<T>,
    key: impl Fn(&T) -> K,
) {
    merged.clear();
    let mut new = found.iter().peekable();
    for old in &*list {
        while let Some(contact) = new.next_if(|new| key(new) < key(old)) {
            merged.push(*contact);
        }
        merged.push(*old);
    }
    merged.extend(new);
    std::mem::swap(list, merged);
}

/// Reserves memory for `room` entries in all.
pub(crate) fn reserve<T>(list: &mut Vec<T>, room: usize) {
    list.reserve(room.saturating_sub(list.len()));
}
