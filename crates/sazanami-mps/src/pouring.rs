//! Initial positions of fluid particles between grains that lie unevenly, in heaps or columns: every part of the box gets
//! as many as its voids hold.
//!
//! The box is cut in two across its longest edge, in whole layers and so that both parts hold whole numbers of particles,
//! and so on until every part holds one. Clear fluid in a box of whole spacings becomes a cubic lattice.

use sazanami_numerics::grid::Grid;
use sazanami_numerics::{Real, Vector};

/// Cells per particle spacing.
pub const FINENESS: Real = 2.0;
/// Bisections that find a cut: to 1e-8 of an edge.
const BISECTIONS: usize = 27;
/// Slice at the end of a part, over its edge, and share of the mean below which it is taken for empty.
const END: Real = 1.0 / 16.0;
const EMPTY: Real = 0.1;

/// Equal cells of a box \[m] in which the share of fluid is given, for particles of spacing `spacing` \[m]. The box ends where
/// the liquid does, wherever that lies between whole spacings.
#[must_use]
pub fn cells(lower: Vector, upper: Vector, spacing: Real) -> Grid {
    let extent = upper - lower;
    Grid::new([0, 1, 2].map(|d| ((extent[d] / spacing * FINENESS).round() as usize).max(1)), lower, upper)
}

/// Position of cell `n` of a grid, x1 fastest.
#[must_use]
pub fn position(grid: &Grid, n: usize) -> [isize; 3] {
    let [nx, ny, _] = grid.cells;
    [n % nx, n / nx % ny, n / (nx * ny)].map(|i| i as isize)
}

/// Volume of fluid, in particles, below the corners of the cells.
struct Below {
    corners: [usize; 3],
    sums: Vec<Real>,
}

/// Part of the box, in cells.
#[derive(Clone, Copy)]
struct Part {
    low: [Real; 3],
    high: [Real; 3],
}

impl Part {
    fn below(self, d: usize, cut: Real) -> Self {
        let mut part = self;
        part.high[d] = cut;
        part
    }

    fn above(self, d: usize, cut: Real) -> Self {
        let mut part = self;
        part.low[d] = cut;
        part
    }
}

impl Below {
    fn of(grid: &Grid, share: &[Real], spacing: Real) -> Self {
        let cell = grid.cell_volume() / spacing.powi(3);
        let corners = grid.cells.map(|n| n + 1);
        let [nx, ny, nz] = corners;
        let mut sums = vec![0.0; nx * ny * nz];
        for k in 1..nz {
            for j in 1..ny {
                let mut row = 0.0;
                for i in 1..nx {
                    row += cell * share[(i - 1) + (nx - 1) * ((j - 1) + (ny - 1) * (k - 1))];
                    let at = |j: usize, k: usize| i + nx * (j + ny * k);
                    sums[at(j, k)] = row + sums[at(j - 1, k)] + sums[at(j, k - 1)] - sums[at(j - 1, k - 1)];
                }
            }
        }
        Self { corners, sums }
    }

    /// Fluid below a corner between those of the cells.
    fn at(&self, x: [Real; 3]) -> Real {
        let [nx, ny, _] = self.corners;
        let cell = [0, 1, 2].map(|d| (x[d] as usize).min(self.corners[d] - 2));
        let part = [0, 1, 2].map(|d| x[d] - cell[d] as Real);
        let base = cell[0] + nx * (cell[1] + ny * cell[2]);
        let along = |at: usize| self.sums[at] + part[0] * (self.sums[at + 1] - self.sums[at]);
        let plane = |at: usize| along(at) + part[1] * (along(at + nx) - along(at));
        plane(base) + part[2] * (plane(base + nx * ny) - plane(base))
    }

    fn within(&self, part: Part) -> Real {
        let Part { low: a, high: b } = part;
        let face = |x: Real| {
            self.at([x, b[1], b[2]]) - self.at([x, a[1], b[2]]) - self.at([x, b[1], a[2]]) + self.at([x, a[1], a[2]])
        };
        face(b[0]) - face(a[0])
    }

    /// Place along `d` of the cut below which `wanted` of a part lies: the least if there are several.
    fn cut(&self, part: Part, d: usize, wanted: Real) -> Real {
        let (mut low, mut high) = (part.low[d], part.high[d]);
        for _ in 0..BISECTIONS {
            let middle = 0.5 * (low + high);
            if self.within(part.below(d, middle)) < wanted {
                low = middle;
            } else {
                high = middle;
            }
        }
        high
    }

    /// A part without what is empty at its ends.
    fn trimmed(&self, mut part: Part, held: Real) -> Part {
        for d in 0..3 {
            let edge = END * (part.high[d] - part.low[d]);
            let is_empty = |slice: Part| self.within(slice) < EMPTY * END * held;
            let ends = [part.below(d, part.low[d] + edge), part.above(d, part.high[d] - edge)].map(is_empty);
            if ends[0] {
                part.low[d] = self.cut(part, d, 1e-9 * held);
            }
            if ends[1] {
                part.high[d] = self.cut(part, d, (1.0 - 1e-9) * held);
            }
        }
        part
    }
}

