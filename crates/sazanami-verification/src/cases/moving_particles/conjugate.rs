//! The conjugate projection beside the same references.

use crate::measured::{Chart, Measured};
use crate::particles as experiments;
use sazanami_mps::scheme::{Projection, Scheme};
use sazanami_numerics::Real;

use super::fluid::column;
use super::said;
use super::waves::{drops, wave};

/// The scheme with its radii.
fn schemes() -> [Scheme; 2] {
    [2.6, 3.1].map(|radius| Scheme { projection: Projection::Conjugate, radius, ..Scheme::default() })
}

/// A drop that stretches.
pub fn conjugate_drop() -> Result<Vec<Measured>, String> {
    drops(&schemes())
}

/// A standing wave in ten layers, and a block in free fall.
pub fn conjugate_wave() -> Result<Vec<Measured>, String> {
    let mut rows = Vec::new();
    for scheme in schemes() {
        rows.extend(wave(scheme)?.0);
        let name = format!("radius {}", scheme.radius);
        let times = [1e-4, 0.02];
        let lattice = experiments::falling_block(scheme, 0.0, &times).map_err(said)?;
        let disordered = experiments::falling_block(scheme, 0.1, &times).map_err(said)?;
        rows.push(Measured::new(format!("{name}, falling lattice: rms error of the acceleration"), lattice[1]));
        for (time, error) in times.iter().zip(disordered) {
            let of = format!("{name}, falling block, disordered: rms error of the acceleration after {time} s");
            rows.push(Measured::new(of, error));
        }
    }
    Ok(rows)
}

/// Water at rest off the lattice, and under a tilted surface.
pub fn conjugate_still() -> Result<Vec<Measured>, String> {
    let [scheme, _] = schemes();
    let mut rows = Vec::new();
    for (name, tilt, jitter) in [("disordered", 0.0, 0.1), ("tilted", 0.16, 0.0)] {
        let setup = experiments::RestSetup { spacing: 1e-3, tilt, jitter, seconds: 1.0, scheme };
        let found = experiments::rest(&setup).map_err(said)?;
        rows.extend([
            Measured::new(format!("{name}: largest speed, last third of 1 s, of sqrt(g H)"), found.speed),
            Measured::new(format!("{name}: rms of the speed, last third of 1 s, of sqrt(g H)"), found.mean_speed),
            Measured::new(format!("{name}: mean kinetic energy, last over first third"), found.energy),
            Measured::new(format!("{name}: largest error of p at the end, of rho g H"), found.pressure_at_end),
            Measured::new(format!("{name}: drift of the surface, in spacings"), found.level.abs()),
            Measured::new(
                format!("control: {name}: largest speed before the damping, of sqrt(g H)"),
                found.first_speed,
            ),
        ]);
    }
    Ok(rows)
}

/// A column of Martin and Moyce.
pub fn conjugate_dam_break() -> Result<(Vec<Measured>, Vec<Chart>), String> {
    let (mut rows, mut charts) = (Vec::new(), Vec::new());
    for scheme in schemes() {
        let name = format!("radius {}", scheme.radius);
        let (measured, chart, series) = column(&name, 2, scheme)?;
        let first = rows.is_empty();
        rows.extend(measured.into_iter().filter(|row| first || !row.quantity.starts_with("control")));
        let largest = series.iter().map(|state| state.energy / series[0].energy).fold(0.0, Real::max);
        rows.push(Measured::new(format!("{name}: largest energy over the first"), largest));
        charts.push(chart);
    }
    Ok((rows, charts))
}
