//! Added mass: fluid that grains accelerate with themselves.
//!
//! The force on a grain is `C rho V (Du/Dt - dv/dt)`. Its part with `dv/dt` is inertia: the grain moves with the mass
//! `m + C rho V`. `Du/Dt` is known but for the pressure of the step, whose part comes with the new pressure force. The
//! reaction acts on the fluid in the next step, so that the pressure equation sees it.
//!
//! Between grains the reaction slows the fluid that they read. With the mass `M` of fluid that yields to a grain and the
//! acceleration `A` that this fluid has without the reaction, `Du/Dt = A - F/M` gives `F = C' (A - dv/dt)` with
//! `1/C' = 1/(C rho V) + 1/M`. The method takes that `A` of the step before as `Du/Dt + F/M`: where the flow is steady
//! the force is that of `C` whatever `M` is, and no step overshoots however dense or light the grains are.

use sazanami_numerics::domain::Domain;
use sazanami_numerics::{Real, Vector, choices};
use sazanami_parallel::for_each_chunk;

use super::drag::volume;
use super::exchange::with_zeros;
use super::kept::{
    ADDED_MASS, ADDED_MASS_FORCE, CARRIED, LIFT_FORCE, NOT_RETURNED, SHARE, VOID, WETNESS, set_vector, vector,
};
use super::{CouplingReport, OverlappingGrains, diameter_of};
use crate::context::Context;
use crate::neighbours::ROWS;
use crate::reductions::{set_column, sum_of};

choices! {
    /// Added mass of the grains.
    #[derive(Default)]
    pub enum AddedMassForm {
        /// None.
        #[default]
        None = "none",
        /// The coefficient whatever the void fraction.
        Constant = "constant",
        /// The coefficient times `(1 + 2 phi)/(1 - phi)` at the solid fraction `phi` around a grain (Zuber 1964).
        Zuber = "zuber",
    }
}

/// Law of the added mass.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AddedMass {
    /// How the coefficient depends on the void fraction.
    pub form: AddedMassForm,
    /// Added mass of a grain alone over the mass of the fluid that it displaces: 1/2 for a sphere.
    pub coefficient: Real,
}

impl AddedMass {
    /// Grains without added mass.
    pub const NONE: Self = Self { form: AddedMassForm::None, coefficient: 0.5 };

    /// Whether there is one.
    #[must_use]
    pub fn is_some(&self) -> bool {
        self.form != AddedMassForm::None
    }

    /// Added mass over the mass of displaced fluid at void fraction `eps`.
    ///
    /// Zuber, Chem. Eng. Sci. 19, 897 (1964).
    #[must_use]
    pub fn at(&self, eps: Real) -> Real {
        match self.form {
            AddedMassForm::None => 0.0,
            AddedMassForm::Constant => self.coefficient,
            AddedMassForm::Zuber => self.coefficient * (3.0 - 2.0 * eps) / eps,
        }
    }
}

impl OverlappingGrains {
    /// Whether grains accelerate fluid with themselves in this step.
    fn has_added_mass(&self) -> bool {
        self.is_active() && self.coupling.added_mass.is_some()
    }

    /// Takes the velocity of each own grain along with the fluid, but for what body force and pressure do in the step of
    /// `dt` \[s]; before the walls give theirs to the grains glued to them.
    pub(super) fn carry_with_fluid(&mut self, dt: Real) {
        if !self.has_added_mass() {
            return;
        }
        let Self { engine, places, .. } = self;
        let grains = engine.grains();
        let owned = grains.owned();
        set_column(places, owned, |g| grains.velocity[g]);
        let velocity = &places[..];
        for_each_chunk(&mut engine.attached_mut()[..owned], ROWS, |number, kept| {
            for (kept, velocity) in kept.iter_mut().zip(&velocity[number * ROWS..]) {
                set_vector(kept, CARRIED, *velocity + dt * vector(kept, CARRIED));
            }
        });
    }

    /// Makes `added` the added masses with which all grains and ghosts move.
    pub(super) fn share_added_mass(&mut self, domain: &Domain) {
        let Self { engine, coupling, added, .. } = self;
        if !coupling.added_mass.is_some() {
            return;
        }
        let grains = engine.grains();
        set_column(added, grains.len(), |g| [if g < grains.owned() { grains.attached[g][ADDED_MASS] } else { 0.0 }]);
        engine.share_with_ghosts(domain, added);
    }

    /// Adds lift and added mass to the forces of the step, and keeps them with the grains; the forces are those of the
    /// pressure of the step before.
    pub(super) fn add_further_forces(&mut self, step: &Context<'_>) {
        let (dt, density) = (step.dt, self.coupling.drag.density);
        let with_added_mass = self.has_added_mass();
        let Self { engine, coupling, around, diameter, force, places, added, .. } = self;
        let grains = engine.grains();
        let owned = grains.owned();
        set_column(places, owned, |g| grains.velocity[g]);
        if with_added_mass {
            set_column(added, owned, |g| {
                let around = &around[g];
                let free =
                    around.wetness * coupling.added_mass.at(around.void_fraction) * density * volume(diameter[g]);
                [free / (1.0 + free * around.inverse_moved_mass)]
            });
        }
        let (around, velocity, added, by_body) = (&around[..], &places[..], &added[..], step.explicit_force());
        let hydrostatic = density * step.unreduced_still_force();
        for_each_chunk((&mut engine.attached_mut()[..owned], &mut force[..]), ROWS, |number, (kept, force)| {
            for (row, (kept, force)) in kept.iter_mut().zip(force).enumerate() {
                let g = number * ROWS + row;
                set_vector(kept, LIFT_FORCE, around[g].lift);
                *force += around[g].lift;
                if with_added_mass {
                    let [mass] = added[g];
                    let gradient = around[g].pressing / around[g].wetness.max(Real::MIN_POSITIVE) + hydrostatic;
                    let carried = vector(kept, CARRIED) + dt * (by_body - gradient / density);
                    *force += mass / dt * (carried - velocity[g]);
                    kept[ADDED_MASS] = mass;
                    set_vector(kept, CARRIED, carried);
                }
            }
        });
    }

