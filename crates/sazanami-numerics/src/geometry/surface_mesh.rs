//! Closed triangle surfaces: volume, inside or outside, distance.

use std::collections::HashMap;

use super::MeshError;
use super::bounding_tree::{BoundingTree, Bounds};
use crate::{Real, Vector};

/// A triangle mesh, normals outward by the right-hand rule.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct SurfaceMesh {
    /// Positions of the nodes \[m].
    pub nodes: Vec<Vector>,
    /// Node indices of each triangle.
    pub triangles: Vec<[u32; 3]>,
}

/// Nodes of a plane convex piece of a surface: a triangle, or two that share an edge.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Facet {
    nodes: [u32; 4],
    count: usize,
}

impl Facet {
    /// Indices of the nodes, counterclockwise seen from outside.
    pub fn nodes(&self) -> &[u32] {
        &self.nodes[..self.count]
    }
}

/// Sine of the angle between two triangles up to which they are one facet.
const PLANE: Real = 1e-9;

impl SurfaceMesh {
    /// The surface as facets: every triangle is a part of one.
    pub(super) fn facets(&self) -> Vec<Facet> {
        let sides = |[a, b, c]: [u32; 3]| [[a, b, c], [b, c, a], [c, a, b]];
        let behind: HashMap<(u32, u32), (usize, u32)> = (self.triangles.iter().enumerate())
            .flat_map(|(t, &triangle)| sides(triangle).map(|[a, b, c]| ((a, b), (t, c))))
            .collect();
        let mut is_done = vec![false; self.triangles.len()];
        let mut facets = Vec::with_capacity(self.triangles.len());
        for t in 0..self.triangles.len() {
            if std::mem::replace(&mut is_done[t], true) {
                continue;
            }
            let joined = sides(self.triangles[t]).into_iter().find_map(|[a, b, c]| {
                let &(other, d) = behind.get(&(b, a)).filter(|(other, _)| !is_done[*other])?;
                self.is_plane_and_convex([a, d, b, c]).then_some((other, [a, d, b, c]))
            });
            facets.push(match joined {
                Some((other, nodes)) => {
                    is_done[other] = true;
                    Facet { nodes, count: 4 }
                }
                None => {
                    let [a, b, c] = self.triangles[t];
                    Facet { nodes: [a, b, c, c], count: 3 }
                }
            });
        }
        facets
    }

    fn is_plane_and_convex(&self, nodes: [u32; 4]) -> bool {
        let p = nodes.map(|node| self.nodes[node as usize]);
        let turn = |n: usize| (p[(n + 1) % 4] - p[n]).cross(p[(n + 2) % 4] - p[(n + 1) % 4]).normalize_or_zero();
        let first = turn(0);
        (1..4).map(turn).all(|turn| first.cross(turn).length() < PLANE && first.dot(turn) > 0.0)
    }

    /// Corners of triangle `t` \[m].
    #[must_use]
    pub fn corners(&self, t: usize) -> [Vector; 3] {
        self.triangles[t].map(|n| self.nodes[n as usize])
    }

    /// Enclosed volume by the divergence theorem [m^3].
    #[must_use]
    pub fn volume(&self) -> Real {
        let reference = self.nodes.first().copied().unwrap_or_default();
        let six: Real = (0..self.triangles.len())
            .map(|t| {
                let [a, b, c] = self.corners(t).map(|p| p - reference);
                a.dot(b.cross(c))
            })
            .sum();
        six / 6.0
    }

    /// Area [m^2].
    #[must_use]
    pub fn area(&self) -> Real {
        (0..self.triangles.len()).map(|t| self.area_vector(t).length()).sum()
    }

    /// Area of triangle `t` times its outward normal [m^2].
    #[must_use]
    pub fn area_vector(&self, t: usize) -> Vector {
        let [a, b, c] = self.corners(t);
        0.5 * (b - a).cross(c - a)
    }

    /// `r x n` at each corner `r` of each triangle with the normal `n` \[m]: times the angular velocity of a turn about
    /// the origin it is the speed of that point along the normal.
    pub(super) fn levers(&self) -> Vec<Vector> {
        let of = |t: usize| {
            let normal = self.area_vector(t).normalize_or_zero();
            self.corners(t).map(|corner| corner.cross(normal))
        };
        (0..self.triangles.len()).flat_map(of).collect()
    }

