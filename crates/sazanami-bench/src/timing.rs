//! Results of a benchmark.

use sazanami_numerics::Real;
use serde::Serialize;

use crate::stopwatch::{Lap, Stopwatch};

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
    /// Number of runs.
    pub runs: usize,
    /// Threads of each rank.
    pub threads: usize,
    /// Number of ranks.
    pub ranks: usize,
    /// Size of the problem, in words.
    pub size: String,
    /// Least possible value on this machine, if it is known.
    pub floor: Option<Real>,
    /// Derivation of the floor.
    pub floor_how: String,
    /// Median processor time, all threads together, in the unit of the values; absent where it means nothing.
    pub cpu: Option<Real>,
    /// Processors that other programs kept busy meanwhile, if the system reports it.
    pub busy_elsewhere: Option<Real>,
}

/// Result of a benchmark: values and their meaning.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Timing {
    /// Unit of the values.
    pub unit: &'static str,
    /// One value per run.
    pub values: Vec<Real>,
    /// Processor time of each run, all threads together, in the same unit; empty where it means nothing.
    pub cpu: Vec<Real>,
    /// Processors that other programs kept busy meanwhile.
    pub busy_elsewhere: Option<Real>,
    /// Size of the problem, in words.
    pub size: String,
    /// Least possible value on this machine.
    pub floor: Option<Real>,
    /// Derivation of the floor.
    pub floor_how: String,
}

impl Timing {
    /// Runs `work` once to warm up and then `runs` times; seconds per run.
    pub fn of(size: impl Into<String>, runs: usize, mut work: impl FnMut()) -> Self {
        let timing = Self::of_laps(runs.max(1), |_| {
            let watch = Stopwatch::start();
            work();
            Ok(watch.stop())
        });
        Self { size: size.into(), ..timing.unwrap_or_default() }
    }

    /// Runs `work` once to warm up and then `runs` times, each with its number; seconds of the laps that it returns.
    pub(crate) fn of_laps(runs: usize, mut work: impl FnMut(usize) -> Result<Lap, String>) -> Result<Self, String> {
        let mut timing = Self { unit: "s", ..Self::default() };
        for run in 0..=runs {
            let lap = work(run)?;
            if run > 0 {
                timing.add(&lap, 1.0);
            }
        }
        Ok(timing)
    }

    /// Adds a run; `factor` turns seconds into the unit of the values.
    pub(crate) fn add(&mut self, lap: &Lap, factor: Real) {
        let runs = self.values.len() as Real;
        self.values.push(factor * lap.wall);
        self.cpu.extend(lap.cpu.map(|cpu| factor * cpu));
        self.busy_elsewhere =
            lap.busy_elsewhere.map(|busy| (self.busy_elsewhere.unwrap_or(0.0) * runs + busy) / (runs + 1.0));
    }

    /// Adds the least possible value and how it was found.
    #[must_use]
    pub fn with_floor(self, floor: Real, how: impl Into<String>) -> Self {
        Self { floor: Some(floor), floor_how: how.into(), ..self }
    }

    pub(crate) fn row(self, name: &str, threads: usize, ranks: usize) -> BenchRow {
        let [least, middle, most] = spread(&self.values).unwrap_or_default();
        BenchRow {
            name: name.to_owned(),
            unit: self.unit.to_owned(),
            median: middle,
            min: least,
            max: most,
            runs: self.values.len(),
            threads,
            ranks,
            size: self.size,
            floor: self.floor,
            floor_how: self.floor_how,
            cpu: spread(&self.cpu).map(|[_, middle, _]| middle),
            busy_elsewhere: self.busy_elsewhere,
        }
    }
}

/// Names of the phases that took any time, with their shares of all `times`.
pub(crate) fn shares(phases: &[(&str, Real)]) -> String {
    let all: Real = phases.iter().map(|(_, time)| time).sum();
    let shares = phases.iter().map(|(name, time)| (name, (100.0 * time / all.max(1e-300)).round()));
    let parts = shares.filter(|(_, share)| *share > 0.0).map(|(name, share)| format!("{name} {share} %"));
    parts.collect::<Vec<String>>().join(", ")
}

/// Least, median and largest of some values.
pub(crate) fn spread(values: &[Real]) -> Option<[Real; 3]> {
    let mut sorted = values.to_vec();
    sorted.sort_by(Real::total_cmp);
    let (least, most) = (*sorted.first()?, *sorted.last()?);
    let middle = sorted.len() / 2;
    let median = if sorted.len() % 2 == 1 { sorted[middle] } else { 0.5 * (sorted[middle - 1] + sorted[middle]) };
    Some([least, median, most])
}
