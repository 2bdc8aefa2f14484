//! Beds: grains fall on each other until they rest (Yagyu et al. (2015), section 3).
//!
//! Grains start on a lattice, or scattered where their sizes are unlike, each turned at random, and fall under a multiple of gravity in a box
//! without lid, without fluid. When the one that began highest meets another gravity takes its true
//! value, and when time enough has passed and the grains rest the bed is done.
//!
//! A bed that is taken at rest is packed with springs that are softer than its own, as soft as keeps overlaps small at the
//! present speeds ([`Softness`]): sub-steps are so much longer. Once gravity has its true value grains are slowed down as by a
//! thin fluid, within a few times that of a fall by their own size ([`PackingSettings::slowing_time`]): a bed is long at rest
//! when its last grains still fly or roll. When all rest, springs are stiffened step by step, and the bed is done when it has
//! rested with its own for a while without being slowed. A bed that is taken after a time has its own springs throughout, and
//! nothing slows it.
//!
//! Grains of unlike sizes begin about as densely as they end up, and are slowed from the start, under their own gravity. The finest would set the
//! sub-step: they are as heavy as a grain of mean size until all rest on their own springs ([`Softness::least_mass`]), and then lose
//! what they are too heavy by halves. Meanwhile coarse ones may press them flat, or beyond a wall, from where their springs bring them back.

mod scatter;
mod settings;
mod softness;

use sazanami_numerics::domain::Domain;
use sazanami_numerics::snapshot::Snapshot;
use sazanami_numerics::{Matrix, Real, Vector};

use crate::body::Body;
use crate::contact::laws::Interactions;
use crate::engine::{ContactReport, Engine, Loads, Setup, Substeps};
use crate::error::DemError;
use crate::grain::{Grain, GrainRecord};
pub use settings::{Lattice, PackingSettings, TILT};
pub use softness::{Kind, Softness};

/// Stage of a packing; its number is that in snapshots.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Stage {
    /// Grains fall under increased gravity.
    Falling,
    /// Grains come to rest.
    Settling,
    /// The bed is done.
    Done = 3,
    /// The grains did not come to rest in time.
    GivenUp,
}

/// Sub-steps between two doublings of the stiffness, or halvings of the least mass, at the end: some contacts last as long.
const STIFFENING: Real = 100.0;
/// Sub-steps in which a bed has to find its rest with its own springs: waves go through hundreds of layers meanwhile.
const RESTING: Real = 1000.0;
/// A power of two from `needed` up; one that is there is lowered only where it would stay so.
fn steady(needed: Real, present: Real) -> Real {
    let [least, most] = [needed, 1.2 * needed].map(|needed| needed.log2().ceil().exp2());
    if least > present { least } else { present.min(most) }
}

/// Own masses and moments of inertia of the grains, by identifier.
#[derive(Debug)]
struct Own {
    grains: Vec<(u64, Real, Vector)>,
}

impl Own {
    fn of(records: &[GrainRecord]) -> Self {
        let of = |record: &GrainRecord| (record.id, record.mass, Vector::from_array(record.inertia));
        Self { grains: records.iter().map(of).collect() }
    }

    /// Mass \[kg] and principal moments \[kg m^2] of a grain.
    fn of_grain(&self, id: u64) -> (Real, Vector) {
        let at = self.grains.partition_point(|grain| grain.0 < id).min(self.grains.len() - 1);
        (self.grains[at].1, self.grains[at].2)
    }
}

/// State of a packing after a step.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PackingReport {
    /// Stage that the packing has reached.
    pub stage: Stage,
    /// Time since the start \[s].
    pub time: Real,
    /// Mean speed of the grains [m/s].
    pub mean_speed: Real,
    /// Largest mean speed so far [m/s].
    pub largest_mean_speed: Real,
    /// Kinetic energy over the sum of weight times thickness of the grains.
    pub energy: Real,
    /// Height of the highest centre of mass \[m].
    pub highest: Real,
    /// Time at which gravity took its true value \[s]; infinite before.
    pub switched: Real,
    /// Diagnostics of the contacts.
    pub contacts: ContactReport,
}

