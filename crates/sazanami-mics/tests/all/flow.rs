//! Viscosity and the prediction of face velocities.

use sazanami_mics::ball::ball;
use sazanami_mics::boundary::{Boundary, FluidName, Side};
use sazanami_mics::flow::{DropVelocity, Flow, Fluids, Schemes};
use sazanami_mics::viscosity::ViscosityScheme;
use sazanami_numerics::domain::Domain;
use sazanami_numerics::grid::Grid;
use sazanami_numerics::{Real, Vector};
use sazanami_parallel::{run_ranks, with_threads};

use crate::support::WATER_AND_AIR;

/// A channel between no-slip walls at the ends of x3, one cell in the periodic directions.
fn channel(n: usize) -> (Domain, Boundary) {
    let mut sides = [[Side::Periodic; 2]; 3];
    sides[2] = [Side::NoSlip; 2];
    let boundary = Boundary::new(sides).expect("the sides make a box");
    let domain = Domain::solo(Grid::new([1, 1, n], Vector::ZERO, Vector::ONE), boundary.periodic());
    (domain, boundary)
}

/// Factor by which a shear wave of one period decays over `time`, in `steps` steps.
fn decay(scheme: ViscosityScheme, time: Real, steps: usize) -> Real {
    let n = 32;
    let domain = Domain::solo(Grid::new([n, 1, 1], Vector::ZERO, Vector::ONE), [true; 3]);
    let fluids = Fluids { liquid_density: 1.0, gas_density: 1.0, liquid_viscosity: 0.1, gas_viscosity: 0.1 };
    let mut flow = Flow::new(&domain, fluids, Schemes { viscosity: scheme, ..Schemes::default() });
    let wave = |i: isize| (2.0 * std::f64::consts::PI * (i as Real + 0.5) / n as Real).sin();
    domain.set(&mut flow.velocity[1], |i, _, _| wave(i));
    flow.fill_halos(&domain, &Boundary::all_periodic());
    let dt = time / steps as Real;
    for _ in 0..steps {
        // Nothing moves, but Crank-Nicolson takes its first half here.
        flow.transport(&domain, &Boundary::all_periodic(), dt);
        flow.diffuse(&domain, &Boundary::all_periodic(), dt).expect("the viscous step is solved");
    }
    flow.velocity[1][[5, 0, 0]] / wave(5)
}

#[test]
fn a_shear_wave_decays_at_its_rate() {
    let (n, time): (Real, Real) = (32.0, 0.25);
    let rate = 0.1 * (2.0 * n * (std::f64::consts::PI / n).sin()).powi(2);
    let exact = (-rate * time).exp();
    for (scheme, order) in [(ViscosityScheme::Implicit, 0.9), (ViscosityScheme::CrankNicolson, 1.9)] {
        let errors = [8, 16, 32].map(|steps| (decay(scheme, time, steps) - exact).abs());
        println!("{scheme:?}: {errors:?}");
        assert!(errors.windows(2).all(|pair| (pair[0] / pair[1]).log2() > order));
    }
    let errors = [600, 1200].map(|steps| (decay(ViscosityScheme::Explicit, time, steps) - exact).abs());
    assert!((errors[0] / errors[1]).log2() > 0.9);
    assert_eq!(decay(ViscosityScheme::Off, time, 3), 1.0);
}

/// `auto` is explicit as long as `2 nu dt sum 1/dx^2` is at most a tenth, else implicit: to the bit.
#[test]
fn automatic_viscosity_is_explicit_in_short_steps() {
    let cell: Real = 1.0 / 32.0;
    // In a direction of one cell the width is that of the box.
    let longest = 0.1 / (2.02 * 0.1 * (1.0 / (cell * cell) + 2.0));
    for (dt, same, other) in [
        (0.99 * longest, ViscosityScheme::Explicit, ViscosityScheme::Implicit),
        (1.01 * longest, ViscosityScheme::Implicit, ViscosityScheme::Explicit),
    ] {
        let found = decay(ViscosityScheme::Auto, 5.0 * dt, 5);
        assert_eq!(found, decay(same, 5.0 * dt, 5), "step of {dt} s");
        // Negative control: the two differ.
        assert_ne!(found, decay(other, 5.0 * dt, 5));
    }
}

