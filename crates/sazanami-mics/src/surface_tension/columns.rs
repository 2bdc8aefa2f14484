//! Heights in the nine columns around a cell, and their curvature.

use sazanami_numerics::{Real, Vector};

use super::fit::Paraboloid;
use super::heights::Heights;

/// Weight of the rows beside the middle one in second differences.
const ASIDE: Real = 0.2;
/// Fewest columns of the nine that tell a curvature.
const FEWEST: usize = 6;

/// Weights of the columns in a fit.
const WEIGHTS: [[Real; 3]; 3] = [[1.0, 2.0, 1.0], [2.0, 8.0, 2.0], [1.0, 2.0, 1.0]];

/// Heights along a direction in the column through a cell and in the eight around it.
pub(super) struct HeightColumns {
    direction: usize,
    /// Whether the liquid is below.
    up: bool,
    /// Over the two other directions, from the centre of the cell, in cells; that of the middle column is known.
    heights: [[Option<Real>; 3]; 3],
}

impl HeightColumns {
    /// Those around the cell at `at` along `direction`, with the liquid below if `up`; `None` if its own has no height.
    pub fn around(heights: &Heights, at: usize, direction: usize, up: bool, strides: [isize; 3]) -> Option<Self> {
        let middle = heights.in_column(direction, at, up, 0.0)?;
        let [e, f] = across(direction).map(|edge| strides[edge]);
        let heights = [-1, 0, 1].map(|a| {
            [-1, 0, 1].map(|b| {
                let column = (at as isize + a * e + b * f) as usize;
                if (a, b) == (0, 0) { Some(middle) } else { heights.in_column(direction, column, up, middle) }
            })
        });
        Some(Self { direction, up, heights })
    }

    /// How many columns have a height.
    pub fn count(&self) -> usize {
        self.heights.iter().flatten().flatten().count()
    }

    /// Curvature from all nine by centred differences, positive where the liquid is convex [1/m]; `None` if not all have a height.
    pub fn curvature(&self, spacing: Vector) -> Option<Real> {
        let mut h = [[0.0; 3]; 3];
        for (h, heights) in h.iter_mut().flatten().zip(self.heights.iter().flatten()) {
            *h = (*heights)?;
        }
        let [e, f] = across(self.direction).map(|edge| spacing[edge]);
        let [ed, fd] = [e, f].map(|edge| spacing[self.direction] / edge);
        let along = |h: [[Real; 3]; 3]| h.map(|[low, middle, high]| high - 2.0 * middle + low);
        let mean = |[low, middle, high]: [Real; 3]| (middle + ASIDE * (low + high)) / (1.0 + 2.0 * ASIDE);
        let turned: [[Real; 3]; 3] = std::array::from_fn(|b| std::array::from_fn(|a| h[a][b]));
        let h_e = 0.5 * ed * (h[2][1] - h[0][1]);
        let h_f = 0.5 * fd * (h[1][2] - h[1][0]);
        let h_ee = ed / e * mean(along(turned));
        let h_ff = fd / f * mean(along(h));
        let h_ef = 0.25 * ed / f * (h[2][2] - h[2][0] - h[0][2] + h[0][0]);
        let slope = 1.0 + h_e * h_e + h_f * h_f;
        let bend = h_ee * (1.0 + h_f * h_f) + h_ff * (1.0 + h_e * h_e) - 2.0 * h_ef * h_e * h_f;
        Some(self.signed(-bend / (slope * slope.sqrt())))
    }

    /// Curvature of the paraboloid nearest to the heights that there are, with weights 8, 2 and 1 in the middle, beside it and in the
    /// corners [1/m]; `None` if they do not tell. Much weight in the middle: what stands out there is pulled back.
    pub fn fit(&self, spacing: Vector) -> Option<Real> {
        if self.count() < FEWEST {
            return None;
        }
        let [e, f] = across(self.direction);
        let mut fit =
            Paraboloid::in_frame(Vector::ZERO, [e, f, self.direction].map(|d| Vector::AXES[d]), spacing.min_element());
        let middle = self.heights[1][1]?;
        for (a, heights) in self.heights.iter().enumerate() {
            for (b, height) in heights.iter().enumerate() {
                if let Some(height) = height {
                    let mut point = Vector::ZERO;
                    (point[e], point[f]) = (a as Real - 1.0, b as Real - 1.0);
                    point[self.direction] = height - middle;
                    fit.add(point * spacing, WEIGHTS[a][b]);
                }
            }
        }
        fit.curvature().map(|curvature| self.signed(curvature))
    }

    /// A curvature that is positive where what is below the heights is convex, as that of the liquid.
    fn signed(&self, curvature: Real) -> Real {
        if self.up { curvature } else { -curvature }
    }
}

/// The two other directions.
fn across(direction: usize) -> [usize; 2] {
    [(direction + 1) % 3, (direction + 2) % 3]
}

#[cfg(test)]
mod tests {
    use super::*;

    fn quadric(missing: &[(usize, usize)]) -> HeightColumns {
        let heights = std::array::from_fn(|a| {
            std::array::from_fn(|b| {
                let (x, y) = (a as Real - 1.0, b as Real - 1.0);
                let height = 0.1 + 0.7 * x - 0.4 * y - 0.2 * x * x + 0.05 * x * y - 0.1 * y * y;
                (!missing.contains(&(a, b))).then_some(height)
            })
        });
        HeightColumns { direction: 2, up: true, heights }
    }

    #[test]
    fn six_columns_tell_the_curvature_of_a_quadric_as_nine_do() {
        let spacing = Vector::splat(0.5);
        let all = quadric(&[]).curvature(spacing).unwrap();
        let (h_x, h_y, slope) = (0.7, -0.4, 1.0 + 0.49 + 0.16_f64);
        let bend = -0.4 * (1.0 + h_y * h_y) - 0.2 * (1.0 + h_x * h_x) - 2.0 * 0.05 * h_x * h_y;
        assert!((all + bend / slope.powf(1.5) / 0.5).abs() < 1e-12, "{all}");
        let some = quadric(&[(0, 0), (2, 2), (2, 0)]);
        assert!((some.fit(spacing).unwrap() - all).abs() < 1e-12 && some.curvature(spacing).is_none());
        let liquid_above = HeightColumns { up: false, ..quadric(&[(0, 0)]) };
        assert!((liquid_above.fit(spacing).unwrap() + all).abs() < 1e-12);
        // Negative controls: five are too few, and a paraboloid of its own has another.
        assert!(quadric(&[(0, 0), (2, 2), (2, 0), (0, 2)]).fit(spacing).is_none());
        assert!((all + bend / 0.5).abs() > 0.1);
    }
}
