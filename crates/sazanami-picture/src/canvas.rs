//! A sheet of pixels to draw smooth lines, areas and text on. Lengths are pixels, y points down.

use super::colour::{Colour, WHITE};
use super::{Picture, text};

/// Position of a text relative to its point, across and down its own line.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum Anchor {
    Start,
    Middle,
    End,
}

/// Size, colour and position of a text.
#[derive(Clone, Copy)]
pub(super) struct Font {
    pub size: f64,
    pub colour: Colour,
    pub across: Anchor,
    /// `Start`: the point is at the top of the capitals, `End`: at the baseline.
    pub down: Anchor,
    /// Turned by 90 degrees, to be read from the right.
    pub upwards: bool,
}

/// Pen of a line.
#[derive(Clone, Copy)]
pub(super) struct Pen<'a> {
    pub width: f64,
    pub colour: Colour,
    /// Lengths of dashes and gaps in turn; empty for a whole line.
    pub dashes: &'a [f64],
}

impl Pen<'static> {
    pub const fn new(width: f64, colour: Colour) -> Self {
        Self { width, colour, dashes: &[] }
    }
}

/// A rectangle that nothing is drawn outside of.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Rectangle {
    pub left: f64,
    pub top: f64,
    pub right: f64,
    pub bottom: f64,
}

pub(super) struct Canvas {
    width: usize,
    height: usize,
    pixels: Vec<Colour>,
    clip: Rectangle,
}

impl Canvas {
    pub fn new(width: usize, height: usize) -> Self {
        let clip = Rectangle { left: 0.0, top: 0.0, right: width as f64, bottom: height as f64 };
        Self { width, height, pixels: vec![WHITE; width * height], clip }
    }

    pub fn finish(self) -> Picture {
        Picture { width: self.width, height: self.height, rgb: bytemuck::cast_vec(self.pixels) }
    }

    /// Draws with everything outside `clip` left alone.
    pub fn clipped(&mut self, clip: Rectangle, draw: impl FnOnce(&mut Self)) {
        let before = std::mem::replace(&mut self.clip, clip);
        draw(self);
        self.clip = before;
    }

    /// Copies a picture with its top left corner at (`x`, `y`).
    pub fn paste(&mut self, x: usize, y: usize, picture: &Picture) {
        for (row, pixels) in picture.pixels().chunks_exact(picture.width).enumerate() {
            let start = (y + row) * self.width + x;
            self.pixels[start..start + picture.width].copy_from_slice(pixels);
        }
    }

    fn cover(&mut self, x: i64, y: i64, colour: Colour, part: f64) {
        let inside = x >= 0 && y >= 0 && x < self.width as i64 && y < self.height as i64;
        if inside && part > 0.0 {
            let pixel = &mut self.pixels[y as usize * self.width + x as usize];
            for (old, new) in pixel.iter_mut().zip(colour) {
                *old = (f64::from(*old) + (f64::from(new) - f64::from(*old)) * part).round() as u8;
            }
        }
    }

    /// Covers pixels near `area` by `part(centre of the pixel)`.
    fn shade(&mut self, area: Rectangle, colour: Colour, part: impl Fn([f64; 2]) -> f64) {
        let clip = self.clip;
        let [left, right] = [area.left.max(clip.left), area.right.min(clip.right)];
        let [top, bottom] = [area.top.max(clip.top), area.bottom.min(clip.bottom)];
        for y in top.floor() as i64..bottom.ceil() as i64 {
            for x in left.floor() as i64..right.ceil() as i64 {
                self.cover(x, y, colour, part([x as f64 + 0.5, y as f64 + 0.5]));
            }
        }
    }

    /// Fills a rectangle, edges within a pixel included in proportion.
    pub fn rectangle(&mut self, area: Rectangle, colour: Colour, opacity: f64) {
        self.shade(area, colour, |[x, y]| {
            let across = (x + 0.5).min(area.right) - (x - 0.5).max(area.left);
            let down = (y + 0.5).min(area.bottom) - (y - 0.5).max(area.top);
            opacity * across.clamp(0.0, 1.0) * down.clamp(0.0, 1.0)
        });
    }

