//! Water alone.

use crate::measured::Measured;
use crate::particles as experiments;
use sazanami_mps::scheme::{CONJUGATE_RADIUS, Scheme};
use sazanami_numerics::Real;

use super::said;

/// A drop that stretches, with two radii.
pub fn stretching_drop() -> Result<Vec<Measured>, String> {
    let mut rows = Vec::new();
    for scheme in [2.6, 3.1].map(Scheme::conjugate) {
        let radius = scheme.radius;
        let found = experiments::stretching_drop(16, 1.0, scheme).map_err(said)?;
        let mut row = |quantity: &str, value| rows.push(Measured::new(format!("radius {radius}: {quantity}"), value));
        row("time reached, t A", found.time);
        row("kinetic energy over that at the start", found.energy);
        row("largest kinetic energy over that at the start", found.largest_energy);
        row("work of the stabilisation over the kinetic energy", found.stabilisation);
        row("rms error of the velocity", found.velocity);
        row("pressure in the middle over exact", found.pressure);
        row("part of the inner particles taken for surface", found.false_surface);
        row("collisions", found.collisions as Real);
        row("control, rms error beside a constant rate of strain", found.velocity_of_constant_rate);
    }
    Ok(rows)
}

/// Radii with the steps of water that falls to and fro; those of the published scheme.
const FALLS: [(Real, usize); 3] = [(CONJUGATE_RADIUS, 100_000), (3.1, 10_000), (3.6, 10_000)];
const PUBLISHED_FALLS: usize = 3000;

/// Jets that strike walls again and again, at three of the radii that are offered.
pub fn jets() -> Result<Vec<Measured>, String> {
    let mut rows = Vec::new();
    for (radius, steps) in FALLS {
        let found = experiments::reversed_fall(steps, Scheme::conjugate(radius)).map_err(said)?;
        rows.extend([
            Measured::new(format!("radius {radius}: steps done"), found.steps as Real),
            Measured::new(format!("radius {radius}: reversals of gravity"), found.reversals as Real),
            Measured::new(format!("radius {radius}: largest energy over that at the last reversal"), found.energy),
            Measured::new(format!("radius {radius}: largest rise of the energy between reversals"), found.rise),
            Measured::new(format!("radius {radius}: largest speed over that of a fall through the box"), found.speed),
        ]);
    }
    let published = experiments::reversed_fall(PUBLISHED_FALLS, Scheme::published()).map_err(said)?;
    rows.push(Measured::new("control: largest rise of the energy with the published scheme", published.rise));
    Ok(rows)
}
