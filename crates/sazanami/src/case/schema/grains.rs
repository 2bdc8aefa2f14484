//! Grains, materials and contacts, as written.

use schemars::JsonSchema;
use serde::Deserialize;

use crate::case::meaning::{
    DampingKind, HistoryRotation, Lattice, Motion, Multiplicity, PackingStop, Rolling, SlipDirection, VolumeChoice,
    WallContact,
};
use crate::case::written::{
    Angle, AngularVelocity, At, AutoOrWhole, Call, Cells, Choice, Dashpot, Density, Flag, Length, Mass, Number,
    Numbers, Quantity, Stiffness, Text, Time, Vectorial, Velocity, Whole, Words,
};

/// How grains are moved.
#[derive(Clone, Debug, Default, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct DemText {
    /// Sub-steps in a step of the fluid: auto or a number.
    pub substeps: Option<AutoOrWhole>,
    /// Dashpot of contacts that do not say themselves.
    pub damping: Option<Choice<DampingKind>>,
    /// Whether separating contacts may pull (default: false).
    pub tension: Option<Flag>,
    /// Several contact spheres of one pair of grains.
    pub multiplicity: Option<Choice<Multiplicity>>,
    /// Direction of friction while slipping.
    pub slip_direction: Option<Choice<SlipDirection>>,
    /// Turning of the tangential displacement.
    pub history: Option<Choice<HistoryRotation>>,
    /// Rolling resistance.
    pub rolling: Option<Choice<Rolling>>,
    /// Torque of the rolling resistance over normal force and effective radius.
    pub rolling_friction: Option<Number>,
    /// Contact with the box where no "a/wall" says otherwise.
    pub wall: Option<Choice<WallContact>>,
    /// Sides that hold grains back, x1_lower to x3_upper (default: those that are walls for the fluid).
    pub grain_walls: Option<Words>,
}

/// A material.
#[derive(Clone, Debug, Default, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct MaterialText {
    /// Density.
    pub density: Option<Quantity<Density>>,
}

/// Contact of a pair of materials.
#[derive(Clone, Debug, Default, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ContactText {
    /// Stiffness along the normal.
    pub normal_stiffness: Option<Quantity<Stiffness>>,
    /// Stiffness along the tangent (default: that along the normal).
    pub tangential_stiffness: Option<Quantity<Stiffness>>,
    /// Dashpot: coefficients, or from a restitution coefficient.
    pub damping: Option<Choice<DampingKind>>,
    /// Dashpot along the normal.
    pub normal_damping: Option<Quantity<Dashpot>>,
    /// Dashpot along the tangent (default: that along the normal).
    pub tangential_damping: Option<Quantity<Dashpot>>,
    /// Restitution coefficient.
    pub restitution: Option<Number>,
    /// Friction coefficient.
    pub friction: Option<Number>,
    /// Whether a separating contact may pull.
    pub tension: Option<Flag>,
}

/// A population of grains.
#[derive(Clone, Debug, Default, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct PopulationText {
    /// Name.
    pub name: Option<Text>,
    /// How many; for a bed that is levelled, as many as fill it up to there by default.
    pub count: Option<Whole>,
    /// Shape.
    pub shape: Option<At<ShapeText>>,
    /// Contact spheres: shell(n), axis(n), single or file.
    pub contact_spheres: Option<Call>,
    /// Radius of the spheres of a shell (default: by rule).
    pub sphere_radius: Option<Quantity<Length>>,
    /// File of contact spheres, lines "x y z r" in the body frame.
    pub sphere_file: Option<Text>,
    /// Length of that file's unit (default: 1 m).
    pub sphere_file_unit: Option<Quantity<Length>>,
    /// Material.
    pub material: Option<Text>,
    /// Mass of a grain of size factor 1, instead of density times volume.
    pub mass_override: Option<Quantity<Mass>>,
    /// Distribution of size factors (default: all 1).
    pub size: Option<At<SizeText>>,
    /// Seed of random numbers (default: 1).
    pub seed: Option<Whole>,
    /// How the grains move (default: free).
    pub motion: Option<Choice<Motion>>,
    /// Where they are put.
    pub placement: Option<At<PlacementText>>,
}

/// Shape of grains.
#[derive(Clone, Debug, PartialEq, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum ShapeText {
    /// A sphere.
    Sphere(SphereShapeText),
    /// A spheroid.
    Spheroid(SpheroidShapeText),
    /// A box.
    Box(BoxShapeText),
    /// A tetrahedral mesh from a Gmsh file.
    Mesh(MeshShapeText),
}

/// A sphere.
#[derive(Clone, Debug, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SphereShapeText {
    /// Diameter.
    pub diameter: Option<Quantity<Length>>,
    /// Divisions of the icosahedron that is its mesh (default: 2).
    pub refinement: Option<Whole>,
    /// Volume of the mesh (default: preserve).
    pub volume: Option<Choice<VolumeChoice>>,
}

/// A spheroid.
#[derive(Clone, Debug, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SpheroidShapeText {
    /// The two equal axes.
    pub diameter: Option<Quantity<Length>>,
    /// The single axis.
    pub length: Option<Quantity<Length>>,
    /// Rings of the mesh (default: 7).
    pub rings: Option<Whole>,
    /// Segments of a ring (default: 6).
    pub segments: Option<Whole>,
    /// Volume of the mesh (default: inscribed).
    pub volume: Option<Choice<VolumeChoice>>,
}

