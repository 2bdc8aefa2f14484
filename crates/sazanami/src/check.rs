//! What a case will be, without running it: resolution, counts, step limits, memory, disk and cost.

mod cost;
mod particles;
mod text;

use sazanami_numerics::{Real, Vector};
use serde::Serialize;

use crate::case::meaning::{
    BoundarySide, Case, ContactLaw, ContactSphereChoice, Damping, GrainPlacement, GrainShape, Placement, Population,
    Solver, Step, Substeps, ViscosityScheme, WALL,
};
use crate::case::{Diagnostics, LoadedCase};
use crate::machine::Machine;

pub(crate) use particles::tank;
pub use particles::{ParticlesReport, TankReport};
pub use text::explain;

/// Cost of the parts of a run on one thread of an ordinary processor, and the memory they take.
///
/// The figures follow from the timings in `docs/performance.md`, where predictions stand beside measurements: they are
/// good to a factor of two.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CostModel {
    /// Fluid pass, pressure included [s per cell].
    pub fluid: Real,
    /// Volume fractions and loads [s per grain and fluid step].
    pub coupling: Real,
    /// Sub-step of the grains [s per grain], plus
    pub substep_grain: Real,
    /// [s per contact sphere]: little, as the contacts cost, and grains of few and of many spheres have two to four each.
    pub substep_sphere: Real,
    /// Share of further threads that turns into speed.
    pub parallel_share: Real,
    /// Time to rest of a bed over that in which gravity would stop its fall.
    pub packing_rest: Real,
    /// Memory [bytes per cell].
    pub memory_cell: Real,
    /// Memory [bytes per grain], plus
    pub memory_grain: Real,
    /// [bytes per contact sphere].
    pub memory_sphere: Real,
    /// Fields on disk [bytes per cell and output], after compression.
    pub disk_cell: Real,
    /// Grains on disk [bytes per grain and output], after compression.
    pub disk_grain: Real,
    /// Step of moving particles, pressure and coupling included [s per fluid particle], plus
    pub fluid_particle: Real,
    /// [s per wall particle].
    pub wall_particle: Real,
    /// Memory [bytes per moving or wall particle].
    pub memory_particle: Real,
    /// Moving particles, or grains that are points, on disk [bytes each and output], after compression.
    pub disk_point: Real,
}

impl Default for CostModel {
    fn default() -> Self {
        Self {
            fluid: 2.2e-7,
            coupling: 9e-6,
            substep_grain: 1.95e-7,
            substep_sphere: 2e-10,
            parallel_share: 0.85,
            packing_rest: 0.65,
            memory_cell: 320.0,
            memory_grain: 2.0e3,
            memory_sphere: 16.0,
            disk_cell: 12.0,
            disk_grain: 3.0e3,
            fluid_particle: 7e-6,
            wall_particle: 2e-6,
            memory_particle: 3.0e3,
            disk_point: 40.0,
        }
    }
}

/// Part of the free memory that a case is advised to take.
const FILLED: Real = 0.9;
/// Memory of a tetrahedron of a shape's mesh, with nodes, surface and search trees [bytes].
const MEMORY_TETRAHEDRON: Real = 1e3;
/// Memory of a contact sphere of a shape [bytes].
const MEMORY_SHAPE_SPHERE: Real = 200.0;

/// A limit on the time step.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct LimitReport {
    /// Name, as in the live line.
    pub name: &'static str,
    /// Longest step it allows at the start [s].
    pub dt_s: Real,
    /// How it is found.
    pub rule: String,
    /// Whether it rules at the start.
    pub rules: bool,
}

/// A population of grains.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct PopulationReport {
    /// Name.
    pub name: String,
    /// How many; absent for a bed whose file has not been read.
    pub grains: Option<usize>,
    /// Contact spheres of one grain.
    pub contact_spheres: Option<usize>,
    /// Grain size [m].
    pub size_m: Option<Real>,
    /// Cells on the grain size, for the largest edge of a cell.
    pub cells_per_grain: Option<Real>,
    /// Mass of a grain of size factor 1 [kg].
    pub mass_kg: Option<Real>,
    /// Facts about its shape, in words.
    pub shape: Vec<String>,
}

