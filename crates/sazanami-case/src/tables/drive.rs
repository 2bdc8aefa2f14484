//! `[drive]`: what drives the flow through periodic sides.

use sazanami_case_derive::Keys;
use sazanami_numerics::mean_flow::ActsBy;
use sazanami_numerics::{Real, Vector};

use super::Oscillation;
use crate::read::{Context, Table};

/// Time in which the force answers to the mean velocity \[s].
const ANSWER: Real = 0.05;
/// Longest step over the time of the answer; the force swings from one on.
pub(crate) const LONGEST_STEP: Real = 0.25;
/// Rise of the flow, in times of the answer.
const RISE: Real = 5.0;

/// What drives the flow once the run begins, beside gravity and motion of the box: it does not act while a bed is packed and water
/// comes to rest. It acts on water and gas by their mass, on grains as `acts_by` says; on the grid with
/// `acts_by = "volume"` as a gradient of the pressure on all volumes alike, so that gas is driven as much harder as it is lighter.
#[derive(Clone, Copy, Debug, PartialEq, Keys)]
#[keys(check = Self::check)]
pub struct Drive {
    /// Body force per mass, the same all the time.
    #[key(unit = "m/s^2", default = Vector::ZERO, says = "none")]
    pub acceleration: Vector,
    /// Oscillating body force per mass on top, `amplitude sin(2 pi frequency t + phase)`: water that begins at rest swings by
    /// `amplitude/(2 pi frequency)^2` without a mean velocity at a phase of `90 deg`.
    #[key(table)]
    pub oscillation: Option<Oscillation>,
    /// Mean velocity of the water that a force holds along periodic directions: those in which it is not zero, and those along which
    /// gravity has a part. Zero in all three is held along every periodic direction: no net flow of all that is in the box, fluids and grains, as where
    /// these settle. On the grid with `acts_by = "volume"` any velocity is that of the net flow. The force is in the series
    /// (`driving_acceleration_1` and so on).
    #[key(unit = "m/s")]
    pub mean_velocity: Option<Vector>,
    /// What the force acts by: mass, as the gravity of a channel that slopes, or volume, as a gradient of the pressure from outside in a tunnel, under
    /// waves, in a box in which grains settle. On grains that is the volume of water that they displace. A gradient of the pressure goes on
    /// the grid through boxes without open sides only.
    #[key(word, default = if mean_velocity == Some(Vector::ZERO) { ActsBy::Volume } else { ActsBy::Mass }, says = "`mass`; `volume` with a mean velocity of zero")]
    pub acts_by: ActsBy,
    /// Height above which the mean of the velocity is taken (on the grid outside grains): over a bed its top.
    #[key(unit = "m", default = cx.known.domain.lower.z, says = "the floor of the box")]
    pub above: Real,
    /// Time in which that force answers to the mean velocity; four steps at least.
    #[key(unit = "s", range = Positive, default = ANSWER)]
    pub answer: Real,
    /// Rise of the mean velocity from rest, `3 s^2 - 2 s^3` with `s = t/ramp`; none suits water that begins with this velocity.
    #[key(unit = "s", range = NonNegative, default = RISE * answer, says = format!("{RISE} times `answer`"))]
    pub ramp: Real,
}

impl Drive {
    fn check(&mut self, table: &Table<'_>, cx: &mut Context<'_>) {
        if !["acceleration", "oscillation", "mean_velocity"].iter().any(|key| table.has(key)) {
            cx.missing(
                Some(table.span()),
                "mean_velocity",
                "add `mean_velocity = [\"0.3 m/s\", \"0 m/s\", \"0 m/s\"]`, `acceleration` or `oscillation`",
            );
        }
        if self.mean_velocity == Some(Vector::ZERO) && self.acts_by == ActsBy::Mass {
            cx.report
                .error(table.place("acts_by"), "a net flow of zero cannot be held by a force per mass")
                .label("it would balance the weight of grains and water alike, and nothing would settle")
                .help("leave out `acts_by`: the gradient of the pressure holds it");
        }
        let given = [
            ("above", self.above != cx.known.domain.lower.z),
            ("answer", self.answer != ANSWER),
            ("ramp", self.ramp != RISE * self.answer),
        ];
        if self.mean_velocity.is_none()
            && let Some((key, _)) = given.into_iter().find(|(key, differs)| *differs && table.has(key))
        {
            cx.report
                .warning(Some(table.place(key)), format!("`{key}` has no effect without `mean_velocity`"))
                .label("it is a parameter of `mean_velocity`")
                .help("add `mean_velocity`, or leave this out");
        }
    }

    /// Mean body force per mass from one time to another \[s] beside that which holds a mean velocity, at it if they are the same [m/s^2].
    #[must_use]
    pub fn mean_acceleration(&self, over: [Real; 2]) -> Vector {
        self.acceleration + self.oscillation.map_or(Vector::ZERO, |swing| swing.mean(over))
    }

    /// What of a body force that drives the flow acts on grains by their volume [m/s^2].
    #[must_use]
    pub fn by_volume(&self, force: Vector) -> Vector {
        if self.acts_by == ActsBy::Volume { force } else { Vector::ZERO }
    }
}
