//! The grains as they lie, on rank 0, and the bed that they make: the same whatever the water is.

use std::sync::Arc;

use sazanami_dem::Engine;
use sazanami_numerics::domain::Domain;
use sazanami_numerics::geometry::Shape;
use sazanami_numerics::snapshot::Snapshot;
use sazanami_numerics::{Quaternion, Real, Vector};
use sazanami_observe::{BedView, Body, GatheredBed, bed_profile};

use super::summary::BedFindings;
use crate::case::meaning::Case;
use crate::simulation::Job;

const BED: &str = "observe/bed";

/// The grains of all ranks, gathered on rank 0.
pub(crate) struct GatheredGrains {
    shapes: Arc<[Shape]>,
    bed: GatheredBed,
    /// Whether this is rank 0.
    pub leads: bool,
    measured: BedSettings,
    /// The bed as it was last measured.
    pub found: Option<BedFindings>,
}

impl GatheredGrains {
    pub fn new(job: &Job) -> Self {
        Self {
            shapes: Arc::clone(&job.shapes),
            bed: GatheredBed::default(),
            leads: false,
            measured: BedSettings::of(job.case),
            found: None,
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

    /// Measures the bed as it lies: height of its highest node near the axis, the floor without grains there [m], and
    /// all that is found.
    pub fn measure_bed(&mut self) -> (Real, BedFindings) {
        let (height, found) = self.with_bed(|bed| {
            let height = self.measured.height(bed);
            (height, self.measured.findings(bed, height))
        });
        if self.count() > 0 {
            self.found = Some(found);
        }
        (height, found)
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

    /// Keeps the grains as they lie under names that begin with `prefix`.
    pub fn keep(&self, prefix: &str, snapshot: &mut Snapshot) {
        self.bed.save(prefix, snapshot);
    }

    /// Adds what was found of the bed to a snapshot.
    pub fn save(&self, snapshot: &mut Snapshot) {
        if let Some(bed) = &self.found {
            snapshot.put_reals(BED, vec![bed.porosity, bed.height_mm, bed.mean_speed, bed.lying_order]);
        }
    }

    /// Takes it up again.
    pub fn restore(&mut self, snapshot: &Snapshot) {
        self.found = bed_findings(snapshot);
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
        self.findings(bed, self.height(bed))
    }

    /// The same for a bed of a `height` that is known [m].
    fn findings(&self, bed: &BedView, height: Real) -> BedFindings {
        let slab = self.slab[0]..self.slab[1];
        let porosity = if bed.is_empty() { 1.0 } else { bed_profile::porosity_of_grains(bed, slab, self.area) };
        BedFindings::of(bed, self.floor, height, porosity)
    }
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
