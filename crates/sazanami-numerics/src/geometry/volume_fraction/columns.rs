//! The surface rasterised into vertical columns.
//!
//! A row of columns runs along x1. The edges of a triangle that cross the row give the columns it spans; an edge
//! is evaluated from its lower end whichever triangle asks, so that what one triangle adds at a shared edge its
//! neighbour takes away, to the last bit: every column through a closed surface leaves as often as it enters.

use super::{Block, Sums};
use crate::{Real, Vector};

/// Working memory.
#[derive(Clone, Debug, Default)]
pub(super) struct Columns {
    nodes: Vec<Node>,
    /// Cell of each column along x1 and its distance from the centre of the cell; the same for rows along x2.
    along: Vec<(usize, Real)>,
    across: Vec<(usize, Real)>,
}

/// A node in column spacings (x, y; columns at whole numbers) and cell edges (z).
#[derive(Clone, Copy, Debug)]
struct Node {
    x: Real,
    y: Real,
    z: Real,
    /// First row at or above y.
    row: usize,
}

impl Columns {
    /// Adds all triangles to the block (with `SAMPLED`, heights rounded to sub-cells) and returns the share of a
    /// cell that a column stands for.
    pub fn accumulate<const SAMPLED: bool>(
        &mut self,
        nodes: &[Vector],
        triangles: &[[u32; 3]],
        per_axis: u8,
        block: &mut Block,
    ) -> Real {
        let n = Real::from(per_axis);
        self.nodes.clear();
        self.nodes.extend(nodes.iter().map(|p| {
            let y = p.y * n - 0.5;
            Node { x: p.x * n - 0.5, y, z: p.z, row: whole(y.ceil()) }
        }));
        for (line, cells) in [(&mut self.along, block.cells[0]), (&mut self.across, block.cells[1])] {
            line.clear();
            for cell in 0..cells {
                line.extend((0..per_axis).map(|m| (cell, (Real::from(m) + 0.5) / n - 0.5)));
            }
        }
        let raster = Raster { along: &self.along, across: &self.across, samples: n };
        for triangle in triangles {
            raster.add::<SAMPLED>(triangle.map(|node| self.nodes[node as usize]), block);
        }
        1.0 / (n * n)
    }
}

struct Raster<'a> {
    along: &'a [(usize, Real)],
    across: &'a [(usize, Real)],
    samples: Real,
}

/// `value` brought between the bounds; the lower one for what is not a number.
#[inline(always)]
fn clamped(value: Real, lowest: Real, highest: Real) -> Real {
    let value = if value > lowest { value } else { lowest };
    if value < highest { value } else { highest }
}

/// A whole number from 0 to 2^32 - 1 out of its floating-point form, without a saturating cast.
#[inline(always)]
fn whole(value: Real) -> usize {
    const SHIFT: Real = 4_503_599_627_370_496.0;
    (value + SHIFT).to_bits() as u32 as usize
}

/// x of the edge from `low` to `high` as `low.x + (y - low.y) slope`.
fn slope(low: &Node, high: &Node) -> Real {
    (high.x - low.x) / (high.y - low.y)
}

impl Raster<'_> {
    #[inline]
    fn add<const SAMPLED: bool>(&self, [mut a, mut b, mut c]: [Node; 3], block: &mut Block) {
        let first = a.row.min(b.row).min(c.row);
        if first == a.row.max(b.row).max(c.row) {
            return;
        }
        // Sorted by y; an odd number of exchanges turns the triangle over.
        let mut sign = 1.0;
        for _ in 0..2 {
            if b.y < a.y {
                std::mem::swap(&mut a, &mut b);
                sign = -sign;
            }
            if c.y < b.y {
                std::mem::swap(&mut b, &mut c);
                sign = -sign;
            }
        }
        let plane = Plane::through(&a, &b, &c);
        let long = slope(&a, &c);
        for (low, high) in [(&a, &b), (&b, &c)] {
            if low.row >= high.row {
                continue;
            }
            let short = slope(low, high);
            for row in low.row..high.row {
                let y = row as u32 as Real;
                let left = whole((a.x + (y - a.y) * long).ceil());
                let right = whole((low.x + (y - low.y) * short).ceil());
                let span = Span {
                    from: left.min(right),
                    to: left.max(right),
                    row,
                    up: if left < right { sign } else { -sign },
                };
                self.add_span::<SAMPLED>(&span, &plane, block);
            }
        }
    }

    #[inline(always)]
    fn add_span<const SAMPLED: bool>(&self, span: &Span, plane: &Plane, block: &mut Block) {
        if span.from == span.to {
            return;
        }
        let (j, y) = self.across[span.row];
        let [n1, n2, _] = block.cells;
        let line = j * n1;
        let at_row = plane.height + plane.along_y * span.row as u32 as Real;
        for (column, &(i, x)) in (span.from as u32..).zip(&self.along[span.from..span.to]) {
            let z = clamped(at_row + plane.along_x * column as Real, plane.lowest, plane.highest);
            let floor = z.floor();
            let mut h = z - floor;
            if SAMPLED {
                h = (h * self.samples - 0.5).ceil().max(0.0) / self.samples;
            }
            let (s, t) = (span.up, span.up * h);
            let piece: Sums = [t, t * x, t * y, t * h, s, s * x, s * y, s];
            let index = whole(floor) * (n1 * n2) + line + i;
            for (sum, term) in block.sums[index].iter_mut().zip(piece) {
                *sum += term;
            }
        }
    }
}

/// Columns `from..to` of a row, under an upward (1) or downward (-1) facing triangle.
struct Span {
    from: usize,
    to: usize,
    row: usize,
    up: Real,
}

/// Height of a triangle's plane over the columns, kept between its lowest and highest node.
struct Plane {
    height: Real,
    along_x: Real,
    along_y: Real,
    lowest: Real,
    highest: Real,
}

impl Plane {
    #[inline(always)]
    fn through(a: &Node, b: &Node, c: &Node) -> Self {
        let (ux, uy, uz) = (b.x - a.x, b.y - a.y, b.z - a.z);
        let (vx, vy, vz) = (c.x - a.x, c.y - a.y, c.z - a.z);
        let area = ux * vy - uy * vx;
        // An upright triangle spans no columns except by round-off; then any height of its own will do.
        let inverse = if area == 0.0 { 0.0 } else { 1.0 / area };
        let along_x = (uz * vy - uy * vz) * inverse;
        let along_y = (ux * vz - uz * vx) * inverse;
        Self {
            height: a.z - along_x * a.x - along_y * a.y,
            along_x,
            along_y,
            lowest: a.z.min(b.z).min(c.z),
            highest: a.z.max(b.z).max(c.z),
        }
    }
}
