//! Probes are read between the ends of steps: what is a state there goes linearly from one end to the other.

use sazanami_io::table::{Column, Value};
use sazanami_numerics::Real;

use super::files::Files;
use super::{Observer, Recorder};
use crate::case::meaning::{BoundarySide, Case};
use crate::clock::Clock;
use crate::job::{RankError, RecordError};
use crate::water::Water as _;

/// What probes showed at one time.
#[derive(Debug, Default)]
pub(super) struct Reading {
    /// That time \[s]; `None` before the first.
    time: Option<Real>,
    /// The probes that were read.
    asked: Vec<bool>,
    /// Values of each of them, on the rank that leads.
    rows: Vec<Vec<Value>>,
}

impl Reading {
    /// Whether it has all probes that are `asked` at `time` \[s]. All ranks agree.
    fn has(&self, time: Real, asked: &[bool]) -> bool {
        self.time == Some(time) && self.asked.iter().zip(asked).all(|(read, asked)| *read || !asked)
    }
}

impl<B: Observer> Recorder<'_, B> {
    /// A step begins that ends at `after`: reads the probes that are due before its end.
    pub fn before_step(&mut self, water: &mut B::Water, clock: &Clock, after: &Clock) {
        let due = self.timetables.probes_due(clock.time(), after);
        let asked: Vec<bool> = due.iter().map(|times| times.iter().any(|&time| time < after.time())).collect();
        self.probed = Reading::default();
        if asked.contains(&true) {
            // Probes of the end of the step before show the same.
            let last = std::mem::take(&mut self.last_probed);
            self.probed =
                if last.has(clock.time(), &asked) { last } else { self.read_probes(water, clock.time(), asked) };
        }
    }

    fn read_probes(&mut self, water: &mut B::Water, time: Real, asked: Vec<bool>) -> Reading {
        let rows = self.observer.probe(self.job, water, time, &asked);
        Reading { time: Some(time), asked, rows }
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
        let found = self.read_probes(water, now, asked);
        let mut write = |files: &mut Files| -> Result<(), RecordError> {
            for (number, times) in due.iter().enumerate().filter(|(_, times)| !times.is_empty()) {
                let (probe, last) = (&job.case.probes[number], &found.rows[number]);
                let columns = B::probe_headings(&probe.place);
                let rows = times.iter().map(|&time| {
                    let first = self.probed.rows.get(number).filter(|_| time < now).unwrap_or(last);
                    let part = (time - before) / (now - before);
                    let box_then = periodic_sides(job.case, time);
                    std::iter::once(time.into()).chain(between(&columns[1..], first, last, part, &box_then)).collect()
                });
                files.probe(number, &probe.name, &columns, clock.step(), rows, |text| job.say(text))?;
            }
            Ok(())
        };
        let outcome = self.files.as_mut().map_or(Ok(()), &mut write);
        self.last_probed = found;
        water.domain().agree(outcome.map_err(RankError::from))?;
        Ok(())
    }
}

/// Places of the two sides of each direction that is periodic, in the frame that is written \[m].
type PeriodicSides = [Option<[Real; 2]>; 3];

fn periodic_sides(case: &Case, time: Real) -> PeriodicSides {
    let [shift, _] = case.to_written_frame(time);
    let (lower, upper) = (case.domain.lower + shift, case.domain.upper + shift);
    let sides = |d: usize| (case.boundary[d][0] == BoundarySide::Periodic).then(|| [lower[d], upper[d]]);
    std::array::from_fn(sides)
}

/// The row at a `part` of the step, of those at its ends. Pressures, forces and torques are those of the step; where one end has no
/// value there is none. A grain goes the shorter way, through a periodic side if that is shorter.
fn between(columns: &[Column], first: &[Value], last: &[Value], part: Real, sides: &PeriodicSides) -> Vec<Value> {
    let period = |column: &Column| {
        let direction = ["position_1", "position_2", "position_3"].iter().position(|name| *name == column.name);
        direction.and_then(|d| sides[d])
    };
    let value = |((column, first), last): ((&Column, &Value), &Value)| match (first, last) {
        _ if ["Pa", "N", "N m"].contains(&column.unit.as_str()) => last.clone(),
        (Value::Real(first), Value::Real(last)) if first == last => Value::Real(*last),
        (Value::Real(first), Value::Real(last)) => Value::Real(match period(column) {
            Some([lower, upper]) => {
                let edge = upper - lower;
                let way = (last - first) - edge * ((last - first) / edge).round();
                lower + (first + part * way - lower).rem_euclid(edge)
            }
            None => first + part * (last - first),
        }),
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
        let walls = [None; 3];
        let between = |first: &[Value], last: &[Value]| super::between(&columns, first, last, 0.25, &walls);
        let found = between(&row(0.5), &row(0.75));
        assert_eq!(found, [Value::Real(3.0 - 2.0 * 0.5625), Value::Real(0.75), Value::Real(0.5625)]);
        let nothing = vec![Value::Missing; 3];
        let half_known = [Value::Missing, Value::Real(0.75), Value::Missing];
        assert_eq!(between(&nothing, &row(0.75)), half_known);
        assert_eq!(between(&row(0.5), &nothing), nothing);
    }

    #[test]
    fn a_grain_goes_through_a_periodic_side() {
        let columns = ["position_1", "position_2", "level"].map(|name| Column::new(name, "m"));
        let row = |x: Real| vec![Value::Real(x); 3];
        let at = |part: Real| between(&columns, &row(0.98), &row(0.02), part, &[Some([0.0, 1.0]), None, None]);
        let places = |part: Real| match &at(part)[..] {
            &[Value::Real(x), Value::Real(y), Value::Real(z)] => [x, y, z],
            other => panic!("{other:?}"),
        };
        let ([before, wall, level], [after, ..]) = (places(0.25), places(0.75));
        assert!((before - 0.99).abs() < 1e-12 && (after - 0.01).abs() < 1e-12, "{before} {after}");
        // Negative control: between walls, and what is no place, goes the long way.
        assert!((wall - 0.74).abs() < 1e-12 && (level - 0.74).abs() < 1e-12, "{wall} {level}");
    }
}