    /// Puts the impulses of lift, and of the added mass in the step before, into the report.
    pub(super) fn report_further_forces(&self, step: &Context<'_>, without: Real, report: &mut CouplingReport) {
        let (grains, dt) = (self.engine.grains(), step.dt);
        let [l1, l2, l3, r1, r2, r3] = sum_of(grains.owned(), |g| {
            let kept = &grains.attached[g];
            let returned = if kept[SHARE] > 0.0 { vector(kept, NOT_RETURNED) } else { Vector::ZERO };
            let lift = dt * vector(kept, LIFT_FORCE);
            [lift.x, lift.y, lift.z, returned.x, returned.y, returned.z]
        });
        let sums = step.domain.sum([l1, l2, l3, r1, r2, r3, without]);
        report.lift_on_grains = Vector::from_slice(&sums[..3]);
        report.added_mass_returned = Vector::from_slice(&sums[3..6]);
        report.without_vorticity = sums[6] as usize;
    }

    /// Makes `force`, the impulses of the new pressure on the own grains [N s], those that move the grains' own masses as these and
    /// the acceleration of the fluid by the same pressure move grains and added mass.
    pub(super) fn share_pressure_with_added_mass(&mut self) {
        if !self.has_added_mass() {
            return;
        }
        let Self { engine, coupling, force, shared, .. } = self;
        let (grains, density) = (engine.grains(), coupling.drag.density);
        let owned = grains.owned();
        // One over the mass of the displaced fluid, and the share of the grain in the inertia.
        set_column(shared, owned, |g| {
            let [mass, displaced] = [grains.attached[g][ADDED_MASS], density * volume(diameter_of(engine, g))];
            with_zeros([displaced.recip(), grains.mass[g] / (grains.mass[g] + mass)])
        });
        let shared = &shared[..];
        for_each_chunk((&mut engine.attached_mut()[..owned], &mut force[..]), ROWS, |number, (kept, force)| {
            for ((kept, force), shared) in kept.iter_mut().zip(force).zip(&shared[number * ROWS..]) {
                let [per_displaced, share, ..] = *shared;
                if kept[ADDED_MASS] > 0.0 {
                    let carried = per_displaced / kept[WETNESS] * *force;
                    set_vector(kept, CARRIED, vector(kept, CARRIED) + carried);
                    *force = share * (*force + kept[ADDED_MASS] * carried);
                }
            }
        });
    }

    /// Settles the impulse of the added mass on each own grain in the step, and reads the acceleration of the fluid for the next
    /// one; the bins hold it without body force and pressure. Returns the impulse over all ranks [N s].
    pub(super) fn settle_added_mass(&mut self, step: &Context<'_>) -> Vector {
        if !self.has_added_mass() {
            return Vector::ZERO;
        }
        let near = self.near_fluid();
        let Self { engine, readings, shared, .. } = self;
        let (grains, dt) = (engine.grains(), step.dt);
        let (owned, readings) = (grains.owned(), &readings[..]);
        set_column(shared, owned, |g| {
            let kept = &grains.attached[g];
            let read = &readings[g];
            let mut other = Vector::ZERO;
            if read.share > 0.0 {
                other = read.velocity / read.share;
                if kept[SHARE] > 0.0 {
                    let yields = near.inverse_mass(diameter_of(engine, g), kept[VOID], kept[SHARE]);
                    other += yields / dt * vector(kept, NOT_RETURNED);
                }
            }
            let impulse = kept[ADDED_MASS] * (vector(kept, CARRIED) - grains.velocity[g]);
            with_zeros([impulse.x, impulse.y, impulse.z, other.x, other.y, other.z])
        });
        let shared = &shared[..];
        for_each_chunk(&mut engine.attached_mut()[..owned], ROWS, |number, kept| {
            for (kept, shared) in kept.iter_mut().zip(&shared[number * ROWS..]) {
                let (impulse, other) = (Vector::from_slice(&shared[..3]), Vector::from_slice(&shared[3..6]));
                let before = if kept[SHARE] > 0.0 { Vector::ZERO } else { vector(kept, NOT_RETURNED) };
                set_vector(kept, NOT_RETURNED, before + impulse);
                set_vector(kept, ADDED_MASS_FORCE, impulse / dt);
                set_vector(kept, CARRIED, other);
            }
        });
        let [x, y, z] = sum_of(owned, |g| [shared[g][0], shared[g][1], shared[g][2]]);
        Vector::from_array(step.domain.sum([x, y, z]))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn zubers_coefficient_is_that_of_a_sphere_alone_in_clear_fluid() {
        let of = |form, eps| AddedMass { form, coefficient: 0.5 }.at(eps);
        assert!((of(AddedMassForm::Zuber, 1.0) - 0.5).abs() < 1e-12);
        // At phi = 0.4: 0.5 (1.8)/(0.6).
        assert!((of(AddedMassForm::Zuber, 0.6) - 1.5).abs() < 1e-12);
        // Negative control: without the factor, and without added mass.
        assert_eq!([AddedMassForm::Constant, AddedMassForm::None].map(|form| of(form, 0.6)), [0.5, 0.0]);
    }
}
