//! Waves that a shaken tank makes, by linear theory.

use std::f64::consts::{PI, TAU};

use sazanami_numerics::Real;
use serde::Serialize;

use super::ShapeFacts;
use super::volumes::bed_top;
use crate::bed_shapes::factors_in_bed;
use crate::case::meaning::{BoundarySide, Case, FluidName, GrainPlacement, LiquidRegion};

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
    /// Largest speed of the water at its surface against the tank over that of the tank.
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
    let (amplitude, frequency) = super::limits::swing_of_water(case)?;
    let shaken = (0..2).filter(|&axis| amplitude[axis] != 0.0);
    let waves = shaken.filter_map(|axis| waves_along(case, axis, amplitude[axis].abs(), frequency));
    waves.max_by(|a, b| a.largest_elevation.total_cmp(&b.largest_elevation))
}

/// Waves along a direction with end walls, from 0, in which the tank is shaken by an amplitude \[m] at a frequency \[Hz].
fn waves_along(case: &Case, axis: usize, amplitude: Real, frequency: Real) -> Option<TankReport> {
    let modes = Modes::along(case, axis, frequency)?;
    let omega = TAU * frequency;
    let k = wavenumber(omega, case.gravity.length(), modes.depth);
    let places = (0..=200).map(|n| 0.5 * modes.length * Real::from(n) / 200.0);
    let elevation = |x: Real| amplitude * modes.elevation(x).abs();
    Some(TankReport {
        axis: axis + 1,
        frequency_hz: frequency,
        length_m: modes.length,
        depth_m: modes.depth,
        wavelength_m: TAU / k,
        amplification: 1.0 / (0.5 * k * modes.length).cos().abs(),
        speed_ratio: places.clone().map(|x| modes.at_surface(x).abs()).fold(0.0, Real::max),
        end_elevation: elevation(0.5 * modes.length),
        largest_elevation: places.map(elevation).fold(0.0, Real::max),
        tank_speed: amplitude * omega,
        stokes_layer_m: (2.0 * case.fluid.liquid.viscosity / case.fluid.liquid.density / omega).sqrt(),
    })
}

/// Modes of a tank by which the water is described: their parts fall with `1/n^2` at the surface and exponentially on the
/// floor.
const MODES: u32 = 400;

/// Water in a tank that is shaken along a direction: potential flow of small waves in the tank's modes `sin(k_n x)`,
/// `k_n = (2n - 1) pi/L` (Faltinsen 1978), whatever the depth over the wavelength.
pub(super) struct Modes {
    /// Depth of the water \[m].
    depth: Real,
    /// Length of the tank \[m].
    length: Real,
    /// Square of the frequency over gravity \[1/m].
    deep: Real,
}

impl Modes {
    /// Of a direction, from 0, with end walls, at a frequency \[Hz]; `None` without water, or without gravity, in which no waves run.
    pub(super) fn along(case: &Case, axis: usize, frequency: Real) -> Option<Self> {
        let gravity = case.gravity.length();
        if gravity == 0.0 || !case.boundary[axis].iter().all(BoundarySide::is_wall) {
            return None;
        }
        let deep = (TAU * frequency).powi(2) / gravity;
        depth(case).map(|depth| Self { depth, length: case.domain.extent()[axis], deep })
    }

    /// Sum over modes of `of(k_n, a_n w^2/(w_n^2 - w^2))`, where `a_n` is the coefficient of `x`.
    fn sum(&self, of: impl Fn(Real, Real) -> Real) -> Real {
        let mode = |n: u32| {
            let k = Real::from(2 * n - 1) * PI / self.length;
            let sign = if n % 2 == 1 { 4.0 } else { -4.0 };
            of(k, sign / (self.length * k * k) * self.deep / (k * (k * self.depth).tanh() - self.deep))
        };
        (1..=MODES).map(mode).sum()
    }

