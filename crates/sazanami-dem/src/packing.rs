//! Beds: grains fall on each other until they rest (Yagyu et al. (2015), section 3).
//!
//! Grains start on a lattice, or on layers of like sizes, each turned at random, and fall under a multiple of gravity in a box
//! without lid, without fluid. When the one that began highest meets another gravity takes its true
//! value, and when time enough has passed and the grains rest the bed is done. Springs may be softer until then; they are
//! stiffened once the grains rest, by steps, and the bed comes to rest with its own.

mod settings;

use sazanami_numerics::domain::Domain;
use sazanami_numerics::snapshot::Snapshot;
use sazanami_numerics::{Matrix, Real, Vector};

use crate::body::Body;
use crate::contact::laws::Interactions;
use crate::engine::{ContactReport, Engine, Loads, Setup, Substeps};
use crate::error::DemError;
use crate::grain::Grain;
pub use settings::{Lattice, PackingSettings, TILT, Tapping};

/// Stage of a packing.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Stage {
    /// Grains fall under increased gravity.
    Falling,
    /// Grains come to rest.
    Settling,
    /// The floor moves.
    Tapping,
    /// The bed is done.
    Done,
    /// The grains did not come to rest in time.
    GivenUp,
}

/// Sub-steps between two doublings of the stiffness at the end: some contacts last as long.
const STIFFENING: Real = 100.0;

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
    tapped: bool,
    /// Present stiffness of contacts over their own.
    stiffness: Real,
    largest_mean_speed: Real,
    /// Identifier of the grain that began highest: its first contact with another ends the fall.
    topmost: u64,
    /// Sum of mass times thickness of the grains [kg m].
    mass_thickness: Real,
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
        let mut falling = interactions.clone();
        falling.scale_friction(settings.fall_friction);
        if settings.stiffness_scale != 1.0 {
            falling.scale_stiffness(settings.stiffness_scale);
        }
        let engine = Engine::new(domain, settings.setup(bodies, falling), &grains)?;
        Ok(Self { topmost, ..Self::with(domain, settings, engine, interactions) })
    }

    fn with(domain: &Domain, settings: PackingSettings, mut engine: Engine, interactions: Interactions) -> Self {
        if settings.substeps == Substeps::Auto {
            engine.book_flat_bodies_only();
        }
        let grains = engine.grains();
        let thickness = |g: usize| 2.0 * engine.bodies()[grains.shape[g] as usize].capsule.radius * grains.scale[g];
        let mine: Real = (0..grains.owned()).map(|g| grains.mass[g] * thickness(g)).sum();
        let [mass_thickness, count] = domain.sum([mine, grains.owned() as Real]);
        Self {
            stiffness: settings.stiffness_scale,
            settings,
            engine,
            interactions,
            stage: Stage::Falling,
            switched: Real::INFINITY,
            since: Real::INFINITY,
            tapped: false,
            largest_mean_speed: 0.0,
            topmost: 0,
            mass_thickness,
            count,
        }
    }

    /// The engine with the grains of the bed.
    #[must_use]
    pub fn engine(&self) -> &Engine {
        &self.engine
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

    /// Advances by one step of [`PackingSettings::step`]; does nothing once done.
    ///
    /// # Errors
    /// Those of [`Engine::advance`].
    pub fn step(&mut self, domain: &Domain) -> Result<PackingReport, DemError> {
        let settings = &self.settings;
        let factor = if self.stage == Stage::Falling { settings.fall_factor } else { 1.0 };
        let gravity = Vector::new(0.0, 0.0, -factor * settings.gravity);
        let contacts = if matches!(self.stage, Stage::Done | Stage::GivenUp) {
            ContactReport::default()
        } else {
            self.engine.advance(domain, &Loads::none(), gravity, settings.step, settings.substeps)?
        };
        let mut report = self.measure(domain, contacts);
        self.judge(domain, &mut report);
        Ok(report)
    }

    fn measure(&mut self, domain: &Domain, contacts: ContactReport) -> PackingReport {
        let grains = self.engine.grains();
        let speeds: Real = (0..grains.owned()).map(|g| grains.velocity[g].length()).sum();
        let energies: Real = (0..grains.owned()).map(|g| grains.kinetic_energy(g)).sum();
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
                    if settings.fall_friction != 1.0 {
                        self.set_stiffness(domain, self.stiffness);
                    }
                }
            }
            Stage::Settling => {
                let rests = self.rests(report);
                let waited = |time: Real| now >= self.since + time;
                if self.stiffness < 1.0 {
                    let begun = self.stiffness > settings.stiffness_scale;
                    let due = if begun {
                        waited(STIFFENING * self.engine.contact_time_step())
                    } else {
                        waited(settings.settling_time) && rests
                    };
                    if due {
                        self.set_stiffness(domain, (2.0 * self.stiffness).min(1.0));
                        self.since = now;
                    }
                } else if waited(settings.settling_time) && (rests || settings.by_time_only) {
                    let tap = settings.tapping.is_some() && !self.tapped;
                    self.stage = if tap { Stage::Tapping } else { Stage::Done };
                    self.since = now;
                }
            }
            Stage::Tapping => self.tap(now),
            Stage::Done | Stage::GivenUp => {}
        }
        if now > self.settings.longest && self.stage != Stage::Done {
            self.stage = Stage::GivenUp;
        }
        report.stage = self.stage;
        report.switched = self.switched;
    }

    /// Gives contacts their own friction, and this part of their stiffness.
    fn set_stiffness(&mut self, domain: &Domain, stiffness: Real) {
        self.stiffness = stiffness;
        let mut interactions = self.interactions.clone();
        if stiffness != 1.0 {
            interactions.scale_stiffness(stiffness);
        }
        self.engine.set_interactions(domain, interactions);
    }

    fn rests(&self, report: &PackingReport) -> bool {
        report.mean_speed < self.settings.rest_speed && report.energy < self.settings.rest_energy
    }

    /// Moves the floor for the next step.
    fn tap(&mut self, now: Real) {
        let Some(tapping) = self.settings.tapping else { return };
        let floor = self.engine.walls().len() - 1;
        let omega = 2.0 * std::f64::consts::PI * tapping.frequency;
        let place = |t: Real| self.settings.lower.z + tapping.amplitude * (omega * (t - self.since)).sin();
        let (rate, over) = if now - self.since >= Real::from(tapping.periods) / tapping.frequency {
            (0.0, true)
        } else {
            // The chord of the sine over the step: the floor comes back to its place.
            ((place(now + self.settings.step) - place(now)) / self.settings.step, false)
        };
        self.engine.set_wall_velocity(floor, Vector::new(0.0, 0.0, rate));
        if over {
            self.tapped = true;
            self.stage = Stage::Settling;
            self.since = now;
        }
    }

    /// Writes the state into `snapshot` on rank 0 under names that begin with `prefix`.
    pub fn snapshot(&mut self, domain: &Domain, prefix: &str, snapshot: &mut Snapshot) {
        self.engine.snapshot(domain, prefix, snapshot);
        if domain.communicator().rank() == 0 {
            let stage = self.stage as u8;
            let mut state = vec![
                Real::from(stage),
                self.switched,
                self.since,
                Real::from(u8::from(self.tapped)),
                self.largest_mean_speed,
                self.topmost as Real,
            ];
            // Of packings with their own springs throughout nothing is written.
            if self.settings.stiffness_scale != 1.0 {
                state.push(self.stiffness);
            }
            snapshot.put_reals(format!("{prefix}packing"), state);
        }
    }

    /// Restores a packing from `snapshot`, which is read on rank 0 only.
    ///
    /// # Errors
    /// Those of [`Engine::restore`].
    pub fn restore(
        domain: &Domain,
        settings: PackingSettings,
        bodies: Vec<Body>,
        interactions: Interactions,
        prefix: &str,
        snapshot: &Snapshot,
    ) -> Result<Self, DemError> {
        let outcome = if domain.communicator().rank() == 0 {
            snapshot
                .reals_of(&format!("{prefix}packing"), if settings.stiffness_scale == 1.0 { 6 } else { 7 })
                .map(<[Real]>::to_vec)
        } else {
            Ok(Vec::new())
        };
        let state = domain.from_first(domain.agree(outcome.map_err(DemError::from))?);
        let stage = match state[0] as u8 {
            0 => Stage::Falling,
            1 => Stage::Settling,
            2 => Stage::Tapping,
            3 => Stage::Done,
            _ => Stage::GivenUp,
        };
        let mut present = interactions.clone();
        if stage == Stage::Falling {
            present.scale_friction(settings.fall_friction);
        }
        let stiffness = state.get(6).copied().unwrap_or(1.0);
        if stiffness != 1.0 {
            present.scale_stiffness(stiffness);
        }
        let engine = Engine::restore(domain, settings.setup(bodies, present), prefix, snapshot)?;
        let mut packing = Self::with(domain, settings, engine, interactions);
        packing.stage = stage;
        (packing.switched, packing.since) = (state[1], state[2]);
        packing.tapped = state[3] > 0.0;
        packing.largest_mean_speed = state[4];
        packing.topmost = state[5] as u64;
        packing.stiffness = stiffness;
        Ok(packing)
    }

    /// The packed grains with their contact history in an engine with other walls. Contacts with a wall go
    /// to the wall of the same number: the sides of the box in their order, then the floor.
    ///
    /// # Errors
    /// Those of [`Engine::restore`].
    pub fn into_engine(mut self, domain: &Domain, setup: Setup) -> Result<Engine, DemError> {
        let mut snapshot = Snapshot::default();
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
        let grains = self.engine.grains();
        (0..grains.owned())
            .map(|g| Grain {
                id: grains.id[g],
                shape: grains.shape[g],
                material: grains.material[g],
                scale: grains.scale[g],
                density: grains.mass[g]
                    / (self.engine.bodies()[grains.shape[g] as usize].volume * grains.scale[g].powi(3)),
                mass: Some(grains.mass[g]),
                motion: grains.motion[g],
                position: grains.position[g],
                orientation: grains.orientation[g],
                velocity: Vector::ZERO,
                angular_velocity: Vector::ZERO,
            })
            .collect()
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
