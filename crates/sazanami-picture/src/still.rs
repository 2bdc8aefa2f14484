//! Three-dimensional picture of a run: grains and liquid in perspective.

use sazanami_numerics::Vector;
use sazanami_numerics::grid::Grid;

use super::axes::{draw_colour_bar, draw_swatch};
use super::canvas::{Anchor, Canvas, Font, Pen, Rectangle};
use super::colour::{BLACK, BLUE, GREY, Light, mix, to_light};
use super::raster::{EMPTY, Layer, Place, SAMPLES, is_front, reduce};
use super::scene::{Drawn, Scene, daylight};
use super::{ColourScale, Isosurface, Picture, PictureError, check_length, text};
use sazanami_io::Bodies;

/// Direction of the eye.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Viewpoint {
    /// Direction of the eye seen from above, from the x1 axis towards x2 \[degrees].
    pub azimuth: f64,
    /// Height of the eye above the horizon \[degrees], below 90.
    pub elevation: f64,
}

impl Default for Viewpoint {
    fn default() -> Self {
        Self { azimuth: -62.0, elevation: 24.0 }
    }
}

/// A still of grains and liquid.
#[derive(Clone, Debug)]
pub struct Still<'a> {
    /// The box, drawn by its edges.
    pub grid: &'a Grid,
    /// Height up to which the box is shown \[m].
    pub top: f64,
    /// Direction of the eye.
    pub viewpoint: Viewpoint,
    /// Line above the picture, or nothing.
    pub title: &'a str,
    /// Grains.
    pub bodies: Bodies<'a>,
    /// Values that colour the grains, one each.
    pub values: &'a [f64],
    /// Colours of the values; a bar beside the picture explains them.
    pub scale: &'a ColourScale,
    /// Surface of the liquid.
    pub liquid: Option<&'a Isosurface>,
    /// Whether what lies on the side of the eye of the plane through the middle of the box, normal to x2, is left out: the
    /// liquid there, and grains that lie there as a whole. A note in the picture says so.
    pub cut_open: bool,
    /// Width and height of the view, without title and bar \[pixels].
    pub size: [usize; 2],
}

/// Room above the picture for the title and beside it for the bar of colours \[pixels].
const ABOVE: usize = 56;
const BESIDE: usize = 130;
/// Note in a picture that is cut open.
const CUT_NOTE: &str = "front half left out";
/// Smallest detail of a grain that is drawn [samples].
const DETAIL: f64 = 3.0;
/// Tangent of half the height of the picture seen from the eye.
const HALF_VIEW: f64 = 0.23;

/// The eye, and how it sees a point.
struct Camera {
    eye: Vector,
    right: Vector,
    up: Vector,
    forward: Vector,
    /// Pixels per unit of tangent.
    focus: f64,
    middle: [f64; 2],
}

impl Camera {
    /// A camera that sees the whole of a box between two corners.
    fn new(viewpoint: &Viewpoint, [lower, upper]: [Vector; 2], [width, height]: [usize; 2]) -> Self {
        let extent = upper - lower;
        let [azimuth, elevation] = [viewpoint.azimuth, viewpoint.elevation.clamp(-89.0, 89.0)].map(f64::to_radians);
        let towards_eye =
            Vector::new(elevation.cos() * azimuth.cos(), elevation.cos() * azimuth.sin(), elevation.sin());
        let right = Vector::Z.cross(towards_eye).normalize();
        let up = towards_eye.cross(right);
        let centre = lower + 0.5 * extent;
        let across = HALF_VIEW * width as f64 / height as f64;
        let corners =
            (0..8).map(|n| lower + extent * Vector::new((n & 1) as f64, (n >> 1 & 1) as f64, (n >> 2) as f64));
        let distance = corners.fold(0.0, |distance: f64, corner| {
            let from = corner - centre;
            let needed = (from.dot(right).abs() / across).max(from.dot(up).abs() / HALF_VIEW);
            distance.max(needed + from.dot(towards_eye))
        });
        Self {
            eye: centre + towards_eye * (1.03 * distance),
            right,
            up,
            forward: -towards_eye,
            focus: height as f64 / (2.0 * HALF_VIEW),
            middle: [width as f64 / 2.0, height as f64 / 2.0],
        }
    }

    /// Pixels across and down, and a depth that is linear on the picture; NaN behind the eye.
    fn place(&self, point: Vector) -> Place {
        let from = point - self.eye;
        let distance = from.dot(self.forward);
        let place = [
            self.middle[0] + self.focus * from.dot(self.right) / distance,
            self.middle[1] - self.focus * from.dot(self.up) / distance,
            -1.0 / distance,
        ];
        place.map(|v| if distance > 0.0 { v as f32 } else { f32::NAN })
    }
}

