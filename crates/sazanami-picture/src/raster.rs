//! Triangles to pixels, the nearest in front.

use sazanami_parallel::{Rows, for_each_chunk};

use super::colour::{Light, Shades};
use super::{Colour, Picture};

/// Place of a corner: pixels across and down, depth away from the eye. One that cannot be seen is NaN.
pub(super) type Place = [f32; 3];

/// Marks a pixel that no triangle covers.
pub(super) const EMPTY: u32 = u32::MAX;
/// Set in the number of a triangle that shows its inner side.
pub(super) const INSIDE: u32 = 1 << 31;

/// Nearest triangle at every pixel.
pub(super) struct Layer {
    pub width: usize,
    pub depth: Vec<f32>,
    /// Number of the triangle, or [`EMPTY`]; with [`INSIDE`] if it is seen from its inner side.
    pub nearest: Vec<u32>,
    places: Vec<Place>,
    triangles: Vec<[u32; 3]>,
}

impl Layer {
    /// Draws the parts of triangles that are not nearer than `nearest` nor hidden, band by band of a picture of `size`.
    /// Corners go anticlockwise seen from outside; places have a number less than 2^31.
    pub fn draw([width, height]: [usize; 2], places: Vec<Place>, triangles: Vec<[u32; 3]>, nearest: f32) -> Self {
        let bands = bands(height, &places, &triangles);
        let pixels = width * height;
        let mut layer =
            Self { width, depth: vec![f32::INFINITY; pixels], nearest: vec![EMPTY; pixels], places, triangles };
        let (places, triangles) = (&layer.places, &layer.triangles);
        let rows = (Rows { data: &mut layer.depth[..], width }, Rows { data: &mut layer.nearest[..], width });
        for_each_chunk(rows, BAND, |band, (depths, numbers)| {
            let (top, height) = ((band * BAND) as f32, depths.data.len() / width);
            for &number in &bands[band] {
                let corners = triangles[number as usize].map(|corner| places[corner as usize]);
                let corners = corners.map(|[x, y, depth]| [x, y - top, depth]);
                let number = if is_front(corners) { number } else { number | INSIDE };
                cover(corners, [width, height], |pixel, depth| {
                    if depth < depths.data[pixel] && depth >= nearest {
                        depths.data[pixel] = depth;
                        numbers.data[pixel] = number;
                    }
                });
            }
        });
        layer
    }

    /// Whether each corner belongs to a triangle that is seen somewhere.
    pub fn seen_corners(&self) -> Vec<bool> {
        let mut seen = vec![false; self.places.len()];
        for number in self.nearest.iter().filter(|&&number| number != EMPTY) {
            self.triangles[(number & !INSIDE) as usize].iter().for_each(|&corner| seen[corner as usize] = true);
        }
        seen
    }

    /// First corner of the triangle at a pixel that is not empty.
    pub fn corner(&self, pixel: usize) -> u32 {
        self.triangles[(self.nearest[pixel] & !INSIDE) as usize][0]
    }

    /// Values of the corners at the point `at` of the triangle that is seen at `pixel`.
    pub fn interpolate<const N: usize>(&self, pixel: usize, [x, y]: [f32; 2], values: &[[f32; N]]) -> [f32; N] {
        let corners = self.triangles[(self.nearest[pixel] & !INSIDE) as usize];
        let [a, b, c] = corners.map(|corner| self.places[corner as usize]);
        let scale = 1.0 / turn([a, b, c]);
        let edge = |p: Place, q: Place| ((q[1] - p[1]) * (x - p[0]) - (q[0] - p[0]) * (y - p[1])) * scale;
        let (first, second) = (edge(b, c).clamp(0.0, 1.0), edge(c, a).clamp(0.0, 1.0));
        let weights = [first, second, 1.0 - first - second];
        let values = corners.map(|corner| values[corner as usize]);
        std::array::from_fn(|n| (0..3).map(|corner| weights[corner] * values[corner][n]).sum())
    }
}

