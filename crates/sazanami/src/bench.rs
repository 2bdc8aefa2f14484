//! Timing of kernels and whole steps on this machine.

use std::time::Instant;

use sazanami_numerics::Real;
use serde::Serialize;

use crate::error::CommandError;
use crate::progress::Progress;
use crate::verify::unknown;

/// One timing.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct BenchRow {
    /// Name of the benchmark.
    pub name: String,
    /// Unit of the values.
    pub unit: String,
    /// Median over the runs.
    pub median: Real,
    /// Smallest value.
    pub min: Real,
    /// Largest value.
    pub max: Real,
    /// How many runs.
    pub runs: usize,
    /// Threads.
    pub threads: usize,
    /// Size of the problem, in words.
    pub size: String,
    /// Least possible value on this machine, if it can be told.
    pub floor: Option<Real>,
    /// How the floor was found.
    pub floor_how: String,
}

/// What a benchmark found: its values and what they are values of.
#[derive(Clone, Debug, PartialEq)]
pub struct Timing {
    /// Unit of the values.
    pub unit: &'static str,
    /// One value per run.
    pub values: Vec<Real>,
    /// Size of the problem, in words.
    pub size: String,
    /// Least possible value on this machine.
    pub floor: Option<Real>,
    /// How the floor was found.
    pub floor_how: String,
}

impl Timing {
    /// Runs `work` once to warm up and then `runs` times; seconds per run.
    pub fn of(size: impl Into<String>, runs: usize, mut work: impl FnMut()) -> Self {
        work();
        let values = (0..runs.max(1))
            .map(|_| {
                let start = Instant::now();
                work();
                start.elapsed().as_secs_f64()
            })
            .collect();
        Self { unit: "s", values, size: size.into(), floor: None, floor_how: String::new() }
    }

    /// Adds the least possible value and how it was found.
    #[must_use]
    pub fn with_floor(self, floor: Real, how: impl Into<String>) -> Self {
        Self { floor: Some(floor), floor_how: how.into(), ..self }
    }

    fn row(mut self, name: &str, threads: usize) -> BenchRow {
        self.values.sort_by(Real::total_cmp);
        let count = self.values.len();
        let at = |n: usize| self.values.get(n).copied().unwrap_or(0.0);
        let middle = count / 2;
        let median = if count % 2 == 1 { at(middle) } else { 0.5 * (at(middle.saturating_sub(1)) + at(middle)) };
        BenchRow {
            name: name.to_owned(),
            unit: self.unit.to_owned(),
            median,
            min: at(0),
            max: at(count.saturating_sub(1)),
            runs: count,
            threads,
            size: self.size,
            floor: self.floor,
            floor_how: self.floor_how,
        }
    }
}

/// A benchmark.
#[derive(Clone, Copy, Debug)]
pub struct Bench {
    /// Name on the command line.
    pub name: &'static str,
    /// What it times, in one line.
    pub about: &'static str,
    /// Times it.
    pub time: fn() -> Result<Timing, String>,
}

/// The benchmarks of this version.
#[must_use]
pub const fn benches() -> &'static [Bench] {
    &[]
}

/// Runs the benchmarks called `names`, or all of them; `threads` is what they run on.
///
/// # Errors
/// If a name is not known, or a benchmark fails.
pub fn bench(
    benches: &[Bench],
    names: &[String],
    threads: usize,
    progress: &mut dyn Progress,
) -> Result<Vec<BenchRow>, CommandError> {
    let known: Vec<&str> = benches.iter().map(|bench| bench.name).collect();
    if let Some(name) = names.iter().find(|name| !known.contains(&name.as_str())) {
        return Err(unknown("benchmark", name, &known));
    }
    let mut rows = Vec::new();
    for bench in benches.iter().filter(|bench| names.is_empty() || names.iter().any(|name| name == bench.name)) {
        progress.message(&format!("{}: {}", bench.name, bench.about));
        let timing = (bench.time)().map_err(|message| crate::error::Failure {
            kind: "bench",
            message: format!("{}: {message}", bench.name),
            ..Default::default()
        })?;
        rows.push(timing.row(bench.name, threads));
    }
    Ok(rows)
}

/// The rows as a table for people.
#[must_use]
pub fn table(rows: &[BenchRow]) -> String {
    let mut text = format!(
        "{:<24} {:>11} {:>11} {:>11} {:>5} {:>5} {:>8} {:>11}  size\n",
        "name", "median", "min", "max", "unit", "runs", "threads", "floor"
    );
    for row in rows {
        let floor = row.floor.map_or_else(|| "-".to_owned(), |floor| format!("{floor:.4}"));
        text.push_str(&format!(
            "{:<24} {:>11.4} {:>11.4} {:>11.4} {:>5} {:>5} {:>8} {:>11}  {}\n",
            row.name, row.median, row.min, row.max, row.unit, row.runs, row.threads, floor, row.size
        ));
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::progress::Silent;

    #[test]
    fn medians_and_names_are_right() {
        let timing = |values: &[Real]| Timing {
            unit: "s",
            values: values.to_vec(),
            size: "small".into(),
            floor: None,
            floor_how: String::new(),
        };
        let row = timing(&[3.0, 1.0, 2.0]).with_floor(0.5, "by hand").row("x", 2);
        assert_eq!((row.median, row.min, row.max, row.runs, row.floor), (2.0, 1.0, 3.0, 3, Some(0.5)));
        assert_eq!(timing(&[4.0, 1.0, 2.0, 3.0]).row("x", 1).median, 2.5);
        let benches = [Bench { name: "nothing", about: "does nothing", time: || Ok(Timing::of("none", 3, || ())) }];
        assert_eq!(bench(&benches, &[], 1, &mut Silent).unwrap().len(), 1);
        assert_eq!(bench(&benches, &["nothin".into()], 1, &mut Silent).unwrap_err().exit_code(), 2);
    }
}
