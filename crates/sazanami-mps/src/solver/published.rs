//! The step of the published scheme (MPS-HS-HL-ECS-GC-DS), phase by phase as in `docs/theory/mps.md`.

use super::{Forcing, Phase, Solver, StepError, StepReport};
use crate::arrangement::Arrangement;
use crate::boundary::Tank;
use crate::context::{Context, Motion, Voids};
use crate::grains::{DragIntegration, OverlappingGrains, VoidReport};
use crate::number_density::{self, NumberDensity, PredictedPairs, Prediction, Sample};
use crate::particles::Particles;
use crate::pressure::PressureEquation;
use crate::source::{self, SourceTerms};
use crate::stabilisation::{Pairs, Stabiliser};
use crate::walls::Walls;
use crate::{free_surface, gradient, momentum, motion, viscosity};
use sazanami_numerics::{Real, Vector};

/// Columns over particles that the phases of a step hand to each other, kept for their memory.
#[derive(Debug, Default)]
pub(super) struct PublishedColumns {
    /// Void fraction, at the present or the predicted positions.
    voids: Voids,
    /// Velocities of the viscous term, mirrored at walls [m/s].
    mirrored: Vec<Vector>,
    /// Packed columns of the sums over pairs.
    samples: Vec<Sample>,
    /// Number density, its rate and viscosity at the start of the step.
    start: Vec<NumberDensity>,
    /// Velocity change by drag [m/s].
    drag: Vec<Vector>,
    /// Positions and velocities without the pressure.
    predicted: Motion,
    /// `eps + (1 - eps) rho/rho_s`.
    mobility: Vec<Real>,
    /// Sums at the predicted positions.
    sums: Vec<Prediction>,
    roles: Vec<u8>,
    /// Particles whose pressure gradient is not corrected.
    uncorrected: Vec<bool>,
    /// Positions and velocities with the pressure; in the end the new state.
    new: Motion,
    stabiliser: Stabiliser,
}

impl Solver {
    /// The step of [`ParticleProjection::Enhanced`](crate::scheme::ParticleProjection::Enhanced).
    pub(super) fn step_published(
        &mut self,
        dt: Real,
        forcing: &Forcing,
        mut watch: impl FnMut(Phase),
    ) -> Result<StepReport, StepError> {
        let mut step = PublishedStep::of(self, dt, forcing);

        watch(Phase::Neighbours);
        step.find_neighbours()?;
        watch(Phase::Coupling);
        step.set_void_fractions();
        watch(Phase::Fluid);
        step.sum_over_pairs();

        watch(Phase::Coupling);
        step.interpolate_fluid_at_grains();
        watch(Phase::Grains);
        step.advance_grains()?;
        watch(Phase::Coupling);
        step.return_drag_to_fluid();

        watch(Phase::Fluid);
        step.predict();
        watch(Phase::Coupling);
        step.set_predicted_void_fractions();
        watch(Phase::Fluid);
        step.assemble_pressure_equation();
        watch(Phase::Pressure);
        step.solve_pressure()?;

        watch(Phase::Fluid);
        step.correct_velocities();
        step.stabilise();
        watch(Phase::Coupling);
        step.correct_pressure_force_on_grains();
        watch(Phase::Fluid);
        step.store_new_state()
    }
}

/// State that the phases of a step change one after the other, and what they report.
struct PublishedStep<'a> {
    context: Context<'a>,
    tank: &'a mut Tank,
    particles: &'a mut Particles,
    walls: &'a mut Walls,
    near: &'a mut Arrangement,
    equation: &'a mut PressureEquation,
    grains: &'a mut OverlappingGrains,
    columns: &'a mut PublishedColumns,
    /// Void fractions at the start of the step.
    voids: VoidReport,
    report: StepReport,
}

impl<'a> PublishedStep<'a> {
    fn of(solver: &'a mut Solver, dt: Real, forcing: &'a Forcing) -> Self {
        let (reduced_force, surface) = (solver.reduced_force(forcing.body_force), solver.surface);
        let Solver { domain, periods, settings, kernel, tank, particles, walls, near, equation, grains, .. } = solver;
        let context = Context { domain, periods, settings, kernel, surface, forcing, reduced_force, dt, flow_time: dt };
        let (columns, voids, report) = (&mut solver.published, VoidReport::default(), StepReport::default());
        Self { context, tank, particles, walls, near, equation, grains, columns, voids, report }
    }

