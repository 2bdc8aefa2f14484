//! Coupling with the grains by overlap: void fraction, drag, pressure force, and the reaction on the fluid.
//!
//! Grains are spheres. The void fraction is a smooth sum over grains with an analytic rate. Fluid velocity and pressure
//! gradient at a grain are means over the fluid particles within the radius of influence, weighted by `w/eps`; the drag
//! on the grain is returned to the same particles with the same weights, so that momentum is conserved.

mod added_mass;
mod binned;
mod drag;
mod exchange;
mod gusts;
mod kept;
mod lift;
mod loads;
mod reading;
mod report;
mod sources;

use sazanami_dem::{DemError, Engine, Interactions, LinearSpringDashpot, Motion, Setup, Substeps};
use sazanami_numerics::domain::Domain;
use sazanami_numerics::{Real, Vector};
use sazanami_parallel::for_each_chunk;

pub use added_mass::{AddedMass, AddedMassForm};
use binned::Binned;
pub use drag::{DragForm, DragIntegration, DragLaw, DragParameters, Forchheimer, volume};
use exchange::GIVEN;
use kept::{ADDED_MASS_FORCE, DRAG_FORCE, LIFT_FORCE, PRESSURE_FORCE, SHARE, VOID, WETNESS, vector};
pub use lift::{Lift, lift_force};
use reading::{READ, Reading};
pub use report::CouplingReport;
pub(crate) use report::VoidReport;
use sources::Sources;

use crate::boundary::Tank;
use crate::context::Context;
pub use crate::context::Voids;
use crate::gates::Gate;
use crate::ghosts::Ghosts;
use crate::neighbours::ROWS;
use crate::particles::{Kind, Particles};
use crate::reductions;

/// Parameters of the coupling between grains and fluid.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct OverlapSettings {
    /// Drag law of the grains.
    pub drag: DragParameters,
    /// Smoothing radius R_eps of the void fraction, within which a grain reads the fluid and gives the drag back \[m].
    pub smoothing: Real,
    /// Lower bound of the void fraction.
    pub least_void: Real,
    /// Time level of the fluid velocity in the drag of a step.
    pub drag_integration: DragIntegration,
    /// Fluid that grains accelerate with themselves.
    pub added_mass: AddedMass,
    /// Lift of grains in sheared fluid.
    pub lift: Lift,
    /// Contact sub-steps per step.
    pub substeps: Substeps,
}

impl OverlapSettings {
    /// Whether grains and fluid exchange momentum beside drag and pressure.
    fn has_more_than_drag(&self) -> bool {
        self.added_mass.is_some() || self.lift != Lift::None
    }
}

/// Fluid interpolated at a grain at the start of a step.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct FluidAtGrain {
    /// Velocity of the fluid [m/s].
    pub velocity: Vector,
    /// Velocity of the fluid beside that, by turbulence that is not resolved [m/s].
    pub gust: Vector,
    /// Force of the pressure of the step before, beyond the hydrostatic one, over the volume of the grain [Pa/m].
    pub pressing: Vector,
    /// Part of the grain that water reaches: twice the sum of the weights, at most 1. Drag, lift and added mass go by it.
    pub wetness: Real,
    /// Part of the grain's volume below the level of the water around it, by which the hydrostatic pressure acts.
    pub submerged: Real,
    /// Void fraction, without the contribution of the grain itself.
    pub void_fraction: Real,
    /// One over the mass of the fluid that yields to the drag on the grain [1/kg]; 0 where the drag is explicit for the fluid.
    pub inverse_fluid_mass: Real,
    /// One over the mass of the fluid that yields to the added mass [1/kg].
    inverse_moved_mass: Real,
    /// Lift on the grain \[N].
    lift: Vector,
    /// Whether too few particles are around for a vorticity.
    without_vorticity: bool,
    /// Sum of the weights of the fluid particles: 1 in water all round.
    share: Real,
    /// Drag coefficient by the void fractions at the particles over that by the one at the grain.
    drag_factor: Real,
    /// Weight of a particle over that of its bulk: the first, and the second times the cube of its solid fraction.
    weights: [Real; 2],
}

