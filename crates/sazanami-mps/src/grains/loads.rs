//! Loads of the fluid on grains: interpolation of the fluid, drag in the contact sub-steps, and the pressure force.

use sazanami_dem::{ContactReport, DemError, Drag, Engine, Grains, Loads, Substeps};
use sazanami_numerics::domain::Domain;
use sazanami_numerics::{Real, Vector};

use super::drag::{DragLaw, ForDragLaw, relaxation_rate, volume, yielding};
use super::exchange::GIVEN;
use super::kept::{FELT, PLACE, PRESSING, PRESSURE_FORCE, SHARE, VOID, WEIGHTS, WETNESS, set_vector, vector};
use super::{CouplingReport, FluidAtGrain, Lift, OverlappingGrains, diameter_of, largest};
use crate::boundary::Tank;
use crate::context::Context;
use crate::ghosts::Ghosts;
use crate::particles::Particles;
use crate::reductions::{for_each_entry, set_column, sum_of};

/// Drag on the own grains in the contact sub-steps of a step.
struct FluidDrag<'a, L> {
    law: &'a L,
    around: &'a [FluidAtGrain],
    diameter: &'a [Real],
}

impl<L: DragLaw> Drag for FluidDrag<'_, L> {
    fn fluid_velocity(&self, own: usize) -> Vector {
        self.around[own].velocity + self.around[own].gust
    }

    fn coefficient(&self, own: usize, slip: Real) -> Real {
        let around = &self.around[own];
        if around.wetness == 0.0 {
            return 0.0;
        }
        around.wetness * around.drag_factor * self.law.coefficient(self.diameter[own], around.void_fraction, slip)
    }

    fn inverse_fluid_mass(&self, own: usize) -> Real {
        self.around[own].inverse_fluid_mass
    }
}

/// The contact sub-steps of a step, with drag.
struct Advance<'a> {
    domain: &'a Domain,
    engine: &'a mut Engine,
    around: &'a [FluidAtGrain],
    diameter: &'a [Real],
    /// Pressure force \[N].
    force: &'a [Vector],
    added_mass: &'a [Real],
    body_force: Vector,
    dt: Real,
    substeps: Substeps,
}

impl ForDragLaw for Advance<'_> {
    type Output = Result<ContactReport, DemError>;

    fn run<L: DragLaw>(self, law: &L) -> Self::Output {
        let Self { domain, engine, around, diameter, force, added_mass, body_force, dt, substeps } = self;
        let drag = FluidDrag { law, around, diameter };
        let loads = Loads { force, torque: &[], added_mass, drag: Some(&drag) };
        engine.advance(domain, &loads, body_force, dt, substeps)
    }
}

/// The shortest drag relaxation time of the grains and the fluid around them.
struct DragRate<'a> {
    domain: &'a Domain,
    grains: &'a Grains,
    /// Density of the fluid [kg/m^3].
    density: Real,
    around: &'a [FluidAtGrain],
    diameter: &'a [Real],
}

impl ForDragLaw for DragRate<'_> {
    /// Its reciprocal, over all ranks [1/s].
    type Output = Real;

    fn run<L: DragLaw>(self, law: &L) -> Real {
        let Self { domain, grains, density, around, diameter } = self;
        let rate = |g: usize| {
            let around = &around[g];
            let slip = (around.velocity + around.gust - grains.velocity[g]).length();
            let d = diameter[g];
            let kappa = around.wetness * around.drag_factor * law.coefficient(d, around.void_fraction, slip);
            relaxation_rate(kappa, density, d, grains.mass[g], around.void_fraction)
        };
        largest(domain, around.len(), rate)
    }
}

/// The fluid around a grain that yields to it.
#[derive(Clone, Copy)]
pub(super) struct NearFluid {
    /// Density of the fluid [kg/m^3].
    density: Real,
    /// Most of the smoothing function [1/m^3].
    most: Real,
}

impl NearFluid {
    /// One over the mass of the fluid that yields to a grain of diameter `d` \[m] at void fraction `eps` with this sum of weights [1/kg].
    pub fn inverse_mass(&self, d: Real, eps: Real, share: Real) -> Real {
        // The fluid between grains, less where a grain stands out of it: at a surface each grain has half the fluid,
        // and each fluid particle half the grains. A grain alone moves at most the particles it reads.
        let between = yielding(self.density, d, eps) * (0.5 / share).max(1.0);
        between.max(self.most / (share * self.density))
    }
}

impl OverlappingGrains {
    /// What the fluid that yields to a grain is known by.
    pub(super) fn near_fluid(&self) -> NearFluid {
        NearFluid { density: self.coupling.drag.density, most: self.sources.smoothing().1 }
    }

