//! A body of liquid known by its share of the cells of a grid, with a velocity in each.
//!
//! Its surface is where the quadratic B-spline of the shares has one value: smooth, and such that the volume within it is that of the
//! cells. The velocity is the mean of the cells about a place, linear in the distance, by the liquid in them. Where the grid is one cell thick
//! the body is the same all along that direction, without an end.

use std::sync::Arc;

use crate::{Quaternion, Real, Vector};

/// Samples along a cell's edge by which the surface's value is found; of a body without an end, whose volume is not corrected
/// afterwards, along the edges across it.
const SAMPLES: usize = 4;
const SAMPLES_ACROSS: usize = 64;
/// Share from which on a cell counts, and by which it is less than full where it counts as full.
const LEAST: Real = 1e-6;

/// A body of liquid about its centre of mass.
#[derive(Clone, Debug, PartialEq)]
pub struct SampledLiquid {
    cells: [usize; 3],
    /// Directions along which it has no end.
    endless: [bool; 3],
    /// Centre of the first cell from the centre of mass \[m].
    first: Vector,
    spacing: Vector,
    fraction: Vec<Real>,
    /// Relative to the mean of the liquid [m/s].
    velocity: Vec<Vector>,
    volume: Real,
    /// Value of the spline on the surface.
    threshold: Real,
    /// Points of the surface from the centre of mass \[m].
    surface: Vec<Vector>,
}

/// A body where it lies.
#[derive(Clone, Debug, PartialEq)]
pub struct PlacedLiquid {
    /// The body.
    pub body: Arc<SampledLiquid>,
    /// Where its centre of mass lies \[m].
    pub centre: Vector,
    /// Its rotation.
    pub orientation: Quaternion,
}

/// Cells of a body, x1 fastest.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct SampledCells {
    /// Cells along each direction.
    pub cells: [usize; 3],
    /// Edges of a cell \[m].
    pub spacing: Vector,
    /// Liquid in each cell over its volume.
    pub fraction: Vec<Real>,
    /// Velocity in each cell [m/s].
    pub velocity: Vec<Vector>,
}

impl SampledCells {
    /// Adds the image of the cells in the lower side along direction `d`.
    #[must_use]
    pub fn mirrored(&self, d: usize) -> Self {
        let mut cells = self.cells;
        cells[d] *= 2;
        let half = self.cells[d];
        let mut image = Self { cells, spacing: self.spacing, ..Self::default() };
        for n in 0..cells.iter().product() {
            let mut index = index_of(cells, n);
            let is_image = index[d] < half;
            index[d] = if is_image { half - 1 - index[d] } else { index[d] - half };
            let from = place_of(self.cells, index);
            let mut velocity = self.velocity[from];
            if is_image {
                velocity[d] = -velocity[d];
            }
            image.fraction.push(self.fraction[from]);
            image.velocity.push(velocity);
        }
        image
    }
}

fn index_of(cells: [usize; 3], n: usize) -> [usize; 3] {
    [n % cells[0], n / cells[0] % cells[1], n / (cells[0] * cells[1])]
}

fn place_of(cells: [usize; 3], [i, j, k]: [usize; 3]) -> usize {
    i + cells[0] * (j + cells[1] * k)
}

