//! Whether a case can run: everything that can be refused before memory is taken or a file overwritten.
//!
//! Builds the shapes of the grains and reads the beds, and with them asks whether meshes are sound, grains lie
//! within the box, liquids keep clear of grains, and the whole fits into memory.

mod above_bed;
mod beds;
mod blocked;
mod carried;
mod overlaps;
mod pace;
mod placed;
mod poured;
mod prepared;
mod within_box;

use std::ops::Range;

use sazanami_dem::{Body, Engine};
use sazanami_io::bed::Bed;
use sazanami_numerics::geometry::{Exact, Shape};
use sazanami_numerics::{Quaternion, Real, Vector};

use crate::assembly::grains;
use crate::assembly::shapes::shape_of;
use crate::case::amounts::{self, length};
use crate::case::meaning::{
    BedFile, BoundarySide, Case, ContactSphereChoice, Exchange, GrainPlacement, GrainShape, MOST_ON_SHELL, Population,
};
use crate::case::units::rounded;
use crate::case::{CaseError, Diagnostics, LoadedCase};
use crate::check::{CostModel, PACKED, ShapeFacts, check_memory, exchange_of, warn_of_overlap, warn_of_tank};
use crate::machine::Machine;

use placed::Placed;

/// Shapes, beds and tables built on the way.
#[derive(Clone, Debug)]
pub struct Feasible {
    /// Shape of each population at size factor 1.
    pub shapes: Vec<Shape>,
    /// Bed of each population that is read from a file, with the grains of that population alone.
    pub beds: Vec<Option<Bed>>,
    /// Facts about the shapes.
    pub facts: Vec<ShapeFacts>,
    /// Warnings, those of the case file included.
    pub warnings: Diagnostics,
}

/// More findings of one kind than this help nobody.
const MOST_ALIKE: usize = 5;
/// Solid fraction no packing of like grains reaches.
const DENSEST: Real = 0.78;
/// Solid fraction of the loosest bed to reckon with where other grains have to keep clear of it.
const LOOSEST: Real = 0.4;
/// Least density of a grain that acts by its surface over that of the liquid.
const LIGHTEST: Real = 0.3;
/// Differences of lengths below this part of them are rounding.
const ROUNDED: Real = 1e-9;
/// Largest gap between the surface of a grain and its contact spheres over its size that is not warned of; `shell(75)` on
/// the sand of Yagyu et al. (2015) has 0.108.
const WIDE_GAP: Real = 0.12;

/// Asks whether the case can run on this machine.
///
/// # Errors
/// All findings together, if one of them is an error.
pub fn check(loaded: &LoadedCase, machine: &Machine, model: &CostModel) -> Result<Feasible, Box<CaseError>> {
    let mut report = loaded.warnings.clone();
    warn_of_tank(loaded, &mut report);
    warn_of_overlap(loaded, &mut report);
    check_memory(loaded, machine, model, &mut report);
    if report.has_errors() {
        return Err(loaded.refused(report));
    }
    let (shapes, beds) = (shapes(loaded, &mut report), beds::read(loaded, &mut report));
    let facts = match complete(loaded, &shapes, &beds) {
        Ok(shapes) => {
            let facts = facts_of_all(&loaded.case, &shapes, &beds);
            let mut search = Search { loaded, case: &loaded.case, shapes: &shapes, beds: &beds, report: &mut report };
            search.faults(&facts);
            search.pace(&facts, model);
            facts
        }
        Err(left_out) => {
            // The faults of the others are told at once.
            let rest = loaded.without_grains(&left_out);
            let is_left = |n: &usize| !left_out.contains(n);
            let (shapes, beds): (Vec<Shape>, Vec<Option<Bed>>) = (0..shapes.len())
                .filter(is_left)
                .filter_map(|n| shapes[n].clone().map(|shape| (shape, beds[n].clone())))
                .unzip();
            let facts = facts_of_all(&rest.case, &shapes, &beds);
            Search { loaded: &rest, case: &rest.case, shapes: &shapes, beds: &beds, report: &mut report }
                .faults(&facts);
            return Err(loaded.refused(report));
        }
    };
    if report.has_errors() {
        return Err(loaded.refused(report));
    }
    Ok(Feasible { shapes: shapes.into_iter().flatten().collect(), beds, facts, warnings: report })
}

