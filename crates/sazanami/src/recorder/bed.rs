//! The grains as they lie, on rank 0, and the bed that they make: the same whatever the water is.

use std::sync::Arc;

use sazanami_dem::Engine;
use sazanami_numerics::domain::Domain;
use sazanami_numerics::geometry::Shape;
use sazanami_numerics::snapshot::Snapshot;
use sazanami_numerics::{Quaternion, Real, Vector};
use sazanami_observe::heap::{Heap, HeapError, HeapSettings};
use sazanami_observe::{BedView, Body, GatheredBed, Ground, bed_profile};
use serde_json::{Value, json};

use crate::case::meaning::{Bed, Case};
use crate::columns::{Field, object, quantities};
use crate::job::Job;
use crate::recorder::grain_files::in_tank;

const SECTION: &str = "observe/bed";
/// Void fraction above which grains are no bed.
pub(crate) const LOOSEST: Real = 0.9;

/// The bed before the impact.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct BedFindings {
    /// Porosity of the slab; `None` if the slab lies above the bed.
    pub porosity: Option<Real>,
    /// Highest node near the axis above the floor [mm].
    pub height_mm: Real,
    /// Upper side of the slab above the floor [mm]: no higher than the bed. `None` if not known.
    pub slab_top_mm: Option<Real>,
    /// Mean speed [m/s].
    pub mean_speed: Real,
    /// Order of the long axes: above 0 if they lie.
    pub lying_order: Real,
}

impl BedFindings {
    /// Whether the grains form a bed: a few that lie or fall in a tank do not.
    pub fn is_bed(&self) -> bool {
        self.porosity.is_some_and(|porosity| porosity < LOOSEST)
    }
}

/// Fields of `observables.bed`.
pub(crate) const BED: &[Field<BedFindings>] = quantities! {
    "porosity", "", "porosity of the slab of `[bed]`, as far as it lies within the bed" => |bed| json!(bed.porosity);
    "height_mm", "mm", "height of the highest node near the axis, or of the surface on it where that is higher, H_s, above the floor" => |bed| json!(bed.height_mm);
    "slab_top_mm", "mm", "upper side of that slab above the floor: that of `porosity_upper`, or H_s if it lies lower; by default a grain below H_s at most, of beds of more than two layers"
        => |bed| json!(bed.slab_top_mm);
    "mean_speed", "m/s", "mean speed of the grains" => |bed| json!(bed.mean_speed);
    "lying_order", "", "order of the long axes: above 0 if they lie, 0 at random" => |bed| json!(bed.lying_order);
};

/// Fields of `observables.heap`.
pub(crate) const HEAP: &[Field<Heap>] = quantities! {
    "angle_deg", "degree", "angle of the flank against the horizontal: of repose, once the grains lie still"
        => |heap| json!(heap.angle.to_degrees());
    "angle_uncertainty_deg", "degree", "its standard error, from the scatter about the fitted line or between parts of the heap; other heaps scatter more"
        => |heap| json!(heap.uncertainty.to_degrees());
    "upper_angle_deg", "degree", "angle of the upper half of the flank" => |heap| json!(heap.halves[0].to_degrees());
    "lower_angle_deg", "degree", "angle of the lower half of the flank" => |heap| json!(heap.halves[1].to_degrees());
    "relief_mm", "mm", "height of the crest over the foot" => |heap| json!(1e3 * heap.relief);
    "flank_mm", "mm", "distances from the axis between which the line is fitted"
        => |heap| json!(heap.flank.map(|distance| 1e3 * distance));
    "mean_speed", "m/s", "mean speed of the grains that are not in the air; a heap that moves has no angle"
        => |heap| json!(heap.mean_speed);
    "airborne_grains", "", "free grains in the air, or in a funnel, which are left out" => |heap| json!(heap.airborne);
};

/// A heap, or why there is none, as the summary has it.
pub(super) fn heap_json(heap: &Result<Heap, HeapError>) -> Value {
    match heap {
        Ok(heap) => Value::Object(object(HEAP, heap)),
        Err(problem) => json!({ "not_evaluated": problem.to_string() }),
    }
}

/// Settings of the heap of a case, if it measures one.
pub(super) fn heap_settings(case: &Case) -> Option<HeapSettings> {
    let heap = case.heap?;
    let Ground { lower, upper, periodic } = case.ground();
    Some(HeapSettings {
        shape: heap.shape,
        axis: heap.axis,
        grain_size: heap.grain_size,
        lower,
        upper,
        periodic,
        floor: case.domain.lower.z,
        gravity: case.resting_gravity().length(),
    })
}

