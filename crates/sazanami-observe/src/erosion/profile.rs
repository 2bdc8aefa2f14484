//! The smoothed bed surface against the distance from the impact axis.

use std::f64::consts::FRAC_1_SQRT_2;

use sazanami_numerics::Real;

use super::surface_grains::GrainTop;
use crate::Horizontal;

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

    #[test]
    fn holes_are_filled_from_both_sides() {
        let profile = Profile { layer: 1.0, heights: vec![None, Some(1.0), None, None, Some(4.0), None] };
        assert_eq!(profile.filled(), [1.0, 1.0, 2.0, 3.0, 4.0, 4.0]);
        assert!(Profile { layer: 1.0, heights: vec![None; 3] }.filled().is_empty());
    }
}
