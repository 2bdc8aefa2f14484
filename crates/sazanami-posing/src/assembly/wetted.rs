//! Liquids where they lie as a run begins, and the grains that lie in them.

use sazanami_numerics::geometry::Region;
use sazanami_numerics::{Real, Vector};

use super::fluid::origin_of;
use crate::case::meaning::{Case, FluidName, LiquidRegion, Placement};

/// Coordinates, over the radius of a ball, of the places in it that stand for its volume: those of their products that lie within.
const PLACES: [Real; 4] = [-0.75, -0.25, 0.25, 0.75];
/// Part of a length that is rounding.
const ROUNDED: Real = 1e-9;

/// Liquids and bubbles of a case where they lie at the start: later ones take the place of earlier ones.
pub struct PlacedLiquids {
    regions: Vec<(Region, FluidName)>,
    /// Lower corner of the box \[m], and its edges along which it repeats; infinite along others.
    lower: Vector,
    periods: Vector,
    /// Places in a ball of radius 1.
    ball: Vec<Vector>,
}

impl PlacedLiquids {
    /// Those of a case whose bed reaches up to `bed_height` \[m].
    #[must_use]
    pub fn of(case: &Case, bed_height: Real) -> Self {
        let regions = case.liquids.iter().map(|liquid| {
            let origin = origin_of(liquid, case.bed.axis, bed_height);
            (case.region_of(liquid, origin).geometry(), liquid.fluid)
        });
        let places =
            PLACES.iter().flat_map(|&x| PLACES.iter().flat_map(move |&y| PLACES.map(|z| Vector::new(x, y, z))));
        let (extent, repeats) = (case.domain.extent(), case.periodic());
        Self {
            regions: regions.collect(),
            lower: case.domain.lower,
            periods: Vector::from_array([0, 1, 2].map(|d| if repeats[d] { extent[d] } else { Real::INFINITY })),
            ball: places.filter(|x| x.length_squared() < 1.0).collect(),
        }
    }

    /// Number of the liquid at a place \[m], beyond a periodic side too; `None` in gas.
    #[must_use]
    pub fn at(&self, x: Vector) -> Option<usize> {
        let within = |d: usize| match self.periods[d] {
            period if period.is_finite() => x[d] - period * ((x[d] - self.lower[d]) / period).floor(),
            _ => x[d],
        };
        let x = Vector::from_array([0, 1, 2].map(within));
        let number = self.regions.iter().rposition(|(region, _)| region.contains(x))?;
        (self.regions[number].1 == FluidName::Liquid).then_some(number)
    }

    /// Part of a ball of this centre and diameter \[m] that lies in each of the liquids, about.
    pub(crate) fn parts(&self, centre: Vector, diameter: Real) -> impl Iterator<Item = (usize, Real)> {
        let found = self.ball.iter().filter_map(move |&x| self.at(centre + 0.5 * diameter * x));
        found.map(|number| (number, 1.0 / self.ball.len() as Real))
    }

    /// Part of a ball of this centre and diameter \[m] that lies in liquid, about.
    #[must_use]
    pub fn part(&self, centre: Vector, diameter: Real) -> Real {
        self.parts(centre, diameter).map(|(_, part)| part).sum()
    }
}

/// Whether a liquid hangs in the air: it lies more than a particle above the floor, the bed, and all liquids below it. What lists of
/// grains bear is not known here.
///
/// Liquids above the bed are put so above `bed_height`; for others the bed reaches up to `top` \[m].
#[must_use]
pub fn hangs(case: &Case, n: usize, bed_height: Real, top: Real) -> bool {
    if case.liquids[n].fluid != FluidName::Liquid || case.resting_gravity().z >= 0.0 || case.periodic()[2] {
        return false;
    }
    let near = case.moving_particles().spacing * (1.0 + ROUNDED);
    let bounds = |liquid: &LiquidRegion| {
        case.region_of(liquid, origin_of(liquid, case.bed.axis, bed_height)).geometry().bounds()
    };
    let (low, high) = bounds(&case.liquids[n]);
    let meets = |other: &LiquidRegion| {
        let (from, to) = bounds(other);
        from.z < low.z && (low - near).cmple(to).all() && from.cmple(high + near).all()
    };
    let bed = match case.liquids[n].placement {
        Placement::AboveBed { .. } => bed_height,
        Placement::Absolute(_) => top,
    };
    let others = case.liquids.iter().enumerate().filter(|(m, other)| *m != n && other.fluid == FluidName::Liquid);
    low.z > bed.max(case.domain.lower.z) + near && !others.map(|(_, other)| other).any(meets)
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;

    #[test]
    fn a_ball_lies_in_liquid_as_far_as_the_level_says_and_not_in_a_bubble() {
        let text = "solver = \"mps\"\n[domain]\nsize = [\"8 mm\", \"8 mm\", \"12 mm\"]\n[run]\nuntil = \"1 ms\"\n\
                    [particles]\nspacing = \"1 mm\"\n[[liquid]]\nregion.box = { lower = [\"0 mm\", \"0 mm\", \"0 mm\"], \
                    upper = [\"8 mm\", \"8 mm\", \"6 mm\"] }\n[[liquid]]\nfluid = \"gas\"\nregion.sphere = { diameter = \
                    \"3 mm\", centre = [\"2 mm\", \"2 mm\", \"2 mm\"] }\n";
        let case = sazanami_case::parse(Path::new("c.toml"), text, &[]).expect("the case is complete").case;
        let liquids = PlacedLiquids::of(&case, 0.0);
        let part = |x: Real, z: Real| liquids.part(1e-3 * Vector::new(x, x, z), 1e-3);
        assert_eq!([part(6.0, 3.0), part(6.0, 6.0), part(6.0, 7.0), part(2.0, 2.0)], [1.0, 0.5, 0.0, 0.0]);
        // A cap of a quarter of the diameter has 0.156 of the volume; negative control: that of the whole ball.
        assert!((part(6.0, 6.25) - 0.156).abs() < 0.05 && liquids.at(1e-3 * Vector::new(6.0, 6.0, 6.25)).is_none());
        // Across a side: a wall cuts what lies in liquid, a periodic side does not.
        assert_eq!([part(8.0, 3.0), part(0.0, 3.0)], [0.25, 0.25]);
        let sides = ["boundary.x1=periodic", "boundary.x2=periodic"].map(str::to_owned);
        let periodic = sazanami_case::parse(Path::new("c.toml"), text, &sides).expect("the case is complete").case;
        let liquids = PlacedLiquids::of(&periodic, 0.0);
        let part = |x: Real, z: Real| liquids.part(1e-3 * Vector::new(x, x, z), 1e-3);
        assert_eq!([part(8.0, 3.0), part(0.0, 3.0), part(8.0, 6.0)], [1.0, 1.0, 0.5]);
    }
}
