//! Grains: shapes, materials, contacts, and where they are put.

use std::path::PathBuf;

use sazanami_numerics::{Quaternion, Real, Vector};

use crate::case::written::choices;

/// Name of the box among the materials of a contact.
pub const WALL: &str = "wall";

choices! {
    /// Dashpot of a contact.
    DampingKind {
        /// Coefficients as given.
        Literal = "literal",
        /// From a restitution coefficient and the reduced mass of the grains.
        Restitution = "restitution",
    }

    /// What several contact spheres of one pair of grains do together.
    Multiplicity {
        /// Their stiffnesses add.
        Sum = "sum",
        /// They share one stiffness.
        Average = "average",
        /// Only the deepest counts.
        Deepest = "deepest",
    }

    /// Direction of friction while a contact slips.
    SlipDirection {
        /// Along the trial force.
        Force = "force",
        /// Along the sliding velocity, Yagyu et al. (2015), eq. (6).
        Velocity = "velocity",
    }

    /// What the turning of the normal does to the tangential displacement.
    HistoryRotation {
        /// Projected onto the new tangent plane, its length kept.
        LengthKept = "length_kept",
        /// Projected only.
        Projected = "projected",
    }

    /// Rolling resistance.
    Rolling {
        /// None: the shape gives it.
        None = "none",
        /// A constant torque against rolling, for spheres.
        ConstantTorque = "constant_torque",
    }

    /// Contact of grains with the walls of the box.
    WallContact {
        /// As that between grains.
        AsGrains = "as_grains",
        /// Without friction on the vertical sides.
        FrictionlessSides = "frictionless_sides",
    }

    /// Volume of a mesh inscribed in a curved shape.
    VolumeChoice {
        /// As inscribed: smaller than the shape.
        Inscribed = "inscribed",
        /// Scaled to the volume of the shape.
        Preserve = "preserve",
    }

    /// How grains move.
    Motion {
        /// By the forces on them.
        Free = "free",
        /// Not at all.
        Fixed = "fixed",
        /// With the given velocity and angular velocity.
        Prescribed = "prescribed",
    }

    /// Lattice grains fall from.
    Lattice {
        /// Wide enough for any orientation.
        Tall = "tall",
        /// As low as the orientations allow, for small beds.
        Low = "low",
    }

    /// When packing ends.
    PackingStop {
        /// When the bed has come to rest.
        Settled = "settled",
        /// A fixed time after the switch to normal gravity, as Yagyu et al. (2015).
        TimeOnly = "time_only",
    }
}

/// Sub-steps of the grains within a step of the fluid.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Substeps {
    /// As many as the contacts need.
    Auto,
    /// So many.
    Fixed(usize),
}

/// How grains are moved.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DemOptions {
    /// Sub-steps.
    pub substeps: Substeps,
    /// Several contact spheres of one pair.
    pub multiplicity: Multiplicity,
    /// Direction of friction while slipping.
    pub slip_direction: SlipDirection,
    /// Turning of the tangential displacement.
    pub history: HistoryRotation,
    /// Rolling resistance.
    pub rolling: Rolling,
    /// Torque of the rolling resistance over normal force and effective radius.
    pub rolling_friction: Real,
    /// Contact with the box.
    pub wall: WallContact,
    /// Sides of the box that hold grains back, `[direction][0 lower, 1 upper]`.
    pub grain_walls: [[bool; 2]; 3],
}

/// What a grain is made of.
#[derive(Clone, Debug, PartialEq)]
pub struct Material {
    /// Name.
    pub name: String,
    /// Density [kg/m^3].
    pub density: Real,
}

/// Dashpot of a contact.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Damping {
    /// Coefficients [N s/m].
    Literal {
        /// Along the normal [N s/m].
        normal: Real,
        /// Along the tangent [N s/m].
        tangential: Real,
    },
    /// From the restitution coefficient and the grains' reduced mass.
    Restitution(Real),
}

/// Contact law of a pair of materials, Yagyu et al. (2015), eqs. (4)-(6).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ContactLaw {
    /// Stiffness along the normal [N/m].
    pub normal_stiffness: Real,
    /// Stiffness along the tangent [N/m].
    pub tangential_stiffness: Real,
    /// Dashpot.
    pub damping: Damping,
    /// Friction coefficient.
    pub friction: Real,
    /// Whether a separating contact may pull.
    pub tension: bool,
}

