//! Where the coupling keeps its numbers among those that the engine attaches to each grain.

use sazanami_dem::ATTACHED;
use sazanami_numerics::{Real, Vector};

/// Place at the start of the step, without wrapping at periodic sides \[m].
pub(super) const PLACE: usize = 0;
/// Sum of the weights of the fluid particles at the start of the step.
pub(super) const SHARE: usize = 3;
/// Wet fraction.
pub(super) const WETNESS: usize = 4;
/// Force of the pressure of the step before, beyond the hydrostatic one, over the volume of the grain [Pa/m].
pub(super) const PRESSING: usize = 5;
/// Drag in the last step \[N]; while grains move the velocity of the fluid that they felt [m/s].
pub(super) const DRAG_FORCE: usize = 8;
pub(super) const FELT: usize = DRAG_FORCE;
/// Pressure force in the last step \[N].
pub(super) const PRESSURE_FORCE: usize = 11;
/// Void fraction, without the contribution of the grain itself.
pub(super) const VOID: usize = 14;
/// Lift on a grain in the last step \[N].
pub(super) const LIFT_FORCE: usize = 15;
/// Added mass with which the grain moves \[kg].
pub(super) const ADDED_MASS: usize = 18;
/// Force of the added mass on a grain in the last step \[N]; while grains move the two weights of particles, and the resistance to the
/// slip of each [kg].
pub(super) const ADDED_MASS_FORCE: usize = 19;
pub(super) const WEIGHTS: usize = ADDED_MASS_FORCE;
/// Impulse of the added mass on the grain whose reaction the fluid has not had yet [N s].
pub(super) const NOT_RETURNED: usize = 22;
/// Between steps the acceleration of the fluid at the grain by all but body force, pressure and added mass [m/s^2]; in a
/// step the velocity that the grain would have if it had moved with the fluid since its end before [m/s].
pub(super) const CARRIED: usize = 25;
/// Three numbers of the gust at the grain, and the number of its steps.
pub(super) const GUST: usize = 28;

/// Three of the values attached to a grain.
pub(super) fn vector(kept: &[Real; ATTACHED], at: usize) -> Vector {
    Vector::from_slice(&kept[at..at + 3])
}

/// Sets three of the values attached to a grain.
pub(super) fn set_vector(kept: &mut [Real; ATTACHED], at: usize, value: Vector) {
    kept[at..at + 3].copy_from_slice(&value.to_array());
}
