//! Runs with moving particles: bed and water surface, ripples, averages over layers, and what is to be watched.

mod fields;
mod forms;
mod gathered;
mod notes;
mod pictures;
mod probes;
mod rim;
mod series;

use sazanami_dem::{Arrivals, Departures};
use sazanami_io::table::{Column, Value};
use sazanami_mps::solver::Solver;
use sazanami_mps::stability::COMPRESSIBLE;
use sazanami_numerics::snapshot::Snapshot;
use sazanami_numerics::{Real, Vector};
use sazanami_observe::budget::{FluidMomentumBudget, ParticleImpulses};
use sazanami_observe::ripples::{self, BedFormSettings, BedForms, LayerMeans, SurfaceProfile, TankInside};
use sazanami_posing::assembly::wetted::PlacedLiquids;
use serde_json::{Map, json};

use super::bed::GatheredGrains;
use super::files::Files;
use super::observer::{DoneStep, Observer, Output, SeriesCell, SummaryParts, Warning};
use crate::case::meaning::{self, Case, LayerReference, ProbePlace, TankMotion};
use crate::check::{BedReport, bed_flow, given_speed};
use crate::clock::Clock;
use crate::columns::object;
use crate::job::{Job, RankError, RecordError, Totals};
use crate::state::{Array, WaterState};
pub(crate) use forms::{form_settings, forms_of, surface_json};
use gathered::GatheredTank;
use rim::Rim;
pub(super) use series::{BED, CONSERVATION, LAYERS, WATER};

const INITIAL: &str = "observe/initial_tank";
const HIGHEST: &str = "observe/highest_water";

/// The tables of probes as the reference page has them.
pub(super) fn probe_page() -> String {
    probes::COLUMNS.page()
}

/// Measured surfaces, forms and layers of the bed.
#[derive(Clone, Debug)]
pub(super) struct BedMeasures {
    /// Surface of the bed.
    pub bed: SurfaceProfile,
    /// Number of suspended grains.
    pub suspended: usize,
    /// Root mean square of the surface without its trend \[m].
    pub relief: Option<Real>,
    /// Mound and ripples.
    pub forms: BedForms,
    /// Averages of the lower and the upper layer.
    pub layers: [LayerMeans; 2],
}

/// Sums over the tank.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct TankSums {
    /// Bulk volume of the fluid [m^3].
    pub volume: Real,
    /// Momentum of fluid and grains [N s].
    pub momentum: Vector,
    /// Kinetic energy of the fluid \[J].
    pub fluid_energy: Real,
    /// Kinetic energy of the grains \[J].
    pub grain_energy: Real,
    /// Potential energy of fluid and grains against the constant force, from the lower corner of the tank \[J]: of grains with their weight
    /// less that of the water they displace.
    pub potential_energy: Real,
    /// Weight of the free grains along x3 less that of the fluid they displace \[N].
    pub submerged_weight: Real,
    /// Upward force of walls and of grains that forces do not move on the free grains, at the end of the last step \[N].
    pub carried_weight: Real,
    /// Mean height of the grains above the floor \[m].
    pub grain_height: Real,
    /// Share of the grains on which the law of beds acts.
    pub bed_share: Real,
    /// Number of fluid particles.
    pub particles: usize,
    /// Largest place of fluid along x1 \[m].
    pub front: Real,
}

/// Observer of a run with moving particles.
pub(crate) struct ParticleObserver {
    tank: TankInside,
    settings: Option<meaning::Ripples>,
    /// Flow over the bed, where the tank swings.
    flow: Option<BedReport>,
    /// Settings that tell mound and ripples apart.
    forms: Option<BedFormSettings>,
    /// Motion of the tank, where its walls move.
    moving: Option<TankMotion>,
    /// Period of that motion, or of what else swings the tank or the flow \[s].
    period: Option<Real>,
    /// Constant force per mass, gravity in the box as a rule [m/s^2].
    force: Vector,
    /// Liquids where they lay at the start.
    start: PlacedLiquids,
    /// Particle spacing \[m].
    spacing: Real,
    gathered: GatheredTank,
    /// Time of what was gathered \[s].
    gathered_at: Option<Real>,
    /// Bulk volume of the fluid at the start [m^3].
    first_volume: Real,
    /// Whether a step has solved for the pressure, of this run or of its preparation.
    has_pressure: bool,
    water: SurfaceProfile,
    /// Highest level of the water at any measurement \[m], if there was any.
    highest: Option<Real>,
    /// Rim of the tank, if it is open and has walls.
    rim: Option<Rim>,
    /// Largest speed of the water so far, and one that gravity in the box does not explain [m/s].
    speeds: [Real; 2],
    found: Option<BedMeasures>,
    sums: TankSums,
    /// Budget of the fluid's momentum, in the frame of its places.
    momentum: FluidMomentumBudget,
    departures: Departures,
    arrivals: Arrivals,
    /// Least density of the grains' materials [kg/m^3].
    lightest: Real,
}