    /// Walls, owners, order, ghosts and lists of neighbours; the time scale of the flow.
    fn find_neighbours(&mut self) -> Result<(), StepError> {
        let Self { context: step, tank, particles, walls, near, equation, grains, columns, .. } = self;
        walls.begin_step(step, tank, particles);
        grains.begin_step(step, &tank.gates)?;
        let fastest = motion::fastest_beside_walls(step, particles, grains);
        let rates = (fastest, grains.drag_rate());
        near.renew(step, particles, rates, (1.0, grains.smoothing()), &mut columns.voids);
        equation.resize(particles.owned);
        step.flow_time = motion::flow_time(step, particles);
        Ok(())
    }

    /// Void fractions at the particles.
    fn set_void_fractions(&mut self) {
        let Self { context: step, tank, particles, near, grains, columns, .. } = self;
        let now = (&particles.position[..], &particles.velocity[..]);
        self.voids = grains.void_fractions(step, tank, particles, now, &mut near.ghosts, &mut columns.voids);
    }

    /// Number density, its rate and viscosity.
    fn sum_over_pairs(&mut self) {
        let Self { context: step, tank, particles, near, columns, .. } = self;
        let PublishedColumns { voids, mirrored, samples, start, .. } = &mut **columns;
        number_density::sample((&particles.position, &particles.velocity), voids, samples);
        let viscous = viscosity::field(step, tank, particles, near, mirrored);
        number_density::at_start(step.kernel, &near.neighbours, samples, &viscous, start);
    }

    /// Fluid at the grains: with implicit drag as it moves without drag.
    fn interpolate_fluid_at_grains(&mut self) {
        let Self { context: step, tank, particles, near, grains, columns, .. } = self;
        let PublishedColumns { voids, start, predicted, .. } = &mut **columns;
        let velocity = if grains.coupling().drag_integration == DragIntegration::Implicit {
            motion::predict(step, particles, start, None, &mut near.ghosts, predicted);
            Some(&predicted.velocity[..])
        } else {
            None
        };
        grains.interpolate_fluid(step, tank, particles, velocity, &voids.inverse, &mut near.ghosts);
    }

    /// Grains under contacts, drag, lift and the pressure of the step before.
    fn advance_grains(&mut self) -> Result<(), StepError> {
        self.report.contacts = self.grains.advance(&self.context, &mut self.report.coupling)?;
        Ok(())
    }

    /// Reaction of the drag on the fluid.
    fn return_drag_to_fluid(&mut self) {
        let Self { context: step, tank, particles, grains, columns, report, .. } = self;
        let PublishedColumns { voids, drag, .. } = &mut **columns;
        report.coupling.drag_on_fluid = grains.return_drag(step, tank, particles, &voids.inverse, drag);
    }

    /// Velocities and positions without the pressure, lists that hold them, walls in their new place.
    fn predict(&mut self) {
        let Self { context: step, tank, particles, near, columns, .. } = self;
        let PublishedColumns { start, drag, predicted, .. } = &mut **columns;
        motion::predict(step, particles, start, Some(&drag[..]), &mut near.ghosts, predicted);
        tank.displacement = step.forcing.wall_displacement;
        near.follow(step, particles, predicted);
    }

    /// Void fractions at the predicted positions.
    fn set_predicted_void_fractions(&mut self) {
        let Self { context: step, tank, particles, near, grains, columns, report, .. } = self;
        let then = (&columns.predicted.position[..], &columns.predicted.velocity[..]);
        let then = grains.void_fractions(step, tank, particles, then, &mut near.ghosts, &mut columns.voids);
        report.coupling.set_voids([self.voids, then]);
    }

