//! The grains of all ranks in one place.

use bytemuck::{Pod, Zeroable};
use sazanami_dem::{Grains, Motion};
use sazanami_numerics::domain::Domain;
use sazanami_numerics::snapshot::{Snapshot, SnapshotError};
use sazanami_numerics::{Quaternion, Real, Vector};

use crate::{BedView, Body};

/// State of a grain as the observers need it, gathered on rank 0.
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C)]
struct Record {
    id: u64,
    body: u32,
    held: u32,
    scale: Real,
    mass: Real,
    position: [Real; 3],
    orientation: [Real; 4],
    velocity: [Real; 3],
    last_contact: Real,
}

/// Grains as columns that observers look at, each with a value per grain.
#[derive(Clone, Debug, Default)]
pub struct BedColumns {
    /// Identifier.
    pub id: Vec<u64>,
    /// Whether the grain is held or has a given motion.
    pub held: Vec<bool>,
    /// Number of the grain's shape among those of [`Self::view`].
    pub body: Vec<u32>,
    /// Factor on the shape.
    pub scale: Vec<Real>,
    /// Mass \[kg].
    pub mass: Vec<Real>,
    /// Position \[m].
    pub position: Vec<Vector>,
    /// Rotation from body to laboratory coordinates.
    pub orientation: Vec<Quaternion>,
    /// Velocity [m/s].
    pub velocity: Vec<Vector>,
    /// Time at which a grain touched another one or a wall last \[s]; negative infinity if it never did.
    pub last_contact: Vec<Real>,
    /// Time on the same clock \[s].
    pub time: Real,
}

