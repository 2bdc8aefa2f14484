//! How soft springs, and how heavy fine grains, may be while a bed is packed.

use sazanami_numerics::Real;

use super::settings::{ALIKE, PackingSettings};
use crate::body::Body;
use crate::contact::laws::Interactions;
use crate::grain::GrainRecord;

/// Largest overlap of an impact over a contact sphere's radius.
const IMPACT: Real = 0.15;
/// The same of a contact under the weight of the bed; twice as much among unlike sizes.
const RESTING: Real = 0.05;
/// The same of the finest grains under the weight of a coarse one that lies on three. On one alone, as while it finds its place, it
/// is three times as much, 1.2 radii: from two on the fine grain is within the coarse one.
const CRUSHED: Real = 0.4;
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
    /// Stiffness that the weight of the bed needs under the gravity of the fall, or as it sinks [N/m].
    by_weight: Real,
    /// Largest bounding radius \[m].
    reach: Real,
    /// Whether sizes are too far apart for a lattice.
    pub(super) unlike: bool,
    /// Mass of a grain of mean size, up to which finer ones are made heavier \[kg].
    mean_mass: Real,
    /// Least mass \[kg].
    lightest: Real,
    /// Stiffness with which the heaviest grain, on three of the smallest contact spheres, presses them by two fifths of
    /// their radius [N/m].
    by_crushing: Real,
}

impl Softness {
    /// For grains of these kinds.
    #[must_use]
    pub fn of(settings: &PackingSettings, kinds: &[Kind]) -> Self {
        let size = settings.upper - settings.lower;
        let sum = |of: &dyn Fn(&Kind) -> Real| kinds.iter().map(|kind| kind.count * of(kind)).sum::<Real>();
        let most = |of: &dyn Fn(&Kind) -> Real| kinds.iter().map(of).fold(0.0, Real::max);
        let least = kinds.iter().map(|kind| kind.reach).fold(Real::INFINITY, Real::min);
        let unlike = most(&|kind| kind.reach) > ALIKE * least;
        // Unlike grains sink under their own weight, and are stiffened slowly.
        let (factor, overlap) = if unlike { (1.0, 2.0 * RESTING) } else { (settings.fall_factor, RESTING) };
        let pressure = sum(&|kind| kind.mass) * factor * settings.gravity / (size.x * size.y);
        let finest = kinds.iter().map(|kind| kind.sphere).fold(Real::INFINITY, Real::min);
        let lightest = kinds.iter().map(|kind| kind.mass).fold(Real::INFINITY, Real::min);
        let heaviest = most(&|kind| kind.mass);
        let count = sum(&|_| 1.0);
        Self {
            // The deepest overlap of a free impact of equal grains is v sqrt(m/(2 K)), at a wall v sqrt(m/K).
            by_impact: most(&|kind| kind.mass / (IMPACT * kind.sphere).powi(2)),
            by_weight: most(&|kind| 4.0 * kind.reach * kind.reach * pressure / (overlap * kind.sphere)),
            reach: most(&|kind| kind.reach),
            unlike,
            mean_mass: (sum(&|kind| kind.mass.cbrt()) / count).powi(3),
            lightest,
            by_crushing: heaviest * settings.gravity / (3.0 * CRUSHED * finest),
        }
    }

    /// For the grains of these records.
    pub(super) fn of_records(settings: &PackingSettings, bodies: &[Body], records: &[GrainRecord]) -> Self {
        let kind = |record: &GrainRecord| Kind::of(&bodies[record.shape as usize], record.scale, record.mass, 1.0);
        Self::of(settings, &records.iter().map(kind).collect::<Vec<_>>())
    }

    /// Stiffness over that of `own` springs where grains move at `speed` [m/s] at most.
    #[must_use]
    pub fn scale(&self, own: &Interactions, speed: Real) -> Real {
        let needed = self.by_weight.max(self.by_impact * speed * speed);
        (needed / own.least_stiffness()).clamp(SOFTEST, 1.0)
    }

    /// Least stiffness of springs on which grains of these unlike sizes can lie: softer ones let a coarse grain press a fine one flat
    /// [N/m]; 0 for like sizes.
    #[must_use]
    pub fn least(&self) -> Real {
        if self.unlike { self.by_crushing } else { 0.0 }
    }

    /// Room that grains of unlike sizes have beyond the walls \[m].
    pub(super) fn room(&self) -> Real {
        if self.unlike { self.reach } else { 0.0 }
    }

    /// Whether sizes are too far apart for a lattice.
    #[must_use]
    pub fn is_of_unlike(&self) -> bool {
        self.unlike
    }

    /// Mass of the lightest grains while the bed is packed \[kg]; 0 where they keep their own.
    #[must_use]
    pub fn least_mass(&self) -> Real {
        if self.unlike { self.mean_mass } else { 0.0 }
    }

    /// Halvings of the least mass until all grains have their own.
    #[must_use]
    pub fn halvings(&self) -> Real {
        (self.least_mass() / self.lightest).max(1.0).log2().ceil()
    }

    /// Length of the longest sub-step of the lightest grains over that with their own springs and mass, at `speed` [m/s].
    #[must_use]
    pub fn substep_factor(&self, own: &Interactions, speed: Real) -> Real {
        let scale = (ROUNDED * self.scale(own, speed)).min(1.0);
        ((self.least_mass() / self.lightest).max(1.0) / scale).sqrt()
    }
}
