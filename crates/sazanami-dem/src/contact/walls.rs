//! Contacts with walls, by the law of contacts between grains.

use sazanami_numerics::{Real, Vector};

use super::context::{ContactContext, SubStep};
use super::counters::Counters;
use super::force::{ConstantLanes, force, roll};
use super::pair::{DEEP_OVERLAP, insert_in_order, reserve};
use super::search::{CUT_OFF, PlacedCapsule, TOUCH};
use crate::lanes::{Lanes, Lanes3};
use crate::wrench::Wrench;

/// Radius of a plane, which has no curvature, over that of a sphere at it: the effective radius is the sphere's own.
pub(crate) const FLAT: Real = 1e9;

/// A grain near a wall.
#[derive(Clone, Copy, Debug)]
pub(crate) struct WallPair {
    pub grain: u32,
    pub wall: u32,
    pub law: u32,
    pub factor: Real,
    /// See [`super::pair::give`].
    pub give: f32,
    /// Sum of the travels of grain and wall until which the pair is skipped \[m].
    pub skip_until: Real,
}

/// A sphere that touches a wall.
#[derive(Clone, Copy, Debug)]
pub(crate) struct WallContact {
    pub pair: u32,
    pub a: u16,
    pub deep: bool,
    pub d_t: Vector,
    pub turn: Vector,
}

/// Pairs and contacts of a block's grains with walls.
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

    /// Contacts of grain `g`.
    pub fn contacts_of(&self, g: usize) -> impl Iterator<Item = &WallContact> {
        let grain = |c: &WallContact| self.pairs[c.pair as usize].grain as usize;
        let start = self.contacts.partition_point(|c| grain(c) < g);
        self.contacts[start..].iter().take_while(move |c| grain(c) == g)
    }

    /// See [`super::block::Block::reserve`]; a grain touches a wall with some spheres.
    pub fn reserve(&mut self) {
        let room = 4 * self.pairs.len();
        reserve(&mut self.contacts, room);
        reserve(&mut self.merged, room);
        reserve(&mut self.found, room);
        reserve(&mut self.actions, self.pairs.len());
    }

    /// Forces between walls and the grains of the block that starts at grain `first`.
    pub fn step(&mut self, step: &SubStep<'_>, first: usize, touches: &mut [bool], counters: &mut Counters) {
        let SubStep { context, ids, .. } = *step;
        self.actions.clear();
        if self.pairs.is_empty() {
            return;
        }
        self.check_skins(context);
        let (mut at, mut kept) = (0, 0);
        while at < self.contacts.len() {
            let p = self.contacts[at].pair;
            let pair = self.pairs[p as usize];
            // Spheres that act, and those of them that touch: with a film not all do.
            let (mut count, mut touching) = (0, 0);
            let mut total = Wrench::default();
            while at < self.contacts.len() && self.contacts[at].pair == p {
                let mut contact = self.contacts[at];
                at += 1;
                let Some((action, overlap, fraction)) = touch(step, &pair, &mut contact) else {
                    let skip_until = &mut self.pairs[p as usize].skip_until;
                    let travel = context.travel[pair.grain as usize] + context.wall_travel[pair.wall as usize];
                    *skip_until = skip_until.min(travel);
                    continue;
                };
                contact.deep &= overlap > 0.0;
                if fraction > DEEP_OVERLAP && !contact.deep {
                    contact.deep = true;
                    counters.deepened += 1;
                }
                if fraction > counters.deepest {
                    counters.deepest = fraction;
                    counters.deepest_ids = [ids[pair.grain as usize], crate::WALL + u64::from(pair.wall)];
                    counters.deepest_at = context.poses[pair.grain as usize].unwrapped;
                }
                self.contacts[kept] = contact;
                kept += 1;
                count += 1;
                touching += usize::from(overlap > 0.0);
                total += action;
            }
            if count == 0 {
                continue;
            }
            touches[pair.grain as usize - first] |= touching > 0;
            counters.contacts += touching;
            counters.pairs += usize::from(touching > 0);
            counters.on_walls -= total.force;
            counters.by_walls += total.force.dot(context.walls[pair.wall as usize].velocity);
            match self.actions.last_mut() {
                Some((grain, sum)) if *grain == pair.grain => *sum += total,
                _ => self.actions.push((pair.grain, total)),
            }
        }
        self.contacts.truncate(kept);
    }

    fn check_skins(&mut self, context: &ContactContext<'_>) {
        self.found.clear();
        for (p, pair) in self.pairs.iter_mut().enumerate() {
            let travel = context.travel[pair.grain as usize] + context.wall_travel[pair.wall as usize];
            if travel < pair.skip_until {
                continue;
            }
            let p = p as u32;
            let known = |a: u16| {
                let start = self.contacts.partition_point(|c| c.pair < p);
                self.contacts[start..].iter().take_while(|c| c.pair == p).any(|c| c.a == a)
            };
            let pose = &context.poses[pair.grain as usize];
            let body = &context.bodies[pose.body as usize];
            let wall = &context.walls[pair.wall as usize];
            let size = body.bounding_radius * pose.scale;
            let near = TOUCH * size + context.reach.of(size);
            let cut_off = (CUT_OFF * size).max(2.0 * near);
            let height = wall.distance(pose.unwrapped);
            let rotation = &context.rotations[pair.grain as usize];
            let capsule = PlacedCapsule::new(&body.capsule, rotation, pose.scale);
            let mut gap = match wall.edges {
                None => height + capsule.start.dot(wall.normal).min(capsule.end.dot(wall.normal)) - capsule.radius,
                Some(_) => height - size,
            };
            if gap < cut_off {
                gap = cut_off;
                let normal = rotation.transpose() * wall.normal;
                for (a, (centre, radius)) in body.centres.iter().zip(&body.radii).enumerate() {
                    let distance = match wall.edges {
                        None => height + (centre.dot(normal) - radius) * pose.scale,
                        Some(_) => {
                            wall.facing(pose.unwrapped, *rotation * *centre * pose.scale).0 - radius * pose.scale
                        }
                    };
                    if distance >= near {
                        gap = gap.min(distance);
                    } else if !known(a as u16) {
                        self.found.push(WallContact {
                            pair: p,
                            a: a as u16,
                            deep: false,
                            d_t: Vector::ZERO,
                            turn: Vector::ZERO,
                        });
                    }
                }
            }
            pair.skip_until = travel + (gap - near).max(0.0);
        }
        if !self.found.is_empty() {
            insert_in_order(&mut self.contacts, &self.found, &mut self.merged, |c| (c.pair, c.a));
        }
    }
}