/// The shapes if every population has one, and its bed if it lies in one; else which have not.
fn complete(loaded: &LoadedCase, shapes: &[Option<Shape>], beds: &[Option<Bed>]) -> Result<Vec<Shape>, Vec<usize>> {
    let lacks_bed = |n: usize| matches!(loaded.case.grains[n].placement, GrainPlacement::Bed(_)) && beds[n].is_none();
    let left_out: Vec<usize> = (0..shapes.len()).filter(|&n| shapes[n].is_none() || lacks_bed(n)).collect();
    if left_out.is_empty() { Ok(shapes.iter().flatten().cloned().collect()) } else { Err(left_out) }
}

fn facts_of_all(case: &Case, shapes: &[Shape], beds: &[Option<Bed>]) -> Vec<ShapeFacts> {
    let each = case.grains.iter().zip(shapes).zip(beds);
    each.map(|((population, shape), bed)| facts_of(population, shape, bed.as_ref())).collect()
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
    let shapes = if report.has_errors() { Vec::new() } else { usable_shapes(loaded, &mut report) };
    if report.has_errors() {
        return Err(loaded.refused(report));
    }
    let facts = loaded.case.grains.iter().zip(&shapes).map(|(of, shape)| facts_of(of, shape, None)).collect();
    Ok(Feasible { beds: vec![None; shapes.len()], shapes, facts, warnings: report })
}

/// The shapes of the grains and, for a run that begins with them, the beds, for a rank that is told to run what was
/// found feasible.
///
/// # Errors
/// All findings together, if a population has no usable shape or its bed cannot be read.
pub fn shapes_and_beds(loaded: &LoadedCase, with_beds: bool) -> Result<ShapesAndBeds, Box<CaseError>> {
    let mut report = Diagnostics::default();
    let shapes = usable_shapes(loaded, &mut report);
    let beds = if with_beds { beds::read(loaded, &mut report) } else { vec![None; shapes.len()] };
    if report.has_errors() {
        return Err(loaded.refused(report));
    }
    Ok((shapes, beds))
}

/// Shape and bed of each population.
pub type ShapesAndBeds = (Vec<Shape>, Vec<Option<Bed>>);

/// The shapes of the grains alone, one of each population, for a run that is only looked at.
///
/// # Errors
/// All findings together, if a population has no usable shape.
pub fn shapes_alone(loaded: &LoadedCase) -> Result<Vec<Shape>, Box<CaseError>> {
    let mut report = loaded.warnings.clone();
    let shapes = usable_shapes(loaded, &mut report);
    if report.has_errors() {
        return Err(loaded.refused(report));
    }
    Ok(shapes)
}

/// The shapes that can be built, which are all if nothing is reported.
fn usable_shapes(loaded: &LoadedCase, report: &mut Diagnostics) -> Vec<Shape> {
    shapes(loaded, report).into_iter().flatten().collect()
}

/// Builds the shape of each population, each once for all that have it; those that fail are reported.
fn shapes(loaded: &LoadedCase, report: &mut Diagnostics) -> Vec<Option<Shape>> {
    let grains = &loaded.case.grains;
    let mut shapes: Vec<Option<Shape>> = Vec::new();
    for (n, population) in grains.iter().enumerate() {
        let alike =
            |other: &Population| other.shape == population.shape && other.contact_spheres == population.contact_spheres;
        let before = grains[..n].iter().position(alike).and_then(|before| shapes[before].clone());
        if let Some(before) = before {
            shapes.push(Some(before.named(&population.name)));
            continue;
        }
        match shape_of(population) {
            Ok(shape) => shapes.push(Some(shape)),
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
                shapes.push(None);
            }
        }
    }
    shapes
}

/// How fast listed grains that turn cover space as they begin, and how fast a point of their surfaces is at most [m/s].
fn beginning(population: &Population, shape: &Shape) -> [Real; 2] {
    let GrainPlacement::List(list) = &population.placement else { return [0.0; 2] };
    list.iter().filter(|grain| grain.angular_velocity != Vector::ZERO).fold([0.0; 2], |[cover, point], grain| {
        let (speed, turn) = (grain.velocity.length(), grain.angular_velocity);
        let along_normal = shape.turning_speed((grain.orientation * shape.drawn()).inverse() * turn);
        let around = shape.bounding_radius() * turn.length();
        [cover.max(speed + grain.factor * along_normal), point.max(speed + grain.factor * around)]
    })
}

