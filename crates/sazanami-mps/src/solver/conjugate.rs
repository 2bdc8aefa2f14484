//! The step with the conjugate projection.

#[cfg(test)]
mod tests;

use sazanami_numerics::{Real, Vector};

use super::{Forcing, Phase, Solver, StepError, StepReport};
use crate::conjugate::{self, Mirrors};
use crate::context::Context;
use crate::report::EnergyChanges;
use crate::{momentum, motion};

impl Solver {
    /// The step of [`Projection::Conjugate`](crate::scheme::Projection::Conjugate).
    pub(super) fn step_conjugate(
        &mut self,
        dt: Real,
        forcing: &Forcing,
        mut watch: impl FnMut(Phase),
    ) -> Result<StepReport, StepError> {
        let Self {
            domain, periods, settings, kernel, tank, particles, walls, near, equation, conjugate: columns, ..
        } = self;
        let (surface, reduced_force) = (self.surface, Vector::ZERO);
        let step = Context { domain, periods, settings, kernel, surface, forcing, reduced_force, dt, flow_time: dt };
        let mut report = StepReport::default();

        watch(Phase::Neighbours);
        walls.begin_step(&step, tank, particles);
        let mirrors = Mirrors::of(tank);
        let fastest = motion::largest_speed(domain, particles, |_| true);
        near.renew(&step, particles, fastest, 0.0, &mut columns.voids);
        // Damping and relaxation are parts of a step, however long it is.
        let flow_time = motion::flow_time(&Context { dt: 0.0, ..step }, particles);
        let step = &Context { flow_time, ..step };
        equation.resize(particles.owned);

        watch(Phase::Fluid);
        columns.surround(step, &mirrors, near, particles, equation);
        report.collisions = columns.report(step, particles, equation, &mut report);
        report.stabilisation_work = columns.move_freely(step, tank.friction, near, particles, equation);
        report.impulses = columns.impulses(step, particles);

        watch(Phase::Pressure);
        columns.set_right_side(step, particles, equation);
        report.pressure = columns.project(step, near, particles, equation)?;
        let (impulse, [relaxation, projection]) = columns.apply_pressure(step, particles, equation);
        report.impulses.wall_pressure = impulse;
        conjugate::set_wall_pressures(step, tank, near, particles, &mut columns.divergence);

        watch(Phase::Fluid);
        let [longest, shifting] = columns.shift(step, particles, equation);
        report.largest_shift = longest;
        report.energy = EnergyChanges { projection, relaxation, shifting };
        tank.displacement = forcing.wall_displacement;
        let before = momentum::momentum(step, particles, &columns.new.velocity);
        report.clipped = motion::finalise(step, tank, &columns.new, particles)?;
        report.impulses.contact += momentum::momentum(step, particles, &particles.velocity) - before;
        report.largest_speed = motion::largest_speed(domain, particles, |_| true);
        report.pairs = columns.pairs.len();
        Ok(report)
    }
}
