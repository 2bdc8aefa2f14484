//! One fluid, or two that do not mix: vortices, channels, the cavity, the projection by itself.

use std::f64::consts::PI;

use crate::grid::{
    CavityError, Experiment, Reynolds, TimeOrder, cavity, slip_box_vortex, taylor_green, taylor_green_in_time,
};
use sazanami_dem::Random;
use sazanami_mics::advection::Limiter;
use sazanami_mics::boundary::{Boundary, Side};
use sazanami_mics::flow::Schemes;
use sazanami_mics::pressure::{PressureReport, PressureSide, Projection, Tolerance};
use sazanami_mics::viscosity::ViscosityScheme;
use sazanami_numerics::domain::{Domain, GhostRules};
use sazanami_numerics::grid::{Field, Grid};
use sazanami_numerics::{Real, Vector};

use super::tank::{largest, single};
use crate::measured::{Chart, Measured};

/// Observed orders of a sequence of errors, each from twice as fine as the one before.
pub(crate) fn orders<const N: usize>(errors: [Real; N]) -> Vec<Real> {
    errors.windows(2).map(|pair| (pair[0] / pair[1]).log2()).collect()
}

/// Smallest of `values`; not a number if one of them is not.
fn smallest(values: &[Real]) -> Real {
    values.iter().copied().fold(Real::INFINITY, |a, b| if a.is_nan() || b.is_nan() { Real::NAN } else { a.min(b) })
}

/// The results of `run` for each of `inputs`.
pub(crate) fn each<I: Copy, O, E: std::fmt::Display, const N: usize>(
    inputs: [I; N],
    run: impl Fn(I) -> Result<O, E>,
) -> Result<[O; N], String> {
    let outputs: Result<Vec<O>, String> =
        inputs.into_iter().map(|i| run(i).map_err(|error| error.to_string())).collect();
    outputs?.try_into().map_err(|_| "as many results as inputs".to_owned())
}

/// Orders in space and time, and error of the energy, of Taylor-Green vortices at rest and drifting.
pub(crate) fn taylor_green_vortices() -> Result<Vec<Measured>, String> {
    let mut rows = Vec::new();
    for (name, drift) in [("at rest", 0.0), ("drifting", 0.7)] {
        let runs = each([16, 32, 64], |n| taylor_green(n, 6 * n, drift, TimeOrder::Second))?;
        let order = smallest(&orders(runs.map(|run| run.velocity)));
        rows.push(Measured::new(format!("{name}: order in space, 16 to 64 cells"), order));
        rows.push(Measured::new(format!("{name}: error of the kinetic energy on 64^2"), runs[2].energy));
        let [euler, second] =
            each([TimeOrder::First, TimeOrder::Second], |order| taylor_green_in_time(32, 16, drift, order))?;
        let order = smallest(&orders(euler));
        rows.push(Measured::new(format!("{name}: order in time on fixed 32^2, full projection"), order));
        // Missed: the slope of the upwind value, which knows the Courant number, leaves an error of dt h^2 on a fixed grid.
        let order = smallest(&orders(second));
        let quantity = format!("{name}: order in time on fixed 32^2, incremental");
        rows.push(Measured::new(quantity, order));
        let joint = each([16, 32, 64], |n| taylor_green(n, n / 2, drift, TimeOrder::Second))?;
        let order = smallest(&orders(joint.map(|run| run.velocity)));
        rows.push(Measured::new(format!("{name}: order in space and time, incremental"), order));
    }
    let together = each([32, 64], |n| taylor_green(n, n / 2, 0.0, TimeOrder::First))?;
    let order = orders(together.map(|run| run.velocity))[0];
    rows.push(Measured::new("control: order of Euler steps refined with the cells", order));
    Ok(rows)
}