/// Rows of a picture that are drawn at once.
const BAND: usize = 64;

/// Numbers of the triangles in each band of a picture.
fn bands(height: usize, places: &[Place], triangles: &[[u32; 3]]) -> Vec<Vec<u32>> {
    let mut bands = vec![Vec::new(); height.div_ceil(BAND)];
    for (number, triangle) in triangles.iter().enumerate() {
        let rows = triangle.map(|corner| places[corner as usize][1]);
        let (low, high) = (rows[0].min(rows[1]).min(rows[2]), rows[0].max(rows[1]).max(rows[2]));
        if high >= 0.0 {
            // The cast stops at 0; what lies below the picture belongs to no band.
            let (first, last) = (low as usize / BAND, high as usize / BAND);
            let end = bands.len().min(last + 1);
            bands[first.min(end)..end].iter_mut().for_each(|band| band.push(number as u32));
        }
    }
    bands
}

/// Twice the area of a triangle, positive if it is seen from outside (y points down).
fn turn([a, b, c]: [Place; 3]) -> f32 {
    (b[1] - a[1]) * (c[0] - a[0]) - (b[0] - a[0]) * (c[1] - a[1])
}

/// Whether a triangle is seen from outside.
pub(super) fn is_front(places: [Place; 3]) -> bool {
    turn(places) > 0.0
}

/// Calls `with(pixel, depth)` for every pixel whose centre a triangle covers.
#[inline]
pub(super) fn cover(places: [Place; 3], [width, height]: [usize; 2], mut with: impl FnMut(usize, f32)) {
    let [a, b, c] = places;
    let area = turn(places);
    let bounds = |direction: usize, limit: usize| {
        let low = a[direction].min(b[direction]).min(c[direction]);
        let high = a[direction].max(b[direction]).max(c[direction]);
        // Centres of pixels lie at halves; the casts stop at 0 and at the largest number.
        let first = (low - 0.5).ceil().max(0.0) as usize;
        let end = ((high - 0.5).floor() + 1.0).max(0.0) as usize;
        first..end.min(limit)
    };
    let (columns, rows) = (bounds(0, width), bounds(1, height));
    if columns.is_empty() || rows.is_empty() || !(area.abs() > 0.0 && area.is_finite()) {
        return;
    }
    let scale = 1.0 / area;
    // Weight of a corner: its edge function over the area, a linear function of the place.
    let weight = |p: Place, q: Place, x: f32, y: f32| ((q[1] - p[1]) * (x - p[0]) - (q[0] - p[0]) * (y - p[1])) * scale;
    for row in rows {
        let y = row as f32 + 0.5;
        let mut was_inside = false;
        for column in columns.clone() {
            let x = column as f32 + 0.5;
            let weights = [weight(b, c, x, y), weight(c, a, x, y), weight(a, b, x, y)];
            if weights[0] >= 0.0 && weights[1] >= 0.0 && weights[2] >= 0.0 {
                was_inside = true;
                with(row * width + column, weights[0] * a[2] + weights[1] * b[2] + weights[2] * c[2]);
            } else if was_inside {
                break;
            }
        }
    }
}

/// Samples of a pixel in each direction.
pub(super) const SAMPLES: usize = 2;

