//! Fluid, walls and grains on one rank, and one step of all.

mod conjugate;
mod setup;

use sazanami_dem::Engine;
use sazanami_numerics::domain::Domain;
use sazanami_numerics::{Real, Vector};

use crate::arrangement::Arrangement;
use crate::boundary::Tank;
use crate::context::{Context, Motion, Voids};
pub use crate::error::{SetupError, StepError};
use crate::ghosts::Periods;
use crate::grains::{DragExchange, GrainPhase};
use crate::number_density::{self, NumberDensity, PredictedPairs, Prediction, Sample};
use crate::particles::{Kind, Particles, Role};
use crate::pressure::PressureEquation;
pub use crate::report::{EnergyChanges, Phase, StepReport};
use crate::scheme::{Fluid, Kernel, Projection, Scheme, ShiftingForm};
pub use crate::settings::{Forcing, Settings};
use crate::shifting_by_strain::Shifter;
use crate::source::{self, SourceTerms};
use crate::stabilisation::{Pairs, Stabiliser};
use crate::stability::{Rates, Step};
use crate::surface_test::SurfaceTest;
use crate::walls::Walls;
use crate::{free_surface, gradient, momentum, motion, shifting, viscosity};

/// What the phases of a step hand to each other: columns over particles, kept for their memory.
#[derive(Debug, Default)]
struct Columns {
    /// Void fraction, at the present or the predicted positions.
    voids: Voids,
    /// Velocities of the viscous term, mirrored at walls [m/s].
    mirrored: Vec<Vector>,
    /// Packed columns of the sums over pairs.
    samples: Vec<Sample>,
    /// Number density, its rate and viscosity at the start of the step.
    start: Vec<NumberDensity>,
    /// Velocity change by drag [m/s].
    drag: Vec<Vector>,
    /// Positions and velocities without the pressure.
    predicted: Motion,
    /// `eps + (1 - eps) rho/rho_s`.
    mobility: Vec<Real>,
    /// Sums at the predicted positions.
    sums: Vec<Prediction>,
    roles: Vec<u8>,
    /// Particles whose pressure gradient is not corrected.
    uncorrected: Vec<bool>,
    /// Positions and velocities with the pressure; in the end the new state.
    new: Motion,
    stabiliser: Stabiliser,
    displacements: Vec<Vector>,
    shifter: Shifter,
}

