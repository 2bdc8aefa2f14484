//! A step in the phases of Fig. 1 of Yagyu et al. (2015), as `docs/theory/mics.md` numbers them.

use sazanami_numerics::grid::Field;
use sazanami_numerics::mean_flow::MeanFlow;
use sazanami_numerics::{Real, Vector};

use super::{GridSettings, Phase, Solver, StepError, StepReport};
use crate::acceleration::Acceleration;
use crate::flow::Flow;
use crate::grains::ResolvedGrains;
use crate::grains::room::Room;
use crate::mobility::Closing;
use crate::pass::Pass;
use crate::pressure::Projection;
use crate::stability::StableStep;
use crate::surface_tension::WIDE;

impl Solver {
    /// Advances flow, interface and grains by `dt` \[s], at most `step.dt`. `watch` is called at the start of each phase.
    ///
    /// # Errors
    /// [`StepError`] names what failed and where; the state is then not usable.
    pub fn step(&mut self, step: StableStep, dt: Real, mut watch: impl FnMut(Phase)) -> Result<StepReport, StepError> {
        let gravity = self.settings.gravity + self.by_mass();
        if let Some(net) = self.mean_flow.filter(MeanFlow::is_net) {
            self.projection.mean.hold(net.held(), net.wanted_after(dt));
        }
        let mut report = StepReport { fluid_passes: step.fluid_passes, ..StepReport::default() };
        self.move_box(dt);
        self.place_surfaces(dt);
        for _ in 0..step.fluid_passes {
            watch(Phase::Fluid);
            let mut pass = FluidPass::of(self, gravity, dt / step.fluid_passes as Real);
            pass.transport(&mut report);
            pass.diffuse(&mut report)?;
            pass.predict(&mut report);
            watch(Phase::Pressure);
            pass.project(&mut report)?;
            watch(Phase::Coupling);
            pass.load(&mut report);
        }
        let Self { domain, boundary, flow, grains, room, projection, settings, .. } = self;
        report.impulses += grains.load(domain, room.as_mut(), gravity, dt);
        watch(Phase::Grains);
        report.contacts = grains.advance(domain, flow, gravity, dt)?;
        watch(Phase::Coupling);
        report.imprint = grains.imprint(domain);
        if let Some(room) = room.as_mut() {
            report.transport.settled += room.refit(domain, boundary, grains.moved(domain), flow);
            // The pressure behind walls is that beside the liquid where it is now, as after a restart.
            projection.fill_ghosts(domain, flow, settings.gravity);
        }
        report.impulses += grains.exchange(domain, flow, room.as_mut(), gravity, dt);
        report.book_sides();
        report.impulses.open_sides += self.let_leave()? + std::mem::take(&mut self.fed);
        self.previous_step = Some(step.dt);
        report.mean_flow = self.answer(dt);
        self.settle_ghosts();
        self.check(&report)?;
        Ok(report)
    }

    /// Places the surfaces of the grains, and holds the fluid in the room that they leave it.
    fn place_surfaces(&mut self, dt: Real) {
        let Self { domain, flow, grains, room, .. } = self;
        if let Some(room) = room.as_mut() {
            room.keep(domain, &flow.velocity);
        }
        grains.place_surfaces(domain, flow, dt);
        if let Some(room) = room.as_mut() {
            room.hold(domain, flow);
        }
    }
}

impl Solver {
    /// Takes away the grains that have left through open sides; returns by how much the stored momentum changed [N s].
    fn let_leave(&mut self) -> Result<Vector, StepError> {
        if !self.grains.have_left(&self.domain) {
            return Ok(Vector::ZERO);
        }
        let before = self.momentum().total();
        let Self { domain, grains, .. } = self;
        grains.take_departed(domain)?;
        Ok(self.momentum().total() - before)
    }
}

impl StepReport {
    /// Books what went through walls and open sides in the phases.
    fn book_sides(&mut self) {
        let Self { transport, diffusion, pressure, contacts, impulses, .. } = self;
        impulses.walls_on_fluid += diffusion.wall_impulse + pressure.wall_impulse;
        impulses.surface_tension += pressure.surface_tension.impulse;
        impulses.walls_on_grains -= contacts.impulse_on_walls;
        impulses.held_grains -= contacts.impulse_on_held;
        impulses.open_sides += transport.momentum_through;
        impulses.residue += transport.residue.clipped_momentum + transport.settled.clipped_momentum;
    }
}

/// State that a pass of the fluid changes.
struct FluidPass<'a> {
    now: Pass<'a>,
    settings: &'a GridSettings,
    flow: &'a mut Flow,
    projection: &'a mut Projection,
    grains: &'a mut ResolvedGrains,
    /// The acceleration, if the viscous step of the pass sees one.
    acceleration: Option<&'a mut Acceleration>,
    room: Option<&'a mut Room>,
}

impl<'a> FluidPass<'a> {
    /// A pass of `dt` \[s] under `gravity` [m/s^2].
    fn of(solver: &'a mut Solver, gravity: Vector, dt: Real) -> Self {
        let Solver { domain, boundary, settings, flow, projection, grains, acceleration, room, .. } = solver;
        let acceleration = Acceleration::for_pass(acceleration, domain, flow, dt);
        let now = Pass { domain, boundary, gravity, dt };
        Self { now, settings, flow, projection, grains, acceleration, room: room.as_mut() }
    }

