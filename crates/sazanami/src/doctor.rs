//! Findings on a machine: its means for a run, and what would keep a run from working.

use std::path::{Path, PathBuf};
use std::time::Instant;

use sazanami_parallel::{Launcher, for_each_chunk, with_threads};
use serde::Serialize;

use crate::machine::{self, Machine};
use crate::tanks;

/// Whether a finding is as it should be.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum State {
    /// As it should be.
    Good,
    /// Runs work; something is slower or smaller than it could be.
    Fair,
    /// Keeps runs from working.
    Bad,
}

impl std::fmt::Display for State {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        formatter.pad(match self {
            Self::Good => "ok",
            Self::Fair => "note",
            Self::Bad => "BAD",
        })
    }
}

/// One thing that was looked at.
#[derive(Clone, Debug, Serialize)]
pub struct Finding {
    /// Subject.
    pub what: &'static str,
    /// Whether it is in order.
    pub state: State,
    /// Finding, for people.
    pub found: String,
}

impl Finding {
    fn new(what: &'static str, state: State, found: impl Into<String>) -> Self {
        Self { what, state, found: found.into() }
    }
}

/// Doubles in each array of the triad: beyond every cache (3 x 64 MiB).
const TRIAD: usize = 8 << 20;
/// Doubles that a thread takes at a time.
const CHUNK: usize = 1 << 16;
/// Memory that the triad needs with room to spare \[bytes].
const TRIAD_ROOM: u64 = 4 * 8 * TRIAD as u64;
/// Space below which a disk is called small \[bytes].
const SMALL_DISK: u64 = 2 << 30;

/// Looks at program and machine; `commit` is what the program was built from, `mpi` the name of the MPI that it was built
/// with.
#[must_use]
pub fn examine(commit: Option<&str>, mpi: Option<&str>) -> Vec<Finding> {
    let machine = Machine::this();
    let mut findings = vec![
        Finding::new(
            "version",
            State::Good,
            format!("{} ({})", env!("CARGO_PKG_VERSION"), commit.unwrap_or("unknown commit")),
        ),
        build(),
        Finding::new("processor", State::Good, machine.cpu.clone()),
        instruction_set(),
        threads(&machine),
    ];
    findings.extend(memory(&machine));
    findings.push(bandwidth(&machine));
    findings.push(folder("results", Path::new("runs")));
    findings.extend(tanks::cache_folder().map(|path| folder("kept tanks", &path)));
    findings.push(folder("temporary files", &std::env::temp_dir()));
    findings.push(ranks(mpi));
    findings.push(Finding::new("fonts", State::Good, "DejaVu Sans, embedded: pictures need none of the system's"));
    findings
}

/// The MPI of the build, and the launcher if there is one.
fn ranks(mpi: Option<&str>) -> Finding {
    let launcher = Launcher::seen();
    let built = match mpi {
        Some(library) => format!("built with {library}"),
        None => "not built in: ranks are threads of one process (`--ranks`)".to_owned(),
    };
    match launcher {
        Some(launcher) if mpi.is_none() => Finding::new(
            "MPI",
            State::Bad,
            format!("{built}; {launcher} started this program: build it with `--features mpi`"),
        ),
        Some(launcher) => Finding::new("MPI", State::Good, format!("{built}; started by {launcher}")),
        None => Finding::new("MPI", State::Good, built),
    }
}

fn build() -> Finding {
    let (optimised, state) = if cfg!(debug_assertions) {
        ("without optimisation: runs are slow", State::Fair)
    } else {
        ("optimised", State::Good)
    };
    let libc = if cfg!(target_env = "musl") { ", static (musl)" } else { "" };
    let place = format!("{}-{}{libc}", std::env::consts::ARCH, std::env::consts::OS);
    Finding::new("build", state, format!("{place}, {optimised}"))
}

/// Instruction sets that the build uses, and wider ones that the processor has.
fn instruction_set() -> Finding {
    #[cfg(target_arch = "x86_64")]
    {
        let built = if cfg!(target_feature = "avx2") { "AVX2 and FMA (x86-64-v3)" } else { "SSE2 (x86-64)" };
        let has = [
            ("AVX2", std::arch::is_x86_feature_detected!("avx2")),
            ("FMA", std::arch::is_x86_feature_detected!("fma")),
            ("AVX-512", std::arch::is_x86_feature_detected!("avx512f")),
        ];
        let has: Vec<&str> = has.into_iter().filter_map(|(name, there)| there.then_some(name)).collect();
        let state = if !cfg!(target_feature = "avx2") && has.contains(&"AVX2") { State::Fair } else { State::Good };
        Finding::new("instruction set", state, format!("built for {built}; the processor has {}", has.join(", ")))
    }
    #[cfg(not(target_arch = "x86_64"))]
    Finding::new("instruction set", State::Good, format!("that of {}", std::env::consts::ARCH))
}

