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