impl ParticleObserver {
    /// Evaluates bed and layers by what was gathered, on rank 0.
    fn evaluate(&mut self) {
        let (Some(case), Some(forms)) = (self.settings.clone(), &self.forms) else { return };
        if self.gathered.grains.is_empty() {
            self.found = None;
            return;
        }
        let (bed, suspended) = ripples::bed_surface(&self.tank, &self.gathered.grain_view(), case.grain_size);
        let suspended = suspended.into_iter().filter(|&is| is).count();
        let relief = relief_of(&case, &self.tank, &bed);
        let forms = forms_of(&case, &self.tank, &bed, forms);
        let layers = self.layer_means(&case, &bed);
        self.found = Some(BedMeasures { bed, suspended, relief, forms, layers });
    }

    fn layer_means(&self, case: &meaning::Ripples, surface: &SurfaceProfile) -> [LayerMeans; 2] {
        let reference = match case.layers {
            LayerReference::Surface => ripples::LayerReference::Surface(surface),
            LayerReference::Floor => ripples::LayerReference::Floor(self.tank.floor),
        };
        let layers = ripples::Layers { reference, thickness: case.layer_thickness, range: case.layer_range() };
        let gathered = &self.gathered;
        let of_grains = layers.sort(&gathered.grains.position);
        let of_water = layers.sort(&gathered.water.position);
        let grains = ripples::LayerGrains {
            layer: &of_grains,
            velocity: &gathered.grains.velocity,
            drag: &gathered.grains.drag,
            pressure_force: &gathered.grains.pressure_force,
        };
        let water = ripples::LayerWater {
            layer: &of_water,
            bulk_volume: &gathered.water.bulk_volume,
            velocity: &gathered.water.velocity,
        };
        [ripples::Layer::Lower, ripples::Layer::Upper].map(|layer| ripples::layer_means(layer, &grains, &water))
    }
}

/// The profile of a bed without its short gaps: a bed may have a hole.
pub(crate) fn closed(case: &meaning::Ripples, tank: &TankInside, profile: &SurfaceProfile) -> SurfaceProfile {
    let longest = 4.0 * case.grain_size;
    match tank.ends {
        ripples::Sides::Periodic => profile.with_gaps_closed_around(longest),
        ripples::Sides::Walls => profile.with_gaps_closed(longest),
    }
}

/// Relief of the surface of a bed off the end walls \[m], if it has no gaps.
pub(crate) fn relief_of(case: &meaning::Ripples, tank: &TankInside, profile: &SurfaceProfile) -> Option<Real> {
    ripples::relief(&closed(case, tank, profile), tank.reach(case.margin)).ok()
}

/// Displacement \[m] and velocity [m/s] of a tank whose walls move.
fn tank_motion(motion: Option<&TankMotion>, time: Real) -> [Vector; 2] {
    motion.map_or([Vector::ZERO; 2], |motion| {
        let [place, velocity, _] = motion.at(time);
        [place, velocity]
    })
}

/// Speed that gravity in the box does not explain: five times `sqrt(g H)` of its height, twice the largest that the case gives if it is
/// more [m/s].
fn unlikely_speed(case: &Case) -> Real {
    let wave = (case.resting_gravity().length() * case.domain.extent().z).sqrt();
    if wave > 0.0 { (5.0 * wave).max(2.0 * given_speed(case)) } else { Real::INFINITY }
}

/// The tank as ripples are measured in it.
pub(crate) fn tank_of(case: &Case) -> TankInside {
    let [ends, sides] =
        [0, 1].map(|d| if case.periodic()[d] { ripples::Sides::Periodic } else { ripples::Sides::Walls });
    let (lower, upper) = (case.domain.lower, case.domain.upper);
    let lid = (!case.boundary[2][1].is_open() && !case.periodic()[2]).then_some(upper.z);
    let repeats = case.periodic()[2].then_some(upper.z - lower.z);
    TankInside { x: [lower.x, upper.x], y: [lower.y, upper.y], floor: lower.z, lid, ends, sides, repeats }
}

impl Observer for ParticleObserver {
    type Water = Solver;

    const SERIES: &'static [SeriesCell<Self>] = series::SERIES;

