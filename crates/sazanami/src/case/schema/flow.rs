//! The box, the fluids and the liquid at the start, as written.

use schemars::JsonSchema;
use serde::Deserialize;

use crate::case::meaning::{
    Convection, DropVelocity, Exchange, FluidName, Limiter, Projection, TorqueArm, ViscosityScheme, VofScheme,
    Weighting,
};
use crate::case::written::{
    Acceleration, Angle, At, Call, Cells, Choice, Density, DynamicViscosity, Flag, Frequency, KinematicViscosity,
    Length, Number, Pressure, Quantity, Several, Text, Time, Vectorial, Velocity, Whole,
};

/// The box and its cells.
#[derive(Clone, Debug, Default, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct DomainText {
    /// Lower corner (default: the origin).
    pub lower: Option<Vectorial<Length>>,
    /// Upper corner.
    pub upper: Option<Vectorial<Length>>,
    /// Edges, instead of the upper corner.
    pub size: Option<Vectorial<Length>>,
    /// Cells in x1, x2, x3; not needed for `solver = "mps"`.
    pub cells: Option<Cells>,
}

/// The sides of the box; the more special key wins.
#[derive(Clone, Debug, Default, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct BoundaryText {
    /// All sides (default: no_slip).
    pub all: Option<At<SideText>>,
    /// Both sides normal to x1.
    pub x1: Option<At<SideText>>,
    /// Both sides normal to x2.
    pub x2: Option<At<SideText>>,
    /// Bottom and top.
    pub x3: Option<At<SideText>>,
    /// Side of smallest x1.
    pub x1_lower: Option<At<SideText>>,
    /// Side of largest x1.
    pub x1_upper: Option<At<SideText>>,
    /// Side of smallest x2.
    pub x2_lower: Option<At<SideText>>,
    /// Side of largest x2.
    pub x2_upper: Option<At<SideText>>,
    /// Bottom.
    pub x3_lower: Option<At<SideText>>,
    /// Top.
    pub x3_upper: Option<At<SideText>>,
}

/// One side of the box.
#[derive(Clone, Debug, PartialEq, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum SideText {
    /// Wall that holds the fluid.
    NoSlip,
    /// Wall without friction.
    Slip,
    /// Joined to the opposite side.
    Periodic,
    /// Fluid leaves freely.
    Outflow,
    /// Wall that moves in its plane.
    Moving(MovingText),
    /// Fluid enters.
    Inflow(InflowText),
    /// Fluid enters or leaves under a given pressure.
    FixedPressure(FixedPressureText),
}

/// Wall that moves in its plane.
#[derive(Clone, Debug, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct MovingText {
    /// Velocity of the wall.
    pub velocity: Option<Vectorial<Velocity>>,
}

/// Fluid that enters.
#[derive(Clone, Debug, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct InflowText {
    /// Velocity of the fluid.
    pub velocity: Option<Vectorial<Velocity>>,
    /// Which fluid (default: liquid).
    pub fluid: Option<Choice<FluidName>>,
}

/// A given pressure.
#[derive(Clone, Debug, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct FixedPressureText {
    /// Pressure (default: zero).
    pub pressure: Option<Quantity<Pressure>>,
    /// Which fluid comes in (default: gas).
    pub fluid: Option<Choice<FluidName>>,
}

/// Motion of the frame of reference.
#[derive(Clone, Debug, Default, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct FrameText {
    /// Constant acceleration.
    pub acceleration: Option<Vectorial<Acceleration>>,
    /// Oscillating acceleration.
    pub oscillation: Option<At<OscillationText>>,
    /// Displacement of the tank, by formula or from a file.
    pub motion: Option<At<super::MotionText>>,
}

/// An acceleration `amplitude sin(2 pi frequency t + phase)`.
#[derive(Clone, Debug, Default, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct OscillationText {
    /// Amplitude.
    pub amplitude: Option<Vectorial<Acceleration>>,
    /// Frequency.
    pub frequency: Option<Quantity<Frequency>>,
    /// Phase (default: zero).
    pub phase: Option<Quantity<Angle>>,
}

/// The fluids and how they are computed.
#[derive(Clone, Debug, Default, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct FluidText {
    /// The heavier fluid (default: water).
    pub liquid: Option<At<PropertiesText>>,
    /// The lighter fluid (default: air).
    pub gas: Option<At<PropertiesText>>,
    /// Transport of the liquid's volume.
    pub vof: Option<Choice<VofScheme>>,
    /// Form of the convection.
    pub convection: Option<Choice<Convection>>,
    /// Limiter of its slopes.
    pub limiter: Option<Choice<Limiter>>,
    /// Projection.
    pub projection: Option<Choice<Projection>>,
    /// Treatment of viscosity.
    pub viscosity: Option<Choice<ViscosityScheme>>,
    /// Fixed time step; absent: as long as the limits allow.
    pub dt: Option<Quantity<Time>>,
    /// Longest time step.
    pub dt_max: Option<Quantity<Time>>,
    /// First time step.
    pub dt_first: Option<Quantity<Time>>,
    /// Largest ratio of a step to the one before.
    pub dt_growth: Option<Number>,
    /// Largest sum of Courant numbers in a fluid pass (below 0.5).
    pub cfl: Option<Number>,
    /// Largest |div u| dt left by the projection.
    pub tol_div: Option<Number>,
    /// Most iterations of the pressure solver.
    pub pressure_iterations: Option<Whole>,
}

