//! One step of gas, liquid and grains.

use std::sync::Arc;

use sazanami_dem::{ContactReport, DemError, Engine};
use sazanami_numerics::domain::{Domain, FailedElsewhere};
use sazanami_numerics::geometry::Shape;
use sazanami_numerics::grid::Field;
use sazanami_numerics::{Real, Vector};

use crate::boundary::Boundary;
use crate::flow::{Flow, TransportReport};
use crate::grains::{Coupling, GrainPhase, ImprintReport};
use crate::momentum::{MomentumImpulses, MomentumStock};
use crate::pressure::{PressureError, PressureReport, Projection, Tolerance};
use crate::stability::{Rates, Step, StepLimits};
use crate::viscosity::{DiffusionReport, ViscosityError};

/// A step could not be completed.
#[derive(Clone, Debug, thiserror::Error)]
pub enum StepError {
    /// The pressure equation was not solved.
    #[error(transparent)]
    Pressure(#[from] PressureError),
    /// The viscous equation was not solved.
    #[error(transparent)]
    Viscosity(#[from] ViscosityError),
    /// A grain went wrong.
    #[error(transparent)]
    Grains(#[from] DemError),
    /// A field holds a number that is not finite.
    #[error(
        "the {field} is not finite in cell ({}, {}, {}) at ({:.4e}, {:.4e}, {:.4e}) m",
        cell[0], cell[1], cell[2], position.x, position.y, position.z
    )]
    NotFinite {
        /// Name of the field.
        field: &'static str,
        /// Global indices of the first such cell of the rank.
        cell: [usize; 3],
        /// Its centre [m].
        position: Vector,
    },
    /// Another rank failed.
    #[error(transparent)]
    Elsewhere(#[from] FailedElsewhere),
}

/// What a step did.
#[derive(Clone, Debug, Default)]
pub struct StepReport {
    /// Fluid passes.
    pub fluid_passes: usize,
    /// Transport, summed over the passes.
    pub transport: TransportReport,
    /// Viscosity, summed over the passes.
    pub diffusion: DiffusionReport,
    /// Pressure: iterations summed, the worst of the rest over the passes.
    pub pressure: PressureReport,
    /// Largest advective Courant number of a pass.
    pub courant: Real,
    /// Contacts.
    pub contacts: ContactReport,
    /// Imprint.
    pub imprint: ImprintReport,
    /// Impulses, over all ranks.
    pub impulses: MomentumImpulses,
}

/// How the fluid and the step are computed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Settings {
    /// Gravity [m/s^2].
    pub gravity: Vector,
    /// Limits of the step.
    pub limits: StepLimits,
    /// Accuracy of the projection.
    pub tolerance: Tolerance,
    /// Whether the predictor carries the old pressure and the projection its increment: second
    /// order in time for a single fluid.
    pub incremental: bool,
}

/// A phase of the step, for whoever measures it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Phase {
    /// Transport, viscosity and face velocities.
    Fluid,
    /// Projection.
    Pressure,
    /// Contacts and motion of the grains.
    Grains,
    /// Loads, imprint, exchange.
    Coupling,
}

/// Flow, interface and grains on one rank.
pub struct Solver {
    pub(crate) domain: Domain,
    pub(crate) boundary: Boundary,
    pub(crate) settings: Settings,
    pub(crate) flow: Flow,
    pub(crate) projection: Projection,
    pub(crate) grains: GrainPhase,
    /// Length that the limits gave the last step, before an output shortened it [s].
    pub(crate) previous_step: Option<Real>,
}

impl Solver {
    /// Puts the parts together and makes the flow free of divergence, without transport.
    ///
    /// # Errors
    /// [`StepError`] if the projection fails.
    pub fn new(
        domain: Domain,
        boundary: Boundary,
        settings: Settings,
        mut flow: Flow,
        engine: Engine,
        shapes: Arc<[Shape]>,
        coupling: Coupling,
    ) -> Result<Self, StepError> {
        let mut projection = Projection::new(&domain, boundary.pressure_sides());
        let mut grains = GrainPhase::new(&domain, engine, shapes, coupling);
        flow.fill_halos(&domain, &boundary);
        // A short step without gravity: only the divergence of the initial velocity matters.
        let dt = settings.limits.longest;
        flow.predict_faces(&domain, &boundary, Vector::ZERO, dt);
        let Flow { density, velocity, face_velocity, .. } = &mut flow;
        projection.project(&domain, density, velocity, face_velocity, Vector::ZERO, dt, &settings.tolerance)?;
        flow.fill_halos(&domain, &boundary);
        grains.open_accounts(&domain, &flow.velocity, &flow.density);
        Ok(Self { domain, boundary, settings, flow, projection, grains, previous_step: None })
    }

    /// Makes the first step no longer than `first` [s], if it is given.
    pub fn begin_with(&mut self, first: Option<Real>) {
        self.previous_step = first.map(|first| first / self.settings.limits.growth);
    }

    /// The longest stable next step, what limits it and in how many passes the fluid takes it.
    #[must_use]
    pub fn stable_step(&self) -> Step {
        let rates = Rates {
            advective: self.flow.advective_rate(&self.domain),
            viscous: self.flow.viscous_rate(&self.domain),
            grain_motion: self.grains.motion_rate(&self.domain),
            contact: self.grains.contact_rate(),
        };
        self.settings.limits.choose(&rates, self.previous_step)
    }

