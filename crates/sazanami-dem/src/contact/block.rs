//! A block of neighbouring grains and the pairs in which they come first: the unit of parallel work.
//!
//! A pair of grains sleeps until the two could have come together: both carry a bound of the way
//! their contact spheres have gone, and the pair need not be looked at before the sum has grown by
//! its last known gap. A row of pairs sleeps until its grain's way and the farthest way of any grain in
//! each sub-step could add up to the least of what its pairs have left: a sleeping row costs one
//! comparison. Contacts that touch are kept in a list ordered by pair and sphere and evaluated in every
//! sub-step. Which pairs are listed or awake has no influence on any force: it only decides what is
//! looked at.

use sazanami_numerics::{Real, Vector};

use super::evaluate::{Outcomes, WIDTH, evaluate};
use super::search::{Near, Nearest, REACH, TOUCH};
use super::walls::WallContacts;
use super::{Census, World, Wrench};
use crate::material::Multiplicity;

/// Grains in a block.
pub(crate) const ROWS: usize = 64;
/// Overlap over the smaller contact sphere's radius above which a contact is counted as deep.
pub const WARNING: Real = 0.2;

/// Two grains near each other.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Pair {
    /// The grain with the lower identifier.
    pub low: u32,
    pub high: u32,
    /// Factor on the dashpots.
    pub factor: Real,
    /// Periodic image of the second grain relative to the first.
    pub image: [i16; 2],
    /// Number of the contact law.
    pub law: u16,
    pub multiplicity: Multiplicity,
    pub touching: bool,
    /// First of its contacts, if it touches.
    pub contacts: u32,
}

impl Pair {
    /// From the second grain's home to its periodic image [m].
    #[inline(always)]
    pub fn shift(&self, period: Vector) -> Vector {
        Vector::new(Real::from(self.image[0]) * period.x, Real::from(self.image[1]) * period.y, 0.0)
    }
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
    /// Sum of a row's budget and [`World::grown`] before which none of its pairs can be due.
    alarm: Vec<Real>,
    pub pairs: Vec<Pair>,
    /// What each pair remembers of its last search.
    pub nearest: Vec<Nearest>,
    /// Place of each pair's first grain among those with a lower identifier than the second.
    pub rank: Vec<u32>,
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
    /// Identifier, image, place and gap of the neighbours of the row being filled.
    pub listed: Vec<(u64, [i32; 2], u32, Real)>,
    due: Vec<u32>,
    found: Vec<Contact>,
    merged: Vec<Contact>,
    near: Near,
}

/// Takes memory for `room` entries altogether.
pub(super) fn make_room<T>(list: &mut Vec<T>, room: usize) {
    list.reserve(room.saturating_sub(list.len()));
}

impl Block {
    /// Empties the block for `rows` grains from `first`.
    pub fn reset(&mut self, first: usize, rows: usize) {
        self.first = first;
        self.starts.clear();
        self.starts.push(0);
        self.high.clear();
        self.wake.clear();
        self.alarm.clear();
        self.alarm.resize(rows, Real::NEG_INFINITY);
        self.pairs.clear();
        self.rank.clear();
        self.nearest.clear();
        self.contacts.clear();
        self.on_high.clear();
        self.changes.clear();
        self.own.clear();
        self.own.resize(rows, Wrench::default());
        self.touches.clear();
        self.touches.resize(rows, false);
        self.walls.clear();
    }

    /// Appends a pair to the row being filled.
    pub fn push(&mut self, pair: Pair, wake: Real, nearest: Nearest) {
        self.high.push(pair.high);
        self.wake.push(wake);
        self.pairs.push(pair);
        self.rank.push(0);
        self.nearest.push(nearest);
        self.on_high.push(Wrench::default());
    }

    /// Ends the row being filled.
    pub fn end_row(&mut self) {
        self.starts.push(self.pairs.len() as u32);
    }

