//! The longest sub-step: of each contact by itself and of faces, whatever touches; of all contacts that there are.

use sazanami_numerics::domain::Domain;
use sazanami_numerics::{Real, Vector};
use sazanami_parallel::max_over;

use super::Engine;
use crate::contact::block::Block;
use crate::grain::{Grains, Motion, ROWS};
use crate::modes::{Inertia, Modes};
use crate::stability::{EffectiveMasses, OF_ALL_CONTACTS, stable_for};

/// Stiffness and damping of the contacts of a grain, and what turns forces on it into motion.
struct GrainModes {
    inertia: Inertia,
    stiffness: Modes,
    damping: Modes,
}

/// A grain in a contact: itself, and the point from its centre of mass.
type End = (usize, Vector);

impl Engine {
    /// Longest sub-step that no contact of these grains can make too long, whatever touches \[s].
    pub(super) fn longest_time_step(&self, domain: &Domain) -> Real {
        let Grains { mass, motion, material, scale, shape, .. } = &self.grains;
        let mut masses = EffectiveMasses::new(&self.interactions);
        let mut last = None;
        for g in (0..self.grains.owned).filter(|&g| motion[g] == Motion::Free) {
            let this = (shape[g], scale[g], mass[g], material[g]);
            if last.replace(this) != Some(this) {
                masses.add(&self.bodies[shape[g] as usize], scale[g], mass[g], material[g]);
            }
        }
        masses.over_ranks(domain);
        masses.longest_substep().shortest()
    }

    /// Longest sub-step for the contacts that touched last \[s]: no more than [`Self::contact_time_step`], less where many act on
    /// a grain at once (see [`crate::stability`]). All ranks take part, and have the same.
    #[must_use]
    pub fn present_time_step(&self, domain: &Domain) -> Real {
        if !self.bodies.iter().any(|body| body.face().is_flat()) {
            return self.time_step;
        }
        let rate = max_over(self.grains.owned, |g| self.longest_for(g).recip());
        self.time_step.min(domain.max(rate.max(0.0)).recip())
    }

    /// The same for own grain `g`.
    fn longest_for(&self, g: usize) -> Real {
        let flat = self.bodies[self.grains.shape[g] as usize].face().is_flat();
        if !flat || self.grains.motion[g] != Motion::Free || self.cannot_be_driven(g) {
            return Real::INFINITY;
        }
        let mass = &self.mass_properties[g];
        let inertia = Inertia { inverse_mass: mass.inverse_mass, inverse_moments: mass.inverse_inertia };
        let mut modes = GrainModes { inertia, stiffness: Modes::default(), damping: Modes::default() };
        self.incoming.visit(g, |block, p| self.add_pair(&mut modes, g, &self.blocks[block], p));
        let block = &self.blocks[g / ROWS];
        block.touching_pairs(g).for_each(|p| self.add_pair(&mut modes, g, block, p));
        self.add_walls(&mut modes, g, block);
        stable_for(OF_ALL_CONTACTS, [modes.stiffness.largest(), modes.damping.largest()])
    }

    /// Whether as many contacts as the grain has are stable however they are arranged.
    fn cannot_be_driven(&self, g: usize) -> bool {
        let block = &self.blocks[g / ROWS];
        let mut count = block.walls.contacts_of(g).count();
        count += block.touching_pairs(g).map(|p| block.pairs[p].count as usize).sum::<usize>();
        self.incoming.visit(g, |block, p| count += self.blocks[block].pairs[p].count as usize);
        if count == 0 {
            return true;
        }
        let Grains { mass, shape, .. } = &self.grains;
        let body = &self.bodies[shape[g] as usize];
        let leverage = body.leverage();
        let mut stiffest = [0.0; 2];
        for (n, law) in self.interactions.laws().iter().enumerate() {
            let of_law = [law.stiffness(), self.interactions.dashpots(n, mass[g])];
            for (most, values) in stiffest.iter_mut().zip(of_law) {
                let of_one = Real::max(leverage[0] * values[0], leverage[1] * values[1]) / mass[g];
                *most = Real::max(*most, 2.0 * count as Real * of_one);
            }
        }
        self.time_step < stable_for(1.0, stiffest)
    }

    /// Adds the contacts of grain `g` in pair `p` of a block.
    fn add_pair(&self, modes: &mut GrainModes, g: usize, block: &Block, p: usize) {
        let pair = &block.pairs[p];
        if pair.apart {
            return;
        }
        let (low, high) = (pair.low as usize, pair.high as usize);
        let other = if g == low { high } else { low };
        let inverse = [g, other].map(|g| self.mass_properties[g].inverse_mass);
        let share = if inverse[1] > 0.0 { 2.0 } else { 1.0 };
        let between = self.poses[high].unwrapped - self.poses[low].unwrapped + pair.shift(self.period);
        for contact in block.contacts_of(p) {
            let ((a, ra), (b, rb)) = (self.sphere(low, contact.a), self.sphere(high, contact.b));
            let line = between + b - a;
            let n = line.normalize_or(Vector::Z);
            let arm = a + n * (ra - 0.5 * (ra + rb - line.length()));
            let arm = if g == low { arm } else { arm - between };
            self.add_contact(modes, (g, arm), n, pair.law.into(), (inverse[0] + inverse[1], share));
        }
    }

    fn add_walls(&self, modes: &mut GrainModes, g: usize, block: &Block) {
        for contact in block.walls.contacts_of(g) {
            let pair = &block.walls.pairs[contact.pair as usize];
            let (a, radius) = self.sphere(g, contact.a);
            let (_, away) = self.walls[pair.wall as usize].facing(self.poses[g].unwrapped, a);
            let arm = a - away * radius;
            self.add_contact(modes, (g, arm), away, pair.law as usize, (modes.inertia.inverse_mass, 1.0));
        }
    }

    /// Adds a contact of grain `g` by its law, times `share`.
    fn add_contact(
        &self,
        modes: &mut GrainModes,
        (g, arm): End,
        normal: Vector,
        law: usize,
        (inverse_mass, share): (Real, Real),
    ) {
        let stiffness = self.interactions.laws()[law].stiffness();
        let dashpots = self.interactions.dashpots(law, inverse_mass.recip());
        let turn = self.rotations[g].transpose();
        let (arm, normal) = (turn * arm, turn * normal);
        let times = |values: [Real; 2]| values.map(|value| share * value);
        modes.stiffness.add(&modes.inertia, arm, normal, times(stiffness));
        modes.damping.add(&modes.inertia, arm, normal, times(dashpots));
    }
}
