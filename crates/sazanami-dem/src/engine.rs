//! The engine that moves grains: as many sub-steps as the contacts need.

mod checks;
mod energy;
mod impulses;
mod leaving;
mod lists;
mod network;
mod report;
mod setup;
mod substep;

use sazanami_numerics::domain::Domain;
use sazanami_numerics::particles::ParticleColumns;
use sazanami_numerics::{Matrix, Real, Vector};
use sazanami_parallel::for_each_chunk;

use crate::body::Body;
use crate::contact::block::Block;
use crate::contact::counters::Counters;
use crate::contact::force::PairConstants;
use crate::contact::incoming::Incoming;
use crate::contact::laws::Interactions;
use crate::contact::neighbours::ListBuilder;
use crate::contact::pace::{PACES, Pace};
use crate::contact::record::ContactRecord;
use crate::contact::search::SphereArrays;
use crate::error::DemError;
use crate::ghosts::{self, GrainExchange};
use crate::grain::{Grain, GrainRecord, Grains, Motion, ROWS, image_position};
use crate::motion::{MassProperties, Pose, turn_balls};
use crate::selection::Selection;
use crate::wall::Wall;
use energy::EnergyBook;
pub use leaving::{Arrivals, Departures};
use lists::FormerList;
pub use report::ContactReport;
use report::overlap_error;
pub use setup::{Drag, Loads, Setup, Substeps, Vicinity};
use substep::Kick;

/// Overlap over the smaller contact sphere's radius above which a run ends.
pub const LARGEST_OVERLAP: Real = 0.8;
/// Largest skin of a fast grain over its bounding radius.
const LARGEST_SKIN: Real = 0.6;

/// Rigid grains, their contacts, and walls.
#[derive(Debug)]
pub struct Engine {
    pub(crate) bodies: Vec<Body>,
    arrays: Vec<SphereArrays>,
    spheres: Vec<[Real; 4]>,
    /// Number of the first of each body's among `spheres`.
    first_spheres: Vec<u32>,
    pub(crate) interactions: Interactions,
    laws: Vec<PairConstants>,
    pub(crate) walls: Vec<Wall>,
    region: [Vector; 2],
    ghost_margin: Real,
    pub(crate) grains: Grains,
    pub(crate) time: Real,
    period: Vector,
    poses: Vec<Pose>,
    rotations: Vec<Matrix>,
    mass_properties: Vec<MassProperties>,
    /// Angles that balls have turned through in the present call \[rad].
    turned: Vec<Vector>,
    travel: Vec<Real>,
    /// Class of speed of each grain when the lists were built.
    paces: Vec<Pace>,
    /// Upper bound of the travel since the lists were built of every grain of a pace or a slower one \[m].
    largest_travel: [Real; PACES],
    /// Largest increments of own grains' travel that are not in `largest_travel` yet, by pace \[m].
    pending_travel: [Real; PACES],
    wall_travel: Vec<Real>,
    blocks: Vec<Block>,
    /// Contiguous counters of the last sub-step, one per block.
    block_counters: Vec<Counters>,
    former: Vec<Block>,
    incoming: Incoming,
    builder: ListBuilder,
    former_list: FormerList,
    exchange: GrainExchange,
    pub(crate) records: Vec<ContactRecord>,
    /// Whether blocks and records belong to the present grains: false before the first list.
    listed: bool,
    /// Time from the last evaluation of contacts to the present places \[s].
    since_contacts: Real,
    /// Overlap over a contact sphere's radius above which a run ends.
    largest_overlap_allowed: Real,
    /// Whether a grain changes its owner in the step in which it crosses a boundary between ranks.
    owned_promptly: bool,
    /// Sides through which grains leave, by direction, lower and upper.
    leave_through: [[bool; 2]; 3],
    pub(crate) departures: Departures,
    pub(crate) arrivals: Arrivals,
    arrivals_expected: bool,
    time_step: Real,
    book: EnergyBook,
    /// Grains that are watched, by their identifiers, and the mean force of contacts on them over the last call of [`Engine::advance`], as far
    /// as they were on this rank \[N].
    watched: Vec<(u64, Vector)>,
}

