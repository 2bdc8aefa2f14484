//! The phases of a step, each over what the ones before it left (`docs/theory/mps.md`).

use sazanami_numerics::Vector;

use super::{PublishedColumns, StepError, StepReport};
use crate::arrangement::Arrangement;
use crate::boundary::Tank;
use crate::context::Context;
use crate::grains::{DragExchange, GrainPhase, VoidReport};
use crate::number_density::{self, PredictedPairs};
use crate::particles::Particles;
use crate::pressure::PressureEquation;
use crate::source::{self, SourceTerms};
use crate::stabilisation::Pairs;
use crate::walls::Walls;
use crate::{free_surface, gradient, momentum, motion, viscosity};

/// State that a step changes.
pub(super) struct Phases<'a> {
    pub tank: &'a mut Tank,
    pub particles: &'a mut Particles,
    pub walls: &'a mut Walls,
    pub near: &'a mut Arrangement,
    pub equation: &'a mut PressureEquation,
    pub grains: &'a mut GrainPhase,
    pub columns: &'a mut PublishedColumns,
}

impl Phases<'_> {
    /// Walls, owners, order, ghosts and lists of the step; returns it with the time scale of the flow.
    ///
    /// # Errors
    /// If the grains have no plate for a gate.
    pub fn arrange<'s>(&mut self, step: Context<'s>) -> Result<Context<'s>, StepError> {
        self.walls.begin_step(&step, self.tank, self.particles);
        self.grains.begin_step(&step, &self.tank.gates)?;
        let of_fluid = motion::largest_speed(step.domain, self.particles, |_| true);
        let fastest = of_fluid.max(self.grains.largest_speed(step.domain));
        let rates = (fastest, self.grains.drag_rate());
        self.near.renew(&step, self.particles, rates, (1.0, self.grains.smoothing()), &mut self.columns.voids);
        self.equation.resize(self.particles.owned);
        Ok(Context { flow_time: motion::flow_time(&step, self.particles), ..step })
    }

    /// Void fractions at the particles.
    pub fn void_fractions(&mut self, step: &Context<'_>) -> VoidReport {
        let Self { tank, particles, near, grains, columns, .. } = self;
        let now = (&particles.position[..], &particles.velocity[..]);
        grains.void_fractions(step, tank, particles, now, &mut near.ghosts, &mut columns.voids)
    }

    /// Number density, its rate and viscosity.
    pub fn densities(&mut self, step: &Context<'_>) {
        let Self { tank, particles, near, columns, .. } = self;
        let PublishedColumns { voids, mirrored, samples, start, .. } = &mut **columns;
        number_density::sample((&particles.position, &particles.velocity), voids, samples);
        let viscous = viscosity::field(step, tank, particles, near, mirrored);
        number_density::at_start(step.kernel, &near.neighbours, samples, &viscous, start);
    }

    /// Fluid at the grains: with implicit drag as it moves without drag.
    pub fn interpolate_fluid(&mut self, step: &Context<'_>) {
        let Self { tank, particles, near, grains, columns, .. } = self;
        let PublishedColumns { voids, start, predicted, .. } = &mut **columns;
        let velocity = if grains.coupling().exchange == DragExchange::Implicit {
            motion::predict(step, particles, start, None, &mut near.ghosts, predicted);
            Some(&predicted.velocity[..])
        } else {
            None
        };
        grains.interpolate_fluid(step, tank, particles, velocity, &voids.inverse, &mut near.ghosts);
    }

    /// Reaction of the drag on the fluid; returns its impulse [N s].
    pub fn return_drag(&mut self, step: &Context<'_>) -> Vector {
        let PublishedColumns { voids, drag, .. } = &mut *self.columns;
        self.grains.return_drag(step, self.tank, self.particles, &voids.inverse, drag)
    }

    /// Velocities and positions without the pressure, lists that hold them, walls in their new place.
    pub fn predict(&mut self, step: &Context<'_>) {
        let Self { tank, particles, near, columns, .. } = self;
        let PublishedColumns { start, drag, predicted, .. } = &mut **columns;
        motion::predict(step, particles, start, Some(&drag[..]), &mut near.ghosts, predicted);
        tank.displacement = step.forcing.wall_displacement;
        near.follow(step, particles, predicted);
    }

    /// Void fractions at the predicted positions.
    pub fn predicted_void_fractions(&mut self, step: &Context<'_>) -> VoidReport {
        let Self { tank, particles, near, grains, columns, .. } = self;
        let then = (&columns.predicted.position[..], &columns.predicted.velocity[..]);
        grains.void_fractions(step, tank, particles, then, &mut near.ghosts, &mut columns.voids)
    }

    /// Coefficients of the pressure equation and roles of the particles in it.
    pub fn assemble(&mut self, step: &Context<'_>, report: &mut StepReport) {
        let Self { particles, near, equation, columns, .. } = self;
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
    pub fn solve(&mut self, step: &Context<'_>, report: &mut StepReport) -> Result<(), StepError> {
        let Self { particles, near, equation, columns, .. } = self;
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
    pub fn correct(&mut self, step: &Context<'_>, report: &mut StepReport) {
        let Self { particles, walls, near, columns, .. } = self;
        let PublishedColumns { start, predicted, sums, new, .. } = &mut **columns;
        motion::correct(step, particles, predicted, &mut near.ghosts, new);
        report.impulses = momentum::impulses(step, particles, walls, start, sums, &predicted.position);
        report.impulses.contact -= momentum::momentum(step, particles, &new.velocity);
    }

    /// Dynamic stabilisation and collisions.
    pub fn stabilise(&mut self, step: &Context<'_>, report: &mut StepReport) {
        let Self { particles, near, equation, columns, .. } = self;
        let PublishedColumns { voids, predicted, new, stabiliser, .. } = &mut **columns;
        let Particles { kind, owned, .. } = &**particles;
        let inverse_void = &voids.inverse;
        let pairs =
            Pairs { kind, owned: *owned, position: &predicted.position, inverse_void, blocks: &equation.blocks };
        report.set_stabilisation(stabiliser.stabilise(step, &pairs, &mut near.ghosts, new));
        report.collisions = stabiliser.collide(step, &pairs, new);
    }

    /// Force of the new pressure on the grains, and their added mass.
    pub fn correct_grains(&mut self, step: &Context<'_>, report: &mut StepReport) {
        let Self { tank, particles, near, grains, columns, .. } = self;
        let PublishedColumns { predicted, voids, .. } = &**columns;
        let unpressed = |a: usize| predicted.velocity[a];
        let water = (&mut **particles, &mut near.ghosts);
        grains.correct_pressure_force(step, tank, water, unpressed, &voids.inverse, &mut report.coupling);
    }

    /// The new state, clipped to the box and checked.
    pub fn finalise(&mut self, step: &Context<'_>, report: &mut StepReport) -> Result<(), StepError> {
        let Self { tank, particles, near, columns, .. } = self;
        report.set_clipped(motion::finalise(step, tank, &columns.new, particles)?);
        report.impulses.contact += momentum::momentum(step, particles, &particles.velocity);
        report.largest_speed = motion::largest_speed(step.domain, particles, |_| true);
        report.pairs = near.neighbours.pairs;
        Ok(())
    }
}
