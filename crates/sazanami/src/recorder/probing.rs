//! Probes are read between the ends of steps: what is a state there goes linearly from one end to the other.

use sazanami_io::table::{Column, Value};
use sazanami_numerics::Real;

use super::files::Files;
use super::{Observer, Recorder};
use crate::clock::Clock;
use crate::job::{RankError, RecordError};
use crate::water::Water as _;

impl<B: Observer> Recorder<'_, B> {
    /// A step begins that ends at `after`: reads the probes that are due before its end.
    pub fn before_step(&mut self, water: &mut B::Water, clock: &Clock, after: &Clock) {
        let due = self.timetables.probes_due(clock.time(), after);
        let asked: Vec<bool> = due.iter().map(|times| times.iter().any(|&time| time < after.time())).collect();
        self.probed.clear();
        if asked.contains(&true) {
            self.probed = self.observer.probe(self.job, water, clock.time(), &asked);
        }
    }

    /// Writes the rows of the probes that were `due` in the step from `before` \[s] to now.
    pub(super) fn write_probes(
        &mut self,
        water: &mut B::Water,
        clock: &Clock,
        before: Real,
        due: &[Vec<Real>],
    ) -> Result<(), RankError> {
        let asked: Vec<bool> = due.iter().map(|times| !times.is_empty()).collect();
        if !asked.contains(&true) {
            return Ok(());
        }
        let (job, now) = (self.job, clock.time());
        let found = self.observer.probe(job, water, now, &asked);
        let mut write = |files: &mut Files| -> Result<(), RecordError> {
            for (number, times) in due.iter().enumerate().filter(|(_, times)| !times.is_empty()) {
                let (probe, last) = (&job.case.probes[number], &found[number]);
                let columns = B::probe_headings(&probe.place);
                let rows = times.iter().map(|&time| {
                    let first = self.probed.get(number).filter(|_| time < now).unwrap_or(last);
                    let part = (time - before) / (now - before);
                    std::iter::once(time.into()).chain(between(&columns[1..], first, last, part)).collect()
                });
                files.probe(number, &probe.name, &columns, clock.step(), rows, |text| job.say(text))?;
            }
            Ok(())
        };
        let outcome = self.files.as_mut().map_or(Ok(()), &mut write);
        water.domain().agree(outcome.map_err(RankError::from))?;
        Ok(())
    }
}

/// The row at a `part` of the step, of those at its ends. Pressures, forces and what else acts throughout the step are means over
/// it; where one end has no value there is none.
fn between(columns: &[Column], first: &[Value], last: &[Value], part: Real) -> Vec<Value> {
    let value = |((column, first), last): ((&Column, &Value), &Value)| match (first, last) {
        _ if ["Pa", "N", "N m"].contains(&column.unit.as_str()) => last.clone(),
        (Value::Real(first), Value::Real(last)) => {
            Value::Real(if first == last { *last } else { first + part * (last - first) })
        }
        (Value::Missing, _) => Value::Missing,
        _ => last.clone(),
    };
    columns.iter().zip(first).zip(last).map(value).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn states_are_linear_within_a_step_and_forces_are_those_of_the_step() {
        let columns = [Column::new("velocity_1", "m/s"), Column::new("pressure", "Pa"), Column::new("level", "m")];
        let row = |time: Real| vec![Value::Real(3.0 - 2.0 * time), Value::Real(time), Value::Real(time)];
        let found = between(&columns, &row(0.5), &row(0.75), 0.25);
        assert_eq!(found, [Value::Real(3.0 - 2.0 * 0.5625), Value::Real(0.75), Value::Real(0.5625)]);
        let nothing = vec![Value::Missing; 3];
        let half_known = [Value::Missing, Value::Real(0.75), Value::Missing];
        assert_eq!(between(&columns, &nothing, &row(0.75), 0.25), half_known);
        assert_eq!(between(&columns, &row(0.5), &nothing, 0.25), nothing);
    }
}