impl SampledLiquid {
    /// The liquid in `all` cells; `None` if there is none, or too little for a surface between centres of cells.
    ///
    /// # Panics
    /// If the cells are fewer than their number along the edges.
    #[must_use]
    pub fn new(all: &SampledCells) -> Option<Self> {
        let whole = all.cells.iter().product::<usize>();
        assert!(all.fraction.len() == whole && all.velocity.len() == whole, "a value for each cell");
        let share = |n: usize| match all.fraction[n] {
            fraction if fraction < LEAST => 0.0,
            fraction if fraction > 1.0 - LEAST => 1.0,
            fraction => fraction,
        };
        let centre = |n: usize| Vector::from_array(index_of(all.cells, n).map(|i| i as Real + 0.5)) * all.spacing;
        let filled = || (0..whole).filter(|&n| share(n) > 0.0);
        let sum: Real = filled().map(share).sum();
        if sum == 0.0 {
            return None;
        }
        let mean = |of: &dyn Fn(usize) -> Vector| filled().map(|n| share(n) * of(n)).sum::<Vector>() / sum;
        let (middle, carried) = (mean(&centre), mean(&|n| all.velocity[n]));
        let mut range = [[usize::MAX, 0]; 3];
        for n in filled() {
            for (range, i) in range.iter_mut().zip(index_of(all.cells, n)) {
                *range = [range[0].min(i), range[1].max(i)];
            }
        }
        // A layer around, so that the surface lies between cells.
        let endless = all.cells.map(|n| n == 1);
        let around = endless.map(|endless| usize::from(!endless));
        let cells = [0, 1, 2].map(|d| range[d][1] - range[d][0] + 1 + 2 * around[d]);
        let from = |n: usize| {
            let index = index_of(cells, n);
            let along = |d: usize| (range[d][0] + index[d]).checked_sub(around[d]).filter(|&i| i < all.cells[d]);
            let [i, j, k] = [0, 1, 2].map(along);
            Some(place_of(all.cells, [i?, j?, k?]))
        };
        let count = cells.iter().product();
        let lowest = [0, 1, 2].map(|d| range[d][0] as Real + 0.5 - around[d] as Real);
        let first = Vector::from_array(lowest) * all.spacing - middle;
        let mut body = Self {
            cells,
            endless,
            first,
            spacing: all.spacing,
            fraction: (0..count).map(|n| from(n).map_or(0.0, share)).collect(),
            velocity: (0..count).map(|n| from(n).map_or(Vector::ZERO, |n| all.velocity[n] - carried)).collect(),
            volume: sum * all.spacing.element_product(),
            threshold: 0.5,
            surface: Vec::new(),
        };
        body.threshold = body.value_on_surface(sum);
        body.surface = body.points_of_surface();
        (!body.surface.is_empty()).then_some(body)
    }

    /// Volume \[m^3]; infinite of a body without an end.
    #[must_use]
    pub fn volume(&self) -> Real {
        if self.endless.contains(&true) { Real::INFINITY } else { self.volume }
    }

    /// Share of a cell, none beyond the grid.
    fn share(&self, index: [isize; 3]) -> Real {
        self.place(index).map_or(0.0, |at| self.fraction[at])
    }

    fn place(&self, index: [isize; 3]) -> Option<usize> {
        let index = [0, 1, 2].map(|d| if self.endless[d] { 0 } else { index[d] });
        let within = (0..3).all(|d| (0..self.cells[d] as isize).contains(&index[d]));
        within.then(|| place_of(self.cells, index.map(|i| i as usize)))
    }

    /// Value of the spline at a place from the centre of mass.
    fn value(&self, place: Vector) -> Real {
        let scaled = (place - self.first) / self.spacing;
        let nearest = scaled.round();
        let weights =
            (scaled - nearest).to_array().map(|s| [0.5 * (0.5 - s).powi(2), 0.75 - s * s, 0.5 * (0.5 + s).powi(2)]);
        let middle = nearest.to_array().map(|i| i as isize);
        let mut sum = 0.0;
        for c in 0..3 {
            for b in 0..3 {
                for a in 0..3 {
                    let index = [a, b, c].map(|n| n as isize - 1);
                    let share = self.share([0, 1, 2].map(|d| middle[d] + index[d]));
                    sum += weights[0][a] * weights[1][b] * weights[2][c] * share;
                }
            }
        }
        sum
    }

