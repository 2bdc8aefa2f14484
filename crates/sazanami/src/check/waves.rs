//! Waves that a shaken tank makes, by linear theory.

use std::f64::consts::TAU;

use sazanami_numerics::Real;
use serde::Serialize;

use crate::case::meaning::{BoundarySide, Case, FluidName, GrainPlacement, LiquidRegion, Placement};

/// Waves in a tank that is shaken along x1 or x2, by linear theory: from the bed or the floor up, without friction.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct TankReport {
    /// Direction, from 1.
    pub axis: usize,
    /// Frequency of the motion, or of its strongest harmonic \[Hz].
    pub frequency_hz: Real,
    /// Length of the tank \[m].
    pub length_m: Real,
    /// Depth of the water above the bed \[m].
    pub depth_m: Real,
    /// Wavelength at the frequency of the motion \[m].
    pub wavelength_m: Real,
    /// `1/cos(k L/2)`, without its sign: large near resonance.
    pub amplification: Real,
    /// Largest speed of the water against the tank over that of the tank.
    pub speed_ratio: Real,
    /// Elevation at the end walls over the depth.
    pub end_elevation: Real,
    /// Largest elevation over the depth.
    pub largest_elevation: Real,
    /// Largest speed of the tank [m/s].
    pub tank_speed: Real,
    /// Thickness of the oscillating boundary layer \[m].
    pub stokes_layer_m: Real,
}

/// Waves of a tank that is shaken at its strongest harmonic, along the horizontal direction with end walls in which
/// they are highest.
pub(crate) fn tank(case: &Case) -> Option<TankReport> {
    let (amplitude, frequency) = super::limits::swing(case)?;
    let waves = (0..2).filter_map(|axis| waves_along(case, axis, amplitude[axis].abs(), frequency));
    waves.max_by(|a, b| a.largest_elevation.total_cmp(&b.largest_elevation))
}

/// Waves along a direction with end walls, from 0, in which the tank is shaken by an amplitude \[m] at a frequency \[Hz].
pub(super) fn waves_along(case: &Case, axis: usize, amplitude: Real, frequency: Real) -> Option<TankReport> {
    let closed = amplitude != 0.0 && case.boundary[axis].iter().all(is_wall);
    depth(case).filter(|_| closed).map(|depth| waves(case, axis, amplitude, frequency, depth))
}

/// Waves along a direction, from 0, in which the tank is shaken by an amplitude \[m] at a frequency \[Hz].
fn waves(case: &Case, axis: usize, amplitude: Real, frequency: Real, depth: Real) -> TankReport {
    let omega = TAU * frequency;
    let length_m = case.domain.extent()[axis];
    let k = wavenumber(omega, case.gravity.length(), depth);
    let half = 0.5 * k * length_m;
    let amplification = 1.0 / half.cos().abs();
    // The speed relative to the tank is 1 - cos(k x)/cos(k L/2) of the tank's, the elevation h A k sin(k x)/cos(k L/2).
    let places = (0..=200).map(|n| half * Real::from(n) / 200.0);
    let speed_ratio = places.clone().map(|place| (1.0 - place.cos() / half.cos()).abs()).fold(0.0, Real::max);
    let elevation = amplitude * k * amplification;
    TankReport {
        axis: axis + 1,
        frequency_hz: frequency,
        length_m,
        depth_m: depth,
        wavelength_m: TAU / k,
        amplification,
        speed_ratio,
        end_elevation: elevation * half.sin().abs(),
        largest_elevation: elevation * places.map(|place| place.sin().abs()).fold(0.0, Real::max),
        tank_speed: amplitude * omega,
        stokes_layer_m: (2.0 * case.fluid.liquid.viscosity / case.fluid.liquid.density / omega).sqrt(),
    }
}

/// Depth of the water above a bed that is levelled, or above the floor \[m].
fn depth(case: &Case) -> Option<Real> {
    let top = |liquid: &LiquidRegion| match liquid.placement {
        Placement::Absolute(position) => Some(position.z + liquid.region.heights()[1]),
        Placement::AboveBed { .. } => None,
    };
    let liquids = case.liquids.iter().filter(|liquid| liquid.fluid == FluidName::Liquid);
    let level = liquids.filter_map(top).filter(|top| top.is_finite()).reduce(Real::max)?;
    let bed = case.grains.iter().filter_map(|population| match &population.placement {
        GrainPlacement::Packed(how) => how.level,
        _ => None,
    });
    let depth = level - case.domain.lower.z - bed.fold(0.0, Real::max);
    (depth > 0.0).then_some(depth)
}

/// Solution of `omega^2 = g k tanh(k h)` by Newton's method.
fn wavenumber(omega: Real, gravity: Real, depth: Real) -> Real {
    let deep = omega * omega / gravity;
    let mut k = deep.max(omega / (gravity * depth).sqrt());
    for _ in 0..50 {
        let (tanh, slope) = ((k * depth).tanh(), depth / (k * depth).cosh().powi(2));
        let change = (k * tanh - deep) / (tanh + k * slope);
        k -= change;
        if change.abs() < 1e-14 * k {
            break;
        }
    }
    k
}

pub(super) fn is_wall(side: &BoundarySide) -> bool {
    matches!(side, BoundarySide::NoSlip | BoundarySide::Slip)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn long_and_short_waves() {
        // 10 mm of water at 2 Hz: k = 41.2 1/m.
        assert!((wavenumber(2.0 * TAU, 9.81, 0.01) - 41.2).abs() < 0.1);
        let deep = wavenumber(20.0, 9.81, 10.0);
        assert!((deep - 400.0 / 9.81).abs() < 1e-9);
    }
}
