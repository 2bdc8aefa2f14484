//! What is taken of a column of results: `max(-velocity_3)`.
//!
//! A function of columns that are added or subtracted, and nothing that combines functions: what needs more is a program.

use sazanami_numerics::Real;
use sazanami_observe::fit::line;
use serde::Deserialize;
use serde::de::IntoDeserializer as _;

use crate::reference;

/// A function of columns.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(try_from = "String")]
pub struct Value {
    /// The function.
    pub function: Function,
    /// Its argument.
    pub columns: Columns,
}

/// Columns that are added, each with its sign.
#[derive(Clone, Debug, Default, PartialEq, Eq, Deserialize)]
#[serde(try_from = "String")]
pub struct Columns(pub Vec<(bool, String)>);

/// Rows of `reference.csv` and how they compare with columns of the results.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Beside {
    /// First cell of the rows; empty for all of them.
    #[serde(default)]
    pub rows: String,
    /// Column of the abscissa: time, or distance along a line of points from its first one.
    pub x: String,
    /// Column of the values.
    pub y: String,
    /// Unit of the abscissa there, in s or m.
    #[serde(default = "one")]
    pub x_unit: Real,
    /// Unit of the values there, in SI units.
    #[serde(default = "one")]
    pub y_unit: Real,
    /// Abscissas that count, in the unit of the table; none: all.
    pub range: Option<[Real; 2]>,
    /// Most that the clock of the reference may be shifted either way, in the unit of the table.
    pub shift: Option<Real>,
    /// Whether distances are divided by the reference.
    #[serde(default)]
    pub relative: bool,
}

const fn one() -> Real {
    1.0
}

/// Functions of the rows of a column.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Function {
    /// First value.
    First,
    /// Last value.
    Last,
    /// Largest value.
    Max,
    /// Smallest value.
    Min,
    /// Mean of the rows.
    Mean,
    /// Root mean square; beside a reference, of the distance.
    Rms,
    /// Largest magnitude; beside a reference, of the distance.
    Largest,
    /// Change from the first to the last row over the time between them.
    Rate,
    /// Largest less smallest value.
    Range,
    /// Mean period of passes through the mean.
    Period,
    /// Slope of the straight line of least squares; of a table with places along `x`, over these at the last of the times.
    Slope,
    /// Way up to the largest value and down to the last one with all turns between, over that value, less that of a course
    /// that only rises up to it and falls from it, plus 1: 1 where nothing turns back.
    Variation,
    /// Time at which it first lies above a number (below, where the flag is set).
    Time(bool, Real),
    /// Shift of the reference's clock with the least distance.
    Shift,
    /// Smallest observed order of convergence of other quantities.
    Order,
}

impl TryFrom<String> for Value {
    type Error = String;

    fn try_from(text: String) -> Result<Self, String> {
        let (name, rest) = text.split_once('(').ok_or_else(|| format!("`{text}`: expected FUNCTION(COLUMNS)"))?;
        let argument = rest.strip_suffix(')').ok_or_else(|| format!("`{text}`: expected `)` at its end"))?;
        if name == "time" {
            let below = argument.contains('<');
            let (columns, number) =
                argument.split_once(['<', '>']).ok_or_else(|| format!("`{text}`: expected COLUMN > NUMBER"))?;
            let number = number.trim().parse().map_err(|_| format!("`{number}` is no number"))?;
            return Ok(Self { function: Function::Time(below, number), columns: columns.to_owned().try_into()? });
        }
        let known = Function::deserialize(name.into_deserializer());
        let function = known.map_err(|error: serde::de::value::Error| format!("`{text}`: {error}"))?;
        match (function, argument) {
            (Function::Order, "") => Ok(Self { function, columns: Columns::default() }),
            (Function::Order, _) => Err(format!("`{text}`: an order is of other quantities")),
            _ => Ok(Self { function, columns: argument.to_owned().try_into()? }),
        }
    }
}

