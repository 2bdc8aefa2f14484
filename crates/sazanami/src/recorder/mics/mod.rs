//! Runs with one grid for water, air and grains: the crater, the splash, and the budgets of liquid and momentum.

mod interface;
pub(super) mod pictures;
mod probes;
mod series;
mod soaked;
mod summary;

use sazanami_dem::{Arrivals, Departures};
use sazanami_io::table::{Column, Value};
use sazanami_mics::momentum::{Impulses, StoredMomentum};
use sazanami_mics::solver::{Solver, StepReport};
use sazanami_numerics::Real;
use sazanami_numerics::snapshot::Snapshot;
use sazanami_observe::budget::{LiquidBudget, LiquidVolume, MomentumBudget};
use sazanami_observe::erosion::{CraterCourse, Erosion, ErosionSettings, InitialBed, VolumeCourse};
use sazanami_observe::splash::SplashTracker;
use sazanami_observe::{BedView, Ground};

use super::bed::GatheredGrains;
use super::files::Files;
use super::observer::{DoneStep, Observer, Output, SeriesCell, SummaryParts, Warning};
use crate::case::meaning::{Case, ProbePlace};
use crate::clock::Clock;
use crate::job::{Job, RankError, RecordError, Totals};
use crate::state::WaterState;

use interface::Interface;
use soaked::Soaked;
pub(super) use summary::{CONSERVATION, EROSION, Findings, REST, SOAKED, SPLASH};

/// The table of the crater's profiles as the reference page has it.
pub(super) fn profile_page() -> String {
    let first = crate::columns::page(
        "A row per observation (with `[erosion]`): the surface in the layers of the paper, of which `volume_by_layers_mm3` is; rim, depth and the volumes are those of a smooth surface.",
        series::PROFILE,
    );
    first
        + "| `height_0`, `height_1`, ... | m | smoothed height (coordinate of x3) of the bed's surface in each layer about the axis |\n"
}

/// The tables of probes as the reference page has them.
pub(super) fn probe_page() -> String {
    probes::COLUMNS.page()
}

const INITIAL_HEIGHTS: &str = "observe/initial_surface";
/// V and the volume below the plane of the rim before the impact.
const INITIAL_NOISE: &str = "observe/initial_noise";
/// Prefix of the bed as it lay before the impact.
pub(super) const BEFORE: &str = "observe/before_impact/";
const VOLUME_COURSE: &str = "observe/volume_course";
const RESTED: &str = "observe/rested";
const COURSE_BELOW_RIM: &str = "observe/course_below_rim";
/// A crater is not waited for that has been at rest for so long \[s], and of which what flies could change this part at most.
const KEPT: [Real; 2] = [0.03, 10e-3];
/// What grains fill when they have come down, over their own volume: as loose as sand lies.
const LOOSE: Real = 2.0;
const LIQUID_TRACE: &str = "observe/liquid_trace";

/// Energies as measured last \[J].
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Energies {
    pub fluid: Real,
    pub grains: Real,
}

/// Observer of a run on a grid.
pub(crate) struct GridObserver {
    erosion: Option<ErosionSettings>,
    initial: Option<InitialBed>,
    /// The bed before the impact, as it goes into every checkpoint; empty on ranks without files.
    before: Snapshot,
    /// The crater in each row of the series.
    course: CraterCourse,
    /// Whether the crater in the last row need not be waited for.
    rested: bool,
    splash: Option<SplashTracker>,
    /// None of a flow that is given: nothing acts on its momentum.
    momentum: Option<MomentumBudget>,
    liquid: Option<LiquidBudget>,
    through: Real,
    clipped: Real,
    findings: Findings,
    energies: Energies,
    departures: Departures,
    arrivals: Arrivals,
    /// Largest place of the interface along x1 \[m], if there is liquid.
    front: Option<Real>,
    /// What surface tension acts on, if there is any.
    interface: Option<Interface>,
}

impl GridObserver {
    fn open(&mut self, case: &Case, grains: &mut GatheredGrains, solver: &Solver) {
        self.momentum = case
            .fluid
            .carrying_flow
            .is_none()
            .then(|| MomentumBudget::new(&StoredMomentum::TERMS, solver.momentum().terms(), Impulses::names()));
        self.liquid = Some(LiquidBudget::new(self.liquid_volume(solver)));
        if grains.count() > 0 {
            grains.keep(BEFORE, &mut self.before);
            grains.measure_bed();
            if let Some(settings) = &self.erosion {
                let begin = |bed: &BedView| SplashTracker::new(bed, settings.axis, settings.grain_size, settings.floor);
                let seen = |bed: &BedView| settings.ground().seen_from(settings.axis, bed, begin);
                self.splash = Some(grains.with_bed(seen));
            }
            self.evaluate_erosion(grains);
            self.initial = self.findings.erosion.as_ref().map(Erosion::as_initial);
        }
    }

