//! Whether a mean velocity that is held is there.

use sazanami_numerics::mean_flow::{MeanFlowReport, MeanFlowSettings};
use sazanami_numerics::{Real, Vector};

use crate::case::meaning::Case;
use crate::water::StepProblem;

/// Share of the wanted velocity that may be missing, and for how many times the force's answer, once the velocity has risen.
const MISSING: Real = 0.5;
const ANSWERS: Real = 16.0;

/// Watches over a mean velocity that is held. Against drag of a rate `k` half of it comes in `T (1 + ln(k T/2))` with the time `T` of the
/// answer (`mean_flow`): sixteen of them are enough for all that flows. What still misses it then cannot be had, and the force would grow
/// until it destroys the run. The time for which it is missed runs back while it is there, as in slow waves, and begins anew with a restart.
pub(super) struct HeldFlow {
    settings: Option<MeanFlowSettings>,
    /// Time for which it has been missed \[s].
    missed: Real,
}

impl HeldFlow {
    /// Nothing is watched where none is held, or a velocity of zero, which has no measure.
    pub fn of(case: &Case) -> Self {
        let settings = case.mean_flow().filter(|flow| flow.velocity.length() > 0.0);
        Self { settings, missed: 0.0 }
    }

    /// Looks at the flow after a step of `dt` \[s].
    ///
    /// # Errors
    /// A velocity that has been missed for too long.
    pub fn watch(&mut self, dt: Real, report: Option<&MeanFlowReport>) -> Result<(), StepProblem> {
        let (Some(flow), Some(report)) = (&self.settings, report) else { return Ok(()) };
        let held = |d: usize| if flow.held[d] { report.velocity[d] - report.wanted[d] } else { 0.0 };
        let off = held(0).hypot(held(1)).hypot(held(2));
        let risen = report.wanted == flow.velocity;
        let is_missed = risen && off > MISSING * flow.velocity.length();
        self.missed = if is_missed { self.missed + dt } else { (self.missed - dt).max(0.0) };
        if self.missed < ANSWERS * flow.answer {
            return Ok(());
        }
        let shown = |v: Vector| format!("({:.3e}, {:.3e}, {:.3e})", v.x, v.y, v.z);
        Err(StepProblem {
            kind: "mean_flow",
            elsewhere: false,
            message: format!(
                "the mean velocity that `drive` holds has been missed by more than half for {ANSWERS} times its `answer`: {} m/s in place of {} m/s, \
                 with a force of {} m/s^2; is its way blocked by grains, or does the box close it?",
                shown(report.velocity),
                shown(report.wanted),
                shown(report.acceleration)
            ),
        })
    }
}

#[cfg(test)]
mod tests {
    use sazanami_numerics::mean_flow::{ActsBy, MeanFlow};

    use super::*;

    const SETTINGS: MeanFlowSettings = MeanFlowSettings {
        velocity: Vector::new(0.1, 0.0, 0.0),
        held: [true, false, false],
        net: false,
        above: 0.0,
        area: 1.0,
        answer: 0.05,
        rise: 0.25,
        acts_by: ActsBy::Mass,
        beside: Vector::ZERO,
        moves_box: false,
    };

    /// Time at which the watch gives up on a flow that rises in `rise` \[s], of which a share `passes`, with friction of `rate` [1/s].
    fn given_up(passes: Real, rate: Real, rise: Real) -> Option<Real> {
        let settings = MeanFlowSettings { rise, ..SETTINGS };
        let (mut watch, mut flow) = (HeldFlow { settings: Some(settings), missed: 0.0 }, MeanFlow::new(settings));
        let (dt, mut u) = (1e-3, Vector::ZERO);
        for n in 1..10_000 {
            u = (u + passes * dt * flow.acceleration()) / (1.0 + dt * rate);
            let report = flow.answer(dt, u, 1.0);
            if watch.watch(dt, Some(&report)).is_err() {
                return Some(n as Real * dt);
            }
        }
        None
    }

    #[test]
    fn a_flow_that_cannot_be_had_is_given_up() {
        let time = given_up(0.0, 0.0, 0.25).expect("nothing flows");
        assert!((time - 1.05).abs() < 0.01, "{time}");
        // Controls: a duct, and beds that stop water within a step, with and without a rise.
        for (rate, rise) in [(2.0, 0.25), (2.0, 0.0), (1e4, 0.25), (1e5, 0.0)] {
            assert_eq!(given_up(1.0, rate, rise), None, "{rate} {rise}");
        }
        // Where there is no liquid nothing is missed.
        let (mut watch, mut flow) = (HeldFlow { settings: Some(SETTINGS), missed: 0.0 }, MeanFlow::new(SETTINGS));
        let dry = (0..10_000).all(|_| watch.watch(1e-3, Some(&flow.answer(1e-3, Vector::ZERO, 0.0))).is_ok());
        assert!(dry);
    }
}