    /// Checks that exactly two triangles meet in every edge and run along it in opposite directions.
    ///
    /// # Errors
    /// [`MeshError::NonManifoldEdge`] with the first edge where this fails.
    pub fn check_closed(&self) -> Result<(), MeshError> {
        let mut edges: Vec<(u32, u32, bool)> = self
            .triangles
            .iter()
            .flat_map(|&[a, b, c]| [(a, b), (b, c), (c, a)])
            .map(|(a, b)| (a.min(b), a.max(b), a < b))
            .collect();
        edges.sort_unstable();
        for group in edges.chunk_by(|a, b| (a.0, a.1) == (b.0, b.1)) {
            let forward = group.iter().filter(|e| e.2).count();
            if group.len() != 2 || forward != 1 {
                let edge = [group[0].0 as usize, group[0].1 as usize];
                return Err(MeshError::NonManifoldEdge { edge, faces: group.len() });
            }
        }
        Ok(())
    }

    /// Winding number of the surface round `point`: 1 inside, 0 outside (Van Oosterom and Strackee, 1983).
    #[must_use]
    pub fn winding_number(&self, point: Vector) -> Real {
        let angle: Real = (0..self.triangles.len())
            .map(|t| {
                let [a, b, c] = self.corners(t).map(|p| p - point);
                let (la, lb, lc) = (a.length(), b.length(), c.length());
                let denominator = la * lb * lc + a.dot(b) * lc + b.dot(c) * la + c.dot(a) * lb;
                2.0 * a.dot(b.cross(c)).atan2(denominator)
            })
            .sum();
        angle / (4.0 * std::f64::consts::PI)
    }

    /// Whether `point` lies inside the closed surface.
    #[must_use]
    pub fn contains(&self, point: Vector) -> bool {
        self.winding_number(point) > 0.5
    }

    pub(super) fn tree(&self) -> BoundingTree {
        BoundingTree::new((0..self.triangles.len()).map(|t| Bounds::around(self.corners(t))).collect())
    }

    /// Point of the surface nearest to `point`, found with the surface's `tree`.
    pub(super) fn closest_point(&self, tree: &BoundingTree, point: Vector) -> Vector {
        let distance = |t: usize| (closest_on_triangle(point, &self.corners(t)) - point).length_squared();
        match tree.nearest(point, distance) {
            Some((t, _)) => closest_on_triangle(point, &self.corners(t)),
            None => point,
        }
    }

    /// About `count` points spread over the surface in proportion to area, each with its outward unit normal.
    pub(super) fn samples(&self, count: usize) -> Vec<(Vector, Vector)> {
        let area = self.area();
        let mut samples = Vec::with_capacity(count + self.triangles.len());
        for t in 0..self.triangles.len() {
            let [a, b, c] = self.corners(t);
            let vector = self.area_vector(t);
            let wanted = (count as Real * vector.length() / area).max(1.0);
            // A triangle divided n times along each edge has n^2 parts; sample their centres.
            let n = wanted.sqrt().ceil() as usize;
            let step = 1.0 / n as Real;
            let normal = vector.normalize_or_zero();
            for i in 0..n {
                for j in 0..n - i {
                    let (u, v) = ((i as Real + 1.0 / 3.0) * step, (j as Real + 1.0 / 3.0) * step);
                    samples.push((a + u * (b - a) + v * (c - a), normal));
                    if i + j + 1 < n {
                        let (u, v) = ((i as Real + 2.0 / 3.0) * step, (j as Real + 2.0 / 3.0) * step);
                        samples.push((a + u * (b - a) + v * (c - a), normal));
                    }
                }
            }
        }
        samples
    }
}

