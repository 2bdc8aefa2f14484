//! `shape` of `[[grains]]`.

use std::path::PathBuf;

use sazanami_case_derive::Keys;
use sazanami_numerics::geometry::VolumeRule;
use sazanami_numerics::{Real, Vector};

use crate::value::Range1;

/// Lengths that a grain can have \[m]: beyond them volumes and masses are lost in rounding.
pub(super) const LENGTHS: Range1 = Range1::Between(1e-7, 1e3);
/// Most rings of a mesh, and most segments of a ring.
const MOST_DIVISIONS: usize = 200;

/// Shape of a grain of size factor 1.
#[derive(Clone, Debug, PartialEq, Keys)]
pub enum GrainShape {
    /// A sphere.
    Sphere {
        /// Diameter.
        #[key(unit = "m", range = LENGTHS)]
        diameter: Real,
        /// Divisions of the icosahedron that is its mesh.
        #[key(most = 8, default = 2)]
        refinement: usize,
        /// Volume of its mesh.
        #[key(word, default = VolumeRule::Preserve)]
        volume: VolumeRule,
    },
    /// A spheroid with two equal axes `diameter` and a single one `length`.
    Spheroid {
        /// The two equal axes.
        #[key(unit = "m", range = LENGTHS)]
        diameter: Real,
        /// The single axis.
        #[key(unit = "m", range = LENGTHS)]
        length: Real,
        /// Rings of its mesh.
        #[key(least = 1, most = MOST_DIVISIONS, default = 7)]
        rings: usize,
        /// Segments of a ring.
        #[key(least = 3, most = MOST_DIVISIONS, default = 6)]
        segments: usize,
        /// Volume of its mesh; inscribed, the paper's grain has about 0.8 of the spheroid's volume.
        #[key(word, default)]
        volume: VolumeRule,
    },
    /// A box.
    Box {
        /// Edges.
        #[key(unit = "m", range = LENGTHS)]
        size: Vector,
    },
    /// A circular cylinder with flat ends about body axis x1.
    Cylinder {
        /// Diameter.
        #[key(unit = "m", range = LENGTHS)]
        diameter: Real,
        /// Length along the axis.
        #[key(unit = "m", range = LENGTHS)]
        length: Real,
        /// Corners of the polygon that stands for the circle in its mesh.
        #[key(least = 3, most = MOST_DIVISIONS, default = 24)]
        segments: usize,
        /// Volume of its mesh: preserved by a larger radius, the length stays.
        #[key(word, default = VolumeRule::Preserve)]
        volume: VolumeRule,
    },
    /// A tetrahedral mesh from a Gmsh file, `.msh` 2.2 or 4.1.
    Mesh {
        /// The file, relative to the case file.
        #[key(example = "grain.msh -- a tetrahedral mesh of Gmsh")]
        file: PathBuf,
        /// Length of the file's unit.
        #[key(unit = "m", range = Positive, default = 1.0)]
        unit: Real,
    },
}

impl GrainShape {
    /// Grain size d \[m]: the short axis, the shortest edge, or the smaller of diameter and length; unknown for meshes until they are read.
    #[must_use]
    pub fn size(&self) -> Option<Real> {
        match self {
            Self::Sphere { diameter, .. } => Some(*diameter),
            Self::Spheroid { diameter, length, .. } | Self::Cylinder { diameter, length, .. } => {
                Some(diameter.min(*length))
            }
            Self::Box { size } => Some(size.min_element()),
            Self::Mesh { .. } => None,
        }
    }

    /// Middle one of the three extents \[m]; unknown for meshes until they are read.
    #[must_use]
    pub fn middle(&self) -> Option<Real> {
        match self {
            Self::Sphere { diameter, .. } | Self::Spheroid { diameter, .. } | Self::Cylinder { diameter, .. } => {
                Some(*diameter)
            }
            Self::Box { size } => Some(size.element_sum() - size.min_element() - size.max_element()),
            Self::Mesh { .. } => None,
        }
    }

    /// Largest extent \[m]; unknown for meshes until they are read.
    #[must_use]
    pub fn extent(&self) -> Option<Real> {
        match self {
            Self::Sphere { diameter, .. } => Some(*diameter),
            Self::Spheroid { diameter, length, .. } => Some(diameter.max(*length)),
            Self::Cylinder { diameter, length, .. } => Some(diameter.hypot(*length)),
            Self::Box { size } => Some(size.length()),
            Self::Mesh { .. } => None,
        }
    }

    /// Volume of the smooth shape [m^3]; unknown for meshes until they are read.
    #[must_use]
    pub fn volume(&self) -> Option<Real> {
        let sixth = std::f64::consts::PI / 6.0;
        match self {
            Self::Sphere { diameter, .. } => Some(sixth * diameter.powi(3)),
            Self::Spheroid { diameter, length, .. } => Some(sixth * diameter * diameter * length),
            Self::Cylinder { diameter, length, .. } => Some(1.5 * sixth * diameter * diameter * length),
            Self::Box { size } => Some(size.x * size.y * size.z),
            Self::Mesh { .. } => None,
        }
    }
}