    /// The value within whose surface the volume of `sum` cells lies.
    fn value_on_surface(&self, sum: Real) -> Real {
        let across = if self.endless.contains(&true) { SAMPLES_ACROSS } else { SAMPLES };
        let samples = self.endless.map(|endless| if endless { 1 } else { across });
        let per_cell = samples.iter().product::<usize>();
        let (mut values, mut wanted) = (Vec::new(), sum * per_cell as Real);
        for n in 0..self.fraction.len() {
            let index = index_of(self.cells, n);
            let [low, high] = self.least_and_most(index.map(|i| [i as isize - 1, i as isize + 1]));
            if low == high {
                wanted -= low * per_cell as Real;
                continue;
            }
            let centre = self.first + Vector::from_array(index.map(|i| i as Real)) * self.spacing;
            let sample = |n: usize| {
                let place = index_of(samples, n);
                Vector::from_array([0, 1, 2].map(|d| (place[d] as Real + 0.5) / samples[d] as Real - 0.5))
            };
            values.extend((0..per_cell).map(|n| self.value(centre + sample(n) * self.spacing)));
        }
        values.sort_unstable_by(|a, b| b.total_cmp(a));
        let last = (wanted.round() as usize).clamp(1, values.len().max(1)) - 1;
        values.get(last).copied().unwrap_or(0.5)
    }

    /// Least and largest share of the cells in a block.
    fn least_and_most(&self, block: [[isize; 2]; 3]) -> [Real; 2] {
        let mut found = [Real::INFINITY, Real::NEG_INFINITY];
        let [[i0, i1], [j0, j1], [k0, k1]] = block;
        for k in k0..=k1 {
            for j in j0..=j1 {
                for i in i0..=i1 {
                    let share = self.share([i, j, k]);
                    found = [found[0].min(share), found[1].max(share)];
                }
            }
        }
        found
    }

    /// Where lines between centres of neighbouring cells pass the surface.
    fn points_of_surface(&self) -> Vec<Vector> {
        let centre = |index: [usize; 3]| self.first + Vector::from_array(index.map(|i| i as Real)) * self.spacing;
        let values: Vec<Real> = (0..self.fraction.len()).map(|n| self.value(centre(index_of(self.cells, n)))).collect();
        let mut points = Vec::new();
        for (n, here) in values.iter().map(|value| value - self.threshold).enumerate() {
            let index = index_of(self.cells, n);
            for d in (0..3).filter(|&d| index[d] + 1 < self.cells[d]) {
                let mut next = index;
                next[d] += 1;
                let there = values[place_of(self.cells, next)] - self.threshold;
                if (here >= 0.0) != (there >= 0.0) {
                    points.push(centre(index).lerp(centre(next), here / (here - there)));
                }
            }
        }
        points
    }
}

impl PlacedLiquid {
    fn local(&self, point: Vector) -> Vector {
        self.orientation.inverse() * (point - self.centre)
    }

    /// The part of a local vector across the directions without an end.
    fn across(&self, vector: Vector) -> Vector {
        let [x, y, z] = self.body.endless.map(|endless| if endless { 0.0 } else { 1.0 });
        vector * Vector::new(x, y, z)
    }

    /// A length that is negative within the body and positive outside, never larger than the distance to the surface \[m].
    pub(super) fn level(&self, point: Vector) -> Real {
        // The spline rises by one in a cell at most along each direction.
        let steepest = self.body.spacing.min_element() / Real::sqrt(3.0);
        (self.body.threshold - self.body.value(self.local(point))) * steepest
    }

    pub(super) fn contains(&self, point: Vector) -> bool {
        self.body.value(self.local(point)) >= self.body.threshold
    }

    /// Cautiously: by half a cell.
    pub(super) fn touches_ball(&self, centre: Vector, radius: Real) -> bool {
        let (centre, reach) = (self.local(centre), radius + 0.5 * self.body.spacing.max_element());
        self.body.surface.iter().any(|&point| self.across(point - centre).length_squared() <= reach * reach)
    }

