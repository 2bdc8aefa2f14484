//! One fluid without an interface: Taylor-Green vortices, the lid-driven cavity.

use std::f64::consts::PI;

use sazanami_numerics::grid::Grid;
use sazanami_numerics::{Real, Vector};

use super::experiment::{Experiment, ExperimentError};
use crate::reference;
use sazanami_mics::advection::Limiter;
use sazanami_mics::boundary::{Boundary, Side};
use sazanami_mics::flow::{Carrier, Fluids, Schemes};
use sazanami_mics::viscosity::ViscosityScheme;

/// Accuracy in time.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TimeOrder {
    /// Euler steps with a full projection: what runs with liquid and grains use.
    First,
    /// Crank-Nicolson viscosity, faces in the middle of the step, pressure gradient carried along.
    Second,
}

impl TimeOrder {
    /// Unlimited slopes and the time integration of this order.
    fn schemes(self) -> Schemes {
        let schemes = Schemes { limiter: Limiter::Unlimited, ..Schemes::default() };
        match self {
            Self::First => schemes,
            Self::Second => Schemes { viscosity: ViscosityScheme::CrankNicolson, carrier: Carrier::Middle, ..schemes },
        }
    }
}

/// A fluid of density 1.
fn fluid(viscosity: Real) -> Fluids {
    Fluids { liquid_density: 1.0, gas_density: 1.0, liquid_viscosity: viscosity, gas_viscosity: viscosity }
}

/// Errors of the decaying vortices of Taylor and Green (1937).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct VortexError {
    /// Root mean square error of the velocity over the velocity at the start.
    pub velocity: Real,
    /// Error of the kinetic energy over the energy at the end.
    pub energy: Real,
}

/// Vortices `u = -cos x sin z`, `w = sin x cos z` in a periodic box of width 2 pi.
struct TaylorGreen {
    viscosity: Real,
    time: Real,
    /// Added to the velocity in x so that the vortices move.
    drift: Real,
}

impl TaylorGreen {
    fn exact(&self, x: Vector, t: Real) -> Vector {
        let (decay, x) = ((-2.0 * self.viscosity * t).exp(), Vector::new(x.x - self.drift * t, 0.0, x.z));
        Vector::new(self.drift - decay * x.x.cos() * x.z.sin(), 0.0, decay * x.x.sin() * x.z.cos())
    }

    fn run(&self, n: usize, steps: usize, order: TimeOrder) -> Result<Experiment, ExperimentError> {
        let width = 2.0 * PI;
        let grid = Grid::new([n, 1, n], Vector::ZERO, Vector::new(width, width / n as Real, width));
        let mut run = Experiment::new(grid, Boundary::all_periodic(), fluid(self.viscosity), order.schemes());
        run.pressure_carried = order == TimeOrder::Second;
        run.flow.viscous_tolerance = 1e-12;
        run.set_velocity(|x| self.exact(x, 0.0))?;
        for _ in 0..steps {
            run.step(Vector::ZERO, self.time / steps as Real)?;
        }
        Ok(run)
    }
}

/// Vortices with viscosity 0.05 on `n` x `n` cells, moving with `drift`, at `t = 1` after `steps`
/// steps.
///
/// # Errors
/// [`ExperimentError`] if a step fails.
pub fn taylor_green(n: usize, steps: usize, drift: Real, order: TimeOrder) -> Result<VortexError, ExperimentError> {
    let case = TaylorGreen { viscosity: 0.05, time: 1.0, drift };
    let [difference, scale, energy, end] = case.run(n, steps, order)?.mean(|x, u| {
        let exact = case.exact(x, case.time);
        let start = case.exact(x, 0.0).length_squared();
        [(u - exact).length_squared(), start, u.length_squared(), exact.length_squared()]
    });
    Ok(VortexError { velocity: (difference / scale).sqrt(), energy: (energy - end).abs() / end })
}

/// Root mean square differences of [`taylor_green`] in `steps`, 2 `steps` and 4 `steps` steps from
/// the same in 32 `steps`, over the velocity at the start: errors in time alone.
///
/// # Errors
/// [`ExperimentError`] if a step fails.
pub fn taylor_green_in_time(
    n: usize,
    steps: usize,
    drift: Real,
    order: TimeOrder,
) -> Result<[Real; 3], ExperimentError> {
    let case = TaylorGreen { viscosity: 0.05, time: 1.0, drift };
    let fine = case.run(n, 32 * steps, order)?;
    let mut errors = [0.0; 3];
    for (error, factor) in errors.iter_mut().zip([1, 2, 4]) {
        let coarse = case.run(n, factor * steps, order)?;
        let (u, v) = (&coarse.flow.velocity, &fine.flow.velocity);
        let domain = &fine.domain;
        let [square] = domain.sum_rows(&domain.interior(), |row| {
            [row.shifted(0).map(|at| (0..3).map(|d| (u[d].data()[at] - v[d].data()[at]).powi(2)).sum::<Real>()).sum()]
        });
        let [scale] = fine.mean(|x, _| [case.exact(x, 0.0).length_squared()]);
        *error = (square / domain.grid().len() as Real / scale).sqrt();
    }
    Ok(errors)
}

