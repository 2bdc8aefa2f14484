//! Cases posed by a case file: run as a user runs them, their values taken of the tables that a run leaves.

use std::borrow::Cow;
use std::collections::BTreeMap;
use std::io;
use std::path::Path;

use sazanami_numerics::Real;
use sazanami_posing::case::meaning::ProbePlace;
use sazanami_posing::case::{self, LoadedCase};

use crate::cases::whole_run::{Manner, WholeRun};
use crate::expected::{Curves, Expected, Other, Quantity, Run, Taken};
use crate::measured::{Chart, Outcome};
use crate::value::{Beside, Columns, Course, Function, order};

/// Case file of a verification case and its table of reference data.
pub(crate) const CASE: &str = "case.toml";
pub(crate) const REFERENCE: &str = "reference.csv";

/// The case file of a verification case and its table of reference data (empty if it has none).
#[derive(Clone, Debug)]
pub struct Posed {
    /// Text of `case.toml`.
    pub case: Cow<'static, str>,
    /// Names and texts of other case files, for runs that name one.
    pub others: &'static [(&'static str, &'static str)],
    /// Text of `reference.csv`.
    pub reference: Cow<'static, str>,
}

impl Posed {
    /// The same with the files of `folder` in place of its own, where there are such.
    ///
    /// # Errors
    /// If a file cannot be read.
    pub fn of_folder(mut self, folder: &Path) -> io::Result<Self> {
        for (text, name) in [(&mut self.case, CASE), (&mut self.reference, REFERENCE)] {
            let path = folder.join(name);
            if path.is_file() {
                *text = std::fs::read_to_string(path)?.into();
            }
        }
        Ok(self)
    }

    /// The runs of `expected` as loaded cases, by name.
    ///
    /// # Errors
    /// What is wrong with the case file or with what a run sets.
    pub fn loaded(&self, expected: &Expected) -> Result<Vec<(String, LoadedCase)>, String> {
        let alone = [Run::default()];
        let runs = if expected.runs.is_empty() { &alone } else { &expected.runs[..] };
        let load = |run: &Run| {
            let named =
                |name: &String| self.others.iter().find(|other| other.0 == name).ok_or(format!("no case `{name}`"));
            let text = run.case.as_ref().map_or(Ok(&*self.case), |name| named(name).map(|other| other.1))?;
            let loaded = case::parse(Path::new(CASE), text, &run.set).map_err(|error| error.to_string())?;
            Ok((run.name.clone(), loaded))
        };
        runs.iter().map(load).collect()
    }

    /// Runs the case `name` and takes the values and curves that are declared.
    ///
    /// # Errors
    /// Why a run ended early, or a value cannot be had.
    pub fn measure(&self, name: &str, expected: &Expected, manner: Manner<'_>) -> Result<Outcome, String> {
        let mut runs = Vec::new();
        for (n, (run, loaded)) in self.loaded(expected)?.into_iter().enumerate() {
            let whole = WholeRun::of(name, n, &loaded, manner).map_err(|problem| format!("run `{run}`: {problem}"))?;
            runs.push(Finished { name: run, loaded, whole });
        }
        let mut values: BTreeMap<&str, Real> = BTreeMap::new();
        for quantity in &expected.quantities {
            if quantity.value.is_some() {
                let value = self.value(expected, quantity, &runs, &values);
                values.insert(&quantity.name, value.map_err(|problem| format!("`{}`: {problem}", quantity.name))?);
            }
        }
        let values = values.into_iter().map(|(name, value)| (name.to_owned(), value)).collect();
        let curves = expected.charts.iter().map(|curves| self.chart(expected, curves, &runs));
        Ok(Outcome { values, curves: curves.collect::<Result<_, _>>()? })
    }

    fn value(
        &self,
        expected: &Expected,
        quantity: &Quantity,
        runs: &[Finished],
        above: &BTreeMap<&str, Real>,
    ) -> Result<Real, String> {
        let named = |name: &str| above.get(name).copied().ok_or_else(|| format!("`{name}` is not measured"));
        let other = |other: &Option<Other>, none: Real| match other {
            None => Ok(none),
            Some(Other::Number(number)) => Ok(*number),
            Some(Other::Quantity(name)) => named(name),
            Some(Other::Taken(taken)) => self.taken(expected, quantity, taken, runs),
        };
        let found = if quantity.of.is_empty() {
            self.taken(expected, quantity, &Taken::default(), runs)?
        } else {
            let errors: Result<Vec<Real>, String> = quantity.of.iter().map(|name| named(name)).collect();
            order(&errors?)
        };
        let found = found / other(&quantity.over, 1.0)? - other(&quantity.minus, 0.0)?;
        Ok(if quantity.absolute { found.abs() } else { found })
    }

