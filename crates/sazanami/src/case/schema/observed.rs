//! What is observed, written and kept, as written.

use schemars::JsonSchema;
use serde::Deserialize;

use crate::case::meaning::{ErosionMode, FieldPrecision, OutputFrame};
use crate::case::written::{At, Choice, Flag, Length, Quantity, Several, Text, Time, Vectorial, Whole};

/// Observation of the bed.
#[derive(Clone, Debug, Default, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct BedText {
    /// Lower height of the slab in which porosity is measured (default: the floor).
    pub porosity_lower: Option<Quantity<Length>>,
    /// Upper height of that slab (default: 5 mm above the floor, or the box if that is lower).
    pub porosity_upper: Option<Quantity<Length>>,
    /// Radius about the axis within which the bed's height is taken (default: 1 mm).
    pub height_radius: Option<Quantity<Length>>,
    /// Axis in x1 and x2 (default: middle of the box).
    pub axis: Option<Several<Length>>,
}

/// Observation of the crater.
#[derive(Clone, Debug, Default, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ErosionText {
    /// Grain size d (default: that of the first population).
    pub grain_size: Option<Quantity<Length>>,
    /// Cells of the smoothing grid (default: 2.5 d).
    pub dx: Option<Quantity<Length>>,
    /// Thickness of the circular layers (default: the smaller of 2.5 d and r_max/6).
    pub dr: Option<Quantity<Length>>,
    /// Largest radius (default: 0.45 of the smaller horizontal edge).
    pub r_max: Option<Quantity<Length>>,
    /// Which grains count.
    pub mode: Option<Choice<ErosionMode>>,
    /// Axis in x1 and x2 (default: that of the bed).
    pub axis: Option<Several<Length>>,
}

/// A place to watch: one of point, line, plane, gauge and body.
#[derive(Clone, Debug, Default, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ProbeText {
    /// Name.
    pub name: Option<Text>,
    /// A point.
    pub point: Option<Vectorial<Length>>,
    /// A line.
    pub line: Option<At<LineText>>,
    /// A plane.
    pub plane: Option<At<PlaneText>>,
    /// A wave gauge: a place in x1 and x2; moving particles are averaged across x2.
    pub gauge: Option<Several<Length>>,
    /// A grain.
    pub body: Option<At<BodyText>>,
    /// Every so often.
    pub every: Option<Quantity<Time>>,
    /// Every so many steps.
    pub steps: Option<Whole>,
    /// At these times.
    pub at: Option<Several<Time>>,
}

/// A line of points.
#[derive(Clone, Debug, Default, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct LineText {
    /// First point.
    pub from: Option<Vectorial<Length>>,
    /// Last point.
    pub to: Option<Vectorial<Length>>,
    /// How many points (default: 101).
    pub points: Option<Whole>,
}

/// A plane; one of x1, x2, x3.
#[derive(Clone, Debug, Default, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct PlaneText {
    /// Plane normal to x1, its coordinate.
    pub x1: Option<Quantity<Length>>,
    /// Plane normal to x2, its coordinate.
    pub x2: Option<Quantity<Length>>,
    /// Plane normal to x3, its coordinate.
    pub x3: Option<Quantity<Length>>,
}

/// A grain.
#[derive(Clone, Debug, Default, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct BodyText {
    /// Name of its population (default: the first).
    pub population: Option<Text>,
    /// Number within it, from 0 (default: 0).
    pub index: Option<Whole>,
}

/// What is written when.
#[derive(Clone, Debug, Default, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct OutputText {
    /// Fields for ParaView.
    pub fields: Option<At<ScheduleText>>,
    /// Grains for ParaView.
    pub grains: Option<At<ScheduleText>>,
    /// Pictures.
    pub figures: Option<At<ScheduleText>>,
    /// Rows of series.csv.
    pub series: Option<At<ScheduleText>>,
    /// Precision of fields.
    pub precision: Option<Choice<FieldPrecision>>,
    /// Frame of positions and velocities in files for ParaView and of probes.
    pub frame: Option<Choice<OutputFrame>>,
    /// File the packed bed is written to, relative to the case file (default: none but the one in OUT).
    pub bed: Option<Text>,
}

/// Times at which something happens.
#[derive(Clone, Debug, Default, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ScheduleText {
    /// Every so often.
    pub every: Option<Quantity<Time>>,
    /// Every so many steps.
    pub steps: Option<Whole>,
    /// At these times.
    pub at: Option<Several<Time>>,
}

/// Checkpoints.
#[derive(Clone, Debug, Default, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct CheckpointText {
    /// Every so much wall-clock time (default: 10 min).
    pub every_wall: Option<Quantity<Time>>,
    /// Every so much simulated time (default: never).
    pub every: Option<Quantity<Time>>,
    /// How many are kept (default: 2).
    pub keep: Option<Whole>,
}

/// How long the run is.
#[derive(Clone, Debug, Default, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct RunText {
    /// Simulated time at the end.
    pub until: Option<Quantity<Time>>,
    /// Most fluid steps (default: any number).
    pub steps: Option<Whole>,
    /// Whether the run ends when its grains are packed (default: false).
    pub packing_only: Option<Flag>,
}