/// The grains of one rank and their coupling to the fluid.
#[derive(Debug)]
pub struct OverlappingGrains {
    engine: Engine,
    coupling: OverlapSettings,
    sources: Sources,
    /// Void fraction at each own fluid particle before the lower bound is applied.
    void: Vec<Real>,
    around: Vec<FluidAtGrain>,
    /// Reciprocal of the shortest drag relaxation time of a grain and the fluid around it in the last step, over all
    /// ranks [1/s].
    drag_rate: Real,
    /// The same before the first step, and the first after grains were let go, with grains and fluid at rest; none once grains were
    /// stepped.
    first_drag_rate: Option<Real>,
    diameter: Vec<Real>,
    force: Vec<Vector>,
    /// Added mass of each grain and ghost, empty without \[kg].
    added: Vec<[Real; 1]>,
    shared: Vec<[Real; GIVEN]>,
    places: Vec<Vector>,
    /// Fluid in bins at the start of the step.
    fluid: Binned<READ>,
    /// Bulk volume of each particle and ghost times the scale of the smoothing function.
    bulk: Vec<Real>,
    /// Velocity of each own particle that grains feel [m/s].
    felt: Vec<Vector>,
    readings: Vec<Reading>,
    /// Grains and their images that give back to the fluid.
    givers: Vec<[Real; GIVEN]>,
    giver_ids: Vec<u64>,
    /// The same in bins.
    impulses: Binned<GIVEN>,
    /// Gates where they are in the step.
    gates: Vec<Gate>,
    /// Whether there are, were or will be grains on any rank.
    any: bool,
    frozen: bool,
}

/// Diameter of grain `g`, a sphere \[m].
#[must_use]
pub fn diameter_of(engine: &Engine, g: usize) -> Real {
    let grains = engine.grains();
    2.0 * engine.bodies()[grains.shape[g] as usize].bounding_radius * grains.scale[g]
}