impl BedColumns {
    /// The bed for the observers, with the surfaces of the shapes that the grains refer to.
    #[must_use]
    pub fn view<'a>(&'a self, bodies: &'a [Body<'a>]) -> BedView<'a> {
        BedView {
            bodies,
            id: &self.id,
            held: &self.held,
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

/// All grains of all ranks on rank 0, in the order of their identifiers; empty on the other ranks.
///
/// Keep one and gather into it again: its columns keep their memory.
#[derive(Clone, Debug, Default)]
pub struct GatheredBed {
    /// State of the grains, in the order of their identifiers.
    pub grains: BedColumns,
}

impl GatheredBed {
    /// Gathers the grains at `time` on the clock of their engine \[s]. Collective.
    pub fn gather(&mut self, domain: &Domain, grains: &Grains, time: Real) {
        let records = domain.to_first_by((0..grains.owned()).map(|i| record(grains, i)), |record| record.id);
        self.grains.time = time;
        self.unpack(&records);
    }

    fn unpack(&mut self, records: &[Record]) {
        fn refill<T>(column: &mut Vec<T>, records: &[Record], value: impl Fn(&Record) -> T) {
            column.clear();
            column.extend(records.iter().map(value));
        }
        refill(&mut self.grains.id, records, |r| r.id);
        refill(&mut self.grains.held, records, |r| r.held != 0);
        refill(&mut self.grains.body, records, |r| r.body);
        refill(&mut self.grains.scale, records, |r| r.scale);
        refill(&mut self.grains.mass, records, |r| r.mass);
        refill(&mut self.grains.position, records, |r| r.position.into());
        refill(&mut self.grains.orientation, records, |r| Quaternion::from_array(r.orientation));
        refill(&mut self.grains.velocity, records, |r| r.velocity.into());
        refill(&mut self.grains.last_contact, records, |r| r.last_contact);
    }

    /// The bed for the observers, with the surfaces of the shapes that the grains refer to.
    #[must_use]
    pub fn view<'a>(&'a self, bodies: &'a [Body<'a>]) -> BedView<'a> {
        self.grains.view(bodies)
    }

    /// Writes the bed as it lies into a snapshot under names that begin with `prefix`.
    pub fn save(&self, prefix: &str, snapshot: &mut Snapshot) {
        let name = |part: &str| format!("{prefix}{part}");
        snapshot.put_u64(name("id"), self.grains.id.clone());
        snapshot.put_bytes(name("held"), self.grains.held.iter().map(|&held| u8::from(held)).collect());
        snapshot.put_u32(name("shape"), self.grains.body.clone());
        snapshot.put_reals(name("scale"), self.grains.scale.clone());
        snapshot.put_reals(name("mass"), self.grains.mass.clone());
        snapshot.put_vectors(name("position"), &self.grains.position);
        snapshot
            .put_reals(name("orientation"), self.grains.orientation.iter().flat_map(|turn| turn.to_array()).collect());
        snapshot.put_vectors(name("velocity"), &self.grains.velocity);
        snapshot.put_reals(name("last_contact"), self.grains.last_contact.clone());
        snapshot.put_reals(name("time"), vec![self.grains.time]);
    }

    /// Reads a bed from a snapshot.
    ///
    /// # Errors
    /// [`SnapshotError`] if it is not there, or not as [`Self::save`] writes it.
    pub fn restore(prefix: &str, snapshot: &Snapshot) -> Result<Self, SnapshotError> {
        let name = |part: &str| format!("{prefix}{part}");
        let id = snapshot.u64(&name("id"))?.to_vec();
        let count = id.len();
        let reals = |part: &str, width: usize| snapshot.reals_of(&name(part), width * count);
        let vectors = |part: &str| {
            reals(part, 3).map(|values| values.chunks_exact(3).map(Vector::from_slice).collect::<Vec<Vector>>())
        };
        let body = snapshot.u32(&name("shape"))?.to_vec();
        if body.len() != count {
            return Err(SnapshotError::Length { name: name("shape"), expected: count, found: body.len() });
        }
        let held = snapshot.bytes(&name("held"))?;
        if held.len() != count {
            return Err(SnapshotError::Length { name: name("held"), expected: count, found: held.len() });
        }
        let grains = BedColumns {
            held: held.iter().map(|&held| held != 0).collect(),
            id,
            body,
            scale: reals("scale", 1)?.to_vec(),
            mass: reals("mass", 1)?.to_vec(),
            position: vectors("position")?,
            orientation: reals("orientation", 4)?.chunks_exact(4).map(Quaternion::from_slice).collect(),
            velocity: vectors("velocity")?,
            last_contact: reals("last_contact", 1)?.to_vec(),
            time: snapshot.reals_of(&name("time"), 1)?[0],
        };
        Ok(Self { grains })
    }
}

fn record(grains: &Grains, i: usize) -> Record {
    Record {
        id: grains.id[i],
        body: grains.shape[i],
        held: u32::from(grains.motion[i] != Motion::Free),
        scale: grains.scale[i],
        mass: grains.mass[i],
        position: grains.position[i].to_array(),
        orientation: grains.orientation[i].to_array(),
        velocity: grains.velocity[i].to_array(),
        last_contact: grains.last_contact[i],
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_bed_survives_a_snapshot() {
        let record = |id: u64, last_contact: Real| Record {
            id,
            body: 1,
            held: u32::from(id == 8),
            scale: 0.9,
            mass: 2e-7,
            position: [1.0, 2.0, id as Real],
            orientation: [0.5, -0.5, 0.5, 0.5],
            velocity: [0.1, 0.0, -0.3],
            last_contact,
        };
        let mut bed = GatheredBed::default();
        bed.grains.time = 0.5;
        bed.unpack(&[record(3, 0.25), record(8, Real::NEG_INFINITY)]);
        let mut snapshot = Snapshot::default();
        bed.save("before/", &mut snapshot);
        let again = GatheredBed::restore("before/", &snapshot).unwrap();
        assert_eq!(format!("{again:?}"), format!("{bed:?}"));
        assert!(GatheredBed::restore("after/", &snapshot).is_err());
        snapshot.put_reals("before/mass", vec![1.0]);
        assert!(GatheredBed::restore("before/", &snapshot).is_err());
    }
}
