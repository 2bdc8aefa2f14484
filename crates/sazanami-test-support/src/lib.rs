//! Support for tests of other crates: an allocator that counts, for tests which show that a step allocates nothing, and a
//! reader of VTK files ([`vtk`]).
//!
//! ```
//! use sazanami_test_support::{CountingAllocator, allocations_of_thread};
//!
//! #[global_allocator]
//! static ALLOCATOR: CountingAllocator = CountingAllocator;
//!
//! let before = allocations_of_thread();
//! drop(std::hint::black_box(vec![1; 100]));
//! assert!(allocations_of_thread() > before);
//! ```

pub mod vtk;

use std::alloc::{GlobalAlloc, Layout, System};
use std::cell::Cell;
use std::sync::atomic::{AtomicUsize, Ordering};

/// The allocator of the system, with counters.
pub struct CountingAllocator;

static ALL: AtomicUsize = AtomicUsize::new(0);

thread_local! {
    static COUNT: Cell<usize> = const { Cell::new(0) };
    static BYTES: Cell<usize> = const { Cell::new(0) };
    static TRACED: Cell<bool> = const { Cell::new(false) };
}

/// Allocations of all threads so far.
#[must_use]
pub fn allocations() -> usize {
    ALL.load(Ordering::Relaxed)
}

/// Allocations of the calling thread so far.
#[must_use]
pub fn allocations_of_thread() -> usize {
    COUNT.get()
}

/// Bytes that the calling thread has allocated so far.
#[must_use]
pub fn bytes_of_thread() -> usize {
    BYTES.get()
}

/// Prints a backtrace of each allocation of the calling thread from now on, or no longer.
pub fn trace_allocations(traced: bool) {
    TRACED.set(traced);
}

fn note(layout: Layout) {
    ALL.fetch_add(1, Ordering::Relaxed);
    COUNT.set(COUNT.get() + 1);
    BYTES.set(BYTES.get() + layout.size());
    if TRACED.replace(false) {
        eprintln!("{} bytes at\n{}", layout.size(), std::backtrace::Backtrace::force_capture());
        TRACED.set(true);
    }
}

// SAFETY: every call is handed to the system's allocator unchanged.
unsafe impl GlobalAlloc for CountingAllocator {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        note(layout);
        // SAFETY: the caller's promises are those that `System` asks for.
        unsafe { System.alloc(layout) }
    }

    unsafe fn dealloc(&self, pointer: *mut u8, layout: Layout) {
        // SAFETY: `pointer` came from `System` through `alloc`.
        unsafe { System.dealloc(pointer, layout) }
    }
}
