//! Times on which steps end.

use sazanami_numerics::Real;

use crate::case::meaning::{Case, Feed, GrainPlacement, Schedule};

/// Relative distance up to which a number of steps counts as a whole one.
const SAME: Real = 1e-9;

/// Times on which a step has to end: those of series, fields, grains, pictures and checkpoints. Probes are read between
/// the ends of steps and shorten none.
#[derive(Clone, Debug)]
pub struct StepEnds {
    times: Vec<Schedule>,
    feeds: Vec<Feed>,
}

impl StepEnds {
    /// Those of what a case writes.
    #[must_use]
    pub fn of(case: &Case) -> Self {
        let output = &case.output;
        let outputs = [&output.series, &output.fields, &output.grains, &output.figures].map(Schedule::clone);
        Self { times: outputs.into_iter().chain([case.checkpoint.schedule()]).collect(), feeds: Vec::new() }
    }

    /// Those of what a case writes and of all that happens in it: grains that are fed in or let go, gates that open and springs that become
    /// softer.
    #[must_use]
    pub fn foretold(case: &Case) -> Self {
        let releases = case.grains.iter().filter_map(|population| population.release);
        let gates = case.gates.iter().map(|gate| gate.opens);
        let mut at: Vec<Real> = releases.chain(gates).chain(case.dem.soften.map(|softening| softening.from)).collect();
        at.sort_by(Real::total_cmp);
        let feed = |placement: &GrainPlacement| match placement {
            GrainPlacement::Fed(feed) => Some(feed.clone()),
            _ => None,
        };
        let Self { mut times, .. } = Self::of(case);
        times.push(Schedule { at, ..Schedule::default() });
        Self { times, feeds: case.grains.iter().filter_map(|population| feed(&population.placement)).collect() }
    }

    /// Next of them after `now` \[s].
    pub fn next_after(&self, now: Real) -> Option<Real> {
        let of_feeds = self.feeds.iter().filter_map(|feed| feed.next_after(now));
        self.times.iter().filter_map(|times| times.next_after(now)).chain(of_feeds).reduce(Real::min)
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
            StepEnds { times: vec![some, none], feeds: Vec::new() }
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