/// A body of liquid.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct LiquidReport {
    /// Name.
    pub name: String,
    /// Volume [m^3], where it has a formula.
    pub volume_m3: Option<Real>,
    /// Mass [kg].
    pub mass_kg: Option<Real>,
    /// Momentum [kg m/s].
    pub momentum: Option<Real>,
    /// Cells on its height.
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
    /// Edges of a cell [m].
    pub spacing_m: [Real; 3],
    /// Liquids.
    pub liquids: Vec<LiquidReport>,
    /// Grains.
    pub populations: Vec<PopulationReport>,
    /// Grains in all, as far as known.
    pub grains: usize,
    /// Contact spheres in all, as far as known.
    pub contact_spheres: usize,
    /// Moving particles and their tank, for that solver.
    pub particles: Option<ParticlesReport>,
    /// Limits on the step, shortest first.
    pub limits: Vec<LimitReport>,
    /// Step at the start [s].
    pub dt_s: Real,
    /// Fluid passes in a step.
    pub fluid_passes: usize,
    /// Sub-steps of the grains in a step.
    pub substeps: usize,
    /// Fluid steps, if the step stays as it is at the start.
    pub steps: Real,
    /// Memory [bytes].
    pub memory_bytes: Real,
    /// Memory that is free [bytes].
    pub memory_available: Option<u64>,
    /// Results on disk [bytes].
    pub disk_bytes: Real,
    /// Disk that is free [bytes].
    pub disk_available: Option<u64>,
    /// Wall-clock time by part on this machine [s].
    pub predicted_s: Vec<(&'static str, Real)>,
    /// Wall-clock time in all [s].
    pub predicted_total_s: Real,
    /// Threads the prediction is for.
    pub threads: usize,
    /// The machine.
    pub machine: Machine,
}

/// Memory a case takes [bytes].
#[must_use]
pub fn memory(case: &Case, model: &CostModel) -> Real {
    let grains: Real = case.grains.iter().map(|p| grain_memory(p, p.count.unwrap_or(0), model)).sum();
    grains
        + match particles::report(case) {
            Some(particles) => particles::memory(&particles, model),
            None => cell_memory(case.domain.cells, model),
        }
}

/// Memory of the fields [bytes].
fn cell_memory(cells: [usize; 3], model: &CostModel) -> Real {
    cells.iter().map(|&n| n as Real + 4.0).product::<Real>() * model.memory_cell
}

/// Memory of one grain [bytes].
fn memory_per_grain(population: &Population, model: &CostModel) -> Real {
    model.memory_grain + spheres_of(population).unwrap_or(0) as Real * model.memory_sphere
}

/// Memory of `count` grains of a population with their shape [bytes].
fn grain_memory(population: &Population, count: usize, model: &CostModel) -> Real {
    let tetrahedra = match population.shape {
        GrainShape::Sphere { refinement, .. } => 20.0 * 4.0_f64.powi(refinement.min(100) as i32),
        GrainShape::Spheroid { rings, segments, .. } => 2.0 * rings as Real * segments as Real,
        GrainShape::Box { .. } | GrainShape::Mesh { .. } => 0.0,
    };
    let shape = tetrahedra * MEMORY_TETRAHEDRON + spheres_of(population).unwrap_or(0) as Real * MEMORY_SHAPE_SPHERE;
    shape + count as Real * memory_per_grain(population, model)
}