    /// A bed without grains about the axis, or a crater down to the floor, has no volume to speak of: that is
    /// reported in the summary and ends no run.
    fn evaluate_erosion(&mut self, grains: &GatheredGrains) {
        let Some(settings) = &self.erosion else { return };
        let evaluated = grains.with_bed(|bed| Erosion::of(bed, settings, self.initial.as_ref()));
        self.findings.set_erosion(evaluated);
    }

    fn liquid_volume(&self, solver: &Solver) -> LiquidVolume {
        LiquidVolume {
            transported: solver.liquid_volume(),
            wet: solver.wet_liquid_volume(),
            through_open_sides: self.through,
            clipped: -self.clipped,
        }
    }

    fn add_to_budgets(&mut self, report: &StepReport) {
        if let Some(momentum) = &mut self.momentum {
            momentum.add(report.impulses.terms());
        }
        self.through += report.transport.volume_through.iter().flatten().sum::<Real>();
        self.clipped += report.transport.residue.clipped_volume;
    }

    fn restore(&mut self, job: &Job, leads: bool, snapshot: &Snapshot) -> Result<(), RankError> {
        if job.case.fluid.carrying_flow.is_none() {
            let terms = &StoredMomentum::TERMS;
            self.momentum = Some(MomentumBudget::restore(terms, Impulses::names(), snapshot)?);
        }
        self.liquid = Some(LiquidBudget::restore(snapshot)?);
        self.splash = SplashTracker::restore(snapshot).ok();
        self.initial = initial_heights(snapshot);
        self.course = crater_course(snapshot);
        self.rested = snapshot.reals(RESTED).is_ok_and(|rested| rested == [1.0]);
        if leads {
            // Checkpoints of earlier versions have no such bed.
            let before = snapshot.sections().filter(|(name, _)| name.starts_with(BEFORE));
            before.for_each(|(name, section)| self.before.put(name, section.clone()));
        }
        let trace = snapshot.reals_of(LIQUID_TRACE, 2)?;
        (self.through, self.clipped) = (trace[0], trace[1]);
        Ok(())
    }
}

impl Observer for GridObserver {
    type Water = Solver;

    const SERIES: &'static [SeriesCell<Self>] = series::SERIES;
    const SERIES_OF_CRATER: &'static [SeriesCell<Self>] = series::CRATER;
    const SERIES_OF_INTERFACE: &'static [SeriesCell<Self>] = series::INTERFACE;

    fn new(job: &Job) -> Self {
        Self {
            erosion: erosion_settings(job.case),
            initial: None,
            before: Snapshot::default(),
            course: CraterCourse::default(),
            rested: false,
            splash: None,
            momentum: None,
            liquid: None,
            through: 0.0,
            clipped: 0.0,
            findings: Findings { drops: drops(job.case), floor: job.case.domain.lower.z, ..Findings::default() },
            energies: Energies::default(),
            departures: Departures::default(),
            arrivals: Arrivals::default(),
            front: None,
            interface: None,
        }
    }

    fn begin(&mut self, job: &Job, grains: &mut GatheredGrains, solver: &mut Solver) -> Result<(), RankError> {
        match job.resumed.as_ref().filter(|state| state.run.flows()) {
            Some(state) => self.restore(job, grains.leads, &state.snapshot)?,
            None => self.open(job.case, grains, solver),
        }
        Ok(())
    }

    fn add(&mut self, step: &DoneStep<'_, Solver>, totals: &mut Totals) {
        totals.add(step.report);
        self.add_to_budgets(step.report);
    }

