//! Fluid, walls and grains on one rank, and one step of all.

mod conjugate;
mod published;
mod setup;

use sazanami_dem::{DemError, Engine, Grain};
use sazanami_numerics::domain::Domain;
use sazanami_numerics::mean_flow::MeanFlow;
use sazanami_numerics::{Real, Vector};

use crate::arrangement::Arrangement;
use crate::boundary::Tank;
use crate::context::Context;
pub use crate::error::{SetupError, StepError};
use crate::ghosts::Periods;
use crate::grains::OverlappingGrains;
use crate::motion;
use crate::particles::{Kind, Particles, Role};
use crate::pressure::PressureEquation;
pub use crate::report::{EnergyChanges, Phase, StepReport};
use crate::scheme::{Fluid, Kernel, ParticleProjection};
pub use crate::settings::{Forcing, ParticleSettings};
use crate::stability::{Rates, StableStep};
use crate::surface_test::SurfaceTest;
use crate::walls::Walls;
use published::PublishedColumns;

/// Fluid and walls on one rank.
pub struct Solver {
    pub(crate) domain: Domain,
    periods: Periods,
    settings: ParticleSettings,
    tank: Tank,
    kernel: Kernel,
    /// `None` in a closed box that is full.
    surface: Option<SurfaceTest>,
    pub(crate) particles: Particles,
    walls: Walls,
    near: Arrangement,
    equation: PressureEquation,
    pub(crate) grains: OverlappingGrains,
    published: PublishedColumns,
    conjugate: crate::conjugate::ConjugateColumns,
    pub(crate) mean_flow: Option<MeanFlow>,
    /// Largest viscosity of the step before, fluid and eddies together [m^2/s].
    pub(crate) largest_viscosity: Real,
}

/// Initial state of a fluid particle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FluidParticle {
    /// Position \[m].
    pub position: Vector,
    /// Velocity [m/s].
    pub velocity: Vector,
}

impl Solver {
    /// The part of a body force [m/s^2] whose hydrostatic pressure is split off: its components along directions that are
    /// not periodic.
    #[must_use]
    pub fn reduced_force(&self, body_force: Vector) -> Vector {
        if self.settings.scheme.projection == ParticleProjection::Conjugate {
            return Vector::ZERO;
        }
        Vector::select(self.periods.length.cmpgt(Vector::ZERO), Vector::ZERO, body_force)
    }

    /// Holds a mean velocity of the fluid from the next step on, by a body force on fluid and grains beside that of the step.
    pub fn hold_mean_flow(&mut self, mean_flow: MeanFlow) {
        self.mean_flow = Some(mean_flow);
    }

    /// A net flow is held from the start by what bears the weight of water and grains.
    fn bear_weight(&mut self, body_force: Vector) {
        let Some(mut flow) = self.mean_flow.filter(MeanFlow::is_net) else { return };
        let [count] = self.sum_over_fluid(|_, _| [1.0]);
        let [grains, displaced] = self.grains.free_sums(&self.domain);
        let water = self.particle_mass() * count;
        flow.bear(body_force, water + grains, water + self.settings.fluid.density * displaced);
        self.mean_flow = Some(flow);
    }

    /// Body force per mass by which a mean velocity is held in the next step, and what of it acts by volume [m/s^2].
    fn driving(&self) -> [Vector; 2] {
        self.mean_flow.map_or([Vector::ZERO; 2], |flow| [flow.acceleration(), flow.by_volume()])
    }

    /// The longest stable next step under a body force [m/s^2], beside that which holds a mean velocity.
    #[must_use]
    pub fn stable_step(&self, body_force: Vector) -> StableStep {
        let body_force = body_force + self.driving()[0];
        let Fluid { spacing, viscosity, .. } = self.settings.fluid;
        let rates = Rates {
            // Isolated particles interact with nothing.
            advective: motion::largest_speed(&self.domain, &self.particles, Vector::ZERO, |role| {
                role != Role::Inactive
            }) / spacing,
            grain_motion: self.grains.motion_rate(&self.domain),
            drag: self.grains.limiting_drag_rate(),
        };
        self.settings.limits.choose(&rates, body_force, spacing, viscosity.max(self.largest_viscosity))
    }

    /// Advances fluid and grains by `dt` \[s]. `watch` is called at the start of each phase.
    ///
    /// # Errors
    /// [`StepError`] names what failed and where; the state is then not usable.
    pub fn step(&mut self, dt: Real, forcing: &Forcing, watch: impl FnMut(Phase)) -> Result<StepReport, StepError> {
        self.bear_weight(forcing.body_force);
        let [all, by_volume] = self.driving();
        let (body_force, by_volume) = (forcing.body_force + all, forcing.by_volume + by_volume);
        let forcing = &Forcing { body_force, by_volume, ..*forcing };
        let [water] = self.sum_over_fluid(|_, _| [1.0]);
        let mut report = match self.settings.scheme.projection {
            _ if water == 0.0 => self.step_dry(dt, forcing, watch),
            ParticleProjection::Conjugate => self.step_conjugate(dt, forcing, watch),
            ParticleProjection::Enhanced => self.step_published(dt, forcing, watch),
        }?;
        self.largest_viscosity = report.largest_viscosity;
        self.grains.engine_mut().take_departed(&self.domain)?;
        if let Some(mut flow) = self.mean_flow {
            let level = flow.above() + forcing.wall_displacement.z;
            let [count, x, y, z] = self.sum_over_fluid(|particles, a| {
                let [x, y, z] = particles.velocity[a].to_array();
                if particles.position[a].z > level { [1.0, x, y, z] } else { [0.0; 4] }
            });
            let mass = self.particle_mass();
            let (mut momentum, mut moved) = (mass * Vector::new(x, y, z), mass * count);
            if flow.is_net() {
                let [_, displaced, x, y, z] = self.grains.sums(&self.domain);
                momentum += self.settings.fluid.density * Vector::new(x, y, z);
                moved += self.settings.fluid.density * displaced;
            }
            momentum -= moved * forcing.wall_velocity;
            report.mean_flow = Some(flow.answer(dt, momentum, moved));
            self.mean_flow = Some(flow);
        }
        Ok(report)
    }

