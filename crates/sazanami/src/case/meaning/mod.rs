//! What a case file means: plain data in SI units with every default filled in and cross-checked.

mod flow;
mod grains;
mod observed;
mod particles;

pub use flow::{
    Acceleration, AlphaMethod, BoundarySide, Convection, Coupling, DropVelocity, Exchange, Fluid, FluidName,
    FluidOptions, Fluids, Frame, Limiter, LiquidRegion, Oscillation, Placement, Projection, Region, SIDE_NAMES, Step,
    TorqueArm, ViscosityScheme, VofScheme, Weighting,
};
pub use grains::{
    BedFile, ContactLaw, ContactSphereChoice, Damping, DampingKind, DemOptions, Grain, GrainPlacement, GrainShape,
    HistoryRotation, Lattice, LatticePlacement, Material, Motion, Multiplicity, Orientation, Packing, PackingStop,
    PairContact, Population, Rolling, SizeDistribution, SlipDirection, Substeps, VolumeChoice, WALL, WallContact,
};
pub use observed::{
    Bed, Checkpoints, Erosion, ErosionMode, FieldPrecision, Outputs, Probe, ProbePlace, RunLength, Schedule,
};
pub use particles::{
    Axis, COLOUR_FORCE, DensityReference, GradientForm, ImageSide, KeepApart, LayerReference, Measured,
    Motion as TankMotion, Order, OutputFrame, Overlap, Particles, Preparation, PressureForce, Ripples, SphereDrag,
    WallMotion, Wendland,
};

use std::path::{Path, PathBuf};

use sazanami_io::MeasuredProfile;
use sazanami_io::readings::ReadingsError;
use sazanami_numerics::grid::Grid;
use sazanami_numerics::{Real, Vector};

use super::written::choices;

choices! {
    /// Solver for the water and the air.
    Solver {
        /// One grid for liquid, gas and grains.
        Mics = "mics",
        /// Moving particles of liquid that overlap grains.
        Mps = "mps",
    }

    /// Set of defaults.
    Preset {
        /// What works best.
        Recommended = "recommended",
        /// The scheme of Yagyu et al. (2015), or of Tazaki et al. for moving particles, to the letter, where it is known.
        PaperLiteral = "paper_literal",
    }
}

/// The box and its division into cells.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BoxDomain {
    /// Lower corner [m].
    pub lower: Vector,
    /// Upper corner [m].
    pub upper: Vector,
    /// Cells in each direction.
    pub cells: [usize; 3],
}

impl BoxDomain {
    /// The grid of the box.
    #[must_use]
    pub fn grid(&self) -> Grid {
        Grid::new(self.cells, self.lower, self.upper)
    }

    /// Edges of the box [m].
    #[must_use]
    pub fn extent(&self) -> Vector {
        self.upper - self.lower
    }

    /// Edges of a cell [m].
    #[must_use]
    pub fn spacing(&self) -> Vector {
        self.extent() / Vector::new(self.cells[0] as Real, self.cells[1] as Real, self.cells[2] as Real)
    }

    /// Number of cells.
    #[must_use]
    pub fn cell_count(&self) -> usize {
        self.cells.iter().fold(1, |count: usize, &n| count.saturating_mul(n))
    }
}

/// A case, ready to be built.
#[derive(Clone, Debug, PartialEq)]
pub struct Case {
    /// Name, used for the folder of results.
    pub name: String,
    /// One line for people.
    pub title: String,
    /// Set of defaults that was used.
    pub preset: Preset,
    /// Solver for the water and the air.
    pub solver: Solver,
    /// The box.
    pub domain: BoxDomain,
    /// Sides of the box, `boundary[direction][0 lower, 1 upper]`.
    pub boundary: [[BoundarySide; 2]; 3],
    /// Gravity [m/s^2].
    pub gravity: Vector,
    /// Motion of the frame of reference, if it moves.
    pub frame: Option<Frame>,
    /// The two fluids.
    pub fluids: Fluids,
    /// How the fluids are computed.
    pub fluid: FluidOptions,
    /// How fluids and grains act on each other.
    pub coupling: Coupling,
    /// Water as moving particles, where the case says how.
    pub particles: Option<Particles>,
    /// Where there is liquid at first; the rest is gas.
    pub liquids: Vec<LiquidRegion>,
    /// How grains are moved.
    pub dem: DemOptions,
    /// What grains are made of.
    pub materials: Vec<Material>,
    /// Contact of every pair of materials that can meet, walls included.
    pub contacts: Vec<PairContact>,
    /// The grains.
    pub grains: Vec<Population>,
    /// Observation of the bed.
    pub bed: Bed,
    /// Observation of the crater, if it is wanted.
    pub erosion: Option<Erosion>,
    /// Observation of ripples, if it is wanted.
    pub ripples: Option<Ripples>,
    /// Points, lines, planes and bodies to watch.
    pub probes: Vec<Probe>,
    /// What is written when.
    pub output: Outputs,
    /// Checkpoints.
    pub checkpoint: Checkpoints,
    /// How long the run is.
    pub run: RunLength,
}

