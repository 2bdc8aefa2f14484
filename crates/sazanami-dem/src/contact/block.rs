//! A block of neighbouring grains and the pairs in which they come first: the unit of parallel work.
//!
//! A pair of grains sleeps until the two could have come together: both carry a bound of the way
//! their contact spheres have gone, and the pair need not be looked at before the sum has grown by
//! its last known gap. A sleeping pair costs one comparison. Contacts that touch are kept in a list
//! ordered by pair and sphere and evaluated in every sub-step. Which pairs are listed or awake has
//! no influence on any force: it only decides what is looked at.

use sazanami_numerics::{Real, Vector};

use super::evaluate::{Outcome, WIDTH, evaluate};
use super::search::Near;
use super::walls::WallContacts;
use super::{Census, World, Wrench};
use crate::material::Multiplicity;

/// Grains in a block.
pub(crate) const ROWS: usize = 64;
/// Overlap over radius above which a contact is counted.
pub(crate) const WARNING: Real = 0.2;
/// Sphere pairs closer than this fraction of the bounding radius are handed to the contact law, which decides.
const TOUCH: Real = 1e-9;
/// Distance, over the smaller bounding radius, within which gaps of spheres are measured one by one.
const REACH: Real = 0.1;

/// Two grains near each other.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Pair {
    /// The grain with the lower identifier.
    pub low: u32,
    pub high: u32,
    /// Number of the contact law.
    pub law: u32,
    /// Place of the first among those with a lower identifier than the second.
    pub rank: u32,
    /// Factor on the dashpots.
    pub factor: Real,
    /// From the second's home to its periodic image [m].
    pub shift: Vector,
    pub image: [i32; 2],
    pub touching: bool,
    pub multiplicity: Multiplicity,
}

/// Two spheres that touch.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Contact {
    /// Pair of grains, within the block.
    pub pair: u32,
    pub a: u16,
    pub b: u16,
    pub deep: bool,
    /// Tangential displacement [m].
    pub d_t: Vector,
}

impl Contact {
    fn key(&self) -> (u32, u16, u16) {
        (self.pair, self.a, self.b)
    }
}

/// See the module.
#[derive(Clone, Debug, Default)]
pub(crate) struct Block {
    /// First grain.
    pub first: usize,
    /// First pair of each row, and the number of pairs.
    pub starts: Vec<u32>,
    /// Second grain of each pair.
    pub high: Vec<u32>,
    /// Sum of the two budgets at which the pair must be looked at.
    pub wake: Vec<Real>,
    pub pairs: Vec<Pair>,
    pub contacts: Vec<Contact>,
    /// Action of each pair on its second grain; meaningful while it touches.
    pub on_high: Vec<Wrench>,
    /// Sum of the actions on each row's grain of the pairs in which it is first.
    pub own: Vec<Wrench>,
    /// Whether a row's grain touches as first of a pair or touches a wall.
    pub touches: Vec<bool>,
    /// Pairs that began or ceased to touch in this sub-step.
    pub changes: Vec<u32>,
    pub walls: WallContacts,
    pub census: Census,
    due: Vec<u32>,
    found: Vec<Contact>,
    merged: Vec<Contact>,
    outcomes: Vec<Outcome>,
    near: Near,
}

impl Block {
    /// Empties the block for `rows` grains from `first`.
    pub fn reset(&mut self, first: usize, rows: usize) {
        self.first = first;
        self.starts.clear();
        self.starts.push(0);
        self.high.clear();
        self.wake.clear();
        self.pairs.clear();
        self.contacts.clear();
        self.on_high.clear();
        self.changes.clear();
        self.own.clear();
        self.own.resize(rows, Wrench::default());
        self.touches.clear();
        self.touches.resize(rows, false);
        self.walls.clear();
        self.census = Census::default();
    }

    /// Appends a pair to the row being filled.
    pub fn push(&mut self, pair: Pair, wake: Real) {
        self.high.push(pair.high);
        self.wake.push(wake);
        self.pairs.push(pair);
        self.on_high.push(Wrench::default());
    }

    /// Ends the row being filled.
    pub fn end_row(&mut self) {
        self.starts.push(self.pairs.len() as u32);
    }

    /// Forces of all contacts of the block over a sub-step of length `dt`.
    pub fn step(&mut self, world: &World<'_>, ids: &[u64], dt: Real) {
        self.census = Census::default();
        self.changes.clear();
        self.wake_pairs(world);
        self.evaluate(world, dt);
        self.sum(world, ids);
        self.walls.step(world, ids, self.first, dt, &mut self.touches, &mut self.census);
    }

