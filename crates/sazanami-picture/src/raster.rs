//! Triangles to pixels, the nearest in front.

use sazanami_parallel::{Rows, for_each_chunk};

use super::colour::{Light, to_colour};
use super::{Colour, Picture};

/// Corner of a triangle: pixels across and down, depth away from the eye, light and opacity.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Corner {
    pub place: [f32; 3],
    pub light: [f32; 4],
}

/// Marks a pixel that no triangle covers.
pub(super) const EMPTY: u32 = u32::MAX;
/// Set in the tag of a pixel whose nearest triangle shows its inner side.
pub(super) const INSIDE: u32 = 1 << 31;

/// Nearest triangle at every pixel.
pub(super) struct Layer {
    pub width: usize,
    pub height: usize,
    pub depth: Vec<f32>,
    pub light: Vec<[f32; 4]>,
    /// What the triangle belongs to, or [`EMPTY`]; with [`INSIDE`] if it is seen from its inner side.
    pub tag: Vec<u32>,
}

impl Layer {
    pub fn new(width: usize, height: usize) -> Self {
        let pixels = width * height;
        Self {
            width,
            height,
            depth: vec![f32::INFINITY; pixels],
            light: vec![[0.0; 4]; pixels],
            tag: vec![EMPTY; pixels],
        }
    }

    /// Draws the parts of triangles that are not nearer than `nearest` nor hidden, band by band of the picture.
    /// Corners go anticlockwise seen from outside.
    pub fn draw(&mut self, triangles: &[Triangle], nearest: f32) {
        let Self { width, .. } = *self;
        let rows = (
            Rows { data: &mut self.depth[..], width },
            Rows { data: &mut self.light[..], width },
            Rows { data: &mut self.tag[..], width },
        );
        for_each_chunk(rows, BAND, |band, (depths, lights, tags)| {
            let top = (band * BAND) as f32;
            let height = depths.data.len() / width;
            for &Triangle { corners, tag } in triangles {
                let places = corners.map(|corner| [corner.place[0], corner.place[1] - top, corner.place[2]]);
                let tag = if is_front(places) { tag } else { tag | INSIDE };
                cover(places, [width, height], |pixel, depth, weights| {
                    if depth < depths.data[pixel] && depth >= nearest {
                        depths.data[pixel] = depth;
                        tags.data[pixel] = tag;
                        lights.data[pixel] = std::array::from_fn(|c| {
                            (0..3).map(|corner| weights[corner] * corners[corner].light[c]).sum()
                        });
                    }
                });
            }
        });
    }
}

/// Rows of a picture that are drawn at once.
const BAND: usize = 64;

/// A triangle and what it belongs to.
#[derive(Clone, Copy, Debug)]
pub(super) struct Triangle<'a> {
    pub corners: [&'a Corner; 3],
    pub tag: u32,
}

/// Twice the area of a triangle, positive if it is seen from outside (y points down).
fn turn(places: [[f32; 3]; 3]) -> f32 {
    let [a, b, c] = places;
    (b[1] - a[1]) * (c[0] - a[0]) - (b[0] - a[0]) * (c[1] - a[1])
}

/// Whether a triangle is seen from outside.
pub(super) fn is_front(places: [[f32; 3]; 3]) -> bool {
    turn(places) > 0.0
}

/// Calls `with(pixel, depth, weights of the corners)` for every pixel whose centre a triangle covers.
#[inline]
pub(super) fn cover(places: [[f32; 3]; 3], [width, height]: [usize; 2], mut with: impl FnMut(usize, f32, [f32; 3])) {
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
    let weight =
        |p: [f32; 3], q: [f32; 3], x: f32, y: f32| ((q[1] - p[1]) * (x - p[0]) - (q[0] - p[0]) * (y - p[1])) * scale;
    for row in rows {
        let y = row as f32 + 0.5;
        for column in columns.clone() {
            let x = column as f32 + 0.5;
            let weights = [weight(b, c, x, y), weight(c, a, x, y), weight(a, b, x, y)];
            if weights[0] >= 0.0 && weights[1] >= 0.0 && weights[2] >= 0.0 {
                let depth = weights[0] * a[2] + weights[1] * b[2] + weights[2] * c[2];
                with(row * width + column, depth, weights);
            }
        }
    }
}