/// Means of [`SAMPLES`] x [`SAMPLES`] blocks of light, as a picture. `light` is asked once, for the middle, where the
/// samples of a pixel have the same `key`; it is given a sample and a point in units of samples.
pub(super) fn reduce<K: PartialEq>(
    [width, height]: [usize; 2],
    key: impl Fn(usize) -> K + Sync,
    light: impl Fn(usize, [f32; 2]) -> Light + Sync,
) -> Picture {
    let mut pixels: Vec<Colour> = vec![[0; 3]; width * height];
    let shades = Shades::new();
    for_each_chunk(&mut pixels[..], width, |y, row: &mut [Colour]| {
        for (x, pixel) in row.iter_mut().enumerate() {
            let (left, top) = (x * SAMPLES, y * SAMPLES);
            let sample = |n: usize| (top + n / SAMPLES) * width * SAMPLES + left + n % SAMPLES;
            let first = key(sample(0));
            *pixel = if (1..SAMPLES * SAMPLES).all(|n| key(sample(n)) == first) {
                let middle = 0.5 * SAMPLES as f32;
                shades.colour(light(sample(0), [left as f32 + middle, top as f32 + middle]))
            } else {
                let mut sum = [0.0; 3];
                for n in 0..SAMPLES * SAMPLES {
                    let place = [(left + n % SAMPLES) as f32 + 0.5, (top + n / SAMPLES) as f32 + 0.5];
                    let part = light(sample(n), place);
                    sum = std::array::from_fn(|c| sum[c] + part[c].min(1.0));
                }
                shades.colour(sum.map(|s| s / (SAMPLES * SAMPLES) as f32))
            };
        }
    });
    Picture { width, height, rgb: bytemuck::cast_vec(pixels) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_nearer_triangle_wins_in_any_order() {
        let near = [[1.0, 1.0, 1.0], [1.0, 9.0, 1.0], [9.0, 1.0, 1.0]];
        let far = [[0.0, 0.0, 2.0], [0.0, 20.0, 2.0], [20.0, 0.0, 2.0]];
        let places = [near, far].concat();
        let drawn = |triangles: [[u32; 3]; 2]| Layer::draw([10, 10], places.clone(), triangles.to_vec(), 0.0);
        let (layer, turned) = (drawn([[0, 1, 2], [3, 4, 5]]), drawn([[3, 4, 5], [0, 1, 2]]));
        assert!((0..100).all(|pixel| layer.corner(pixel) == turned.corner(pixel)));
        assert_eq!((layer.corner(22), layer.corner(0)), (0, 3));
        let [x, y, _] = layer.interpolate(22, [2.5, 2.75], &places);
        assert!((x - 2.5).abs() < 1e-5 && (y - 2.75).abs() < 1e-5, "corners' values are interpolated");
        let seen = layer.seen_corners();
        assert_eq!(seen, [true; 6]);
        let hidden = [near, [[0.0, 0.0, 0.5], [0.0, 90.0, 0.5], [90.0, 0.0, 0.5]]].concat();
        let layer = Layer::draw([10, 10], hidden, vec![[0, 1, 2], [3, 4, 5]], 0.0);
        assert_eq!(layer.seen_corners(), [false, false, false, true, true, true]);
    }

    #[test]
    fn neighbours_leave_no_gap_and_the_inner_side_is_marked() {
        let mut places = vec![[31.3, 30.7, 1.0]];
        let rim = (0..13).map(|n| (n as f32 * -0.483_322).sin_cos());
        places.extend(rim.map(|(s, c)| [32.0 + 60.0 * c, 32.0 + 60.0 * s, 1.0]));
        let fan = (0..13).map(|n| [0, n + 1, (n + 1) % 13 + 1]).collect();
        let layer = Layer::draw([64, 140], places.clone(), fan, 0.0);
        assert!(layer.nearest[..64 * 64].iter().all(|&number| number < 13));
        assert!(layer.nearest[64 * 100..].iter().all(|&number| number == EMPTY));
        let layer = Layer::draw([64, 64], places, vec![[0, 2, 1]], 0.0);
        assert!(layer.nearest.contains(&INSIDE) && !layer.nearest.contains(&0));
    }

    #[test]
    fn what_is_too_near_or_not_a_place_is_cut_away() {
        let places = vec![[-10.0, -10.0, -1.0], [-10.0, 30.0, -1.0], [20.0, 5.0, 1.0], [f32::NAN; 3]];
        let layer = Layer::draw([10, 10], places, vec![[0, 1, 2], [0, 1, 3]], 0.0);
        let row = &layer.nearest[50..60];
        assert!(row[..4].iter().all(|&number| number == EMPTY) && layer.depth.iter().all(|&depth| depth >= 0.0));
        assert!(row[9] == 0, "the far part is drawn");
    }
}