/// Facts about a shape for the report of `check`.
fn facts_of(population: &Population, shape: &Shape, bed: Option<&Bed>) -> ShapeFacts {
    let report = shape.report();
    let mut first =
        format!("{} nodes, {} tetrahedra, volume {}", report.nodes, report.tetrahedra, amounts::volume(report.volume));
    if let (Some(volume), Some(inertia)) = (report.volume_error, report.inertia_error) {
        first +=
            // Rounded first, for no "-0.0 %".
            &format!(
                ": {:+.1} % of the smooth shape's, inertia off by {:.1} %",
                (1e3 * volume).round() / 10.0 + 0.0,
                1e2 * inertia.abs()
            );
    }
    let mut lines = vec![first];
    lines.push(format!(
        "dihedral angles {:.0} to {:.0} degrees, smallest radius ratio {:.2}",
        report.quality.smallest_dihedral_angle,
        report.quality.largest_dihedral_angle,
        report.quality.smallest_radius_ratio
    ));
    let [smallest, largest] = report.sphere_radii;
    let radii = if largest - smallest < ROUNDED * largest {
        format!("a radius of {}", length(largest))
    } else {
        format!("radii of {} to {}", length(smallest), length(largest))
    };
    let gap = if report.largest_gap < ROUNDED * largest {
        "no gap to the shape".into()
    } else {
        format!("largest gap to the shape {}", length(report.largest_gap))
    };
    let spheres = if report.contact_spheres == 1 { "sphere" } else { "spheres" };
    lines.push(format!("{} contact {spheres} with {radii}, {gap}", report.contact_spheres));
    let (low, high) = shape.extent();
    ShapeFacts {
        volume: Some(report.volume),
        contact_spheres: Some(report.contact_spheres),
        size: Some((high - low).min_element()),
        grains: bed.map(|bed| bed.grains.len()),
        bed_volume: bed.map(|bed| report.volume * bed.grains.iter().map(|grain| grain.scale.powi(3)).sum::<Real>()),
        body: Some(Body::from(shape)),
        corners: Some(shape.surface().nodes.len()),
        begins: beginning(population, shape),
        lines,
    }
}

struct Search<'a> {
    loaded: &'a LoadedCase,
    case: &'a Case,
    shapes: &'a [Shape],
    beds: &'a [Option<Bed>],
    report: &'a mut Diagnostics,
}

