//! What the published MPS-HS-HL-ECS-GC-DS, which the literal preset runs, gives beside the references of the default.

use sazanami_mps::scheme::Scheme;
use sazanami_mps::stability::COURANT;

use super::said;
use super::waves::over_theory;
use crate::measured::Measured;
use crate::particles::{self as experiments, RestSetup};

/// A wave, a drop that stretches, vortices, water at rest and a falling block.
pub fn published() -> Result<Vec<Measured>, String> {
    let scheme = Scheme::published();
    let (mut rows, _) = over_theory("wave, h/l0 10", (0.1, 0.05, 10, 1), scheme)?;
    let drop = experiments::stretching_drop(16, 1.0, scheme).map_err(said)?;
    rows.extend([
        Measured::new("drop: kinetic energy over that at the start", drop.energy),
        Measured::new("drop: work of the stabilisation over the kinetic energy", drop.stabilisation),
        Measured::new("drop: rms error of the velocity", drop.velocity),
        Measured::new("drop: pressure in the middle over exact", drop.pressure),
    ]);
    let mut row = |name: &str, value| rows.push(Measured::new(name, value));
    let vortices = experiments::taylor_green(50, COURANT, scheme).map_err(said)?;
    row("vortices: rate of decay of the largest speed over exact", vortices.decay);
    row("vortices: rms error of the velocity", vortices.velocity);
    for (name, tilt, jitter) in [("disordered", 0.0, 0.1), ("tilted", 0.16, 0.0)] {
        let still = RestSetup { spacing: 1e-3, tilt, jitter, seconds: 3.0, scheme };
        let found = experiments::rest(&still).map_err(said)?;
        row(&format!("still, {name}: largest speed, of sqrt(g H)"), found.speed);
        row(&format!("still, {name}: largest error of p at the end, of rho g H"), found.pressure_at_end);
    }
    let falling = experiments::falling_block(scheme, 0.1, &[5e-4, 0.02]).map_err(said)?;
    row("falling block, disordered: rms |a - g|/g in the first step", falling[0]);
    row("falling block, disordered: rms |a - g|/g after 20 ms", falling[1]);
    Ok(rows)
}
