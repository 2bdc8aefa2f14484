//! The way of particles to new owners, and ghosts: copies of other ranks' particles and periodic images.

use bytemuck::Pod;
use sazanami_numerics::domain::Domain;
use sazanami_numerics::{Real, Vector};
use sazanami_parallel::for_each_chunk;

use crate::neighbours::ROWS;
use crate::particles::{ParticleRecord, Particles};

const MIGRANTS: u32 = 400;
const GHOSTS: u32 = 401;
const VALUES: u32 = 402;

/// Lengths along which the fluid repeats itself, zero where it does not [m].
///
/// Periods and the coordinates along them are multiples of a tiny length, so that an image lies exactly a period
/// away and a pair sees the same distance from both its ends, to the last bit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Periods {
    lower: Vector,
    /// Period in each direction [m].
    pub length: Vector,
    grain: Real,
}

impl Periods {
    /// Periods of the box of `domain` in its periodic directions.
    #[must_use]
    pub fn of(domain: &Domain) -> Self {
        let (lower, upper) = (domain.grid().lower, domain.grid().upper());
        let largest = lower.abs().max(upper.abs()).max_element().max(domain.grid().extent().max_element());
        // Multiples of 2^-50 of a length four times as large keep two bits to spare.
        let grain = (2.0 * largest.log2().ceil().exp2()) * (-50.0_f64).exp2();
        let periodic = domain.periodic();
        let of = |d: usize| if periodic[d] { (domain.grid().extent()[d] / grain).round() * grain } else { 0.0 };
        Self { lower, length: Vector::new(of(0), of(1), of(2)), grain }
    }

    /// `position` on exact multiples along periodic directions.
    #[inline]
    #[must_use]
    pub fn rounded(&self, mut position: Vector) -> Vector {
        for d in 0..3 {
            if self.length[d] > 0.0 {
                position[d] = (position[d] / self.grain).round() * self.grain;
            }
        }
        position
    }

    /// The image of `position` in the box, on exact multiples along periodic directions.
    #[must_use]
    pub fn wrapped(&self, mut position: Vector) -> Vector {
        for d in 0..3 {
            let length = self.length[d];
            if length > 0.0 {
                position[d] -= ((position[d] - self.lower[d]) / length).floor() * length;
            }
        }
        self.rounded(position)
    }

    /// Images other than the box itself that can matter.
    fn images(&self) -> impl Iterator<Item = Vector> {
        let range = |d: usize| if self.length[d] > 0.0 { -1..=1 } else { 0..=0 };
        let (first, second, third) = (range(0), range(1), range(2));
        let length = self.length;
        first.flat_map(move |i| {
            let third = third.clone();
            second.clone().flat_map(move |j| {
                third.clone().map(move |k| Vector::new(Real::from(i), Real::from(j), Real::from(k)) * length)
            })
        })
    }
}

/// Particles copied to one rank (or to this one, as images).
#[derive(Clone, Debug, Default)]
struct Link {
    rank: usize,
    /// Own particle and shift of its image [m].
    outgoing: Vec<(u32, Vector)>,
    /// Where what is received goes.
    slots: Vec<u32>,
}

/// Who sends which particles to whom.
#[derive(Clone, Debug, Default)]
pub(crate) struct Ghosts {
    links: Vec<Link>,
    bytes: Vec<u8>,
    records: Vec<ParticleRecord>,
    /// New owner of each own particle.
    owners: Vec<usize>,
    /// Ghosts in the order of arrival, with link and place there.
    arrived: Vec<(u32, u32, ParticleRecord)>,
    /// Bin and identifier of those that have arrived, and their place among them, in the order of the ghosts.
    order: Vec<(u32, u64, u32)>,
    /// First ghost.
    first: usize,
    /// Own particle that each ghost is an image of, and the shift of the image [m]; none of a ghost of another rank.
    origins: Vec<Option<(u32, Vector)>>,
}

