//! Smooth solids that meshes approximate.

use super::{Cylinder, Spheroid};
use crate::{Quaternion, Real, Vector};

/// The smooth solid that a mesh approximates.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Exact {
    /// A sphere or spheroid.
    Spheroid(Spheroid),
    /// A circular cylinder.
    Cylinder(Cylinder),
}

impl Exact {
    /// Volume [m^3].
    #[must_use]
    pub fn volume(&self) -> Real {
        match self {
            Self::Spheroid(spheroid) => spheroid.volume(),
            Self::Cylinder(cylinder) => cylinder.volume(),
        }
    }

    /// Principal moments of inertia per unit density, axis of revolution first [m^5].
    #[must_use]
    pub fn principal_inertia(&self) -> Vector {
        match self {
            Self::Spheroid(spheroid) => spheroid.principal_inertia(),
            Self::Cylinder(cylinder) => cylinder.principal_inertia(),
        }
    }

    /// Radius of the ball about the centre that holds it \[m].
    #[must_use]
    pub fn bounding_radius(&self) -> Real {
        match self {
            Self::Spheroid(spheroid) => spheroid.axial.max(spheroid.equatorial),
            Self::Cylinder(cylinder) => cylinder.radius.hypot(0.5 * cylinder.length),
        }
    }

    /// Half the edges of the box along x1, x2, x3 round it, turned by `orientation` \[m].
    #[must_use]
    pub fn half_extents(&self, orientation: Quaternion) -> Vector {
        match self {
            Self::Spheroid(spheroid) => spheroid.half_extents(orientation),
            Self::Cylinder(cylinder) => cylinder.half_extents(orientation),
        }
    }
}
