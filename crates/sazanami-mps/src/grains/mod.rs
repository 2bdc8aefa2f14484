//! Grains in the fluid: void fraction, drag, pressure force, and what the fluid gets back.
//!
//! Grains are spheres. The void fraction is smooth and its rate analytic; the fluid around a grain is a mean over the
//! fluid particles within the radius of influence, weighted by `w/eps`, and the drag on a grain returns to the same
//! particles with the same weights, so that its sum over both vanishes.

mod binned;
mod closure;
mod sources;

use sazanami_dem::{ContactLaw, ContactReport, DemError, Drag, Engine, Interactions, Loads, Setup, Substeps};
use sazanami_numerics::domain::Domain;
use sazanami_numerics::{Real, Vector};
use sazanami_parallel::for_each_chunk;

use binned::{Binned, Lanes, lanes};
pub use closure::{Closure, DensityReference, Forchheimer, SphereDrag, volume};
use sources::Sources;

use crate::boundary::Tank;
use crate::neighbours::ROWS;
use crate::particles::{Kind, Particles};
use crate::reductions;
use crate::scheme::Kernel;

/// Sum of weights over n0 from which on a grain is wholly wet.
const WET: Real = 0.5;

/// How grains and fluid act on each other.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Coupling {
    /// Drag law.
    pub closure: Closure,
    /// Radius R_eps over which the void fraction is smoothed [m].
    pub smoothing: Real,
    /// Least void fraction.
    pub least_void: Real,
    /// Whether grains feel the pressure of the same step, and the pressure equation knows how they give way to it;
    /// otherwise they feel that of the step before, which is stable only for heavy grains.
    pub implicit_pressure_force: bool,
    /// Sub-steps of the grains in a step.
    pub substeps: Substeps,
}

/// The fluid around a grain, at the start of a step.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Surroundings {
    /// Velocity of the fluid [m/s].
    pub velocity: Vector,
    /// Gradient of the reduced pressure [Pa/m].
    pub gradient: Vector,
    /// Part of the grain that is wet.
    pub wetness: Real,
    /// Void fraction, without the grain's own share.
    pub void_fraction: Real,
    /// Sum of the weights of the fluid particles.
    support: Real,
}

/// What the coupling did in a step; over all ranks.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct CouplingReport {
    /// Fluid particles whose void fraction was cut to the least.
    pub cut_voids: usize,
    /// Smallest void fraction of a fluid particle before it was cut.
    pub least_void: Real,
    /// Impulse that drag gave the grains [N s].
    pub drag_on_grains: Vector,
    /// Impulse that it gave the fluid [N s].
    pub drag_on_fluid: Vector,
    /// Impulse of the pressure on the grains, hydrostatic part included [N s].
    pub pressure_on_grains: Vector,
}

/// Places of numbers kept with a grain.
const PLACE: usize = 0;
const SUPPORT: usize = 3;
const WETNESS: usize = 4;
const GRADIENT: usize = 5;
/// Force on a grain in the last step, for output [N]: drag, then pressure.
const DRAG_FORCE: usize = 8;
const PRESSURE_FORCE: usize = 11;
const VOID: usize = 14;

/// The grains of one rank and what couples them to the fluid.
#[derive(Debug)]
pub struct GrainPhase {
    engine: Engine,
    coupling: Coupling,
    sources: Sources,
    /// Void fraction of each own fluid particle before it is cut.
    void: Vec<Real>,
    around: Vec<Surroundings>,
    /// Reciprocal of the shortest time in which drag brought a grain and the fluid around it together in the last
    /// step, over all ranks [1/s].
    drag_rate: Real,
    diameter: Vec<Real>,
    force: Vec<Vector>,
    shared: Vec<[Real; 6]>,
    places: Vec<Vector>,
    /// Fluid around the grains: places, `1/eps`, gradients, velocities.
    fluid: Binned<10>,
    /// Impulse that each grain took from the fluid over the sum of its weights, where it was.
    impulses: Binned<6>,
    /// Whether there are grains at all, on any rank.
    any: bool,
    frozen: bool,
}