impl OverlappingGrains {
    /// No grains.
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
        let coupling = OverlapSettings {
            drag: DragParameters::recommended(1.0, 0.0),
            smoothing: 1.0,
            least_void: 1.0,
            drag_integration: DragIntegration::Explicit,
            added_mass: AddedMass::NONE,
            lift: Lift::None,
            substeps: Substeps::Auto,
        };
        Ok(Self::new(domain, Engine::new(domain, setup, &[])?, coupling))
    }

    /// The spheres of `engine`, coupled to the fluid.
    ///
    /// # Panics
    /// If the ghost margin of the engine is not larger than the smoothing radius of the void fraction.
    #[must_use]
    pub fn new(domain: &Domain, mut engine: Engine, coupling: OverlapSettings) -> Self {
        engine.own_promptly(true);
        let there = engine.grains().owned() > 0 || engine.expects_arrivals() || engine.departures().grains > 0;
        let any = domain.max(if there { 1.0 } else { 0.0 }) > 0.0;
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
            first_drag_rate: None,
            diameter: Vec::new(),
            force: Vec::new(),
            added: Vec::new(),
            shared: Vec::new(),
            places: Vec::new(),
            fluid: Binned::default(),
            bulk: Vec::new(),
            felt: Vec::new(),
            readings: Vec::new(),
            givers: Vec::new(),
            giver_ids: Vec::new(),
            impulses: Binned::default(),
            gates: Vec::new(),
            any,
            frozen: false,
        }
    }

    /// Holds the grains in place or releases them; held grains exchange no momentum with the fluid, and keep their velocities until
    /// they are released.
    pub fn freeze(&mut self, frozen: bool) {
        self.frozen = frozen;
    }

    /// Whether there are no grains on any rank, were none and will be none.
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
    pub fn coupling(&self) -> &OverlapSettings {
        &self.coupling
    }

    /// Void fraction at own grain `g` without its own contribution, and its wet fraction, at the start of the last step;
    /// zeros before the first step.
    #[must_use]
    pub fn surroundings(&self, g: usize) -> [Real; 2] {
        let kept = &self.engine.grains().attached[g];
        [kept[VOID], kept[WETNESS]]
    }

    /// Part of the volume of own grain `g` below the level of the water around it, at the start of the last step.
    #[must_use]
    pub fn submerged(&self, g: usize) -> Real {
        let share = self.engine.grains().attached[g][SHARE];
        reading::submerged(share, diameter_of(&self.engine, g) / self.sources.smoothing().0)
    }

    /// Mean drag, pressure force, lift and force of the added mass on own grain `g` in the last step \[N].
    #[must_use]
    pub fn forces(&self, g: usize) -> [Vector; 4] {
        let kept = &self.engine.grains().attached[g];
        [DRAG_FORCE, PRESSURE_FORCE, LIFT_FORCE, ADDED_MASS_FORCE].map(|at| vector(kept, at))
    }

    /// Void fraction at `position` \[m] for the grain positions at the last [`Self::place`], not below its lower bound.
    #[must_use]
    pub fn void_fraction(&self, position: Vector) -> Real {
        let solid = if self.any { self.sources.fraction(position) } else { 0.0 };
        (1.0 - solid).max(self.coupling.least_void)
    }

    /// Sets the velocity of the walls that grains touch, and puts the gates.
    ///
    /// # Errors
    /// [`DemError::NoPlate`] if the grains do not have a plate for each gate.
    pub(crate) fn begin_step(&mut self, step: &Context<'_>, gates: &[Gate]) -> Result<(), DemError> {
        self.carry_with_fluid(step.dt);
        self.engine.set_wall_velocities(step.domain, step.forcing.wall_velocity);
        self.gates.clear();
        self.gates.extend_from_slice(gates);
        let felt = if self.any { gates } else { &[] };
        felt.iter().enumerate().try_for_each(|(n, gate)| self.engine.set_plate(n, gate.span(), gate.velocity))
    }

    /// Whether grains and fluid exchange momentum, and the pressure of a step moves grains in the same step.
    pub(crate) fn is_active(&self) -> bool {
        self.any && !self.frozen
    }

    /// Distance between fluid particles at the lower bound of the void fraction over that in clear water.
    pub(crate) fn widest_size(&self) -> Real {
        if self.any { self.coupling.least_void.cbrt().recip() } else { 1.0 }
    }

    /// Radius of the smoothing function of void fractions, within which grains read the pressure; 0 without grains \[m].
    pub(crate) fn smoothing(&self) -> Real {
        if self.any { self.coupling.smoothing } else { 0.0 }
    }

    /// Volume of the grains of all ranks [m^3].
    pub(crate) fn solid_volume(&self, domain: &Domain) -> Real {
        let own = (0..self.engine.grains().owned()).map(|g| volume(diameter_of(&self.engine, g)));
        domain.sum([own.sum()])[0]
    }

    /// Mass \[kg] and volume [m^3] of the grains of all ranks that nothing holds or drives.
    pub(crate) fn free_sums(&self, domain: &Domain) -> [Real; 2] {
        let grains = self.engine.grains();
        let free = (0..grains.owned()).filter(|&g| grains.motion[g] == Motion::Free);
        domain.sum(
            free.fold([0.0; 2], |[mass, all], g| [mass + grains.mass[g], all + volume(diameter_of(&self.engine, g))]),
        )
    }

    /// Mass \[kg], volume [m^3] and volume times velocity [m^4/s] of the grains of all ranks.
    pub(crate) fn sums(&self, domain: &Domain) -> [Real; 5] {
        let grains = self.engine.grains();
        domain.sum((0..grains.owned()).fold([0.0; 5], |sum, g| {
            let volume = volume(diameter_of(&self.engine, g));
            let [x, y, z] = (volume * grains.velocity[g]).to_array();
            let own = [grains.mass[g], volume, x, y, z];
            std::array::from_fn(|n| sum[n] + own[n])
        }))
    }

    /// Updates the grain positions that void fractions are computed from, with mirror images in the walls of `tank`.
    pub fn place(&mut self, domain: &Domain, tank: &Tank) {
        if self.any {
            self.share_added_mass(domain);
            let (grains, density) = ((&self.engine, self.frozen), self.coupling.drag.density);
            self.sources.fill(domain, tank, grains, density, self.added.as_flattened());
        }
    }

    /// Void fraction at all particles and ghosts, at their present or predicted `motion`. Without grains the fluid is clear.
    pub(crate) fn void_fractions(
        &mut self,
        step: &Context<'_>,
        tank: &Tank,
        particles: &Particles,
        (position, velocity): (&[Vector], &[Vector]),
        ghosts: &mut Ghosts,
        voids: &mut Voids,
    ) -> VoidReport {
        if !self.any {
            return VoidReport::default();
        }
        self.place(step.domain, tank);
        let (cut, smallest) = self.voids(&particles.kind[..particles.owned], position, velocity, voids);
        let cut = step.domain.sum([cut as Real])[0] as usize;
        let least = step.domain.min(smallest);
        voids.refresh(step.domain, ghosts);
        VoidReport { cut, least }
    }

    /// Void fraction of fluid particles at `position` \[m] that move with `velocity` [m/s]: sets the columns of `voids` for
    /// as many as there are kinds. Returns the number at the lower bound and the smallest `eps`.
    pub fn voids(
        &mut self,
        kind: &[Kind],
        position: &[Vector],
        velocity: &[Vector],
        voids: &mut Voids,
    ) -> (usize, Real) {
        let count = kind.len();
        let gives_way = self.is_active();
        let Self { sources, void, coupling, .. } = self;
        let (sources, least) = (&*sources, coupling.least_void);
        void.clear();
        void.resize(count, 1.0);
        let Voids { inverse, inverse_rate, grain_mobility } = voids;
        let columns = (&mut void[..], &mut inverse[..count], &mut inverse_rate[..count], &mut grain_mobility[..count]);
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
        let void = &void[..];
        let [cut] = reductions::sum_of(count, |a| [if void[a] <= least { 1.0 } else { 0.0 }]);
        (cut as usize, -reductions::largest(count, |a| -void[a]).max(-1.0))
    }

    /// Reciprocal of the shortest drag relaxation time in the last step [1/s].
    pub(crate) fn drag_rate(&self) -> Real {
        self.drag_rate
    }

    /// The drag rate that limits the next step [1/s]: none where the drag is implicit or the grains are held; before the first step
    /// that of fluid at rest, and at least that where grains were let go since the last one.
    pub(crate) fn limiting_drag_rate(&self) -> Real {
        if self.coupling.drag_integration == DragIntegration::Implicit || !self.is_active() {
            return 0.0;
        }
        self.first_drag_rate.map_or(self.drag_rate, |first| first.max(self.drag_rate))
    }

    /// Whether the last step had grains of which none felt drag.
    pub(crate) fn stepped_without_drag(&self) -> bool {
        !self.is_empty() && self.first_drag_rate.is_none() && self.drag_rate == 0.0
    }

    /// Restores the drag rate [1/s] of a snapshot, that of the last step if there was one.
    pub(crate) fn set_drag_rate(&mut self, rate: Real, stepped: bool) {
        self.drag_rate = rate;
        if stepped {
            self.first_drag_rate = None;
        }
    }

    /// Largest speed of a grain relative to a velocity `frame` [m/s].
    pub(crate) fn largest_speed(&self, domain: &Domain, frame: Vector) -> Real {
        largest(domain, self.engine.grains().owned(), |g| (self.motion(g) - frame).length())
    }

    /// Largest speed of a grain over its diameter [1/s].
    pub(crate) fn motion_rate(&self, domain: &Domain) -> Real {
        let rate = |g: usize| self.motion(g).length() / diameter_of(&self.engine, g);
        largest(domain, self.engine.grains().owned(), rate)
    }

    /// Velocity with which own grain `g` moves [m/s]: none while the grains are held in place.
    fn motion(&self, g: usize) -> Vector {
        if self.frozen { Vector::ZERO } else { self.engine.grains().velocity[g] }
    }
}

/// Maximum of `rate` over the first `count` grains of all ranks; 0 without grains.
fn largest(domain: &Domain, count: usize, rate: impl Fn(usize) -> Real + Sync) -> Real {
    domain.max(reductions::largest(count, rate).max(0.0))
}
