//! Surfaces posed in the laboratory, and the light that falls on them.

use std::collections::BTreeMap;

use sazanami_numerics::{Matrix, Vector};
use sazanami_parallel::for_each_chunk;

use super::colour::{Colour, to_light};
use super::raster::{Layer, Place, cover, is_front};
use sazanami_io::{Bodies, BodySurface};

/// Triangles of several things, with normals at their corners.
#[derive(Default)]
pub(super) struct Scene {
    /// Corners \[m].
    pub places: Vec<Vector>,
    /// Unit normals, outwards.
    pub normals: Vec<Vector>,
    /// Body of each corner.
    pub tags: Vec<u32>,
    /// Corner numbers.
    pub triangles: Vec<[u32; 3]>,
}

/// A layer of triangles with the light and opacity at their corners, and what each corner belongs to.
pub(super) struct Drawn {
    pub surface: Layer,
    pub light: Vec<[f32; 4]>,
    pub tags: Vec<u32>,
}

/// Faces that meet at a larger angle than this cosine's (65 degrees) keep their edge.
const SHARP: f64 = 0.42;

/// A surface without the detail that is smaller than `detail` \[m]: nodes in the same cell of a lattice are one.
fn coarsened(surface: BodySurface, detail: f64) -> (Vec<Vector>, Vec<[u32; 3]>) {
    let mut cells: BTreeMap<[i64; 3], u32> = BTreeMap::new();
    let (mut sums, mut counts) = (Vec::new(), Vec::new());
    let numbers: Vec<u32> = surface
        .nodes
        .iter()
        .map(|&node| {
            let cell = (node / detail).round().to_array().map(|place| place as i64);
            let number = *cells.entry(cell).or_insert(sums.len() as u32);
            if number as usize == sums.len() {
                sums.push(Vector::ZERO);
                counts.push(0.0);
            }
            sums[number as usize] += node;
            counts[number as usize] += 1.0;
            number
        })
        .collect();
    let nodes = sums.iter().zip(&counts).map(|(&sum, &count)| sum / count).collect();
    let merged = surface.triangles.iter().map(|triangle| triangle.map(|node| numbers[node as usize]));
    (nodes, merged.filter(|[a, b, c]| a != b && b != c && c != a).collect())
}

/// A surface with as many corners at a node as there are normals.
struct Smoothed {
    places: Vec<Vector>,
    normals: Vec<Vector>,
    triangles: Vec<[u32; 3]>,
}

impl Smoothed {
    /// The normal of a corner is the mean over the faces around its node that meet its face smoothly.
    fn new(surface: BodySurface) -> Self {
        let face_normals: Vec<Vector> = surface
            .triangles
            .iter()
            .map(|triangle| {
                let [a, b, c] = triangle.map(|node| surface.nodes[node as usize]);
                (b - a).cross(c - a)
            })
            .collect();
        let mut faces_of_node = vec![Vec::new(); surface.nodes.len()];
        for (face, triangle) in surface.triangles.iter().enumerate() {
            triangle.iter().for_each(|&node| faces_of_node[node as usize].push(face));
        }
        let mut smoothed = Self { places: Vec::new(), normals: Vec::new(), triangles: Vec::new() };
        let mut corners_of_node: Vec<Vec<u32>> = vec![Vec::new(); surface.nodes.len()];
        for (face, triangle) in surface.triangles.iter().enumerate() {
            let own = face_normals[face].normalize_or_zero();
            let corners = triangle.map(|node| {
                let faces = &faces_of_node[node as usize];
                let smooth = faces.iter().filter(|&&other| own.dot(face_normals[other].normalize_or_zero()) > SHARP);
                let normal = smooth.map(|&other| face_normals[other]).sum::<Vector>().normalize_or(Vector::Z);
                let corners = &mut corners_of_node[node as usize];
                let same = corners.iter().find(|&&corner| smoothed.normals[corner as usize].dot(normal) > 0.999_999);
                same.copied().unwrap_or_else(|| {
                    let corner = smoothed.places.len() as u32;
                    smoothed.places.push(surface.nodes[node as usize]);
                    smoothed.normals.push(normal);
                    corners.push(corner);
                    corner
                })
            });
            smoothed.triangles.push(corners);
        }
        smoothed
    }
}

impl Scene {
    /// Bodies that `keep` lets through, without what is smaller than `detail` \[m] on them; the tag is the body's number.
    pub fn of_bodies(bodies: &Bodies, detail: f64, keep: impl Fn(usize) -> bool) -> Self {
        let mut scene = Self::default();
        let mut largest = vec![0.0_f64; bodies.surfaces.len()];
        for pose in bodies.poses {
            let largest = &mut largest[pose.surface as usize];
            *largest = largest.max(pose.scale);
        }
        let smoothed = bodies.surfaces.iter().zip(largest).map(|(&surface, scale)| {
            // However small a body is, a body is left of it.
            let radius = surface.nodes.iter().map(|node| node.length()).fold(0.0, f64::max);
            let (nodes, triangles) = coarsened(surface, (detail / scale).clamp(1e-6 * radius, 0.5 * radius));
            Smoothed::new(BodySurface { nodes: &nodes, triangles: &triangles })
        });
        let smoothed: Vec<_> = smoothed.collect();
        scene.add(bodies, &smoothed, keep);
        scene
    }

