//! A block of neighbouring grains and the pairs in which they come first: the unit of parallel work.
//!
//! Skin check: every grain carries an upper bound of the path of its contact spheres, its travel. A pair is skipped
//! until the travel of its two grains has grown by the gap last measured; a row of pairs is skipped until its grain's
//! travel and the largest travel of any grain as slow as its neighbours ([`super::pace`]) could add up to the smallest gap
//! left in the row, so that a skipped row costs one comparison. Contacts that touch are kept in a list ordered by pair and sphere and evaluated in every
//! sub-step. Which pairs are listed or skipped has no influence on any force.

mod bridges;
mod waking;

use sazanami_numerics::{Real, Vector};

use super::context::{ContactContext, Reach, SubStep};
use super::counters::Counters;
use super::evaluate::{ContactForces, evaluate};
use super::pace::Pace;
use super::pair::{Contact, DEEP_OVERLAP, Pair, reserve};
use super::search::{NearestSpheres, SphereSearch, TOUCH};
use super::walls::WallContacts;
use crate::lanes::WIDTH;
use crate::wrench::Wrench;
pub(crate) use bridges::Held;
use waking::Approach;

/// Consecutive grains with the pairs in which they come first; see the module.
#[derive(Clone, Debug, Default)]
pub(crate) struct Block {
    /// First grain.
    pub first: usize,
    /// First pair of each row, and the number of pairs.
    pub starts: Vec<u32>,
    /// Second grain of each pair.
    pub high: Vec<u32>,
    /// Sum of the two travels until which the pair is skipped \[m].
    pub skip_until: Vec<Real>,
    /// Sum of a row's travel and [`ContactContext::largest_travel`] until which the whole row is skipped \[m].
    row_skip_until: Vec<Real>,
    /// Pace of the fastest neighbour in each row.
    row_paces: Vec<Pace>,
    pub pairs: Vec<Pair>,
    /// Nearest spheres of each pair from its last search.
    pub nearest: Vec<NearestSpheres>,
    /// Place of each pair's first grain among those with a lower identifier than the second.
    pub rank: Vec<u32>,
    pub contacts: Vec<Contact>,
    /// Liquid bridges, by pair.
    pub bridges: Vec<Held>,
    /// Action of each pair on its second grain; meaningful while it acts.
    pub on_high: Vec<Wrench>,
    /// Sum of the actions on each row's grain of the pairs in which it is first.
    pub own: Vec<Wrench>,
    /// Whether a row's grain touches as first of a pair or touches a wall.
    pub touches: Vec<bool>,
    /// Pairs that began or ceased to act in this sub-step.
    pub changes: Vec<u32>,
    pub walls: WallContacts,
    /// Identifier, image, place and gap of the neighbours of the row being filled.
    pub listed: Vec<(u64, [i32; 3], u32, Real)>,
    due: Vec<Approach>,
    found: Vec<Contact>,
    merged: Vec<Contact>,
    near: SphereSearch,
}

impl Block {
    /// Empties the block for `rows` grains from `first`.
    pub fn reset(&mut self, first: usize, rows: usize) {
        self.first = first;
        self.starts.clear();
        self.starts.push(0);
        self.high.clear();
        self.skip_until.clear();
        self.row_skip_until.clear();
        self.row_skip_until.resize(rows, Real::NEG_INFINITY);
        self.row_paces.clear();
        self.pairs.clear();
        self.rank.clear();
        self.nearest.clear();
        self.contacts.clear();
        self.bridges.clear();
        self.on_high.clear();
        self.changes.clear();
        self.own.clear();
        self.own.resize(rows, Wrench::default());
        self.touches.clear();
        self.touches.resize(rows, false);
        self.walls.clear();
    }

    /// Appends a pair to the row being filled.
    pub fn push(&mut self, pair: Pair, skip_until: Real, nearest: NearestSpheres) {
        self.high.push(pair.high);
        self.skip_until.push(skip_until);
        self.pairs.push(pair);
        self.rank.push(0);
        self.nearest.push(nearest);
        self.on_high.push(Wrench::default());
    }

    /// Ends the row being filled, whose fastest neighbour is of this pace.
    pub fn end_row(&mut self, pace: Pace) {
        self.starts.push(self.pairs.len() as u32);
        self.row_paces.push(pace);
    }

    /// Reserves the memory that the sub-steps with this list need: one contact per listed pair, of which few touch,
    /// and a few to spare; with `bridges` one of each pair too.
    pub fn reserve(&mut self, bridges: bool) {
        let room = self.pairs.len() + 16;
        reserve(&mut self.contacts, room);
        reserve(&mut self.merged, room);
        reserve(&mut self.found, room);
        // Sphere pairs of one pair of grains.
        reserve(&mut self.near.found, 64);
        reserve(&mut self.due, room);
        reserve(&mut self.changes, room);
        if bridges {
            reserve(&mut self.bridges, room);
        }
        self.walls.reserve();
    }

