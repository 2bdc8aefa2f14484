//! The surface rasterised into vertical columns.
//!
//! A row of columns runs along x1. The edges of a triangle that cross the row give the columns it spans; an edge
//! is evaluated from its lower end whichever triangle asks, so that what one triangle adds at a shared edge its
//! neighbour takes away, to the last bit: every column through a closed surface leaves as often as it enters.
//!
//! Triangles have few rows and spans few columns: a loop over either ends where a processor does not expect it. So what
//! depends on triangles alone is evaluated for many side by side, and spans and columns are listed without branches before they
//! are worked on. Sums are made in the order of triangles, rows, columns.

use std::ops::Range;

use super::{Block, Sums};
use crate::{Real, Vector};

/// Triangles evaluated side by side.
const ABREAST: usize = 32;
/// Spans, and columns, listed before they are worked on.
const LISTED: usize = 64;
/// Columns evaluated side by side.
const LANES: usize = 4;

/// A number of each triangle.
type Abreast = [Real; ABREAST];
/// x and y of a node in column spacings (columns at whole numbers), z in cell edges, and the first row at or above y.
type Node = [Real; 4];

/// Working memory.
#[derive(Clone, Debug, Default)]
pub(super) struct ColumnSums {
    nodes: Vec<Node>,
    /// Cell of each column along x1 and its distance from the centre of the cell, with some more to fill the lanes; the same
    /// for rows along x2, with the first cell of the row of cells.
    along: [Vec<Real>; 2],
    across: Vec<[Real; 2]>,
}

impl ColumnSums {
    /// Adds all triangles to the block and returns the share of a cell that a column stands for.
    pub fn accumulate(&mut self, nodes: &[Vector], triangles: &[[u32; 3]], per_axis: u8, block: &mut Block) -> Real {
        let n = Real::from(per_axis);
        self.nodes.clear();
        self.nodes.extend(nodes.iter().map(|p| {
            let y = p.y * n - 0.5;
            [p.x * n - 0.5, y, p.z, y.ceil()]
        }));
        self.lay_columns(block.cells, per_axis);
        let mut facets = Facets::default();
        let mut spans = [Span::default(); LISTED];
        for triangles in triangles.chunks(ABREAST) {
            facets.evaluate(&self.nodes, triangles);
            let mut listed = 0;
            for triangle in 0..triangles.len() {
                let edges = facets.edges(triangle);
                for row in edges.rows.clone() {
                    if listed == LISTED {
                        self.add(&facets, &spans, block);
                        listed = 0;
                    }
                    let span = edges.span(row);
                    spans[listed] = span;
                    listed += usize::from(span.from != span.to);
                }
            }
            self.add(&facets, &spans[..listed], block);
        }
        1.0 / (n * n)
    }

    fn lay_columns(&mut self, [n1, n2, _]: [usize; 3], per_axis: u8) {
        let place = |m: u8| (Real::from(m) + 0.5) / Real::from(per_axis) - 0.5;
        let Self { along: [cells, places], across, .. } = self;
        cells.clear();
        places.clear();
        across.clear();
        for cell in 0..n1 {
            cells.extend((0..per_axis).map(|_| cell as Real));
            places.extend((0..per_axis).map(place));
        }
        for line in [cells, places] {
            line.extend([0.0; LANES]);
        }
        for cell in 0..n2 {
            across.extend((0..per_axis).map(|m| [(cell * n1) as Real, place(m)]));
        }
    }

