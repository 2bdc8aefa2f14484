//! The smoothed bed surface against the distance from the impact axis.

use std::f64::consts::FRAC_1_SQRT_2;

use sazanami_numerics::{Real, Vector};

use super::surface_grains::GrainTop;
use crate::Horizontal;
use crate::height_map::HeightMap;

/// Layers of a smooth profile in a bandwidth.
const LAYERS_IN_BANDWIDTH: Real = 32.0;
/// Bandwidths after which the weight of the regression is nothing.
const REACH: Real = 5.0;
/// Rings with grains that a local parabola needs within a bandwidth.
const LEAST_RINGS: usize = 3;

/// Mean heights of circular layers about the axis.
#[derive(Clone, Debug, PartialEq)]
pub struct Profile {
    /// Thickness of a layer \[m].
    pub layer: Real,
    /// Mean height of each layer \[m], innermost first; `None` where there is no grain.
    pub heights: Vec<Option<Real>>,
}

impl Profile {
    /// Mean radius of a layer \[m].
    #[must_use]
    pub fn radius(&self, layer: usize) -> Real {
        (layer as Real + 0.5) * self.layer
    }

    /// Area of a layer [m^2].
    #[must_use]
    pub fn area(&self, layer: usize) -> Real {
        std::f64::consts::PI * (2.0 * layer as Real + 1.0) * self.layer * self.layer
    }

    /// Heights \[m] with empty layers filled linearly from their neighbours; empty if no layer has a height.
    #[must_use]
    pub fn filled(&self) -> Vec<Real> {
        let known: Vec<(usize, Real)> =
            self.heights.iter().enumerate().filter_map(|(n, height)| height.map(|height| (n, height))).collect();
        if known.is_empty() {
            return Vec::new();
        }
        let between = |n: usize| {
            let after = known.partition_point(|&(m, _)| m < n);
            match (after.checked_sub(1).map(|before| known[before]), known.get(after)) {
                (_, Some(&(m, height))) if m == n => height,
                (Some((m, low)), Some(&(p, high))) => low + (high - low) * (n - m) as Real / (p - m) as Real,
                (Some((_, height)), None) => height,
                (None, first) => first.map_or(known[0].1, |&(_, height)| height),
            }
        };
        (0..self.heights.len()).map(between).collect()
    }

    /// Averages the tops of grains over square cells of width `cell`, then over layers of thickness
    /// `layer` out to `largest_radius` \[m].
    ///
    /// The axis is a corner of the cells; where the layers are so thin that the innermost one would
    /// then hold no cell centre, it is the centre of a cell.
    pub(super) fn of(tops: &[GrainTop], axis: Horizontal, cell: Real, layer: Real, largest_radius: Real) -> Self {
        let offset = if FRAC_1_SQRT_2 * cell < layer { 0.0 } else { 0.5 };
        let half = (largest_radius / cell).ceil() as isize + 1;
        let width = (2 * half + 1) as usize;
        let mut sums = vec![(0.0, 0_u32); width * width];
        for top in tops {
            let [i, j] = [top.x - axis[0], top.y - axis[1]].map(|x| (x / cell + offset).floor() as isize + half);
            if (0..width as isize).contains(&i) && (0..width as isize).contains(&j) {
                let sum = &mut sums[j as usize * width + i as usize];
                *sum = (sum.0 + top.height, sum.1 + 1);
            }
        }
        // A little slack, so that a radius of exactly n layers gives n of them.
        let mut layers = vec![(0.0, 0_u32); (largest_radius / layer * (1.0 + 1e-12)) as usize];
        for (at, &(sum, count)) in sums.iter().enumerate().filter(|(_, (_, count))| *count > 0) {
            let [x, y] = [at % width, at / width].map(|n| (n as isize - half) as Real + 0.5 - offset);
            if let Some(layer) = layers.get_mut((x.hypot(y) * cell / layer) as usize) {
                *layer = (layer.0 + sum / Real::from(count), layer.1 + 1);
            }
        }
        let heights = layers.iter().map(|&(sum, cells)| (cells > 0).then(|| sum / Real::from(cells))).collect();
        Self { layer, heights }
    }

    /// The height of `rings` in thin layers out to `largest_radius` \[m]: at each radius the value of the parabola in the radius
    /// that fits the rings best with Gaussian weights of width `bandwidth` \[m], the surface going on behind the axis as before it.
    pub(super) fn smooth(rings: &Rings, bandwidth: Real, largest_radius: Real) -> Self {
        let layer = smooth_layer(bandwidth);
        let count = (largest_radius / layer * (1.0 + 1e-12)) as usize;
        let heights = (0..count).map(|n| rings.height((n as Real + 0.5) * layer, bandwidth)).collect();
        Self { layer, heights }
    }
}

/// Thickness of the layers of a smooth profile of a bandwidth \[m].
pub(super) fn smooth_layer(bandwidth: Real) -> Real {
    bandwidth / LAYERS_IN_BANDWIDTH
}

/// Mean height of the bed seen from above, in rings one pixel wide about the axis.
pub(super) struct Rings {
    width: Real,
    /// Sum of the heights \[m] and number of the pixels of each ring.
    sums: Vec<(Real, u32)>,
}