/// Point of a triangle nearest to `p` (Ericson, Real-Time Collision Detection, 2005, section 5.1.5).
fn closest_on_triangle(p: Vector, &[a, b, c]: &[Vector; 3]) -> Vector {
    let (ab, ac, ap) = (b - a, c - a, p - a);
    let (d1, d2) = (ab.dot(ap), ac.dot(ap));
    if d1 <= 0.0 && d2 <= 0.0 {
        return a;
    }
    let bp = p - b;
    let (d3, d4) = (ab.dot(bp), ac.dot(bp));
    if d3 >= 0.0 && d4 <= d3 {
        return b;
    }
    let vc = d1 * d4 - d3 * d2;
    if vc <= 0.0 && d1 >= 0.0 && d3 <= 0.0 {
        return a + d1 / (d1 - d3) * ab;
    }
    let cp = p - c;
    let (d5, d6) = (ab.dot(cp), ac.dot(cp));
    if d6 >= 0.0 && d5 <= d6 {
        return c;
    }
    let vb = d5 * d2 - d1 * d6;
    if vb <= 0.0 && d2 >= 0.0 && d6 <= 0.0 {
        return a + d2 / (d2 - d6) * ac;
    }
    let va = d3 * d6 - d5 * d4;
    if va <= 0.0 && d4 - d3 >= 0.0 && d5 - d6 >= 0.0 {
        return b + (d4 - d3) / ((d4 - d3) + (d5 - d6)) * (c - b);
    }
    let total = va + vb + vc;
    a + vb / total * ab + vc / total * ac
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::box_mesh;

    #[test]
    fn a_cube_knows_inside_from_outside_and_its_distance() {
        let cube = box_mesh(Vector::splat(2.0)).boundary();
        assert_eq!(cube.check_closed(), Ok(()));
        assert!((cube.volume() - 8.0).abs() < 1e-14);
        assert!((cube.area() - 24.0).abs() < 1e-13);
        assert!(cube.contains(Vector::new(0.9, -0.9, 0.3)));
        assert!(!cube.contains(Vector::new(1.1, 0.0, 0.0)));
        let tree = cube.tree();
        for (point, nearest) in [
            (Vector::new(3.0, 0.2, 0.1), Vector::new(1.0, 0.2, 0.1)),
            (Vector::new(3.0, 4.0, 0.1), Vector::new(1.0, 1.0, 0.1)),
            (Vector::new(-3.0, 4.0, -2.0), Vector::new(-1.0, 1.0, -1.0)),
            (Vector::new(0.2, 0.1, 0.7), Vector::new(0.2, 0.1, 1.0)),
        ] {
            assert!((cube.closest_point(&tree, point) - nearest).length() < 1e-14);
        }
    }

    #[test]
    fn two_triangles_in_a_plane_are_one_facet() {
        let cube = box_mesh(Vector::splat(2.0)).boundary();
        let facets = cube.facets();
        assert_eq!(facets.len(), 6);
        let centre = |facet: &Facet| facet.nodes().iter().map(|&n| cube.nodes[n as usize]).sum::<Vector>() / 4.0;
        for facet in &facets {
            let [a, b, c, d] = facet.nodes() else { panic!("a square has four corners") };
            let [a, b, c, d] = [a, b, c, d].map(|&n| cube.nodes[n as usize]);
            let area = 0.5 * (c - a).cross(d - b);
            assert!((area - 4.0 * centre(facet)).length() < 1e-14, "{area}");
        }
        // A bent pair stays two triangles, and so does one that is no convex quadrilateral.
        let mesh = |fourth: Vector| SurfaceMesh {
            nodes: vec![Vector::ZERO, Vector::X, Vector::Y, fourth],
            triangles: vec![[0, 1, 2], [2, 1, 3]],
        };
        assert_eq!(mesh(Vector::new(1.0, 1.0, 0.0)).facets().len(), 1);
        assert_eq!(mesh(Vector::new(1.0, 1.0, 1e-6)).facets().len(), 2);
        assert_eq!(mesh(Vector::new(3.0, -1.0, 0.0)).facets().len(), 2);
    }

    #[test]
    fn an_open_or_torn_surface_is_found() {
        let mut cube = box_mesh(Vector::splat(2.0)).boundary();
        let lost = cube.triangles.pop().unwrap();
        assert!(matches!(cube.check_closed(), Err(MeshError::NonManifoldEdge { faces: 1, .. })));
        cube.triangles.push([lost[1], lost[0], lost[2]]);
        assert!(matches!(cube.check_closed(), Err(MeshError::NonManifoldEdge { faces: 2, .. })));
    }

    #[test]
    fn samples_lie_on_the_surface() {
        let cube = box_mesh(Vector::splat(2.0)).boundary();
        let samples = cube.samples(600);
        assert!(samples.len() >= 600);
        assert!(samples.iter().all(|(p, n)| (p.dot(*n) - 1.0).abs() < 1e-14));
    }
}
