//! Velocity vectors in a window of a section.

use super::PictureError;
use super::axes::Frame;
use super::canvas::{Anchor, Canvas, Font, Pen, Rectangle};
use super::colour::{BLACK, Colour, WHITE};

/// Colour of the arrows.
const ARROW: Colour = [16, 60, 128];
/// Arrows shorter than this are points \[pixels].
const SHORTEST: f64 = 1.5;

/// Velocities of the water in a part of a section, on points of a grid.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct VectorWindow<'a> {
    /// Bounds in x1 \[m].
    pub x: [f64; 2],
    /// Bounds in x3 \[m].
    pub z: [f64; 2],
    /// Places (x1, x3) \[m] and velocities there [m/s].
    pub vectors: &'a [([f64; 2], [f64; 2])],
    /// Speed of the arrow in the caption [m/s]; it is a tenth of the window long.
    pub reference: f64,
}

impl VectorWindow<'_> {
    /// Height over width.
    pub(super) fn aspect(&self) -> Result<f64, PictureError> {
        let aspect = (self.z[1] - self.z[0]) / (self.x[1] - self.x[0]);
        if aspect.is_finite() && aspect > 0.0 && self.reference > 0.0 {
            Ok(aspect)
        } else {
            Err(PictureError::WrongLength { what: "the extent of a window of vectors", expected: 1, found: 0 })
        }
    }

    fn arrow_scale(&self, area: &Rectangle) -> f64 {
        (area.right - area.left) / 10.0 / self.reference
    }

    /// Draws the arrows into the frame, whose axes are in mm.
    pub(super) fn draw(&self, canvas: &mut Canvas, frame: &Frame) {
        let scale = self.arrow_scale(&frame.area);
        canvas.clipped(frame.area, |canvas| {
            for (place, velocity) in self.vectors {
                let from = frame.place(place.map(|v| 1e3 * v));
                draw_arrow(canvas, from, [velocity[0] * scale, -velocity[1] * scale]);
            }
        });
    }

    /// Draws the arrow of the reference speed with its value so that it ends at `right`.
    pub(super) fn draw_reference(&self, canvas: &mut Canvas, frame: &Frame, size: f64) {
        let y = frame.area.top - 0.9 * size;
        let length = self.arrow_scale(&frame.area) * self.reference;
        draw_arrow(canvas, [frame.area.right - length, y], [length, 0.0]);
        let font = Font { size, colour: BLACK, across: Anchor::End, down: Anchor::Middle, upwards: false };
        canvas.text([frame.area.right - length - 8.0, y], &format!("{} m/s", self.reference), font);
    }

    /// Draws the outline of the window into a frame, whose axes are in mm.
    pub(super) fn draw_outline(&self, canvas: &mut Canvas, frame: &Frame) {
        let corner = |i: usize, k: usize| frame.place([1e3 * self.x[i], 1e3 * self.z[k]]);
        let outline = [corner(0, 0), corner(1, 0), corner(1, 1), corner(0, 1), corner(0, 0)];
        canvas.clipped(frame.area, |canvas| {
            // On light and dark grains alike.
            canvas.line(&outline, Pen::new(3.6, WHITE));
            canvas.line(&outline, Pen { width: 2.0, colour: BLACK, dashes: &[9.0, 5.0] });
        });
    }
}

fn draw_arrow(canvas: &mut Canvas, [x, y]: [f64; 2], [along, down]: [f64; 2]) {
    let length = along.hypot(down);
    if !length.is_finite() {
        return;
    }
    if length < SHORTEST {
        canvas.disc([x, y], 1.0, ARROW);
        return;
    }
    let [cosine, sine] = [along / length, down / length];
    let head = (0.38 * length).clamp(2.5, 9.0).min(length);
    let point =
        |forwards: f64, aside: f64| [x + forwards * cosine - aside * sine, y + forwards * sine + aside * cosine];
    canvas.line(&[[x, y], point(length - 0.8 * head, 0.0)], Pen::new(1.6, ARROW));
    let corners = [point(length, 0.0), point(length - head, 0.42 * head), point(length - head, -0.42 * head)];
    canvas.polygon(&corners, ARROW, 1.0);
}