/// Root mean square error of the velocity in the cells at the walls of the slip-box vortex when the wall pressure is
/// built from `u*/dt`: it then halves the normal velocity of those cells every step.
fn vortex_with_wrong_walls(n: usize, steps: usize) -> Result<Real, String> {
    let h = 1.0 / n as Real;
    let grid = Grid::new([n, 1, n], Vector::ZERO, Vector::new(1.0, h, 1.0));
    let mut sides = [[Side::Slip; 2]; 3];
    sides[1] = [Side::Periodic; 2];
    let boundary = Boundary::new(sides).map_err(|error| error.to_string())?;
    let schemes = Schemes { viscosity: ViscosityScheme::Off, limiter: Limiter::Unlimited, ..Schemes::default() };
    let mut run = Experiment::new(grid, boundary, single(1.0, 0.0), schemes);
    let exact = |x: Vector| {
        let (x, z) = (PI * x.x, PI * x.z);
        Vector::new(-x.sin() * z.cos(), 0.0, x.cos() * z.sin())
    };
    run.set_velocity(exact).map_err(|error| error.to_string())?;
    for _ in 0..steps {
        run.step(Vector::ZERO, 0.5 / steps as Real).map_err(|error| error.to_string())?;
        let last = n as isize - 1;
        for m in 0..=last {
            for end in [0, last] {
                run.flow.velocity[0][[end, 0, m]] *= 0.5;
                run.flow.velocity[2][[m, 0, end]] *= 0.5;
            }
        }
    }
    let at_wall = |x: Vector| x.x.min(1.0 - x.x).min(x.z.min(1.0 - x.z)) < h;
    let [error, scale] = run.mean(|x, u| {
        let wall = if at_wall(x) { 1.0 } else { 0.0 };
        [wall * (u - exact(x)).length_squared(), wall * exact(x).length_squared()]
    });
    Ok((error / scale).sqrt())
}

/// An inviscid vortex between slip walls: what the pressure on a wall does to the cells before it.
pub(crate) fn vortex_between_walls() -> Result<Vec<Measured>, String> {
    let runs = each([16, 32, 64], |n| slip_box_vortex(n, 2 * n, TimeOrder::Second))?;
    let mut rows = Vec::new();
    for (cells, name) in ["all cells", "cells at walls"].into_iter().enumerate() {
        let order = smallest(&orders(runs.map(|run| run[cells])));
        rows.push(Measured::new(format!("order in space, {name}"), order));
    }
    for (name, order) in [("full projection", TimeOrder::First), ("second order in time", TimeOrder::Second)] {
        let errors = each([64, 128, 256], |steps| slip_box_vortex(32, steps, order))?.map(|error| error[1]);
        let growth = (errors[1] / errors[0]).max(errors[2] / errors[1]);
        rows.push(Measured::new(format!("{name}: error at walls with half the step"), growth));
    }
    let wrong = each([64, 256], |steps| vortex_with_wrong_walls(32, steps))?;
    let right = slip_box_vortex(32, 256, TimeOrder::First).map_err(|error| error.to_string())?[1];
    rows.push(Measured::new("control: error with the wall pressure from u*/dt, over the true one", wrong[1] / right));
    rows.push(Measured::new("control: its growth from 64 to 256 steps", wrong[1] / wrong[0]));
    Ok(rows)
}

/// The lid-driven cavity at Reynolds numbers 100 and 1000.
pub(crate) fn lid_driven_cavity() -> Result<(Vec<Measured>, Vec<Chart>), String> {
    let (mut rows, mut charts) = (Vec::new(), Vec::new());
    for (name, n, reynolds) in [("Re 100, 64^2", 64, Reynolds::Hundred), ("Re 1000, 128^2", 128, Reynolds::Thousand)] {
        let found = cavity(n, reynolds).map_err(|error| error.to_string())?;
        let CavityError { along, across, profiles, .. } = found;
        rows.push(Measured::new(format!("{name}: largest error along"), along));
        rows.push(Measured::new(format!("{name}: largest error across"), across));
        let named = [("along the lid", "height"), ("across", "position")];
        for ((profile, table), (what, place)) in profiles.iter().zip(reynolds.tables()).zip(named) {
            let chart = Chart::new(&format!("{name}: velocity {what}"), place, "velocity of the lid");
            charts.push(chart.computed("computed", profile).reference("Ghia et al.", &table));
        }
    }
    let coarse = cavity(16, Reynolds::Hundred).map_err(|error| error.to_string())?;
    rows.push(Measured::new("control: Re 100 on 16^2", coarse.along.max(coarse.across)));
    Ok((rows, charts))
}

