//! Spherical grains in a slab across a tank, seen from the side, in several panels of colours (figure 3 of Tazaki,
//! Harada, Ikari and Gotoh, ripples in an oscillating tank).

use sazanami_numerics::Vector;

use super::axes::{Axis, Frame, draw_colour_bar};
use super::canvas::{Anchor, Canvas, Font, Pen, Rectangle};
use super::colour::{BLACK, BLUE, Colour, GREY, mix, to_colour, to_light};
use super::{ColourScale, Picture, PictureError, VectorWindow, check_length};

/// Size of numbers and captions, distances \[pixels].
const SIZE: f64 = 17.0;
const LEFT: f64 = 84.0;
const TOP: f64 = 50.0;
const CAPTION: f64 = 38.0;
const BELOW_PANEL: f64 = 26.0;
const BELOW_LAST: f64 = 64.0;
const BAR: f64 = 22.0;
const RIGHT: f64 = 128.0;
/// Panels are at least this high.
const LOWEST_PANEL: f64 = 90.0;
/// All panels together are as high as this at most, unless they would be narrower than [`NARROWEST`].
const HIGHEST: f64 = 2400.0;
const NARROWEST: f64 = 160.0;

const PLAIN: Colour = [196, 192, 184];
const HAZE: Colour = [228, 233, 238];

/// One panel: what colours the grains.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SlabPanel<'a> {
    /// A value per grain.
    pub values: &'a [f64],
    /// Colours of the values; the label stands above the panel.
    pub scale: &'a ColourScale,
}

/// Grains in a slab at one instant, seen along x2, in panels below each other.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SlabView<'a> {
    /// Line above the panels, for example the time.
    pub title: &'a str,
    /// Note on all panels, small above the first: which grains are drawn, for example.
    pub note: &'a str,
    /// Part of x1 shown \[m].
    pub x: [f64; 2],
    /// Part of x3 shown \[m].
    pub z: [f64; 2],
    /// Grains with their centres between these places on x2 are drawn \[m]: the whole width or a slab.
    pub slab: [f64; 2],
    /// Centres of the grains \[m].
    pub position: &'a [Vector],
    /// Diameters \[m].
    pub diameter: &'a [f64],
    /// Quantities of the grains, a panel for each, from the top.
    pub panels: &'a [SlabPanel<'a>],
    /// Points `(x1, x3)` of the water surface in the order of x1 \[m]; NaN where there is none.
    pub water: &'a [[f64; 2]],
    /// Velocities of the water in a window, which stands to the right of the panels and is outlined in them.
    pub vectors: Option<&'a VectorWindow<'a>>,
    /// Width of a panel \[pixels]; less where the panels would be too high together.
    pub width: usize,
}

