//! Momentum budget of a fluid of moving particles.

use sazanami_numerics::snapshot::{Snapshot, SnapshotError};
use sazanami_numerics::{Real, Vector, named_vectors};

use super::total::{Total, relative, vectors_of};

/// Section of a snapshot with the initial momentum of a fluid and the sums of its impulses.
const FLUID_SUMS: &str = "observe/momentum";
/// Round-off of these sums.
const FLUID_RESTS: &str = "observe/momentum_rest";

named_vectors! {
    /// Impulses in a tank of moving particles during one step, or since the start [N s].
    pub struct ParticleImpulses {
        /// Gravity and the inertial force of the tank's motion on the fluid.
        body_force_on_fluid,
        /// Pressure of the walls on the fluid.
        wall_pressure_on_fluid,
        /// Viscous stress of the walls on the fluid.
        wall_friction_on_fluid,
        /// Stabilisation and collisions of fluid particles with walls, and particles returned to the box.
        wall_contact_on_fluid,
        /// Drag of the grains on the fluid, with lift and added mass where grains have them.
        drag_on_fluid,
        /// Drag of the fluid on the grains, with lift, and with the added mass in the step before, whose reaction is in that on the fluid.
        drag_on_grains,
        /// Force of the fluid's pressure on the grains.
        pressure_on_grains,
        /// Contact forces of the grains on the walls.
        grains_on_walls,
    }
}

impl ParticleImpulses {
    /// Impulse of body force, walls and grains on the fluid.
    #[must_use]
    pub fn on_fluid(&self) -> Vector {
        let walls = self.body_force_on_fluid
            + self.wall_pressure_on_fluid
            + self.wall_friction_on_fluid
            + self.wall_contact_on_fluid;
        walls + self.drag_on_fluid - self.pressure_on_grains
    }

    /// Sum of drag on grains and on fluid: zero where action equals reaction.
    #[must_use]
    pub fn drag_residual(&self) -> Vector {
        self.drag_on_fluid + self.drag_on_grains
    }

    /// The same relative to the larger of the two; 0 if there was no drag.
    #[must_use]
    pub fn relative_drag_residual(&self) -> Real {
        relative(self.drag_residual().length(), self.drag_on_grains.length().max(self.drag_on_fluid.length()))
    }
}

/// Lines of the budget.
const LINES: usize = ParticleImpulses::TERMS.len();

/// Momentum budget of a fluid of moving particles over a whole run.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct FluidMomentumBudget {
    initial: Vector,
    impulses: [Total; LINES],
    /// Absolute impulses of the body force in each direction: the scale of the residual.
    forced: Total,
    residual: Vector,
}

impl FluidMomentumBudget {
    /// Starts with the momentum of the fluid at the beginning of the run [N s].
    #[must_use]
    pub fn new(initial: Vector) -> Self {
        Self { initial, ..Self::default() }
    }

    /// Adds the impulses of a step.
    pub fn add(&mut self, step: &ParticleImpulses) {
        self.forced.add(step.body_force_on_fluid.abs());
        self.impulses.iter_mut().zip(step.terms()).for_each(|(total, impulse)| total.add(impulse));
    }

    /// Balances the impulses so far with the momentum of the fluid now [N s]. Not every step needs it.
    pub fn balance(&mut self, now: Vector) {
        self.residual = now - self.initial - self.impulses().on_fluid();
    }

    /// Impulses since the start.
    #[must_use]
    pub fn impulses(&self) -> ParticleImpulses {
        ParticleImpulses::from_terms(self.impulses.iter().map(Total::value))
    }

    /// Momentum gained beyond the impulses, when last balanced [N s].
    #[must_use]
    pub fn residual(&self) -> Vector {
        self.residual
    }

    /// The residual in each direction, relative to the impulses of the body force; `None` where there is no such force.
    #[must_use]
    pub fn relative_residual(&self) -> [Option<Real>; 3] {
        let (residual, forced) = (self.residual, self.forced.value());
        [0, 1, 2].map(|d| (forced[d] > 0.0).then(|| residual[d].abs() / forced[d]))
    }

    fn totals(&self) -> impl Iterator<Item = &Total> {
        std::iter::once(&self.forced).chain(&self.impulses)
    }

