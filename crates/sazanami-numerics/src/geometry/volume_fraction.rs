//! Share of each cell that a rigid shape fills, and where in the cell that share lies.
//!
//! The volume below an upward facing piece of a closed surface minus that below a downward facing piece is the
//! volume in between. So every piece of the surface adds, with the sign of its normal's vertical component, the
//! part of its own cell below it and all of the cells under it; no piece need know of another:
//!
//! V_c = sum over pieces in c of int h dA + dz sum over pieces above c of int dA,
//!
//! with h the height above the cell's floor and dA the signed horizontal area; first moments likewise. The methods
//! differ in how they evaluate the integrals: on vertical columns through the cell (a midpoint rule horizontally,
//! exact vertically), or exactly on the surface cut by the cells' faces. All use the mesh that
//! gives the mass. What the sampling misses of the exact volume and centre of mass is then put on the partly
//! filled cells, with weight alpha (1 - alpha), so that weight, buoyancy and the torque of a uniform
//! pressure gradient are exact; alpha stays between 0 and 1.

mod clip;
mod columns;

use super::Shape;
use super::surface_mesh::Facet;
use crate::grid::Grid;
use crate::{Matrix, Quaternion, Real, Vector};

/// Evaluation of volume fractions.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum VolumeFractionMethod {
    /// The surface rasterised into `per_axis` x `per_axis` vertical columns a cell, exact vertically.
    Columns {
        /// Columns per cell edge.
        per_axis: u8,
    },
    /// The surface cut by the faces of the cells: exact.
    Clip,
}

impl Default for VolumeFractionMethod {
    fn default() -> Self {
        Self::Columns { per_axis: 4 }
    }
}

/// One cell that a shape covers in part or whole.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CellCover {
    /// Global indices; outside the grid where the shape is.
    pub cell: [i32; 3],
    /// Covered share of the cell, above 0, at most 1.
    pub fraction: Real,
    /// Centre of the covered part in the laboratory \[m].
    pub centroid: Vector,
    /// Area of the surface in the cell [m^2]; zero unless asked for ([`Rasteriser::with_areas`]).
    pub area: Real,
    /// Centre of that surface in the laboratory \[m]; that of the covered part where there is none. A flat end of the body in a plane of cells is
    /// part of the cells outside.
    pub surface: Vector,
    /// What the shape covers of the lower face in each direction; nothing unless asked for.
    pub sections: [Section; 3],
}

/// The part of a face of a cell within a shape.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Section {
    /// Its area over that of the face.
    pub part: Real,
    /// Integral of the place within the face over its part, over the area of the face \[m]: laboratory coordinates in the next two
    /// directions, cyclically.
    pub moment: [Real; 2],
}

/// Diagnostics of an imprint.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Imprint {
    /// Number of cells covered: the last so many of the list.
    pub cells: usize,
    /// Relative error of the volume before correction.
    pub raw_volume_error: Real,
    /// Whether the shape was too small for the method's samples and was evaluated exactly instead.
    pub fell_back: bool,
}

/// Fractions below this are left out (and made up for by the correction).
const NEGLIGIBLE: Real = 1e-9;
/// Distance of a flat end of a body from a plane of cells within which it lies in that, in cell edges.
const FLUSH: Real = 1e-6;
/// Fraction of the cells outside a flat end that lies in a plane of cells: so little that it counts nowhere but for its surface.
pub const FLUSH_FRACTION: Real = 1e-12;
/// Largest correction; it changes a half-filled cell by a quarter of this. Samples that need a larger one are too few.
const LARGEST_CORRECTION: Real = 0.5;
/// Largest shift of a centroid by it, in cell edges.
const LARGEST_SHIFT: Real = 0.25;

/// Integrals over the pieces of surface in one cell, lengths in cell edges: over the part of the cell below them
/// of 1, x, y, 2z, and over their horizontal projection of 1, x, y, 1; x and y from the centre, z from the floor.
type Sums = [Real; 8];

