//! Trial.
use sazanami_dem::{Body, Engine, Grain, Interactions, LinearSpringDashpot, Motion, Setup, Wall};
use sazanami_mics::boundary::{Boundary, Side};
use sazanami_mics::flow::{DropVelocity, Flow, Fluids, Schemes};
use sazanami_mics::grains::room::LiquidRoom;
use sazanami_mics::grains::{Coupling, Exchange};
use sazanami_mics::pressure::Tolerance;
use sazanami_mics::solver::{Settings, Solver};
use sazanami_mics::stability::StepLimits;
use sazanami_mics::viscosity::ViscosityScheme;
use sazanami_numerics::domain::Domain;
use sazanami_numerics::geometry::{ContactSphereRule, Region, RegionFractions, Shape, VolumeRule};
use sazanami_numerics::grid::Grid;
use sazanami_numerics::{Real, Vector};

const FLUIDS: Fluids = Fluids { liquid_density: 1e3, gas_density: 1.0, liquid_viscosity: 1e-3, gas_viscosity: 1e-5 };

fn var(name: &str, default: Real) -> Real {
    std::env::var(name).ok().map_or(default, |v| v.parse().expect(name))
}
fn word(name: &str) -> String {
    std::env::var(name).unwrap_or_default()
}

#[test]
fn trial() {
    let width = var("H", 1e-4);
    let (n, nz) = (var("N", 16.0) as usize, var("NZ", 28.0) as usize);
    let d = var("D", 5.2) * width;
    let layers = var("LAYERS", 2.0) as usize;
    let motion = if word("MOTION") == "fixed" { Motion::Fixed } else { Motion::Free };
    let grid = Grid::new([n, n, nz], Vector::ZERO, width * Vector::from_array([n, n, nz].map(|n| n as Real)));
    let boundary = Boundary::new([[Side::Slip; 2]; 3]).expect("the case is sound");
    let domain = Domain::solo(grid, boundary.periodic());
    let viscosity = if word("VISC") == "off" { ViscosityScheme::Off } else { ViscosityScheme::Auto };
    let schemes = Schemes { viscosity, ..Schemes::default() };
    let mut flow = Flow::new(&domain, FLUIDS, schemes);
    let extent = grid.upper();
    let across = (extent.x / d) as usize;
    let gap = extent.x / across as Real;
    let mut grains = Vec::new();
    let rise = var("RISE", 1.0) * d;
    for k in 0..layers {
        let shift = if k % 2 == 1 { 0.5 * gap } else { 0.0 };
        let count = if k % 2 == 1 { across - 1 } else { across };
        for j in 0..count {
            for i in 0..count {
                let p = |i: usize| (i as Real + 0.5) * gap + shift;
                let position = Vector::new(p(i), p(j), 0.5 * d + k as Real * rise * 0.999);
                grains.push(Grain { motion, ..Grain::new(grains.len() as u64, var("RHO", 2650.0), position) });
            }
        }
    }
    let top = 0.5 * d + (layers - 1) as Real * rise + 0.5 * d;
    let mut add = |region: Region, velocity: Vector| {
        let exact = RegionFractions::new(&region, domain.grid(), 8);
        let mut beta = domain.field(0.0);
        domain.set(&mut beta, |i, j, k| exact.fraction(i, j, k));
        flow.add_liquid(&domain, &boundary, &beta, velocity, DropVelocity::Mass);
    };
    let pool = var("POOL", 0.0) * d;
    if pool > 0.0 {
        add(Region::Box { lower: Vector::ZERO, upper: Vector::new(extent.x, extent.y, pool) }, Vector::ZERO);
    }
    let speed = Vector::new(0.0, 0.0, -var("SPEED", 2.25));
    let radius = var("RADIUS", 6.0) * width;
    if radius > 0.0 {
        let centre = Vector::new(0.5 * extent.x, 0.5 * extent.y, top.max(pool) + radius + 0.5 * width);
        add(Region::Sphere { centre, radius }, speed);
    } else {
        let lower = Vector::new(0.0, 0.0, top.max(pool) + width);
        add(Region::Box { lower, upper: Vector::new(extent.x, extent.y, lower.z + 8.0 * width) }, speed);
    }
    let shape = Shape::sphere(d, 3, VolumeRule::Preserve, &ContactSphereRule::Single).expect("a sphere");
    let setup = Setup {
        bodies: vec![Body::from(&shape)],
        interactions: Interactions::uniform(1, LinearSpringDashpot { normal_stiffness: 2e3, tangential_stiffness: 2e3, ..LinearSpringDashpot::SAND }),
        walls: Wall::of_box(grid.lower, grid.upper(), 0, [[true; 2]; 3]),
        region: [grid.lower, grid.upper()],
        ghost_margin: 2.0 * width,
    };
    let engine = Engine::new(&domain, setup, &grains).expect("grains");
    let settings = Settings {
        gravity: Vector::new(0.0, 0.0, -9.8),
        limits: StepLimits { ..StepLimits::up_to(var("DTMAX", 1e-4)) },
        tolerance: Tolerance { divergence: 1e-10, max_iterations: 500 },
        incremental: false,
    };
    let exchange = if word("EXCHANGE") == "exact" { Exchange::Exact } else { Exchange::Surface };
    let room = if word("ROOM") == "whole" { LiquidRoom::Whole } else { LiquidRoom::Open };
    let coupling = Coupling { exchange, room, ..Coupling::default() };
    let mut solver = Solver::new(domain, boundary, settings, flow, engine, vec![shape].into(), coupling).expect("ok");
    let until = var("UNTIL", 1e-3);
    let (mut time, mut count) = (0.0, 0);
    let every = var("EVERY", 10.0) as usize;
    println!("{} grains", solver.grains().count());
    while time < until {
        let step = solver.stable_step();
        let dt = step.dt.min(until - time).min(var("DT", 1.0));
        let report = match solver.step(step, dt, |_| ()) {
            Ok(report) => report,
            Err(error) => {
                println!("{count} {time:.4e}: {error}");
                break;
            }
        };
        time += dt;
        count += 1;
        if count % every == 0 {
            let d = solver.domain();
            let p = solver.pressure().data();
            let (c, alpha) = (solver.flow().volume_fraction.data(), solver.grains().covered().solid_fraction.data());
            let mut worst = [0.0_f64, 0.0, 0.0, 1.0, 1.0, 0.0, 0.0];
            let mut place = [0; 3];
            let u = solver.flow().velocity.each_ref().map(|f| f.data());
            let [a, b, cc] = d.cells();
            for k in 0..cc { for j in 0..b { for i in 0..a {
                let at = p.len().min(solver.pressure().at(i as isize, j as isize, k as isize));
                if p[at].abs() > worst[0] { worst[0] = p[at].abs(); place = [i, j, k]; }
                let speed = (0..3).map(|d| u[d][at] * u[d][at]).sum::<Real>().sqrt();
                if c[at] > 0.5 { worst[1] = worst[1].max(speed); }
                let [_, v] = solver.liquid_and_room(at);
                if solver.has_open_room() && c[at] == 1.0 {
                    let x = v - (1.0 - alpha[at].min(1.0));
                    worst[2] = worst[2].max(x.abs());
                    worst[5] += x.abs();
                    worst[6] += alpha[at];
                    if alpha[at] == 0.0 { worst[3] = worst[3].min(v); } else { worst[4] = worst[4].min(v); }
                }
            }}}
            let grains = solver.grains().engine().grains();
            let fastest = grains.velocity.iter().map(|v| v.length()).fold(0.0, Real::max);
            let kinetic: Real = (0..grains.owned()).map(|n| 0.5 * grains.mass[n] * grains.velocity[n].length_squared()).sum();
            println!("{count} t {time:.4e} dt {dt:.2e} passes {} E_f {:.4e} E_g {kinetic:.3e} vmax {fastest:.3} p {:.3e} at {place:?} u {:.3} delta {:.3} min free V {:.3} covered V {:.3} sum|delta| {:.2} of {:.1} clip {:.1e} rounds {}",
                report.fluid_passes, solver.fluid_energy(), worst[0], worst[1], worst[2], worst[3], worst[4], worst[5], worst[6], report.transport.settled.clipped_amount, report.transport.settled.rounds);
        }
    }
}
