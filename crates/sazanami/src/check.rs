//! What a case will be, without running it: resolution, counts, step limits, memory, disk and cost.

mod cost;
mod limits;
mod particles;
mod reached;
mod tank_warnings;
mod text;

use sazanami_dem::Body;
use sazanami_numerics::Real;
use serde::Serialize;

use crate::assembly::shapes::shape_of;
use crate::case::meaning::{
    Case, ContactLaw, ContactSphereChoice, Damping, GrainShape, LiquidRegion, Population, Probe, ProbePlace, Schedule,
    Solver, WALL,
};
use crate::case::{Diagnostics, LoadedCase};
use crate::machine::Machine;

pub(crate) use cost::packing_substeps;
use cost::packing_time;
pub(crate) use limits::{Cause, Pace, speeds, stiffest_contact, strongest_force};
pub(crate) use particles::tank;
pub use particles::{ParticlesReport, TankReport};
pub(crate) use tank_warnings::warn_of_tank;
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
    /// [s per contact sphere]: little, as the contacts cost, of which grains of few and of many spheres have as many.
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
    /// Pictures of one time [s], plus
    pub pictures: Real,
    /// [s per grain].
    pub picture_grain: Real,
    /// Memory for the pictures [bytes].
    pub memory_pictures: Real,
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
            pictures: 1.0,
            picture_grain: 1e-4,
            memory_pictures: 1e8,
        }
    }
}

/// Solid fraction of a bed of grains that were packed, about.
pub(crate) const PACKED: Real = 0.55;
/// The same of spheres of like size.
pub(crate) const PACKED_SPHERES: Real = 0.60;
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
    /// How many of those that are packed stay when the bed is levelled, about.
    pub levelled: Option<usize>,
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
    /// Its contact spheres and inertia.
    #[serde(skip)]
    pub body: Option<Body>,
}

