//! When something is due: at regular times, at listed times, or both.

use sazanami_numerics::Real;

use crate::case::meaning::{self, Case};

/// Relative distance at which two times count as one.
const SAME: Real = 1e-9;

/// Output times, all counted from time zero so that a resumed run meets the same ones.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Schedule {
    every: Option<Real>,
    at: Vec<Real>,
}

impl Schedule {
    /// Due every `every` seconds and at the times `at` \[s].
    #[must_use]
    pub fn new(every: Option<Real>, mut at: Vec<Real>) -> Self {
        at.sort_by(Real::total_cmp);
        Self { every, at }
    }

    /// Next time after `now` \[s] at which something is due.
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

    /// Whether there is any time in it.
    #[must_use]
    pub fn is_used(&self) -> bool {
        self.every.is_some() || !self.at.is_empty()
    }

    /// Whether time zero itself is listed or regular.
    #[must_use]
    pub fn starts_at_zero(&self) -> bool {
        self.every.is_some() || self.at.first() == Some(&0.0)
    }
}

/// Times on which a step has to end: those of series, fields, grains, pictures and checkpoints. Probes are read between
/// the ends of steps and shorten none.
#[derive(Clone, Debug)]
pub struct StepEnds([Schedule; 5]);

impl StepEnds {
    /// Those of a case.
    #[must_use]
    pub fn of(case: &Case) -> Self {
        let output = &case.output;
        let by_time = |written: &meaning::Schedule| Schedule::new(written.every, written.at.clone());
        let [series, fields, grains, figures] =
            [&output.series, &output.fields, &output.grains, &output.figures].map(by_time);
        Self([series, fields, grains, figures, Schedule::new(case.checkpoint.every, Vec::new())])
    }

    /// Next of them after `now` \[s].
    pub fn next_after(&self, now: Real) -> Option<Real> {
        self.0.iter().filter_map(|times| times.next_after(now)).reduce(Real::min)
    }

    /// Steps from time zero to `until` \[s], `most` at most, and the time that they reach \[s], if none is longer than the second of `longest` up
    /// to the first \[s], their times in order and the last `until`: counted between the first `MOST_WALKED` of these times, and as many a
    /// second after them if the lengths do not ask for more.
    pub fn steps(&self, until: Real, longest: &[(Real, Real)], most: Real) -> (Real, Real) {
        // Steps without ends between two times.
        let between = |from: Real, to: Real| {
            let (mut now, mut steps) = (from, 0.0);
            for &(end, longest) in &longest[longest.partition_point(|(end, _)| *end <= from)..] {
                steps += (end.min(to) - now) / longest;
                now = end.min(to);
                if now >= to {
                    break;
                }
            }
            steps
        };
        let (mut now, mut steps) = (0.0, 0.0);
        for _ in 0..MOST_WALKED {
            let next = self.next_after(now).map_or(until, |due| due.min(until));
            let more = (between(now, next) * (1.0 - SAME)).ceil();
            if steps + more >= most {
                return (most, now + (next - now) * (most - steps) / more);
            }
            (steps, now) = (steps + more, next);
            if now >= until {
                return (steps, until);
            }
        }
        let left = between(now, until).max(MOST_WALKED as Real * (until - now) / now);
        let all = (steps + left).ceil();
        if all > most { (most, now + (until - now) * (most - steps) / left) } else { (all, until) }
    }
}

/// Ends of steps that are looked at one by one.
const MOST_WALKED: usize = 10_000;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn steps_are_counted_between_their_ends_and_as_long_as_they_may_be() {
        let ends = |every: Option<Real>| {
            let [none, some] = [None, every].map(|every| Schedule::new(every, Vec::new()));
            StepEnds([some, none.clone(), none.clone(), none.clone(), none])
        };
        // A second of steps of 0.1 s and nine of 0.5 s.
        let longest = [(1.0, 0.1), (10.0, 0.5)];
        let all = Real::INFINITY;
        assert_eq!(ends(None).steps(10.0, &longest, all), (28.0, 10.0));
        assert_eq!(ends(Some(0.4)).steps(10.0, &longest, all), (4.0 + 4.0 + 3.0 + 22.0, 10.0));
        assert_eq!(ends(None).steps(10.0, &longest, 14.0), (14.0, 5.0));
        let (steps, to) = ends(Some(1e-4)).steps(10.0, &longest, all);
        assert!((steps - 1e5).abs() < 2.0 && to == 10.0, "{steps}");
    }

    #[test]
    fn regular_times_are_met_once_each() {
        let schedule = Schedule::new(Some(0.1), vec![0.25]);
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
        let schedule = Schedule::new(None, vec![0.0123]);
        let dt = 0.002;
        let due: Vec<u64> = (1..20).filter(|&n| schedule.is_due((n - 1) as Real * dt, n as Real * dt, dt)).collect();
        assert_eq!(due, [6]);
    }
}
