//! Prediction of a case without running it: resolution, counts, step limits, memory, disk and cost.

mod bed_flow;
mod cost;
mod disk;
mod limits;
mod memory;
mod model;
mod overlapping;
mod particles;
mod pictures;
mod populations;
mod ranks;
mod reached;
mod report;
mod slowing;
mod substeps;
mod tank_warnings;
mod text;
mod volumes;
mod waves;

use sazanami_numerics::Real;
use sazanami_numerics::choice::Choice as _;

use crate::case::meaning::{Case, FluidName, LiquidRegion};
use crate::machine::Machine;

pub(crate) use crate::assembly::grains::PACKED;
pub use bed_flow::{BedReport, PredictedReport, bed_flow};
use cost::packing_time;
pub(crate) use cost::{fall_of, packing_substeps};
pub use disk::warn_of_disk;
pub use limits::given_speed;
pub(crate) use limits::{Cause, OF_PASS, Pace, speeds, strongest_force};
pub use memory::{check_memory, memory, warn_of_address_space};
pub use model::CostModel;
pub(crate) use overlapping::{taken, warn_of_overlap};
pub use particles::ParticlesReport;
pub use pictures::PictureCost;
pub use populations::ShapeFacts;
pub(crate) use populations::{exchange_of, population_reports};
pub use ranks::{RanksReport, ranks};
pub use report::{
    BumpReport, CheckReport, ErrorReport, ExchangeReport, ImpactReport, LimitReport, LiquidReport, PopulationReport,
};
pub use substeps::SubstepCause;
pub(crate) use substeps::{impact_errors, longest_substep, stiffest_contact, stiffness, substep_cause};
pub(crate) use tank_warnings::warn_of_tank;
pub use text::explain;
pub(crate) use volumes::{bed_top, volume_within};
pub use waves::TankReport;
pub(crate) use waves::tank;

/// The same of spheres of like size.
pub(crate) const PACKED_SPHERES: Real = 0.60;

/// A size for people.
#[must_use]
pub fn bytes(size: Real) -> String {
    let steps = [(1024.0 * 1024.0 * 1024.0, "GiB"), (1024.0 * 1024.0, "MiB"), (1024.0, "KiB")];
    steps
        .iter()
        .find(|(unit, _)| size >= *unit)
        .map_or_else(|| format!("{size:.0} B"), |(unit, name)| format!("{:.1} {name}", size / unit))
}

/// A number for people: so many decimals, or from a million on a power of ten.
#[must_use]
pub fn number(value: Real, decimals: usize) -> String {
    if value.abs() < 1e6 { format!("{value:.decimals$}") } else { format!("{value:.3e}") }
}

/// Facts about a case beyond its file.
#[derive(Clone, Copy, Debug, Default)]
pub struct Known<'k> {
    /// The shape of each population.
    pub shapes: &'k [ShapeFacts],
    /// Whether the tank was prepared before.
    pub made_ready: bool,
}