/// Refuses a case that does not fit into the machine's memory, and points to what takes most of it.
pub fn check_memory(loaded: &LoadedCase, machine: &Machine, model: &CostModel, report: &mut Diagnostics) {
    let case = &loaded.case;
    let needed = memory(case, model);
    let Some(available) = machine.memory_available else { return };
    if needed <= available as Real {
        return;
    }
    let cells = match particles::report(case) {
        Some(particles) => particles::memory(&particles, model),
        None => cell_memory(case.domain.cells, model),
    };
    let grains = |n: usize| grain_memory(&case.grains[n], case.grains[n].count.unwrap_or(0), model);
    let heaviest = (0..case.grains.len()).max_by(|&a, &b| grains(a).total_cmp(&grains(b)));
    let free = bytes(available as Real);
    match heaviest.filter(|&n| grains(n) > cells) {
        Some(n) => {
            let population = &case.grains[n];
            let at = &loaded.text.grains[n];
            let placement = at.value.placement.as_ref().map_or(&at.span, |placement| &placement.span);
            let span = at.value.count.as_ref().map_or(placement, |count| &count.0.span).clone();
            let room = FILLED * available as Real - (needed - grains(n)) - grain_memory(population, 0, model);
            let fit = (room / memory_per_grain(population, model)).floor();
            let help = if fit >= 1.0 {
                format!("{fit:.0} grains of this kind fit beside the rest")
            } else {
                format!("the rest of the case needs {} by itself: make it smaller as well", bytes(needed - grains(n)))
            };
            report
                .error(span, format!("`{}` is too large for the memory of this machine", population.name))
                .label(format!("these grains need about {}, and {free} are free", bytes(grains(n))))
                .help(help);
        }
        None if case.solver == Solver::Mps => {
            let written = loaded.text.particles.as_ref();
            report
                .error(
                    written.map_or(0..0, |at| at.span.clone()),
                    "this tank is too large for the memory of this machine",
                )
                .label(format!("its particles need about {}, and {free} are free", bytes(cells)))
                .help("take a larger `spacing`, or a smaller tank");
        }
        None => {
            let title = "this box is too large for the memory of this machine";
            let label = format!("its cells need about {}, and {free} are free", bytes(cells));
            let help = match fitting_cells(case.domain.cells, FILLED * available as Real - (needed - cells), model) {
                Some([a, b, c]) => format!("[{a}, {b}, {c}] fits"),
                None => format!("the grains need {} by themselves: take fewer as well", bytes(needed - cells)),
            };
            let written = loaded.text.domain.as_ref().and_then(|domain| domain.value.cells.as_ref());
            match written {
                Some(cells) => report.error(cells.0.span.clone(), title).label(label).help(help),
                None => report.error_in_file(title).label(label).help(help),
            };
        }
    }
}

/// The largest numbers of cells in the proportions of `cells` whose fields fit into `room` [bytes].
fn fitting_cells(cells: [usize; 3], room: Real, model: &CostModel) -> Option<[usize; 3]> {
    let mut factor = (room / cell_memory(cells, model)).cbrt();
    if factor.is_nan() || factor <= 0.0 {
        return None;
    }
    // The cells round the box do not shrink with it: thin boxes need some more steps.
    while factor > 1e-7 {
        let fewer = cells.map(|n| ((n as Real * factor).floor() as usize).max(1));
        if cell_memory(fewer, model) <= room {
            return Some(fewer);
        }
        factor *= 0.99;
    }
    None
}

/// A size for people.
#[must_use]
pub fn bytes(size: Real) -> String {
    let steps = [(1024.0 * 1024.0 * 1024.0, "GiB"), (1024.0 * 1024.0, "MiB"), (1024.0, "KiB")];
    steps
        .iter()
        .find(|(unit, _)| size >= *unit)
        .map_or_else(|| format!("{size:.0} B"), |(unit, name)| format!("{:.1} {name}", size / unit))
}

/// Contact spheres of one grain, where known without reading files.
fn spheres_of(population: &Population) -> Option<usize> {
    match population.contact_spheres {
        ContactSphereChoice::Shell { count, .. } => Some(count),
        ContactSphereChoice::Axis(count) => Some(count),
        ContactSphereChoice::Single => Some(1),
        ContactSphereChoice::File { .. } => None,
    }
}

