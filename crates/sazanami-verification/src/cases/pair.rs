//! Two spheres that fall one behind the other: the one in the wake catches up, touches, and the pair turns over.

use sazanami_dem::Grain;
use sazanami_mics::boundary::{Boundary, Side};
use sazanami_numerics::grid::Grid;
use sazanami_numerics::{Real, Vector};

use super::tank::{Tank, ball, down, single, step};
use crate::measured::Measured;

/// Box in diameters.
const SIZE: [Real; 3] = [6.0, 6.0, 30.0];

/// Drafting, kissing and tumbling of two spheres.
#[derive(Clone, Copy, Debug)]
struct Meeting {
    /// When they first touch; not a number if never.
    touched: Real,
    /// Largest speed of the upper sphere over that of the lower before.
    faster: Real,
    /// Distance of the centres at the end.
    apart: Real,
    /// Largest angle of the line of centres to the vertical \[degrees].
    turned: Real,
}

/// Two spheres of relative density 1.5 fall from 2.5 diameters above one another, the upper one `beside` to the side: lengths in
/// diameters, velocities in that at which the drag of Clift et al. at Reynolds number 100 balances the weight of one.
fn meet(cells: usize, beside: Real) -> Result<Meeting, String> {
    let n = SIZE.map(|l| (l * cells as Real).round() as usize);
    let grid = Grid::new(n, Vector::ZERO, Vector::from_array(SIZE));
    let mut sides = [[Side::Slip; 2]; 3];
    sides[2] = [Side::NoSlip; 2];
    let boundary = Boundary::new(sides).map_err(|error| error.to_string())?;
    let mut tank = Tank::new(grid, boundary, single(1.0, 0.01), 0.05);
    tank.gravity = down(0.75 * 1.0875 / 0.5);
    tank.divergence = 1e-6;
    tank.shapes = vec![ball(1.0)?];
    let lower = Vector::new(0.5 * (SIZE[0] - beside), 0.5 * SIZE[1], SIZE[2] - 4.5);
    let lower = lower + Vector::new(0.21, 0.37, 0.13) * grid.spacing;
    // A little beside one another always, so that the pair can turn.
    let upper = lower + Vector::new(beside + 0.02, 0.0, 2.5);
    tank.grains = vec![Grain::new(0, 1.5, lower), Grain::new(1, 1.5, upper)];
    let mut solver = tank.solver(|domain, boundary, flow| flow.fill_halos(domain, boundary))?;
    let mut found = Meeting { touched: Real::NAN, faster: 0.0, apart: 0.0, turned: 0.0 };
    let mut time = 0.0;
    loop {
        let (dt, report) = step(&mut solver, time, Real::INFINITY)?;
        time += dt;
        let grains = solver.grains().engine().grains();
        let between = grains.position[1] - grains.position[0];
        if report.contacts.pairs > 0 && found.touched.is_nan() {
            found.touched = time;
        }
        if found.touched.is_nan() {
            found.faster = found.faster.max(grains.velocity[1].z / grains.velocity[0].z);
        }
        let angle = Vector::new(between.x, between.y, 0.0).length().atan2(between.z).to_degrees();
        found.turned = found.turned.max(angle);
        found.apart = between.length();
        if grains.position[0].z.min(grains.position[1].z) < 1.5 || time > 60.0 {
            return Ok(found);
        }
    }
}

/// One behind the other, and side by side.
pub(crate) fn two_spheres() -> Result<Vec<Measured>, String> {
    let found = meet(5, 0.0)?;
    let mut rows = vec![
        Measured::new("speed of the upper over the lower before they touch", found.faster),
        Measured::new("time at which they touch", found.touched),
        Measured::new("angle of the line of centres to the vertical", found.turned),
        Measured::new("distance of the centres at the end", found.apart),
    ];
    // Negative control: two diameters to the side there is no wake to fall in.
    let control = meet(5, 2.0)?;
    rows.push(Measured::new("control, two diameters to the side: speed of the upper over the lower", control.faster));
    rows.push(Measured::new("control, two diameters to the side: distance at the end", control.apart));
    Ok(rows)
}