/// Describes the case.
#[must_use]
pub fn check(case: &Case, known: Known, machine: &Machine, threads: usize, model: &CostModel) -> CheckReport {
    let spacing = case.domain.spacing();
    let populations = population_reports(case, known.shapes);
    let in_flow = |p: &PopulationReport| p.levelled.or(p.grains).unwrap_or(0);
    let grains = populations.iter().map(in_flow).sum();
    let contact_spheres = populations.iter().map(|p| in_flow(p) * p.contact_spheres.unwrap_or(0)).sum();
    let particles = particles::report(case, known.shapes);
    let tank = particles.as_ref().and_then(|particles| particles.tank.as_ref());
    let (pace, reached) = (Pace::at_start(case, &populations), Pace::reached(case, &populations, tank));
    // What gets no faster than at the start slows down as foretold.
    let faster = reached.stable < pace.stable || reached.passes > pace.passes;
    let reached = if faster && reached.steps >= pace.steps { reached } else { pace.clone() };
    // Grains that only a bed file counts.
    let of_files: Real = case
        .grains
        .iter()
        .zip(&populations)
        .filter(|(population, _)| population.grains().is_none())
        .map(|(population, known)| {
            known.grains.unwrap_or(0) as Real * memory::memory_per_grain(case, population, model)
        })
        .sum();
    let cells = case.domain.cell_count();
    let room = if case.grains.iter().any(|population| population.moves()) { liquid_volume(case) } else { 0.0 };
    let liquid_cells = (room / case.domain.spacing().element_product()).min(cells as Real);
    let face_spheres = populations::on_faces(case, &populations);
    let of_grain = |population, report| populations::filled_cells(case, population, report).unwrap_or(0.0);
    let filled =
        case.grains.iter().zip(&populations).map(|(of, report)| in_flow(report) as Real * of_grain(of, report));
    let filled_cells = filled.sum();
    let surfaces = populations.iter().map(|report| in_flow(report) * report.surface_corners.unwrap_or(0));
    let size = Size {
        cells,
        liquid_cells,
        grains,
        filled_cells,
        spheres: contact_spheres,
        face_spheres,
        surface_corners: surfaces.sum(),
    };
    let packing = cost::packing_substeps(case, &populations, model);
    let substep_cause = substep_cause(case, &populations);
    let pictures = pictures::time(case, &populations, [pace.steps, pace.mean], model);
    let predict = |pace: &Pace| {
        let Pace { steps, stable: dt, passes, mean_substeps: substeps, .. } = *pace;
        let files = disk::files(case, [steps, pace.mean]);
        let work = cost::Work { steps, dt, passes, substeps, packing, pictures, files, made_ready: known.made_ready };
        // Threads beyond the processors take turns on them.
        cost::predict(case, &populations, &size, &work, particles.as_ref(), threads.min(machine.cores), model)
    };
    let total = |parts: &[(&'static str, Real)]| parts.iter().map(|(_, seconds)| seconds).sum::<Real>();
    let (predicted, most) = (predict(&pace), total(&predict(&reached)));
    let disk_parts = disk::disk(case, &size, [pace.steps, pace.mean], model);
    CheckReport {
        case: case.name.clone(),
        title: case.title.clone(),
        case_hash: crate::case::resolved::hash_text(case),
        cells: case.domain.cells,
        cell_count: size.cells,
        spacing_m: spacing.to_array(),
        liquids: liquid_reports(case, known.shapes),
        exchange: exchange_of(case, known.shapes).map(|(scheme, narrowest_cells)| ExchangeReport {
            scheme: scheme.word(),
            narrowest_cells: Some(narrowest_cells).filter(|cells| cells.is_finite()),
        }),
        bumps: populations::bump_reports(case, &populations),
        populations,
        grains,
        contact_spheres,
        made_ready: known.made_ready,
        particles,
        dt_s: pace.dt,
        fluid_passes: pace.passes,
        substeps: pace.substeps,
        substep_cause,
        impact_errors: pace.impact_errors.map(Into::into),
        steps: pace.steps,
        most_steps: reached.steps,
        limits: pace.limits,
        memory_bytes: memory(case, model) + of_files + memory::PROGRAM,
        memory_available: machine.memory_available,
        disk_bytes: disk_parts.iter().map(|(_, bytes)| bytes).sum(),
        disk_parts,
        disk_available: None,
        predicted_total_s: total(&predicted),
        predicted_most_s: most.max(total(&predicted)),
        predicted_s: predicted,
        threads,
        ranks: None,
        machine: machine.clone(),
    }
}

struct Size {
    cells: usize,
    /// Cells of liquid beside grains that move.
    liquid_cells: Real,
    grains: usize,
    /// Cells that grains fill, of wide ones those by their surface.
    filled_cells: Real,
    spheres: usize,
    /// Contact spheres on a flat face of each body that forces move.
    face_spheres: Real,
    /// Corners of the surfaces of all grains.
    surface_corners: usize,
}

/// Simulated time that packing the bed of a case takes \[s]; `None` if it packs none.
#[must_use]
pub fn packing_time_of(case: &Case, shapes: &[ShapeFacts]) -> Option<Real> {
    packing_time(case, &population_reports(case, shapes), &CostModel::default())
}

/// Volume of all liquids of the case, as far as it is known before the bed is packed [m^3].
fn liquid_volume(case: &Case) -> Real {
    let taken = overlapping::taken(case);
    let liquids = case.liquids.iter().zip(taken).filter(|(liquid, _)| liquid.fluid == FluidName::Liquid);
    liquids.filter_map(|(liquid, taken)| Some(volumes::volume_within(case, liquid)? * (1.0 - taken))).sum()
}

fn liquid_reports(case: &Case, shapes: &[ShapeFacts]) -> Vec<LiquidReport> {
    let report = |(liquid, volume): (&LiquidRegion, Option<Real>)| {
        let density = match liquid.fluid {
            FluidName::Liquid => case.fluid.liquid.density,
            FluidName::Gas => case.fluid.gas.density,
        };
        let [low, high] = liquid.region.heights();
        LiquidReport {
            name: liquid.name.clone(),
            fluid: liquid.fluid.word(),
            volume_m3: volume,
            mass_kg: volume.map(|volume| volume * density),
            momentum: volume.map(|volume| volume * density * liquid.velocity.length()),
            cells_per_height: Some((high - low) / case.domain.spacing().z).filter(|n| n.is_finite()),
        }
    };
    case.liquids.iter().zip(particles::volumes_between_grains(case, shapes)).map(report).collect()
}
