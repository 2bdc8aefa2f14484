//! Surface where a cell field has a given value, by naive surface nets (Gibson 1998).

use sazanami_numerics::Vector;
use sazanami_numerics::grid::Grid;

use super::{PictureError, check_length};

/// A closed surface around the cells above a level. Outside the grid the field counts as zero.
#[derive(Clone, Debug, Default)]
pub struct Isosurface {
    /// Corners \[m].
    pub nodes: Vec<Vector>,
    /// Triangles, anticlockwise seen from the lower side.
    pub triangles: Vec<[u32; 3]>,
    /// Unit normals at the corners, towards the lower side.
    pub normals: Vec<Vector>,
}

/// No node.
const NONE: u32 = u32::MAX;

impl Isosurface {
    /// Surface at `level` of the cell field `values` (without ghosts, x1 fastest), which is first smoothed
    /// `smoothing` times with the weights 1, 2, 1 in every direction.
    ///
    /// # Errors
    /// If there is not one value for each cell.
    pub fn new(grid: &Grid, values: &[f64], level: f64, smoothing: usize) -> Result<Self, PictureError> {
        check_length("the cell field", grid.len(), values.len())?;
        let mut field: Vec<f32> = values.iter().map(|&value| value as f32).collect();
        for _ in 0..smoothing {
            smooth(&mut field, grid.cells);
        }
        let samples = Samples { field: &field, cells: grid.cells, level: level as f32 };
        let mut surface = Self::default();
        let numbers = surface.place_nodes(grid, &samples);
        surface.join_nodes(&samples, &numbers);
        surface.normals = surface.node_normals();
        Ok(surface)
    }

    /// Puts a node into every box between eight cell centres that lie on both sides; returns the nodes' numbers.
    fn place_nodes(&mut self, grid: &Grid, samples: &Samples) -> Vec<u32> {
        let [n1, n2, n3] = samples.cells;
        let mut numbers = vec![NONE; (n1 + 1) * (n2 + 1) * (n3 + 1)];
        let mut at = 0;
        for k in 0..=n3 {
            for j in 0..=n2 {
                for i in 0..=n1 {
                    if let Some(place) = samples.crossing([i, j, k]) {
                        numbers[at] = self.nodes.len() as u32;
                        let place = Vector::from_array(place.map(f64::from));
                        let cell = Vector::new(i as f64, j as f64, k as f64);
                        self.nodes.push(grid.lower + grid.spacing * (cell + place - 0.5));
                    }
                    at += 1;
                }
            }
        }
        numbers
    }

    /// Spans two triangles around every pair of neighbouring cells that lie on both sides.
    fn join_nodes(&mut self, samples: &Samples, numbers: &[u32]) {
        let [n1, n2, n3] = samples.cells;
        let stride = [1, n1 + 1, (n1 + 1) * (n2 + 1)];
        for k in 0..=n3 {
            for j in 0..=n2 {
                for i in 0..=n1 {
                    let upper = [i, j, k];
                    for direction in 0..3 {
                        let [second, third] = [(direction + 1) % 3, (direction + 2) % 3];
                        // The pair is the cells below and at `upper`; both others must be inside.
                        if upper[second] == samples.cells[second] || upper[third] == samples.cells[third] {
                            continue;
                        }
                        let inside_below = samples.is_inside_below(upper, direction);
                        if inside_below == samples.is_inside(upper) {
                            continue;
                        }
                        let corner = i + j * stride[1] + k * stride[2];
                        let (b, c) = (stride[second], stride[third]);
                        let quad = [corner, corner + b, corner + b + c, corner + c].map(|at| numbers[at]);
                        self.add_quad(if inside_below { quad } else { [quad[0], quad[3], quad[2], quad[1]] });
                    }
                }
            }
        }
    }

    fn add_quad(&mut self, quad: [u32; 4]) {
        let [a, b, c, d] = quad;
        let length = |p: u32, q: u32| self.nodes[p as usize].distance_squared(self.nodes[q as usize]);
        if length(a, c) <= length(b, d) {
            self.triangles.extend([[a, b, c], [a, c, d]]);
        } else {
            self.triangles.extend([[a, b, d], [b, c, d]]);
        }
    }

    /// Means of the triangles' normals, weighted by area.
    fn node_normals(&self) -> Vec<Vector> {
        let mut normals = vec![Vector::ZERO; self.nodes.len()];
        for triangle in &self.triangles {
            let [a, b, c] = triangle.map(|node| self.nodes[node as usize]);
            let normal = (b - a).cross(c - a);
            triangle.iter().for_each(|&node| normals[node as usize] += normal);
        }
        normals.into_iter().map(|normal| normal.normalize_or(Vector::Z)).collect()
    }
}

/// The field, zero outside the grid.
struct Samples<'a> {
    field: &'a [f32],
    cells: [usize; 3],
    level: f32,
}

