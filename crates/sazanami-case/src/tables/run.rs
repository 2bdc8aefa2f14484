//! `[run]` and `[checkpoint]`: how long the run is, and what is kept to go on from.

use sazanami_case_derive::Keys;
use sazanami_numerics::Real;

use crate::read::{Context, Table};

/// Length of the run.
#[derive(Clone, Copy, Debug, Default, PartialEq, Keys)]
#[keys(check = Self::check)]
pub struct RunLength {
    /// Simulated time at the end; it may be left out with `packing_only`.
    #[key(unit = "s", range = NonNegative, default = Real::NAN, says = "required", example = "0.02 s")]
    pub until: Real,
    /// Most steps of the fluid.
    #[key(least = 1, says = "any number")]
    pub steps: Option<usize>,
    /// Whether the run ends with the packed bed.
    #[key(default = false)]
    pub packing_only: bool,
}

impl RunLength {
    fn check(&mut self, table: &Table<'_>, cx: &mut Context<'_>) {
        if table.has("until") {
            return;
        }
        if self.packing_only {
            self.until = 0.0;
        } else {
            table.missing("until", cx);
        }
    }

    /// Substitute for a table that is missing.
    pub(crate) fn unknown() -> Self {
        Self { until: Real::NAN, steps: None, packing_only: false }
    }
}

/// Wall-clock time between checkpoints \[s].
const EVERY: Real = 600.0;

/// Checkpoints.
#[derive(Clone, Copy, Debug, PartialEq, Keys)]
#[keys(check = Self::check)]
pub struct Checkpoints {
    /// Every so much wall-clock time.
    #[key(unit = "s", range = Positive, says = format!("{} min, none if `every` is given", EVERY / 60.0))]
    pub every_wall: Option<Real>,
    /// Every so much simulated time.
    #[key(unit = "s", range = Positive)]
    pub every: Option<Real>,
    /// Number kept.
    #[key(least = 1, default = 2)]
    pub keep: usize,
}

impl Checkpoints {
    fn check(&mut self, table: &Table<'_>, _: &mut Context<'_>) {
        if !table.has("every_wall") && self.every.is_none() {
            self.every_wall = Some(EVERY);
        }
    }
}
