//! Prediction of a case of moving particles: counts, memory and time.

use sazanami_mps::pouring;
use sazanami_numerics::{Real, Vector};
use serde::Serialize;

use super::bed_flow::{BedReport, bed_flow};
use super::volumes::{bed_top, displaced, volume_within};
use super::waves::{TankReport, tank};
use super::{CostModel, ShapeFacts, overlapping};
use crate::assembly::particles;
use crate::case::meaning::{Case, FluidName, Particles, Preparation, Solver};

/// Memory of a bin, with its part of the coarse pressure equation \[bytes].
const MEMORY_BIN: Real = 75.0;
/// Memory of a cell in which water is poured: its share of liquid, what lies below its corner, and a copy while ranks add
/// theirs \[bytes].
const MEMORY_POURED: Real = 24.0;
/// Layers of a wall beside those within the radius of influence.
const WALL_LAYERS: Real = 1.0;

/// Moving particles and their tank.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ParticlesReport {
    /// Particle spacing \[m].
    pub spacing_m: Real,
    /// Fluid particles, about.
    pub fluid: usize,
    /// Wall particles.
    pub walls: usize,
    /// Waves of a shaken tank.
    pub tank: Option<TankReport>,
    /// Flow over the bed of a tank that swings along x1.
    pub bed: Option<BedReport>,
}

/// Describes particles and tank, between the grains of a bed file too where `shapes` know them; `None` for the other solver.
pub(super) fn report(case: &Case, shapes: &[ShapeFacts]) -> Option<ParticlesReport> {
    let particles = case.particles.as_ref().filter(|_| case.solver == Solver::Mps)?;
    Some(ParticlesReport {
        spacing_m: particles.spacing,
        fluid: fluid(case, particles, shapes),
        walls: walls(case, particles),
        tank: tank(case),
        bed: bed_flow(case),
    })
}

/// Fluid particles: what the liquids hold between the grains.
fn fluid(case: &Case, particles: &Particles, shapes: &[ShapeFacts]) -> usize {
    let box_ = case.domain.extent().element_product();
    let volumes = case.liquids.iter().zip(volumes_between_grains(case, shapes));
    let liquids = volumes.filter(|(liquid, _)| liquid.fluid == FluidName::Liquid);
    let liquid: Real = liquids.map(|(_, volume)| volume.unwrap_or(box_)).sum();
    (liquid / particles.spacing.powi(3)).round() as usize
}

/// Volume of each liquid within the box, without what later ones take of it [m^3]; among moving particles without the grains that lie in it.
pub(super) fn volumes_between_grains(case: &Case, shapes: &[ShapeFacts]) -> Vec<Option<Real>> {
    let overlapped = case.solver == Solver::Mps;
    let displaced = if overlapped { displaced(case, shapes) } else { vec![0.0; case.liquids.len()] };
    let all = case.liquids.iter().zip(overlapping::taken_beside(case, bed_top(case, shapes))).zip(displaced);
    all.map(|((liquid, taken), displaced)| Some((volume_within(case, liquid)? * (1.0 - taken) - displaced).max(0.0)))
        .collect()
}

/// Particles of the walls: the layers behind each, edges included.
fn walls(case: &Case, particles: &Particles) -> usize {
    let layers = WALL_LAYERS + particles.radius.floor();
    let box_ = case.domain.extent();
    let inner: Vec<Real> = (0..3).map(|d| (box_[d] / particles.spacing).round()).collect();
    let outer = |d: usize| inner[d] + layers * case.boundary[d].iter().filter(|side| side.is_wall()).count() as Real;
    (outer(0) * outer(1) * outer(2) - inner[0] * inner[1] * inner[2]) as usize
}

/// Wall-clock time of the steps and of what comes before them, without the grains \[s].
pub(super) fn predict(report: &ParticlesReport, steps: Real, threads: usize, model: &CostModel) -> Real {
    // Without water no step looks at walls.
    if report.fluid == 0 {
        return 0.0;
    }
    let step = report.fluid as Real * model.fluid_particle + report.walls as Real * model.wall_particle;
    steps * step / model.speed(threads)
}

/// Memory of the particles, and of the bins in which their neighbours are found \[bytes]; that of pouring where it is more.
pub(super) fn memory(case: &Case, report: &ParticlesReport, model: &CostModel) -> Real {
    let steps = (report.fluid + report.walls) as Real * model.memory_particle + bins(case) * MEMORY_BIN;
    steps.max(pouring(case, report))
}

/// Memory of pouring between grains that may lie unevenly \[bytes].
fn pouring(case: &Case, report: &ParticlesReport) -> Real {
    if case.grains.is_empty() {
        return 0.0;
    }
    let cells = watered(case) * (pouring::FINENESS / report.spacing_m);
    cells.element_product() * MEMORY_POURED
}

/// Extent of the part of the tank in which there is water, from side to side and up to its highest place \[m].
fn watered(case: &Case) -> Vector {
    let extent = case.domain.extent();
    let tops = case.liquids.iter().map(|liquid| liquid.top().map_or(extent.z, |top| top - case.domain.lower.z));
    let top = tops.fold(0.0, Real::max);
    extent.with_z(extent.z.min(top))
}

/// Bins of that part.
fn bins(case: &Case) -> Real {
    // Three bins on each side are within the radius of influence and the way of a step.
    (watered(case) / particles::grid(case).spacing + 6.0).element_product()
}

/// Steps that come before the run, at most.
pub(super) fn preparation_steps(preparation: &Preparation, dt: Real) -> Real {
    if preparation.state.is_some() {
        return 0.0;
    }
    preparation.relax_steps as Real + preparation.settle / dt
}
