//! Values of earlier tables for those read after them.

use sazanami_dem::Motion;
use sazanami_numerics::{Real, Vector};

use crate::presets::{Preset, Solver};
use crate::tables::{
    Bed, BoundarySide, BoxDomain, DemOptions, Frame, Gate, GrainPlacement, LiquidRegion, Materials, Outputs, Overlap,
    Population, RunLength, Sides,
};
use crate::value::Range1;

/// Distance of places that are the same, over the box.
const SAME: Real = 1e-9;

/// Tables read before, under the names of their fields in [`Case`](crate::Case).
#[derive(Clone, Debug)]
pub struct Known {
    /// Name of the case file.
    pub file_name: String,
    /// Set of defaults.
    pub preset: Preset,
    /// Solver of the water.
    pub solver: Solver,
    /// Length of the run.
    pub run: RunLength,
    /// The box.
    pub domain: BoxDomain,
    /// Its sides.
    pub boundary: Sides,
    /// Gravity [m/s^2].
    pub gravity: Vector,
    /// Motion of the box.
    pub frame: Option<Frame>,
    /// Motion and contact of the grains.
    pub dem: DemOptions,
    /// Material of grains.
    pub materials: Materials,
    /// Populations of grains read before.
    pub grains: Vec<Population>,
    /// Gates.
    pub gates: Vec<Gate>,
    /// Motion of the grains of the population that is read.
    pub motion: Motion,
    /// Coupling of grains and the water that overlaps them.
    pub overlap: Overlap,
    /// Observation of the bed.
    pub bed: Bed,
    /// Liquids at the start read before.
    pub liquids: Vec<LiquidRegion>,
    /// Output and its schedule.
    pub output: Outputs,
    /// Names of the probes read before.
    pub probe_names: Vec<String>,
    /// Whether a table could not be read: what seems to be missing may stand in it.
    pub is_damaged: bool,
}

impl Default for Known {
    fn default() -> Self {
        Self {
            file_name: String::new(),
            preset: Preset::Recommended,
            solver: Solver::Mics,
            run: RunLength::default(),
            domain: BoxDomain::default(),
            boundary: [[BoundarySide::NoSlip; 2]; 3],
            gravity: Vector::NAN,
            frame: None,
            dem: DemOptions::default(),
            materials: Materials::default(),
            grains: Vec::new(),
            gates: Vec::new(),
            motion: Motion::Free,
            overlap: Overlap::default(),
            bed: Bed {
                porosity_lower: Real::NAN,
                porosity_upper: None,
                grain: Real::NAN,
                height_radius: Real::NAN,
                axis: [Real::NAN; 2],
            },
            liquids: Vec::new(),
            output: Outputs::default(),
            probe_names: Vec::new(),
            is_damaged: false,
        }
    }
}

impl Known {
    /// Whether grains form a bed: packed within the run or read from a file.
    pub fn has_bed(&self) -> bool {
        let forms = |p: &Population| matches!(p.placement, GrainPlacement::Packed(_) | GrainPlacement::Bed(_));
        self.grains.iter().any(forms)
    }

    /// Where the only liquid that falls meets the bed; the axis of the bed where none or several do, or that place is not in the box \[m].
    pub fn impact(&self) -> [Real; 2] {
        let axis = self.bed.axis;
        let mut falling = self.liquids.iter().filter(|liquid| liquid.falls());
        let (Some(drop), None) = (falling.next(), falling.next()) else { return axis };
        let gravity = self.gravity - self.frame.as_ref().map_or(Vector::ZERO, |frame| frame.acceleration);
        let Some(mut place) = drop.meets_bed(axis, gravity) else { return axis };
        let (lower, extent) = (self.domain.lower, self.domain.extent());
        for d in 0..2 {
            let repeats = self.boundary[d][0] == BoundarySide::Periodic;
            if repeats && !(0.0..=extent[d]).contains(&(place[d] - lower[d])) {
                place[d] = lower[d] + (place[d] - lower[d]).rem_euclid(extent[d]);
            }
        }
        // The axis itself, but for the rounding of its place.
        let is_apart = (0..2).any(|d| (place[d] - axis[d]).abs() > SAME * extent[d]);
        let is_inside = !self.domain.excludes(Vector::new(place[0], place[1], lower.z));
        if is_apart && is_inside { place } else { axis }
    }

    /// Lengths of what is observed: no longer than the box.
    pub fn lengths(&self) -> Range1 {
        let longest = self.domain.extent().length();
        if longest > 0.0 { Range1::Between(1e-6 * longest, longest) } else { Range1::Positive }
    }

    /// Radii of what is observed: within the plan of the box.
    pub fn radii(&self) -> Range1 {
        let extent = self.domain.extent();
        let longest = extent.x.hypot(extent.y);
        if longest > 0.0 { Range1::Between(1e-6 * longest, longest) } else { Range1::Positive }
    }
}