/// State of a sub-step, worst wins.
const FINE: u8 = 0;
const EXPIRED: u8 = 1;
const FAILED: u8 = 2;

impl Engine {
    /// Places grains. Every rank gives the same list and keeps those in its part of the domain.
    ///
    /// # Errors
    /// [`DemError::BadGrain`] for a grain that makes no sense, [`DemError::BoxTooShort`] for a
    /// periodic direction in which a grain could touch its own image.
    pub fn new(domain: &Domain, setup: Setup, grains: &[Grain]) -> Result<Self, DemError> {
        let records = GrainRecord::of_all(grains, &setup.bodies, setup.interactions.materials())?;
        Self::from_records(domain, setup, &records, Vec::new(), 0.0)
    }

    /// Places grains with the history of their contacts; `records` are sorted by identifier and key.
    pub(crate) fn from_records(
        domain: &Domain,
        setup: Setup,
        grains: &[GrainRecord],
        records: Vec<ContactRecord>,
        time: Real,
    ) -> Result<Self, DemError> {
        let (period, bodies) = (ghosts::period(domain), setup.bodies.len());
        let mut engine = Self {
            arrays: setup.bodies.iter().map(SphereArrays::new).collect(),
            spheres: setup.bodies.iter().flat_map(Body::packed_spheres).collect(),
            first_spheres: setup
                .bodies
                .iter()
                .scan(0, |next, body| Some(std::mem::replace(next, *next + body.spheres() as u32)))
                .collect(),
            laws: setup.interactions.constants(),
            wall_travel: vec![0.0; setup.walls.len()],
            bodies: setup.bodies,
            interactions: setup.interactions,
            walls: setup.walls,
            region: setup.region,
            ghost_margin: setup.ghost_margin,
            grains: Grains::default(),
            time,
            period,
            poses: Vec::new(),
            rotations: Vec::new(),
            mass_properties: Vec::new(),
            turned: Vec::new(),
            travel: Vec::new(),
            paces: Vec::new(),
            largest_travel: [0.0; PACES],
            pending_travel: [0.0; PACES],
            blocks: Vec::new(),
            block_counters: Vec::new(),
            former: Vec::new(),
            incoming: Incoming::default(),
            builder: ListBuilder::default(),
            former_list: FormerList::default(),
            exchange: GrainExchange::default(),
            records,
            listed: false,
            since_contacts: 0.0,
            largest_overlap_allowed: LARGEST_OVERLAP,
            owned_promptly: false,
            leave_through: [[false; 2]; 3],
            departures: Departures::none(bodies),
            arrivals: Arrivals::none(bodies),
            arrivals_expected: false,
            time_step: Real::INFINITY,
            book: EnergyBook::default(),
            watched: Vec::new(),
        };
        engine.check_box(domain, grains)?;
        let rank = domain.communicator().rank();
        for record in grains {
            let record = record.as_image(ghosts::image_in_box(domain, record.unwrapped), period);
            if domain.owner_of(Vector::from_array(record.position)) == rank {
                engine.grains.push(&record);
            }
        }
        engine.grains.own_all();
        engine.time_step = engine.longest_time_step(domain);
        engine.renew(domain, true)?;
        Ok(engine)
    }

    /// Adds grains to those there are, whose contacts keep their memory. Every rank gives the same list.
    ///
    /// # Errors
    /// As [`Self::new`].
    pub fn insert(&mut self, domain: &Domain, grains: &[Grain]) -> Result<(), DemError> {
        if grains.is_empty() {
            return Ok(());
        }
        let new = GrainRecord::of_all(grains, &self.bodies, self.interactions.materials())?;
        self.check_box(domain, &new)?;
        let known = &self.grains.id[..self.grains.owned];
        let twice = known.iter().find(|id| new.binary_search_by_key(*id, |r| r.id).is_ok());
        domain.agree(twice.map_or(Ok(()), |id| Err(DemError::not_unique(*id))))?;
        self.collect_records();
        let rank = domain.communicator().rank();
        let mut records: Vec<GrainRecord> = (0..self.grains.owned).map(|g| self.grains.record(g)).collect();
        records.extend(new.iter().filter(|r| domain.owner_of(Vector::from_array(r.unwrapped)) == rank));
        records.sort_unstable_by_key(|r| r.id);
        self.grains.truncate(0);
        records.iter().for_each(|record| self.grains.push(record));
        self.grains.own_all();
        self.time_step = self.longest_time_step(domain);
        self.book.window = None;
        self.listed = false;
        self.renew(domain, true)
    }

