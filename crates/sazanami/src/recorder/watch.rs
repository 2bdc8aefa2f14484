//! Wall-clock time by phase.

use std::collections::BTreeMap;
use std::time::Instant;

use sazanami_numerics::Real;

use crate::job::Totals;

/// Phase of what comes before the first step: files read, grains settled, liquids poured.
pub(crate) const SETUP: &str = "setup";
/// Name of the phase in which pictures are prepared and waited for; they are drawn beside the others.
pub(crate) const PICTURES: &str = "pictures";

/// Measures how long phases take.
#[derive(Debug)]
pub(crate) struct Watch {
    phase: &'static str,
    since: Instant,
    seconds: BTreeMap<&'static str, Real>,
}

impl Watch {
    /// Begins with the set-up.
    pub fn start() -> Self {
        Self { phase: SETUP, since: Instant::now(), seconds: BTreeMap::new() }
    }

    /// Name of the phase that is measured.
    pub fn phase(&self) -> &'static str {
        self.phase
    }

    /// The phase before ends, that of this name begins.
    pub fn turn(&mut self, name: &'static str) {
        let now = Instant::now();
        *self.seconds.entry(self.phase).or_default() += (now - self.since).as_secs_f64();
        self.since = now;
        self.phase = name;
    }

    /// Moves what was measured into the totals.
    pub fn empty_into(&mut self, totals: &mut Totals) {
        self.turn(self.phase);
        for (name, seconds) in std::mem::take(&mut self.seconds) {
            *totals.phase_s.entry(name.to_owned()).or_default() += seconds;
            totals.wall_s += seconds;
        }
    }
}
