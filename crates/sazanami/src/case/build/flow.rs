//! Boundaries, gravity, fluids and their schemes.

use std::ops::Range;

use sazanami_numerics::{Real, Vector};

use super::Context;
use crate::case::meaning::{
    AlphaMethod, BoundarySide, BoxDomain, Convection, Coupling, Fluid, FluidName, FluidOptions, Fluids, Frame, Limiter,
    Oscillation, Projection, SIDE_NAMES, Step, TorqueArm, ViscosityScheme, Weighting,
};
use crate::case::schema::{BoundaryText, CaseText, CouplingText, FluidText, PropertiesText, SideText};
use crate::case::value::Range1;
use crate::case::written::{
    Acceleration, Angle, At, Density, DynamicViscosity, Frequency, KinematicViscosity, Pressure, Time, Velocity,
};

/// Water and air as in Yagyu et al. (2015): density [kg/m^3] and kinematic viscosity [m^2/s].
const WATER: [Real; 2] = [1000.0, 1e-6];
const AIR: [Real; 2] = [1.0, 1e-5];

/// What is written about a side: for itself, for its direction, or for all.
fn side_text(written: &BoundaryText, direction: usize, upper: usize) -> Option<&At<SideText>> {
    let by_direction = [&written.x1, &written.x2, &written.x3];
    let by_side = [
        [&written.x1_lower, &written.x1_upper],
        [&written.x2_lower, &written.x2_upper],
        [&written.x3_lower, &written.x3_upper],
    ];
    by_side[direction][upper].as_ref().or(by_direction[direction].as_ref()).or(written.all.as_ref())
}

/// Place of a side in the file, if it is written about.
pub(super) fn span_of_side(text: &CaseText, direction: usize, upper: usize) -> Option<Range<usize>> {
    let boundary = text.boundary.as_ref()?;
    let side = side_text(&boundary.value, direction, upper);
    Some(side.map_or(boundary.span.clone(), |at| at.span.clone()))
}

