//! When what is due.

use sazanami_numerics::Real;
use sazanami_posing::schedule::StepEnds;

use crate::case::meaning::{Case, Schedule};
use crate::clock::Clock;

/// A schedule by time and by steps.
#[derive(Clone, Debug, Default)]
pub(crate) struct Timetable(Schedule);

impl Timetable {
    pub fn new(schedule: &Schedule) -> Self {
        Self(schedule.clone())
    }

    fn starts_at_zero(&self) -> bool {
        self.0.steps.is_some() || self.0.starts_at_zero()
    }

    fn is_used(&self) -> bool {
        !self.0.is_empty()
    }

    fn by_step(&self, clock: &Clock) -> bool {
        self.0.steps.is_some_and(|steps| clock.step().is_multiple_of(steps as u64))
    }

    /// Times at which something is due in the step from `before` to now \[s].
    fn within(&self, before: Real, clock: &Clock) -> Vec<Real> {
        let now = clock.time();
        let mut times: Vec<Real> = self.0.within(before, now).map(|time| time.min(now)).collect();
        if self.by_step(clock) && times.last() != Some(&now) {
            times.push(now);
        }
        times
    }

    fn is_due(&self, before: Real, clock: &Clock, tolerance: Real) -> bool {
        self.by_step(clock) || self.0.is_due(before, clock.time(), tolerance)
    }
}

/// Everything that is due at times.
#[derive(Clone, Debug)]
pub(crate) struct Timetables {
    /// Series, fields, grains, pictures.
    outputs: [Timetable; 4],
    probes: Vec<Timetable>,
    checkpoints: Schedule,
    ends: StepEnds,
    /// Time \[s] and step that the run ends at.
    end: (Real, Option<u64>),
}

impl Timetables {
    pub fn of(case: &Case) -> Self {
        let output = &case.output;
        Self {
            outputs: [&output.series, &output.fields, &output.grains, &output.figures].map(Timetable::new),
            probes: case.probes.iter().map(|probe| Timetable::new(&probe.schedule)).collect(),
            checkpoints: case.checkpoint.schedule(),
            ends: StepEnds::of(case),
            end: (case.run.until, case.run.steps.map(|steps| steps as u64)),
        }
    }

    /// Next time after `now` \[s] on which a step has to end.
    pub fn next_after(&self, now: Real) -> Option<Real> {
        self.ends.next_after(now)
    }

    /// Whether series, fields, grains, pictures are due before the first step. A series begins there.
    pub fn due_at_start(&self) -> [bool; 4] {
        let mut due = self.outputs.each_ref().map(Timetable::starts_at_zero);
        due[0] = true;
        due
    }

    /// Whether series, fields, grains, pictures are due. A series ends where the case ends, not where a command stops.
    pub fn due(&self, before: Real, clock: &Clock, tolerance: Real) -> [bool; 4] {
        let mut due = self.outputs.each_ref().map(|table| table.is_due(before, clock, tolerance));
        let (time, step) = self.end;
        due[0] |= clock.has_reached(time) || step.is_some_and(|step| clock.step() >= step);
        due
    }

    /// Whether series, fields, grains, pictures are due at an end that no schedule knew; the series has its row then.
    pub fn due_at_end(&self) -> [bool; 4] {
        let mut due = self.outputs.each_ref().map(Timetable::is_used);
        due[0] = false;
        due
    }

    /// Times at which each probe is due before the first step: zero or never.
    pub fn probes_due_at_start(&self) -> Vec<Vec<Real>> {
        self.probes.iter().map(|table| vec![0.0; usize::from(table.starts_at_zero())]).collect()
    }

    /// Times at which each probe is due in the step from `before` to now \[s].
    pub fn probes_due(&self, before: Real, clock: &Clock) -> Vec<Vec<Real>> {
        self.probes.iter().map(|table| table.within(before, clock)).collect()
    }

    pub fn checkpoint_is_due(&self, before: Real, clock: &Clock, tolerance: Real) -> bool {
        self.checkpoints.is_due(before, clock.time(), tolerance)
    }
}