impl TryFrom<String> for Columns {
    type Error = String;

    fn try_from(text: String) -> Result<Self, String> {
        let spaced = text.replace('-', " - ").replace('+', " + ");
        let (mut found, mut minus) = (Vec::new(), false);
        for word in spaced.split_whitespace() {
            match word {
                "+" => (),
                "-" => minus = true,
                _ if word.chars().all(|c| c.is_ascii_alphanumeric() || c == '_') => {
                    found.push((minus, word.to_owned()));
                    minus = false;
                }
                _ => return Err(format!("`{word}` is no column")),
            }
        }
        if found.is_empty() { Err(format!("`{text}` names no column")) } else { Ok(Self(found)) }
    }
}

/// Time (or place) and value of each row.
pub type Course = Vec<[Real; 2]>;

/// Why an empty course has no value.
const NO_ROW: &str = "no row has a value";

impl Function {
    /// Of a `course` in the order of time.
    ///
    /// # Errors
    /// Why there is no such value.
    pub fn of(self, course: &[[Real; 2]]) -> Result<Real, String> {
        let (Some(first), Some(last)) = (course.first(), course.last()) else {
            return Err(NO_ROW.into());
        };
        let count = course.len() as Real;
        let values = || course.iter().map(|row| row[1]);
        let max = values().fold(Real::NEG_INFINITY, Real::max);
        Ok(match self {
            Self::First => first[1],
            Self::Last => last[1],
            Self::Max => max,
            Self::Min => values().fold(Real::INFINITY, Real::min),
            Self::Mean => values().sum::<Real>() / count,
            Self::Rms => (values().map(|v| v * v).sum::<Real>() / count).sqrt(),
            Self::Largest => values().map(Real::abs).fold(0.0, Real::max),
            Self::Rate if course.len() > 1 => (last[1] - first[1]) / (last[0] - first[0]),
            Self::Rate => return Err("a rate needs two rows".into()),
            Self::Range => max - values().fold(Real::INFINITY, Real::min),
            Self::Period => period(course).ok_or("it does not swing about its mean")?,
            Self::Slope => {
                let points: Vec<(Real, Real)> = course.iter().map(|&[x, y]| (x, y)).collect();
                line(&points).ok_or("a slope needs two places")?.slope
            }
            Self::Variation => {
                let way: Real = course.windows(2).map(|pair| (pair[1][1] - pair[0][1]).abs()).sum();
                (way - (max - last[1])) / (max - first[1])
            }
            Self::Time(below, level) => {
                let sign = if below { -1.0 } else { 1.0 };
                passes(course, level).find(|pass| sign * pass[1] > 0.0).ok_or("it never does")?[0]
            }
            Self::Shift | Self::Order => return Err("only beside a reference, or of other quantities".into()),
        })
    }

    /// Of the distances of `course` from its reference.
    ///
    /// # Errors
    /// Why there is none.
    pub fn beside(self, course: &[[Real; 2]], beside: &Beside, csv: &str) -> Result<Real, String> {
        if course.is_empty() {
            return Err(NO_ROW.into());
        }
        let table = beside.table(csv)?;
        let course: Course = course.iter().map(|[x, y]| [x / beside.x_unit, y / beside.y_unit]).collect();
        let off = |shift: Real| -> Course {
            let distance = |&[x, y]: &[Real; 2]| {
                let distance = at(&course, x + shift) - y;
                [x, if beside.relative { distance / y } else { distance }]
            };
            table.iter().map(distance).collect()
        };
        let [from, to] = [table[0][0], table[table.len() - 1][0]];
        let most = beside.shift.unwrap_or_default();
        // One row stands for all times: a course that stays.
        if course.len() > 1 && (from < course[0][0] - 1e-9 || to + most > course[course.len() - 1][0] + 1e-9) {
            return Err(format!("the reference goes from {from} to {to}, beyond the run"));
        }
        let kind = if self == Self::Shift { Self::Rms } else { self };
        let [shift, error] = best_shift(most, |shift| kind.of(&off(shift)).unwrap_or(Real::INFINITY));
        if !error.is_finite() {
            return Err(kind.of(&off(0.0)).err().unwrap_or_else(|| "no shift gives a finite distance".into()));
        }
        Ok(if self == Self::Shift { shift } else { error })
    }
}

