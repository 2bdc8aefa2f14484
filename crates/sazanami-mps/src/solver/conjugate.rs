//! The step with the conjugate projection, phase by phase as in `docs/theory/mps.md`.

#[cfg(test)]
mod tests;

use sazanami_numerics::{Real, Vector};

use super::{Forcing, Phase, Solver, StepError, StepReport};
use crate::arrangement::Arrangement;
use crate::boundary::Tank;
use crate::conjugate::{self, ConjugateColumns, Mirrors};
use crate::context::Context;
use crate::grains::{DragIntegration, OverlappingGrains, VoidReport};
use crate::particles::Particles;
use crate::pressure::PressureEquation;
use crate::report::EnergyChanges;
use crate::walls::Walls;
use crate::{momentum, motion};

impl Solver {
    /// The step of [`ParticleProjection::Conjugate`](crate::scheme::ParticleProjection::Conjugate).
    pub(super) fn step_conjugate(
        &mut self,
        dt: Real,
        forcing: &Forcing,
        mut watch: impl FnMut(Phase),
    ) -> Result<StepReport, StepError> {
        let mut step = ConjugateStep::of(self, dt, forcing);

        watch(Phase::Neighbours);
        step.find_neighbours()?;
        watch(Phase::Coupling);
        step.set_void_fractions();
        watch(Phase::Fluid);
        step.sum_over_pairs();
        step.add_viscosity_and_body_force();
        if !step.grains.is_empty() {
            watch(Phase::Coupling);
            step.interpolate_fluid_at_grains();
            watch(Phase::Grains);
            step.advance_grains()?;
            watch(Phase::Coupling);
            step.return_drag_to_fluid();
        }
        watch(Phase::Pressure);
        step.solve_pressure()?;
        step.correct_velocities();
        if !step.grains.is_empty() {
            watch(Phase::Coupling);
            step.correct_pressure_force_on_grains();
        }
        watch(Phase::Fluid);
        step.shift_particles();
        step.store_new_state()
    }
}

/// State that the phases of a step change one after the other, and what they report.
struct ConjugateStep<'a> {
    context: Context<'a>,
    tank: &'a mut Tank,
    particles: &'a mut Particles,
    walls: &'a mut Walls,
    near: &'a mut Arrangement,
    equation: &'a mut PressureEquation,
    grains: &'a mut OverlappingGrains,
    columns: &'a mut ConjugateColumns,
    /// Void fractions at the start of the step.
    voids: VoidReport,
    /// Speed relative to the walls of the fastest particle or grain at the start of the step [m/s].
    fastest: Real,
    report: StepReport,
}

impl<'a> ConjugateStep<'a> {
    fn of(solver: &'a mut Solver, dt: Real, forcing: &'a Forcing) -> Self {
        let (surface, reduced_force) = (solver.surface, Vector::ZERO);
        let Solver { domain, periods, settings, kernel, tank, particles, walls, near, equation, grains, .. } = solver;
        let context = Context { domain, periods, settings, kernel, surface, forcing, reduced_force, dt, flow_time: dt };
        let (columns, voids, report) = (&mut solver.conjugate, VoidReport::default(), StepReport::default());
        columns.moves_grains = grains.is_active();
        Self { context, tank, particles, walls, near, equation, grains, columns, voids, fastest: 0.0, report }
    }

    /// 1. Walls where they are at the start, owners, order in space, ghosts, lists of neighbours.
    fn find_neighbours(&mut self) -> Result<(), StepError> {
        let Self { context: step, tank, particles, walls, near, grains, columns, .. } = self;
        walls.begin_step(step, tank, particles);
        grains.begin_step(step, &tank.gates)?;
        let fastest = motion::fastest_beside_walls(step, particles, grains);
        self.fastest = fastest;
        let rates = (fastest, grains.drag_rate());
        let reaches = (grains.widest_size(), grains.smoothing());
        near.renew(step, particles, rates, reaches, &mut columns.voids.start);
        // Damping and relaxation are parts of a step, however long it is.
        step.flow_time = motion::flow_time(&Context { dt: 0.0, ..*step }, particles);
        self.equation.resize(particles.owned);
        Ok(())
    }

    /// 2. Void fractions at the particles, and mixing lengths over the bed where turbulence is put in.
    fn set_void_fractions(&mut self) {
        let Self { context: step, tank, particles, near, grains, columns, .. } = self;
        self.voids = columns.voids.at_start(step, tank, particles, near, grains);
        columns.measure_mixing_lengths(step, tank, grains);
    }

    /// 3. Pairs, moments, velocity gradients, number density, drift and roles.
    fn sum_over_pairs(&mut self) {
        let Self { context: step, tank, particles, near, equation, columns, report, .. } = self;
        columns.sum_over_pairs(step, (&Mirrors::of(tank), self.grains.widest_size()), near, particles, equation);
        report.collisions = columns.count_roles(step, particles, equation, report);
    }

