//! Grains between ranks and periodic sides: owners, ghosts, images.

use bytemuck::{Pod, Zeroable};
use sazanami_numerics::domain::Domain;
use sazanami_numerics::particles::{GhostChoice, Ghosts, Migration, ParticleColumns, RecordExchange};
use sazanami_numerics::{Matrix, Quaternion, Real, Vector};
use sazanami_parallel::{for_each_chunk, reduce_over};

use crate::contact::record::ContactRecord;
use crate::grain::{GrainRecord, Grains, image_position};
use crate::motion::{MassProperties, Pose};
use crate::selection::Selection;

const GHOSTS: u32 = 300;
const POSES: u32 = 301;
const BACK: u32 = 302;
const GRAINS: u32 = 303;
const CONTACTS: u32 = 304;
const SHARED: u32 = 305;
/// Grains that one task of a loop does.
const CHUNK: usize = 512;

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
    /// Largest bounding radius plus skin \[m].
    size: Real,
}

/// An own grain that has left the box of a single rank.
#[derive(Clone, Copy, Debug)]
struct Departed {
    own: u32,
    /// The image of it that lies in the box.
    image: [i32; 3],
    /// The ghost that represents this image; `u32::MAX`: none does.
    ghost: u32,
}

/// State derived from the motion of grains and ghosts, updated with it.
pub(crate) struct PoseState<'a> {
    pub poses: &'a mut [Pose],
    pub rotations: &'a mut [Matrix],
    pub travel: &'a mut [Real],
    pub mass_properties: &'a [MassProperties],
}

/// Owners and ghosts of the grains, with all storage.
#[derive(Debug, Default)]
pub(crate) struct GrainExchange {
    ghosts: Ghosts<[i32; 3], GrainRecord>,
    migration: Migration<GrainRecord>,
    contacts: RecordExchange<ContactRecord>,
    extents: Vec<Extent>,
    gathered: Vec<Vec<u8>>,
    departed: Vec<Departed>,
    leaving: Selection<Departed>,
    near: Selection<(u32, [i32; 3])>,
}

/// Extent of the box in the periodic directions, else 0 \[m].
pub(crate) fn period(domain: &Domain) -> Vector {
    let extent = domain.grid().extent();
    let of = |d: usize| if domain.periodic()[d] { extent[d] } else { 0.0 };
    Vector::new(of(0), of(1), of(2))
}

/// The periodic image of a grain at `unwrapped` \[m] that lies in the box.
pub(crate) fn image_in_box(domain: &Domain, unwrapped: [Real; 3]) -> [i32; 3] {
    let (lower, period) = (domain.grid().lower, period(domain));
    std::array::from_fn(|d| if period[d] > 0.0 { -((unwrapped[d] - lower[d]) / period[d]).floor() as i32 } else { 0 })
}

/// Distance of `point` from the box `lower..upper` \[m].
fn distance(point: Vector, lower: Vector, upper: Vector) -> Real {
    (lower - point).max(point - upper).max(Vector::ZERO).length()
}

/// Relative periodic images to be considered, in ascending order.
fn images(domain: &Domain) -> impl Iterator<Item = [i32; 3]> {
    let range = |d: usize| if domain.periodic()[d] { -1..=1 } else { 0..=0 };
    let [first, second, third] = [0, 1, 2].map(range);
    let of_plane = move |a: i32| {
        let third = third.clone();
        second.clone().flat_map(move |b| third.clone().map(move |c| [a, b, c]))
    };
    first.flat_map(of_plane)
}

/// Grains whose surface may come within `need` of a rank's part and of its own grains are ghosts there.
struct Near<'a> {
    domain: &'a Domain,
    period: Vector,
    extents: &'a [Extent],
    /// Bounding radius plus skin of each own grain \[m].
    size: &'a [Real],
    need: Real,
    found: &'a mut Selection<(u32, [i32; 3])>,
}

impl Near<'_> {
    /// The region for which a rank needs ghosts: its part and all its grains.
    fn zone(&self, rank: usize) -> (Vector, Vector) {
        let (lower, upper) = self.domain.rank_box(rank);
        let e = &self.extents[rank];
        (lower.min(Vector::from_array(e.lower)), upper.max(Vector::from_array(e.upper)))
    }

    fn shift(&self, image: [i32; 3]) -> Vector {
        Vector::from_array(image.map(Real::from)) * self.period
    }

    fn sends(&self, from: usize, to: usize) -> bool {
        let (lower, upper) = self.zone(to);
        let e = &self.extents[from];
        let near = |image| {
            let (a, b) =
                (Vector::from_array(e.lower) + self.shift(image), Vector::from_array(e.upper) + self.shift(image));
            (lower - b).max(a - upper).max_element() < self.need + e.size
        };
        e.size > 0.0 && images(self.domain).any(near)
    }
}

