//! Whether a case can run: everything that can be refused before memory is taken or a file overwritten.
//!
//! Builds the shapes of the grains, and with them asks whether meshes are sound, grains lie within the box,
//! liquids keep clear of grains, and the whole fits into memory.

use std::ops::Range;

use sazanami_numerics::geometry::Shape;
use sazanami_numerics::{Quaternion, Real, Vector};

use crate::assembly::shapes::shape_of;
use crate::case::meaning::{
    Case, Exchange, GrainPlacement, GrainShape, LatticePlacement, LiquidRegion, Placement, Region, SIDE_NAMES,
};
use crate::case::schema::{PlacementText, ShapeText};
use crate::case::written::At;
use crate::case::{CaseError, Diagnostics, LoadedCase};
use crate::check::{CostModel, ShapeFacts, check_memory};
use crate::machine::Machine;

/// What was built on the way.
#[derive(Clone, Debug)]
pub struct Feasible {
    /// Shape of each population at size factor 1.
    pub shapes: Vec<Shape>,
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
}

/// More findings of one kind than this help nobody.
const MOST_ALIKE: usize = 5;
/// Solid fraction no packing of like grains reaches.
const DENSEST: Real = 0.78;
/// Overlap of contact spheres over the smaller radius from which grains are said to overlap.
const OVERLAP_WARNED: Real = 0.2;
/// Overlap of contact spheres over the smaller radius that no run accepts.
const OVERLAP_REFUSED: Real = 0.8;

/// Asks whether the case can run on this machine.
///
/// # Errors
/// All findings together, if one of them is an error.
pub fn check(loaded: &LoadedCase, machine: &Machine, model: &CostModel) -> Result<Feasible, Box<CaseError>> {
    let mut report = loaded.warnings.clone();
    check_memory(loaded, machine, model, &mut report);
    let shapes = shapes(loaded, &mut report);
    if report.has_errors() {
        return Err(Box::new(CaseError { source: loaded.source.clone(), diagnostics: report }));
    }
    let facts = shapes.iter().map(facts_of).collect();
    let mut search = Search { loaded, case: &loaded.case, shapes: &shapes, report: &mut report };
    search.weights();
    search.room();
    let placed = search.placed();
    search.within_box(&placed);
    search.overlaps(&placed);
    for (n, liquid) in loaded.case.liquids.iter().enumerate() {
        search.clear_of_grains(n, liquid, &placed);
    }
    if report.has_errors() {
        return Err(Box::new(CaseError { source: loaded.source.clone(), diagnostics: report }));
    }
    Ok(Feasible { shapes, facts, warnings: report })
}