    fn wake_pairs(&mut self, world: &World<'_>) {
        self.due.clear();
        for (row, range) in self.starts.windows(2).enumerate() {
            let mine = world.budget[self.first + row];
            for p in range[0]..range[1] {
                let sum = mine + world.budget[self.high[p as usize] as usize];
                if sum >= self.wake[p as usize] {
                    self.due.push(p);
                }
            }
        }
        if self.due.is_empty() {
            return;
        }
        self.found.clear();
        for &p in &self.due {
            let pair = &self.pairs[p as usize];
            let (low, high) = (pair.low as usize, pair.high as usize);
            let ends = [low, high].map(|g| {
                let frame = &world.frames[g];
                (&world.bodies[frame.body as usize], &world.arrays[frame.body as usize], frame)
            });
            let offset = ends[1].2.home - ends[0].2.home + pair.shift;
            let size = (ends[0].0.bounding_radius * ends[0].2.scale).min(ends[1].0.bounding_radius * ends[1].2.scale);
            let touch = TOUCH * size;
            let gap = self.near.look(ends, offset, REACH * size, touch);
            self.wake[p as usize] = world.budget[low] + world.budget[high] + (gap - touch).max(0.0);
            if self.near.found.is_empty() {
                continue;
            }
            let start = self.contacts.partition_point(|c| c.pair < p);
            let known = self.contacts[start..].iter().take_while(|c| c.pair == p);
            for &(a, b) in &self.near.found {
                if !known.clone().any(|c| (c.a, c.b) == (a, b)) {
                    self.found.push(Contact { pair: p, a, b, deep: false, d_t: Vector::ZERO });
                }
            }
        }
        self.insert_found();
    }

    /// Merges the new contacts into the ordered list.
    fn insert_found(&mut self) {
        if self.found.is_empty() {
            return;
        }
        self.merged.clear();
        let mut new = self.found.iter().peekable();
        for old in &self.contacts {
            while let Some(contact) = new.next_if(|c| c.key() < old.key()) {
                self.merged.push(*contact);
            }
            self.merged.push(*old);
        }
        self.merged.extend(new);
        std::mem::swap(&mut self.contacts, &mut self.merged);
    }

    fn evaluate(&mut self, world: &World<'_>, dt: Real) {
        self.outcomes.clear();
        for contacts in self.contacts.chunks(WIDTH) {
            if world.plain {
                evaluate::<WIDTH, true>(world, &self.pairs, contacts, dt, &mut self.outcomes);
            } else {
                evaluate::<WIDTH, false>(world, &self.pairs, contacts, dt, &mut self.outcomes);
            }
        }
    }

    /// Adds up pairs and rows in order, drops the contacts that have ended.
    fn sum(&mut self, world: &World<'_>, ids: &[u64]) {
        self.own.fill(Wrench::default());
        self.touches.fill(false);
        let (mut at, mut kept) = (0, 0);
        while at < self.contacts.len() {
            let p = self.contacts[at].pair;
            let end = at + self.contacts[at..].iter().take_while(|c| c.pair == p).count();
            let pair = &mut self.pairs[p as usize];
            let (low, high) = (pair.low as usize, pair.high as usize);
            let mut total = Total::default();
            for c in at..end {
                let outcome = &self.outcomes[c];
                // A number that is none passes here and is found when the grains move.
                if outcome.overlap <= 0.0 {
                    let gap = (-outcome.overlap - TOUCH * world.bodies[0].bounding_radius).max(0.0);
                    let wake = &mut self.wake[p as usize];
                    *wake = wake.min(world.budget[low] + world.budget[high] + gap);
                    continue;
                }
                let mut contact = self.contacts[c];
                contact.d_t = outcome.d_t;
                if outcome.fraction > WARNING && !contact.deep {
                    contact.deep = true;
                    self.census.deepened += 1;
                }
                if outcome.fraction > self.census.deepest {
                    self.census.deepest = outcome.fraction;
                    self.census.deepest_ids = [ids[low], ids[high]];
                    self.census.deepest_at = world.frames[low].home;
                }
                self.contacts[kept] = contact;
                kept += 1;
                total.add(outcome, pair.multiplicity);
            }
            if (total.count > 0) != pair.touching {
                pair.touching = !pair.touching;
                self.changes.push(p);
            }
            if total.count > 0 {
                let (on_low, on_high) = total.wrenches(pair.multiplicity);
                let row = low - self.first;
                self.own[row] += on_low;
                self.on_high[p as usize] = on_high;
                self.touches[row] = true;
                self.census.pairs += 1;
                self.census.contacts += total.count;
            }
            at = end;
        }
        self.contacts.truncate(kept);
    }
}

/// Sum over the sphere contacts of a pair.
#[derive(Default)]
struct Total {
    count: usize,
    deepest: Real,
    on_low: Wrench,
    torque_high: Vector,
}

impl Total {
    #[inline(always)]
    fn add(&mut self, outcome: &Outcome, multiplicity: Multiplicity) {
        self.count += 1;
        let on_low = Wrench { force: outcome.force, torque: outcome.torque_low };
        if multiplicity != Multiplicity::Deepest {
            self.on_low += on_low;
            self.torque_high += outcome.torque_high;
        } else if outcome.overlap > self.deepest {
            self.deepest = outcome.overlap;
            self.on_low = on_low;
            self.torque_high = outcome.torque_high;
        }
    }

    #[inline(always)]
    fn wrenches(&self, multiplicity: Multiplicity) -> (Wrench, Wrench) {
        let share = if multiplicity == Multiplicity::Average { 1.0 / self.count as Real } else { 1.0 };
        (
            Wrench { force: share * self.on_low.force, torque: share * self.on_low.torque },
            Wrench { force: -share * self.on_low.force, torque: share * self.torque_high },
        )
    }
}