impl Beside {
    /// Abscissas and values in its own units, by abscissa.
    ///
    /// # Errors
    /// If there are none.
    pub fn table(&self, csv: &str) -> Result<Course, String> {
        let mut table: Course = reference::rows(csv, &self.rows, [&self.x, &self.y]);
        if let Some([low, high]) = self.range {
            table.retain(|row| low <= row[0] && row[0] <= high);
        }
        table.sort_by(|a, b| a[0].total_cmp(&b[0]));
        if table.is_empty() {
            return Err(format!("reference.csv has no rows `{}` with {} and {}", self.rows, self.x, self.y));
        }
        Ok(table)
    }
}

/// The shift of a clock, no more than `most` either way, with the least `error`, and that error. It is the error that is
/// judged: the shift is what is allowed for it.
fn best_shift(most: Real, error: impl Fn(Real) -> Real) -> [Real; 2] {
    let steps = (most / 0.005).round() as i32;
    let tried = (-steps..=steps).map(|n| 0.005 * Real::from(n)).map(|shift| [shift, error(shift)]);
    tried.fold([0.0, Real::INFINITY], |best, now| if now[1] < best[1] { now } else { best })
}

/// Value of a course that has rows at `x`, linear between them, that of the nearest row outside.
fn at(course: &[[Real; 2]], x: Real) -> Real {
    let after = course.partition_point(|row| row[0] < x).clamp(1, course.len().max(2) - 1);
    let (Some(a), Some(b)) = (course.get(after - 1), course.get(after)) else { return course[0][1] };
    a[1] + (b[1] - a[1]) * ((x - a[0]) / (b[0] - a[0])).clamp(0.0, 1.0)
}

/// Times at which a course passes `level`, and the change of the value there.
fn passes(course: &[[Real; 2]], level: Real) -> impl Iterator<Item = [Real; 2]> {
    let pass = move |pair: &[[Real; 2]]| {
        let [before, after] = [pair[0][1] - level, pair[1][1] - level];
        let time = pair[0][0] + (pair[1][0] - pair[0][0]) * before / (before - after);
        (before * after < 0.0 || before == 0.0 && after != 0.0).then_some([time, after - before])
    };
    course.windows(2).filter_map(pass)
}

/// Mean period of a course that swings about its mean, from its passes in one direction.
fn period(course: &[[Real; 2]]) -> Option<Real> {
    let mean = course.iter().map(|row| row[1]).sum::<Real>() / course.len() as Real;
    let times: Vec<Real> = passes(course, mean).map(|pass| pass[0]).collect();
    let whole = times.len().checked_sub(1)? / 2;
    (whole > 0).then(|| (times[2 * whole] - times[0]) / whole as Real)
}

/// Smallest observed order of `errors`, each from twice as fine as the one before.
#[must_use]
pub fn order(errors: &[Real]) -> Real {
    let orders = errors.windows(2).map(|pair| (pair[0] / pair[1]).log2());
    orders.fold(Real::INFINITY, |least, order| if order < least || order.is_nan() { order } else { least })
}

#[cfg(test)]
mod tests {
    use std::f64::consts::PI;

    use super::*;

    fn value(text: &str) -> Result<Value, String> {
        text.to_owned().try_into()
    }

    fn of(text: &str, course: &[[Real; 2]]) -> Result<Real, String> {
        value(text).and_then(|value| value.function.of(course))
    }

