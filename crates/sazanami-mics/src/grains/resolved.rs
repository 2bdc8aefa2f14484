//! The exchange with grains that act by their surfaces: what the fluid loses they gain in the same step.
//!
//! Between steps a grain keeps its acceleration, from which the next step expects its velocity at the end. A step takes
//! what the covered part of the cells has gained ([`super::room`]) and the friction ([`super::surface`]) as the load
//! of the grain, moves it, and gives it what its cells owe it in its new place.

use sazanami_dem::{ATTACHED, Motion};
use sazanami_numerics::domain::Domain;
use sazanami_numerics::grid::Field;
use sazanami_numerics::{Real, Vector};
use sazanami_parallel::{for_each_chunk, sum_over};

use super::{Imprint, ResolvedGrains, Surface, sum_over_ranks};
use crate::flow::Flow;
use crate::mobility::{Closing, RowSet};
use crate::momentum::Impulses;

/// State of the exchange with each grain, also when it migrates to another rank.
#[derive(Clone, Copy, Debug, Default, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
pub(super) struct SurfaceState {
    /// See [`super::CouplingState`].
    wetted: Real,
    unused: [Real; 5],
    /// Slope of the impulse over its estimate in the last joint step ([`super::joint`]); zero: not known.
    pub slope: Real,
    /// Between steps the mean acceleration in the last step [m/s^2]; while the grain moves its velocity before [m/s]. Where
    /// velocities are unknowns ([`super::joint`]) the acceleration by all but gravity, viscosity, friction and projection, and the velocity
    /// without it.
    pub motion: [Real; 3],
    /// The same of its rotation [rad/s^2, rad/s].
    pub rotation: [Real; 3],
    /// See [`super::CouplingState`].
    imprinted: [Real; 7],
    unused_too: [Real; ATTACHED - 20],
}

const _: () = assert!(size_of::<SurfaceState>() == size_of::<[Real; ATTACHED]>());

impl ResolvedGrains {
    /// Starts a step of `dt` \[s]: places the surfaces of the grains as they are, and expects of the grains the velocity
    /// at its end that they have if their acceleration stays what it was.
    pub(crate) fn place_surfaces(&mut self, domain: &Domain, flow: &mut Flow, dt: Real) {
        if !self.has_surfaces() {
            return self.clear_stress(domain);
        }
        self.find_motion(domain, |_, _| [Vector::ZERO; 2]);
        self.surface.place(domain, &mut self.imprint, (self.engine.grains(), &self.motion), flow);
        self.joint.on = self.joins(domain, flow);
        self.begin_joint();
        self.surface.hold(domain, &mut flow.velocity);
        if self.joint.on {
            // What they have at its end is found in the viscous step.
            return;
        }
        self.sum_velocities(domain, |grains, n| {
            let state = grains.surface_state(n);
            [state.motion, state.rotation].map(|rate| dt * Vector::from_array(rate))
        });
        self.imprint.fill_halos(domain);
    }

    /// The surfaces of the grains, if they act by these.
    pub(crate) fn surface_mut(&mut self) -> Option<&mut Surface> {
        self.has_surfaces().then_some(&mut self.surface)
    }