    fn new(job: &Job) -> Self {
        Self {
            tank: tank_of(job.case),
            settings: job.case.ripples.clone(),
            flow: bed_flow(job.case),
            forms: form_settings(job.case),
            moving: job.case.frame.as_ref().filter(|_| job.case.walls_move()).and_then(|frame| frame.motion.clone()),
            period: job.case.period(),
            force: job.case.constant_force_by_mass(),
            start: PlacedLiquids::of(job.case, job.case.domain.lower.z),
            spacing: job.case.particles.as_ref().map_or(1.0, |particles| particles.spacing),
            gathered: GatheredTank::default(),
            gathered_at: None,
            first_volume: 0.0,
            has_pressure: job.case.preparation.relax_steps > 0 || job.case.preparation.settle > 0.0,
            water: SurfaceProfile { start: 0.0, spacing: 1.0, heights: Vec::new() },
            highest: None,
            rim: job.case.particles.as_ref().and_then(|p| Rim::of(job.case, p.radius * p.spacing)),
            speeds: [0.0, unlikely_speed(job.case)],
            found: None,
            sums: TankSums::default(),
            momentum: FluidMomentumBudget::default(),
            departures: Departures::default(),
            arrivals: Arrivals::default(),
            lightest: job.case.materials.iter().map(|material| material.density).fold(Real::INFINITY, Real::min),
        }
    }

    fn begin(&mut self, job: &Job, grains: &mut GatheredGrains, water: &mut Solver) -> Result<(), RankError> {
        match job.resumed.as_ref().filter(|state| state.run.flows()) {
            Some(state) => {
                self.has_pressure |= state.run.step > 0;
                self.first_volume = state.snapshot.reals_of(INITIAL, 1)?[0];
                // Checkpoints of earlier versions do not have it.
                self.highest = state.snapshot.reals(HIGHEST).ok().and_then(|level| level.first().copied());
                self.momentum = FluidMomentumBudget::restore(&state.snapshot)?;
                self.momentum.balance(water.fluid_momentum());
            }
            None => {
                let bed_height = water.domain().max(grains.measure_bed().0);
                self.start = PlacedLiquids::of(job.case, bed_height);
                self.measure_all(water, 0.0);
                self.first_volume = self.sums.volume;
                self.momentum = FluidMomentumBudget::new(water.fluid_momentum());
            }
        }
        Ok(())
    }

    fn add(&mut self, &DoneStep { dt, report, .. }: &DoneStep<'_, Solver>, totals: &mut Totals) {
        totals.fluid_passes += 1;
        self.has_pressure = true;
        let worst = &mut totals.worst;
        worst.cfl = worst.cfl.max(report.largest_speed * dt / self.spacing);
        worst.divergence = worst.divergence.max(report.pressure.residual);
        let particles = totals.particles.get_or_insert_default();
        particles.add(report);
        self.speeds[0] = particles.fluid_speed;
        let (fluid, coupling) = (&report.impulses, &report.coupling);
        self.momentum.add(&ParticleImpulses {
            body_force_on_fluid: fluid.body_force,
            wall_pressure_on_fluid: fluid.wall_pressure,
            wall_friction_on_fluid: fluid.friction,
            wall_contact_on_fluid: fluid.contact,
            drag_on_fluid: coupling.drag_on_fluid,
            // With what else the water gives the grains and gets back.
            drag_on_grains: coupling.drag_on_grains + coupling.lift_on_grains + coupling.added_mass_returned,
            pressure_on_grains: coupling.pressure_on_grains,
            grains_on_walls: report.contacts.impulse_on_walls,
        });
    }

    fn measure(&mut self, _grains: &mut GatheredGrains, water: &mut Solver, time: Real) {
        self.measure_all(water, time);
    }

    fn notes(case: &Case) -> Vec<String> {
        notes::of(case)
    }

    fn warnings(&self) -> Vec<Warning> {
        let change = self.volume_change();
        // Grains that are fed in raise it, and those that leave lower it, by their volume if all of it is under water.
        let share = |mass: Real| mass / (self.lightest * self.first_volume);
        let (most, least) = (0.01 + share(self.arrivals.mass), -0.01 - share(self.departures.mass));
        let volume = change.filter(|change| *change > most || *change < least).map(|change| Warning {
            about: "volume",
            text: format!("the bulk volume of the water has changed by {:+.2} %", 1e2 * change),
        });
        let excess = self.rim.as_ref().and_then(Rim::excess);
        let rim = excess.map(|excess| Warning {
            about: "rim",
            text: format!(
                "water stands {:.1} mm above the rim of the tank, where it would flow over its walls but is kept inside: \
                 make the box higher",
                1e3 * excess
            ),
        });
        let [fastest, unlikely] = self.speeds;
        let fast = (fastest > unlikely).then(|| Warning {
            about: "speed",
            text: format!(
                "water has reached {fastest:.2} m/s, more than {unlikely:.2} m/s (five times sqrt(g H) of the box, or twice \
                 the largest speed that the case gives): look at its energy; the run ends at {COMPRESSIBLE} m/s"
            ),
        });
        volume.into_iter().chain(rim).chain(fast).collect()
    }

