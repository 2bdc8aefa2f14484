//! The engine that moves grains: as many sub-steps as the contacts need.

use std::sync::atomic::{AtomicU8, Ordering};

use sazanami_numerics::domain::Domain;
use sazanami_numerics::{Real, Vector};
use sazanami_parallel::{for_each_chunk, max_over, sum_over};

use crate::body::Body;
use crate::contact::block::{Block, ROWS};
use crate::contact::incoming::Incoming;
use crate::contact::law::Constants;
use crate::contact::neighbours::{ListBuilder, Matter, Previous};
use crate::contact::search::SphereArrays;
use crate::contact::{Census, ContactRecord, World, Wrench};
use crate::error::DemError;
use crate::ghosts::{self, Exchange};
use crate::grain::{Grain, GrainRecord, Grains, Motion, imaged};
use crate::material::Interactions;
use crate::motion::{Frame, Inert, Leap, Moving};
use crate::wall::Wall;

/// Overlap over radius above which a run ends.
const TOO_DEEP: Real = 0.8;
/// Sub-step over pi sqrt(m*/K).
const AUTO: Real = 0.057;
/// How far a resting grain may go before lists are renewed, over its bounding radius.
const REACH: Real = 0.08;
/// How far a fast grain may go, over its bounding radius.
const FARTHEST: Real = 0.6;
/// Number of sub-steps that a fast grain's reach is meant to last.
const HORIZON: Real = 150.0;

/// What an engine is made of, besides grains.
#[derive(Clone, Debug)]
pub struct Setup {
    /// Bodies by number of the shape.
    pub bodies: Vec<Body>,
    /// Contact laws.
    pub interactions: Interactions,
    /// Walls.
    pub walls: Vec<Wall>,
    /// Corners of the region that centres of mass may not leave [m]; components may be infinite.
    pub region: [Vector; 2],
    /// Every grain whose surface comes this near to a rank's part is known there [m].
    pub ghost_margin: Real,
}

/// Forces and torques from outside on this rank's grains, constant over a call.
#[derive(Clone, Copy, Debug, Default)]
pub struct Loads<'a> {
    /// Force on each own grain [N]; empty: none.
    pub force: &'a [Vector],
    /// Torque about the centre of mass of each own grain [N m]; empty: none.
    pub torque: &'a [Vector],
}

impl Loads<'_> {
    /// No loads.
    #[must_use]
    pub fn none() -> Self {
        Self::default()
    }
}

/// How many sub-steps a call takes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Substeps {
    /// As many as [`Engine::contact_time_step`] asks for.
    Auto,
    /// This number.
    Fixed(usize),
}

/// What happened among the grains of all ranks during a call.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ContactReport {
    /// Sub-steps taken.
    pub substeps: usize,
    /// Touching pairs (of grains, or of a grain and a wall) in the last sub-step.
    pub pairs: usize,
    /// Touching spheres in the last sub-step.
    pub contacts: usize,
    /// Contacts that became deeper than 20 % of the smaller sphere's radius during the call.
    pub deep_contacts: usize,
    /// Largest overlap over the smaller sphere's radius during the call.
    pub largest_overlap: Real,
    /// The grains (or grain and wall) of the largest overlap.
    pub largest_overlap_ids: [u64; 2],
    /// Largest speed of a centre of mass at the end [m/s].
    pub largest_speed: Real,
    /// Kinetic energy at the end, rotation included [J].
    pub kinetic_energy: Real,
    /// Momentum given to the walls during the call [N s].
    pub impulse_on_walls: Vector,
    /// Times the neighbour lists were renewed.
    pub list_renewals: usize,
}

