//! Times on which steps end.

use sazanami_numerics::Real;

use crate::case::meaning::{Case, Schedule};

/// Relative distance up to which a number of steps counts as a whole one.
const SAME: Real = 1e-9;

/// Times on which a step has to end: those of series, fields, grains, pictures and checkpoints. Probes are read between
/// the ends of steps and shorten none.
#[derive(Clone, Debug)]
pub struct StepEnds([Schedule; 5]);

impl StepEnds {
    /// Those of a case.
    #[must_use]
    pub fn of(case: &Case) -> Self {
        let output = &case.output;
        let [series, fields, grains, figures] =
            [&output.series, &output.fields, &output.grains, &output.figures].map(Schedule::clone);
        Self([series, fields, grains, figures, case.checkpoint.schedule()])
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
            let [none, some] = [None, every].map(|every| Schedule { every, ..Schedule::default() });
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
}
