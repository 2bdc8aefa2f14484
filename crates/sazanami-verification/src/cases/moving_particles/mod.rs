//! The moving-particle solver beside what is known exactly or was measured.

mod flows;
mod fluid;
mod grains;
mod published;
mod suspended;
mod waves;

pub(crate) use flows::{conservation, dam_break, hydrostatics, jets, standing_wave, stretching_drop, watered_bed};
pub(crate) use fluid::{dam_break_lobovsky, operators};
pub(crate) use grains::{
    bed_load, bed_stress, frames, frames_with_bed, packed_bed, repose, resting_bed, settling_grain, void_fraction,
};
pub(crate) use published::published;
pub(crate) use suspended::{fluidised_bed, hindered_settling};
pub(crate) use waves::sloshing;

use crate::particles::ExperimentError;

/// A failed experiment as the message of a failed case.
fn said(error: ExperimentError) -> String {
    error.to_string()
}
