//! Liquid carried by a prescribed velocity.

use std::f64::consts::PI;

use crate::grid::{ShapeError, deformation, reversed_vortex, translation};
use sazanami_mics::advection::Convection;
use sazanami_mics::ball::ball;
use sazanami_mics::boundary::Boundary;
use sazanami_mics::flow::{Flow, Fluids, Schemes};
use sazanami_numerics::domain::Domain;
use sazanami_numerics::grid::Grid;
use sazanami_numerics::{Real, Vector};

use crate::measured::Measured;

/// Largest of `values`, at least zero; not a number if one of them is not.
fn largest(values: impl IntoIterator<Item = Real>) -> Real {
    values.into_iter().fold(0.0, |a: Real, b| if a.is_nan() || b.is_nan() { Real::NAN } else { a.max(b) })
}

/// Observed orders of a sequence of errors, each from twice as fine as the one before.
fn orders<const N: usize>(errors: [Real; N]) -> Vec<Real> {
    errors.windows(2).map(|pair| (pair[0] / pair[1]).log2()).collect()
}

/// Relative change of the liquid volume in vortices in a periodic box, 50 steps, the velocities along x1 times `stretch`.
fn drift(stretch: Real) -> Real {
    let (n, h) = (32, 1.0 / 32.0);
    let domain = Domain::solo(Grid::new([n, 1, n], Vector::ZERO, Vector::new(1.0, h, 1.0)), [true; 3]);
    let boundary = Boundary::all_periodic();
    let schemes = Schemes { convection: Convection::Off, ..Schemes::default() };
    let fluids = Fluids { liquid_density: 1e3, gas_density: 1.0, liquid_viscosity: 1e-3, gas_viscosity: 1e-5 };
    let mut flow = Flow::new(&domain, fluids, schemes);
    flow.volume_fraction = ball(&domain, Vector::new(0.4, 0.5 * h, 0.55), 0.21, 16);
    let stream = |i: isize, k: isize| (2.0 * PI * i as Real * h).sin() * (2.0 * PI * k as Real * h).sin() / (2.0 * PI);
    domain.set(&mut flow.face_velocity[0], |i, _, k| -stretch * (stream(i, k + 1) - stream(i, k)) / h);
    domain.set(&mut flow.face_velocity[2], |i, _, k| (stream(i + 1, k) - stream(i, k)) / h);
    flow.fill_halos(&domain, &boundary);
    let volume = flow.liquid_volume(&domain);
    let mut clipped = 0.0;
    for _ in 0..50 {
        clipped += flow.transport(&domain, &boundary, 0.4 * h).residue.clipped_volume;
    }
    ((flow.liquid_volume(&domain) - volume - clipped) / volume).abs()
}

/// A sphere carried once along the diagonal of a periodic box.
pub(crate) fn carried_sphere() -> Result<Vec<Measured>, String> {
    let runs = [16, 32, 64].map(translation);
    let worst = |value: fn(&ShapeError) -> Real| largest(runs.iter().map(value));
    let order = orders(runs.map(|run| run.shape));
    Ok(vec![
        Measured::new("change of the volume", worst(|run| run.volume.abs())),
        Measured::new("largest C - 1", worst(|run| run.range[1] - 1.0)),
        Measured::new("largest -C", worst(|run| -run.range[0])),
        Measured::new("order of the shape error, 16 to 32", order[0]),
        Measured::new("order of the shape error, 32 to 64", order[1]),
        Measured::new("vortices: change of the volume", drift(1.0)),
        Measured::new("control: with a divergence", drift(1.01)),
    ])
}

/// The reversed single vortex.
pub(crate) fn vortex() -> Result<Vec<Measured>, String> {
    let mut rows = Vec::new();
    let runs = [32, 64, 128].map(|n| (n, reversed_vortex(n)));
    for (n, run) in &runs {
        rows.push(Measured::new(format!("{n}^2: shape error"), run.shape));
    }
    rows.push(Measured::new("change of the volume", largest(runs.iter().map(|(_, run)| run.volume.abs()))));
    rows.push(Measured::new("control: 16^2", reversed_vortex(16).shape));
    Ok(rows)
}

/// Deformation in three dimensions.
pub(crate) fn deformed_sphere() -> Result<Vec<Measured>, String> {
    let run = deformation(64);
    Ok(vec![
        Measured::new("64^3: shape error", run.shape),
        Measured::new("change of the volume", run.volume.abs()),
        Measured::new("control: 24^3", deformation(24).shape),
    ])
}