impl GhostChoice<Grains, [i32; 3]> for Near<'_> {
    fn linked(&self, rank: usize) -> [bool; 2] {
        let me = self.domain.communicator().rank();
        [self.sends(me, rank), self.sends(rank, me)]
    }

    fn choose(&mut self, grains: &Grains, rank: usize, chosen: &mut Vec<(u32, [i32; 3])>) {
        let itself = rank == self.domain.communicator().rank();
        let (lower, upper) = self.zone(rank);
        // Heights do not matter to whom a cell belongs, nor, unless they are periodic, to whom a grain is sent.
        let endless = self.period.z > 0.0;
        let away = |position: Vector| {
            let height = if endless { position.z } else { position.z.clamp(lower.z, upper.z) };
            distance(position.with_z(height), lower, upper)
        };
        for image in images(self.domain).filter(|&image| !itself || image != [0; 3]) {
            let shift = self.shift(image);
            let (size, need) = (self.size, self.need);
            let near = |g: usize| (away(grains.position[g] + shift) < size[g] + need).then_some((g as u32, image));
            self.found.collect(grains.owned, near, chosen);
        }
    }

    fn image(&self, grains: &Grains, own: u32, image: [i32; 3]) -> GrainRecord {
        let record = grains.record(own as usize);
        record.as_image([0, 1, 2].map(|d| record.image[d] + image[d]), self.period)
    }

    fn arrange(&mut self, _ghosts: &[GrainRecord], _order: &mut [u32]) {}
}

impl GrainExchange {
    /// Chooses and exchanges ghosts. `size[g]` is the bounding radius plus skin of own grain `g`;
    /// every grain whose surface may come within `margin` of a rank's part becomes a ghost there.
    pub fn renew(&mut self, domain: &Domain, grains: &mut Grains, size: &[Real], margin: Real) {
        self.gather_extents(domain, grains, size);
        let extents = &self.extents[..];
        let need = margin.max(extents.iter().map(|e| e.size).fold(0.0, Real::max));
        let mut near = Near { domain, period: period(domain), extents, size, need, found: &mut self.near };
        self.ghosts.renew(domain, GHOSTS, grains, &mut near);
    }

    fn gather_extents(&mut self, domain: &Domain, grains: &Grains, size: &[Real]) {
        let none = (Vector::INFINITY, Vector::NEG_INFINITY, 0.0);
        let larger = |a: (Vector, Vector, Real), b: (Vector, Vector, Real)| (a.0.min(b.0), a.1.max(b.1), a.2.max(b.2));
        let of_grain = |g: usize| (grains.position[g], grains.position[g], size[g]);
        let of_chunk = |n: usize| (n * CHUNK..grains.owned.min((n + 1) * CHUNK)).map(of_grain).fold(none, larger);
        let (lower, upper, size) = reduce_over(grains.owned.div_ceil(CHUNK), of_chunk, larger).unwrap_or(none);
        let mine = Extent { lower: lower.to_array(), upper: upper.to_array(), size };
        domain.communicator().all_gather(bytemuck::bytes_of(&mine), &mut self.gathered);
        self.extents.clear();
        self.extents.extend(self.gathered.iter().map(|bytes| bytemuck::pod_read_unaligned::<Extent>(bytes)));
    }

    /// Writes the entry that contacts read for each of `count` entries: images on this rank share the pose of their
    /// grain, since its unwrapped position is theirs.
    pub fn originals(&self, count: usize, into: &mut Vec<u32>) {
        into.clear();
        into.extend(0..count as u32);
        for &(_, grain, ghost) in self.ghosts.images() {
            into[ghost as usize] = grain;
        }
    }

    /// Sends the poses of own grains to where they are ghosts, with `all` also to images on this rank. Returns the largest
    /// increment of the travel of another rank's grain \[m].
    pub fn refresh(&mut self, domain: &Domain, grains: &mut Grains, state: &mut PoseState<'_>, all: bool) -> Real {
        self.ghosts.send(domain, POSES, |own, _| pose(grains, state.travel, own));
        if all {
            for &(_, grain, ghost) in self.ghosts.images() {
                let record = pose(grains, state.travel, grain as usize);
                put_pose(grains, ghost as usize, &record);
            }
        }
        let mut growth: Real = 0.0;
        self.ghosts.receive(domain, POSES, |ghost, record: PoseRecord| {
            growth = growth.max(record.travel - state.travel[ghost]);
            state.travel[ghost] = record.travel;
            put_pose(grains, ghost, &record);
            state.rotations[ghost] = state.poses[ghost].follow(grains, ghost, &state.mass_properties[ghost]);
        });
        growth
    }

