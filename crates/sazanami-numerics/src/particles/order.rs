//! Order in space: particles sorted by their cell and, within a cell, by identifier.

use sazanami_parallel::for_each_chunk;

use super::columns::{MANY, ParticleColumns};

/// Cell, identifier and place of a particle.
type Key = (u32, u64, u32);

/// Sorts particles by cell; holds the storage.
#[derive(Clone, Debug, Default)]
pub struct SpatialOrder<C> {
    keys: Vec<Key>,
    sorted: Vec<Key>,
    starts: Vec<u32>,
    spare: C,
}

impl<C: ParticleColumns> SpatialOrder<C> {
    /// Puts the own particles into the order of their `cell` (below `cells`) and identifier, which `key` gives for a
    /// place. There are no ghosts.
    pub fn sort(&mut self, columns: &mut C, cells: usize, key: impl Fn(&C, usize) -> (u32, u64) + Sync) {
        let Self { keys, sorted, starts, spare } = self;
        keys.resize(columns.len(), (0, 0, 0));
        let of = &*columns;
        for_each_chunk(&mut keys[..], MANY, |number, keys| {
            for (n, entry) in keys.iter_mut().enumerate() {
                let at = number * MANY + n;
                let (cell, id) = key(of, at);
                *entry = (cell, id, at as u32);
            }
        });
        if !keys.is_sorted() {
            sort_by_cell(keys, sorted, starts, cells);
            let keys = &keys[..];
            spare.take_in_order(columns, |n| keys[n].2 as usize);
            std::mem::swap(columns, spare);
        }
        columns.own_all();
    }
}

/// Sorts keys whose first part is less than `cells`.
fn sort_by_cell(keys: &mut Vec<Key>, sorted: &mut Vec<Key>, starts: &mut Vec<u32>, cells: usize) {
    starts.clear();
    starts.resize(cells + 1, 0);
    keys.iter().for_each(|key| starts[key.0 as usize + 1] += 1);
    (1..=cells).for_each(|n| starts[n] += starts[n - 1]);
    sorted.resize(keys.len(), (0, 0, 0));
    for key in &*keys {
        let at = &mut starts[key.0 as usize];
        sorted[*at as usize] = *key;
        *at += 1;
    }
    // Each entry is where its cell ends now.
    let mut first = 0;
    for &end in &starts[..cells] {
        sorted[first..end as usize].sort_unstable();
        first = end as usize;
    }
    std::mem::swap(keys, sorted);
}