/// Means of `samples` x `samples` blocks of light, as a picture.
pub(super) fn reduce(width: usize, height: usize, samples: usize, light: impl Fn(usize) -> Light + Sync) -> Picture {
    let mut pixels: Vec<Colour> = vec![[0; 3]; width * height];
    let weight = 1.0 / (samples * samples) as f32;
    for_each_chunk(&mut pixels[..], width, |y, row: &mut [Colour]| {
        for (x, pixel) in row.iter_mut().enumerate() {
            let mut sum = [0.0; 3];
            for n in 0..samples * samples {
                let index = (y * samples + n / samples) * width * samples + x * samples + n % samples;
                let part = light(index);
                sum = std::array::from_fn(|c| sum[c] + part[c].min(1.0));
            }
            *pixel = to_colour(sum.map(|s| s * weight));
        }
    });
    Picture { width, height, rgb: bytemuck::cast_vec(pixels) }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn corner(x: f32, y: f32, depth: f32) -> Corner {
        Corner { place: [x, y, depth], light: [x, y, depth, 1.0] }
    }

    #[test]
    fn the_nearer_triangle_wins_in_any_order() {
        let near = [corner(1.0, 1.0, 1.0), corner(1.0, 9.0, 1.0), corner(9.0, 1.0, 1.0)];
        let far = [corner(0.0, 0.0, 2.0), corner(0.0, 20.0, 2.0), corner(20.0, 0.0, 2.0)];
        let drawn = |order: [(&[Corner; 3], u32); 2]| {
            let mut layer = Layer::new(10, 10);
            layer.draw(&order.map(|(corners, tag)| Triangle { corners: corners.each_ref(), tag }), 0.0);
            layer
        };
        let layer = drawn([(&near, 1), (&far, 2)]);
        assert_eq!(layer.tag, drawn([(&far, 2), (&near, 1)]).tag);
        assert_eq!((layer.tag[22], layer.tag[0]), (1, 2));
        let light = layer.light[22];
        assert!((light[0] - 2.5).abs() < 1e-5 && (light[1] - 2.5).abs() < 1e-5, "corners' values are interpolated");
    }

    #[test]
    fn neighbours_leave_no_gap_and_the_inner_side_is_told() {
        let mut layer = Layer::new(64, 64);
        let centre = corner(31.3, 30.7, 1.0);
        let rim: Vec<_> = (0..13)
            .map(|n| (n as f32 * -0.483_322).sin_cos())
            .map(|(s, c)| corner(32.0 + 60.0 * c, 32.0 + 60.0 * s, 1.0))
            .collect();
        let fan: Vec<_> =
            (0..13).map(|n| Triangle { corners: [&centre, &rim[n], &rim[(n + 1) % 13]], tag: 7 }).collect();
        layer.draw(&fan, 0.0);
        assert!(layer.tag.iter().all(|&tag| tag == 7));
        let mut layer = Layer::new(64, 64);
        layer.draw(&[Triangle { corners: [&centre, &rim[1], &rim[0]], tag: 7 }], 0.0);
        assert!(layer.tag.contains(&(7 | INSIDE)) && !layer.tag.contains(&7));
    }

    #[test]
    fn what_is_too_near_is_cut_away() {
        let mut layer = Layer::new(10, 10);
        let corners = [corner(-10.0, -10.0, -1.0), corner(-10.0, 30.0, -1.0), corner(30.0, 5.0, 1.0)];
        layer.draw(&[Triangle { corners: corners.each_ref(), tag: 3 }], 0.0);
        let row = &layer.tag[50..60];
        assert!(row[..4].iter().all(|&tag| tag == EMPTY) && layer.depth.iter().all(|&depth| depth >= 0.0));
    }
}