/// Mass of a grain of size factor 1 [kg]; the volume of its mesh is used if it is known.
fn mass_of(case: &Case, population: &Population, mesh_volume: Option<Real>) -> Option<Real> {
    let density = case.material(&population.material)?.density;
    population.mass_override.or_else(|| Some(density * mesh_volume.or_else(|| population.shape.volume())?))
}

/// What is known of a population's shape once it has been built.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ShapeFacts {
    /// Volume of its mesh [m^3].
    pub volume: Option<Real>,
    /// Contact spheres.
    pub contact_spheres: Option<usize>,
    /// Grain size [m].
    pub size: Option<Real>,
    /// Number of grains, where a bed file tells it.
    pub grains: Option<usize>,
    /// For people.
    pub lines: Vec<String>,
}

/// Describes the case; `shapes` holds what is known of each population's shape.
#[must_use]
pub fn check(case: &Case, shapes: &[ShapeFacts], machine: &Machine, threads: usize, model: &CostModel) -> CheckReport {
    let spacing = case.domain.spacing();
    let nothing = ShapeFacts::default();
    let facts = |n: usize| shapes.get(n).unwrap_or(&nothing);
    let populations: Vec<PopulationReport> =
        case.grains.iter().enumerate().map(|(n, p)| population_report(case, p, facts(n))).collect();
    let grains = populations.iter().filter_map(|p| p.grains).sum();
    let contact_spheres = populations.iter().map(|p| p.grains.unwrap_or(0) * p.contact_spheres.unwrap_or(0)).sum();
    let particles = particles::report(case);
    let (limits, dt, passes) = match (&case.particles, &particles) {
        (Some(how), Some(_)) => {
            let (limits, dt) = particles::step_limits(case, how);
            (limits, dt, 1)
        }
        _ => step_limits(case, &populations),
    };
    let substeps = substeps(case, &populations, dt);
    let steps = (case.run.until / dt).ceil().min(case.run.steps.map_or(Real::INFINITY, |n| n as Real));
    // Grains that only a bed file counts.
    let of_files: Real = case
        .grains
        .iter()
        .zip(&populations)
        .filter(|(population, _)| population.count.is_none())
        .map(|(population, told)| told.grains.unwrap_or(0) as Real * memory_per_grain(population, model))
        .sum();
    let size = Size { cells: case.domain.cell_count(), grains, spheres: contact_spheres };
    let work = cost::Work { steps, passes, substeps, packing: cost::packing_substeps(case, &populations, model) };
    let predicted = cost::predict(case, &size, &work, particles.as_ref(), threads, model);
    CheckReport {
        case: case.name.clone(),
        title: case.title.clone(),
        case_hash: format!("{:016x}", crate::case::resolved::hash(case)),
        cells: case.domain.cells,
        cell_count: size.cells,
        spacing_m: spacing.to_array(),
        liquids: liquid_reports(case),
        populations,
        grains,
        contact_spheres,
        particles,
        limits,
        dt_s: dt,
        fluid_passes: passes,
        substeps,
        steps,
        memory_bytes: memory(case, model) + of_files,
        memory_available: machine.memory_available,
        disk_bytes: disk(case, &size, steps, model),
        disk_available: None,
        predicted_total_s: predicted.iter().map(|(_, seconds)| seconds).sum(),
        predicted_s: predicted,
        threads,
        machine: machine.clone(),
    }
}

struct Size {
    cells: usize,
    grains: usize,
    spheres: usize,
}

