//! Flow between plates under a body force, with exact steady profiles.

use sazanami_numerics::grid::Grid;
use sazanami_numerics::{Real, Vector};

use super::experiment::{Experiment, ExperimentError};
use sazanami_mics::boundary::{Boundary, Side};
use sazanami_mics::flow::{Fluids, Schemes};

/// Steady velocities between no-slip plates at `z = 0` and 1, from the lower plate up; the fluid of
/// cell `k` has the liquid part `liquid(k)`.
fn profile(
    n: usize,
    fluids: Fluids,
    force: Real,
    liquid: impl Fn(usize) -> Real + Sync,
) -> Result<Vec<Real>, ExperimentError> {
    let mut sides = [[Side::Periodic; 2]; 3];
    sides[2] = [Side::NoSlip; 2];
    let boundary = Boundary::new(sides).expect("periodic sides stand opposite each other");
    let mut run =
        Experiment::new(Grid::new([1, 1, n], Vector::ZERO, Vector::ONE), boundary, fluids, Schemes::default());
    let Experiment { domain, boundary, flow, .. } = &mut run;
    flow.viscous_tolerance = 1e-13;
    domain.set(&mut flow.volume_fraction, |_, _, k| liquid(k as usize));
    flow.fill_halos(domain, boundary);
    let dt = 2.0;
    for _ in 0..60 {
        flow.predict_faces(domain, boundary, Vector::new(force, 0.0, 0.0), dt);
        flow.diffuse(domain, boundary, dt)?;
    }
    Ok((0..n as isize).map(|k| flow.velocity[0][[0, 0, k]]).collect())
}

/// Largest relative error of plane Poiseuille flow on `n` cells against the exact solution of the
/// difference equations, `g / (2 nu) (y (h - y) + dy^2 / 4)`.
///
/// # Errors
/// [`ExperimentError`] if a step fails.
pub fn poiseuille(n: usize) -> Result<Real, ExperimentError> {
    let fluids = Fluids { liquid_density: 2.0, gas_density: 2.0, liquid_viscosity: 0.3, gas_viscosity: 0.3 };
    let (force, nu, h) = (0.7, 0.15, 1.0 / n as Real);
    let errors = profile(n, fluids, force, |_| 0.0)?.into_iter().enumerate().map(|(k, u)| {
        let y = (k as Real + 0.5) * h;
        (u / (force / (2.0 * nu) * (y * (1.0 - y) + h * h / 4.0)) - 1.0).abs()
    });
    Ok(errors.fold(0.0, Real::max))
}

/// Largest error, over the velocity in the middle of the upper layer, of two layers of equal depth
/// and density whose viscosities are as 50 to 1, on `n` cells (even).
///
/// # Errors
/// [`ExperimentError`] if a step fails.
pub fn two_layers(n: usize) -> Result<Real, ExperimentError> {
    let [mu1, mu2] = [1.0, 0.02];
    let fluids = Fluids { liquid_density: 1.0, gas_density: 1.0, liquid_viscosity: mu1, gas_viscosity: mu2 };
    // The stress is s - y; s follows from the continuity of the velocity at y = 1/2.
    let s = (1.0 / (8.0 * mu1) + 0.375 / mu2) / (0.5 / mu1 + 0.5 / mu2);
    let exact = |y: Real| {
        if y < 0.5 { (s * y - 0.5 * y * y) / mu1 } else { (s * (y - 1.0) - 0.5 * (y * y - 1.0)) / mu2 }
    };
    let u = profile(n, fluids, 1.0, |k| if k < n / 2 { 1.0 } else { 0.0 })?;
    let errors = u.iter().enumerate().map(|(k, u)| (u - exact((k as Real + 0.5) / n as Real)).abs());
    Ok(errors.fold(0.0, Real::max) / exact(0.75))
}
