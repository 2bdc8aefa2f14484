//! Pairs of a block that are due, and the gaps of their spheres.
//!
//! Thousands of pairs are due in a sub-step of a bed that flows, each with its grains elsewhere in memory. So all are
//! posed first, then all measured, then judged: the loops before the last have no branches that wait for what they load.

use sazanami_numerics::{Matrix, Real, Vector};

use super::Block;
use crate::contact::context::ContactContext;
use crate::contact::pair::{Contact, insert_in_order};
use crate::contact::search::{CUT_OFF, NEAREST, TOUCH};
use crate::lanes::{Lanes, Lanes3};

/// Two grains whose gap may have closed.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Approach {
    pair: u32,
    ends: [u32; 2],
    /// From the first grain to the second \[m].
    offset: Vector,
    /// Sum of the two travels \[m].
    sum: Real,
    /// Smaller bounding radius \[m].
    size: Real,
    /// Gaps of the nearest spheres stored with the pair \[m].
    gaps: [Real; NEAREST],
}

/// Pairs measured together.
const BATCH: usize = 8;

/// Centres relative to the grain's centre of mass, in the laboratory frame, and radii of contact spheres of a grain.
#[inline(always)]
fn placed(
    context: &ContactContext<'_>,
    grain: u32,
    rotation: &Matrix,
    spheres: [u16; NEAREST],
) -> (Lanes3<NEAREST>, Lanes<NEAREST>) {
    let pose = &context.poses[grain as usize];
    let of_body = &context.spheres[pose.spheres as usize..];
    let sphere = spheres.map(|number| &of_body[usize::from(number)]);
    let component = |d: usize| Lanes::from_fn(|l| sphere[l][d]);
    let column = |d: usize| Lanes3::splat(rotation.col(d));
    let centre = column(0) * component(0) + column(1) * component(1) + column(2) * component(2);
    let scale = Lanes::<NEAREST>::splat(pose.scale);
    (centre * scale, component(3) * scale)
}

impl Block {
    /// Searches the pairs that are due. Returns the number of rows that were not skipped.
    pub(super) fn check_skins(&mut self, context: &ContactContext<'_>) -> usize {
        let checked = self.collect_due(context);
        if self.due.is_empty() {
            return checked;
        }
        self.pose(context);
        if !context.balls {
            self.measure(context);
        }
        self.found.clear();
        for n in 0..self.due.len() {
            let approach = self.due[n];
            self.search(context, &approach);
            self.lower_row_limit(context, approach.pair);
        }
        self.insert_found();
        checked
    }

    fn collect_due(&mut self, context: &ContactContext<'_>) -> usize {
        let mut checked = 0;
        self.due.clear();
        let mine = &context.travel[self.first..];
        let rows = self.starts.windows(2).zip(&self.row_paces).zip(&mut self.row_skip_until).zip(mine);
        for (((range, pace), row_skip_until), mine) in rows {
            let largest_travel = context.largest_travel[pace.index()];
            if mine + largest_travel < *row_skip_until {
                continue;
            }
            checked += 1;
            let pairs = range[0] as usize..range[1] as usize;
            let mut least = Real::INFINITY;
            for (pair, (high, skip_until)) in
                (range[0]..).zip(self.high[pairs.clone()].iter().zip(&self.skip_until[pairs]))
            {
                let other = context.travel[*high as usize];
                if mine + other >= *skip_until {
                    self.due.push(Approach { pair, ..Approach::default() });
                } else {
                    least = least.min(skip_until - other);
                }
            }
            *row_skip_until = least + largest_travel;
        }
        checked
    }

    /// Sets the relative positions of the grains of the pairs that are due.
    fn pose(&mut self, context: &ContactContext<'_>) {
        for approach in &mut self.due {
            let pair = &self.pairs[approach.pair as usize];
            approach.ends = [pair.low, pair.high];
            let poses = approach.ends.map(|g| &context.poses[g as usize]);
            approach.offset = poses[1].unwrapped - poses[0].unwrapped + pair.shift(context.period);
            let sizes = poses.map(|f| context.bodies[f.body as usize].bounding_radius * f.scale);
            approach.size = sizes[0].min(sizes[1]);
            let [low, high] = approach.ends.map(|g| context.travel[g as usize]);
            approach.sum = low + high;
        }
    }