    /// Grains that close faces, if they act by their surfaces.
    pub(crate) fn closing(&self) -> Option<Closing<'_>> {
        let Imprint { solid_fraction, solid_density, solid_velocity, .. } = &self.imprint;
        self.has_surfaces().then(|| Closing {
            fraction: solid_fraction.data(),
            density: solid_density.data(),
            velocity: solid_velocity.each_ref().map(Field::data),
            before: None,
            response: None,
            binding: self.joint.on,
            rows: &self.surface.covered,
            shared: self.imprint.shared(),
            cut: None,
        })
    }

    /// Sums what the grains cover of the lower faces, what they carry through, and how light they are, in the rows that they cover and those
    /// beside them: [`crate::mobility::Cut`].
    pub(crate) fn cut_faces(&self, domain: &Domain, into: &mut [Field<Real>; 9]) {
        let grains = self.engine.grains();
        let lightness = |n: usize| match self.joint.density.get(n).filter(|_| self.joint.on) {
            Some(&[density]) => 1.0 / density,
            None => {
                let volume = self.shapes[grains.shape[n] as usize].volume() * grains.scale[n].powi(3);
                self.imprint.lightness(grains, n, volume)
            }
        };
        self.imprint.sum_sections(domain, self.motion_in_pass(), lightness, self.surface.reach(), into.each_mut());
    }

    /// Sums what the grains carry through the lower faces alone [m/s].
    pub(crate) fn carry_through_faces(&self, domain: &Domain, into: [&mut Field<Real>; 3]) {
        self.imprint.sum_carried(domain, self.motion_in_pass(), self.surface.reach(), into);
    }

    /// Rows of cells that grains cover in this step.
    pub(crate) fn covered_rows(&self) -> &RowSet {
        &self.surface.covered
    }

    /// Velocity and spin of every grain and ghost in a pass, as far as known [m/s, rad/s].
    fn motion_in_pass(&self) -> &[[Real; 6]] {
        if self.joint.on { &self.joint.velocity } else { &self.motion }
    }

    /// Gives each free grain its `impulse(n)` and angular impulse [N s, N m s] and keeps its accelerations in the step of `dt` \[s].
    /// Returns the impulses on grains that are held.
    pub(super) fn receive(
        &mut self,
        domain: &Domain,
        dt: Real,
        impulse: impl Fn(&Self, usize) -> [Vector; 2] + Sync,
    ) -> Impulses {
        let mut impulses = std::mem::take(&mut self.impulses);
        let grains = self.engine.grains();
        impulses.resize(grains.owned(), [Vector::ZERO; 2]);
        for_each_chunk(&mut impulses[..], 64, |number, impulses| {
            impulses.iter_mut().enumerate().for_each(|(n, value)| *value = impulse(self, number * 64 + n));
        });
        let held = sum_over(grains.owned(), |n| match grains.motion[n] {
            Motion::Free => [0.0; 3],
            _ => (Vector::ZERO - impulses[n][0]).to_array(),
        });
        self.engine.add_impulses(&impulses);
        for ((force, torque), [impulse, turn]) in self.force.iter_mut().zip(&mut self.torque).zip(&impulses) {
            *force += *impulse / dt;
            *torque += *turn / dt;
        }
        self.engine.change_attached(|grains, n, attached| {
            let state: SurfaceState = bytemuck::cast(*attached);
            let change = |now: Vector, before: [Real; 3]| ((now - Vector::from_array(before)) / dt).to_array();
            let [motion, rotation] = match grains.motion[n] {
                Motion::Free => {
                    [change(grains.velocity[n], state.motion), change(grains.angular_velocity(n), state.rotation)]
                }
                _ => [[0.0; 3]; 2],
            };
            *attached = bytemuck::cast(SurfaceState { motion, rotation, ..state });
        });
        self.engine.refresh_ghosts(domain);
        self.impulses = impulses;
        let [held_grains, ..] = sum_over_ranks(domain, [Vector::from_array(held), Vector::ZERO, Vector::ZERO]);
        Impulses { held_grains, ..Impulses::default() }
    }

    /// Starts the exchange: free grains fall until they are known to be carried.
    pub(super) fn begin_surfaces(&mut self, domain: &Domain, flow: &Flow, gravity: Vector) {
        if self.joins(domain, flow) {
            return;
        }
        for n in 0..self.engine.grains().owned() {
            if self.engine.grains().motion[n] == Motion::Free {
                let state = SurfaceState { motion: gravity.to_array(), ..self.surface_state(n) };
                self.set_surface_state(n, state);
            }
        }
    }

    pub(super) fn surface_state(&self, n: usize) -> SurfaceState {
        bytemuck::cast(self.engine.grains().attached[n])
    }

    pub(super) fn set_surface_state(&mut self, n: usize, state: SurfaceState) {
        self.engine.attached_mut()[n] = bytemuck::cast(state);
    }
}
