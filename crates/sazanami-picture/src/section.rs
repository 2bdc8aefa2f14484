//! Vertical section of a run: grains cut by the plane and those behind it, liquid, axes.

use sazanami_numerics::Vector;
use sazanami_numerics::grid::Grid;

use super::axes::{Axis, Frame, draw_colour_bar, draw_swatch};
use super::canvas::{Anchor, Canvas, Font, Pen, Rectangle};
use super::colour::{BLACK, BLUE, Light, mix, to_colour, to_light};
use super::raster::{EMPTY, INSIDE, Layer, Place, SAMPLES, is_front, reduce};
use super::scene::{Drawn, Scene, daylight};
use super::{ColourScale, Picture, PictureError, check_length, crater, text};
use sazanami::artist::BedSurface;
use sazanami_io::Bodies;

/// A section normal to x2 at one instant, seen along x2.
#[derive(Clone, Debug)]
pub struct SectionView<'a> {
    /// The grid; the picture shows its whole extent in x1.
    pub grid: &'a Grid,
    /// Height up to which it is shown \[m].
    pub top: f64,
    /// Place of the section on the x2 axis \[m].
    pub plane: f64,
    /// Line above the picture, for example case, time and speed.
    pub title: &'a str,
    /// Fraction of each cell of the section that is liquid, x1 fastest (see [`section_of_cells`]): drawn between the
    /// cells' centres, the fuller the darker, with a line where it is one half.
    pub liquid: &'a [f64],
    /// Grains, cut and behind the section; none for a picture of the liquid alone.
    pub bodies: Bodies<'a>,
    /// Values that colour the grains, one each.
    pub values: &'a [f64],
    /// Colours of the values; a bar beside the picture explains them if there are grains.
    pub scale: &'a ColourScale,
    /// Surface of the bed and crater, drawn over the grains and explained below them.
    pub surface: Option<&'a BedSurface>,
    /// Width of the section in the picture \[pixels]; less where it would be too high.
    pub width: usize,
}

/// Fractions on the plane `x2` \[m] from a cell field (without ghosts, x1 fastest): linear between the two nearest
/// layers of cells.
///
/// # Panics
/// If the field has fewer values than the grid cells.
#[must_use]
pub fn section_of_cells(grid: &Grid, values: &[f64], x2: f64) -> Vec<f64> {
    let [n1, n2, n3] = grid.cells;
    let place = ((x2 - grid.lower.y) / grid.spacing.y - 0.5).clamp(0.0, (n2 - 1) as f64);
    let first = (place as usize).min(n2.saturating_sub(2));
    let second = (first + 1).min(n2 - 1);
    let weight = place - first as f64;
    let mut section = Vec::with_capacity(n1 * n3);
    for k in 0..n3 {
        let row = |j: usize| &values[(k * n2 + j) * n1..][..n1];
        section.extend(row(first).iter().zip(row(second)).map(|(a, b)| a + (b - a) * weight));
    }
    section
}

/// Most pixels of a section: of a slender box it is narrower.
const MOST_PIXELS: f64 = 2e6;
/// Where there is less liquid none is shown (Yagyu et al. 2015).
const LEAST_LIQUID: f64 = 0.01;
/// Smallest detail of a grain that is drawn [samples].
const DETAIL: f64 = 3.0;
const SIZE: f64 = 20.0;
/// Direction of the sun.
const SUN: Vector = Vector::new(-0.45, -0.9, 0.85);

impl<'a> SectionView<'a> {
    /// The liquid alone, on the plane x2 = `plane` \[m]; grains come with [`Self::with_grains`].
    #[must_use]
    pub fn new(grid: &'a Grid, plane: f64, title: &'a str, liquid: &'a [f64], scale: &'a ColourScale) -> Self {
        Self {
            grid,
            top: grid.upper().z,
            plane,
            title,
            liquid,
            bodies: Bodies::none(),
            values: &[],
            scale,
            surface: None,
            width: 1000,
        }
    }

    /// The same with grains, cut and behind the section, and a value for the colour of each.
    #[must_use]
    pub fn with_grains(self, bodies: Bodies<'a>, values: &'a [f64]) -> Self {
        Self { bodies, values, ..self }
    }

