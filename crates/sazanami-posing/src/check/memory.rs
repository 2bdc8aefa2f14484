//! Memory that a case takes, and whether the machine has it.

use sazanami_mics::viscosity::ViscosityScheme;
use sazanami_numerics::Real;

use super::populations::{exchange_of, spheres_of};
use super::{CheckReport, CostModel, bytes, disk::points, particles, pictures, volumes};
use crate::assembly::fluid::{entry_pressure, has_wide_grains, surface_tension_coefficient};
use crate::case::meaning::{Case, Exchange, Population, Solver};
use crate::case::{Diagnostics, LoadedCase};
use crate::machine::{Machine, MemoryLimit};

/// Part of the free memory that a case is advised to take.
const FILLED: Real = 0.9;
/// Memory of a tetrahedron of a shape's mesh, with nodes, surface and search trees \[bytes].
const MEMORY_TETRAHEDRON: Real = 1e3;
/// Memory of a contact sphere of a shape \[bytes].
const MEMORY_SHAPE_SPHERE: Real = 200.0;
/// Memory of the program itself, with its stacks \[bytes].
pub(super) const PROGRAM: Real = 13.0 * 1024.0 * 1024.0;
/// Address space of the program, and of each of its threads with stack and heap of its own \[bytes].
const OF_PROGRAM: Real = 270.0 * 1024.0 * 1024.0;
const OF_THREAD: Real = 140.0 * 1024.0 * 1024.0;
/// Memory of a mean over a cell, a layer or a pixel \[bytes].
const MEMORY_MEAN: Real = 16.0;
/// Memory of the surfaces of resolved grains in their exchange with the fluid [bytes per cell]: ten fields for three.
const MEMORY_SURFACES: Real = 56.0;
/// Memory of the acceleration that implicit viscous steps see [bytes per cell]: three fields.
const MEMORY_ACCELERATION: Real = 24.0;
/// Memory of liquid that has only the open part of the cells as its room [bytes per cell]: sixteen fields.
const MEMORY_ROOM: Real = 128.0;
/// Memory of surface tension or an entry pressure [bytes per cell]: heights, curvatures, jumps, and three fields of the step.
const MEMORY_TENSION: Real = 100.0;
/// Memory of the angle at which an interface meets grains [bytes per cell]: planes, liquid and lines of contact in the grains.
const MEMORY_ANGLE: Real = 100.0;
/// Memory of the pores of an entry pressure [bytes per cell]: seven fields.
const MEMORY_PORES: Real = 56.0;
/// Memory of a point of a probe's line: values, and their columns \[bytes].
const MEMORY_POINT: Real = 1e3;

/// Memory a case takes \[bytes]: of the flow, or of the packing before it.
#[must_use]
pub fn memory(case: &Case, model: &CostModel) -> Real {
    let of_grains = |count: fn(&Case, &Population) -> Option<usize>| {
        let each = case.grains.iter().map(|p| grain_memory(case, p, count(case, p).unwrap_or(0), model));
        each.sum::<Real>()
    };
    let packing = of_grains(|_, population| population.grains());
    let flow = of_grains(|case, population| volumes::levelled(case, population).or(population.grains()));
    packing.max(flow + fluid_memory(case, model)) + observer_memory(case, model)
}

/// Memory of something that a case observes \[bytes], the key that asks for it, and what makes it smaller.
struct Observed {
    bytes: Real,
    key: &'static str,
    help: &'static str,
}

/// Memory of the observers \[bytes].
fn observer_memory(case: &Case, model: &CostModel) -> Real {
    observed(case, model).iter().map(|part| part.bytes).sum()
}

/// What a case observes: erosion profile, lines of probes, pictures.
fn observed(case: &Case, model: &CostModel) -> [Observed; 3] {
    let erosion = case.erosion.as_ref().map_or(0.0, |erosion| {
        // The smoothing grid is a square round the axis.
        let width = 2.0 * (erosion.r_max / erosion.dx).ceil() + 3.0;
        MEMORY_MEAN * (width * width + erosion.r_max / erosion.dr)
    });
    let probes: Real = case.probes.iter().map(|probe| points(probe) * MEMORY_POINT).sum();
    let part = |bytes, key, help| Observed { bytes, key, help };
    [
        part(erosion, "erosion", "lower `erosion.r_max`, or take larger `erosion.dx` and `erosion.dr`"),
        part(probes, "probe", "take fewer `points` of the lines of probes"),
        part(pictures::memory(case, model), "output.figures", "draw none: `output.figures = { at = [] }`"),
    ]
}

/// Memory of the fluids \[bytes].
fn fluid_memory(case: &Case, model: &CostModel) -> Real {
    match particles::report(case, &[]) {
        Some(particles) => particles::memory(case, &particles, model),
        None => with_layers(case.domain.cells) * per_cell(case, model),
    }
}