impl<'a> Still<'a> {
    /// Grains in their box, seen from the usual viewpoint.
    #[must_use]
    pub fn new(grid: &'a Grid, title: &'a str, bodies: Bodies<'a>, values: &'a [f64], scale: &'a ColourScale) -> Self {
        Self {
            grid,
            top: grid.upper().z,
            viewpoint: Viewpoint::default(),
            title,
            bodies,
            values,
            scale,
            liquid: None,
            cut_open: false,
            size: [1100, 700],
        }
    }

    /// The same as wide as `width` \[pixels] and as high as what is shown needs.
    #[must_use]
    pub fn fitted(self, width: usize) -> Self {
        let [lower, upper] = self.shown();
        let extent = upper - lower;
        let [azimuth, elevation] = [self.viewpoint.azimuth, self.viewpoint.elevation].map(f64::to_radians);
        let [right, up, deep] = [
            [azimuth.sin().abs(), azimuth.cos().abs(), 0.0],
            [elevation.sin() * azimuth.cos().abs(), elevation.sin() * azimuth.sin().abs(), elevation.cos()],
            [elevation.cos() * azimuth.cos().abs(), elevation.cos() * azimuth.sin().abs(), elevation.sin()],
        ]
        .map(|direction| extent.dot(Vector::from_array(direction)));
        // The near side is larger to the eye.
        let nearer = 1.0 + HALF_VIEW * deep / up.max(right);
        Self { size: [width, (width as f64 * (up / right * nearer).clamp(0.3, 1.2)).round() as usize], ..self }
    }

    /// Draws the still.
    ///
    /// # Errors
    /// If the grains do not have one value each.
    pub fn draw(&self) -> Result<Picture, PictureError> {
        check_length("the colour of a grain", self.bodies.poses.len(), self.values.len())?;
        let [width, height] = self.size;
        let camera = Camera::new(&self.viewpoint, self.shown(), self.samples());
        let grains = self.draw_grains(&camera);
        let liquid = self.draw_liquid(&camera);
        let (top, bottom) = (to_light([214, 226, 238]), to_light([250, 250, 250]));
        let rows = (height * SAMPLES) as f32;
        let in_front =
            |sample: usize| liquid.as_ref().filter(|l| l.surface.depth[sample] < grains.surface.depth[sample]);
        let key = |sample: usize| (grains.surface.nearest[sample], in_front(sample).map(|l| l.surface.nearest[sample]));
        let picture = reduce([width, height], key, |sample, place| {
            let mut light = if grains.surface.nearest[sample] == EMPTY {
                mix(top, bottom, place[1] / rows)
            } else {
                opaque(grains.surface.interpolate(sample, place, &grains.light))
            };
            if let Some(liquid) = in_front(sample) {
                let water = liquid.surface.interpolate(sample, place, &liquid.light);
                light = mix(light, opaque(water), water[3]);
            }
            light
        });
        let mut canvas = Canvas::new(width, height);
        canvas.paste(0, 0, &picture);
        self.draw_box(&mut canvas, &camera, &grains.surface, liquid.as_ref().map(|liquid| &liquid.surface));
        let picture = canvas.finish();
        let mut canvas = Canvas::new(width + BESIDE, ABOVE + height);
        canvas.paste(0, ABOVE, &picture);
        let size = text::fitted(self.title, 24.0, (width + BESIDE) as f64 - 40.0);
        let font = Font { size, colour: BLACK, across: Anchor::Start, down: Anchor::Start, upwards: false };
        canvas.text([26.0, 22.0], self.title, font);
        if self.liquid.is_some() {
            draw_swatch(&mut canvas, [width as f64 - 14.0, (ABOVE + height) as f64 - 20.0], BLUE, "liquid", 18.0);
        }
        if self.cut_open {
            let bottom = (ABOVE + height) as f64 - 14.0;
            let note = Font { size: 17.0, colour: GREY, down: Anchor::End, ..font };
            canvas.text([26.0, bottom], CUT_NOTE, note);
        }
        let (left, middle) = (width as f64 + 22.0, ABOVE as f64 + height as f64 / 2.0);
        let bar = Rectangle { left, right: left + 22.0, top: middle - 200.0, bottom: middle + 200.0 };
        draw_colour_bar(&mut canvas, bar, self.scale, 18.0);
        Ok(canvas.finish())
    }

    /// Size of the enlarged picture [samples].
    fn samples(&self) -> [usize; 2] {
        self.size.map(|pixels| pixels * SAMPLES)
    }

    /// Lower and upper corner of what is shown \[m].
    fn shown(&self) -> [Vector; 2] {
        let (lower, upper) = (self.grid.lower, self.grid.upper().with_z(self.top));
        let middle = 0.5 * (lower.y + upper.y);
        let eye_is_beyond = self.viewpoint.azimuth.to_radians().sin() > 0.0;
        match (self.cut_open, eye_is_beyond) {
            (false, _) => [lower, upper],
            (true, false) => [lower.with_y(middle), upper],
            (true, true) => [lower, upper.with_y(middle)],
        }
    }

