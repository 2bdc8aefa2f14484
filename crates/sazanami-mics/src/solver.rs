//! One step of gas, liquid and grains.

mod step;

use std::sync::Arc;

use sazanami_dem::{ContactReport, DemError, Engine, Grain};
use sazanami_numerics::domain::{Domain, FailedElsewhere, Row};
use sazanami_numerics::geometry::Shape;
use sazanami_numerics::grid::Field;
use sazanami_numerics::mean_flow::{MeanFlow, MeanFlowReport};
use sazanami_numerics::{Real, Vector};

use crate::acceleration::Acceleration;
use crate::boundary::Boundary;
use crate::carrying::CarryingFlow;
use crate::flow::Flow;
use crate::grains::room::Room;
use crate::grains::{Coupling, ImprintReport, ResolvedGrains};
use crate::momentum::{Impulses, StoredMomentum};
use crate::outside::place_on_side;
use crate::pressure::{PressureError, PressureReport, Projection, Tolerance};
use crate::stability::{Rates, StableStep, StepLimits, body_force_rate};
use crate::surface_tension::SurfaceTension;
use crate::transport::TransportReport;
use crate::viscosity::{DiffusionReport, ViscosityError, explicit_rate_of_liquid};

/// A step could not be completed.
#[derive(Clone, Debug, thiserror::Error)]
pub enum StepError {
    /// The pressure equation was not solved.
    #[error(transparent)]
    Pressure(#[from] PressureError),
    /// The viscous equation was not solved.
    #[error(transparent)]
    Viscosity(#[from] ViscosityError),
    /// The discrete-element engine failed.
    #[error(transparent)]
    Grains(#[from] DemError),
    /// A field holds NaN or an infinite value.
    #[error(
        "the {field} is not finite in cell ({}, {}, {}) at ({:.4e}, {:.4e}, {:.4e}) m",
        cell[0], cell[1], cell[2], position.x, position.y, position.z
    )]
    NotFinite {
        /// Name of the field.
        field: &'static str,
        /// Global indices of the first such cell on the rank.
        cell: [usize; 3],
        /// Centre of that cell \[m].
        position: Vector,
    },
    /// The step failed on another rank.
    #[error(transparent)]
    Elsewhere(#[from] FailedElsewhere),
}

/// Diagnostics of one step.
#[derive(Clone, Debug, Default)]
pub struct StepReport {
    /// Passes of the fluid phase in this step.
    pub fluid_passes: usize,
    /// Inflow and mixed-cell residue of the transport, summed over the passes.
    pub transport: TransportReport,
    /// Viscous solve and its wall impulse, summed over the passes.
    pub diffusion: DiffusionReport,
    /// Pressure solve: iterations and wall impulse summed, the largest residuals over the passes.
    pub pressure: PressureReport,
    /// Largest advective Courant number over the passes.
    pub courant: Real,
    /// Contacts of the grains.
    pub contacts: ContactReport,
    /// Volume fractions of the grains.
    pub imprint: ImprintReport,
    /// Impulses in the momentum budget, over all ranks.
    pub impulses: Impulses,
    /// The mean velocity that is held, if one is, and the force that held it; its impulse is part of that of gravity, or of the
    /// walls where it is a gradient of the pressure.
    pub mean_flow: Option<MeanFlowReport>,
}

/// Physical and numerical settings of the step.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GridSettings {
    /// Gravity [m/s^2].
    pub gravity: Vector,
    /// Limits on the time step.
    pub limits: StepLimits,
    /// Convergence criterion of the projection.
    pub tolerance: Tolerance,
    /// Whether the pressure gradient of the step before acts during the transport: second order in time for a single fluid.
    pub incremental: bool,
}

/// A phase of the step, reported to the caller for timing.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Phase {
    /// Transport, viscosity and face velocities.
    Fluid,
    /// Solution of the pressure equation and correction of the velocities.
    Pressure,
    /// Contacts and motion of the grains.
    Grains,
    /// Fluid loads on grains, volume fractions, momentum exchange.
    Coupling,
}

/// Flow, interface and grains on one rank.
pub struct Solver {
    pub(crate) domain: Domain,
    pub(crate) boundary: Boundary,
    pub(crate) settings: GridSettings,
    pub(crate) flow: Flow,
    pub(crate) projection: Projection,
    pub(crate) grains: ResolvedGrains,
    /// The acceleration that implicit viscous steps see.
    pub(crate) acceleration: Option<Acceleration>,
    /// The room of the liquid, if that is only the open part of the cells.
    pub(crate) room: Option<Room>,
    /// Length that the limits allowed for the last step, before an output time shortened it \[s].
    pub(crate) previous_step: Option<Real>,
    /// The last flow that carried the liquid, and its advective rate [1/s].
    pub(crate) carried: Option<(CarryingFlow, Real)>,
    /// The sides of the box as they are given; what enters a box that moves has another velocity.
    pub(crate) given: Boundary,
    /// The mean velocity that is held, if one is.
    pub(crate) mean_flow: Option<MeanFlow>,
    /// What grains that were fed in since the last step changed of the stored momentum [N s].
    fed: Vector,
}

