//! What the case asks to know: the bed, the crater, the splash, and the books of liquid and momentum.

use std::sync::Arc;

use sazanami_dem::Engine;
use sazanami_mics::solver::{Solver, StepReport};
use sazanami_numerics::domain::Domain;
use sazanami_numerics::geometry::Shape;
use sazanami_numerics::snapshot::Snapshot;
use sazanami_numerics::{Quaternion, Real, Vector};
use sazanami_observe::budget::{Impulses, LiquidBudget, LiquidVolume, MomentumBudget, MomentumStock};
use sazanami_observe::erosion::{CountedGrains, Erosion, ErosionSettings, InitialBed};
use sazanami_observe::splash::SplashTracker;
use sazanami_observe::{BedView, Body, GatheredBed, bed_profile};

use super::summary::{BedFindings, Findings};
use crate::case::meaning::{Case, ErosionMode};
use crate::simulation::{Job, RankError};

const INITIAL_HEIGHTS: &str = "observe/initial_heights";
const INITIAL_NOISE: &str = "observe/initial_noise";
const BED: &str = "observe/bed";
/// Prefix of the bed as it lay before the impact.
pub(super) const BEFORE: &str = "observe/before_impact/";
const LIQUID_TRACE: &str = "observe/liquid_trace";

/// Energies at the last look [J].
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Energies {
    pub fluid: Real,
    pub grains: Real,
}

/// Observes a run; the grains of all ranks are on rank 0.
pub(crate) struct Observers {
    shapes: Arc<[Shape]>,
    bed: GatheredBed,
    leads: bool,
    measured: BedSettings,
    erosion: Option<ErosionSettings>,
    initial: Option<InitialBed>,
    /// The bed before the impact, as it goes into every checkpoint; empty on ranks without files.
    before: Snapshot,
    splash: Option<SplashTracker>,
    momentum: Option<MomentumBudget>,
    liquid: Option<LiquidBudget>,
    through: Real,
    clipped: Real,
    findings: Findings,
    energies: Energies,
}

impl Observers {
    pub fn new(job: &Job) -> Self {
        let case = job.case;
        Self {
            shapes: Arc::clone(&job.shapes),
            bed: GatheredBed::default(),
            leads: false,
            measured: BedSettings::of(case),
            erosion: erosion_settings(case),
            initial: None,
            before: Snapshot::default(),
            splash: None,
            momentum: None,
            liquid: None,
            through: 0.0,
            clipped: 0.0,
            findings: Findings::default(),
            energies: Energies::default(),
        }
    }

    /// Gathers the grains of all ranks.
    pub fn gather(&mut self, domain: &Domain, engine: &Engine) {
        self.leads = domain.communicator().rank() == 0;
        self.bed.gather(domain, engine.grains(), engine.time());
    }

    /// Number of grains gathered.
    pub fn count(&self) -> usize {
        self.bed.id.len()
    }

    /// Looks at the gathered grains.
    pub fn with_bed<T>(&self, look: impl FnOnce(&BedView) -> T) -> T {
        let bodies: Vec<Body> = self.shapes.iter().map(Body::of).collect();
        look(&self.bed.view(&bodies))
    }

    /// Highest node near the axis [m]; the floor without grains there.
    pub fn bed_height(&self) -> Real {
        self.with_bed(|bed| self.measured.height(bed))
    }

    /// Measures the bed as it lies.
    pub fn measure_bed(&mut self) -> BedFindings {
        let found = self.with_bed(|bed| self.measured.measure(bed));
        if self.count() > 0 {
            self.findings.bed = Some(found);
        }
        found
    }

    /// The grains as they lie, in the order of their identifiers.
    pub fn lying<T>(&self, make: impl Fn(u32, Real, Vector, Quaternion) -> T) -> Vec<T> {
        self.with_bed(|bed| {
            (0..bed.len()).map(|n| make(bed.body[n], bed.scale[n], bed.position[n], bed.orientation[n])).collect()
        })
    }

    /// Number of grains of each shape.
    pub fn grains_by_shape(&self, shapes: usize) -> Vec<usize> {
        let mut counts = vec![0; shapes];
        self.with_bed(|bed| bed.body.iter().for_each(|&shape| counts[shape as usize] += 1));
        counts
    }

