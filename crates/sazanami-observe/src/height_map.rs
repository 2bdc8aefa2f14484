//! The bed seen from above: height of the highest surface, and the grain it belongs to.

use std::ops::Range;

use sazanami_numerics::{Real, Vector};
use sazanami_parallel::for_each_chunk;

use crate::{BedView, Horizontal};

const NO_GRAIN: u32 = u32::MAX;

/// Square pixels over a rectangle of the horizontal plane, each with the highest surface over its centre.
#[derive(Clone, Debug, PartialEq)]
pub struct HeightMap {
    lower: Horizontal,
    spacing: Real,
    pixels: [usize; 2],
    height: Vec<Real>,
    grain: Vec<u32>,
}

impl HeightMap {
    /// An empty map over the rectangle from `lower` to `upper` \[m] with pixels of width `spacing` \[m].
    #[must_use]
    pub fn new(lower: Horizontal, upper: Horizontal, spacing: Real) -> Self {
        let pixels = [0, 1].map(|d| ((upper[d] - lower[d]) / spacing).ceil().max(0.0) as usize);
        let count = pixels[0] * pixels[1];
        Self { lower, spacing, pixels, height: vec![Real::NEG_INFINITY; count], grain: vec![NO_GRAIN; count] }
    }

    /// Draws the upper surfaces of `grains`, whose boxes are `bounds` by the number of the grain. The result depends
    /// neither on the order of the grains nor on the number of threads: a pixel keeps the highest surface, and of equal
    /// ones that of the grain with the smallest number.
    ///
    /// Strips of rows are drawn in parallel, each from the highest grain down, so that most hidden grains are skipped.
    pub fn add(&mut self, bed: &BedView, bounds: &[(Vector, Vector)], grains: &[usize]) {
        let &mut Self { lower, spacing, pixels, .. } = self;
        let strips = pixels[1].div_ceil(STRIP);
        let mut of_strip: Vec<Vec<usize>> = vec![Vec::new(); strips];
        let plane = Plane { lower, spacing, pixels };
        for &grain in grains {
            let (low, high) = bounds[grain];
            let rows = plane.centres_within(1, low.y, high.y);
            if !rows.is_empty() {
                of_strip[rows.start / STRIP..=(rows.end - 1) / STRIP].iter_mut().for_each(|strip| strip.push(grain));
            }
        }
        let chunk = STRIP * pixels[0].max(1);
        for_each_chunk((&mut self.height[..], &mut self.grain[..]), chunk, |number, (height, grain)| {
            let mut highest_first = of_strip[number].clone();
            highest_first.sort_unstable_by(|&a, &b| bounds[b].1.z.total_cmp(&bounds[a].1.z).then(a.cmp(&b)));
            let first = number * STRIP;
            let mut strip = Strip { plane, rows: first..first + height.len() / pixels[0], height, grain };
            highest_first.into_iter().for_each(|n| strip.add(bed, n, bounds[n]));
        });
    }

    /// Number of pixels in both directions.
    #[must_use]
    pub fn pixels(&self) -> [usize; 2] {
        self.pixels
    }

    /// Width of a pixel \[m].
    #[must_use]
    pub fn spacing(&self) -> Real {
        self.spacing
    }

    /// Centre of a pixel \[m].
    #[must_use]
    pub fn centre(&self, i: usize, j: usize) -> Horizontal {
        [(0, i), (1, j)].map(|(d, n)| self.lower[d] + (n as Real + 0.5) * self.spacing)
    }

    /// Height over a pixel \[m]; `None` where there is no grain.
    #[must_use]
    pub fn height(&self, i: usize, j: usize) -> Option<Real> {
        Some(self.height[j * self.pixels[0] + i]).filter(|z| z.is_finite())
    }

