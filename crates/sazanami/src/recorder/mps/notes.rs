//! Notes as a flow begins: the frame in which things are written, and what is made of the motion of a tank.

use crate::case::meaning::{Case, Direction, TankMotion};
use crate::recorder::observer::of_frame;

/// Notes on a case.
pub(super) fn of(case: &Case) -> Vec<String> {
    let Some(motion) = case.frame.as_ref().and_then(|frame| frame.motion.as_ref()) else { return Vec::new() };
    let mut notes = Vec::from_iter(of_frame(case));
    if case.ripples.is_none() {
        return notes;
    }
    if let (TankMotion::File { .. }, Some(frequency)) = (motion, motion.frequency()) {
        notes.push(format!(
            "the record of the tank's motion counts as one of its strongest harmonic: cycles of {:.4} s",
            frequency.recip()
        ));
    }
    if is_across(motion) {
        notes.push(
            "warning: the tank is shaken along x2, but ripples, layers and figures are evaluated along x1 alone: turn the \
             tank so that it is shaken along x1"
                .to_owned(),
        );
    }
    notes
}

/// Whether a motion has a part along x2.
fn is_across(motion: &TankMotion) -> bool {
    match motion {
        TankMotion::Formula { amplitude, .. } => amplitude.y != 0.0,
        TankMotion::File { axis, .. } => *axis == Direction::X2,
    }
}
