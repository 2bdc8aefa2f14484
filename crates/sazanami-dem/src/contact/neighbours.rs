//! The list of neighbouring grains, and how the state of pairs and contacts passes from one list to the next.

use sazanami_numerics::particles::BinIndex;
use sazanami_numerics::{Real, Vector};
use sazanami_parallel::{for_each_chunk, reduce_over};

use super::block::{Block, Held};
use super::context::ContactContext;
use super::laws::Interactions;
use super::pace::Pace;
use super::pair::{Contact, Pair, give};
use super::record::ContactRecord;
use super::search::{NearestSpheres, PlacedCapsule};
use super::walls::{WallContact, WallPair};
use crate::grain::{Grains, Motion, ROWS};

/// Capsule and bounding box of a grain for the list.
#[derive(Clone, Copy, Debug, Default)]
struct Bound {
    capsule: PlacedCapsule,
    /// Half extents of the capsule's box about `middle`, skin included \[m].
    half: Vector,
    /// Centre of the capsule's box \[m].
    middle: Vector,
    skin: Real,
    mobile: bool,
}

/// The previous list, from which bounds of skipped pairs are taken over.
pub(crate) struct Previous<'a> {
    pub blocks: &'a [Block],
    pub travel: &'a [Real],
    pub wall_travel: &'a [Real],
    /// Former number of each grain and ghost; `u32::MAX`: new on this rank.
    pub number: &'a [u32],
}

/// Grains, laws and contact history from which a list is built.
#[derive(Clone, Copy)]
pub(crate) struct ListInput<'a> {
    pub grains: &'a Grains,
    pub interactions: &'a Interactions,
    /// Contacts to be taken over, by key.
    pub records: &'a [ContactRecord],
    /// The entry that contacts read for each grain and ghost: images on this rank share that of their grain.
    pub originals: &'a [u32],
    /// Pace of each grain and ghost.
    pub paces: &'a [Pace],
}

/// Work space for building lists.
#[derive(Clone, Debug, Default)]
pub(crate) struct ListBuilder {
    bounds: Vec<Bound>,
    /// Grains by size, the largest first: bins for grains of all sizes would be as wide as the largest, and hold too many small ones.
    levels: Vec<Level>,
}

/// Grains whose half extents lie within a factor of two, and the bins in which they are found.
#[derive(Clone, Debug, Default)]
struct Level {
    members: Vec<u32>,
    centres: Vec<Vector>,
    bins: BinIndex,
    /// Largest half extents of its grains, skin included \[m].
    largest: Vector,
}

/// Most levels: sizes of 1 to 128 have their own, smaller ones share the last.
const LEVELS: usize = 8;

impl ListBuilder {
    /// Fills `blocks` with all pairs nearer than the sum of their skins.
    pub fn build(
        &mut self,
        context: &ContactContext<'_>,
        input: ListInput<'_>,
        previous: Option<&Previous<'_>>,
        blocks: &mut Vec<Block>,
    ) {
        let grains = input.grains;
        let count = grains.len();
        blocks.resize_with(count.div_ceil(ROWS), Block::default);
        self.bounds.resize(count, Bound::default());
        for_each_chunk(&mut self.bounds[..], ROWS, |number, bounds| {
            for (n, b) in bounds.iter_mut().enumerate() {
                let g = number * ROWS + n;
                let pose = &context.poses[g];
                let margin = input.interactions.margin(&context.bodies[pose.body as usize], pose.scale);
                *b = bound(context, grains, grains.skin[g] + margin, g);
            }
        });
        self.sort_by_size();
        let (levels, bounds) = (&self.levels[..], &self.bounds[..]);
        for_each_chunk(&mut blocks[..], 1, |number, block| {
            let first = number * ROWS;
            fill(&mut block[0], first..(first + ROWS).min(count), context, input, previous, (levels, bounds));
        });
    }

    fn sort_by_size(&mut self) {
        let bounds = &self.bounds[..];
        let half = |g: usize| bounds[g].half.max_element();
        let largest = reduce_over(bounds.len(), half, Real::max).unwrap_or(0.0).max(Real::MIN_POSITIVE);
        self.levels.resize_with(LEVELS, Level::default);
        for level in &mut self.levels {
            level.members.clear();
            level.centres.clear();
            level.largest = Vector::ZERO;
        }
        for (g, b) in bounds.iter().enumerate() {
            let halvings = (largest / b.half.max_element()).log2() as usize;
            let level = &mut self.levels[halvings.min(LEVELS - 1)];
            level.members.push(g as u32);
            level.centres.push(b.middle);
            level.largest = level.largest.max(b.half);
        }
        for Level { centres, bins, largest, .. } in self.levels.iter_mut().filter(|level| !level.members.is_empty()) {
            bins.sort(centres, 1.1 * largest.max_element().max(Real::MIN_POSITIVE));
        }
    }
}

