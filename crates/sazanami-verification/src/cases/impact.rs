//! A drop hits a bed of grains: where its momentum goes.

use sazanami_dem::Grain;
use sazanami_mics::boundary::Boundary;
use sazanami_mics::flow::DropVelocity;
use sazanami_mics::grains::Exchange;
use sazanami_mics::momentum::Impulses;
use sazanami_numerics::geometry::{ContactSphereRule, Region, Shape, VolumeRule};
use sazanami_numerics::grid::Grid;
use sazanami_numerics::{Real, Vector};

use super::tank::{Tank, WATER_AND_AIR, enter, fractions, new_budget, step};
use crate::measured::Measured;

const SPEED: Real = 9.0;
const GRAIN: Real = 0.52e-3;
/// Drop radius over grain diameter, as in the two-dimensional prototype.
const DROP: Real = GRAIN / 0.3;

/// Parts of the momentum of the drop after some radii of travel, over that at the start.
#[derive(Clone, Copy, Debug)]
struct Outcome {
    fluid: Real,
    grains: Real,
    /// Lost from fluid and grains, walls accounted for.
    lost: Real,
    /// Residual of the budget with all its lines over the largest.
    closed: Real,
    liquid: Real,
}

/// After the first radius, without viscosity.
fn outcome(cells_per_grain: Real, exchange: Exchange) -> Result<Outcome, String> {
    Ok(outcomes(cells_per_grain, exchange, false, [1.0])?[0])
}

/// After `radii` of travel of water and air, `viscous` or not.
fn outcomes<const N: usize>(
    cells_per_grain: Real,
    exchange: Exchange,
    viscous: bool,
    radii: [Real; N],
) -> Result<[Outcome; N], String> {
    let width = GRAIN / cells_per_grain;
    let cells = [5.0, 5.0, 5.0].map(|n| (n * DROP / width).round() as usize);
    let extent = Vector::from_array(cells.map(|n| n as Real)) * width;
    let grid = Grid::new(cells, Vector::ZERO, extent);
    let mut tank = Tank::new(grid, Boundary::closed(), WATER_AND_AIR, 1e-5);
    if !viscous {
        tank = tank.inviscid();
    }
    tank.exchange = exchange;
    tank.divergence = 1e-10;
    let sphere = Shape::sphere(GRAIN, 2, VolumeRule::Preserve, &ContactSphereRule::Single);
    tank.shapes = vec![sphere.map_err(|error| error.to_string())?];
    let bed_top = 2.2 * DROP;
    let (pitch, layer) = (1.1 * GRAIN, 0.967 * GRAIN);
    let across = (3.6 * DROP / pitch) as i32;
    for k in 0..3 {
        let shift = if k % 2 == 0 { 0.0 } else { 0.5 };
        for j in 0..across {
            for i in 0..across {
                let place = |n: i32, l: Real| 0.5 * l + (Real::from(n) - 0.5 * Real::from(across - 1) + shift) * pitch;
                let z = bed_top - (0.5 * GRAIN + Real::from(k) * layer);
                let position = Vector::new(place(i, extent.x), place(j, extent.y), z);
                tank.grains.push(Grain::new(tank.grains.len() as u64, 2650.0, position));
            }
        }
    }
    let centre = Vector::new(0.5 * extent.x, 0.5 * extent.y, bed_top + 1.1 * DROP);
    let mut solver = tank.solver(|domain, boundary, flow| {
        let beta = fractions(domain, &Region::Sphere { centre, radius: DROP });
        flow.add_liquid(domain, boundary, &beta, Vector::new(0.0, 0.0, -SPEED), DropVelocity::Mass);
    })?;
    let mut budget = new_budget(&solver);
    let liquid = solver.flow().liquid_volume(solver.domain());
    let start = budget.initial_total().z;
    let (mut time, mut clipped) = (0.0, 0.0);
    let mut found = [None; N];
    for (radii, found) in radii.iter().zip(&mut found) {
        let end = radii * DROP / SPEED;
        while time < end * (1.0 - 1e-9) {
            let (dt, report) = step(&mut solver, time, end)?;
            time += dt;
            clipped += report.transport.residue.clipped_volume;
            enter(&mut budget, &solver, &report);
        }
        let impulses = Impulses::from_terms(budget.impulses().map(|(_, impulse)| impulse));
        let walls = (impulses.walls_on_fluid + impulses.walls_on_grains).z;
        let now = solver.momentum();
        let (fluid, grains) = ((now.liquid + now.gas - now.displaced).z, now.grains.z);
        *found = Some(Outcome {
            fluid: fluid / start,
            grains: grains / start,
            lost: 1.0 - (fluid + grains - walls) / start,
            closed: budget.relative_residual(),
            liquid: (solver.flow().liquid_volume(solver.domain()) - liquid - clipped) / liquid,
        });
    }
    let found: Option<Vec<_>> = found.into_iter().collect();
    found.and_then(|found| found.try_into().ok()).ok_or_else(|| "the drop has not travelled".to_owned())
}