    /// Watches the contacts of these grains from the next call of [`Self::advance`] on, in place of those that it watched.
    pub fn watch(&mut self, grains: impl Iterator<Item = u64>) {
        self.watched = grains.map(|id| (id, Vector::ZERO)).collect();
    }

    /// Mean force of contacts on each watched grain over the last call of [`Self::advance`], as far as it was on this rank \[N]: the sum over
    /// the ranks is that on the grain.
    #[must_use]
    pub fn watched(&self) -> &[(u64, Vector)] {
        &self.watched
    }

    /// Adds the `part` of the contact forces of a sub-step to the means of watched grains.
    fn book_watched(&mut self, part: Real) {
        let Grains { id, contact_force, owned, .. } = &self.grains;
        for (watched, force) in &mut self.watched {
            if let Ok(n) = id[..*owned].binary_search(watched) {
                *force += part * contact_force[n];
            }
        }
    }

    /// All grains this rank knows.
    #[must_use]
    pub fn grains(&self) -> &Grains {
        &self.grains
    }

    /// The numbers that a coupled solver keeps with the grains. Those of an own grain travel with it and are
    /// stored; a ghost has those that its owner had when the lists were last renewed, and what was set since.
    pub fn attached_mut(&mut self) -> &mut [[Real; crate::ATTACHED]] {
        &mut self.grains.attached
    }

    /// The wetness of the grains and ghosts ([`Grains::wetness`]); those of ghosts are the caller's to set too.
    pub fn wetness_mut(&mut self) -> &mut [Real] {
        &mut self.grains.wetness
    }

    /// Sets the moisture of each grain and ghost ([`Grains::moisture`]) to `moisture` of its number and of the values kept with it
    /// ([`Self::attached_mut`]), which it may change too. What bridges have more or less by it no contact has given.
    pub fn set_moisture(&mut self, moisture: impl Fn(usize, &mut [Real; crate::ATTACHED]) -> Real + Sync) {
        let before = self.book.window.map(|_| self.energy_of_bridges());
        let columns = (&mut self.grains.moisture[..], &mut self.grains.attached[..]);
        for_each_chunk(columns, ROWS, |number, (moist, attached)| {
            for (n, (moist, attached)) in moist.iter_mut().zip(attached).enumerate() {
                *moist = moisture(number * ROWS + n, attached);
            }
        });
        if let (Some(before), Some(mut window)) = (before, self.book.window) {
            window.moistened += self.energy_of_bridges() - before;
            self.book.window = Some(window);
        }
    }

    /// Surroundings nearer than `margin` \[m] to this rank's part; where a side of the box is not periodic, all that is beyond it.
    ///
    /// With a margin up to [`Setup::ghost_margin`] every image of a grain in it has an entry. Whether there are entries
    /// farther away, as beyond the corners of two periodic directions, depends on when lists were renewed: a sum whose order is to follow
    /// from the state alone omits them. There are no images beyond a whole period.
    #[must_use]
    pub fn vicinity(&self, domain: &Domain, margin: Real) -> Vicinity {
        let rank = domain.communicator().rank();
        let (mut lower, mut upper) = domain.rank_box(rank);
        let (start, cells) = domain.decomposition().part(rank);
        let mut farthest = self.period;
        for d in (0..3).filter(|&d| !domain.periodic()[d]) {
            farthest[d] = Real::INFINITY;
            if start[d] == 0 {
                lower[d] = Real::NEG_INFINITY;
            }
            if start[d] + cells[d] == domain.grid().cells[d] {
                upper[d] = Real::INFINITY;
            }
        }
        Vicinity { lower, upper, margin, farthest }
    }

