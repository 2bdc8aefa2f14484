//! Memory bandwidth of the machine, the measure of the floors.

use std::sync::OnceLock;

use sazanami_numerics::Real;
use sazanami_parallel::for_each_chunk;

use crate::stopwatch::Stopwatch;
use crate::timing::Timing;

/// Numbers in each array of the triad: three arrays that no cache holds.
const LENGTH: usize = 32 << 20;
/// Numbers that a thread takes at a time.
const CHUNK: usize = 1 << 16;
/// Bytes moved per element: two read, one written.
const TRIAD_BYTES: Real = 24.0;

/// `a = b + s c` on arrays that no cache holds, with all threads [GB/s].
pub(crate) fn triad() -> Result<Timing, String> {
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
pub(crate) fn bandwidth() -> Real {
    static BANDWIDTH: OnceLock<Real> = OnceLock::new();
    *BANDWIDTH.get_or_init(|| 1e9 * run_triad(LENGTH / 2, 9).values.into_iter().fold(0.0, Real::max))
}

/// Time \[s] in which so many bytes are read or written at least, with its derivation in words.
pub(crate) fn floor_of_bytes(bytes: Real, what: &str) -> (Real, String) {
    let bandwidth = bandwidth();
    (bytes / bandwidth, format!("{:.3e} bytes ({what}) at {:.1} GB/s", bytes, 1e-9 * bandwidth))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_triad_has_a_bandwidth() {
        assert!(run_triad(1 << 12, 3).values.iter().all(|&value| value > 0.0));
    }
}