/// The momentum of a drop without viscosity stays in fluid and grains; the stress integral alone loses it.
pub(crate) fn drop_on_bed_inviscid() -> Result<Vec<Measured>, String> {
    let [coarse, found] = [outcome(1.7, Exchange::Surface)?, outcome(2.7, Exchange::Surface)?];
    let stress = outcome(2.7, Exchange::Stress)?;
    Ok(vec![
        Measured::new("closed budget, residual over largest term", found.closed.max(coarse.closed)),
        Measured::new("momentum lost in the first radius", found.lost.abs()),
        Measured::new("left in the fluid", found.fluid),
        Measured::new("in the grains, 1.7 cells a grain", coarse.grains),
        Measured::new("in the grains, 2.7 cells a grain", found.grains),
        Measured::new("1.7 cells over 2.7 cells: in the grains", coarse.grains / found.grains),
        Measured::new("liquid volume change", found.liquid.abs()),
        Measured::new("stress: in the grains", stress.grains),
        Measured::new("control: stress loses momentum", stress.lost),
    ])
}

/// The same with twice the cells: the share of the grains does not depend on them.
pub(crate) fn drop_on_bed_fine() -> Result<Vec<Measured>, String> {
    let [coarse, middle] = [outcome(1.7, Exchange::Surface)?, outcome(2.7, Exchange::Surface)?];
    let fine = outcome(5.4, Exchange::Surface)?;
    Ok(vec![
        Measured::new("5.4 cells: closed budget, residual over largest term", fine.closed),
        Measured::new("5.4 cells: in the grains", fine.grains),
        Measured::new("1.7 cells over 5.4 cells: in the grains", coarse.grains / fine.grains),
        Measured::new("2.7 cells over 5.4 cells: in the grains", middle.grains / fine.grains),
    ])
}

/// Momentum in the grains after one and after two radii of travel, and the worst residual of the budget.
fn shares(cells_per_grain: Real, viscous: bool) -> Result<[Real; 3], String> {
    let [first, second] = outcomes(cells_per_grain, Exchange::Surface, viscous, [1.0, 2.0])?;
    Ok([first.grains, second.grains, first.closed.max(second.closed)])
}

/// The share of the grains in viscous water does not depend on the cells.
pub(crate) fn drop_on_bed() -> Result<Vec<Measured>, String> {
    let mut rows = Vec::new();
    let finest = shares(4.0, true)?;
    for cells in [1.7, 2.7] {
        let found = shares(cells, true)?;
        for (n, radii) in ["one radius", "two radii"].into_iter().enumerate() {
            let name = format!("{cells} cells over 4 cells: in the grains after {radii}");
            rows.push(Measured::new(name, found[n] / finest[n]));
        }
        rows.push(Measured::new(format!("{cells} cells: closed budget, residual over largest term"), found[2]));
    }
    rows.push(Measured::new("4 cells: in the grains after one radius", finest[0]));
    rows.push(Measured::new("4 cells: in the grains after two radii", finest[1]));
    // Negative control: without friction less reaches narrow grains.
    let control = shares(1.7, false)?[1] / shares(4.0, false)?[1];
    rows.push(Measured::new("control: without viscosity, 1.7 cells over 4 cells, two radii", control));
    Ok(rows)
}