    /// Adds the columns of these spans to the block.
    fn add(&self, facets: &Facets, spans: &[Span], block: &mut Block) {
        let [n1, n2, _] = block.cells;
        let layer = (n1 * n2) as Real;
        let [cells, places] = &self.along;
        let mut columns = Listed::default();
        let mut listed = 0;
        for span in spans {
            let t = span.triangle as usize % ABREAST;
            let [line, y] = self.across[span.row as usize];
            let at_row = facets.height[t] + facets.along_y[t] * Real::from(span.row);
            for from in (span.from..span.to).step_by(LANES) {
                if listed + LANES > LISTED {
                    columns.add(listed, layer, &mut block.sums);
                    listed = 0;
                }
                let at = from as usize;
                let (cells, places) = (&cells[at..at + LANES], &places[at..at + LANES]);
                let column = Real::from(from);
                columns.z[listed..listed + LANES]
                    .copy_from_slice(&lanes(|l| at_row + facets.along_x[t] * (column + l as Real)));
                columns.lowest[listed..listed + LANES].fill(facets.lowest[t]);
                columns.highest[listed..listed + LANES].fill(facets.highest[t]);
                columns.up[listed..listed + LANES].fill(span.up);
                columns.y[listed..listed + LANES].fill(y);
                columns.x[listed..listed + LANES].copy_from_slice(places);
                columns.place[listed..listed + LANES].copy_from_slice(&lanes(|l| line + cells[l]));
                listed += LANES.min((span.to - from) as usize);
            }
        }
        columns.add(listed, layer, &mut block.sums);
    }
}

impl Listed {
    /// Adds the first `count` columns to the sums of their cells.
    fn add(&mut self, count: usize, layer: Real, sums: &mut [Sums]) {
        for l in 0..LISTED {
            let z = if self.z[l] > self.lowest[l] { self.z[l] } else { self.lowest[l] };
            let z = if z < self.highest[l] { z } else { self.highest[l] };
            let floor = z.floor();
            self.z[l] = z - floor;
            self.place[l] += floor * layer;
        }
        for l in 0..count.min(LISTED) {
            let (x, y, h, s) = (self.x[l], self.y[l], self.z[l], self.up[l]);
            let t = s * h;
            let piece: Sums = [t, t * x, t * y, t * h, s, s * x, s * y, s];
            for (sum, term) in sums[whole(self.place[l]) as usize].iter_mut().zip(piece) {
                *sum += term;
            }
        }
    }
}

/// A number of each column.
#[inline(always)]
fn lanes(value: impl FnMut(usize) -> Real) -> [Real; LANES] {
    std::array::from_fn(value)
}

/// A whole number from 0 to 2^32 - 1 out of its floating-point form, without a saturating cast.
#[inline(always)]
fn whole(value: Real) -> u32 {
    const SHIFT: Real = 4_503_599_627_370_496.0;
    (value + SHIFT).to_bits() as u32
}

/// Columns `from..to` of a row, under an upward (1) or downward (-1) facing triangle.
#[derive(Clone, Copy, Default)]
struct Span {
    up: Real,
    from: u32,
    to: u32,
    row: u32,
    triangle: u32,
}

/// Columns with a piece of surface.
struct Listed {
    /// Height of the plane of the piece, then that of the piece above the floor of its cell [cell edges].
    z: [Real; LISTED],
    lowest: [Real; LISTED],
    highest: [Real; LISTED],
    /// Place in the cell from its centre [cell edges].
    x: [Real; LISTED],
    y: [Real; LISTED],
    up: [Real; LISTED],
    /// Number of the cell in the lowest layer, then of that with the piece.
    place: [Real; LISTED],
}

impl Default for Listed {
    fn default() -> Self {
        let zeros = [0.0; LISTED];
        Self { z: zeros, lowest: zeros, highest: zeros, x: zeros, y: zeros, up: zeros, place: zeros }
    }
}

/// Triangles side by side, the corners of each from the lowest y to the highest.
struct Facets {
    corners: [[Abreast; 4]; 3],
    /// -1 where the corners were turned over by their sorting.
    sign: Abreast,
    /// dx/dy of the long edge, the lower short one, the upper short one.
    slopes: [Abreast; 3],
    /// Height of the plane over the columns, and its limits: the lowest and the highest corner.
    height: Abreast,
    along_x: Abreast,
    along_y: Abreast,
    lowest: Abreast,
    highest: Abreast,
}

impl Default for Facets {
    fn default() -> Self {
        let zeros = [0.0; ABREAST];
        Self {
            corners: [[zeros; 4]; 3],
            sign: zeros,
            slopes: [zeros; 3],
            height: zeros,
            along_x: zeros,
            along_y: zeros,
            lowest: zeros,
            highest: zeros,
        }
    }
}