/// Evaluates volume fractions one body at a time; keeps its working memory between calls.
#[derive(Clone, Debug)]
pub struct Rasteriser {
    method: VolumeFractionMethod,
    /// Nodes in cell edges from the lower corner of the block of cells around the body.
    nodes: Vec<Vector>,
    columns: columns::ColumnSums,
    block: Block,
    with_areas: bool,
    /// Lower and upper plane of cells in each direction that a flat end of the body lies in, as the nodes have it.
    flush: [[Option<Real>; 2]; 3],
}

/// The surface of a body in one cell.
#[derive(Clone, Copy, Debug, Default)]
struct Piece {
    /// Area [m^2] and its first moments from the lower corner of the block [m^2 cell edges].
    area: [Real; 4],
    /// In each direction the area as it is seen along it, outward, and the first moments of that in the next two directions, lengths in
    /// cell edges; later the same of the section of the lower face.
    seen: [[Real; 3]; 3],
    /// Whether it is part of a flat end in a plane of cells.
    is_flush: bool,
}

/// The cells around a body.
#[derive(Clone, Debug, Default)]
struct Block {
    /// Global indices of its first cell.
    first: [i32; 3],
    cells: [usize; 3],
    /// By x1 fastest, x3 slowest.
    sums: Vec<Sums>,
    /// The surface in the cells, if asked for.
    areas: Vec<Piece>,
}

impl Rasteriser {
    /// # Panics
    /// If the method has no samples.
    #[must_use]
    pub fn new(method: VolumeFractionMethod) -> Self {
        if let VolumeFractionMethod::Columns { per_axis } = method {
            assert!(per_axis > 0, "volume fractions need at least one sample a cell");
        }
        let (columns, block) = (columns::ColumnSums::default(), Block::default());
        Self { method, nodes: Vec::new(), columns, block, with_areas: false, flush: Default::default() }
    }

    /// The same, evaluating the area of the surface in each cell too, exactly whatever the method.
    #[must_use]
    pub fn with_areas(self, with_areas: bool) -> Self {
        Self { with_areas, ..self }
    }

    /// The method in use.
    #[must_use]
    pub fn method(&self) -> VolumeFractionMethod {
        self.method
    }

    /// Appends to `covers` the cells that `shape` covers with its centre of mass at `position` \[m] and its body
    /// axes turned by `orientation`, in the order of cells in memory.
    pub fn imprint(
        &mut self,
        shape: &Shape,
        position: Vector,
        orientation: Quaternion,
        grid: &Grid,
        covers: &mut Vec<CellCover>,
    ) -> Imprint {
        self.imprint_scaled(shape, 1.0, position, orientation, grid, covers)
    }

    /// [`Self::imprint`] of the shape with every length multiplied by `scale`.
    pub fn imprint_scaled(
        &mut self,
        shape: &Shape,
        scale: Real,
        position: Vector,
        orientation: Quaternion,
        grid: &Grid,
        covers: &mut Vec<CellCover>,
    ) -> Imprint {
        self.place(shape, scale, position, orientation, grid);
        let triangles = &shape.surface().triangles;
        let start = covers.len();
        let weight = match self.method {
            VolumeFractionMethod::Columns { per_axis } => {
                self.columns.accumulate(&self.nodes, triangles, per_axis, &mut self.block)
            }
            VolumeFractionMethod::Clip => clip::accumulate(&self.nodes, triangles, &mut self.block),
        };
        if self.with_areas {
            self.block.areas.clear();
            self.block.areas.resize(self.block.sums.len(), Piece::default());
            clip::accumulate_areas(&self.nodes, shape.facets(), grid.spacing, self.flush, &mut self.block);
            self.block.cut_faces();
        }
        let exact_cells = shape.volume() * scale.powi(3) / grid.cell_volume();
        let mut tally = self.block.collect(weight, grid, covers);
        let raw_volume_error = tally.cells / exact_cells - 1.0;
        let fell_back = tally.correction(exact_cells).abs() > LARGEST_CORRECTION;
        if fell_back {
            covers.truncate(start);
            self.block.clear();
            let weight = clip::accumulate(&self.nodes, triangles, &mut self.block);
            tally = self.block.collect(weight, grid, covers);
        }
        correct(&mut covers[start..], &tally, exact_cells, position, grid.spacing);
        Imprint { cells: covers.len() - start, raw_volume_error, fell_back }
    }

