//! How soft springs, and how heavy fine grains, may be while a bed is packed.

use sazanami_numerics::Real;

use super::settings::{ALIKE, PackingSettings};
use crate::body::Body;
use crate::contact::laws::Interactions;

/// Largest overlap of an impact over a contact sphere's radius.
const IMPACT: Real = 0.15;
/// The same of a contact under the weight of the bed.
const RESTING: Real = 0.05;
/// The same of impacts of grains that are made heavier.
const HEAVIER: Real = 0.4;
/// The same of the finest grains under the weight of a coarse one.
const CRUSHED: Real = 0.2;
/// Values that go by factors of two, over the least that is needed, in the mean.
const ROUNDED: Real = 1.5;
/// Softest springs over a case's own. Beds of softer ones are denser: 1,236 spheroids of `shell(75)` had, over four seeds, a
/// porosity of 0.4964 (deviation 0.0021) with their own springs, 0.4939 (0.0034) so, and 0.4920 (0.0008) with a thirtieth
/// and overlaps up to 0.4 in impacts.
const SOFTEST: Real = 0.1;

/// A kind of grains.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Kind {
    /// Mass \[kg].
    pub mass: Real,
    /// Bounding radius \[m].
    pub reach: Real,
    /// Radius of the smallest contact sphere \[m].
    pub sphere: Real,
    /// Number of such grains.
    pub count: Real,
}

impl Kind {
    /// Of grains of a body times `scale`, with their `mass` \[kg] and number.
    #[must_use]
    pub fn of(body: &Body, scale: Real, mass: Real, count: Real) -> Self {
        let sphere = body.radii.iter().copied().fold(Real::INFINITY, Real::min);
        Self { mass, reach: body.bounding_radius * scale, sphere: sphere * scale, count }
    }
}

/// What keeps overlaps small while grains of some kinds are packed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Softness {
    /// Stiffness that impacts need, over the square of the speed [N s^2/m^3].
    by_impact: Real,
    /// Stiffness that the weight of the bed needs under the gravity of the fall [N/m].
    by_weight: Real,
    /// Largest bounding radius \[m].
    reach: Real,
    /// Whether sizes are too far apart for a lattice.
    pub(super) unlike: bool,
    /// Up to this mass fine grains are made heavier: that of a grain of mean size \[kg].
    heaviest: Real,
    /// The lightest kind.
    lightest: Kind,
    /// Largest mass \[kg].
    most: Real,
    /// Radius of the smallest contact sphere \[m].
    finest: Real,
    /// Stiffness with which the weight of the heaviest grain, on three of the smallest contact spheres, presses them by a fifth of
    /// their radius [N/m].
    by_crushing: Real,
}

impl Softness {
    /// For grains of these kinds.
    #[must_use]
    pub fn of(settings: &PackingSettings, kinds: &[Kind]) -> Self {
        let size = settings.upper - settings.lower;
        let sum = |of: &dyn Fn(&Kind) -> Real| kinds.iter().map(|kind| kind.count * of(kind)).sum::<Real>();
        let pressure = sum(&|kind| kind.mass) * settings.fall_factor * settings.gravity / (size.x * size.y);
        let most = |of: &dyn Fn(&Kind) -> Real| kinds.iter().map(of).fold(0.0, Real::max);
        let least = kinds.iter().map(|kind| kind.reach).fold(Real::INFINITY, Real::min);
        let finest = kinds.iter().map(|kind| kind.sphere).fold(Real::INFINITY, Real::min);
        let none = Kind { mass: 0.0, reach: 0.0, sphere: 0.0, count: 0.0 };
        Self {
            // The deepest overlap of a free impact of equal grains is v sqrt(m/(2 K)), at a wall v sqrt(m/K).
            by_impact: most(&|kind| kind.mass / (IMPACT * kind.sphere).powi(2)),
            by_weight: most(&|kind| 4.0 * kind.reach * kind.reach * pressure / (RESTING * kind.sphere)),
            reach: most(&|kind| kind.reach),
            unlike: most(&|kind| kind.reach) > ALIKE * least,
            heaviest: (sum(&|kind| kind.mass.cbrt()) / sum(&|_| 1.0)).powi(3),
            finest,
            most: most(&|kind| kind.mass),
            by_crushing: most(&|kind| kind.mass) * settings.gravity / (3.0 * CRUSHED * finest),
            lightest: kinds.iter().copied().min_by(|a, b| a.mass.total_cmp(&b.mass)).unwrap_or(none),
        }
    }

    /// Stiffness over that of `own` springs where grains move at `speed` [m/s] at most.
    #[must_use]
    pub fn scale(&self, own: &Interactions, speed: Real) -> Real {
        let crushing = if self.unlike { self.by_crushing } else { 0.0 };
        let needed = self.by_weight.max(self.by_impact * speed * speed).max(crushing);
        (needed / self.least_of(own)).clamp(SOFTEST, 1.0)
    }

    /// Least stiffness of springs on which grains of these unlike sizes can lie: softer ones let a coarse grain press a fine one flat
    /// [N/m]; 0 for like sizes.
    #[must_use]
    pub fn least(&self) -> Real {
        if self.unlike { self.by_crushing } else { 0.0 }
    }

    /// Least stiffness of `own` springs between grains of these kinds [N/m].
    #[must_use]
    pub fn least_of(&self, own: &Interactions) -> Real {
        own.least_stiffness(self.reach)
    }

    /// Speed at which a grain that meets one of the smallest contact spheres presses it by two fifths of its radius, times
    /// the root of its mass, on springs of this stiffness [N/m] [m/s kg^(1/2)].
    pub(super) fn limit(&self, stiffness: Real) -> Real {
        HEAVIER * self.finest * stiffness.sqrt()
    }

    /// Speed that the heaviest grain may not exceed [m/s]; infinite among like sizes.
    #[must_use]
    pub fn slowest(&self, own: &Interactions) -> Real {
        let springs = (ROUNDED * self.scale(own, 0.0)).min(1.0) * self.least_of(own);
        if self.unlike { self.limit(springs) / self.most.sqrt() } else { Real::INFINITY }
    }

    /// Factor on the mass of grains of a kind with which they overlap by less than two fifths of their radius in impacts at
    /// `speed` [m/s] on springs of this stiffness [N/m]; 1 for all but the fine grains of unlike sizes.
    #[must_use]
    pub fn mass_factor(&self, kind: &Kind, stiffness: Real, speed: Real) -> Real {
        let bearable = stiffness * (HEAVIER * kind.sphere / speed).powi(2);
        if self.unlike { (self.heaviest.min(bearable) / kind.mass).max(1.0) } else { 1.0 }
    }

    /// Length of the longest sub-step of the lightest grains over that with their own springs and mass, at `speed` [m/s].
    #[must_use]
    pub fn substep_factor(&self, own: &Interactions, speed: Real) -> Real {
        let scale = (ROUNDED * self.scale(own, speed)).min(1.0);
        let springs = scale * self.least_of(own);
        let lightest = &self.lightest;
        (self.mass_factor(lightest, springs, ROUNDED * speed.max(super::SLOW)) / scale).sqrt()
    }
}
