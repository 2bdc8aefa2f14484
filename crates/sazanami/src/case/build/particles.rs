//! Water as moving particles and the shaking of its tank.

use sazanami_io::readings::Readings;
use sazanami_mps::stability::COURANT;
use sazanami_numerics::Real;
use sazanami_numerics::spline::Spline;

use super::flow::span_of_side;
use super::{Context, span_of};
use crate::case::meaning::{
    Axis, BoundarySide, BoxDomain, Case, DensityReference, FluidName, GradientForm, GrainPlacement, GrainShape,
    KeepApart, Order, Overlap, Particles, Population, Preparation, PressureForce, ProbePlace, SIDE_NAMES, Solver,
    SphereDrag, TankMotion, WallMotion, Wendland,
};
use crate::case::schema::{CaseText, FrameText, MotionText, OverlapText, ParticlesText, PreparationText};
use crate::case::units::{rounded, rounded_within};
use crate::case::value::Range1;
use crate::case::written::{Angle, At, Frequency, Length, Text, Time, Velocity};
use crate::check::number;

/// Range of the radius of influence over the particle spacing in which the lattice sums are what they should be.
const RADII: [Real; 2] = [2.1, 3.6];
/// Radius of influence over the particle spacing.
const RADIUS: Real = 3.1;
/// Longest step [s].
const LONGEST: Real = 2e-4;
/// Largest part of (r_e/2)^2 by which particles are shifted: with twice as much vortices gain energy.
const SHIFTING: Real = 0.5;
/// Largest grain over the smallest edge of its tank.
const LARGEST_GRAIN: Real = 0.25;
/// Least density of grains over that of the liquid with a pressure force of the step before: `1.2 (1 - eps)/eps` in a
/// bed of void fraction 0.4.
const LAGGED_LEAST: Real = 1.8;

/// Amplification of waves from which on a tank is near resonance.
const RESONANT: Real = 4.0;

/// Smoothing of the void fraction over the mean diameter, and over the largest.
const SMOOTHING: [Real; 2] = [3.0, 2.5];

