//! `[fluid]`: liquid, gas and how they are computed.

use sazanami_case_derive::Keys;
use sazanami_mics::advection::Convection;
use sazanami_mics::pressure::Tolerance;
use sazanami_mics::stability::StepLimits;
use sazanami_mics::viscosity::ViscosityScheme;
use sazanami_numerics::{Real, choices};

use super::{CarryingFlow, ContactAngles, InitialVelocity, read_by};
use crate::read::{Context, Table};

/// Water and air as in Yagyu et al. (2015).
const WATER: Fluid = Fluid { density: 1000.0, viscosity: 1000.0 * 1e-6 };
const AIR: Fluid = Fluid { density: 1.0, viscosity: 1.0 * 1e-5 };
/// Longest of the longest steps that are taken where the case says nothing \[s].
const LONGEST: Real = 1e-3;
/// The recommended limits of the step.
const LIMITS: StepLimits = StepLimits::up_to(LONGEST);

choices! {
    /// Form of the pressure in the projection onto divergence-free velocities.
    pub enum PressureForm {
        /// The whole pressure every step.
        Full = "full",
        /// The same, with the pressure gradient of the step before during the transport and velocities of faces at the middle of the step
        /// (single-phase flow, second order in time).
        Incremental = "incremental",
    }
}

/// Properties of a fluid; density and one viscosity are required in the table.
#[derive(Clone, Debug, Keys)]
#[keys(check = Self::check)]
struct FluidKeys {
    /// Density.
    #[key(unit = "kg/m^3", range = Positive)]
    density: Real,
    /// Kinematic viscosity.
    #[key(unit = "m^2/s", range = NonNegative)]
    kinematic_viscosity: Option<Real>,
    /// Dynamic viscosity, instead of the kinematic one.
    #[key(unit = "Pa s", range = NonNegative)]
    dynamic_viscosity: Option<Real>,
}

/// Properties of a fluid.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Fluid {
    /// Density [kg/m^3].
    pub density: Real,
    /// Dynamic viscosity [Pa s].
    pub viscosity: Real,
}

read_by!(Fluid, FluidKeys);

impl Fluid {
    fn words(&self, name: &str) -> String {
        let Self { density, viscosity } = self;
        format!("{name}: {density} kg/m^3, {:e} m^2/s", viscosity / density)
    }
}

impl FluidKeys {
    fn check(&mut self, table: &Table<'_>, cx: &mut Context<'_>) {
        match (self.kinematic_viscosity, self.dynamic_viscosity) {
            (Some(_), Some(_)) => {
                cx.report
                    .error(table.span(), "a fluid has one viscosity")
                    .label("this one has two")
                    .help("keep `kinematic_viscosity` or `dynamic_viscosity`");
            }
            (None, None) => {
                cx.missing(Some(table.span()), "kinematic_viscosity", "add `kinematic_viscosity = \"1e-6 m^2/s\"`")
            }
            _ => {}
        }
    }

    fn meaning(self, _: &mut Context<'_>) -> Option<Fluid> {
        let kinematic = self.kinematic_viscosity.map(|kinematic| self.density * kinematic);
        Some(Fluid { density: self.density, viscosity: self.dynamic_viscosity.or(kinematic).unwrap_or(Real::NAN) })
    }

    fn of(fluid: &Fluid) -> Self {
        Self { density: fluid.density, kinematic_viscosity: None, dynamic_viscosity: Some(fluid.viscosity) }
    }
}

/// Length of a step.
#[derive(Clone, Debug, Keys)]
#[keys(check = Self::check)]
struct StepKeys {
    /// Fixed time step; the fluid makes several passes where its own limits ask for it. Excludes the three keys of
    /// adaptive steps, one of which makes `paper_literal` adaptive too.
    #[key(unit = "s", range = Positive,
          paper_literal = (Yagyu, 1e-5, "the paper's step; the fluid makes several passes where its own limits ask for it"))]
    dt: Option<Real>,
    /// Longest adaptive step.
    #[key(unit = "s", range = Positive, says = format!("a free fall through a tenth of a cell, at most {LONGEST:e} s"))]
    dt_max: Option<Real>,
    /// First adaptive step.
    #[key(unit = "s", range = Positive, says = "`dt_max`")]
    dt_first: Option<Real>,
    /// Largest ratio of a step to the one before.
    #[key(range = Between(1.0, 10.0), meant = LIMITS.growth)]
    dt_growth: Option<Real>,
}

/// Choice of the time step.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum StepChoice {
    /// The same length always \[s]; the fluid makes several passes where its limits ask for it.
    Fixed(Real),
    /// As long as the limits allow.
    Adaptive {
        /// Longest step \[s].
        longest: Real,
        /// First step \[s].
        first: Real,
        /// Largest ratio of a step to the one before.
        growth: Real,
    },
}

read_by!(StepChoice, StepKeys);

impl StepChoice {
    /// The longest step \[s].
    #[must_use]
    pub fn longest(&self) -> Real {
        match *self {
            Self::Fixed(step) => step,
            Self::Adaptive { longest, .. } => longest,
        }
    }
}

impl StepKeys {
    fn check(&mut self, table: &Table<'_>, cx: &mut Context<'_>) {
        if !["dt_max", "dt_first", "dt_growth"].iter().any(|key| table.has(key)) {
            return;
        }
        if table.has("dt") {
            cx.report
                .error(table.span(), "a fixed step has no limits of its own")
                .label("`dt` stands beside `dt_max`, `dt_first` or `dt_growth`")
                .help("leave out `dt` for a step that adapts");
        } else {
            self.dt = None;
        }
    }