impl SlabView<'_> {
    /// Draws the panels.
    ///
    /// # Errors
    /// If grains do not have one diameter and one value for each panel, or if there is no panel.
    pub fn draw(&self) -> Result<Picture, PictureError> {
        check_length("the diameter of a grain", self.position.len(), self.diameter.len())?;
        for panel in self.panels {
            check_length("the colour of a grain", self.position.len(), panel.values.len())?;
        }
        if self.panels.is_empty() {
            return Err(PictureError::WrongLength { what: "panels of a slab", expected: 1, found: 0 });
        }
        let aspect = (self.z[1] - self.z[0]) / (self.x[1] - self.x[0]);
        let width = (self.width as f64).min((HIGHEST / (self.panels.len() as f64 * aspect)).max(NARROWEST)).round();
        let height = (width * aspect).round().max(LOWEST_PANEL);
        let step = CAPTION + height + BELOW_PANEL;
        let count = self.panels.len() as f64;
        let bottom = TOP + count * step - BELOW_PANEL;
        let window_left = LEFT + width + RIGHT + LEFT;
        let window_area = self.vectors.map(|window| window.aspect()).transpose()?.map(|aspect| {
            // As high as the panels together, or less if it would be wider than they are.
            let high = (bottom - TOP - CAPTION).min(width * aspect);
            let top = TOP + CAPTION;
            Rectangle { left: window_left, top, right: window_left + high / aspect, bottom: top + high }
        });
        let right = window_area.map_or(LEFT + width + RIGHT, |area| area.right + 30.0);
        let mut canvas = Canvas::new(right.ceil() as usize, (bottom + BELOW_LAST).ceil() as usize);
        let font = Font { size: 23.0, colour: BLACK, across: Anchor::Middle, down: Anchor::Middle, upwards: false };
        canvas.text([0.5 * right, 0.5 * TOP], self.title, font);
        let order = self.back_to_front();
        for (number, panel) in self.panels.iter().enumerate() {
            let top = TOP + number as f64 * step + CAPTION;
            let area = Rectangle { left: LEFT, top, right: LEFT + width, bottom: top + height };
            let x_label = if number + 1 == self.panels.len() { "x₁ [mm]" } else { "" };
            let frame = frame(area, self.x, self.z, x_label);
            self.draw_slab(&mut canvas, &frame, &order, |grain| panel.scale.colour(panel.values[grain]));
            if let Some(window) = self.vectors {
                window.draw_outline(&mut canvas, &frame);
            }
            frame.draw(&mut canvas);
            caption(&mut canvas, &area, &panel.scale.label);
            if number == 0 {
                let across = Anchor::End;
                let font = Font { size: 0.9 * SIZE, colour: GREY, across, down: Anchor::End, upwards: false };
                canvas.text([area.right, area.top - 9.0], self.note, font);
            }
            let bar = Rectangle { left: area.right + 20.0, right: area.right + 20.0 + BAR, ..area };
            let unnamed = ColourScale { label: String::new(), ..panel.scale.clone() };
            draw_colour_bar(&mut canvas, bar, &unnamed, SIZE);
        }
        if let (Some(window), Some(area)) = (self.vectors, window_area) {
            let frame = frame(area, window.x, window.z, "x₁ [mm]");
            self.draw_slab(&mut canvas, &frame, &order, |_| PLAIN);
            window.draw(&mut canvas, &frame);
            frame.draw(&mut canvas);
            caption(&mut canvas, &area, "velocity of the water");
            window.draw_reference(&mut canvas, &frame, SIZE);
        }
        Ok(canvas.finish())
    }

    /// Grains of the slab that can be seen, those far away first; equally far ones in their order.
    fn back_to_front(&self) -> Vec<usize> {
        let is_in_slab = |grain: &usize| {
            let y = self.position[*grain].y;
            y >= self.slab[0] && y <= self.slab[1]
        };
        let mut order: Vec<usize> = (0..self.position.len()).filter(is_in_slab).collect();
        order.sort_by(|&a, &b| self.position[b].y.total_cmp(&self.position[a].y).then(a.cmp(&b)));
        order
    }

    fn draw_slab(&self, canvas: &mut Canvas, frame: &Frame, order: &[usize], colour: impl Fn(usize) -> Colour) {
        let area = frame.area;
        let scale = (area.right - area.left) / (1e-3 * (frame.x.upper - frame.x.lower));
        let depth = (self.slab[1] - self.slab[0]).max(f64::MIN_POSITIVE);
        let haze = to_light(HAZE);
        canvas.clipped(area, |canvas| {
            self.draw_water(canvas, frame);
            for &grain in order {
                let place = self.position[grain];
                let radius = 0.5 * self.diameter[grain] * scale;
                let centre = frame.place([1e3 * place.x, 1e3 * place.z]);
                let [x, y] = centre;
                let is_seen = x > area.left - radius
                    && x < area.right + radius
                    && y > area.top - radius
                    && y < area.bottom + radius;
                if !is_seen {
                    continue;
                }
                let far = (0.35 * (place.y - self.slab[0]) / depth) as f32;
                let light = to_light(colour(grain));
                let rim = if radius > 6.0 { 1.2 } else { 0.18 * radius };
                canvas.disc(centre, radius - 0.5, to_colour(mix(light.map(|c| 0.22 * c), haze, far)));
                canvas.disc(centre, radius - 0.5 - rim, to_colour(mix(light, haze, far)));
            }
            for wet in self.water.split(|point| !point[1].is_finite()) {
                let line: Vec<_> = wet.iter().map(|point| frame.place(point.map(|v| 1e3 * v))).collect();
                canvas.line(&line, Pen::new(2.0, BLUE));
            }
        });
    }

    /// Fills what lies below the water surface, column by column of pixels.
    fn draw_water(&self, canvas: &mut Canvas, frame: &Frame) {
        let Rectangle { bottom, .. } = frame.area;
        for ends in self.water.windows(2).filter(|ends| ends.iter().all(|point| point[1].is_finite())) {
            let [from, to] = [ends[0], ends[1]].map(|point| frame.place(point.map(|v| 1e3 * v)));
            for column in from[0].floor() as i64..to[0].ceil() as i64 {
                let (left, right) = (from[0].max(column as f64), to[0].min(column as f64 + 1.0));
                if right > left {
                    let part = (0.5 * (left + right) - from[0]) / (to[0] - from[0]);
                    let top = from[1] + (to[1] - from[1]) * part;
                    canvas.rectangle(Rectangle { left, top, right, bottom }, BLUE, 0.16);
                }
            }
        }
    }
}