/// Drag on the own grains during a step.
struct FluidDrag<'a> {
    closure: &'a Closure,
    around: &'a [Surroundings],
    diameter: &'a [Real],
}

impl Drag for FluidDrag<'_> {
    fn fluid_velocity(&self, own: usize) -> Vector {
        self.around[own].velocity
    }

    fn coefficient(&self, own: usize, slip: Real) -> Real {
        let around = &self.around[own];
        if around.wetness == 0.0 {
            return 0.0;
        }
        around.wetness * self.closure.coefficient(self.diameter[own], around.void_fraction, slip)
    }
}

/// Diameter of grain `g`, a sphere [m].
#[must_use]
pub fn diameter_of(engine: &Engine, g: usize) -> Real {
    let grains = engine.grains();
    2.0 * engine.bodies()[grains.shape[g] as usize].bounding_radius * grains.scale[g]
}

impl GrainPhase {
    /// No grains.
    ///
    /// # Errors
    /// None: an engine without grains can always be made.
    pub fn none(domain: &Domain) -> Result<Self, DemError> {
        let setup = Setup {
            bodies: Vec::new(),
            interactions: Interactions::uniform(0, ContactLaw::SAND),
            walls: Vec::new(),
            region: [Vector::NEG_INFINITY, Vector::INFINITY],
            ghost_margin: 0.0,
        };
        let coupling = Coupling {
            closure: Closure::recommended(1.0, 0.0),
            smoothing: 1.0,
            least_void: 1.0,
            implicit_pressure_force: false,
            substeps: Substeps::Auto,
        };
        Ok(Self::new(domain, Engine::new(domain, setup, &[])?, coupling))
    }

    /// Grains that are spheres, with an engine of their own.
    ///
    /// # Panics
    /// If the engine knows fewer images of grains than the void fraction asks for.
    #[must_use]
    pub fn new(domain: &Domain, engine: Engine, coupling: Coupling) -> Self {
        let any = domain.max(if engine.grains().owned() > 0 { 1.0 } else { 0.0 }) > 0.0;
        assert!(!any || engine.ghost_margin() > coupling.smoothing, "grains are known as far as they are smoothed");
        Self {
            engine,
            coupling,
            sources: Sources::new(coupling.smoothing),
            void: Vec::new(),
            around: Vec::new(),
            drag_rate: 0.0,
            diameter: Vec::new(),
            force: Vec::new(),
            shared: Vec::new(),
            places: Vec::new(),
            fluid: Binned::default(),
            impulses: Binned::default(),
            any,
            frozen: false,
        }
    }

    /// Holds the grains where they are, or lets them go again; held, they neither feel nor give drag.
    pub fn freeze(&mut self, frozen: bool) {
        self.frozen = frozen;
    }

    /// Whether the grains are held.
    #[must_use]
    pub fn is_frozen(&self) -> bool {
        self.frozen
    }