/// Fluid and walls on one rank.
pub struct Solver {
    pub(crate) domain: Domain,
    periods: Periods,
    settings: Settings,
    tank: Tank,
    kernel: Kernel,
    /// `None` in a closed box that is full.
    surface: Option<SurfaceTest>,
    pub(crate) particles: Particles,
    walls: Walls,
    near: Arrangement,
    equation: PressureEquation,
    pub(crate) grains: GrainPhase,
    columns: Columns,
    conjugate: crate::conjugate::Columns,
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
        let Scheme { projection, reduced_pressure, .. } = self.settings.scheme;
        if projection == Projection::Conjugate || !reduced_pressure {
            return Vector::ZERO;
        }
        Vector::select(self.periods.length.cmpgt(Vector::ZERO), Vector::ZERO, body_force)
    }

    /// The longest stable next step under a body force [m/s^2].
    #[must_use]
    pub fn stable_step(&self, body_force: Vector) -> Step {
        let Fluid { spacing, viscosity, .. } = self.settings.fluid;
        let rates = Rates {
            // Isolated particles interact with nothing.
            advective: motion::largest_speed(&self.domain, &self.particles, |role| role != Role::Inactive) / spacing,
            grain_motion: self.grains.motion_rate(&self.domain),
            drag: self.grains.limiting_drag_rate(),
        };
        self.settings.limits.choose(&rates, body_force, spacing, viscosity)
    }

    /// Advances fluid and grains by `dt` \[s]. `watch` is called at the start of each phase.
    ///
    /// # Errors
    /// [`StepError`] names what failed and where; the state is then not usable.
    pub fn step(&mut self, dt: Real, forcing: &Forcing, mut watch: impl FnMut(Phase)) -> Result<StepReport, StepError> {
        if self.settings.scheme.projection == Projection::Conjugate {
            return self.step_conjugate(dt, forcing, watch);
        }
        let reduced_force = self.reduced_force(forcing.body_force);
        let Self { domain, periods, settings, kernel, tank, particles, walls, near, equation, grains, columns, .. } =
            self;
        let surface = self.surface;
        let step = Context { domain, periods, settings, kernel, surface, forcing, reduced_force, dt, flow_time: dt };
        let Columns { voids, mirrored, samples, start, drag, predicted, sums, new, .. } = columns;
        let mut report = StepReport::default();

        watch(Phase::Neighbours);
        walls.begin_step(&step, tank, particles);
        grains.begin_step(&step);
        let fastest = motion::largest_speed(domain, particles, |_| true).max(grains.largest_speed(domain));
        near.renew(&step, particles, (fastest, grains.drag_rate()), 1.0, voids);
        let step = &Context { flow_time: motion::flow_time(&step, particles), ..step };
        equation.resize(particles.owned);

        watch(Phase::Coupling);
        let now = (&particles.position[..], &particles.velocity[..]);
        let voids_now = grains.void_fractions(step, tank, particles, now, &mut near.ghosts, voids);
        watch(Phase::Fluid);
        number_density::sample(now, voids, samples);
        let viscous = viscosity::field(step, tank, particles, near, mirrored);
        number_density::at_start(kernel, &near.neighbours, samples, &viscous, start);

        watch(Phase::Coupling);
        let velocity = if grains.coupling().exchange == DragExchange::Implicit {
            motion::predict(step, particles, start, None, &mut near.ghosts, predicted);
            Some(&predicted.velocity[..])
        } else {
            None
        };
        grains.interpolate_fluid(step, particles, velocity, &voids.inverse, &mut near.ghosts);
        watch(Phase::Grains);
        report.contacts = grains.advance(step, &mut report.coupling)?;
        watch(Phase::Coupling);
        report.coupling.drag_on_fluid = grains.return_drag(step, particles, &voids.inverse, drag);

        watch(Phase::Fluid);
        motion::predict(step, particles, start, Some(&drag[..]), &mut near.ghosts, predicted);
        tank.displacement = forcing.wall_displacement;
        near.follow(step, particles, predicted);
        watch(Phase::Coupling);
        let then = (&predicted.position[..], &predicted.velocity[..]);
        let voids_then = grains.void_fractions(step, tank, particles, then, &mut near.ghosts, voids);
        report.coupling.set_voids([voids_now, voids_then]);

        watch(Phase::Fluid);
        number_density::sample(then, voids, samples);
        number_density::mobility(voids, &mut columns.mobility);
        let pairs = PredictedPairs { kind: &particles.kind, samples, mobility: &columns.mobility };
        number_density::prediction(
            kernel,
            settings.fluid.spacing,
            &near.neighbours,
            &pairs,
            &mut equation.blocks,
            sums,
        );
        let found = (&sums[..], then.0);
        free_surface::set_roles(step, particles, found, &equation.blocks, &mut near.ghosts, &mut columns.roles);
        equation.set_diagonal(&particles.role, particles.owned);
        report.set_surface(&free_surface::report(step, particles, &equation.rows, start));

        watch(Phase::Pressure);
        let terms = SourceTerms { start, predicted: sums, samples, mobility: &columns.mobility, voids };
        source::set_right_side(step, &terms, particles, &equation.blocks, &mut equation.rows);
        source::prescribe(step, particles, then.0);
        equation.complete_support(particles, then.0, sums);
        report.pressure = equation.solve(step, near, particles, then.0)?;
        report.tensile_cutoffs = equation.cut_tension(step, sums, particles);
        near.ghosts.refresh(domain, &mut particles.pressure);
        report.uncorrected_gradients =
            gradient::gradient(step, &equation.blocks, then.0, &voids.inverse, particles, &mut columns.uncorrected);
        source::release_inactive(step, particles, then.0);

        watch(Phase::Fluid);
        motion::correct(step, particles, predicted, &mut near.ghosts, new);
        report.impulses = momentum::impulses(step, particles, walls, start, sums, &predicted.position);
        report.impulses.contact -= momentum::momentum(step, particles, &new.velocity);
        let Particles { kind, owned, .. } = particles;
        let inverse_void = &voids.inverse;
        let pairs =
            Pairs { kind, owned: *owned, position: &predicted.position, inverse_void, blocks: &equation.blocks };
        report.set_stabilisation(columns.stabiliser.stabilise(step, &pairs, &mut near.ghosts, new));
        report.collisions = columns.stabiliser.collide(step, &pairs, new);
        match settings.scheme.shifting_form {
            ShiftingForm::Strain if settings.scheme.shifting > 0.0 => {
                report.set_shift(&columns.shifter.shift(step, particles, (inverse_void, sums), near, new));
                report.impulses.contact -= report.shifting_impulse;
            }
            _ => {
                report.largest_shift =
                    shifting::shift(step, particles, inverse_void, near, new, &mut columns.displacements);
            }
        }

        watch(Phase::Coupling);
        report.coupling.pressure_on_grains +=
            grains.correct_pressure_force(step, particles, new, inverse_void, &mut near.ghosts);
        watch(Phase::Fluid);
        report.clipped = motion::finalise(step, tank, new, particles)?;
        report.impulses.contact += momentum::momentum(step, particles, &particles.velocity);
        report.largest_speed = motion::largest_speed(domain, particles, |_| true);
        report.pairs = near.neighbours.pairs;
        Ok(report)
    }

    /// Largest speed of a fluid particle, over all ranks [m/s].
    #[must_use]
    pub fn largest_speed(&self) -> Real {
        motion::largest_speed(&self.domain, &self.particles, |_| true)
    }

    /// The same without particles that fly alone.
    #[must_use]
    pub fn largest_speed_together(&self) -> Real {
        motion::largest_speed(&self.domain, &self.particles, |role| role != Role::Inactive)
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
    pub fn grains(&self) -> &GrainPhase {
        &self.grains
    }

    /// Updates the positions of the grains behind [`GrainPhase::void_fraction`], between steps.
    pub fn place_grains(&mut self) {
        self.grains.place(&self.domain, &self.tank);
    }

    /// Mutable access to the grains and their coupling, between steps.
    pub fn grains_mut(&mut self) -> &mut GrainPhase {
        &mut self.grains
    }

    /// Mutable access to the grain engine between steps, with the domain.
    pub fn engine_mut(&mut self) -> (&mut Engine, &Domain) {
        (self.grains.engine_mut(), &self.domain)
    }

    /// Decomposition of the box and this rank's part of it.
    #[must_use]
    pub fn domain(&self) -> &Domain {
        &self.domain
    }

    /// Properties and numerical parameters of the fluid.
    #[must_use]
    pub fn settings(&self) -> &Settings {
        &self.settings
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
