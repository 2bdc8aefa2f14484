//! A closed description of fluid and grains that becomes a solver on one rank.

use sazanami_dem::{Body, Damping, Engine, Grain, Interactions, LinearSpringDashpot, Setup, Wall};
use sazanami_mics::boundary::{Boundary, Side};
use sazanami_mics::flow::{Flow, Fluids, Schemes};
use sazanami_mics::grains::{Coupling, Exchange};
use sazanami_mics::pressure::Tolerance;
use sazanami_mics::solver::{Settings, Solver, StepReport};
use sazanami_mics::stability::StepLimits;
use sazanami_numerics::domain::Domain;
use sazanami_numerics::geometry::{ContactSphereRule, Shape, VolumeRule};
use sazanami_numerics::grid::Grid;
use sazanami_numerics::{Real, Vector};

/// Standard gravity of the reference experiments, downwards [m/s^2].
pub(crate) fn down(gravity: Real) -> Vector {
    Vector::new(0.0, 0.0, -gravity)
}

/// One liquid everywhere.
pub(crate) fn single(density: Real, viscosity: Real) -> Fluids {
    Fluids { liquid_density: density, gas_density: density, liquid_viscosity: viscosity, gas_viscosity: viscosity }
}

/// Everything a coupled run starts from.
#[derive(Clone)]
pub(crate) struct Tank {
    /// Cells.
    pub grid: Grid,
    /// Sides; grains meet walls where the fluid does.
    pub boundary: Boundary,
    /// Densities and viscosities of liquid and gas.
    pub fluids: Fluids,
    /// Gravity [m/s^2].
    pub gravity: Vector,
    /// Limits of the step.
    pub limits: StepLimits,
    /// Largest |div u| dt.
    pub divergence: Real,
    /// Momentum exchange with the grains.
    pub exchange: Exchange,
    /// Shapes of the grains.
    pub shapes: Vec<Shape>,
    /// Grains at the start.
    pub grains: Vec<Grain>,
}

impl Tank {
    /// Fluid at rest without gravity and without grains.
    pub fn new(grid: Grid, boundary: Boundary, fluids: Fluids, longest_step: Real) -> Self {
        Self {
            grid,
            boundary,
            fluids,
            gravity: Vector::ZERO,
            limits: StepLimits::up_to(longest_step),
            divergence: 1e-8,
            exchange: Exchange::default(),
            shapes: Vec::new(),
            grains: Vec::new(),
        }
    }

    /// The solver, after `fill` has set liquid and velocity.
    pub fn solver(self, fill: impl FnOnce(&Domain, &Boundary, &mut Flow)) -> Result<Solver, String> {
        let domain = Domain::solo(self.grid, self.boundary.periodic());
        let mut flow = Flow::new(&domain, self.fluids, Schemes::default());
        fill(&domain, &self.boundary, &mut flow);
        let is_wall = |side: &Side| matches!(side, Side::NoSlip | Side::Slip | Side::Moving { .. });
        let present = self.boundary.sides().map(|pair| pair.map(|side| is_wall(&side)));
        let (lower, upper) = (self.grid.lower, self.grid.upper());
        let law = LinearSpringDashpot { damping: Damping::Restitution(0.5), ..LinearSpringDashpot::SAND };
        let setup = Setup {
            bodies: self.shapes.iter().map(Body::from).collect(),
            interactions: Interactions::uniform(1, law),
            walls: Wall::of_box(lower, upper, 0, present),
            region: [lower, upper],
            ghost_margin: 2.0 * self.grid.spacing.max_element(),
        };
        let engine = Engine::new(&domain, setup, &self.grains).map_err(|error| error.to_string())?;
        let settings = Settings {
            gravity: self.gravity,
            limits: self.limits,
            tolerance: Tolerance { divergence: self.divergence, ..Tolerance::default() },
            incremental: false,
        };
        let coupling = Coupling { exchange: self.exchange, ..Coupling::default() };
        Solver::new(domain, self.boundary, settings, flow, engine, self.shapes.into(), coupling)
            .map_err(|error| error.to_string())
    }
}

/// A sphere that touches by one contact sphere.
pub(crate) fn ball(diameter: Real) -> Result<Shape, String> {
    Shape::sphere(diameter, 3, VolumeRule::Preserve, &ContactSphereRule::Single).map_err(|error| error.to_string())
}

/// One step of the length that the limits allow, but not beyond `end` \[s]; returns its length \[s].
pub(crate) fn step(solver: &mut Solver, now: Real, end: Real) -> Result<(Real, StepReport), String> {
    let step = solver.stable_step();
    let dt = step.dt.min(end - now);
    let report = solver.step(step, dt, |_| ()).map_err(|error| format!("at t = {now:e} s: {error}"))?;
    Ok((dt, report))
}

/// Largest of `values`, at least zero; not a number if one of them is not.
pub(crate) fn largest(values: impl IntoIterator<Item = Real>) -> Real {
    values.into_iter().fold(0.0, |a: Real, b| if a.is_nan() || b.is_nan() { Real::NAN } else { a.max(b) })
}
