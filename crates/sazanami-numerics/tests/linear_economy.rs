//! A solve allocates nothing after the first. Alone in its file: it counts for the whole process.

use std::alloc::{GlobalAlloc, Layout, System};
use std::sync::atomic::{AtomicUsize, Ordering};

use sazanami_numerics::Vector;
use sazanami_numerics::domain::{Domain, GhostRules};
use sazanami_numerics::grid::Grid;
use sazanami_numerics::linear::{ConjugateGradient, FaceEquation, Stop};
use sazanami_parallel::with_threads;

/// Counts allocations.
struct Counting;

static ALLOCATIONS: AtomicUsize = AtomicUsize::new(0);

// SAFETY: every call is handed to the system's allocator unchanged.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        ALLOCATIONS.fetch_add(1, Ordering::Relaxed);
        // SAFETY: as the caller promises.
        unsafe { System.alloc(layout) }
    }

    unsafe fn dealloc(&self, at: *mut u8, layout: Layout) {
        // SAFETY: as the caller promises.
        unsafe { System.dealloc(at, layout) }
    }
}

#[global_allocator]
static COUNTING: Counting = Counting;

#[test]
fn a_solve_allocates_nothing_after_the_first() {
    let cells = [34, 30, 51];
    let domain = Domain::solo(Grid::new(cells, Vector::ZERO, Vector::ONE), [false; 3]);
    let mut faces = [0, 1, 2].map(|_| domain.field(0.0));
    for (d, field) in faces.iter_mut().enumerate() {
        domain.set(field, |i, j, k| match [i, j, k] {
            at if at[d] == 0 => 0.0,
            _ if i + j < 20 => 1e-3,
            _ => 1.0,
        });
    }
    let mut right = domain.field(0.0);
    domain.set(&mut right, |i, _, k| (k - 25) as f64 * (1 + i) as f64);
    let faces = [&faces[0], &faces[1], &faces[2]];
    let equation = FaceEquation { faces, right_hand_side: &right, ghosts: &GhostRules::EVEN, singular: true };
    with_threads(2, || {
        let mut solver = ConjugateGradient::new(&domain);
        let mut p = domain.field(0.0);
        let mut solve = |p: &mut _| solver.solve(&domain, &equation, p, Stop::Relative(1e-6), 50).unwrap();
        let before = ALLOCATIONS.load(Ordering::Relaxed);
        let first = solve(&mut p);
        assert!(first.iterations > 3, "{first:?}");
        assert!(ALLOCATIONS.load(Ordering::Relaxed) > before, "negative control: the counter counts");
        p.fill(0.0);
        let before = ALLOCATIONS.load(Ordering::Relaxed);
        assert_eq!(solve(&mut p), first);
        assert_eq!(ALLOCATIONS.load(Ordering::Relaxed), before);
    })
    .expect("the threads are granted");
}