    /// Takes the memory that the sub-steps with this list need, so that they need not ask for any: room for a
    /// contact of each pair listed, where few of them touch, and a few to spare.
    pub fn make_room(&mut self) {
        let room = self.pairs.len() + 16;
        make_room(&mut self.contacts, room);
        make_room(&mut self.merged, room);
        make_room(&mut self.found, room);
        make_room(&mut self.due, room);
        make_room(&mut self.changes, room);
        self.walls.make_room();
    }

    /// Forces of all contacts of the block over a sub-step of length `dt`.
    pub fn step(&mut self, world: &World<'_>, ids: &[u64], dt: Real) -> Census {
        let mut census = Census::default();
        self.changes.clear();
        self.wake_pairs(world);
        match (world.plain, world.balls) {
            (true, true) => self.evaluate_balls::<true>(world, ids, dt, &mut census),
            (false, true) => self.evaluate_balls::<false>(world, ids, dt, &mut census),
            (true, false) => self.evaluate::<true>(world, ids, dt, &mut census),
            (false, false) => self.evaluate::<false>(world, ids, dt, &mut census),
        }
        self.walls.step(world, ids, self.first, dt, &mut self.touches, &mut census);
        census.changes = self.changes.len();
        census
    }

    fn wake_pairs(&mut self, world: &World<'_>) {
        self.due.clear();
        let mine = &world.budget[self.first..];
        for ((range, alarm), mine) in self.starts.windows(2).zip(&mut self.alarm).zip(mine) {
            if mine + world.grown < *alarm {
                continue;
            }
            let pairs = range[0] as usize..range[1] as usize;
            let mut least = Real::INFINITY;
            for (p, (high, wake)) in (range[0]..).zip(self.high[pairs.clone()].iter().zip(&self.wake[pairs])) {
                let other = world.budget[*high as usize];
                if mine + other >= *wake {
                    self.due.push(p);
                } else {
                    least = least.min(wake - other);
                }
            }
            *alarm = least + world.grown;
        }
        if self.due.is_empty() {
            return;
        }
        self.found.clear();
        for n in 0..self.due.len() {
            self.search(world, self.due[n]);
            self.set_alarm(world, self.due[n]);
        }
        self.insert_found();
    }

    /// Sees to it that the row of a pair wakes when the pair does.
    fn set_alarm(&mut self, world: &World<'_>, p: u32) {
        let pair = &self.pairs[p as usize];
        let alarm = &mut self.alarm[pair.low as usize - self.first];
        *alarm = alarm.min(self.wake[p as usize] - world.budget[pair.high as usize] + world.grown);
    }

    /// Looks at a pair that has woken: at the sphere pairs it remembers, or if that is not enough at all.
    fn search(&mut self, world: &World<'_>, p: u32) {
        let pair = &self.pairs[p as usize];
        let (low, high) = (pair.low as usize, pair.high as usize);
        let frames = [low, high].map(|g| &world.frames[g]);
        let offset = frames[1].home - frames[0].home + pair.shift(world.period);
        let size = frames.map(|f| world.bodies[f.body as usize].bounding_radius * f.scale);
        let size = size[0].min(size[1]);
        let touch = TOUCH * size;
        let sum = world.budget[low] + world.budget[high];
        let start = if pair.touching { pair.contacts as usize } else { self.contacts.len() };
        let mine = self.contacts[start..].iter().take_while(|c| c.pair == p);
        let known = |spheres: (u16, u16)| mine.clone().any(|c| (c.a, c.b) == spheres);
        let nearest = &mut self.nearest[p as usize];
        let new = |(a, b): (u16, u16)| Contact { pair: p, a, b, deep: false, d_t: Vector::ZERO };
        if frames.iter().all(|f| f.radius > 0.0) {
            // Of balls there is nothing else to know. While they touch they need no look; see `part`.
            let gap = offset.length() - (frames[0].radius + frames[1].radius);
            self.wake[p as usize] = if gap < touch { Real::INFINITY } else { sum + (gap - touch) };
            if gap < touch && !pair.touching {
                self.found.push(new((0, 0)));
            }
        } else if sum < nearest.rest {
            let mut wake = nearest.rest;
            for &spheres in &nearest.spheres[..nearest.count as usize] {
                if known(spheres) {
                    continue;
                }
                let gap = gap(world, [low, high], spheres, offset);
                if gap < touch { self.found.push(new(spheres)) } else { wake = wake.min(sum + (gap - touch)) }
            }
            self.wake[p as usize] = wake;
        } else {
            let ends = [low, high].map(|g| {
                let frame = &world.frames[g];
                let body = frame.body as usize;
                (&world.bodies[body], &world.arrays[body], &world.rotations[g], frame.scale)
            });
            let gap = self.near.look(ends, offset, REACH * size, touch);
            self.wake[p as usize] = sum + (gap - touch).max(0.0);
            *nearest = self.near.nearest(sum, touch);
            self.found.extend(self.near.found.iter().filter(|s| !known(**s)).map(|s| new(*s)));
        }
    }