    /// Whether there are no grains on any rank.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        !self.any
    }

    /// The engine of the grains.
    #[must_use]
    pub fn engine(&self) -> &Engine {
        &self.engine
    }

    /// The engine of the grains, to be changed between steps.
    pub fn engine_mut(&mut self) -> &mut Engine {
        &mut self.engine
    }

    /// How grains and fluid act on each other.
    #[must_use]
    pub fn coupling(&self) -> &Coupling {
        &self.coupling
    }

    /// Void fraction around own grain `g`, without its own share, and the part of it that was wet at the start of the
    /// last step; zeros before the first one.
    #[must_use]
    pub fn surroundings(&self, g: usize) -> [Real; 2] {
        let kept = &self.engine.grains().attached[g];
        [kept[VOID], kept[WETNESS]]
    }

    /// Drag and pressure force on own grain `g` in the last step, means over the step [N].
    #[must_use]
    pub fn forces(&self, g: usize) -> [Vector; 2] {
        let kept = &self.engine.grains().attached[g];
        [DRAG_FORCE, PRESSURE_FORCE].map(|at| Vector::from_slice(&kept[at..at + 3]))
    }

    /// Void fraction at `position` [m] among the grains where [`Self::place`] last found them, no less than
    /// the least.
    #[must_use]
    pub fn void_fraction(&self, position: Vector) -> Real {
        let solid = if self.any { self.sources.fraction(position) } else { 0.0 };
        (1.0 - solid).max(self.coupling.least_void)
    }

    /// Volume of the grains of all ranks [m^3].
    pub(crate) fn solid_volume(&self, domain: &Domain) -> Real {
        let own = (0..self.engine.grains().owned()).map(|g| volume(diameter_of(&self.engine, g)));
        domain.sum([own.sum()])[0]
    }

    /// Takes note of where the grains are, and of their images in the walls of `tank`.
    pub fn place(&mut self, domain: &Domain, tank: &Tank) {
        if self.any {
            self.sources.fill(domain, tank, &self.engine, self.coupling.closure.density);
        }
    }

    /// What the grains make of each own fluid particle's surroundings; tells how many were cut and the smallest `eps`.
    pub fn voids(
        &mut self,
        kind: &[Kind],
        position: &[Vector],
        velocity: &[Vector],
        voids: &mut Voids<'_>,
    ) -> (usize, Real) {
        let gives_way = self.coupling.implicit_pressure_force && !self.frozen;
        let Self { sources, void, coupling, .. } = self;
        let (sources, least) = (&*sources, coupling.least_void);
        void.clear();
        void.resize(voids.bulk.len(), 1.0);
        let columns = (&mut void[..], &mut *voids.bulk, &mut *voids.bulk_rate, &mut *voids.mobile);
        for_each_chunk(columns, ROWS, |number, (void, bulk, rate, mobile)| {
            for (row, void) in void.iter_mut().enumerate() {
                let a = number * ROWS + row;
                (bulk[row], rate[row], mobile[row]) = (1.0, 0.0, 0.0);
                if kind[a] != Kind::Fluid {
                    continue;
                }
                let Some(solid) = sources.solid(position[a], velocity[a]) else {
                    continue;
                };
                *void = 1.0 - solid.fraction;
                let eps = void.max(least);
                bulk[row] = 1.0 / eps;
                if *void > least {
                    rate[row] = solid.rate / (eps * eps);
                }
                if gives_way {
                    mobile[row] = solid.mobile;
                }
            }
        });
        let smallest = void.iter().copied().fold(1.0, Real::min);
        (void.iter().filter(|eps| **eps <= least).count(), smallest)
    }

    /// Looks at the fluid around each own grain.
    pub(crate) fn look_around(&mut self, domain: &Domain, kernel: &Kernel, fluid: &Fluid<'_>) {
        let Self { engine, coupling, sources, around, diameter, fluid: binned, .. } = self;
        let grains = engine.grains();
        let owned = grains.owned();
        diameter.clear();
        diameter.extend((0..owned).map(|g| diameter_of(engine, g)));
        around.clear();
        around.resize(owned, Surroundings::default());
        let whole = WET * kernel.sums.number_density;
        fluid.put_into(binned, domain, kernel);
        let (binned, sources, diameter, least) = (&*binned, &*sources, &diameter[..], coupling.least_void);
        for_each_chunk(&mut around[..], ROWS, |number, around| {
            for (row, around) in around.iter_mut().enumerate() {
                let g = number * ROWS + row;
                let x = grains.position[g];
                let family = kernel.weight.family;
                let [support, gradient @ .., u, v, w] = binned.sum(family, x, |pair, fluid: &[Lanes; 10]| {
                    let [_, _, _, bulk, g1, g2, g3, u, v, w] = fluid;
                    let weight = lanes(|l| pair.weight[l] * bulk[l]);
                    let mean = |field: &Lanes| lanes(|l| weight[l] * field[l]);
                    [weight, mean(g1), mean(g2), mean(g3), mean(u), mean(v), mean(w)]
                });
                let mut sum = Surroundings { support, ..Surroundings::default() };
                if support > 0.0 {
                    sum.velocity = Vector::new(u, v, w) / support;
                    sum.gradient = Vector::from_array(gradient) / support;
                    sum.wetness = (support / whole).min(1.0);
                }
                let solid = sources.fraction(x);
                sum.void_fraction = (1.0 - sources.around(solid, diameter[g])).clamp(least, 1.0);
                *around = sum;
            }
        });
    }

    /// Reciprocal of the shortest time in which drag brought a grain and the fluid around it together in the last
    /// step [1/s].
    pub(crate) fn drag_rate(&self) -> Real {
        self.drag_rate
    }

    /// Takes up the rate of drag [1/s] of a restored state.
    pub(crate) fn set_drag_rate(&mut self, rate: Real) {
        self.drag_rate = rate;
    }

    /// See [`Self::drag_rate`], where the grains and the fluid around them are now.
    fn present_drag_rate(&self, domain: &Domain) -> Real {
        let grains = self.engine.grains();
        let density = self.coupling.closure.density;
        let rate = |g: usize| {
            let around = &self.around[g];
            let slip = (around.velocity - grains.velocity[g]).length();
            let d = self.diameter[g];
            let kappa = around.wetness * self.coupling.closure.coefficient(d, around.void_fraction, slip);
            let solid = 1.0 - around.void_fraction;
            let fluid = solid / (around.void_fraction * density * volume(d));
            kappa * (1.0 / grains.mass[g] + fluid)
        };
        largest(domain, self.around.len(), rate)
    }

    /// Largest speed of a grain [m/s].
    pub(crate) fn largest_speed(&self, domain: &Domain) -> Real {
        let grains = self.engine.grains();
        largest(domain, grains.owned(), |g| grains.velocity[g].length())
    }

    /// Largest speed of a grain over its diameter [1/s].
    pub(crate) fn motion_rate(&self, domain: &Domain) -> Real {
        let grains = self.engine.grains();
        let rate = |g: usize| grains.velocity[g].length() / diameter_of(&self.engine, g);
        largest(domain, grains.owned(), rate)
    }

    /// Moves the grains by `dt` [s] under contacts, drag, pressure and the body force [m/s^2], of which the gradient
    /// is without the part `reduced`.
    pub(crate) fn advance(
        &mut self,
        domain: &Domain,
        [body_force, reduced]: [Vector; 2],
        dt: Real,
        report: &mut CouplingReport,
    ) -> Result<ContactReport, DemError> {
        self.drag_rate = self.present_drag_rate(domain);
        let Self { engine, coupling, around, diameter, force, places, .. } = self;
        let density = coupling.closure.density;
        force.clear();
        force.extend(
            around
                .iter()
                .zip(&*diameter)
                .map(|(around, &d)| -around.wetness * volume(d) * (around.gradient + density * reduced)),
        );
        places.clear();
        places.extend((0..around.len()).map(|g| engine.grains().unwrapped_position(g)));
        for (g, kept) in engine.attached_mut().iter_mut().enumerate().take(around.len()) {
            kept[PLACE..PLACE + 3].copy_from_slice(&places[g].to_array());
            kept[SUPPORT] = around[g].support;
            kept[WETNESS] = around[g].wetness;
            kept[VOID] = around[g].void_fraction;
            kept[GRADIENT..GRADIENT + 3].copy_from_slice(&around[g].gradient.to_array());
            kept[PRESSURE_FORCE..PRESSURE_FORCE + 3].copy_from_slice(&force[g].to_array());
        }
        let drag = FluidDrag { closure: &coupling.closure, around, diameter };
        let loads = Loads { force, torque: &[], drag: Some(&drag) };
        let contacts = engine.advance(domain, &loads, body_force, dt, coupling.substeps)?;
        let grains = engine.grains();
        let mut sum = [0.0; 6];
        for g in 0..grains.owned() {
            let pressure = Vector::from_slice(&grains.attached[g][PRESSURE_FORCE..PRESSURE_FORCE + 3]);
            for d in 0..3 {
                sum[d] += grains.drag_impulse[g][d];
                sum[3 + d] += dt * pressure[d];
            }
        }
        let sum = domain.sum(sum);
        report.drag_on_grains = Vector::from_slice(&sum[..3]);
        report.pressure_on_grains = Vector::from_slice(&sum[3..]);
        places.clear();
        places.extend_from_slice(&grains.drag_impulse[..grains.owned()]);
        for (kept, impulse) in engine.attached_mut().iter_mut().zip(places) {
            kept[DRAG_FORCE..DRAG_FORCE + 3].copy_from_slice(&(*impulse / dt).to_array());
        }
        Ok(contacts)
    }

    /// Sets each own fluid particle's `change` to what drag took from it, as a velocity [m/s]; places and weights
    /// are those of the start of the step.
    #[allow(clippy::too_many_arguments, reason = "the fluid of the start of the step, in columns")]
    pub(crate) fn react(
        &mut self,
        domain: &Domain,
        kernel: &Kernel,
        particles: &Particles,
        bulk: &[Real],
        particle_mass: Real,
        change: &mut [Vector],
        report: &mut CouplingReport,
    ) {
        let Self { engine, shared, impulses, .. } = self;
        let grains = engine.grains();
        shared.clear();
        shared.resize(grains.len(), [0.0; 6]);
        for (g, shared) in shared.iter_mut().enumerate().take(grains.owned()) {
            let kept = &grains.attached[g];
            let support = kept[SUPPORT];
            let impulse = grains.drag_impulse[g];
            for d in 0..3 {
                shared[d] = kept[PLACE + d];
                shared[3 + d] = if support > 0.0 { impulse[d] / support } else { 0.0 };
            }
        }
        engine.share_with_ghosts(domain, shared);
        for (g, shared) in shared.iter_mut().enumerate() {
            let place = engine.image_position(Vector::from_slice(&shared[..3]), grains.image(g));
            shared[..3].copy_from_slice(&place.to_array());
        }
        let shared = &shared[..];
        // Beyond the radius more or fewer are known, by chance.
        let near = engine.vicinity(domain, kernel.weight.radius);
        impulses.fill(
            domain,
            kernel.weight.radius,
            shared.len(),
            |g| Some(Vector::from_slice(&shared[g][..3])).filter(|&place| near.contains(place)),
            |a, b| {
                let by = |d: usize| shared[a][d].total_cmp(&shared[b][d]);
                grains.id[a].cmp(&grains.id[b]).then_with(|| by(0).then_with(|| by(1)).then_with(|| by(2)))
            },
            |g| shared[g],
        );
        let impulses = &*impulses;
        for_each_chunk(&mut *change, ROWS, |number, change| {
            for (row, change) in change.iter_mut().enumerate() {
                let a = number * ROWS + row;
                *change = Vector::ZERO;
                if particles.kind[a] != Kind::Fluid || !impulses.is_near(particles.position[a]) {
                    continue;
                }
                let family = kernel.weight.family;
                let taken =
                    impulses.sum(family, particles.position[a], |pair, [_, _, _, impulse @ ..]: &[Lanes; 6]| {
                        impulse.map(|impulse| lanes(|l| pair.weight[l] * impulse[l]))
                    });
                *change = -bulk[a] / particle_mass * Vector::from_array(taken);
            }
        });
        let mut sum = [0.0; 3];
        for change in &*change {
            (0..3).for_each(|d| sum[d] += particle_mass * change[d]);
        }
        report.drag_on_fluid = Vector::from_array(domain.sum(sum));
    }

    /// Replaces the pressure force of the step, which saw the gradient of the step before, by that of the new one.
    pub(crate) fn correct_pressure_force(
        &mut self,
        domain: &Domain,
        kernel: &Kernel,
        fluid: &Fluid<'_>,
        dt: Real,
        report: &mut CouplingReport,
    ) {
        if !self.coupling.implicit_pressure_force {
            return;
        }
        let Self { engine, force, fluid: binned, .. } = self;
        fluid.put_into(binned, domain, kernel);
        let binned = &*binned;
        let grains = engine.grains();
        let owned = grains.owned();
        force.clear();
        force.resize(owned, Vector::ZERO);
        for_each_chunk(&mut force[..], ROWS, |number, force| {
            for (row, force) in force.iter_mut().enumerate() {
                let g = number * ROWS + row;
                let kept = &grains.attached[g];
                if kept[WETNESS] == 0.0 {
                    continue;
                }
                let x = grains.position[g];
                let family = kernel.weight.family;
                let [support, sum @ ..] = binned.sum(family, x, |pair, fluid: &[Lanes; 10]| {
                    let [_, _, _, bulk, g1, g2, g3, ..] = fluid;
                    let weight = lanes(|l| pair.weight[l] * bulk[l]);
                    let mean = |field: &Lanes| lanes(|l| weight[l] * field[l]);
                    [weight, mean(g1), mean(g2), mean(g3)]
                });
                if support > 0.0 {
                    let before = Vector::from_slice(&kept[GRADIENT..GRADIENT + 3]);
                    *force =
                        -kept[WETNESS] * volume(diameter_of(engine, g)) * (Vector::from_array(sum) / support - before);
                }
            }
        });
        let mut sum = [0.0; 3];
        for (kept, correction) in engine.attached_mut().iter_mut().zip(&*force) {
            (0..3).for_each(|d| kept[PRESSURE_FORCE + d] += correction[d]);
        }
        for impulse in force.iter_mut() {
            *impulse *= dt;
            (0..3).for_each(|d| sum[d] += impulse[d]);
        }
        engine.apply_impulses(domain, force);
        report.pressure_on_grains += Vector::from_array(domain.sum(sum));
    }
}

