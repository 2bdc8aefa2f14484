//! Complete state of the grains as named arrays, sorted by identifier, for any number of ranks.
//!
//! Neighbour lists are not part of it: they have no influence on any force. The memory of contacts is.

use sazanami_numerics::domain::Domain;
use sazanami_numerics::particles::ParticleColumns;
use sazanami_numerics::snapshot::{Snapshot, SnapshotError};
use sazanami_numerics::{Real, Vector};

use crate::contact::record::ContactRecord;
use crate::engine::{Arrivals, Departures, Engine, Setup};
use crate::error::DemError;
use crate::grain::{ALWAYS_STORED, ATTACHED, GrainRecord};

/// Values attached to a grain that are stored where some are not zero.
const FURTHER: usize = ATTACHED - ALWAYS_STORED;

impl Engine {
    /// Writes the state into `snapshot` on rank 0 under names that begin with `prefix`. All ranks take part.
    pub fn snapshot(&mut self, domain: &Domain, prefix: &str, snapshot: &mut Snapshot) {
        self.collect_records();
        let own = (0..self.grains.owned).map(|g| self.grains.record(g));
        let grains: Vec<GrainRecord> = domain.to_first_by(own, |g| g.id);
        let mut contacts: Vec<ContactRecord> = domain.to_first(&self.records);
        if domain.communicator().rank() != 0 {
            return;
        }
        contacts.sort_unstable_by_key(ContactRecord::key);
        // Both owners of a pair hold the same bits.
        contacts.dedup_by_key(|c| c.key());
        let mut out = Writer { prefix, snapshot };
        out.u64("grain.id", grains.iter().map(|g| g.id));
        out.u32("grain.shape", grains.iter().map(|g| g.shape));
        out.u32("grain.material", grains.iter().map(|g| g.material));
        out.u32("grain.motion", grains.iter().map(|g| g.motion as u32));
        out.reals("grain.scale", grains.iter().map(|g| g.scale));
        out.reals("grain.mass", grains.iter().map(|g| g.mass));
        out.reals("grain.last_contact", grains.iter().map(|g| g.last_contact));
        out.reals("grain.inertia", grains.iter().flat_map(|g| g.inertia));
        out.reals("grain.position", grains.iter().flat_map(|g| g.unwrapped));
        out.reals("grain.orientation", grains.iter().flat_map(|g| g.orientation));
        out.reals("grain.velocity", grains.iter().flat_map(|g| g.velocity));
        out.reals("grain.angular_momentum", grains.iter().flat_map(|g| g.angular_momentum));
        out.reals("grain.contact_force", grains.iter().flat_map(|g| g.contact_force));
        out.reals("grain.contact_torque", grains.iter().flat_map(|g| g.contact_torque));
        out.reals("grain.attached", grains.iter().flat_map(|g| g.attached[..ALWAYS_STORED].iter().copied()));
        let further = || grains.iter().flat_map(|g| &g.attached[ALWAYS_STORED..]).copied();
        if further().any(|value| value != 0.0) {
            out.reals("grain.attached_further", further());
        }
        out.u64("contact.low", contacts.iter().map(|c| c.low));
        out.u64("contact.high", contacts.iter().map(|c| c.high));
        out.u32("contact.image", contacts.iter().flat_map(|c| [c.image[0], c.image[1]].map(i32::cast_unsigned)));
        if domain.periodic()[2] {
            out.u32("contact.image_3", contacts.iter().map(|c| c.image[2].cast_unsigned()));
        }
        out.u32("contact.spheres", contacts.iter().flat_map(|c| [u32::from(c.a), u32::from(c.b)]));
        out.u32("contact.deep", contacts.iter().map(|c| c.marks as u32));
        out.reals("contact.displacement", contacts.iter().flat_map(|c| c.d_t));
        let turns = || contacts.iter().flat_map(|c| c.turn);
        if turns().any(|turn| turn != 0.0) {
            out.reals("contact.turn", turns());
        }
        out.reals("wall.point", self.walls.iter().flat_map(|w| w.point.to_array()));
        out.reals("wall.velocity", self.walls.iter().flat_map(|w| w.velocity.to_array()));
        let edges: Vec<Real> = self.walls.iter().filter_map(|w| w.edges).flatten().collect();
        if !edges.is_empty() {
            out.reals("wall.edges", edges);
        }
        if self.departures.grains > 0 {
            out.reals("departures", self.departures.to_row());
        }
        if self.arrivals.grains > 0 {
            out.reals("arrivals", self.arrivals.to_row());
        }
        out.reals("time", [self.time]);
    }

