//! Waves.

use crate::particles::{self as experiments, WaveTank};
use sazanami_mps::scheme::Scheme;
use sazanami_numerics::Real;

use super::said;
use crate::measured::Measured;

/// Length, depth \[m], layers, mode.
pub(super) type Wave = (Real, Real, usize, usize);

/// Period and viscosity of any wave; the period over theory once more.
pub(super) fn over_theory(
    name: &str,
    (length, depth, layers, mode): Wave,
    scheme: Scheme,
) -> Result<(Vec<Measured>, Real), String> {
    let tank = WaveTank { length, depth, layers, scheme };
    let wave = experiments::standing_wave(tank, mode, 0.02).map_err(said)?;
    let rows = vec![
        Measured::new(format!("{name}: period over theory"), wave.period),
        Measured::new(format!("{name}: numerical viscosity"), wave.viscosity),
    ];
    Ok((rows, wave.period))
}

/// Name of a wave.
pub(super) fn called((length, depth, layers, mode): Wave) -> String {
    format!("L {length} m, h {depth} m, mode {mode}, h/l0 {layers}")
}

/// Judged quantities of a drop that stretches, for each scheme.
pub(super) fn drops(schemes: &[Scheme]) -> Result<Vec<Measured>, String> {
    let mut rows = Vec::new();
    for &scheme in schemes {
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