    /// Interpolates the fluid at each own grain: its velocity at the start of the step or, for implicit drag, the
    /// `predicted` one without drag [m/s] and with the pressure of the step before.
    pub(crate) fn interpolate_fluid(
        &mut self,
        step: &Context<'_>,
        tank: &Tank,
        particles: &mut Particles,
        predicted: Option<&[Vector]>,
        inverse_void: &[Real],
        ghosts: &mut Ghosts,
    ) {
        if !self.is_active() {
            return;
        }
        ghosts.refresh(step.domain, &mut particles.gradient);
        let mut felt = std::mem::take(&mut self.felt);
        let yields = if predicted.is_some() { -step.dt / self.coupling.drag.density } else { 0.0 };
        let velocity = predicted.unwrap_or(&particles.velocity);
        set_column(&mut felt, particles.len(), |a| velocity[a] + yields * particles.gradient[a]);
        self.begin_reading(step, particles, inverse_void, |a| felt[a], ghosts);
        self.felt = felt;
        let Self { engine, diameter, .. } = self;
        let (engine, owned) = (&*engine, engine.grains().owned());
        set_column(diameter, owned, |g| diameter_of(engine, g));
        let (implicit, with_added_mass) = (predicted.is_some(), self.coupling.added_mass.is_some());
        let (mut around, near) = (std::mem::take(&mut self.around), self.near_fluid());
        set_column(&mut around, owned, |g| {
            let mut felt = self.feel(tank, g, self.diameter[g]);
            if felt.share > 0.0 {
                let inverse_mass = near.inverse_mass(self.diameter[g], felt.void_fraction, felt.share);
                felt.inverse_fluid_mass = if implicit { inverse_mass } else { 0.0 };
                felt.inverse_moved_mass = if with_added_mass { inverse_mass } else { 0.0 };
            }
            felt
        });
        self.around = around;
        if self.coupling.lift != Lift::None {
            self.set_lift();
        }
    }

    /// Where there is no water nothing is around the own grains.
    pub(crate) fn leave_dry(&mut self) {
        let Self { engine, around, diameter, .. } = self;
        let (engine, owned) = (&*engine, engine.grains().owned());
        set_column(diameter, owned, |g| diameter_of(engine, g));
        set_column(around, owned, |_| FluidAtGrain { void_fraction: 1.0, ..FluidAtGrain::default() });
    }

    /// Sets the drag rate for the first step: grains among others as they lie, in fluid at rest. All ranks take part.
    pub(crate) fn expect_drag(&mut self, domain: &Domain, tank: &Tank) {
        if self.is_empty() {
            return;
        }
        self.place(domain, tank);
        let Self { engine, coupling, sources, around, diameter, .. } = self;
        let (engine, sources, least) = (&*engine, &*sources, coupling.least_void);
        let grains = engine.grains();
        set_column(diameter, grains.owned(), |g| diameter_of(engine, g));
        set_column(around, grains.owned(), |g| {
            let solid = sources.fraction(grains.position[g]);
            let void_fraction = (1.0 - sources.around(solid, diameter[g])).clamp(least, 1.0);
            FluidAtGrain { wetness: 1.0, void_fraction, drag_factor: 1.0, ..FluidAtGrain::default() }
        });
        self.first_drag_rate = Some(self.present_drag_rate(domain));
    }

    /// The [`Self::drag_rate`] of the present state.
    fn present_drag_rate(&self, domain: &Domain) -> Real {
        let Self { engine, coupling, around, diameter, .. } = self;
        coupling.drag.run(DragRate {
            domain,
            grains: engine.grains(),
            density: coupling.drag.density,
            around,
            diameter,
        })
    }

