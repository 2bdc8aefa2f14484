//! Loads of the fluid on grains: interpolation of the fluid, drag in the contact sub-steps, and the pressure force.

use sazanami_dem::{ContactReport, DemError, Drag, Engine, Grains, Loads, Substeps};
use sazanami_numerics::domain::Domain;
use sazanami_numerics::{Real, Vector};
use sazanami_parallel::for_each_chunk;

use super::binned::{Binned, Lanes, lanes};
use super::drag::{DragLaw, ForDragLaw, relaxation_rate, volume, yielding};
use super::kept::{DRAG_FORCE, PLACE, PRESSING, PRESSURE_FORCE, SUPPORT, VOID, WETNESS, set_vector, vector};
use super::{CouplingReport, FluidAtGrain, GrainPhase, Lift, diameter_of, largest};
use crate::boundary::Tank;
use crate::context::{Context, Motion};
use crate::ghosts::Ghosts;
use crate::neighbours::ROWS;
use crate::particles::{Kind, Particles};
use crate::reductions::{set_column, sum_of};
use crate::weight::{Calibration, Weight};

/// Sum of weights over n0 above which a grain is fully wet.
const WET: Real = 0.5;

/// Columns of the fluid that grains interpolate, ghosts included.
struct Fluid<'a, U> {
    kind: &'a [Kind],
    position: &'a [Vector],
    inverse_void: &'a [Real],
    /// What is interpolated, by particle: the velocity [m/s] or a part of the acceleration [m/s^2].
    of_motion: U,
}

impl<U: Fn(usize) -> Vector + Sync> Fluid<'_, U> {
    /// Sorts the fluid particles into bins, in their present order.
    fn put_into(&self, binned: &mut Binned<7>, domain: &Domain, radius: Real) {
        binned.fill(
            domain,
            radius,
            self.position.len(),
            |a| (self.kind[a] == Kind::Fluid).then_some(self.position[a]),
            |a, b| a.cmp(&b),
            |a| {
                let (x, u) = (self.position[a], (self.of_motion)(a));
                [x.x, x.y, x.z, self.inverse_void[a], u.x, u.y, u.z]
            },
        );
    }
}

/// Drag on the own grains in the contact sub-steps of a step.
struct FluidDrag<'a, L> {
    law: &'a L,
    around: &'a [FluidAtGrain],
    diameter: &'a [Real],
}

impl<L: DragLaw> Drag for FluidDrag<'_, L> {
    fn fluid_velocity(&self, own: usize) -> Vector {
        self.around[own].velocity
    }

    fn coefficient(&self, own: usize, slip: Real) -> Real {
        let around = &self.around[own];
        if around.wetness == 0.0 {
            return 0.0;
        }
        around.wetness * self.law.coefficient(self.diameter[own], around.void_fraction, slip)
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
            let slip = (around.velocity - grains.velocity[g]).length();
            let d = diameter[g];
            let kappa = around.wetness * law.coefficient(d, around.void_fraction, slip);
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
    particle_mass: Real,
    /// Sum of weights above which a grain is fully wet.
    whole: Real,
}

impl NearFluid {
    /// One over the mass of the fluid that yields to a grain of diameter `d` \[m] at void fraction `eps` with this sum of weights [1/kg].
    pub fn inverse_mass(&self, d: Real, eps: Real, support: Real) -> Real {
        // The fluid between grains, less where a grain stands out of it: beside a wall each grain has half the fluid,
        // and each fluid particle half the grains. A grain alone moves at most the particles it reads.
        let between = yielding(self.density, d, eps) * (self.whole / support).max(1.0);
        between.max(1.0 / (support * self.particle_mass))
    }
}

impl GrainPhase {
    /// What the fluid that yields to a grain is known by.
    pub(super) fn near_fluid(&self, step: &Context<'_>) -> NearFluid {
        let Context { kernel, settings, .. } = *step;
        let reach = Weight { radius: self.coupling.reach * kernel.weight.radius };
        let full = Calibration::new(&reach, settings.fluid.spacing).number_density;
        let (density, particle_mass) = (self.coupling.drag.density, step.particle_mass());
        NearFluid { density, particle_mass, whole: WET * full }
    }