/// Action of a wall on a grain through one sphere, with overlap and overlap over radius; `None` if they are apart and not
/// within a film.
fn touch(step: &SubStep<'_>, pair: &WallPair, contact: &mut WallContact) -> Option<(Wrench, Real, Real)> {
    let SubStep { context, laws, dt, .. } = *step;
    let pose = &context.poses[pair.grain as usize];
    let body = &context.bodies[pose.body as usize];
    let wall = &context.walls[pair.wall as usize];
    let radius = body.radii[contact.a as usize] * pose.scale;
    let to_a = context.rotations[pair.grain as usize] * body.centres[contact.a as usize] * pose.scale;
    let (distance, away) = wall.facing(pose.unwrapped, to_a);
    let overlap = radius - distance;
    if overlap <= -context.reach.of(radius) {
        return None;
    }
    // The wall is body j: the normal points into it.
    let n = -away;
    let arm = to_a + n * (radius - 0.5 * overlap);
    let v_r = wall.velocity - pose.velocity - pose.spin.cross(arm);
    let mut constants: ConstantLanes<1> =
        ConstantLanes::from_fn(|_| (&laws[pair.law as usize], pair.factor, pair.give));
    constants.roll_where(|_| body.is_round());
    let (own, far) = (Lanes::splat(radius), Lanes::splat(FLAT * radius));
    let (h, d_t, h_n) = force::<1, false>(
        &constants,
        Lanes3::splat(n),
        (Lanes::splat(overlap), [own, far], Lanes::splat(context.wetness[pair.grain as usize])),
        Lanes3::splat(v_r),
        Lanes3::splat(contact.d_t),
        dt,
    );
    let spins = [pose.spin, Vector::ZERO].map(Lanes3::splat);
    let (rolling, turn) = roll(&constants, [own, far], h_n, spins, Lanes3::splat(contact.turn), dt);
    (contact.d_t, contact.turn) = (d_t.lane(0), turn.lane(0));
    let force = h.lane(0);
    Some((Wrench { force, torque: arm.cross(force) + rolling.lane(0) }, overlap, overlap / radius))
}
