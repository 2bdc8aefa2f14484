//! Contacts with plane walls, by the law of contacts between grains.

use sazanami_numerics::{Real, Vector};

use super::block::make_room;
use super::evaluate::rolling_torque;
use super::law::{ConstantLanes, force};
use super::search::{REACH, Rod, TOUCH};
use super::{Census, World, Wrench};
use crate::lanes::{Lanes, Lanes3};
use crate::material::Multiplicity;

/// A grain near a wall.
#[derive(Clone, Copy, Debug)]
pub(crate) struct WallPair {
    pub grain: u32,
    pub wall: u32,
    pub law: u32,
    pub factor: Real,
    /// Sum of the budgets of grain and wall at which the pair must be looked at.
    pub wake: Real,
    pub multiplicity: Multiplicity,
}

/// A sphere that touches a wall.
#[derive(Clone, Copy, Debug)]
pub(crate) struct WallContact {
    pub pair: u32,
    pub a: u16,
    pub deep: bool,
    pub d_t: Vector,
}

/// The walls' side of a block.
#[derive(Clone, Debug, Default)]
pub(crate) struct WallContacts {
    /// By grain, then wall.
    pub pairs: Vec<WallPair>,
    pub contacts: Vec<WallContact>,
    /// Sum over the walls for each pair whose grain touches: `(grain, action)`, by grain.
    pub actions: Vec<(u32, Wrench)>,
    found: Vec<WallContact>,
    merged: Vec<WallContact>,
}

impl WallContacts {
    pub fn clear(&mut self) {
        self.pairs.clear();
        self.contacts.clear();
        self.actions.clear();
    }

    /// See [`super::block::Block::make_room`]; a grain touches a wall with some spheres.
    pub fn make_room(&mut self) {
        let room = 4 * self.pairs.len();
        make_room(&mut self.contacts, room);
        make_room(&mut self.merged, room);
        make_room(&mut self.found, room);
        make_room(&mut self.actions, self.pairs.len());
    }

    /// Forces between walls and the grains of the block that starts at grain `first`.
    pub fn step(
        &mut self,
        world: &World<'_>,
        ids: &[u64],
        first: usize,
        dt: Real,
        touches: &mut [bool],
        census: &mut Census,
    ) {
        self.actions.clear();
        if self.pairs.is_empty() {
            return;
        }
        self.wake_pairs(world);
        let (mut at, mut kept) = (0, 0);
        while at < self.contacts.len() {
            let p = self.contacts[at].pair;
            let pair = self.pairs[p as usize];
            let mut count = 0;
            let mut total = Wrench::default();
            let mut deepest = 0.0;
            while at < self.contacts.len() && self.contacts[at].pair == p {
                let mut contact = self.contacts[at];
                at += 1;
                let Some((action, overlap, fraction)) = touch(world, &pair, &mut contact, dt) else {
                    let wake = &mut self.pairs[p as usize].wake;
                    let budget = world.budget[pair.grain as usize] + world.wall_budget[pair.wall as usize];
                    *wake = wake.min(budget);
                    continue;
                };
                if fraction > super::block::WARNING && !contact.deep {
                    contact.deep = true;
                    census.deepened += 1;
                }
                if fraction > census.deepest {
                    census.deepest = fraction;
                    census.deepest_ids = [ids[pair.grain as usize], crate::WALL + u64::from(pair.wall)];
                    census.deepest_at = world.frames[pair.grain as usize].home;
                }
                self.contacts[kept] = contact;
                kept += 1;
                count += 1;
                if pair.multiplicity != Multiplicity::Deepest {
                    total += action;
                } else if overlap > deepest {
                    (deepest, total) = (overlap, action);
                }
            }
            if count == 0 {
                continue;
            }
            if pair.multiplicity == Multiplicity::Average {
                let share = 1.0 / count as Real;
                total = Wrench { force: share * total.force, torque: share * total.torque };
            }
            touches[pair.grain as usize - first] = true;
            census.contacts += count;
            census.pairs += 1;
            census.on_walls -= total.force;
            match self.actions.last_mut() {
                Some((grain, sum)) if *grain == pair.grain => *sum += total,
                _ => self.actions.push((pair.grain, total)),
            }
        }
        self.contacts.truncate(kept);
    }

