//! A box with fluid and grains, and the loop that runs it.

use std::error::Error;

use sazanami_dem::{Body, DemError, Engine, Grain, Interactions, LinearSpringDashpot, Setup, Substeps, Wall};
use sazanami_numerics::domain::Domain;
use sazanami_numerics::grid::Grid;
use sazanami_numerics::{Real, Vector};

use sazanami_mps::boundary::{Side, Tank, WallFriction};
use sazanami_mps::grains::{AddedMass, DragIntegration, DragParameters, Lift, OverlapSettings, OverlappingGrains};
use sazanami_mps::pressure::Tolerance;
use sazanami_mps::scheme::{Fluid, Scheme};
use sazanami_mps::solver::{FluidParticle, ParticleSettings, Solver};
use sazanami_mps::stability::StepLimits;

/// Density of the grains [kg/m^3].
pub(super) const GRAIN_DENSITY: Real = 2650.0;
/// Diameter of the grains \[m].
pub(super) const DIAMETER: Real = 1e-3;
/// Density of the water [kg/m^3].
const DENSITY: Real = 1000.0;
/// Kinematic viscosity of the water [m^2/s].
const VISCOSITY: Real = 1e-6;
/// Acceleration of gravity [m/s^2].
const GRAVITY: Real = 9.81;
/// The same as a vector.
pub const DOWN: Vector = Vector::new(0.0, 0.0, -GRAVITY);

pub(super) const WALLS: [Side; 2] = [Side::Wall; 2];
pub(super) const PERIODIC: [Side; 2] = [Side::Periodic; 2];
pub(super) const OPEN: [Side; 2] = [Side::Open; 2];

/// A box with its lower corner at the origin, with fluid and grains before it runs.
#[derive(Clone, Debug)]
pub struct Vessel {
    /// Upper corner \[m].
    pub upper: Vector,
    /// Sides of the box.
    pub sides: [[Side; 2]; 3],
    /// Particle spacing \[m].
    pub spacing: Real,
    /// Scheme of the water.
    pub scheme: Scheme,
    /// Point at which the hydrostatic part of the pressure is zero \[m].
    pub reference: Vector,
    /// Fluid particles at the start.
    pub fluid: Vec<FluidParticle>,
    /// Grains, spheres of 1 mm.
    pub grains: Vec<Grain>,
}

impl Vessel {
    /// An empty box of `size` spacings.
    #[must_use]
    pub fn new(size: [usize; 3], spacing: Real, sides: [[Side; 2]; 3]) -> Self {
        Self {
            upper: spacing * Vector::from_array(size.map(|n| n as Real)),
            sides,
            spacing,
            scheme: Scheme::default(),
            reference: Vector::ZERO,
            fluid: Vec::new(),
            grains: Vec::new(),
        }
    }

    /// Adds water at rest on a lattice of `count` particles from the lower corner; the pressure is counted from its
    /// surface.
    #[must_use]
    pub fn filled(mut self, count: [usize; 3]) -> Self {
        let at_rest = |place| FluidParticle { position: self.spacing * place, velocity: Vector::ZERO };
        self.fluid.extend(lattice(count).map(at_rest));
        self.reference = self.spacing * Vector::new(0.0, 0.0, count[2] as Real);
        self
    }

    pub(super) fn domain(&self) -> Domain {
        let cell = 0.5 * (self.scheme.radius + 0.36) * self.spacing;
        let cells = self.upper.to_array().map(|length| ((length / cell).floor() as usize).max(1));
        Domain::solo(Grid::new(cells, Vector::ZERO, self.upper), self.sides.map(|sides| sides[0] == Side::Periodic))
    }

    pub(super) fn tank(&self) -> Tank {
        Tank::new(Vector::ZERO, self.upper, self.sides, WallFriction::NoSlip)
    }

    pub(super) fn engine(&self, domain: &Domain) -> Result<Engine, DemError> {
        let present = self.sides.map(|sides| sides.map(|side| side == Side::Wall));
        let around = Vector::splat(10.0 * DIAMETER) + self.upper;
        let setup = Setup {
            bodies: vec![Body::ball(0.5 * DIAMETER)],
            interactions: Interactions::uniform(1, LinearSpringDashpot::spheres(400.0, 0.5, 0.4)),
            walls: Wall::of_box(Vector::ZERO, self.upper, 0, present),
            region: [-around, self.upper + around],
            ghost_margin: 3.6 * DIAMETER.max(self.spacing),
        };
        Engine::new(domain, setup, &self.grains)
    }

    pub(super) fn overlapping_grains(&self, domain: &Domain) -> Result<OverlappingGrains, DemError> {
        if self.grains.is_empty() {
            return OverlappingGrains::none(domain);
        }
        let coupling = OverlapSettings {
            drag: DragParameters::recommended(DENSITY, DENSITY * VISCOSITY),
            smoothing: 3.0 * DIAMETER,
            least_void: 0.3,
            drag_integration: DragIntegration::Explicit,
            added_mass: AddedMass::NONE,
            lift: Lift::None,
            substeps: Substeps::Auto,
        };
        Ok(OverlappingGrains::new(domain, self.engine(domain)?, coupling))
    }

    /// The solver, on one rank.
    ///
    /// # Errors
    /// If box, fluid and grains do not fit.
    pub fn solver(&self) -> Result<Solver, Box<dyn Error>> {
        let domain = self.domain();
        let settings = ParticleSettings {
            fluid: Fluid { density: DENSITY, viscosity: VISCOSITY, spacing: self.spacing },
            scheme: self.scheme,
            limits: StepLimits { longest: 0.05 * (self.spacing / GRAVITY).sqrt(), ..StepLimits::default() },
            tolerance: Tolerance::default(),
            reference: self.reference,
        };
        let grains = self.overlapping_grains(&domain)?;
        Ok(Solver::new(domain, settings, self.tank(), &self.fluid, grains)?)
    }
}

/// Places of a lattice of unit spacing, half a spacing from the planes through the origin.
pub(super) fn lattice([n1, n2, n3]: [usize; 3]) -> impl Iterator<Item = Vector> {
    let at = |n: usize| n as Real + 0.5;
    (0..n3).flat_map(move |k| (0..n2).flat_map(move |j| (0..n1).map(move |i| Vector::new(at(i), at(j), at(k)))))
}

/// Kinetic energy of the fluid \[J].
pub(super) fn kinetic_energy(solver: &Solver) -> Real {
    let [square] = solver.sum_over_fluid(|p, a| [p.velocity[a].length_squared()]);
    0.5 * solver.particle_mass() * square
}

/// An energy as it is seen from step to step, over what it was at first.
pub(super) struct Energy {
    first: Real,
    least: Real,
    /// Energy in the last step seen.
    pub last: Real,
    /// The largest rise above the least before it.
    pub rise: Real,
}

impl Energy {
    pub fn new(first: Real) -> Self {
        Self { first, least: 1.0, last: 1.0, rise: 0.0 }
    }

    pub fn see(&mut self, now: Real) {
        self.last = now / self.first;
        self.least = self.least.min(self.last);
        self.rise = self.rise.max(self.last - self.least);
    }
}
