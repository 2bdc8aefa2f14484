//! The exchange with grains that act by their surfaces: what the fluid loses they gain in the same step.
//!
//! Between steps a grain keeps its acceleration, from which the next step expects its velocity at the end. A step takes
//! what the covered part of the cells has gained ([`super::covered`]) and the friction ([`super::surface`]) as the load
//! of the grain, moves it, and gives it the momentum of what it covers anew.

use sazanami_dem::{ATTACHED, Motion};
use sazanami_numerics::domain::Domain;
use sazanami_numerics::grid::Field;
use sazanami_numerics::{Real, Vector};
use sazanami_parallel::{for_each_chunk, sum_over};

use super::{GrainPhase, Imprint, Surface, covered, loads, sum_over_ranks, vectors};
use crate::flow::Flow;
use crate::grains::loads::FluidLoad;
use crate::grains::room::LiquidRoom;
use crate::mobility::Closing;
use crate::momentum::Impulses;

/// State of the exchange with each grain, also when it migrates to another rank.
#[derive(Clone, Copy, Debug, Default, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
pub(super) struct SurfaceState {
    /// Momentum of the fluid on the covered part before the grain moved [N s].
    momentum: [Real; 3],
    /// Its angular momentum about the origin, without wrapping at periodic sides [N m s].
    angular_momentum: [Real; 3],
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
    /// Covered volume before the grain moved, near a side through which grains leave \[m^3]; else zero.
    inside: Real,
    unused: [Real; 7],
}

const _: () = assert!(size_of::<SurfaceState>() == size_of::<[Real; ATTACHED]>());

/// Owned grains beside open sides.
struct AtSides {
    /// Covered volume of each grain and ghost \[m^3].
    volume: Vec<[Real; 1]>,
    /// Whether a grain may reach across such a side within a step.
    near: Vec<bool>,
    /// Whether it may reach across one now.
    across: Vec<bool>,
}

impl AtSides {
    /// Covered volume of a grain that may reach across \[m^3]; zero of the others.
    fn inside(&self, n: usize) -> Real {
        if self.near[n] { self.volume[n][0] } else { 0.0 }
    }
}