/// A bed that is being packed.
#[derive(Debug)]
pub struct Packing {
    settings: PackingSettings,
    engine: Engine,
    interactions: Interactions,
    stage: Stage,
    switched: Real,
    /// When the present wait for rest began \[s].
    since: Real,
    softness: Softness,
    own: Own,
    /// Present stiffness of contacts over their own.
    stiffness: Real,
    /// Least mass of a grain at present \[kg]; 0: grains have their own.
    least_mass: Real,
    /// Whether the grains rest and springs are stiffened.
    stiffening: bool,
    /// Whether grains are slowed down.
    slowed: bool,
    largest_mean_speed: Real,
    /// Identifier of the grain that began highest: its first contact with another ends the fall.
    topmost: u64,
    /// Sum of mass times thickness of the grains [kg m].
    mass_thickness: Real,
    /// Mean thickness \[m].
    thickness: Real,
    count: Real,
}

impl Packing {
    /// Arranges `grains` on the lattice and gets ready to drop them. `domain` needs the right extent
    /// and periodicity in x1 and x2 only.
    ///
    /// # Errors
    /// Those of [`PackingSettings::arrange`] and [`Engine::new`].
    pub fn new(
        domain: &Domain,
        settings: PackingSettings,
        bodies: Vec<Body>,
        interactions: Interactions,
        mut grains: Vec<Grain>,
    ) -> Result<Self, DemError> {
        settings.arrange(&bodies, &mut grains)?;
        let higher = |a: &Grain, b: &Grain| a.position.z.total_cmp(&b.position.z).then(b.id.cmp(&a.id));
        let topmost = grains.iter().max_by(|a, b| higher(a, b)).map_or(0, |grain| grain.id);
        let records = GrainRecord::of_all(&grains, &bodies, interactions.materials())?;
        let softness = Softness::of_records(&settings, &bodies, &records);
        let springs = Self::springs(&settings, &interactions, true, 1.0);
        let setup = settings.setup(bodies, springs, softness.room());
        let engine = Engine::from_records(domain, setup, &records, Vec::new(), 0.0)?;
        let mut packing = Self { topmost, ..Self::with(settings, softness, engine, interactions, &records) };
        if packing.sinks() {
            (packing.stage, packing.switched, packing.since, packing.slowed) = (Stage::Settling, 0.0, 0.0, true);
            packing.set_least_mass(domain, packing.softness.least_mass());
        }
        packing.soften(domain, 0.0);
        Ok(packing)
    }

    /// With `records` of all grains of all ranks.
    fn with(
        settings: PackingSettings,
        softness: Softness,
        mut engine: Engine,
        interactions: Interactions,
        records: &[GrainRecord],
    ) -> Self {
        if settings.substeps == Substeps::Auto {
            engine.book_flat_bodies_only();
        }
        let body = |record: &GrainRecord| &engine.bodies()[record.shape as usize];
        let thickness = |record: &GrainRecord| 2.0 * body(record).capsule.radius * record.scale;
        Self {
            softness,
            own: Own::of(records),
            stiffness: 1.0,
            least_mass: 0.0,
            stiffening: false,
            slowed: false,
            mass_thickness: records.iter().map(|record| record.mass * thickness(record)).sum(),
            thickness: records.iter().map(thickness).sum::<Real>() / records.len() as Real,
            count: records.len() as Real,
            settings,
            engine,
            interactions,
            stage: Stage::Falling,
            switched: Real::INFINITY,
            since: Real::INFINITY,
            largest_mean_speed: 0.0,
            topmost: 0,
        }
    }

    /// Whether grains of unlike sizes sink instead of falling.
    fn sinks(&self) -> bool {
        self.softness.unlike && !self.settings.by_time_only
    }

    /// The engine with the grains of the bed.
    #[must_use]
    pub fn engine(&self) -> &Engine {
        &self.engine
    }

    /// Lets each rank have the grains that lie in its part after every step ([`Engine::own_promptly`]): those of [`Self::bed`].
    pub fn own_promptly(&mut self) {
        self.engine.own_promptly(true);
    }

    /// The settings that the packing was started with.
    #[must_use]
    pub fn settings(&self) -> &PackingSettings {
        &self.settings
    }

