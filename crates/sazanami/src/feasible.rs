//! Whether a case can run: everything that can be refused before memory is taken or a file overwritten.
//!
//! Builds the shapes of the grains and reads the beds, and with them asks whether meshes are sound, grains lie
//! within the box, liquids keep clear of grains, and the whole fits into memory.

mod above_bed;
mod beds;
mod pace;
mod workers;

use std::ops::Range;

use sazanami_dem::{Body, DEEP_OVERLAP, Engine, LARGEST_OVERLAP};
use sazanami_numerics::geometry::{Region, Shape};
use sazanami_numerics::{Quaternion, Real, Vector};

use crate::assembly::grains::{self, population_of};
use crate::assembly::shapes::shape_of;
use crate::bed_file::Bed;
use crate::case::meaning::{
    BedFile, BoundarySide, Case, Exchange, GrainPlacement, GrainShape, LatticePlacement, SIDE_NAMES, Solver,
};
use crate::case::{CaseError, Diagnostics, LoadedCase};
use crate::check::{CostModel, PACKED, ShapeFacts, check_memory, warn_of_tank};
use crate::machine::Machine;

pub use workers::check_workers;

/// What was built on the way.
#[derive(Clone, Debug)]
pub struct Feasible {
    /// Shape of each population at size factor 1.
    pub shapes: Vec<Shape>,
    /// Bed of each population that is read from a file, with the grains of that population alone.
    pub beds: Vec<Option<Bed>>,
    /// What is worth telling about them.
    pub facts: Vec<ShapeFacts>,
    /// Warnings, those of the case file included.
    pub warnings: Diagnostics,
}

/// A grain that has a place already.
#[derive(Clone, Copy, Debug)]
struct Placed {
    population: usize,
    index: usize,
    position: Vector,
    orientation: Quaternion,
    factor: Real,
    /// Room to leave round it for what is random [m].
    slack: Real,
    /// How it came there.
    origin: Origin,
}

/// How a grain came to its place.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Origin {
    /// By the case file.
    Case,
    /// By a bed file; whether it will still move before the run begins.
    Bed { relaxes: bool },
}

/// More findings of one kind than this help nobody.
const MOST_ALIKE: usize = 5;
/// Solid fraction no packing of like grains reaches.
const DENSEST: Real = 0.78;
/// Solid fraction of the loosest bed to reckon with where other grains have to keep clear of it.
const LOOSEST: Real = 0.4;

/// Asks whether the case can run on this machine.
///
/// # Errors
/// All findings together, if one of them is an error.
pub fn check(loaded: &LoadedCase, machine: &Machine, model: &CostModel) -> Result<Feasible, Box<CaseError>> {
    let mut report = loaded.warnings.clone();
    let refused = |diagnostics: Diagnostics| Box::new(CaseError { source: loaded.source.clone(), diagnostics });
    warn_of_tank(loaded, &mut report);
    check_memory(loaded, machine, model, &mut report);
    beds::can_be_written(loaded, &mut report);
    if report.has_errors() {
        return Err(refused(report));
    }
    let shapes = shapes(loaded, &mut report);
    let beds = beds::read(loaded, &mut report);
    if report.has_errors() {
        return Err(refused(report));
    }
    let facts: Vec<ShapeFacts> = shapes.iter().zip(&beds).map(|(shape, bed)| facts_of(shape, bed.as_ref())).collect();
    let lying = grains::placed(&loaded.case, &beds);
    let mut search = Search { loaded, case: &loaded.case, shapes: &shapes, beds: &beds, report: &mut report };
    search.weights();
    search.room();
    search.periods();
    let lying: Vec<Placed> = lying.iter().map(|grain| search.as_it_lies(grain)).collect();
    let placed = search.placed(&lying);
    search.within_box(&placed);
    search.overlaps(&placed);
    search.beside_packed(&lying);
    search.liquids(&lying);
    search.pace(&facts, model);
    if report.has_errors() {
        return Err(refused(report));
    }
    Ok(Feasible { shapes, beds, facts, warnings: report })
}

/// The same for a run whose grains are already there: their shapes only.
///
/// # Errors
/// All findings together, if one of them is an error.
pub fn check_without_grains(
    loaded: &LoadedCase,
    machine: &Machine,
    model: &CostModel,
) -> Result<Feasible, Box<CaseError>> {
    let mut report = loaded.warnings.clone();
    check_memory(loaded, machine, model, &mut report);
    let shapes = if report.has_errors() { Vec::new() } else { shapes(loaded, &mut report) };
    if report.has_errors() {
        return Err(Box::new(CaseError { source: loaded.source.clone(), diagnostics: report }));
    }
    let facts = shapes.iter().map(|shape| facts_of(shape, None)).collect();
    Ok(Feasible { beds: vec![None; shapes.len()], shapes, facts, warnings: report })
}