    /// Whether the cut takes away all of what lies within `radius` \[m] of a point.
    fn is_cut_away(&self, point: Vector, radius: f64, camera: &Camera) -> bool {
        let middle = self.grid.lower.y + 0.5 * self.grid.extent().y;
        self.cut_open && (point.y - middle) * (camera.eye.y - middle).signum() > radius
    }

    fn draw_grains(&self, camera: &Camera) -> Drawn {
        let [lower, upper] = self.shown();
        let detail = DETAIL * (camera.eye - 0.5 * (lower + upper)).length() / camera.focus;
        let radii = self.bodies.outer_radii();
        let scene = Scene::of_bodies(&self.bodies, detail, |number| {
            !self.is_cut_away(self.bodies.poses[number].position, radii[number], camera)
        });
        let places: Vec<Place> = scene.places.iter().map(|&place| camera.place(place)).collect();
        let is_seen = |triangle: &&[u32; 3]| is_front(triangle.map(|corner| places[corner as usize]));
        let triangles = scene.triangles.iter().filter(is_seen).copied().collect();
        let surface = Layer::draw(self.samples(), places, triangles, f32::NEG_INFINITY);
        let sun = Vector::Z * 1.15 - camera.forward * 0.35 - camera.right * 0.75;
        let lamps = daylight(sun, -camera.forward, 0.2);
        let light = scene.shade(&lamps, &surface, |body| self.scale.colour(self.values[body]));
        Drawn { surface, light, tags: scene.tags }
    }

    fn draw_liquid(&self, camera: &Camera) -> Option<Drawn> {
        let surface = self.liquid?;
        let sun = (Vector::Z * 1.15 - camera.forward * 0.35 - camera.right * 0.75).normalize();
        let water = to_light([64, 140, 214]);
        let light = |(&node, &normal): (&Vector, &Vector)| {
            let to_eye = (camera.eye - node).normalize();
            let normal = if normal.dot(to_eye) < 0.0 { -normal } else { normal };
            let slant = (1.0 - normal.dot(to_eye)).powi(3) as f32;
            let glint = 0.5 * normal.dot((sun + to_eye).normalize()).max(0.0).powi(150) as f32;
            // The inner side of a cut surface is as blue as the outer one.
            let body = water.map(|c| c * (0.55 + 0.55 * normal.dot(sun).abs() as f32));
            let sky = mix(body, [0.85, 0.92, 0.98], 0.55 * slant);
            let [r, g, b] = sky.map(|c| c + glint);
            [r, g, b, (0.62 + 0.33 * slant + glint).min(1.0)]
        };
        let light = surface.nodes.iter().zip(&surface.normals).map(light).collect();
        let places = surface.nodes.iter().map(|&node| camera.place(node)).collect();
        let is_kept = |triangle: &&[u32; 3]| !self.is_cut_away(surface.nodes[triangle[0] as usize], 0.0, camera);
        let triangles = surface.triangles.iter().filter(is_kept).copied().collect();
        let surface = Layer::draw(self.samples(), places, triangles, f32::NEG_INFINITY);
        Some(Drawn { surface, light, tags: Vec::new() })
    }

    /// Draws the edges of the box where nothing is in front of them.
    fn draw_box(&self, canvas: &mut Canvas, camera: &Camera, grains: &Layer, liquid: Option<&Layer>) {
        let [lower, upper] = self.shown();
        let extent = upper - lower;
        let corner = |n: usize| lower + extent * Vector::new((n & 1) as f64, (n >> 1 & 1) as f64, (n >> 2) as f64);
        let hidden = |[x, y, depth]: [f32; 3]| {
            let (column, row) = (x as usize, y as usize);
            let seen = column < self.samples()[0] && row < self.samples()[1] && x >= 0.0 && y >= 0.0;
            let pixel = if seen { row * grains.width + column } else { return true };
            grains.depth[pixel] < depth || liquid.is_some_and(|liquid| liquid.depth[pixel] < depth)
        };
        for direction in 0..3 {
            // No lid where the box goes on above what is shown.
            let has_lid = self.top >= self.grid.upper().z;
            for n in (0..8_usize).filter(|n| n >> direction & 1 == 0 && (has_lid || direction == 2 || n >> 2 == 0)) {
                let [a, b] = [corner(n), corner(n | 1 << direction)];
                let at =
                    |s: usize| Some(camera.place(a + (b - a) * (s as f64 / 600.0))).filter(|&place| !hidden(place));
                let places: Vec<_> = (0..=600).map(at).collect();
                for ends in places.windows(2) {
                    if let [Some(a), Some(b)] = [ends[0], ends[1]] {
                        let on_sheet =
                            |p: [f32; 3]| [f64::from(p[0]) / SAMPLES as f64, f64::from(p[1]) / SAMPLES as f64];
                        canvas.line(&[on_sheet(a), on_sheet(b)], Pen::new(1.3, GREY));
                    }
                }
            }
        }
    }
}

fn opaque(light: [f32; 4]) -> Light {
    [light[0], light[1], light[2]]
}