    /// Stage that the packing has reached.
    #[must_use]
    pub fn stage(&self) -> Stage {
        self.stage
    }

    /// Length of the next step: that of the settings, or a sub-step where that is longer \[s].
    fn step_length(&self) -> Real {
        let substep = self.engine.contact_time_step();
        let longer = self.settings.substeps == Substeps::Auto && substep.is_finite();
        if longer { self.settings.step.max(substep) } else { self.settings.step }
    }

    /// Advances by one step; does nothing once done.
    ///
    /// # Errors
    /// Those of [`Engine::advance`].
    pub fn step(&mut self, domain: &Domain) -> Result<PackingReport, DemError> {
        let settings = &self.settings;
        let factor = if self.stage == Stage::Falling { settings.fall_factor } else { 1.0 };
        let gravity = Vector::new(0.0, 0.0, -factor * settings.gravity);
        let length = self.step_length();
        let contacts = if matches!(self.stage, Stage::Done | Stage::GivenUp) {
            ContactReport::default()
        } else {
            self.engine.advance(domain, &Loads::none(), gravity, length, settings.substeps)?
        };
        let part = if self.slowed { (-length / settings.slowing_time(self.thickness)).exp() } else { 1.0 };
        if self.slowed {
            // What is pressed out from between coarse grains does not fly off.
            let sinking = settings.gravity * settings.slowing_time(self.thickness);
            let limit = if self.sinks() { sinking } else { Real::INFINITY };
            self.engine.limit_speeds(domain, limit, part);
        }
        let mut report = self.measure(domain, contacts);
        self.judge(domain, &mut report);
        if matches!(self.stage, Stage::Falling | Stage::Settling) {
            self.soften(domain, contacts.largest_speed);
        }
        Ok(report)
    }

    fn measure(&mut self, domain: &Domain, contacts: ContactReport) -> PackingReport {
        let grains = self.engine.grains();
        let speeds: Real = (0..grains.owned()).map(|g| grains.velocity[g].length()).sum();
        // Of the grains' own masses.
        let part =
            |g: usize| if self.least_mass > 0.0 { self.own.of_grain(grains.id[g]).0 / grains.mass[g] } else { 1.0 };
        let energies: Real = (0..grains.owned()).map(|g| part(g) * grains.kinetic_energy(g)).sum();
        let [speeds, energies] = domain.sum([speeds, energies]);
        let highest = (0..grains.owned()).map(|g| grains.position[g].z).fold(Real::NEG_INFINITY, Real::max);
        let mean_speed = speeds / self.count;
        self.largest_mean_speed = self.largest_mean_speed.max(mean_speed);
        PackingReport {
            stage: self.stage,
            time: self.engine.time(),
            mean_speed,
            largest_mean_speed: self.largest_mean_speed,
            energy: energies / (self.settings.gravity * self.mass_thickness),
            highest: domain.max(highest),
            switched: self.switched,
            contacts,
        }
    }

    /// Enters the next stage when its condition is met.
    fn judge(&mut self, domain: &Domain, report: &mut PackingReport) {
        let settings = &self.settings;
        let now = report.time;
        match self.stage {
            Stage::Falling => {
                let grains = self.engine.grains();
                let own = grains.id[..grains.owned()].binary_search(&self.topmost);
                // Where all lie on the floor side by side it never meets another.
                let lies = |g: usize| self.rests(report) && grains.last_contact[g].is_finite();
                let landed = own.is_ok_and(|g| self.engine.touches_a_grain(g) || lies(g));
                if domain.max(Real::from(u8::from(landed))) > 0.0 {
                    self.stage = Stage::Settling;
                    (self.switched, self.since) = (now, now);
                    self.slowed = !settings.by_time_only;
                    if settings.fall_friction != 1.0 {
                        self.set_stiffness(domain, self.stiffness);
                    }
                }
            }
            Stage::Settling => {
                let rests = self.rests(report);
                let waited = |time: Real| now >= self.since + time;
                let substeps = |count: Real| waited(count * self.engine.contact_time_step());
                if settings.by_time_only {
                    if waited(settings.settling_time) {
                        self.end_settling(now);
                    }
                } else if !self.stiffening {
                    if waited(settings.settling_time) && self.rests_by(0.5, report) {
                        (self.stiffening, self.since) = (true, now);
                        if self.sinks() {
                            self.set_stiffness(domain, self.stiffness);
                        }
                    }
                } else if self.stiffness < 1.0 {
                    if substeps(STIFFENING) {
                        self.set_stiffness(domain, (2.0 * self.stiffness).min(1.0));
                        self.since = now;
                    }
                } else if !rests {
                    (self.slowed, self.since) = (true, now);
                } else if self.least_mass > 0.0 {
                    if substeps(STIFFENING) {
                        self.set_least_mass(domain, 0.5 * self.least_mass);
                        self.since = now;
                    }
                } else if self.slowed {
                    (self.slowed, self.since) = (false, now);
                } else if substeps(RESTING) {
                    self.end_settling(now);
                }
            }
            Stage::Done | Stage::GivenUp => {}
        }
        if now > self.settings.longest && self.stage != Stage::Done {
            self.stage = Stage::GivenUp;
        }
        report.stage = self.stage;
        report.switched = self.switched;
    }