/// Contact law of the materials `a` and `b`.
#[derive(Clone, Debug, PartialEq)]
pub struct PairContact {
    /// One material.
    pub a: String,
    /// The other, or [`WALL`].
    pub b: String,
    /// Their contact law.
    pub law: ContactLaw,
}

/// Shape of a grain of size factor 1.
#[derive(Clone, Debug, PartialEq)]
pub enum GrainShape {
    /// A sphere.
    Sphere {
        /// Diameter [m].
        diameter: Real,
        /// Divisions of the icosahedron that is its mesh.
        refinement: usize,
        /// Volume of its mesh.
        volume: VolumeChoice,
    },
    /// A spheroid with two equal axes `diameter` and a single one `length`.
    Spheroid {
        /// The two equal axes [m].
        diameter: Real,
        /// The single axis [m].
        length: Real,
        /// Rings of its mesh.
        rings: usize,
        /// Segments of a ring.
        segments: usize,
        /// Volume of its mesh.
        volume: VolumeChoice,
    },
    /// A box.
    Box {
        /// Edges [m].
        size: Vector,
    },
    /// A tetrahedral mesh from a Gmsh file.
    Mesh {
        /// The file.
        file: PathBuf,
        /// Length of the file's unit [m].
        unit: Real,
    },
}

/// Contact spheres of a grain.
#[derive(Clone, Debug, PartialEq)]
pub enum ContactSphereChoice {
    /// Equal spheres under the surface; the radius [m] by rule if not given.
    Shell {
        /// How many.
        count: usize,
        /// Radius [m].
        radius: Option<Real>,
    },
    /// Largest spheres along the long axis of a spheroid.
    Axis(usize),
    /// One sphere.
    Single,
    /// A list `x y z r` in a file, in the unit of the shape's body frame.
    File {
        /// The file.
        file: PathBuf,
        /// Length of the file's unit [m].
        unit: Real,
    },
}

/// Distribution of the size factors of a population.
#[derive(Clone, Debug, PartialEq)]
pub enum SizeDistribution {
    /// All the same.
    Equal,
    /// Some factors with their shares by number.
    List(Vec<[Real; 2]>),
    /// Equally likely between two factors.
    Uniform {
        /// Smallest factor.
        lower: Real,
        /// Largest factor.
        upper: Real,
    },
    /// Log-normal, cut off at two factors.
    Lognormal {
        /// Median factor.
        median: Real,
        /// Standard deviation of the logarithm.
        sigma: Real,
        /// Smallest factor.
        lower: Real,
        /// Largest factor.
        upper: Real,
    },
}

/// Packing of a bed within the run.
#[derive(Clone, Debug, PartialEq)]
pub struct Packing {
    /// Lattice the grains fall from.
    pub lattice: Lattice,
    /// Distance of neighbours over the largest extent of a grain.
    pub spacing: Real,
    /// Random displacement over the distance of neighbours.
    pub jitter: Real,
    /// Height above the floor up to which grains stay [m]: the packed bed is levelled there.
    pub level: Option<Real>,
    /// Height above the floor below which the centres of grains lie that are glued to it [m]: the floor is rough.
    pub glued: Option<Real>,
    /// Height of the packing space above the floor [m]; by the lattice if not given.
    pub height: Option<Real>,
    /// Gravity during the fall over gravity.
    pub fall_gravity: Real,
    /// Least time after the switch to normal gravity [s].
    pub settle_time: Real,
    /// When packing ends.
    pub stop: PackingStop,
    /// Largest mean speed of a bed at rest [m/s].
    pub mean_speed: Real,
    /// Largest kinetic energy of a bed at rest over `N M g d`.
    pub energy_ratio: Real,
    /// Friction during packing over friction.
    pub friction_scale: Real,
    /// Longest packing time [s].
    pub time_limit: Real,
}

/// A bed from a file.
#[derive(Clone, Debug, PartialEq)]
pub struct BedFile {
    /// The file.
    pub file: PathBuf,
    /// Factor on the positions in the file.
    pub scale: Real,
    /// Whether the grains settle before the run begins.
    pub relax: bool,
    /// The case that makes the file.
    pub recipe: Option<PathBuf>,
}

/// Grains on a lattice.
#[derive(Clone, Debug, PartialEq)]
pub struct LatticePlacement {
    /// Lower corner of the block they fill [m].
    pub lower: Vector,
    /// Upper corner [m].
    pub upper: Vector,
    /// Grains in each direction.
    pub counts: [usize; 3],
    /// Random displacement over the distance of neighbours.
    pub jitter: Real,
    /// Whether each is turned at random; otherwise the body axes lie along the box.
    pub random_orientation: bool,
    /// Velocity [m/s].
    pub velocity: Vector,
}