    /// 4. Velocities with viscosity, that of eddies included, body force and the damping of what of the motion is not linear.
    fn add_viscosity_and_body_force(&mut self) {
        let Self { context: step, tank, particles, near, equation, columns, report, .. } = self;
        report.largest_viscosity = columns.set_eddy_viscosity(step, tank, near, particles);
        report.stabilisation_work = columns.add_viscosity_and_body_force(step, tank, near, particles, equation);
        report.impulses = columns.impulses(step, particles);
    }

    /// 5a. Fluid at the grains: with implicit drag as it moves without drag; and gusts where turbulence is put in.
    fn interpolate_fluid_at_grains(&mut self) {
        let Self { context: step, tank, particles, near, grains, columns, .. } = self;
        let implicit = grains.coupling().drag_integration == DragIntegration::Implicit;
        if implicit {
            columns.predict(step, particles, None, near);
        }
        let velocity = implicit.then_some(&columns.new.velocity[..]);
        let inverse_void = &columns.voids.start.inverse;
        grains.interpolate_fluid(step, tank, particles, velocity, inverse_void, &mut near.ghosts);
        if let Some(eddies) = columns.eddies() {
            grains.add_gusts(step, tank, particles, inverse_void, eddies);
        }
    }

    /// 5b. Grains under contacts, drag, lift and the pressure of the step before.
    fn advance_grains(&mut self) -> Result<(), StepError> {
        self.report.contacts = self.grains.advance(&self.context, &mut self.report.coupling)?;
        Ok(())
    }

    /// 5c. The reaction of the drag on the fluid, and the void fractions where grains and fluid then are.
    fn return_drag_to_fluid(&mut self) {
        let Self { context: step, tank, particles, near, grains, columns, report, .. } = self;
        let mut drag = std::mem::take(&mut columns.drag);
        report.coupling.drag_on_fluid =
            grains.return_drag(step, tank, particles, &columns.voids.start.inverse, &mut drag);
        columns.predict(step, particles, Some(&drag), near);
        columns.drag = drag;
        let then = columns.take_predicted_velocities(step, tank, particles, grains);
        report.coupling.set_voids([self.voids, then]);
    }

    /// 6 to 8. Right side and pressure.
    fn solve_pressure(&mut self) -> Result<(), StepError> {
        let Self { context: step, particles, near, equation, columns, fastest, report, .. } = self;
        columns.set_right_side(step, particles, near, equation);
        report.pressure = columns.solve_pressure(step, near, particles, equation, *fastest)?;
        Ok(())
    }

    /// 9. Velocities and positions with the pressure.
    fn correct_velocities(&mut self) {
        let Self { context: step, tank, particles, near, equation, columns, report, .. } = self;
        let (impulse, [relaxation, projection]) = columns.correct_velocities(step, particles, equation);
        report.impulses.wall_pressure = impulse;
        report.energy = EnergyChanges { projection, relaxation, ..report.energy };
        conjugate::set_wall_pressures(step, tank, near, particles, &mut columns.divergence);
    }

    /// 9. Force of the new pressure on the grains, and their added mass.
    fn correct_pressure_force_on_grains(&mut self) {
        let Self { context: step, tank, particles, near, grains, columns, report, .. } = self;
        columns.new.refresh(step.domain, &mut near.ghosts);
        let (inverse_void, water) = (&columns.voids.start.inverse, (&mut **particles, &mut near.ghosts));
        let unpressed = |a: usize| columns.velocity_without_pressure(step, a);
        grains.correct_pressure_force(step, tank, water, unpressed, inverse_void, &mut report.coupling);
    }

    /// 10. Particles towards an even arrangement.
    fn shift_particles(&mut self) {
        let Self { context: step, particles, near, equation, columns, report, .. } = self;
        let [longest, shifting] = columns.shift(step, &mut near.ghosts, particles, equation);
        report.largest_shift = longest;
        report.energy.shifting = shifting;
    }

    /// 11. The new state, clipped to the box and checked.
    fn store_new_state(self) -> Result<StepReport, StepError> {
        let Self { context: step, tank, particles, columns, mut report, .. } = self;
        tank.displacement = step.forcing.wall_displacement;
        let before = momentum::momentum(&step, particles, &columns.new.velocity);
        report.set_clipped(motion::finalise(&step, tank, &columns.new, particles)?);
        report.impulses.contact += momentum::momentum(&step, particles, &particles.velocity) - before;
        report.largest_speed = motion::largest_speed(step.domain, particles, step.forcing.wall_velocity, |_| true);
        report.pairs = columns.pairs.len();
        Ok(report)
    }
}
