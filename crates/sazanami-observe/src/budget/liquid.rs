//! Budget of the liquid volume on a grid.

use sazanami_numerics::Real;
use sazanami_numerics::snapshot::{Snapshot, SnapshotError};

/// Liquid volume at one time, and its sources since the start [m^3].
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct LiquidVolume {
    /// `sum C dV`, liquid inside grains included: conserved by the transport.
    pub transported: Real,
    /// `sum (1 - alpha) C dV`: liquid outside grains.
    pub wet: Real,
    /// Inflow through open sides since the start.
    pub through_open_sides: Real,
    /// Removed (negative: added) by clipping to the range 0 to 1, since the start.
    pub clipped: Real,
}

/// Liquid budget of a whole run.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LiquidBudget {
    initial: LiquidVolume,
    now: LiquidVolume,
}

/// Change over scale; none where the scale is not positive.
fn share(change: Real, scale: Real) -> Option<Real> {
    (scale > 0.0).then(|| change / scale)
}

impl LiquidBudget {
    /// Starts with the volumes at the beginning of the run.
    #[must_use]
    pub fn new(initial: LiquidVolume) -> Self {
        Self { initial, now: initial }
    }

    /// Sets the volumes now.
    pub fn set(&mut self, now: LiquidVolume) {
        self.now = now;
    }

    /// Change of the transported volume that open sides do not explain, relative to the volume at the
    /// start (or the inflow, if that is more); clipping is included. None where there has been no liquid.
    #[must_use]
    pub fn relative_change(&self) -> Option<Real> {
        let inflow = self.now.through_open_sides - self.initial.through_open_sides;
        let change = self.now.transported - self.initial.transported - inflow;
        share(change, self.initial.transported.max(inflow))
    }

    /// Relative change of the liquid volume outside grains.
    #[must_use]
    pub fn wet_relative_change(&self) -> Option<Real> {
        let inflow = self.now.through_open_sides - self.initial.through_open_sides;
        share(self.now.wet - self.initial.wet - inflow, self.initial.wet.max(inflow))
    }

    /// Writes the state into a snapshot.
    pub fn save(&self, snapshot: &mut Snapshot) {
        let volumes = [self.initial, self.now].map(|v| [v.transported, v.wet, v.through_open_sides, v.clipped]);
        snapshot.put_reals("liquid_budget", volumes.concat());
    }

    /// Reads the state from a snapshot.
    ///
    /// # Errors
    /// [`SnapshotError`] if it is not there or of another length.
    pub fn restore(snapshot: &Snapshot) -> Result<Self, SnapshotError> {
        let v = snapshot.reals_of("liquid_budget", 8)?;
        let volume = |at: usize| LiquidVolume {
            transported: v[at],
            wet: v[at + 1],
            through_open_sides: v[at + 2],
            clipped: v[at + 3],
        };
        Ok(Self { initial: volume(0), now: volume(4) })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_state_survives_a_snapshot() {
        let liquid = LiquidBudget {
            initial: LiquidVolume { transported: 2.0, wet: 1.9, through_open_sides: 0.0, clipped: 0.0 },
            now: LiquidVolume { transported: 2.5, wet: 2.1, through_open_sides: 0.5, clipped: 1e-12 },
        };
        let mut snapshot = Snapshot::default();
        liquid.save(&mut snapshot);
        assert_eq!(LiquidBudget::restore(&snapshot).unwrap(), liquid);
        assert!(LiquidBudget::restore(&Snapshot::default()).is_err());
    }

    #[test]
    fn inflow_is_not_a_loss_of_liquid() {
        let mut budget = LiquidBudget::new(LiquidVolume { transported: 2.0, wet: 2.0, ..Default::default() });
        budget.set(LiquidVolume { transported: 3.0, wet: 2.9, through_open_sides: 1.0, clipped: 0.0 });
        assert_eq!(budget.relative_change(), Some(0.0));
        assert!((budget.wet_relative_change().unwrap() + 0.05).abs() < 1e-15);
        // Where there is no liquid nothing is kept.
        let dry = LiquidBudget::new(LiquidVolume::default());
        assert_eq!((dry.relative_change(), dry.wet_relative_change()), (None, None));
    }
}
