//! Reports of a running command about itself; who listens decides how they are shown.

mod pace;

use sazanami_numerics::Real;

use crate::case::{Diagnostics, Source};

pub(crate) use pace::Pace;
pub use sazanami_posing::case::amounts::{duration, time};

/// Phases that grains end by coming to rest: their end is predicted.
const BY_REST: [&str; 2] = ["packing", "relax"];
/// Part of a predicted phase beyond which nothing is said of its end.
const OVERDUE: Real = 0.99;

/// State of a run after a step.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct StepLine {
    /// Phase of the run: `packing`, `relax`, `settle` or `flow`.
    pub phase: &'static str,
    /// Fluid step (packing: sub-step).
    pub step: u64,
    /// Simulated time \[s].
    pub time: Real,
    /// Simulated time at which this phase ends \[s]; predicted where grains decide it by coming to rest.
    pub until: Real,
    /// Length of the step \[s].
    pub dt: Real,
    /// Limit that ruled it.
    pub limiter: &'static str,
    /// Iterations of the pressure solver.
    pub pressure_iterations: usize,
    /// Sub-steps of the grains.
    pub substeps: usize,
    /// Touching pairs of contact spheres.
    pub contacts: usize,
    /// Wall-clock time to the end of this phase \[s]; absent until the pace is steady.
    pub remaining: Option<Real>,
}

impl StepLine {
    /// Part of this phase that is done, from 0 to 1; just below 1 where a phase takes longer than was predicted.
    #[must_use]
    pub fn fraction(&self) -> Real {
        let most = if self.is_overdue() { OVERDUE } else { 1.0 };
        if self.until > 0.0 { (self.time / self.until).clamp(0.0, most) } else { 0.0 }
    }

    /// Whether a phase that grains end by coming to rest goes on beyond the time that was predicted for it.
    #[must_use]
    pub fn is_overdue(&self) -> bool {
        BY_REST.contains(&self.phase) && self.time >= OVERDUE * self.until
    }

    /// Percentage and time left, then where the run is: at most 79 columns.
    #[must_use]
    pub fn short(&self) -> String {
        format!("{:<7} {:>3.0} %  {}", self.phase, (100.0 * self.fraction()).floor(), self.after_percentage())
    }

    /// Text after the percentage in [`StepLine::short`].
    #[must_use]
    pub fn after_percentage(&self) -> String {
        let left = self.remaining.map_or_else(String::new, |seconds| format!("left {}", duration(seconds)));
        format!("{left:<17}  t {:.3e} s  step {}  {}", self.time, self.step, self.limiter)
    }
}

impl std::fmt::Display for StepLine {
    /// All that is known, for a log.
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(formatter, "{}  dt {:.3e} s", self.short(), self.dt)?;
        if self.pressure_iterations > 0 {
            write!(formatter, "  pressure {} it", self.pressure_iterations)?;
        }
        if self.substeps > 0 {
            write!(formatter, "  sub-steps {}  contacts {}", self.substeps, self.contacts)?;
        }
        Ok(())
    }
}

/// Listener of a running command.
pub trait Progress {
    /// A step is done. Called after every step; whoever shows it thins out.
    fn step(&mut self, line: &StepLine);

    /// Something worth a line of its own: a checkpoint skipped, a warning, a picture written.
    fn message(&mut self, text: &str);

    /// Warnings of the check of a case, before it runs; rendered as text by default.
    fn warnings(&mut self, warnings: &Diagnostics, source: &Source) {
        self.message(warnings.render(source, false).trim_end());
    }
}

/// A listener that shows nothing.
#[derive(Clone, Copy, Debug, Default)]
pub struct Silent;

impl Progress for Silent {
    fn step(&mut self, _: &StepLine) {}

    fn message(&mut self, _: &str) {}
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn percentage_and_time_left_come_first_within_80_columns() {
        let line = StepLine {
            phase: "packing",
            step: 1_234_567,
            time: 0.0499,
            until: 0.05,
            dt: 2e-5,
            limiter: "grain_motion",
            pressure_iterations: 12,
            substeps: 61,
            contacts: 30_000,
            remaining: Some(18_650.0),
        };
        let short = line.short();
        assert!(short.starts_with("packing  99 %  left 5 h 10 min  "), "{short}");
        assert!(short.chars().count() < 80, "{short}");
        assert!(
            line.to_string().starts_with(&short)
                && line.to_string().ends_with("pressure 12 it  sub-steps 61  contacts 30000")
        );
        // Nothing is guessed before the pace is known.
        let first = StepLine { remaining: None, time: 0.0, ..line };
        assert!(first.short().starts_with("packing   0 %                   "), "{}", first.short());
        assert!(!first.short().contains("left"));
        // A bed that takes longer than predicted is never done before it is.
        let late = StepLine { time: 0.06, ..line };
        assert!(late.short().starts_with("packing  99 %") && late.fraction() == OVERDUE, "{}", late.short());
        let flow = StepLine { phase: "flow", time: 0.05, ..line };
        assert!(flow.short().starts_with("flow    100 %"), "{}", flow.short());
    }
}
