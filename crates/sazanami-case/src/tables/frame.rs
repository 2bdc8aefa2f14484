//! `[frame]`: motion of the box without rotation.

use std::f64::consts::TAU;

use sazanami_case_derive::Keys;
use sazanami_numerics::{Real, Vector, choices};

use super::motion::MotionKeys;
use super::{TankMotion, WallMotion, read_by};
use crate::read::Context;

/// An acceleration that oscillates, `amplitude sin(2 pi frequency t + phase)`.
#[derive(Clone, Copy, Debug, PartialEq, Keys)]
pub struct Oscillation {
    /// Amplitude.
    #[key(unit = "m/s^2")]
    pub amplitude: Vector,
    /// Frequency.
    #[key(unit = "Hz", range = Positive)]
    pub frequency: Real,
    /// Phase.
    #[key(unit = "rad", default = 0.0)]
    pub phase: Real,
}

impl Oscillation {
    /// Mean acceleration from one time to another \[s], at it if they are the same [m/s^2].
    #[must_use]
    pub fn mean(&self, [from, to]: [Real; 2]) -> Vector {
        let angle = |time: Real| TAU * self.frequency * time;
        let half = 0.5 * angle(to - from);
        let part = if half > 0.0 { half.sin() / half } else { 1.0 };
        self.amplitude * (part * (angle(0.5 * (from + to)) + self.phase).sin())
    }

    /// Amplitude of the displacement of what is accelerated so \[m].
    #[must_use]
    pub fn stroke(&self) -> Vector {
        self.amplitude / (TAU * self.frequency).powi(2)
    }
}

/// A box that moves.
#[derive(Clone, Debug, Keys)]
struct FrameKeys {
    /// Constant acceleration of the box; what it holds feels the opposite.
    #[key(unit = "m/s^2", default = Vector::ZERO, says = "none")]
    acceleration: Vector,
    /// Oscillating acceleration on top.
    #[key(table)]
    oscillation: Option<Oscillation>,
    /// Displacement on top, by formula or from a file.
    #[key(table)]
    motion: Option<MotionKeys>,
    /// What the box follows along gravity: with `liquid` it is accelerated so that the liquid stays in it without a mean velocity, as around a drop
    /// that falls. The fluid outside is at rest, and enters through inflow sides with its velocity as seen from the box, at the start that
    /// given for the side. The speed of the box is in the series (`box_velocity_3`).
    #[key(word, default = Follows::Nothing)]
    follows: Follows,
}

choices! {
    /// What a box follows.
    pub enum Follows {
        /// Nothing: it moves as it is told.
        Nothing = "nothing",
        /// The liquid in it.
        Liquid = "liquid",
    }
}

/// Motion of the frame of reference without rotation.
#[derive(Clone, Debug, PartialEq)]
pub struct Frame {
    /// Constant acceleration [m/s^2].
    pub acceleration: Vector,
    /// Oscillating acceleration, if there is one.
    pub oscillation: Option<Oscillation>,
    /// Displacement of the tank, if it has one.
    pub motion: Option<TankMotion>,
    /// Frame of reference of that motion.
    pub walls: WallMotion,
    /// What it follows along gravity.
    pub follows: Follows,
}

read_by!(Frame, FrameKeys);

impl FrameKeys {
    fn meaning(self, cx: &mut Context<'_>) -> Option<Frame> {
        let walls = self.motion.as_ref().map_or(WallMotion::AtRest, |motion| motion.walls);
        let motion = self.motion.and_then(|motion| motion.meaning(cx.known.run.until));
        let Self { acceleration, oscillation, follows, .. } = self;
        Some(Frame { acceleration, oscillation, motion, walls, follows })
    }

    fn of(frame: &Frame) -> Self {
        let motion = frame.motion.as_ref().map(|motion| MotionKeys::of(motion, frame.walls));
        Self { acceleration: frame.acceleration, oscillation: frame.oscillation, motion, follows: frame.follows }
    }
}

impl Frame {
    /// Mean acceleration of the frame from one time to another \[s], at it if they are the same [m/s^2].
    #[must_use]
    pub fn mean_acceleration(&self, over: [Real; 2]) -> Vector {
        let oscillating = self.oscillation.map_or(Vector::ZERO, |swing| swing.mean(over));
        let moved = match (&self.motion, self.walls) {
            (Some(motion), WallMotion::AtRest) => motion.mean_acceleration(over),
            _ => Vector::ZERO,
        };
        self.acceleration + oscillating + moved
    }
}