impl Context<'_> {
    pub(super) fn particles(
        &mut self,
        text: &CaseText,
        solver: Solver,
        domain: &mut BoxDomain,
        grains: &[Population],
    ) -> Option<Particles> {
        let empty = At { value: ParticlesText::default(), span: 0..0 };
        let At { value, span } = match &text.particles {
            Some(written) => written,
            None if solver == Solver::Mps => {
                self.values.missing(None, "particles", "add `[particles]` with `spacing = \"1 mm\"`");
                &empty
            }
            None => return None,
        };
        let has_bed = grains.iter().any(|p| matches!(p.placement, GrainPlacement::Packed(_) | GrainPlacement::Bed(_)));
        let overlap = self.overlap(text, grains);
        let preparation = self.preparation(text, has_bed);
        let reduced = self.defaults.reduced_pressure;
        let values = &mut self.values;
        let number = |values: &mut crate::case::value::Values, written, key: &str, range, default| {
            values.number(written, key, range, default)
        };
        if text.particles.is_some() && value.spacing.is_none() {
            values.missing(Some(span), "spacing", "add `spacing = \"1 mm\"`");
        }
        let spacing =
            values.optional::<Length>(value.spacing.as_ref(), "spacing", Range1::Positive).unwrap_or(Real::NAN);
        let particles = Particles {
            spacing,
            radius: number(values, value.radius.as_ref(), "radius", Range1::Between(RADII[0], RADII[1]), RADIUS),
            weight: values.choice(value.weight.as_ref(), "weight", Wendland::C2),
            source: values.choice(value.source.as_ref(), "source", Order::HigherOrder),
            laplacian: values.choice(value.laplacian.as_ref(), "laplacian", Order::HigherOrder),
            compensation: number(values, value.compensation.as_ref(), "compensation", Range1::Between(0.0, 10.0), 1.0),
            relaxation: number(values, value.relaxation.as_ref(), "relaxation", Range1::NonNegative, 100.0),
            gradient: values.choice(value.gradient.as_ref(), "gradient", GradientForm::Corrected),
            stabilisation: values.choice(value.stabilisation.as_ref(), "stabilisation", KeepApart::Weighted),
            stabilisation_distance: number(
                values,
                value.stabilisation_distance.as_ref(),
                "stabilisation_distance",
                Range1::Between(0.5, 1.0),
                0.95,
            ),
            shifting: number(values, value.shifting.as_ref(), "shifting", Range1::Between(0.0, SHIFTING), 0.0),
            reduced_pressure: values.flag(value.reduced_pressure.as_ref(), "reduced_pressure", reduced),
            courant: number(values, value.courant.as_ref(), "courant", Range1::Between(1e-3, 0.5), COURANT),
            dt: values.optional::<Time>(value.dt.as_ref(), "dt", Range1::Positive),
            dt_max: values.quantity::<Time>(value.dt_max.as_ref(), "dt_max", Range1::Positive, LONGEST),
            tolerance: number(values, value.tolerance.as_ref(), "tolerance", Range1::Between(1e-15, 1e-2), 1e-6),
            pressure_iterations: values
                .whole(value.pressure_iterations.as_ref(), "pressure_iterations", 1)
                .unwrap_or(500),
            overlap,
            preparation,
        };
        if domain.cells == [0; 3] && spacing > 0.0 {
            let extent = domain.extent();
            domain.cells = [0, 1, 2].map(|d| ((extent[d] / spacing).round() as usize).max(1));
        }
        Some(particles)
    }

    fn overlap(&mut self, text: &CaseText, grains: &[Population]) -> Overlap {
        let empty = OverlapText::default();
        let (written, span) = text.overlap.as_ref().map_or((&empty, 0..0), |at| (&at.value, at.span.clone()));
        let sizes = |factor: fn(&Population) -> Real| {
            grains.iter().filter_map(move |p| p.shape.size().map(|d| d * factor(p))).collect::<Vec<Real>>()
        };
        let means = sizes(|p| p.size.mean());
        let largest = sizes(|p| p.size.largest()).into_iter().fold(0.0, Real::max);
        let mean = if means.is_empty() { 0.0 } else { means.iter().sum::<Real>() / means.len() as Real };
        let smoothing = (SMOOTHING[0] * mean).max(SMOOTHING[1] * largest);
        let values = &mut self.values;
        let blend = values.numbers::<2>(written.blend.as_ref(), "blend").unwrap_or(self.defaults.blend);
        if blend.iter().all(|value| value.is_finite()) && !(0.0..=blend[1]).contains(&blend[0]) {
            values
                .report
                .error(
                    written.blend.as_ref().map_or(span, |blend| blend.0.span.clone()),
                    "`blend` is a lower and an upper solid number density",
                )
                .label(format!("[{}, {}]", blend[0], blend[1]))
                .help("for example `blend = [0.38, 0.42]`, or `[0.4, 0.4]` for a switch");
        }
        Overlap {
            smoothing: values.quantity::<Length>(
                written.smoothing.as_ref(),
                "smoothing",
                Range1::Positive,
                if smoothing > 0.0 { smoothing } else { 1.0 },
            ),
            least_void: values.number(written.least_void.as_ref(), "least_void", Range1::Between(0.05, 1.0), 0.3),
            pressure_force: values.choice(written.pressure_force.as_ref(), "pressure_force", PressureForce::Implicit),
            kozeny: values.number(written.kozeny.as_ref(), "kozeny", Range1::NonNegative, 150.0),
            forchheimer: values.optional_number(written.forchheimer.as_ref(), "forchheimer", Range1::NonNegative),
            sphere_drag: values.choice(written.sphere_drag.as_ref(), "sphere_drag", SphereDrag::SchillerNaumann),
            density_reference: values.choice(
                written.density_reference.as_ref(),
                "density_reference",
                DensityReference::SimpleCubic,
            ),
            blend,
        }
    }

    fn preparation(&mut self, text: &CaseText, has_bed: bool) -> Preparation {
        let empty = PreparationText::default();
        let written = text.preparation.as_ref().map_or(&empty, |at| &at.value);
        let state = self.path(written.state.as_ref(), "state");
        let values = &mut self.values;
        if let (Some(state), Some(text)) = (&state, &written.state)
            && !state.is_file()
        {
            values
                .report
                .error(span_of(text), format!("there is no file `{}`", state.display()))
                .label("file not found")
                .help("leave out `state`: the bed is made ready before the run, and the state is kept");
        }
        let (steps, settle) = if has_bed { (500, 0.2) } else { (0, 0.0) };
        Preparation {
            relax_steps: values.whole(written.relax_steps.as_ref(), "relax_steps", 0).unwrap_or(steps),
            damping: values.number(written.damping.as_ref(), "damping", Range1::Between(0.0, 1.0), 0.9),
            strain: values.number(written.strain.as_ref(), "strain", Range1::Positive, 0.01),
            speed: values.quantity::<Velocity>(written.speed.as_ref(), "speed", Range1::Positive, 1e-3),
            settle: values.quantity::<Time>(written.settle.as_ref(), "settle", Range1::NonNegative, settle),
            state,
            cache: values.flag(written.cache.as_ref(), "cache", true),
        }
    }

    pub(super) fn motion(&mut self, frame: &FrameText, until: Real) -> (Option<TankMotion>, WallMotion) {
        let Some(At { value, span }) = &frame.motion else { return (None, WallMotion::AtRest) };
        let walls = self.values.choice(value.walls.as_ref(), "walls", WallMotion::AtRest);
        let formula = value.amplitude.is_some() || value.frequency.is_some();
        if formula == value.file.is_some() {
            self.values
                .report
                .error(span.clone(), "a motion is given by a formula or by a file")
                .label(if formula { "this has both" } else { "this has neither" })
                .help("give `amplitude = [\"-10 mm\", \"0 mm\", \"0 mm\"]` and `frequency = \"2 Hz\"`, or `file`");
            return (None, walls);
        }
        if let Some(name) = &value.file {
            return (self.motion_from_file(name, value, until), walls);
        }
        let ramp = self.defaults.ramp;
        let values = &mut self.values;
        let frequency = values.required::<Frequency>(value.frequency.as_ref(), span, "frequency", Range1::Positive);
        let motion = TankMotion::Formula {
            amplitude: values.required_vector::<Length>(value.amplitude.as_ref(), span, "amplitude"),
            frequency,
            phase: values.quantity::<Angle>(value.phase.as_ref(), "phase", Range1::Any, 0.0),
            ramp: values.quantity::<Time>(value.ramp.as_ref(), "ramp", Range1::NonNegative, ramp / frequency),
        };
        (Some(motion), walls)
    }

    fn motion_from_file(&mut self, name: &Text, value: &MotionText, until: Real) -> Option<TankMotion> {
        let axis = self.values.choice(value.axis.as_ref(), "axis", Axis::X1);
        let file = self.path(Some(name), "file")?;
        let curve = match Readings::read(&file, &["t_s", "x_m"], 2) {
            Ok(readings) => Spline::through(readings.column(0), readings.column(1)),
            Err(problem) => {
                self.values
                    .report
                    .error(span_of(name), "the motion of the tank cannot be read")
                    .label(problem.to_string())
                    .help("a CSV file with a line `t_s,x_m` and a row of numbers for each time, times increasing");
                return None;
            }
        }?;
        if curve.range()[0] > 0.0 {
            self.values
                .report
                .error(span_of(name), "the motion of the tank begins after the run")
                .label(format!("its first time is {} s", rounded(curve.range()[0])))
                .help("add a row at time 0");
        }
        Some(TankMotion::recorded(file, axis, curve, until))
    }

    /// What has to fit together for moving particles.
    pub(super) fn check_particles(&mut self, text: &CaseText, case: &Case) {
        if case.solver == Solver::Mics {
            for (population, at) in case.grains.iter().zip(&text.grains) {
                if let GrainPlacement::Packed(how) = &population.placement
                    && (how.level.is_some() || how.glued.is_some())
                {
                    self.values
                        .report
                        .error(at.span.clone(), "beds are levelled and glued for `solver = \"mps\"`")
                        .label("this case has `solver = \"mics\"`")
                        .help("give a `count` instead of `level`, and leave out `glued`");
                }
            }
            if case.walls_move() {
                let span = text.frame.as_ref().map_or(0..0, |at| at.span.clone());
                self.values
                    .report
                    .error(span, "the walls of a grid cannot move as a whole")
                    .label("`walls = \"moving\"` is for `solver = \"mps\"`")
                    .help("leave out `walls`: the fluid feels the acceleration of the tank");
            }
            if let Some(at) = &text.ripples {
                self.values
                    .report
                    .error(at.span.clone(), "ripples are observed with `solver = \"mps\"`")
                    .label("this case has `solver = \"mics\"`");
            }
            return;
        }
        let Some(particles) = &case.particles else { return };
        self.check_sides(text, case);
        self.check_spheres(text, case);
        self.check_light_grains(text, case);
        self.warn_of_glued_beds(text, case);
        self.check_smoothing(text, case);
        self.check_lattice(text, case, particles);
        self.warn_of_waves(text, case);
        if let (Some(TankMotion::File { curve, .. }), Some(at)) =
            (case.frame.as_ref().and_then(|frame| frame.motion.as_ref()), &text.frame)
            && curve.range()[1] < case.run.until * (1.0 - 1e-9)
        {
            self.values
                .report
                .error(at.span.clone(), "the motion of the tank ends before the run")
                .label(format!("its last time is {} s, the run ends at {} s", curve.range()[1], case.run.until))
                .help("add rows, or end the run before");
        }
        self.warn_of_levelled_probes(text, case);
        let planes = case.probes.iter().zip(&text.probe);
        for (_, at) in planes.filter(|(probe, _)| matches!(probe.place, ProbePlace::Plane { .. })) {
            self.values
                .report
                .error(at.span.clone(), "a plane is no probe among moving particles")
                .label("fluxes through a plane are for `solver = \"mics\"`")
                .help("use a `line` of points");
        }
        if let Some(at) = &text.erosion {
            self.values
                .report
                .error(at.span.clone(), "craters are observed with `solver = \"mics\"`")
                .label("this case has `solver = \"mps\"`");
        }
    }

    /// Waves that a shaken tank makes, and that linear theory or the particles cannot follow.
    fn warn_of_waves(&mut self, text: &CaseText, case: &Case) {
        let Some(tank) = crate::check::tank(case) else { return };
        let Some(frame) = &text.frame else { return };
        let span = frame.value.motion.as_ref().map_or(frame.span.clone(), |at| at.span.clone());
        let mut warn = |title: &str, label: String| {
            self.values.report.warning(Some(span.clone()), title).label(label);
        };
        if tank.amplification > RESONANT {
            warn(
                "the tank is near resonance",
                format!(
                    "1/cos(kL/2) = {}: expect breaking waves and bores; with this depth and frequency L = {} mm \
                     and {} mm have 1",
                    number(tank.amplification, 1),
                    number(1e3 * tank.wavelength_m, 0),
                    number(2e3 * tank.wavelength_m, 0)
                ),
            );
        }
        if tank.end_elevation > 1.0 {
            warn(
                "the tank dries at its ends",
                format!("by linear theory the water falls there by {} times its depth", number(tank.end_elevation, 2)),
            );
        }
        if let Some(particles) = case.particles.as_ref().filter(|particles| tank.stokes_layer_m < particles.spacing) {
            warn(
                "the boundary layer on the bed is thinner than a particle",
                format!(
                    "{:.2} mm, the particle spacing {:.2} mm: near the bed the drag law carries the shear",
                    1e3 * tank.stokes_layer_m,
                    1e3 * particles.spacing
                ),
            );
        }
    }

    /// Sides that moving particles know: walls, periodic ones, and open ones.
    fn check_sides(&mut self, text: &CaseText, case: &Case) {
        for (d, upper) in (0..3).flat_map(|d| [(d, 0), (d, 1)]) {
            let (name, span) = (SIDE_NAMES[d][upper], span_of_side(text, d, upper));
            match case.boundary[d][upper] {
                BoundarySide::Inflow { .. } | BoundarySide::Moving { .. } => self
                    .values
                    .report
                    .error_at(span, format!("moving particles cannot have the side {name}"))
                    .label("walls, periodic and open sides are possible")
                    .help("use \"no_slip\", \"slip\", \"periodic\" or \"outflow\""),
                BoundarySide::FixedPressure { pressure, fluid } if pressure != 0.0 || fluid == FluidName::Liquid => {
                    self.values
                        .report
                        .error_at(span, format!("moving particles leave through the side {name}, and none come in"))
                        .label("beyond an open side there is air at pressure zero")
                        .help("write \"outflow\"")
                }
                _ => continue,
            };
        }
        let span = text.boundary.as_ref().map_or(0..0, |at| at.span.clone());
        let any = |wanted: BoundarySide| case.boundary.iter().flatten().any(|side| *side == wanted);
        if any(BoundarySide::NoSlip) && any(BoundarySide::Slip) {
            self.values
                .report
                .error(span, "walls of moving particles are all alike")
                .label("some of these hold the fluid, others do not")
                .help("choose \"no_slip\" or \"slip\" for all walls");
        }
    }

    /// Overlapping grains are spheres, small against their tank.
    fn check_spheres(&mut self, text: &CaseText, case: &Case) {
        if case.boundary[2][0] == BoundarySide::Periodic
            && let Some(at) = text.grains.first()
        {
            self.values
                .report
                .error(at.span.clone(), "grains need a floor: x3 is periodic")
                .label("they would fall without end")
                .help("make x3 a wall, or leave the grains out");
        }
        let smallest = case.domain.extent().min_element();
        for (population, at) in case.grains.iter().zip(&text.grains) {
            let span = at.value.shape.as_ref().map_or(at.span.clone(), |shape| shape.span.clone());
            let GrainShape::Sphere { diameter, .. } = population.shape else {
                self.values
                    .report
                    .error(span, format!("`{}` is no sphere", population.name))
                    .label("grains that water overlaps are spheres")
                    .help("write `shape.sphere = { diameter = \"1 mm\" }`, or `solver = \"mics\"` for grains of any shape");
                continue;
            };
            let largest = diameter * population.size.largest();
            if largest > LARGEST_GRAIN * smallest {
                self.values
                    .report
                    .error(span, format!("`{}` is too large for its tank", population.name))
                    .label(format!(
                        "up to {:.4} mm, more than a quarter of the shortest edge, {:.4} mm",
                        1e3 * largest,
                        1e3 * smallest
                    ))
                    .help("make the tank wider or the grains smaller");
            }
        }
    }

    /// The void fraction is smoothed over several grains, and over no more than one image of each beyond a side.
    fn check_smoothing(&mut self, text: &CaseText, case: &Case) {
        let largest = case.grains.iter().filter_map(|p| Some(p.shape.size()? * p.size.largest())).reduce(Real::max);
        let (Some(particles), Some(largest)) = (&case.particles, largest) else { return };
        let (smoothing, wide) = (particles.overlap.smoothing, SMOOTHING[1] * largest);
        let written = text.overlap.as_ref().and_then(|at| at.value.smoothing.as_ref());
        let span = written.map(|smoothing| smoothing.item.span.clone());
        let open = |side: &BoundarySide| matches!(side, BoundarySide::Outflow | BoundarySide::FixedPressure { .. });
        let edges = (0..3).filter(|&d| !case.boundary[d].iter().any(open)).map(|d| case.domain.extent()[d]);
        let edge = edges.fold(Real::INFINITY, Real::min);
        let millimetres = |length: Real| rounded(1e3 * length);
        let [least, _] = rounded_within(1e3 * wide, Real::INFINITY);
        if smoothing > edge {
            let suited = SMOOTHING[0] * largest;
            let help = if suited <= edge {
                format!("{} mm, three grain sizes, suit these grains", millimetres(suited))
            } else {
                "make the tank wider or the grains smaller".to_owned()
            };
            self.values
                .report
                .error_at(span, "`smoothing` is longer than the tank between two sides")
                .label(format!("{} mm, the edge {} mm", millimetres(smoothing), millimetres(edge)))
                .help(help);
        } else if smoothing < largest {
            self.values
                .report
                .error_at(span, "`smoothing` is smaller than a grain")
                .label("water between grains does not see them, water within one sees nothing else")
                .help(format!("take {least} mm at least, 2.5 times the largest grain"));
        } else if smoothing < wide * (1.0 - 1e-9) {
            self.values
                .report
                .warning(span, "`smoothing` is short: one grain passes for a dense bed where it lies")
                .label(format!("{} times the largest grain", rounded(smoothing / largest)))
                .help(format!("take {least} mm at least, 2.5 times the largest grain"));
        }
    }

    /// A grain that is taken away when its bed is levelled has nothing to be watched.
    fn warn_of_levelled_probes(&mut self, text: &CaseText, case: &Case) {
        for (probe, at) in case.probes.iter().zip(&text.probe) {
            let ProbePlace::Body { population: name, index } = &probe.place else { continue };
            let Some(population) = case.grains.iter().find(|population| population.name == *name) else { continue };
            let Some(left) = crate::check::levelled(case, population).filter(|left| index >= left) else { continue };
            let span = at.value.body.as_ref().map_or(at.span.clone(), |body| body.span.clone());
            self.values
                .report
                .warning(Some(span), format!("grain {index} of `{name}` may be taken away when the bed is levelled"))
                .label("its rows would then be empty")
                .help(format!("about {left} grains stay, as a rule those of the smallest numbers"));
        }
    }

    /// A bed of which every grain is glued to the floor does not move.
    fn warn_of_glued_beds(&mut self, text: &CaseText, case: &Case) {
        for (population, at) in case.grains.iter().zip(&text.grains) {
            let GrainPlacement::Packed(how) = &population.placement else { continue };
            let radius = 0.5 * population.shape.size().unwrap_or(0.0) * population.size.smallest();
            let (Some(glued), Some(level)) = (how.glued, how.level) else { continue };
            if glued > level - radius {
                let span = at.value.placement.as_ref().map_or(at.span.clone(), |placement| placement.span.clone());
                self.values
                    .report
                    .warning(Some(span), format!("every grain of `{}` is glued to the floor", population.name))
                    .label(format!("up to {} mm, the bed is {} mm high", rounded(1e3 * glued), rounded(1e3 * level)))
                    .help("lower `glued`: three quarters of a grain size hold the lowest layer");
            }
        }
    }

    /// A pressure force of the step before grows from step to step where grains have too little inertia.
    fn check_light_grains(&mut self, text: &CaseText, case: &Case) {
        if case.particles.as_ref().is_none_or(|p| p.overlap.pressure_force == PressureForce::Implicit) {
            return;
        }
        let liquid = case.fluids.liquid.density;
        for (population, at) in case.grains.iter().zip(&text.grains) {
            let by_volume = population.shape.volume().zip(population.mass_override).map(|(volume, mass)| mass / volume);
            let density = by_volume.or_else(|| case.material(&population.material).map(|material| material.density));
            if let Some(density) = density.filter(|density| *density < LAGGED_LEAST * liquid) {
                self.values
                    .report
                    .error(at.span.clone(), format!("`{}` is too light for a lagged pressure force", population.name))
                    .label(format!(
                        "{:.2} times as heavy as the liquid; it has to be {LAGGED_LEAST} times at least",
                        density / liquid
                    ))
                    .help("leave out `pressure_force = \"lagged\"`");
            }
        }
    }

    /// The tank fits the lattice of its walls and is longer than what a particle looks at; the water fits into it.
    fn check_lattice(&mut self, text: &CaseText, case: &Case, particles: &Particles) {
        let span = text.domain.as_ref().map_or(0..0, |at| at.span.clone());
        let reach = particles.radius * particles.spacing;
        let extent = case.domain.extent();
        for d in 0..3 {
            let periodic = case.boundary[d][0] == BoundarySide::Periodic;
            let needed = if periodic { 2.0 * reach } else { reach };
            if extent[d] < needed {
                self.values
                    .report
                    .error(span.clone(), format!("the tank is shorter along x{} than what a particle looks at", d + 1))
                    .label(format!("{:.4} mm; it has to be {:.4} mm at least", 1e3 * extent[d], 1e3 * needed))
                    .help("make the tank longer or the particles smaller");
                continue;
            }
            let tank = crate::assembly::particles::tank(case);
            if let Err(problem) = tank.lattice(particles.spacing)
                && problem.direction == d
            {
                self.values
                    .report
                    .error(span.clone(), format!("no lattice of wall particles fits the tank along x{}", d + 1))
                    .label(problem.to_string())
                    .help(format!(
                        "make this edge a multiple of the particle spacing, such as {:.4} mm",
                        1e3 * (extent[d] / particles.spacing).round() * particles.spacing
                    ));
            }
        }
        for (liquid, at) in case.liquids.iter().zip(&text.liquid) {
            let crate::case::meaning::Placement::Absolute(position) = liquid.placement else { continue };
            let top = position.z + liquid.region.heights()[1];
            if top.is_finite() && top > case.domain.upper.z + 1e-9 * extent.z {
                self.values
                    .report
                    .error(at.span.clone(), format!("`{}` is deeper than the tank", liquid.name))
                    .label(format!(
                        "it reaches up to {:.4} mm, the tank to {:.4} mm",
                        1e3 * top,
                        1e3 * case.domain.upper.z
                    ))
                    .help("make the tank higher or the water shallower");
            }
        }
    }
}
