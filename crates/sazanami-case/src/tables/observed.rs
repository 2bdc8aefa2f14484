//! `[bed]`, `[heap]` and `[erosion]`: what is measured of the bed, of a heap and of the crater.

use sazanami_case_derive::Keys;
use sazanami_numerics::{Real, Vector};
use sazanami_observe::erosion::CountedGrains;
use sazanami_observe::heap::HeapShape;

use super::Population;
use crate::amounts::length;
use crate::read::{Context, Table};
use crate::units::{rounded, rounded_within};
use crate::value::Range1;

/// Largest ratio, either way, of the grain size that an evaluation measures lengths in to that of the grains.
const NEAR_SIZE: Real = 10.0;
/// Cells of an evaluation over the shortest edge of the box at least, where no size of grains is known.
const FINEST: Real = 1e-3;

/// Radius about the axis of the bed, and height of the slab of the porosity, in sizes of the largest grains.
const HEIGHT_RADIUS: Real = 2.0;
const POROSITY_SLAB: Real = 10.0;

/// Measures of the bed.
#[derive(Clone, Copy, Debug, Default, PartialEq, Keys)]
#[keys(check = Self::check)]
pub struct Bed {
    /// Lower height (coordinate of x3) of the slab in which porosity is measured.
    #[key(unit = "m", default = cx.known.domain.lower.z, says = "the floor")]
    pub porosity_lower: Real,
    /// Upper height of that slab; H_s where that is lower.
    #[key(
        unit = "m",
        says = "ten of the largest grains by their usual size above the lower one; at most one below H_s where that leaves one"
    )]
    pub porosity_upper: Option<Real>,
    /// Usual size of the largest grains \[m].
    #[key(skip = usual_size(cx))]
    pub grain: Real,
    /// Radius about the axis within which the height of the bed H_s is taken: the highest point of a grain there.
    #[key(unit = "m", within = cx.known.lengths(), default = height_radius(cx),
          says = "two of the largest grains by their usual size; at most half the diagonal of the box, at least a hundred-thousandth of it")]
    pub height_radius: Real,
    /// Axis in x1 and x2, near which H_s is taken and from which the `offset` of liquids counts.
    #[key(unit = "m", default = cx.known.domain.middle(), says = "middle of the box")]
    pub axis: [Real; 2],
}

/// Radius about the axis of the bed \[m].
fn height_radius(cx: &Context<'_>) -> Real {
    let longest = cx.known.domain.extent().length();
    (HEIGHT_RADIUS * usual_size(cx)).max(1e-5 * longest).min(0.5 * longest)
}

/// Usual size of the largest grains \[m]; a tenth of the shortest edge of the box where none is known: that of a mesh stands in its file.
fn usual_size(cx: &Context<'_>) -> Real {
    let sizes = cx.known.grains.iter().filter_map(|grains| Some(grains.shape.size()? * grains.usual_factor()));
    sizes.reduce(Real::max).unwrap_or(0.1 * cx.known.domain.extent().min_element())
}

/// Refuses an axis that is given and lies outside the box.
fn check_axis(what: &str, [x, y]: [Real; 2], table: &Table<'_>, help: &str, cx: &mut Context<'_>) {
    let domain = cx.known.domain;
    if table.has("axis") && domain.excludes(Vector::new(x, y, domain.lower.z)) {
        cx.report
            .error(table.place("axis"), format!("the axis of the {what} lies outside the box"))
            .label(domain.reaches())
            .help(help);
    }
}

impl Bed {
    fn check(&mut self, table: &Table<'_>, cx: &mut Context<'_>) {
        check_axis("bed", self.axis, table, "leave out `axis` for the middle of the box", cx);
        let (lower, domain) = (self.porosity_lower, cx.known.domain);
        let upper = self.porosity_upper.unwrap_or(domain.upper.z);
        if lower >= upper || lower < domain.lower.z || upper > domain.upper.z {
            let place = if table.has("porosity_upper") { "porosity_upper" } else { "porosity_lower" };
            let [from, to] = [lower, upper].map(|height| rounded(1e3 * height));
            let [floor, top] = rounded_within(1e3 * domain.lower.z, 1e3 * domain.upper.z);
            cx.report
                .error(table.place(place), "the slab of the porosity has to lie within the box")
                .label(format!("it reaches from {from} mm to {to} mm"))
                .help(format!(
                    "choose heights between {floor} mm and {top} mm, `porosity_lower` below `porosity_upper`"
                ));
        }
    }

    /// Slab between two heights in which the porosity of a bed is measured whose surface lies at `surface` \[m]. The
    /// uppermost grain, where a bed is loose, stays out of it unless an upper height is given or less than a grain would be left.
    #[must_use]
    pub fn porosity_slab(&self, surface: Real) -> [Real; 2] {
        let lower = self.porosity_lower;
        let below = surface - self.grain;
        let upper = match self.porosity_upper {
            Some(given) => given.min(surface),
            None if below > lower + self.grain => below.min(lower + POROSITY_SLAB * self.grain),
            None => surface,
        };
        [lower, upper]
    }
}

/// The slope of a heap. Absent: not observed. An empty table observes a cone in the middle.
#[derive(Clone, Copy, Debug, PartialEq, Keys)]
#[keys(check = Self::check)]
pub struct HeapObserved {
    /// Shape of the heap.
    #[key(word, default = HeapShape::Cone)]
    pub shape: HeapShape,
    /// Axis of the cone in x1 and x2; of a ridge the line along x2 that the heap falls away from: its crest, or a wall.
    #[key(unit = "m", default = cx.known.bed.axis, says = "`bed.axis`")]
    pub axis: [Real; 2],
    /// Grain size: width of the bands over which heights are averaged.
    #[key(unit = "m", within = range_of_grain_size(cx), default = first_size(table, "heap up", cx),
          says = "that of the first population")]
    pub grain_size: Real,
}

