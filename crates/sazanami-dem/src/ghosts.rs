//! Ghosts: copies of grains of other ranks and periodic images, and the way of grains to new owners.

use std::sync::{Mutex, PoisonError};

use bytemuck::{Pod, Zeroable};
use sazanami_numerics::domain::Domain;
use sazanami_numerics::{Matrix, Quaternion, Real, Vector};

use crate::contact::ContactRecord;
use crate::grain::{GrainRecord, Grains};
use crate::motion::{Frame, Inert};

const GHOSTS: u32 = 300;
const POSES: u32 = 301;
const BACK: u32 = 302;
const GRAINS: u32 = 303;
const CONTACTS: u32 = 304;
const SHARED: u32 = 305;

/// What a ghost needs in every sub-step.
#[derive(Debug, Clone, Copy, Pod, Zeroable)]
#[repr(C)]
struct PoseRecord {
    home: [Real; 3],
    orientation: [Real; 4],
    velocity: [Real; 3],
    angular_momentum: [Real; 3],
    last_contact: Real,
    budget: Real,
}

/// Where a rank's grains are: the same for all ranks after a gather.
#[derive(Debug, Clone, Copy, Pod, Zeroable)]
#[repr(C)]
struct Extent {
    lower: [Real; 3],
    upper: [Real; 3],
    /// Largest bounding radius plus reach [m].
    size: Real,
}

/// A copy that this rank sends.
#[derive(Clone, Copy, Debug)]
struct Sent {
    grain: u32,
    image: [i32; 2],
}

/// Ghosts exchanged with one rank.
#[derive(Clone, Debug, Default)]
struct Link {
    rank: usize,
    outgoing: Vec<Sent>,
    /// Ghosts received from it: first and number.
    incoming: (usize, usize),
}

/// What follows from where grains are and how they move.
pub(crate) struct Poses<'a> {
    pub frames: &'a mut [Frame],
    pub rotations: &'a mut [Matrix],
    pub budget: &'a mut [Real],
    pub inert: &'a [Inert],
}

impl Poses<'_> {
    /// An image has the frame of its grain: both count from where the grain is without wrapping.
    fn copy(&mut self, grain: usize, image: usize) {
        self.frames[image] = self.frames[grain];
        self.budget[image] = self.budget[grain];
        if !self.inert[grain].ball {
            self.rotations[image] = self.rotations[grain];
        }
    }
}

/// Who sends which grains to whom.
#[derive(Debug, Default)]
pub(crate) struct Exchange {
    links: Vec<Link>,
    /// Images of own grains on this rank, in order: `(image relative to the grain's, grain, ghost)`.
    selves: Vec<([i32; 2], u32, u32)>,
    /// Those of these that can come to touch, `(grain, ghost)`: the others need not be known in every sub-step.
    near: Vec<(u32, u32)>,
    bytes: Vec<u8>,
    records: Vec<GrainRecord>,
    poses: Vec<PoseRecord>,
    scratch: Mutex<(Vec<u8>, Vec<Real>)>,
    extents: Vec<Extent>,
    gathered: Vec<Vec<u8>>,
    own: Vec<Sent>,
}

/// Extent of the box in the periodic directions, else 0 [m].
pub(crate) fn period(domain: &Domain) -> Vector {
    let extent = domain.grid().extent();
    let of = |d: usize| if domain.periodic()[d] { extent[d] } else { 0.0 };
    Vector::new(of(0), of(1), 0.0)
}

/// The periodic image of a grain at `home` [m] that lies in the box.
pub(crate) fn image_within(domain: &Domain, home: [Real; 3]) -> [i32; 2] {
    let (lower, period) = (domain.grid().lower, period(domain));
    std::array::from_fn(|d| if period[d] > 0.0 { -((home[d] - lower[d]) / period[d]).floor() as i32 } else { 0 })
}

/// Distance of `point` from the box `lower..upper` [m].
fn distance(point: Vector, lower: Vector, upper: Vector) -> Real {
    (lower - point).max(point - upper).max(Vector::ZERO).length()
}

/// Relative periodic images to be considered, in ascending order.
fn images(domain: &Domain) -> impl Iterator<Item = [i32; 2]> {
    let range = |d: usize| if domain.periodic()[d] { -1..=1 } else { 0..=0 };
    let second = range(1);
    range(0).flat_map(move |a| second.clone().map(move |b| [a, b]))
}

