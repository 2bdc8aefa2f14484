//! Water alone.

use crate::measured::Measured;
use crate::particles as experiments;
use sazanami_mps::scheme::CONJUGATE_RADIUS;
use sazanami_numerics::Real;

use super::said;

/// Radii with the steps of water that falls to and fro; those of the published scheme.
const FALLS: [(Real, usize); 3] = [(CONJUGATE_RADIUS, 100_000), (3.1, 10_000), (3.6, 10_000)];
const PUBLISHED_FALLS: usize = 3000;

/// Jets that strike walls again and again, at three of the radii that are offered.
pub fn jets() -> Result<Vec<Measured>, String> {
    let mut rows = Vec::new();
    for (radius, steps) in FALLS {
        let found = experiments::reversed_fall(steps, &[format!("particles.radius={radius}")]).map_err(said)?;
        rows.extend([
            Measured::new(format!("radius {radius}: steps done"), found.steps as Real),
            Measured::new(format!("radius {radius}: reversals of gravity"), found.reversals as Real),
            Measured::new(format!("radius {radius}: largest energy over that at the last reversal"), found.energy),
            Measured::new(format!("radius {radius}: largest rise of the energy between reversals"), found.rise),
            Measured::new(format!("radius {radius}: largest speed over that of a fall through the box"), found.speed),
        ]);
    }
    let published = experiments::reversed_fall(PUBLISHED_FALLS, &["preset=paper_literal".to_owned()]).map_err(said)?;
    rows.push(Measured::new("control: largest rise of the energy with the published scheme", published.rise));
    Ok(rows)
}