impl Solver {
    /// A solver that has been started, of a flow that nothing but gravity drives: [`Self::waiting`] and [`Self::start`].
    ///
    /// # Errors
    /// [`StepError`] if the projection fails.
    pub fn new(
        domain: Domain,
        boundary: Boundary,
        settings: GridSettings,
        flow: Flow,
        engine: Engine,
        shapes: Arc<[Shape]>,
        coupling: Coupling,
    ) -> Result<Self, StepError> {
        let mut solver = Self::waiting(domain, boundary, settings, flow, engine, shapes, coupling);
        solver.start(None, Vector::ZERO)?;
        Ok(solver)
    }

    /// Assembles a solver that has to be started before its first step: [`Self::start`].
    #[must_use]
    pub fn waiting(
        domain: Domain,
        boundary: Boundary,
        settings: GridSettings,
        flow: Flow,
        engine: Engine,
        shapes: Arc<[Shape]>,
        coupling: Coupling,
    ) -> Self {
        let projection = Projection::new(&domain, boundary.pressure_sides());
        let grains = ResolvedGrains::new(&domain, &flow.fluids, engine, shapes, coupling);
        Self::assembled(domain, boundary, settings, flow, projection, grains)
    }

    /// The solver of these parts, before its first step.
    pub(crate) fn assembled(
        domain: Domain,
        boundary: Boundary,
        settings: GridSettings,
        flow: Flow,
        projection: Projection,
        mut grains: ResolvedGrains,
    ) -> Self {
        // Grains leave through what is no wall of the fluid; where a wall for grains alone stands they do not get there.
        let open = |d: usize| [0, 1].map(|side| boundary.opening(d, side).is_some());
        grains.engine_mut().let_leave([open(0), open(1), open(2)]);
        let acceleration = Acceleration::of(&domain, &grains, &flow);
        let room = Room::beside(&domain, &mut grains);
        Self {
            domain,
            boundary,
            settings,
            flow,
            projection,
            grains,
            acceleration,
            room,
            previous_step: None,
            carried: None,
            given: boundary,
            mean_flow: None,
            fed: Vector::ZERO,
        }
    }

    /// Gives the interface surface tension from the next step on.
    #[must_use]
    pub fn with_surface_tension(mut self, tension: Option<SurfaceTension>) -> Self {
        self.projection.tension = tension;
        self
    }

    /// Surface tension, if there is any.
    #[must_use]
    pub fn surface_tension(&self) -> Option<&SurfaceTension> {
        self.projection.tension.as_ref()
    }

    /// Energy of the interface over all ranks \[J]: the surface tension times its area.
    #[must_use]
    pub fn surface_energy(&self) -> Real {
        self.surface_tension().map_or(0.0, |tension| tension.energy(&self.domain, &self.flow))
    }

    /// Limits the length of the first step to `first` \[s], if given, and to that in which the pressure of open sides sets the fluid going.
    pub fn limit_first_step(&mut self, first: Option<Real>) {
        let fluids = &self.flow.fluids;
        let lighter = fluids.liquid_density.min(fluids.gas_density);
        let pushed = Vector::X * (self.projection.gradient_of_sides(&self.domain) / lighter);
        let rates = Rates { body_force: body_force_rate(pushed, self.domain.grid().spacing), ..Rates::default() };
        let pushed = StepLimits { fixed: None, ..self.settings.limits }.choose(&rates, None).dt;
        self.previous_step = first.map(|first| first.min(pushed) / self.settings.limits.growth);
    }

    /// The longest stable next step, the limit that sets it, and the number of fluid passes in it.
    #[must_use]
    pub fn stable_step(&self) -> StableStep {
        let [grain_motion, grain_turn] = self.grains.motion_rates(&self.domain, self.settings.limits.courant);
        // What is heavy feels gravity and what holds a mean velocity by mass, the liquid the mean gradient of the pressure as well.
        let gravity = self.settings.gravity + self.by_mass();
        let of_liquid = gravity + self.projection.mean.acceleration();
        let strongest = if gravity.length() > of_liquid.length() { gravity } else { of_liquid };
        let rates = Rates {
            advective: self.flow.advective_rate(&self.domain),
            viscous: self.flow.viscous_rate(&self.domain),
            capillary: self.surface_tension().map_or(0.0, |tension| tension.rate(&self.domain, &self.flow.fluids)),
            body_force: body_force_rate(strongest, self.domain.grid().spacing),
            grain_motion,
            grain_turn,
            grain_friction: if self.grains.joins(&self.domain, &self.flow) {
                explicit_rate_of_liquid(&self.flow.fluids, self.domain.grid().spacing)
            } else {
                0.0
            },
            interface_viscosity: self.flow.interface_rate(&self.domain, self.settings.limits.longest),
            contact: self.grains.contact_rate(&self.domain),
        };
        self.settings.limits.choose(&rates, self.previous_step)
    }

