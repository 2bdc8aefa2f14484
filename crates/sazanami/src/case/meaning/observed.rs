//! What is observed, written and kept, and how long the run is.

use std::path::PathBuf;

use sazanami_numerics::{Real, Vector};

use crate::case::written::choices;

choices! {
    /// Which grains make the surface of the bed.
    ErosionMode {
        /// Those that can be seen from above.
        Surface = "surface",
        /// All of them.
        All = "all",
    }

    /// Precision of written fields.
    FieldPrecision {
        /// Four bytes a number.
        Single = "single",
        /// Eight bytes a number.
        Double = "double",
    }
}

/// Observation of the bed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bed {
    /// Slab between two heights in which porosity is measured [m].
    pub porosity_slab: [Real; 2],
    /// Radius about the axis within which the bed's height H_s is taken [m].
    pub height_radius: Real,
    /// Axis in x1 and x2 [m].
    pub axis: [Real; 2],
}

/// Observation of the crater.
#[derive(Clone, Debug, PartialEq)]
pub struct Erosion {
    /// Cells of the smoothing grid [m].
    pub dx: Real,
    /// Thickness of the circular layers [m].
    pub dr: Real,
    /// Largest radius [m].
    pub r_max: Real,
    /// Which grains count.
    pub mode: ErosionMode,
    /// Axis in x1 and x2 [m].
    pub axis: [Real; 2],
    /// Grain size d that lengths of the method are measured in [m].
    pub grain_size: Real,
}

/// Times at which something happens.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Schedule {
    /// Every so often [s].
    pub every: Option<Real>,
    /// Every so many steps.
    pub steps: Option<usize>,
    /// At these times [s], ascending.
    pub at: Vec<Real>,
}

impl Schedule {
    /// Whether nothing ever happens.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.every.is_none() && self.steps.is_none() && self.at.is_empty()
    }

    /// How often it happens up to `until` [s], with about `steps` steps on the way.
    #[must_use]
    pub fn count(&self, until: Real, steps: Real) -> Real {
        let every = self.every.map_or(0.0, |every| (until / every).floor() + 1.0);
        let by_steps = self.steps.map_or(0.0, |n| (steps / n as Real).floor());
        every + by_steps + self.at.iter().filter(|&&t| t <= until).count() as Real
    }
}

/// A place to watch.
#[derive(Clone, Debug, PartialEq)]
pub enum ProbePlace {
    /// A point [m].
    Point(Vector),
    /// Points equally spaced on a line.
    Line {
        /// First point [m].
        from: Vector,
        /// Last point [m].
        to: Vector,
        /// How many.
        points: usize,
    },
    /// A plane normal to a direction of the box.
    Plane {
        /// Direction 0, 1, 2.
        direction: usize,
        /// Coordinate along it [m].
        position: Real,
    },
    /// A wave gauge at this place in x1 and x2 [m].
    Gauge([Real; 2]),
    /// A grain.
    Body {
        /// Name of its population.
        population: String,
        /// Number within it, from 0.
        index: usize,
    },
}

/// A place to watch and when.
#[derive(Clone, Debug, PartialEq)]
pub struct Probe {
    /// Name.
    pub name: String,
    /// Where.
    pub place: ProbePlace,
    /// When.
    pub schedule: Schedule,
}

/// What is written when.
#[derive(Clone, Debug, PartialEq)]
pub struct Outputs {
    /// Fields for ParaView.
    pub fields: Schedule,
    /// Grains for ParaView.
    pub grains: Schedule,
    /// Pictures.
    pub figures: Schedule,
    /// Rows of `series.csv`.
    pub series: Schedule,
    /// Precision of fields.
    pub precision: FieldPrecision,
    /// Frame of positions and velocities.
    pub frame: super::OutputFrame,
    /// File the packed bed is written to.
    pub bed: Option<PathBuf>,
}

/// Checkpoints.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Checkpoints {
    /// Every so much wall-clock time [s].
    pub every_wall: Option<Real>,
    /// Every so much simulated time [s].
    pub every: Option<Real>,
    /// How many are kept.
    pub keep: usize,
}

/// How long the run is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RunLength {
    /// Simulated time at the end [s].
    pub until: Real,
    /// Most fluid steps.
    pub steps: Option<usize>,
    /// Whether the run ends when its grains are packed.
    pub packing_only: bool,
}