impl Exchange {
    /// Chooses and exchanges ghosts. `size[g]` is the bounding radius plus reach of own grain `g`;
    /// every grain whose surface may come within `margin` of a rank's part becomes known there.
    pub fn renew(&mut self, domain: &Domain, grains: &mut Grains, size: &[Real], reach: &mut Vec<Real>, margin: Real) {
        let owned = grains.owned;
        grains.truncate(owned);
        reach.truncate(owned);
        self.links.clear();
        self.selves.clear();
        self.near.clear();
        let communicator = domain.communicator();
        let me = communicator.rank();
        let period = period(domain);
        self.gather_extents(domain, grains, size);
        let extents = &self.extents[..];
        let widest = extents.iter().map(|e| e.size).fold(0.0, Real::max);
        let need = margin.max(widest);
        // What a rank must know about: its part and all its grains.
        let zone = |rank: usize| {
            let (lower, upper) = domain.rank_box(rank);
            let e = &extents[rank];
            (lower.min(Vector::from_array(e.lower)), upper.max(Vector::from_array(e.upper)))
        };
        let shift = |image: [i32; 2]| Vector::new(Real::from(image[0]), Real::from(image[1]), 0.0) * period;
        let sends = |from: usize, to: usize| {
            let (lower, upper) = zone(to);
            let e = &extents[from];
            e.size > 0.0
                && images(domain).any(|image| {
                    let (a, b) =
                        (Vector::from_array(e.lower) + shift(image), Vector::from_array(e.upper) + shift(image));
                    (lower - b).max(a - upper).max_element() < need + e.size
                })
        };
        let away = |position: Vector, lower: Vector, upper: Vector| {
            // Heights do not matter to whom a cell belongs, nor to whom a grain is sent.
            distance(position.with_z(position.z.clamp(lower.z, upper.z)), lower, upper)
        };
        let wanted = |rank: usize, image: [i32; 2]| {
            let (lower, upper) = zone(rank);
            let positions = &grains.position[..owned];
            (0..owned).filter(move |&g| away(positions[g] + shift(image), lower, upper) < size[g] + need)
        };
        for rank in (0..communicator.size()).filter(|&r| r != me) {
            let (to, from) = (sends(me, rank), sends(rank, me));
            if !to && !from {
                continue;
            }
            let mut link = Link { rank, ..Link::default() };
            if to {
                for image in images(domain) {
                    link.outgoing.extend(wanted(rank, image).map(|g| Sent { grain: g as u32, image }));
                }
                self.records.clear();
                self.records.extend(link.outgoing.iter().map(|c| copy(grains, *c, reach)));
                communicator.send(rank, GHOSTS, bytemuck::cast_slice(&self.records));
            }
            link.incoming.1 = usize::from(from);
            self.links.push(link);
        }
        let others = images(domain).filter(|&image| image != [0; 2]);
        self.own.clear();
        self.own.extend(others.flat_map(|image| wanted(me, image).map(move |g| Sent { grain: g as u32, image })));
        let (lower, upper) = zone(me);
        for &c in &self.own {
            let g = c.grain as usize;
            if away(grains.position[g] + shift(c.image), lower, upper) < size[g] + widest {
                self.near.push((c.grain, grains.len() as u32));
            }
            self.selves.push((c.image, c.grain, grains.len() as u32));
            let record = copy(grains, c, reach);
            grains.push(&record, period);
            reach.push(record.reach);
        }
        for link in &mut self.links {
            let expected = link.incoming.1 > 0;
            link.incoming = (grains.len(), 0);
            if expected {
                communicator.receive(link.rank, GHOSTS, &mut self.bytes);
                for record in self.bytes.chunks_exact(size_of::<GrainRecord>()).map(bytemuck::pod_read_unaligned) {
                    grains.push(&record, period);
                    reach.push(record.reach);
                }
                link.incoming.1 = grains.len() - link.incoming.0;
            }
        }
    }

    fn gather_extents(&mut self, domain: &Domain, grains: &Grains, size: &[Real]) {
        let positions = &grains.position[..grains.owned];
        let mine = Extent {
            lower: positions.iter().copied().fold(Vector::INFINITY, Vector::min).to_array(),
            upper: positions.iter().copied().fold(Vector::NEG_INFINITY, Vector::max).to_array(),
            size: size.iter().copied().fold(0.0, Real::max),
        };
        domain.communicator().all_gather(bytemuck::bytes_of(&mine), &mut self.gathered);
        self.extents.clear();
        self.extents.extend(self.gathered.iter().map(|bytes| bytemuck::pod_read_unaligned::<Extent>(bytes)));
    }

