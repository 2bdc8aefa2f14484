//! Ghosts (copies of other ranks' grains, and periodic images) and the migration of grains to new owners.

use std::sync::{Mutex, PoisonError};

use bytemuck::{Pod, Zeroable};
use sazanami_numerics::domain::Domain;
use sazanami_numerics::{Matrix, Quaternion, Real, Vector};

use crate::contact::record::ContactRecord;
use crate::grain::{GrainRecord, Grains, image_position};
use crate::motion::{MassProperties, Pose};

const GHOSTS: u32 = 300;
const POSES: u32 = 301;
const BACK: u32 = 302;
const GRAINS: u32 = 303;
const CONTACTS: u32 = 304;
const SHARED: u32 = 305;

/// State of a ghost that changes in every sub-step.
#[derive(Debug, Clone, Copy, Pod, Zeroable)]
#[repr(C)]
struct PoseRecord {
    unwrapped: [Real; 3],
    orientation: [Real; 4],
    velocity: [Real; 3],
    angular_momentum: [Real; 3],
    last_contact: Real,
    travel: Real,
}

/// Bounding box of a rank's grains: the same for all ranks after a gather.
#[derive(Debug, Clone, Copy, Pod, Zeroable)]
#[repr(C)]
struct Extent {
    lower: [Real; 3],
    upper: [Real; 3],
    /// Largest bounding radius plus skin [m].
    size: Real,
}

/// A copy that this rank sends.
#[derive(Clone, Copy, Debug)]
struct GhostSource {
    grain: u32,
    image: [i32; 2],
}

/// An own grain that has left the box of a single rank.
#[derive(Clone, Copy, Debug)]
struct Departed {
    own: u32,
    /// The image of it that lies in the box.
    image: [i32; 2],
    /// The ghost that represents this image; `u32::MAX`: none does.
    ghost: u32,
}

/// Ghosts exchanged with one rank.
#[derive(Clone, Debug, Default)]
struct Link {
    rank: usize,
    outgoing: Vec<GhostSource>,
    /// Ghosts received from it: first and number.
    incoming: (usize, usize),
}

/// State derived from the motion of grains and ghosts, updated with it.
pub(crate) struct PoseState<'a> {
    pub poses: &'a mut [Pose],
    pub rotations: &'a mut [Matrix],
    pub travel: &'a mut [Real],
    pub mass_properties: &'a [MassProperties],
}

/// Who sends which grains to whom.
#[derive(Debug, Default)]
pub(crate) struct Exchange {
    links: Vec<Link>,
    /// Images of own grains on this rank, in order: `(image relative to the grain's, grain, ghost)`.
    self_images: Vec<([i32; 2], u32, u32)>,
    bytes: Vec<u8>,
    records: Vec<GrainRecord>,
    pose_records: Vec<PoseRecord>,
    scratch: Mutex<(Vec<u8>, Vec<Real>)>,
    extents: Vec<Extent>,
    gathered: Vec<Vec<u8>>,
    own: Vec<GhostSource>,
    departed: Vec<Departed>,
    /// New owner of each own grain.
    owners: Vec<usize>,
    /// Identifiers of the grains that migrate to one rank, and the history of their contacts.
    leaving: Vec<u64>,
    contacts: Vec<ContactRecord>,
}

/// Extent of the box in the periodic directions, else 0 [m].
pub(crate) fn period(domain: &Domain) -> Vector {
    let extent = domain.grid().extent();
    let of = |d: usize| if domain.periodic()[d] { extent[d] } else { 0.0 };
    Vector::new(of(0), of(1), 0.0)
}