    fn end_settling(&mut self, now: Real) {
        self.stage = Stage::Done;
        (self.stiffening, self.slowed, self.since) = (false, false, now);
    }

    /// Makes springs as soft as grains that move at `speed` [m/s] at most let them be.
    fn soften(&mut self, domain: &Domain, speed: Real) {
        if self.settings.by_time_only || self.stiffening {
            return;
        }
        let stiffness = steady(self.softness.scale(&self.interactions, speed), self.stiffness).min(1.0);
        if stiffness != self.stiffness {
            self.set_stiffness(domain, stiffness);
        }
    }

    /// Gives contacts the friction of the stage, and this part of their stiffness.
    fn set_stiffness(&mut self, domain: &Domain, stiffness: Real) {
        self.stiffness = stiffness;
        let falls =
            self.stage == Stage::Falling || self.stage == Stage::Settling && self.least_mass > 0.0 && !self.stiffening;
        let interactions = Self::springs(&self.settings, &self.interactions, falls, stiffness);
        self.engine.set_interactions(domain, interactions);
    }

    /// Makes grains as heavy as this at least, for what they weigh and for what moves them alike \[kg].
    fn set_least_mass(&mut self, domain: &Domain, least: Real) {
        let grains = &mut self.engine.grains;
        let mut raised = 0.0;
        for g in 0..grains.owned {
            let (mass, inertia) = self.own.of_grain(grains.id[g]);
            let factor = (least / mass).max(1.0);
            raised += if factor > 1.0 { 1.0 } else { 0.0 };
            grains.angular_momentum[g] *= factor * mass / grains.mass[g];
            (grains.mass[g], grains.inertia[g]) = (factor * mass, factor * inertia);
        }
        self.least_mass = if domain.max(raised) > 0.0 { least } else { 0.0 };
        // Coarse grains may press fine ones flat meanwhile; the bed must not have such contacts.
        self.engine.allow_any_overlap(self.least_mass > 0.0);
        self.set_stiffness(domain, self.stiffness);
    }

    fn springs(settings: &PackingSettings, own: &Interactions, falls: bool, stiffness: Real) -> Interactions {
        let mut springs = own.clone();
        if falls {
            springs.scale_friction(settings.fall_friction);
        }
        if stiffness != 1.0 {
            springs.scale_stiffness(stiffness);
        }
        springs
    }

    fn rests(&self, report: &PackingReport) -> bool {
        self.rests_by(1.0, report)
    }

    /// Whether the grains are as slow as this part of the speeds of a bed at rest.
    fn rests_by(&self, part: Real, report: &PackingReport) -> bool {
        let Self { settings, .. } = self;
        report.mean_speed < part * settings.rest_speed && report.energy < part * part * settings.rest_energy
    }