    fn add(&mut self, bodies: &Bodies, smoothed: &[Smoothed], keep: impl Fn(usize) -> bool) {
        for (number, pose) in bodies.poses.iter().enumerate().filter(|&(number, _)| keep(number)) {
            let surface = &smoothed[pose.surface as usize];
            let rotation = Matrix::from_quat(pose.orientation);
            let first = self.places.len() as u32;
            self.places.extend(surface.places.iter().map(|&place| pose.position + rotation * (pose.scale * place)));
            self.normals.extend(surface.normals.iter().map(|&normal| rotation * normal));
            self.tags.resize(self.places.len(), number as u32);
            self.triangles.extend(surface.triangles.iter().map(|triangle| triangle.map(|corner| first + corner)));
        }
    }

    /// Light and opacity at the corners of what is seen of the scene, drawn on `surface`: `colour` is that of a body.
    pub fn shade(&self, lamps: &[Lamp], surface: &Layer, colour: impl Fn(usize) -> Colour) -> Vec<[f32; 4]> {
        let seen = surface.seen_corners();
        let light = self.illuminate(lamps, &seen);
        let shaded = |corner: usize| {
            if !seen[corner] {
                return [0.0; 4];
            }
            let [r, g, b] = to_light(colour(self.tags[corner] as usize)).map(|c| c * (0.14 + light[corner]));
            [r, g, b, 1.0]
        };
        (0..self.places.len()).map(shaded).collect()
    }

    /// Light at the corners that are `seen`, as a factor for the colour of what is there; 0 at the others.
    pub fn illuminate(&self, lamps: &[Lamp], seen: &[bool]) -> Vec<f32> {
        let mut parts = vec![Vec::new(); lamps.len()];
        for_each_chunk(&mut parts[..], 1, |number, part: &mut [Vec<f32>]| {
            part[0] = self.light_of(&lamps[number], seen);
        });
        let mut sum = vec![0.0; self.places.len()];
        for part in parts {
            sum.iter_mut().zip(part).for_each(|(sum, part)| *sum += part);
        }
        sum
    }

    /// Light of one lamp at the corners that are `seen`, shadows included.
    fn light_of(&self, lamp: &Lamp, seen: &[bool]) -> Vec<f32> {
        let shadows = Shadows::new(self, lamp);
        let lit = |corner: usize| {
            let facing = self.normals[corner].dot(-lamp.direction) as f32;
            if !seen[corner] || facing <= 0.0 {
                return 0.0;
            }
            lamp.strength * facing * shadows.visible(self.places[corner], self.normals[corner])
        };
        (0..self.places.len()).map(lit).collect()
    }

    /// Mean size of a body \[m]: the root of the area of its surface.
    fn size_of_bodies(&self) -> f64 {
        let area = |triangle: &[u32; 3]| {
            let [a, b, c] = triangle.map(|corner| self.places[corner as usize]);
            0.5 * (b - a).cross(c - a).length()
        };
        let count = 1 + self.tags.windows(2).filter(|tags| tags[0] != tags[1]).count();
        (self.triangles.iter().map(area).sum::<f64>() / count as f64).sqrt()
    }
}

/// A far lamp.
#[derive(Clone, Copy)]
pub(super) struct Lamp {
    /// Unit vector that its light follows.
    pub direction: Vector,
    /// Light on a surface that faces it.
    pub strength: f32,
    /// Whether its shadows are drawn sharp.
    pub sharp: bool,
}

/// A sun from `towards_sun` and a sky of eight lamps around the vertical and `towards_eye`,
/// and a lamp of strength `at_eye` where the eye is.
pub(super) fn daylight(towards_sun: Vector, towards_eye: Vector, at_eye: f32) -> Vec<Lamp> {
    let mut lamps = vec![Lamp { direction: -towards_sun.normalize(), strength: 0.62, sharp: true }];
    let across = towards_eye.cross(Vector::Z).normalize_or(Vector::X);
    let along = Vector::Z.cross(across);
    for (n, height) in [0.35, 1.6, 0.7, 2.6, 0.35, 1.6, 0.7, 2.6].into_iter().enumerate() {
        let (sine, cosine) = (std::f64::consts::TAU * (n as f64 + 0.3) / 8.0).sin_cos();
        // Lamps behind the scene stand higher, so that every lamp shows on what the eye sees.
        let height = if cosine > 0.2 { height + 0.8 } else { height };
        let towards = (across * sine + along * cosine + Vector::Z * height).normalize();
        lamps.push(Lamp { direction: -towards, strength: 0.085, sharp: false });
    }
    lamps.push(Lamp { direction: -towards_eye.normalize(), strength: at_eye, sharp: false });
    lamps
}

/// Pixels of a shadow map for the size of a body, for sharp shadows and others; limits along its longer side.
const SHADOW_PIXELS: [f64; 2] = [30.0, 16.0];
const SHADOW_LIMITS: [f64; 2] = [160.0, 600.0];