    /// Interpolates the fluid at each own grain: its velocity at the start of the step or, for an implicit exchange, the
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
        let Context { domain, kernel, dt, .. } = *step;
        self.begin_pressing(step, particles, inverse_void, ghosts);
        let Particles { kind, position, velocity, gradient, .. } = &*particles;
        let density = self.coupling.drag.density;
        let yields = if predicted.is_some() { -dt / density } else { 0.0 };
        let velocity = predicted.unwrap_or(velocity);
        let of_motion = |a: usize| velocity[a] + yields * gradient[a];
        let fluid = Fluid { kind, position, inverse_void, of_motion };
        let near = self.near_fluid(step);
        let Self { engine, coupling, sources, around, diameter, fluid: binned, gates, .. } = self;
        let (engine, gates) = (&*engine, &gates[..]);
        let grains = engine.grains();
        set_column(diameter, grains.owned(), |g| diameter_of(engine, g));
        fluid.put_into(binned, domain, coupling.reach * kernel.weight.radius);
        let (binned, sources, diameter, least) = (&*binned, &*sources, &diameter[..], coupling.least_void);
        let with_added_mass = coupling.added_mass.is_some();
        set_column(around, grains.owned(), |g| {
            let x = grains.position[g];
            let [support, u, v, w] = binned.sum_beside(gates, x, |pair, fluid: &[Lanes; 7]| {
                let [_, _, _, inverse_void, u, v, w] = fluid;
                let weight = lanes(|l| pair.weight[l] * inverse_void[l]);
                let mean = |field: &Lanes| lanes(|l| weight[l] * field[l]);
                [weight, mean(u), mean(v), mean(w)]
            });
            let mut sum = FluidAtGrain { support, ..FluidAtGrain::default() };
            if support > 0.0 {
                sum.velocity = Vector::new(u, v, w) / support;
                sum.wetness = (support / near.whole).min(1.0);
            }
            let solid = sources.fraction(x);
            sum.void_fraction = (1.0 - sources.around(solid, diameter[g])).clamp(least, 1.0);
            if support > 0.0 {
                let inverse_mass = near.inverse_mass(diameter[g], sum.void_fraction, support);
                sum.inverse_fluid_mass = if predicted.is_some() { inverse_mass } else { 0.0 };
                sum.inverse_moved_mass = if with_added_mass { inverse_mass } else { 0.0 };
            }
            sum
        });
        let (mut around, grains) = (std::mem::take(&mut self.around), self.engine.grains());
        for_each_grain(&mut around, |g, around| around.pressing = self.pressing_at(tank, grains.position[g]));
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
            FluidAtGrain { wetness: 1.0, void_fraction, ..FluidAtGrain::default() }
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
        let Self { engine, coupling, around, diameter, force, places, .. } = self;
        let density = coupling.drag.density;
        let (around, diameter, owned, still) = (&around[..], &diameter[..], around.len(), step.still_force());
        set_column(force, owned, |g| {
            -volume(diameter[g]) * (around[g].pressing + around[g].wetness * density * (still - by_volume))
        });
        set_column(places, owned, |g| engine.grains().unwrapped_position(g));
        for_each_grain(&mut engine.attached_mut()[..owned], |g, kept| {
            set_vector(kept, PLACE, places[g]);
            kept[SUPPORT] = around[g].support;
            kept[WETNESS] = around[g].wetness;
            kept[VOID] = around[g].void_fraction;
            set_vector(kept, PRESSING, around[g].pressing);
            set_vector(kept, PRESSURE_FORCE, force[g]);
        });
        let has_more = coupling.has_more_than_drag();
        if has_more {
            self.add_further_forces(step);
        }
        let Self { engine, coupling, around, diameter, force, places, added, .. } = self;
        let (around, diameter, added_mass) = (&around[..], &diameter[..], added.as_flattened());
        let substeps = coupling.substeps;
        let [without] = sum_of(owned, |g| [if around[g].without_vorticity { 1.0 } else { 0.0 }]);
        let contacts = coupling.drag.run(Advance {
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
        let grains = engine.grains();
        let sum = domain.sum(sum_of(owned, |g| {
            let drag = grains.drag_impulse[g];
            let kept = &grains.attached[g];
            // That of the water alone; what comes from outside has no reaction on it.
            let outside = kept[WETNESS] * density * volume(diameter[g]) * by_volume;
            let pressure = dt * (vector(kept, PRESSURE_FORCE) - outside);
            [drag.x, drag.y, drag.z, pressure.x, pressure.y, pressure.z]
        }));
        report.drag_on_grains = Vector::from_slice(&sum[..3]);
        report.pressure_on_grains = Vector::from_slice(&sum[3..]);
        set_column(places, owned, |g| grains.drag_impulse[g]);
        for_each_grain(&mut engine.attached_mut()[..owned], |g, kept| {
            set_vector(kept, DRAG_FORCE, places[g] / dt);
        });
        if has_more {
            self.report_further_forces(step, without, report);
        }
        Ok(contacts)
    }

    /// Corrects the pressure force of the step from the pressure of the step before to the new one, and settles the added mass. The
    /// fluid was `new` places and had the velocities `unpressed` without the pressure of the step [m/s]. Adds the impulses to the
    /// report.
    pub(crate) fn correct_pressure_force(
        &mut self,
        step: &Context<'_>,
        tank: &Tank,
        (particles, ghosts): (&mut Particles, &mut Ghosts),
        (new, unpressed): (&Motion, impl Fn(usize) -> Vector + Sync),
        inverse_void: &[Real],
        report: &mut CouplingReport,
    ) {
        if !self.is_active() {
            return;
        }
        let Context { domain, kernel, dt, .. } = *step;
        self.press_anew(step, particles, ghosts);
        if self.coupling.added_mass.is_some() {
            let (kind, velocity, by_body) = (&particles.kind[..], &particles.velocity[..], step.explicit_force());
            let of_motion = |a: usize| (unpressed(a) - velocity[a]) / dt - by_body;
            let fluid = Fluid { kind, position: &new.position, inverse_void, of_motion };
            fluid.put_into(&mut self.fluid, domain, self.coupling.reach * kernel.weight.radius);
        }
        let mut force = std::mem::take(&mut self.force);
        let (engine, grains) = (&self.engine, self.engine.grains());
        let owned = grains.owned();
        set_column(&mut force, owned, |g| {
            let kept = &grains.attached[g];
            let begun = engine.image_position(vector(kept, PLACE), grains.image(g));
            -volume(diameter_of(engine, g)) * (self.pressing_at(tank, begun) - vector(kept, PRESSING))
        });
        self.force = force;
        let Self { engine, force, .. } = self;
        for_each_grain(&mut engine.attached_mut()[..owned], |g, kept| {
            (0..3).for_each(|d| kept[PRESSURE_FORCE + d] += force[g][d]);
        });
        for_each_grain(&mut force[..], |_, impulse| *impulse *= dt);
        let sum = domain.sum(sum_of(owned, |g| force[g].to_array()));
        report.pressure_on_grains += Vector::from_array(sum);
        self.share_pressure_with_added_mass();
        self.engine.apply_impulses(domain, &self.force);
        report.added_mass_on_grains = self.settle_added_mass(step);
    }
}

/// Calls `body` with each grain and its entry of a column.
fn for_each_grain<T: Send>(column: &mut [T], body: impl Fn(usize, &mut T) + Sync) {
    for_each_chunk(column, ROWS, |number, column| {
        column.iter_mut().enumerate().for_each(|(row, entry)| body(number * ROWS + row, entry));
    });
}