    /// Sends the poses of own grains to where they are ghosts, with `all` also to images that cannot come to touch; else
    /// images on this rank learn only what contacts look at.
    pub fn refresh(&mut self, domain: &Domain, grains: &mut Grains, poses: &mut Poses<'_>, all: bool) {
        let communicator = domain.communicator();
        for link in self.links.iter().filter(|l| !l.outgoing.is_empty()) {
            self.poses.clear();
            self.poses.extend(link.outgoing.iter().map(|c| pose(grains, poses.budget, c.grain as usize)));
            communicator.send(link.rank, POSES, bytemuck::cast_slice(&self.poses));
        }
        if all {
            for &(_, grain, ghost) in &self.selves {
                let record = pose(grains, poses.budget, grain as usize);
                put_pose(grains, poses.budget, ghost as usize, &record);
                poses.copy(grain as usize, ghost as usize);
            }
        } else {
            self.near.iter().for_each(|&(grain, ghost)| poses.copy(grain as usize, ghost as usize));
        }
        for link in self.links.iter().filter(|l| l.incoming.1 > 0) {
            communicator.receive(link.rank, POSES, &mut self.bytes);
            for (n, bytes) in self.bytes.chunks_exact(size_of::<PoseRecord>()).enumerate() {
                let ghost = link.incoming.0 + n;
                put_pose(grains, poses.budget, ghost, &bytemuck::pod_read_unaligned(bytes));
                poses.rotations[ghost] = poses.frames[ghost].follow(grains, ghost, &poses.inert[ghost]);
            }
        }
    }

    /// Lets own grains that have left the box of a single rank stand for their image in it: each changes places with its
    /// ghost there. Lists stay as they are, since they count from where grains are without wrapping. Tells whether all
    /// grains that left had such a ghost.
    pub fn return_to_box(&mut self, domain: &Domain, grains: &mut Grains) -> bool {
        let mut turned = false;
        for own in 0..grains.owned {
            let image = image_within(domain, grains.home[own].to_array());
            if grains.image[own] == image {
                continue;
            }
            let mine = |s: &&([i32; 2], u32, u32)| s.1 as usize == own;
            let Some(&(_, _, ghost)) = self.selves.iter().filter(mine).find(|s| grains.image[s.2 as usize] == image)
            else {
                return false;
            };
            grains.image.swap(own, ghost as usize);
            grains.position.swap(own, ghost as usize);
            for (relative, _, ghost) in self.selves.iter_mut().filter(|s| s.1 as usize == own) {
                let there = grains.image[*ghost as usize];
                *relative = [there[0] - image[0], there[1] - image[1]];
            }
            turned = true;
        }
        if turned {
            // In the order of images again, as after a renewal.
            self.selves.sort_unstable();
        }
        true
    }

    /// See [`crate::Engine::share_with_ghosts`].
    pub fn share<const N: usize>(&self, domain: &Domain, values: &mut [[Real; N]]) {
        let communicator = domain.communicator();
        let mut scratch = self.scratch.lock().unwrap_or_else(PoisonError::into_inner);
        let (bytes, row) = &mut *scratch;
        for link in self.links.iter().filter(|l| !l.outgoing.is_empty()) {
            row.clear();
            row.extend(link.outgoing.iter().flat_map(|c| values[c.grain as usize]));
            communicator.send(link.rank, SHARED, bytemuck::cast_slice(row));
        }
        for &(_, grain, ghost) in &self.selves {
            values[ghost as usize] = values[grain as usize];
        }
        for link in self.links.iter().filter(|l| l.incoming.1 > 0) {
            communicator.receive(link.rank, SHARED, bytes);
            let ghosts = &mut values[link.incoming.0..link.incoming.0 + link.incoming.1];
            for (ghost, bytes) in ghosts.iter_mut().zip(bytes.chunks_exact(N * size_of::<Real>())) {
                *ghost = std::array::from_fn(|n| bytemuck::pod_read_unaligned(&bytes[8 * n..8 * n + 8]));
            }
        }
    }

    /// See [`crate::Engine::gather_to_owners`].
    pub fn gather<const N: usize>(&self, domain: &Domain, owned: usize, partial: &mut [[Real; N]]) {
        if self.links.is_empty() && self.selves.is_empty() {
            return;
        }
        let communicator = domain.communicator();
        let mut scratch = self.scratch.lock().unwrap_or_else(PoisonError::into_inner);
        let (bytes, totals) = &mut *scratch;
        for link in self.links.iter().filter(|l| l.incoming.1 > 0) {
            let ghosts = &partial[link.incoming.0..link.incoming.0 + link.incoming.1];
            communicator.send(link.rank, BACK, bytemuck::cast_slice(ghosts.as_flattened()));
        }
        totals.clear();
        totals.resize(owned * N, 0.0);
        let mut add = |grain: usize, values: &[Real]| {
            totals[grain * N..(grain + 1) * N].iter_mut().zip(values).for_each(|(t, v)| *t += v);
        };
        // In the order of ranks and images, whoever owns the grain: the sum does not change with the owner.
        let me = communicator.rank();
        let mut own_added = false;
        let add_own = |add: &mut dyn FnMut(usize, &[Real])| {
            let selves = |before: bool| self.selves.iter().filter(move |s| (s.0 < [0; 2]) == before);
            selves(true).for_each(|s| add(s.1 as usize, &partial[s.2 as usize]));
            (0..owned).for_each(|g| add(g, &partial[g]));
            selves(false).for_each(|s| add(s.1 as usize, &partial[s.2 as usize]));
        };
        for link in &self.links {
            if link.rank > me && !own_added {
                add_own(&mut add);
                own_added = true;
            }
            if !link.outgoing.is_empty() {
                communicator.receive(link.rank, BACK, bytes);
                for (copy, values) in link.outgoing.iter().zip(bytes.chunks_exact(N * size_of::<Real>())) {
                    let values: [Real; N] =
                        std::array::from_fn(|n| bytemuck::pod_read_unaligned(&values[8 * n..8 * n + 8]));
                    add(copy.grain as usize, &values);
                }
            }
        }
        if !own_added {
            add_own(&mut add);
        }
        partial[..owned].as_flattened_mut().copy_from_slice(totals);
    }
}

