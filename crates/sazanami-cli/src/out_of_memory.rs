//! Memory that is refused ends the program with a message and exit code 1; any other abort is reported as what it is.

use std::alloc::{GlobalAlloc, Layout, System};
use std::sync::atomic::{AtomicBool, Ordering};

/// Whether the system has refused memory.
static REFUSED: AtomicBool = AtomicBool::new(false);

/// The system's allocator, which notes a refusal: the standard library aborts upon it, as upon other faults.
struct Noting;

#[global_allocator]
static ALLOCATOR: Noting = Noting;

/// Passes on what the system gave, and notes if it was nothing.
fn noted(place: *mut u8) -> *mut u8 {
    if place.is_null() {
        REFUSED.store(true, Ordering::Relaxed);
    }
    place
}

// SAFETY: every call goes to the system's allocator with the arguments that came, and its answer is returned unchanged.
unsafe impl GlobalAlloc for Noting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        // SAFETY: the caller keeps the contract of `alloc`.
        noted(unsafe { System.alloc(layout) })
    }

    unsafe fn alloc_zeroed(&self, layout: Layout) -> *mut u8 {
        // SAFETY: the caller keeps the contract of `alloc_zeroed`.
        noted(unsafe { System.alloc_zeroed(layout) })
    }

    unsafe fn realloc(&self, place: *mut u8, layout: Layout, size: usize) -> *mut u8 {
        // SAFETY: the caller keeps the contract of `realloc`.
        noted(unsafe { System.realloc(place, layout, size) })
    }

    unsafe fn dealloc(&self, place: *mut u8, layout: Layout) {
        // SAFETY: the caller keeps the contract of `dealloc`.
        unsafe { System.dealloc(place, layout) }
    }
}

/// From here on an abort after a refusal of memory (the standard library has printed how much was asked for) ends with
/// advice and exit code 1, and any other one names its signal and ends by it.
#[cfg(unix)]
pub fn end_by_name() {
    use std::io::Write as _;
    use std::os::fd::AsFd as _;

    use sazanami::error::exit;
    use signal_hook::consts::SIGABRT;
    use signal_hook::low_level;

    // A copy of the error stream: that of the standard library might be locked.
    let Ok(errors) = std::io::stderr().as_fd().try_clone_to_owned() else { return };
    let errors = std::fs::File::from(errors);
    let end = move || {
        if REFUSED.load(Ordering::Relaxed) {
            let _ = (&errors).write_all(NO_MEMORY.as_bytes());
            low_level::exit(i32::from(exit::FAILED));
        }
        let _ = (&errors).write_all(ABORTED.as_bytes());
        // The default of this signal ends the process.
        let _ = low_level::emulate_default_handler(SIGABRT);
    };
    // SAFETY: the handler reads an atomic flag, writes a constant text to a file of its own and ends the process:
    // `write`, `_exit` and what the default handler needs are async-signal-safe, nothing is allocated, no lock is taken.
    let registered = unsafe { low_level::register(SIGABRT, end) };
    // Without it the program ends by the signal, as it would have anyway.
    drop(registered);
}

/// Elsewhere the program ends as the standard library ends it.
#[cfg(not(unix))]
pub fn end_by_name() {}

const NO_MEMORY: &str = "\nerror: out of memory: the system refused what the line above asked for\n  \
    help: `sazanami check` predicts the memory of a case and `sazanami doctor` shows the limits (`ulimit -v`, \
    container, machine);\n        take fewer cells or grains or fewer threads, or raise the limit; a run with a \
    checkpoint goes on with `sazanami resume`\n";

const ABORTED: &str = "\nerror: the program was aborted (signal SIGABRT), with no memory refused\n  \
    help: if nothing outside sent the signal this is a fault of the program: please report it with the case; a run with \
    a\n        checkpoint goes on with `sazanami resume`\n";
