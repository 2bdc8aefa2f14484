//! Coupling with the grains by overlap: void fraction, drag, pressure force, and the reaction on the fluid.
//!
//! Grains are spheres. The void fraction is a smooth sum over grains with an analytic rate. Fluid velocity and pressure
//! gradient at a grain are means over the fluid particles within the radius of influence, weighted by `w/eps`; the drag
//! on the grain is returned to the same particles with the same weights, so that momentum is conserved.

mod binned;
mod drag;
mod sources;

use sazanami_dem::{
    ContactReport, DemError, Drag, Engine, Grains, Interactions, LinearSpringDashpot, Loads, Setup, Substeps,
};
use sazanami_numerics::domain::Domain;
use sazanami_numerics::{Real, Vector};
use sazanami_parallel::for_each_chunk;

use binned::{Binned, Lanes, lanes};
use drag::ForDragLaw;
pub use drag::{DensityReference, DragForm, DragLaw, DragParameters, Forchheimer, SphereDrag, volume};
use sources::Sources;

use crate::boundary::Tank;
use crate::neighbours::ROWS;
use crate::particles::{Kind, Particles};
use crate::reductions;
use crate::scheme::Kernel;

/// Sum of weights over n0 above which a grain is fully wet.
const WET: Real = 0.5;

/// Parameters of the coupling between grains and fluid.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Coupling {
    /// Drag law of the grains.
    pub drag: DragParameters,
    /// Smoothing radius R_eps of the void fraction [m].
    pub smoothing: Real,
    /// Lower bound of the void fraction.
    pub least_void: Real,
    /// Whether the pressure force on grains is that of the same step, with the acceleration of the grains in the pressure
    /// equation; otherwise it is that of the previous step, which is stable only for heavy grains.
    pub implicit_pressure_force: bool,
    /// Contact sub-steps per step.
    pub substeps: Substeps,
}

/// Fluid interpolated at a grain at the start of a step.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct FluidAtGrain {
    /// Velocity of the fluid [m/s].
    pub velocity: Vector,
    /// Gradient of the reduced pressure [Pa/m].
    pub gradient: Vector,
    /// Wet fraction of the grain.
    pub wetness: Real,
    /// Void fraction, without the contribution of the grain itself.
    pub void_fraction: Real,
    /// Sum of the weights of the fluid particles.
    support: Real,
}

/// Report of the coupling in a step, over all ranks.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct CouplingReport {
    /// Fluid particles whose void fraction was raised to the lower bound.
    pub cut_voids: usize,
    /// Smallest void fraction of a fluid particle before the lower bound was applied.
    pub least_void: Real,
    /// Impulse of the drag on the grains [N s].
    pub drag_on_grains: Vector,
    /// Impulse of the drag on the fluid [N s].
    pub drag_on_fluid: Vector,
    /// Impulse of the pressure on the grains, buoyancy included [N s].
    pub pressure_on_grains: Vector,
}

/// Layout of the numbers attached to each grain by the engine.
const PLACE: usize = 0;
const SUPPORT: usize = 3;
const WETNESS: usize = 4;
const GRADIENT: usize = 5;
/// Drag and pressure force on a grain in the last step, for output [N].
const DRAG_FORCE: usize = 8;
const PRESSURE_FORCE: usize = 11;
const VOID: usize = 14;

/// The grains of one rank and their coupling to the fluid.
#[derive(Debug)]
pub struct GrainPhase {
    engine: Engine,
    coupling: Coupling,
    sources: Sources,
    /// Void fraction at each own fluid particle before the lower bound is applied.
    void: Vec<Real>,
    around: Vec<FluidAtGrain>,
    /// Reciprocal of the shortest drag relaxation time of a grain and the fluid around it in the last step, over all
    /// ranks [1/s].
    drag_rate: Real,
    diameter: Vec<Real>,
    force: Vec<Vector>,
    shared: Vec<[Real; 6]>,
    places: Vec<Vector>,
    /// Fluid in bins: positions, `1/eps`, pressure gradients, velocities.
    fluid: Binned<10>,
    /// Grains in bins: positions at the start of the step, drag impulse over the sum of weights.
    impulses: Binned<6>,
    /// Whether there are grains on any rank.
    any: bool,
    frozen: bool,
}