impl Context<'_> {
    pub(super) fn boundary(&mut self, text: &CaseText, domain: &BoxDomain) -> [[BoundarySide; 2]; 3] {
        let empty = BoundaryText::default();
        let written = text.boundary.as_ref().map_or(&empty, |at| &at.value);
        let mut sides = [[BoundarySide::NoSlip; 2]; 3];
        for d in 0..3 {
            let mut spans = [None, None];
            for upper in 0..2 {
                if let Some(at) = side_text(written, d, upper) {
                    sides[d][upper] = self.side(at, d, SIDE_NAMES[d][upper]);
                    spans[upper] = Some(at.span.clone());
                }
            }
            let periodic = sides[d].map(|side| side == BoundarySide::Periodic);
            if periodic[0] != periodic[1] {
                let single = usize::from(periodic[1]);
                let span = spans[single].clone().unwrap_or(0..0);
                self.values
                    .report
                    .error(span, format!("the side {} is periodic, the opposite one is not", SIDE_NAMES[d][single]))
                    .label("a periodic side is joined to the opposite one")
                    .help(format!("write `x{} = \"periodic\"` for both", d + 1));
            }
        }
        self.check_net_inflow(text, &sides, domain);
        sides
    }

    /// A box without an open side has to get out what comes in.
    fn check_net_inflow(&mut self, text: &CaseText, sides: &[[BoundarySide; 2]; 3], domain: &BoxDomain) {
        let open = |side: &BoundarySide| matches!(side, BoundarySide::Outflow | BoundarySide::FixedPressure { .. });
        if sides.iter().flatten().any(open) {
            return;
        }
        let extent = domain.extent();
        let mut net = 0.0;
        let mut gross = 0.0;
        for d in 0..3 {
            let area = extent[(d + 1) % 3] * extent[(d + 2) % 3];
            for (upper, side) in sides[d].iter().enumerate() {
                if let BoundarySide::Inflow { velocity, .. } = side {
                    let inwards = if upper == 0 { velocity[d] } else { -velocity[d] };
                    net += inwards * area;
                    gross += (inwards * area).abs();
                }
            }
        }
        if net.abs() > 1e-12 * gross {
            let span = text.boundary.as_ref().map_or(0..0, |at| at.span.clone());
            self.values
                .report
                .error(span, "fluid enters a box that it cannot leave")
                .label(format!("{net:.3e} m^3/s in all, and no side is open"))
                .help("make one side `\"outflow\"` or `{ fixed_pressure = {} }`");
        }
    }

    fn side(&mut self, at: &At<SideText>, direction: usize, name: &str) -> BoundarySide {
        match &at.value {
            SideText::NoSlip => BoundarySide::NoSlip,
            SideText::Slip => BoundarySide::Slip,
            SideText::Periodic => BoundarySide::Periodic,
            SideText::Outflow => BoundarySide::Outflow,
            SideText::Moving(moving) => {
                let velocity = self.values.required_vector::<Velocity>(moving.velocity.as_ref(), &at.span, "velocity");
                if velocity[direction].abs() > 0.0 {
                    self.values
                        .report
                        .error(at.span.clone(), format!("the wall {name} moves out of its plane"))
                        .label(format!("its velocity along x{} has to be zero", direction + 1))
                        .help("use `inflow` for a side that fluid comes through");
                }
                BoundarySide::Moving { velocity }
            }
            SideText::Inflow(inflow) => BoundarySide::Inflow {
                velocity: self.values.required_vector::<Velocity>(inflow.velocity.as_ref(), &at.span, "velocity"),
                fluid: self.values.choice(inflow.fluid.as_ref(), "fluid", FluidName::Liquid),
            },
            SideText::FixedPressure(fixed) => BoundarySide::FixedPressure {
                pressure: self.values.quantity::<Pressure>(fixed.pressure.as_ref(), "pressure", Range1::Any, 0.0),
                fluid: self.values.choice(fixed.fluid.as_ref(), "fluid", FluidName::Gas),
            },
        }
    }

    pub(super) fn gravity(&mut self, text: &CaseText, until: Real) -> (Vector, Option<Frame>) {
        let gravity = match self.values.scalar_or_vector::<Acceleration>(text.gravity.as_ref(), "gravity") {
            None => Vector::new(0.0, 0.0, -9.8),
            Some(Ok(vector)) => vector,
            Some(Err(magnitude)) => {
                if magnitude < 0.0
                    && let Some(written) = &text.gravity
                {
                    self.values
                        .report
                        .error(written.item.span.clone(), "a magnitude of gravity must not be negative")
                        .label("a single value points down x3 by itself")
                        .help("leave out the minus sign, or give three components");
                }
                Vector::new(0.0, 0.0, if magnitude == 0.0 { 0.0 } else { -magnitude })
            }
        };
        let moved = text.frame.as_ref().map(|at| self.motion(&at.value, until));
        let frame = text.frame.as_ref().zip(moved).map(|(At { value, .. }, (motion, walls))| Frame {
            motion,
            walls,
            acceleration: self
                .values
                .vector::<Acceleration>(value.acceleration.as_ref(), "acceleration")
                .unwrap_or(Vector::ZERO),
            oscillation: value.oscillation.as_ref().map(|At { value, span }| Oscillation {
                amplitude: self.values.required_vector::<Acceleration>(value.amplitude.as_ref(), span, "amplitude"),
                frequency: self.values.required::<Frequency>(
                    value.frequency.as_ref(),
                    span,
                    "frequency",
                    Range1::Positive,
                ),
                phase: self.values.quantity::<Angle>(value.phase.as_ref(), "phase", Range1::Any, 0.0),
            }),
        });
        (gravity, frame)
    }

    pub(super) fn fluids(&mut self, text: &CaseText) -> Fluids {
        let written = text.fluid.as_ref().map(|at| &at.value);
        let liquid = self.properties(written.and_then(|f| f.liquid.as_ref()), WATER);
        let gas = self.properties(written.and_then(|f| f.gas.as_ref()), AIR);
        Fluids { liquid, gas }
    }

    fn properties(&mut self, written: Option<&At<PropertiesText>>, default: [Real; 2]) -> Fluid {
        let Some(At { value, span }) = written else {
            return Fluid { density: default[0], viscosity: default[0] * default[1] };
        };
        let density = self.values.required::<Density>(value.density.as_ref(), span, "density", Range1::Positive);
        let kinematic = self.values.optional::<KinematicViscosity>(
            value.kinematic_viscosity.as_ref(),
            "kinematic_viscosity",
            Range1::NonNegative,
        );
        let dynamic = self.values.optional::<DynamicViscosity>(
            value.dynamic_viscosity.as_ref(),
            "dynamic_viscosity",
            Range1::NonNegative,
        );
        let viscosity = match (kinematic, dynamic) {
            (Some(_), Some(_)) => {
                self.values
                    .report
                    .error(span.clone(), "a fluid has one viscosity")
                    .label("this one has two")
                    .help("keep `kinematic_viscosity` or `dynamic_viscosity`");
                Real::NAN
            }
            (Some(kinematic), None) => density * kinematic,
            (None, Some(dynamic)) => dynamic,
            (None, None) => {
                self.values.missing(Some(span), "kinematic_viscosity", "add `kinematic_viscosity = \"1e-6 m^2/s\"`");
                Real::NAN
            }
        };
        Fluid { density, viscosity }
    }

    pub(super) fn fluid_options(&mut self, text: &CaseText, domain: &BoxDomain, gravity: Vector) -> FluidOptions {
        let empty = FluidText::default();
        let written = text.fluid.as_ref().map_or(&empty, |at| &at.value);
        let defaults = self.defaults;
        let step = self.step(text, written, domain, gravity);
        let values = &mut self.values;
        let projection = values.choice(written.projection.as_ref(), "projection", defaults.projection);
        let viscosity = match projection {
            Projection::Full => ViscosityScheme::Implicit,
            Projection::Incremental => ViscosityScheme::CrankNicolson,
        };
        let options = FluidOptions {
            vof: values.choice(written.vof.as_ref(), "vof", defaults.vof),
            convection: values.choice(written.convection.as_ref(), "convection", defaults.convection),
            limiter: values.choice(written.limiter.as_ref(), "limiter", Limiter::VanLeer),
            projection,
            viscosity: values.choice(written.viscosity.as_ref(), "viscosity", viscosity),
            step,
            cfl: values.number(written.cfl.as_ref(), "cfl", Range1::Between(1e-3, 0.499), 0.45),
            divergence_tolerance: values.number(
                written.tol_div.as_ref(),
                "tol_div",
                Range1::Between(1e-15, 1e-2),
                1e-6,
            ),
            pressure_iterations: values
                .whole(written.pressure_iterations.as_ref(), "pressure_iterations", 1)
                .unwrap_or(500),
        };
        if options.convection == Convection::VelocityForm && options.limiter == Limiter::None {
            let span = written.limiter.as_ref().map_or(0..0, |limiter| limiter.item.span.clone());
            values
                .report
                .warning(Some(span), "velocity form without a limiter oscillates at interfaces")
                .label("meant for smooth flow only");
        }
        options
    }

    fn step(&mut self, text: &CaseText, written: &FluidText, domain: &BoxDomain, gravity: Vector) -> Step {
        let fixed = self.values.optional::<Time>(written.dt.as_ref(), "dt", Range1::Positive);
        let longest = self.values.optional::<Time>(written.dt_max.as_ref(), "dt_max", Range1::Positive);
        let first = self.values.optional::<Time>(written.dt_first.as_ref(), "dt_first", Range1::Positive);
        let growth = self.values.optional_number(written.dt_growth.as_ref(), "dt_growth", Range1::Between(1.0, 10.0));
        let adaptive = longest.is_some() || first.is_some() || growth.is_some();
        if fixed.is_some() && adaptive {
            let span = text.fluid.as_ref().map_or(0..0, |at| at.span.clone());
            self.values
                .report
                .error(span, "a fixed step has no limits of its own")
                .label("`dt` stands beside `dt_max`, `dt_first` or `dt_growth`")
                .help("leave out `dt` for a step that adapts");
        }
        if let Some(dt) = fixed.or(if adaptive { None } else { self.defaults.dt }) {
            return Step::Fixed(dt);
        }
        // Falling freely from rest for this long crosses a tenth of a cell.
        let fall = (0.2 * domain.spacing().min_element() / gravity.length()).sqrt();
        let longest = longest.unwrap_or(if fall.is_finite() { fall.min(1e-3) } else { 1e-3 });
        Step::Adaptive { longest, first: first.unwrap_or(longest), growth: growth.unwrap_or(1.2) }
    }

    pub(super) fn coupling(&mut self, text: &CaseText) -> Coupling {
        let empty = CouplingText::default();
        let written = text.coupling.as_ref().map_or(&empty, |at| &at.value);
        const EXPECTED: &str = "\"columns(4)\", \"subcell(4)\" or \"clip\"";
        let alpha = match self.values.call(written.alpha.as_ref(), "alpha", EXPECTED) {
            None => self.defaults.alpha,
            Some(("columns", Some(n @ 1..=64))) => AlphaMethod::Columns(n as u8),
            Some(("subcell", Some(n @ 1..=64))) => AlphaMethod::SubCells(n as u8),
            Some(("clip", None)) => AlphaMethod::Clip,
            Some(_) => {
                let span = written.alpha.as_ref().map_or(0..0, |call| call.0.span.clone());
                self.values
                    .report
                    .error(span, "no such evaluator of volume fractions")
                    .label(format!("expected {EXPECTED}"))
                    .help("the count is per cell edge, 1 to 64");
                self.defaults.alpha
            }
        };
        Coupling {
            exchange: self.values.choice(written.exchange.as_ref(), "exchange", self.defaults.exchange),
            weighting: self.values.choice(written.weighting.as_ref(), "weighting", Weighting::Mass),
            alpha,
            torque_arm: self.values.choice(written.torque_arm.as_ref(), "torque_arm", TorqueArm::Centroid),
        }
    }
}
