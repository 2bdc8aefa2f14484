//! Particles of any kind (grains, fluid) as structure of arrays, this rank's own first and then ghosts: columns,
//! migration to new owners, ghosts, order in space, bins.

mod bins;
mod columns;
mod ghosts;
mod migrate;
mod order;

pub use bins::{BinIndex, Bins};
pub use columns::{ParticleColumns, Stored, take_column};
pub use ghosts::{GhostChoice, Ghosts};
pub use migrate::{Migration, RecordExchange};
pub use order::SpatialOrder;

/// Identifiers of walls and of their particles start here: `WALL + number`. Smaller ones are grains and fluid.
pub const WALL: u64 = 1 << 62;