    fn measure(&mut self, grains: &mut GatheredGrains, solver: &mut Solver, time: Real) {
        let domain = solver.domain();
        let volume = self.liquid_volume(solver);
        if let Some(liquid) = &mut self.liquid {
            liquid.set(volume);
            self.findings.liquid_relative_change = liquid.relative_change();
            self.findings.wet_relative_change = liquid.wet_relative_change();
        }
        if let Some(momentum) = &mut self.momentum {
            let stored = solver.momentum();
            momentum.set_stored(stored.terms());
            let before = StoredMomentum::from_terms(momentum.initial().map(|(_, term)| term));
            let impulses = Impulses::from_terms(momentum.impulses().map(|(_, impulse)| impulse));
            let engine = solver.grains().engine();
            let passed = engine.departures().momentum - engine.arrivals().momentum;
            momentum.note_exchange(stored.grains + passed - before.grains - impulses.on_grains());
        }
        self.departures.clone_from(solver.grains().engine().departures());
        self.arrivals.clone_from(solver.grains().engine().arrivals());
        let own = solver.grains().engine().grains();
        let (owned, momentum) = (0..own.owned(), |n: usize| own.mass[n] * own.velocity[n].length());
        let mine = [owned.clone().map(|n| own.kinetic_energy(n)).sum(), owned.map(momentum).sum()];
        let [energy, momenta] = domain.sum(mine);
        self.energies = Energies { fluid: solver.fluid_energy(), grains: energy };
        if let Some(budget) = &mut self.momentum {
            // No fluid of this mass and energy has more momentum.
            let of_fluid = (2.0 * solver.flow().mass(domain) * self.energies.fluid).sqrt();
            budget.note_motion(of_fluid + momenta);
        }
        // The cell beyond the last one of a rank is another's.
        solver.fill_halos();
        self.front = front(solver);
        self.interface = Interface::of(solver);
        self.findings.soaked = self.erosion.as_ref().and_then(|_| {
            let level = solver.domain().max(self.initial.as_ref().map_or(Real::NEG_INFINITY, InitialBed::level));
            level.is_finite().then(|| Soaked::below(level, solver))
        });
        // A bed whose last grain has left is looked at too: it has no crater, and none of its grains is above it.
        if !grains.leads || grains.count() == 0 && self.departures.grains == 0 {
            return;
        }
        self.evaluate_erosion(grains);
        self.findings.set_rest(&self.course, time);
        if let (Some(mut splash), Some(settings)) = (self.splash.take(), &self.erosion) {
            let seen = |bed: &BedView| settings.ground().seen_from(settings.axis, bed, |bed| splash.observe(bed));
            self.findings.splash = Some(grains.with_bed(seen));
            self.splash = Some(splash);
        }
    }

    fn note_row(&mut self, time: Real) {
        if let Some(erosion) = &self.findings.erosion {
            self.course.add(time, [erosion.crater.volume, erosion.crater.volume_direct]);
            let [part, span] = KEPT;
            self.rested = erosion.has_crater()
                && LOOSE * erosion.airborne_volume <= part * erosion.crater.volume_direct
                && self.course.has_kept(erosion, span);
        }
    }

    fn is_at_rest(&self) -> bool {
        self.rested
    }

    fn warnings(&self) -> Vec<Warning> {
        let no_crater = self.findings.no_erosion.as_ref().map(|problem| Warning {
            about: "crater",
            text: format!(
                "the crater cannot be evaluated: {problem}; the run goes on, and its columns stay empty until it can"
            ),
        });
        let at_edge = self.findings.erosion.as_ref().is_some_and(|erosion| erosion.crater.rim_at_edge);
        let rim = at_edge.then(|| Warning {
            about: "rim",
            text: "the rim of the crater lies at the edge of the box, or at `erosion.r_max`: as long as it does, the \
                   erosion volume V is not reliable"
                .to_owned(),
        });
        // Before the impact the highest layer may lie anywhere.
        no_crater
            .into_iter()
            .chain(rim.filter(|_| self.findings.splash.is_some_and(|splash| splash.grains > 0)))
            .collect()
    }

    fn tables(&self, clock: &Clock, files: &mut Files) -> Result<(), RecordError> {
        series::tables(self, clock, files)
    }

    fn fields(&self, to: Output, solver: &mut Solver) -> Result<(), RecordError> {
        series::fields(solver, to)
    }

    fn water_state(&mut self, job: &Job, clock: &Clock, solver: &mut Solver) -> Option<WaterState> {
        series::state(solver, job, clock)
    }

    fn draw(&self, to: Output, solver: &Solver, grains: &GatheredGrains) -> Result<(), RecordError> {
        pictures::draw(to, solver, grains, self)
    }

    fn probe_headings(place: &ProbePlace) -> Vec<Column> {
        probes::COLUMNS.headings(place)
    }

    fn probe(&mut self, job: &Job, solver: &mut Solver, time: Real, asked: &[bool]) -> Vec<Vec<Value>> {
        // A probe between cells of two ranks looks at both.
        solver.fill_halos();
        probes::read(job.case, solver, time, asked)
    }

    fn summary_parts(&self) -> SummaryParts {
        summary::parts(self)
    }

