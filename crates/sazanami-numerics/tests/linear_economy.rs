//! A solve allocates nothing after the first. Alone in its file: it counts for the whole process.

use sazanami_numerics::Vector;
use sazanami_numerics::domain::{Domain, GhostRules};
use sazanami_numerics::grid::Grid;
use sazanami_numerics::linear::{ConjugateGradient, FaceEquation, Stop};
use sazanami_parallel::with_threads;
use sazanami_test_support::{CountingAllocator, allocations};

#[global_allocator]
static ALLOCATOR: CountingAllocator = CountingAllocator;

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
        let before = allocations();
        let first = solve(&mut p);
        assert!(first.iterations > 3, "{first:?}");
        assert!(allocations() > before, "negative control: the counter counts");
        p.fill(0.0);
        let before = allocations();
        assert_eq!(solve(&mut p), first);
        assert_eq!(allocations(), before);
    })
    .expect("the threads are granted");
}