/// A drop in a box, with a velocity that varies everywhere.
fn stirred(domain: &Domain, boundary: &Boundary, viscosity: ViscosityScheme) -> Flow {
    let fluids = Fluids { liquid_viscosity: 2.0, gas_viscosity: 0.02, ..WATER_AND_AIR };
    let mut flow = Flow::new(domain, fluids, Schemes { viscosity, ..Schemes::default() });
    let beta = ball(domain, Vector::new(0.45, 0.5, 0.55), 0.3, 4);
    flow.add_liquid(domain, boundary, &beta, |_| Vector::new(0.2, -0.1, -1.0), DropVelocity::Mass);
    for (d, u) in flow.velocity.iter_mut().enumerate() {
        let before = u.clone();
        domain.set(u, |i, j, k| {
            let x = domain.centre(i, j, k) * 2.0 * std::f64::consts::PI;
            before[[i, j, k]] + 0.3 * (x.x + d as Real).sin() * x.y.cos() * (x.z - d as Real).cos()
        });
    }
    flow.fill_halos(domain, boundary);
    flow
}

#[test]
fn viscosity_changes_momentum_at_walls_only() {
    let grid = Grid::new([12, 10, 9], Vector::ZERO, Vector::ONE);
    for scheme in [ViscosityScheme::Implicit, ViscosityScheme::CrankNicolson, ViscosityScheme::Explicit] {
        for periodic in [true, false] {
            let mut sides = [[Side::Slip, Side::Moving { velocity: Vector::new(1.0, 0.5, 0.2) }]; 3];
            sides[1] = [Side::NoSlip; 2];
            let boundary = if periodic { Boundary::all_periodic() } else { Boundary::new(sides).unwrap() };
            let domain = Domain::solo(grid, boundary.periodic());
            let mut flow = stirred(&domain, &boundary, scheme);
            let momentum = |flow: &Flow| flow.momentum(&domain).into_iter().sum::<Vector>();
            let before = momentum(&flow);
            let mut impulse = Vector::ZERO;
            for _ in 0..5 {
                flow.transport(&domain, &boundary, 1e-3);
                impulse += flow.diffuse(&domain, &boundary, 1e-3).unwrap().wall_impulse;
            }
            let residual = (momentum(&flow) - before - impulse).length() / before.length();
            println!("{scheme:?}, periodic {periodic}: impulse {:e}, residual {residual:e}", impulse.length());
            assert!(residual < 1e-13);
            assert!(impulse.length() > 1e-6 || periodic);
        }
    }
}

#[test]
fn the_stress_that_loads_the_grains_is_the_one_applied() {
    let boundary = Boundary::closed();
    let domain = Domain::solo(Grid::new([12, 10, 9], Vector::ZERO, Vector::ONE), boundary.periodic());
    let mut flow = stirred(&domain, &boundary, ViscosityScheme::Implicit);
    let before = flow.velocity.clone();
    let dt = 2e-3;
    flow.diffuse(&domain, &boundary, dt).unwrap();
    for cell in [[0, 0, 0], [5, 5, 5], [3, 7, 2], [11, 9, 8]] {
        let acceleration = flow.viscous_acceleration(before[0].at(cell[0], cell[1], cell[2]), dt);
        for d in 0..3 {
            let change = flow.velocity[d][cell] - before[d][cell];
            assert!((acceleration[d] * dt - change).abs() < 1e-15);
        }
    }
}