    pub(super) fn bounds(&self) -> (Vector, Vector) {
        let points = self.body.surface.iter().map(|&point| self.centre + self.orientation * point);
        let (lower, upper) =
            points.fold((Vector::INFINITY, Vector::NEG_INFINITY), |(lower, upper), x| (lower.min(x), upper.max(x)));
        // The surface may stand out between the lines on which its points are.
        let margin = 0.1 * self.body.spacing.max_element();
        let ends = (0..3).filter(|&d| self.body.endless[d]).map(|d| (self.orientation * Vector::AXES[d]).abs());
        // A turn by a right angle leaves rounding in the other directions.
        let reach = ends.fold(Vector::splat(margin), |reach, along| {
            Vector::select(along.cmpgt(Vector::splat(1e-12)), Vector::INFINITY, reach)
        });
        (lower - reach, upper + reach)
    }

    /// Least and largest value that the spline can have in a box with this centre and these half edges, less that on the surface.
    pub(super) fn values_in(&self, centre: Vector, half: Vector) -> [Real; 2] {
        let turned = crate::Matrix::from_quat(self.orientation.inverse());
        let half = Vector::from_array([0, 1, 2].map(|row| turned.row(row).abs().dot(half)));
        let middle = self.local(centre) - self.body.first;
        let [low, high] = [middle - half, middle + half].map(|x| (x / self.body.spacing).round().to_array());
        // Further cells are empty.
        let end = |d: usize, i: Real| (i as isize).clamp(-2, self.body.cells[d] as isize + 1);
        let block = [0, 1, 2].map(|d| [end(d, low[d] - 1.0), end(d, high[d] + 1.0)]);
        self.body.least_and_most(block).map(|value| value - self.body.threshold)
    }