    /// Draws the section.
    ///
    /// # Errors
    /// If the liquid does not have one value per cell of the section, or the grains not one value each.
    pub fn draw(&self) -> Result<Picture, PictureError> {
        let [n1, _, n3] = self.grid.cells;
        check_length("the liquid of a section", n1 * n3, self.liquid.len())?;
        check_length("the colour of a grain", self.bodies.poses.len(), self.values.len())?;
        let size @ [across, height] = self.pixels();
        let (left, top) = (96, 56);
        let has_bar = !self.bodies.poses.is_empty();
        let below = 80 + if self.surface.is_some() { crater::legend_height() } else { 0 };
        let width = left + across + if has_bar { 150 } else { 36 };
        let mut canvas = Canvas::new(width, top + height + below);
        canvas.paste(left, top, &self.render(size));
        let area = Rectangle {
            left: left as f64,
            top: top as f64,
            right: (left + across) as f64,
            bottom: (top + height) as f64,
        };
        let (lower, upper) = (1e3 * self.grid.lower, 1e3 * self.grid.upper());
        let x = Axis::linear("x₁ [mm]", lower.x, upper.x);
        let frame = Frame { area, x, y: Axis::linear("x₃ [mm]", lower.z, 1e3 * self.top), size: SIZE };
        canvas.clipped(area, |canvas| {
            self.draw_liquid_line(canvas, &frame);
            self.draw_outlines(canvas, &frame);
            if let Some(surface) = self.surface {
                crater::draw(canvas, &frame, surface);
            }
        });
        frame.draw(&mut canvas);
        if let Some(surface) = self.surface {
            crater::draw_legend(&mut canvas, [area.left, area.bottom + 72.0], width as f64 - area.left - 8.0, surface);
        }
        if has_bar {
            let bar = Rectangle { left: area.right + 28.0, right: area.right + 52.0, ..area };
            draw_colour_bar(&mut canvas, bar, self.scale, SIZE);
        }
        let size = text::fitted(self.title, 22.0, 0.98 * width as f64);
        let font = Font { size, colour: BLACK, across: Anchor::Middle, down: Anchor::Middle, upwards: false };
        canvas.text([0.5 * width as f64, 0.5 * area.top], self.title, font);
        if self.liquid.iter().any(|&fraction| fraction >= LEAST_LIQUID) {
            let label = if has_bar { "liquid" } else { "liquid, the fuller the darker; line: half full" };
            draw_swatch(&mut canvas, [area.right, area.bottom + 2.4 * SIZE], BLUE, label, 0.9 * SIZE);
        }
        Ok(canvas.finish())
    }

    /// Height that is shown \[m].
    fn height(&self) -> f64 {
        self.top - self.grid.lower.z
    }

    /// Width and height of the section in the picture [pixels].
    fn pixels(&self) -> [usize; 2] {
        let aspect = self.height() / self.grid.extent().x;
        let width = (self.width as f64).min((MOST_PIXELS / aspect).sqrt()).round().max(1.0);
        [width, (width * aspect).round().max(1.0)].map(|pixels| pixels as usize)
    }

    /// Picture of the section of so many pixels, without lines and labels.
    fn render(&self, pixels: [usize; 2]) -> Picture {
        let size = pixels.map(|pixels| pixels * SAMPLES);
        let grains = self.draw_grains(size);
        let scale = (size[0] as f64 / self.grid.extent().x) as f32;
        let haze_depth = 0.45 * self.grid.extent().y as f32 * scale;
        let (haze, water, paper) = (to_light([226, 231, 236]), to_light(BLUE), to_light([250, 251, 252]));
        let bodies = self.values.iter().map(|&value| to_light(self.scale.colour(value))).collect::<Vec<Light>>();
        let key = |sample: usize| grains.surface.nearest[sample];
        reduce(pixels, key, |sample, place| {
            let number = key(sample);
            if number != EMPTY && number & INSIDE != 0 {
                return bodies[grains.tags[grains.surface.corner(sample) as usize] as usize].map(|c| 0.93 * c);
            }
            let light = if number == EMPTY {
                paper
            } else {
                let [r, g, b, _] = grains.surface.interpolate(sample, place, &grains.light);
                mix([r, g, b], haze, 0.75 * (1.0 - (-grains.surface.depth[sample] / haze_depth).exp()))
            };
            let fraction = self.liquid_at(place, size);
            if fraction >= LEAST_LIQUID { mix(light, water, (0.10 + 0.64 * fraction.min(1.0)) as f32) } else { light }
        })
    }

