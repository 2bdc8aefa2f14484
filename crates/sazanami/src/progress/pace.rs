//! Pace of a phase of a run, and the time left until it is done.

use std::collections::VecDeque;
use std::time::{Duration, Instant};

use sazanami_numerics::Real;

use super::StepLine;

/// The pace is measured over this time: steps grow and shrink by orders of magnitude in a run.
const WINDOW: Duration = Duration::from_secs(60);
/// Time between two marks.
const BETWEEN: Duration = Duration::from_secs(1);
/// Marks needed before anything is said.
const MARKS: usize = 6;
/// The pace is steady if that of the latter half of the marks is that of all within this factor.
const STEADY: Real = 1.5;

/// Simulated time over wall-clock time of late.
#[derive(Clone, Debug)]
pub(crate) struct Pace {
    phase: &'static str,
    /// Wall clock and simulated time \[s], oldest first.
    marks: VecDeque<(Instant, Real)>,
    /// Whether the pace has been steady once in this phase.
    is_known: bool,
}

impl Pace {
    /// Nothing has been seen.
    pub fn new() -> Self {
        Self { phase: "", marks: VecDeque::new(), is_known: false }
    }

    /// Wall-clock time from `line` to the end of its phase \[s], once the pace is steady.
    pub fn remaining(&mut self, line: &StepLine) -> Option<Real> {
        self.remaining_at(Instant::now(), line)
    }

    fn remaining_at(&mut self, now: Instant, line: &StepLine) -> Option<Real> {
        if line.phase != self.phase {
            *self = Self { phase: line.phase, ..Self::new() };
        }
        if self.marks.back().is_none_or(|&(last, _)| now - last >= BETWEEN) {
            self.marks.push_back((now, line.time));
        }
        while self.marks.len() > MARKS && now - self.marks[1].0 >= WINDOW {
            self.marks.pop_front();
        }
        let pace_since = |n: usize| {
            let (since, begun) = *self.marks.get(n)?;
            let passed = (now - since).as_secs_f64();
            (line.time > begun && passed > 0.0).then(|| (line.time - begun) / passed)
        };
        let (pace, of_late) = (pace_since(0)?, pace_since(self.marks.len() / 2)?);
        let is_steady = (1.0 / STEADY..STEADY).contains(&(of_late / pace));
        self.is_known |= self.marks.len() >= MARKS && is_steady;
        (self.is_known && !line.is_overdue()).then(|| (line.until - line.time).max(0.0) / pace)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Predictions after each second in which the simulated time reaches `times` \[s], of a phase of 1 s.
    fn predicted(phase: &'static str, pace: &mut Pace, begin: Instant, times: &[Real]) -> Vec<Option<Real>> {
        let after = |n: usize| begin + Duration::from_secs(n as u64);
        let line = |time: Real| StepLine { phase, time, until: 1.0, ..StepLine::default() };
        times.iter().enumerate().map(|(n, &time)| pace.remaining_at(after(n), &line(time))).collect()
    }

    #[test]
    fn nothing_is_said_before_the_pace_is_known() {
        // Steps that begin tiny and double: a first guess would be hours.
        let times: Vec<Real> = (0..12).map(|n| 1e-6 * Real::from(1 << n)).collect();
        assert!(predicted("flow", &mut Pace::new(), Instant::now(), &times).iter().all(Option::is_none));
        // Negative control: an even pace is known after a few seconds, and right.
        let even: Vec<Real> = (0..12).map(|n| 1e-2 * Real::from(n)).collect();
        let said = predicted("flow", &mut Pace::new(), Instant::now(), &even);
        assert!(said[..MARKS - 1].iter().all(Option::is_none), "{said:?}");
        assert!((said[11].unwrap() - 89.0).abs() < 1e-6, "{said:?}");
    }

    #[test]
    fn what_is_left_follows_the_pace_of_late() {
        let mut pace = Pace::new();
        let begin = Instant::now();
        // 100 s at 1 ms a second, then 61 s at 5 ms a second.
        let slow = (0..100).map(|n| 1e-3 * Real::from(n));
        let times: Vec<Real> = slow.chain((0..62).map(|n| 0.1 + 5e-3 * Real::from(n))).collect();
        let left = predicted("flow", &mut pace, begin, &times).pop().unwrap().unwrap();
        assert!((left - (1.0 - 0.405) / 5e-3).abs() < 1.0, "{left}");
        // Beyond the time predicted for a bed nothing is known.
        let even: Vec<Real> = (0..12).map(|n| 0.1 * Real::from(n)).collect();
        let said = predicted("packing", &mut Pace::new(), begin, &even);
        assert!(said[9].is_some() && said[10].is_none() && said[11].is_none(), "{said:?}");
        // Another phase has its own pace.
        assert_eq!(predicted("settle", &mut pace, begin + Duration::from_secs(200), &[0.0, 0.1]), [None, None]);
    }
}
