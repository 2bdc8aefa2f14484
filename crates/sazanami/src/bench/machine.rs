//! What the machine can do, and what it is doing: memory bandwidth, processor time, memory taken.

use std::sync::OnceLock;
use std::time::Instant;

use sazanami_numerics::Real;
use sazanami_parallel::for_each_chunk;

use super::Timing;

/// Numbers in each array of the triad: three arrays that no cache holds.
const LENGTH: usize = 32 << 20;
/// Numbers that a thread takes at a time.
const CHUNK: usize = 1 << 16;
/// Bytes moved per element: two read, one written.
const TRIAD_BYTES: Real = 24.0;
/// Ticks of the system's clock of processor time in a second.
const TICKS: Real = 100.0;

/// Time taken by a run.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Lap {
    /// Wall-clock time [s].
    pub wall: Real,
    /// Processor time of all threads of this program [s], if the system tells.
    pub cpu: Option<Real>,
    /// Processors that other programs kept busy, if the system tells.
    pub busy_elsewhere: Option<Real>,
}

/// Measures one run.
#[derive(Clone, Copy, Debug)]
pub(super) struct Stopwatch {
    begin: Instant,
    own: Option<Real>,
    all: Option<Real>,
}

impl Stopwatch {
    pub(super) fn start() -> Self {
        Self { all: machine_time(), own: program_time(), begin: Instant::now() }
    }

    pub(super) fn stop(&self) -> Lap {
        let wall = self.begin.elapsed().as_secs_f64();
        let since = |now: Option<Real>, then: Option<Real>| Some(now? - then?);
        let cpu = since(program_time(), self.own);
        let all = since(machine_time(), self.all);
        // Below a few ticks of the system's clock the difference says nothing.
        let busy = all.zip(cpu).filter(|_| wall > 10.0 / TICKS).map(|(all, cpu)| ((all - cpu) / wall).max(0.0));
        Lap { wall, cpu, busy_elsewhere: busy }
    }
}

/// Processor time of all threads of this program so far [s].
fn program_time() -> Option<Real> {
    let threads = std::fs::read_dir("/proc/self/task").ok()?;
    let time = |thread: std::fs::DirEntry| -> Option<Real> {
        let text = std::fs::read_to_string(thread.path().join("schedstat")).ok()?;
        text.split_whitespace().next()?.parse().ok()
    };
    Some(threads.flatten().filter_map(time).sum::<Real>() * 1e-9)
}

/// Processor time of all programs so far [s].
fn machine_time() -> Option<Real> {
    let text = std::fs::read_to_string("/proc/stat").ok()?;
    let times: Vec<Real> = text.lines().next()?.split_whitespace().skip(1).filter_map(|t| t.parse().ok()).collect();
    // user, nice, system, (idle, iowait,) irq, softirq
    Some([0, 1, 2, 5, 6].iter().filter_map(|&n| times.get(n)).sum::<Real>() / TICKS)
}

/// Memory of this program from the system's table, `VmHWM` (the peak) or `VmRSS` (now) [bytes].
pub(super) fn memory(entry: &str) -> Option<Real> {
    let text = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = text.lines().find(|line| line.starts_with(entry))?;
    Some(line.split_whitespace().nth(1)?.parse::<Real>().ok()? * 1024.0)
}

/// Makes the peak of the memory the memory taken now; returns that, if the system can do it [bytes].
pub(super) fn forget_peak() -> Option<Real> {
    std::fs::write("/proc/self/clear_refs", "5").ok()?;
    memory("VmRSS")
}

/// `a = b + s c` on arrays that no cache holds, with all threads [GB/s].
pub(super) fn triad() -> Result<Timing, String> {
    let timing = run_triad(LENGTH, 15);
    Ok(Timing { size: format!("a = b + s c, three arrays of {} MiB, 24 bytes an element", LENGTH >> 17), ..timing })
}

fn run_triad(length: usize, runs: usize) -> Timing {
    let mut a = vec![0.0; length];
    let (b, c) = (vec![1.0; length], vec![2.0; length]);
    let mut timing = Timing { unit: "GB/s", ..Timing::default() };
    for run in 0..=runs {
        let factor = run as Real;
        let watch = Stopwatch::start();
        for_each_chunk(&mut a[..], CHUNK, |number, a| {
            let from = number * CHUNK..number * CHUNK + a.len();
            for ((a, b), c) in a.iter_mut().zip(&b[from.clone()]).zip(&c[from]) {
                *a = b + factor * c;
            }
        });
        let lap = watch.stop();
        // The first run touches the pages.
        if run > 0 {
            timing.values.push(TRIAD_BYTES * length as Real / lap.wall * 1e-9);
        }
    }
    std::hint::black_box(&a);
    timing
}

/// Memory bandwidth that floors are reckoned with [bytes/s]: the best of a few triads, since other programs only
/// take from it.
pub(super) fn bandwidth() -> Real {
    static BANDWIDTH: OnceLock<Real> = OnceLock::new();
    *BANDWIDTH.get_or_init(|| 1e9 * run_triad(LENGTH / 2, 9).values.into_iter().fold(0.0, Real::max))
}

/// How a floor of so many bytes was found.
pub(super) fn floor_of_bytes(bytes: Real, what: &str) -> (Real, String) {
    let bandwidth = bandwidth();
    (bytes / bandwidth, format!("{:.3e} bytes ({what}) at {:.1} GB/s", bytes, 1e-9 * bandwidth))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_system_tells_time_and_memory() {
        let watch = Stopwatch::start();
        let mut sum = 0.0;
        while watch.begin.elapsed().as_secs_f64() < 0.02 {
            sum += std::hint::black_box(1.0);
        }
        let lap = watch.stop();
        assert!(lap.wall >= 0.02 && sum > 0.0);
        // Where the system keeps the tables, its time is this thread's at least in part.
        if let Some(cpu) = lap.cpu {
            assert!(cpu >= 0.0);
        }
        if let (Some(now), Some(peak)) = (memory("VmRSS"), memory("VmHWM")) {
            assert!(peak >= 0.9 * now && now > 1e5);
        }
        assert!(run_triad(1 << 12, 3).values.iter().all(|&value| value > 0.0));
    }
}