    /// Writes the state into `snapshot` on rank 0 under names that begin with `prefix`.
    pub fn snapshot(&mut self, domain: &Domain, prefix: &str, snapshot: &mut Snapshot) {
        self.engine.snapshot(domain, prefix, snapshot);
        if domain.communicator().rank() == 0 {
            let stage = self.stage as u8;
            let state = vec![
                Real::from(stage),
                self.switched,
                self.since,
                // The fourth number has no meaning.
                0.0,
                self.largest_mean_speed,
                self.topmost as Real,
                self.stiffness,
                Real::from(u8::from(self.stiffening)),
                Real::from(u8::from(self.slowed)),
                self.least_mass,
            ];
            snapshot.put_reals(format!("{prefix}packing"), state);
        }
    }

    /// Restores a packing of `grains` from `snapshot`, which is read on rank 0 only.
    ///
    /// # Errors
    /// Those of [`Engine::restore`].
    pub fn restore(
        domain: &Domain,
        settings: PackingSettings,
        bodies: Vec<Body>,
        interactions: Interactions,
        grains: &[Grain],
        prefix: &str,
        snapshot: &Snapshot,
    ) -> Result<Self, DemError> {
        let outcome = if domain.communicator().rank() == 0 {
            snapshot.reals_of(&format!("{prefix}packing"), 10).map(<[Real]>::to_vec)
        } else {
            Ok(Vec::new())
        };
        let state = domain.from_first(domain.agree(outcome.map_err(DemError::from))?);
        let stage = match state[0] as u8 {
            0 => Stage::Falling,
            1 => Stage::Settling,
            3 => Stage::Done,
            _ => Stage::GivenUp,
        };
        let records = GrainRecord::of_all(grains, &bodies, interactions.materials())?;
        let softness = Softness::of_records(&settings, &bodies, &records);
        let sinks = stage == Stage::Settling && state[9] > 0.0 && state[7] == 0.0;
        let present = Self::springs(&settings, &interactions, stage == Stage::Falling || sinks, state[6]);
        let setup = settings.setup(bodies, present, softness.room());
        let engine = Engine::restore(domain, setup, prefix, snapshot)?;
        let mut packing = Self::with(settings, softness, engine, interactions, &records);
        packing.stage = stage;
        (packing.switched, packing.since) = (state[1], state[2]);
        packing.largest_mean_speed = state[4];
        packing.topmost = state[5] as u64;
        (packing.stiffness, packing.stiffening, packing.slowed) = (state[6], state[7] > 0.0, state[8] > 0.0);
        packing.least_mass = state[9];
        packing.engine.allow_any_overlap(packing.least_mass > 0.0);
        Ok(packing)
    }

    /// The packed grains with their contact history in an engine with other walls. Contacts with a wall go to that in the same place; those
    /// with a wall that is gone are forgotten.
    ///
    /// # Errors
    /// Those of [`Engine::restore`].
    pub fn into_engine(mut self, domain: &Domain, setup: Setup) -> Result<Engine, DemError> {
        let mut snapshot = Snapshot::default();
        self.engine.renumber_walls(&setup.walls);
        self.engine.snapshot(domain, "", &mut snapshot);
        if domain.communicator().rank() == 0 {
            snapshot.put_vectors("wall.point", &setup.walls.iter().map(|w| w.point).collect::<Vec<_>>());
            snapshot.put_vectors("wall.velocity", &setup.walls.iter().map(|w| w.velocity).collect::<Vec<_>>());
        }
        drop(self);
        Engine::restore(domain, setup, "", &snapshot)
    }

    /// The grains of this rank in their present places, at rest.
    #[must_use]
    pub fn bed(&self) -> Vec<Grain> {
        self.engine.at_rest()
    }
}

/// Order of the long axes of this rank's grains, `1 - 3 <cos^2>` of the angle to the vertical over all ranks: 0 without
/// order, 1 if all lie, -2 if all stand.
#[must_use]
pub fn lying_order(domain: &Domain, engine: &Engine) -> Real {
    let grains = engine.grains();
    let square = |g: usize| {
        let inertia = engine.bodies()[grains.shape[g] as usize].inertia.to_array();
        let axis = (0..3).fold(0, |best, d| if inertia[d] < inertia[best] { d } else { best });
        Matrix::from_quat(grains.orientation[g]).col(axis).z.powi(2)
    };
    let mine: Real = (0..grains.owned()).map(square).sum();
    let [sum, count] = domain.sum([mine, grains.owned() as Real]);
    1.0 - 3.0 * sum / count
}
