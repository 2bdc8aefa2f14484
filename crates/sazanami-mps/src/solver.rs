//! Fluid, walls and grains on one rank, and the step.

mod phases;

use sazanami_dem::{ContactReport, DemError, Engine};
use sazanami_numerics::domain::{Domain, FailedElsewhere};
use sazanami_numerics::{Real, Vector};

use crate::boundary::{LatticeError, Tank};
use crate::exchange::{Exchange, Periods};
use crate::free_surface::SurfaceTest;
use crate::grains::{CouplingReport, GrainPhase};
use crate::momentum::{FluidImpulses, facet};
use crate::neighbours::{Bins, Neighbours};
use crate::number_density::{Crowding, Prediction, Sample};
use crate::particles::{Kind, ParticleRecord, Particles, Role, WALL};
use crate::pressure::{PressureEquation, PressureError, PressureReport, Tolerance};
use crate::reductions::{largest, sum_of};
use crate::scheme::{Fluid, Kernel, Scheme};
use crate::stabilisation::Push;
use crate::stability::{COMPRESSIBLE, Rates, Step, StepLimits};

/// A step could not be completed.
#[derive(Clone, Debug, thiserror::Error)]
pub enum StepError {
    /// The pressure equation was not solved.
    #[error(transparent)]
    Pressure(#[from] PressureError),
    /// A particle holds a number that is not finite.
    #[error("fluid particle {id} has a {what} that is not finite at ({:.4e}, {:.4e}, {:.4e}) m", position.x, position.y, position.z)]
    NotFinite {
        /// Identifier.
        id: u64,
        /// Name of the quantity.
        what: &'static str,
        /// Where it was last [m].
        position: Vector,
    },
    /// A particle moved farther in a step than it looks.
    #[error("fluid particle {id} moved {:.3} mm in the step, farther than its radius of influence of {:.3} mm, from ({:.4e}, {:.4e}, {:.4e}) m", 1e3 * way, 1e3 * farthest, position.x, position.y, position.z)]
    TooFar {
        /// Identifier.
        id: u64,
        /// How far it moved [m].
        way: Real,
        /// Radius of influence [m].
        farthest: Real,
        /// Where it was last [m].
        position: Vector,
    },
    /// A particle is so fast that water would not be incompressible.
    #[error("fluid particle {id} moves at {speed:.4e} m/s, which no water does that is incompressible (at most {COMPRESSIBLE} m/s), from ({:.4e}, {:.4e}, {:.4e}) m: speeds have grown out of hand", position.x, position.y, position.z)]
    TooFast {
        /// Identifier.
        id: u64,
        /// Its speed [m/s].
        speed: Real,
        /// Where it was last [m].
        position: Vector,
    },
    /// A grain went wrong.
    #[error(transparent)]
    Grains(#[from] DemError),
    /// Another rank failed.
    #[error(transparent)]
    Elsewhere(#[from] FailedElsewhere),
}

/// A solver could not be made.
#[derive(Clone, Debug, thiserror::Error)]
pub enum SetupError {
    /// The walls' lattice does not fit.
    #[error(transparent)]
    Lattice(#[from] LatticeError),
    /// The box is smaller than what a particle looks at.
    #[error("the box is {:.3} mm long in x{}, where it is periodic; it needs {:.3} mm, twice the radius of influence", 1e3 * length, direction + 1, 1e3 * needed)]
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

/// What moves the fluid from outside in a step.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Forcing {
    /// Body force in the middle of the step, in the frame of the positions [m/s^2].
    pub body_force: Vector,
    /// Where the walls are at the end of the step, from where they were at the start of the run [m].
    pub wall_displacement: Vector,
    /// Velocity of the walls in the step [m/s].
    pub wall_velocity: Vector,
}

/// How the fluid and the step are computed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Settings {
    /// Fluid.
    pub fluid: Fluid,
    /// Enhancements.
    pub scheme: Scheme,
    /// Limits of the step.
    pub limits: StepLimits,
    /// Accuracy of the pressure.
    pub tolerance: Tolerance,
    /// Point where the hydrostatic part of the pressure is zero [m].
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

/// What a step did; over all ranks.
#[derive(Clone, Debug, Default)]
pub struct StepReport {
    /// Pressure.
    pub pressure: PressureReport,
    /// Mean and root mean square of the volume strain of fluid away from the surface, at the start of the step.
    pub strain: [Real; 2],
    /// Fluid particles at the surface and on their own.
    pub surface: usize,
    /// Fluid particles that fly on their own.
    pub splashes: usize,
    /// Wall particles with little water before them that would have pulled at it.
    pub released_walls: usize,
    /// Particles whose pressure gradient was not corrected.
    pub plain_gradients: usize,
    /// Pairs that were pushed apart.
    pub pushed_pairs: usize,
    /// Work of the pushes [J].
    pub push_work: Real,
    /// Longest way that a particle was shifted [m].
    pub largest_shift: Real,
    /// Pairs, of fluid or of fluid and wall, that bounced off each other.
    pub collisions: usize,
    /// Particles that were put back from a wall.
    pub clipped: usize,
    /// Largest speed of the fluid [m/s].
    pub largest_speed: Real,
    /// Pairs within the radius of the lists.
    pub pairs: usize,
    /// Contacts of the grains.
    pub contacts: ContactReport,
    /// Exchange with the grains.
    pub coupling: CouplingReport,
    /// What else acted on the fluid from outside.
    pub impulses: FluidImpulses,
}

/// Columns of a step, kept for their memory.
#[derive(Debug, Default)]
struct Scratch {
    bulk: Vec<Real>,
    bulk_rate: Vec<Real>,
    mobile: Vec<Real>,
    /// `eps` and what gives way with it.
    conductance: Vec<Real>,
    seen: Vec<Vector>,
    samples: Vec<Sample>,
    crowding: Vec<Crowding>,
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
    pushes: Vec<Push>,
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
    /// None where the box is closed and full.
    surface: Option<SurfaceTest>,
    pub(crate) particles: Particles,
    /// Where wall particles were at the start, by number [m].
    wall_places: Vec<Vector>,
    /// See [`facet`], by number.
    facets: Vec<Vector>,
    exchange: Exchange,
    bins: Bins,
    neighbours: Neighbours,
    equation: PressureEquation,
    pub(crate) grains: GrainPhase,
    scratch: Scratch,
}

/// A fluid particle as a user describes it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FluidParticle {
    /// Place [m].
    pub position: Vector,
    /// Velocity [m/s].
    pub velocity: Vector,
}

impl Solver {
    /// Puts fluid into a tank. Every rank gives the same particles and keeps those in its part of the domain.
    ///
    /// # Errors
    /// [`SetupError`] if walls or periods do not fit the particles.
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

    /// The same from the state of fluid and walls; walls are added where there are none.
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
        let water = records.iter().filter(|record| record.id < WALL).count() as Real * settings.fluid.spacing.powi(3);
        let full = tank.is_full(water + grains.solid_volume(&domain));
        let me = domain.communicator().rank();
        let mut particles = Particles::default();
        for known in records.iter().filter(|record| record.id >= WALL) {
            if let Some(wall) = walls.get_mut((known.id - WALL) as usize) {
                *wall = *known;
            }
        }
        for record in records.iter().filter(|record| record.id < WALL).chain(&walls) {
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
            exchange: Exchange::default(),
            bins: Bins::default(),
            neighbours: Neighbours::default(),
            equation: PressureEquation::default(),
            scratch: Scratch::default(),
        })
    }

    /// The part of a body force [m/s^2] whose pressure at rest the reduced pressure is without: along a periodic direction
    /// there is no rest.
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
            // Who flies on its own disturbs nobody, however fast.
            advective: self.largest_speed_of(|role| role != Role::Outside) / spacing,
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
        self.find_voids(false, &mut report);
        watch(Phase::Fluid);
        self.crowd();
        self.advance_grains(dt, forcing, &mut report, &mut watch)?;
        watch(Phase::Fluid);
        self.predict(dt, forcing);
        watch(Phase::Coupling);
        self.find_voids(true, &mut report);
        watch(Phase::Fluid);
        self.sum_up(&mut report);
        watch(Phase::Pressure);
        self.solve(dt, time, forcing, &mut report)?;
        watch(Phase::Fluid);
        self.correct(dt);
        self.book(dt, forcing, &mut report);
        self.keep_apart(dt, time, &mut report);
        self.shift(dt, time, &mut report);
        watch(Phase::Coupling);
        self.correct_grains(dt, &mut report);
        watch(Phase::Fluid);
        self.settle(&mut report)?;
        Ok(report)
    }