    /// The flow begins: opens the books, or goes on with those of the checkpoint.
    pub fn begin(&mut self, job: &Job, solver: &mut Solver) -> Result<(), RankError> {
        self.gather(solver.domain(), solver.grains().engine());
        match job.resumed.as_ref().filter(|state| !state.run.packing) {
            Some(state) => self.restore(&state.snapshot)?,
            None => self.open(solver),
        }
        Ok(())
    }

    fn open(&mut self, solver: &Solver) {
        self.momentum = Some(MomentumBudget::new(stock(solver)));
        self.liquid = Some(LiquidBudget::new(self.liquid_volume(solver)));
        if self.count() > 0 {
            self.bed.save(BEFORE, &mut self.before);
            self.measure_bed();
            if let Some(settings) = &self.erosion {
                self.splash = Some(self.with_bed(|bed| SplashTracker::new(bed, settings.axis, settings.grain_size)));
            }
            self.evaluate_erosion();
            self.initial = self.findings.erosion.as_ref().map(Erosion::as_initial);
        }
    }

    /// A bed without grains about the axis, or a crater down to the floor, has no volume to speak of: that is
    /// told in the summary and ends no run.
    fn evaluate_erosion(&mut self) {
        let Some(settings) = &self.erosion else { return };
        let evaluated = self.with_bed(|bed| Erosion::of(bed, settings, self.initial.as_ref()));
        self.findings.set_erosion(evaluated);
    }

    fn liquid_volume(&self, solver: &Solver) -> LiquidVolume {
        LiquidVolume {
            transported: solver.flow().liquid_volume(solver.domain()),
            wet: solver.wet_liquid_volume(),
            through_open_sides: self.through,
            clipped: -self.clipped,
        }
    }

    /// Books a step.
    pub fn add(&mut self, report: &StepReport) {
        let i = &report.impulses;
        if let Some(momentum) = &mut self.momentum {
            momentum.add(&Impulses {
                walls_on_fluid: i.walls_on_fluid,
                walls_on_grains: i.walls_on_grains,
                gravity_on_fluid: i.gravity_on_fluid,
                gravity_on_grains: i.gravity_on_grains,
                swallowed: i.swallowed,
                open_sides: i.open_sides + report.transport.wisps.clipped_momentum,
                held_grains: i.held_grains,
            });
        }
        self.through += report.transport.volume_through.iter().flatten().sum::<Real>();
        self.clipped += report.transport.wisps.clipped_volume;
    }

    /// Looks at everything. All ranks take part.
    pub fn look(&mut self, solver: &mut Solver) {
        let domain = solver.domain();
        self.gather(domain, solver.grains().engine());
        let volume = self.liquid_volume(solver);
        if let Some(liquid) = &mut self.liquid {
            liquid.set(volume);
            self.findings.liquid_relative_change = liquid.relative_change();
            self.findings.wet_relative_change = liquid.wet_relative_change();
        }
        let now = stock(solver);
        if let Some(momentum) = &mut self.momentum {
            momentum.set_stock(now);
        }
        let grains = solver.grains().engine().grains();
        let mine: Real = (0..grains.owned()).map(|n| grains.kinetic_energy(n)).sum();
        self.energies = Energies { fluid: solver.flow().kinetic_energy(domain), grains: domain.sum([mine])[0] };
        if !self.leads || self.count() == 0 {
            return;
        }
        self.evaluate_erosion();
        if let Some(mut splash) = self.splash.take() {
            self.findings.splash = Some(self.with_bed(|bed| splash.observe(bed)));
            self.splash = Some(splash);
        }
    }

    /// What was found at the last look.
    pub fn findings(&self) -> &Findings {
        &self.findings
    }

    /// The books of momentum.
    pub fn budget(&self) -> Option<&MomentumBudget> {
        self.momentum.as_ref()
    }

    /// Energies at the last look.
    pub fn energies(&self) -> Energies {
        self.energies
    }