    /// Restores an engine from `snapshot`, which is read on rank 0 only. `setup` is that of the run that
    /// wrote it; walls are put where they were.
    ///
    /// # Errors
    /// [`DemError::Snapshot`] if something is missing, and those of [`Engine::new`]; on all ranks if on one.
    pub fn restore(domain: &Domain, mut setup: Setup, prefix: &str, snapshot: &Snapshot) -> Result<Self, DemError> {
        let outcome = if domain.communicator().rank() == 0 {
            State::read(prefix, snapshot, &setup).map_err(DemError::from)
        } else {
            Ok(State::default())
        };
        let state = domain.agree(outcome)?;
        let grains = domain.from_first(state.grains);
        let contacts = domain.from_first(state.contacts);
        let others = domain.from_first(state.others);
        let [departures, arrivals] = state.passed.map(|row| domain.from_first(row));
        let time = others[0];
        let (walls, edges) = others[1..].split_at(6 * setup.walls.len());
        for (wall, values) in setup.walls.iter_mut().zip(walls.chunks_exact(6)) {
            wall.point = Vector::from_slice(&values[..3]);
            wall.velocity = Vector::from_slice(&values[3..]);
        }
        let plates = setup.walls.iter_mut().filter_map(|wall| wall.edges.as_mut());
        plates.zip(edges.chunks_exact(2)).for_each(|(edges, values)| *edges = [values[0], values[1]]);
        let bodies = setup.bodies.len();
        let mut engine = Self::from_records(domain, setup, &grains, contacts, time)?;
        engine.departures = Departures::from_row(&departures, bodies);
        engine.arrivals = Arrivals::from_row(&arrivals, bodies);
        Ok(engine)
    }
}

/// Contents of a snapshot.
#[derive(Default)]
struct State {
    grains: Vec<GrainRecord>,
    contacts: Vec<ContactRecord>,
    /// Time, then point and velocity of each wall, then edges of each plate.
    others: Vec<Real>,
    /// See [`Departures::to_row`] and [`Arrivals::to_row`]; empty if no grain has left or was fed in.
    passed: [Vec<Real>; 2],
}