    /// Largest speed of the fluid, over all ranks [m/s].
    #[must_use]
    pub fn largest_speed(&self) -> Real {
        self.largest_speed_of(|_| true)
    }

    /// The same of particles that had a role which `counts` in the last step.
    fn largest_speed_of(&self, counts: impl Fn(Role) -> bool + Sync) -> Real {
        let particles = &self.particles;
        let counted = |a: usize| particles.kind[a] == Kind::Fluid && counts(particles.role[a]);
        let square =
            largest(particles.owned, |a| if counted(a) { particles.velocity[a].length_squared() } else { 0.0 });
        self.domain.max(square.max(0.0).sqrt())
    }

    /// Sum of `part` over the own fluid particles of all ranks.
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

    /// Fluid and walls; between steps own particles are up to date, ghosts are not.
    #[must_use]
    pub fn particles(&self) -> &Particles {
        &self.particles
    }

    /// The grains and their coupling.
    #[must_use]
    pub fn grains(&self) -> &GrainPhase {
        &self.grains
    }

    /// Takes note of where the grains are now, for void fractions that are asked for between steps.
    pub fn place_grains(&mut self) {
        self.grains.place(&self.domain, &self.tank);
    }

    /// The grains, to be changed between steps.
    pub fn grains_mut(&mut self) -> &mut GrainPhase {
        &mut self.grains
    }

    /// The engine of the grains, to be changed between steps, with this rank's part of the box.
    pub fn engine_mut(&mut self) -> (&mut Engine, &Domain) {
        (self.grains.engine_mut(), &self.domain)
    }

    /// This rank's part of the box.
    #[must_use]
    pub fn domain(&self) -> &Domain {
        &self.domain
    }

    /// How fluid and step are computed.
    #[must_use]
    pub fn settings(&self) -> &Settings {
        &self.settings
    }

    /// The box and its walls.
    #[must_use]
    pub fn tank(&self) -> &Tank {
        &self.tank
    }

    /// Changes the velocity of every own fluid particle.
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
