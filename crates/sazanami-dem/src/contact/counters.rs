//! Counters of contacts.

use sazanami_numerics::{Real, Vector};

/// Counters of the contacts of one or more blocks in a sub-step.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Counters {
    pub pairs: usize,
    pub contacts: usize,
    /// Pairs that began or ceased to act.
    pub changes: usize,
    /// Rows of pairs whose skins were checked.
    pub checked_rows: usize,
    /// Contacts that passed the warning limit in this sub-step.
    pub deepened: usize,
    /// Largest overlap over the smaller radius, with the identifiers and a position.
    pub deepest: Real,
    pub deepest_ids: [u64; 2],
    pub deepest_at: Vector,
    /// Liquid bridges, and those that broke in this sub-step.
    pub bridges: usize,
    pub ruptures: usize,
    /// Volume of the bridges, each as far as its grains are moist [m^3].
    pub bridge_volume: Real,
    /// Force on the walls \[N].
    pub on_walls: Vector,
    /// Power of moving walls \[W].
    pub by_walls: Real,
}

impl Counters {
    pub fn merged(self, other: Self) -> Self {
        let deeper = if other.deepest > self.deepest { &other } else { &self };
        Self {
            pairs: self.pairs + other.pairs,
            contacts: self.contacts + other.contacts,
            changes: self.changes + other.changes,
            checked_rows: self.checked_rows + other.checked_rows,
            deepened: self.deepened + other.deepened,
            deepest: deeper.deepest,
            deepest_ids: deeper.deepest_ids,
            deepest_at: deeper.deepest_at,
            bridges: self.bridges + other.bridges,
            ruptures: self.ruptures + other.ruptures,
            bridge_volume: self.bridge_volume + other.bridge_volume,
            on_walls: self.on_walls + other.on_walls,
            by_walls: self.by_walls + other.by_walls,
        }
    }
}
