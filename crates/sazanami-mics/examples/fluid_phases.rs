//! Times transport, viscosity and face prediction for a drop of 5.537 mm falling at 9 m/s on the
//! grid of Yagyu et al. (2015): `cargo run --release -p sazanami-mics --example fluid_phases [cells divisor] [threads] [repeats]`.

use std::time::Instant;

use sazanami_mics::boundary::Boundary;
use sazanami_mics::flow::{DropVelocity, Flow, Fluids, Schemes};
use sazanami_numerics::domain::Domain;
use sazanami_numerics::grid::Grid;
use sazanami_numerics::{Real, Vector};

fn main() {
    let arguments: Vec<usize> = std::env::args().skip(1).filter_map(|a| a.parse().ok()).collect();
    let divisor = arguments.first().copied().unwrap_or(1);
    let threads = arguments.get(1).copied().unwrap_or(2);
    let repeats = arguments.get(2).copied().unwrap_or(6);
    sazanami_parallel::with_threads(threads, || time(divisor, repeats)).expect("the threads are granted");
}

fn time(divisor: usize, repeats: usize) {
    let grid = Grid::new([176, 184, 132].map(|n| n / divisor), Vector::ZERO, Vector::new(33.8e-3, 33.8e-3, 25e-3));
    let domain = Domain::solo(grid, [false; 3]);
    let boundary = Boundary::closed();
    let fluids = Fluids { liquid_density: 1e3, gas_density: 1.0, liquid_viscosity: 1e-3, gas_viscosity: 1e-5 };
    let mut flow = Flow::new(&domain, fluids, Schemes::default());
    let (centre, radius) = (Vector::new(16.9e-3, 16.9e-3, 12.5e-3), 5.537e-3 / 2.0);
    let mut beta = domain.field(0.0);
    domain.set(&mut beta, |i, j, k| drop_fraction(&domain, [i, j, k], centre, radius));
    flow.add_liquid(&domain, &boundary, &beta, Vector::new(0.0, 0.0, -9.0), DropVelocity::Mass);
    for d in 0..3 {
        domain.set(&mut flow.face_velocity[d], |i, j, k| {
            let mut x = domain.centre(i, j, k) - centre;
            x[d] -= 0.5 * grid.spacing[d];
            around_a_sphere(x, radius)[d]
        });
    }
    let dt = 1e-5;
    let gravity = Vector::new(0.0, 0.0, -9.8);
    let mixed = beta.data().iter().filter(|&&c| c > 0.0 && c < 1.0).count();
    println!(
        "{:?} cells, {mixed} with an interface, Courant number {:.3}",
        grid.cells,
        flow.advective_rate(&domain) * dt
    );
    let faces = flow.face_velocity.clone();
    for _ in 0..repeats {
        flow.face_velocity.clone_from(&faces);
        let start = Instant::now();
        let report = flow.transport(&domain, &boundary, dt);
        let transport = start.elapsed();
        let diffusion = flow.diffuse(&domain, &boundary, dt).expect("the viscous step is not stiff");
        let diffuse = start.elapsed() - transport;
        flow.predict_faces(&domain, &boundary, gravity, dt);
        let all = start.elapsed();
        println!(
            "transport {:.1} ms, diffuse {:.1} ms ({} passes), faces {:.1} ms, sum {:.1} ms; {} residue moved, {} cut",
            transport.as_secs_f64() * 1e3,
            diffuse.as_secs_f64() * 1e3,
            diffusion.iterations,
            (all - transport - diffuse).as_secs_f64() * 1e3,
            all.as_secs_f64() * 1e3,
            report.residue.moved_cells,
            report.residue.clipped_cells,
        );
    }
}

fn drop_fraction(domain: &Domain, [i, j, k]: [isize; 3], centre: Vector, radius: Real) -> Real {
    let (x, h) = (domain.centre(i, j, k) - centre, domain.grid().spacing);
    if (x.length() - radius).abs() > h.length() {
        return if x.length() < radius { 1.0 } else { 0.0 };
    }
    let offset = |n: usize| (n as Real + 0.5) / 4.0 - 0.5;
    let inside = |n: usize| (x + h * Vector::new(offset(n % 4), offset(n / 4 % 4), offset(n / 16))).length() < radius;
    (0..64).filter(|&n| inside(n)).count() as Real / 64.0
}

/// Velocity of a falling sphere and of the ideal flow around it [m/s].
fn around_a_sphere(x: Vector, radius: Real) -> Vector {
    let speed = Vector::new(0.0, 0.0, -9.0);
    let r = x.length();
    if r < radius {
        return speed;
    }
    let n = x / r;
    0.5 * (radius / r).powi(3) * (3.0 * speed.dot(n) * n - speed)
}