    #[test]
    fn a_period_is_read_from_its_passes() {
        let level = |t: Real| 0.05 + 0.002 * (2.0 * PI * t / 0.5).cos();
        let course: Course = (0..200).map(|n| 0.01 * Real::from(n)).map(|t| [t, level(t)]).collect();
        assert!((of("period(level)", &course).unwrap() - 0.5).abs() < 1e-4);
        let still: Course = course.iter().map(|row| [row[0], 1.0]).collect();
        assert!(of("period(level)", &still).is_err());
    }

    #[test]
    fn functions_are_those_of_the_rows() {
        let course = [[0.0, 0.0], [1.0, 3.0], [2.0, 2.0], [4.0, 4.0], [5.0, -1.0]];
        for (text, expected) in [
            ("first(x)", 0.0),
            ("last(x)", -1.0),
            ("max(x)", 4.0),
            ("min(x)", -1.0),
            ("mean(x)", 1.6),
            ("rms(x)", 6.0_f64.sqrt()),
            ("largest(x)", 4.0),
            ("rate(x)", -0.2),
            // Sums of products with the distances from the mean time, 2.4: -1.2 over 17.2.
            ("slope(x)", -1.2 / 17.2),
            // Down by 1 and up again.
            ("variation(x)", 1.5),
            ("time(x > 1.5)", 0.5),
            ("time(x < 1.5)", 4.5),
        ] {
            assert!((of(text, &course).unwrap() - expected).abs() < 1e-12, "{text}");
        }
        assert!(
            of("time(x > 9)", &course).is_err()
                && of("max(x)", &[]).is_err()
                && of("rate(x)", &course[..1]).is_err()
                && of("slope(x)", &course[..1]).is_err()
        );
    }

    #[test]
    fn what_is_no_value_is_refused() {
        let sum = value("max(-velocity_3 + drift)").unwrap();
        assert_eq!(sum.columns.0, [(true, "velocity_3".to_owned()), (false, "drift".to_owned())]);
        for text in
            ["max", "max(x", "most(x)", "max()", "max(2*x)", "max(min(x))", "time(x)", "time(x > y)", "order(x)"]
        {
            assert!(value(text).is_err(), "{text}");
        }
    }

    #[test]
    fn distances_are_those_from_the_table() {
        let csv = "kind,t,x\nfront,1,2\nfront,2,4\nother,1,9\n";
        let text = "rows = \"front\"\nx = \"t\"\ny = \"x\"\nx_unit = 2.0\ny_unit = 10.0\n";
        let beside = |more: &str| -> Beside { toml::from_str(&format!("{text}{more}")).unwrap() };
        assert_eq!(Function::Largest.beside(&[], &beside(""), csv).unwrap_err(), NO_ROW);
        // One row stands for all times.
        assert!((Function::Largest.beside(&[[0.0, 0.0]], &beside(""), csv).unwrap() - 4.0).abs() < 1e-9);
        // Twice as fast as the table from a start half a unit later.
        let course: Course = (0..=8).map(Real::from).map(|t| [t, 10.0 * (2.0 * (0.5 * t - 0.1))]).collect();
        let near = |function: Function, more: &str, expected: Real| {
            let found = function.beside(&course, &beside(more), csv).unwrap();
            assert!((found - expected).abs() < 1e-9, "{function:?} {more}: {found}");
        };
        near(Function::Rms, "", 0.2);
        near(Function::Largest, "relative = true", 0.1);
        near(Function::Rms, "shift = 0.2", 0.0);
        near(Function::Shift, "shift = 0.2", 0.1);
        near(Function::Largest, "range = [1.5, 3.0]", 0.2);
        // A run that ends too early, rows that are not there; a single row stays.
        assert!(Function::Rms.beside(&course[..3], &beside(""), csv).is_err());
        assert!(beside("").table("kind,t,x\nother,1,9\n").is_err());
        assert!((Function::Largest.beside(&course[..1], &beside(""), csv).unwrap() - 4.2).abs() < 1e-9);
        assert!((order(&[8.0, 2.0, 1.0]) - 1.0).abs() < 1e-12 && order(&[1.0, -1.0]).is_nan());
    }
}
