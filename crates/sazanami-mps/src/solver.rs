//! Fluid, walls and grains on one rank, and one step of all.

mod phases;

use sazanami_dem::{ContactReport, DemError, Engine};
use sazanami_numerics::domain::{Domain, FailedElsewhere};
use sazanami_numerics::{Real, Vector};

use crate::boundary::{LatticeError, Tank};
use crate::free_surface::SurfaceTest;
use crate::ghosts::{Ghosts, Periods};
use crate::grains::{CouplingReport, GrainPhase};
use crate::momentum::{FluidImpulses, facet};
use crate::neighbours::{Bins, Neighbours};
use crate::number_density::{NumberDensity, Prediction, Sample};
use crate::particles::{FIRST_WALL_ID, Kind, ParticleRecord, Particles, Role};
use crate::pressure::{PressureEquation, PressureError, PressureReport, Tolerance};
use crate::reductions::{largest, sum_of};
use crate::scheme::{Fluid, Kernel, Scheme};
use crate::stabilisation::Repulsion;
use crate::stability::{COMPRESSIBLE, Rates, Step, StepLimits};

/// A step could not be completed.
#[derive(Clone, Debug, thiserror::Error)]
pub enum StepError {
    /// The pressure equation was not solved.
    #[error(transparent)]
    Pressure(#[from] PressureError),
    /// A particle has a NaN or infinite value.
    #[error("fluid particle {id} has a {what} that is not finite at ({:.4e}, {:.4e}, {:.4e}) m", position.x, position.y, position.z)]
    NotFinite {
        /// Identifier of the particle.
        id: u64,
        /// Name of the quantity.
        what: &'static str,
        /// Position at the start of the step [m].
        position: Vector,
    },
    /// A particle moved farther in a step than its radius of influence.
    #[error("fluid particle {id} moved {:.3} mm in the step, farther than its radius of influence of {:.3} mm, from ({:.4e}, {:.4e}, {:.4e}) m", 1e3 * distance, 1e3 * limit, position.x, position.y, position.z)]
    TooFar {
        /// Identifier of the particle.
        id: u64,
        /// Distance moved [m].
        distance: Real,
        /// Radius of influence [m].
        limit: Real,
        /// Position at the start of the step [m].
        position: Vector,
    },
    /// A particle exceeds the speed up to which water is incompressible.
    #[error("fluid particle {id} moves at {speed:.4e} m/s at ({:.4e}, {:.4e}, {:.4e}) m; flow faster than {COMPRESSIBLE} m/s is not incompressible: the run is unstable", position.x, position.y, position.z)]
    TooFast {
        /// Identifier of the particle.
        id: u64,
        /// Its speed [m/s].
        speed: Real,
        /// Position at the start of the step [m].
        position: Vector,
    },
    /// The grains could not be advanced.
    #[error(transparent)]
    Grains(#[from] DemError),
    /// Another rank failed.
    #[error(transparent)]
    Elsewhere(#[from] FailedElsewhere),
}

/// A solver could not be set up.
#[derive(Clone, Debug, thiserror::Error)]
pub enum SetupError {
    /// The wall lattice does not fit the box.
    #[error(transparent)]
    Lattice(#[from] LatticeError),
    /// A periodic length is less than twice the radius of influence.
    #[error("the box is {:.3} mm long in x{}, where it is periodic; at least {:.3} mm, twice the radius of influence, is needed", 1e3 * length, direction + 1, 1e3 * needed)]
    BoxTooShort {
        /// Direction, from 0.
        direction: usize,
        /// Length of the box [m].
        length: Real,
        /// Least length [m].
        needed: Real,
    },
    /// The radius of influence is out of range.
    #[error("a radius of influence of {radius} particle spacings is outside 2.1 to 3.6")]
    Radius {
        /// Radius over the spacing.
        radius: Real,
    },
}

/// External forcing of a step.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Forcing {
    /// Body force per mass in the middle of the step, in the frame of the positions [m/s^2].
    pub body_force: Vector,
    /// Displacement of the walls at the end of the step, from the start of the run [m].
    pub wall_displacement: Vector,
    /// Mean velocity of the walls in the step [m/s].
    pub wall_velocity: Vector,
}

/// Properties and numerical parameters of the fluid.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Settings {
    /// Fluid properties and particle spacing.
    pub fluid: Fluid,
    /// Enhancements of the method.
    pub scheme: Scheme,
    /// Limits of the time step.
    pub limits: StepLimits,
    /// Stopping criterion of the pressure solver.
    pub tolerance: Tolerance,
    /// Point at which the hydrostatic part of the pressure is zero [m].
    pub reference: Vector,
}

/// A phase of the step, for whoever measures it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Phase {
    /// Order, ghosts, lists.
    Neighbours,
    /// Sums over neighbours, motion.
    Fluid,
    /// Pressure.
    Pressure,
    /// Contacts and motion of the grains.
    Grains,
    /// Void fraction, drag.
    Coupling,
}

/// Report of a step, over all ranks.
#[derive(Clone, Debug, Default)]
pub struct StepReport {
    /// Solution of the pressure equation.
    pub pressure: PressureReport,
    /// Mean and root mean square of the volume strain away from the free surface, at the start of the step.
    pub strain: [Real; 2],
    /// Fluid particles at the free surface.
    pub surface: usize,
    /// Isolated fluid particles (spray).
    pub isolated: usize,
    /// Wall particles at which the tensile cut-off acted.
    pub tensile_cutoffs: usize,
    /// Particles with an uncorrected pressure gradient.
    pub uncorrected_gradients: usize,
    /// Pairs on which dynamic stabilisation acted.
    pub stabilised_pairs: usize,
    /// Work done by the stabilisation [J].
    pub stabilisation_work: Real,
    /// Largest displacement by shifting [m].
    pub largest_shift: Real,
    /// Pairs that collided, fluid with fluid or fluid with wall.
    pub collisions: usize,
    /// Particles clipped to the box.
    pub clipped: usize,
    /// Largest speed of the fluid [m/s].
    pub largest_speed: Real,
    /// Pairs in the neighbour lists.
    pub pairs: usize,
    /// Contacts between grains and with walls.
    pub contacts: ContactReport,
    /// Coupling with the grains.
    pub coupling: CouplingReport,
    /// External impulses on the fluid.
    pub impulses: FluidImpulses,
}

/// Columns of a step, kept for their memory.
#[derive(Debug, Default)]
struct Scratch {
    inverse_void: Vec<Real>,
    inverse_void_rate: Vec<Real>,
    grain_mobility: Vec<Real>,
    /// `eps` and what gives way with it.
    mobility: Vec<Real>,
    viscous_velocity: Vec<Vector>,
    samples: Vec<Sample>,
    densities: Vec<NumberDensity>,
    /// What drag changes the velocity by.
    change: Vec<Vector>,
    prediction: Vec<Prediction>,
    /// Predicted velocity and place, ghosts included.
    velocity: Vec<Vector>,
    place: Vec<Vector>,
    after: Vec<Vector>,
    plain: Vec<bool>,
    roles: Vec<u8>,
    bin: Vec<u32>,
    size: Vec<Real>,
    repulsions: Vec<Repulsion>,
    shifts: Vec<Vector>,
    collisions: Vec<(Vector, Real)>,
    /// Walls that see no water but what flies on its own.
    dry: Vec<u32>,
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
    /// Positions of the wall particles at the start, by number [m].
    wall_places: Vec<Vector>,
    /// Area vectors of the wall particles, by number (see [`facet`]) [m^2].
    facets: Vec<Vector>,
    ghosts: Ghosts,
    bins: Bins,
    neighbours: Neighbours,
    equation: PressureEquation,
    pub(crate) grains: GrainPhase,
    scratch: Scratch,
}

/// Initial state of a fluid particle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FluidParticle {
    /// Position [m].
    pub position: Vector,
    /// Velocity [m/s].
    pub velocity: Vector,
}

