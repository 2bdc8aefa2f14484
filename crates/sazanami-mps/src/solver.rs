//! One step of the fluid.

use sazanami_dem::{ContactReport, DemError};
use sazanami_numerics::domain::{Domain, FailedElsewhere};
use sazanami_numerics::{Real, Vector};
use sazanami_parallel::{for_each_chunk, max_over, sum_over};

use crate::boundary::{LatticeError, Tank, WallFriction};
use crate::exchange::{Exchange, Periods};
use crate::free_surface::{SurfaceTest, is_splash};
use crate::grains::{self, CouplingReport, GrainPhase, Voids};
use crate::neighbours::{Bins, Neighbours, ROWS};
use crate::number_density::{self, Columns, Crowding, Prediction};
use crate::operators::{self, PressureField};
use crate::particles::{Kind, ParticleRecord, Particles, WALL};
use crate::pressure::{Layout, PressureEquation, PressureError, PressureReport, Role, Tolerance, hydrostatic};
use crate::scheme::{Fluid, Kernel, Scheme, SourceForm};
use crate::stabilisation::{self, Moved, Push};
use crate::stability::{Rates, Step, StepLimits};

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

/// Repeats of the first solve for the gradient at surfaces.
const FIRST_REPEATS: usize = 3;

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
    /// Pressure, iterations of all solves.
    pub pressure: PressureReport,
    /// Mean and root mean square of the volume strain of fluid away from the surface, at the start of the step.
    pub strain: [Real; 2],
    /// Fluid particles at the surface and on their own.
    pub surface: usize,
    /// Fluid particles that fly on their own.
    pub splashes: usize,
    /// Particles whose pressure gradient was not corrected.
    pub plain_gradients: usize,
    /// Pairs that were pushed apart.
    pub pushed_pairs: usize,
    /// Work of the pushes [J].
    pub push_work: Real,
    /// Pairs that bounced off each other.
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
}

/// Columns of a step, kept for their memory.
#[derive(Debug, Default)]
struct Scratch {
    bulk: Vec<Real>,
    bulk_rate: Vec<Real>,
    mobile: Vec<Real>,
    previous: Vec<Real>,
    seen: Vec<Vector>,
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
    pushes: Vec<Push>,
    collisions: Vec<(Vector, u32)>,
}