    /// The step of grains in a tank without water.
    fn step_dry(&mut self, dt: Real, forcing: &Forcing, mut watch: impl FnMut(Phase)) -> Result<StepReport, StepError> {
        let Self { domain, periods, settings, kernel, tank, grains, .. } = self;
        let (surface, reduced_force) = (self.surface, Vector::ZERO);
        let step = Context { domain, periods, settings, kernel, surface, forcing, reduced_force, dt, flow_time: dt };
        let mut report = StepReport::default();
        watch(Phase::Grains);
        grains.begin_step(&step, &tank.gates)?;
        grains.leave_dry();
        report.contacts = grains.advance(&step, &mut report.coupling)?;
        tank.displacement = forcing.wall_displacement;
        Ok(report)
    }

    /// Largest speed of a fluid particle, over all ranks [m/s].
    #[must_use]
    pub fn largest_speed(&self) -> Real {
        motion::largest_speed(&self.domain, &self.particles, Vector::ZERO, |_| true)
    }

    /// The same without particles that fly alone.
    #[must_use]
    pub fn largest_speed_together(&self) -> Real {
        motion::largest_speed(&self.domain, &self.particles, Vector::ZERO, |role| role != Role::Inactive)
    }

    /// Sum of `part` over all fluid particles, over all ranks.
    #[must_use]
    pub fn sum_over_fluid<const N: usize>(&self, part: impl Fn(&Particles, usize) -> [Real; N] + Sync) -> [Real; N] {
        motion::sum_over_fluid(&self.domain, &self.particles, part)
    }

    /// Momentum of the fluid, over all ranks [N s].
    #[must_use]
    pub fn fluid_momentum(&self) -> Vector {
        let velocities = self.sum_over_fluid(|particles, a| particles.velocity[a].to_array());
        self.particle_mass() * Vector::from_array(velocities)
    }

    /// Particles of fluid and walls; between steps only own particles are up to date, ghosts are not.
    #[must_use]
    pub fn particles(&self) -> &Particles {
        &self.particles
    }

    /// The grains and their coupling.
    #[must_use]
    pub fn grains(&self) -> &OverlappingGrains {
        &self.grains
    }

    /// Updates the positions of the grains behind [`OverlappingGrains::void_fraction`], between steps.
    pub fn place_grains(&mut self) {
        self.grains.place(&self.domain, &self.tank);
    }

    /// Mutable access to the grains and their coupling, between steps.
    pub fn grains_mut(&mut self) -> &mut OverlappingGrains {
        &mut self.grains
    }

    /// Mutable access to the grain engine between steps, with the domain.
    pub fn engine_mut(&mut self) -> (&mut Engine, &Domain) {
        (self.grains.engine_mut(), &self.domain)
    }

    /// Lets held grains move by the forces on them from now on; see [`Engine::release`].
    ///
    /// # Errors
    /// As there.
    pub fn release(&mut self, which: impl Fn(u64) -> bool + Sync) -> Result<usize, DemError> {
        let count = self.grains.engine_mut().release(&self.domain, which)?;
        if count > 0 {
            self.grains.expect_drag(&self.domain, &self.tank);
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

    /// Feeds in grains, and lets those go whose identifier `which` takes; see [`Engine::feed`] and [`Engine::let_go_fed`].
    ///
    /// # Errors
    /// As there.
    pub fn feed(&mut self, fed: &[Grain], which: impl Fn(u64) -> bool + Sync) -> Result<(), DemError> {
        self.grains.engine_mut().feed(&self.domain, fed)?;
        let count = self.grains.engine_mut().let_go_fed(&self.domain, which)?;
        if count > 0 {
            self.grains.expect_drag(&self.domain, &self.tank);
        }
        Ok(())
    }

    /// Decomposition of the box and this rank's part of it.
    #[must_use]
    pub fn domain(&self) -> &Domain {
        &self.domain
    }

    /// Properties and numerical parameters of the fluid.
    #[must_use]
    pub fn settings(&self) -> &ParticleSettings {
        &self.settings
    }

    /// Puts the gates where they are at `time` \[s] of the run; before, they are closed.
    pub fn open_gates(&mut self, time: Real) {
        let ceiling = self.tank.upper.z;
        self.tank.gates.iter_mut().for_each(|gate| gate.put(time, ceiling));
    }

    /// The box and its walls.
    #[must_use]
    pub fn tank(&self) -> &Tank {
        &self.tank
    }

    /// Sets the velocity of every own fluid particle [m/s].
    pub fn set_velocities(&mut self, velocity: impl Fn(&Particles, usize) -> Vector) {
        for a in 0..self.particles.owned {
            if self.particles.kind[a] == Kind::Fluid {
                self.particles.velocity[a] = velocity(&self.particles, a);
            }
        }
    }

    /// Mass of a fluid particle \[kg].
    #[must_use]
    pub fn particle_mass(&self) -> Real {
        self.settings.fluid.density * self.settings.fluid.spacing.powi(3)
    }
}