    /// Moves the nodes to their place and lays an empty block of cells around them.
    fn place(&mut self, shape: &Shape, scale: Real, position: Vector, orientation: Quaternion, grid: &Grid) {
        let to_cells = Matrix::from_diagonal(grid.spacing.recip() * scale) * Matrix::from_quat(orientation);
        let origin = (position - grid.lower) / grid.spacing;
        let (mut lower, mut upper) = (Vector::splat(Real::INFINITY), Vector::splat(Real::NEG_INFINITY));
        self.nodes.clear();
        self.nodes.extend(shape.surface().nodes.iter().map(|&p| {
            let q = to_cells * p + origin;
            lower = lower.min(q);
            upper = upper.max(q);
            q
        }));
        let ends = if self.with_areas { self.flush_ends(shape, [lower, upper]) } else { Default::default() };
        let mut first = lower.floor();
        for (d, [below, above]) in ends.into_iter().enumerate() {
            for plane in [below, above].into_iter().flatten() {
                self.nodes.iter_mut().filter(|q| (q[d] - plane).abs() < FLUSH).for_each(|q| q[d] = plane);
            }
            first[d] = below.map_or(first[d], |plane| plane - 1.0);
            upper[d] = above.unwrap_or(upper[d]);
        }
        for q in &mut self.nodes {
            *q -= first;
        }
        self.flush = [0, 1, 2].map(|d| ends[d].map(|plane| plane.map(|plane| plane - first[d])));
        let last = (upper - first).floor();
        self.block.first = [first.x as i32, first.y as i32, first.z as i32];
        self.block.cells = [last.x as usize + 1, last.y as usize + 1, last.z as usize + 1];
        self.block.clear();
    }
}

impl Rasteriser {
    /// The planes of cells that flat ends of the body with these `bounds` lie in. Rounding would put either half of such an end into the cells on
    /// either side.
    fn flush_ends(&self, shape: &Shape, bounds: [Vector; 2]) -> [[Option<Real>; 2]; 3] {
        let end = |d: usize, bound: Vector| {
            let plane = bound[d].round();
            let is_in = |&node: &u32| (self.nodes[node as usize][d] - plane).abs() < FLUSH;
            let is_flush =
                (bound[d] - plane).abs() < FLUSH && shape.facets().iter().any(|facet| facet.nodes().iter().all(is_in));
            is_flush.then_some(plane)
        };
        [0, 1, 2].map(|d| bounds.map(|bound| end(d, bound)))
    }
}

/// Sums over the cells of one body before correction.
#[derive(Clone, Copy, Debug, Default)]
struct Tally {
    /// Sum of alpha.
    cells: Real,
    /// Sum of alpha (1 - alpha).
    leeway: Real,
    /// Sum of alpha times the centroid \[m].
    moment: Vector,
}

impl Tally {
    /// Factor k with which alpha + k alpha (1 - alpha) sums to `exact`.
    fn correction(&self, exact: Real) -> Real {
        let missing = exact - self.cells;
        if missing.abs() <= 1e-14 * exact { 0.0 } else { missing / self.leeway }
    }
}

impl Block {
    fn clear(&mut self) {
        self.sums.clear();
        self.sums.resize(self.cells.iter().product(), [0.0; 8]);
    }

    #[inline(always)]
    fn index(&self, i: usize, j: usize, k: usize) -> usize {
        (k * self.cells[1] + j) * self.cells[0] + i
    }

