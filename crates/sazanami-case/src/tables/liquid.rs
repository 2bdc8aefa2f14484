//! `[[liquid]]`: where liquid (or a bubble) is at first.

use std::f64::consts::FRAC_PI_2;

use sazanami_case_derive::Keys;
use sazanami_mics::flow::DropVelocity;
use sazanami_numerics::{Real, Vector};

use super::grains::numbered;
use super::{BoundarySide, BoxDomain, FluidName, Region};
use crate::amounts::length;
use crate::presets::Solver;
use crate::read::{Context, Table};

/// Part of an edge of the box by which regions reach over it by rounding.
const ROUNDED: Real = 1e-9;

/// A fall.
#[derive(Clone, Copy, Debug, Keys)]
struct Fall {
    /// Speed.
    #[key(unit = "m/s", range = NonNegative)]
    speed: Real,
    /// Angle from the vertical.
    #[key(unit = "rad", default = 0.0)]
    angle: Real,
    /// Direction of the slant, from x1 towards x2.
    #[key(unit = "rad", default = 0.0)]
    heading: Real,
}

impl Fall {
    fn velocity(self) -> Vector {
        let slant = self.speed * self.angle.sin();
        Vector::new(slant * self.heading.cos(), slant * self.heading.sin(), -self.speed * self.angle.cos())
    }
}

/// Placement of a region.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Placement {
    /// The region's origin comes to this point \[m].
    Absolute(Vector),
    /// Above the highest point H_s of the bed in use, near the axis of the box.
    AboveBed {
        /// Height above H_s \[m] of the region's origin (`to_bottom` false) or of its lowest point (true).
        height: Real,
        /// Whether the height is that of the lowest point.
        to_bottom: bool,
        /// Offset from the axis in x1 and x2 \[m].
        offset: [Real; 2],
    },
}

/// Velocity of a liquid: as it is, or by a fall.
#[derive(Clone, Copy, Debug, Keys)]
struct VelocityKeys {
    /// Velocity.
    #[key(unit = "m/s", says = "at rest")]
    velocity: Option<Vector>,
    /// Speed and direction of a fall, instead of the velocity.
    #[key(table)]
    fall: Option<Fall>,
}

impl VelocityKeys {
    fn meaning(self, table: &Table<'_>, cx: &mut Context<'_>) -> Vector {
        if self.velocity.is_some() && self.fall.is_some() {
            cx.report
                .error(table.span(), "`velocity` and `fall` say the same thing twice")
                .label("this liquid has both")
                .help("keep one of the two");
        }
        if self.fall.is_some_and(|fall| fall.angle.abs() > FRAC_PI_2 - 1e-9) {
            let span = cx.places.near(&format!("{}.fall.angle", table.at().path)).unwrap_or(table.span());
            cx.report
                .error(span, "a fall leads downwards: its angle lies between -90 deg and 90 deg")
                .label("measured from the vertical")
                .help("take an angle below 90 deg, or a `velocity` for a liquid that does not fall");
        }
        self.velocity.or(self.fall.map(Fall::velocity)).unwrap_or(Vector::ZERO)
    }

    fn of(velocity: &Vector) -> Self {
        Self { velocity: Some(*velocity), fall: None }
    }
}

/// Place of a liquid: a point, or a height above the bed.
#[derive(Clone, Copy, Debug, Default, Keys)]
struct PlacementKeys {
    /// Position of the shape's origin.
    #[key(unit = "m", says = "the origin")]
    position: Option<Vector>,
    /// Instead of `position`: height of the shape's origin above H_s, the highest point of the bed in use within
    /// `bed.height_radius` of the axis.
    #[key(unit = "m")]
    above_bed: Option<Real>,
    /// Instead of `position`: height of the shape's lowest point above H_s.
    #[key(unit = "m")]
    gap_above_bed: Option<Real>,
    /// Offset in x1 and x2 from the axis `bed.axis`, near which H_s is taken; with `above_bed` or `gap_above_bed`.
    #[key(unit = "m", says = "none")]
    offset: Option<[Real; 2]>,
}

