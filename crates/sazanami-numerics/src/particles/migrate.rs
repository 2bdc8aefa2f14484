//! Migration: particles and what belongs to them go to the ranks that own them now.

use bytemuck::Pod;

use super::columns::ParticleColumns;
use crate::Vector;
use crate::domain::Domain;

/// Records exchanged between all ranks; holds the buffers.
#[derive(Clone, Debug)]
pub struct RecordExchange<R> {
    bytes: Vec<u8>,
    leaving: Vec<R>,
}

impl<R> Default for RecordExchange<R> {
    fn default() -> Self {
        Self { bytes: Vec::new(), leaving: Vec::new() }
    }
}

impl<R: Pod> RecordExchange<R> {
    /// Sends the records that `choose` adds for each other rank to it, under a message `tag`; appends those that arrive
    /// to `records`, in the order of ranks. Collective.
    pub fn exchange(
        &mut self,
        domain: &Domain,
        tag: u32,
        records: &mut Vec<R>,
        mut choose: impl FnMut(usize, &[R], &mut Vec<R>),
    ) {
        let communicator = domain.communicator();
        let others = || (0..communicator.size()).filter(|&rank| rank != communicator.rank());
        for rank in others() {
            self.leaving.clear();
            choose(rank, records, &mut self.leaving);
            communicator.send(rank, tag, bytemuck::cast_slice(&self.leaving));
        }
        for rank in others() {
            communicator.receive(rank, tag, &mut self.bytes);
            records.extend(self.bytes.chunks_exact(size_of::<R>()).map(bytemuck::pod_read_unaligned::<R>));
        }
    }
}

/// Gives particles to the ranks whose parts hold them; holds the buffers.
#[derive(Clone, Debug)]
pub struct Migration<R> {
    owners: Vec<usize>,
    records: Vec<R>,
    exchange: RecordExchange<R>,
}

impl<R> Default for Migration<R> {
    fn default() -> Self {
        Self { owners: Vec::new(), records: Vec::new(), exchange: RecordExchange::default() }
    }
}

impl<R: Pod> Migration<R> {
    /// Finds the new owner of every own particle from its position \[m]. Returns whether there may be another than this
    /// rank.
    pub fn find_owners(&mut self, domain: &Domain, positions: &[Vector]) -> bool {
        self.owners.clear();
        let several = domain.communicator().size() > 1;
        if several {
            self.owners.extend(positions.iter().map(|&x| domain.owner_of(x)));
        }
        several
    }

    /// New owner of each own particle after [`Self::find_owners`].
    #[must_use]
    pub fn owners(&self) -> &[usize] {
        &self.owners
    }

    /// Exchanges the particles whose new owners were found, under a message `tag`. `arrange` puts the records of those
    /// that belong to this rank now into order: first those that stay, then those that arrive by rank. Collective.
    pub fn exchange<C: ParticleColumns<Record = R>>(
        &mut self,
        domain: &Domain,
        tag: u32,
        columns: &mut C,
        arrange: impl FnOnce(&mut [R]),
    ) {
        let Self { owners, records, exchange } = self;
        let me = domain.communicator().rank();
        let of = |rank: usize| owners.iter().enumerate().filter(move |(_, owner)| **owner == rank);
        records.clear();
        records.extend(of(me).map(|(at, _)| columns.record(at)));
        let from = &*columns;
        exchange.exchange(domain, tag, records, |rank, _, leaving| {
            leaving.extend(of(rank).map(|(at, _)| from.record(at)));
        });
        arrange(records);
        columns.truncate(0);
        records.iter().for_each(|record| columns.push(record));
        columns.own_all();
    }
}
