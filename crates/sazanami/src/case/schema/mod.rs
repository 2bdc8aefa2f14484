//! The case file as written. Every key is optional here; what is missing, wrong or contradictory is
//! said by [`build`](super::build), where the file gets its meaning.

mod flow;
mod grains;
mod observed;
mod particles;

pub use flow::*;
pub use grains::*;
pub use observed::*;
pub use particles::*;

use std::collections::BTreeMap;

use schemars::JsonSchema;
use serde::Deserialize;
use toml::Spanned;

use super::meaning::{Preset, Solver};
use super::written::{Acceleration, At, Choice, ScalarOrVector, Text};

/// Names with what they stand for, in alphabetic order.
pub type Named<T> = BTreeMap<Name, At<T>>;

/// A name that is a key, with its place.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord, Deserialize)]
#[serde(transparent)]
pub struct Name(pub Spanned<String>);

impl JsonSchema for Name {
    fn inline_schema() -> bool {
        true
    }

    fn schema_name() -> std::borrow::Cow<'static, str> {
        "Name".into()
    }

    fn json_schema(generator: &mut schemars::SchemaGenerator) -> schemars::Schema {
        String::json_schema(generator)
    }
}

/// A sazanami case: grains under moving water. Every number with a dimension is a text with its unit.
#[derive(Clone, Debug, Default, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, rename = "Case")]
#[schemars(title = "sazanami case")]
pub struct CaseText {
    /// Name of the run's folder (default: the file's name).
    pub name: Option<Text>,
    /// One line for people.
    pub title: Option<Text>,
    /// Set of defaults.
    pub preset: Option<Choice<Preset>>,
    /// Solver of the water: one grid for water, air and grains (mics), or moving particles (mps).
    pub solver: Option<Choice<Solver>>,
    /// The box and its cells.
    pub domain: Option<At<DomainText>>,
    /// The sides of the box.
    pub boundary: Option<At<BoundaryText>>,
    /// Gravity: a vector, or a magnitude that points down x3.
    pub gravity: Option<ScalarOrVector<Acceleration>>,
    /// Motion of the frame of reference.
    pub frame: Option<At<FrameText>>,
    /// The fluids and how they are computed.
    pub fluid: Option<At<FluidText>>,
    /// How fluids and grains act on each other.
    pub coupling: Option<At<CouplingText>>,
    /// Water as moving particles, for `solver = "mps"`.
    pub particles: Option<At<ParticlesText>>,
    /// How grains and the particles of water that overlap them act on each other, for `solver = "mps"`.
    pub overlap: Option<At<OverlapText>>,
    /// How a bed in water is made ready before the run begins, for `solver = "mps"`.
    pub preparation: Option<At<PreparationText>>,
    /// Where there is liquid (or a bubble) at the start; all else is gas.
    #[serde(default)]
    pub liquid: Vec<At<LiquidText>>,
    /// How grains are moved.
    pub dem: Option<At<DemText>>,
    /// What grains are made of, by name.
    #[serde(default)]
    pub material: Named<MaterialText>,
    /// Contact of pairs of materials, "a/b"; "a/wall" is the box, "default" all others.
    #[serde(default)]
    pub contact: Named<ContactText>,
    /// Populations of grains.
    #[serde(default)]
    pub grains: Vec<At<PopulationText>>,
    /// Observation of the bed.
    pub bed: Option<At<BedText>>,
    /// Observation of the crater; absent: not observed.
    pub erosion: Option<At<ErosionText>>,
    /// Observation of ripples, for `solver = "mps"`; absent: not observed.
    pub ripples: Option<At<RipplesText>>,
    /// Points, lines, planes and bodies to watch.
    #[serde(default)]
    pub probe: Vec<At<ProbeText>>,
    /// What is written when.
    pub output: Option<At<OutputText>>,
    /// Checkpoints.
    pub checkpoint: Option<At<CheckpointText>>,
    /// How long the run is.
    pub run: Option<At<RunText>>,
}