    fn meaning(self, cx: &mut Context<'_>) -> Option<StepChoice> {
        if let Some(dt) = self.dt {
            return Some(StepChoice::Fixed(dt));
        }
        // Falling freely from rest for this long crosses a tenth of a cell.
        let fall = (0.2 * cx.known.domain.spacing().min_element() / cx.known.gravity.length()).sqrt();
        let longest = self.dt_max.unwrap_or(if fall.is_finite() { fall.min(LONGEST) } else { LONGEST });
        Some(StepChoice::Adaptive {
            longest,
            first: self.dt_first.unwrap_or(longest),
            growth: self.dt_growth.unwrap_or(LIMITS.growth),
        })
    }

    fn of(step: &StepChoice) -> Self {
        match *step {
            StepChoice::Fixed(dt) => Self { dt: Some(dt), dt_max: None, dt_first: None, dt_growth: None },
            StepChoice::Adaptive { longest, first, growth } => {
                Self { dt: None, dt_max: Some(longest), dt_first: Some(first), dt_growth: Some(growth) }
            }
        }
    }
}

/// Liquid, gas and how they are computed.
#[derive(Clone, Copy, Debug, PartialEq, Keys)]
#[keys(check = Self::check)]
pub struct FluidOptions {
    /// Form of the convection of momentum.
    #[key(word, default, paper_literal = (Yagyu, Convection::VelocityForm,
          "eq. (3) is written for the velocity, not for momentum"))]
    pub convection: Convection,
    /// Form of the pressure in the projection onto divergence-free velocities.
    #[key(word, default = PressureForm::Full, paper_literal = (Yagyu, PressureForm::Incremental,
          "C-ISMAC, the authors' solver, advances the pressure's increment"))]
    pub pressure_form: PressureForm,
    /// Treatment of viscosity.
    #[key(word, default = suited_to(pressure_form), says = "`auto`; `crank_nicolson` with `pressure_form = \"incremental\"`")]
    pub viscosity: ViscosityScheme,
    /// Time step.
    #[key(flatten)]
    pub step: StepChoice,
    /// Largest sum over directions of the parts of a cell swept in a pass.
    #[key(range = Between(1e-3, 0.499), default = LIMITS.courant)]
    pub cfl: Real,
    /// Largest `|div u| dt` that the projection leaves. The volume of liquid changes by no more than this and the number
    /// of steps allow. Below a Courant number of 0.01 less is wanted in proportion, down to 1e-10, so that it stays small beside a slow flow.
    #[key(name = "tol_div", range = Between(1e-15, 1e-2), default = Tolerance::default().divergence)]
    pub divergence_tolerance: Real,
    /// Iterations after which a solve of the pressure is given up (exit code 1).
    #[key(least = 1, default = Tolerance::default().max_iterations)]
    pub pressure_iterations: usize,
    /// Surface tension of liquid and gas on the grid (`solver = "mics"`).
    #[key(unit = "N/m", quantity = "a surface tension", range = NonNegative, says = "none")]
    pub surface_tension: Option<Real>,
    /// By how much the pressure of the gas exceeds that of the liquid where they meet in the pores of a bed of grains narrower than four cells:
    /// positive draws the liquid in (grains that it wets, some `6 sigma cos(theta) (1 - eps)/(eps d)`), negative holds it out. There it takes
    /// the place of the curvature of the interface; `surface_tension` need not be given (`solver = "mics"`, `exchange = "surface"`).
    #[key(unit = "Pa", says = "none: the interface goes through narrow grains as it comes")]
    pub entry_pressure: Option<Real>,
    /// Angles at which the interface meets walls and grains, with surface tension.
    #[key(table)]
    pub contact_angle: Option<ContactAngles>,
    /// Angles below which a line of contact recedes; between these and those of `contact_angle`, from which on it advances, it stands still.
    /// Where none is given it is that of `contact_angle`. Of walls that stand still only, not of grains.
    #[key(table)]
    pub receding_angle: Option<ContactAngles>,
    /// Velocity at the start, on top of that of the liquids; on a grid the pressure takes out its divergence.
    #[key(table)]
    pub initial_velocity: Option<InitialVelocity>,
    /// Flow that carries the liquid on the grid (`solver = "mics"`) as it is given: nothing is solved for, and momentum has
    /// no budget. Only without grains.
    #[key(table)]
    pub carrying_flow: Option<CarryingFlow>,
    /// The heavier fluid.
    #[key(table, default = WATER, says = WATER.words("water"))]
    pub liquid: Fluid,
    /// The lighter fluid.
    #[key(table, default = AIR, says = AIR.words("air"))]
    pub gas: Fluid,
}

fn suited_to(pressure_form: PressureForm) -> ViscosityScheme {
    match pressure_form {
        PressureForm::Full => ViscosityScheme::Auto,
        PressureForm::Incremental => ViscosityScheme::CrankNicolson,
    }
}

impl FluidOptions {
    fn check(&mut self, table: &Table<'_>, cx: &mut Context<'_>) {
        if self.gas.density > self.liquid.density {
            cx.report
                .error(table.span(), "the gas is heavier than the liquid")
                .label("`liquid` names the heavier fluid")
                .help("exchange the two");
        }
        if self.viscosity == ViscosityScheme::CrankNicolson && self.pressure_form == PressureForm::Full {
            cx.report
                .error(table.place("viscosity"), "Crank-Nicolson with the full pressure")
                .label("it is of second order in time with `pressure_form = \"incremental\"` alone, and shakes drops of thick liquid")
                .help("leave `viscosity` out");
        }
    }
}