/// The grains of all ranks, gathered on rank 0.
pub(crate) struct GatheredGrains {
    shapes: Arc<[Shape]>,
    bed: GatheredBed,
    /// Whether this is rank 0.
    pub leads: bool,
    measured: BedSettings,
    /// The bed as it was last measured.
    pub found: Option<BedFindings>,
    heap_settings: Option<HeapSettings>,
    /// The heap as it was last measured, where the case asks for it.
    pub heap: Option<Result<Heap, HeapError>>,
}

impl GatheredGrains {
    pub fn new(job: &Job) -> Self {
        Self {
            shapes: Arc::clone(&job.shapes),
            bed: GatheredBed::default(),
            leads: false,
            measured: BedSettings::of(job.case),
            found: None,
            heap_settings: heap_settings(job.case),
            heap: None,
        }
    }

    /// Gathers the grains of all ranks.
    pub fn gather(&mut self, domain: &Domain, engine: &Engine) {
        self.leads = domain.communicator().rank() == 0;
        self.bed.gather(domain, engine.grains(), engine.time());
    }

    /// Sees the grains from a tank that is displaced \[m] and moves [m/s] in the frame of the engine.
    pub fn put_into_tank(&mut self, domain: &Domain, [place, velocity]: [Vector; 2]) {
        let grains = &mut self.bed.grains;
        grains.position.iter_mut().for_each(|position| *position = in_tank(domain, *position, place));
        grains.velocity.iter_mut().for_each(|of_grain| *of_grain -= velocity);
    }

    /// Number of grains gathered.
    pub fn count(&self) -> usize {
        self.bed.grains.id.len()
    }

    /// Evaluates the gathered grains.
    pub fn with_bed<T>(&self, evaluate: impl FnOnce(&BedView) -> T) -> T {
        let bodies: Vec<Body> = self.shapes.iter().map(Body::of).collect();
        evaluate(&self.bed.view(&bodies))
    }

    /// Measures the bed as it lies: height of its highest node near the axis, the floor without grains there \[m], and
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

    /// Measures the slope of the heap on rank 0, where the case asks for it.
    pub fn measure_heap(&mut self) {
        if let Some(settings) = self.heap_settings.filter(|_| self.leads) {
            self.heap = Some(self.with_bed(|bed| Heap::of(bed, &settings)));
        }
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
            let or_nan = |value: Option<Real>| value.unwrap_or(Real::NAN);
            let BedFindings { porosity, height_mm, slab_top_mm, mean_speed, lying_order } = *bed;
            let values = vec![or_nan(porosity), height_mm, mean_speed, lying_order, or_nan(slab_top_mm)];
            snapshot.put_reals(SECTION, values);
        }
    }

    /// Takes it up again.
    pub fn restore(&mut self, snapshot: &Snapshot) {
        self.found = bed_findings(snapshot);
    }
}

/// Settings of the bed's measurement.
#[derive(Clone, Copy, Debug)]
pub(super) struct BedSettings {
    floor: Real,
    ground: Ground,
    bed: Bed,
    area: Real,
}

impl BedSettings {
    pub fn of(case: &Case) -> Self {
        let extent = case.domain.extent();
        Self { floor: case.domain.lower.z, ground: case.ground(), bed: case.bed, area: extent.x * extent.y }
    }

    /// Highest node near the axis \[m]; the floor without grains there.
    fn height(&self, bed: &BedView) -> Real {
        bed_profile::height_near(bed, &self.ground, self.bed.axis, self.bed.height_radius).unwrap_or(self.floor)
    }

    /// Measures of a bed as it lies.
    pub fn measure(&self, bed: &BedView) -> BedFindings {
        self.findings(bed, self.height(bed))
    }

    /// The same for a bed of a `height` that is known \[m].
    fn findings(&self, bed: &BedView, height: Real) -> BedFindings {
        let [lower, upper] = self.bed.porosity_slab(height);
        let porosity = (lower < upper).then(|| bed_profile::porosity_of_grains(bed, lower..upper, self.area));
        BedFindings {
            porosity,
            height_mm: 1e3 * (height - self.floor),
            slab_top_mm: Some(1e3 * (upper - self.floor)),
            mean_speed: bed_profile::motion(bed).mean_speed,
            lying_order: bed_profile::orientation(bed).map_or(0.0, |order| order.lying_order),
        }
    }
}

/// The initial bed as the run measured it.
pub(super) fn bed_findings(snapshot: &Snapshot) -> Option<BedFindings> {
    let known = |value: Real| Some(value).filter(|value| value.is_finite());
    match *snapshot.reals(SECTION).ok()? {
        [porosity, height_mm, mean_speed, lying_order, ref slab_top @ ..] => Some(BedFindings {
            porosity: known(porosity),
            height_mm,
            // Checkpoints of earlier versions do not have it.
            slab_top_mm: slab_top.first().copied().and_then(known),
            mean_speed,
            lying_order,
        }),
        _ => None,
    }
}