/// The shapes of the grains alone, one of each population, for a run that is only looked at.
///
/// # Errors
/// All findings together, if a population has no usable shape.
pub fn shapes_alone(loaded: &LoadedCase) -> Result<Vec<Shape>, Box<CaseError>> {
    let mut report = loaded.warnings.clone();
    let shapes = shapes(loaded, &mut report);
    if report.has_errors() {
        return Err(Box::new(CaseError { source: loaded.source.clone(), diagnostics: report }));
    }
    Ok(shapes)
}

/// Builds the shapes; those that fail are reported.
fn shapes(loaded: &LoadedCase, report: &mut Diagnostics) -> Vec<Shape> {
    let mut shapes = Vec::new();
    for (n, population) in loaded.case.grains.iter().enumerate() {
        match shape_of(population) {
            Ok(shape) => shapes.push(shape),
            Err(problem) => {
                let key = if matches!(population.shape, GrainShape::Mesh { .. }) { "shape.mesh.file" } else { "shape" };
                let span = loaded.places.at(&format!("grains.{n}.{key}"));
                let help = match population.shape {
                    GrainShape::Mesh { .. } => {
                        "a grain needs a closed mesh of tetrahedra in a Gmsh file, version 2.2 or 4.1"
                    }
                    _ => "check the sizes of the shape and its contact spheres",
                };
                report
                    .error(span, format!("`{}` has no usable shape", population.name))
                    .label(problem.to_string())
                    .help(help);
            }
        }
    }
    shapes
}

/// What `check` reports about a shape.
fn facts_of(shape: &Shape, bed: Option<&Bed>) -> ShapeFacts {
    let report = shape.report();
    let mut first =
        format!("{} nodes, {} tetrahedra, volume {:.5} mm^3", report.nodes, report.tetrahedra, report.volume * 1e9);
    if let (Some(volume), Some(inertia)) = (report.volume_error, report.inertia_error) {
        first +=
            &format!(": {:+.1} % of the smooth shape's, inertia off by {:.1} %", 1e2 * volume, 1e2 * inertia.abs());
    }
    let mut lines = vec![first];
    lines.push(format!(
        "dihedral angles {:.0} to {:.0} degrees, smallest radius ratio {:.2}",
        report.quality.smallest_dihedral_angle,
        report.quality.largest_dihedral_angle,
        report.quality.smallest_radius_ratio
    ));
    lines.push(format!(
        "{} contact spheres of {:.4} to {:.4} mm, largest gap to the shape {:.1} um",
        report.contact_spheres,
        report.sphere_radii[0] * 1e3,
        report.sphere_radii[1] * 1e3,
        report.largest_gap * 1e6
    ));
    let (low, high) = extent(shape);
    ShapeFacts {
        volume: Some(report.volume),
        contact_spheres: Some(report.contact_spheres),
        size: Some((high - low).min_element()),
        grains: bed.map(|bed| bed.grains.len()),
        body: Some(Body::from(shape)),
        lines,
    }
}

/// Corners of the box round the mesh in the body frame [m].
fn extent(shape: &Shape) -> (Vector, Vector) {
    let nodes = &shape.mesh().nodes;
    nodes.iter().fold((Vector::INFINITY, Vector::NEG_INFINITY), |(low, high), &node| (low.min(node), high.max(node)))
}

struct Search<'a> {
    loaded: &'a LoadedCase,
    case: &'a Case,
    shapes: &'a [Shape],
    beds: &'a [Option<Bed>],
    report: &'a mut Diagnostics,
}