/// A box.
#[derive(Clone, Debug, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct BoxShapeText {
    /// Edges.
    pub size: Option<Vectorial<Length>>,
}

/// A tetrahedral mesh.
#[derive(Clone, Debug, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct MeshShapeText {
    /// Gmsh file (.msh 2.2 or 4.1), relative to the case file.
    pub file: Option<Text>,
    /// Length of the file's unit (default: 1 m).
    pub unit: Option<Quantity<Length>>,
}

/// Distribution of size factors.
#[derive(Clone, Debug, PartialEq, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum SizeText {
    /// Some factors with their shares by number.
    List(Vec<At<ShareText>>),
    /// Equally likely between two factors.
    Uniform(UniformText),
    /// Log-normal, cut off at two factors.
    Lognormal(LognormalText),
}

/// A factor and its share.
#[derive(Clone, Debug, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ShareText {
    /// Factor on lengths.
    pub factor: Option<Number>,
    /// Share by number.
    pub weight: Option<Number>,
}

/// Equally likely between two factors.
#[derive(Clone, Debug, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct UniformText {
    /// Smallest factor.
    pub lower: Option<Number>,
    /// Largest factor.
    pub upper: Option<Number>,
}

/// Log-normal, cut off at two factors.
#[derive(Clone, Debug, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct LognormalText {
    /// Median factor (default: 1).
    pub median: Option<Number>,
    /// Standard deviation of the logarithm.
    pub sigma: Option<Number>,
    /// Smallest factor (default: median exp(-3 sigma)).
    pub lower: Option<Number>,
    /// Largest factor (default: median exp(3 sigma)).
    pub upper: Option<Number>,
}

/// Where grains are put.
#[derive(Clone, Debug, PartialEq, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum PlacementText {
    /// Packed within the run.
    Packed(Box<PackingText>),
    /// Read from a bed file.
    Bed(BedFileText),
    /// On a lattice.
    Lattice(LatticeText),
    /// One by one.
    List(Vec<At<GrainText>>),
}

/// Packing within the run.
#[derive(Clone, Debug, Default, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct PackingText {
    /// Lattice the grains fall from.
    pub lattice: Option<Choice<Lattice>>,
    /// Distance of neighbours over the largest extent of a grain (default: 1.05).
    pub spacing: Option<Number>,
    /// Random displacement over that distance (default: 0.02).
    pub jitter: Option<Number>,
    /// Height above the floor at which the packed bed is levelled: grains that reach above are taken away.
    pub level: Option<Quantity<Length>>,
    /// Height above the floor below which the centres of grains lie that are glued to it once they are packed
    /// (default: none; for `solver = "mps"`).
    pub glued: Option<Quantity<Length>>,
    /// Height of the packing space (default: by the lattice).
    pub height: Option<Quantity<Length>>,
    /// Gravity during the fall over gravity (default: 4).
    pub fall_gravity: Option<Number>,
    /// Least time after the switch to normal gravity (default: 5e-3 s).
    pub settle_time: Option<Quantity<Time>>,
    /// When packing ends.
    pub stop: Option<Choice<PackingStop>>,
    /// Largest mean speed of a bed at rest (default: 2e-3 m/s).
    pub mean_speed: Option<Quantity<Velocity>>,
    /// Largest kinetic energy of a bed at rest over N M g d (default: 1e-3).
    pub energy_ratio: Option<Number>,
    /// Friction during packing over friction (default: 1).
    pub friction_scale: Option<Number>,
    /// Longest packing time (default: 2 s).
    pub time_limit: Option<Quantity<Time>>,
}

/// A bed file.
#[derive(Clone, Debug, Default, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct BedFileText {
    /// The file, relative to the case file.
    pub file: Option<Text>,
    /// Factor on positions (default: 1).
    pub scale: Option<Number>,
    /// Whether the grains settle before the run begins (default: false).
    pub relax: Option<Flag>,
    /// The case that makes the file, for the message when it is missing.
    pub recipe: Option<Text>,
}

/// A lattice of grains.
#[derive(Clone, Debug, Default, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct LatticeText {
    /// Lower corner of the block (default: that of the box).
    pub lower: Option<Vectorial<Length>>,
    /// Upper corner of the block (default: that of the box).
    pub upper: Option<Vectorial<Length>>,
    /// Grains in x1, x2, x3.
    pub counts: Option<Cells>,
    /// Random displacement over the distance of neighbours (default: 0).
    pub jitter: Option<Number>,
    /// Whether each grain is turned at random (default: false).
    pub random_orientation: Option<Flag>,
    /// Velocity (default: at rest).
    pub velocity: Option<Vectorial<Velocity>>,
}

/// One grain.
#[derive(Clone, Debug, Default, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct GrainText {
    /// Centre of mass.
    pub position: Option<Vectorial<Length>>,
    /// Axis of the rotation from the body frame, a list of three numbers.
    pub axis: Option<Numbers>,
    /// Angle of that rotation.
    pub angle: Option<Quantity<Angle>>,
    /// Rotation as a quaternion [w, x, y, z], instead of axis and angle.
    pub quaternion: Option<Numbers>,
    /// Velocity (default: at rest).
    pub velocity: Option<Vectorial<Velocity>>,
    /// Angular velocity (default: none).
    pub angular_velocity: Option<Vectorial<AngularVelocity>>,
    /// How it moves (default: as its population).
    pub motion: Option<Choice<Motion>>,
    /// Size factor (default: 1).
    pub factor: Option<Number>,
}
