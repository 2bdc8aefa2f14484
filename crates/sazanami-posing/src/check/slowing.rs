//! How liquids slow down that fall on a bed.

use std::f64::consts::PI;

use sazanami_numerics::{Real, Vector};

use super::volumes::volume_within;
use crate::case::meaning::{Case, Placement};

/// A liquid that falls on a bed. Up to the impact the largest speed is 1.7 times its own `U`, that of the gas round it. A time `t` after it, that
/// of jets and spray, it is about `k U (U t/D)^(-1/2)` for a diameter `D`, 3 U at most, with `k = 1.3 (D/14 dx)^(1/2) (Re/12500)^(1/5)`, from 1 to 4:
/// the finer the cells and the larger the Reynolds number `U D/nu`, the faster the spray. Fitted to the steps of ten runs of the paper's drops at
/// 2.25 to 9 m/s with 14 and 29 cells to the diameter. In the end it is that of what falls through the box.
#[derive(Clone, Copy, Debug)]
pub(super) struct Slowing {
    /// Time in which the liquid moves by its diameter, that of a sphere of its volume \[s].
    passing: Real,
    /// The factor `k`.
    spray: Real,
    /// Time to the impact, with that in which a long liquid arrives \[s].
    pub before: Real,
    /// Speed of what falls through the box over that of the liquid.
    least: Real,
}

impl Slowing {
    /// That of the liquid number `n`, if it falls on grains of the case with a given `speed` [m/s].
    pub fn of(case: &Case, n: usize, speed: Vector) -> Option<Self> {
        let (liquid, speed) = (&case.liquids[n], speed.length());
        let falls = liquid.velocity.z < 0.0 && liquid.velocity.z.abs() >= liquid.velocity.abs().max_element();
        if !falls || case.grains.is_empty() || case.periodic()[2] {
            return None;
        }
        let diameter = (6.0 / PI * volume_within(case, liquid)?).cbrt();
        let [low, high] = liquid.region.heights();
        let gap = match liquid.placement {
            Placement::Absolute(position) => position.z + low - case.domain.lower.z,
            Placement::AboveBed { height, to_bottom: true, .. } => height,
            Placement::AboveBed { height, to_bottom: false, .. } => height + low,
        };
        let fluid = &case.fluid.liquid;
        let fall = (2.0 * case.resting_gravity().length() * case.domain.extent().z).sqrt();
        let before = (gap + high - low - diameter).max(0.0) / speed;
        (diameter > 0.0 && before.is_finite()).then(|| Self {
            passing: diameter / speed,
            spray: 1.3
                * (diameter / (14.0 * case.domain.spacing().max_element())).sqrt()
                * (speed * diameter * fluid.density / (12_500.0 * fluid.viscosity)).powf(0.2),
            before,
            least: (fall / speed).min(1.0),
        })
    }

    /// Largest speed at a `time` \[s] over that of the liquid.
    pub fn at(self, time: Real) -> Real {
        let after = (time - self.before) / self.passing;
        if after < 0.0 { 1.7 } else { (self.spray.clamp(1.0, 4.0) / after.sqrt()).clamp(self.least, 3.0) }
    }
}
