//! Waves.

use std::f64::consts::PI;

use crate::particles::{self as experiments, Shaking, Sloshing, WaveTank};
use sazanami_mps::scheme::{CONJUGATE_RADIUS, Scheme};
use sazanami_numerics::Real;

use super::said;
use crate::measured::Measured;

/// Length, depth \[m], layers, mode.
pub(super) type Wave = (Real, Real, usize, usize);

/// Periods over linear theory and numerical viscosities of free waves.
pub fn standing_wave() -> Result<Vec<Measured>, String> {
    let mut rows = periods(&[(0.1, 0.05, 5, 1), (0.1, 0.05, 10, 1), (0.15, 0.01, 5, 1)])?;
    let mut found = Vec::new();
    for radius in RADII {
        let (measured, period) = wave(Scheme { radius, ..Scheme::default() })?;
        rows.extend(measured);
        found.push(period);
    }
    let [low, high] = [found.iter().copied().fold(Real::MAX, Real::min), found.iter().copied().fold(0.0, Real::max)];
    rows.push(Measured::new("h/l0 10: periods of the three radii over theory, largest less smallest", high - low));
    Ok(rows)
}

/// Period and viscosity of a wave in ten layers; the period over theory once more.
fn wave(scheme: Scheme) -> Result<(Vec<Measured>, Real), String> {
    over_theory(&format!("h/l0 10, radius {}", scheme.radius), (0.1, 0.05, 10, 1), scheme)
}

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

/// A drop that stretches.
pub fn stretching_drop() -> Result<Vec<Measured>, String> {
    drops(&RADII.map(|radius| Scheme { radius, ..Scheme::default() }))
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

/// Radii of influence of the tests, in spacings.
const RADII: [Real; 3] = [2.1, 2.6, 3.1];

/// V4, shallow water in ten layers.
pub fn standing_wave_shallow() -> Result<Vec<Measured>, String> {
    periods(&[(0.15, 0.01, 10, 2)])
}

fn periods(waves: &[Wave]) -> Result<Vec<Measured>, String> {
    let scheme = Scheme::default();
    let mut rows = Vec::new();
    for &wave in waves {
        let (length, depth, layers, mode) = wave;
        let tank = WaveTank { length, depth, layers, scheme };
        let found = experiments::standing_wave(tank, mode, 0.02).map_err(said)?;
        let name = called(wave);
        let (period, exact) = (format!("{name}: period"), 2.0 * PI / tank.frequency(mode));
        rows.push(Measured::new(period, found.period * exact));
        rows.push(Measured::new(format!("{name}: numerical viscosity"), found.viscosity));
        if layers == 10 && mode == 1 {
            let k = PI / length;
            let shallow = exact / (2.0 * PI / (k * (9.81 * depth).sqrt())) * found.period;
            rows.push(Measured::new(format!("control, {name}: period over that of long waves"), shallow));
        }
    }
    Ok(rows)
}

/// V5, away from resonance: with the enhanced scheme, and with the conjugate one in twice the layers.
pub fn sloshing() -> Result<Vec<Measured>, String> {
    let tank = WaveTank { length: 0.3, depth: 0.05, layers: 10, scheme: Scheme::default() };
    let part = 0.7;
    let rate = part * tank.frequency(1);
    let shaking = Shaking { amplitude: 6e-3, rate, ramp: 4.0 * PI / rate };
    let found = experiments::sloshing(tank, shaking, 5.0).map_err(said)?;
    // Steady waves answer as 1/(w1^2 - w^2): an error of the first frequency counts several times.
    let period = experiments::standing_wave(tank, 1, 0.02).map_err(said)?.period;
    let answer = (1.0 - part * part) / (period.powi(2).recip() - part * part);
    let nearer = WaveTank { scheme: Scheme { radius: 2.6, ..tank.scheme }, ..tank };
    let other = experiments::sloshing(nearer, shaking, 5.0).map_err(said)?;
    let mut rows = vec![
        Measured::new("period of a standing wave in this tank over that of linear theory", period),
        Measured::new("rms of the centre of mass that follows from this period", answer),
        Measured::new("radius of influence 2.6: rms of the centre of mass", other.amplitude),
        Measured::new("radius of influence 2.6: rms error of the centre of mass", other.history),
    ];
    rows.extend(driven("", &found));
    let conjugate = WaveTank { layers: 20, scheme: Scheme::conjugate(CONJUGATE_RADIUS), ..tank };
    let found = experiments::sloshing(conjugate, shaking, 5.0).map_err(said)?;
    rows.extend(driven("conjugate, 20 layers: ", &found));
    Ok(rows)
}

/// Judged quantities of driven waves.
fn driven(name: &str, found: &Sloshing) -> [Measured; 5] {
    [
        ("", "largest wave at a wall, of spacings", found.height),
        ("", "rms of the centre of mass over that of linear theory", found.amplitude),
        ("", "rms error of the centre of mass over five periods", found.history),
        ("", "rms error of the velocity in ten columns", found.velocity),
        ("control: ", "rms error beside theory for 0.8 of the depth", found.shallower),
    ]
    .map(|(kind, what, value)| Measured::new(format!("{kind}{name}{what}"), value))
}

/// V5, lengths around the resonance at 2 Hz and 10 mm.
pub fn sloshing_resonance() -> Result<Vec<Measured>, String> {
    let rate = 4.0 * PI;
    let shaking = Shaking { amplitude: 1e-4, rate, ramp: 0.5 };
    let (mut rows, mut largest) = (Vec::new(), (0.0, 0.0));
    for millimetres in [66, 70, 73, 76, 80, 84] {
        let length = 1e-3 * Real::from(millimetres);
        let tank = WaveTank { length, depth: 0.01, layers: 10, scheme: Scheme::default() };
        let found = experiments::sloshing(tank, shaking, 6.0).map_err(said)?;
        rows.push(Measured::new(format!("L {millimetres} mm: rms of the centre of mass"), found.centre));
        if found.centre > largest.1 {
            largest = (length, found.centre);
        }
    }
    rows.push(Measured::new("length of the strongest answer", largest.0));
    Ok(rows)
}