/// Hands grains whose centre lies in another rank's part to it, with the contacts they remember.
/// `records` are the contacts of this rank, by key; afterwards they include those that came.
pub(crate) fn migrate(domain: &Domain, grains: &mut Grains, records: &mut Vec<ContactRecord>) {
    let period = period(domain);
    grains.truncate(grains.owned);
    for g in 0..grains.owned {
        grains.image[g] = image_within(domain, grains.home[g].to_array());
        grains.position[g] = crate::grain::imaged(grains.home[g], grains.image[g], period);
    }
    let communicator = domain.communicator();
    if communicator.size() == 1 {
        return;
    }
    let me = communicator.rank();
    let destination: Vec<usize> = grains.position.iter().map(|&p| domain.owner_of(p)).collect();
    for rank in (0..communicator.size()).filter(|&r| r != me) {
        let leaving: Vec<usize> = (0..grains.owned).filter(|&g| destination[g] == rank).collect();
        let ids: Vec<u64> = leaving.iter().map(|&g| grains.id[g]).collect();
        let moves = |id: u64| ids.binary_search(&id).is_ok();
        let states: Vec<GrainRecord> = leaving.iter().map(|&g| grains.record(g)).collect();
        let contacts: Vec<ContactRecord> = if ids.is_empty() {
            Vec::new()
        } else {
            records.iter().filter(|r| moves(r.low) || moves(r.high)).copied().collect()
        };
        communicator.send(rank, GRAINS, bytemuck::cast_slice(&states));
        communicator.send(rank, CONTACTS, bytemuck::cast_slice(&contacts));
    }
    let mut states: Vec<GrainRecord> =
        (0..grains.owned).filter(|&g| destination[g] == me).map(|g| grains.record(g)).collect();
    let mut bytes = Vec::new();
    for rank in (0..communicator.size()).filter(|&r| r != me) {
        communicator.receive(rank, GRAINS, &mut bytes);
        states.extend(bytes.chunks_exact(size_of::<GrainRecord>()).map(bytemuck::pod_read_unaligned::<GrainRecord>));
        communicator.receive(rank, CONTACTS, &mut bytes);
        let arrived = bytes.chunks_exact(size_of::<ContactRecord>());
        records.extend(arrived.map(bytemuck::pod_read_unaligned::<ContactRecord>));
    }
    states.sort_unstable_by_key(|s| s.id);
    grains.clear();
    states.iter().for_each(|s| grains.push(s, period));
    grains.owned = states.len();
    records.sort_unstable_by_key(ContactRecord::key);
    records.dedup_by_key(|r| r.key());
}

fn copy(grains: &Grains, c: Sent, reach: &[Real]) -> GrainRecord {
    let g = c.grain as usize;
    let mut record = grains.record(g);
    record.image = [grains.image[g][0] + c.image[0], grains.image[g][1] + c.image[1]];
    record.reach = reach[g];
    record
}

fn pose(grains: &Grains, budget: &[Real], g: usize) -> PoseRecord {
    PoseRecord {
        home: grains.home[g].to_array(),
        orientation: grains.orientation[g].to_array(),
        velocity: grains.velocity[g].to_array(),
        angular_momentum: grains.angular_momentum[g].to_array(),
        last_contact: grains.last_contact[g],
        budget: budget[g],
    }
}

fn put_pose(grains: &mut Grains, budget: &mut [Real], g: usize, record: &PoseRecord) {
    grains.home[g] = Vector::from_array(record.home);
    grains.orientation[g] = Quaternion::from_array(record.orientation);
    grains.velocity[g] = Vector::from_array(record.velocity);
    grains.angular_momentum[g] = Vector::from_array(record.angular_momentum);
    grains.last_contact[g] = record.last_contact;
    budget[g] = record.budget;
}