    /// Advances flow, interface and grains by `dt` [s], at most `step.dt`: transport, diffuse,
    /// project, load, move, imprint, exchange. `watch` is told when a phase begins.
    ///
    /// # Errors
    /// [`StepError`] names what went wrong and where; the state is then of no use.
    pub fn step(&mut self, step: Step, dt: Real, mut watch: impl FnMut(Phase)) -> Result<StepReport, StepError> {
        let Self { domain, boundary, settings, flow, projection, grains, .. } = self;
        let gravity = settings.gravity;
        let mut report = StepReport { fluid_passes: step.fluid_passes, ..StepReport::default() };
        let pass = dt / step.fluid_passes as Real;
        grains.clear_stress(domain);
        for _ in 0..step.fluid_passes {
            watch(Phase::Fluid);
            report.courant = report.courant.max(flow.advective_rate(domain) * pass);
            // The old pressure acts for half the transport's time: second order where it is asked for.
            let half = if settings.incremental { 0.5 * pass } else { 0.0 };
            projection.push(domain, &flow.density, &mut flow.velocity, -half);
            report.transport += flow.transport(domain, boundary, pass);
            projection.push(domain, &flow.density, &mut flow.velocity, half);
            report.diffusion += flow.diffuse(domain, boundary, pass)?;
            flow.predict_faces(domain, boundary, gravity, pass);
            report.impulses.gravity_on_fluid += flow.mass(domain) * gravity * pass;
            watch(Phase::Pressure);
            let Flow { density, velocity, face_velocity, .. } = flow;
            report.pressure +=
                projection.project(domain, density, velocity, face_velocity, gravity, pass, &settings.tolerance)?;
            watch(Phase::Coupling);
            let gradient = projection.gradient(&flow.density);
            grains.add_stress(domain, pass, |at| {
                flow.density.data()[at] * flow.viscous_acceleration(at, pass) - gradient.at(at)
            });
        }
        grains.load(domain, dt);
        watch(Phase::Grains);
        report.contacts = grains.advance(domain, gravity, dt)?;
        watch(Phase::Coupling);
        report.imprint = grains.imprint(domain);
        let exchanged = grains.exchange(domain, &mut flow.velocity, &flow.density, gravity, dt);
        report.impulses += exchanged;
        report.impulses.walls_on_fluid += report.diffusion.wall_impulse + report.pressure.wall_impulse;
        report.impulses.walls_on_grains -= report.contacts.impulse_on_walls;
        report.impulses.open_sides += report.transport.momentum_through;
        self.previous_step = Some(step.dt);
        self.check(&report)?;
        Ok(report)
    }

    /// Looks for numbers that are not finite, at the price of one reduction when all is well.
    fn check(&self, report: &StepReport) -> Result<(), StepError> {
        let energy = self.flow.kinetic_energy(&self.domain);
        if energy.is_finite() && report.pressure.divergence.is_finite() {
            return Ok(());
        }
        let [u1, u2, u3] = &self.flow.velocity;
        let named =
            [("liquid fraction", &self.flow.volume_fraction), ("velocity", u1), ("velocity", u2), ("velocity", u3)];
        let found = named.iter().find_map(|(field, values)| self.first_not_finite(values).map(|cell| (*field, cell)));
        self.domain.agree(found.map_or(Ok(()), |(field, cell)| {
            let [i, j, k] = cell.map(|n| n as isize);
            Err(StepError::NotFinite { field, cell, position: self.domain.grid().centre(i, j, k) })
        }))
    }

    fn first_not_finite(&self, field: &Field<Real>) -> Option<[usize; 3]> {
        let ([n1, n2, n3], start) = (self.domain.cells(), self.domain.start());
        (0..n3).flat_map(|k| (0..n2).flat_map(move |j| (0..n1).map(move |i| [i, j, k]))).find_map(|[i, j, k]| {
            let value = field[[i as isize, j as isize, k as isize]];
            (!value.is_finite()).then_some([i + start[0], j + start[1], k + start[2]])
        })
    }

    /// Fills the ghosts of the fields, for who looks at values between cells. The next step fills them anyway.
    pub fn fill_halos(&mut self) {
        self.flow.fill_halos(&self.domain, &self.boundary);
    }

    /// Momentum held by everything at present, over all ranks.
    #[must_use]
    pub fn momentum(&self) -> MomentumStock {
        let [liquid, gas] = self.flow.momentum(&self.domain);
        let [grains, displaced, owed] = self.grains.momentum(&self.domain);
        MomentumStock { liquid, gas, grains, displaced, owed }
    }

    /// Volume of liquid outside grains, over all ranks [m^3].
    #[must_use]
    pub fn wet_liquid_volume(&self) -> Real {
        self.flow.liquid_volume(&self.domain) - self.grains.swallowed_volume(&self.domain, &self.flow.volume_fraction)
    }

    /// This rank's part of the grid.
    #[must_use]
    pub fn domain(&self) -> &Domain {
        &self.domain
    }

    /// Sides of the box.
    #[must_use]
    pub fn boundary(&self) -> &Boundary {
        &self.boundary
    }

    /// How the fluid and the step are computed.
    #[must_use]
    pub fn settings(&self) -> &Settings {
        &self.settings
    }

    /// Changes gravity (a frame of reference that moves) [m/s^2].
    pub fn set_gravity(&mut self, gravity: Vector) {
        self.settings.gravity = gravity;
    }

    /// Liquid and gas.
    #[must_use]
    pub fn flow(&self) -> &Flow {
        &self.flow
    }

    /// Pressure [Pa].
    #[must_use]
    pub fn pressure(&self) -> &Field<Real> {
        self.projection.pressure()
    }

    /// The grains and their coupling.
    #[must_use]
    pub fn grains(&self) -> &GrainPhase {
        &self.grains
    }
}
