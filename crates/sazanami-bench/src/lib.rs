//! Timing of kernels and whole steps on this machine.
//!
//! ```
//! use sazanami_bench::Timing;
//!
//! let timing = Timing::of("1000 numbers", 3, || drop((0..1000).sum::<u64>()));
//! assert!(timing.values.len() == 3 && timing.values.iter().all(|&seconds| seconds >= 0.0));
//! ```

mod beds;
mod contacts;
mod coupling;
mod fluid;
mod machine;
mod particles;
pub mod scaling;
mod stopwatch;
mod timing;

pub use timing::{BenchRow, Timing};

use sazanami_numerics::Real;
use sazanami_parallel::{Communicator, Processes, RanksFailed, Sums, run_ranks, with_threads};

use sazanami::error::CommandError;
use sazanami::followers;
use sazanami::progress::Progress;

/// A benchmark.
#[derive(Clone, Copy, Debug)]
pub struct Bench {
    /// Name on the command line.
    pub name: &'static str,
    /// Subject, in one line.
    pub about: &'static str,
    /// Function that runs and times it.
    pub time: Time,
}

/// Timing of a benchmark.
#[derive(Clone, Copy, Debug)]
pub enum Time {
    /// On one rank.
    Alone(Alone),
    /// On any number of ranks, each of which calls it.
    Shared(Shared),
}

/// Cases and machine that benchmarks run on.
#[derive(Clone, Debug)]
pub struct Place {
    /// Threads of each rank.
    pub threads: usize,
    /// Ranks within this process.
    pub ranks: usize,
    /// The processes of a launcher, each of which is a rank instead.
    pub processes: Option<Processes>,
}

impl Place {
    fn ranks(&self) -> usize {
        self.processes.as_ref().map_or(self.ranks, Processes::size)
    }

    /// Times a benchmark; the outer error is that of ranks that broke off.
    fn time(&self, bench: &Bench) -> Result<Result<Timing, String>, CommandError> {
        let broke_off = |failed: RanksFailed| CommandError::Undone(format!("{}: {failed}", bench.name));
        match (bench.time, &self.processes) {
            (Time::Shared(time), Some(processes)) => {
                let order = format!("{ORDER} {} {}", bench.name, self.threads);
                followers::order_work(processes, &order);
                processes.run(self.threads, Sums::Ordered, time).map_err(broke_off)
            }
            (Time::Shared(time), None) => {
                run_ranks(self.ranks, self.threads, time).map(|mut all| all.swap_remove(0)).map_err(broke_off)
            }
            (Time::Alone(_), _) if self.ranks() > 1 => Err(CommandError::input(
                format!("`{}` is timed on one rank, and there are {}", bench.name, self.ranks()),
                format!("name benchmarks that ranks share: {}", names_of_shared().join(", ")),
            )),
            (Time::Alone(time), _) => with_threads(self.threads, time)
                .map_err(|refused| CommandError::input(refused.to_string(), "ask for fewer with `--threads`")),
        }
    }
}

/// First word of the order to time a benchmark that ranks share.
const ORDER: &str = "bench";

/// Takes part in a benchmark that rank 0 ordered, if this is such an order.
pub fn follow(processes: &Processes, order: &str) {
    let mut words = order.split_whitespace();
    let (Some(ORDER), Some(name), Some(threads)) = (words.next(), words.next(), words.next()) else { return };
    let bench = BENCHES.iter().find(|bench| bench.name == name);
    if let (Some(Bench { time: Time::Shared(time), .. }), Ok(threads)) = (bench, threads.parse()) {
        // What went wrong here, rank 0 says.
        drop(processes.run(threads, Sums::Ordered, time));
    }
}

/// Names of the benchmarks that ranks share.
fn names_of_shared() -> Vec<&'static str> {
    BENCHES.iter().filter(|bench| matches!(bench.time, Time::Shared(_))).map(|bench| bench.name).collect()
}

type Alone = fn() -> Result<Timing, String>;
type Shared = fn(Box<dyn Communicator>) -> Result<Timing, String>;

const fn alone(name: &'static str, about: &'static str, time: Alone) -> Bench {
    Bench { name, about, time: Time::Alone(time) }
}

const fn shared(name: &'static str, about: &'static str, time: Shared) -> Bench {
    Bench { name, about, time: Time::Shared(time) }
}