fn threads(machine: &Machine) -> Finding {
    match with_threads(machine.cores, || ()) {
        Ok(()) => Finding::new(
            "cores",
            State::Good,
            format!("{0}; a run uses {0} threads unless `--threads` says otherwise", machine.cores),
        ),
        Err(error) => Finding::new("cores", State::Bad, format!("{}, but {error}", machine.cores)),
    }
}

fn memory(machine: &Machine) -> Vec<Finding> {
    let bounds = machine::memory_bounds();
    if bounds.is_empty() {
        return vec![Finding::new("memory", State::Fair, "the system does not report it: `check` cannot compare")];
    }
    let of = |(limit, bytes): (machine::MemoryLimit, u64)| {
        let rules = if limit == machine.memory_limit && bounds.len() > 1 { " <- the least: it rules" } else { "" };
        Finding::new("memory", State::Good, format!("{:.2} GiB ({limit}){rules}", gibibytes(bytes)))
    };
    bounds.iter().copied().map(of).collect()
}

/// Bandwidth of `a = b + s c`, the best of a few passes of all threads.
fn bandwidth(machine: &Machine) -> Finding {
    let what = "memory bandwidth";
    if machine.memory_available.is_some_and(|bytes| bytes < TRIAD_ROOM) {
        return Finding::new(what, State::Fair, "not measured: too little memory");
    }
    let best = with_threads(machine.cores, || {
        let (b, c, mut a) = (filled(1.0)?, filled(2.0)?, filled(0.0)?);
        let pass = |a: &mut [f64]| {
            let began = Instant::now();
            for_each_chunk(a, CHUNK, |number, chunk: &mut [f64]| {
                let start = number * CHUNK;
                let others = b[start..].iter().zip(&c[start..]);
                chunk.iter_mut().zip(others).for_each(|(a, (b, c))| *a = b + 3.0 * c);
            });
            began.elapsed().as_secs_f64()
        };
        Some((0..5).map(|_| pass(&mut a)).fold(f64::INFINITY, f64::min))
    });
    match best {
        // The threads have taken of the address space too.
        Ok(None) => Finding::new(what, State::Fair, "not measured: the system refused the memory"),
        // Two arrays are read; the one written is read into the cache first.
        Ok(Some(seconds)) => {
            let rate = 4.0 * 8.0 * TRIAD as f64 / seconds;
            Finding::new(what, State::Good, format!("{:.1} GB/s by a triad of {} threads", 1e-9 * rate, machine.cores))
        }
        Err(error) => Finding::new(what, State::Bad, error.to_string()),
    }
}

/// An array of the triad, if there is memory for it.
fn filled(value: f64) -> Option<Vec<f64>> {
    let mut array = Vec::new();
    array.try_reserve_exact(TRIAD).ok()?;
    array.resize(TRIAD, value);
    Some(array)
}

/// A folder that runs write to, or the nearest one above it that exists.
fn folder(what: &'static str, path: &Path) -> Finding {
    let absolute = std::path::absolute(path).unwrap_or_else(|_| path.to_owned());
    let existing: PathBuf = absolute.ancestors().find(|above| above.is_dir()).unwrap_or(&absolute).to_owned();
    let trial = existing.join(format!(".sazanami-doctor-{}", std::process::id()));
    if let Err(error) = std::fs::write(&trial, b"sazanami").and_then(|()| std::fs::remove_file(&trial)) {
        return Finding::new(what, State::Bad, format!("{}: nothing can be written: {error}", existing.display()));
    }
    match machine::free_disk(&existing) {
        Some(bytes) => {
            let state = if bytes < SMALL_DISK { State::Fair } else { State::Good };
            Finding::new(what, state, format!("{}: writable, {:.1} GiB free", absolute.display(), gibibytes(bytes)))
        }
        None => {
            Finding::new(what, State::Fair, format!("{}: writable; free space is not reported", absolute.display()))
        }
    }
}

fn gibibytes(bytes: u64) -> f64 {
    bytes as f64 / (1_u64 << 30) as f64
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn folders_are_tried() {
        let place = tempfile::tempdir().unwrap();
        let found = folder("results", &place.path().join("not/yet"));
        assert_ne!(found.state, State::Bad, "{}", found.found);
        assert_eq!(std::fs::read_dir(place.path()).unwrap().count(), 0);
        // Negative control: a folder nobody can write to.
        assert_eq!(folder("results", Path::new("/proc/self")).state, State::Bad);
    }
}
