//! Ghosts: entries behind the own particles that are copies of other ranks' particles, or periodic images.

use std::sync::{Mutex, MutexGuard, PoisonError};

use bytemuck::Pod;
use sazanami_parallel::for_each_chunk;

use super::columns::{MANY, ParticleColumns};
use crate::Real;
use crate::domain::Domain;

/// Ghosts exchanged with one other rank.
#[derive(Clone, Debug, Default)]
struct Link<I> {
    rank: usize,
    /// Own particles that are ghosts there, and of which image.
    outgoing: Vec<(u32, I)>,
    /// Places of the ghosts received from there.
    places: Vec<u32>,
}

/// Buffers of an exchange.
#[derive(Debug, Default)]
struct Buffers {
    send: Vec<u8>,
    receive: Vec<u8>,
    totals: Vec<Real>,
}

/// Own particles that are ghosts on other ranks or images on this one; `I` says which periodic image a ghost is.
#[derive(Debug)]
pub struct Ghosts<I, R> {
    links: Vec<Link<I>>,
    /// Images of own particles on this rank: image, own particle, ghost.
    images: Vec<(I, u32, u32)>,
    /// First ghost.
    first: usize,
    /// Own particle of which each ghost is an image, and the image; none of a ghost of another rank.
    origins: Vec<Option<(u32, I)>>,
    records: Vec<R>,
    chosen: Vec<(u32, I)>,
    order: Vec<u32>,
    buffers: Mutex<Buffers>,
}

impl<I, R> Default for Ghosts<I, R> {
    fn default() -> Self {
        Self {
            links: Vec::new(),
            images: Vec::new(),
            first: 0,
            origins: Vec::new(),
            records: Vec::new(),
            chosen: Vec::new(),
            order: Vec::new(),
            buffers: Mutex::default(),
        }
    }
}

/// Rule that chooses own particles as ghosts of other ranks, or of periodic images.
pub trait GhostChoice<C: ParticleColumns, I> {
    /// Whether this rank sends ghosts to `rank`, and whether it receives some from there; both ends agree.
    fn linked(&self, rank: usize) -> [bool; 2];

    /// Own particles, with the image, that become ghosts on `rank`; on this rank itself those that are images.
    fn choose(&mut self, columns: &C, rank: usize, chosen: &mut Vec<(u32, I)>);

    /// The record of an image of own particle `own`.
    fn image(&self, columns: &C, own: u32, image: I) -> C::Record;

    /// Puts the numbers of the ghosts into the order in which they are to stand; as they come: images on this rank, then
    /// those of other ranks.
    fn arrange(&mut self, ghosts: &[C::Record], order: &mut [u32]);
}

impl<I: Copy + Send + Sync, R: Pod> Ghosts<I, R> {
    /// Replaces all ghosts by those of `choice`, exchanged under a message `tag`. Collective.
    pub fn renew<C: ParticleColumns<Record = R>>(
        &mut self,
        domain: &Domain,
        tag: u32,
        columns: &mut C,
        choice: &mut impl GhostChoice<C, I>,
    ) {
        let communicator = domain.communicator();
        let me = communicator.rank();
        columns.truncate(columns.owned());
        let Self { links, images, first, origins, records, chosen, order, buffers } = self;
        let bytes = &mut buffers.get_mut().unwrap_or_else(PoisonError::into_inner).receive;
        let mut used = 0;
        for rank in (0..communicator.size()).filter(|&rank| rank != me) {
            let [sends, receives] = choice.linked(rank);
            if !(sends || receives) {
                continue;
            }
            if used == links.len() {
                links.push(Link { rank, outgoing: Vec::new(), places: Vec::new() });
            }
            let link = &mut links[used];
            used += 1;
            link.rank = rank;
            link.outgoing.clear();
            link.places.clear();
            if sends {
                choice.choose(columns, rank, &mut link.outgoing);
                records.clear();
                records.extend(link.outgoing.iter().map(|&(own, image)| choice.image(columns, own, image)));
                communicator.send(rank, tag, bytemuck::cast_slice(records));
            }
            // Marks that a message comes from there.
            link.places.resize(usize::from(receives), 0);
        }
        links.truncate(used);
        records.clear();
        chosen.clear();
        choice.choose(columns, me, chosen);
        records.extend(chosen.iter().map(|&(own, image)| choice.image(columns, own, image)));
        images.clear();
        images.extend(chosen.iter().map(|&(own, image)| (image, own, 0)));
        for link in links.iter_mut().filter(|link| !link.places.is_empty()) {
            communicator.receive(link.rank, tag, bytes);
            let before = records.len();
            records.extend(bytes.chunks_exact(size_of::<R>()).map(bytemuck::pod_read_unaligned::<R>));
            link.places.resize(records.len() - before, 0);
        }
        order.clear();
        order.extend(0..records.len() as u32);
        choice.arrange(records, order);
        *first = columns.len();
        origins.clear();
        for &number in &*order {
            let (place, mut number) = (columns.len() as u32, number as usize);
            columns.push(&records[number]);
            if let Some(image) = images.get_mut(number) {
                image.2 = place;
                origins.push(Some((image.1, image.0)));
                continue;
            }
            origins.push(None);
            number -= images.len();
            for link in links.iter_mut() {
                match link.places.get_mut(number) {
                    Some(entry) => {
                        *entry = place;
                        break;
                    }
                    None => number -= link.places.len(),
                }
            }
        }
    }