    /// Forces of all contacts of the block.
    pub fn step(&mut self, step: &SubStep<'_>) -> Counters {
        let mut counters = Counters::default();
        self.changes.clear();
        counters.checked_rows = self.check_skins(step.context);
        match (step.plain, step.context.balls) {
            (true, true) => self.evaluate_balls::<true>(step, &mut counters),
            (false, true) => self.evaluate_balls::<false>(step, &mut counters),
            (true, false) => self.evaluate::<true>(step, &mut counters),
            (false, false) => self.evaluate::<false>(step, &mut counters),
        }
        if let Some(bridge) = step.context.bridge {
            self.act_by_bridges(step.context, bridge, &mut counters);
        }
        self.walls.step(step, self.first, &mut self.touches, &mut counters);
        counters.changes = self.changes.len();
        counters
    }

    /// Evaluates all contacts, adds up pairs and rows in order, drops the contacts that have ended.
    #[inline(never)]
    fn evaluate<const PLAIN: bool>(&mut self, step: &SubStep<'_>, counters: &mut Counters) {
        let SubStep { context, laws, ids, dt, .. } = *step;
        self.own.fill(Wrench::default());
        self.touches.fill(false);
        let count = self.contacts.len();
        let (mut kept, mut at) = (0, 0);
        let mut present = u32::MAX;
        let (mut total, mut deepest) = (Total::default(), (0.0, 0));
        while at < count {
            let end = (at + WIDTH).min(count);
            let forces = evaluate::<WIDTH, PLAIN, false>(context, laws, (&self.pairs, &self.contacts[at..end]), dt);
            for l in 0..end - at {
                let from = at + l;
                let p = self.contacts[from].pair;
                if p != present {
                    self.close(context, present, &total, counters);
                    (present, total) = (p, Total::default());
                    self.pairs[p as usize].contacts = kept as u32;
                }
                let overlap = forces.overlap.0[l];
                // NaN passes here and is found when the grains move.
                if overlap <= 0.0 {
                    self.part(context, from, -overlap);
                    continue;
                }
                if kept != from {
                    self.contacts[kept] = self.contacts[from];
                }
                self.contacts[kept].d_t = forces.d_t.lane(l);
                if !PLAIN {
                    self.contacts[kept].turn = forces.turn.lane(l);
                }
                let fraction = forces.fraction.0[l];
                if fraction > deepest.0 {
                    deepest = (fraction, kept);
                }
                if fraction > DEEP_OVERLAP {
                    self.mark_deep(context, kept, counters);
                }
                kept += 1;
                total.add(&forces, l);
            }
            at = end;
        }
        self.close(context, present, &total, counters);
        self.contacts.truncate(kept);
        self.note_deepest(context, ids, deepest, counters);
    }

    /// The same where all bodies are balls: a pair has one contact, and there is nothing to add up.
    #[inline(never)]
    fn evaluate_balls<const PLAIN: bool>(&mut self, step: &SubStep<'_>, counters: &mut Counters) {
        let SubStep { context, laws, ids, dt, .. } = *step;
        self.own.fill(Wrench::default());
        self.touches.fill(false);
        let count = self.contacts.len();
        let (mut kept, mut at) = (0, 0);
        let mut deepest = (0.0, 0);
        while at < count {
            let end = (at + WIDTH).min(count);
            let forces = evaluate::<WIDTH, PLAIN, true>(context, laws, (&self.pairs, &self.contacts[at..end]), dt);
            for l in 0..end - at {
                let from = at + l;
                let p = self.contacts[from].pair;
                let pair = &mut self.pairs[p as usize];
                let apart = forces.overlap.0[l] <= 0.0;
                let Reach { over_radius, farthest } = context.reach;
                let parted =
                    apart && (PLAIN || forces.fraction.0[l] <= -over_radius || forces.overlap.0[l] <= -farthest);
                if parted == pair.touching {
                    pair.touching = !parted;
                    pair.count = u32::from(!parted);
                    if !pair.bridged {
                        self.changes.push(p);
                    }
                }
                if !PLAIN {
                    pair.apart = apart;
                }
                if parted {
                    self.part(context, from, -forces.overlap.0[l]);
                    continue;
                }
                let row = pair.low as usize - self.first;
                let counted = usize::from(!apart && (pair.low as usize) < context.owned);
                if kept != from {
                    self.contacts[kept] = self.contacts[from];
                }
                self.contacts[kept].d_t = forces.d_t.lane(l);
                if !PLAIN {
                    self.contacts[kept].turn = forces.turn.lane(l);
                }
                if !PLAIN && apart {
                    self.contacts[kept].deep = false;
                }
                let fraction = forces.fraction.0[l];
                if fraction > deepest.0 {
                    deepest = (fraction, kept);
                }
                if fraction > DEEP_OVERLAP {
                    self.mark_deep(context, kept, counters);
                }
                kept += 1;
                let force = forces.force.lane(l);
                self.own[row] += Wrench { force, torque: forces.torque_low.lane(l) };
                self.on_high[p as usize] = Wrench { force: -force, torque: forces.torque_high.lane(l) };
                self.touches[row] |= !apart;
                counters.pairs += counted;
                counters.contacts += counted;
            }
            at = end;
        }
        self.contacts.truncate(kept);
        self.note_deepest(context, ids, deepest, counters);
    }