impl PlacementKeys {
    fn meaning(self, table: &Table<'_>, cx: &mut Context<'_>) -> Placement {
        if [self.position.is_some(), self.above_bed.is_some(), self.gap_above_bed.is_some()]
            .into_iter()
            .filter(|given| *given)
            .count()
            > 1
        {
            cx.report
                .error(table.span(), "a liquid has one place")
                .label("more than one of `position`, `above_bed` and `gap_above_bed` is given")
                .help("keep one of them");
        }
        let offset = self.offset.unwrap_or([0.0; 2]);
        match (self.above_bed, self.gap_above_bed) {
            (Some(height), _) => Placement::AboveBed { height, to_bottom: false, offset },
            (None, Some(height)) => Placement::AboveBed { height, to_bottom: true, offset },
            (None, None) => {
                if self.offset.is_some() {
                    cx.report
                        .error(table.place("offset"), "`offset` belongs to a place above the bed")
                        .label("there is no `above_bed` or `gap_above_bed` beside it")
                        .help("shift `position` instead");
                }
                Placement::Absolute(self.position.unwrap_or(Vector::ZERO))
            }
        }
    }

    fn of(placement: &Placement) -> Self {
        match *placement {
            Placement::Absolute(position) => Self { position: Some(position), ..Self::default() },
            Placement::AboveBed { height, to_bottom, offset } => Self {
                above_bed: (!to_bottom).then_some(height),
                gap_above_bed: to_bottom.then_some(height),
                offset: Some(offset),
                ..Self::default()
            },
        }
    }
}

/// Time in which what goes down at `speed` [m/s] and is pulled by `gravity` [m/s^2] comes `height` lower \[m]; `None` if it turns before.
fn time_of_fall(height: Real, speed: Real, gravity: Real) -> Option<Real> {
    let square = speed * speed + 2.0 * gravity * height;
    // The same as (sqrt(square) - speed) / gravity, without gravity too.
    (square >= 0.0).then(|| 2.0 * height / (speed + square.sqrt()))
}

/// A body of liquid (or a bubble) at the start. Everything else is gas; later bodies take the place of earlier ones.
#[derive(Clone, Debug, PartialEq, Keys)]
#[keys(check = Self::check)]
pub struct LiquidRegion {
    /// Name, for messages and results.
    #[key(default = numbered(table), says = "`liquid N`")]
    pub name: String,
    /// Fluid that fills it; `gas` puts a bubble into an earlier liquid.
    #[key(word, default = FluidName::Liquid)]
    pub fluid: FluidName,
    /// Shape about its origin.
    #[key(table, inline, example = "`region.sphere = { diameter = \"5.537 mm\" }` or another shape")]
    pub region: Region,
    /// Placement of that origin.
    #[key(flatten, via = PlacementKeys, then = placement.meaning(table, cx))]
    pub placement: Placement,
    /// Velocity [m/s].
    #[key(flatten, via = VelocityKeys, then = velocity.meaning(table, cx))]
    pub velocity: Vector,
    /// Velocity in cells that it fills in part.
    #[key(word, default, paper_literal = (Yagyu, DropVelocity::Beta,
          "u3 = beta_w v: cells with some water get some of the velocity"))]
    pub drop_velocity: DropVelocity,
    /// Whether it may touch grains at the start; otherwise a liquid that does is refused.
    #[key(default = cx.known.solver == Solver::Mps, says = "`false`; `true` for `solver = \"mps\"`")]
    pub allow_touching_grains: bool,
}

impl LiquidRegion {
    /// Height of its highest point \[m], as far as that is known before the bed is.
    #[must_use]
    pub fn top(&self) -> Option<Real> {
        match self.placement {
            Placement::Absolute(position) => Some(position.z + self.region.heights()[1]),
            Placement::AboveBed { .. } => None,
        }
    }

    /// Whether it falls at the start.
    #[must_use]
    pub fn falls(&self) -> bool {
        self.fluid == FluidName::Liquid && self.velocity.z < 0.0
    }