impl HeapObserved {
    fn check(&mut self, table: &Table<'_>, cx: &mut Context<'_>) {
        // A ridge stands along the whole of x2.
        let [x, y] = self.axis;
        let y = if self.shape == HeapShape::Ridge { cx.known.domain.lower.y } else { y };
        let help = "a cone stands about a point of the floor, a ridge falls away from a line between the ends of x1";
        check_axis("heap", [x, y], table, help, cx);
    }
}

/// The crater. Absent: not observed. An empty table observes it with the defaults.
#[derive(Clone, Debug, PartialEq, Keys)]
#[keys(check = Self::check)]
pub struct Erosion {
    /// Grain size d that lengths of the method are measured in; required for meshes.
    #[key(unit = "m", within = range_of_grain_size(cx), default = first_size(table, "erode", cx),
          says = "that of the first population")]
    pub grain_size: Real,
    /// Cells of the smoothing grid.
    #[key(unit = "m", within = cells(grain_size, cx), default = 2.5 * grain_size, says = "2.5 d")]
    pub dx: Real,
    /// Thickness of the circular layers.
    #[key(unit = "m", within = cells(grain_size, cx), default = (2.5 * grain_size).min(outer(table, cx) / 6.0),
          says = "2.5 d, at most r_max/6")]
    pub dr: Real,
    /// Largest radius, at most from the axis to the farthest corner of a box that has it in its middle.
    #[key(unit = "m", within = cx.known.radii(), default = outer_default(cx), says = "0.45 of the smaller horizontal edge")]
    pub r_max: Real,
    /// Grains that make the surface in the layers of the paper (`volume_by_layers_mm3`, `profiles.csv`).
    #[key(word, default = CountedGrains::Surface, paper_literal = (Yagyu, CountedGrains::All,
          "the wording counts all grains of a cell, not only those at the surface"))]
    pub mode: CountedGrains,
    /// Axis in x1 and x2. The default is where the only liquid that falls comes to the height H_s with its middle, as it falls freely;
    /// one with a `position`, whose height above the bed is not given, where it starts.
    #[key(unit = "m", default = cx.known.impact(), says = "where the drop meets the bed; `bed.axis` with no drop or several")]
    pub axis: [Real; 2],
}

fn outer_default(cx: &Context<'_>) -> Real {
    let extent = cx.known.domain.extent();
    0.45 * extent.x.min(extent.y)
}

/// The largest radius, before it is read: the thickness of the layers depends on it.
fn outer(table: &Table<'_>, cx: &Context<'_>) -> Real {
    match table.get("r_max").value {
        Some(toml::de::DeValue::String(text)) => {
            crate::units::parse_quantity(text).map_or(Real::NAN, |(value, _)| value)
        }
        _ => outer_default(cx),
    }
}

fn cells(grain_size: Real, cx: &Context<'_>) -> Range1 {
    Range1::Between(grain_size / NEAR_SIZE, cx.known.domain.extent().max_element())
}

impl Erosion {
    fn check(&mut self, table: &Table<'_>, cx: &mut Context<'_>) {
        check_axis("crater", self.axis, table, "leave out `axis` for the place where the drop meets the bed", cx);
        // The coarsest smoothing of the evaluation takes layers 1.6 times as thick, and two of them.
        if self.dr * 3.2 > self.r_max {
            cx.report
                .error(table.span(), "the layers of the crater are too thick")
                .label(format!("{} each out to {}", length(self.dr), length(self.r_max)))
                .help("`r_max` has to be at least 3.2 times `dr`: lower `dr` or raise `r_max`");
        }
    }
}

/// Grain size of the first population; says what is missing where there is none.
pub(super) fn first_size(table: &Table<'_>, verb: &str, cx: &mut Context<'_>) -> Real {
    if let Some(size) = cx.known.grains.first().and_then(|first| Some(first.shape.size()? * first.usual_factor())) {
        return size;
    }
    if !cx.known.grains.is_empty() {
        cx.missing(Some(table.span()), "grain_size", "add `grain_size = \"0.52 mm\"`: a mesh does not tell it");
    } else if !cx.known.is_damaged {
        cx.report.error(table.span(), format!("there is nothing to {verb}")).label("the case has no grains");
    }
    Real::NAN
}

/// Range of the grain size that lengths of an evaluation are measured in.
pub(crate) fn range_of_grain_size(cx: &Context<'_>) -> Range1 {
    let grains = &cx.known.grains;
    let sizes = |factor: fn(&Population) -> Real| grains.iter().filter_map(move |p| Some(p.shape.size()? * factor(p)));
    let smallest = sizes(|p| p.sizes().smallest()).reduce(Real::min);
    let largest = sizes(|p| p.sizes().largest()).reduce(Real::max);
    let edge = cx.known.domain.extent().min_element();
    // The size of a mesh is known with its file only.
    let known = grains.iter().all(|p| p.shape.size().is_some());
    match smallest.zip(largest) {
        Some((smallest, largest)) if known => Range1::Between(smallest / NEAR_SIZE, largest * NEAR_SIZE),
        _ => Range1::Between(FINEST * edge, edge),
    }
}