    /// Draws a line through `points` with round corners. It may cross itself, but is opaque.
    pub fn line(&mut self, points: &[[f64; 2]], pen: Pen) {
        if pen.dashes.is_empty() {
            points.windows(2).for_each(|ends| self.segment(ends[0], ends[1], pen));
        } else {
            dashes(points, pen.dashes, |a, b| self.segment(a, b, Pen { dashes: &[], ..pen }));
        }
    }

    fn segment(&mut self, a: [f64; 2], b: [f64; 2], pen: Pen) {
        let radius = pen.width.max(1.0) / 2.0;
        let faintness = pen.width.min(1.0);
        let reach = radius + 1.0;
        let along = [b[0] - a[0], b[1] - a[1]];
        let square = along[0] * along[0] + along[1] * along[1];
        let area = Rectangle {
            left: a[0].min(b[0]) - reach,
            right: a[0].max(b[0]) + reach,
            top: a[1].min(b[1]) - reach,
            bottom: a[1].max(b[1]) + reach,
        };
        self.shade(area, pen.colour, |p| {
            let from = [p[0] - a[0], p[1] - a[1]];
            let place =
                if square > 0.0 { ((from[0] * along[0] + from[1] * along[1]) / square).clamp(0.0, 1.0) } else { 0.0 };
            let distance = (from[0] - place * along[0]).hypot(from[1] - place * along[1]);
            faintness * (radius + 0.5 - distance).clamp(0.0, 1.0)
        });
    }

    /// Fills a polygon (even-odd rule), smoothed by 4 x 4 samples in a pixel.
    pub fn polygon(&mut self, corners: &[[f64; 2]], colour: Colour, opacity: f64) {
        let mut area = Rectangle { left: f64::MAX, right: f64::MIN, top: f64::MAX, bottom: f64::MIN };
        for &[x, y] in corners {
            area = Rectangle { left: area.left.min(x), right: area.right.max(x), ..area };
            area = Rectangle { top: area.top.min(y), bottom: area.bottom.max(y), ..area };
        }
        self.shade(area, colour, |[x, y]| {
            let sample = |n: i32| (f64::from(n) + 0.5) / 4.0 - 0.5;
            let hits = (0..16).filter(|n| inside(corners, [x + sample(n % 4), y + sample(n / 4)])).count();
            opacity * hits as f64 / 16.0
        });
    }

    /// Fills a disc.
    pub fn disc(&mut self, centre: [f64; 2], radius: f64, colour: Colour) {
        let reach = radius + 1.0;
        let [x, y] = centre;
        let area = Rectangle { left: x - reach, right: x + reach, top: y - reach, bottom: y + reach };
        self.shade(area, colour, |p| (radius + 0.5 - (p[0] - x).hypot(p[1] - y)).clamp(0.0, 1.0));
    }

    /// Writes a line of text at `point`.
    pub fn text(&mut self, point: [f64; 2], content: &str, font: Font) {
        let length = text::length(content, font.size);
        let across = match font.across {
            Anchor::Start => 0.0,
            Anchor::Middle => -length / 2.0,
            Anchor::End => -length,
        };
        // Capitals of DejaVu Sans are 0.729 em high.
        let down = match font.down {
            Anchor::Start => 0.729 * font.size,
            Anchor::Middle => 0.364 * font.size,
            Anchor::End => 0.0,
        };
        let corner =
            if font.upwards { [point[0] + down, point[1] - across] } else { [point[0] + across, point[1] + down] };
        let whole = corner.map(f64::floor);
        let part = [corner[0] - whole[0], corner[1] - whole[1]];
        let shift = if font.upwards { [1.0 - part[1], part[0]] } else { part };
        let [x0, y0] = whole.map(|v| v as i64);
        text::draw(content, font.size, shift, |x, y, cover| {
            let (x, y) = (i64::from(x), i64::from(y));
            let [x, y] = if font.upwards { [x0 + y, y0 - x] } else { [x0 + x, y0 + y] };
            self.cover(x, y, font.colour, f64::from(cover));
        });
    }
}