    /// Turns the surface seen along each direction into the sections of the lower faces: the surface in a cell and the sections of its
    /// two faces close the covered part, over which the integrals of 1 and of the coordinates along the face cancel.
    fn cut_faces(&mut self) {
        let strides = [1, self.cells[0], self.cells[0] * self.cells[1]];
        for (d, (&stride, &count)) in strides.iter().zip(&self.cells).enumerate() {
            let is_first = |index: usize| (index / stride).is_multiple_of(count);
            for start in (0..self.areas.len()).filter(|&index| is_first(index)) {
                let mut section = [0.0; 3];
                for n in 0..count {
                    let seen = std::mem::replace(&mut self.areas[start + n * stride].seen[d], section);
                    section.iter_mut().zip(seen).for_each(|(section, seen)| *section -= seen);
                }
            }
        }
    }

    /// Adds what lies under the pieces of the cells above, then lists the covered cells.
    fn collect(&mut self, weight: Real, grid: &Grid, covers: &mut Vec<CellCover>) -> Tally {
        let [n1, n2, n3] = self.cells;
        let plane = n1 * n2;
        for k in (0..n3.saturating_sub(1)).rev() {
            let (here, above) = self.sums[k * plane..(k + 2) * plane].split_at_mut(plane);
            for (v, up) in here.iter_mut().zip(above.iter()) {
                for l in 0..4 {
                    v[l] += up[l + 4];
                    v[l + 4] += up[l + 4];
                }
            }
        }
        let mut tally = Tally::default();
        let threshold = NEGLIGIBLE / weight;
        let mut index = 0;
        for k in 0..n3 as i32 {
            for j in 0..n2 as i32 {
                for i in 0..n1 as i32 {
                    let v = &self.sums[index];
                    let Piece { area: [area, moment @ ..], seen, is_flush } =
                        self.areas.get(index).copied().unwrap_or_default();
                    index += 1;
                    let is_filled = v[0] > threshold;
                    if !(is_filled || is_flush && area > 0.0) {
                        continue;
                    }
                    let cell = [self.first[0] + i, self.first[1] + j, self.first[2] + k];
                    let first = Vector::from_array(self.first.map(Real::from));
                    let on_surface = grid.lower + grid.spacing * (first + Vector::from_array(moment) / area);
                    let (fraction, centroid) = if is_filled {
                        let fraction = (weight * v[0]).min(1.0);
                        let local = Vector::new(v[1] / v[0] + 0.5, v[2] / v[0] + 0.5, 0.5 * v[3] / v[0]);
                        let floor = Vector::new(Real::from(cell[0]), Real::from(cell[1]), Real::from(cell[2]));
                        let centroid = grid.lower + grid.spacing * (floor + local);
                        tally.cells += fraction;
                        tally.leeway += fraction * (1.0 - fraction);
                        tally.moment += fraction * centroid;
                        (fraction, centroid)
                    } else {
                        (FLUSH_FRACTION, on_surface)
                    };
                    let surface = if area > 0.0 { on_surface } else { centroid };
                    let corner = grid.lower + grid.spacing * first;
                    let sections = [0, 1, 2].map(|d| {
                        let [part, moment @ ..] = seen[d];
                        let in_laboratory = |t: usize| {
                            let along = (d + 1 + t) % 3;
                            part * corner[along] + moment[t] * grid.spacing[along]
                        };
                        Section { part, moment: [in_laboratory(0), in_laboratory(1)] }
                    });
                    covers.push(CellCover { cell, fraction, centroid, area, surface, sections });
                }
            }
        }
        tally
    }
}