/// Properties of a fluid.
#[derive(Clone, Debug, Default, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct PropertiesText {
    /// Density.
    pub density: Option<Quantity<Density>>,
    /// Kinematic viscosity.
    pub kinematic_viscosity: Option<Quantity<KinematicViscosity>>,
    /// Dynamic viscosity, instead of the kinematic one.
    pub dynamic_viscosity: Option<Quantity<DynamicViscosity>>,
}

/// How fluids and grains act on each other.
#[derive(Clone, Debug, Default, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct CouplingText {
    /// What grains get back of the momentum that the fluid loses to them.
    pub exchange: Option<Choice<Exchange>>,
    /// Weight of the grain's velocity in shared cells.
    pub weighting: Option<Choice<Weighting>>,
    /// Evaluator of volume fractions: columns(n), subcell(n) or clip.
    pub alpha: Option<Call>,
    /// Arm of the fluid's forces.
    pub torque_arm: Option<Choice<TorqueArm>>,
}

/// A body of liquid (or a bubble) at the start.
#[derive(Clone, Debug, Default, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct LiquidText {
    /// Name.
    pub name: Option<Text>,
    /// Which fluid (default: liquid). Later bodies overwrite earlier ones.
    pub fluid: Option<Choice<FluidName>>,
    /// Shape about its origin.
    pub region: Option<At<RegionText>>,
    /// Where the shape's origin is put (default: the origin of the box's coordinates).
    pub position: Option<Vectorial<Length>>,
    /// Height of the shape's origin above the highest point of the bed in use.
    pub above_bed: Option<Quantity<Length>>,
    /// Height of the shape's lowest point above the highest point of the bed in use.
    pub gap_above_bed: Option<Quantity<Length>>,
    /// Offset from the axis of the box in x1 and x2, with above_bed or gap_above_bed.
    pub offset: Option<Several<Length>>,
    /// Velocity (default: at rest).
    pub velocity: Option<Vectorial<Velocity>>,
    /// Speed and direction of a fall, instead of the velocity.
    pub fall: Option<At<FallText>>,
    /// Velocity in cells that it fills in part.
    pub drop_velocity: Option<Choice<DropVelocity>>,
    /// Whether it may touch grains at the start (default: false).
    pub allow_touching_grains: Option<Flag>,
}

/// A fall.
#[derive(Clone, Debug, Default, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct FallText {
    /// Speed.
    pub speed: Option<Quantity<Velocity>>,
    /// Angle from the vertical (default: zero).
    pub angle: Option<Quantity<Angle>>,
    /// Direction of the slant, from x1 towards x2 (default: zero).
    pub heading: Option<Quantity<Angle>>,
}

/// A shape made of primitives.
#[derive(Clone, Debug, PartialEq, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum RegionText {
    /// A box.
    Box(BoxText),
    /// A sphere.
    Sphere(SphereText),
    /// A spheroid about the vertical.
    Spheroid(SpheroidText),
    /// All behind a plane.
    HalfSpace(HalfSpaceText),
    /// Whatever one of several shapes holds.
    Union(Vec<At<RegionText>>),
}

/// A box.
#[derive(Clone, Debug, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct BoxText {
    /// Lower corner.
    pub lower: Option<Vectorial<Length>>,
    /// Upper corner.
    pub upper: Option<Vectorial<Length>>,
}

/// A sphere.
#[derive(Clone, Debug, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SphereText {
    /// Centre (default: the shape's origin).
    pub centre: Option<Vectorial<Length>>,
    /// Diameter.
    pub diameter: Option<Quantity<Length>>,
}

/// A spheroid about the vertical.
#[derive(Clone, Debug, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SpheroidText {
    /// Centre (default: the shape's origin).
    pub centre: Option<Vectorial<Length>>,
    /// Diameter across.
    pub horizontal_diameter: Option<Quantity<Length>>,
    /// Diameter along the vertical.
    pub vertical_diameter: Option<Quantity<Length>>,
}

/// All behind a plane.
#[derive(Clone, Debug, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct HalfSpaceText {
    /// A point of the plane.
    pub point: Option<Vectorial<Length>>,
    /// Direction out of the shape (default: up), a list of three numbers.
    pub normal: Option<crate::case::written::Numbers>,
}