/// Error of an inviscid steady vortex `psi = sin(pi x) sin(pi z)` between slip walls on `n` x `n`
/// cells after `t = 0.5` in `steps` steps: root mean square of the velocity over that at the start,
/// in all cells and in those at walls.
///
/// # Errors
/// [`ExperimentError`] if a step fails.
pub fn slip_box_vortex(n: usize, steps: usize, order: TimeOrder) -> Result<[Real; 2], ExperimentError> {
    let h = 1.0 / n as Real;
    let grid = Grid::new([n, 1, n], Vector::ZERO, Vector::new(1.0, h, 1.0));
    let mut sides = [[Side::Slip; 2]; 3];
    sides[1] = [Side::Periodic; 2];
    let boundary = Boundary::new(sides).expect("both sides in x2 are periodic");
    let schemes = Schemes { viscosity: ViscosityScheme::Off, ..order.schemes() };
    let mut run = Experiment::new(grid, boundary, fluid(0.0), schemes);
    run.pressure_carried = order == TimeOrder::Second;
    let exact = |x: Vector| {
        let (x, z) = (PI * x.x, PI * x.z);
        Vector::new(-x.sin() * z.cos(), 0.0, x.cos() * z.sin())
    };
    run.set_velocity(exact)?;
    for _ in 0..steps {
        run.step(Vector::ZERO, 0.5 / steps as Real)?;
    }
    let at_wall = |x: Vector| x.x.min(1.0 - x.x).min(x.z.min(1.0 - x.z)) < h;
    let [all, wall, cells] = run.mean(|x, u| {
        let square = (u - exact(x)).length_squared();
        if at_wall(x) { [square, square, 1.0] } else { [square, 0.0, 0.0] }
    });
    let scale = run.mean(|x, _| [exact(x).length_squared()])[0];
    Ok([(all / scale).sqrt(), (wall / cells / scale).sqrt()])
}

/// Largest differences from Ghia, Ghia and Shin (1982), J. Comput. Phys. 48: velocity along the lid
/// on the vertical centre line, and across it on the horizontal one, over that of the lid.
#[derive(Clone, Debug, PartialEq)]
pub struct CavityError {
    /// Along the lid.
    pub along: Real,
    /// Of the velocity across the lid, on the horizontal centre line.
    pub across: Real,
    /// Time steps to the steady state.
    pub steps: usize,
    /// Position and velocity on the centre lines, along the lid and across.
    pub profiles: [Vec<[Real; 2]>; 2],
}

/// Reynolds numbers of the reference for the lid-driven cavity.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Reynolds {
    /// 100.
    Hundred,
    /// 400.
    FourHundred,
    /// 1000.
    Thousand,
}

impl Reynolds {
    /// Position and velocity along the lid and across it, away from the walls. The point at 0.9063 for 400 is left out: it
    /// breaks the curve of its neighbours, a known misprint.
    #[must_use]
    pub fn tables(self) -> [Vec<[Real; 2]>; 2] {
        let (along, across) = match self {
            Self::Hundred => ("u_re100", "v_re100"),
            Self::FourHundred => ("u_re400", "v_re400"),
            Self::Thousand => ("u_re1000", "v_re1000"),
        };
        let misprint = |d: &str, row: &[Real; 2]| d == "v_re400" && row[0] == 0.9063;
        [("y", along), ("x", across)].map(|(place, velocity)| {
            let mut table = reference::rows(reference::CAVITY, "", [place, velocity]);
            table.retain(|row| 0.0 < row[0] && row[0] < 1.0 && !misprint(velocity, row));
            table
        })
    }
}

/// The cavity of unit width under a lid that moves with unit velocity, on `n` x `n` cells, until the
/// velocity changes by less than 1e-5 per unit of time.
///
/// # Errors
/// [`ExperimentError`] if a step fails.
pub fn cavity(n: usize, reynolds: Reynolds) -> Result<CavityError, ExperimentError> {
    let viscosity = match reynolds {
        Reynolds::Hundred => 1e-2,
        Reynolds::FourHundred => 2.5e-3,
        Reynolds::Thousand => 1e-3,
    };
    let h = 1.0 / n as Real;
    let grid = Grid::new([n, 1, n], Vector::ZERO, Vector::new(1.0, h, 1.0));
    let mut sides = [[Side::NoSlip; 2]; 3];
    sides[1] = [Side::Periodic; 2];
    sides[2][1] = Side::Moving { velocity: Vector::X };
    let boundary = Boundary::new(sides).expect("both sides in x2 are periodic");
    let mut run = Experiment::new(grid, boundary, fluid(viscosity), Schemes::default());
    run.tolerance.divergence = 1e-7;
    let (dt, mut steps) = (0.4 * h, 0);
    let mut before = run.flow.velocity.clone();
    loop {
        run.step(Vector::ZERO, dt)?;
        steps += 1;
        // The order of the sweeps repeats after six steps.
        if steps % 60 == 0 {
            let change = run.largest_change(&before);
            if change < 1e-5 * 60.0 * dt || steps as Real * dt > 200.0 {
                break;
            }
            before.clone_from(&run.flow.velocity);
        }
    }
    let u = |d: usize, i: isize, k: isize| run.flow.velocity[d][[i, 0, k]];
    let n = n as isize;
    // The centre line runs along faces if the number of cells is even.
    let (low, high) = ((n - 1) / 2, n / 2);
    let line = |d: usize, s: isize| {
        let at = |m: isize| if d == 0 { u(0, m, s) } else { u(2, s, m) };
        0.5 * (at(low) + at(high))
    };
    let value = |d: usize, x: Real| {
        let place = x / h - 0.5;
        let cell = (place.floor() as isize).clamp(0, n - 2);
        let part = place - cell as Real;
        (1.0 - part) * line(d, cell) + part * line(d, cell + 1)
    };
    let largest = |d: usize, table: Vec<[Real; 2]>| {
        table.iter().map(|row| (value(d, row[0]) - row[1]).abs()).fold(0.0, Real::max)
    };
    let profiles = [0, 2].map(|d| (0..n).map(|s| [(s as Real + 0.5) * h, line(d, s)]).collect());
    let [along, across] = reynolds.tables();
    Ok(CavityError { along: largest(0, along), across: largest(2, across), steps, profiles })
}