fn bound(context: &ContactContext<'_>, grains: &Grains, skin: Real, g: usize) -> Bound {
    let pose = &context.poses[g];
    let mut capsule =
        PlacedCapsule::new(&context.bodies[pose.body as usize].capsule, &context.rotations[g], pose.scale);
    capsule.start += grains.position[g];
    capsule.end += grains.position[g];
    let half = 0.5 * (capsule.end - capsule.start).abs() + Vector::splat(capsule.radius + skin);
    let mobile = grains.motion[g] == Motion::Free;
    Bound { capsule, half, middle: 0.5 * (capsule.start + capsule.end), skin, mobile }
}

fn fill(
    block: &mut Block,
    rows: std::ops::Range<usize>,
    context: &ContactContext<'_>,
    input: ListInput<'_>,
    previous: Option<&Previous<'_>>,
    (levels, bounds): (&[Level], &[Bound]),
) {
    let ListInput { grains, interactions, records, originals, paces } = input;
    block.reset(rows.start, rows.len());
    let mut near = std::mem::take(&mut block.listed);
    for low in rows {
        near.clear();
        // Rows of images on this rank stay empty: the pair is in the row of the grain itself, with an image of the
        // other.
        if originals[low] as usize != low {
            block.end_row(Pace::SLOWEST);
            continue;
        }
        let b = &bounds[low];
        let mut look_at = |h: usize| {
            if grains.id[h] <= grains.id[low] || low >= context.owned && h >= context.owned {
                return;
            }
            let o = &bounds[h];
            let apart = (o.middle - b.middle).abs() - (o.half + b.half);
            if apart.max_element() > 0.0 || !(b.mobile || o.mobile) {
                return;
            }
            let gap = b.capsule.gap(&o.capsule, Vector::ZERO);
            if gap < b.skin + o.skin {
                let (m, n) = (grains.image[low], grains.image[h]);
                near.push((grains.id[h], [0, 1, 2].map(|d| n[d] - m[d]), originals[h], gap));
            }
        };
        for Level { members, bins, largest, .. } in levels.iter().filter(|level| !level.members.is_empty()) {
            let reach = b.half + *largest;
            bins.visit(b.middle - reach, b.middle + reach, |n| look_at(members[n as usize] as usize));
        }
        near.sort_unstable_by_key(|&(id, image, ..)| (id, image));
        let id = grains.id[low];
        let from = records.partition_point(|r| r.low < id);
        let mine = records[from..].iter().take_while(|r| r.low == id);
        let mut pace = Pace::SLOWEST;
        for &(_, image, high, gap) in &near {
            pace = pace.max(paces[high as usize]);
            let p = block.pairs.len() as u32;
            let first = block.contacts.len() as u32;
            let known = mine.clone().filter(|r| r.high == grains.id[high as usize] && r.image == image);
            // Without a film nothing but a bridge acts apart; older checkpoints have such bridges as contacts.
            let film = interactions.film().is_some();
            let apart = film && known.clone().any(|r| r.is(ContactRecord::APART));
            let bridged = known.clone().find(|r| r.is(ContactRecord::BRIDGED));
            block.bridges.extend(bridged.map(|r| Held { pair: p, spheres: (r.a, r.b) }));
            let contacts = known.filter(|r| !r.is(ContactRecord::NO_CONTACT) && (film || !r.is(ContactRecord::APART)));
            block.contacts.extend(contacts.map(|r| Contact {
                pair: p,
                a: r.a,
                b: r.b,
                deep: r.is(ContactRecord::DEEP),
                d_t: Vector::from_array(r.d_t),
                turn: Vector::from_array(r.turn),
            }));
            let touching = block.contacts.last().is_some_and(|c| c.pair == p);
            let mut pair = pair(grains, interactions, [low as u32, high], image, touching);
            (pair.contacts, pair.apart, pair.bridged) = (first, apart, bridged.is_some());
            pair.count = block.contacts.len() as u32 - first;
            let sum = context.travel[low] + context.travel[high as usize];
            let (left, mut nearest) = previous
                .and_then(|old| remaining(old, low, high as usize, image))
                .unwrap_or((Real::NEG_INFINITY, NearestSpheres::default()));
            nearest.rest += sum;
            // Balls alone have films; the radius of others is 0.
            let [a, b] = [low, high as usize].map(|g| context.poses[g].radius);
            let free = gap * (1.0 - 1e-9) - context.reach.of(a.min(b));
            block.push(pair, sum + left.max(free), nearest);
        }
        block.end_row(pace);
        if low < context.owned && bounds[low].mobile {
            add_walls(block, context, input, previous, low, &bounds[low]);
        }
    }
    block.listed = near;
    block.reserve(context.bridge.is_some());
}