/// The periodic image of a grain at `unwrapped` [m] that lies in the box.
pub(crate) fn image_in_box(domain: &Domain, unwrapped: [Real; 3]) -> [i32; 2] {
    let (lower, period) = (domain.grid().lower, period(domain));
    std::array::from_fn(|d| if period[d] > 0.0 { -((unwrapped[d] - lower[d]) / period[d]).floor() as i32 } else { 0 })
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
    /// Chooses and exchanges ghosts. `size[g]` is the bounding radius plus skin of own grain `g`;
    /// every grain whose surface may come within `margin` of a rank's part becomes a ghost there.
    pub fn renew(&mut self, domain: &Domain, grains: &mut Grains, size: &[Real], skin: &mut Vec<Real>, margin: Real) {
        let owned = grains.owned;
        grains.truncate(owned);
        skin.truncate(owned);
        self.links.clear();
        self.self_images.clear();
        let communicator = domain.communicator();
        let me = communicator.rank();
        let period = period(domain);
        self.gather_extents(domain, grains, size);
        let extents = &self.extents[..];
        let widest = extents.iter().map(|e| e.size).fold(0.0, Real::max);
        let need = margin.max(widest);
        // The region for which a rank needs ghosts: its part and all its grains.
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
                    link.outgoing.extend(wanted(rank, image).map(|g| GhostSource { grain: g as u32, image }));
                }
                self.records.clear();
                self.records.extend(link.outgoing.iter().map(|c| copy(grains, *c, skin)));
                communicator.send(rank, GHOSTS, bytemuck::cast_slice(&self.records));
            }
            link.incoming.1 = usize::from(from);
            self.links.push(link);
        }
        let others = images(domain).filter(|&image| image != [0; 2]);
        self.own.clear();
        self.own
            .extend(others.flat_map(|image| wanted(me, image).map(move |g| GhostSource { grain: g as u32, image })));
        for &c in &self.own {
            self.self_images.push((c.image, c.grain, grains.len() as u32));
            let record = copy(grains, c, skin);
            grains.push(&record, period);
            skin.push(record.skin);
        }
        for link in &mut self.links {
            let expected = link.incoming.1 > 0;
            link.incoming = (grains.len(), 0);
            if expected {
                communicator.receive(link.rank, GHOSTS, &mut self.bytes);
                for record in self.bytes.chunks_exact(size_of::<GrainRecord>()).map(bytemuck::pod_read_unaligned) {
                    grains.push(&record, period);
                    skin.push(record.skin);
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

    /// Writes the entry that contacts read for each of `count` entries: images on this rank share the pose of their
    /// grain, since its unwrapped position is theirs.
    pub fn originals(&self, count: usize, into: &mut Vec<u32>) {
        into.clear();
        into.extend(0..count as u32);
        for &(_, grain, ghost) in &self.self_images {
            into[ghost as usize] = grain;
        }
    }

    /// Sends the poses of own grains to where they are ghosts, with `all` also to images on this rank. Returns the largest
    /// growth of the travel of another rank's grain [m].
    pub fn refresh(&mut self, domain: &Domain, grains: &mut Grains, state: &mut PoseState<'_>, all: bool) -> Real {
        let communicator = domain.communicator();
        for link in self.links.iter().filter(|l| !l.outgoing.is_empty()) {
            self.pose_records.clear();
            self.pose_records.extend(link.outgoing.iter().map(|c| pose(grains, state.travel, c.grain as usize)));
            communicator.send(link.rank, POSES, bytemuck::cast_slice(&self.pose_records));
        }
        if all {
            for &(_, grain, ghost) in &self.self_images {
                let record = pose(grains, state.travel, grain as usize);
                put_pose(grains, ghost as usize, &record);
            }
        }
        let mut growth: Real = 0.0;
        for link in self.links.iter().filter(|l| l.incoming.1 > 0) {
            communicator.receive(link.rank, POSES, &mut self.bytes);
            for (n, bytes) in self.bytes.chunks_exact(size_of::<PoseRecord>()).enumerate() {
                let ghost = link.incoming.0 + n;
                let record: PoseRecord = bytemuck::pod_read_unaligned(bytes);
                growth = growth.max(record.travel - state.travel[ghost]);
                state.travel[ghost] = record.travel;
                put_pose(grains, ghost, &record);
                state.rotations[ghost] = state.poses[ghost].follow(grains, ghost, &state.mass_properties[ghost]);
            }
        }
        growth
    }

    /// Makes the entries of own grains that have left the box of a single rank represent their image inside it: each is
    /// swapped with its ghost there. Lists remain valid, since they use unwrapped positions. Returns whether every such
    /// grain had a ghost inside the box; if not, nothing has changed.
    pub fn return_to_box(&mut self, domain: &Domain, grains: &mut Grains) -> bool {
        let Self { self_images, departed, .. } = self;
        departed.clear();
        departed.extend((0..grains.owned).filter_map(|g| {
            let image = image_in_box(domain, grains.unwrapped[g].to_array());
            (image != grains.image[g]).then_some(Departed { own: g as u32, image, ghost: u32::MAX })
        }));
        if departed.is_empty() {
            return true;
        }
        for &(_, own, ghost) in self_images.iter() {
            if let Ok(at) = departed.binary_search_by_key(&own, |l| l.own)
                && grains.image[ghost as usize] == departed[at].image
            {
                departed[at].ghost = ghost;
            }
        }
        if departed.iter().any(|l| l.ghost == u32::MAX) {
            return false;
        }
        for l in departed.iter() {
            grains.image.swap(l.own as usize, l.ghost as usize);
            grains.position.swap(l.own as usize, l.ghost as usize);
        }
        for (relative, own, ghost) in self_images.iter_mut() {
            let (there, here) = (grains.image[*ghost as usize], grains.image[*own as usize]);
            *relative = [there[0] - here[0], there[1] - here[1]];
        }
        // In the order of images again, as after a renewal.
        self_images.sort_unstable();
        true
    }

    /// Sends grains whose centre lies in another rank's part to it, with the history of their contacts.
    /// `records` are the contacts of this rank, by key; afterwards they include those that came.
    pub fn migrate(&mut self, domain: &Domain, grains: &mut Grains, records: &mut Vec<ContactRecord>) {
        let period = period(domain);
        grains.truncate(grains.owned);
        for g in 0..grains.owned {
            grains.image[g] = image_in_box(domain, grains.unwrapped[g].to_array());
            grains.position[g] = image_position(grains.unwrapped[g], grains.image[g], period);
        }
        let communicator = domain.communicator();
        if communicator.size() == 1 {
            return;
        }
        let me = communicator.rank();
        self.owners.clear();
        self.owners.extend(grains.position.iter().map(|&p| domain.owner_of(p)));
        for rank in (0..communicator.size()).filter(|&r| r != me) {
            self.send_grains(domain, rank, grains, records);
        }
        self.collect_for(grains, me);
        for rank in (0..communicator.size()).filter(|&r| r != me) {
            communicator.receive(rank, GRAINS, &mut self.bytes);
            let arrived = self.bytes.chunks_exact(size_of::<GrainRecord>());
            self.records.extend(arrived.map(bytemuck::pod_read_unaligned::<GrainRecord>));
            communicator.receive(rank, CONTACTS, &mut self.bytes);
            let arrived = self.bytes.chunks_exact(size_of::<ContactRecord>());
            records.extend(arrived.map(bytemuck::pod_read_unaligned::<ContactRecord>));
        }
        self.records.sort_unstable_by_key(|s| s.id);
        grains.clear();
        self.records.iter().for_each(|s| grains.push(s, period));
        grains.owned = self.records.len();
        records.sort_unstable_by_key(ContactRecord::key);
        records.dedup_by_key(|r| r.key());
    }

    /// Sends the grains that belong to `rank` now, with those of the contacts `remembered` that they take part in.
    fn send_grains(&mut self, domain: &Domain, rank: usize, grains: &Grains, remembered: &[ContactRecord]) {
        self.collect_for(grains, rank);
        let Self { records, leaving, contacts, .. } = self;
        leaving.clear();
        leaving.extend(records.iter().map(|r| r.id));
        contacts.clear();
        if !leaving.is_empty() {
            let moves = |id: u64| leaving.binary_search(&id).is_ok();
            contacts.extend(remembered.iter().filter(|c| moves(c.low) || moves(c.high)));
        }
        let communicator = domain.communicator();
        communicator.send(rank, GRAINS, bytemuck::cast_slice(records));
        communicator.send(rank, CONTACTS, bytemuck::cast_slice(contacts));
    }

    /// Collects the own grains that belong to `rank` now.
    fn collect_for(&mut self, grains: &Grains, rank: usize) {
        let Self { records, owners, .. } = self;
        records.clear();
        records.extend((0..grains.owned).filter(|&g| owners[g] == rank).map(|g| grains.record(g)));
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
        for &(_, grain, ghost) in &self.self_images {
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
        if self.links.is_empty() && self.self_images.is_empty() {
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
            let self_images = |before: bool| self.self_images.iter().filter(move |s| (s.0 < [0; 2]) == before);
            self_images(true).for_each(|s| add(s.1 as usize, &partial[s.2 as usize]));
            (0..owned).for_each(|g| add(g, &partial[g]));
            self_images(false).for_each(|s| add(s.1 as usize, &partial[s.2 as usize]));
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

fn copy(grains: &Grains, c: GhostSource, skin: &[Real]) -> GrainRecord {
    let g = c.grain as usize;
    let mut record = grains.record(g);
    record.image = [grains.image[g][0] + c.image[0], grains.image[g][1] + c.image[1]];
    record.skin = skin[g];
    record
}

fn pose(grains: &Grains, travel: &[Real], g: usize) -> PoseRecord {
    PoseRecord {
        unwrapped: grains.unwrapped[g].to_array(),
        orientation: grains.orientation[g].to_array(),
        velocity: grains.velocity[g].to_array(),
        angular_momentum: grains.angular_momentum[g].to_array(),
        last_contact: grains.last_contact[g],
        travel: travel[g],
    }
}

fn put_pose(grains: &mut Grains, g: usize, record: &PoseRecord) {
    grains.unwrapped[g] = Vector::from_array(record.unwrapped);
    grains.orientation[g] = Quaternion::from_array(record.orientation);
    grains.velocity[g] = Vector::from_array(record.velocity);
    grains.angular_momentum[g] = Vector::from_array(record.angular_momentum);
    grains.last_contact[g] = record.last_contact;
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::body::Body;
    use crate::grain::Grain;
    use sazanami_numerics::grid::Grid;

    const SIZE: Real = 0.15;

    /// A box of 1 m that is periodic along x1 and x2, with balls that have all their ghosts.
    fn balls(positions: &[[Real; 3]]) -> (Domain, Grains, Exchange) {
        let domain = Domain::solo(Grid::new([8; 3], Vector::ZERO, Vector::ONE), [true, true, false]);
        let mut grains = Grains::default();
        for (id, position) in positions.iter().enumerate() {
            let grain = Grain::new(id as u64, 1.0, Vector::from_array(*position));
            let record = GrainRecord::new(&grain, &[Body::ball(0.1)], 1).expect("the ball makes sense");
            grains.push(&record, period(&domain));
        }
        grains.owned = positions.len();
        let mut exchange = Exchange::default();
        renew(&mut exchange, &domain, &mut grains);
        (domain, grains, exchange)
    }

    fn renew(exchange: &mut Exchange, domain: &Domain, grains: &mut Grains) {
        let size = vec![SIZE; grains.owned];
        exchange.renew(domain, grains, &size, &mut vec![0.0; grains.owned], 0.0);
    }

    /// Image and position of every entry, by grain.
    fn images(grains: &Grains) -> Vec<(u64, [i32; 2], [Real; 3])> {
        let entries = 0..grains.len();
        let mut images: Vec<_> =
            entries.map(|g| (grains.id[g], grains.image[g], grains.position[g].to_array())).collect();
        images.sort_unstable_by_key(|entry| (entry.0, entry.1));
        images
    }

    #[test]
    fn a_grain_that_crosses_a_corner_changes_places_with_its_ghost_there() {
        let (domain, mut grains, mut exchange) = balls(&[[0.96, 0.98, 0.5], [0.5, 0.03, 0.5], [0.9, 0.5, 0.5]]);
        let known = grains.len();
        assert_eq!(known, 3 + 3 + 1 + 1, "three images beyond a corner, one beyond a side");
        // The first leaves across the corner, the second across a side; the third stays.
        for g in 0..known {
            grains.unwrapped[g] +=
                [Vector::new(0.06, 0.04, 0.0), Vector::new(0.0, -0.05, 0.0), Vector::ZERO][grains.id[g] as usize];
            grains.position[g] = image_position(grains.unwrapped[g], grains.image[g], Vector::new(1.0, 1.0, 0.0));
        }
        let before = images(&grains);
        assert!(exchange.return_to_box(&domain, &mut grains));
        assert_eq!(grains.image[..3], [[-1, -1], [0, 1], [0, 0]]);
        assert!(grains.position[..3].iter().all(|p| p.cmpge(Vector::ZERO).all() && p.cmplt(Vector::ONE).all()));
        assert_eq!(images(&grains), before, "the same images, in other places");
        // Contacts read the grain itself, wherever its images are.
        let mut originals = Vec::new();
        exchange.originals(known, &mut originals);
        assert!(originals.iter().zip(&grains.id).all(|(&of, &id)| (of as usize) < 3 && grains.id[of as usize] == id));
        // Relative images are in the order of those that are chosen afresh.
        let self_images: Vec<_> = exchange.self_images.iter().map(|s| (s.0, s.1)).collect();
        renew(&mut exchange, &domain, &mut grains);
        assert_eq!(self_images, exchange.self_images.iter().map(|s| (s.0, s.1)).collect::<Vec<_>>());
        assert!(self_images.contains(&([0, -1], 1)));
    }

    #[test]
    fn nothing_changes_if_one_grain_has_no_ghost_in_the_box() {
        let (domain, mut grains, mut exchange) = balls(&[[0.98, 0.98, 0.5], [0.5, 0.5, 0.5]]);
        grains.unwrapped.iter_mut().for_each(|unwrapped| *unwrapped += Vector::new(0.6, 0.03, 0.0));
        let (before, self_images) = (images(&grains), exchange.self_images.clone());
        assert!(!exchange.return_to_box(&domain, &mut grains));
        assert_eq!((images(&grains), exchange.self_images), (before, self_images));
        assert_eq!(grains.image[..2], [[0; 2]; 2]);
    }
}