/// The part of space that belongs to `rank`: its box, without end where the box ends.
fn zone(domain: &Domain, periods: &Periods, rank: usize) -> (Vector, Vector) {
    let (mut lower, mut upper) = domain.rank_box(rank);
    let (start, cells) = domain.decomposition().part(rank);
    for d in 0..3 {
        if periods.length[d] == 0.0 {
            if start[d] == 0 {
                lower[d] = Real::NEG_INFINITY;
            }
            if start[d] + cells[d] == domain.grid().cells[d] {
                upper[d] = Real::INFINITY;
            }
        }
    }
    (lower, upper)
}

impl Ghosts {
    /// Gives every particle to the rank whose part holds it. There are no ghosts.
    pub fn migrate(&mut self, domain: &Domain, particles: &mut Particles) {
        let communicator = domain.communicator();
        let (me, size) = (communicator.rank(), communicator.size());
        if size == 1 {
            return;
        }
        self.owners.clear();
        self.owners.extend(particles.position.iter().map(|&x| domain.owner_of(x)));
        for rank in (0..size).filter(|&rank| rank != me) {
            self.pick(particles, rank);
            communicator.send(rank, MIGRANTS, bytemuck::cast_slice(&self.records));
        }
        self.pick(particles, me);
        for rank in (0..size).filter(|&rank| rank != me) {
            communicator.receive(rank, MIGRANTS, &mut self.bytes);
            let records = self.bytes.chunks_exact(size_of::<ParticleRecord>());
            self.records.extend(records.map(bytemuck::pod_read_unaligned::<ParticleRecord>));
        }
        particles.truncate(0);
        self.records.iter().for_each(|record| particles.push(record));
    }

    /// Writes down the particles that belong to `rank` now.
    fn pick(&mut self, particles: &Particles, rank: usize) {
        let Self { records, owners, .. } = self;
        records.clear();
        records.extend((0..particles.len()).filter(|&a| owners[a] == rank).map(|a| particles.record(a)));
    }

    /// Chooses and exchanges ghosts: every particle within `margin` [m] of a rank's part becomes known there. They
    /// are put in the order of `bin` and their identifiers.
    pub fn renew(
        &mut self,
        domain: &Domain,
        periods: &Periods,
        particles: &mut Particles,
        margin: Real,
        bin: impl Fn(Vector) -> u32,
    ) {
        let communicator = domain.communicator();
        let me = communicator.rank();
        particles.truncate(particles.owned);
        let near = |a: (Vector, Vector), b: (Vector, Vector), shift: Vector| {
            (b.0 - (a.1 + shift)).max((a.0 + shift) - b.1).max_element() <= 2.0 * margin
        };
        let mine = zone(domain, periods, me);
        let mut links = std::mem::take(&mut self.links);
        let mut used = 0;
        for rank in 0..communicator.size() {
            let theirs = zone(domain, periods, rank);
            // Both ask in the same words, and so agree whether there is a link.
            let (low, high) = if me < rank { (mine, theirs) } else { (theirs, mine) };
            if rank != me && !periods.images().any(|shift| near(low, high, shift)) {
                continue;
            }
            if used == links.len() {
                links.push(Link::default());
            }
            let link = &mut links[used];
            used += 1;
            link.rank = rank;
            link.outgoing.clear();
            for shift in periods.images().filter(|&shift| rank != me || shift != Vector::ZERO) {
                if !near(mine, theirs, shift) {
                    continue;
                }
                let (lower, upper) = (theirs.0 - shift - margin, theirs.1 - shift + margin);
                let positions = particles.position[..particles.owned].iter().enumerate();
                let wanted = positions.filter(|(_, x)| x.cmpge(lower).all() && x.cmple(upper).all());
                link.outgoing.extend(wanted.map(|(a, _)| (a as u32, shift)));
            }
            if rank != me {
                self.records.clear();
                self.records.extend(link.outgoing.iter().map(|&sent| copy(particles, sent)));
                communicator.send(rank, GHOSTS, bytemuck::cast_slice(&self.records));
            }
        }
        links.truncate(used);
        self.arrived.clear();
        for (number, link) in links.iter_mut().enumerate() {
            self.records.clear();
            if link.rank == me {
                self.records.extend(link.outgoing.iter().map(|&sent| copy(particles, sent)));
            } else {
                communicator.receive(link.rank, GHOSTS, &mut self.bytes);
                let records = self.bytes.chunks_exact(size_of::<ParticleRecord>());
                self.records.extend(records.map(bytemuck::pod_read_unaligned::<ParticleRecord>));
            }
            link.slots.clear();
            link.slots.resize(self.records.len(), 0);
            let records = self.records.iter().enumerate();
            self.arrived.extend(records.map(|(place, record)| (number as u32, place as u32, *record)));
        }
        self.order.clear();
        let keys = self.arrived.iter().zip(0..);
        self.order.extend(keys.map(|((.., r), place)| (bin(Vector::from_array(r.position)), r.id, place)));
        // An image of a particle is another particle: positions tell images of the same particle apart.
        let arrived = &self.arrived;
        self.order.sort_unstable_by(|a, b| {
            (a.0, a.1).cmp(&(b.0, b.1)).then_with(|| {
                let [a, b] = [a, b].map(|key| arrived[key.2 as usize].2.position);
                a[0].total_cmp(&b[0]).then(a[1].total_cmp(&b[1])).then(a[2].total_cmp(&b[2]))
            })
        });
        self.first = particles.len();
        self.origins.clear();
        for &(.., at) in &self.order {
            let (link, place, record) = arrived[at as usize];
            let link = &mut links[link as usize];
            link.slots[place as usize] = particles.len() as u32;
            self.origins.push((link.rank == me).then(|| link.outgoing[place as usize]));
            particles.push(&record);
        }
        self.links = links;
    }

