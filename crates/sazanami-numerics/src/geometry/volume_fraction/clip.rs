//! The surface cut by the faces of the cells, integrated exactly.

use super::{Block, Facet, Sums};
use crate::{Real, Vector};

/// Most corners: a quadrilateral cut by six planes has ten. A power of two, so that places are bounded without a branch.
const CORNERS: usize = 16;

/// A convex polygon.
#[derive(Clone, Copy, Default)]
struct Polygon {
    corners: [Vector; CORNERS],
    len: usize,
}

/// Adds all triangles to the block; the integrals are in cells already.
pub(super) fn accumulate(nodes: &[Vector], triangles: &[[u32; 3]], block: &mut Block) -> Real {
    let (mut cuts, mut triangle) = (Cuts::default(), Polygon::default());
    for corners in triangles {
        triangle.set(nodes, corners);
        pieces(&triangle, &mut cuts, |[i, j, k], piece| {
            let floor = Vector::new(i as Real + 0.5, j as Real + 0.5, k as Real);
            let index = block.index(i, j, k);
            add(piece, floor, &mut block.sums[index]);
        });
    }
    1.0
}

/// Adds to the block the area of all facets in each cell, how it is seen along each direction, and first moments.
///
/// A piece of a plane facet is as large a part of it as seen along the axis along which most of the facet is seen. One in a plane of cells that a
/// `flush` end of the body lies in counts to the cells outside.
pub(super) fn accumulate_areas(
    nodes: &[Vector],
    facets: &[Facet],
    spacing: Vector,
    flush: [[Option<Real>; 2]; 3],
    block: &mut Block,
) {
    let (mut cuts, mut polygon) = (Cuts::default(), Polygon::default());
    let faces = Vector::new(spacing.y * spacing.z, spacing.z * spacing.x, spacing.x * spacing.y);
    for facet in facets {
        polygon.set(nodes, facet.nodes());
        let outward = polygon.area();
        let size = outward.abs();
        let along = if size.x >= size.y.max(size.z) { 0 } else { 1 + usize::from(size.z > size.y) };
        if size[along] == 0.0 {
            continue;
        }
        let [a, b] = [(along + 1) % 3, (along + 2) % 3];
        let (area, part_of) = ((outward * faces).length(), 0.5 / outward[along]);
        let lies_in = |plane: Option<Real>| {
            plane.is_some_and(|plane| polygon.corners[..polygon.len].iter().all(|corner| corner[along] == plane))
        };
        let [below, above] = flush[along].map(lies_in);
        pieces(&polygon, &mut cuts, |mut index, piece| {
            index[along] -= usize::from(below);
            let [i, j, k] = index;
            let p = piece.corners[0];
            let (mut part, mut moment) = (0.0, Vector::ZERO);
            for pair in piece.corners[1..piece.len].windows(2) {
                let [q, r] = [pair[0] - p, pair[1] - p];
                let seen = part_of * (q[a] * r[b] - q[b] * r[a]);
                part += seen;
                moment += seen / 3.0 * (q + r);
            }
            moment += part * p;
            let index = block.index(i, j, k);
            let piece = &mut block.areas[index];
            piece.is_flush |= below || above;
            piece.area.iter_mut().zip([part, moment.x, moment.y, moment.z]).for_each(|(sum, part)| *sum += area * part);
            for (d, seen) in piece.seen.iter_mut().enumerate() {
                let sums = [part, moment[(d + 1) % 3], moment[(d + 2) % 3]];
                seen.iter_mut().zip(sums).for_each(|(sum, part)| *sum += outward[d] * part);
            }
        });
    }
}

/// The parts of a polygon below and above a cut along each axis, and a rest.
type Cuts = [[Polygon; 3]; 3];

/// Cuts a polygon at the faces of the cells and visits the pieces by cell index.
#[inline(always)]
fn pieces(polygon: &Polygon, cuts: &mut Cuts, mut visit: impl FnMut([usize; 3], &Polygon)) {
    let corners = &polygon.corners[..polygon.len];
    let (lower, upper) =
        corners.iter().fold((corners[0], corners[0]), |(lower, upper), &p| (lower.min(p), upper.max(p)));
    let cells = [0, 1, 2].map(|d| [lower[d] as usize, upper[d] as usize]);
    let [x, y, z] = cuts;
    slices(polygon, 0, cells[0], x, |i, slab| {
        slices(slab, 1, cells[1], y, |j, rod| {
            slices(rod, 2, cells[2], z, |k, piece| visit([i, j, k], piece));
        });
    });
}