fn population_report(case: &Case, population: &Population, facts: &ShapeFacts) -> PopulationReport {
    let size = population.shape.size().or(facts.size).map(|size| size * population.size.smallest());
    PopulationReport {
        name: population.name.clone(),
        grains: population.count.or(facts.grains),
        contact_spheres: facts.contact_spheres.or_else(|| spheres_of(population)),
        size_m: size,
        cells_per_grain: size.map(|size| size / case.domain.spacing().max_element()),
        mass_kg: mass_of(case, population, facts.volume),
        shape: facts.lines.clone(),
    }
}

fn liquid_reports(case: &Case) -> Vec<LiquidReport> {
    let density = case.fluids.liquid.density;
    let report = |liquid: &crate::case::meaning::LiquidRegion| {
        let volume = liquid.region.volume();
        let [low, high] = liquid.region.heights();
        LiquidReport {
            name: liquid.name.clone(),
            volume_m3: volume,
            mass_kg: volume.map(|volume| volume * density),
            momentum: volume.map(|volume| volume * density * liquid.velocity.length()),
            cells_per_height: Some((high - low) / case.domain.spacing().z).filter(|n| n.is_finite()),
        }
    };
    case.liquids.iter().map(report).collect()
}

/// Speeds that can be foreseen [m/s]: what moves at the start, and what falls through the box.
fn foreseen_velocity(case: &Case) -> Vector {
    let mut fastest = Vector::ZERO;
    for liquid in &case.liquids {
        fastest = fastest.max(liquid.velocity.abs());
        let above = match liquid.placement {
            Placement::Absolute(position) => position.z + liquid.region.heights()[1] - case.domain.lower.z,
            Placement::AboveBed { .. } => 0.0,
        };
        // A full box has nothing to fall into.
        let full = above >= case.domain.extent().z;
        let height = if full { 0.0 } else { above.max(0.0) };
        fastest = fastest.max(Vector::new(0.0, 0.0, (2.0 * case.gravity.length() * height).sqrt()));
    }
    for side in case.boundary.iter().flatten() {
        if let BoundarySide::Moving { velocity } | BoundarySide::Inflow { velocity, .. } = side {
            fastest = fastest.max(velocity.abs());
        }
    }
    fastest
}

fn fastest_grain(case: &Case) -> Real {
    let of_population = |population: &Population| match &population.placement {
        GrainPlacement::List(list) => list.iter().map(|grain| grain.velocity.length()).fold(0.0, Real::max),
        GrainPlacement::Lattice(lattice) => lattice.velocity.length(),
        GrainPlacement::Packed(_) | GrainPlacement::Bed(_) => 0.0,
    };
    case.grains.iter().map(of_population).fold(0.0, Real::max)
}

/// The limits on the step at the start, the step, and the fluid's passes in it.
fn step_limits(case: &Case, populations: &[PopulationReport]) -> (Vec<LimitReport>, Real, usize) {
    let spacing = case.domain.spacing();
    let velocity = foreseen_velocity(case);
    let rate = velocity.x / spacing.x + velocity.y / spacing.y + velocity.z / spacing.z;
    let mut limits = Vec::new();
    let mut add = |name, dt: Real, rule: String| {
        if dt.is_finite() {
            limits.push(LimitReport { name, dt_s: dt, rule, rules: false });
        }
    };
    let advective = case.fluid.cfl / rate;
    add(
        "advective",
        advective,
        format!("{} / sum of speed over cell edge, speeds {:.3} m/s", case.fluid.cfl, velocity.length()),
    );
    if case.fluid.viscosity == ViscosityScheme::Explicit {
        let nu = (case.fluids.gas.viscosity / case.fluids.gas.density)
            .max(case.fluids.liquid.viscosity / case.fluids.liquid.density);
        let inverse = (Vector::ONE / (spacing * spacing)).element_sum();
        add("viscous", 0.5 / (nu * inverse), "1 / (2 nu sum of 1/dx^2)".into());
    }
    let grain = fastest_grain(case);
    add("grain motion", 0.2 * spacing.min_element() / grain, format!("a fifth of a cell at {grain:.3} m/s"));
    if let (Substeps::Fixed(n), Some(contact)) = (case.dem.substeps, contact_step(case, populations)) {
        add("contact", contact * n as Real, format!("{n} sub-steps of {contact:.2e} s"));
    }
    let (dt, passes) = match case.fluid.step {
        Step::Fixed(dt) => {
            limits.push(LimitReport { name: "fixed", dt_s: dt, rule: "the case asks for it".into(), rules: false });
            (dt, ((dt / advective).ceil() as usize).max(1))
        }
        Step::Adaptive { longest, .. } => {
            limits.push(LimitReport {
                name: "maximum",
                dt_s: longest,
                rule: "dt_max of the case".into(),
                rules: false,
            });
            (limits.iter().map(|limit| limit.dt_s).fold(Real::INFINITY, Real::min), 1)
        }
    };
    limits.sort_by(|a, b| a.dt_s.total_cmp(&b.dt_s));
    for limit in &mut limits {
        limit.rules = match case.fluid.step {
            Step::Fixed(_) => limit.name == "fixed",
            Step::Adaptive { .. } => limit.dt_s == dt,
        };
    }
    (limits, dt, passes)
}