impl State {
    fn read(prefix: &str, snapshot: &Snapshot, setup: &Setup) -> Result<Self, SnapshotError> {
        let from = Reader { prefix, snapshot };
        let id = from.u64("grain.id")?;
        let n = id.len();
        let [shape, material, motion] =
            ["shape", "material", "motion"].map(|name| from.u32_of(&format!("grain.{name}"), n));
        let (shape, material, motion) = (shape?, material?, motion?);
        let real = |name: &str, width: usize| from.reals_of(&format!("grain.{name}"), n * width);
        let (scale, mass, last_contact) = (real("scale", 1)?, real("mass", 1)?, real("last_contact", 1)?);
        let (inertia, unwrapped, orientation) = (real("inertia", 3)?, real("position", 3)?, real("orientation", 4)?);
        let (velocity, momentum) = (real("velocity", 3)?, real("angular_momentum", 3)?);
        let (force, torque) = (real("contact_force", 3)?, real("contact_torque", 3)?);
        let attached = real("attached", ALWAYS_STORED)?;
        let further = match real("attached_further", FURTHER) {
            Err(SnapshotError::Missing { .. }) => None,
            found => Some(found?),
        };
        let grains = (0..n)
            .map(|g| GrainRecord {
                id: id[g],
                shape: shape[g],
                material: material[g],
                motion: u64::from(motion[g]),
                image: [0; 4],
                position: triple(unwrapped, g),
                scale: scale[g],
                mass: mass[g],
                last_contact: last_contact[g],
                skin: 0.0,
                inertia: triple(inertia, g),
                unwrapped: triple(unwrapped, g),
                orientation: std::array::from_fn(|d| orientation[4 * g + d]),
                velocity: triple(velocity, g),
                angular_momentum: triple(momentum, g),
                contact_force: triple(force, g),
                contact_torque: triple(torque, g),
                // Every step collects it anew.
                drag_impulse: [0.0; 3],
                wetness: 1.0,
                moisture: 1.0,
                attached: std::array::from_fn(|d| match d.checked_sub(ALWAYS_STORED) {
                    None => attached[ALWAYS_STORED * g + d],
                    Some(d) => further.map_or(0.0, |further| further[FURTHER * g + d]),
                }),
            })
            .collect();
        let low = from.u64("contact.low")?;
        let n = low.len();
        let high = from.u64_of("contact.high", n)?;
        let (image, spheres) = (from.u32_of("contact.image", 2 * n)?, from.u32_of("contact.spheres", 2 * n)?);
        // There in boxes that are periodic along x3 alone.
        let high_image = match from.u32_of("contact.image_3", n) {
            Err(SnapshotError::Missing { .. }) => None,
            found => Some(found?),
        };
        let (marks, d_t) = (from.u32_of("contact.deep", n)?, from.reals_of("contact.displacement", 3 * n)?);
        // There where contacts resist rolling; earlier versions had no such spring.
        let turn = match from.reals_of("contact.turn", 3 * n) {
            Err(SnapshotError::Missing { .. }) => None,
            found => Some(found?),
        };
        let contacts = (0..n)
            .map(|c| ContactRecord {
                low: low[c],
                high: high[c],
                image: [image[2 * c], image[2 * c + 1], high_image.map_or(0, |image| image[c])].map(u32::cast_signed),
                a: spheres[2 * c] as u16,
                b: spheres[2 * c + 1] as u16,
                marks: u64::from(marks[c]),
                d_t: triple(d_t, c),
                turn: turn.map_or([0.0; 3], |turn| triple(turn, c)),
            })
            .collect();
        let walls = setup.walls.len();
        let (point, velocity) = (from.reals_of("wall.point", 3 * walls)?, from.reals_of("wall.velocity", 3 * walls)?);
        let mut others = vec![from.reals_of("time", 1)?[0]];
        (0..walls).for_each(|w| others.extend(triple(point, w).into_iter().chain(triple(velocity, w))));
        let plates = setup.walls.iter().filter(|wall| wall.edges.is_some()).count();
        if plates > 0 {
            others.extend_from_slice(from.reals_of("wall.edges", 2 * plates)?);
        }
        let passed = |name: &str| match from.reals_of(name, 5 + setup.bodies.len()) {
            Err(SnapshotError::Missing { .. }) => Ok(Vec::new()),
            found => found.map(<[Real]>::to_vec),
        };
        Ok(Self { grains, contacts, others, passed: [passed("departures")?, passed("arrivals")?] })
    }
}

fn triple(values: &[Real], at: usize) -> [Real; 3] {
    std::array::from_fn(|d| values[3 * at + d])
}

struct Writer<'a> {
    prefix: &'a str,
    snapshot: &'a mut Snapshot,
}

impl Writer<'_> {
    fn u64(&mut self, name: &str, values: impl Iterator<Item = u64>) {
        self.snapshot.put_u64(format!("{}{name}", self.prefix), values.collect());
    }

    fn u32(&mut self, name: &str, values: impl Iterator<Item = u32>) {
        self.snapshot.put_u32(format!("{}{name}", self.prefix), values.collect());
    }

    fn reals(&mut self, name: &str, values: impl IntoIterator<Item = Real>) {
        self.snapshot.put_reals(format!("{}{name}", self.prefix), values.into_iter().collect());
    }
}

struct Reader<'a> {
    prefix: &'a str,
    snapshot: &'a Snapshot,
}

impl<'a> Reader<'a> {
    fn u64(&self, name: &str) -> Result<&'a [u64], SnapshotError> {
        self.snapshot.u64(&self.full(name))
    }

    fn u64_of(&self, name: &str, expected: usize) -> Result<&'a [u64], SnapshotError> {
        self.snapshot.u64_of(&self.full(name), expected)
    }

    fn u32_of(&self, name: &str, expected: usize) -> Result<&'a [u32], SnapshotError> {
        self.snapshot.u32_of(&self.full(name), expected)
    }

    fn reals_of(&self, name: &str, expected: usize) -> Result<&'a [Real], SnapshotError> {
        self.snapshot.reals_of(&self.full(name), expected)
    }

    fn full(&self, name: &str) -> String {
        format!("{}{name}", self.prefix)
    }
}