    /// Where its middle comes to the height H_s of the bed as it falls freely under `gravity` [m/s^2], with `axis` that of the bed \[m]; where it
    /// starts if its height above the bed is not given. `None` if it has no middle, or never comes there.
    pub(crate) fn meets_bed(&self, axis: [Real; 2], gravity: Vector) -> Option<[Real; 2]> {
        let (lower, upper) = self.region.bounds()?;
        let middle = 0.5 * (lower + upper);
        let (place, height) = match self.placement {
            Placement::Absolute(origin) => ([origin.x, origin.y], 0.0),
            Placement::AboveBed { height, to_bottom, offset } => {
                let above = if to_bottom { height - lower.z } else { height };
                ([axis[0] + offset[0], axis[1] + offset[1]], (above + middle.z).max(0.0))
            }
        };
        let time = time_of_fall(height, -self.velocity.z, -gravity.z)?;
        Some([0, 1].map(|d| place[d] + middle[d] + time * (self.velocity[d] + 0.5 * time * gravity[d])))
    }

    fn check(&mut self, table: &Table<'_>, cx: &mut Context<'_>) {
        self.region.check(&table.get("region"), cx);
        if let Placement::AboveBed { height, to_bottom, .. } = self.placement {
            self.check_above_bed(height, to_bottom, table, cx);
        }
        self.check_place(table, cx);
        if self.fluid == FluidName::Gas && cx.known.solver == Solver::Mps {
            cx.report
                .warning(
                    Some(table.place("fluid")),
                    format!("`{}` stays empty: there is no gas among moving particles", self.name),
                )
                .label("a cavity, which the water around it closes")
                .help("take `solver = \"mics\"` for bubbles");
        }
    }

    fn check_above_bed(&self, height: Real, to_bottom: bool, table: &Table<'_>, cx: &mut Context<'_>) {
        let place = table.place(if to_bottom { "gap_above_bed" } else { "above_bed" });
        if !cx.known.has_bed() && !cx.known.is_damaged {
            cx.report
                .error(place.clone(), "there is no bed to be above")
                .label("needs grains with `placement.packed` or `placement.bed`")
                .help("give the `position` of the liquid instead");
        }
        if to_bottom && !self.region.heights()[0].is_finite() {
            cx.report
                .error(place.clone(), "this region has no lowest point")
                .label("the gap is that between the bed and the lowest point of the liquid")
                .help("give the height of its origin instead, `above_bed`, or an end to the region");
        }
        let bottom = if to_bottom { height } else { height + self.region.heights()[0] };
        if bottom < 0.0 && !self.allow_touching_grains {
            cx.report
                .error(place, "the liquid begins within the bed")
                .label(format!("its lowest point lies {} below the highest grain", length(-bottom)))
                .help("raise it, or write `allow_touching_grains = true`");
        }
    }

