//! What a running command tells about itself; who listens decides how it is shown.

use sazanami_numerics::Real;

use crate::case::{Diagnostics, Source};

/// State of a run after a step.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct StepLine {
    /// What the run is doing, `packing` or `flow`.
    pub phase: &'static str,
    /// Fluid step (packing: sub-step).
    pub step: u64,
    /// Simulated time [s].
    pub time: Real,
    /// Simulated time at the end [s].
    pub until: Real,
    /// Length of the step [s].
    pub dt: Real,
    /// Limit that ruled it.
    pub limiter: &'static str,
    /// Iterations of the pressure solver.
    pub pressure_iterations: usize,
    /// Sub-steps of the grains.
    pub substeps: usize,
    /// Contacts between grains.
    pub contacts: usize,
    /// Wall-clock time left [s], if it can be told.
    pub remaining: Option<Real>,
}

impl std::fmt::Display for StepLine {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(
            formatter,
            "{:<7} step {:>7}  t {:.5e} s  dt {:.3e} s ({})",
            self.phase, self.step, self.time, self.dt, self.limiter
        )?;
        if self.pressure_iterations > 0 {
            write!(formatter, "  pressure {} it", self.pressure_iterations)?;
        }
        if self.substeps > 0 {
            write!(formatter, "  sub-steps {}  contacts {}", self.substeps, self.contacts)?;
        }
        match self.remaining {
            Some(seconds) => write!(formatter, "  left {}", duration(seconds)),
            None => Ok(()),
        }
    }
}

/// A length of time for people: `42 s`, `3 min 20 s`, `5 h 10 min`.
#[must_use]
pub fn duration(seconds: Real) -> String {
    if seconds < 10.0 {
        return format!("{seconds:.1} s");
    }
    let whole = seconds.round();
    if whole < 120.0 {
        format!("{whole:.0} s")
    } else if whole < 7200.0 {
        format!("{:.0} min {:02.0} s", (whole / 60.0).floor(), whole % 60.0)
    } else if whole < 3.6e9 {
        format!("{:.0} h {:02.0} min", (whole / 3600.0).floor(), ((whole % 3600.0) / 60.0).floor())
    } else {
        format!("{:.1e} h", whole / 3600.0)
    }
}

/// Listener of a running command.
pub trait Progress {
    /// A step is done. Called after every step; whoever shows it thins out.
    fn step(&mut self, line: &StepLine);

    /// Something worth a line of its own: a checkpoint skipped, a warning, a picture written.
    fn message(&mut self, text: &str);

    /// What makes one wonder about a case that can run, before it runs; as text unless shown otherwise.
    fn warnings(&mut self, warnings: &Diagnostics, source: &Source) {
        self.message(warnings.render(source, false).trim_end());
    }
}

/// A listener that does not care.
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
    fn durations_read_well() {
        assert_eq!(duration(4.25), "4.2 s");
        assert_eq!(duration(42.4), "42 s");
        assert_eq!(duration(200.0), "3 min 20 s");
        assert_eq!(duration(18_650.0), "5 h 10 min");
    }
}