/// Rigid grains, their contacts, and walls.
#[derive(Debug)]
pub struct Engine {
    pub(crate) bodies: Vec<Body>,
    arrays: Vec<SphereArrays>,
    spheres: Vec<[Real; 4]>,
    pub(crate) interactions: Interactions,
    constants: Vec<Constants>,
    pub(crate) walls: Vec<Wall>,
    region: [Vector; 2],
    ghost_margin: Real,
    pub(crate) grains: Grains,
    pub(crate) time: Real,
    period: Vector,
    frames: Vec<Frame>,
    inert: Vec<Inert>,
    budget: Vec<Real>,
    wall_budget: Vec<Real>,
    reach: Vec<Real>,
    blocks: Vec<Block>,
    former: Vec<Block>,
    incoming: Incoming,
    builder: ListBuilder,
    exchange: Exchange,
    pub(crate) records: Vec<ContactRecord>,
    /// Whether blocks and records describe the present grains: false before the first list.
    listed: bool,
    time_step: Real,
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
        let mut records = Vec::with_capacity(grains.len());
        for grain in grains {
            if (grain.material as usize) >= setup.interactions.materials() {
                return Err(DemError::BadGrain { id: grain.id, what: "there is no such material".to_string() });
            }
            records.push(GrainRecord::new(grain, &setup.bodies)?);
        }
        records.sort_unstable_by_key(|r| r.id);
        if let Some(twice) = records.windows(2).find(|w| w[0].id == w[1].id) {
            return Err(DemError::BadGrain { id: twice[0].id, what: "the identifier is not unique".to_string() });
        }
        Self::from_records(domain, setup, &records, Vec::new(), 0.0)
    }

    /// Places grains with the contacts they remember; `records` are sorted by identifier and key.
    pub(crate) fn from_records(
        domain: &Domain,
        setup: Setup,
        grains: &[GrainRecord],
        records: Vec<ContactRecord>,
        time: Real,
    ) -> Result<Self, DemError> {
        let period = ghosts::period(domain);
        let mut engine = Self {
            arrays: setup.bodies.iter().map(SphereArrays::new).collect(),
            spheres: setup.bodies.iter().flat_map(Body::packed_spheres).collect(),
            constants: setup.interactions.laws().iter().map(Constants::new).collect(),
            wall_budget: vec![0.0; setup.walls.len()],
            bodies: setup.bodies,
            interactions: setup.interactions,
            walls: setup.walls,
            region: setup.region,
            ghost_margin: setup.ghost_margin,
            grains: Grains::default(),
            time,
            period,
            frames: Vec::new(),
            inert: Vec::new(),
            budget: Vec::new(),
            reach: Vec::new(),
            blocks: Vec::new(),
            former: Vec::new(),
            incoming: Incoming::default(),
            builder: ListBuilder::default(),
            exchange: Exchange::default(),
            records,
            listed: false,
            time_step: Real::INFINITY,
        };
        engine.check_box(domain, grains)?;
        let rank = domain.communicator().rank();
        for record in grains {
            let mut record = *record;
            for d in (0..2).filter(|&d| period[d] > 0.0) {
                let turns = (record.home[d] - domain.grid().lower[d]) / period[d];
                record.image[d] = -turns.floor() as i32;
            }
            let position = imaged(Vector::from_array(record.home), record.image, period);
            if domain.owner_of(position) == rank {
                engine.grains.push(&record, period);
            }
        }
        engine.grains.owned = engine.grains.len();
        engine.time_step = engine.stable_time_step(domain);
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
        self.collect_records();
        let mut records: Vec<GrainRecord> = (0..self.grains.owned).map(|g| self.grains.record(g)).collect();
        let rank = domain.communicator().rank();
        for grain in grains {
            let record = GrainRecord::new(grain, &self.bodies)?;
            if domain.owner_of(grain.position) == rank {
                records.push(record);
            }
        }
        records.sort_unstable_by_key(|r| r.id);
        let twice = records.windows(2).find(|w| w[0].id == w[1].id);
        domain.agree(twice.map_or(Ok(()), |w| {
            Err(DemError::BadGrain { id: w[0].id, what: "the identifier is not unique".to_string() })
        }))?;
        self.check_box(domain, &records)?;
        self.grains.clear();
        for record in &records {
            self.grains.push(record, self.period);
        }
        self.grains.owned = self.grains.len();
        self.time_step = self.stable_time_step(domain);
        self.listed = false;
        self.renew(domain, true)
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

    /// Where an image of a grain is whose unwrapped position is `home` [m].
    #[must_use]
    pub fn imaged(&self, home: Vector, image: [i32; 2]) -> Vector {
        imaged(home, image, self.period)
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
        self.constants = interactions.laws().iter().map(Constants::new).collect();
        self.interactions = interactions;
        self.time_step = self.stable_time_step(domain);
        // Pairs hold numbers and factors of their law.
        self.collect_records();
        self.listed = false;
    }

    /// Walls, where they are now.
    #[must_use]
    pub fn walls(&self) -> &[Wall] {
        &self.walls
    }

    /// Gives a wall a velocity [m/s].
    pub fn set_wall_velocity(&mut self, wall: usize, velocity: Vector) {
        self.walls[wall].velocity = velocity;
    }

    /// Time on the grains' clock [s].
    #[must_use]
    pub fn time(&self) -> Real {
        self.time
    }

    /// Longest sub-step that resolves every contact, `0.057 pi sqrt(m*/K)` [s].
    ///
    /// `m*` is the smallest effective mass of any two grains, or of a grain at a wall, for forces
    /// along and across the normal at any point of their contact spheres.
    #[must_use]
    pub fn contact_time_step(&self) -> Real {
        self.time_step
    }

    /// Number of sub-steps for a step of length `dt` [s].
    #[must_use]
    pub fn substeps(&self, dt: Real, substeps: Substeps) -> usize {
        match substeps {
            Substeps::Auto => ((dt / self.time_step).ceil() as usize).max(1),
            Substeps::Fixed(n) => n.max(1),
        }
    }

    /// Moves the grains by `dt` [s] under contact forces, `loads` and `gravity` [m/s^2].
    ///
    /// Afterwards every grain belongs to the rank whose part holds its centre of mass or has left it
    /// by less than the list's reach only, and ghosts are up to date.
    ///
    /// # Errors
    /// [`DemError::NotFinite`], [`DemError::GrainEscaped`] or [`DemError::OverlapTooLarge`]; on all
    /// ranks if on one.
    pub fn advance(
        &mut self,
        domain: &Domain,
        loads: &Loads<'_>,
        gravity: Vector,
        dt: Real,
        substeps: Substeps,
    ) -> Result<ContactReport, DemError> {
        let count = self.substeps(dt, substeps);
        let h = dt / count as Real;
        let mut report = ContactReport { substeps: count, ..ContactReport::default() };
        let start = self.time;
        let state = self.drift(0.5 * h);
        self.refresh_poses(domain);
        let mut state = self.worst(domain, state);
        let mut census = Census::default();
        let mut deep = 0;
        let mut deepest = Census::default();
        for step in 0..count {
            if state >= EXPIRED || !self.listed {
                self.check_finite(domain, step)?;
                self.renew(domain, false)?;
                report.list_renewals += 1;
            }
            self.contacts(h);
            census = self.blocks.iter().fold(Census::default(), |sum, block| sum.merged(block.census));
            deep += census.deepened;
            deepest = deepest.merged(census);
            report.impulse_on_walls += h * census.on_walls;
            let last = step + 1 == count;
            self.time = start + dt * ((step + 1) as Real / count as Real);
            state = self.kick_and_drift(loads, gravity, h, if last { 0.5 * h } else { h }, last);
            if census.deepest > TOO_DEEP {
                state = FAILED;
            }
            self.refresh_poses(domain);
            state = self.worst(domain, state);
            if state == FAILED {
                let outcome = if census.deepest > TOO_DEEP { Err(overlap_error(&census, step)) } else { Ok(()) };
                domain.agree(outcome)?;
            }
        }
        self.check_finite(domain, count)?;
        self.finish(domain)?;
        self.report(domain, &mut report, [census, deepest], deep);
        Ok(report)
    }

    /// Worst state of a sub-step over the ranks.
    fn worst(&self, domain: &Domain, state: u8) -> u8 {
        if domain.communicator().size() == 1 { state } else { domain.max(Real::from(state)) as u8 }
    }

    fn report(&self, domain: &Domain, report: &mut ContactReport, [last, deepest]: [Census; 2], deep: usize) {
        let grains = &self.grains;
        let chunks = grains.owned.div_ceil(ROWS);
        let of_chunk =
            |c: usize| (c * ROWS..((c + 1) * ROWS).min(grains.owned)).map(|g| grains.kinetic_energy(g)).sum();
        let [energy] = sum_over(chunks, |c| [of_chunk(c)]);
        let speed = max_over(grains.owned, |g| grains.velocity[g].length_squared()).max(0.0).sqrt();
        let impulse = report.impulse_on_walls;
        let sums = domain.sum([
            last.pairs as Real,
            last.contacts as Real,
            deep as Real,
            energy,
            impulse.x,
            impulse.y,
            impulse.z,
        ]);
        report.pairs = sums[0] as usize;
        report.contacts = sums[1] as usize;
        report.deep_contacts = sums[2] as usize;
        report.kinetic_energy = sums[3];
        report.impulse_on_walls = Vector::new(sums[4], sums[5], sums[6]);
        report.largest_speed = domain.max(speed);
        report.largest_overlap = domain.max(deepest.deepest);
        // The lowest rank that saw the largest overlap names the grains, in halves that are exact in a real.
        let mine = deepest.deepest == report.largest_overlap && report.largest_overlap > 0.0;
        let rank = domain.min(if mine { domain.communicator().rank() as Real } else { Real::INFINITY });
        let told = rank == domain.communicator().rank() as Real;
        let half = |n: usize, shift: u32| {
            if told { Real::from((deepest.deepest_ids[n] >> shift & u64::from(u32::MAX)) as u32) } else { 0.0 }
        };
        let [a, b, c, d] = domain.sum([half(0, 32), half(0, 0), half(1, 32), half(1, 0)]);
        report.largest_overlap_ids = [[a, b], [c, d]].map(|[high, low]| (high as u64) << 32 | low as u64);
    }

    /// Elastic energy of all contacts this rank computes, as they stood in the last sub-step, at the present poses [J].
    ///
    /// Contacts with other ranks' grains are counted on both ranks.
    #[must_use]
    pub fn elastic_energy(&self) -> Real {
        let point = |g: usize, a: u16| {
            let frame = &self.frames[g];
            let body = &self.bodies[frame.body as usize];
            (frame.rotation * body.centres[a as usize] * frame.scale, body.radii[a as usize] * frame.scale)
        };
        let mut energy = 0.0;
        for block in &self.blocks {
            for contact in &block.contacts {
                let pair = &block.pairs[contact.pair as usize];
                let (low, high) = (pair.low as usize, pair.high as usize);
                let ((a, ra), (b, rb)) = (point(low, contact.a), point(high, contact.b));
                let line = self.frames[high].home - self.frames[low].home + pair.shift(self.period) + b - a;
                let overlap = (ra + rb - line.length()).max(0.0);
                let c = &self.constants[pair.law as usize];
                energy += 0.5 * (c.normal_stiffness * overlap * overlap);
                energy += 0.5 * c.tangential_stiffness * contact.d_t.length_squared();
            }
            for contact in &block.walls.contacts {
                let pair = &block.walls.pairs[contact.pair as usize];
                let (a, radius) = point(pair.grain as usize, contact.a);
                let height = self.walls[pair.wall as usize].distance(self.frames[pair.grain as usize].home + a);
                let overlap = (radius - height).max(0.0);
                let c = &self.constants[pair.law as usize];
                energy += 0.5 * (c.normal_stiffness * overlap * overlap);
                energy += 0.5 * c.tangential_stiffness * contact.d_t.length_squared();
            }
        }
        energy
    }

    /// Adds to each own grain's entry what its ghosts on all ranks collected, in an order that does
    /// not depend on who owns the grain. `partial` has an entry for every grain and ghost.
    pub fn gather_to_owners<const N: usize>(&self, domain: &Domain, partial: &mut [[Real; N]]) {
        self.exchange.gather(domain, self.grains.owned, partial);
    }

    /// Whether own grain `own` touched another grain in the last sub-step.
    #[must_use]
    pub fn touches_a_grain(&self, own: usize) -> bool {
        let block = &self.blocks[own / ROWS];
        let row = own - block.first;
        let range = block.starts[row] as usize..block.starts[row + 1] as usize;
        block.pairs[range].iter().any(|p| p.touching) || self.incoming.total(&self.blocks, own).1
    }

    /// Changes the velocity of an own grain, and its angular velocity [m/s, rad/s].
    pub fn set_velocity(&mut self, own: usize, velocity: Vector, angular_velocity: Vector) {
        let turn = self.frames[own].rotation;
        let inertia = self.grains.inertia[own];
        self.grains.velocity[own] = velocity;
        self.grains.angular_momentum[own] = turn * (inertia * (turn.transpose() * angular_velocity));
        set_frame(&mut self.frames[own], &self.inert[own], &self.grains, own);
    }

    /// Brings the ghosts up to date after own grains were changed.
    pub fn refresh_ghosts(&mut self, domain: &Domain) {
        self.refresh_poses(domain);
        self.place();
    }

    fn check_box(&self, domain: &Domain, grains: &[GrainRecord]) -> Result<(), DemError> {
        let size = |r: &GrainRecord| self.bodies[r.shape as usize].bounding_radius * r.scale;
        let largest = grains.iter().map(size).fold(0.0, Real::max);
        let needed = 2.0 * largest * (1.0 + FARTHEST);
        for direction in 0..2 {
            let length = self.period[direction];
            if domain.periodic()[direction] && length < needed {
                return Err(DemError::BoxTooShort { direction, length, needed });
            }
        }
        Ok(())
    }

    fn stable_time_step(&self, domain: &Domain) -> Real {
        let materials = self.interactions.materials();
        let mut softest = vec![[0.0_f64; 2]; materials];
        for g in (0..self.grains.owned).filter(|&g| self.grains.motion[g] == Motion::Free) {
            let leverage = self.bodies[self.grains.shape[g] as usize].leverage;
            let worst = &mut softest[self.grains.material[g] as usize];
            (0..2).for_each(|d| worst[d] = worst[d].max(leverage[d] / self.grains.mass[g]));
        }
        for value in softest.iter_mut().flatten() {
            *value = domain.max(*value);
        }
        let mut square: Real = 0.0;
        for a in 0..materials {
            for b in 0..materials {
                let law = self.interactions.law(a as u32, b as u32);
                let sum = |d: usize| softest[a][d] + softest[b][d];
                square = square.max(law.normal_stiffness * sum(0)).max(law.tangential_stiffness * sum(1));
            }
        }
        if square > 0.0 { AUTO * std::f64::consts::PI / square.sqrt() } else { Real::INFINITY }
    }

    fn world(&self) -> World<'_> {
        World {
            bodies: &self.bodies,
            arrays: &self.arrays,
            spheres: &self.spheres,
            constants: &self.constants,
            plain: self.constants.iter().all(Constants::plain),
            frames: &self.frames,
            budget: &self.budget,
            walls: &self.walls,
            wall_budget: &self.wall_budget,
            period: self.period,
            owned: self.grains.owned,
        }
    }

    fn contacts(&mut self, h: Real) {
        let mut blocks = std::mem::take(&mut self.blocks);
        let world = self.world();
        let ids = &self.grains.id[..];
        for_each_chunk(&mut blocks[..], 1, |_, block| block[0].step(&world, ids, h));
        self.incoming.follow(&blocks);
        self.blocks = blocks;
    }

    fn drift(&mut self, time: Real) -> u8 {
        let nothing = Loads::none();
        self.move_grains(&nothing, None, time, false)
    }

    fn kick_and_drift(&mut self, loads: &Loads<'_>, gravity: Vector, h: Real, time: Real, keep: bool) -> u8 {
        self.move_grains(loads, Some((gravity, h)), time, keep)
    }

    /// Kick by `(gravity, duration)` if given, then drift for `time`; `keep` stores the contact forces.
    fn move_grains(&mut self, loads: &Loads<'_>, kick: Option<(Vector, Real)>, time: Real, keep: bool) -> u8 {
        let owned = self.grains.owned;
        let state = AtomicU8::new(FINE);
        let Self { grains, frames, budget, inert, reach, blocks, incoming, time: now, .. } = self;
        let (blocks, incoming, now) = (&blocks[..], &*incoming, *now);
        let poses = (
            &mut grains.home[..owned],
            &mut grains.orientation[..owned],
            &mut grains.velocity[..owned],
            &mut grains.angular_momentum[..owned],
        );
        let marks = (
            &mut grains.last_contact[..owned],
            &mut grains.contact_force[..owned],
            &mut grains.contact_torque[..owned],
        );
        let (gravity, h) = kick.unwrap_or_default();
        for_each_chunk(
            (poses, marks, &mut frames[..owned], &mut budget[..owned]),
            ROWS,
            |number, (poses, marks, frames, budget)| {
                let first = number * ROWS;
                let rows = first..first + frames.len();
                let mut impulses = [Wrench::default(); ROWS];
                if let (Some(_), Some(block)) = (kick, blocks.get(number)) {
                    let mut on_walls = &block.walls.actions[..];
                    for (row, g) in rows.clone().enumerate() {
                        let (mut total, touched) = incoming.total(blocks, g);
                        total += block.own[row];
                        if let [(grain, wrench), rest @ ..] = on_walls
                            && *grain as usize == g
                        {
                            total += *wrench;
                            on_walls = rest;
                        }
                        if touched || block.touches[row] {
                            marks.0[row] = now;
                        }
                        if keep {
                            (marks.1[row], marks.2[row]) = (total.force, total.torque);
                        }
                        if let Some(force) = loads.force.get(g) {
                            total.force += *force;
                        }
                        if let Some(torque) = loads.torque.get(g) {
                            total.torque += *torque;
                        }
                        impulses[row] = Wrench { force: h * total.force, torque: h * total.torque };
                    }
                }
                let mut moving = Moving {
                    inert: &inert[rows.clone()],
                    home: poses.0,
                    orientation: poses.1,
                    velocity: poses.2,
                    angular_momentum: poses.3,
                    frames,
                    budget,
                };
                moving.leap(&Leap { gravity: h * gravity, impulses: &impulses, time });
                // Not a number counts as expired: the check that follows finds it.
                if !moving.budget.iter().zip(&reach[rows]).all(|(budget, reach)| budget <= reach) {
                    state.fetch_max(EXPIRED, Ordering::Relaxed);
                }
            },
        );
        let mut state = state.into_inner();
        let least = reach[..owned].iter().copied().fold(Real::INFINITY, Real::min);
        for (wall, budget) in self.walls.iter_mut().zip(&mut self.wall_budget) {
            if wall.velocity != Vector::ZERO {
                let step = wall.velocity.dot(wall.normal) * time;
                wall.point += step * wall.normal;
                *budget += step.abs() * (1.0 + 1e-9);
                if *budget > least {
                    state = state.max(EXPIRED);
                }
            }
        }
        state
    }

    fn refresh_poses(&mut self, domain: &Domain) {
        let Self { exchange, grains, budget, frames, inert, .. } = self;
        exchange.refresh(domain, grains, budget, |grains, g| set_frame(&mut frames[g], &inert[g], grains, g));
    }

    /// Positions of the periodic images that this rank's entries stand for.
    fn place(&mut self) {
        let grains = &mut self.grains;
        for g in 0..grains.len() {
            grains.position[g] = imaged(grains.home[g], grains.image[g], self.period);
        }
    }

    fn check_finite(&self, domain: &Domain, substep: usize) -> Result<(), DemError> {
        let grains = &self.grains;
        let fine = |g: usize| {
            grains.home[g].is_finite()
                && grains.velocity[g].is_finite()
                && grains.angular_momentum[g].is_finite()
                && grains.orientation[g].is_finite()
        };
        let outcome = match (0..grains.owned).find(|&g| !fine(g)) {
            Some(g) => Err(DemError::NotFinite { id: grains.id[g], position: grains.position[g], substep }),
            None => Ok(()),
        };
        domain.agree(outcome)
    }

    /// Places, ownership and ghosts after the last sub-step.
    fn finish(&mut self, domain: &Domain) -> Result<(), DemError> {
        self.place();
        let grains = &self.grains;
        let outcome = match (0..grains.owned).find(|&g| self.outside(g)) {
            Some(g) => Err(DemError::GrainEscaped { id: grains.id[g], position: grains.position[g] }),
            None => Ok(()),
        };
        domain.agree(outcome)?;
        // Half of the reach is left for the next step; otherwise now is the time to change owners.
        let spent = (0..grains.owned).any(|g| self.budget[g] > 0.5 * self.reach[g]);
        let state = if spent && self.several(domain) { EXPIRED } else { FINE };
        if self.worst(domain, state) == EXPIRED { self.renew(domain, true) } else { Ok(()) }
    }

    /// Whether own grain `g` is outside the region in a direction that is not periodic.
    fn outside(&self, g: usize) -> bool {
        let p = self.grains.home[g];
        (0..3).any(|d| {
            let periodic = d < 2 && self.period[d] > 0.0;
            !periodic && (p[d] < self.region[0][d] || p[d] > self.region[1][d])
        })
    }

    /// Whether ghosts exist at all, so that owners and images matter.
    fn several(&self, domain: &Domain) -> bool {
        domain.communicator().size() > 1 || self.period != Vector::ZERO
    }

    /// Writes all contacts of this rank, by key, into `records`.
    pub(crate) fn collect_records(&mut self) {
        if !self.listed {
            return;
        }
        let Self { records, blocks, grains, .. } = self;
        records.clear();
        for block in blocks.iter() {
            for c in &block.contacts {
                let pair = &block.pairs[c.pair as usize];
                records.push(ContactRecord {
                    low: grains.id[pair.low as usize],
                    high: grains.id[pair.high as usize],
                    image: pair.image.map(i32::from),
                    a: c.a,
                    b: c.b,
                    deep: u32::from(c.deep),
                    d_t: c.d_t.to_array(),
                });
            }
            for c in &block.walls.contacts {
                let pair = &block.walls.pairs[c.pair as usize];
                records.push(ContactRecord {
                    low: grains.id[pair.grain as usize],
                    high: crate::WALL + u64::from(pair.wall),
                    image: [0; 2],
                    a: c.a,
                    b: 0,
                    deep: u32::from(c.deep),
                    d_t: c.d_t.to_array(),
                });
            }
        }
        records.sort_unstable_by_key(ContactRecord::key);
        // Pairs across periodic sides stand in the list once for each of the two.
        records.dedup_by_key(|r| r.key());
    }

    /// New ghosts and lists; with `migrate`, new owners first.
    fn renew(&mut self, domain: &Domain, migrate: bool) -> Result<(), DemError> {
        self.collect_records();
        let known: Vec<(u64, [i32; 2], u32)> = if self.listed {
            let mut known: Vec<_> =
                (0..self.grains.len()).map(|g| (self.grains.id[g], self.grains.image[g], g as u32)).collect();
            known.sort_unstable();
            known
        } else {
            Vec::new()
        };
        let old_budget = std::mem::take(&mut self.budget);
        let old_wall_budget = self.wall_budget.clone();
        if migrate {
            ghosts::migrate(domain, &mut self.grains, &mut self.records);
        }
        self.place();
        self.choose_reach();
        let size: Vec<Real> = (0..self.grains.owned).map(|g| self.bounding_radius(g) + self.reach[g]).collect();
        self.exchange.renew(domain, &mut self.grains, &size, &mut self.reach, self.ghost_margin);
        self.set_frames();
        self.budget.resize(self.grains.len(), 0.0);
        self.wall_budget.fill(0.0);
        self.list(&known, &old_budget, &old_wall_budget);
        Ok(())
    }

    fn list(&mut self, known: &[(u64, [i32; 2], u32)], old_budget: &[Real], old_wall_budget: &[Real]) {
        let grains = &self.grains;
        let find = |g: usize| {
            let key = (grains.id[g], grains.image[g]);
            known.binary_search_by_key(&key, |k| (k.0, k.1)).map_or(u32::MAX, |at| known[at].2)
        };
        let number: Vec<u32> = (0..grains.len()).map(find).collect();
        std::mem::swap(&mut self.blocks, &mut self.former);
        let mut blocks = std::mem::take(&mut self.blocks);
        let mut builder = std::mem::take(&mut self.builder);
        let matter = Matter {
            grains: &self.grains,
            interactions: &self.interactions,
            reach: &self.reach,
            records: &self.records,
        };
        let previous =
            Previous { blocks: &self.former, budget: old_budget, wall_budget: old_wall_budget, number: &number };
        builder.build(&self.world(), matter, self.listed.then_some(&previous), &mut blocks);
        self.incoming.rebuild(&mut blocks, &self.grains.id, self.grains.owned);
        self.blocks = blocks;
        self.builder = builder;
        self.listed = true;
    }

    fn bounding_radius(&self, g: usize) -> Real {
        self.bodies[self.grains.shape[g] as usize].bounding_radius * self.grains.scale[g]
    }

    fn choose_reach(&mut self) {
        let grains = &self.grains;
        self.reach.clear();
        for g in 0..grains.owned {
            let size = self.bounding_radius(g);
            let arm = self.bodies[grains.shape[g] as usize].centre_radius * grains.scale[g];
            let speed = grains.velocity[g].length() + arm * grains.angular_velocity(g).length();
            let way = if self.time_step.is_finite() { HORIZON * self.time_step * speed } else { FARTHEST * size };
            self.reach.push((REACH * size + way).min(FARTHEST * size));
        }
    }

    fn set_frames(&mut self) {
        let Self { grains, frames, inert, bodies, .. } = self;
        frames.resize(grains.len(), Frame::default());
        let first: Vec<u32> = bodies
            .iter()
            .scan(0, |next, body| {
                let first = *next;
                *next += body.spheres() as u32;
                Some(first)
            })
            .collect();
        inert.clear();
        for g in 0..grains.len() {
            let free = grains.motion[g] == Motion::Free;
            let moment = grains.inertia[g].recip();
            inert.push(Inert {
                inverse_mass: if free { 1.0 / grains.mass[g] } else { 0.0 },
                inverse_inertia: moment,
                arm: bodies[grains.shape[g] as usize].centre_radius * grains.scale[g],
                motion: grains.motion[g],
            });
            frames[g].scale = grains.scale[g];
            frames[g].body = grains.shape[g];
            frames[g].spheres = first[grains.shape[g] as usize];
            set_frame(&mut frames[g], &inert[g], grains, g);
        }
    }
}

fn set_frame(frame: &mut Frame, inert: &Inert, grains: &Grains, g: usize) {
    let (home, orientation, velocity) = (grains.home[g], grains.orientation[g], grains.velocity[g]);
    frame.set(home, orientation, velocity, grains.angular_momentum[g], inert.inverse_inertia);
}

fn overlap_error(census: &Census, substep: usize) -> DemError {
    DemError::OverlapTooLarge {
        ids: census.deepest_ids,
        fraction: census.deepest,
        position: census.deepest_at,
        substep,
    }
}