    /// The longest stable next step of [`Self::carry`]: that of the flow when it is fastest, at time zero.
    #[must_use]
    pub fn stable_step_carried(&mut self, carrying: &CarryingFlow) -> StableStep {
        let known = self.carried.filter(|(known, _)| known == carrying);
        let (_, advective) = *self.carried.insert(known.unwrap_or_else(|| (*carrying, carrying.rate(&self.domain))));
        self.settings.limits.choose(&Rates { advective, ..Rates::default() }, self.previous_step)
    }

    /// Gives faces and cells the velocity of `carrying` at `time` \[s], as [`Self::carry`] leaves them.
    pub fn set_carried(&mut self, carrying: &CarryingFlow, time: Real) {
        let Self { domain, boundary, flow, .. } = self;
        carrying.set_faces(domain, time, &mut flow.face_velocity);
        flow.take_faces(domain);
        flow.fill_halos(domain, boundary);
    }

    /// Carries the liquid from `time` \[s] on for `dt` \[s], at most `step.dt`, by a given velocity: a test of the transport,
    /// without forces, pressure or grains. The faces have the velocity of the middle of each pass; afterwards faces and
    /// cells have that of the end.
    ///
    /// # Errors
    /// [`StepError`] if a field is not finite.
    pub fn carry(
        &mut self,
        carrying: &CarryingFlow,
        step: StableStep,
        time: Real,
        dt: Real,
    ) -> Result<StepReport, StepError> {
        let Self { domain, boundary, flow, .. } = self;
        let mut report = StepReport { fluid_passes: step.fluid_passes, ..StepReport::default() };
        let pass = dt / step.fluid_passes as Real;
        for number in 0..step.fluid_passes {
            carrying.set_faces(domain, time + (number as Real + 0.5) * pass, &mut flow.face_velocity);
            report.courant = report.courant.max(flow.advective_rate(domain) * pass);
            report.transport += flow.transport(domain, boundary, pass);
        }
        self.set_carried(carrying, time + dt);
        self.previous_step = Some(step.dt);
        self.check(&report)?;
        Ok(report)
    }

    /// Checks for NaN and infinities; costs one reduction when all values are finite.
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

    /// Fills the ghost cells, as needed to interpolate the fields between cells.
    pub fn fill_halos(&mut self) {
        self.flow.fill_halos(&self.domain, &self.boundary);
    }

    /// Momentum stored in fluids, grains and the exchange between them, over all ranks.
    #[must_use]
    pub fn momentum(&self) -> StoredMomentum {
        let [liquid, gas] = self.flow.momentum(&self.domain);
        let [grains, mut displaced] = self.grains.momentum(&self.domain);
        if let Some(room) = &self.room {
            displaced = room.covered_momentum(&self.domain, &self.flow);
        }
        StoredMomentum { liquid, gas, grains, displaced }
    }

    /// Volume of the liquid, over all ranks [m^3]; inside grains too if it fills whole cells.
    #[must_use]
    pub fn liquid_volume(&self) -> Real {
        match &self.room {
            Some(room) => room.liquid_volume(&self.domain, &self.flow.volume_fraction),
            None => self.flow.liquid_volume(&self.domain),
        }
    }

    /// Volume of liquid outside grains, over all ranks [m^3].
    #[must_use]
    pub fn wet_liquid_volume(&self) -> Real {
        if self.room.is_some() {
            return self.liquid_volume();
        }
        self.flow.liquid_volume(&self.domain)
            - self.grains.liquid_volume_inside(&self.domain, &self.flow.volume_fraction)
    }

    /// Whether liquid has only the open part of the cells as its room.
    #[must_use]
    pub fn has_open_room(&self) -> bool {
        self.room.is_some()
    }

    /// Liquid in the cell at a place in memory, and the room it has there, in cell volumes: the whole cell, or its open part.
    #[must_use]
    #[inline]
    pub fn liquid_and_room(&self, at: usize) -> [Real; 2] {
        let (c, room) =
            (self.flow.volume_fraction.data()[at], self.room.as_ref().map_or(1.0, |room| room.for_liquid(at)));
        [room * c, room]
    }

