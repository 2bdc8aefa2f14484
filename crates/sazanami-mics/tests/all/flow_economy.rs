//! The fluid phases allocate nothing once they have run.

use sazanami_mics::ball::ball;
use sazanami_mics::boundary::Boundary;
use sazanami_mics::flow::{DropVelocity, Flow, Schemes};
use sazanami_numerics::Vector;
use sazanami_numerics::domain::Domain;
use sazanami_numerics::grid::Grid;
use sazanami_parallel::with_threads;
use sazanami_test_support::allocations_of_thread;

use crate::support::WATER_AND_AIR;

#[test]
fn a_step_allocates_nothing_after_the_first() {
    let allocations = with_threads(1, || {
        let domain = Domain::solo(Grid::new([20, 18, 16], Vector::ZERO, Vector::splat(4e-3)), [false; 3]);
        let boundary = Boundary::closed();
        let mut flow = Flow::new(&domain, WATER_AND_AIR, Schemes::default());
        let beta = ball(&domain, Vector::splat(2e-3), 1e-3, 4);
        flow.add_liquid(&domain, &boundary, &beta, |_| Vector::new(0.0, 0.0, -9.0), DropVelocity::Mass);
        let mut step = || {
            flow.predict_faces(&domain, &boundary, Vector::new(0.0, 0.0, -9.8), 1e-6);
            flow.transport(&domain, &boundary, 1e-6);
            flow.diffuse(&domain, &boundary, 1e-6).map(|report| report.iterations)
        };
        // All orders of the sweeps, so that every list has met its longest.
        for _ in 0..12 {
            step().unwrap();
        }
        let before = allocations_of_thread();
        for _ in 0..6 {
            step().unwrap();
        }
        allocations_of_thread() - before
    })
    .expect("the threads are granted");
    assert_eq!(allocations, 0);
}
