//! Sets of defaults.
//!
//! `paper_literal` follows Yagyu et al. (2015), or for moving particles Tazaki et al., to the letter where the
//! paper's letter, or the nearest named alternative to what the paper leaves open, is known; [`explain`] gives the
//! reasons line by line.

use sazanami_numerics::Real;

use super::meaning::{
    AlphaMethod, Convection, DropVelocity, ErosionMode, Exchange, HistoryRotation, PackingStop, Preset, Projection,
    SlipDirection, Solver, Substeps, VofScheme, WallContact,
};

/// Defaults that differ between presets.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Defaults {
    /// `fluid.vof`
    pub vof: VofScheme,
    /// `fluid.convection`
    pub convection: Convection,
    /// `fluid.projection`
    pub projection: Projection,
    /// `fluid.dt` [s]
    pub dt: Option<Real>,
    /// `coupling.exchange`
    pub exchange: Exchange,
    /// `coupling.alpha`
    pub alpha: AlphaMethod,
    /// `liquid.drop_velocity`
    pub drop_velocity: DropVelocity,
    /// `dem.substeps`
    pub substeps: Substeps,
    /// `dem.tension`
    pub tension: bool,
    /// `dem.slip_direction`
    pub slip_direction: SlipDirection,
    /// `dem.history`
    pub history: HistoryRotation,
    /// `dem.wall`
    pub wall: WallContact,
    /// `grains.placement.packed.stop`
    pub packing_stop: PackingStop,
    /// `grains.mass_override` of the paper's spheroid (0.52 mm x 1.27 mm) [kg]
    pub paper_grain_mass: Option<Real>,
    /// `erosion.mode`
    pub erosion_mode: ErosionMode,
    /// `overlap.blend`
    pub blend: [Real; 2],
    /// `frame.motion.ramp`, in periods
    pub ramp: Real,
    /// `particles.reduced_pressure`
    pub reduced_pressure: bool,
}

/// The paper's grain: its two equal axes and the single one [m].
pub const PAPER_GRAIN: [Real; 2] = [0.52e-3, 1.27e-3];

impl Defaults {
    /// The defaults of a preset for a solver: each follows its own paper.
    #[must_use]
    pub const fn of(preset: Preset, solver: Solver) -> Self {
        match (preset, solver) {
            (Preset::PaperLiteral, Solver::Mps) => {
                Self { blend: [0.4, 0.4], ramp: 0.0, reduced_pressure: false, ..Self::of(Preset::Recommended, solver) }
            }
            (Preset::Recommended, _) => Self {
                vof: VofScheme::Plic,
                convection: Convection::Consistent,
                projection: Projection::Full,
                dt: None,
                exchange: Exchange::Exact,
                alpha: AlphaMethod::Columns(4),
                drop_velocity: DropVelocity::Mass,
                substeps: Substeps::Auto,
                tension: false,
                slip_direction: SlipDirection::Force,
                history: HistoryRotation::LengthKept,
                wall: WallContact::AsGrains,
                packing_stop: PackingStop::Settled,
                paper_grain_mass: None,
                erosion_mode: ErosionMode::Surface,
                blend: [0.38, 0.42],
                ramp: 1.0,
                reduced_pressure: true,
            },
            (Preset::PaperLiteral, Solver::Mics) => Self {
                vof: VofScheme::ThincWlic,
                convection: Convection::VelocityForm,
                projection: Projection::Incremental,
                dt: Some(1e-5),
                exchange: Exchange::Stress,
                alpha: AlphaMethod::Clip,
                drop_velocity: DropVelocity::Beta,
                substeps: Substeps::Fixed(325),
                tension: true,
                slip_direction: SlipDirection::Velocity,
                history: HistoryRotation::Projected,
                wall: WallContact::FrictionlessSides,
                packing_stop: PackingStop::TimeOnly,
                paper_grain_mass: Some(1.93e-7),
                erosion_mode: ErosionMode::All,
                blend: [0.38, 0.42],
                ramp: 1.0,
                reduced_pressure: true,
            },
        }
    }
}

/// The keys that `paper_literal` sets, each with its value and the reason.
#[must_use]
pub const fn explain() -> &'static [(&'static str, &'static str, &'static str)] {
    &[
        ("fluid.vof", "thinc_wlic", "the paper transports density and names no scheme; an algebraic one comes closest"),
        ("fluid.convection", "velocity_form", "eq. (3) is written for the velocity, not for momentum"),
        ("fluid.projection", "incremental", "C-ISMAC, the authors' solver, advances the pressure's increment"),
        ("fluid.dt", "1e-5 s", "the paper's step; the fluid makes several passes where its own limits ask for it"),
        ("coupling.exchange", "stress", "forces on grains are the stress integral; what back-projection takes is lost"),
        ("coupling.alpha", "clip", "volume fractions by exact clipping, the reference evaluator"),
        ("liquid.drop_velocity", "beta", "u3 = beta_w v: cells with some water get some of the velocity"),
        ("dem.substeps", "325", "the paper's number of sub-steps in a fluid step"),
        ("dem.tension", "true", "eq. (4) without a cut: a separating contact may pull"),
        ("dem.slip_direction", "velocity", "eq. (6): friction along the sliding velocity"),
        ("dem.history", "projected", "the tangential displacement is projected and not stretched back"),
        ("dem.wall", "frictionless_sides", "the paper states no wall contact; the alternative to the default"),
        (
            "grains.placement.packed.stop",
            "time_only",
            "the bed is taken 5e-3 s after the first collision, at rest or not",
        ),
        ("grains.mass_override", "1.93e-7 kg", "table 1's mass, for the spheroid of 0.52 mm x 1.27 mm only"),
        ("erosion.mode", "all", "the wording counts all grains of a cell, not only those at the surface"),
        ("overlap.blend", "[0.4, 0.4]", "Tazaki et al. switch between the drag laws at phi = 0.4"),
        ("frame.motion.ramp", "0 s", "Tazaki et al. give the motion without a rise"),
        ("particles.reduced_pressure", "false", "the usual equations hold the whole pressure"),
    ]
}