    /// Merges the new contacts into the ordered list.
    fn insert_found(&mut self) {
        if self.found.is_empty() {
            return;
        }
        self.found.sort_unstable_by_key(Contact::key);
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

    /// Evaluates all contacts, adds up pairs and rows in order, drops the contacts that have ended.
    #[inline(never)]
    fn evaluate<const PLAIN: bool>(&mut self, world: &World<'_>, ids: &[u64], dt: Real, census: &mut Census) {
        self.own.fill(Wrench::default());
        self.touches.fill(false);
        let count = self.contacts.len();
        let (mut kept, mut at) = (0, 0);
        let mut present = u32::MAX;
        let mut total = Total::default();
        while at < count {
            let end = (at + WIDTH).min(count);
            let outcomes = evaluate::<WIDTH, PLAIN, false>(world, &self.pairs, &self.contacts[at..end], dt);
            for l in 0..end - at {
                let from = at + l;
                let p = self.contacts[from].pair;
                if p != present {
                    self.close(world, present, &total, census);
                    (present, total) = (p, Total::default());
                    self.pairs[p as usize].contacts = kept as u32;
                }
                let overlap = outcomes.overlap.0[l];
                // A number that is none passes here and is found when the grains move.
                if overlap <= 0.0 {
                    self.part(world, from, -overlap);
                    continue;
                }
                if kept != from {
                    self.contacts[kept] = self.contacts[from];
                }
                self.contacts[kept].d_t = outcomes.d_t.lane(l);
                let fraction = outcomes.fraction.0[l];
                if fraction > census.deepest.min(WARNING) {
                    self.note_depth(world, ids, kept, fraction, census);
                }
                kept += 1;
                total.add(&outcomes, l, self.pairs[p as usize].multiplicity);
            }
            at = end;
        }
        self.close(world, present, &total, census);
        self.contacts.truncate(kept);
    }

    /// The same where all bodies are balls: a pair has one contact, and there is nothing to add up.
    #[inline(never)]
    fn evaluate_balls<const PLAIN: bool>(&mut self, world: &World<'_>, ids: &[u64], dt: Real, census: &mut Census) {
        self.own.fill(Wrench::default());
        self.touches.fill(false);
        let count = self.contacts.len();
        let (mut kept, mut at) = (0, 0);
        while at < count {
            let end = (at + WIDTH).min(count);
            let outcomes = evaluate::<WIDTH, PLAIN, true>(world, &self.pairs, &self.contacts[at..end], dt);
            for l in 0..end - at {
                let from = at + l;
                let p = self.contacts[from].pair;
                let pair = &mut self.pairs[p as usize];
                let parted = outcomes.overlap.0[l] <= 0.0;
                if parted == pair.touching {
                    pair.touching = !parted;
                    self.changes.push(p);
                }
                if parted {
                    self.part(world, from, -outcomes.overlap.0[l]);
                    continue;
                }
                let row = pair.low as usize - self.first;
                let counted = usize::from((pair.low as usize) < world.owned);
                if kept != from {
                    self.contacts[kept] = self.contacts[from];
                }
                self.contacts[kept].d_t = outcomes.d_t.lane(l);
                let fraction = outcomes.fraction.0[l];
                if fraction > census.deepest.min(WARNING) {
                    self.note_depth(world, ids, kept, fraction, census);
                }
                kept += 1;
                let force = outcomes.force.lane(l);
                self.own[row] += Wrench { force, torque: outcomes.torque_low.lane(l) };
                self.on_high[p as usize] = Wrench { force: -force, torque: outcomes.torque_high.lane(l) };
                self.touches[row] = true;
                census.pairs += counted;
                census.contacts += counted;
            }
            at = end;
        }
        self.contacts.truncate(kept);
    }

    /// Takes down the deepest contact, and one that passes the warning limit.
    #[cold]
    fn note_depth(&mut self, world: &World<'_>, ids: &[u64], contact: usize, fraction: Real, census: &mut Census) {
        let p = self.contacts[contact].pair;
        let pair = &self.pairs[p as usize];
        if fraction > census.deepest {
            census.deepest = fraction;
            census.deepest_ids = [ids[pair.low as usize], ids[pair.high as usize]];
            census.deepest_at = world.frames[pair.low as usize].home;
        }
        if fraction > WARNING && !self.contacts[contact].deep {
            self.contacts[contact].deep = true;
            census.deepened += usize::from(self.counts(world, p));
        }
    }

    /// Two spheres have parted and are `gap` apart.
    fn part(&mut self, world: &World<'_>, contact: usize, gap: Real) {
        let contact = self.contacts[contact];
        let p = contact.pair as usize;
        let pair = &self.pairs[p];
        let frame = &world.frames[pair.low as usize];
        let slack = TOUCH * world.bodies[frame.body as usize].bounding_radius * frame.scale;
        let sum = world.budget[pair.low as usize] + world.budget[pair.high as usize];
        self.wake[p] = self.wake[p].min(sum + (gap - slack).max(0.0));
        self.nearest[p].add((contact.a, contact.b));
        self.set_alarm(world, contact.pair);
    }

    /// Whether pair `p` is counted here: of the ranks that evaluate it, the one that owns its lower grain counts.
    #[inline(always)]
    fn counts(&self, world: &World<'_>, p: u32) -> bool {
        (self.pairs[p as usize].low as usize) < world.owned
    }

    /// All contacts of a pair are known.
    #[inline(always)]
    fn close(&mut self, world: &World<'_>, p: u32, total: &Total, census: &mut Census) {
        let Some(pair) = self.pairs.get_mut(p as usize) else { return };
        if (total.count > 0) != pair.touching {
            pair.touching = !pair.touching;
            self.changes.push(p);
        }
        if total.count > 0 {
            let (on_low, on_high) = total.wrenches(pair.multiplicity);
            let row = pair.low as usize - self.first;
            self.own[row] += on_low;
            self.on_high[p as usize] = on_high;
            self.touches[row] = true;
            if self.counts(world, p) {
                census.pairs += 1;
                census.contacts += total.count;
            }
        }
    }
}

/// Gap of two contact spheres [m].
fn gap(world: &World<'_>, [i, j]: [usize; 2], (a, b): (u16, u16), offset: Vector) -> Real {
    let [p, q] = [(i, a), (j, b)].map(|(grain, sphere)| {
        let frame = &world.frames[grain];
        let [x, y, z, r] = world.spheres[frame.spheres as usize + sphere as usize];
        (world.rotations[grain] * Vector::new(x, y, z) * frame.scale, r * frame.scale)
    });
    (offset + q.0 - p.0).length() - (p.1 + q.1)
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
    fn add(&mut self, outcomes: &Outcomes<WIDTH>, l: usize, multiplicity: Multiplicity) {
        self.count += 1;
        let on_low = Wrench { force: outcomes.force.lane(l), torque: outcomes.torque_low.lane(l) };
        if multiplicity != Multiplicity::Deepest {
            self.on_low += on_low;
            self.torque_high += outcomes.torque_high.lane(l);
        } else if outcomes.overlap.0[l] > self.deepest {
            self.deepest = outcomes.overlap.0[l];
            self.on_low = on_low;
            self.torque_high = outcomes.torque_high.lane(l);
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