    /// Width of the layer around a rank's part in which it holds ghosts of all grains ([`Setup::ghost_margin`]) \[m].
    #[must_use]
    pub fn ghost_margin(&self) -> Real {
        self.ghost_margin
    }

    /// Position of the periodic image `image` of a grain whose unwrapped position is `unwrapped` \[m].
    #[must_use]
    pub fn image_position(&self, unwrapped: Vector, image: [i32; 3]) -> Vector {
        image_position(unwrapped, image, self.period)
    }

    /// Bodies by number of the shape.
    #[must_use]
    pub fn bodies(&self) -> &[Body] {
        &self.bodies
    }

    /// Contact laws.
    #[must_use]
    pub fn interactions(&self) -> &Interactions {
        &self.interactions
    }

    /// Changes the contact laws; the memory of contacts stays.
    pub fn set_interactions(&mut self, domain: &Domain, interactions: Interactions) {
        self.laws = interactions.constants();
        self.interactions = interactions;
        self.time_step = self.longest_time_step(domain);
        self.book.window = None;
        // Pairs hold numbers and factors of their law.
        self.collect_records();
        self.listed = false;
    }

    /// Leaves this part of the stiffness of every contact from now on, and ends a sub-step in which one is deeper than `largest_overlap`,
    /// over the smaller radius. Restitution and friction stay. All ranks take part.
    pub fn soften(&mut self, domain: &Domain, stiffness: Real, largest_overlap: Real) {
        let mut interactions = self.interactions.clone();
        interactions.scale_stiffness(stiffness);
        self.set_interactions(domain, interactions);
        self.largest_overlap_allowed = largest_overlap;
    }

    /// The grains of this rank in their present places, at rest.
    #[must_use]
    pub fn at_rest(&self) -> Vec<Grain> {
        let grains = self.grains();
        (0..grains.owned())
            .map(|g| Grain {
                id: grains.id[g],
                shape: grains.shape[g],
                material: grains.material[g],
                scale: grains.scale[g],
                density: grains.mass[g] / (self.bodies()[grains.shape[g] as usize].volume * grains.scale[g].powi(3)),
                mass: Some(grains.mass[g]),
                motion: grains.motion[g],
                position: grains.position[g],
                orientation: grains.orientation[g],
                velocity: Vector::ZERO,
                angular_velocity: Vector::ZERO,
            })
            .collect()
    }

    /// Walls, where they are now.
    #[must_use]
    pub fn walls(&self) -> &[Wall] {
        &self.walls
    }

    /// Gives all walls but plates, and the grains that are glued to them, a velocity [m/s]. All ranks take part.
    pub fn set_wall_velocities(&mut self, domain: &Domain, velocity: Vector) {
        let Grains { motion, velocity: velocities, owned, .. } = &self.grains;
        let mut glued = motion[..*owned].iter().zip(velocities).filter(|(motion, _)| **motion == Motion::WithWalls);
        let same = self.walls.iter().all(|wall| wall.edges.is_some() || wall.velocity == velocity)
            && glued.all(|(_, v)| *v == velocity);
        if domain.max(if same { 0.0 } else { 1.0 }) == 0.0 {
            return;
        }
        self.walls.iter_mut().filter(|wall| wall.edges.is_none()).for_each(|wall| wall.velocity = velocity);
        for g in 0..self.grains.owned {
            if self.grains.motion[g] == Motion::WithWalls && self.grains.velocity[g] != velocity {
                self.set_velocity(g, velocity, Vector::ZERO);
            }
        }
        self.refresh_ghosts(domain);
    }