impl Samples<'_> {
    fn value(&self, [i, j, k]: [usize; 3]) -> f32 {
        let [n1, n2, n3] = self.cells;
        // Indices below zero have wrapped to large ones.
        if i < n1 && j < n2 && k < n3 { self.field[(k * n2 + j) * n1 + i] } else { 0.0 }
    }

    fn is_inside(&self, cell: [usize; 3]) -> bool {
        self.value(cell) > self.level
    }

    fn is_inside_below(&self, mut cell: [usize; 3], direction: usize) -> bool {
        cell[direction] = cell[direction].wrapping_sub(1);
        self.is_inside(cell)
    }

    /// Mean of the points where the surface crosses the edges of the box between the cells below and at `upper`,
    /// in units of the spacing from the lowest centre; nothing if it crosses none.
    fn crossing(&self, upper: [usize; 3]) -> Option<[f32; 3]> {
        let mut corners = [0.0; 8];
        for (n, corner) in corners.iter_mut().enumerate() {
            let cell = std::array::from_fn(|d| upper[d].wrapping_sub(1 - (n >> d & 1)));
            *corner = self.value(cell) - self.level;
        }
        let inside = corners.iter().filter(|&&corner| corner > 0.0).count();
        if inside == 0 || inside == 8 {
            return None;
        }
        let (mut sum, mut count) = ([0.0; 3], 0.0);
        for direction in 0..3 {
            for low in (0..8_usize).filter(|n| n >> direction & 1 == 0) {
                let [a, b] = [corners[low], corners[low | 1 << direction]];
                if (a > 0.0) != (b > 0.0) {
                    let point: [f32; 3] =
                        std::array::from_fn(|d| if d == direction { a / (a - b) } else { (low >> d & 1) as f32 });
                    sum = std::array::from_fn(|d| sum[d] + point[d]);
                    count += 1.0;
                }
            }
        }
        Some(sum.map(|s| s / count))
    }
}

/// Means with the weights 1, 2, 1 in every direction; the edge counts for what lies beyond.
fn smooth(field: &mut [f32], [n1, n2, n3]: [usize; 3]) {
    for (stride, length) in [(1, n1), (n1, n2), (n1 * n2, n3)] {
        // Lines along the direction start wherever its own index is zero.
        for start in (0..field.len()).filter(|at| (at / stride).is_multiple_of(length)) {
            let mut before = field[start];
            for n in 0..length {
                let at = start + n * stride;
                let here = field[at];
                let after = if n + 1 < length { field[at + stride] } else { here };
                field[at] = 0.25 * before + 0.5 * here + 0.25 * after;
                before = here;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::BTreeMap;

    fn volume(surface: &Isosurface) -> f64 {
        let parts = surface.triangles.iter().map(|triangle| {
            let [a, b, c] = triangle.map(|node| surface.nodes[node as usize]);
            a.dot(b.cross(c)) / 6.0
        });
        parts.sum()
    }

    /// Whether every edge belongs to as many triangles one way as the other.
    fn is_closed(surface: &Isosurface) -> bool {
        let mut edges = BTreeMap::new();
        for [a, b, c] in &surface.triangles {
            for (p, q) in [(a, b), (b, c), (c, a)] {
                *edges.entry((p.min(q), p.max(q))).or_insert(0) += if p < q { 1 } else { -1 };
            }
        }
        edges.values().all(|&sum| sum == 0)
    }

    #[test]
    fn a_ball_has_its_volume_and_normals_and_is_closed() {
        let mut errors = Vec::new();
        for n in [16_usize, 32] {
            let grid = Grid::new([n, n + 3, n - 2], Vector::new(-1.1, -1.2, -1.0), Vector::new(1.1, 1.0, 1.3));
            let width = grid.spacing.max_element();
            let centre = Vector::new(0.05, -0.1, 0.1);
            let values: Vec<f64> = (0..grid.len())
                .map(|at| {
                    let (i, j, k) = (at % n, at / n % (n + 3), at / n / (n + 3));
                    let distance = grid.centre(i as isize, j as isize, k as isize).distance(centre);
                    (0.5 + (0.8 - distance) / width).clamp(0.0, 1.0)
                })
                .collect();
            let surface = Isosurface::new(&grid, &values, 0.5, 0).unwrap();
            let exact = 4.0 / 3.0 * std::f64::consts::PI * 0.8_f64.powi(3);
            errors.push((volume(&surface) / exact - 1.0).abs());
            assert!(is_closed(&surface));
            let cosines = surface
                .nodes
                .iter()
                .zip(&surface.normals)
                .map(|(node, normal)| normal.dot((*node - centre).normalize()));
            assert!(cosines.fold(1.0, f64::min) > 0.93);
            let mut open = surface.clone();
            open.triangles.pop();
            assert!(!is_closed(&open));
        }
        assert!(errors[0] < 0.04 && errors[1] < 0.01, "{errors:?}");
    }

    #[test]
    fn a_full_grid_is_closed_at_its_walls_and_smoothing_keeps_it() {
        let grid = Grid::new([3, 4, 5], Vector::ZERO, Vector::new(3.0, 4.0, 5.0));
        for smoothing in [0, 2] {
            let surface = Isosurface::new(&grid, &vec![1.0; 60], 0.5, smoothing).unwrap();
            assert!(is_closed(&surface));
            // Corners and edges are rounded.
            assert!((44.0..60.0).contains(&volume(&surface)), "{}", volume(&surface));
        }
        assert!(Isosurface::new(&grid, &vec![0.2; 60], 0.5, 0).unwrap().triangles.is_empty());
        assert!(Isosurface::new(&grid, &[0.2; 59], 0.5, 0).is_err());
    }
}