    /// Liquid fraction at a place of the enlarged picture, between the centres of cells.
    fn liquid_at(&self, [across, down]: [f32; 2], size: [usize; 2]) -> f64 {
        let [n1, _, n3] = self.grid.cells;
        let x = f64::from(across) / size[0] as f64 * n1 as f64;
        let z = (1.0 - f64::from(down) / size[1] as f64) * self.height() / self.grid.spacing.z;
        let ([i, a], [k, c]) = (between(x, n1), between(z, n3));
        let row = |k: usize| {
            let next = (i as usize + 1).min(n1 - 1);
            self.liquid[k * n1 + i as usize] * (1.0 - a) + self.liquid[k * n1 + next] * a
        };
        row(k as usize) * (1.0 - c) + row((k as usize + 1).min(n3 - 1)) * c
    }

    /// Place of a point in the enlarged picture, with the distance behind the section as depth.
    fn place(&self, point: Vector, size: [usize; 2]) -> Place {
        let (lower, extent) = (self.grid.lower, self.grid.extent());
        let scale = size[0] as f64 / extent.x;
        [
            (point.x - lower.x) * scale,
            (1.0 - (point.z - lower.z) / self.height()) * size[1] as f64,
            (point.y - self.plane) * scale,
        ]
        .map(|v| v as f32)
    }

    /// Distance of the centre of body `number` behind the section \[m].
    fn distance_behind(&self, number: usize) -> f64 {
        self.bodies.poses[number].position.y - self.plane
    }

    /// Whether the section may cut each body.
    fn cut_bodies(&self) -> Vec<bool> {
        let radii = self.bodies.outer_radii();
        (0..radii.len()).map(|number| self.distance_behind(number).abs() <= radii[number]).collect()
    }

    fn draw_grains(&self, size: [usize; 2]) -> Drawn {
        let is_cut = self.cut_bodies();
        let detail = DETAIL * self.grid.extent().x / size[0] as f64;
        let is_drawn = |number: usize| is_cut[number] || self.distance_behind(number) > 0.0;
        let scene = Scene::of_bodies(&self.bodies, detail, is_drawn);
        let places: Vec<Place> = scene.places.iter().map(|&place| self.place(place, size)).collect();
        let is_seen = |triangle: &&[u32; 3]| {
            // Inner sides show only where the plane has cut the outer ones away.
            is_cut[scene.tags[triangle[0] as usize] as usize]
                || is_front(triangle.map(|corner| places[corner as usize]))
        };
        let triangles = scene.triangles.iter().filter(is_seen).copied().collect();
        let surface = Layer::draw(size, places, triangles, 0.0);
        let light =
            scene.shade(&daylight(SUN, -Vector::Y, 0.34), &surface, |body| self.scale.colour(self.values[body]));
        Drawn { surface, light, tags: scene.tags }
    }

    /// Line where the liquid fills half of the cells.
    fn draw_liquid_line(&self, canvas: &mut Canvas, frame: &Frame) {
        let [n1, _, n3] = self.grid.cells;
        let pen = Pen::new(1.6, [22, 70, 130]);
        let value = |i: usize, k: usize| self.liquid[k * n1 + i] - 0.5;
        let point = |x: f64, z: f64| {
            let centre = self.grid.lower + self.grid.spacing * (Vector::new(x, 0.0, z) + 0.5);
            frame.place([1e3 * centre.x, 1e3 * centre.z])
        };
        for k in 0..n3 - 1 {
            for i in 0..n1 - 1 {
                // Four triangles around the middle, so that no diagonal is preferred.
                let square = [[i, k], [i + 1, k], [i + 1, k + 1], [i, k + 1]];
                let [a, b, c, d] = square.map(|[i, k]| ([i as f64, k as f64], value(i, k)));
                if [b, c, d].iter().all(|corner| (corner.1 > 0.0) == (a.1 > 0.0)) {
                    continue;
                }
                let middle = ([i as f64 + 0.5, k as f64 + 0.5], 0.25 * (a.1 + b.1 + c.1 + d.1));
                for corners in [[a, b, middle], [b, c, middle], [c, d, middle], [d, a, middle]] {
                    let ends: Vec<_> = (0..3)
                        .map(|n| (corners[n], corners[(n + 1) % 3]))
                        .filter(|((_, fa), (_, fb))| (*fa > 0.0) != (*fb > 0.0))
                        .map(|((pa, fa), (pb, fb))| {
                            let s = fa / (fa - fb);
                            point(pa[0] + (pb[0] - pa[0]) * s, pa[1] + (pb[1] - pa[1]) * s)
                        })
                        .collect();
                    canvas.line(&ends, pen);
                }
            }
        }
    }