/// Orientation of a grain as a unit quaternion (body to laboratory).
pub type Orientation = Quaternion;

/// A grain put by hand.
#[derive(Clone, Debug, PartialEq)]
pub struct Grain {
    /// Centre of mass [m].
    pub position: Vector,
    /// Orientation.
    pub orientation: Orientation,
    /// Velocity [m/s].
    pub velocity: Vector,
    /// Angular velocity [rad/s].
    pub angular_velocity: Vector,
    /// How it moves.
    pub motion: Motion,
    /// Size factor.
    pub factor: Real,
}

/// Where the grains of a population are put.
#[derive(Clone, Debug, PartialEq)]
pub enum GrainPlacement {
    /// Packed within the run.
    Packed(Packing),
    /// Read from a file.
    Bed(BedFile),
    /// On a lattice.
    Lattice(LatticePlacement),
    /// One by one.
    List(Vec<Grain>),
}

/// Grains of one kind.
#[derive(Clone, Debug, PartialEq)]
pub struct Population {
    /// Name.
    pub name: String,
    /// How many; given by the file for beds read from one.
    pub count: Option<usize>,
    /// Shape.
    pub shape: GrainShape,
    /// Contact spheres.
    pub contact_spheres: ContactSphereChoice,
    /// Name of the material.
    pub material: String,
    /// Mass of a grain of size factor 1 [kg] instead of density times volume.
    pub mass_override: Option<Real>,
    /// Size factors.
    pub size: SizeDistribution,
    /// Seed of its random numbers.
    pub seed: u64,
    /// How its grains move (listed grains say so themselves).
    pub motion: Motion,
    /// Where they are put.
    pub placement: GrainPlacement,
}

impl SizeDistribution {
    /// Largest size factor.
    #[must_use]
    pub fn largest(&self) -> Real {
        match self {
            Self::Equal => 1.0,
            Self::List(list) => list.iter().map(|share| share[0]).fold(0.0, Real::max),
            Self::Uniform { upper, .. } | Self::Lognormal { upper, .. } => *upper,
        }
    }

    /// Mean size factor.
    #[must_use]
    pub fn mean(&self) -> Real {
        self.mean_power(1)
    }

    /// Mean cube of the size factors: that of the volumes.
    #[must_use]
    pub fn mean_cube(&self) -> Real {
        self.mean_power(3)
    }

    /// Mean of a power of the size factors; that of the whole distribution where a log-normal one is cut off.
    fn mean_power(&self, power: i32) -> Real {
        match self {
            Self::Equal => 1.0,
            Self::List(list) => {
                let shares: Real = list.iter().map(|share| share[1]).sum();
                list.iter().map(|share| share[1] * share[0].powi(power)).sum::<Real>() / shares
            }
            Self::Uniform { lower, upper } if upper > lower => {
                let over = f64::from(power + 1);
                (upper.powi(power + 1) - lower.powi(power + 1)) / (over * (upper - lower))
            }
            Self::Uniform { upper, .. } => upper.powi(power),
            Self::Lognormal { median, sigma, .. } => {
                median.powi(power) * (0.5 * (f64::from(power) * sigma).powi(2)).exp()
            }
        }
    }

    /// Smallest size factor.
    #[must_use]
    pub fn smallest(&self) -> Real {
        match self {
            Self::Equal => 1.0,
            Self::List(list) => list.iter().map(|share| share[0]).fold(Real::INFINITY, Real::min),
            Self::Uniform { lower, .. } | Self::Lognormal { lower, .. } => *lower,
        }
    }
}

impl GrainShape {
    /// Grain size d [m]: the short axis, or the shortest edge; unknown for meshes until they are read.
    #[must_use]
    pub fn size(&self) -> Option<Real> {
        match self {
            Self::Sphere { diameter, .. } => Some(*diameter),
            Self::Spheroid { diameter, length, .. } => Some(diameter.min(*length)),
            Self::Box { size } => Some(size.min_element()),
            Self::Mesh { .. } => None,
        }
    }

    /// Largest extent [m]; unknown for meshes until they are read.
    #[must_use]
    pub fn extent(&self) -> Option<Real> {
        match self {
            Self::Sphere { diameter, .. } => Some(*diameter),
            Self::Spheroid { diameter, length, .. } => Some(diameter.max(*length)),
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
            Self::Box { size } => Some(size.x * size.y * size.z),
            Self::Mesh { .. } => None,
        }
    }
}