    /// Gaps of the nearest spheres stored with the pairs that are due; beyond their number of no meaning.
    fn measure(&mut self, context: &ContactContext<'_>) {
        for batch in self.due.chunks_mut(BATCH) {
            // Read first, so that many of these scattered reads are in flight at once.
            let mut read = [([(0, 0); NEAREST], [Matrix::ZERO; 2]); BATCH];
            for ((spheres, rotations), approach) in read.iter_mut().zip(&*batch) {
                *spheres = self.nearest[approach.pair as usize].spheres;
                *rotations = approach.ends.map(|grain| context.rotations[grain as usize]);
            }
            for ((spheres, rotations), approach) in read.iter().zip(batch) {
                let p = placed(context, approach.ends[0], &rotations[0], spheres.map(|(a, _)| a));
                let q = placed(context, approach.ends[1], &rotations[1], spheres.map(|(_, b)| b));
                let line = Lanes3::splat(approach.offset) + q.0 - p.0;
                approach.gaps = (line.dot(line).sqrt() - (p.1 + q.1)).0;
            }
        }
    }

    /// Limits the skipping of a row to that of its pair `p`.
    pub(super) fn lower_row_limit(&mut self, context: &ContactContext<'_>, p: u32) {
        let pair = &self.pairs[p as usize];
        let row = pair.low as usize - self.first;
        let largest_travel = context.largest_travel[self.row_paces[row].index()];
        let skip_until = self.skip_until[p as usize] - context.travel[pair.high as usize] + largest_travel;
        self.row_skip_until[row] = self.row_skip_until[row].min(skip_until);
    }

    /// Judges a pair that is due by the sphere pairs stored with it, or if that is not enough measures all.
    fn search(&mut self, context: &ContactContext<'_>, approach: &Approach) {
        let &Approach { pair: p, ends, offset, sum, size, .. } = approach;
        let pair = &self.pairs[p as usize];
        // Balls alone have films.
        let touch = TOUCH * size + context.reach.of(size);
        let start = if pair.touching { pair.contacts as usize } else { self.contacts.len() };
        let mine = self.contacts[start..].iter().take_while(|c| c.pair == p);
        let known = |spheres: (u16, u16)| mine.clone().any(|c| (c.a, c.b) == spheres);
        let nearest = &mut self.nearest[p as usize];
        let new = |(a, b): (u16, u16)| Contact { pair: p, a, b, deep: false, d_t: Vector::ZERO, turn: Vector::ZERO };
        let ends = ends.map(|g| g as usize);
        let radii = ends.map(|g| context.poses[g].radius);
        if radii.iter().all(|&radius| radius > 0.0) {
            // Balls have one sphere each. While they touch they need no check; see `part`.
            let gap = offset.length() - (radii[0] + radii[1]);
            self.skip_until[p as usize] = if gap < touch { Real::INFINITY } else { sum + (gap - touch) };
            if gap < touch && !pair.touching {
                self.found.push(new((0, 0)));
            }
        } else if sum < nearest.rest {
            let mut skip_until = nearest.rest;
            for (&spheres, gap) in nearest.spheres[..nearest.count as usize].iter().zip(approach.gaps) {
                if known(spheres) {
                    continue;
                }
                if gap < touch {
                    self.found.push(new(spheres))
                } else {
                    skip_until = skip_until.min(sum + (gap - touch))
                }
            }
            self.skip_until[p as usize] = skip_until;
        } else {
            let ends = ends.map(|g| {
                let pose = &context.poses[g];
                let body = pose.body as usize;
                (&context.bodies[body], &context.arrays[body], &context.rotations[g], pose.scale)
            });
            let gap = self.near.find(ends, offset, CUT_OFF * size, touch);
            self.skip_until[p as usize] = sum + (gap - touch).max(0.0);
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
        insert_in_order(&mut self.contacts, &self.found, &mut self.merged, Contact::key);
    }
}
