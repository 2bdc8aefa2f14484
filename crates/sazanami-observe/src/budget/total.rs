//! Sums that are exact to the last digit.

use sazanami_numerics::snapshot::{Snapshot, SnapshotError};
use sazanami_numerics::{Real, Vector};

/// Compensated sum (Neumaier): millions of small impulses add up to the last digit.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Total {
    /// Sum without the round-off.
    pub sum: Vector,
    /// Round-off.
    pub rest: Vector,
}

impl Total {
    pub fn add(&mut self, value: Vector) {
        let sum = self.sum + value;
        for d in 0..3 {
            let (old, new) = (self.sum[d], value[d]);
            self.rest[d] += if old.abs() >= new.abs() { (old - sum[d]) + new } else { (new - sum[d]) + old };
        }
        self.sum = sum;
    }

    pub fn value(&self) -> Vector {
        self.sum + self.rest
    }
}

/// A known number of vectors from a snapshot.
pub(super) fn vectors_of(snapshot: &Snapshot, name: &str, count: usize) -> Result<Vec<Vector>, SnapshotError> {
    snapshot.reals_of(name, 3 * count)?;
    snapshot.vectors(name)
}

/// Change over scale, or 0 where the scale is not positive.
pub(super) fn relative(change: Real, scale: Real) -> Real {
    if scale > 0.0 { change / scale } else { 0.0 }
}
