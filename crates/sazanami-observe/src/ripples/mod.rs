//! Sand ripples in a shaken tank: surfaces of bed and water, ripples and their growth, layer averages, gauges and
//! probes, and the comparison with profiles read from photographs (Tazaki, Harada, Ikari and Gotoh, overlapping
//! DEM-MPS of ripples in an oscillating tank).
//!
//! Positions and velocities are those in the frame of the tank: x1 along the shaking, x2 across, x3 up. What cannot
//! be measured is an [`Unmeasured`] that says why, never a number made up.

mod bed_forms;
mod bed_surface;
mod experiment;
mod growth;
mod layers;
mod phases;
pub mod predictors;
mod probes;
mod profile;
mod section_density;
mod smoothing;
mod trend;
mod water_surface;

pub use bed_forms::{BedFormSettings, BedForms, CrestedRipples, Mound, relief};
pub use bed_surface::bed_surface;
pub use experiment::{BedMatch, ProfileMatch, ShiftLimits, match_bed, match_profiles};
pub use growth::Growth;
pub use layers::{Layer, LayerGrains, LayerMeans, LayerReference, LayerWater, Layers, layer_means, submerged_weight};
pub use phases::{PhaseAverage, cycle_averages, phase_average};
pub use probes::{Interpolation, Near, SectionWindow, vectors_in_section};
pub use profile::SurfaceProfile;
pub use water_surface::{water_level_at, water_surface};

use sazanami_numerics::{Real, Vector};
use thiserror::Error;

/// A pair of sides of the tank.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Sides {
    /// Joined: what leaves on one side enters on the other.
    #[default]
    Periodic,
    /// Walls at both ends.
    Walls,
}

/// The inside of the tank.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TankInside {
    /// Places of the end walls on x1 \[m].
    pub x: [Real; 2],
    /// Places of the sides on x2 \[m].
    pub y: [Real; 2],
    /// Height of the floor \[m].
    pub floor: Real,
    /// Height of a lid that closes it \[m].
    pub lid: Option<Real>,
    /// Kind of the ends in x1.
    pub ends: Sides,
    /// Kind of the sides in x2.
    pub sides: Sides,
    /// Height after which a tank without floor and lid repeats \[m].
    pub repeats: Option<Real>,
}

impl TankInside {
    /// Length between the end walls \[m].
    #[must_use]
    pub fn length(&self) -> Real {
        self.x[1] - self.x[0]
    }

    /// Way between two places, the shorter one through sides that are joined \[m].
    #[must_use]
    pub fn way(&self, from: Vector, to: Vector) -> Vector {
        let shorter = |way: Real, kind: Sides, period: Real| match kind {
            Sides::Periodic => way - period * (way / period).round(),
            Sides::Walls => way,
        };
        let way = to - from;
        let [x, y] = [shorter(way.x, self.ends, self.length()), shorter(way.y, self.sides, self.width())];
        Vector::new(x, y, self.repeats.map_or(way.z, |height| shorter(way.z, Sides::Periodic, height)))
    }

    /// Width between the sides \[m].
    #[must_use]
    pub fn width(&self) -> Real {
        self.y[1] - self.y[0]
    }

    /// The part of x1 that is farther than `margin` \[m] from both end walls; all of a tank whose ends are joined.
    #[must_use]
    pub fn reach(&self, margin: Real) -> Reach {
        match self.ends {
            Sides::Periodic => Reach { range: self.x, ends: Sides::Periodic },
            Sides::Walls => Reach { range: [self.x[0] + margin, self.x[1] - margin], ends: Sides::Walls },
        }
    }
}

/// The part of x1 whose forms are looked at.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Reach {
    /// First and last place \[m].
    pub range: [Real; 2],
    /// Whether its ends are joined: then it is a period of the bed, which has neither slope nor bend, and goes on beyond them.
    pub ends: Sides,
}

/// Spherical grains at one instant, one entry each, in the order of their identifiers.
#[derive(Clone, Copy, Debug)]
pub struct GrainView<'a> {
    /// Centres \[m].
    pub position: &'a [Vector],
    /// Diameters \[m].
    pub diameter: &'a [Real],
    /// Number of grains and walls that each one touches.
    pub contacts: &'a [u32],
}

impl GrainView<'_> {
    /// Mean diameter \[m]; zero without grains.
    #[must_use]
    pub fn mean_diameter(&self) -> Real {
        self.diameter.iter().sum::<Real>() / self.diameter.len().max(1) as Real
    }
}

/// Particles of water at one instant, one entry each, in the order of their identifiers.
#[derive(Clone, Copy, Debug)]
pub struct WaterView<'a> {
    /// Centres \[m].
    pub position: &'a [Vector],
    /// Volume that a particle takes up together with the grains in it, `V0 / eps` [m^3].
    pub bulk_volume: &'a [Real],
    /// Whether a particle is isolated.
    pub splash: &'a [bool],
}