    /// Phase 1: liquid and momentum move with the face velocities.
    fn transport(&mut self, report: &mut StepReport) {
        let Self { flow, projection, grains, .. } = self;
        let Pass { domain, boundary, dt, .. } = self.now;
        report.courant = report.courant.max(flow.advective_rate(domain) * dt);
        // Incremental projection: the old pressure gradient acts at half time during the transport (second order).
        let half = if self.settings.incremental { 0.5 * dt } else { 0.0 };
        projection.add_gradient(domain, &flow.density, &mut flow.velocity, -half);
        if let Some(acceleration) = &mut self.acceleration {
            acceleration.keep(domain, projection, &flow.density, self.now.gravity);
        }
        let beside = self.room.as_deref_mut().map(|room| (room, &**grains));
        report.transport += flow.transport_beside(domain, boundary, dt, beside, Some(projection.outside()));
        projection.add_gradient(domain, &flow.density, &mut flow.velocity, half);
        if let Some(acceleration) = &mut self.acceleration {
            acceleration.carry(domain, projection, &flow.density, self.now.gravity);
        }
    }

    /// Phase 2: viscous stress, friction on the surfaces of grains.
    fn diffuse(&mut self, report: &mut StepReport) -> Result<(), StepError> {
        let Self { flow, grains, acceleration, .. } = self;
        let Pass { domain, boundary, gravity, dt } = self.now;
        if let (Some(acceleration), Some(surface)) = (&mut *acceleration, grains.surface_mut()) {
            acceleration.set_damping(domain, dt, flow, surface.parts().0);
        }
        if let Some(acceleration) = &*acceleration {
            grains.join(domain, flow, acceleration.response(), dt);
            acceleration.add(domain, &mut flow.velocity, dt);
        }
        report.diffusion += grains.diffuse(domain, boundary, flow, gravity, dt)?;
        Ok(())
    }

    /// Phase 3: gravity, face velocities.
    fn predict(&mut self, report: &mut StepReport) {
        let Self { now, flow, grains, acceleration, .. } = self;
        match &*acceleration {
            Some(acceleration) => {
                grains.settle(now.domain, flow, acceleration.response());
                acceleration.predict(now, flow, &mut report.impulses);
            }
            None => now.predict(flow, &mut report.impulses),
        }
    }

    /// Phase 4: pressure, velocities free of divergence beside grains that close faces.
    fn project(&mut self, report: &mut StepReport) -> Result<(), StepError> {
        let Pass { domain, boundary, gravity, dt } = self.now;
        if let Some(closing) = self.grains.closing() {
            let response = self.acceleration.as_ref().and_then(|acceleration| acceleration.response());
            let cut = |into: &mut [Field<Real>; 9]| self.grains.cut_faces(domain, into);
            let before = self.acceleration.as_ref().filter(|acceleration| acceleration.is_beside_surfaces());
            let before = before.map(|acceleration| (acceleration.kept(), gravity));
            let closing = Closing { response, before, cut: Some(&cut), ..closing };
            self.projection.close_faces(domain, boundary, closing, self.flow, dt);
        }
        if let Some(tension) = &mut self.projection.tension {
            tension.place_grains(domain, |into| self.grains.sum_wide(domain, WIDE, into));
            tension.place_narrow_grains(domain, |into| self.grains.sum_narrow(domain, WIDE, into));
            let solid = self.grains.filled_fraction(domain);
            self.projection.find_jumps(domain, self.flow, solid);
        }
        let Flow { volume_fraction, density, velocity, face_velocity, .. } = &mut *self.flow;
        let fluid = [&*volume_fraction, &*density];
        let (tolerance, courant) = (&self.settings.tolerance, report.courant);
        report.pressure +=
            self.projection.project(domain, fluid, velocity, face_velocity, gravity, dt, tolerance, courant)?;
        Ok(())
    }

    /// The part of the pass in the loads of phase 5: what the projection moved the surfaces by, and the stress.
    fn load(&mut self, report: &mut StepReport) {
        let Self { now, flow, projection, grains, room, .. } = self;
        let Pass { domain, gravity, dt, .. } = *now;
        if let Some(acceleration) = &self.acceleration {
            let rows = grains.surface_mut().map(|surface| &surface.covered);
            if let (Some(response), Some(rows)) = (acceleration.response(), rows) {
                acceleration.find_change(now, flow, projection, rows);
                grains.give_way(domain, flow, response);
            }
            grains.end_pass(domain, flow, gravity, dt);
        }
        if let Some(room) = room {
            room.hand_over(domain, grains.covered(), flow, gravity * dt);
            if let (Some(tension), Some(surface)) = (&mut projection.tension, grains.surface_mut()) {
                let (open, given) = room.open_and_given();
                let into = [surface.taken_mut(), given];
                report.impulses.surface_tension += tension.pull_grains(domain, open, dt, into);
                if let Some(pulled) = tension.pull_narrow_grains(domain, dt, room.open_and_given().1) {
                    report.impulses.surface_tension += pulled;
                }
            }
        }
        let gradient = projection.gradient(&flow.density);
        grains
            .add_stress(domain, dt, |at| flow.density.data()[at] * flow.viscous_acceleration(at, dt) - gradient.at(at));
    }
}
