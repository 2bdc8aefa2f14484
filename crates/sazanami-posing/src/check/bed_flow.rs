//! The flow over the bed of a tank that swings, by linear theory, and the ripples that published formulas give for it.

use std::f64::consts::TAU;

use sazanami_numerics::Real;
use sazanami_observe::ripples::BedFormSettings;
use sazanami_observe::ripples::predictors::{LEAST_MOBILITY, mobility, predicted};
use serde::Serialize;

use super::limits::swing_of_water;
use super::waves::Modes;
use crate::case::meaning::{BoundarySide, Case};

/// Places along half of a tank at which the flow is looked at.
const PLACES: u32 = 200;

/// Flow over a bed and what it does to the grains.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct BedReport {
    /// Diameter of the grains of the bed \[m].
    pub grain_size_m: Real,
    /// Largest speed of the water over the bed [m/s].
    pub orbital_speed: Real,
    /// Half of the way of the water there \[m].
    pub orbital_amplitude_m: Real,
    /// Mobility number there, `U^2/((s - 1) g d)`.
    pub mobility: Real,
    /// Mobility number from which on ripples are looked for.
    pub least_mobility: Real,
    /// Parts of x1 where it is reached \[m].
    pub mobile_m: Vec<[Real; 2]>,
    /// Ripples by published formulas for the largest speed.
    pub predicted: Vec<PredictedReport>,
}

/// Ripples by a published formula.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct PredictedReport {
    /// Authors and year.
    pub source: &'static str,
    /// Distance between crests \[m].
    pub wavelength_m: Real,
    /// Height \[m], where the formula has one.
    pub height_m: Option<Real>,
}

impl BedReport {
    /// Settings that tell mound and ripples of this bed apart.
    pub fn forms(&self) -> BedFormSettings {
        BedFormSettings::under(self.grain_size_m, self.orbital_amplitude_m, self.mobile_m.clone())
    }
}

/// The flow over the bed of a tank that swings along x1: between end walls that of small waves of any length, in a periodic tank water
/// that stays behind, or water that a force drives to and fro. `None` without grains, without water or without such a motion.
pub fn bed_flow(case: &Case) -> Option<BedReport> {
    let (amplitude, frequency) = swing_of_water(case)?;
    let amplitude = amplitude.x.abs();
    let population = case.grains.first().filter(|_| case.has_liquid())?;
    let observed = case.ripples.as_ref().map(|ripples| ripples.grain_size);
    let grain_size = observed.or(Some(population.shape.size()? * population.sizes().mean()))?;
    let specific = case.material(&population.material)?.density / case.fluid.liquid.density;
    let submerged = (specific - 1.0) * case.gravity.length();
    if amplitude == 0.0 || submerged <= 0.0 || grain_size <= 0.0 {
        return None;
    }
    let tank_speed = amplitude * TAU * frequency;
    let [lower, upper] = [case.domain.lower.x, case.domain.upper.x];
    let ratio: Box<dyn Fn(Real) -> Real> = if case.boundary[0].contains(&BoundarySide::Periodic) {
        Box::new(|_| 1.0)
    } else {
        let modes = Modes::along(case, 0, frequency)?;
        Box::new(move |place: Real| modes.at_floor(0.5 * (upper - lower) * place).abs())
    };
    let places: Vec<Real> = (0..=2 * PLACES).map(|n| Real::from(n) / Real::from(PLACES) - 1.0).collect();
    let largest = places.iter().map(|&place| ratio(place)).fold(0.0, Real::max);
    let moves = |place: Real| mobility(ratio(place) * tank_speed, submerged, grain_size) >= LEAST_MOBILITY;
    let x = |place: Real| 0.5 * (lower + upper) + 0.5 * (upper - lower) * place;
    let number = mobility(largest * tank_speed, submerged, grain_size);
    let report = |one: sazanami_observe::ripples::predictors::Predicted| PredictedReport {
        source: one.source,
        wavelength_m: one.wavelength,
        height_m: one.height,
    };
    Some(BedReport {
        grain_size_m: grain_size,
        orbital_speed: largest * tank_speed,
        orbital_amplitude_m: largest * amplitude,
        mobility: number,
        least_mobility: LEAST_MOBILITY,
        mobile_m: places
            .chunk_by(|a, b| moves(*a) == moves(*b))
            .filter(|part| moves(part[0]))
            .map(|part| [x(part[0]), x(part[part.len() - 1])])
            .collect(),
        predicted: predicted(largest * amplitude, number, grain_size).into_iter().map(report).collect(),
    })
}