/// A body of liquid.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct LiquidReport {
    /// Name.
    pub name: String,
    /// Volume within the box and between the grains [m^3], where it has a formula.
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
    /// Step at the start [s].
    pub dt_s: Real,
    /// Fluid passes in a step.
    pub fluid_passes: usize,
    /// Sub-steps of the grains in a step.
    pub substeps: usize,
    /// Fluid steps, if the step stays as it is at the start.
    pub steps: Real,
    /// Fluid steps, if the step is that of the speeds that bodies reach from the start on.
    pub most_steps: Real,
    /// Memory [bytes].
    pub memory_bytes: Real,
    /// Memory that is free [bytes].
    pub memory_available: Option<u64>,
    /// Results on disk [bytes].
    pub disk_bytes: Real,
    /// The same by what is written.
    #[serde(skip)]
    pub disk_parts: [(&'static str, Real); 6],
    /// Disk that is free [bytes].
    pub disk_available: Option<u64>,
    /// Wall-clock time by part on this machine [s].
    pub predicted_s: Vec<(&'static str, Real)>,
    /// Wall-clock time in all, if the step stays as it is at the start [s].
    pub predicted_total_s: Real,
    /// The same if the step is that of the speeds that bodies reach from the start on [s].
    pub predicted_most_s: Real,
    /// Threads the prediction is for.
    pub threads: usize,
    /// The machine.
    pub machine: Machine,
}

/// Memory a case takes [bytes]: of the flow, or of the packing before it.
#[must_use]
pub fn memory(case: &Case, model: &CostModel) -> Real {
    let of_grains = |count: fn(&Case, &Population) -> Option<usize>| {
        let each = case.grains.iter().map(|p| grain_memory(p, count(case, p).unwrap_or(0), model));
        each.sum::<Real>()
    };
    let packing = of_grains(|_, population| population.count);
    let flow = of_grains(|case, population| particles::levelled(case, population).or(population.count));
    packing.max(flow + fluid_memory(case, model)) + observer_memory(case, model)
}

/// Memory of the observers: erosion profile, exposed grains, lines of probes, pictures [bytes].
fn observer_memory(case: &Case, model: &CostModel) -> Real {
    let erosion = case.erosion.as_ref().map_or(0.0, |erosion| {
        // The smoothing grid is a square round the axis.
        let width = 2.0 * (erosion.r_max / erosion.dx).ceil() + 3.0;
        MEMORY_MEAN * (width * width + erosion.r_max / erosion.dr)
    });
    let extent = case.domain.extent();
    let exposed = case.ripples.as_ref().map_or(0.0, |ripples| {
        let pixel = ripples.grain_size / 8.0;
        MEMORY_MEAN * (extent.x / pixel).ceil() * (extent.y / pixel).ceil()
    });
    let probes: Real = case.probes.iter().map(|probe| points(probe) * MEMORY_POINT).sum();
    let pictures = if case.output.figures.is_empty() { 0.0 } else { model.memory_pictures };
    erosion + exposed + probes + pictures
}

/// Memory of a mean over a cell, a layer or a pixel [bytes].
const MEMORY_MEAN: Real = 16.0;
/// Memory of a point of a probe's line: values, and their columns [bytes].
const MEMORY_POINT: Real = 1e3;

/// Memory of the fluids [bytes].
fn fluid_memory(case: &Case, model: &CostModel) -> Real {
    match particles::report(case) {
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
    let cells = fluid_memory(case, model);
    let grains = |n: usize| grain_memory(&case.grains[n], case.grains[n].count.unwrap_or(0), model);
    let observers = observer_memory(case, model);
    if observers > cells.max((0..case.grains.len()).map(grains).fold(0.0, Real::max)) {
        let written = loaded.places.of("erosion");
        report
            .error_at(written, "what this case observes is too large for the memory of this machine")
            .label(format!("it needs about {}, and {} are free", bytes(observers), bytes(available as Real)))
            .help("lower `erosion.r_max` or the points of a probe, or take larger `erosion.dx` and `erosion.dr`");
        return;
    }
    let heaviest = (0..case.grains.len()).max_by(|&a, &b| grains(a).total_cmp(&grains(b)));
    let free = bytes(available as Real);
    match heaviest.filter(|&n| grains(n) > cells) {
        Some(n) => {
            let population = &case.grains[n];
            let place = |key: &str| loaded.places.of(&format!("grains.{n}.{key}"));
            let span = place("count").or_else(|| place("placement")).unwrap_or(0..0);
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
            report
                .error(loaded.places.at("particles"), "this tank is too large for the memory of this machine")
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
            match loaded.places.of("domain.cells") {
                Some(span) => report.error(span, title).label(label).help(help),
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

/// A number for people: so many decimals, or from a million on a power of ten.
#[must_use]
pub fn number(value: Real, decimals: usize) -> String {
    if value.abs() < 1e6 { format!("{value:.decimals$}") } else { format!("{value:.3e}") }
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
    /// Contact spheres and inertia of a grain of size factor 1.
    pub body: Option<Body>,
    /// For people.
    pub lines: Vec<String>,
}

/// What is known of a case beyond its file.
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
    let particles = particles::report(case);
    let tank = particles.as_ref().and_then(|particles| particles.tank.as_ref());
    let (pace, reached) = (Pace::of(case, &populations, tank), Pace::reached(case, &populations, tank));
    // Grains that only a bed file counts.
    let of_files: Real = case
        .grains
        .iter()
        .zip(&populations)
        .filter(|(population, _)| population.count.is_none())
        .map(|(population, told)| told.grains.unwrap_or(0) as Real * memory_per_grain(population, model))
        .sum();
    let size = Size { cells: case.domain.cell_count(), grains, spheres: contact_spheres };
    let packing = cost::packing_substeps(case, &populations, model);
    let pictures = cost::pictures(case, [pace.steps, pace.dt], grains, model);
    let predict = |pace: &Pace| {
        let Pace { steps, passes, substeps, .. } = *pace;
        let work = cost::Work { steps, passes, substeps, packing, pictures, made_ready: known.made_ready };
        cost::predict(case, &populations, &size, &work, particles.as_ref(), threads, model)
    };
    let total = |parts: &[(&'static str, Real)]| parts.iter().map(|(_, seconds)| seconds).sum::<Real>();
    let (predicted, most) = (predict(&pace), total(&predict(&reached)));
    let disk_parts = disk(case, &size, [pace.steps, pace.dt], model);
    CheckReport {
        case: case.name.clone(),
        title: case.title.clone(),
        case_hash: crate::case::resolved::hash_text(case),
        cells: case.domain.cells,
        cell_count: size.cells,
        spacing_m: spacing.to_array(),
        liquids: liquid_reports(case),
        populations,
        grains,
        contact_spheres,
        made_ready: known.made_ready,
        particles,
        dt_s: pace.dt,
        fluid_passes: pace.passes,
        substeps: pace.substeps,
        steps: pace.steps,
        most_steps: reached.steps,
        limits: pace.limits,
        memory_bytes: memory(case, model) + of_files,
        memory_available: machine.memory_available,
        disk_bytes: disk_parts.iter().map(|(_, bytes)| bytes).sum(),
        disk_parts,
        disk_available: None,
        predicted_total_s: total(&predicted),
        predicted_most_s: most.max(total(&predicted)),
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

/// Simulated time that packing the bed of a case takes [s]; `None` if it packs none.
pub(crate) fn packing_time_of(case: &Case, shapes: &[ShapeFacts]) -> Option<Real> {
    packing_time(case, &population_reports(case, shapes), &CostModel::default())
}

/// What is known of the populations; `shapes` as for [`check`].
pub(crate) fn population_reports(case: &Case, shapes: &[ShapeFacts]) -> Vec<PopulationReport> {
    let nothing = ShapeFacts::default();
    let facts = |n: usize| shapes.get(n).unwrap_or(&nothing);
    case.grains.iter().enumerate().map(|(n, population)| population_report(case, population, facts(n))).collect()
}

fn population_report(case: &Case, population: &Population, facts: &ShapeFacts) -> PopulationReport {
    let size = population.shape.size().or(facts.size).map(|size| size * population.size.smallest());
    PopulationReport {
        name: population.name.clone(),
        grains: population.count.or(facts.grains),
        levelled: particles::levelled(case, population),
        contact_spheres: facts.contact_spheres.or_else(|| spheres_of(population)),
        size_m: size,
        cells_per_grain: size.map(|size| size / case.domain.spacing().max_element()),
        mass_kg: mass_of(case, population, facts.volume),
        shape: facts.lines.clone(),
        body: facts.body.clone().or_else(|| shape_of(population).ok().map(|shape| Body::from(&shape))),
    }
}

fn liquid_reports(case: &Case) -> Vec<LiquidReport> {
    let density = case.fluid.liquid.density;
    let report = |liquid: &LiquidRegion| {
        let volume = particles::volume_between_grains(case, liquid);
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

/// Results on disk by key of `[output]` [bytes], and the checkpoints kept.
fn disk(case: &Case, size: &Size, [steps, dt]: [Real; 2], model: &CostModel) -> [(&'static str, Real); 6] {
    let outputs = &case.output;
    let (elements, element, grain) = match particles::report(case) {
        Some(particles) => (particles.fluid, model.disk_point, 1.5 * model.disk_point),
        None => (size.cells, model.disk_cell, model.disk_grain),
    };
    let until = if case.run.steps.is_some() { case.run.until.min(steps * dt) } else { case.run.until };
    let times = |schedule: &Schedule| schedule.count(until, steps);
    let state = elements as Real * 64.0 + size.grains as Real * 600.0;
    let probes = case.probes.iter().map(|probe| times(&probe.schedule) * points(probe) * ROW_OF_POINT).sum();
    [
        ("fields", times(&outputs.fields) * elements as Real * element),
        ("grains", times(&outputs.grains) * size.grains as Real * grain),
        ("figures", times(&outputs.figures) * PICTURES),
        ("series", times(&outputs.series) * (ROW + profiles(case))),
        ("probe", probes),
        ("checkpoint", (case.checkpoint.keep + 1) as Real * state),
    ]
}

/// The pictures of a time on disk [bytes].
const PICTURES: Real = 1.5e6;
/// A row of the series on disk [bytes].
const ROW: Real = 600.0;
/// What is written of a point that is watched [bytes].
const ROW_OF_POINT: Real = 70.0;
/// What is written of a place along the bed, with the water above it [bytes].
const ROW_OF_PLACE: Real = 150.0;

/// Profiles of bed and water beside a row of the series [bytes].
fn profiles(case: &Case) -> Real {
    // Two places a grain size.
    case.ripples.as_ref().map_or(0.0, |ripples| 2.0 * case.domain.extent().x / ripples.grain_size * ROW_OF_PLACE)
}

/// Points that a probe watches.
fn points(probe: &Probe) -> Real {
    if let ProbePlace::Line { points, .. } = probe.place { points as Real } else { 1.0 }
}

/// Warns of results that do not fit onto the disk, of which `available` bytes are free, and names what takes most.
pub fn warn_of_disk(loaded: &LoadedCase, report: &CheckReport, available: Option<u64>, warnings: &mut Diagnostics) {
    let Some(free) = available.map(|free| free as Real).filter(|&free| report.disk_bytes > free) else { return };
    let Some((most, share)) = report.disk_parts.into_iter().max_by(|a, b| a.1.total_cmp(&b.1)) else { return };
    let span = match most {
        "checkpoint" => loaded.places.of("checkpoint"),
        "probe" => loaded.places.of("probe.0"),
        _ => loaded.places.of("output"),
    };
    let key = if ["checkpoint", "probe"].contains(&most) { most.to_owned() } else { format!("output.{most}") };
    warnings
        .warning(span, "the results do not fit onto the disk")
        .label(format!("about {}, of which {} are free", bytes(report.disk_bytes), bytes(free)))
        .help(format!("write `{key}` less often: it takes {}", bytes(share)));
}

/// Damping of a contact, in words.
#[must_use]
pub fn damping_in_words(law: &ContactLaw) -> String {
    match law.damping {
        Damping::Literal { normal, .. } => format!("dashpot {normal:.3e} N s/m"),
        Damping::Restitution(e) => format!("restitution {e}"),
        Damping::RestitutionAndRatio { restitution, .. } => format!("restitution {restitution}"),
    }
}

/// Whether a pair is a contact with the box.
#[must_use]
pub fn is_wall(name: &str) -> bool {
    name == WALL
}