    /// Largest height \[m] over the pixels with centres in a rectangle.
    #[must_use]
    pub fn highest_within(&self, low: Horizontal, high: Horizontal) -> Option<Real> {
        let Self { lower, spacing, pixels, .. } = *self;
        let plane = Plane { lower, spacing, pixels };
        let [columns, rows] = [0, 1].map(|d| plane.centres_within(d, low[d], high[d]));
        rows.flat_map(|j| columns.clone().map(move |i| (i, j))).filter_map(|(i, j)| self.height(i, j)).reduce(Real::max)
    }

    /// Number of pixels at which each of `grains` grains is seen.
    #[must_use]
    pub fn pixels_seen(&self, grains: usize) -> Vec<u32> {
        let mut seen = vec![0; grains];
        for &grain in self.grain.iter().filter(|&&g| g != NO_GRAIN) {
            seen[grain as usize] += 1;
        }
        seen
    }
}

/// Rows of pixels that one thread draws at a time.
const STRIP: usize = 8;

/// Grid of the pixels of a map.
#[derive(Clone, Copy)]
struct Plane {
    lower: Horizontal,
    spacing: Real,
    pixels: [usize; 2],
}

impl Plane {
    /// Pixels of one direction whose centres lie between two coordinates.
    fn centres_within(&self, direction: usize, low: Real, high: Real) -> Range<usize> {
        let pixel = |x: Real| (x - self.lower[direction]) / self.spacing - 0.5;
        let count = self.pixels[direction];
        // Casts of negative numbers give zero.
        (pixel(low).ceil() as usize).min(count)..((pixel(high).floor() + 1.0) as usize).min(count)
    }
}

/// Some rows of a map.
struct Strip<'a> {
    plane: Plane,
    rows: Range<usize>,
    height: &'a mut [Real],
    grain: &'a mut [u32],
}

impl Strip<'_> {
    /// Pixels of the strip whose centres lie in a rectangle: columns, rows.
    fn within(&self, low: Vector, high: Vector) -> [Range<usize>; 2] {
        let rows = self.plane.centres_within(1, low.y, high.y);
        let rows = rows.start.max(self.rows.start)..rows.end.min(self.rows.end);
        [self.plane.centres_within(0, low.x, high.x), rows]
    }

    /// Place of a pixel in the strip.
    fn at(&self, i: usize, j: usize) -> usize {
        (j - self.rows.start) * self.plane.pixels[0] + i
    }

    /// Draws the upper surface of a grain, unless all of it is hidden.
    fn add(&mut self, bed: &BedView, grain: usize, (low, high): (Vector, Vector)) {
        let [columns, mut rows] = self.within(low, high);
        let is_hidden =
            |j: usize| self.height[self.at(columns.start, j)..][..columns.len()].iter().all(|&z| z > high.z);
        if columns.is_empty() || rows.all(is_hidden) {
            return;
        }
        let body = bed.body_of(grain);
        let (centre, turn, scale) = (bed.position[grain], bed.orientation[grain], bed.scale[grain]);
        for triangle in body.triangles {
            let corners = triangle.map(|n| centre + turn * (body.nodes[n as usize] * scale));
            self.draw(corners, grain as u32);
        }
    }

    fn draw(&mut self, [a, b, c]: [Vector; 3], grain: u32) {
        let twice_area = edge(a, b, c.x, c.y);
        if twice_area <= 0.0 {
            return; // seen from below or edge-on
        }
        let [columns, rows] = self.within(a.min(b).min(c), a.max(b).max(c));
        let Plane { lower, spacing, .. } = self.plane;
        for j in rows {
            let y = lower[1] + (j as Real + 0.5) * spacing;
            for i in columns.clone() {
                let x = lower[0] + (i as Real + 0.5) * spacing;
                let [wa, wb, wc] = [edge(b, c, x, y), edge(c, a, x, y), edge(a, b, x, y)];
                if wa >= 0.0 && wb >= 0.0 && wc >= 0.0 {
                    let z = (wa * a.z + wb * b.z + wc * c.z) / twice_area;
                    let at = self.at(i, j);
                    if z > self.height[at] || (z == self.height[at] && grain < self.grain[at]) {
                        self.height[at] = z;
                        self.grain[at] = grain;
                    }
                }
            }
        }
    }
}

