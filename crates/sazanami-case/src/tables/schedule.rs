//! When something happens: `every`, `steps` and `at`, together or alone.

use sazanami_case_derive::Keys;
use sazanami_numerics::Real;

use crate::read::{Context, Table};

/// Times at which something happens; `{ at = [] }` is never. Steps end on the times of `every` and `at`.
#[derive(Clone, Debug, Default, PartialEq, Keys)]
#[keys(check = Self::check)]
pub struct Schedule {
    /// Every so often.
    #[key(unit = "s", range = Positive)]
    pub every: Option<Real>,
    /// Every so many steps.
    #[key(least = 1)]
    pub steps: Option<usize>,
    /// At these times.
    #[key(unit = "s", default = Vec::new(), says = "none")]
    pub at: Vec<Real>,
}

impl Schedule {
    fn check(&mut self, table: &Table<'_>, cx: &mut Context<'_>) {
        if self.at.iter().any(|&t| t < 0.0) {
            cx.report
                .error(table.place("at"), "a run begins at time zero")
                .label("no time before that")
                .help("leave out the times below zero");
        }
        self.at.sort_by(Real::total_cmp);
        self.at.dedup();
    }

    /// Whether a table says when.
    pub(super) fn is_in(table: &Table<'_>) -> bool {
        ["every", "steps", "at"].iter().any(|key| table.has(key))
    }

    /// At the start, and at the end of a run until `until` \[s].
    pub(super) fn ends(until: Real) -> Self {
        Self { at: if until > 0.0 { vec![0.0, until] } else { vec![0.0] }, ..Self::default() }
    }

    /// The same at the start and at the end of a run whose end moves; other times stay.
    pub(super) fn move_end(&mut self, from: Real, to: Real) {
        if *self == Self::ends(from) {
            *self = Self::ends(to);
        }
    }

    /// Every step.
    pub(super) fn each_step() -> Self {
        Self { steps: Some(1), ..Self::default() }
    }

    /// Whether nothing ever happens.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.every.is_none() && self.steps.is_none() && self.at.is_empty()
    }

    /// Number of times up to `until` \[s], with about `steps` steps on the way.
    #[must_use]
    pub fn count(&self, until: Real, steps: Real) -> Real {
        let every = self.every.map_or(0.0, |every| (until / every).floor() + 1.0);
        let by_steps = self.steps.map_or(0.0, |n| (steps / n as Real).floor());
        every + by_steps + self.at.iter().filter(|&&t| t <= until).count() as Real
    }
}