    /// Brings a column of all particles and ghosts up to date at the ghosts; `image` says what a shift [m] makes of a
    /// value.
    pub fn refresh_with<T: Pod + Send + Sync>(
        &mut self,
        domain: &Domain,
        column: &mut [T],
        image: impl Fn(T, Vector) -> T + Sync,
    ) {
        let communicator = domain.communicator();
        let Self { links, bytes, first, origins, .. } = self;
        debug_assert_eq!(column.len(), *first + origins.len(), "own particles and ghosts");
        let others = |link: &&Link| link.rank != communicator.rank();
        for link in links.iter().filter(others) {
            bytes.clear();
            for &(a, shift) in &link.outgoing {
                bytes.extend_from_slice(bytemuck::bytes_of(&image(column[a as usize], shift)));
            }
            communicator.send(link.rank, VALUES, bytes);
        }
        let (own, ghosts) = column.split_at_mut(*first);
        for_each_chunk(ghosts, ROWS, |number, ghosts| {
            for (value, origin) in ghosts.iter_mut().zip(&origins[number * ROWS..]) {
                if let Some((a, shift)) = *origin {
                    *value = image(own[a as usize], shift);
                }
            }
        });
        for link in links.iter().filter(others) {
            communicator.receive(link.rank, VALUES, bytes);
            for (value, &slot) in bytes.chunks_exact(size_of::<T>()).zip(&link.slots) {
                column[slot as usize] = bytemuck::pod_read_unaligned(value);
            }
        }
    }

    /// Brings a column up to date at the ghosts, which have the value of the particle they are images of.
    pub fn refresh<T: Pod + Send + Sync>(&mut self, domain: &Domain, column: &mut [T]) {
        self.refresh_with(domain, column, |value, _| value);
    }

    /// Brings positions up to date at the ghosts.
    pub fn refresh_positions(&mut self, domain: &Domain, column: &mut [Vector]) {
        self.refresh_with(domain, column, |position, shift| position + shift);
    }
}

fn copy(particles: &Particles, (a, shift): (u32, Vector)) -> ParticleRecord {
    let record = particles.record(a as usize);
    ParticleRecord { position: (Vector::from_array(record.position) + shift).to_array(), ..record }
}