    /// Puts the edges of plate `number`, counted among the plates, to heights \[m], and lets it rise [m/s]. Lists of pairs hold as
    /// long as it does not come nearer to a grain than it would by its own motion.
    ///
    /// # Errors
    /// [`DemError::NoPlate`] if there are fewer plates.
    pub fn set_plate(&mut self, number: usize, edges: [Real; 2], speed: Real) -> Result<(), DemError> {
        let plate = self.walls.iter_mut().filter(|wall| wall.edges.is_some()).nth(number);
        let plate = plate.ok_or(DemError::NoPlate { number })?;
        (plate.edges, plate.velocity) = (Some(edges), Vector::new(0.0, 0.0, speed));
        Ok(())
    }

    /// Time on the grains' clock \[s].
    #[must_use]
    pub fn time(&self) -> Real {
        self.time
    }

    /// Longest sub-step that resolves every contact and lets every grain rest on a face \[s]; see [`crate::stability`].
    #[must_use]
    pub fn contact_time_step(&self) -> Real {
        self.time_step
    }

    /// Number of sub-steps for a step of length `dt` \[s]. All ranks take part.
    #[must_use]
    pub fn substeps(&self, domain: &Domain, dt: Real, substeps: Substeps) -> usize {
        match substeps {
            Substeps::Auto => ((dt / self.present_time_step(domain)).ceil() as usize).max(1),
            Substeps::Fixed(n) => n.max(1),
        }
    }

    /// Moves the grains by `dt` \[s] under contact forces, `loads` and `gravity` [m/s^2].
    ///
    /// Afterwards every grain belongs to the rank whose part holds its centre of mass or has left it
    /// by less than the skin of the neighbour list, and ghosts are up to date.
    ///
    /// # Errors
    /// [`DemError::NotFinite`], [`DemError::GrainEscaped`], [`DemError::OverlapTooLarge`] or
    /// [`DemError::EnergyGained`]; on all ranks if on one.
    pub fn advance(
        &mut self,
        domain: &Domain,
        loads: &Loads<'_>,
        gravity: Vector,
        dt: Real,
        substeps: Substeps,
    ) -> Result<ContactReport, DemError> {
        let count = self.substeps(domain, dt, substeps);
        let h = dt / count as Real;
        let mut report = ContactReport { substeps: count, ..ContactReport::default() };
        let start = self.time;
        self.grains.drag_impulse.fill(Vector::ZERO);
        self.turned.clear();
        self.turned.resize(self.grains.owned, Vector::ZERO);
        self.open_book(loads, gravity, dt);
        self.watched.iter_mut().for_each(|(_, force)| *force = Vector::ZERO);
        let watches = !self.watched.is_empty();
        let mut by_walls = 0.0;
        let state = self.drift(0.5 * h);
        self.refresh_poses(domain, false);
        let mut state = Self::worst(domain, state);
        let mut counters = Counters::default();
        let (mut deep, mut ruptures) = (0, 0);
        let mut deepest = Counters::default();
        for step in 0..count {
            if state >= EXPIRED || !self.listed {
                self.check_finite(domain, step)?;
                self.renew(domain, false)?;
                report.list_renewals += 1;
            }
            counters = self.contacts(h);
            deep += counters.deepened;
            ruptures += counters.ruptures;
            deepest = deepest.merged(counters);
            report.impulse_on_walls += h * counters.on_walls;
            by_walls += h * counters.by_walls;
            let last = step + 1 == count;
            self.time = start + dt * ((step + 1) as Real / count as Real);
            state =
                self.kick_and_drift(&Kick { loads, gravity, h, keep: last || watches }, if last { 0.5 * h } else { h });
            self.book_watched(1.0 / count as Real);
            if counters.deepest > self.largest_overlap_allowed {
                state = FAILED;
            }
            if last {
                turn_balls(&mut self.grains.orientation[..self.grains.owned], &self.turned);
            }
            self.refresh_poses(domain, last);
            state = Self::worst(domain, state);
            if state == FAILED {
                let outcome = if counters.deepest > self.largest_overlap_allowed {
                    Err(overlap_error(&counters, self.largest_overlap_allowed, step))
                } else {
                    Ok(())
                };
                domain.agree(outcome)?;
            }
        }
        self.since_contacts = 0.5 * h;
        self.check_finite(domain, count)?;
        self.close_book(domain, (loads, gravity, dt), by_walls, &mut report)?;
        self.finish(domain)?;
        self.report(domain, &mut report, [counters, deepest], [deep, ruptures]);
        Ok(report)
    }