    fn wake_pairs(&mut self, world: &World<'_>) {
        self.found.clear();
        for (p, pair) in self.pairs.iter_mut().enumerate() {
            let budget = world.budget[pair.grain as usize] + world.wall_budget[pair.wall as usize];
            if budget < pair.wake {
                continue;
            }
            let p = p as u32;
            let known = |a: u16| {
                let start = self.contacts.partition_point(|c| c.pair < p);
                self.contacts[start..].iter().take_while(|c| c.pair == p).any(|c| c.a == a)
            };
            let frame = &world.frames[pair.grain as usize];
            let body = &world.bodies[frame.body as usize];
            let wall = &world.walls[pair.wall as usize];
            let size = body.bounding_radius * frame.scale;
            let near = TOUCH * size;
            let height = wall.distance(frame.home);
            let rotation = &world.rotations[pair.grain as usize];
            let rod = Rod::new(&body.capsule, rotation, frame.scale);
            let mut gap = height + rod.start.dot(wall.normal).min(rod.end.dot(wall.normal)) - rod.radius;
            if gap < REACH * size {
                gap = REACH * size;
                let normal = rotation.transpose() * wall.normal;
                for (a, (centre, radius)) in body.centres.iter().zip(&body.radii).enumerate() {
                    let distance = height + (centre.dot(normal) - radius) * frame.scale;
                    if distance >= near {
                        gap = gap.min(distance);
                    } else if !known(a as u16) {
                        self.found.push(WallContact { pair: p, a: a as u16, deep: false, d_t: Vector::ZERO });
                    }
                }
            }
            pair.wake = budget + (gap - near).max(0.0);
        }
        if !self.found.is_empty() {
            self.merged.clear();
            let mut new = self.found.iter().peekable();
            for old in &self.contacts {
                while let Some(contact) = new.next_if(|c| (c.pair, c.a) < (old.pair, old.a)) {
                    self.merged.push(*contact);
                }
                self.merged.push(*old);
            }
            self.merged.extend(new);
            std::mem::swap(&mut self.contacts, &mut self.merged);
        }
    }
}

/// Action of a wall on a grain through one sphere, with overlap and overlap over radius; `None` if they are apart.
fn touch(world: &World<'_>, pair: &WallPair, contact: &mut WallContact, dt: Real) -> Option<(Wrench, Real, Real)> {
    let frame = &world.frames[pair.grain as usize];
    let body = &world.bodies[frame.body as usize];
    let wall = &world.walls[pair.wall as usize];
    let radius = body.radii[contact.a as usize] * frame.scale;
    let to_a = world.rotations[pair.grain as usize] * body.centres[contact.a as usize] * frame.scale;
    let overlap = radius - (wall.distance(frame.home) + to_a.dot(wall.normal));
    if overlap <= 0.0 {
        return None;
    }
    // The wall is body j: the normal points into it.
    let n = -wall.normal;
    let arm = to_a + n * (radius - 0.5 * overlap);
    let v_r = wall.velocity - frame.velocity - frame.spin.cross(arm);
    let constants: ConstantLanes<1> = ConstantLanes::from_fn(|_| (&world.constants[pair.law as usize], pair.factor));
    let (h, d_t, h_n) = force::<1, false>(
        &constants,
        Lanes3::splat(n),
        Lanes::splat(overlap),
        Lanes3::splat(v_r),
        Lanes3::splat(contact.d_t),
        dt,
    );
    // A plane has no curvature: the effective radius is the sphere's own.
    let far = Lanes::splat(1e9 * radius);
    let rolling = rolling_torque(&constants, Lanes::splat(radius), far, h_n, Lanes3::splat(-frame.spin));
    contact.d_t = d_t.lane(0);
    let force = h.lane(0);
    Some((Wrench { force, torque: arm.cross(force) + rolling.lane(0) }, overlap, overlap / radius))
}