    /// Adds what a resumed run needs to a snapshot.
    pub fn save(&self, snapshot: &mut Snapshot) {
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
            snapshot.put_reals(INITIAL_NOISE, vec![initial.noise]);
        }
        if let Some(bed) = &self.findings.bed {
            snapshot.put_reals(BED, vec![bed.porosity, bed.height_mm, bed.mean_speed, bed.lying_order]);
        }
        self.before.sections().for_each(|(name, section)| snapshot.put(name, section.clone()));
        snapshot.put_reals(LIQUID_TRACE, vec![self.through, self.clipped]);
    }

    fn restore(&mut self, snapshot: &Snapshot) -> Result<(), RankError> {
        self.momentum = Some(MomentumBudget::restore(snapshot)?);
        self.liquid = Some(LiquidBudget::restore(snapshot)?);
        self.splash = SplashTracker::restore(snapshot).ok();
        self.initial = initial_heights(snapshot);
        self.findings.bed = bed_findings(snapshot);
        if self.leads {
            // Checkpoints of earlier versions have no such bed.
            let before = snapshot.sections().filter(|(name, _)| name.starts_with(BEFORE));
            before.for_each(|(name, section)| self.before.put(name, section.clone()));
        }
        let trace = snapshot.reals_of(LIQUID_TRACE, 2)?;
        (self.through, self.clipped) = (trace[0], trace[1]);
        Ok(())
    }
}

/// How the bed is measured.
#[derive(Clone, Copy, Debug)]
pub(super) struct BedSettings {
    floor: Real,
    slab: [Real; 2],
    height_radius: Real,
    axis: [Real; 2],
    area: Real,
}

impl BedSettings {
    pub fn of(case: &Case) -> Self {
        let extent = case.domain.extent();
        Self {
            floor: case.domain.lower.z,
            slab: case.bed.porosity_slab,
            height_radius: case.bed.height_radius,
            axis: case.bed.axis,
            area: extent.x * extent.y,
        }
    }

    /// Highest node near the axis [m]; the floor without grains there.
    fn height(&self, bed: &BedView) -> Real {
        bed_profile::height_near(bed, self.axis, self.height_radius).unwrap_or(self.floor)
    }

    /// What is found of a bed as it lies.
    pub fn measure(&self, bed: &BedView) -> BedFindings {
        let slab = self.slab[0]..self.slab[1];
        let porosity = if bed.is_empty() { 1.0 } else { bed_profile::porosity_of_grains(bed, slab, self.area) };
        BedFindings::of(bed, self.floor, self.height(bed), porosity)
    }
}

/// The initial bed as the run evaluated it.
pub(super) fn initial_heights(snapshot: &Snapshot) -> Option<InitialBed> {
    snapshot.reals(INITIAL_HEIGHTS).ok().map(|heights| InitialBed {
        heights: heights.to_vec(),
        noise: snapshot.reals(INITIAL_NOISE).ok().and_then(|noise| noise.first().copied()).unwrap_or_default(),
    })
}

/// The initial bed as the run measured it.
pub(super) fn bed_findings(snapshot: &Snapshot) -> Option<BedFindings> {
    match snapshot.reals_of(BED, 4) {
        Ok(&[porosity, height_mm, mean_speed, lying_order]) => {
            Some(BedFindings { porosity, height_mm, mean_speed, lying_order })
        }
        _ => None,
    }
}

pub(super) fn erosion_settings(case: &Case) -> Option<ErosionSettings> {
    let erosion = case.erosion.as_ref()?;
    let corner = |v: Vector| [v.x, v.y];
    let (lower, upper) = (corner(case.domain.lower), corner(case.domain.upper));
    Some(ErosionSettings {
        axis: erosion.axis,
        cell: erosion.dx,
        layer: erosion.dr,
        largest_radius: erosion.r_max,
        counted: match erosion.mode {
            ErosionMode::Surface => CountedGrains::Surface,
            ErosionMode::All => CountedGrains::All,
        },
        ..ErosionSettings::recommended(lower, upper, case.domain.lower.z, erosion.grain_size)
    })
}

fn stock(solver: &Solver) -> MomentumStock {
    let now = solver.momentum();
    MomentumStock {
        liquid: now.liquid,
        gas: now.gas,
        grains: now.grains,
        displaced: now.displaced,
        owed_to_grains: now.owed,
    }
}