/// Memory of the fields, and of the liquid in pictures [bytes per cell].
fn per_cell(case: &Case, model: &CostModel) -> Real {
    let surfaces = matches!(exchange_of(case, &[]), Some((Exchange::Surface, _)));
    let implicit = !matches!(case.fluid.viscosity, ViscosityScheme::Explicit | ViscosityScheme::Off);
    let (tension, pores) = (surface_tension_coefficient(case).is_some(), entry_pressure(case).is_some());
    let asked = [
        (surfaces, MEMORY_SURFACES + MEMORY_ROOM),
        (implicit && !surfaces, MEMORY_ACCELERATION),
        (tension || pores, MEMORY_TENSION),
        (tension && has_wide_grains(case), MEMORY_ANGLE),
        (pores, MEMORY_PORES),
    ];
    let extra: Real = asked.iter().filter(|(asked, _)| *asked).map(|(_, bytes)| bytes).sum();
    model.memory_cell + extra + pictures::memory_per_cell(case, model)
}

/// Cells of a box, or of a part of it, with the two layers round it.
pub(super) fn with_layers(cells: [usize; 3]) -> Real {
    cells.iter().map(|&n| n as Real + 4.0).product()
}

/// Memory of one grain and of its surface in pictures \[bytes].
pub(super) fn memory_per_grain(case: &Case, population: &Population, model: &CostModel) -> Real {
    let spheres = spheres_of(population).unwrap_or(0) as Real * model.memory_sphere;
    model.memory_grain + spheres + pictures::memory_per_grain(case, population, model)
}

/// Memory of `count` grains of a population with their shape \[bytes].
fn grain_memory(case: &Case, population: &Population, count: usize, model: &CostModel) -> Real {
    let spheres = spheres_of(population).unwrap_or(0) as Real * MEMORY_SHAPE_SPHERE;
    let shape = pictures::triangles(population) * MEMORY_TETRAHEDRON + spheres;
    shape + count as Real * memory_per_grain(case, population, model)
}

/// Warns where the threads take so much of a limited address space that the case may not fit beside them.
pub fn warn_of_address_space(report: &CheckReport, warnings: &mut Diagnostics) {
    let reserved = OF_PROGRAM + OF_THREAD * report.threads as Real;
    let sum = report.memory_bytes + reserved;
    let Some(available) = report.machine.memory_available.filter(|available| sum > *available as Real) else { return };
    if report.machine.memory_limit == MemoryLimit::AddressSpace {
        warnings
            .warning(None, "the address space may be too small for this run")
            .label(format!(
                "{} for the case and up to {} that {} threads reserve, {} are free under `ulimit -v`",
                bytes(report.memory_bytes),
                bytes(reserved),
                report.threads,
                bytes(available as Real)
            ))
            .help("take fewer threads, or raise the limit");
    }
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
    let grains = |n: usize| grain_memory(case, &case.grains[n], case.grains[n].grains().unwrap_or(0), model);
    let parts = observed(case, model);
    let observers: Real = parts.iter().map(|part| part.bytes).sum();
    let [first, others @ ..] = parts;
    let largest = others.into_iter().fold(first, |most, part| if part.bytes > most.bytes { part } else { most });
    let all_grains: Real = (0..case.grains.len()).map(grains).sum();
    if observers > cells.max((0..case.grains.len()).map(grains).fold(0.0, Real::max)) {
        let written = loaded.places.of(largest.key).or_else(|| loaded.places.of(&format!("{}.0", largest.key)));
        report
            .error_at(written, format!("`{}` is too large for the memory of this machine", largest.key))
            .label(format!("it needs about {}, and {} are free", bytes(largest.bytes), bytes(available as Real)))
            .help(largest.help);
        return;
    }
    let heaviest = (0..case.grains.len()).max_by(|&a, &b| grains(a).total_cmp(&grains(b)));
    let free = bytes(available as Real);
    match heaviest.filter(|&n| grains(n) > cells) {
        Some(n) => {
            let population = &case.grains[n];
            let place = |key: &str| loaded.places.of(&format!("grains.{n}.{key}"));
            let span = place("count").or_else(|| place("placement")).unwrap_or(0..0);
            let room = FILLED * available as Real - (needed - grains(n)) - grain_memory(case, population, 0, model);
            let fit = (room / memory_per_grain(case, population, model)).floor();
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
            let help = match fitting_cells(
                case.domain.cells,
                FILLED * available as Real - (needed - cells),
                per_cell(case, model),
            ) {
                Some([a, b, c]) => format!("[{a}, {b}, {c}] fits"),
                None if all_grains > observers => {
                    format!("the grains need {} by themselves: take fewer as well", bytes(all_grains))
                }
                None if observers > 0.0 => {
                    format!("`{}` needs {} by itself as well: {}", largest.key, bytes(largest.bytes), largest.help)
                }
                None => "no box fits".to_owned(),
            };
            report.error_at(loaded.places.of("domain.cells"), title).label(label).help(help);
        }
    }
}

/// The largest numbers of cells, of so many bytes `each`, in the proportions of `cells` that fit into `room` \[bytes].
fn fitting_cells(cells: [usize; 3], room: Real, each: Real) -> Option<[usize; 3]> {
    let mut factor = (room / (with_layers(cells) * each)).cbrt();
    if factor.is_nan() || factor <= 0.0 {
        return None;
    }
    // The cells round the box do not shrink with it: thin boxes need some more steps.
    while factor > 1e-7 {
        let fewer = cells.map(|n| ((n as Real * factor).floor() as usize).max(1));
        if with_layers(fewer) * each <= room {
            return Some(fewer);
        }
        factor *= 0.99;
    }
    None
}