    /// A liquid that misses the box is a mistake, and so is one from a file that reaches over its edge; others are cut there, and said so.
    fn check_place(&self, table: &Table<'_>, cx: &mut Context<'_>) {
        let (domain, axis) = (cx.known.domain, cx.known.bed.axis);
        // Through periodic sides it goes on, but for liquids from files.
        let is_sampled = self.region.is_sampled();
        let goes_on = cx.known.boundary.map(|[side, _]| side == BoundarySide::Periodic && !is_sampled);
        let (shift, heights_known) = match self.placement {
            Placement::Absolute(position) => (position, true),
            Placement::AboveBed { offset, .. } => {
                (Vector::new(axis[0] + offset[0], axis[1] + offset[1], domain.lower.z), false)
            }
        };
        let moved = self.region.moved(shift);
        let (mut lower, mut upper) = moved.geometry().bounds();
        if is_sampled {
            // A slice has no end along one direction.
            lower = Vector::select(lower.cmpeq(Vector::NEG_INFINITY), domain.lower, lower);
            upper = Vector::select(upper.cmpeq(Vector::INFINITY), domain.upper, upper);
        }
        if heights_known && fills(&moved, &domain) {
            cx.report
                .warning(Some(table.place("region")), format!("`{}` fills the box", self.name))
                .label(format!("none of its surface is in it: {}", domain.reaches()))
                .help("check the unit of its size, and its position");
            return;
        }
        if !lower.is_finite() || !upper.is_finite() {
            return;
        }
        if !heights_known {
            (lower.z, upper.z) = (domain.lower.z, domain.lower.z);
        }
        let misses = lower.cmpge(domain.upper).any() || upper.cmplt(domain.lower).any();
        // A middle on a side is meant: half of the shape beside a plane of symmetry.
        let middle = 0.5 * (lower + upper);
        let is_box = matches!(self.region, Region::Box { .. });
        let reaches_over = (0..3).filter(|&d| !goes_on[d]).any(|d| {
            let (extent, over) = (domain.extent()[d], ROUNDED * domain.extent()[d]);
            let is_apart = |side: Vector| (middle[d] - side[d]).abs() > over;
            let below = domain.lower[d] - lower[d];
            let above = upper[d] - domain.upper[d];
            // A box that reaches far beyond, or beyond both sides, fills that direction.
            let fills = is_box && (below.min(above) > over || below.max(above) >= extent);
            !fills && (below > over && is_apart(domain.lower) || above > over && is_apart(domain.upper))
        });
        let has_ends =
            is_box || matches!(self.region, Region::Sphere { .. } | Region::Spheroid { .. } | Region::Union(_));
        if misses {
            cx.report
                .error(table.place("region"), format!("`{}` lies outside the box", self.name))
                .label(domain.reaches())
                .help("positions are those of the shape's origin");
        } else if reaches_over && is_sampled {
            cx.report
                .error(table.place("region"), format!("`{}`, from a file, does not fit into the box", self.name))
                .label(domain.reaches())
                .help("move it, or give the box room for it; it is not continued through periodic sides");
        } else if reaches_over && has_ends {
            cx.report
                .warning(Some(table.place("region")), format!("`{}` reaches over the edge of the box", self.name))
                .label(format!("what is outside is cut off: {}", domain.reaches()));
        }
    }
}

/// Whether a round shape holds all of the box: it has no hollows.
fn fills(region: &Region, domain: &BoxDomain) -> bool {
    let is_round = matches!(region, Region::Sphere { .. } | Region::Spheroid { .. })
        || matches!(region, Region::Cylinder { amplitude, .. } if *amplitude == 0.0);
    let corner = |n: usize| {
        let [x, y, z] = [0, 1, 2].map(|d| if n >> d & 1 == 1 { domain.upper[d] } else { domain.lower[d] });
        Vector::new(x, y, z)
    };
    is_round && (0..8).all(|n| region.geometry().contains(corner(n)))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Place along x1 at which a drop that slants by 45 degrees from 2 mm above the bed meets it \[mm].
    fn met(speed: Real, gravity: Real) -> Option<Real> {
        let slant = speed * std::f64::consts::FRAC_1_SQRT_2;
        let drop = LiquidRegion {
            name: "drop".to_owned(),
            fluid: FluidName::Liquid,
            region: Region::Sphere { centre: Vector::ZERO, diameter: 1e-3 },
            placement: Placement::AboveBed { height: 2e-3, to_bottom: false, offset: [0.0; 2] },
            velocity: Vector::new(slant, 0.0, -slant),
            drop_velocity: DropVelocity::Mass,
            allow_touching_grains: false,
        };
        drop.meets_bed([5e-3, 5e-3], Vector::new(0.0, 0.0, -gravity)).map(|place| 1e3 * place[0])
    }

    #[test]
    fn a_slow_drop_that_slants_meets_the_bed_sooner_than_along_a_straight_line() {
        let assert_near = |found: Option<Real>, wanted: Real| {
            assert!(found.is_some_and(|found| (found - wanted).abs() < 1e-9), "{found:?}, not {wanted}");
        };
        for speed in [0.1, 4.5] {
            let v = speed * std::f64::consts::FRAC_1_SQRT_2;
            let time = ((v * v + 2.0 * 9.8 * 2e-3).sqrt() - v) / 9.8;
            assert_near(met(speed, 9.8), 5.0 + 1e3 * v * time);
            // Along a straight line without gravity.
            assert_near(met(speed, 0.0), 7.0);
        }
        // Half of the way straight on, and nearly all of it.
        assert!(met(0.1, 9.8).is_some_and(|x| x < 6.1) && met(4.5, 9.8).is_some_and(|x| x > 6.99));
        // Gravity that turns it round before.
        assert_eq!(met(0.1, -9.8), None);
    }
}
