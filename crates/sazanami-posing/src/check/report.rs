//! Report of `check`.

use sazanami_dem::Body;
use sazanami_dem::impact::{Error, ImpactErrors};
use sazanami_numerics::Real;
use serde::Serialize;

use super::{ParticlesReport, RanksReport, SubstepCause};
use crate::machine::Machine;

/// A limit on the time step.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct LimitReport {
    /// Name, as in the live line.
    pub name: &'static str,
    /// Longest step it allows at the start \[s].
    pub dt_s: Real,
    /// Rule by which it is found.
    pub rule: String,
    /// Whether it rules at the start.
    pub rules: bool,
}

/// A population of grains.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct PopulationReport {
    /// Name of the population in the case.
    pub name: String,
    /// Number of grains; absent for a bed whose file has not been read.
    pub grains: Option<usize>,
    /// Approximate number of packed grains that stay when the bed is levelled.
    pub levelled: Option<usize>,
    /// Contact spheres of one grain.
    pub contact_spheres: Option<usize>,
    /// Contact spheres of a grain that touch a plane at once, at most.
    pub face_spheres: Option<usize>,
    /// Grain size \[m].
    pub size_m: Option<Real>,
    /// Cells on the grain size, for the largest edge of a cell.
    pub cells_per_grain: Option<Real>,
    /// Mass of a grain of size factor 1, the mean of a list \[kg].
    pub mass_kg: Option<Real>,
    /// Facts about its shape, in words.
    pub shape: Vec<String>,
    /// Its contact spheres and inertia.
    #[serde(skip)]
    pub body: Option<Body>,
    /// How fast surfaces of listed grains that turn cover space as these begin, and how fast the fastest of their points is at most [m/s].
    #[serde(skip)]
    pub begins: [Real; 2],
    /// Corners of its surface.
    #[serde(skip)]
    pub surface_corners: Option<usize>,
}

/// Flat faces of two populations on each other, made of spheres as they are.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct BumpReport {
    /// The populations.
    pub between: [String; 2],
    /// Friction coefficient that the bumps add where one slides slowly on the other.
    pub friction: Real,
    /// Speed beyond which it flies from bump to bump and they add more [m/s].
    pub speed: Real,
}

/// Error over the moments within a sub-step at which grains meet, at the worst of five angles.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct ErrorReport {
    /// Magnitude of its mean.
    pub mean: Real,
    /// Its largest magnitude.
    pub largest: Real,
}

/// Errors of oblique impacts of the lightest grains that come from the length of the sub-step.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct ImpactReport {
    /// Of the coefficient of restitution.
    pub restitution: ErrorReport,
    /// Of the speed of the surface by the spin, over the tangential speed before.
    pub spin: ErrorReport,
}

impl From<ImpactErrors> for ImpactReport {
    fn from(errors: ImpactErrors) -> Self {
        let of = |error: Error| ErrorReport { mean: error.mean, largest: error.largest };
        Self { restitution: of(errors.restitution), spin: of(errors.spin) }
    }
}

/// Momentum exchange between resolved grains and fluid.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ExchangeReport {
    /// Word of `coupling.exchange`, `auto` resolved.
    pub scheme: &'static str,
    /// Width of the narrowest grain in cells, where known.
    pub narrowest_cells: Option<Real>,
}

/// A body of liquid.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct LiquidReport {
    /// Name of the liquid in the case.
    pub name: String,
    /// Its fluid: `liquid`, or `gas` for a bubble.
    pub fluid: &'static str,
    /// Volume within the box and between the grains [m^3], without what later liquids take, where it has a formula.
    pub volume_m3: Option<Real>,
    /// Mass of this volume \[kg].
    pub mass_kg: Option<Real>,
    /// Momentum [kg m/s].
    pub momentum: Option<Real>,
    /// Height of the liquid over that of a cell.
    pub cells_per_height: Option<Real>,
}

/// Everything `check` tells.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct CheckReport {
    /// Name of the case.
    pub case: String,
    /// One line about it.
    pub title: String,
    /// Hash of its meaning.
    pub case_hash: String,
    /// Cells in each direction.
    pub cells: [usize; 3],
    /// Number of cells.
    pub cell_count: usize,
    /// Edges of a cell \[m].
    pub spacing_m: [Real; 3],
    /// Bodies of liquid at the start.
    pub liquids: Vec<LiquidReport>,
    /// Grains.
    pub populations: Vec<PopulationReport>,
    /// What the bumps of flat faces add to friction.
    pub bumps: Vec<BumpReport>,
    /// Their exchange of momentum with the fluid on the grid.
    pub exchange: Option<ExchangeReport>,
    /// Grains of the flow in all, as far as known.
    pub grains: usize,
    /// Their contact spheres in all, as far as known.
    pub contact_spheres: usize,
    /// Whether the tank was prepared before, so that nothing has to be packed.
    pub made_ready: bool,
    /// Moving particles and their tank, for that solver.
    pub particles: Option<ParticlesReport>,
    /// Limits on the step, shortest first.
    pub limits: Vec<LimitReport>,
    /// Step at the start \[s].
    pub dt_s: Real,
    /// Fluid passes in a step.
    pub fluid_passes: usize,
    /// Sub-steps of the grains in a step.
    pub substeps: usize,
    /// What asks for so many, where the case does not say how many.
    pub substep_cause: SubstepCause,
    /// Errors of oblique impacts that the length of the sub-steps brings, where grains move.
    pub impact_errors: Option<ImpactReport>,
    /// Fluid steps, if the step stays as it is at the start, or grows as a liquid slows down on its bed.
    pub steps: Real,
    /// Fluid steps, if the step is that of the speeds that bodies reach from the start on.
    pub most_steps: Real,
    /// Memory that the run takes \[bytes].
    pub memory_bytes: Real,
    /// Memory that is free \[bytes].
    pub memory_available: Option<u64>,
    /// Results on disk \[bytes].
    pub disk_bytes: Real,
    /// The same by what is written.
    #[serde(skip)]
    pub disk_parts: [(&'static str, Real); 7],
    /// Disk that is free \[bytes].
    pub disk_available: Option<u64>,
    /// Wall-clock time by part on this machine \[s].
    pub predicted_s: Vec<(&'static str, Real)>,
    /// Wall-clock time in all, if the step stays as it is at the start \[s].
    pub predicted_total_s: Real,
    /// The same if the step is that of the speeds that bodies reach from the start on \[s].
    pub predicted_most_s: Real,
    /// Threads the prediction is for.
    pub threads: usize,
    /// Division among ranks, if that was asked for.
    pub ranks: Option<RanksReport>,
    /// Processors and memory of this machine.
    pub machine: Machine,
}