/// Brings the sum of the fractions to `exact` and their common centre to `position`, full cells untouched.
fn correct(covers: &mut [CellCover], tally: &Tally, exact: Real, position: Vector, spacing: Vector) {
    let k = tally.correction(exact).clamp(-1.0, 1.0);
    let (mut leeway, mut moment) = (0.0, Vector::ZERO);
    for cover in covers.iter_mut().filter(|cover| cover.fraction > FLUSH_FRACTION) {
        cover.fraction += k * cover.fraction * (1.0 - cover.fraction);
        leeway += cover.fraction * (1.0 - cover.fraction);
        moment += cover.fraction * (cover.centroid - position);
    }
    if leeway > NEGLIGIBLE {
        let wanted = -moment / leeway;
        // Slivers alone would have to lie far away; what they cannot do all cells do.
        let shift = wanted.clamp(-LARGEST_SHIFT * spacing, LARGEST_SHIFT * spacing);
        for cover in &mut *covers {
            cover.centroid += (1.0 - cover.fraction) * shift;
        }
        if shift != wanted {
            let rest = (wanted - shift) * leeway / covers.iter().map(|cover| cover.fraction).sum::<Real>();
            covers.iter_mut().for_each(|cover| cover.centroid += rest);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::ContactSphereRule;

    /// Covers of a block of 4 x 3 x 2 cells of unlike edges, moved and turned about x3.
    fn covers(shift: Vector, angle: Real) -> Vec<CellCover> {
        let grid = Grid::new([10, 10, 10], Vector::ZERO, Vector::new(10.0, 5.0, 20.0));
        let shape = Shape::cuboid(Vector::new(4.0, 1.5, 4.0), &ContactSphereRule::Listed(vec![(Vector::ZERO, 0.5)]))
            .expect("a block");
        let mut covers = Vec::new();
        let position = Vector::new(5.0, 2.75, 10.0) + shift;
        let turn = Quaternion::from_rotation_z(angle);
        Rasteriser::new(VolumeFractionMethod::default()).with_areas(true).imprint(
            &shape,
            position,
            turn,
            &grid,
            &mut covers,
        );
        covers
    }

    #[test]
    fn flat_ends_in_planes_of_cells_are_part_of_the_cells_outside() {
        for (shift, angle) in [(0.0, 0.0), (1e-9, 0.0), (0.0, 1e-8), (0.0, -1e-8)] {
            let covers = covers(Vector::splat(shift), angle);
            let (full, beside): (Vec<CellCover>, Vec<CellCover>) =
                covers.iter().partition(|cover| cover.fraction > 0.5);
            assert_eq!((full.len(), beside.len()), (24, 2 * (4 * 3 + 3 * 2 + 2 * 4)), "{shift} {angle}");
            assert!(full.iter().all(|cover| cover.area == 0.0 && (cover.fraction - 1.0).abs() < 1e-9));
            assert!(beside.iter().all(|cover| cover.fraction == FLUSH_FRACTION));
            let area: Real = beside.iter().map(|cover| cover.area).sum();
            assert!((area - 2.0 * (6.0 + 6.0 + 16.0)).abs() < 1e-6, "{area}");
            // A face of a cell in the plane is covered on either end.
            let of =
                |cell: [i32; 3]| covers.iter().find(|cover| cover.cell == cell).map(|cover| cover.sections[0].part);
            assert_eq!([of([3, 5, 5]), of([7, 5, 5])], [Some(1.0), Some(1.0)]);
        }
        // Negative control: a hundredth of a cell further the ends lie within cells.
        let covers = covers(Vector::new(0.0, 0.0, 0.02), 0.0);
        assert!(covers.iter().any(|cover| cover.cell[2] == 6 && (cover.fraction - 0.01).abs() < 1e-6));
    }

    #[test]
    fn centroids_stay_at_their_cells_however_little_is_covered_in_part() {
        for angle in [1e-7, 1e-6, 1e-5, 1e-3] {
            for cover in covers(Vector::new(1e-5, -1e-5, 2e-6), angle) {
                let middle = (Vector::from_array(cover.cell.map(Real::from)) + 0.5) * Vector::new(1.0, 0.5, 2.0);
                let away = (cover.centroid - middle).abs() / Vector::new(1.0, 0.5, 2.0);
                assert!(away.max_element() < 0.8, "{angle}: {cover:?}");
                assert!(cover.surface.is_finite() && cover.centroid.is_finite());
            }
        }
    }
}