/// A frame with axes in mm.
fn frame(area: Rectangle, x: [f64; 2], z: [f64; 2], x_label: &str) -> Frame {
    let [x, z] = [x, z].map(|range| range.map(|v| 1e3 * v));
    Frame { area, x: Axis::linear(x_label, x[0], x[1]), y: Axis::linear("x₃ [mm]", z[0], z[1]), size: SIZE }
}

fn caption(canvas: &mut Canvas, area: &Rectangle, text: &str) {
    let font = Font { size: 1.1 * SIZE, colour: BLACK, across: Anchor::Start, down: Anchor::End, upwards: false };
    canvas.text([area.left, area.top - 9.0], text, font);
}

#[cfg(test)]
mod tests {
    use super::*;

    const SCALE: f64 = 300.0 / 0.03;

    fn view<'a>(
        position: &'a [Vector],
        diameter: &'a [f64],
        panels: &'a [SlabPanel<'a>],
        slab: [f64; 2],
    ) -> SlabView<'a> {
        SlabView {
            title: "",
            note: "",
            x: [0.0, 0.03],
            z: [0.0, 0.02],
            slab,
            position,
            diameter,
            panels,
            water: &[],
            vectors: None,
            width: 300,
        }
    }

    /// Pixels of about that colour left of the bar.
    fn count(picture: &Picture, colour: Colour) -> f64 {
        let near = |pixel: &&[u8; 3]| (0..3).all(|c| pixel[c].abs_diff(colour[c]) < 8);
        let rows = picture.pixels().chunks(picture.width()).map(|row| &row[..(LEFT as usize + 300).min(row.len())]);
        rows.flatten().filter(near).count() as f64
    }

    #[test]
    fn grains_have_their_size_and_colour_and_near_ones_hide_far_ones() {
        let position =
            [Vector::new(0.010, 0.000, 0.010), Vector::new(0.010, 0.002, 0.010), Vector::new(0.02, 0.0, 0.01)];
        let scale = ColourScale::symmetric("f [N]", 1.0);
        let panels = [SlabPanel { values: &[1.0, -1.0, -1.0], scale: &scale }];
        let picture = view(&position, &[4e-3; 3], &panels, [0.0, 0.002]).draw().expect("a picture");
        let disc = std::f64::consts::PI * (2e-3 * SCALE - 1.7).powi(2);
        for value in [1.0, -1.0] {
            let found = count(&picture, scale.colour(value));
            assert!((found / disc - 1.0).abs() < 0.08, "{value}: {found} of {disc}");
        }
        // Without the near slab the far grain shows: the control.
        let picture = view(&position, &[4e-3; 3], &panels, [0.001, 0.003]).draw().expect("a picture");
        assert!(count(&picture, scale.colour(1.0)) < 0.1 * disc);
    }

    #[test]
    fn what_does_not_fit_is_refused() {
        let position = [Vector::ZERO];
        let scale = ColourScale::speed(1.0);
        let panels = [SlabPanel { values: &[], scale: &scale }];
        let wrong = view(&position, &[1.0], &panels, [0.0, 1.0]).draw();
        assert!(matches!(wrong, Err(PictureError::WrongLength { expected: 1, found: 0, .. })));
        assert!(view(&position, &[], &panels, [0.0, 1.0]).draw().is_err());
        assert!(view(&position, &[1.0], &[], [0.0, 1.0]).draw().is_err());
        let panels = [SlabPanel { values: &[0.0], scale: &scale }];
        let window = VectorWindow { x: [0.0, 0.0], z: [0.0, 1.0], vectors: &[], reference: 0.1 };
        let flat = SlabView { vectors: Some(&window), ..view(&position, &[1.0], &panels, [0.0, 1.0]) };
        assert!(flat.draw().is_err());
    }

    #[test]
    fn panels_of_a_deep_tank_stay_within_a_screen() {
        let scale = ColourScale::speed(0.1);
        let panels = [SlabPanel { values: &[], scale: &scale }; 3];
        let size = |z: f64| {
            let view = SlabView { z: [0.0, z], width: 1100, ..view(&[], &[], &panels, [0.0, 1.0]) };
            let picture = view.draw().expect("a picture");
            [picture.width(), picture.pixels().len() / picture.width()]
        };
        let [deep, flat] = [0.14, 0.002].map(size);
        assert!(deep[1] < 2700 && deep[0] < 600, "{deep:?}");
        // Control: a long tank has its full width.
        assert!(flat[0] > 1100 && flat[1] < 600, "{flat:?}");
        // Deeper still it is as narrow as can be read.
        assert!(size(3.0)[0] > 300);
    }

    #[test]
    fn water_and_arrows_are_drawn() {
        let panels = [SlabPanel { values: &[], scale: &ColourScale::speed(0.1) }];
        let dry = view(&[], &[], &panels, [0.0, 1.0]);
        let water = [[0.0, 0.01], [0.03, 0.01]];
        let wet = SlabView { water: &water, ..dry };
        let (dry_picture, wet_picture) = (dry.draw().expect("a picture"), wet.draw().expect("a picture"));
        let changed = dry_picture.pixels().iter().zip(wet_picture.pixels()).filter(|(a, b)| a != b).count();
        assert!((changed as f64 / (300.0 * 100.0) - 1.0).abs() < 0.05, "{changed}");
        let gap = SlabView { water: &[[0.0, 0.01], [0.01, 0.01], [0.02, f64::NAN], [0.03, 0.01]], ..dry };
        let gap = gap.draw().expect("a picture");
        let changed = dry_picture.pixels().iter().zip(gap.pixels()).filter(|(a, b)| a != b).count();
        assert!((changed as f64 / (100.0 * 100.0) - 1.0).abs() < 0.05, "{changed}");
        let fast = [([0.005, 0.005], [0.1, 0.0]), ([0.005, 0.006], [f64::NAN, 0.0])];
        let still = [([0.005, 0.005], [0.0, 0.0])];
        let arrows = |vectors| {
            let window = VectorWindow { x: [0.0, 0.01], z: [0.0, 0.01], vectors, reference: 0.1 };
            let picture = SlabView { vectors: Some(&window), ..wet }.draw().expect("a picture");
            picture.pixels().iter().filter(|&&pixel| pixel == [16, 60, 128]).count()
        };
        assert!(arrows(&fast) > arrows(&still) + 10, "{} {}", arrows(&fast), arrows(&still));
    }
}