/// Drag on the own grains in the contact sub-steps of a step.
struct FluidDrag<'a, L> {
    law: &'a L,
    around: &'a [FluidAtGrain],
    diameter: &'a [Real],
}

impl<L: DragLaw> Drag for FluidDrag<'_, L> {
    fn fluid_velocity(&self, own: usize) -> Vector {
        self.around[own].velocity
    }

    fn coefficient(&self, own: usize, slip: Real) -> Real {
        let around = &self.around[own];
        if around.wetness == 0.0 {
            return 0.0;
        }
        around.wetness * self.law.coefficient(self.diameter[own], around.void_fraction, slip)
    }
}

/// The contact sub-steps of a step, with drag.
struct Advance<'a> {
    domain: &'a Domain,
    engine: &'a mut Engine,
    around: &'a [FluidAtGrain],
    diameter: &'a [Real],
    /// Pressure force [N].
    force: &'a [Vector],
    body_force: Vector,
    dt: Real,
    substeps: Substeps,
}

impl ForDragLaw for Advance<'_> {
    type Output = Result<ContactReport, DemError>;

    fn run<L: DragLaw>(self, law: &L) -> Self::Output {
        let Self { domain, engine, around, diameter, force, body_force, dt, substeps } = self;
        let drag = FluidDrag { law, around, diameter };
        engine.advance(domain, &Loads { force, torque: &[], drag: Some(&drag) }, body_force, dt, substeps)
    }
}

/// The shortest drag relaxation time of the grains and the fluid around them.
struct DragRate<'a> {
    domain: &'a Domain,
    grains: &'a Grains,
    /// Density of the fluid [kg/m^3].
    density: Real,
    around: &'a [FluidAtGrain],
    diameter: &'a [Real],
}

impl ForDragLaw for DragRate<'_> {
    /// Its reciprocal, over all ranks [1/s].
    type Output = Real;

    fn run<L: DragLaw>(self, law: &L) -> Real {
        let Self { domain, grains, density, around, diameter } = self;
        let rate = |g: usize| {
            let around = &around[g];
            let slip = (around.velocity - grains.velocity[g]).length();
            let d = diameter[g];
            let kappa = around.wetness * law.coefficient(d, around.void_fraction, slip);
            let solid = 1.0 - around.void_fraction;
            let fluid = solid / (around.void_fraction * density * volume(d));
            kappa * (1.0 / grains.mass[g] + fluid)
        };
        largest(domain, around.len(), rate)
    }
}

/// Diameter of grain `g`, a sphere [m].
#[must_use]
pub fn diameter_of(engine: &Engine, g: usize) -> Real {
    let grains = engine.grains();
    2.0 * engine.bodies()[grains.shape[g] as usize].bounding_radius * grains.scale[g]
}

impl GrainPhase {
    /// A phase without grains.
    ///
    /// # Errors
    /// Those of [`Engine::new`]; none are known for an engine without grains.
    pub fn none(domain: &Domain) -> Result<Self, DemError> {
        let setup = Setup {
            bodies: Vec::new(),
            interactions: Interactions::uniform(0, LinearSpringDashpot::SAND),
            walls: Vec::new(),
            region: [Vector::NEG_INFINITY, Vector::INFINITY],
            ghost_margin: 0.0,
        };
        let coupling = Coupling {
            drag: DragParameters::recommended(1.0, 0.0),
            smoothing: 1.0,
            least_void: 1.0,
            implicit_pressure_force: false,
            substeps: Substeps::Auto,
        };
        Ok(Self::new(domain, Engine::new(domain, setup, &[])?, coupling))
    }

    /// The spheres of `engine`, coupled to the fluid.
    ///
    /// # Panics
    /// If the ghost margin of the engine is not larger than the smoothing radius of the void fraction.
    #[must_use]
    pub fn new(domain: &Domain, engine: Engine, coupling: Coupling) -> Self {
        let any = domain.max(if engine.grains().owned() > 0 { 1.0 } else { 0.0 }) > 0.0;
        assert!(
            !any || engine.ghost_margin() > coupling.smoothing,
            "ghost margin of the grains exceeds the smoothing radius"
        );
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

    /// Holds the grains in place or releases them; held grains exchange no momentum with the fluid.
    pub fn freeze(&mut self, frozen: bool) {
        self.frozen = frozen;
    }

    /// Whether the grains are held in place.
    #[must_use]
    pub fn is_frozen(&self) -> bool {
        self.frozen
    }

    /// Whether there are no grains on any rank.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        !self.any
    }