impl Solver {
    /// A tank with fluid and grains. Every rank passes all fluid particles and keeps those in its part of the domain.
    ///
    /// # Errors
    /// [`SetupError`] if the box does not fit the particle spacing or the radius of influence.
    pub fn new(
        domain: Domain,
        settings: Settings,
        tank: Tank,
        fluid: &[FluidParticle],
        grains: GrainPhase,
    ) -> Result<Self, SetupError> {
        let fluid = fluid.iter().enumerate();
        let records: Vec<ParticleRecord> =
            fluid.map(|(n, p)| ParticleRecord::new(n as u64, Kind::Fluid, p.position, p.velocity)).collect();
        Self::from_records(domain, settings, tank, &records, grains)
    }

    /// A solver from the state of fluid and walls; wall particles missing in `records` are created at rest.
    pub(crate) fn from_records(
        domain: Domain,
        settings: Settings,
        tank: Tank,
        records: &[ParticleRecord],
        grains: GrainPhase,
    ) -> Result<Self, SetupError> {
        let radius = settings.scheme.radius;
        if !(2.1..=3.6).contains(&radius) {
            return Err(SetupError::Radius { radius });
        }
        let kernel = Kernel::new(settings.scheme, settings.fluid.spacing);
        let periods = Periods::of(&domain);
        for direction in 0..3 {
            let (length, needed) = (periods.length[direction], 2.0 * kernel.weight.radius);
            if length > 0.0 && length < needed {
                return Err(SetupError::BoxTooShort { direction, length, needed });
            }
        }
        let mut walls = tank.particles(settings.fluid.spacing, kernel.weight.radius)?;
        let wall_places: Vec<Vector> = walls.iter().map(|wall| Vector::from_array(wall.position)).collect();
        let lattice = tank.lattice(settings.fluid.spacing)?;
        let facets = wall_places.iter().map(|&place| facet(&tank, lattice, place)).collect();
        let water =
            records.iter().filter(|record| record.id < FIRST_WALL_ID).count() as Real * settings.fluid.spacing.powi(3);
        let full = tank.is_full(water + grains.solid_volume(&domain));
        let me = domain.communicator().rank();
        let mut particles = Particles::default();
        for known in records.iter().filter(|record| record.id >= FIRST_WALL_ID) {
            if let Some(wall) = walls.get_mut((known.id - FIRST_WALL_ID) as usize) {
                *wall = *known;
            }
        }
        for record in records.iter().filter(|record| record.id < FIRST_WALL_ID).chain(&walls) {
            let position = periods.wrapped(Vector::from_array(record.position));
            if domain.owner_of(position) == me {
                particles.push(&ParticleRecord { position: position.to_array(), ..*record });
            }
        }
        particles.owned = particles.len();
        Ok(Self {
            surface: (!full).then(|| SurfaceTest::of(&kernel.sums)),
            grains,
            domain,
            periods,
            settings,
            tank,
            kernel,
            particles,
            wall_places,
            facets,
            ghosts: Ghosts::default(),
            bins: Bins::default(),
            neighbours: Neighbours::default(),
            equation: PressureEquation::default(),
            scratch: Scratch::default(),
        })
    }