    /// The value of `quantity` where `taken` says nothing else.
    fn taken(
        &self,
        expected: &Expected,
        quantity: &Quantity,
        taken: &Taken,
        runs: &[Finished],
    ) -> Result<Real, String> {
        let Some(value) = taken.value.as_ref().or(quantity.value.as_ref()) else {
            return Err("it has no value".into());
        };
        let run = &runs[expected.run(taken.run.as_deref().or(quantity.run.as_deref()))?];
        let from = taken.from.as_ref().or(quantity.from.as_ref()).unwrap_or(&expected.from);
        let when = taken.when.or(quantity.when);
        match &quantity.beside {
            None if value.function == Function::Slope => value.function.of(&run.along(from, &value.columns, when)?),
            None => value.function.of(&run.course(from, &value.columns, when)?),
            Some(beside) => value.function.beside(&run.beside(from, &value.columns, when)?, beside, &self.reference),
        }
    }

    fn chart(&self, expected: &Expected, curves: &Curves, runs: &[Finished]) -> Result<Chart, String> {
        let [x, y] = &curves.axes;
        let mut chart = Chart::new(&curves.title, x, y);
        let units = curves.beside.as_ref().map_or([1.0; 2], |beside| [beside.x_unit, beside.y_unit]);
        for run in runs.iter().filter(|run| curves.runs.is_empty() || curves.runs.contains(&run.name)) {
            let course = run.beside(curves.from.as_ref().unwrap_or(&expected.from), &curves.value, None)?;
            let scaled: Course = course.iter().map(|[x, y]| [x / units[0], y / units[1]]).collect();
            chart = chart.computed(if run.name.is_empty() { "computed" } else { &run.name }, &scaled);
        }
        if let Some(beside) = &curves.beside {
            chart = chart.reference(&curves.reference, &Beside::table(beside, &self.reference)?);
        }
        Ok(chart)
    }
}

/// A run that has ended.
struct Finished {
    name: String,
    loaded: LoadedCase,
    whole: WholeRun,
}

impl Finished {
    /// Course of a sum of columns between two times; of a line of points, all their values one point after the other, unless
    /// the columns name one.
    fn course(&self, from: &str, columns: &Columns, when: Option<[Real; 2]>) -> Result<Course, String> {
        let is_one = columns.0.iter().any(|(_, name)| name.contains("_at_"));
        let points = if is_one { 0 } else { self.line(from).map_or(0, |places| places.len()) };
        let at = |n: usize| self.columns(from, columns, if points > 0 { format!("_at_{n}") } else { String::new() });
        let mut course = Course::new();
        for n in 0..points.max(1) {
            course.extend(at(n)?);
        }
        let [start, end] = when.unwrap_or([Real::NEG_INFINITY, Real::INFINITY]);
        course.retain(|row| {
            row[1].is_finite() && row[0] >= start - 1e-9 * start.abs() && row[0] <= end + 1e-9 * end.abs()
        });
        Ok(course)
    }

    /// What goes beside a reference: the course in time or, of a line of points, the values along it at the last of the times.
    fn beside(&self, from: &str, columns: &Columns, when: Option<[Real; 2]>) -> Result<Course, String> {
        let course = self.course(from, columns, when)?;
        let Some(places) = self.line(from) else { return Ok(course) };
        let last = course.iter().map(|row| row[0]).fold(Real::NEG_INFINITY, Real::max);
        let values: Vec<Real> = course.iter().filter(|row| row[0] == last).map(|row| row[1]).collect();
        if values.len() != places.len() {
            return Err(format!("{from} has values at {} of {} points at {last} s", values.len(), places.len()));
        }
        Ok(places.into_iter().zip(values).map(|(place, value)| [place, value]).collect())
    }

    /// Values along `x` at the last of the times, of a table with such places; else the course in time.
    fn along(&self, from: &str, columns: &Columns, when: Option<[Real; 2]>) -> Result<Course, String> {
        let course = self.course(from, columns, when)?;
        let Ok([times, places]) = self.whole.columns(from, ["time", "x"]) else { return Ok(course) };
        let last = course.iter().map(|row| row[0]).fold(Real::NEG_INFINITY, Real::max);
        let values = self.columns(from, columns, String::new())?;
        let rows = places.into_iter().zip(values).zip(times).filter(|(_, time)| *time == last);
        Ok(rows.map(|((place, row), _)| [place, row[1]]).filter(|row| row[1].is_finite()).collect())
    }

    /// Distances along the line of a probe from its first point \[m], if `from` is the table of one.
    fn line(&self, from: &str) -> Option<Vec<Real>> {
        let name = from.strip_prefix("probes/")?.strip_suffix(".csv")?;
        let probe = self.loaded.case.probes.iter().find(|probe| probe.name == name)?;
        let ProbePlace::Line { from, to, points } = &probe.place else { return None };
        let spacing = (*to - *from).length() / (points - 1) as Real;
        Some((0..*points).map(|n| spacing * n as Real).collect())
    }

    /// Times and sums of columns, `suffix` added to their names.
    fn columns(&self, from: &str, columns: &Columns, suffix: String) -> Result<Course, String> {
        let mut course = Course::new();
        for (minus, name) in &columns.0 {
            let [time, values] = self.whole.columns(from, ["time", &format!("{name}{suffix}")])?;
            if course.is_empty() {
                course = time.into_iter().map(|time| [time, 0.0]).collect();
            }
            for (row, value) in course.iter_mut().zip(values) {
                row[1] += if *minus { -value } else { value };
            }
        }
        Ok(course)
    }
}