/// Depths of what a lamp reaches first.
struct Shadows {
    axes: [Vector; 3],
    lower: [f64; 2],
    scale: f64,
    size: [usize; 2],
    depth: Vec<f32>,
}

impl Shadows {
    fn new(scene: &Scene, lamp: &Lamp) -> Self {
        let direction = lamp.direction;
        let [right, up] = [direction.any_orthonormal_vector(), direction.cross(direction.any_orthonormal_vector())];
        let (mut lower, mut upper) = (Vector::MAX, Vector::MIN);
        let turned = |place: Vector| Vector::new(right.dot(place), up.dot(place), direction.dot(place));
        for &place in &scene.places {
            lower = lower.min(turned(place));
            upper = upper.max(turned(place));
        }
        let extent = if scene.places.is_empty() { Vector::ONE } else { upper - lower };
        let longer = extent.x.max(extent.y).max(f64::MIN_POSITIVE);
        let wanted = SHADOW_PIXELS[usize::from(!lamp.sharp)] * longer / scene.size_of_bodies();
        let scale = wanted.clamp(SHADOW_LIMITS[0], SHADOW_LIMITS[1]) / longer;
        let size = [extent.x, extent.y].map(|length| (length * scale).ceil() as usize + 2);
        let mut shadows = Self {
            axes: [right, up, direction],
            lower: [lower.x, lower.y],
            scale,
            size,
            depth: vec![f32::INFINITY; size[0] * size[1]],
        };
        let places: Vec<_> = scene.places.iter().map(|&place| shadows.place(place)).collect();
        for triangle in &scene.triangles {
            let corners = triangle.map(|corner| places[corner as usize]);
            // The light reaches the faces of a closed body that are towards the lamp.
            if is_front(corners) {
                cover(corners, size, |pixel, depth| shadows.depth[pixel] = shadows.depth[pixel].min(depth));
            }
        }
        shadows
    }

    /// Pixels across and down, depth \[pixels].
    fn place(&self, place: Vector) -> Place {
        let [right, up, direction] = self.axes.map(|axis| axis.dot(place));
        [(right - self.lower[0]) * self.scale + 1.0, (up - self.lower[1]) * self.scale + 1.0, direction * self.scale]
            .map(|v| v as f32)
    }

    /// Part of the lamp's light that reaches a place of a surface.
    fn visible(&self, place: Vector, normal: Vector) -> f32 {
        // A step of two pixels off the surface keeps it from shading itself.
        let [x, y, depth] = self.place(place + normal * (2.0 / self.scale));
        let mut lit = 0.0;
        for n in 0..9 {
            let column = (x as usize + n % 3).saturating_sub(1).min(self.size[0] - 1);
            let row = (y as usize + n / 3).saturating_sub(1).min(self.size[1] - 1);
            if depth <= self.depth[row * self.size[0] + column] + 1.5 {
                lit += 1.0 / 9.0;
            }
        }
        lit
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use sazanami_io::BodyPose;
    use sazanami_numerics::Quaternion;

    fn cube() -> (Vec<Vector>, Vec<[u32; 3]>) {
        let nodes = (0..8).map(|n| Vector::new((n & 1) as f64, (n >> 1 & 1) as f64, (n >> 2) as f64) - 0.5).collect();
        let quads = [[0, 4, 6, 2], [1, 3, 7, 5], [0, 1, 5, 4], [2, 6, 7, 3], [0, 2, 3, 1], [4, 5, 7, 6]];
        (nodes, quads.iter().flat_map(|[a, b, c, d]| [[*a, *b, *c], [*a, *c, *d]]).collect())
    }

    #[test]
    fn sharp_edges_stay_and_a_body_casts_a_shadow_on_the_one_below() {
        let (nodes, triangles) = cube();
        let large: Vec<Vector> = nodes.iter().map(|node| 1.5 * *node).collect();
        let surface = |nodes| BodySurface { nodes, triangles: &triangles };
        let surfaces = [surface(&nodes[..]), surface(&large[..])];
        let pose = |surface, x, z| BodyPose {
            surface,
            scale: 1.0,
            position: Vector::new(x, 0.0, z),
            orientation: Quaternion::IDENTITY,
        };
        let poses = [pose(0, 0.0, 0.0), pose(1, 0.0, 2.0), pose(0, 5.0, 0.0)];
        let scene = Scene::of_bodies(&Bodies { surfaces: &surfaces, poses: &poses }, 0.0, |_| true);
        assert_eq!(scene.places.len(), 3 * 24, "a cube has three normals at each corner");
        let light = scene.illuminate(&[Lamp { direction: -Vector::Z, strength: 1.0, sharp: true }], &[true; 72]);
        let top = |body: u32| -> f32 {
            let tops = (0..light.len()).filter(|&n| scene.tags[n] == body && scene.normals[n].z > 0.9);
            tops.map(|n| light[n]).sum::<f32>() / 4.0
        };
        assert!(top(0) < 0.1 && top(1) > 0.8 && top(2) > 0.8, "{} {} {}", top(0), top(1), top(2));
    }
}