    /// Images of own particles on this rank: image, own particle, ghost.
    #[must_use]
    pub fn images(&self) -> &[(I, u32, u32)] {
        &self.images
    }

    /// Sends what `record` makes of each own particle and its image to where it is a ghost.
    pub fn send<T: Pod>(&self, domain: &Domain, tag: u32, record: impl Fn(usize, I) -> T) {
        let bytes = &mut self.buffers().send;
        for link in self.links.iter().filter(|link| !link.outgoing.is_empty()) {
            bytes.clear();
            for &(own, image) in &link.outgoing {
                bytes.extend_from_slice(bytemuck::bytes_of(&record(own as usize, image)));
            }
            domain.communicator().send(link.rank, tag, bytes);
        }
    }

    /// Receives what other ranks sent of their particles, and gives it to `take` with the place of the ghost.
    pub fn receive<T: Pod>(&self, domain: &Domain, tag: u32, mut take: impl FnMut(usize, T)) {
        let bytes = &mut self.buffers().receive;
        for link in self.links.iter().filter(|link| !link.places.is_empty()) {
            domain.communicator().receive(link.rank, tag, bytes);
            for (&place, value) in link.places.iter().zip(bytes.chunks_exact(size_of::<T>())) {
                take(place as usize, bytemuck::pod_read_unaligned(value));
            }
        }
    }

    /// Brings a column of all particles and ghosts up to date at the ghosts; `image` makes the value of an image from
    /// that of the particle.
    pub fn refresh<T: Pod + Send + Sync>(
        &self,
        domain: &Domain,
        tag: u32,
        column: &mut [T],
        image: impl Fn(T, I) -> T + Sync,
    ) {
        debug_assert_eq!(column.len(), self.first + self.origins.len(), "own particles and ghosts");
        self.send(domain, tag, |own, of| image(column[own], of));
        let (own, ghosts) = column.split_at_mut(self.first);
        let origins = &self.origins[..];
        for_each_chunk(ghosts, MANY, |number, ghosts| {
            for (value, origin) in ghosts.iter_mut().zip(&origins[number * MANY..]) {
                if let Some((from, of)) = *origin {
                    *value = image(own[from as usize], of);
                }
            }
        });
        self.receive(domain, tag, |place, value| column[place] = value);
    }

    fn buffers(&self) -> MutexGuard<'_, Buffers> {
        self.buffers.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl<R: Pod> Ghosts<[i32; 3], R> {
    /// Changes which image each ghost of an own particle on this rank is; they stay sorted by image. `change` gets image,
    /// own particle and ghost.
    pub fn change_images(&mut self, mut change: impl FnMut(&mut [i32; 3], u32, u32)) {
        self.images.iter_mut().for_each(|(image, own, ghost)| change(image, *own, *ghost));
        self.images.sort_unstable();
        for &(image, own, ghost) in &self.images {
            self.origins[ghost as usize - self.first] = Some((own, image));
        }
    }

    /// Adds to each own particle's entry what its ghosts on all ranks collected, in the order of ranks and images: the
    /// sum does not depend on who owns the particle. `partial` has an entry for every particle and ghost.
    pub fn gather<const N: usize>(&self, domain: &Domain, tag: u32, partial: &mut [[Real; N]]) {
        if self.links.is_empty() && self.images.is_empty() {
            return;
        }
        let communicator = domain.communicator();
        let Buffers { send, receive, totals } = &mut *self.buffers();
        for link in self.links.iter().filter(|link| !link.places.is_empty()) {
            send.clear();
            link.places.iter().for_each(|&at| send.extend_from_slice(bytemuck::cast_slice(&partial[at as usize])));
            communicator.send(link.rank, tag, send);
        }
        totals.clear();
        totals.resize(self.first * N, 0.0);
        let mut add = |own: usize, values: &[Real]| {
            totals[own * N..(own + 1) * N].iter_mut().zip(values).for_each(|(total, value)| *total += value);
        };
        let add_own = |add: &mut dyn FnMut(usize, &[Real])| {
            let images = |before: bool| self.images.iter().filter(move |image| (image.0 < [0; 3]) == before);
            images(true).for_each(|&(_, own, ghost)| add(own as usize, &partial[ghost as usize]));
            (0..self.first).for_each(|own| add(own, &partial[own]));
            images(false).for_each(|&(_, own, ghost)| add(own as usize, &partial[ghost as usize]));
        };
        let me = communicator.rank();
        let mut own_added = false;
        for link in &self.links {
            if link.rank > me && !own_added {
                add_own(&mut add);
                own_added = true;
            }
            if !link.outgoing.is_empty() {
                communicator.receive(link.rank, tag, receive);
                for (&(own, _), values) in link.outgoing.iter().zip(receive.chunks_exact(N * size_of::<Real>())) {
                    let values: [Real; N] =
                        std::array::from_fn(|n| bytemuck::pod_read_unaligned(&values[8 * n..8 * n + 8]));
                    add(own as usize, &values);
                }
            }
        }
        if !own_added {
            add_own(&mut add);
        }
        partial[..self.first].as_flattened_mut().copy_from_slice(totals);
    }
}
