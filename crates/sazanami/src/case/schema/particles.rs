//! Water as moving particles, the shaking of its tank, and ripples, as written.

use schemars::JsonSchema;
use serde::Deserialize;

use crate::case::meaning::{
    Axis, DensityReference, GradientForm, ImageSide, KeepApart, LayerReference, Order, PressureForce, SphereDrag,
    WallMotion, Wendland,
};
use crate::case::written::{
    Angle, At, Choice, Flag, Frequency, Length, Number, Numbers, Quantity, Text, Time, Vectorial, Velocity, Whole,
};

/// Water as moving particles, for `solver = "mps"`.
#[derive(Clone, Debug, Default, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ParticlesText {
    /// Particle spacing l0.
    pub spacing: Option<Quantity<Length>>,
    /// Radius of influence r_e over the spacing, 2.1 to 3.6 (default: 3.1).
    pub radius: Option<Number>,
    /// Family of the weight function.
    pub weight: Option<Choice<Wendland>>,
    /// Source of the pressure equation: HS or the deviation of the number density.
    pub source: Option<Choice<Order>>,
    /// Laplacian: HL or the classical one.
    pub laplacian: Option<Choice<Order>>,
    /// Factor of the error-compensating source (ECS); 0: none (default: 1).
    pub compensation: Option<Number>,
    /// Times of the flow over which an error of the number density relaxes; 0: it does not (default: 100).
    pub relaxation: Option<Number>,
    /// Gradient of the pressure: GC or the classical one.
    pub gradient: Option<Choice<GradientForm>>,
    /// Dynamic stabilisation (DS), pairs counted with their weight or fully, or off.
    pub stabilisation: Option<Choice<KeepApart>>,
    /// Distance below which it acts, over the particle size (default: 0.95).
    pub stabilisation_distance: Option<Number>,
    /// Part of (r_e/2)^2 by which particles away from the surface move down the gradient of their concentration in a
    /// time of the flow, 0 to 0.5; 0: they do not (default).
    pub shifting: Option<Number>,
    /// Whether the pressure is solved for without its part at rest.
    pub reduced_pressure: Option<Flag>,
    /// Way of the fastest particle or grain in a step over its size (default: 0.15).
    pub courant: Option<Number>,
    /// Fixed time step; absent: as long as the limits allow.
    pub dt: Option<Quantity<Time>>,
    /// Longest time step (default: a fifth of the millisecond).
    pub dt_max: Option<Quantity<Time>>,
    /// Largest residual of the pressure equation, as a volume strain in a step (default: 1e-6).
    pub tolerance: Option<Number>,
    /// Most iterations of the pressure solver (default: 500).
    pub pressure_iterations: Option<Whole>,
}

/// How grains and the particles of water that overlap them act on each other, for `solver = "mps"`.
#[derive(Clone, Debug, Default, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct OverlapText {
    /// Radius over which the void fraction is smoothed (default: 3 mean diameters, at least 2.5 of the largest).
    pub smoothing: Option<Quantity<Length>>,
    /// Least void fraction (default: 0.3).
    pub least_void: Option<Number>,
    /// Pressure that grains feel: of the same step, or of the one before.
    pub pressure_force: Option<Choice<PressureForce>>,
    /// Kozeny's constant in the permeability `eps^3 d^2/(k (1-eps)^2)` (default: 150).
    pub kozeny: Option<Number>,
    /// Constant quadratic coefficient F_ch (default: `1.75/sqrt(150 eps^3)`, Ergun's).
    pub forchheimer: Option<Number>,
    /// Drag of a single sphere.
    pub sphere_drag: Option<Choice<SphereDrag>>,
    /// What the solid number density phi is counted from.
    pub density_reference: Option<Choice<DensityReference>>,
    /// Lower and upper phi between which the law goes over from single grains to a bed (default: [0.38, 0.42]).
    pub blend: Option<Numbers>,
}

/// How a bed in water is made ready before the run begins, for `solver = "mps"`.
#[derive(Clone, Debug, Default, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct PreparationText {
    /// Most steps in which the water comes to rest with the grains held (default: 500 with a bed, otherwise 0).
    pub relax_steps: Option<Whole>,
    /// What a step leaves of the water's velocity meanwhile (default: 0.9).
    pub damping: Option<Number>,
    /// Root mean square of the volume strain of water at rest (default: 0.01).
    pub strain: Option<Number>,
    /// Largest speed of water at rest (default: 1 mm/s).
    pub speed: Option<Quantity<Velocity>>,
    /// Time for which the grains are free in water at rest (default: 0.2 s with a bed, otherwise 0).
    pub settle: Option<Quantity<Time>>,
    /// File of a state made ready by an earlier run, instead.
    pub state: Option<Text>,
    /// Whether a state made ready is kept for later runs of the same tank (default: true).
    pub cache: Option<Flag>,
}

/// A motion of the tank, by formula or from a file.
#[derive(Clone, Debug, Default, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct MotionText {
    /// Amplitude A of the displacement `A r(t) sin(2 pi f t + phase)`.
    pub amplitude: Option<Vectorial<Length>>,
    /// Frequency f.
    pub frequency: Option<Quantity<Frequency>>,
    /// Phase (default: zero).
    pub phase: Option<Quantity<Angle>>,
    /// Time over which the motion rises from rest, `r = 3 s^2 - 2 s^3` (default: one period).
    pub ramp: Option<Quantity<Time>>,
    /// File with columns `t_s,x_m`, instead of the formula.
    pub file: Option<Text>,
    /// Direction of the motion in the file (default: x1).
    pub axis: Option<Choice<Axis>>,
    /// Whether positions are those in the tank, whose walls are at rest, or those in the laboratory, where they move.
    pub walls: Option<Choice<WallMotion>>,
}

/// Observation of ripples.
#[derive(Clone, Debug, Default, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct RipplesText {
    /// Grain size d (default: that of the first population).
    pub grain_size: Option<Quantity<Length>>,
    /// Thickness of the two layers of averages (default: 5 d, at most the height of the box).
    pub layer_thickness: Option<Quantity<Length>>,
    /// Where the layers are counted from.
    pub layers: Option<Choice<LayerReference>>,
    /// Part of x1 that is averaged over, about the middle (default: the whole length).
    pub layer_length: Option<Quantity<Length>>,
    /// Distance from the end walls at which ripples are not measured (default: 10 mm, at most a quarter of the
    /// length).
    pub margin: Option<Quantity<Length>>,
    /// Side that photographs were taken from.
    pub image_side: Option<Choice<ImageSide>>,
    /// Speed at the upper end of the colours (default: 0.1 m/s).
    pub colour_speed: Option<Quantity<Velocity>>,
    /// Drag and force of the pressure at the ends of the colours, over the submerged weight of a grain (default: 0.3).
    pub colour_force: Option<Number>,
    /// Profiles that were measured.
    #[serde(default)]
    pub measured: Vec<At<MeasuredText>>,
}

/// Measured profiles of a time.
#[derive(Clone, Debug, Default, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct MeasuredText {
    /// Time of the profiles.
    pub time: Option<Quantity<Time>>,
    /// File with columns `x_m,z_m`: surface of the bed.
    pub bed: Option<Text>,
    /// File with columns `x_m,z_m`: surface of the water.
    pub water: Option<Text>,
}