impl Search<'_> {
    /// Place of a population in the file.
    fn span(&self, population: usize) -> Range<usize> {
        self.loaded.places.at(&format!("grains.{population}.placement"))
    }

    /// A mass override must not make a grain too light for the exact exchange.
    fn weights(&mut self) {
        if self.case.solver != Solver::Mics {
            return;
        }
        let least = 1.05 * self.case.fluid.liquid.density;
        for (n, population) in self.case.grains.iter().enumerate() {
            let Some(mass) = population.mass_override else { continue };
            let density = mass / self.shapes[n].volume();
            if self.case.coupling.exchange == Exchange::Exact && density < least {
                let span = self.loaded.places.at(&format!("grains.{n}.mass_override"));
                self.report
                    .error(span, format!("`{}` is too light for the exact exchange", population.name))
                    .label(format!("{density:.1} kg/m^3, below 1.05 times the liquid's {:.1}", least / 1.05))
                    .help("write `exchange = \"stress\"` under `[coupling]`");
            }
        }
    }

    /// Between periodic sides a grain must not meet an image of itself.
    fn periods(&mut self) {
        let extent = self.case.domain.extent();
        for (n, population) in self.case.grains.iter().enumerate() {
            let needed = Engine::shortest_period(self.shapes[n].bounding_radius() * population.size.largest());
            let is_short = |&d: &usize| self.case.boundary[d][0] == BoundarySide::Periodic && extent[d] < needed;
            let Some(d) = (0..2).find(is_short) else { continue };
            self.report
                .error(self.span_of_shape(n), format!("`{}` is too long for the periodic box", population.name))
                .label(format!("the box is {:.4} mm long along x{}", 1e3 * extent[d], d + 1))
                .help(format!("it has to be {:.4} mm at least: make it longer, or the grains smaller", 1e3 * needed));
        }
    }

    /// Place of the shape of a population in the file.
    fn span_of_shape(&self, population: usize) -> Range<usize> {
        self.loaded.places.at(&format!("grains.{population}.shape"))
    }

    /// A packed bed has to fit into the box.
    fn room(&mut self) {
        let extent = self.case.domain.extent();
        let base = extent.x * extent.y;
        for (n, population) in self.case.grains.iter().enumerate() {
            let (GrainPlacement::Packed(_), Some(count)) = (&population.placement, population.count) else { continue };
            let solid = count as Real * self.shapes[n].volume() * population.size.largest().powi(3);
            let height = solid / (PACKED * base);
            let span = self.loaded.places.of(&format!("grains.{n}.count")).unwrap_or(self.span(n));
            let levelled = matches!(&population.placement, GrainPlacement::Packed(how) if how.level.is_some());
            if levelled && solid <= DENSEST * base * extent.z {
                continue;
            }
            if solid > DENSEST * base * extent.z {
                self.report
                    .error(span, format!("`{}` does not fit into the box", population.name))
                    .label(format!("{count} grains make a bed about {:.1} mm high", height * 1e3))
                    .help(format!("the box is {:.1} mm high: take fewer grains or a larger box", extent.z * 1e3));
            } else if height > extent.z {
                self.report
                    .warning(Some(span), format!("`{}` may reach out of the box", population.name))
                    .label(format!("{count} grains make a bed about {:.1} mm high", height * 1e3));
            }
        }
    }

    /// A bed is packed without the other grains: they have to lie above it, and nothing can come to rest before.
    fn beside_packed(&mut self, lying: &[Placed]) {
        if !self.case.packs() {
            return;
        }
        const APART: &str = "pack the bed first, with `packing_only = true` under `[run]` and `bed` under `[output]`, \
                             and read it with `placement.bed` beside the other grains";
        for (n, population) in self.case.grains.iter().enumerate() {
            if let GrainPlacement::Bed(BedFile { relax: true, .. }) = &population.placement {
                let span = self.loaded.places.at(&format!("grains.{n}.placement.bed.relax"));
                self.report
                    .error(span, format!("`{}` cannot come to rest beside grains that are packed", population.name))
                    .label("the run packs the others without it")
                    .help(APART);
            }
        }
        let floor = self.case.domain.lower.z;
        let top = floor + self.highest_bed();
        for population in 0..self.case.grains.len() {
            let all = lying.iter().filter(|grain| grain.population == population);
            let lowest = all.map(|grain| (self.lowest(grain), grain)).min_by(|a, b| a.0.total_cmp(&b.0));
            let Some((height, grain)) = lowest.filter(|(height, _)| *height < top) else { continue };
            let (name, span) = self.name(grain);
            self.report
                .error(span, format!("{name} lies where other grains are packed"))
                .label(format!(
                    "it reaches down to {:.4} mm above the floor, the bed perhaps up to {:.4} mm",
                    (height - floor) * 1e3,
                    (top - floor) * 1e3
                ))
                .help(APART);
        }
    }

    /// Height that the packed bed may reach: packed loosely, with a grain that stands on it [m].
    fn highest_bed(&self) -> Real {
        let extent = self.case.domain.extent();
        let mut solid = 0.0;
        let mut longest: Real = 0.0;
        for (population, shape) in self.case.grains.iter().zip(self.shapes) {
            let (GrainPlacement::Packed(_), Some(count)) = (&population.placement, population.count) else { continue };
            let factor = population.size.largest();
            solid += count as Real * shape.volume() * factor.powi(3);
            longest = longest.max(2.0 * shape.bounding_radius() * factor);
        }
        solid / (LOOSEST * extent.x * extent.y) + longest
    }

    /// Height of the lowest point of a grain's contact spheres [m].
    fn lowest(&self, grain: &Placed) -> Real {
        self.spheres(grain).iter().map(|(centre, radius)| centre.z - radius).fold(Real::INFINITY, Real::min)
    }

    /// A grain that begins where it is now.
    fn as_it_lies(&self, grain: &sazanami_dem::Grain) -> Placed {
        let (population, index) = population_of(grain.id);
        let origin = match &self.case.grains[population].placement {
            GrainPlacement::Bed(bed) => Origin::Bed { relaxes: bed.relax },
            _ => Origin::Case,
        };
        Placed {
            population,
            index: index as usize,
            position: grain.position,
            orientation: grain.orientation,
            factor: grain.scale,
            slack: 0.0,
            origin,
        }
    }

    /// Grains whose places are known before the run: lattices as far as they are not random, others as they lie.
    fn placed(&self, lying: &[Placed]) -> Vec<Placed> {
        let lattice = |n: usize| match &self.case.grains[n].placement {
            GrainPlacement::Lattice(lattice) => Some(lattice),
            _ => None,
        };
        let mut placed: Vec<Placed> =
            lying.iter().filter(|grain| lattice(grain.population).is_none()).copied().collect();
        for (n, population) in self.case.grains.iter().enumerate() {
            let Some(lattice) = lattice(n) else { continue };
            placed.extend(lattice_places(n, lattice, population.size.largest(), self.shapes[n].bounding_radius()));
        }
        placed
    }

    /// Names a grain and points to it as well as the file allows.
    fn name(&self, grain: &Placed) -> (String, Range<usize>) {
        let population = &self.case.grains[grain.population];
        let path = format!("grains.{}.placement.list.{}.position", grain.population, grain.index);
        (format!("grain {} of `{}`", grain.index, population.name), self.loaded.places.at(&path))
    }

    /// No grain may stick out of a wall.
    fn within_box(&mut self, placed: &[Placed]) {
        let tolerance = 1e-9 * self.case.domain.extent().max_element();
        let mut found = 0;
        let mut of_beds: Vec<Vec<(usize, Outside)>> = vec![Vec::new(); self.case.grains.len()];
        for (number, grain) in placed.iter().enumerate() {
            let Some(out) = self.outside(grain, tolerance) else { continue };
            if let Origin::Bed { .. } = grain.origin {
                of_beds[grain.population].push((number, out));
                continue;
            }
            found += 1;
            if found <= MOST_ALIKE {
                let (name, span) = self.name(grain);
                self.report
                    .error(span, format!("{name} sticks out of the box"))
                    .label(out.to_string())
                    .help("move the grain, or enlarge the box");
            }
        }
        for (population, list) in of_beds.iter().enumerate() {
            let Some((number, worst)) = list.iter().max_by(|a, b| a.1.depth.total_cmp(&b.1.depth)) else { continue };
            self.bed_outside(population, list.len(), &placed[*number], *worst);
        }
    }

    /// Says that grains of a bed lie outside the box.
    fn bed_outside(&mut self, population: usize, count: usize, worst: &Placed, out: Outside) {
        let (name, span) = self.name(worst);
        let finding = if count == 1 {
            self.report.error(span, format!("{name} sticks out of the box")).label(out.to_string())
        } else {
            let title =
                format!("{count} grains of the bed of `{}` stick out of the box", self.case.grains[population].name);
            self.report.error(span, title).label(format!("{name} the most: {out}"))
        };
        if let (GrainPlacement::Bed(file), Some(bed)) =
            (&self.case.grains[population].placement, &self.beds[population])
        {
            let size = file.scale * (bed.upper - bed.lower) * 1e3;
            finding.help(format!(
                "the bed was packed in a box of {:.4} mm x {:.4} mm x {:.4} mm (times `scale`): take one as large",
                size.x, size.y, size.z
            ));
        }
    }

    /// How far a grain stands out of the box, if it does.
    ///
    /// Grains put by hand may not do so at all. Those of a bed press against the sides, and their contact spheres
    /// need not be those they were packed with: they may overlap a side as far as they may overlap each other.
    fn outside(&self, grain: &Placed, tolerance: Real) -> Option<Outside> {
        let (lower, upper) = (self.case.domain.lower, self.case.domain.upper);
        let shape = &self.shapes[grain.population];
        let reach = Vector::splat(grain.factor * shape.bounding_radius() + grain.slack);
        let ball = [grain.position - reach, grain.position + reach];
        let corners = if (ball[0] - lower).min(upper - ball[1]).min_element() >= 0.0 || grain.slack > 0.0 {
            ball
        } else {
            match grain.origin {
                Origin::Bed { relaxes } => {
                    let share = if relaxes { LARGEST_OVERLAP } else { DEEP_OVERLAP };
                    let top = if relaxes { share } else { 0.0 };
                    self.spheres(grain).iter().fold(no_corners(), |[low, high], &(centre, radius)| {
                        let room = Vector::new(share, share, top);
                        [low.min(centre - radius * (1.0 - share)), high.max(centre + radius * (Vector::ONE - room))]
                    })
                }
                Origin::Case => {
                    let [low, mut high] =
                        self.nodes(grain).fold(no_corners(), |[low, high], x| [low.min(x), high.max(x)]);
                    // The run refuses contact spheres above the lid.
                    for (centre, radius) in self.spheres(grain) {
                        high.z = high.z.max(centre.z + radius);
                    }
                    [low, high]
                }
            }
        };
        let depth = |d: usize, side: usize| if side == 0 { lower[d] - corners[0][d] } else { corners[1][d] - upper[d] };
        (0..6)
            .map(|n| Outside { direction: n % 3, side: n / 3, depth: depth(n % 3, n / 3) })
            .filter(|out| out.depth > tolerance && self.case.holds_grains(out.direction, out.side))
            .max_by(|a, b| a.depth.total_cmp(&b.depth))
    }

    /// Grains must not lie within each other.
    fn overlaps(&mut self, placed: &[Placed]) {
        let settled = |n: &usize| placed[*n].slack == 0.0 && placed[*n].origin != (Origin::Bed { relaxes: true });
        let mut order: Vec<Hull> = (0..placed.len()).filter(settled).map(|n| self.hull(n, &placed[n])).collect();
        order.sort_by(|a, b| a.lower.x.total_cmp(&b.lower.x));
        let mut found = Vec::new();
        for (rank, a) in order.iter().enumerate() {
            let mut mine = None;
            for b in &order[rank + 1..] {
                if b.lower.x > a.upper.x {
                    break;
                }
                let (lower, upper) = (a.lower.max(b.lower), a.upper.min(b.upper));
                if lower.cmpgt(upper).any() {
                    continue;
                }
                let mine = mine.get_or_insert_with(|| self.spheres(&placed[a.grain]));
                let overlap = self.overlap(mine, &placed[b.grain], [lower, upper]);
                if overlap > DEEP_OVERLAP {
                    found.push((a.grain.min(b.grain), a.grain.max(b.grain), overlap));
                }
            }
        }
        found.sort_by_key(|&(a, b, _)| (a, b));
        let of_beds =
            |&(a, b, _): &(usize, usize, Real)| [a, b].iter().all(|&n| matches!(placed[n].origin, Origin::Bed { .. }));
        let (within_beds, others): (Vec<_>, Vec<_>) = found.into_iter().partition(of_beds);
        for &(a, b, overlap) in others.iter().take(MOST_ALIKE) {
            self.overlapping(
                [&placed[a], &placed[b]],
                overlap,
                "",
                "move one of the two: contacts are thin against grains",
            );
        }
        if let Some(&(a, b, overlap)) = within_beds.iter().max_by(|a, b| a.2.total_cmp(&b.2)) {
            let more = match within_beds.len() {
                1 => String::new(),
                pairs => format!("; {pairs} pairs of the bed by more than {:.0} %", 1e2 * DEEP_OVERLAP),
            };
            let help = "`relax = true` lets the bed come to rest with these contact spheres before the run begins";
            self.overlapping([&placed[a], &placed[b]], overlap, &more, help);
        }
    }

    /// Says that two grains overlap.
    fn overlapping(&mut self, [a, b]: [&Placed; 2], overlap: Real, more: &str, help: &str) {
        let (first, _) = self.name(a);
        let (second, span) = self.name(b);
        let label = format!("by {:.0} % of the smaller contact sphere's radius{more}", 1e2 * overlap);
        let title = format!("{second} overlaps {first}");
        if overlap > LARGEST_OVERLAP {
            self.report.error(span, title).label(label).help(help);
        } else {
            self.report.warning(Some(span), title).label(label);
        }
    }

    /// The box round the contact spheres of a grain.
    fn hull(&self, number: usize, grain: &Placed) -> Hull {
        let spheres = self.shapes[grain.population].contact_spheres();
        let [lower, upper] = spheres.centres.iter().zip(&spheres.radii).fold(no_corners(), |[low, high], (&c, &r)| {
            let (centre, radius) = (grain.position + grain.orientation * (grain.factor * c), grain.factor * r);
            [low.min(centre - radius), high.max(centre + radius)]
        });
        Hull { grain: number, lower, upper }
    }

    /// Largest overlap of two grains' contact spheres over the smaller radius, where their hulls meet.
    fn overlap(&self, mine: &[(Vector, Real)], other: &Placed, [lower, upper]: [Vector; 2]) -> Real {
        let near = |&&(centre, radius): &&(Vector, Real)| centre.distance(centre.clamp(lower, upper)) <= radius;
        let mine: Vec<&(Vector, Real)> = mine.iter().filter(near).collect();
        let mut largest: Real = 0.0;
        if mine.is_empty() {
            return largest;
        }
        for (y, s) in self.spheres(other).iter().filter(near) {
            for (x, r) in &mine {
                let squared = x.distance_squared(*y);
                if squared < (r + s) * (r + s) {
                    largest = largest.max((r + s - squared.sqrt()) / r.min(*s));
                }
            }
        }
        largest
    }

    /// Contact spheres of a grain where it lies.
    fn spheres(&self, grain: &Placed) -> Vec<(Vector, Real)> {
        let spheres = self.shapes[grain.population].contact_spheres();
        let at = |(&centre, &radius): (&Vector, &Real)| {
            (grain.position + grain.orientation * (grain.factor * centre), grain.factor * radius)
        };
        spheres.centres.iter().zip(&spheres.radii).map(at).collect()
    }

    /// Nodes of a grain where it lies [m].
    fn nodes(&self, grain: &Placed) -> impl Iterator<Item = Vector> {
        let grain = *grain;
        let nodes = &self.shapes[grain.population].mesh().nodes;
        nodes.iter().map(move |&node| grain.position + grain.orientation * (grain.factor * node))
    }

    fn touches(&self, region: &Region, grain: &Placed) -> bool {
        let reach = grain.factor * self.shapes[grain.population].bounding_radius();
        region.touches_ball(grain.position, reach)
            && (self.nodes(grain).any(|x| region.contains(x))
                || self.spheres(grain).iter().any(|&(centre, radius)| region.touches_ball(centre, radius)))
    }
}