/// Cuts a polygon, a part of one in the cells `first` to `last`, at the whole numbers within it along `axis` and visits the parts by cell
/// index.
#[inline(always)]
fn slices(
    polygon: &Polygon,
    axis: usize,
    [first, last]: [usize; 2],
    cuts: &mut [Polygon; 3],
    mut visit: impl FnMut(usize, &Polygon),
) {
    if first == last {
        return visit(first, polygon);
    }
    let (mut lower, mut upper) = (polygon.corners[0][axis], polygon.corners[0][axis]);
    for corner in &polygon.corners[1..polygon.len] {
        (lower, upper) = (lower.min(corner[axis]), upper.max(corner[axis]));
    }
    let (first, last) = (lower as usize, upper as usize);
    if first == last {
        return visit(first, polygon);
    }
    let [below, rest, above] = cuts;
    let (mut rest, mut above) = (rest, above);
    cut(polygon, axis, (first + 1) as Real, [below, rest]);
    for index in first..last {
        if index > first {
            cut(rest, axis, (index + 1) as Real, [below, above]);
            std::mem::swap(&mut rest, &mut above);
        }
        if below.len > 2 {
            visit(index, below);
        }
        if rest.len < 3 {
            return;
        }
    }
    visit(last, rest);
}

/// Sets the parts of a polygon below and above `level` along `axis`. Without branches: on which side a corner lies is hard to foretell.
#[inline(always)]
fn cut(polygon: &Polygon, axis: usize, level: Real, [below, above]: [&mut Polygon; 2]) {
    let [mut under, mut over] = [0; 2];
    let mut previous = polygon.corners[polygon.len.wrapping_sub(1) % CORNERS];
    for &corner in &polygon.corners[..polygon.len] {
        let (from, to) = (previous[axis] - level, corner[axis] - level);
        let mut crossing = previous + from / (from - to) * (corner - previous);
        crossing[axis] = level;
        let crosses = usize::from(from * to < 0.0);
        below.corners[under % CORNERS] = crossing;
        under += crosses;
        below.corners[under % CORNERS] = corner;
        under += usize::from(to <= 0.0);
        above.corners[over % CORNERS] = crossing;
        over += crosses;
        above.corners[over % CORNERS] = corner;
        over += usize::from(to >= 0.0);
        previous = corner;
    }
    (below.len, above.len) = (under, over);
}

impl Polygon {
    /// Becomes the polygon of these corners among the `nodes`.
    fn set(&mut self, nodes: &[Vector], corners: &[u32]) {
        self.len = corners.len();
        self.corners.iter_mut().zip(corners).for_each(|(corner, &node)| *corner = nodes[node as usize]);
    }

    /// Area times the normal.
    fn area(&self) -> Vector {
        let p = self.corners[0];
        self.corners[1..self.len].windows(2).map(|pair| 0.5 * (pair[0] - p).cross(pair[1] - p)).sum()
    }
}

/// Adds the integrals over a polygon inside one cell, whose floor has its centre at `floor`.
fn add(polygon: &Polygon, floor: Vector, sums: &mut Sums) {
    let p = polygon.corners[0] - floor;
    for pair in polygon.corners[1..polygon.len].windows(2) {
        let (q, r) = (pair[0] - floor, pair[1] - floor);
        let area = 0.5 * ((q.x - p.x) * (r.y - p.y) - (q.y - p.y) * (r.x - p.x));
        let s = p + q + r;
        // int f g dA = area/12 (sum f_i g_i + sum f_i sum g_i) for linear f, g.
        let twelfth = area / 12.0;
        sums[0] += area / 3.0 * s.z;
        sums[1] += twelfth * (p.z * p.x + q.z * q.x + r.z * r.x + s.z * s.x);
        sums[2] += twelfth * (p.z * p.y + q.z * q.y + r.z * r.y + s.z * s.y);
        sums[3] += twelfth * (p.z * p.z + q.z * q.z + r.z * r.z + s.z * s.z);
        sums[4] += area;
        sums[5] += area / 3.0 * s.x;
        sums[6] += area / 3.0 * s.y;
        sums[7] += area;
    }
}