    /// Worst state of a sub-step over the ranks.
    fn worst(domain: &Domain, state: u8) -> u8 {
        domain.max(Real::from(state)) as u8
    }

    /// Adds to each own grain's entry what its ghosts on all ranks collected, in an order that does
    /// not depend on who owns the grain. `partial` has an entry for every grain and ghost.
    pub fn gather_to_owners<const N: usize>(&self, domain: &Domain, partial: &mut [[Real; N]]) {
        self.exchange.gather(domain, partial);
    }

    /// Gives each ghost the entry of the grain that it is a copy of. `values` has an entry for every grain and ghost.
    pub fn share_with_ghosts<const N: usize>(&self, domain: &Domain, values: &mut [[Real; N]]) {
        self.exchange.share(domain, values);
    }

    /// Number of grains that own grain `own` touched in the last sub-step.
    #[must_use]
    pub fn touched_grains(&self, own: usize) -> usize {
        let block = &self.blocks[own / ROWS];
        let row = own - block.first;
        let range = block.starts[row] as usize..block.starts[row + 1] as usize;
        block.pairs[range].iter().filter(|p| p.meets()).count() + self.incoming.touching(&self.blocks, own)
    }

    /// Whether own grain `own` touched another grain in the last sub-step.
    #[must_use]
    pub fn touches_a_grain(&self, own: usize) -> bool {
        self.touched_grains(own) > 0
    }

    /// Lets the grains whose identifier `which` takes move by the forces on them from now on; returns how many did not before,
    /// over all ranks. Collective.
    ///
    /// # Errors
    /// Those of new lists of neighbours.
    pub fn release(&mut self, domain: &Domain, which: impl Fn(u64) -> bool + Sync) -> Result<usize, DemError> {
        let Grains { id, motion, owned, .. } = &mut self.grains;
        let held = |g: usize| motion[g] != Motion::Free && which(id[g]);
        let mut found = Vec::new();
        Selection::default().collect(*owned, |g| held(g).then_some(g), &mut found);
        found.iter().for_each(|&g| motion[g] = Motion::Free);
        let [count] = domain.sum([found.len() as Real]);
        if count > 0.0 {
            self.time_step = self.longest_time_step(domain);
            self.book.window = None;
            self.renew(domain, false)?;
        }
        Ok(count as usize)
    }

    /// Overlap of contact spheres over the smaller radius beyond which a sub-step fails; infinite where any is accepted.
    #[must_use]
    pub fn largest_overlap_allowed(&self) -> Real {
        self.largest_overlap_allowed
    }

    /// Accepts any overlap of contact spheres, or restores the limit of [`LARGEST_OVERLAP`].
    pub fn allow_any_overlap(&mut self, allowed: bool) {
        self.largest_overlap_allowed = if allowed { Real::INFINITY } else { LARGEST_OVERLAP };
    }

    /// Whether grains change their owner at the end of the step in which they cross a boundary between ranks; else they may
    /// stay until they have left it behind by their skin. Sums over the grains of each rank then depend on where the
    /// grains are, not on where they came from, and have the same bits after a restart.
    pub fn own_promptly(&mut self, promptly: bool) {
        self.owned_promptly = promptly;
    }

    /// Brings the ghosts up to date after own grains were changed.
    pub fn refresh_ghosts(&mut self, domain: &Domain) {
        self.refresh_poses(domain, true);
        self.place();
    }

    /// Shortest periodic edge in which a grain of bounding radius `largest` \[m] does not meet its own image \[m].
    #[must_use]
    pub fn shortest_period(largest: Real) -> Real {
        2.0 * largest * (1.0 + LARGEST_SKIN)
    }
}