/// How far a grain stands out of the box.
#[derive(Clone, Copy, Debug)]
struct Outside {
    direction: usize,
    side: usize,
    /// [m]
    depth: Real,
}

impl std::fmt::Display for Outside {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(formatter, "{:.4} mm beyond the side {}", self.depth * 1e3, SIDE_NAMES[self.direction][self.side])
    }
}

/// The box round a grain's contact spheres.
#[derive(Clone, Copy, Debug)]
struct Hull {
    grain: usize,
    lower: Vector,
    upper: Vector,
}

/// Corners of a box that holds nothing yet.
const fn no_corners() -> [Vector; 2] {
    [Vector::INFINITY, Vector::NEG_INFINITY]
}

/// Places of a lattice, with room for jitter and any orientation where these are random.
fn lattice_places(
    population: usize,
    lattice: &LatticePlacement,
    factor: Real,
    radius: Real,
) -> impl Iterator<Item = Placed> {
    let [n1, n2, n3] = lattice.counts;
    let pitch = (lattice.upper - lattice.lower) / Vector::new(n1 as Real, n2 as Real, n3 as Real);
    let jitter = lattice.jitter * pitch.min_element();
    let slack = if lattice.random_orientation { jitter.max(1e-9 * radius) } else { jitter };
    let lower = lattice.lower;
    (0..n1 * n2 * n3).map(move |index| {
        let (i, j, k) = (index % n1, index / n1 % n2, index / (n1 * n2));
        let cell = Vector::new(i as Real + 0.5, j as Real + 0.5, k as Real + 0.5);
        Placed {
            population,
            index,
            position: lower + cell * pitch,
            orientation: Quaternion::IDENTITY,
            factor,
            slack,
            origin: Origin::Case,
        }
    })
}