#[test]
fn a_stiff_step_is_solved_to_the_stated_error() {
    // Against the same step in 64 parts with Crank-Nicolson there is only the error in time, so
    // compare with the discrete solution: the residual of the implicit equation.
    let (domain, boundary) = channel(16);
    let fluids = Fluids { liquid_density: 1.0, gas_density: 1.0, liquid_viscosity: 1.0, gas_viscosity: 1.0 };
    let mut flow = Flow::new(&domain, fluids, Schemes::default());
    domain.set(&mut flow.velocity[0], |_, _, k| if k % 3 == 0 { 1.0 } else { -0.4 });
    flow.fill_halos(&domain, &boundary);
    let column = |flow: &Flow| -> Vec<Real> { (0..16).map(|k| flow.velocity[0][[0, 0, k]]).collect() };
    let before = column(&flow);
    let dt = 0.5;
    let report = flow.diffuse(&domain, &boundary, dt).unwrap();
    let after = column(&flow);
    for k in 0..16 {
        let below = if k > 0 { after[k - 1] } else { -after[0] };
        let above = if k < 15 { after[k + 1] } else { -after[15] };
        let stiffness = dt * 256.0;
        let residual = after[k] - before[k] - stiffness * (below - 2.0 * after[k] + above);
        assert!(residual.abs() < 1e-5 * 4.0 * stiffness, "{k}: {residual} after {}", report.iterations);
    }
}

#[test]
fn faces_at_an_interface_keep_the_velocity_of_the_water() {
    let boundary = Boundary::closed();
    let domain = Domain::solo(Grid::new([4, 1, 1], Vector::ZERO, Vector::ONE), boundary.periodic());
    let mut flow = Flow::new(&domain, WATER_AND_AIR, Schemes::default());
    flow.volume_fraction[[1, 0, 0]] = 1.0;
    flow.velocity[0][[1, 0, 0]] = 9.0;
    flow.fill_halos(&domain, &boundary);
    flow.predict_faces(&domain, &boundary, Vector::new(-2.0, 0.0, 0.0), 0.5);
    let uf = &flow.face_velocity[0];
    assert_eq!([uf[[0, 0, 0]], uf[[4, 0, 0]]], [0.0, 0.0], "walls");
    assert!((uf[[1, 0, 0]] - (9000.0 / 1001.0 - 1.0)).abs() < 1e-14);
    assert!((uf[[3, 0, 0]] + 1.0).abs() < 1e-15);
    assert!((flow.velocity[0][[1, 0, 0]] - 8.0).abs() < 1e-15);
}

/// Three steps without pressure in a box with walls, an inlet and periodic sides; all fields as
/// seen on the whole grid.
fn steps(domain: &Domain, boundary: &Boundary) -> Vec<Vec<Real>> {
    let mut flow = stirred(domain, boundary, ViscosityScheme::Implicit);
    flow.predict_faces(domain, boundary, Vector::ZERO, 0.0);
    let dt = 0.4 / flow.advective_rate(domain);
    for _ in 0..3 {
        flow.transport(domain, boundary, dt);
        flow.diffuse(domain, boundary, dt).expect("the viscous step is solved");
        flow.predict_faces(domain, boundary, Vector::new(0.0, 0.0, -0.5), dt);
    }
    let fields = [&flow.volume_fraction, &flow.density].into_iter().chain(&flow.velocity).chain(&flow.face_velocity);
    fields.map(|field| domain.gather(field)).collect()
}

#[test]
fn ranks_and_threads_change_no_bit() {
    let grid = Grid::new([13, 12, 6], Vector::ZERO, Vector::ONE);
    let mut walls = [[Side::NoSlip; 2]; 3];
    walls[1][1] = Side::Slip;
    walls[2][1] = Side::Moving { velocity: Vector::X };
    let mut open = [[Side::Periodic; 2]; 3];
    open[0] = [Side::Inflow { velocity: Vector::new(0.4, 0.1, 0.0), fluid: FluidName::Liquid }, Side::Outflow];
    for sides in [walls, open] {
        let boundary = Boundary::new(sides).expect("the sides make a box");
        let alone = steps(&Domain::solo(grid, boundary.periodic()), &boundary);
        assert!(alone.iter().flatten().all(|v| v.is_finite()));
        for threads in [1, 2, 4] {
            let found = with_threads(threads, || steps(&Domain::solo(grid, boundary.periodic()), &boundary));
            assert_eq!(found.expect("the threads are granted"), alone);
        }
        for ranks in [2, 3, 4, 6] {
            let all = run_ranks(ranks, 1 + ranks % 2, |communicator| {
                steps(&Domain::new(grid, boundary.periodic(), communicator).unwrap(), &boundary)
            });
            assert_eq!(all.unwrap()[0], alone, "{ranks} ranks");
        }
    }
}