impl GrainPhase {
    /// Starts a step of `dt` \[s]: places the surfaces of the grains as they are, and expects of the grains the velocity
    /// at its end that they have if their acceleration stays what it was.
    pub(crate) fn place_surfaces(&mut self, domain: &Domain, flow: &mut Flow, dt: Real) {
        if !self.has_surfaces() {
            if self.coupling.room == LiquidRoom::Open {
                self.sum_velocities(domain, |_, _| [Vector::ZERO; 2]);
                self.imprint.fill_halos(domain);
            }
            return self.clear_stress(domain);
        }
        self.sum_velocities(domain, |_, _| [Vector::ZERO; 2]);
        self.surface.place(domain, &mut self.imprint, &self.motion, flow);
        self.joint.on = self.joins(domain, flow);
        self.begin_joint();
        self.surface.hold(domain, &mut flow.velocity);
        if self.coupling.room == LiquidRoom::Whole {
            self.sum_covered(domain, flow);
            std::mem::swap(&mut self.partial, &mut self.before);
        }
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

    /// Sums what the grains cover of the lower faces in direction `d`, what they carry through, and how light they are: [`crate::mobility::Cut`].
    pub(crate) fn cut_faces(&self, domain: &Domain, d: usize, into: [&mut Field<Real>; 3]) {
        let motion = if self.joint.on { &self.joint.velocity } else { &self.motion };
        let grains = self.engine.grains();
        let density = |n: usize| match self.joint.density.get(n).filter(|_| self.joint.on) {
            Some(&[density]) => density,
            None => {
                let mass = grains.mass[n] / (self.shapes[grains.shape[n] as usize].volume() * grains.scale[n].powi(3));
                if grains.motion[n] == Motion::Free { mass } else { self.imprint.rigid() * mass }
            }
        };
        self.imprint.sum_sections(domain, d, motion, density, into);
    }

    /// Sets force and torque on each owned grain over `dt` \[s]: what the covered part of the cells has gained since the
    /// start of the step, less its weight, and the friction.
    pub(super) fn load_surfaces(&mut self, domain: &Domain, flow: &Flow, gravity: Vector, dt: Real) -> Impulses {
        self.surface.complete(domain);
        self.sum_covered(domain, flow);
        std::mem::swap(&mut self.partial, &mut self.after);
        self.loads.clear();
        self.loads.resize(self.engine.grains().len(), FluidLoad::default());
        loads::of_friction(domain, &self.imprint, &self.surface, &mut self.loads);
        self.gather_loads(domain);
        self.force.clear();
        self.torque.clear();
        let inside = self.volumes_at_sides(domain);
        let (mut weight, mut held) = (Vector::ZERO, Vector::ZERO);
        for n in 0..self.engine.grains().owned() {
            let grains = self.engine.grains();
            let ([rubbed, turned], [now, turning], [then, turning_then]) =
                (vectors(&self.partial[n]), vectors(&self.after[n]), vectors(&self.before[n]));
            let fluid_weight = self.after[n][6] * gravity * dt;
            let impulse = rubbed + now - then - fluid_weight;
            weight -= fluid_weight;
            if grains.motion[n] == Motion::Free {
                weight += grains.mass[n] * gravity * dt;
            } else {
                held -= impulse;
            }
            // The fluid loses the impulse at the place of the start, the grain takes it on its way from there.
            let way = dt * (grains.velocity[n] + 0.5 * dt * gravity);
            let angular_momentum = turning + grains.unwrapped_position(n).cross(now) + 0.5 * way.cross(impulse);
            let [motion, rotation] = self.without_rest(n, gravity, dt);
            let state = SurfaceState {
                momentum: now.to_array(),
                angular_momentum: angular_momentum.to_array(),
                motion,
                rotation,
                inside: inside.as_ref().map_or(0.0, |at_sides| at_sides.inside(n)),
                ..self.surface_state(n)
            };
            self.force.push(impulse / dt);
            self.torque.push((turned + turning - turning_then) / dt);
            self.set_surface_state(n, state);
        }
        let [gravity_on_grains, held_grains, _] = sum_over_ranks(domain, [weight, held, Vector::ZERO]);
        Impulses { gravity_on_grains, held_grains, ..Impulses::default() }
    }

    /// Gives the grains the momentum of the fluid that they cover or uncover by their motion, and keeps their
    /// accelerations. What they carry through an open side they do not uncover: it is booked as gone through that.
    pub(super) fn exchange_surfaces(&mut self, domain: &Domain, flow: &Flow, dt: Real) -> Impulses {
        self.sum_covered(domain, flow);
        let inside = self.volumes_at_sides(domain);
        let stays = |state: &SurfaceState, n: usize| match &inside {
            Some(now) if state.inside > 0.0 && now.across[n] => now.volume[n][0] / state.inside,
            _ => 1.0,
        };
        let mut impulses = self.receive(domain, dt, |phase, n| {
            let ([now, turning], state) = (vectors(&phase.partial[n]), phase.surface_state(n));
            let part = stays(&state, n);
            let then = part * Vector::from_array(state.momentum);
            let turned = turning - part * Vector::from_array(state.angular_momentum);
            [now - then, turned + phase.engine.grains().unwrapped_position(n).cross(then)]
        });
        if inside.is_some() {
            let gone = |n: usize| {
                let state = self.surface_state(n);
                (1.0 - stays(&state, n)) * Vector::from_array(state.momentum)
            };
            let all = (0..self.engine.grains().owned()).map(gone).sum();
            [impulses.open_sides, ..] = sum_over_ranks(domain, [all, Vector::ZERO, Vector::ZERO]);
        }
        impulses
    }

    /// The owned grains beside open sides through which grains leave; `None` where none on any rank may pass one in a step.
    fn volumes_at_sides(&self, domain: &Domain) -> Option<AtSides> {
        let (grains, sides) = (self.engine.grains(), self.engine.leave_through());
        if sides == [[false; 2]; 3] {
            return None;
        }
        let (lower, upper) = (domain.grid().lower, domain.grid().lower + domain.grid().extent());
        let cell = domain.grid().spacing.max_element();
        let within = |n: usize, beyond: Real| {
            let reach = self.shapes[grains.shape[n] as usize].bounding_radius() * grains.scale[n] + beyond;
            let (below, above) = (grains.position[n] - lower, upper - grains.position[n]);
            (0..3).any(|d| sides[d][0] && below[d] < reach || sides[d][1] && above[d] < reach)
        };
        let near: Vec<bool> = (0..grains.owned()).map(|n| within(n, cell)).collect();
        if domain.max(if near.contains(&true) { 1.0 } else { 0.0 }) == 0.0 {
            return None;
        }
        let mut volume = covered::volumes(domain, &self.imprint, grains.len());
        self.engine.gather_to_owners(domain, &mut volume);
        Some(AtSides { volume, near, across: (0..grains.owned()).map(|n| within(n, 0.0)).collect() })
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
        let joins = self.joins(domain, flow);
        for n in 0..self.engine.grains().owned() {
            if !joins && self.engine.grains().motion[n] == Motion::Free {
                let state = SurfaceState { motion: gravity.to_array(), ..self.surface_state(n) };
                self.set_surface_state(n, state);
            }
        }
        self.sum_covered(domain, flow);
    }

    /// Finds again what the last step left on the covered part of the cells, at a restart.
    pub(crate) fn resume(&mut self, domain: &Domain, flow: &Flow) {
        if self.has_surfaces() {
            self.sum_covered(domain, flow);
        }
    }

    /// See [`Self::momentum`].
    pub(super) fn momentum_beside_surfaces(&self, domain: &Domain) -> [Vector; 3] {
        let grains = self.engine.grains();
        let free = (0..grains.owned()).filter(|&n| grains.motion[n] == Motion::Free);
        let covered = self.partial[..grains.owned()].iter().map(|sums| vectors(sums)[0]).sum();
        sum_over_ranks(domain, [free.map(|n| grains.mass[n] * grains.velocity[n]).sum(), covered, Vector::ZERO])
    }

    /// Sums what the fluid holds on the covered parts of the cells, per owned grain.
    fn sum_covered(&mut self, domain: &Domain, flow: &Flow) {
        self.partial.resize(self.engine.grains().len(), [0.0; 7]);
        covered::sum(domain, &self.imprint, &flow.velocity, &flow.density, &mut self.partial);
        self.engine.gather_to_owners(domain, &mut self.partial);
    }

    pub(super) fn surface_state(&self, n: usize) -> SurfaceState {
        bytemuck::cast(self.engine.grains().attached[n])
    }

    pub(super) fn set_surface_state(&mut self, n: usize, state: SurfaceState) {
        self.engine.attached_mut()[n] = bytemuck::cast(state);
    }
}