    /// Records the deepest contact, given with its overlap over the smaller radius.
    fn note_deepest(
        &self,
        context: &ContactContext<'_>,
        ids: &[u64],
        (fraction, contact): (Real, usize),
        counters: &mut Counters,
    ) {
        if fraction > counters.deepest {
            let pair = &self.pairs[self.contacts[contact].pair as usize];
            counters.deepest = fraction;
            counters.deepest_ids = [ids[pair.low as usize], ids[pair.high as usize]];
            counters.deepest_at = context.poses[pair.low as usize].unwrapped;
        }
    }

    /// Counts a contact that passes the warning limit.
    #[cold]
    fn mark_deep(&mut self, context: &ContactContext<'_>, contact: usize, counters: &mut Counters) {
        if !self.contacts[contact].deep {
            self.contacts[contact].deep = true;
            counters.deepened += usize::from(self.counts(context, self.contacts[contact].pair));
        }
    }

    /// Two spheres have parted and are `gap` apart.
    fn part(&mut self, context: &ContactContext<'_>, contact: usize, gap: Real) {
        let contact = self.contacts[contact];
        let p = contact.pair as usize;
        let pair = &self.pairs[p];
        let pose = &context.poses[pair.low as usize];
        // Balls alone have films; the radius of others is 0.
        let reach = context.reach.of(pose.radius.min(context.poses[pair.high as usize].radius));
        let slack = TOUCH * context.bodies[pose.body as usize].bounding_radius * pose.scale + reach;
        let sum = context.travel[pair.low as usize] + context.travel[pair.high as usize];
        self.skip_until[p] = self.skip_until[p].min(sum + (gap - slack).max(0.0));
        self.nearest[p].add((contact.a, contact.b));
        self.lower_row_limit(context, contact.pair);
    }

    /// Whether pair `p` is counted here: of the ranks that evaluate it, the one that owns its lower grain counts.
    #[inline(always)]
    fn counts(&self, context: &ContactContext<'_>, p: u32) -> bool {
        (self.pairs[p as usize].low as usize) < context.owned
    }

    /// Pairs in which grain `g` comes first that have contacts.
    pub fn touching_pairs(&self, g: usize) -> impl Iterator<Item = usize> {
        let row = g - self.first;
        let pairs = self.starts[row] as usize..self.starts[row + 1] as usize;
        pairs.filter(|&p| self.pairs[p].touching)
    }

    /// Contacts of pair `p`.
    pub fn contacts_of(&self, p: usize) -> &[Contact] {
        let start = self.contacts.partition_point(|c| (c.pair as usize) < p);
        &self.contacts[start..start + self.pairs[p].count as usize]
    }

    /// Ends the sum over the contacts of pair `p`.
    #[inline(always)]
    fn close(&mut self, context: &ContactContext<'_>, p: u32, total: &Total, counters: &mut Counters) {
        let Some(pair) = self.pairs.get_mut(p as usize) else { return };
        if (total.count > 0) != pair.touching {
            pair.touching = !pair.touching;
            if !pair.bridged {
                self.changes.push(p);
            }
        }
        pair.count = total.count as u32;
        if total.count > 0 {
            let row = pair.low as usize - self.first;
            self.own[row] += total.on_low;
            self.on_high[p as usize] = Wrench { force: -total.on_low.force, torque: total.torque_high };
            self.touches[row] = true;
            if self.counts(context, p) {
                counters.pairs += 1;
                counters.contacts += total.count;
            }
        }
    }
}

/// Sum over the sphere contacts of a pair.
#[derive(Default)]
struct Total {
    count: usize,
    on_low: Wrench,
    torque_high: Vector,
}

impl Total {
    #[inline(always)]
    fn add(&mut self, forces: &ContactForces<WIDTH>, l: usize) {
        self.count += 1;
        self.on_low += Wrench { force: forces.force.lane(l), torque: forces.torque_low.lane(l) };
        self.torque_high += forces.torque_high.lane(l);
    }
}