    /// Coefficients of the pressure equation and roles of the particles in it.
    fn assemble_pressure_equation(&mut self) {
        let Self { context: step, particles, near, equation, columns, report, .. } = self;
        let PublishedColumns { voids, samples, start, predicted, mobility, sums, roles, .. } = &mut **columns;
        let position = &predicted.position[..];
        number_density::sample((position, &predicted.velocity), voids, samples);
        number_density::mobility(voids, mobility);
        let pairs = PredictedPairs { kind: &particles.kind, samples, mobility };
        let spacing = step.settings.fluid.spacing;
        number_density::prediction(step.kernel, spacing, &near.neighbours, &pairs, &mut equation.blocks, sums);
        free_surface::set_roles(step, particles, sums, &equation.blocks, &mut near.ghosts, roles);
        equation.set_diagonal(&particles.role, particles.owned);
        report.set_surface(&free_surface::report(step, particles, &equation.rows, start));
    }

    /// Source, pressure, tensile cut-off at walls, and the gradient of the pressure.
    fn solve_pressure(&mut self) -> Result<(), StepError> {
        let Self { context: step, particles, near, equation, columns, report, .. } = self;
        let PublishedColumns { voids, samples, start, predicted, mobility, sums, uncorrected, .. } = &mut **columns;
        let position = &predicted.position[..];
        let terms = SourceTerms { start, predicted: sums, samples, mobility, voids };
        source::set_right_side(step, &terms, particles, &equation.blocks, &mut equation.rows);
        source::prescribe(step, particles, position);
        equation.complete_support(particles, position, sums);
        report.pressure = equation.solve(step, near, particles, position)?;
        report.tensile_cutoffs = equation.cut_tension(step, sums, particles);
        near.ghosts.refresh(step.domain, &mut particles.pressure);
        report.uncorrected_gradients =
            gradient::gradient(step, &equation.blocks, position, &voids.inverse, particles, uncorrected);
        source::release_inactive(step, particles, position);
        Ok(())
    }

    /// Velocities and positions with the pressure; begins the sum of what contacts with walls give the fluid.
    fn correct_velocities(&mut self) {
        let Self { context: step, particles, walls, near, columns, report, .. } = self;
        let PublishedColumns { start, predicted, sums, new, .. } = &mut **columns;
        motion::correct(step, particles, predicted, &mut near.ghosts, new);
        report.impulses = momentum::impulses(step, particles, walls, start, sums, &predicted.position);
        report.impulses.contact -= momentum::momentum(step, particles, &new.velocity);
    }

    /// Dynamic stabilisation and collisions.
    fn stabilise(&mut self) {
        let Self { context: step, particles, near, equation, columns, report, .. } = self;
        let PublishedColumns { voids, predicted, new, stabiliser, .. } = &mut **columns;
        let Particles { kind, owned, .. } = &**particles;
        let inverse_void = &voids.inverse;
        let pairs =
            Pairs { kind, owned: *owned, position: &predicted.position, inverse_void, blocks: &equation.blocks };
        report.set_stabilisation(stabiliser.stabilise(step, &pairs, &mut near.ghosts, new));
        report.collisions = stabiliser.collide(step, &pairs, new);
    }

    /// Force of the new pressure on the grains, and their added mass.
    fn correct_pressure_force_on_grains(&mut self) {
        let Self { context: step, tank, particles, near, grains, columns, report, .. } = self;
        let PublishedColumns { predicted, voids, .. } = &**columns;
        let unpressed = |a: usize| predicted.velocity[a];
        let water = (&mut **particles, &mut near.ghosts);
        grains.correct_pressure_force(step, tank, water, unpressed, &voids.inverse, &mut report.coupling);
    }

    /// The new state, clipped to the box and checked.
    fn store_new_state(self) -> Result<StepReport, StepError> {
        let Self { context: step, tank, particles, near, columns, mut report, .. } = self;
        report.set_clipped(motion::finalise(&step, tank, &columns.new, particles)?);
        report.impulses.contact += momentum::momentum(&step, particles, &particles.velocity);
        report.largest_speed = motion::largest_speed(step.domain, particles, step.forcing.wall_velocity, |_| true);
        report.pairs = near.neighbours.pairs;
        Ok(report)
    }
}