/// Positions of fluid particles of spacing `spacing` \[m] where `share` of each cell of `grid`, x1 fastest, is fluid: the
/// void fraction by the share of the cell in which liquid is poured.
#[must_use]
pub fn pour(grid: &Grid, share: &[Real], spacing: Real) -> Vec<Vector> {
    let below = Below::of(grid, share, spacing);
    let whole = Part { low: [0.0; 3], high: grid.cells.map(|n| n as Real) };
    let count = below.within(whole).round() as usize;
    let mut places = Vec::with_capacity(count);
    let mut parts = vec![(whole, count)];
    let step = grid.spacing * (1.0 / spacing);
    while let Some((part, count)) = parts.pop() {
        if count == 0 {
            continue;
        }
        let held = below.within(part);
        let part = below.trimmed(part, held);
        if count == 1 {
            let middle = [0, 1, 2].map(|d| below.cut(part, d, 0.5 * held));
            places.push(grid.lower + grid.spacing * Vector::from_array(middle));
            continue;
        }
        let edges = [0, 1, 2].map(|d| (part.high[d] - part.low[d]) * step[d]);
        let longest = (1..3).fold(0, |d, other| if edges[other] > edges[d] * (1.0 + 1e-6) { other } else { d });
        let size = (edges.iter().product::<Real>() / count as Real).cbrt();
        let layers = (edges[longest] / size).round().max(2.0);
        let first = (count as Real * (0.5 * layers).floor() / layers).round().clamp(1.0, count as Real - 1.0);
        let cut = below.cut(part, longest, first / count as Real * held);
        parts.push((part.above(longest, cut), count - first as usize));
        parts.push((part.below(longest, cut), first as usize));
    }
    places
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::filling::layers;

    const UPPER: Vector = Vector::new(24.0, 8.0, 20.0);

    fn centres(grid: &Grid) -> impl Iterator<Item = Vector> {
        (0..grid.len()).map(|n| position(grid, n)).map(|[i, j, k]| grid.centre(i, j, k))
    }

    fn poured(upper: Vector, share: impl Fn(Vector) -> Real) -> Vec<Vector> {
        let grid = cells(Vector::ZERO, upper, 1.0);
        pour(&grid, &centres(&grid).map(share).collect::<Vec<_>>(), 1.0)
    }

    /// Number of places under a soft mask, so that whole rows on a rim do not count at once.
    fn number(places: &[Vector], mask: impl Fn(Vector) -> Real) -> Real {
        places.iter().map(|place| mask(*place)).sum()
    }

    /// Liquid of `share` under a mask, in particles.
    fn held(share: impl Fn(Vector) -> Real, mask: impl Fn(Vector) -> Real) -> Real {
        let fine = cells(Vector::ZERO, UPPER, 0.5);
        centres(&fine).map(|x| share(x) * mask(x) * fine.cell_volume()).sum()
    }

    /// From 0 to 1 over 4 spacings about a distance of zero.
    fn ramp(distance: Real) -> Real {
        (0.5 + 0.25 * distance).clamp(0.0, 1.0)
    }

    #[test]
    fn clear_water_is_a_cubic_lattice() {
        let places = poured(Vector::new(4.0, 3.0, 9.0), |x| if x.z < 5.0 { 1.0 } else { 0.0 });
        assert_eq!(places.len(), 60);
        let is_node = |x: &Vector| (*x - Vector::splat(0.5) - (*x - Vector::splat(0.5)).round()).length() < 1e-5;
        assert!(places.iter().all(is_node), "{places:?}");
    }

    #[test]
    fn a_column_and_a_heap_hold_what_their_voids_hold() {
        let column = |x: Vector| (8.0 - x.x).min(12.0 - x.z);
        let heap = |x: Vector| (12.0 - x.z - (x.x - 12.0).abs()) / 2.0_f64.sqrt();
        let bodies: [&dyn Fn(Vector) -> Real; 2] = [&column, &heap];
        for inside in bodies {
            // As void fractions are: smooth over a few spacings.
            let void = |x: Vector| 1.0 - 0.6 * ramp(inside(x));
            let share = |x: Vector| if x.z < 15.0 { void(x) } else { 0.0 };
            let mask = |x: Vector| ramp(inside(x) - 2.0);
            let places = poured(UPPER, share);
            let (found, expected) = (number(&places, mask), held(share, mask));
            assert!((found / expected - 1.0).abs() < 0.01, "{found} {expected}");
            let whole = held(share, |_| 1.0);
            assert!((places.len() as Real - whole).abs() < 0.01 * whole, "{} {whole}", places.len());
            let apart = |a: usize| {
                let others = places.iter().enumerate().filter(|(b, _)| *b != a);
                others.map(|(_, other)| (*other - places[a]).length()).fold(Real::INFINITY, Real::min)
            };
            let least = (0..places.len()).map(apart).fold(Real::INFINITY, Real::min);
            assert!(least > 0.5, "{least}");
            // Negative control: layers by the mean of a height.
            let mean = |z: Real| {
                let along = (0..240).map(|n| void(Vector::new(0.1 * (Real::from(n) + 0.5), 4.0, z)));
                along.sum::<Real>() / 240.0
            };
            let layered = number(&layers(Vector::ZERO, UPPER, 15.0, 1.0, mean), mask);
            assert!(layered > 1.3 * expected, "{layered} {expected}");
        }
    }

    #[test]
    fn slopes_of_void_fraction_and_parts_without_liquid_are_followed() {
        let void = |x: Vector| if x.x < 10.0 { 0.3 + 0.07 * x.x } else { 0.0 };
        let places = poured(UPPER, void);
        for (a, b) in [(0.0, 4.0), (3.0, 7.0), (6.0, 10.0)] {
            let mask = |x: Vector| ramp(x.x - a) * ramp(b - x.x);
            let (found, expected) = (number(&places, mask), held(void, mask));
            assert!((found / expected - 1.0).abs() < 0.02, "{a} {found} {expected}");
        }
        assert!(places.iter().all(|x| x.x < 10.5));
        assert!(poured(UPPER, |_| 0.0).is_empty());
    }
}