fn inside(corners: &[[f64; 2]], [x, y]: [f64; 2]) -> bool {
    let mut inside = false;
    let mut last = corners[corners.len() - 1];
    for &corner in corners {
        let crosses = (corner[1] > y) != (last[1] > y);
        if crosses && x < (last[0] - corner[0]) * (y - corner[1]) / (last[1] - corner[1]) + corner[0] {
            inside = !inside;
        }
        last = corner;
    }
    inside
}

/// Cuts a line into the pieces of `pattern`.
fn dashes(points: &[[f64; 2]], pattern: &[f64], mut piece: impl FnMut([f64; 2], [f64; 2])) {
    let (mut number, mut left) = (0, pattern[0]);
    for ends in points.windows(2) {
        let [a, b] = [ends[0], ends[1]];
        let length = (b[0] - a[0]).hypot(b[1] - a[1]);
        let at = |s: f64| [a[0] + (b[0] - a[0]) * s / length, a[1] + (b[1] - a[1]) * s / length];
        let mut done = 0.0;
        while done < length {
            let step = left.min(length - done);
            if number % 2 == 0 {
                piece(at(done), at(done + step));
            }
            done += step;
            left -= step;
            if left <= 0.0 {
                number = (number + 1) % (pattern.len() + pattern.len() % 2);
                left = pattern[number % pattern.len()];
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::colour::BLACK;

    fn ink(canvas: &Canvas) -> f64 {
        canvas.pixels.iter().map(|p| f64::from(255 - p[1]) / f64::from(255 - BLACK[1])).sum()
    }

    #[test]
    fn areas_have_their_size_wherever_they_lie() {
        for shift in [0.0, 0.25, 0.6] {
            let mut canvas = Canvas::new(60, 60);
            canvas.disc([30.0 + shift, 30.0], 10.0, BLACK);
            assert!((ink(&canvas) - 100.0 * std::f64::consts::PI).abs() < 1.5, "{}", ink(&canvas));
            let mut canvas = Canvas::new(60, 60);
            canvas.line(&[[10.0, 10.0 + shift], [50.0, 10.0 + shift]], Pen::new(3.0, BLACK));
            assert!((ink(&canvas) - (120.0 + 2.25 * std::f64::consts::PI)).abs() < 3.0, "{}", ink(&canvas));
            let mut canvas = Canvas::new(60, 60);
            canvas.polygon(&[[10.0 + shift, 10.0], [50.0, 10.0], [50.0, 50.0]], BLACK, 1.0);
            assert!((ink(&canvas) - 0.5 * (40.0 - shift) * 40.0).abs() < 12.0, "{}", ink(&canvas));
        }
    }

    #[test]
    fn nothing_is_drawn_outside_the_clip_or_the_sheet() {
        let mut canvas = Canvas::new(40, 30);
        let clip = Rectangle { left: 10.0, top: 10.0, right: 20.0, bottom: 20.0 };
        canvas.clipped(clip, |canvas| canvas.disc([20.0, 20.0], 50.0, BLACK));
        assert!((ink(&canvas) - 100.0).abs() < 1e-9);
        canvas.text(
            [-5.0, 29.0],
            "outside of everything",
            Font { size: 20.0, colour: BLACK, across: Anchor::Start, down: Anchor::Middle, upwards: true },
        );
    }

    #[test]
    fn dashes_have_their_lengths() {
        let mut pieces = Vec::new();
        dashes(&[[0.0, 0.0], [10.0, 0.0], [10.0, 6.0]], &[4.0, 3.0], |a, b| pieces.push((a, b)));
        assert_eq!(
            pieces,
            [
                ([0.0, 0.0], [4.0, 0.0]),
                ([7.0, 0.0], [10.0, 0.0]),
                ([10.0, 0.0], [10.0, 1.0]),
                ([10.0, 4.0], [10.0, 6.0])
            ]
        );
    }
}
