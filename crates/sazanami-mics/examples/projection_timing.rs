//! Times the projection along the first steps of a drop of 5.537 mm falling at 9 m/s in a closed box:
//! `cargo run --release -p sazanami-mics --example projection_timing [cells divisor] [threads] [steps]`.

use std::time::Instant;

use sazanami_mics::boundary::Boundary;
use sazanami_mics::flow::{DropVelocity, Flow, Fluids, Schemes};
use sazanami_mics::pressure::{Projection, Tolerance};
use sazanami_numerics::Vector;
use sazanami_numerics::domain::Domain;
use sazanami_numerics::grid::Grid;

fn main() {
    let arguments: Vec<usize> = std::env::args().skip(1).filter_map(|a| a.parse().ok()).collect();
    let argument = |n: usize, default: usize| arguments.get(n).copied().unwrap_or(default);
    sazanami_parallel::with_threads(argument(1, 2), || time(argument(0, 1), argument(2, 8)))
        .expect("the threads are granted");
}

fn time(divisor: usize, steps: usize) {
    let grid = Grid::new([176, 184, 132].map(|n| n / divisor), Vector::ZERO, Vector::new(33.8e-3, 33.8e-3, 25e-3));
    let domain = Domain::solo(grid, [false; 3]);
    let boundary = Boundary::closed();
    let fluids = Fluids { liquid_density: 1e3, gas_density: 1.0, liquid_viscosity: 1e-3, gas_viscosity: 1e-5 };
    let mut flow = Flow::new(&domain, fluids, Schemes::default());
    let (centre, radius) = (Vector::new(16.9e-3, 16.9e-3, 12.5e-3), 5.537e-3 / 2.0);
    let mut beta = domain.field(0.0);
    domain.set(&mut beta, |i, j, k| {
        let x = (domain.centre(i, j, k) - centre).length();
        (0.5 - (x - radius) / grid.spacing.x).clamp(0.0, 1.0)
    });
    flow.add_liquid(&domain, &boundary, &beta, Vector::new(0.0, 0.0, -9.0), DropVelocity::Mass);
    let mut projection = Projection::new(&domain, boundary.pressure_sides());
    let gravity = Vector::new(0.0, 0.0, -9.8);
    let dt = 1e-5 * divisor as f64;
    for step in 0..steps {
        if step > 0 {
            flow.transport(&domain, &boundary, dt);
        }
        flow.predict_faces(&domain, &boundary, gravity, dt);
        let start = Instant::now();
        let Flow { density, velocity, face_velocity, .. } = &mut flow;
        let report = projection.project(&domain, density, velocity, face_velocity, gravity, dt, &Tolerance::default());
        let report = report.expect("the pressure converges");
        println!(
            "step {step}: {:.1} ms, {} iterations, max |div u| dt = {:.2e}, residual {:.1e} of the first guess",
            start.elapsed().as_secs_f64() * 1e3,
            report.iterations,
            report.divergence,
            report.residual,
        );
    }
}
