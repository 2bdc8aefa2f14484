//! The pull of liquid bridges, one for a pair of grains at most, through their nearest contact spheres.

use sazanami_numerics::{Real, Vector};

use super::Block;
use crate::bridge::{Bridge, moisture_of_pair};
use crate::contact::context::ContactContext;
use crate::contact::counters::Counters;
use crate::contact::pair::Contact;
use crate::contact::search::TOUCH;
use crate::wrench::Wrench;

/// A liquid bridge.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Held {
    /// Pair of grains, within the block.
    pub pair: u32,
    /// Spheres of the two grains that were nearest in the last sub-step.
    pub spheres: (u16, u16),
}

/// How two contact spheres stand.
#[derive(Clone, Copy)]
struct Stand {
    gap: Real,
    /// From the first to the second.
    normal: Vector,
    /// From the centre of mass of each grain to the middle of the gap \[m].
    arms: [Vector; 2],
}

impl Block {
    /// Adds the pull of all bridges to the actions of the contacts. Pairs that touch get one as far as their grains are moist; one breaks
    /// where no spheres of its grains are near enough.
    pub(super) fn act_by_bridges(&mut self, context: &ContactContext<'_>, bridge: &Bridge, counters: &mut Counters) {
        self.form_bridges(context);
        let mut bridges = std::mem::take(&mut self.bridges);
        bridges.retain_mut(|held| self.pull(context, bridge, held, counters));
        self.bridges = bridges;
    }

    /// Gives a bridge to each moist pair that touches and has none.
    fn form_bridges(&mut self, context: &ContactContext<'_>) {
        let known = self.bridges.len();
        for contact in &self.contacts {
            let pair = &mut self.pairs[contact.pair as usize];
            if pair.meets() && !pair.bridged && moisture(context, [pair.low, pair.high]) > 0.0 {
                pair.bridged = true;
                self.bridges.push(Held { pair: contact.pair, spheres: (contact.a, contact.b) });
            }
        }
        if self.bridges.len() > known {
            self.bridges.sort_unstable_by_key(|held| held.pair);
        }
    }

    /// Pulls the grains of a pair together; returns whether its bridge holds.
    fn pull(
        &mut self,
        context: &ContactContext<'_>,
        bridge: &Bridge,
        held: &mut Held,
        counters: &mut Counters,
    ) -> bool {
        let p = held.pair as usize;
        let ends = [self.pairs[p].low, self.pairs[p].high];
        let radii = ends.map(|g| context.volume_radius(g));
        let part = moisture(context, ends);
        let counted = (ends[0] as usize) < context.owned && part > 0.0;
        let longest = bridge.rupture(radii);
        let stand = self.nearest_stand(context, held, longest).filter(|stand| stand.gap <= longest);
        let Some(Stand { gap, normal, arms }) = stand else {
            let pair = &mut self.pairs[p];
            pair.bridged = false;
            if !pair.touching {
                self.changes.push(held.pair);
            }
            counters.ruptures += usize::from(counted);
            return false;
        };
        let force = normal * (part * bridge.force(gap, radii));
        let on_high = Wrench { force: -force, torque: -arms[1].cross(force) };
        if self.pairs[p].touching {
            self.on_high[p] += on_high;
        } else {
            self.on_high[p] = on_high;
        }
        self.own[ends[0] as usize - self.first] += Wrench { force, torque: arms[0].cross(force) };
        if counted {
            counters.bridges += 1;
            counters.bridge_volume += part * bridge.volume(radii);
        }
        true
    }

    /// How the nearest spheres of a pair stand, those of its deepest contact if it touches; `None` if all are farther apart than `longest`.
    fn nearest_stand(&mut self, context: &ContactContext<'_>, held: &mut Held, longest: Real) -> Option<Stand> {
        let pair = self.pairs[held.pair as usize];
        let ends = [pair.low as usize, pair.high as usize];
        let shift = pair.shift(context.period);
        if ends.iter().all(|&g| context.poses[g].radius > 0.0) {
            return Some(stand(context, ends, shift, (0, 0)));
        }
        if pair.touching {
            let start = pair.contacts as usize;
            let contacts = &self.contacts[start..start + pair.count as usize];
            let stands = contacts.iter().map(|&Contact { a, b, .. }| ((a, b), stand(context, ends, shift, (a, b))));
            let (spheres, deepest) = stands.min_by(|x, y| x.1.gap.total_cmp(&y.1.gap))?;
            held.spheres = spheres;
            return Some(deepest);
        }
        let poses = ends.map(|g| &context.poses[g]);
        let size = poses.map(|pose| context.bodies[pose.body as usize].bounding_radius * pose.scale);
        let shapes = ends.map(|g| {
            let pose = &context.poses[g];
            let body = pose.body as usize;
            (&context.bodies[body], &context.arrays[body], &context.rotations[g], pose.scale)
        });
        let offset = poses[1].unwrapped - poses[0].unwrapped + shift;
        self.near.find(shapes, offset, longest * (1.0 + 1e-9), TOUCH * size[0].min(size[1]));
        held.spheres = self.near.closest()?;
        Some(stand(context, ends, shift, held.spheres))
    }
}

/// Part of the pull of its bridge that what is about a pair leaves.
#[inline]
fn moisture(context: &ContactContext<'_>, ends: [u32; 2]) -> Real {
    moisture_of_pair(ends.map(|g| context.moisture[g as usize]))
}

/// How spheres of grains `ends` stand, the second in the image that is `shift` from it.
fn stand(context: &ContactContext<'_>, ends: [usize; 2], shift: Vector, spheres: (u16, u16)) -> Stand {
    let place = |g: usize, number: u16| {
        let pose = &context.poses[g];
        let [x, y, z, radius] = context.spheres[pose.spheres as usize + usize::from(number)];
        (context.rotations[g] * Vector::new(x, y, z) * pose.scale, radius * pose.scale)
    };
    let [(a, a_radius), (b, b_radius)] = [place(ends[0], spheres.0), place(ends[1], spheres.1)];
    let between = context.poses[ends[1]].unwrapped - context.poses[ends[0]].unwrapped + shift;
    let line = between + b - a;
    let distance = line.length();
    let gap = distance - (a_radius + b_radius);
    let normal = line * distance.recip();
    let arm = a + normal * (a_radius + 0.5 * gap);
    Stand { gap, normal, arms: [arm, arm - between] }
}