    /// Speed over the floor against that of the tank, over the tank's, at a distance from the middle \[m].
    pub(super) fn at_floor(&self, x: Real) -> Real {
        self.sum(|k, part| part * k * (k * x).cos() / (k * self.depth).cosh())
    }

    /// The same at the surface.
    fn at_surface(&self, x: Real) -> Real {
        self.sum(|k, part| part * k * (k * x).cos())
    }

    /// Elevation over the depth and the amplitude of the tank, at a distance from the middle [1/m].
    fn elevation(&self, x: Real) -> Real {
        (x + self.sum(|k, part| part * (k * x).sin())) * self.deep / self.depth
    }
}

/// Depth of the water above the bed, or above the floor \[m].
fn depth(case: &Case) -> Option<Real> {
    let liquids = case.liquids.iter().filter(|liquid| liquid.fluid == FluidName::Liquid);
    let level = liquids.filter_map(LiquidRegion::top).filter(|top| top.is_finite()).reduce(Real::max)?;
    let depth = level - case.domain.lower.z - bed(case);
    (depth > 0.0).then_some(depth)
}

/// Height of the bed above the floor: its level, or about that of its grains, which are counted in its file where that is there \[m].
fn bed(case: &Case) -> Real {
    let levels = case.grains.iter().filter_map(|population| match &population.placement {
        GrainPlacement::Packed(how) => how.level,
        _ => None,
    });
    levels.reduce(Real::max).unwrap_or_else(|| {
        let facts = |n: usize| {
            let cubes =
                factors_in_bed(case, n).map(|factors| factors.iter().map(|factor| factor.powi(3)).sum::<Real>());
            let bed_volume = cubes.zip(case.grains[n].shape.volume()).map(|(cubes, volume)| cubes * volume);
            ShapeFacts { bed_volume, ..ShapeFacts::default() }
        };
        let shapes: Vec<ShapeFacts> = (0..case.grains.len()).map(facts).collect();
        bed_top(case, &shapes) - case.domain.lower.z
    })
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

    #[test]
    fn modes_are_those_of_long_waves_in_shallow_water_and_decay_towards_the_floor_of_deep_water() {
        let length = 0.12;
        let modes = |depth: Real, kl: Real| Modes { depth, length, deep: kl / length * (kl / length * depth).tanh() };
        // Long waves: 1 - cos(k x)/cos(k L/2), and an elevation of k sin(k x)/cos(k L/2) over depth and amplitude.
        let (kl, x): (Real, Real) = (4.4, 0.03);
        let shallow = modes(1e-4, kl);
        let long = 1.0 - (kl * 0.25).cos() / (0.5 * kl).cos();
        for speed in [shallow.at_floor(x), shallow.at_surface(x)] {
            assert!((speed + long).abs() < 1e-3 * long.abs(), "{speed} {long}");
        }
        let elevation = kl / length * (kl * 0.25).sin() / (0.5 * kl).cos();
        assert!((shallow.elevation(x) / elevation - 1.0).abs() < 1e-3, "{} {elevation}", shallow.elevation(x));
        // Near resonance the first mode alone is left, which has 1/cosh(k h) of its speed on the floor.
        for depth in [0.01, 0.03, 0.1] {
            let near = modes(depth, PI * 1.0001);
            let decay = near.at_floor(x) / near.at_surface(x);
            assert!((decay * (PI * depth / length).cosh() - 1.0).abs() < 1e-3, "{depth} {decay}");
        }
        // Continuity: what flows through a section raises the water beyond it. h U/w d(elevation)/dt = - d(depth mean)/dx.
        let deep = modes(0.05, kl);
        let mean = |x: Real| deep.sum(|k, part| part * k * (k * x).cos() * (k * deep.depth).tanh() / (k * deep.depth));
        let slope = (mean(x + 1e-5) - mean(x - 1e-5)) / 2e-5;
        assert!((deep.elevation(x) / -slope - 1.0).abs() < 1e-3, "{} {slope}", deep.elevation(x));
    }
}