/// A random velocity in a closed box of liquid and gas sprinkled cell by cell.
struct Sprinkled {
    domain: Domain,
    density: Field<Real>,
    velocity: [Field<Real>; 3],
    faces: [Field<Real>; 3],
}

impl Sprinkled {
    fn new(n: usize) -> Self {
        let domain = Domain::solo(Grid::new([n; 3], Vector::ZERO, Vector::splat(1e-3 * n as Real)), [false; 3]);
        let mut random = Random::new(5);
        let (mut density, mut velocity) = (domain.field(0.0), [0; 3].map(|_| domain.field(0.0)));
        let mut faces = velocity.clone();
        let last = n as isize;
        for k in 0..last {
            for j in 0..last {
                for i in 0..last {
                    density[[i, j, k]] = if random.unit() < 0.5 { 1e3 } else { 1.0 };
                    for d in 0..3 {
                        velocity[d][[i, j, k]] = random.between(-1.0, 1.0);
                        let inside = [i, j, k][d] > 0;
                        faces[d][[i, j, k]] = if inside { random.between(-1.0, 1.0) } else { 0.0 };
                    }
                }
            }
        }
        domain.fill_halos(&mut [(&mut density, &GhostRules::EVEN)]);
        Self { domain, density, velocity, faces }
    }

    fn project(&mut self, projection: &mut Projection, dt: Real, divergence: Real) -> Result<PressureReport, String> {
        let tolerance = Tolerance { divergence, max_iterations: 500 };
        let Self { domain, density, velocity, faces } = self;
        projection
            .project(domain, density, velocity, faces, Vector::ZERO, dt, &tolerance)
            .map_err(|error| error.to_string())
    }

    /// Largest |div u| dt, by sums over the faces made here.
    fn divergence(&self, dt: Real) -> Real {
        let n = self.domain.cells().map(|n| n as isize);
        let mut worst: Real = 0.0;
        for k in 0..n[2] {
            for j in 0..n[1] {
                for i in 0..n[0] {
                    let [f1, f2, f3] = &self.faces;
                    let sum = f1[[i + 1, j, k]] - f1[[i, j, k]] + f2[[i, j + 1, k]] - f2[[i, j, k]] + f3[[i, j, k + 1]]
                        - f3[[i, j, k]];
                    worst = worst.max((sum / 1e-3 * dt).abs());
                }
            }
        }
        worst
    }

    fn momentum(&self) -> Vector {
        let rho = self.density.data();
        let sum = self.domain.sum_rows(&self.domain.interior(), |row| {
            let part = |d: usize| row.shifted(0).map(|at| rho[at] * self.velocity[d].data()[at]).sum::<Real>();
            [part(0), part(1), part(2)]
        });
        Vector::from_array(sum) * self.domain.grid().cell_volume()
    }
}

/// The projection of a random velocity with density jumps of 1000 cell by cell.
pub(crate) fn projection() -> Result<Vec<Measured>, String> {
    let (dt, asked) = (1e-4, 1e-10);
    let mut box_ = Sprinkled::new(40);
    let mut projection = Projection::new(&box_.domain, [[PressureSide::Wall; 2]; 3]);
    let before = box_.divergence(dt);
    let momentum = box_.momentum();
    let scale = 500.0 * box_.domain.grid().cell_volume() * box_.domain.grid().len() as Real;
    let report = box_.project(&mut projection, dt, asked)?;
    let after = box_.divergence(dt);
    let gained = box_.momentum() - momentum;
    let faces = box_.faces.clone();
    let mut again = Projection::new(&box_.domain, [[PressureSide::Wall; 2]; 3]);
    box_.project(&mut again, dt, asked)?;
    let changes =
        box_.faces.iter().zip(&faces).flat_map(|(a, b)| a.data().iter().zip(b.data()).map(|(a, b)| (a - b).abs()));
    let change = largest(changes) * dt / 1e-3;
    Ok(vec![
        Measured::new("control: largest |div u| dt before", before),
        Measured::new("largest |div u| dt over the tolerance", after / asked),
        Measured::new("change of a face by a second projection, dt/dx, over the tolerance", change / asked),
        Measured::new("momentum not explained by the wall pressure", (gained - report.wall_impulse).length() / scale),
        Measured::new("control: momentum gained", gained.length() / scale),
        Measured::new("iterations", report.iterations as Real),
    ])
}
