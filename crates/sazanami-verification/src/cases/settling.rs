//! A sphere settling in a tank of oil (ten Cate, Nieuwstad, Derksen and Van den Akker 2002).

use sazanami_dem::Grain;
use sazanami_mics::boundary::Boundary;
use sazanami_mics::grains::Exchange;
use sazanami_numerics::geometry::{ContactSphereRule, Shape, VolumeRule};
use sazanami_numerics::grid::Grid;
use sazanami_numerics::{Real, Vector};

use super::tank::{Tank, down, single, step};
use crate::measured::Measured;

const SOURCE: &str = "ten Cate et al. 2002, Phys. Fluids 14";
const DIAMETER: Real = 15e-3;
/// Step of the exact exchange over `dx^2 / nu`.
const VISCOUS: Real = 0.1;

/// A run of the experiment.
#[derive(Clone, Copy)]
struct Oil {
    name: &'static str,
    density: Real,
    viscosity: Real,
    /// Largest speed in the experiment [m/s].
    fastest: Real,
    /// By when it is reached [s].
    until: Real,
    tolerance: Real,
}

const E1: Oil = Oil { name: "E1", density: 970.0, viscosity: 0.373, fastest: 0.035986, until: 1.5, tolerance: 0.08 };
const E2: Oil = Oil { name: "E2", density: 965.0, viscosity: 0.212, fastest: 0.05718, until: 0.8, tolerance: 0.05 };
const E3: Oil = Oil { name: "E3", density: 962.0, viscosity: 0.113, fastest: 0.087269, until: 1.2, tolerance: 0.05 };
const E4: Oil = Oil { name: "E4", density: 960.0, viscosity: 0.058, fastest: 0.12224, until: 1.05, tolerance: 0.05 };

/// Largest speed of the sphere until `oil.until`, in steps of at most `viscous` times `dx^2 / nu`.
///
/// Back-projection acts once a step; in between momentum spreads by `sqrt(nu dt)` through the sphere's surface. The
/// exact exchange needs this to be a small part of a cell.
fn fastest(oil: Oil, cells_per_diameter: usize, exchange: Exchange, viscous: Real) -> Result<Real, String> {
    let width = DIAMETER / cells_per_diameter as Real;
    let extent = Vector::new(0.1, 0.1, 0.16);
    let grid = Grid::new(extent.to_array().map(|l| (l / width).round() as usize), Vector::ZERO, extent);
    let longest = viscous * width * width * oil.density / oil.viscosity;
    let mut tank = Tank::new(grid, Boundary::closed(), single(oil.density, oil.viscosity), longest.min(4e-3));
    tank.exchange = exchange;
    tank.gravity = down(9.81);
    tank.divergence = 1e-6;
    let sphere = Shape::sphere(DIAMETER, 3, VolumeRule::Preserve, &ContactSphereRule::Single);
    tank.shapes = vec![sphere.map_err(|error| error.to_string())?];
    tank.grains = vec![Grain::new(0, 1120.0, Vector::new(0.05, 0.05, 0.1275))];
    let mut solver = tank.solver(|domain, boundary, flow| flow.fill_halos(domain, boundary))?;
    let (mut time, mut fastest): (Real, Real) = (0.0, 0.0);
    while time < oil.until * (1.0 - 1e-9) {
        time += step(&mut solver, time, oil.until)?.0;
        fastest = fastest.max(-solver.grains().engine().grains().velocity[0].z);
    }
    Ok(fastest)
}

/// The exact exchange, which the band binds, and the stress integral beside it.
fn compared(oils: &[Oil]) -> Result<Vec<Measured>, String> {
    let mut rows = Vec::new();
    for oil in oils {
        let speed = fastest(*oil, 12, Exchange::Exact, VISCOUS)?;
        let quantity = format!("{}, exact: largest speed", oil.name);
        rows.push(Measured::near(quantity, "m/s", speed, oil.fastest, oil.tolerance).from_source(SOURCE));
        // Hardly depends on the step.
        let speed = fastest(*oil, 12, Exchange::Stress, 4.0 * VISCOUS)?;
        let row = Measured::info(format!("{}, stress: largest speed", oil.name), "m/s", speed);
        rows.push(Measured { reference: Some(oil.fastest), ..row }.from_source(SOURCE));
    }
    Ok(rows)
}

/// 5.5, Reynolds numbers 4.1 and 31.9.
pub(crate) fn settling() -> Result<Vec<Measured>, String> {
    compared(&[E2, E4])
}

/// 5.5, Reynolds numbers 1.5 and 11.6.
pub(crate) fn settling_rest() -> Result<Vec<Measured>, String> {
    compared(&[E1, E3])
}
