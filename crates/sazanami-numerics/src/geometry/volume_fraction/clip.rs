//! The surface cut by the faces of the cells, integrated exactly.

use super::{Block, Sums};
use crate::{Real, Vector};

/// A triangle cut by six planes has at most nine corners.
const CORNERS: usize = 10;

/// A convex polygon.
#[derive(Clone, Copy, Default)]
struct Polygon {
    corners: [Vector; CORNERS],
    len: usize,
}

/// Adds all triangles to the block; the integrals are in cells already.
pub(super) fn accumulate(nodes: &[Vector], triangles: &[[u32; 3]], block: &mut Block) -> Real {
    pieces(nodes, triangles, |[i, j, k], piece| {
        let floor = Vector::new(i as Real + 0.5, j as Real + 0.5, k as Real);
        let index = block.index(i, j, k);
        add(piece, floor, &mut block.sums[index]);
    });
    1.0
}

/// Adds to the block the area of all triangles in each cell, how it is seen along each direction, and first moments.
pub(super) fn accumulate_areas(nodes: &[Vector], triangles: &[[u32; 3]], spacing: Vector, block: &mut Block) {
    pieces(nodes, triangles, |[i, j, k], piece| {
        let index = block.index(i, j, k);
        let p = piece.corners[0];
        for pair in piece.corners[1..piece.len].windows(2) {
            let area = 0.5 * ((pair[0] - p) * spacing).cross((pair[1] - p) * spacing).length();
            let centre = (p + pair[0] + pair[1]) / 3.0;
            let moment = area * centre;
            let sums = [area, moment.x, moment.y, moment.z];
            let piece = &mut block.areas[index];
            piece.area.iter_mut().zip(sums).for_each(|(sum, part)| *sum += part);
            let outward = 0.5 * (pair[0] - p).cross(pair[1] - p);
            for (d, seen) in piece.seen.iter_mut().enumerate() {
                let sums = [1.0, centre[(d + 1) % 3], centre[(d + 2) % 3]];
                seen.iter_mut().zip(sums).for_each(|(sum, part)| *sum += outward[d] * part);
            }
        }
    });
}

/// Cuts all triangles at the faces of the cells and visits the pieces by cell index.
fn pieces(nodes: &[Vector], triangles: &[[u32; 3]], mut visit: impl FnMut([usize; 3], &Polygon)) {
    let mut triangle = Polygon::default();
    for nodes_of in triangles {
        triangle.len = 3;
        triangle.corners[..3].copy_from_slice(&nodes_of.map(|node| nodes[node as usize]));
        slices(&triangle, 0, |i, slab| {
            slices(slab, 1, |j, rod| {
                slices(rod, 2, |k, piece| visit([i, j, k], piece));
            });
        });
    }
}

/// Cuts a polygon at the whole numbers within it along `axis` and visits the parts by cell index.
#[inline(always)]
fn slices(polygon: &Polygon, axis: usize, mut visit: impl FnMut(usize, &Polygon)) {
    let (mut lower, mut upper) = (polygon.corners[0][axis], polygon.corners[0][axis]);
    for corner in &polygon.corners[1..polygon.len] {
        (lower, upper) = (lower.min(corner[axis]), upper.max(corner[axis]));
    }
    let (first, last) = (lower as usize, upper as usize);
    if first == last {
        return visit(first, polygon);
    }
    let (mut below, mut rest, mut above) = (Polygon::default(), *polygon, Polygon::default());
    for index in first..last {
        cut(&rest, axis, (index + 1) as Real, [&mut below, &mut above]);
        if below.len > 2 {
            visit(index, &below);
        }
        std::mem::swap(&mut rest, &mut above);
        if rest.len < 3 {
            return;
        }
    }
    visit(last, &rest);
}

/// Sets the parts of a polygon below and above `level` along `axis`.
#[inline]
fn cut(polygon: &Polygon, axis: usize, level: Real, [below, above]: [&mut Polygon; 2]) {
    (below.len, above.len) = (0, 0);
    let mut previous = polygon.corners[polygon.len - 1];
    for &corner in &polygon.corners[..polygon.len] {
        let (from, to) = (previous[axis] - level, corner[axis] - level);
        if from * to < 0.0 {
            let mut crossing = previous + from / (from - to) * (corner - previous);
            crossing[axis] = level;
            below.push(crossing);
            above.push(crossing);
        }
        if to <= 0.0 {
            below.push(corner);
        }
        if to >= 0.0 {
            above.push(corner);
        }
        previous = corner;
    }
}

impl Polygon {
    #[inline(always)]
    fn push(&mut self, corner: Vector) {
        if self.len < CORNERS {
            self.corners[self.len] = corner;
            self.len += 1;
        }
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