/// Builds the shapes; those that fail are reported.
fn shapes(loaded: &LoadedCase, report: &mut Diagnostics) -> Vec<Shape> {
    let mut shapes = Vec::new();
    for (population, written) in loaded.case.grains.iter().zip(&loaded.text.grains) {
        match shape_of(population) {
            Ok(shape) => shapes.push(shape),
            Err(problem) => {
                let text = &written.value;
                let span = match text.shape.as_ref() {
                    Some(At { value: ShapeText::Mesh(mesh), span }) => {
                        mesh.file.as_ref().map_or(span.clone(), |file| file.0.span.clone())
                    }
                    Some(shape) => shape.span.clone(),
                    None => written.span.clone(),
                };
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

/// What `check` tells about a shape.
fn facts_of(shape: &Shape) -> ShapeFacts {
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
    report: &'a mut Diagnostics,
}

impl Search<'_> {
    /// Place of a population in the file.
    fn span(&self, population: usize) -> Range<usize> {
        let at = &self.loaded.text.grains[population];
        at.value.placement.as_ref().map_or(at.span.clone(), |placement| placement.span.clone())
    }

    /// A mass override must not make a grain too light for the exact exchange.
    fn weights(&mut self) {
        let least = 1.05 * self.case.fluids.liquid.density;
        for (n, population) in self.case.grains.iter().enumerate() {
            let Some(mass) = population.mass_override else { continue };
            let density = mass / self.shapes[n].volume();
            if self.case.coupling.exchange == Exchange::Exact && density < least {
                let at = &self.loaded.text.grains[n];
                let span = at.value.mass_override.as_ref().map_or(at.span.clone(), |mass| mass.item.span.clone());
                self.report
                    .error(span, format!("`{}` is too light for the exact exchange", population.name))
                    .label(format!("{density:.1} kg/m^3, below 1.05 times the liquid's {:.1}", least / 1.05))
                    .help("write `exchange = \"stress\"` under `[coupling]`");
            }
        }
    }

    /// A packed bed has to fit into the box.
    fn room(&mut self) {
        let extent = self.case.domain.extent();
        let base = extent.x * extent.y;
        for (n, population) in self.case.grains.iter().enumerate() {
            let (GrainPlacement::Packed(_), Some(count)) = (&population.placement, population.count) else { continue };
            let solid = count as Real * self.shapes[n].volume() * population.size.largest().powi(3);
            let height = solid / (0.55 * base);
            let span =
                self.loaded.text.grains[n].value.count.as_ref().map_or(self.span(n), |count| count.0.span.clone());
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

    /// Grains whose places are known before the run.
    fn placed(&self) -> Vec<Placed> {
        let mut placed = Vec::new();
        for (n, population) in self.case.grains.iter().enumerate() {
            match &population.placement {
                GrainPlacement::List(list) => placed.extend(list.iter().enumerate().map(|(index, grain)| Placed {
                    population: n,
                    index,
                    position: grain.position,
                    orientation: grain.orientation,
                    factor: grain.factor,
                    slack: 0.0,
                })),
                GrainPlacement::Lattice(lattice) => {
                    placed.extend(lattice_places(
                        n,
                        lattice,
                        population.size.largest(),
                        self.shapes[n].bounding_radius(),
                    ));
                }
                GrainPlacement::Packed(_) | GrainPlacement::Bed(_) => {}
            }
        }
        placed
    }

    /// Names a grain and points to it as well as the file allows.
    fn name(&self, grain: &Placed) -> (String, Range<usize>) {
        let population = &self.case.grains[grain.population];
        let place = self.loaded.text.grains[grain.population].value.placement.as_ref();
        let span = match place.map(|at| &at.value) {
            Some(PlacementText::List(list)) => list
                .get(grain.index)
                .map(|at| at.value.position.as_ref().map_or(at.span.clone(), |position| position.item.span.clone())),
            _ => None,
        };
        (format!("grain {} of `{}`", grain.index, population.name), span.unwrap_or_else(|| self.span(grain.population)))
    }

    /// No grain may stick out of a wall.
    fn within_box(&mut self, placed: &[Placed]) {
        let (lower, upper) = (self.case.domain.lower, self.case.domain.upper);
        let tolerance = 1e-9 * self.case.domain.extent().max_element();
        let mut found = 0;
        for grain in placed {
            let shape = &self.shapes[grain.population];
            let (low, high) = if grain.slack > 0.0 {
                let reach = Vector::splat(grain.factor * shape.bounding_radius() + grain.slack);
                (grain.position - reach, grain.position + reach)
            } else {
                shape.mesh().nodes.iter().fold((Vector::INFINITY, Vector::NEG_INFINITY), |(low, high), &node| {
                    let x = grain.position + grain.orientation * (grain.factor * node);
                    (low.min(x), high.max(x))
                })
            };
            let out = [low - lower, upper - high]
                .iter()
                .enumerate()
                .flat_map(|(side, room)| (0..3).map(move |d| (d, side, -room[d])))
                .filter(|&(d, side, depth)| depth > tolerance && self.case.holds_grains(d, side))
                .max_by(|a, b| a.2.total_cmp(&b.2));
            if let Some((direction, side, depth)) = out {
                found += 1;
                if found <= MOST_ALIKE {
                    let (name, span) = self.name(grain);
                    self.report
                        .error(span, format!("{name} sticks out of the box"))
                        .label(format!("{:.4} mm beyond the side {}", depth * 1e3, SIDE_NAMES[direction][side]))
                        .help("move the grain, or enlarge the box");
                }
            }
        }
    }

    /// Grains put one by one must not lie within each other.
    fn overlaps(&mut self, placed: &[Placed]) {
        let mut order: Vec<usize> = (0..placed.len()).filter(|&n| placed[n].slack == 0.0).collect();
        order.sort_by(|&a, &b| placed[a].position.x.total_cmp(&placed[b].position.x));
        let reach = |n: usize| placed[n].factor * self.shapes[placed[n].population].bounding_radius();
        let widest = order.iter().map(|&n| reach(n)).fold(0.0, Real::max);
        let mut found = Vec::new();
        for (rank, &a) in order.iter().enumerate() {
            for &b in &order[rank + 1..] {
                if placed[b].position.x - placed[a].position.x > reach(a) + widest {
                    break;
                }
                if placed[a].position.distance(placed[b].position) < reach(a) + reach(b) {
                    let overlap = self.overlap(&placed[a], &placed[b]);
                    if overlap > OVERLAP_WARNED {
                        found.push((a.min(b), a.max(b), overlap));
                    }
                }
            }
        }
        found.sort_by_key(|&(a, b, _)| (a, b));
        for &(a, b, overlap) in found.iter().take(MOST_ALIKE) {
            let (first, _) = self.name(&placed[a]);
            let (second, span) = self.name(&placed[b]);
            let label = format!("by {:.0} % of the smaller contact sphere's radius", 1e2 * overlap);
            let title = format!("{second} overlaps {first}");
            if overlap > OVERLAP_REFUSED {
                self.report
                    .error(span, title)
                    .label(label)
                    .help("move one of the two: contacts are thin against grains");
            } else {
                self.report.warning(Some(span), title).label(label);
            }
        }
    }

    /// Largest overlap of two grains' contact spheres over the smaller radius.
    fn overlap(&self, a: &Placed, b: &Placed) -> Real {
        let mut largest: Real = 0.0;
        let other = self.spheres(b);
        for (x, r) in self.spheres(a) {
            for &(y, s) in &other {
                largest = largest.max((r + s - x.distance(y)) / r.min(s));
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

    /// A liquid must not touch grains unless that is allowed.
    fn clear_of_grains(&mut self, number: usize, liquid: &LiquidRegion, placed: &[Placed]) {
        let Placement::Absolute(position) = liquid.placement else { return };
        if liquid.allow_touching_grains {
            return;
        }
        let region = liquid.region.moved(position);
        let touched = placed.iter().find(|grain| self.touches(&region, grain));
        if let Some(grain) = touched {
            let (name, _) = self.name(grain);
            let at = &self.loaded.text.liquid[number];
            let span = at.value.region.as_ref().map_or(at.span.clone(), |region| region.span.clone());
            self.report
                .error(span, format!("`{}` touches grains", liquid.name))
                .label(format!("it reaches {name}"))
                .help("move it away, or write `allow_touching_grains = true` for a liquid that wets them");
        }
    }

    fn touches(&self, region: &Region, grain: &Placed) -> bool {
        let shape = &self.shapes[grain.population];
        let node_inside = shape
            .mesh()
            .nodes
            .iter()
            .any(|&node| region.contains(grain.position + grain.orientation * (grain.factor * node)));
        node_inside || self.spheres(grain).iter().any(|&(centre, radius)| sphere_touches(region, centre, radius))
    }
}

/// Whether a sphere reaches into a region (for spheroids and unions: as far as 26 points of it tell).
fn sphere_touches(region: &Region, centre: Vector, radius: Real) -> bool {
    match region {
        Region::Sphere { centre: other, diameter } => centre.distance(*other) < radius + 0.5 * diameter,
        Region::HalfSpace { point, normal } => (centre - *point).dot(*normal) < radius,
        Region::Box { lower, upper } => centre.distance(centre.clamp(*lower, *upper)) < radius,
        Region::Union(parts) => parts.iter().any(|part| sphere_touches(part, centre, radius)),
        Region::Spheroid { centre: other, .. } => {
            let steps = [-1.0, 0.0, 1.0];
            let directions =
                steps.iter().flat_map(|&x| steps.iter().flat_map(move |&y| steps.map(|z| Vector::new(x, y, z))));
            let towards = (*other - centre).normalize_or_zero();
            directions.chain([towards]).any(|d| region.contains(centre + radius * d.normalize_or_zero()))
        }
    }
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
        Placed { population, index, position: lower + cell * pitch, orientation: Quaternion::IDENTITY, factor, slack }
    })
}
