//! Waves.

use std::f64::consts::PI;

use crate::particles::{self as experiments, Shaking, WaveTank};
use sazanami_mps::scheme::Scheme;
use sazanami_numerics::Real;

use super::{CONTROL, said};
use crate::measured::Measured;

const LINEAR: &str = "linear wave theory";

/// Length, depth [m], layers, mode, largest error of the period that is allowed at this resolution.
type Wave = (Real, Real, usize, usize, Option<Real>);

/// Standing waves.
pub fn standing_wave() -> Result<Vec<Measured>, String> {
    periods(&[(0.1, 0.05, 5, 1, None), (0.1, 0.05, 10, 1, Some(0.03)), (0.15, 0.01, 5, 1, None)])
}

/// V4, shallow water in ten layers.
pub fn standing_wave_shallow() -> Result<Vec<Measured>, String> {
    periods(&[(0.15, 0.01, 10, 2, Some(0.03))])
}

fn periods(waves: &[Wave]) -> Result<Vec<Measured>, String> {
    let scheme = Scheme::default();
    let mut rows = Vec::new();
    for &(length, depth, layers, mode, tolerance) in waves {
        let tank = WaveTank { length, depth, layers, scheme };
        let found = experiments::standing_wave(tank, mode, 0.02).map_err(said)?;
        let name = format!("L {length} m, h {depth} m, mode {mode}, h/l0 {layers}");
        let (period, exact) = (format!("{name}: period"), 2.0 * PI / tank.frequency(mode));
        rows.push(
            match tolerance {
                Some(tolerance) => Measured::near(period, "s", found.period * exact, exact, tolerance),
                None => Measured { reference: Some(exact), ..Measured::info(period, "s", found.period * exact) },
            }
            .from_source(LINEAR),
        );
        rows.push(Measured::info(format!("{name}: numerical viscosity"), "m^2/s", found.viscosity));
        if layers == 10 && mode == 1 {
            let k = PI / length;
            let shallow = exact / (2.0 * PI / (k * (9.81 * depth).sqrt())) * found.period;
            rows.push(
                Measured::within(format!("control, {name}: period over that of long waves"), "", shallow, 1.03, 2.0)
                    .from_source(CONTROL),
            );
        }
    }
    Ok(rows)
}

/// V5, away from resonance.
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
    Ok(vec![
        Measured::info("period of a standing wave in this tank over that of linear theory", "", period),
        Measured::info("rms of the centre of mass that follows from this period", "", answer),
        Measured::info("radius of influence 2.6: rms of the centre of mass", "", other.amplitude),
        Measured::info("radius of influence 2.6: rms error of the centre of mass", "", other.history),
        Measured::within("largest wave at a wall, of spacings", "", found.height, 2.0, Real::INFINITY)
            .from_source(LINEAR),
        Measured::near("rms of the centre of mass over that of linear theory", "", found.amplitude, 1.0, 0.05)
            .from_source(LINEAR),
        Measured::within("rms error of the centre of mass over five periods", "", found.history, 0.0, 0.05)
            .from_source(LINEAR),
        Measured::within("rms error of the velocity in ten columns", "", found.velocity, 0.0, 0.05).from_source(LINEAR),
        Measured::within(
            "control: rms error beside theory for 0.8 of the depth",
            "",
            found.shallower,
            0.05,
            Real::INFINITY,
        )
        .from_source(CONTROL),
    ])
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
        rows.push(Measured::info(format!("L {millimetres} mm: rms of the centre of mass"), "m", found.centre));
        if found.centre > largest.1 {
            largest = (length, found.centre);
        }
    }
    let row = Measured::within("length of the strongest answer", "m", largest.0, 0.073, 0.080);
    rows.push(Measured { reference: Some(0.0762), ..row }.from_source(LINEAR));
    Ok(rows)
}