    /// Outlines of the grains where the section cuts them.
    fn draw_outlines(&self, canvas: &mut Canvas, frame: &Frame) {
        let mut nodes = Vec::new();
        let is_cut = self.cut_bodies();
        for number in (0..is_cut.len()).filter(|&number| is_cut[number]) {
            nodes.clear();
            self.bodies.for_each_node(number, |node| nodes.push(node));
            let dark = to_light(self.scale.colour(self.values[number])).map(|c| 0.16 * c);
            for triangle in self.bodies.surface(number).triangles {
                let ends = cut(triangle.map(|node| nodes[node as usize]), self.plane);
                if let Some(ends) = ends {
                    let ends = ends.map(|end| frame.place([1e3 * end.x, 1e3 * end.z]));
                    canvas.line(&ends, Pen::new(1.1, to_colour(dark)));
                }
            }
        }
    }
}

/// Lower neighbour among `count` centres and weight of the upper one, for a place in cells from the edge.
fn between(place: f64, count: usize) -> [f64; 2] {
    let place = (place - 0.5).clamp(0.0, (count - 1) as f64);
    [place.floor(), place - place.floor()]
}

/// Line in which a triangle meets the plane x2 = `plane`.
fn cut(corners: [Vector; 3], plane: f64) -> Option<[Vector; 2]> {
    let mut ends = [Vector::ZERO; 2];
    let mut count = 0;
    for n in 0..3 {
        let [a, b] = [corners[n], corners[(n + 1) % 3]];
        if (a.y > plane) != (b.y > plane) {
            ends[count] = a + (b - a) * ((plane - a.y) / (b.y - a.y));
            count += 1;
        }
    }
    (count == 2).then_some(ends)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_section_of_a_linear_field_is_exact() {
        let grid = Grid::new([3, 4, 2], Vector::ZERO, Vector::new(3.0, 4.0, 2.0));
        let values: Vec<f64> =
            (0..24).map(|n| f64::from(n % 3) + 10.0 * f64::from(n / 3 % 4) + 100.0 * f64::from(n / 12)).collect();
        assert_eq!(section_of_cells(&grid, &values, 2.0), [15., 16., 17., 115., 116., 117.]);
        assert_eq!(section_of_cells(&grid, &values, 1.75), [12.5, 13.5, 14.5, 112.5, 113.5, 114.5]);
        assert_eq!(section_of_cells(&grid, &values, 99.0)[0], 30.0);
        let flat = Grid::new([3, 1, 2], Vector::ZERO, Vector::ONE);
        assert_eq!(section_of_cells(&flat, &values[..6], 0.5), values[..6]);
    }

    #[test]
    fn sections_of_slender_boxes_are_narrow() {
        let scale = ColourScale { label: String::new(), range: [0.0, 1.0], map: crate::ColourMap::Sand };
        let pixels = |height: f64| {
            let grid = Grid::new([2, 2, 2], Vector::ZERO, Vector::new(1.0, 1.0, height));
            SectionView::new(&grid, 0.5, "", &[0.0; 4], &scale).pixels()
        };
        assert_eq!([pixels(0.75), pixels(2.0)], [[1000, 750], [1000, 2000]]);
        assert_eq!([pixels(1e-5), pixels(50.0)], [[1000, 1], [200, 10_000]]);
        let [width, height] = pixels(1e6);
        assert!(width == 1 && height <= 2_000_000);
    }

    #[test]
    fn a_triangle_meets_the_plane_in_a_line_or_not_at_all() {
        let corners = [Vector::ZERO, Vector::new(2.0, 2.0, 0.0), Vector::new(0.0, 2.0, 2.0)];
        let ends = cut(corners, 1.0).unwrap();
        assert_eq!(ends, [Vector::new(1.0, 1.0, 0.0), Vector::new(0.0, 1.0, 1.0)]);
        assert_eq!(cut(corners, 2.5), None);
        assert_eq!(cut(corners, -0.5), None);
    }
}