impl Facets {
    fn evaluate(&mut self, nodes: &[Node], triangles: &[[u32; 3]]) {
        for (t, triangle) in triangles.iter().enumerate() {
            for (corner, &node) in self.corners.iter_mut().zip(triangle) {
                for (line, value) in corner.iter_mut().zip(nodes[node as usize]) {
                    line[t] = value;
                }
            }
        }
        for t in 0..ABREAST {
            let [first, second, third] = &self.corners;
            let node = |[x, y, z, row]: &[Abreast; 4]| [x[t], y[t], z[t], row[t]];
            let (mut a, mut b, mut c) = (node(first), node(second), node(third));
            let mut sign = 1.0;
            lower_first(&mut a, &mut b, &mut sign);
            lower_first(&mut b, &mut c, &mut sign);
            lower_first(&mut a, &mut b, &mut sign);
            for d in 0..4 {
                self.corners[0][d][t] = a[d];
                self.corners[1][d][t] = b[d];
                self.corners[2][d][t] = c[d];
            }
            self.sign[t] = sign;
            let slope = |low: Node, high: Node| (high[0] - low[0]) / (high[1] - low[1]);
            self.slopes[0][t] = slope(a, c);
            self.slopes[1][t] = slope(a, b);
            self.slopes[2][t] = slope(b, c);
            let [ux, uy, uz] = [b[0] - a[0], b[1] - a[1], b[2] - a[2]];
            let [vx, vy, vz] = [c[0] - a[0], c[1] - a[1], c[2] - a[2]];
            let area = ux * vy - uy * vx;
            // An upright triangle spans no columns except by round-off; then any height of its own will do.
            let inverse = if area == 0.0 { 0.0 } else { 1.0 / area };
            let along_x = (uz * vy - uy * vz) * inverse;
            let along_y = (ux * vz - uz * vx) * inverse;
            self.height[t] = a[2] - along_x * a[0] - along_y * a[1];
            self.along_x[t] = along_x;
            self.along_y[t] = along_y;
            self.lowest[t] = a[2].min(b[2]).min(c[2]);
            self.highest[t] = a[2].max(b[2]).max(c[2]);
        }
    }

    #[inline(always)]
    fn edges(&self, triangle: usize) -> Edges {
        let t = triangle % ABREAST;
        let [a, b, c] = &self.corners;
        Edges {
            rows: whole(a[3][t])..whole(c[3][t]),
            middle: whole(b[3][t]),
            long: [a[0][t], a[1][t], self.slopes[0][t]],
            short: [[a[0][t], a[1][t], self.slopes[1][t]], [b[0][t], b[1][t], self.slopes[2][t]]],
            up: self.sign[t],
            triangle: t as u32,
        }
    }
}

/// Exchanges two nodes, and turns the sign, where the second has the lower y.
#[inline(always)]
fn lower_first(a: &mut Node, b: &mut Node, sign: &mut Real) {
    let (p, q) = (*a, *b);
    let wrong = q[1] < p[1];
    for d in 0..4 {
        a[d] = if wrong { q[d] } else { p[d] };
        b[d] = if wrong { p[d] } else { q[d] };
    }
    *sign = if wrong { -*sign } else { *sign };
}

/// The edges of a triangle, each as x and y of its lower end and dx/dy.
struct Edges {
    rows: Range<u32>,
    /// First row along the upper of the two short edges.
    middle: u32,
    long: [Real; 3],
    short: [[Real; 3]; 2],
    /// Way that the triangle faces with the long edge on the left: up (1) or down (-1).
    up: Real,
    triangle: u32,
}

impl Edges {
    #[inline(always)]
    fn span(&self, row: u32) -> Span {
        let first = |[x, from, slope]: [Real; 3]| (x + (Real::from(row) - from) * slope).ceil();
        let left = first(self.long);
        let right = first(self.short[usize::from(row >= self.middle)]);
        let up = self.up * Real::copysign(1.0, right - left);
        let [left, right] = [whole(left), whole(right)];
        Span { up, from: left.min(right), to: left.max(right), row, triangle: self.triangle }
    }
}
