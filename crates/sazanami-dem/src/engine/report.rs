//! The report of a call: sums and extremes over all ranks.

use sazanami_numerics::domain::Domain;
use sazanami_numerics::{Real, Vector};
use sazanami_parallel::{max_over, sum_over};

use super::Engine;
use crate::bridge::moisture_of_pair;
use crate::contact::block::{Block, Held};
use crate::contact::counters::Counters;
use crate::contact::walls::FLAT;
use crate::error::DemError;
use crate::grain::ROWS;
use crate::material::TangentialForce;

/// Diagnostics of the grains of all ranks during a call.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ContactReport {
    /// Sub-steps taken.
    pub substeps: usize,
    /// Touching pairs (of grains, or of a grain and a wall) in the last sub-step.
    pub pairs: usize,
    /// Touching spheres in the last sub-step.
    pub contacts: usize,
    /// Contacts that became deeper than 20 % of the smaller sphere's radius during the call.
    pub deep_contacts: usize,
    /// Largest overlap over the smaller sphere's radius during the call.
    pub largest_overlap: Real,
    /// The grains (or grain and wall) of the largest overlap.
    pub largest_overlap_ids: [u64; 2],
    /// Largest speed of a centre of mass at the end [m/s].
    pub largest_speed: Real,
    /// Energy that contacts gave the grains during the call; negative: they took it; `None`: not booked \[J].
    pub contact_work: Option<Real>,
    /// Momentum given to the walls during the call [N s].
    pub impulse_on_walls: Vector,
    /// Momentum that contacts gave grains whose motion is given during the call, those with walls included [N s].
    pub impulse_on_held: Vector,
    /// Liquid bridges in the last sub-step.
    pub bridges: usize,
    /// Liquid bridges that broke during the call.
    pub ruptures: usize,
    /// Liquid in the bridges in the last sub-step, in each as far as its grains are moist [m^3].
    pub bridge_volume: Real,
    /// Times the neighbour lists were renewed.
    pub list_renewals: usize,
}

impl Engine {
    pub(super) fn report(
        &self,
        domain: &Domain,
        report: &mut ContactReport,
        [last, deepest]: [Counters; 2],
        [deep, ruptures]: [usize; 2],
    ) {
        let grains = &self.grains;
        let speed = max_over(grains.owned, |g| grains.velocity[g].length_squared()).max(0.0).sqrt();
        // Of those that this rank owned during the call.
        let held = &self.book.held;
        let [h1, h2, h3] = sum_over(held.len().div_ceil(ROWS), |c| {
            held[c * ROWS..((c + 1) * ROWS).min(held.len())].iter().sum::<Vector>().to_array()
        });
        let impulse = report.impulse_on_walls;
        let sums = domain.sum([
            last.pairs as Real,
            last.contacts as Real,
            deep as Real,
            impulse.x,
            impulse.y,
            impulse.z,
            last.bridges as Real,
            ruptures as Real,
            last.bridge_volume,
            h1,
            h2,
            h3,
        ]);
        report.pairs = sums[0] as usize;
        report.contacts = sums[1] as usize;
        report.deep_contacts = sums[2] as usize;
        report.impulse_on_walls = Vector::new(sums[3], sums[4], sums[5]);
        report.bridges = sums[6] as usize;
        report.ruptures = sums[7] as usize;
        report.bridge_volume = sums[8];
        report.impulse_on_held = Vector::new(sums[9], sums[10], sums[11]);
        report.largest_speed = domain.max(speed);
        report.largest_overlap = domain.max(deepest.deepest);
        // The lowest rank that saw the largest overlap names the grains, in halves that are exact in a real.
        let mine = deepest.deepest == report.largest_overlap && report.largest_overlap > 0.0;
        let rank = domain.min(if mine { domain.communicator().rank() as Real } else { Real::INFINITY });
        let reports = rank == domain.communicator().rank() as Real;
        let half = |n: usize, shift: u32| {
            if reports { Real::from((deepest.deepest_ids[n] >> shift & u64::from(u32::MAX)) as u32) } else { 0.0 }
        };
        let [a, b, c, d] = domain.sum([half(0, 32), half(0, 0), half(1, 32), half(1, 0)]);
        report.largest_overlap_ids = [[a, b], [c, d]].map(|[high, low]| (high as u64) << 32 | low as u64);
    }

    /// Elastic energy of all contacts of grains of this rank with walls and with grains of higher identifiers, as they stood in
    /// the last sub-step, at the present poses \[J]: over all ranks, each once. That of liquid bridges, from no gap on, is in it.
    #[must_use]
    pub fn elastic_energy(&self) -> Real {
        self.elastic_energies()[0]
    }

    /// The same, and what of it springs can give back: one that slips takes up `D_t v_t` against the force, which friction does
    /// not hold.
    pub(super) fn elastic_energies(&self) -> [Real; 2] {
        sum_over(self.blocks.len(), |number| self.elastic_energies_of(&self.blocks[number]))
    }

