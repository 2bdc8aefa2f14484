//! Time of a sub-step on a settled bed of the paper's size: a small periodic bed is packed, then tiled.
//!
//! `cargo run --release -p sazanami-dem --example settled_bed -- shell|axis [grains] [sub-steps] [threads]`

use std::time::Instant;

use sazanami_dem::{
    Body, Engine, Grain, Interactions, Lattice, LinearSpringDashpot, Loads, Packing, PackingSettings, Setup, Stage,
    Substeps, Wall,
};
use sazanami_numerics::domain::Domain;
use sazanami_numerics::geometry::{ContactSphereRule, Shape, SpheroidMesh, VolumeRule};
use sazanami_numerics::grid::Grid;
use sazanami_numerics::{Real, Vector};
use sazanami_parallel::with_threads;

fn domain(width: Real, height: Real, periodic: bool) -> Domain {
    let upper = Vector::new(width, width, height);
    Domain::solo(Grid::new([8, 8, 8], Vector::ZERO, upper), [periodic, periodic, false])
}

/// A settled bed of `count` grains in a periodic box.
fn tile(body: &Body, width: Real, count: u64) -> Vec<Grain> {
    let domain = domain(width, 0.05, true);
    let grains = (0..count).map(|id| Grain::new(id, 2650.0, Vector::ZERO)).collect();
    let settings = PackingSettings {
        periodic: [true; 2],
        lattice: Lattice::Low,
        step: 1e-4,
        settling_time: 1e-2,
        ..PackingSettings::new(Vector::ZERO, Vector::new(width, width, 0.05))
    };
    let laws = Interactions::uniform(1, LinearSpringDashpot::SAND);
    let mut packing = Packing::new(&domain, settings, vec![body.clone()], laws, grains).expect("the lattice fits");
    let start = Instant::now();
    loop {
        let report = packing.step(&domain).expect("the grains fall");
        if ((report.time * 1e4).round() as u64).is_multiple_of(50) {
            println!(
                "  {:?} t {:.4} mean speed {:.4} highest {:.5} contacts {} overlap {:.3} sub-steps {} {:.1} s",
                report.stage,
                report.time,
                report.mean_speed,
                report.highest,
                report.contacts.contacts,
                report.contacts.largest_overlap,
                report.contacts.substeps,
                start.elapsed().as_secs_f64(),
            );
        }
        if matches!(report.stage, Stage::Done | Stage::GivenUp) {
            println!(
                "  {:?} after {:.4} s, order {:.3}",
                report.stage,
                report.time,
                sazanami_dem::lying_order(&domain, packing.engine())
            );
            return packing.bed();
        }
    }
}

fn main() {
    let arguments: Vec<String> = std::env::args().collect();
    let number = |n: usize, default: usize| arguments.get(n).and_then(|a| a.parse().ok()).unwrap_or(default);
    let rule = match arguments.get(1).map(String::as_str) {
        Some("axis") => ContactSphereRule::Axis { count: 9 },
        _ => ContactSphereRule::Shell { count: 75, radius: Some(0.075e-3) },
    };
    let (tiles, substeps, threads) = (number(2, 4), number(3, 1000), number(4, 2));
    let shape =
        Shape::spheroid(0.26e-3, 0.635e-3, SpheroidMesh::PAPER, VolumeRule::Inscribed, &rule).expect("a sound shape");
    let body = Body::from(&shape);
    let width = 33.8e-3 / 4.0;
    with_threads(threads, || run(&body, width, tiles, substeps)).expect("the threads are granted");
}

fn run(body: &Body, width: Real, tiles: usize, substeps: usize) {
    let bed = tile(body, width, 1931);
    let mut grains = Vec::new();
    for j in 0..tiles {
        for i in 0..tiles {
            for grain in &bed {
                let mut grain = *grain;
                grain.position += width * Vector::new(i as Real, j as Real, 0.0);
                grains.push(grain);
            }
        }
    }
    grains.sort_by(|a, b| {
        let key = |g: &Grain| ((g.position.z / 1.2e-3) as i64, (g.position.y / 1.2e-3) as i64);
        key(a).cmp(&key(b)).then(a.position.x.total_cmp(&b.position.x))
    });
    (0_u64..).zip(&mut grains).for_each(|(id, grain)| grain.id = id);
    let all = width * tiles as Real;
    let domain = domain(all, 0.025, true);
    let setup = Setup {
        bodies: vec![body.clone()],
        interactions: Interactions::uniform(1, LinearSpringDashpot::SAND),
        walls: vec![Wall::at_rest(Vector::ZERO, Vector::Z, 0)],
        region: [Vector::splat(-1.0), Vector::ONE],
        ghost_margin: 0.0,
    };
    let mut engine = Engine::new(&domain, setup, &grains).expect("the bed stands");
    let gravity = Vector::new(0.0, 0.0, -9.8);
    let dt = engine.contact_time_step();
    println!("{} grains, sub-step {dt:.3e} s", grains.len());
    let settle = engine.advance(&domain, &Loads::none(), gravity, 3000.0 * dt, Substeps::Fixed(3000)).expect("rest");
    println!("settled: {settle:?}");
    for _ in 0..5 {
        let start = Instant::now();
        let time = dt * substeps as Real;
        let report = engine.advance(&domain, &Loads::none(), gravity, time, Substeps::Fixed(substeps)).expect("rest");
        let each = start.elapsed().as_secs_f64() / substeps as f64;
        println!(
            "{:.3} ms per sub-step, {} pairs, {} contacts, {} renewals, largest speed {:.4}, overlap {:.4}",
            each * 1e3,
            report.pairs,
            report.contacts,
            report.list_renewals,
            report.largest_speed,
            report.largest_overlap
        );
    }
}