    fn save(&self, snapshot: &mut Snapshot) {
        if let Some(momentum) = &self.momentum {
            momentum.save(snapshot);
        }
        if let Some(liquid) = &self.liquid {
            liquid.save(snapshot);
        }
        if let Some(splash) = &self.splash {
            splash.save(snapshot);
        }
        if let Some(initial) = &self.initial {
            snapshot.put_reals(INITIAL_HEIGHTS, initial.heights.clone());
            snapshot.put_reals(INITIAL_NOISE, vec![initial.noise, initial.noise_below_rim]);
        }
        if self.erosion.is_some() {
            snapshot.put_reals(VOLUME_COURSE, self.course.cap.pairs());
            snapshot.put_reals(COURSE_BELOW_RIM, self.course.below_rim.pairs());
            snapshot.put_reals(RESTED, vec![Real::from(u8::from(self.rested))]);
        }
        self.before.sections().for_each(|(name, section)| snapshot.put(name, section.clone()));
        snapshot.put_reals(LIQUID_TRACE, vec![self.through, self.clipped]);
    }
}

/// Share of the liquid in the room it has in the cell at a place in memory; none where it has no room.
fn liquid_share(solver: &Solver, at: usize) -> Option<Real> {
    let [liquid, room] = solver.liquid_and_room(at);
    if room == 1.0 { Some(liquid) } else { (room > 0.0).then(|| liquid / room) }
}

/// Liquid outside grains in the cell at a place in memory, and the room of liquid and gas there, in cell volumes.
fn outside_grains(solver: &Solver, at: usize) -> [Real; 2] {
    let grains = solver.grains();
    if solver.has_open_room() || grains.is_empty() {
        return solver.liquid_and_room(at);
    }
    // Grains may overlap: a cell holds no more than itself.
    let room = 1.0 - grains.covered().solid_fraction.data()[at].min(1.0);
    [room * solver.flow().volume_fraction.data()[at], room]
}

/// Largest place of the interface along x1 \[m]: of the last cell of a row that is at least half full, the liquid in it and
/// in the next cell reaches that far from its lower side. Ghosts are filled.
fn front(solver: &Solver) -> Option<Real> {
    let domain = solver.domain();
    let (grid, start) = (domain.grid(), domain.start());
    let ends = domain.at_box_end(0, 1);
    let share = |at: usize| liquid_share(solver, at).unwrap_or_default();
    let found = domain.max(domain.max_rows(&domain.interior(), |row| {
        let cells = row.shifted(0);
        let (first, last) = (cells.start, cells.end - 1);
        cells.rev().find(|&at| share(at) >= 0.5).map_or(Real::NEG_INFINITY, |at| {
            let beyond = if ends && at == last { 0.0 } else { share(at + 1) };
            grid.lower.x + grid.spacing.x * ((at - first + start[0]) as Real + share(at) + beyond)
        })
    }));
    found.is_finite().then_some(found)
}

/// The crater in each row of the series up to a checkpoint; empty in those of earlier versions.
pub(super) fn crater_course(snapshot: &Snapshot) -> CraterCourse {
    let course = |section| snapshot.reals(section).map_or_else(|_| VolumeCourse::default(), VolumeCourse::from_pairs);
    CraterCourse { cap: course(VOLUME_COURSE), below_rim: course(COURSE_BELOW_RIM) }
}

/// The initial bed as the run evaluated it.
pub(super) fn initial_heights(snapshot: &Snapshot) -> Option<InitialBed> {
    let (heights, &[noise, noise_below_rim]) =
        (snapshot.reals(INITIAL_HEIGHTS).ok()?, snapshot.reals(INITIAL_NOISE).ok()?)
    else {
        return None;
    };
    Some(InitialBed { heights: heights.to_vec(), noise, noise_below_rim })
}

/// Number of liquids that fall at the start: the drops of an impact.
pub(crate) fn drops(case: &Case) -> usize {
    case.liquids.iter().filter(|liquid| liquid.falls()).count()
}

pub(crate) fn erosion_settings(case: &Case) -> Option<ErosionSettings> {
    let erosion = case.erosion.as_ref()?;
    let Ground { lower, upper, periodic } = case.ground();
    Some(ErosionSettings {
        axis: erosion.axis,
        periodic,
        cell: erosion.dx,
        layer: erosion.dr,
        largest_radius: erosion.r_max,
        counted: erosion.mode,
        ..ErosionSettings::recommended(lower, upper, case.domain.lower.z, erosion.grain_size)
    })
}