impl Rings {
    /// The rings of a map about `axis`, out to `reach` \[m].
    pub fn of(map: &HeightMap, axis: Horizontal, reach: Real) -> Self {
        let width = map.spacing();
        let mut sums = vec![(0.0, 0); (reach / width) as usize + 1];
        let [columns, rows] = map.pixels();
        for (i, j) in (0..rows).flat_map(|j| (0..columns).map(move |i| (i, j))) {
            let [x, y] = map.centre(i, j);
            let ring = ((x - axis[0]).hypot(y - axis[1]) / width) as usize;
            if let (Some(sum), Some(height)) = (sums.get_mut(ring), map.height(i, j)) {
                *sum = (sum.0 + height, sum.1 + 1);
            }
        }
        Self { width, sums }
    }

    /// Height at a radius \[m] by a local parabola; `None` where too few rings hold grains.
    fn height(&self, radius: Real, bandwidth: Real) -> Option<Real> {
        // Sums of the weights times powers of the distance, and of these with the height.
        let (mut powers, mut heights, mut near) = ([0.0; 5], Vector::ZERO, 0);
        let within = [-REACH, REACH].map(|n| ((radius + n * bandwidth) / self.width) as usize);
        let within = within[0]..(within[1] + 1).min(self.sums.len());
        for (n, &(sum, count)) in within.clone().zip(&self.sums[within]).filter(|(_, (_, count))| *count > 0) {
            let ring = n as Real + 0.5;
            for place in [ring, -ring] {
                let t = (place * self.width - radius) / bandwidth;
                if t.abs() > REACH {
                    continue;
                }
                near += usize::from(t.abs() < 1.0);
                // Along the radius, all places weigh the same where the whole ring is seen.
                let weight = Real::from(count) / ring * (-0.5 * t * t).exp();
                let mean = sum / Real::from(count);
                let power = [1.0, t, t * t, t * t * t, t * t * t * t].map(|power| weight * power);
                powers.iter_mut().zip(power).for_each(|(sum, power)| *sum += power);
                heights += mean * Vector::new(power[0], power[1], power[2]);
            }
        }
        let column = |n: usize| Vector::new(powers[n], powers[n + 1], powers[n + 2]);
        let others = column(1).cross(column(2));
        (near >= LEAST_RINGS).then(|| heights.dot(others) / column(0).dot(others))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn top(x: Real, y: Real, height: Real) -> GrainTop {
        GrainTop { x, y, height }
    }

    #[test]
    fn a_cell_weighs_the_same_whatever_its_grains() {
        // Two grains in one cell, one in another cell of the innermost layer.
        let tops = [top(0.1, 0.1, 1.0), top(0.9, 0.2, 3.0), top(-0.5, 0.5, 5.0), top(-1.5, 0.5, 8.0)];
        let profile = Profile::of(&tops, [0.0, 0.0], 1.0, 1.0, 3.0);
        assert_eq!(profile.heights, [Some(3.5), Some(8.0), None]);
        assert_eq!(profile.filled(), [3.5, 8.0, 8.0]);
        assert_eq!(profile.radius(2), 2.5);
    }

    #[test]
    fn layers_thinner_than_cells_still_have_a_centre() {
        let tops: Vec<_> = (-40_i32..40).map(|n| top(Real::from(n) * 0.1 + 0.05, 0.01, Real::from(n.abs()))).collect();
        let profile = Profile::of(&tops, [0.0, 0.0], 1.0, 0.4, 3.0);
        assert!(profile.heights[0].is_some());
        assert_eq!(profile.heights.len(), 7);
        assert_eq!(profile.heights[1], None);
        let filled = profile.filled();
        assert!((filled[1] - 0.5 * (filled[0] + filled[2])).abs() < 1e-12);
    }

    /// A map over 12 mm x 12 mm about the origin.
    fn rings(pixel: Real, height: impl Fn(Real) -> Real) -> Rings {
        let sums = (0..(6.0 / pixel) as usize).map(|n| {
            let r = (n as Real + 0.5) * pixel;
            (height(r) * (n as Real + 1.0), n as u32 + 1)
        });
        Rings { width: pixel, sums: sums.collect() }
    }

    #[test]
    fn a_smooth_profile_keeps_a_paraboloid_and_its_vertex() {
        let paraboloid = |r: Real| 2.0 + 0.3 * r * r;
        let profile = Profile::smooth(&rings(0.05, paraboloid), 0.5, 5.0);
        assert_eq!(profile.heights.len(), 320);
        for (n, height) in profile.heights.iter().enumerate() {
            assert!((height.unwrap() - paraboloid(profile.radius(n))).abs() < 1e-9, "{n}");
        }
        // Negative control: what is no parabola is smoothed.
        let edge = Profile::smooth(&rings(0.05, |r| if r < 2.5 { 0.0 } else { 1.0 }), 0.5, 5.0);
        assert!((edge.heights[159].unwrap() - 0.5).abs() < 0.03 && edge.heights[130].unwrap() > 0.02);
    }

    #[test]
    fn no_height_is_made_up_where_no_grain_is_seen() {
        let mut hollow = rings(0.05, |_| 1.0);
        hollow.sums[..60].fill((0.0, 0));
        let profile = Profile::smooth(&hollow, 0.4, 5.0);
        assert_eq!(profile.heights[0], None);
        assert!((profile.filled()[0] - 1.0).abs() < 1e-9);
    }

    #[test]
    fn holes_are_filled_from_both_sides() {
        let profile = Profile { layer: 1.0, heights: vec![None, Some(1.0), None, None, Some(4.0), None] };
        assert_eq!(profile.filled(), [1.0, 1.0, 2.0, 3.0, 4.0, 4.0]);
        assert!(Profile { layer: 1.0, heights: vec![None; 3] }.filled().is_empty());
    }
}
