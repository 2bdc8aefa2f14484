//! How fast a run gets on, to tell when it will be done.

use std::time::{Duration, Instant};

use sazanami_numerics::Real;

/// The pace is that of the last one to two of these: steps grow and shrink by orders of magnitude in a run.
const WINDOW: Duration = Duration::from_secs(60);

/// Simulated time over wall-clock time of late.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Pace {
    /// Where the pace is measured from: wall clock and simulated time [s].
    from: (Instant, Real),
    /// Where it will be measured from next.
    next: (Instant, Real),
}

impl Pace {
    /// Measures from now, simulated `time` [s].
    pub fn from(time: Real) -> Self {
        let now = (Instant::now(), time);
        Self { from: now, next: now }
    }

    /// Wall-clock time from simulated `time` to `until` [s]; `None` before anything was simulated.
    pub fn seconds_for(&mut self, time: Real, until: Real) -> Option<Real> {
        let now = Instant::now();
        if now - self.next.0 >= WINDOW {
            self.from = self.next;
            self.next = (now, time);
        }
        let (since, begun) = self.from;
        let done = time - begun;
        (done > 0.0).then(|| (now - since).as_secs_f64() * (until - time) / done)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_left_follows_the_pace_of_late() {
        let mut pace = Pace::from(0.0);
        assert_eq!(pace.seconds_for(0.0, 1.0), None);
        let before = |seconds: u64| Instant::now().checked_sub(Duration::from_secs(seconds)).unwrap();
        // Slow for long, then a quarter of what there is in the last 61 s.
        pace.from = (before(1000), 0.0);
        pace.next = (before(61), 0.25);
        let left = pace.seconds_for(0.5, 1.0).unwrap();
        assert!((left - 122.0).abs() < 1.0, "{left}");
        pace.next = (before(30), 0.5);
        pace.from = (before(60), 0.25);
        let left = pace.seconds_for(0.5, 1.0).unwrap();
        assert!((left - 120.0).abs() < 1.0, "{left}");
    }
}