    /// Kinetic energy of liquid and gas, over all ranks \[J]: of whole cells, or of their open parts where liquid has only these.
    #[must_use]
    pub fn fluid_energy(&self) -> Real {
        match &self.room {
            Some(room) => room.kinetic_energy(&self.domain, &self.flow),
            None => self.flow.kinetic_energy(&self.domain),
        }
    }

    /// Liquid fraction of what enters through an open side with the velocity `u` [m/s] through the face at a place in memory of a
    /// `row` of faces normal to `direction`; `None` where nothing enters through one.
    #[must_use]
    pub fn entering_fraction(&self, direction: usize, row: Row, at: usize, u: Real) -> Option<Real> {
        let index = [row.first, row.j, row.k][direction];
        let side = usize::from(u < 0.0);
        let at_side = index == if side == 0 { 0 } else { self.domain.cells()[direction] as isize };
        let opening = self.boundary.opening(direction, side).filter(|_| at_side && u != 0.0)?;
        if !self.domain.at_box_end(direction, side) {
            return None;
        }
        let face = place_on_side(&self.domain, direction, [row.j, row.k].map(|n| n as usize)) + (at - row.start);
        let standing = self.projection.outside().fraction(direction, side).get(face).copied();
        Some(standing.unwrap_or(opening.volume_fraction))
    }

    /// The grid and this rank's part of it.
    #[must_use]
    pub fn domain(&self) -> &Domain {
        &self.domain
    }

    /// Boundary conditions on the six sides of the box.
    #[must_use]
    pub fn boundary(&self) -> &Boundary {
        &self.boundary
    }

    /// Physical and numerical settings.
    #[must_use]
    pub fn settings(&self) -> &GridSettings {
        &self.settings
    }

    /// Drives the flow along periodic directions by a mean gradient of the pressure that gives the liquid this acceleration [m/s^2];
    /// where a net flow is held, the gradient is what holds it.
    pub fn drive_by_pressure(&mut self, acceleration: Vector) {
        let held = self.mean_flow.filter(MeanFlow::is_net).map_or([false; 3], |flow| flow.held());
        let now = self.projection.mean.acceleration();
        let all = Vector::from_array(std::array::from_fn(|d| if held[d] { now[d] } else { acceleration[d] }));
        self.projection.mean.drive(all, self.flow.fluids.liquid_density);
    }

    /// Sets gravity [m/s^2]: in an accelerated frame of reference it changes with time.
    pub fn set_gravity(&mut self, gravity: Vector) {
        self.settings.gravity = gravity;
    }

    /// Lets held grains move by the forces on them from now on; see [`Engine::release`].
    ///
    /// # Errors
    /// As there.
    pub fn release(&mut self, which: impl Fn(u64) -> bool + Sync) -> Result<usize, DemError> {
        let Self { domain, grains, .. } = self;
        let count = grains.engine_mut().release(domain, which)?;
        if count > 0 {
            // Grains that are not free have another density there.
            grains.imprint(domain);
        }
        Ok(count)
    }

    /// Softens the contacts of the grains; see [`Engine::soften`].
    pub fn soften_contacts(&mut self, stiffness: Real, largest_overlap: Real) {
        let Self { domain, grains, .. } = self;
        grains.engine_mut().soften(domain, stiffness, largest_overlap);
    }

    /// Watches the contacts of grains, by their identifiers; see [`Engine::watch`].
    pub fn watch_contacts(&mut self, grains: impl Iterator<Item = u64>) {
        self.grains.engine_mut().watch(grains);
    }

    /// Feeds in grains, and lets those go whose identifier `which` takes; see [`Engine::feed`] and [`Engine::let_go_fed`]. What they change
    /// of the stored momentum the next step books at the open sides.
    ///
    /// # Errors
    /// As there.
    pub fn feed(&mut self, fed: &[Grain], which: impl Fn(u64) -> bool + Sync) -> Result<(), DemError> {
        let before = self.momentum().total();
        let Self { domain, grains, .. } = self;
        grains.engine_mut().feed(domain, fed)?;
        let count = grains.engine_mut().let_go_fed(domain, which)?;
        if count > 0 || !fed.is_empty() {
            grains.imprint(domain);
        }
        self.fed += self.momentum().total() - before;
        Ok(())
    }

    /// The fluid phase: volume fraction, velocity, density.
    #[must_use]
    pub fn flow(&self) -> &Flow {
        &self.flow
    }

    /// Pressure in the cells \[Pa].
    #[must_use]
    pub fn pressure(&self) -> &Field<Real> {
        self.projection.pressure()
    }

    /// The grains and their coupling to the fluid.
    #[must_use]
    pub fn grains(&self) -> &ResolvedGrains {
        &self.grains
    }
}