/// Twice the area of the projected triangle `(a, b, (x, y))`, positive if counter-clockwise from above.
fn edge(a: Vector, b: Vector, x: Real, y: Real) -> Real {
    (b.x - a.x) * (y - a.y) - (b.y - a.y) * (x - a.x)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bed::test_bed::Bed;

    /// A map of all grains of a bed.
    fn map_of(bed: &BedView, lower: Horizontal, upper: Horizontal, spacing: Real) -> HeightMap {
        let mut map = HeightMap::new(lower, upper, spacing);
        map.add(bed, &bed.bounds(), &(0..bed.len()).collect::<Vec<_>>());
        map
    }

    #[test]
    fn the_higher_grain_hides_the_lower() {
        let bed = Bed::new(1.0, vec![Vector::new(0.0, 0.0, 5.0), Vector::ZERO, Vector::new(0.0, 1.2, 0.0)]);
        bed.view(|view| {
            let map = map_of(view, [-2.0, -2.0], [2.0, 2.0], 0.05);
            let seen = map.pixels_seen(3);
            assert_eq!(seen[1], 0);
            assert!(seen[0] > 200 && seen[0].abs_diff(seen[2]) < 8, "{seen:?}");
            assert_eq!(map.grain[40 * map.pixels[0] + 40], 0);
            let top = map.height(40, 40).unwrap();
            assert!((5.4..5.51).contains(&top), "{top}");
            assert_eq!(map.height(1, 1), None);
            let beside = map.highest_within([-0.5, 0.7], [0.5, 1.7]).unwrap();
            assert!((beside - view.top_of(2)).abs() < 0.03);
        });
    }

    #[test]
    fn the_order_of_the_grains_does_not_matter() {
        let positions = [0.0, 0.3, 0.7, 0.4].map(|x| Vector::new(x, 0.5 * x, 0.1 * x)).to_vec();
        let bed = Bed::new(1.0, positions);
        bed.view(|view| {
            let forward = map_of(view, [-1.0, -1.0], [2.0, 2.0], 0.03);
            let mut backward = HeightMap::new([-1.0, -1.0], [2.0, 2.0], 0.03);
            let bounds = view.bounds();
            (0..4).rev().for_each(|grain| backward.add(view, &bounds, &[grain]));
            assert_eq!(forward, backward);
        });
    }

    #[test]
    fn threads_and_strips_do_not_matter() {
        // Several layers over many strips: most grains are hidden.
        let bed = Bed::columns(1.0, 10.0, 6, |x| 2.0 + 0.2 * x);
        bed.view(|view| {
            let map = || map_of(view, [-10.0; 2], [10.0; 2], 0.125);
            let [one, four] = [1, 4].map(|threads| sazanami_parallel::with_threads(threads, map).unwrap());
            assert_eq!(one, four);
            let seen = one.pixels_seen(view.len());
            assert!(seen.contains(&0) && seen.iter().sum::<u32>() > 10_000);
            // Drawn grain by grain, lowest first, so that none is skipped.
            let mut each = HeightMap::new([-10.0; 2], [10.0; 2], 0.125);
            let (bounds, mut lowest) = (view.bounds(), (0..view.len()).collect::<Vec<_>>());
            lowest.sort_by(|&a, &b| bounds[a].1.z.total_cmp(&bounds[b].1.z));
            lowest.iter().for_each(|&grain| each.add(view, &bounds, &[grain]));
            assert_eq!(one, each);
        });
    }

    #[test]
    fn grains_outside_the_rectangle_are_cut() {
        let bed = Bed::new(1.0, vec![Vector::new(-3.0, 0.0, 0.0), Vector::new(0.9, 0.9, 0.0)]);
        bed.view(|view| {
            let seen = map_of(view, [0.0, 0.0], [1.0, 1.0], 0.1).pixels_seen(2);
            assert!(seen[0] == 0 && seen[1] > 10);
        });
    }
}
