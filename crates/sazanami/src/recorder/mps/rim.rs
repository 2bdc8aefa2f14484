//! The rim of an open tank: its walls end there, yet water beside them is kept in the box at any height.

use sazanami_numerics::Real;
use sazanami_observe::ripples::SurfaceProfile;

use super::gathered::Water;
use crate::case::meaning::{BoundarySide, Case};

/// The rim of an open tank with walls, and the water above it.
#[derive(Clone, Copy, Debug)]
pub(super) struct Rim {
    /// Its height \[m].
    height: Real,
    /// Places on x1 that are beside no wall \[m]; beyond its ends if all are.
    free: [Real; 2],
    /// Fluid particles above it beside walls, those isolated ones left out, as measured last.
    pub above: usize,
    /// Level of the water beside walls as measured last \[m], if there is any.
    pub level: Option<Real>,
}

impl Rim {
    /// The rim of a tank whose particles interact within `cutoff` \[m]; none if it is closed, or has no walls that water
    /// could stand at.
    pub fn of(case: &Case, cutoff: Real) -> Option<Self> {
        let has_wall = |d: usize| case.boundary[d].iter().any(BoundarySide::is_wall);
        let (lower, upper) = (case.domain.lower, case.domain.upper);
        let [left, right] = case.boundary[0].map(|side| side.is_wall());
        let free = match has_wall(1) {
            true => [Real::INFINITY, Real::NEG_INFINITY],
            false if !left && !right => return None,
            false => [
                if left { lower.x + cutoff } else { Real::NEG_INFINITY },
                if right { upper.x - cutoff } else { Real::INFINITY },
            ],
        };
        case.boundary[2][1].is_open().then_some(Self { height: upper.z, free, above: 0, level: None })
    }

    /// Measures the water and its surface.
    pub fn measure(&mut self, water: &Water, surface: &SurfaceProfile) {
        let [first, last] = self.free;
        let is_beside = |x: Real| !(first..=last).contains(&x);
        let is_above = |n: &usize| {
            let place = water.position[*n];
            !water.splash[*n] && place.z > self.height && is_beside(place.x)
        };
        self.above = (0..water.position.len()).filter(is_above).count();
        self.level = surface.points().filter(|[x, _]| is_beside(*x)).map(|[_, z]| z).reduce(Real::max);
    }

    /// Height of the water beside walls above the rim \[m], if it is higher.
    pub fn excess(&self) -> Option<Real> {
        self.level.map(|level| level - self.height).filter(|&excess| excess > 0.0)
    }
}

#[cfg(test)]
mod tests {
    use sazanami_numerics::Vector;

    use super::*;

    #[test]
    fn water_above_the_rim_counts_beside_walls_and_unless_it_flies() {
        let mut rim = Rim { height: 0.01, free: [-0.02, 0.02], above: 0, level: None };
        let places = [[-0.025, 0.011], [0.0, 0.015], [0.024, 0.012], [0.025, 0.009]];
        let mut water = Water {
            position: places.iter().map(|&[x, z]| Vector::new(x, 0.0, z)).collect(),
            splash: vec![false; 4],
            ..Water::default()
        };
        let level = |heights: [Real; 5]| SurfaceProfile::complete(-0.025, 0.0125, heights);
        rim.measure(&water, &level([0.0115, 0.013, 0.016, 0.012, 0.0095]));
        assert_eq!((rim.above, rim.level), (2, Some(0.0115)));
        assert!((rim.excess().unwrap() - 0.0015).abs() < 1e-12);
        water.splash[0] = true;
        rim.measure(&water, &level([0.0099, 0.013, 0.016, 0.012, 0.0095]));
        assert_eq!((rim.above, rim.excess()), (1, None));
        // With walls along the tank every place is beside one.
        rim.free = [Real::INFINITY, Real::NEG_INFINITY];
        rim.measure(&water, &level([0.0099, 0.013, 0.016, 0.012, 0.0095]));
        assert_eq!((rim.above, rim.level), (2, Some(0.016)));
    }
}
