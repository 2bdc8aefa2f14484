//! Small tanks for tests.

use sazanami_dem::{Body, Engine, Grain, Interactions, LinearSpringDashpot, Setup, Substeps, Wall};
use sazanami_mps::boundary::{Side, Tank, WallFriction};
use sazanami_mps::gates::Gate;
use sazanami_mps::grains::{AddedMass, DragIntegration, DragParameters, Lift, OverlapSettings, OverlappingGrains};
use sazanami_mps::pressure::Tolerance;
use sazanami_mps::scheme::{Fluid, Scheme};
use sazanami_mps::solver::{FluidParticle, Forcing, ParticleSettings, SetupError, Solver};
use sazanami_mps::stability::StepLimits;
use sazanami_numerics::domain::Domain;
use sazanami_numerics::grid::Grid;
use sazanami_numerics::{Random, Real, Vector};
use sazanami_parallel::{Communicator, Solo};

/// Particle spacing of the tests \[m].
pub const SPACING: Real = 1e-3;
/// Gravity [m/s^2].
pub const GRAVITY: Vector = Vector::new(0.0, 0.0, -9.81);
pub const WALLS: [Side; 2] = [Side::Wall; 2];
pub const OPEN_TOP: [Side; 2] = [Side::Wall, Side::Open];
pub const PERIODIC: [Side; 2] = [Side::Periodic; 2];
pub const NOTHING: [Side; 2] = [Side::Open; 2];

/// A tank in units of the spacing, part filled.
#[derive(Clone)]
pub struct Case {
    pub size: [usize; 3],
    pub sides: [[Side; 2]; 3],
    pub scheme: Scheme,
    pub tolerance: Tolerance,
    pub limits: StepLimits,
    pub friction: WallFriction,
    pub viscosity: Real,
    pub fluid: Vec<FluidParticle>,
    pub grains: Vec<Grain>,
    pub drag_integration: DragIntegration,
    pub added_mass: AddedMass,
    pub lift: Lift,
    /// Radius within which grains read the fluid, in spacings.
    pub smoothing: Real,
    /// Lower bound of the void fraction.
    pub least_void: Real,
    pub gates: Vec<Gate>,
}

impl Case {
    /// A box filled with a lattice of `fill` particles from its lower corner.
    pub fn filled(size: [usize; 3], fill: [usize; 3], sides: [[Side; 2]; 3]) -> Self {
        Self {
            size,
            sides,
            scheme: Scheme::default(),
            tolerance: Tolerance::default(),
            limits: StepLimits { longest: 5e-4, ..StepLimits::default() },
            friction: WallFriction::NoSlip,
            viscosity: 1e-6,
            fluid: lattice(fill),
            grains: Vec::new(),
            drag_integration: DragIntegration::Explicit,
            added_mass: AddedMass::NONE,
            lift: Lift::None,
            smoothing: 3.0,
            least_void: 0.3,
            gates: Vec::new(),
        }
    }

    pub fn upper(&self) -> Vector {
        SPACING * Vector::from_array(self.size.map(|n| n as Real))
    }

    pub fn domain(&self, communicator: Box<dyn Communicator>) -> Domain {
        let cell = 0.5 * (self.scheme.radius + 0.36) * SPACING;
        let upper = self.upper();
        let cells = [0, 1, 2].map(|d| ((upper[d] / cell).floor() as usize).max(1));
        let periodic = self.sides.map(|sides| sides[0] == Side::Periodic);
        Domain::new(Grid::new(cells, Vector::ZERO, upper), periodic, communicator).expect("the box can be cut")
    }

    pub fn settings(&self) -> ParticleSettings {
        let height = self.fluid.iter().map(|p| p.position.z).fold(0.0, Real::max) + 0.5 * SPACING;
        ParticleSettings {
            fluid: Fluid { density: 1000.0, viscosity: self.viscosity, spacing: SPACING },
            scheme: self.scheme,
            limits: self.limits,
            tolerance: self.tolerance,
            reference: Vector::new(0.0, 0.0, height),
        }
    }

    pub fn tank(&self) -> Tank {
        let tank = Tank::new(Vector::ZERO, self.upper(), self.sides, self.friction);
        Tank { gates: self.gates.clone(), ..tank }
    }

    pub fn setup(&self) -> Setup {
        let present = self.sides.map(|sides| sides.map(|side| side == Side::Wall));
        let plate = |gate: &Gate| {
            let normal = Vector::AXES[gate.direction];
            Wall::plate(gate.place * normal, normal, 0, gate.span())
        };
        let mut walls = Wall::of_box(Vector::ZERO, self.upper(), 0, present);
        walls.extend(self.gates.iter().map(plate));
        Setup {
            bodies: vec![Body::ball(0.5 * SPACING)],
            interactions: Interactions::uniform(1, LinearSpringDashpot::spheres(400.0, 0.5, 0.4)),
            walls,
            region: [Vector::splat(-1.0), Vector::ONE],
            ghost_margin: 3.6 * SPACING,
        }
    }

    pub fn coupling(&self) -> OverlapSettings {
        OverlapSettings {
            drag: DragParameters::recommended(1000.0, 1000.0 * self.viscosity),
            smoothing: self.smoothing * SPACING,
            least_void: self.least_void,
            drag_integration: self.drag_integration,
            added_mass: self.added_mass,
            lift: self.lift,
            substeps: Substeps::Auto,
        }
    }

    /// The solver on a rank, if there can be one.
    pub fn tried_on(&self, communicator: Box<dyn Communicator>) -> Result<Solver, SetupError> {
        let domain = self.domain(communicator);
        let grains = if self.grains.is_empty() {
            OverlappingGrains::none(&domain).expect("no grains")
        } else {
            let engine = Engine::new(&domain, self.setup(), &self.grains).expect("sound grains");
            OverlappingGrains::new(&domain, engine, self.coupling())
        };
        Solver::new(domain, self.settings(), self.tank(), &self.fluid, grains)
    }

    /// The solver on a rank.
    pub fn on(&self, communicator: Box<dyn Communicator>) -> Solver {
        self.tried_on(communicator).expect("a sound tank")
    }

    /// The solver on one rank.
    pub fn solo(&self) -> Solver {
        self.on(Box::<Solo>::default())
    }
}

/// A lattice of particles at rest.
pub fn lattice(count: [usize; 3]) -> Vec<FluidParticle> {
    let mut fluid = Vec::new();
    for k in 0..count[2] {
        for j in 0..count[1] {
            for i in 0..count[0] {
                let position = SPACING * Vector::new(i as Real + 0.5, j as Real + 0.5, k as Real + 0.5);
                fluid.push(FluidParticle { position, velocity: Vector::ZERO });
            }
        }
    }
    fluid
}

/// Moves every particle by up to `part` of a spacing in each direction, always alike.
pub fn jittered(mut fluid: Vec<FluidParticle>, part: Real) -> Vec<FluidParticle> {
    let mut numbers = Random::new(7);
    let mut random = move || numbers.between(-1.0, 1.0);
    for particle in &mut fluid {
        particle.position += part * SPACING * Vector::new(random(), random(), random());
    }
    fluid
}

/// A body force in a frame and walls at rest.
pub fn under(body_force: Vector) -> Forcing {
    Forcing { body_force, ..Forcing::default() }
}