    /// Contact engine of the grains.
    #[must_use]
    pub fn engine(&self) -> &Engine {
        &self.engine
    }

    /// Mutable access to the contact engine, between steps.
    pub fn engine_mut(&mut self) -> &mut Engine {
        &mut self.engine
    }

    /// Parameters of the coupling between grains and fluid.
    #[must_use]
    pub fn coupling(&self) -> &Coupling {
        &self.coupling
    }

    /// Void fraction at own grain `g` without its own contribution, and its wet fraction, at the start of the last step;
    /// zeros before the first step.
    #[must_use]
    pub fn surroundings(&self, g: usize) -> [Real; 2] {
        let kept = &self.engine.grains().attached[g];
        [kept[VOID], kept[WETNESS]]
    }

    /// Mean drag and pressure force on own grain `g` in the last step [N].
    #[must_use]
    pub fn forces(&self, g: usize) -> [Vector; 2] {
        let kept = &self.engine.grains().attached[g];
        [DRAG_FORCE, PRESSURE_FORCE].map(|at| Vector::from_slice(&kept[at..at + 3]))
    }

    /// Void fraction at `position` [m] for the grain positions at the last [`Self::place`], not below its lower bound.
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

    /// Updates the grain positions that void fractions are computed from, with mirror images in the walls of `tank`.
    pub fn place(&mut self, domain: &Domain, tank: &Tank) {
        if self.any {
            self.sources.fill(domain, tank, &self.engine, self.coupling.drag.density);
        }
    }

