//! When something happens: `every`, `steps` and `at`, together or alone.

use sazanami_case_derive::Keys;
use sazanami_numerics::Real;

use crate::read::{Context, Table};

/// Relative distance at which two times count as one.
const SAME: Real = 1e-9;

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

    /// Next time after `now` \[s] at which something is due, whatever the steps; `at` is in order, as it is once read.
    #[must_use]
    pub fn next_after(&self, now: Real) -> Option<Real> {
        let later = |time: Real| time > now + SAME * time.abs().max(Real::MIN_POSITIVE);
        let listed = self.at.get(self.at.partition_point(|&time| !later(time))).copied();
        let regular = self.every.map(|every| {
            let count = (now / every).floor();
            let next = (count + 1.0) * every;
            if later(next) { next } else { (count + 2.0) * every }
        });
        match (listed, regular) {
            (Some(a), Some(b)) => Some(a.min(b)),
            (a, b) => a.or(b),
        }
    }

    /// Whether something fell due after `before` and not after `now`, up to half of `tolerance` \[s].
    #[must_use]
    pub fn is_due(&self, before: Real, now: Real, tolerance: Real) -> bool {
        let reach = now + 0.5 * tolerance;
        self.next_after(before + 0.5 * tolerance).is_some_and(|due| due <= reach + SAME * reach.abs())
    }

    /// The times after `before` and not after `now` \[s] at which something is due, in their order.
    pub fn within(&self, before: Real, now: Real) -> impl Iterator<Item = Real> {
        let until = now + SAME * now.abs();
        std::iter::successors(self.next_after(before), |&due| self.next_after(due)).take_while(move |&due| due <= until)
    }

    /// Whether time zero itself is listed or regular.
    #[must_use]
    pub fn starts_at_zero(&self) -> bool {
        self.every.is_some() || self.at.first() == Some(&0.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn regular_times_are_met_once_each() {
        let schedule = Schedule { every: Some(0.1), at: vec![0.25], steps: None };
        let mut now = 0.0;
        let mut met = Vec::new();
        while let Some(due) = schedule.next_after(now).filter(|&due| due < 0.55) {
            assert!(schedule.is_due(now, due, 0.0));
            assert!(!schedule.is_due(due, due + 0.01, 0.0));
            met.push((due * 100.0).round() as i32);
            now = due;
        }
        assert_eq!(met, [10, 20, 25, 30, 40, 50]);
    }

    #[test]
    fn fixed_steps_report_at_the_nearest_step() {
        let schedule = Schedule { at: vec![0.0123], ..Schedule::default() };
        let dt = 0.002;
        let due: Vec<u64> = (1..20).filter(|&n| schedule.is_due((n - 1) as Real * dt, n as Real * dt, dt)).collect();
        assert_eq!(due, [6]);
    }
}