    fn tables(&self, clock: &Clock, files: &mut Files) -> Result<(), RecordError> {
        series::tables(self, clock, files)
    }

    fn fields(&self, Output { job, clock, files }: Output, _water: &mut Solver) -> Result<(), RecordError> {
        files.map_or(Ok(()), |files| fields::write(job, &self.gathered, clock, files))
    }

    fn tank(&self, time: Real) -> [Vector; 2] {
        tank_motion(self.moving.as_ref(), time)
    }

    fn written_frame(&self, job: &Job, clock: &Clock) -> [Vector; 2] {
        let (tank, written) = (self.tank(clock.time()), job.case.to_written_frame(clock.time()));
        [0, 1].map(|n| tank[n] - written[n])
    }

    fn water_state(&mut self, job: &Job, clock: &Clock, water: &mut Solver) -> Option<WaterState> {
        self.gather(water, clock.time());
        self.gathered.leads.then(|| fields::water_state(job, &self.gathered, clock))
    }

    fn grain_state(&self) -> Vec<Array> {
        fields::grain_state(&self.gathered)
    }

    fn draw(&self, to: Output, _water: &Solver, _grains: &GatheredGrains) -> Result<(), RecordError> {
        to.files.map_or(Ok(()), |files| pictures::draw(to.job, self, to.clock, files))
    }

    fn probe_headings(place: &ProbePlace) -> Vec<Column> {
        probes::COLUMNS.headings(place)
    }

    fn probe(&mut self, job: &Job, water: &mut Solver, time: Real, asked: &[bool]) -> Vec<Vec<Value>> {
        self.gather(water, time);
        if !self.gathered.leads {
            return Vec::new();
        }
        probes::read(job.case, &self.tank, (&self.gathered, self.has_pressure), time, asked)
    }

    fn summary_parts(&self) -> SummaryParts {
        let mut observables = Map::new();
        if let Some(found) = &self.found {
            let mut ripples = surface_json(&found.bed, found.relief, &found.forms, self.flow.as_ref(), &self.tank);
            ripples.insert("suspended_grains".into(), json!(found.suspended));
            observables.insert("ripples".into(), ripples.into());
        }
        if let Some(level) = self.water.mean() {
            let extent = self.water.extent().unwrap_or_default();
            observables.insert(
                "water".into(),
                json!({
                    "mean_level_mm": 1e3 * level,
                    "highest_less_lowest_mm": 1e3 * extent,
                    "highest_level_mm": self.highest.map(|level| 1e3 * level),
                }),
            );
        }
        let impulses = self.momentum.impulses();
        let named: Map<String, serde_json::Value> = ParticleImpulses::TERMS
            .into_iter()
            .zip(impulses.terms())
            .map(|((name, _), impulse)| (name.to_owned(), json!(impulse.to_array())))
            .collect();
        SummaryParts {
            particles: self.sums.particles,
            conservation: object(series::CONSERVATION, self),
            momentum: json!({
                "now": self.sums.momentum.to_array(),
                "impulses": named,
                "fluid_residual": self.momentum.residual().to_array(),
            }),
            observables,
        }
    }

    fn save(&self, snapshot: &mut Snapshot) {
        snapshot.put_reals(INITIAL, vec![self.first_volume]);
        snapshot.put_reals(HIGHEST, self.highest.into_iter().collect());
        self.momentum.save(snapshot);
    }
}

impl ParticleObserver {
    /// Gathers grains and water as they are at `time` \[s], once. All ranks take part.
    fn gather(&mut self, water: &mut Solver, time: Real) {
        if self.gathered_at != Some(time) {
            self.gathered.renew(water, self.tank(time));
            self.gathered_at = Some(time);
        }
    }

    /// Change of the bulk volume of the fluid, relative to that at the start; none where there was none.
    fn volume_change(&self) -> Option<Real> {
        (self.first_volume > 0.0).then(|| self.sums.volume / self.first_volume - 1.0)
    }

    /// Measures grains and water. All ranks take part.
    fn measure_all(&mut self, water: &mut Solver, time: Real) {
        self.gather(water, time);
        self.sums = self.gathered.sums(water, self.force, &self.start);
        self.momentum.balance(water.fluid_momentum());
        self.departures.clone_from(water.grains().engine().departures());
        self.arrivals.clone_from(water.grains().engine().arrivals());
        if !self.gathered.leads {
            return;
        }
        self.water = self.gathered.surface(&self.tank);
        self.highest = self.water.points().map(|[_, z]| z).chain(self.highest).reduce(Real::max);
        if let Some(rim) = &mut self.rim {
            rim.measure(&self.gathered.water, &self.water);
        }
        self.evaluate();
    }
}
