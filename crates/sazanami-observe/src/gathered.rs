//! The grains of all ranks in one place.

use bytemuck::{Pod, Zeroable};
use sazanami_dem::Grains;
use sazanami_numerics::domain::Domain;
use sazanami_numerics::{Quaternion, Real, Vector};

use crate::{BedView, Body};

const BED: u32 = 4100;

/// What the observers need of a grain.
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C)]
struct Record {
    id: u64,
    body: u64,
    scale: Real,
    mass: Real,
    position: [Real; 3],
    orientation: [Real; 4],
    velocity: [Real; 3],
    last_contact: Real,
}

/// All grains of all ranks on rank 0, in the order of their identifiers; empty on the other ranks.
///
/// Keep one and gather into it again: it keeps its memory.
#[derive(Clone, Debug, Default)]
pub struct GatheredBed {
    /// Identifiers.
    pub id: Vec<u64>,
    body: Vec<u32>,
    scale: Vec<Real>,
    mass: Vec<Real>,
    position: Vec<Vector>,
    orientation: Vec<Quaternion>,
    velocity: Vec<Vector>,
    last_contact: Vec<Real>,
    time: Real,
    records: Vec<Record>,
    bytes: Vec<u8>,
}

impl GatheredBed {
    /// Gathers the grains at `time` on the clock of their engine [s]. Collective.
    pub fn gather(&mut self, domain: &Domain, grains: &Grains, time: Real) {
        let communicator = domain.communicator();
        self.time = time;
        self.records.clear();
        self.records.extend((0..grains.owned()).map(|i| record(grains, i)));
        if communicator.rank() != 0 {
            communicator.send(0, BED, bytemuck::cast_slice(&self.records));
            self.records.clear();
        } else {
            for from in 1..communicator.size() {
                communicator.receive(from, BED, &mut self.bytes);
                let parts = self.bytes.chunks_exact(size_of::<Record>());
                self.records.extend(parts.map(bytemuck::pod_read_unaligned::<Record>));
            }
        }
        self.records.sort_unstable_by_key(|record| record.id);
        self.unpack();
    }

    fn unpack(&mut self) {
        fn refill<T>(column: &mut Vec<T>, records: &[Record], value: impl Fn(&Record) -> T) {
            column.clear();
            column.extend(records.iter().map(value));
        }
        let records = &self.records;
        refill(&mut self.id, records, |r| r.id);
        refill(&mut self.body, records, |r| r.body as u32);
        refill(&mut self.scale, records, |r| r.scale);
        refill(&mut self.mass, records, |r| r.mass);
        refill(&mut self.position, records, |r| r.position.into());
        refill(&mut self.orientation, records, |r| Quaternion::from_array(r.orientation));
        refill(&mut self.velocity, records, |r| r.velocity.into());
        refill(&mut self.last_contact, records, |r| r.last_contact);
    }

    /// The bed for the observers, with the surfaces of the shapes that the grains refer to.
    #[must_use]
    pub fn view<'a>(&'a self, bodies: &'a [Body<'a>]) -> BedView<'a> {
        BedView {
            bodies,
            body: &self.body,
            scale: &self.scale,
            mass: &self.mass,
            position: &self.position,
            orientation: &self.orientation,
            velocity: &self.velocity,
            last_contact: Some(&self.last_contact),
            time: self.time,
        }
    }
}

fn record(grains: &Grains, i: usize) -> Record {
    Record {
        id: grains.id[i],
        body: u64::from(grains.shape[i]),
        scale: grains.scale[i],
        mass: grains.mass[i],
        position: grains.position[i].to_array(),
        orientation: grains.orientation[i].to_array(),
        velocity: grains.velocity[i].to_array(),
        last_contact: grains.last_contact[i],
    }
}