/// Fluid and walls on one rank.
pub struct Solver {
    pub(crate) domain: Domain,
    periods: Periods,
    settings: Settings,
    tank: Tank,
    kernel: Kernel,
    surface: SurfaceTest,
    pub(crate) particles: Particles,
    /// Where wall particles were at the start, by number [m].
    wall_places: Vec<Vector>,
    exchange: Exchange,
    bins: Bins,
    neighbours: Neighbours,
    equation: PressureEquation,
    pub(crate) grains: GrainPhase,
    /// Steps taken.
    pub(crate) steps: u64,
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
        let wall_places = walls.iter().map(|wall| Vector::from_array(wall.position)).collect();
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
            surface: SurfaceTest::of(&kernel.sums),
            grains,
            domain,
            periods,
            settings,
            tank,
            kernel,
            particles,
            wall_places,
            exchange: Exchange::default(),
            bins: Bins::default(),
            neighbours: Neighbours::default(),
            equation: PressureEquation::default(),
            steps: 0,
            scratch: Scratch::default(),
        })
    }

    /// The longest stable next step under a body force [m/s^2].
    #[must_use]
    pub fn stable_step(&self, body_force: Vector) -> Step {
        let Fluid { spacing, viscosity, .. } = self.settings.fluid;
        let rates = Rates {
            advective: self.largest_speed() / spacing,
            grain_motion: self.grains.motion_rate(&self.domain),
            drag: self.grains.drag_rate(&self.domain),
        };
        self.settings.limits.choose(&rates, body_force, spacing, viscosity)
    }

    /// Advances fluid and grains by `dt` [s]: arrange, crowd, move grains, predict, solve, correct, keep apart.
    /// `watch` is told when a phase begins.
    ///
    /// # Errors
    /// [`StepError`] names what went wrong and where; the state is then of no use.
    pub fn step(&mut self, dt: Real, forcing: &Forcing, mut watch: impl FnMut(Phase)) -> Result<StepReport, StepError> {
        let mut report = StepReport::default();
        watch(Phase::Neighbours);
        self.move_walls(forcing);
        self.arrange(dt, forcing);
        report.pairs = self.neighbours.pairs;
        watch(Phase::Coupling);
        self.find_voids(&mut report);
        watch(Phase::Fluid);
        self.crowd();
        self.advance_grains(dt, forcing, &mut report, &mut watch)?;
        watch(Phase::Fluid);
        self.predict(dt, forcing);
        watch(Phase::Coupling);
        self.find_predicted_voids(&mut report);
        watch(Phase::Fluid);
        self.sum_up(&mut report);
        watch(Phase::Pressure);
        self.solve(dt, forcing, &mut report)?;
        watch(Phase::Fluid);
        self.correct(dt, forcing);
        self.keep_apart(dt, &mut report);
        watch(Phase::Coupling);
        self.correct_grains(dt, &mut report);
        watch(Phase::Fluid);
        self.settle(&mut report)?;
        self.steps += 1;
        Ok(report)
    }

    fn move_walls(&mut self, forcing: &Forcing) {
        self.tank.displacement = forcing.wall_displacement;
        self.tank.velocity = forcing.wall_velocity;
        let particles = &mut self.particles;
        particles.truncate(particles.owned);
        for a in (0..particles.owned).filter(|&a| particles.kind[a] != Kind::Fluid) {
            let place = self.wall_places[(particles.id[a] - WALL) as usize];
            particles.position[a] = self.periods.wrapped(place + forcing.wall_displacement);
            particles.velocity[a] = forcing.wall_velocity;
        }
    }

    /// Owners, order, ghosts, lists.
    fn arrange(&mut self, dt: Real, forcing: &Forcing) {
        // Neighbours come no nearer than this before the pressure acts.
        let way = dt * (self.largest_speed() + dt * forcing.body_force.length());
        let skin = 2.1 * way + 0.02 * self.settings.fluid.spacing;
        let reach = self.kernel.weight.radius + skin;
        let Self { domain, periods, particles, exchange, bins, neighbours, .. } = self;
        exchange.migrate(domain, particles);
        bins.renew(domain, reach);
        particles.sort(|x| bins.number(x));
        exchange.renew(domain, periods, particles, reach, |x| bins.number(x));
        let (own, ghosts) = particles.position.split_at(particles.owned);
        bins.fill(own, ghosts);
        neighbours.renew(bins, particles, reach);
        let scratch = &mut self.scratch;
        let (owned, all) = (particles.owned, particles.len());
        let blocks = owned.div_ceil(ROWS);
        scratch.bulk.clear();
        scratch.bulk.resize(all, 1.0);
        scratch.bulk_rate.clear();
        scratch.bulk_rate.resize(all, 0.0);
        scratch.mobile.clear();
        scratch.mobile.resize(all, 0.0);
        scratch.crowding.resize(owned, Crowding::default());
        scratch.prediction.resize(blocks * ROWS, Prediction::default());
        scratch.plain.resize(owned, false);
        scratch.pushes.resize(owned, Push::default());
        scratch.bin.clear();
        scratch.bin.extend(particles.position[..owned].iter().map(|&x| bins.number(x)));
        self.equation.resize(owned);
    }

    /// Void fraction where the particles are.
    fn find_voids(&mut self, report: &mut StepReport) {
        let Self { domain, tank, particles, exchange, scratch, grains, .. } = self;
        let Scratch { bulk, bulk_rate, mobile, change, .. } = scratch;
        let owned = particles.owned;
        change.clear();
        change.resize(owned, Vector::ZERO);
        if grains.is_empty() {
            return;
        }
        grains.place(domain, tank);
        let Particles { kind, position, velocity, .. } = &*particles;
        let mut voids = Voids {
            bulk: &mut bulk[..owned],
            bulk_rate: &mut bulk_rate[..owned],
            mobile: &mut mobile[..owned],
        };
        let (cut, smallest) = grains.voids(kind, position, velocity, &mut voids);
        report.coupling.cut_voids = domain.sum([cut as Real])[0] as usize;
        report.coupling.least_void = domain.min(smallest);
        exchange.refresh(domain, bulk);
        exchange.refresh(domain, bulk_rate);
    }

    /// The same where they will be without the pressure, among grains that have moved.
    fn find_predicted_voids(&mut self, report: &mut StepReport) {
        let Self { domain, tank, particles, exchange, scratch, grains, .. } = self;
        if grains.is_empty() {
            return;
        }
        let Scratch { bulk, bulk_rate, mobile, velocity, place, .. } = scratch;
        let owned = particles.owned;
        grains.place(domain, tank);
        let mut voids = Voids {
            bulk: &mut bulk[..owned],
            bulk_rate: &mut bulk_rate[..owned],
            mobile: &mut mobile[..owned],
        };
        let (_, smallest) = grains.voids(&particles.kind, place, velocity, &mut voids);
        report.coupling.least_void = report.coupling.least_void.min(domain.min(smallest));
        exchange.refresh(domain, bulk);
        exchange.refresh(domain, bulk_rate);
        exchange.refresh(domain, mobile);
    }

    /// Moves the grains, and finds what their drag does to the fluid.
    fn advance_grains(
        &mut self,
        dt: Real,
        forcing: &Forcing,
        report: &mut StepReport,
        watch: &mut impl FnMut(Phase),
    ) -> Result<(), StepError> {
        let mass = self.particle_mass();
        let Self { domain, kernel, particles, bins, exchange, scratch, grains, .. } = self;
        if grains.is_empty() || grains.is_frozen() {
            return Ok(());
        }
        watch(Phase::Coupling);
        exchange.refresh(domain, &mut particles.gradient);
        grains.look_around(kernel, bins, particles, &scratch.bulk);
        watch(Phase::Grains);
        report.contacts = grains.advance(domain, forcing.body_force, dt, &mut report.coupling)?;
        watch(Phase::Coupling);
        let Scratch { bulk, change, .. } = scratch;
        grains.react(domain, kernel, particles, bulk, mass, change, &mut report.coupling);
        Ok(())
    }

    /// Lets the grains feel the pressure of this step.
    fn correct_grains(&mut self, dt: Real, report: &mut StepReport) {
        let Self { domain, kernel, particles, exchange, bins, scratch, grains, .. } = self;
        if grains.is_empty() || grains.is_frozen() {
            return;
        }
        exchange.refresh(domain, &mut particles.gradient);
        let Particles { kind, gradient, .. } = &*particles;
        let fluid = grains::Fluid { bins, kind, position: &scratch.after, gradient, bulk: &scratch.bulk };
        grains.correct_pressure_force(domain, kernel, &fluid, dt, &mut report.coupling);
    }

    /// Number density, its rate and viscosity where the particles are.
    fn crowd(&mut self) {
        let Self { domain, tank, kernel, particles, exchange, bins, neighbours, scratch, settings, .. } = self;
        let Scratch { seen, bulk, bulk_rate, crowding, .. } = scratch;
        let seen = if settings.fluid.viscosity > 0.0 && tank.friction == WallFriction::NoSlip {
            operators::mirrored_velocities(kernel, tank, bins, particles, seen);
            exchange.refresh(domain, seen);
            &seen[..]
        } else {
            &particles.velocity[..]
        };
        let Particles { kind, position, velocity, .. } = &*particles;
        let columns = Columns { kind, position, velocity, bulk, bulk_rate };
        number_density::crowding(kernel, neighbours, &columns, seen, tank.friction, crowding);
    }

    /// Velocities and places without the pressure.
    fn predict(&mut self, dt: Real, forcing: &Forcing) {
        let Self { domain, particles, exchange, scratch, settings, .. } = self;
        let Scratch { velocity, place, crowding, change, .. } = scratch;
        velocity.clone_from(&particles.velocity);
        place.clone_from(&particles.position);
        let owned = particles.owned;
        let viscosity = settings.fluid.viscosity;
        let body_force = if settings.scheme.reduced_pressure { Vector::ZERO } else { forcing.body_force };
        let kind = &particles.kind;
        for_each_chunk((&mut velocity[..owned], &mut place[..owned]), ROWS, |number, (velocity, place)| {
            for (row, (u, x)) in velocity.iter_mut().zip(place).enumerate() {
                let a = number * ROWS + row;
                if kind[a] == Kind::Fluid {
                    *u += dt * (viscosity * crowding[a].laplacian + body_force) + change[a];
                    *x += dt * *u;
                }
            }
        });
        exchange.refresh(domain, velocity);
        exchange.refresh_positions(domain, place);
    }

    /// Sums at the predicted places: coefficients of the pressure equation, roles.
    fn sum_up(&mut self, report: &mut StepReport) {
        let Self { domain, kernel, particles, exchange, neighbours, scratch, settings, equation, surface, .. } = self;
        let Scratch { bulk, bulk_rate, mobile, velocity, place, prediction, roles, .. } = scratch;
        let columns = Columns { kind: &particles.kind, position: place, velocity, bulk, bulk_rate };
        let spacing = settings.fluid.spacing;
        number_density::prediction(kernel, spacing, neighbours, &columns, mobile, &mut equation.blocks, prediction);
        let n0 = kernel.sums.number_density;
        let owned = particles.owned;
        roles.clear();
        roles.extend(prediction[..owned].iter().zip(&particles.kind).map(|(sums, kind)| {
            let density = sums.density / n0;
            let role = match kind {
                Kind::Fluid if is_splash(sums.company) => Role::Outside,
                Kind::Fluid if surface.is_surface(density, sums.asymmetry / n0) => Role::Given,
                Kind::Wall if sums.wet == 0 => Role::Outside,
                Kind::Dummy => Role::Outside,
                Kind::Fluid | Kind::Wall => Role::Unknown,
            };
            role.number()
        }));
        roles.resize(particles.len(), 0);
        exchange.refresh(domain, roles);
        particles.role.iter_mut().zip(&*roles).for_each(|(role, &number)| *role = Role::from_number(number));
        equation.close(&particles.role, owned);
        let fluid = (0..owned).filter(|&a| particles.kind[a] == Kind::Fluid);
        let mut counts = [0.0; 5];
        for a in fluid {
            match particles.role[a] {
                Role::Outside => counts[0] += 1.0,
                Role::Given => counts[1] += 1.0,
                Role::Unknown if equation.rows[a].beside_surface => {}
                Role::Unknown => {
                    let strain = (scratch.crowding[a].density - n0) / kernel.sums.strain;
                    counts[2] += 1.0;
                    counts[3] += strain;
                    counts[4] += strain * strain;
                }
            }
        }
        let [splashes, at_surface, inner, sum, squares] = domain.sum(counts);
        (report.splashes, report.surface) = (splashes as usize, at_surface as usize);
        let inner = inner.max(1.0);
        report.strain = [sum / inner, (squares / inner).sqrt()];
    }

    /// Pressure and its gradient.
    fn solve(&mut self, dt: Real, forcing: &Forcing, report: &mut StepReport) -> Result<(), StepError> {
        let Self { domain, kernel, particles, exchange, bins, scratch, settings, equation, surface, steps, .. } = self;
        let Scratch { bulk, mobile, previous, place, crowding, prediction, plain, bin, .. } = scratch;
        let Settings { fluid, scheme, tolerance, reference, .. } = settings;
        let Particles { kind, role, pressure, gradient, owned, .. } = particles;
        let owned = *owned;
        let body_force = if scheme.reduced_pressure { forcing.body_force } else { Vector::ZERO };
        for ((p, role), &x) in pressure.iter_mut().zip(&*role).zip(&*place) {
            match role {
                Role::Outside => *p = 0.0,
                Role::Given => *p = -hydrostatic(fluid.density, body_force, x, *reference),
                Role::Unknown => {}
            }
        }
        // What the grains' way in the sub-steps already owes to the last pressure.
        previous.clear();
        previous.extend_from_slice(pressure);
        let n0 = kernel.sums.number_density;
        let strain = |density: Real| (density - n0) / kernel.sums.strain;
        let layout = Layout { domain, bins, roles: role, bin, owned };
        // Before the first step no gradient is known.
        let repeats = if *steps == 0 { scheme.surface_repeats.max(FIRST_REPEATS) } else { scheme.surface_repeats };
        for repeat in 0..=repeats {
            for a in 0..owned {
                let row = &mut equation.rows[a];
                if row.diagonal == 0.0 {
                    continue;
                }
                let Crowding { density, rate, .. } = crowding[a];
                let error = strain(density);
                let mut source = match scheme.source {
                    SourceForm::HigherOrder => prediction[a].rate,
                    SourceForm::Classical => strain(prediction[a].density) / dt,
                };
                // Water that leaves a wall above the surface pulls at nothing.
                if kind[a] == Kind::Wall && prediction[a].density < surface.density * n0 {
                    source = source.max(0.0);
                }
                // Below the surface a number density that is too low is no error.
                if row.beside_surface && error < 0.0 {
                    if scheme.source == SourceForm::Classical {
                        source = source.max(0.0);
                    }
                } else {
                    source += scheme.compensation * (error.abs() * rate + rate.abs() * error)
                        + error / (scheme.relaxation * dt);
                }
                row.right = fluid.density / dt * source;
                if mobile[a] > 0.0 {
                    let (columns, coefficients) = equation.blocks[a / ROWS].row(a % ROWS);
                    let conductance = |a: usize| 1.0 / bulk[a] + mobile[a];
                    for (&b, &c) in columns.iter().zip(coefficients) {
                        let b = b as usize;
                        if role[b] != Role::Outside {
                            let share = (mobile[a] + mobile[b]) / (conductance(a) + conductance(b));
                            row.right -= Real::from(c) * share * (previous[b] - previous[a]);
                        }
                    }
                }
                if row.beside_surface && kind[a] == Kind::Fluid {
                    // Neighbours are missing: what the sum makes of the gradient that is known is no curvature.
                    row.right -= gradient[a].dot(prediction[a].lean);
                }
            }
            let to_strain = dt * dt / fluid.density;
            let solved = equation.solve(&layout, exchange, pressure, to_strain, tolerance)?;
            let iterations = report.pressure.iterations + solved.iterations;
            report.pressure = PressureReport { iterations, cut_coefficients: equation.cut(), ..solved };
            let field = PressureField {
                pressure,
                position: place,
                bulk,
                roles: role,
                kind,
                weight_of_fluid: fluid.density * body_force,
            };
            operators::gradient(kernel, &mut equation.blocks, &field, &mut gradient[..owned], plain);
            if repeat == repeats {
                report.plain_gradients = domain.sum([plain.iter().filter(|p| **p).count() as Real])[0] as usize;
            }
        }
        Ok(())
    }

    /// Velocities and places with the pressure.
    fn correct(&mut self, dt: Real, forcing: &Forcing) {
        let Self { domain, particles, exchange, scratch, settings, .. } = self;
        let Scratch { velocity, place, after, .. } = scratch;
        after.clone_from(place);
        let Particles { kind, role, gradient, owned, .. } = particles;
        let owned = *owned;
        let density = settings.fluid.density;
        // Who flies on its own feels the body force, and nothing else.
        let alone = if settings.scheme.reduced_pressure { forcing.body_force } else { Vector::ZERO };
        for_each_chunk((&mut velocity[..owned], &mut after[..owned]), ROWS, |number, (velocity, after)| {
            for (row, (u, x)) in velocity.iter_mut().zip(after).enumerate() {
                let a = number * ROWS + row;
                if kind[a] != Kind::Fluid {
                    continue;
                }
                let acceleration = if role[a] == Role::Outside { alone } else { -gradient[a] / density };
                *u += dt * acceleration;
                *x += dt * dt * acceleration;
            }
        });
        exchange.refresh(domain, velocity);
        exchange.refresh_positions(domain, after);
    }

    /// Pushes and collisions.
    fn keep_apart(&mut self, dt: Real, report: &mut StepReport) {
        let Self { domain, kernel, particles, exchange, neighbours, scratch, settings, .. } = self;
        let Scratch { velocity, place, after, bulk, pushes, collisions, .. } = scratch;
        let (kind, owned) = (&particles.kind[..], particles.owned);
        let Fluid { spacing, density, .. } = settings.fluid;
        let mut nearest = 0.0;
        if let Some(stabilisation) = &settings.scheme.stabilisation {
            let moved = Moved { kind, before: place, after, bulk };
            stabilisation::pushes(kernel, stabilisation, spacing, neighbours, &moved, pushes);
            let mass = density * spacing.powi(3);
            let mut sums = [0.0; 2];
            nearest = Real::INFINITY;
            for a in 0..owned {
                let push = pushes[a];
                if push.pairs > 0 {
                    let change = push.way / dt;
                    sums[0] += Real::from(push.pairs);
                    sums[1] += mass * change.dot(velocity[a] + 0.5 * change);
                    velocity[a] += change;
                    after[a] += push.way;
                }
                nearest = nearest.min(push.nearest);
            }
            let [pairs, work] = domain.sum(sums);
            (report.pushed_pairs, report.push_work) = ((pairs / 2.0) as usize, work);
            nearest = domain.min(nearest);
            exchange.refresh(domain, velocity);
            exchange.refresh_positions(domain, after);
        }
        // Pushes move by less than a tenth of a spacing: who was farther apart does not collide.
        if nearest < (0.7 * spacing) * (0.7 * spacing) {
            collisions.resize(owned, (Vector::ZERO, 0));
            stabilisation::collisions(spacing, neighbours, kind, after, velocity, collisions);
            let mut count = 0.0;
            for (u, (change, pairs)) in velocity.iter_mut().zip(&*collisions) {
                *u += *change;
                count += Real::from(*pairs);
            }
            report.collisions = (domain.sum([count])[0] / 2.0) as usize;
        }
    }

    /// Takes over what was found, keeps particles off the walls and in the box, and looks for nonsense.
    fn settle(&mut self, report: &mut StepReport) -> Result<(), StepError> {
        let Self { domain, periods, tank, particles, scratch, settings, .. } = self;
        let Scratch { velocity, after, .. } = scratch;
        let spacing = settings.fluid.spacing;
        let mut clipped = 0.0;
        let mut bad = None;
        for a in 0..particles.owned {
            if particles.kind[a] != Kind::Fluid {
                continue;
            }
            let (mut x, mut u) = (after[a], velocity[a]);
            if !(x.is_finite() && u.is_finite() && particles.pressure[a].is_finite()) {
                let what = if u.is_finite() { "pressure" } else { "velocity" };
                bad = bad.or(Some(StepError::NotFinite { id: particles.id[a], what, position: particles.position[a] }));
                continue;
            }
            if tank.clip(spacing, &mut x, &mut u) {
                clipped += 1.0;
            }
            particles.position[a] = periods.wrapped(x);
            particles.velocity[a] = u;
        }
        domain.agree(bad.map_or(Ok(()), Err))?;
        report.clipped = domain.sum([clipped])[0] as usize;
        report.largest_speed = self.largest_speed();
        Ok(())
    }

    /// Largest speed of the fluid, over all ranks [m/s].
    #[must_use]
    pub fn largest_speed(&self) -> Real {
        let particles = &self.particles;
        let blocks = particles.owned.div_ceil(ROWS);
        let square = max_over(blocks, |n| {
            (n * ROWS..((n + 1) * ROWS).min(particles.owned))
                .filter(|&a| particles.kind[a] == Kind::Fluid)
                .map(|a| particles.velocity[a].length_squared())
                .fold(0.0, Real::max)
        });
        self.domain.max(square.max(0.0).sqrt())
    }

    /// Sum of `part` over the own fluid particles of all ranks.
    #[must_use]
    pub fn sum_over_fluid<const N: usize>(&self, part: impl Fn(&Particles, usize) -> [Real; N] + Sync) -> [Real; N] {
        let particles = &self.particles;
        let sums = sum_over(particles.owned.div_ceil(ROWS), |n| {
            let mut total = [0.0; N];
            for a in n * ROWS..((n + 1) * ROWS).min(particles.owned) {
                if particles.kind[a] == Kind::Fluid {
                    let part = part(particles, a);
                    (0..N).for_each(|m| total[m] += part[m]);
                }
            }
            total
        });
        self.domain.sum(sums)
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

    /// The grains, to be changed between steps.
    pub fn grains_mut(&mut self) -> &mut GrainPhase {
        &mut self.grains
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