fn pair(grains: &Grains, interactions: &Interactions, [low, high]: [u32; 2], image: [i32; 3], touching: bool) -> Pair {
    let (l, h) = (low as usize, high as usize);
    let law = interactions.index(grains.material[l], grains.material[h]);
    // A grain that forces do not move is a wall to the other.
    let inverse = |g: usize| if grains.motion[g] == Motion::Free { 1.0 / grains.mass[g] } else { 0.0 };
    let factor =
        if interactions.laws()[law as usize].damped_by_mass() { (inverse(l) + inverse(h)).recip().sqrt() } else { 1.0 };
    Pair {
        low,
        high,
        factor,
        image: image.map(|n| n as i16),
        law: law as u16,
        touching,
        apart: false,
        bridged: false,
        contacts: 0,
        count: 0,
        give: give([inverse(l), inverse(h)]),
    }
}

/// Travel left until a pair of the previous list is due, if it was listed, and its nearest spheres with the travel left
/// until the others are.
fn remaining(old: &Previous<'_>, low: usize, high: usize, image: [i32; 3]) -> Option<(Real, NearestSpheres)> {
    let (low, high) = (old.number[low], old.number[high]);
    if low == u32::MAX || high == u32::MAX {
        return None;
    }
    let block = &old.blocks[low as usize / ROWS];
    let row = low as usize - block.first;
    let range = block.starts[row] as usize..block.starts[row + 1] as usize;
    // A grain may be near with several of its images.
    let same = |p: &usize| block.high[*p] == high && block.pairs[*p].image.map(i32::from) == image;
    let at = range.into_iter().find(same)?;
    let sum = old.travel[low as usize] + old.travel[high as usize];
    let nearest = block.nearest[at];
    Some((block.skip_until[at] - sum, NearestSpheres { rest: nearest.rest - sum, ..nearest }))
}

fn add_walls(
    block: &mut Block,
    context: &ContactContext<'_>,
    input: ListInput<'_>,
    previous: Option<&Previous<'_>>,
    grain: usize,
    bound: &Bound,
) {
    let ListInput { grains, interactions, records, .. } = input;
    let id = grains.id[grain];
    for (w, wall) in context.walls.iter().enumerate() {
        let capsule = &bound.capsule;
        let height = match wall.edges {
            None => wall.distance(capsule.start).min(wall.distance(capsule.end)) - capsule.radius,
            Some(_) => wall.distance(bound.middle) - 0.5 * (capsule.end - capsule.start).length() - capsule.radius,
        };
        // Walls may move as far as grains before the list expires.
        if height >= 2.0 * bound.skin {
            continue;
        }
        let law = interactions.index(grains.material[grain], wall.material);
        let factor = if interactions.laws()[law as usize].damped_by_mass() { grains.mass[grain].sqrt() } else { 1.0 };
        let p = block.walls.pairs.len() as u32;
        let high = crate::WALL + w as u64;
        let from = records.partition_point(|r| (r.low, r.high) < (id, high));
        let known = records[from..].iter().take_while(|r| (r.low, r.high) == (id, high));
        block.walls.contacts.extend(known.map(|r| WallContact {
            pair: p,
            a: r.a,
            deep: r.is(ContactRecord::DEEP),
            d_t: Vector::from_array(r.d_t),
            turn: Vector::from_array(r.turn),
        }));
        let free = height * (1.0 - 1e-9) - context.reach.of(context.poses[grain].radius);
        let left = previous.and_then(|old| remaining_to_wall(old, grain, w)).unwrap_or(Real::NEG_INFINITY);
        block.walls.pairs.push(WallPair {
            grain: grain as u32,
            wall: w as u32,
            law,
            factor,
            give: give([grains.mass[grain].recip(), 0.0]),
            skip_until: context.travel[grain] + context.wall_travel[w] + left.max(free),
        });
    }
}

fn remaining_to_wall(old: &Previous<'_>, grain: usize, wall: usize) -> Option<Real> {
    let number = old.number[grain];
    let block = old.blocks.get(number as usize / ROWS)?;
    let pair = block.walls.pairs.iter().find(|p| (p.grain, p.wall as usize) == (number, wall))?;
    Some(pair.skip_until - old.travel[number as usize] - old.wall_travel[wall])
}
