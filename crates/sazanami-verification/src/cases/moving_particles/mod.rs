//! The moving-particle solver beside what is known exactly or was measured.

mod flows;
mod fluid;
mod grains;

pub(crate) use flows::jets;
pub(crate) use fluid::operators;
pub(crate) use grains::void_fraction;

/// A failed experiment as the message of a failed case.
fn said(error: impl std::fmt::Display) -> String {
    error.to_string()
}