/// Largest ratio of a grain's mass to the effective mass of a contact, for a spheroid like the paper's.
const OFF_CENTRE: Real = 5.28;

/// Longest sub-step the contacts allow [s].
fn contact_step(case: &Case, populations: &[PopulationReport]) -> Option<Real> {
    let step = |(population, report): (&Population, &PopulationReport)| {
        let mass = report.mass_kg? * population.size.smallest().powi(3);
        let stiffest = case
            .contacts
            .iter()
            .filter(|pair| pair.a == population.material || pair.b == population.material)
            .map(|pair| pair.law.normal_stiffness.max(pair.law.tangential_stiffness))
            .fold(0.0, Real::max);
        // A single sphere is never hit off its centre.
        let lever = if population.contact_spheres == ContactSphereChoice::Single { 1.0 } else { OFF_CENTRE };
        Some(0.057 * std::f64::consts::PI * (0.5 * mass / lever / stiffest).sqrt())
    };
    case.grains.iter().zip(populations).filter_map(step).reduce(Real::min)
}

fn substeps(case: &Case, populations: &[PopulationReport], dt: Real) -> usize {
    if case.grains.is_empty() {
        return 0;
    }
    match case.dem.substeps {
        Substeps::Fixed(n) => n,
        Substeps::Auto => contact_step(case, populations).map_or(1, |step| (dt / step).ceil() as usize).max(1),
    }
}

/// Results on disk [bytes], the checkpoints kept included.
fn disk(case: &Case, size: &Size, steps: Real, model: &CostModel) -> Real {
    let outputs = &case.output;
    let (elements, element, grain) = match particles::report(case) {
        Some(particles) => (particles.fluid, model.disk_point, 1.5 * model.disk_point),
        None => (size.cells, model.disk_cell, model.disk_grain),
    };
    let fields = outputs.fields.count(case.run.until, steps) * elements as Real * element;
    let grains = outputs.grains.count(case.run.until, steps) * size.grains as Real * grain;
    let figures = outputs.figures.count(case.run.until, steps) * 1.5e6;
    let series = outputs.series.count(case.run.until, steps) * 600.0;
    let state = elements as Real * 64.0 + size.grains as Real * 600.0;
    fields + grains + figures + series + (case.checkpoint.keep + 1) as Real * state
}

/// Damping of a contact, in words.
#[must_use]
pub fn damping_in_words(law: &ContactLaw) -> String {
    match law.damping {
        Damping::Literal { normal, .. } => format!("dashpot {normal:.3e} N s/m"),
        Damping::Restitution(e) => format!("restitution {e}"),
    }
}

/// Whether a pair is a contact with the box.
#[must_use]
pub fn is_wall(name: &str) -> bool {
    name == WALL
}
