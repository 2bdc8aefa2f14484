//! Liquid at the start, and what has to fit together across the tables of a case.

use sazanami_numerics::{Real, Vector};

use super::Context;
use super::flow::span_of_side;
use crate::case::meaning::{
    BoxDomain, Case, Exchange, FluidName, GrainPlacement, LiquidRegion, Motion, Placement, Population, Projection,
    Region, Solver,
};
use crate::case::schema::{CaseText, FallText, LiquidText, RegionText};
use crate::case::value::Range1;
use crate::case::written::{Angle, At, Length, Velocity};

impl Context<'_> {
    pub(super) fn liquids(
        &mut self,
        text: &CaseText,
        domain: &BoxDomain,
        grains: &[Population],
        axis: [Real; 2],
    ) -> Vec<LiquidRegion> {
        text.liquid.iter().enumerate().filter_map(|(n, at)| self.liquid(n, at, domain, grains, axis)).collect()
    }

    fn liquid(
        &mut self,
        number: usize,
        at: &At<LiquidText>,
        domain: &BoxDomain,
        grains: &[Population],
        axis: [Real; 2],
    ) -> Option<LiquidRegion> {
        let At { value, span } = at;
        let Some(region) = &value.region else {
            self.values.missing(
                Some(span),
                "region",
                "add `region.sphere = { diameter = \"5.537 mm\" }` or another shape",
            );
            return None;
        };
        let shape = self.region(region)?;
        let name =
            self.values.text(value.name.as_ref(), "name").map_or_else(|| format!("liquid {number}"), str::to_owned);
        let placement = self.placement_of_liquid(value, &shape, span, grains);
        let velocity = self.values.vector::<Velocity>(value.velocity.as_ref(), "velocity");
        let fall = value.fall.as_ref().map(|fall| self.fall(fall));
        if velocity.is_some() && fall.is_some() {
            self.values
                .report
                .error(span.clone(), "`velocity` and `fall` say the same thing twice")
                .label("this liquid has both")
                .help("keep one of the two");
        }
        let liquid = LiquidRegion {
            name,
            fluid: self.values.choice(value.fluid.as_ref(), "fluid", FluidName::Liquid),
            region: shape,
            placement,
            velocity: velocity.or(fall).unwrap_or(Vector::ZERO),
            drop_velocity: self.values.choice(
                value.drop_velocity.as_ref(),
                "drop_velocity",
                self.defaults.drop_velocity,
            ),
            allow_touching_grains: self.values.flag(
                value.allow_touching_grains.as_ref(),
                "allow_touching_grains",
                self.overlaps,
            ),
        };
        self.check_place(&liquid, region, domain, axis);
        Some(liquid)
    }

    fn fall(&mut self, At { value, span }: &At<FallText>) -> Vector {
        let speed = self.values.required::<Velocity>(value.speed.as_ref(), span, "speed", Range1::NonNegative);
        let angle = self.values.quantity::<Angle>(value.angle.as_ref(), "angle", Range1::Any, 0.0);
        let heading = self.values.quantity::<Angle>(value.heading.as_ref(), "heading", Range1::Any, 0.0);
        let slant = speed * angle.sin();
        Vector::new(slant * heading.cos(), slant * heading.sin(), -speed * angle.cos())
    }

    fn placement_of_liquid(
        &mut self,
        value: &LiquidText,
        shape: &Region,
        span: &std::ops::Range<usize>,
        grains: &[Population],
    ) -> Placement {
        let position = self.values.vector::<Length>(value.position.as_ref(), "position");
        let above = self.values.optional::<Length>(value.above_bed.as_ref(), "above_bed", Range1::Any);
        let gap = self.values.optional::<Length>(value.gap_above_bed.as_ref(), "gap_above_bed", Range1::Any);
        let offset = self.values.pair::<Length>(value.offset.as_ref(), "offset");
        let given = usize::from(position.is_some()) + usize::from(above.is_some()) + usize::from(gap.is_some());
        if given > 1 {
            self.values
                .report
                .error(span.clone(), "a liquid has one place")
                .label("more than one of `position`, `above_bed` and `gap_above_bed` is given")
                .help("keep one of them");
        }
        let Some(height) = above.or(gap) else {
            if let (Some(_), Some(written)) = (offset, &value.offset) {
                self.values
                    .report
                    .error(written.item.span.clone(), "`offset` belongs to a place above the bed")
                    .label("there is no `above_bed` or `gap_above_bed` beside it")
                    .help("shift `position` instead");
            }
            return Placement::Absolute(position.unwrap_or(Vector::ZERO));
        };
        let place =
            value.above_bed.as_ref().or(value.gap_above_bed.as_ref()).map_or(span.clone(), |q| q.item.span.clone());
        let has_bed = grains.iter().any(|p| matches!(p.placement, GrainPlacement::Packed(_) | GrainPlacement::Bed(_)));
        if !has_bed {
            self.values
                .report
                .error(place.clone(), "there is no bed to be above")
                .label("needs grains with `placement.packed` or `placement.bed`")
                .help("give the `position` of the liquid instead");
        }
        let to_bottom = above.is_none();
        let bottom = if to_bottom { height } else { height + shape.heights()[0] };
        let overlaps = self.overlaps;
        let touches = self.values.flag(value.allow_touching_grains.as_ref(), "allow_touching_grains", overlaps);
        if bottom < 0.0 && !touches {
            self.values
                .report
                .error(place, "the liquid begins within the bed")
                .label(format!("its lowest point lies {:.4} mm below the highest grain", -bottom * 1e3))
                .help("raise it, or write `allow_touching_grains = true`");
        }
        Placement::AboveBed { height, to_bottom, offset: offset.unwrap_or([0.0; 2]) }
    }

    fn region(&mut self, At { value, span }: &At<RegionText>) -> Option<Region> {
        let values = &mut self.values;
        Some(match value {
            RegionText::Box(b) => {
                let lower = values.required_vector::<Length>(b.lower.as_ref(), span, "lower");
                let upper = values.required_vector::<Length>(b.upper.as_ref(), span, "upper");
                if (upper - lower).min_element() <= 0.0 {
                    values
                        .report
                        .error(span.clone(), "this box of liquid has no extent")
                        .label("`upper` has to lie above `lower` in x1, x2 and x3");
                }
                Region::Box { lower, upper }
            }
            RegionText::Sphere(s) => Region::Sphere {
                centre: values.vector::<Length>(s.centre.as_ref(), "centre").unwrap_or(Vector::ZERO),
                diameter: values.required::<Length>(s.diameter.as_ref(), span, "diameter", Range1::Positive),
            },
            RegionText::Spheroid(s) => Region::Spheroid {
                centre: values.vector::<Length>(s.centre.as_ref(), "centre").unwrap_or(Vector::ZERO),
                horizontal_diameter: values.required::<Length>(
                    s.horizontal_diameter.as_ref(),
                    span,
                    "horizontal_diameter",
                    Range1::Positive,
                ),
                vertical_diameter: values.required::<Length>(
                    s.vertical_diameter.as_ref(),
                    span,
                    "vertical_diameter",
                    Range1::Positive,
                ),
            },
            RegionText::HalfSpace(h) => {
                let point = values.required_vector::<Length>(h.point.as_ref(), span, "point");
                let normal = Vector::from(values.numbers::<3>(h.normal.as_ref(), "normal").unwrap_or([0.0, 0.0, 1.0]));
                if normal.length() == 0.0 {
                    values.report.error(span.clone(), "a normal needs a direction").label("this one is zero");
                }
                // A unit vector, as in a resolved case, is kept to the last bit.
                let unit = (normal.length() - 1.0).abs() < 1e-15;
                Region::HalfSpace { point, normal: if unit { normal } else { normal.normalize_or_zero() } }
            }
            RegionText::Union(parts) => {
                if parts.is_empty() {
                    values
                        .report
                        .error(span.clone(), "a union of nothing holds nothing")
                        .label("expected a list of shapes");
                }
                Region::Union(parts.iter().filter_map(|part| self.region(part)).collect())
            }
        })
    }

    /// A liquid that misses the box is a mistake; one that reaches over its edge is cut, and said so.
    fn check_place(&mut self, liquid: &LiquidRegion, written: &At<RegionText>, domain: &BoxDomain, axis: [Real; 2]) {
        let (shift, heights_known) = match liquid.placement {
            Placement::Absolute(position) => (position, true),
            Placement::AboveBed { offset, .. } => {
                (Vector::new(axis[0] + offset[0], axis[1] + offset[1], domain.lower.z), false)
            }
        };
        let region = liquid.region.moved(shift);
        let Some((mut lower, mut upper)) = bounds(&region) else { return };
        if !heights_known {
            (lower.z, upper.z) = (domain.lower.z, domain.lower.z);
        }
        let misses = lower.cmpge(domain.upper).any() || upper.cmplt(domain.lower).any();
        let reaches_over = lower.cmplt(domain.lower).any() || upper.cmpgt(domain.upper).any();
        if misses {
            self.values
                .report
                .error(written.span.clone(), format!("`{}` lies outside the box", liquid.name))
                .label(format!("the box reaches from {} to {}", millimetres(domain.lower), millimetres(domain.upper)))
                .help("positions are those of the shape's origin");
        } else if reaches_over && matches!(written.value, RegionText::Sphere(_) | RegionText::Spheroid(_)) {
            self.values
                .report
                .warning(Some(written.span.clone()), format!("`{}` reaches over the edge of the box", liquid.name))
                .label("what is outside is cut off");
        }
    }

    /// What has to fit together across tables.
    pub(super) fn cross_check(&mut self, text: &CaseText, case: &Case) {
        if case.fluids.gas.density > case.fluids.liquid.density {
            let span = text.fluid.as_ref().map_or(0..0, |at| at.span.clone());
            self.values
                .report
                .error(span, "the gas is heavier than the liquid")
                .label("`liquid` names the heavier fluid")
                .help("exchange the two");
        }
        if case.fluid.projection == Projection::Incremental && !case.liquids.is_empty() {
            let span = text
                .fluid
                .as_ref()
                .and_then(|at| at.value.projection.as_ref())
                .or(None)
                .map(|choice| choice.item.span.clone());
            self.values
                .report
                .warning(span, "incremental projection with two fluids")
                .label("the pressure of an interface that has moved on stays behind")
                .help("`projection = \"full\"` follows the interface");
        }
        self.check_exchange(text, case);
        self.check_floor(text, case);
        if case.run.packing_only && !case.packs() {
            let span = text.run.as_ref().map_or(0..0, |at| at.span.clone());
            self.values
                .report
                .error(span, "there is nothing to pack")
                .label("`packing_only` needs grains with `placement.packed`")
                .help("leave out `packing_only`, or add `placement.packed = {}` to the grains");
        }
    }

    /// Grains that are packed, and beds that are free, lie on the lower side of x3; they are packed downwards.
    fn check_floor(&mut self, text: &CaseText, case: &Case) {
        let lies = |population: &&Population| match &population.placement {
            GrainPlacement::Packed(_) => true,
            GrainPlacement::Bed(_) => population.motion == Motion::Free,
            GrainPlacement::Lattice(_) | GrainPlacement::List(_) => false,
        };
        if let Some(population) = case.grains.iter().find(lies).filter(|_| !case.holds_grains(2, 0)) {
            self.values
                .report
                .error_at(span_of_side(text, 2, 0), format!("nothing holds `{}` from below", population.name))
                .label("the side x3_lower is no wall for grains")
                .help("make `x3_lower` \"no_slip\" or \"slip\"");
        }
        let down = -case.gravity.z;
        if case.packs() && down <= case.gravity.x.hypot(case.gravity.y) {
            let span = text.gravity.as_ref().map(|gravity| gravity.item.span.clone());
            self.values
                .report
                .error_at(span, "gravity does not pack these grains onto the floor")
                .label("its largest part has to point down x3")
                .help("write `gravity = \"9.8 m/s^2\"`, which points down by itself");
        }
    }

    /// The exact exchange is unstable for grains hardly heavier than the liquid.
    fn check_exchange(&mut self, text: &CaseText, case: &Case) {
        if case.solver != Solver::Mics || case.coupling.exchange != Exchange::Exact {
            return;
        }
        let least = 1.05 * case.fluids.liquid.density;
        for (population, written) in case.grains.iter().zip(&text.grains) {
            let Some(material) = case.material(&population.material) else { continue };
            // With a mass of its own the volume of the mesh decides; it is not known yet.
            if population.mass_override.is_some() {
                continue;
            }
            let density = material.density;
            if density < least {
                self.values
                    .report
                    .error(written.span.clone(), format!("`{}` is too light for the exact exchange", population.name))
                    .label(format!(
                        "{density:.1} kg/m^3, below 1.05 times the liquid's {:.1}",
                        case.fluids.liquid.density
                    ))
                    .help(
                        "write `exchange = \"stress\"` under `[coupling]`: returning the fluid's loss one step later \
                         amplifies it by displaced over own mass",
                    );
            }
        }
    }
}

/// Bounding box, where it is finite.
fn bounds(region: &Region) -> Option<(Vector, Vector)> {
    match region {
        Region::Box { lower, upper } => Some((*lower, *upper)),
        Region::Sphere { centre, diameter } => {
            let half = Vector::splat(0.5 * diameter);
            Some((*centre - half, *centre + half))
        }
        Region::Spheroid { centre, horizontal_diameter, vertical_diameter } => {
            let half = Vector::new(*horizontal_diameter, *horizontal_diameter, *vertical_diameter) * 0.5;
            Some((*centre - half, *centre + half))
        }
        Region::HalfSpace { .. } => None,
        Region::Union(parts) => {
            let mut all = parts.iter().map(bounds);
            let first = all.next()??;
            all.try_fold(first, |(low, high), next| next.map(|(l, h)| (low.min(l), high.max(h))))
        }
    }
}

/// A place in millimetres, for messages.
pub(super) fn millimetres(x: Vector) -> String {
    let short = |value: Real| {
        let text = format!("{:.4}", value * 1e3);
        text.trim_end_matches('0').trim_end_matches('.').to_owned()
    };
    format!("({}, {}, {}) mm", short(x.x), short(x.y), short(x.z))
}