    /// Makes the entries of own grains that have left the box represent their image inside it: each is swapped with its
    /// ghost there. Lists remain valid, since they use unwrapped positions. Returns whether every such grain had a ghost
    /// inside the box; if not, nothing has changed.
    pub fn return_to_box(&mut self, domain: &Domain, grains: &mut Grains) -> bool {
        let Self { ghosts, departed, leaving, .. } = self;
        departed.clear();
        if period(domain) == Vector::ZERO {
            return true;
        }
        let outside = |g: usize| {
            let image = image_in_box(domain, grains.unwrapped[g].to_array());
            (image != grains.image[g]).then_some(Departed { own: g as u32, image, ghost: u32::MAX })
        };
        leaving.collect(grains.owned, outside, departed);
        if departed.is_empty() {
            return true;
        }
        for &(_, own, ghost) in ghosts.images() {
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
        ghosts.change_images(|relative, own, ghost| {
            let (there, here) = (grains.image[ghost as usize], grains.image[own as usize]);
            *relative = [0, 1, 2].map(|d| there[d] - here[d]);
        });
        true
    }

    /// Sends grains whose centre lies in another rank's part to it, with the history of their contacts.
    /// `records` are the contacts of this rank, by key; afterwards they include those that came.
    pub fn migrate(&mut self, domain: &Domain, grains: &mut Grains, records: &mut Vec<ContactRecord>) {
        let Self { migration, contacts, .. } = self;
        let period = period(domain);
        grains.truncate(grains.owned);
        let Grains { unwrapped, image, position, .. } = grains;
        for_each_chunk((&mut image[..], &mut position[..]), CHUNK, |number, (image, position)| {
            for (n, (image, position)) in image.iter_mut().zip(position).enumerate() {
                let unwrapped = unwrapped[number * CHUNK + n];
                *image = image_in_box(domain, unwrapped.to_array());
                *position = image_position(unwrapped, *image, period);
            }
        });
        if !migration.find_owners(domain, &grains.position) {
            return;
        }
        let owner = |id: &u64| grains.id.binary_search(id).ok().map(|g| migration.owners()[g]);
        contacts.exchange(domain, CONTACTS, records, |rank, known, leaving| {
            let moves = |id: &u64| owner(id) == Some(rank);
            leaving.extend(known.iter().filter(|c| moves(&c.low) || moves(&c.high)));
        });
        records.sort_unstable_by_key(ContactRecord::key);
        records.dedup_by_key(|r| r.key());
        migration.exchange(domain, GRAINS, grains, |arrived| arrived.sort_unstable_by_key(|s| s.id));
    }

    /// See [`crate::Engine::share_with_ghosts`].
    pub fn share<const N: usize>(&self, domain: &Domain, values: &mut [[Real; N]]) {
        self.ghosts.refresh(domain, SHARED, values, |value, _| value);
    }

    /// See [`crate::Engine::gather_to_owners`].
    pub fn gather<const N: usize>(&self, domain: &Domain, partial: &mut [[Real; N]]) {
        self.ghosts.gather(domain, BACK, partial);
    }
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
    fn balls(positions: &[[Real; 3]]) -> (Domain, Grains, GrainExchange) {
        let domain = Domain::solo(Grid::new([8; 3], Vector::ZERO, Vector::ONE), [true, true, false]);
        let mut grains = Grains::default();
        for (id, position) in positions.iter().enumerate() {
            let grain = Grain::new(id as u64, 1.0, Vector::from_array(*position));
            let record = GrainRecord::new(&grain, &[Body::ball(0.1)], 1).expect("the ball makes sense");
            grains.push(&record);
        }
        grains.own_all();
        let mut exchange = GrainExchange::default();
        renew(&mut exchange, &domain, &mut grains);
        (domain, grains, exchange)
    }

    fn renew(exchange: &mut GrainExchange, domain: &Domain, grains: &mut Grains) {
        let size = vec![SIZE; grains.owned];
        exchange.renew(domain, grains, &size, 0.0);
    }

    /// Image and position of every entry, by grain.
    fn images(grains: &Grains) -> Vec<(u64, [i32; 3], [Real; 3])> {
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
        assert_eq!(grains.image[..3], [[-1, -1, 0], [0, 1, 0], [0, 0, 0]]);
        assert!(grains.position[..3].iter().all(|p| p.cmpge(Vector::ZERO).all() && p.cmplt(Vector::ONE).all()));
        assert_eq!(images(&grains), before, "the same images, in other places");
        // Contacts read the grain itself, wherever its images are.
        let mut originals = Vec::new();
        exchange.originals(known, &mut originals);
        assert!(originals.iter().zip(&grains.id).all(|(&of, &id)| (of as usize) < 3 && grains.id[of as usize] == id));
        // Relative images are in the order of those that are chosen afresh.
        let self_images: Vec<_> = exchange.ghosts.images().iter().map(|s| (s.0, s.1)).collect();
        renew(&mut exchange, &domain, &mut grains);
        assert_eq!(self_images, exchange.ghosts.images().iter().map(|s| (s.0, s.1)).collect::<Vec<_>>());
        assert!(self_images.contains(&([0, -1, 0], 1)));
    }

    #[test]
    fn nothing_changes_if_one_grain_has_no_ghost_in_the_box() {
        let (domain, mut grains, mut exchange) = balls(&[[0.98, 0.98, 0.5], [0.5, 0.5, 0.5]]);
        grains.unwrapped.iter_mut().for_each(|unwrapped| *unwrapped += Vector::new(0.6, 0.03, 0.0));
        let (before, self_images) = (images(&grains), exchange.ghosts.images().to_vec());
        assert!(!exchange.return_to_box(&domain, &mut grains));
        assert_eq!((images(&grains), exchange.ghosts.images().to_vec()), (before, self_images));
        assert_eq!(grains.image[..2], [[0; 3]; 2]);
    }
}