    /// Advances the grains under contacts, drag, the pressure of the previous step and the body force.
    ///
    /// # Errors
    /// [`DemError`] if the contact engine fails.
    pub(crate) fn advance(
        &mut self,
        step: &Context<'_>,
        report: &mut CouplingReport,
    ) -> Result<ContactReport, DemError> {
        if !self.is_active() {
            return Ok(ContactReport::default());
        }
        let Context { domain, dt, .. } = *step;
        let by_volume = step.forcing.by_volume;
        let body_force = step.forcing.body_force - by_volume;
        self.drag_rate = self.present_drag_rate(domain);
        self.first_drag_rate = None;
        let near = self.near_fluid();
        let Self { engine, coupling, around, diameter, force, places, shared, .. } = self;
        let (law, density) = (coupling.drag, coupling.drag.density);
        let (around, diameter, owned, still) = (&around[..], &diameter[..], around.len(), step.still_force());
        set_column(force, owned, |g| {
            -volume(diameter[g]) * (around[g].pressing + around[g].submerged * density * (still - by_volume))
        });
        set_column(places, owned, |g| engine.grains().unwrapped_position(g));
        set_column(shared, owned, |g| {
            [(around[g].velocity + around[g].gust - engine.grains().velocity[g]).length(); GIVEN]
        });
        for_each_entry(&mut engine.attached_mut()[..owned], |g, kept| {
            set_vector(kept, PLACE, places[g]);
            let mut resists = 0.0;
            if around[g].share > 0.0 {
                let kappa = law.coefficient(diameter[g], around[g].void_fraction, shared[g][0]);
                let resistance = dt * around[g].wetness * around[g].drag_factor * kappa;
                let inverse_mass = near.inverse_mass(diameter[g], around[g].void_fraction, around[g].share);
                resists = resistance / (1.0 + resistance * inverse_mass);
            }
            set_vector(kept, FELT, around[g].velocity);
            kept[WEIGHTS..WEIGHTS + 3].copy_from_slice(&[around[g].weights[0], around[g].weights[1], resists]);
            kept[SHARE] = around[g].share;
            kept[WETNESS] = around[g].wetness;
            kept[VOID] = around[g].void_fraction;
            set_vector(kept, PRESSING, around[g].pressing);
            set_vector(kept, PRESSURE_FORCE, force[g]);
        });
        let has_more = coupling.has_more_than_drag();
        if has_more {
            self.add_further_forces(step);
        }
        let Self { engine, coupling, around, diameter, force, added, .. } = self;
        let (around, diameter, added_mass) = (&around[..], &diameter[..], added.as_flattened());
        let substeps = coupling.substeps;
        let [without] = sum_of(owned, |g| [if around[g].without_vorticity { 1.0 } else { 0.0 }]);
        // Impulse on the grains from outside the water, which has no reaction on it.
        let [displaced] = domain.sum(sum_of(owned, |g| [around[g].submerged * volume(diameter[g])]));
        let outside = dt * density * displaced * by_volume;
        let mut contacts = coupling.drag.run(Advance {
            domain,
            engine,
            around,
            diameter,
            force,
            added_mass,
            body_force,
            dt,
            substeps,
        })?;
        if step.forcing.wall_velocity != Vector::ZERO {
            contacts.largest_speed = self.largest_speed(domain, step.forcing.wall_velocity);
        }
        // Some grains have moved on to other ranks.
        let grains = self.engine.grains();
        let sum = domain.sum(sum_of(grains.owned(), |g| {
            let (drag, pressure) = (grains.drag_impulse[g], dt * vector(&grains.attached[g], PRESSURE_FORCE));
            [drag.x, drag.y, drag.z, pressure.x, pressure.y, pressure.z]
        }));
        report.drag_on_grains = Vector::from_slice(&sum[..3]);
        report.pressure_on_grains = Vector::from_slice(&sum[3..]) - outside;
        if has_more {
            self.report_further_forces(step, without, report);
        }
        Ok(contacts)
    }

    /// Corrects the pressure force of the step from the pressure of the step before to the new one, and settles the added mass. Without
    /// the pressure of the step the fluid had the velocities `unpressed` [m/s]. Adds the impulses to the report.
    pub(crate) fn correct_pressure_force(
        &mut self,
        step: &Context<'_>,
        tank: &Tank,
        (particles, ghosts): (&mut Particles, &mut Ghosts),
        unpressed: impl Fn(usize) -> Vector + Sync,
        inverse_void: &[Real],
        report: &mut CouplingReport,
    ) {
        if !self.is_active() {
            return;
        }
        let Context { domain, dt, .. } = *step;
        ghosts.refresh(domain, &mut particles.gradient);
        let (with_added_mass, by_body) = (self.coupling.added_mass.is_some(), step.explicit_force());
        let velocity = &particles.velocity[..];
        let of_motion =
            |a: usize| if with_added_mass { (unpressed(a) - velocity[a]) / dt - by_body } else { Vector::ZERO };
        self.read_anew(step, particles, inverse_void, of_motion);
        self.read_at_start(tank);
        let mut force = std::mem::take(&mut self.force);
        let (engine, grains) = (&self.engine, self.engine.grains());
        let owned = grains.owned();
        set_column(&mut force, owned, |g| {
            let kept = &grains.attached[g];
            -volume(diameter_of(engine, g)) * (self.readings[g].gradient - vector(kept, PRESSING))
        });
        self.force = force;
        let Self { engine, force, .. } = self;
        for_each_entry(&mut engine.attached_mut()[..owned], |g, kept| {
            (0..3).for_each(|d| kept[PRESSURE_FORCE + d] += force[g][d]);
        });
        for_each_entry(&mut force[..], |_, impulse| *impulse *= dt);
        let sum = domain.sum(sum_of(owned, |g| force[g].to_array()));
        report.pressure_on_grains += Vector::from_array(sum);
        self.share_pressure_with_added_mass();
        self.engine.apply_impulses(domain, &self.force);
        report.added_mass_on_grains = self.settle_added_mass(step);
    }
}
