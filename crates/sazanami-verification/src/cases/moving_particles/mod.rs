//! The moving-particle solver beside what is known exactly or was measured.

mod conjugate;
mod fluid;
mod grains;
mod suspended;
mod waves;

pub(crate) use conjugate::{
    conjugate_bed, conjugate_dam_break, conjugate_drop, conjugate_isolated, conjugate_jets, conjugate_still,
    conjugate_wave,
};
pub(crate) use fluid::{
    dam_break, dam_break_lobovsky, falling_block, hydrostatics, operators, rotating_square, taylor_green,
};
pub(crate) use grains::{
    bed_load, bed_stress, frames, frames_with_bed, packed_bed, repose, resting_bed, settling_grain, void_fraction,
};
pub(crate) use suspended::{fluidised_bed, hindered_settling};
pub(crate) use waves::{sloshing, sloshing_resonance, standing_wave, standing_wave_shallow, stretching_drop};

use crate::particles::ExperimentError;

/// A failed experiment as the message of a failed case.
fn said(error: ExperimentError) -> String {
    error.to_string()
}
