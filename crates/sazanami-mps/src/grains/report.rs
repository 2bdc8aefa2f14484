//! Report of the coupling in a step.

use sazanami_numerics::{Real, Vector};

/// Report of the coupling in a step, over all ranks.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CouplingReport {
    /// Fluid particles whose void fraction was raised to the lower bound.
    pub limited_voids: usize,
    /// Smallest void fraction of a fluid particle before the lower bound was applied.
    pub least_void: Real,
    /// Impulse of the drag on the grains [N s].
    pub drag_on_grains: Vector,
    /// Impulse of the lift on the grains [N s].
    pub lift_on_grains: Vector,
    /// Impulse of the added mass on the grains [N s]; its reaction acts on the fluid in the next step.
    pub added_mass_on_grains: Vector,
    /// Impulse of the added mass on the grains in the step before, whose reaction acts on the fluid in this one [N s].
    pub added_mass_returned: Vector,
    /// Reaction of drag and lift, and of the added mass in the step before, on the fluid [N s].
    pub drag_on_fluid: Vector,
    /// Impulse of the pressure on the grains, buoyancy included [N s].
    pub pressure_on_grains: Vector,
    /// Wet grains with too few fluid particles around them for a vorticity: they feel no lift.
    pub without_vorticity: usize,
}

impl Default for CouplingReport {
    /// Of clear fluid.
    fn default() -> Self {
        Self {
            limited_voids: 0,
            least_void: 1.0,
            drag_on_grains: Vector::ZERO,
            lift_on_grains: Vector::ZERO,
            added_mass_on_grains: Vector::ZERO,
            added_mass_returned: Vector::ZERO,
            drag_on_fluid: Vector::ZERO,
            pressure_on_grains: Vector::ZERO,
            without_vorticity: 0,
        }
    }
}

/// Void fractions of the fluid particles of all ranks.
#[derive(Clone, Copy, Debug)]
pub(crate) struct VoidReport {
    /// Number at the lower bound.
    pub cut: usize,
    /// Smallest value before the lower bound is applied.
    pub least: Real,
}

impl Default for VoidReport {
    /// Clear fluid.
    fn default() -> Self {
        Self { cut: 0, least: 1.0 }
    }
}

impl CouplingReport {
    /// Takes over the void fractions of a step, at its start and at the predicted positions.
    pub(crate) fn set_voids(&mut self, [start, predicted]: [VoidReport; 2]) {
        self.limited_voids = start.cut.max(predicted.cut);
        self.least_void = start.least.min(predicted.least);
    }
}