/// Columns of the own fluid particles that follow from where the grains are.
pub struct Voids<'a> {
    /// `1/eps`.
    pub bulk: &'a mut [Real],
    /// Its rate [1/s].
    pub bulk_rate: &'a mut [Real],
    /// Solid fraction times density of the fluid over that of the grains, where grains give way to the pressure.
    pub mobile: &'a mut [Real],
}

/// Largest `rate` of the first `count` grains, over all ranks; 0 without grains.
fn largest(domain: &Domain, count: usize, rate: impl Fn(usize) -> Real + Sync) -> Real {
    domain.max(reductions::largest(count, rate).max(0.0))
}

/// The fluid as grains see it, ghosts included.
pub(crate) struct Fluid<'a> {
    pub kind: &'a [Kind],
    pub position: &'a [Vector],
    pub velocity: &'a [Vector],
    pub gradient: &'a [Vector],
    pub bulk: &'a [Real],
}

impl Fluid<'_> {
    /// Puts all fluid particles in bins; their order within a bin is the one they have.
    fn put_into(&self, binned: &mut Binned<10>, domain: &Domain, kernel: &Kernel) {
        binned.fill(
            domain,
            kernel.weight.radius,
            self.position.len(),
            |a| (self.kind[a] == Kind::Fluid).then_some(self.position[a]),
            |a, b| a.cmp(&b),
            |a| {
                let (x, g, u) = (self.position[a], self.gradient[a], self.velocity[a]);
                [x.x, x.y, x.z, self.bulk[a], g.x, g.y, g.z, u.x, u.y, u.z]
            },
        );
    }
}