    /// The part of a body force [m/s^2] whose hydrostatic pressure is split off: its components along directions that are
    /// not periodic.
    #[must_use]
    pub fn reduced_force(&self, body_force: Vector) -> Vector {
        if !self.settings.scheme.reduced_pressure {
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
            advective: self.largest_speed_of(|role| role != Role::Inactive) / spacing,
            grain_motion: self.grains.motion_rate(&self.domain),
            drag: self.grains.drag_rate(),
        };
        self.settings.limits.choose(&rates, body_force, spacing, viscosity)
    }

    /// Advances fluid and grains by `dt` [s]: arrange, crowd, move grains, predict, solve, correct, keep apart, shift.
    /// `watch` is told when a phase begins.
    ///
    /// # Errors
    /// [`StepError`] names what went wrong and where; the state is then of no use.
    pub fn step(&mut self, dt: Real, forcing: &Forcing, mut watch: impl FnMut(Phase)) -> Result<StepReport, StepError> {
        let coupling = CouplingReport { least_void: 1.0, ..CouplingReport::default() };
        let mut report = StepReport { coupling, ..StepReport::default() };
        watch(Phase::Neighbours);
        self.begin_walls(dt, forcing);
        self.arrange(dt, forcing);
        let time = self.flow_time(dt, forcing);
        report.pairs = self.neighbours.pairs;
        watch(Phase::Coupling);
        self.void_fractions(false, &mut report);
        watch(Phase::Fluid);
        self.number_density();
        self.advance_grains(dt, forcing, &mut report, &mut watch)?;
        watch(Phase::Fluid);
        self.predict(dt, forcing);
        watch(Phase::Coupling);
        self.void_fractions(true, &mut report);
        watch(Phase::Fluid);
        self.assemble(&mut report);
        watch(Phase::Pressure);
        self.solve(dt, time, forcing, &mut report)?;
        watch(Phase::Fluid);
        self.correct(dt);
        self.record_impulses(dt, forcing, &mut report);
        self.stabilise(dt, time, &mut report);
        self.shift(dt, time, &mut report);
        watch(Phase::Coupling);
        self.correct_grains(dt, &mut report);
        watch(Phase::Fluid);
        self.finalise(&mut report)?;
        Ok(report)
    }

    /// Largest speed of a fluid particle, over all ranks [m/s].
    #[must_use]
    pub fn largest_speed(&self) -> Real {
        self.largest_speed_of(|_| true)
    }

    /// The same over particles with a role in the last step for which `counts` holds.
    fn largest_speed_of(&self, counts: impl Fn(Role) -> bool + Sync) -> Real {
        let particles = &self.particles;
        let counted = |a: usize| particles.kind[a] == Kind::Fluid && counts(particles.role[a]);
        let square =
            largest(particles.owned, |a| if counted(a) { particles.velocity[a].length_squared() } else { 0.0 });
        self.domain.max(square.max(0.0).sqrt())
    }

    /// Sum of `part` over all fluid particles, over all ranks.
    #[must_use]
    pub fn sum_over_fluid<const N: usize>(&self, part: impl Fn(&Particles, usize) -> [Real; N] + Sync) -> [Real; N] {
        let particles = &self.particles;
        let fluid = |a: usize| particles.kind[a] == Kind::Fluid;
        let sums = sum_of(particles.owned, |a| if fluid(a) { part(particles, a) } else { [0.0; N] });
        self.domain.sum(sums)
    }

    /// Momentum of the fluid, over all ranks [N s].
    #[must_use]
    pub fn fluid_momentum(&self) -> Vector {
        self.momentum(&self.particles.velocity)
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

    /// Mass of a fluid particle [kg].
    #[must_use]
    pub fn particle_mass(&self) -> Real {
        self.settings.fluid.density * self.settings.fluid.spacing.powi(3)
    }
}
