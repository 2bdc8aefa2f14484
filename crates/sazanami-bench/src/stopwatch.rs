//! Time and memory of this program, from the system's tables.

use std::time::Instant;

use sazanami::machine::peak_memory;
use sazanami_numerics::Real;

/// Ticks of the system's clock of processor time in a second.
const TICKS: Real = 100.0;

/// Time taken by a run.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Lap {
    /// Wall-clock time \[s].
    pub wall: Real,
    /// Processor time of all threads of this program \[s], if the system reports it.
    pub cpu: Option<Real>,
    /// Processors that other programs kept busy, if the system reports it.
    pub busy_elsewhere: Option<Real>,
}

/// Measures one run.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Stopwatch {
    begin: Instant,
    own: Option<Real>,
    all: Option<Real>,
}

impl Stopwatch {
    pub(crate) fn start() -> Self {
        Self { all: machine_time(), own: program_time(), begin: Instant::now() }
    }

    pub(crate) fn stop(&self) -> Lap {
        let wall = self.begin.elapsed().as_secs_f64();
        let since = |now: Option<Real>, then: Option<Real>| Some(now? - then?);
        let cpu = since(program_time(), self.own);
        let all = since(machine_time(), self.all);
        // Below a few ticks of the system's clock the difference says nothing.
        let busy = all.zip(cpu).filter(|_| wall > 10.0 / TICKS).map(|(all, cpu)| ((all - cpu) / wall).max(0.0));
        Lap { wall, cpu, busy_elsewhere: busy }
    }
}

/// Processor time of all threads of this program so far \[s].
fn program_time() -> Option<Real> {
    let threads = std::fs::read_dir("/proc/self/task").ok()?;
    let time = |thread: std::fs::DirEntry| -> Option<Real> {
        let text = std::fs::read_to_string(thread.path().join("schedstat")).ok()?;
        text.split_whitespace().next()?.parse().ok()
    };
    Some(threads.flatten().filter_map(time).sum::<Real>() * 1e-9)
}

/// Processor time of all programs so far \[s].
fn machine_time() -> Option<Real> {
    let text = std::fs::read_to_string("/proc/stat").ok()?;
    let times: Vec<Real> = text.lines().next()?.split_whitespace().skip(1).filter_map(|t| t.parse().ok()).collect();
    // user, nice, system, (idle, iowait,) irq, softirq
    Some([0, 1, 2, 5, 6].iter().filter_map(|&n| times.get(n)).sum::<Real>() / TICKS)
}

/// Makes the peak of the memory the memory taken now; returns that, if the system can do it \[bytes].
pub(crate) fn forget_peak() -> Option<u64> {
    std::fs::write("/proc/self/clear_refs", "5").ok()?;
    peak_memory()
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
        if let Some(now) = forget_peak() {
            assert!(now > 100_000);
            let taken = vec![1_u8; 32 << 20];
            assert!(std::hint::black_box(taken).len() == 32 << 20 && peak_memory().unwrap() >= now + (30 << 20));
        }
    }
}
