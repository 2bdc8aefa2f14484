//! Fluids and grains that have no reason to move.

use sazanami_dem::Grain;
use sazanami_mics::boundary::Boundary;
use sazanami_numerics::geometry::{ContactSphereRule, Shape};
use sazanami_numerics::grid::Grid;
use sazanami_numerics::{Real, Vector};

use super::tank::{Tank, WATER_AND_AIR, down, step};
use crate::measured::Measured;

const GRAVITY: Real = 9.8;
const BLOCK_DENSITY: Real = 2650.0;

/// A block of 3.2 mm on four feet, the feet 10 um below it, so that no part of it dips into the floor.
fn block() -> Result<Shape, String> {
    let (half, foot) = (1.6e-3, 0.4e-3);
    let corner = |x: Real, y: Real| (Vector::new(x, y, -half + foot - 10e-6), foot);
    let out = half - foot;
    let feet = vec![corner(-out, -out), corner(out, -out), corner(-out, out), corner(out, out)];
    Shape::cuboid(Vector::splat(2.0 * half), &ContactSphereRule::Listed(feet)).map_err(|error| error.to_string())
}

/// Contact force over weight of a block on the floor, and the same with the buoyancy of plain central
/// differences of the pressure, after 200 steps.
fn carried(liquid: bool) -> Result<[Real; 2], String> {
    let grid = Grid::new([12, 12, 16], Vector::ZERO, Vector::new(9.6e-3, 9.6e-3, 12.8e-3));
    let mut tank = Tank::new(grid, Boundary::closed(), WATER_AND_AIR, 2e-5);
    tank.divergence = 1e-13;
    tank.gravity = down(GRAVITY);
    let shape = block()?;
    let weight = BLOCK_DENSITY * shape.volume() * GRAVITY;
    // Off the cells' faces in the plane, and pressed into the floor by what it weighs.
    let rho = if liquid { WATER_AND_AIR.liquid_density } else { WATER_AND_AIR.gas_density };
    let share = 1.0 - rho / BLOCK_DENSITY;
    let overlap = weight * share / 4.0 / tank.law.normal_stiffness;
    tank.grains = vec![Grain::new(0, BLOCK_DENSITY, Vector::new(4.7e-3, 4.9e-3, 1.6e-3 + 10e-6 - overlap))];
    tank.shapes = vec![shape];
    let mut solver = tank.solver(|domain, boundary, flow| {
        flow.volume_fraction.fill(if liquid { 1.0 } else { 0.0 });
        flow.fill_halos(domain, boundary);
    })?;
    let mut time = 0.0;
    for _ in 0..200 {
        time += step(&mut solver, time, Real::INFINITY)?.0;
    }
    let contact = solver.grains().engine().grains().contact_force[0].z;
    // Central differences that know nothing of the wall: the ghost is a copy of the cell.
    let (p, covered) = (solver.pressure(), solver.grains().covered());
    let strides = p.strides();
    let naive: Real = covered
        .shares(0)
        .iter()
        .map(|share| {
            let at = share.at as usize;
            let floor = at / strides[2] == sazanami_numerics::grid::GHOSTS;
            let below = if floor { p.data()[at] } else { p.data()[at - strides[2]] };
            -share.fraction * grid.face_area(2) * 0.5 * (p.data()[at + strides[2]] - below)
        })
        .sum();
    Ok([contact / weight, 1.0 - naive / weight])
}

/// A block on the floor carries its weight less that of the displaced fluid.
pub(crate) fn block_on_floor() -> Result<Vec<Measured>, String> {
    let air = 1.0 - 1.0 / BLOCK_DENSITY;
    let [in_air, naive] = carried(false)?;
    let [in_water, _] = carried(true)?;
    Ok(vec![
        Measured::new("contact force over weight, in air", in_air),
        Measured::new("contact force over weight, in water", in_water),
        Measured::new("control: error with plain pressure differences", (naive - air).abs()),
    ])
}