    /// Velocity of the liquid at a point beside that of the whole, none where there is no liquid about it [m/s].
    pub(super) fn velocity(&self, point: Vector) -> Vector {
        let scaled = (self.local(point) - self.body.first) / self.body.spacing;
        let (lower, part) = (scaled.floor().to_array().map(|i| i as isize), (scaled - scaled.floor()).to_array());
        let (mut sum, mut liquid) = (Vector::ZERO, 0.0);
        for corner in 0..8 {
            let upper = [0, 1, 2].map(|d| corner >> d & 1);
            let Some(at) = self.body.place([0, 1, 2].map(|d| lower[d] + upper[d])) else { continue };
            let weight = (0..3).map(|d| if upper[d] == 1 { part[d] } else { 1.0 - part[d] }).product::<Real>();
            liquid += weight * self.body.fraction[at];
            sum += weight * self.body.fraction[at] * self.body.velocity[at];
        }
        if liquid > LEAST { self.orientation * (sum / liquid) } else { Vector::ZERO }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::{Region, RegionFractions, Wave};
    use crate::grid::Grid;

    /// An ellipsoid in 20 x 20 x 20 cells that turns about x3 as it moves along x1.
    fn cells(semi_axes: Vector, half: bool) -> (SampledCells, Real) {
        let upper = Vector::new(1.0, 1.0, 1.0);
        let lower = if half { Vector::new(0.0, -1.0, -1.0) } else { -upper };
        let grid = Grid::new([if half { 10 } else { 20 }, 20, 20], lower, upper);
        let region = Region::Spheroid { centre: Vector::ZERO, semi_axes, orientation: Quaternion::IDENTITY };
        let fractions = RegionFractions::along_normals(&region, &grid, 8);
        let mut cells = SampledCells { cells: grid.cells, spacing: grid.spacing, ..SampledCells::default() };
        for n in 0..grid.len() {
            let [i, j, k] = index_of(grid.cells, n).map(|i| i as isize);
            let x = grid.centre(i, j, k);
            cells.fraction.push(fractions.fraction(i, j, k));
            cells.velocity.push(Vector::new(if half { -x.x } else { 3.0 - 2.0 * x.y }, 2.0 * x.x, 0.0));
        }
        (cells, region.volume().unwrap())
    }

    fn placed(body: SampledLiquid, centre: Vector, orientation: Quaternion) -> Region {
        Region::Sampled(PlacedLiquid { body: Arc::new(body), centre, orientation })
    }

    #[test]
    fn a_body_keeps_volume_shape_and_motion_when_it_is_turned_and_shifted() {
        let semi_axes = Vector::new(0.72, 0.5, 0.4);
        let (cells, volume) = cells(semi_axes, false);
        let body = SampledLiquid::new(&cells).unwrap();
        assert!((body.volume() / volume - 1.0).abs() < 1e-3);
        let quarter = Quaternion::from_rotation_y(std::f64::consts::FRAC_PI_2);
        let region = placed(body, Vector::new(0.03, 0.0, 0.11), quarter);
        let grid = Grid::new([30; 3], -Vector::ONE, Vector::ONE);
        let fractions = RegionFractions::new(&region, &grid, 6);
        let exact = Region::Spheroid { centre: Vector::new(0.03, 0.0, 0.11), semi_axes, orientation: quarter };
        let reference = RegionFractions::new(&exact, &grid, 6);
        let (mut sum, mut apart) = (0.0, 0.0);
        for n in 0..grid.len() {
            let [i, j, k] = index_of(grid.cells, n).map(|i| i as isize);
            let fraction = fractions.fraction(i, j, k);
            sum += fraction;
            apart += (fraction - reference.fraction(i, j, k)).abs();
        }
        assert!((sum * grid.cell_volume() / region.volume().unwrap() - 1.0).abs() < 1e-9);
        assert!(fractions.raw_volume_error().unwrap().abs() < 5e-3, "{:?}", fractions.raw_volume_error());
        assert!(apart / sum < 0.02, "{}", apart / sum);
        let (lower, upper) = region.bounds();
        let half = Vector::new(0.4, 0.5, 0.72);
        // Smooth ends two to three cells narrow are shorter by a sixth of a cell; the bounds are a tenth wider.
        assert!((upper - lower - 2.0 * half - 0.02).abs().max_element() < 0.04, "{lower} {upper}");
        // What was along x1 is along -x3: velocity 2 x1 along x2 is now -2 x3, from the centre.
        let u = region.velocity(Vector::new(0.03, 0.1, 0.31));
        assert!((u - Vector::new(0.0, -0.4, 0.2)).length() < 0.03, "{u}");
        assert_eq!(region.velocity(Vector::splat(0.95)), Vector::ZERO);
        assert!(
            region.touches_ball(Vector::new(0.03, 0.0, 1.0), 0.2)
                && !region.touches_ball(Vector::new(0.9, 0.0, 0.1), 0.2)
        );
    }

    #[test]
    fn a_slice_goes_on_without_an_end() {
        let grid = Grid::new([20, 1, 20], Vector::new(-1.0, 0.0, -1.0), Vector::new(1.0, 0.1, 1.0));
        let disc = |centre: Vector| Region::Cylinder {
            centre,
            axis: 1,
            semi_axes: [0.5, 0.7],
            wave: Wave { amplitude: 0.0, length: 1.0 },
        };
        let region = disc(Vector::ZERO);
        let fractions = RegionFractions::new(&region, &grid, 8);
        let shares = |n: usize| {
            let [i, j, k] = index_of(grid.cells, n).map(|i| i as isize);
            fractions.fraction(i, j, k)
        };
        let fraction: Vec<Real> = (0..grid.len()).map(shares).collect();
        let velocity = vec![Vector::X; grid.len()];
        let slice = SampledCells { cells: grid.cells, spacing: grid.spacing, fraction, velocity };
        let body = SampledLiquid::new(&slice).unwrap();
        let place = Vector::new(0.1, 0.4, -0.05);
        let found = placed(body.clone(), place, Quaternion::IDENTITY);
        let (wider, exact) = (Grid::new([24, 3, 24], Vector::splat(-1.2), Vector::splat(1.2)), disc(place));
        let [found_in, exact_in] = [&found, &exact].map(|region| RegionFractions::new(region, &wider, 8));
        let (mut sums, mut apart) = ([0.0; 2], 0.0);
        for n in 0..wider.len() {
            let [i, j, k] = index_of(wider.cells, n).map(|i| i as isize);
            let pair = [&found_in, &exact_in].map(|fractions| fractions.fraction(i, j, k));
            sums = [sums[0] + pair[0], sums[1] + pair[1]];
            apart += (pair[0] - pair[1]).abs();
        }
        assert!((sums[0] / sums[1] - 1.0).abs() < 3e-3 && apart < 0.02 * sums[1], "{sums:?} {apart}");
        let (lower, upper) = found.bounds();
        assert!(lower.y == Real::NEG_INFINITY && upper.y == Real::INFINITY && lower.x.is_finite());
        assert!(found.volume().is_none() && found.touches_ball(Vector::new(0.1, 9.0, 0.45), 0.2));
        // Negative control: turned about x1 it ends along x2.
        let turned = placed(body, place, Quaternion::from_rotation_x(std::f64::consts::FRAC_PI_2));
        assert!(turned.bounds().0.y.is_finite() && turned.bounds().1.z == Real::INFINITY);
        assert!(!turned.touches_ball(Vector::new(0.1, 9.0, 0.45), 0.2));
    }

    #[test]
    fn a_slice_keeps_its_area_wherever_its_cells_cut_it() {
        let grid = Grid::new([16, 1, 16], Vector::splat(-8.0), Vector::splat(8.0));
        for (x, z) in [(0.0, 0.0), (0.5, 0.0), (0.25, -0.1), (0.1, 0.37)] {
            let ellipse = Region::Cylinder {
                centre: Vector::new(x, 0.0, z),
                axis: 1,
                semi_axes: [3.0, 2.0],
                wave: Wave { amplitude: 0.0, length: 1.0 },
            };
            let fractions = RegionFractions::new(&ellipse, &grid, 8);
            let index = |n: usize| index_of(grid.cells, n).map(|i| i as isize);
            let share = |[i, j, k]: [isize; 3]| fractions.fraction(i, j, k);
            let fraction: Vec<Real> = (0..grid.len()).map(|n| share(index(n))).collect();
            let area: Real = fraction.iter().sum();
            let velocity = vec![Vector::ZERO; grid.len()];
            let slice = SampledCells { cells: grid.cells, spacing: Vector::new(1.0, 16.0, 1.0), fraction, velocity };
            let found = placed(SampledLiquid::new(&slice).unwrap(), Vector::ZERO, Quaternion::IDENTITY);
            // A fine raster of 8 x 8 around it.
            let at = |n: usize, length: Real| length * ((n as Real + 0.5) / 1000.0 - 0.5);
            let within = |n: usize| found.contains(Vector::new(at(n % 1000, 8.0), 0.0, at(n / 1000, 8.0)));
            let covered = (0..1_000_000).filter(|&n| within(n)).count() as Real * 64e-6;
            assert!((covered / area - 1.0).abs() < 1e-3, "{x} {z}: {covered} {area}");
        }
    }

    #[test]
    fn a_half_becomes_whole_by_its_image() {
        let semi_axes = Vector::new(0.6, 0.6, 0.5);
        let (half, _) = cells(semi_axes, true);
        let (whole, volume) = cells(semi_axes, false);
        let mirrored = SampledLiquid::new(&half.mirrored(0)).unwrap();
        assert!((mirrored.volume() / volume - 1.0).abs() < 1e-3);
        assert!((mirrored.volume() / SampledLiquid::new(&whole).unwrap().volume() - 1.0).abs() < 1e-3);
        let region = placed(mirrored, Vector::ZERO, Quaternion::IDENTITY);
        let [left, right] = [-0.3, 0.3].map(|x| region.velocity(Vector::new(x, 0.0, 0.0)));
        assert!(
            (left.x - 0.3).abs() < 0.02 && (left + right * Vector::new(1.0, -1.0, 1.0)).length() < 1e-9,
            "{left} {right}"
        );
        let empty = SampledCells { fraction: vec![0.0; half.fraction.len()], ..half };
        assert_eq!(SampledLiquid::new(&empty), None);
    }
}