impl Search<'_> {
    /// Looks for all that makes the case impossible.
    fn faults(&mut self, facts: &[ShapeFacts]) {
        self.weights(facts);
        self.contact_gaps();
        self.room();
        self.widths(facts);
        self.periods(facts);
        let lying = grains::placed(self.case, self.shapes, self.beds);
        self.carried_within(&lying);
        let lying: Vec<Placed> = lying.iter().map(|grain| self.as_it_lies(grain)).collect();
        self.within_box(&lying);
        self.clear_of_gates(&lying);
        self.ways_are_free(&lying);
        self.overlaps(&lying);
        self.packed_apart(facts);
        self.beside_packed(&lying);
        self.liquids(&lying);
        self.poured();
        self.thin();
        self.narrow();
        self.prepared(&lying, facts);
        self.moving_grains(&lying);
    }

    /// Place of a population in the file.
    fn span(&self, population: usize) -> Range<usize> {
        self.loaded.places.at(&format!("grains.{population}.placement"))
    }

    /// No grain may be too light for its exchange of momentum with the fluid.
    fn weights(&mut self, facts: &[ShapeFacts]) {
        if exchange_of(self.case, facts).is_none_or(|(exchange, _)| exchange != Exchange::Surface) {
            return;
        }
        if !self.case.has_liquid() {
            return;
        }
        let liquid = self.case.fluid.liquid.density;
        for (n, population) in self.case.grains.iter().enumerate().filter(|(_, p)| p.has_free_grains()) {
            let of_material = self.case.material(&population.material).map(|material| material.density);
            let own = population.mass_override.map(|mass| mass / self.shapes[n].volume());
            let Some(density) = own.or(of_material).filter(|density| *density < LIGHTEST * liquid) else { continue };
            let key = if own.is_some() { format!("grains.{n}.mass_override") } else { format!("grains.{n}") };
            let title = format!("`{}` is too light", population.name);
            self.report
                .error(self.loaded.places.at(&key), title)
                .label(format!("{density:.1} kg/m^3, below {LIGHTEST} times the liquid's {liquid:.1}"))
                .help("the coupling is not tested below this ratio: take heavier grains");
        }
    }

    /// Warns of surfaces that contact spheres leave uncovered: grains sink that far into each other and into walls.
    fn contact_gaps(&mut self) {
        for (n, (population, shape)) in self.case.grains.iter().zip(self.shapes).enumerate() {
            // That of the smooth shape where there is one: a mesh lies within it.
            let extent = match shape.exact() {
                Some(exact) => 2.0 * exact.half_extents(Quaternion::IDENTITY),
                None => shape.extent().1 - shape.extent().0,
            };
            let (size, gap) = (extent.min_element(), shape.contact_spheres().largest_gap);
            if gap <= WIDE_GAP * size {
                continue;
            }
            let help = match population.contact_spheres {
                ContactSphereChoice::File { .. } => {
                    "add spheres to `sphere_file` where its surface is uncovered".to_owned()
                }
                ContactSphereChoice::Axis(_) if matches!(shape.exact(), Some(Exact::Cylinder(_))) => {
                    "`contact_spheres = \"shell(200)\"` follows the edges of its ends".to_owned()
                }
                ContactSphereChoice::Axis(count) => format!("`contact_spheres = \"axis({})\"` leaves less", 2 * count),
                ContactSphereChoice::Single => "`contact_spheres = \"shell(75)\"` follows the surface".to_owned(),
                ContactSphereChoice::Shell { count, .. } => format!(
                    "more and smaller spheres leave less, for example `contact_spheres = \"shell({})\"` with \
                     `sphere_radius = \"{} mm\"`: a corner keeps 0.73 of the radius",
                    (4 * count).min(MOST_ON_SHELL),
                    rounded(500.0 * shape.contact_spheres().radii[0])
                ),
            };
            let span = self.loaded.places.near(&format!("grains.{n}.contact_spheres"));
            self.report
                .warning(
                    span,
                    format!("the contact spheres of `{}` leave parts of its surface uncovered", population.name),
                )
                .label(format!(
                    "up to {}, {:.0} % of its size: it sinks that far into what it touches there",
                    length(gap),
                    1e2 * gap / size
                ))
                .help(help);
        }
    }

    /// Between periodic sides a grain must not meet an image of itself, by its film or bridge neither.
    fn periods(&mut self, facts: &[ShapeFacts]) {
        let (case, extent) = (self.case, self.case.domain.extent());
        let laws = if case.run.packing_only { grains::interactions(case) } else { grains::wet_interactions(case) };
        let margin = |(population, facts): (&Population, &ShapeFacts)| {
            facts.body.as_ref().map_or(0.0, |body| laws.margin(body, population.sizes().largest()))
        };
        let margin = case.grains.iter().zip(facts).map(margin).fold(0.0, Real::max);
        for (n, population) in case.grains.iter().enumerate() {
            let largest = self.shapes[n].bounding_radius() * population.sizes().largest();
            let needed = Engine::shortest_period(largest) + 2.0 * margin;
            let is_short = |&d: &usize| self.case.boundary[d][0] == BoundarySide::Periodic && extent[d] < needed;
            let Some(d) = (0..3).find(is_short) else { continue };
            self.report
                .error(self.span_of_shape(n), format!("`{}` is too long for the periodic box", population.name))
                .label(format!("the box is {} long along x{}", length(extent[d]), d + 1))
                .help(format!(
                    "it has to be {} at least: make it longer, or the grains smaller",
                    amounts::at_least(needed)
                ));
        }
    }

    /// Place of the shape of a population in the file.
    fn span_of_shape(&self, population: usize) -> Range<usize> {
        self.loaded.places.at(&format!("grains.{population}.shape"))
    }

    /// A packed bed has to fit into the box, with all populations that are packed into it.
    fn room(&mut self) {
        let (case, extent) = (self.case, self.case.domain.extent());
        let base = extent.x * extent.y;
        let packed: Vec<(usize, usize, Real)> = (0..case.grains.len())
            .filter_map(|n| Some((n, packed_count(&case.grains[n])?)))
            .map(|(n, count)| (n, count, self.solid(n, count)))
            .collect();
        let count: usize = packed.iter().map(|(_, count, _)| count).sum();
        let solid: Real = packed.iter().map(|(.., solid)| solid).sum();
        let Some(&(n, ..)) = packed.iter().max_by(|a, b| a.2.total_cmp(&b.2)) else { return };
        let height = solid / (PACKED * base);
        let span = self.loaded.places.of(&format!("grains.{n}.count")).unwrap_or(self.span(n));
        let names =
            packed.iter().map(|&(n, ..)| format!("`{}`", case.grains[n].name)).collect::<Vec<_>>().join(" and ");
        let [fit, together] = if packed.len() == 1 { ["does not fit", ""] } else { ["do not fit", " together"] };
        let label = format!("{count} grains make a bed about {:.1} mm high", height * 1e3);
        let levels = |n: usize| matches!(&case.grains[n].placement, GrainPlacement::Packed(how) if how.level.is_some());
        if solid > DENSEST * base * extent.z {
            self.report
                .error(span, format!("{names} {fit} into the box{together}"))
                .label(label)
                .help(format!("the box is {:.1} mm high: take fewer grains or a larger box", extent.z * 1e3));
        } else if height > extent.z && !packed.iter().all(|&(n, ..)| levels(n)) {
            self.report.warning(Some(span), format!("{names} may reach out of the box")).label(label);
        }
    }

    /// Volume of so many grains of a population as they are drawn [m^3].
    fn solid(&self, population: usize, count: usize) -> Real {
        self.shapes[population].volume() * grains::drawn_cubes(&self.case.grains[population], count)
    }

    /// Grains that are packed begin on a lattice, of which a place has to fit into the plan of the box.
    fn widths(&mut self, facts: &[ShapeFacts]) {
        let extent = self.case.domain.extent();
        for (n, population) in self.case.grains.iter().enumerate() {
            let GrainPlacement::Packed(how) = &population.placement else { continue };
            let Some(body) = &facts[n].body else { continue };
            let needed = how.spacing * 2.0 * body.bounding_radius * population.sizes().largest();
            let Some(d) = (0..2).find(|&d| extent[d] < needed) else { continue };
            self.report
                .error(self.span_of_shape(n), format!("`{}` is too large to be packed into this box", population.name))
                .label(format!(
                    "up to {} between places of the lattice, the box is {} long along x{}",
                    length(needed),
                    length(extent[d]),
                    d + 1
                ))
                .help("check the units of the shape; else make the box wider");
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
                    .label("the packing of the other grains would not include it")
                    .help(APART);
            }
        }
        let floor = self.case.domain.lower.z;
        let top = self.top_of_packed();
        for population in 0..self.case.grains.len() {
            let all = lying.iter().filter(|grain| grain.population == population);
            let lowest = all.map(|grain| (self.lowest(grain), grain)).min_by(|a, b| a.0.total_cmp(&b.0));
            let Some((height, grain)) = lowest.filter(|(height, _)| *height < top) else { continue };
            let (name, span) = self.name(grain);
            self.report
                .error(span, format!("{name} lies where other grains are packed"))
                .label(format!(
                    "it reaches down to {} above the floor, the bed perhaps up to {}",
                    length(height - floor),
                    length(top - floor)
                ))
                .help(APART);
        }
    }

    /// Height that a packed bed which is not levelled may reach: packed loosely, with a grain that stands on it \[m].
    fn highest_bed(&self) -> Real {
        let extent = self.case.domain.extent();
        let mut solid = 0.0;
        let mut longest: Real = 0.0;
        for (n, population) in self.case.grains.iter().enumerate() {
            let Some(count) = packed_count(population) else { continue };
            solid += self.solid(n, count);
            longest = longest.max(2.0 * self.shapes[n].bounding_radius() * population.sizes().largest());
        }
        solid / (LOOSEST * extent.x * extent.y) + longest
    }
}

/// Number of the grains of a population that is packed.
fn packed_count(population: &Population) -> Option<usize> {
    population.count.filter(|_| matches!(population.placement, GrainPlacement::Packed(_)))
}
