//! The exchange of surfaces, where liquid has only the open part of the cells as its room ([`crate::grains::room`]): what the equations of the whole
//! cells owe to the covered part is the load of the grains.

use sazanami_dem::Motion;
use sazanami_numerics::domain::Domain;
use sazanami_numerics::{Real, Vector};

use super::imprint::Imprint;
use super::loads;
use super::{ResolvedGrains, sum_over_ranks, vectors};
use crate::grains::room::Room;
use crate::momentum::Impulses;

impl ResolvedGrains {
    /// Whether liquid has only the open part of the cells.
    pub(crate) fn leaves_room(&self) -> bool {
        self.has_surfaces()
    }

    /// Volume fractions and velocities of the grains in their new places, for the room that they leave.
    pub(crate) fn moved(&mut self, domain: &Domain) -> &mut Imprint {
        self.sum_velocities(domain, |_, _| [Vector::ZERO; 2]);
        &mut self.imprint
    }

    /// Volume fractions of the grains, for filling their ghosts.
    pub(crate) fn covered_mut(&mut self) -> &mut Imprint {
        &mut self.imprint
    }

    /// Sets force and torque on each owned grain over `dt` \[s]: what the cells owe it, and the friction.
    pub(super) fn load_open(&mut self, domain: &Domain, room: &mut Room, gravity: Vector, dt: Real) -> Impulses {
        self.share_out(domain, room, true);
        let fluid_weight = room.take_given(domain);
        self.force.clear();
        self.torque.clear();
        let (mut weight, mut held) = (Vector::ZERO, Vector::ZERO);
        for n in 0..self.engine.grains().owned() {
            let grains = self.engine.grains();
            let [impulse, turn] = vectors(&self.partial[n]);
            let free = grains.motion[n] == Motion::Free;
            let mass = grains.mass[n];
            let mut state = self.surface_state(n);
            [state.motion, state.rotation] = self.without_rest(n, gravity, dt);
            self.set_surface_state(n, state);
            if free {
                weight += mass * gravity * dt;
            } else {
                held -= impulse;
            }
            self.force.push(impulse / dt);
            self.torque.push(turn / dt);
        }
        let [gravity_on_grains, held_grains, _] = sum_over_ranks(domain, [weight, held, Vector::ZERO]);
        Impulses { gravity_on_grains: gravity_on_grains - fluid_weight, held_grains, ..Impulses::default() }
    }

    /// Gives the grains in their new places what the cells owe them.
    pub(super) fn exchange_open(&mut self, domain: &Domain, room: &mut Room, dt: Real) -> Impulses {
        self.share_out(domain, room, false);
        let _ = room.take_given(domain);
        self.receive(domain, dt, |phase, n| vectors(&phase.partial[n]))
    }

    /// Sums what the cells owe each grain, and the friction on its surface if asked for, at its owner.
    fn share_out(&mut self, domain: &Domain, room: &Room, friction: bool) {
        let Self { imprint, surface, partial, by_block, engine, .. } = self;
        partial.resize(engine.grains().len(), [0.0; 7]);
        loads::share_out(domain, imprint, room.given(), friction.then_some(&*surface), partial, by_block);
        engine.gather_to_owners(domain, partial);
    }
}