/// The benchmarks of this version, on the sizes of Yagyu et al. (2015). Memory comes first: later ones leave some behind.
const BENCHES: &[Bench] = &[
    alone("case_memory", "peak memory of the paper's whole case: built, and one step", coupling::case_memory),
    alone("machine_triad", "memory bandwidth, the measure of the floors", machine::triad),
    alone("dem_substep_shell75", "contact sub-step of the paper's settled bed, 75 spheres a grain", contacts::shell75),
    alone("dem_substep_spheres", "contact sub-step of 30,600 settled spheres", contacts::spheres),
    alone("dem_substep_tank", "the same of 34,000 spheres, the bed of a wave tank between two walls", contacts::tank),
    alone("packing_bed", "packing of the paper's bed, from a sub-step of the settled bed", contacts::packing_bed),
    alone(
        "volume_fractions",
        "cells covered by all grains of the paper's bed, every grain moved",
        coupling::volume_fractions,
    ),
    alone(
        "pressure_solve",
        "pressure of a drop in air, density ratio 1000, relative residual 1e-6 from zero",
        fluid::pressure_solve,
    ),
    alone("fluid_step", "whole fluid step, drop at 9 m/s, max |div u| dt <= 1e-6", fluid::fluid_step),
    shared("case_step", "whole step of the paper's case: fluid, grains and their coupling", coupling::case_step),
    alone(
        "mps_step",
        "step of moving particles in a wave tank over a bed of spheres, without the grains' sub-steps",
        particles::tank_step,
    ),
    alone(
        "mps_dam_break",
        "step of 100,000 moving particles of a dam that breaks, steps 50 to 100",
        particles::dam_break,
    ),
];

/// The benchmarks of this version.
#[must_use]
pub const fn benches() -> &'static [Bench] {
    BENCHES
}

/// Runs the benchmarks called `names`, or all of them.
///
/// # Errors
/// If a name is not known, or a benchmark fails.
pub fn bench(
    benches: &[Bench],
    names: &[String],
    place: &Place,
    progress: &mut dyn Progress,
) -> Result<Vec<BenchRow>, CommandError> {
    let known: Vec<&str> = benches.iter().map(|bench| bench.name).collect();
    if let Some(name) = names.iter().find(|name| !known.contains(&name.as_str())) {
        return Err(CommandError::unknown("benchmark", name, &known));
    }
    let mut rows = Vec::new();
    for bench in benches.iter().filter(|bench| names.is_empty() || names.iter().any(|name| name == bench.name)) {
        progress.message(&format!("{}: {}", bench.name, bench.about));
        let timing =
            place.time(bench)?.map_err(|message| CommandError::Undone(format!("{}: {message}", bench.name)))?;
        rows.push(timing.row(bench.name, place.threads, place.ranks()));
    }
    Ok(rows)
}

/// Processors that other programs may keep busy before a timing is called disturbed.
const BUSY: Real = 0.15;

/// The rows as a table for people.
#[must_use]
pub fn table(rows: &[BenchRow]) -> String {
    let mut text = format!(
        "{:<24} {:>11} {:>11} {:>11} {:>11} {:>5} {:>5} {:>5} {:>8} {:>11}  size\n",
        "name", "median", "min", "max", "cpu", "unit", "runs", "ranks", "threads", "floor"
    );
    let maybe = |value: Option<Real>| value.map_or_else(|| "-".to_owned(), |value| format!("{value:.4}"));
    for row in rows {
        text.push_str(&format!(
            "{:<24} {:>11.4} {:>11.4} {:>11.4} {:>11} {:>5} {:>5} {:>5} {:>8} {:>11}  {}\n",
            row.name,
            row.median,
            row.min,
            row.max,
            maybe(row.cpu),
            row.unit,
            row.runs,
            row.ranks,
            row.threads,
            maybe(row.floor),
            row.size
        ));
    }
    let busy = rows.iter().filter_map(|row| row.busy_elsewhere).fold(0.0, Real::max);
    if busy > BUSY {
        text.push_str(&format!(
            "other programs kept up to {busy:.1} processors busy meanwhile: compare processor time (cpu), not time\n"
        ));
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;
    use sazanami::progress::Silent;

    #[test]
    fn medians_and_names_are_right() {
        let timing =
            |values: &[Real]| Timing { unit: "s", values: values.to_vec(), size: "small".into(), ..Timing::default() };
        let row = timing(&[3.0, 1.0, 2.0]).with_floor(0.5, "by hand").row("x", 2, 1);
        assert_eq!((row.median, row.min, row.max, row.runs, row.floor), (2.0, 1.0, 3.0, 3, Some(0.5)));
        assert_eq!(timing(&[4.0, 1.0, 2.0, 3.0]).row("x", 1, 1).median, 2.5);
        let benches =
            [Bench { name: "nothing", about: "does nothing", time: Time::Alone(|| Ok(Timing::of("none", 3, || ()))) }];
        let on = |ranks: usize| Place { threads: 1, ranks, processes: None };
        assert_eq!(bench(&benches, &[], &on(1), &mut Silent).unwrap().len(), 1);
        assert_eq!(bench(&benches, &["nothin".into()], &on(1), &mut Silent).unwrap_err().exit_code(), 2);
        let refused = bench(&benches, &[], &on(2), &mut Silent).unwrap_err().to_string();
        assert!(refused.contains("timed on one rank") && refused.contains("case_step"), "{refused}");
    }
}