impl Case {
    /// How water is moving particles, in a case for that solver.
    ///
    /// # Panics
    /// In a case for another one.
    #[must_use]
    pub(crate) fn moving_particles(&self) -> &Particles {
        self.particles.as_ref().expect("a case of moving particles says how they are")
    }

    /// Gravity in the frame of positions at `time` [m/s^2]: gravity less the frame's acceleration.
    #[must_use]
    pub fn effective_gravity(&self, time: Real) -> Vector {
        self.frame.as_ref().map_or(self.gravity, |frame| self.gravity - frame.acceleration_at(time))
    }

    /// What stands above pictures: the title, or the name of a case without one.
    #[must_use]
    pub fn caption(&self) -> &str {
        if self.title.is_empty() { &self.name } else { &self.title }
    }

    /// Gravity in the frame of the tank before it moves [m/s^2].
    #[must_use]
    pub fn resting_gravity(&self) -> Vector {
        self.gravity - self.frame.as_ref().map_or(Vector::ZERO, |frame| frame.acceleration)
    }

    /// Displacement [m], velocity [m/s] and acceleration [m/s^2] of the tank at `time` [s] by its motion.
    #[must_use]
    pub fn tank_at(&self, time: Real) -> [Vector; 3] {
        let motion = self.frame.as_ref().and_then(|frame| frame.motion.as_ref());
        motion.map_or([Vector::ZERO; 3], |motion| motion.at(time))
    }

    /// Period of the tank's motion [s], if it moves in cycles.
    #[must_use]
    pub fn period(&self) -> Option<Real> {
        self.frame.as_ref()?.motion.as_ref()?.period()
    }

    /// Reads a profile that was measured at `time` [s], as seen from the tank; nothing if there is no such file.
    ///
    /// # Errors
    /// As [`MeasuredProfile::read_if_there`].
    pub fn measured_profile(&self, file: &Path, time: Real) -> Result<Option<MeasuredProfile>, ReadingsError> {
        let place = self.tank_at(time)[0];
        Ok(MeasuredProfile::read_if_there(file)?.map(|profile| profile.in_tank([place.x, place.z])))
    }

    /// The bed and the water that were measured at `time` [s], each by the first file that is there.
    #[must_use]
    pub fn measured_at(&self, time: Real) -> [Option<MeasuredProfile>; 2] {
        let of = |file: fn(&Measured) -> Option<&PathBuf>| {
            let mut tables =
                self.ripples.iter().flat_map(|ripples| &ripples.measured).filter(|table| table.is_of(time));
            tables.find_map(|table| self.measured_profile(file(table)?, table.time).ok().flatten())
        };
        [of(|table| table.bed.as_ref()), of(|table| table.water.as_ref())]
    }

    /// Whether positions are those in the laboratory, in which the walls move.
    #[must_use]
    pub fn walls_move(&self) -> bool {
        self.frame.as_ref().is_some_and(|frame| frame.motion.is_some() && frame.walls == WallMotion::Moving)
    }

    /// Contact law of a pair of materials; `wall` is the box.
    #[must_use]
    pub fn contact(&self, a: &str, b: &str) -> Option<&ContactLaw> {
        self.contacts
            .iter()
            .find(|pair| (pair.a == a && pair.b == b) || (pair.a == b && pair.b == a))
            .map(|pair| &pair.law)
    }

    /// Material of that name.
    #[must_use]
    pub fn material(&self, name: &str) -> Option<&Material> {
        self.materials.iter().find(|material| material.name == name)
    }

    /// Whether a side of the box holds grains back.
    #[must_use]
    pub fn holds_grains(&self, direction: usize, upper: usize) -> bool {
        self.dem.grain_walls[direction][upper]
    }

    /// Whether grains are packed within the run.
    #[must_use]
    pub fn packs(&self) -> bool {
        self.grains.iter().any(|population| matches!(population.placement, GrainPlacement::Packed(_)))
    }

    /// Whether the grains form a bed: packed within the run or read from a file.
    #[must_use]
    pub fn has_bed(&self) -> bool {
        self.grains
            .iter()
            .any(|population| matches!(population.placement, GrainPlacement::Packed(_) | GrainPlacement::Bed(_)))
    }
}
