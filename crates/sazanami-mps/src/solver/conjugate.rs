//! The step with the conjugate projection.

#[cfg(test)]
mod tests;

use sazanami_numerics::{Real, Vector};

use super::{Forcing, Phase, Solver, StepError, StepReport};
use crate::arrangement::Arrangement;
use crate::boundary::Tank;
use crate::conjugate::{self, Mirrors};
use crate::context::Context;
use crate::grains::{DragExchange, GrainPhase, VoidReport};
use crate::particles::Particles;
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
            domain,
            periods,
            settings,
            kernel,
            tank,
            particles,
            walls,
            near,
            equation,
            grains,
            conjugate: columns,
            ..
        } = self;
        let (surface, reduced_force) = (self.surface, Vector::ZERO);
        let step = Context { domain, periods, settings, kernel, surface, forcing, reduced_force, dt, flow_time: dt };
        let mut report = StepReport::default();

        watch(Phase::Neighbours);
        walls.begin_step(&step, tank, particles);
        let mirrors = Mirrors::of(tank);
        grains.begin_step(&step, &tank.gates)?;
        let fastest = motion::largest_speed(domain, particles, |_| true).max(grains.largest_speed(domain));
        let widest = grains.widest_size();
        near.renew(&step, particles, (fastest, grains.drag_rate()), widest, &mut columns.voids.start);
        // Damping and relaxation are parts of a step, however long it is.
        let flow_time = motion::flow_time(&Context { dt: 0.0, ..step }, particles);
        let step = &Context { flow_time, ..step };
        equation.resize(particles.owned);

        watch(Phase::Coupling);
        let voids_now = columns.voids.begin(step, tank, particles, near, grains);
        watch(Phase::Fluid);
        columns.surround(step, (&mirrors, widest), near, particles, equation);
        report.collisions = columns.report(step, particles, equation, &mut report);
        report.stabilisation_work = columns.move_freely(step, tank, near, particles, equation);
        report.impulses = columns.impulses(step, particles);

        columns.gives_way = grains.is_active();
        if !grains.is_empty() {
            let voids_then = advance_grains(step, tank, (particles, near), grains, columns, &mut report, &mut watch)?;
            report.coupling.set_voids([voids_now, voids_then]);
        }

        watch(Phase::Pressure);
        columns.set_right_side(step, particles, near, equation);
        report.pressure = columns.project(step, near, particles, equation)?;
        let (impulse, [relaxation, projection]) = columns.apply_pressure(step, particles, equation);
        report.impulses.wall_pressure = impulse;
        conjugate::set_wall_pressures(step, tank, near, particles, &mut columns.divergence);

        if !grains.is_empty() {
            watch(Phase::Coupling);
            columns.new.refresh(domain, &mut near.ghosts);
            let (inverse_void, ghosts) = (&columns.voids.start.inverse, &mut near.ghosts);
            let motion = (&columns.new, |a: usize| columns.unpressed(step, a));
            grains.correct_pressure_force(step, particles, motion, inverse_void, ghosts, &mut report.coupling);
        }

        watch(Phase::Fluid);
        let [longest, shifting] = columns.shift(step, particles, equation);
        report.largest_shift = longest;
        report.energy = EnergyChanges { projection, relaxation, shifting };
        tank.displacement = forcing.wall_displacement;
        let before = momentum::momentum(step, particles, &columns.new.velocity);
        report.set_clipped(motion::finalise(step, tank, &columns.new, particles)?);
        report.impulses.contact += momentum::momentum(step, particles, &particles.velocity) - before;
        report.largest_speed = motion::largest_speed(domain, particles, |_| true);
        report.pairs = columns.pairs.len();
        Ok(report)
    }
}

/// Grains under contacts, drag and the old pressure; the drag returned to the fluid; void fractions where both then are.
fn advance_grains(
    step: &Context<'_>,
    tank: &mut Tank,
    (particles, near): (&mut Particles, &mut Arrangement),
    grains: &mut GrainPhase,
    columns: &mut conjugate::Columns,
    report: &mut StepReport,
    watch: &mut impl FnMut(Phase),
) -> Result<VoidReport, StepError> {
    watch(Phase::Coupling);
    let implicit = grains.coupling().exchange == DragExchange::Implicit;
    if implicit {
        columns.predict(step, particles, None, near);
    }
    let velocity = implicit.then_some(&columns.new.velocity[..]);
    let inverse_void = &columns.voids.start.inverse;
    grains.interpolate_fluid(step, particles, velocity, inverse_void, &mut near.ghosts);
    watch(Phase::Grains);
    report.contacts = grains.advance(step, &mut report.coupling)?;
    watch(Phase::Coupling);
    let mut drag = std::mem::take(&mut columns.drag);
    report.coupling.drag_on_fluid = grains.return_drag(step, particles, inverse_void, &mut drag);
    columns.predict(step, particles, Some(&drag), near);
    columns.drag = drag;
    Ok(columns.take_drag(step, tank, particles, grains))
}