#[cfg(test)]
mod tests {
    use sazanami::stop::Stop;

    use super::*;

    /// A ball in a void, thrown upwards; it comes back after 2 v/g.
    const BALL: &str = r#"
solver = "mps"
gravity = "10 m/s^2"
domain.size = ["1 m", "1 m", "2 m"]
particles = { spacing = "0.1 m", dt_max = "1 ms" }
material.steel.density = "7800 kg/m^3"
contact.default = { normal_stiffness = "1e6 N/m", restitution = 1.0, friction = 0 }
run.until = "0.7 s"
output = { fields = { at = [] }, figures = { at = [] }, series = { every = "10 ms" } }
[[grains]]
name = "ball"
shape.sphere.diameter = "0.1 m"
placement.list = [{ position = ["0.5 m", "0.5 m", "0.5 m"], velocity = ["0 m/s", "0 m/s", "3 m/s"] }]
[[probe]]
name = "ball"
body = {}
every = "10 ms"
"#;
    const EXPECTED: &str = r#"
about = "a test"
cost = 1
from = "probes/ball.csv"
[[run]]
name = "up"
[[run]]
name = "half"
set = ["gravity=5 m/s^2"]
[[quantity]]
name = "height"
run = "up"
value = "max(position_3)"
minus = 0.5
band = [0.4499, 0.4501]
source = "v^2/2g"
[[quantity]]
name = "half: height"
run = "half"
value = "max(position_3)"
minus = 0.5
band = [0.8999, 0.9001]
source = "v^2/2g"
[[quantity]]
name = "ratio of the heights"
run = "half"
value = "max(position_3)"
over = { run = "up" }
band = [1.4735, 1.4739]
source = "(0.5 + v^2/g)/(0.5 + v^2/2g)"
[[quantity]]
name = "speed after a tenth of a second over that at the start"
run = "up"
value = "last(velocity_3)"
when = [0.0, 0.1]
over = { value = "first(velocity_3)" }
band = [0.6666, 0.6667]
source = "v - g t"
[[quantity]]
name = "order"
value = "order()"
of = ["half: height", "height"]
band = [0.999, 1.001]
source = "by hand"
[[quantity]]
name = "course"
run = "up"
value = "largest(position_3)"
beside = { x = "t", y = "z", range = [0.0, 0.6] }
band = [0.0, 1e-3]
source = "by hand"
[[quantity]]
name = "control: half the gravity"
run = "half"
value = "largest(position_3)"
beside = { x = "t", y = "z", range = [0.0, 0.6] }
band = [0.1, inf]
source = "negative control"
[[chart]]
title = "Height"
axes = ["time", "height"]
value = "position_3"
beside = { x = "t", y = "z" }
reference = "exact"
"#;

    #[test]
    fn a_ball_thrown_upwards_is_measured_as_declared() {
        let posed = Posed { case: BALL.into(), others: &[], reference: "t,z\n0,0.5\n0.3,0.95\n0.6,0.5\n".into() };
        let expected = Expected::parse(EXPECTED).unwrap();
        let outcome = posed.measure("thrown-ball", &expected, Manner::passing(&Stop::new())).unwrap();
        let rows = crate::judge::judge("thrown-ball", &expected, &outcome);
        assert!(rows.iter().all(|row| !row.verdict.is_bad()), "{}", crate::verify::table(&rows));
        assert_eq!(outcome.curves[0].series.len(), 3);
        for (from, to) in [
            ("run = \"half\"", "run = \"quarter\""),
            ("[[quantity]]\nname = \"height\"\nrun = \"up\"", "[[quantity]]\nname = \"height\""),
            ("of = [\"half: height\", \"height\"]", "of = [\"half: height\", \"width\"]"),
            ("name = \"half\"", "name = \"other\""),
            ("value = \"max(position_3)\"\nminus", "minus"),
            ("over = { run = \"up\" }", "over = { run = \"half\" }"),
            ("over = { value = \"first(velocity_3)\" }", "minus = { when = [0.0, 0.1] }"),
        ] {
            assert!(EXPECTED.contains(from), "{from}");
            assert!(Expected::parse(&EXPECTED.replacen(from, to, 1)).is_err(), "{to}");
        }
        let missing = EXPECTED.replace("value = \"max(position_3)\"", "value = \"max(position_4)\"");
        let refused =
            |text: &str| posed.measure("thrown-ball", &Expected::parse(text).unwrap(), Manner::passing(&Stop::new()));
        assert!(refused(&missing).unwrap_err().contains("position_4"));
        // Times beyond the end of the run, beside a reference.
        let taken = "value = \"largest(position_3)\"";
        let beyond = EXPECTED.replacen(taken, &format!("when = [1.0, 2.0]\n{taken}"), 1);
        assert_eq!(refused(&beyond).unwrap_err(), "`course`: no row has a value");
    }
}