/// Why something was not measured.
#[derive(Clone, Copy, Debug, Error, PartialEq)]
pub enum Unmeasured {
    /// A profile does not reach far enough.
    #[error("the profile is {length} m long where at least {needed} m are needed")]
    TooShort {
        /// Length there is \[m].
        length: Real,
        /// Length needed \[m].
        needed: Real,
    },
    /// A profile has no height at some place.
    #[error("the profile has no height at x = {at} m")]
    Gap {
        /// The place \[m].
        at: Real,
    },
    /// No form of the bed is as high as its grains.
    #[error("the bed is level to {:.3} mm; a mound is at least {:.3} mm high", 1e3 * height, 1e3 * least)]
    Level {
        /// Highest less lowest place, ripples left out \[m].
        height: Real,
        /// Least height of a mound \[m].
        least: Real,
    },
    /// The flow moves no grains to form ripples.
    #[error("nowhere is the mobility number above the {least} from which on ripples form")]
    Immobile {
        /// That mobility number.
        least: Real,
    },
    /// No two crests as close as ripples can be.
    #[error(
        "{found} crests of at least {:.3} mm where the flow allows ripples, two no farther apart than ripples can be are needed \
         (one in a box that is periodic along x1 and no longer than that); all waves as short as ripples span {:.3} mm",
        1e3 * least, 1e3 * highest
    )]
    TooFewCrests {
        /// Number of crests.
        found: usize,
        /// Least height of a crest \[m].
        least: Real,
        /// Highest less lowest of the waves as short as ripples \[m].
        highest: Real,
    },
    /// Not enough values.
    #[error("{found} usable values where at least {needed} are needed")]
    TooFewValues {
        /// Number of values.
        found: usize,
        /// Number needed.
        needed: usize,
    },
    /// A series does not hold the cycles asked for.
    #[error("the series lasts {found} cycles where {needed} are needed")]
    TooFewCycles {
        /// Cycles there are.
        found: Real,
        /// Cycles needed.
        needed: usize,
    },
    /// A phase of the cycle was never observed.
    #[error("nothing was observed near phase {phase} of the cycle")]
    PhaseMissing {
        /// The phase, from 0 to 1.
        phase: Real,
    },
}

#[cfg(test)]
pub(crate) mod made_up {
    //! Beds and water made up for tests.

    use super::*;

    /// Columns of a bed or of water.
    pub struct Lattice {
        pub position: Vec<Vector>,
        pub diameter: Vec<Real>,
        pub contacts: Vec<u32>,
        pub volume: Vec<Real>,
        pub splash: Vec<bool>,
    }

    impl Lattice {
        /// Cubic lattice of the given spacing \[m] below `surface(x)` \[m], each point with `share` of its cell.
        pub fn below(tank: &TankInside, spacing: Real, share: Real, surface: impl Fn(Real) -> Real) -> Self {
            let count = |length: Real| (length / spacing).round() as usize;
            let diameter = spacing * (share * 6.0 / std::f64::consts::PI).cbrt();
            let mut position = Vec::new();
            for i in 0..count(tank.length()) {
                let x = tank.x[0] + (i as Real + 0.5) * spacing;
                for j in 0..count(tank.width()) {
                    let y = tank.y[0] + (j as Real + 0.5) * spacing;
                    let height = surface(x) - tank.floor;
                    position.extend(
                        (0..count(height)).map(|k| Vector::new(x, y, tank.floor + (k as Real + 0.5) * spacing)),
                    );
                }
            }
            let n = position.len();
            let volume = vec![spacing.powi(3); n];
            Self { position, diameter: vec![diameter; n], contacts: vec![6; n], volume, splash: vec![false; n] }
        }

        /// Adds a grain or particle like the others.
        pub fn add(&mut self, position: Vector, contacts: u32, splash: bool) {
            self.position.push(position);
            self.diameter.push(self.diameter[0]);
            self.volume.push(self.volume[0]);
            self.contacts.push(contacts);
            self.splash.push(splash);
        }

        pub fn grains(&self) -> GrainView<'_> {
            GrainView { position: &self.position, diameter: &self.diameter, contacts: &self.contacts }
        }

        pub fn water(&self) -> WaterView<'_> {
            WaterView { position: &self.position, bulk_volume: &self.volume, splash: &self.splash }
        }
    }

    /// A profile of 150 mm about the origin of x1.
    pub fn profile(height: impl Fn(Real) -> Real) -> SurfaceProfile {
        let x = |n: u32| -0.07475 + 0.5e-3 * f64::from(n);
        SurfaceProfile::complete(x(0), 0.5e-3, (0..300).map(|n| height(x(n))))
    }

    /// A tank of 60 x 8 mm about the origin of x1.
    pub fn tank(sides: Sides) -> TankInside {
        TankInside {
            x: [-0.03, 0.03],
            y: [0.0, 0.008],
            floor: 0.0,
            lid: None,
            ends: Sides::Walls,
            sides,
            repeats: None,
        }
    }
}