    /// Void fraction columns of the own fluid particles; returns the number at the lower bound and the smallest `eps`.
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
        void.resize(voids.inverse_void.len(), 1.0);
        let columns =
            (&mut void[..], &mut *voids.inverse_void, &mut *voids.inverse_void_rate, &mut *voids.grain_mobility);
        for_each_chunk(columns, ROWS, |number, (void, inverse_void, rate, grain_mobility)| {
            for (row, void) in void.iter_mut().enumerate() {
                let a = number * ROWS + row;
                (inverse_void[row], rate[row], grain_mobility[row]) = (1.0, 0.0, 0.0);
                if kind[a] != Kind::Fluid {
                    continue;
                }
                let Some(solid) = sources.solid(position[a], velocity[a]) else {
                    continue;
                };
                *void = 1.0 - solid.fraction;
                let eps = void.max(least);
                inverse_void[row] = 1.0 / eps;
                if *void > least {
                    rate[row] = solid.rate / (eps * eps);
                }
                if gives_way {
                    grain_mobility[row] = solid.grain_mobility;
                }
            }
        });
        let smallest = void.iter().copied().fold(1.0, Real::min);
        (void.iter().filter(|eps| **eps <= least).count(), smallest)
    }

    /// Interpolates the fluid at each own grain.
    pub(crate) fn interpolate_fluid(&mut self, domain: &Domain, kernel: &Kernel, fluid: &Fluid<'_>) {
        let Self { engine, coupling, sources, around, diameter, fluid: binned, .. } = self;
        let grains = engine.grains();
        let owned = grains.owned();
        diameter.clear();
        diameter.extend((0..owned).map(|g| diameter_of(engine, g)));
        around.clear();
        around.resize(owned, FluidAtGrain::default());
        let whole = WET * kernel.sums.number_density;
        fluid.put_into(binned, domain, kernel);
        let (binned, sources, diameter, least) = (&*binned, &*sources, &diameter[..], coupling.least_void);
        for_each_chunk(&mut around[..], ROWS, |number, around| {
            for (row, around) in around.iter_mut().enumerate() {
                let g = number * ROWS + row;
                let x = grains.position[g];
                let family = kernel.weight.family;
                let [support, gradient @ .., u, v, w] = binned.sum(family, x, |pair, fluid: &[Lanes; 10]| {
                    let [_, _, _, inverse_void, g1, g2, g3, u, v, w] = fluid;
                    let weight = lanes(|l| pair.weight[l] * inverse_void[l]);
                    let mean = |field: &Lanes| lanes(|l| weight[l] * field[l]);
                    [weight, mean(g1), mean(g2), mean(g3), mean(u), mean(v), mean(w)]
                });
                let mut sum = FluidAtGrain { support, ..FluidAtGrain::default() };
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

    /// Reciprocal of the shortest drag relaxation time in the last step [1/s].
    pub(crate) fn drag_rate(&self) -> Real {
        self.drag_rate
    }

    /// Restores the drag rate [1/s] of a snapshot.
    pub(crate) fn set_drag_rate(&mut self, rate: Real) {
        self.drag_rate = rate;
    }

    /// The [`Self::drag_rate`] of the present state.
    fn present_drag_rate(&self, domain: &Domain) -> Real {
        let Self { engine, coupling, around, diameter, .. } = self;
        coupling.drag.run(DragRate {
            domain,
            grains: engine.grains(),
            density: coupling.drag.density,
            around,
            diameter,
        })
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

    /// Advances the grains by `dt` [s] under contacts, drag, pressure and the body force [m/s^2]; the gradient is that of
    /// the pressure without the hydrostatic part of `reduced`.
    pub(crate) fn advance(
        &mut self,
        domain: &Domain,
        [body_force, reduced]: [Vector; 2],
        dt: Real,
        report: &mut CouplingReport,
    ) -> Result<ContactReport, DemError> {
        self.drag_rate = self.present_drag_rate(domain);
        let Self { engine, coupling, around, diameter, force, places, .. } = self;
        let density = coupling.drag.density;
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
        let substeps = coupling.substeps;
        let contacts =
            coupling.drag.run(Advance { domain, engine, around, diameter, force, body_force, dt, substeps })?;
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

    /// Sets `change` to the velocity change of each own fluid particle by drag [m/s], with positions and weights of the
    /// start of the step.
    #[allow(clippy::too_many_arguments, reason = "the fluid of the start of the step, in columns")]
    pub(crate) fn return_drag(
        &mut self,
        domain: &Domain,
        kernel: &Kernel,
        particles: &Particles,
        inverse_void: &[Real],
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
        // Which ghosts are known beyond the radius is arbitrary.
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
                *change = -inverse_void[a] / particle_mass * Vector::from_array(taken);
            }
        });
        let mut sum = [0.0; 3];
        for change in &*change {
            (0..3).for_each(|d| sum[d] += particle_mass * change[d]);
        }
        report.drag_on_fluid = Vector::from_array(domain.sum(sum));
    }

    /// Corrects the pressure force of the step from the gradient of the previous step to that of the new pressure.
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
                    let [_, _, _, inverse_void, g1, g2, g3, ..] = fluid;
                    let weight = lanes(|l| pair.weight[l] * inverse_void[l]);
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

/// Columns of the own fluid particles that depend on the grain positions.
pub struct Voids<'a> {
    /// Inverse void fraction `1/eps`.
    pub inverse_void: &'a mut [Real],
    /// Material rate of change of `1/eps` [1/s].
    pub inverse_void_rate: &'a mut [Real],
    /// `(1 - eps) rho/rho_s`, where grains are accelerated by the pressure of the same step; 0 elsewhere.
    pub grain_mobility: &'a mut [Real],
}

/// Maximum of `rate` over the first `count` grains of all ranks; 0 without grains.
fn largest(domain: &Domain, count: usize, rate: impl Fn(usize) -> Real + Sync) -> Real {
    domain.max(reductions::largest(count, rate).max(0.0))
}

/// Columns of the fluid that grains interpolate, ghosts included.
pub(crate) struct Fluid<'a> {
    pub kind: &'a [Kind],
    pub position: &'a [Vector],
    pub velocity: &'a [Vector],
    pub gradient: &'a [Vector],
    pub inverse_void: &'a [Real],
}

impl Fluid<'_> {
    /// Sorts the fluid particles into bins, in their present order.
    fn put_into(&self, binned: &mut Binned<10>, domain: &Domain, kernel: &Kernel) {
        binned.fill(
            domain,
            kernel.weight.radius,
            self.position.len(),
            |a| (self.kind[a] == Kind::Fluid).then_some(self.position[a]),
            |a, b| a.cmp(&b),
            |a| {
                let (x, g, u) = (self.position[a], self.gradient[a], self.velocity[a]);
                [x.x, x.y, x.z, self.inverse_void[a], g.x, g.y, g.z, u.x, u.y, u.z]
            },
        );
    }
}