    fn elastic_energies_of(&self, block: &Block) -> [Real; 2] {
        let mut energies = [0.0; 2];
        let mut add = |law: u32, overlap: Real, stretches: [Real; 2], turned: ([Real; 2], Vector)| {
            let constants = &self.laws[law as usize];
            let rolling = constants.energy_of_turn(turned.0, turned.1);
            let of = |stretch: Real| constants.springs.energy(overlap, stretch).into_iter().sum::<Real>() + rolling;
            energies.iter_mut().zip(stretches).for_each(|(energy, stretch)| *energy += of(stretch));
        };
        let own = |p: &usize| block.pairs[*p].touching && (block.pairs[*p].low as usize) < self.grains.owned;
        for p in (0..block.pairs.len()).filter(own) {
            let pair = &block.pairs[p];
            let (low, high) = (pair.low as usize, pair.high as usize);
            let between = self.poses[high].unwrapped - self.poses[low].unwrapped + pair.shift(self.period);
            for contact in block.contacts_of(p) {
                let ((a, ra), (b, rb)) = (self.sphere(low, contact.a), self.sphere(high, contact.b));
                let line = between + b - a;
                let gap = line.length() - (ra + rb);
                let overlap = (-gap).max(0.0);
                let n = line.normalize();
                let arm = a + n * (ra - 0.5 * overlap);
                let v_r = self.velocity_at(high, arm - between) - self.velocity_at(low, arm);
                let stretch = self.stretch(pair.law.into(), contact.d_t, [n, v_r], overlap);
                add(pair.law.into(), overlap, stretch, ([ra, rb], contact.turn));
            }
        }
        for contact in &block.walls.contacts {
            let pair = &block.walls.pairs[contact.pair as usize];
            let (grain, wall) = (pair.grain as usize, &self.walls[pair.wall as usize]);
            let (a, radius) = self.sphere(grain, contact.a);
            let (distance, away) = wall.facing(self.poses[grain].unwrapped + a, Vector::ZERO);
            let overlap = (radius - distance).max(0.0);
            let n = -away;
            let v_r = wall.velocity - self.velocity_at(grain, a + n * (radius - 0.5 * overlap));
            let stretch = self.stretch(pair.law, contact.d_t, [n, v_r], overlap);
            add(pair.law, overlap, stretch, ([radius, FLAT * radius], contact.turn));
        }
        let bridges = self.energy_of_bridges_of(block);
        energies.map(|energy| energy + bridges)
    }

    /// Energy of the liquid bridges of this rank that are counted here, over that of no gap \[J].
    pub(super) fn energy_of_bridges(&self) -> Real {
        let [energy] = sum_over(self.blocks.len(), |number| [self.energy_of_bridges_of(&self.blocks[number])]);
        energy
    }

    fn energy_of_bridges_of(&self, block: &Block) -> Real {
        let Some(bridge) = self.interactions.bridge() else { return 0.0 };
        let of = |held: &Held| {
            let p = held.pair as usize;
            let pair = &block.pairs[p];
            let ends = [pair.low as usize, pair.high as usize];
            let [low, high] = ends;
            let between = self.poses[high].unwrapped - self.poses[low].unwrapped + pair.shift(self.period);
            let gap = |(a, b): (u16, u16)| {
                let ((a, ra), (b, rb)) = (self.sphere(low, a), self.sphere(high, b));
                (between + b - a).length() - (ra + rb)
            };
            let contacts = if pair.meets() { block.contacts_of(p) } else { &[] };
            let gap = contacts.iter().map(|contact| gap((contact.a, contact.b))).fold(gap(held.spheres), Real::min);
            let radii = ends.map(|g| self.bodies[self.grains.shape[g] as usize].volume_radius * self.grains.scale[g]);
            moisture_of_pair(ends.map(|g| self.grains.moisture[g])) * bridge.energy(gap, radii)
        };
        let mine = |held: &&Held| (block.pairs[held.pair as usize].low as usize) < self.grains.owned;
        block.bridges.iter().filter(mine).map(of).sum()
    }

    /// Centre of contact sphere `a` relative to its grain's centre of mass, in the laboratory frame, and its radius \[m].
    pub(super) fn sphere(&self, g: usize, a: u16) -> (Vector, Real) {
        let pose = &self.poses[g];
        let body = &self.bodies[pose.body as usize];
        (self.rotations[g] * body.centres[a as usize] * pose.scale, body.radii[a as usize] * pose.scale)
    }

    /// Velocity of a point of grain `g` at `arm` from its centre of mass [m/s].
    fn velocity_at(&self, g: usize, arm: Vector) -> Vector {
        self.poses[g].velocity + self.poses[g].spin.cross(arm)
    }

    /// Length of a tangential spring at the time of the present places, half a sub-step after the last evaluation, with
    /// normal and relative velocity at the contact \[m]. One that grew from the touch has grown further, as far as friction
    /// holds it; one that grew from the beginning of a sub-step is ahead by that much on average.
    fn stretch(&self, law: u32, d_t: Vector, [n, v_r]: [Vector; 2], overlap: Real) -> [Real; 2] {
        let law = &self.interactions.laws()[law as usize];
        let [normal, tangential] = law.stiffness();
        let held = law.friction * normal * overlap / tangential.max(Real::MIN_POSITIVE);
        let length = match law.tangential_force {
            TangentialForce::Published => d_t.length(),
            TangentialForce::FromTouch => {
                let v_t = v_r - n * v_r.dot(n);
                (d_t + v_t * self.since_contacts).length().min(held.max(d_t.length()))
            }
        };
        [length, length.min(held)]
    }
}

pub(super) fn overlap_error(counters: &Counters, allowed: Real, substep: usize) -> DemError {
    DemError::OverlapTooLarge {
        ids: counters.deepest_ids,
        fraction: counters.deepest,
        allowed,
        position: counters.deepest_at,
        substep,
    }
}