    /// Writes the state into a snapshot; the residual is not part of it.
    pub fn save(&self, snapshot: &mut Snapshot) {
        let sums = std::iter::once(self.initial).chain(self.totals().map(|total| total.sum));
        snapshot.put_vectors(FLUID_SUMS, &sums.collect::<Vec<_>>());
        snapshot.put_vectors(FLUID_RESTS, &self.totals().map(|total| total.rest).collect::<Vec<_>>());
    }

    /// Reads the state from a snapshot, whose sums may be plain ones as in earlier versions.
    ///
    /// # Errors
    /// [`SnapshotError`] if it is not there or of another length.
    pub fn restore(snapshot: &Snapshot) -> Result<Self, SnapshotError> {
        let sums = vectors_of(snapshot, FLUID_SUMS, 2 + LINES)?;
        let is_plain = snapshot.reals(FLUID_RESTS).is_err();
        let rests =
            if is_plain { vec![Vector::ZERO; 1 + LINES] } else { vectors_of(snapshot, FLUID_RESTS, 1 + LINES)? };
        let total = |n: usize| Total { sum: sums[1 + n], rest: rests[n] };
        Ok(Self {
            initial: sums[0],
            forced: total(0),
            impulses: std::array::from_fn(|n| total(1 + n)),
            residual: Vector::ZERO,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A fluid that is shaken along x1 between walls and drags grains along.
    fn shaken(steps: u32) -> FluidMomentumBudget {
        let mut momentum = Vector::new(0.2, 0.0, -0.1);
        let mut budget = FluidMomentumBudget::new(momentum);
        for step in 0..steps {
            let phase = 0.1 * Real::from(step);
            let impulses = ParticleImpulses {
                body_force_on_fluid: Vector::new(1e-3 * phase.sin(), 0.0, -1e-2),
                wall_pressure_on_fluid: Vector::new(0.0, 0.0, 0.9e-2),
                drag_on_fluid: Vector::new(-1e-4 * phase.cos(), 0.0, 0.0),
                drag_on_grains: Vector::new(1e-4 * phase.cos(), 0.0, 0.0),
                pressure_on_grains: Vector::new(0.0, 0.0, -1e-3),
                grains_on_walls: Vector::new(0.0, 0.0, -5.0),
                ..Default::default()
            };
            momentum += impulses.on_fluid();
            budget.add(&impulses);
        }
        budget.balance(momentum);
        budget
    }

    #[test]
    fn the_budget_of_a_fluid_closes_and_a_loss_shows() {
        let mut budget = shaken(10_000);
        assert!(budget.residual().length() < 1e-12, "{}", budget.residual());
        assert_eq!(budget.impulses().relative_drag_residual(), 0.0);
        // Negative control: momentum that nothing gave.
        budget.balance(Vector::new(0.2, 0.0, 1.0 - 0.1) + budget.impulses().on_fluid());
        assert!((budget.residual() - Vector::Z).length() < 1e-12);
        let [along, across, up] = budget.relative_residual();
        assert!(along.unwrap() < 1e-12 && across.is_none() && (up.unwrap() - 1e-2).abs() < 1e-12);
        assert_eq!(ParticleImpulses::default().relative_drag_residual(), 0.0);
    }

    #[test]
    fn the_budget_of_a_fluid_survives_a_snapshot() {
        let budget = shaken(1000);
        let mut snapshot = Snapshot::default();
        budget.save(&mut snapshot);
        let again = FluidMomentumBudget::restore(&snapshot).unwrap();
        assert_eq!((again.impulses(), again.forced), (budget.impulses(), budget.forced));
        assert_eq!(again.initial, budget.initial);
        // Plain sums have no rests.
        let mut plain = Snapshot::default();
        plain.put_reals(FLUID_SUMS, snapshot.reals(FLUID_SUMS).unwrap().to_vec());
        let plain = FluidMomentumBudget::restore(&plain).unwrap();
        assert!(plain.impulses.iter().zip(&budget.impulses).all(|(a, b)| a.sum == b.sum && a.rest == Vector::ZERO));
        assert!(FluidMomentumBudget::restore(&Snapshot::default()).is_err());
    }
}
