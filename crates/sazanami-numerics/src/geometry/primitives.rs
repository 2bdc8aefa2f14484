//! Tetrahedral meshes of standard shapes, centred at the origin, in their principal axes.

use std::f64::consts::TAU;

use super::{Cylinder, Spheroid, TetrahedralMesh};
use crate::choices;
use crate::{Real, Vector};

choices! {
    /// Property that a faceted mesh shares with its smooth shape.
    #[derive(Default)]
    pub enum VolumeRule {
        /// The nodes lie on the surface; the mesh holds less than the shape.
        #[default]
        Inscribed = "inscribed",
        /// The mesh is scaled to the volume of the shape; its nodes stand out of it.
        Preserve = "preserve",
    }
}

/// Resolution of the ring mesh of a spheroid.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct SpheroidMesh {
    /// Rings of nodes between the two poles, at least one.
    pub rings: usize,
    /// Nodes on each ring, at least three.
    pub segments: usize,
}

impl SpheroidMesh {
    /// 7 rings of 6, two poles and five axis nodes: 49 nodes as in Yagyu et al. (2015), table 1.
    pub const PAPER: Self = Self { rings: 7, segments: 6 };

    /// End rings with few corners are filled without a node on the axis.
    fn open_ends(self) -> bool {
        self.segments <= 6 && self.rings >= 3
    }
}

/// Ring mesh of the spheroid with semi-axes `a` (two) and `c` (single, along x1) \[m].
///
/// Nodes lie on `rings` circles placed for the largest inscribed volume, on the two poles, and on the axis in the
/// plane of each ring, except that of the two end rings where these have at most six corners.
///
/// # Panics
/// If there is no ring or fewer than three segments.
#[must_use]
pub fn spheroid_mesh(a: Real, c: Real, resolution: SpheroidMesh, rule: VolumeRule) -> TetrahedralMesh {
    let SpheroidMesh { rings, segments } = resolution;
    assert!(rings >= 1 && segments >= 3, "a ring mesh needs a ring and three segments");
    let mut mesh = RingMesh::new(resolution);
    let positions = ring_positions(rings);
    for &x in &positions {
        let radius = (1.0 - x * x).max(0.0).sqrt();
        for s in 0..segments {
            let (sin, cos) = (TAU * s as Real / segments as Real).sin_cos();
            mesh.nodes.push(Vector::new(c * x, a * radius * cos, a * radius * sin));
        }
    }
    mesh.nodes.push(Vector::new(-c, 0.0, 0.0));
    mesh.nodes.push(Vector::new(c, 0.0, 0.0));
    for &x in &positions[mesh.first_centre..=mesh.last_centre] {
        mesh.nodes.push(Vector::new(c * x, 0.0, 0.0));
    }
    mesh.connect();
    let mesh = TetrahedralMesh { nodes: mesh.nodes, tetrahedra: mesh.tetrahedra };
    with_volume(mesh, Spheroid { equatorial: a, axial: c }.volume(), rule)
}

/// Subdivided icosahedron about a centre node, for the sphere of radius `radius` \[m]: 20 x 4^`refinement`
/// tetrahedra.
#[must_use]
pub fn sphere_mesh(radius: Real, refinement: usize, rule: VolumeRule) -> TetrahedralMesh {
    let (mut points, mut triangles) = icosahedron();
    for _ in 0..refinement {
        (points, triangles) = subdivided(points, &triangles);
    }
    let centre = points.len() as u32;
    let mut nodes: Vec<Vector> = points.iter().map(|&p| radius * p).collect();
    nodes.push(Vector::ZERO);
    let tetrahedra = triangles.iter().map(|&[i, j, k]| [i, j, k, centre]).map(|t| positive(&nodes, t)).collect();
    let volume = Spheroid { equatorial: radius, axial: radius }.volume();
    with_volume(TetrahedralMesh { nodes, tetrahedra }, volume, rule)
}

/// A box with the given `edges` \[m] in six tetrahedra.
#[must_use]
pub fn box_mesh(edges: Vector) -> TetrahedralMesh {
    let nodes: Vec<Vector> = (0..8_u32)
        .map(|i| {
            let corner = Vector::new(f64::from(i & 1), f64::from((i >> 1) & 1), f64::from((i >> 2) & 1));
            (corner - 0.5) * edges
        })
        .collect();
    // Paths from corner 0 to corner 7 along the edges, one per order of directions (Kuhn).
    let orders = [[1, 2, 4], [1, 4, 2], [2, 1, 4], [2, 4, 1], [4, 1, 2], [4, 2, 1]];
    let tetrahedra = orders.map(|[i, j, _]| positive(&nodes, [0, i, i + j, 7])).to_vec();
    TetrahedralMesh { nodes, tetrahedra }
}

/// A cylinder along x1 as a prism on a regular polygon of `segments` corners, with a node on the axis at each end. The
/// volume is preserved by a larger radius; the length is always that of the cylinder.
///
/// # Panics
/// If there are fewer than three segments.
#[must_use]
pub fn cylinder_mesh(cylinder: Cylinder, segments: usize, rule: VolumeRule) -> TetrahedralMesh {
    assert!(segments >= 3, "a polygon has at least three corners");
    let corner = TAU / segments as Real;
    let radius = match rule {
        VolumeRule::Inscribed => cylinder.radius,
        VolumeRule::Preserve => cylinder.radius * (corner / corner.sin()).sqrt(),
    };
    let mut mesh = RingMesh {
        rings: 2,
        segments,
        first_centre: 0,
        last_centre: 1,
        nodes: Vec::with_capacity(2 * segments + 2),
        tetrahedra: Vec::with_capacity(3 * segments),
    };
    for x in [-0.5, 0.5] {
        for s in 0..segments {
            let (sin, cos) = (corner * s as Real).sin_cos();
            mesh.nodes.push(Vector::new(x * cylinder.length, radius * cos, radius * sin));
        }
    }
    mesh.nodes.extend([-0.5, 0.5].map(|x| Vector::new(x * cylinder.length, 0.0, 0.0)));
    let centre = |ring: usize| (2 * segments + ring) as u32;
    for s in 0..segments {
        let triangle = |ring: usize| [centre(ring), mesh.ring_node(ring, s), mesh.ring_node(ring, s + 1)];
        let (lower, upper) = (triangle(0), triangle(1));
        mesh.add_prism(lower, upper);
    }
    TetrahedralMesh { nodes: mesh.nodes, tetrahedra: mesh.tetrahedra }
}

/// Scales `mesh` to `volume` where the rule asks for it.
fn with_volume(mesh: TetrahedralMesh, volume: Real, rule: VolumeRule) -> TetrahedralMesh {
    match rule {
        VolumeRule::Inscribed => mesh,
        VolumeRule::Preserve => {
            let factor = (volume / mesh.volume()).cbrt();
            mesh.mapped(|p| factor * p)
        }
    }
}

/// The tetrahedron with two nodes exchanged where that is needed for positive volume.
fn positive(nodes: &[Vector], tetrahedron: [u32; 4]) -> [u32; 4] {
    let corners = tetrahedron.map(|n| nodes[n as usize]);
    if super::tetrahedron::signed_volume(&corners) < 0.0 {
        let [i, j, k, l] = tetrahedron;
        [j, i, k, l]
    } else {
        tetrahedron
    }
}

struct RingMesh {
    rings: usize,
    segments: usize,
    first_centre: usize,
    last_centre: usize,
    nodes: Vec<Vector>,
    tetrahedra: Vec<[u32; 4]>,
}

impl RingMesh {
    fn new(resolution: SpheroidMesh) -> Self {
        let SpheroidMesh { rings, segments } = resolution;
        let skip = usize::from(resolution.open_ends());
        Self {
            rings,
            segments,
            first_centre: skip,
            last_centre: rings - 1 - skip,
            nodes: Vec::new(),
            tetrahedra: Vec::new(),
        }
    }

    fn ring_node(&self, ring: usize, segment: usize) -> u32 {
        (ring * self.segments + segment % self.segments) as u32
    }

    /// Pole below (0) or above (1) all rings.
    fn pole(&self, side: usize) -> u32 {
        (self.rings * self.segments + side) as u32
    }

    fn centre(&self, ring: usize) -> u32 {
        (self.rings * self.segments + 2 + ring - self.first_centre) as u32
    }

    fn add(&mut self, tetrahedron: [u32; 4]) {
        let tetrahedron = positive(&self.nodes, tetrahedron);
        self.tetrahedra.push(tetrahedron);
    }

    fn connect(&mut self) {
        for ring in self.first_centre..self.last_centre {
            for s in 0..self.segments {
                let lower = [self.centre(ring), self.ring_node(ring, s), self.ring_node(ring, s + 1)];
                let upper = [self.centre(ring + 1), self.ring_node(ring + 1, s), self.ring_node(ring + 1, s + 1)];
                self.add_prism(lower, upper);
            }
        }
        if self.first_centre == 0 {
            self.add_fan(0, self.pole(0));
            self.add_fan(self.rings - 1, self.pole(1));
        } else {
            self.add_open_end(1, 0, self.pole(0));
            self.add_open_end(self.rings - 2, self.rings - 1, self.pole(1));
        }
    }

    /// Three tetrahedra; the diagonal of each side starts at its smallest node, so that neighbours agree.
    fn add_prism(&mut self, lower: [u32; 3], upper: [u32; 3]) {
        // Sorting the columns by their lower node sorts them by the upper one too: diagonals run from a lower
        // node of a smaller column to the upper node of a larger one.
        let mut columns = [0, 1, 2];
        columns.sort_by_key(|&c| lower[c]);
        let [i, j, k] = columns;
        self.add([lower[i], lower[j], lower[k], upper[k]]);
        self.add([lower[i], lower[j], upper[j], upper[k]]);
        self.add([lower[i], upper[i], upper[j], upper[k]]);
    }

    /// The cone from a ring with an axis node to a pole.
    fn add_fan(&mut self, ring: usize, pole: u32) {
        for s in 0..self.segments {
            self.add([self.centre(ring), self.ring_node(ring, s), self.ring_node(ring, s + 1), pole]);
        }
    }

    /// The layer between ring `inner` with an axis node and ring `outer` without, as a fan from that node, and the
    /// cone from `outer` to the pole.
    fn add_open_end(&mut self, inner: usize, outer: usize, pole: u32) {
        let apex = self.centre(inner);
        for s in 0..self.segments {
            let [i, j] = [s, s + 1].map(|s| self.ring_node(inner, s));
            let [k, l] = [s, s + 1].map(|s| self.ring_node(outer, s));
            self.add([apex, i, j, k]);
            self.add([apex, j, k, l]);
        }
        for [i, j, k] in polygon_triangles(self.segments) {
            let triangle = [i, j, k].map(|s| self.ring_node(outer, s));
            self.add([triangle[0], triangle[1], triangle[2], apex]);
            self.add([triangle[0], triangle[1], triangle[2], pole]);
        }
    }
}

/// A regular polygon cut into triangles by a zigzag of diagonals.
fn polygon_triangles(corners: usize) -> Vec<[usize; 3]> {
    let (mut left, mut right) = (0, corners - 1);
    let mut triangles = Vec::with_capacity(corners - 2);
    while right - left >= 2 {
        if triangles.len() % 2 == 0 {
            triangles.push([left, left + 1, right]);
            left += 1;
        } else {
            triangles.push([left, right - 1, right]);
            right -= 1;
        }
    }
    triangles
}

/// Positions x/c of `rings` circles for which the inscribed ring mesh has the largest volume.
///
/// Between two rings of radius r and r' the mesh holds h (r^2 + r r' + r'^2)/3 times the area factor of the
/// polygon; each ring in turn is moved to its best place between its neighbours until none moves.
fn ring_positions(rings: usize) -> Vec<Real> {
    let frustum = |x: Real, y: Real| {
        let (r2, s2) = (1.0 - x * x, 1.0 - y * y);
        (y - x) * (r2 + (r2 * s2).max(0.0).sqrt() + s2)
    };
    let mut x: Vec<Real> =
        (0..rings + 2).map(|i| -(std::f64::consts::PI * i as Real / (rings + 1) as Real).cos()).collect();
    for _ in 0..2000 {
        let mut moved: Real = 0.0;
        for i in 1..=rings {
            let (lower, upper) = (x[i - 1], x[i + 1]);
            let best = maximum(|t| frustum(lower, t) + frustum(t, upper), lower, upper);
            moved = moved.max((best - x[i]).abs());
            x[i] = best;
        }
        for i in 1..=rings / 2 {
            let mean = 0.5 * (x[rings + 1 - i] - x[i]);
            (x[i], x[rings + 1 - i]) = (-mean, mean);
        }
        if rings % 2 == 1 {
            x[rings.div_ceil(2)] = 0.0;
        }
        if moved < 1e-8 {
            break;
        }
    }
    x[1..=rings].to_vec()
}

/// Place of the maximum of a function with one maximum between `lower` and `upper`, by golden section.
fn maximum(f: impl Fn(Real) -> Real, mut lower: Real, mut upper: Real) -> Real {
    let golden = 0.5 * (5.0_f64.sqrt() - 1.0);
    let (mut p, mut q) = (upper - golden * (upper - lower), lower + golden * (upper - lower));
    let (mut at_p, mut at_q) = (f(p), f(q));
    for _ in 0..44 {
        if at_p < at_q {
            (lower, p, at_p) = (p, q, at_q);
            q = lower + golden * (upper - lower);
            at_q = f(q);
        } else {
            (upper, q, at_q) = (q, p, at_p);
            p = upper - golden * (upper - lower);
            at_p = f(p);
        }
    }
    0.5 * (lower + upper)
}

fn icosahedron() -> (Vec<Vector>, Vec<[u32; 3]>) {
    let g = 0.5 * (1.0 + 5.0_f64.sqrt());
    let mut points = Vec::new();
    for (s, t) in [(1.0, 1.0), (1.0, -1.0), (-1.0, 1.0), (-1.0, -1.0)] {
        points.push(Vector::new(0.0, s, t * g).normalize());
        points.push(Vector::new(s, t * g, 0.0).normalize());
        points.push(Vector::new(t * g, 0.0, s).normalize());
    }
    // Neighbours are the pairs nearest to each other: the 20 faces are their triangles.
    let near = |i: usize, j: usize| (points[i] - points[j]).length() < 1.2;
    let mut triangles = Vec::with_capacity(20);
    for i in 0..12 {
        for j in i + 1..12 {
            for k in j + 1..12 {
                if near(i, j) && near(j, k) && near(i, k) {
                    triangles.push([i as u32, j as u32, k as u32]);
                }
            }
        }
    }
    (points, triangles)
}

/// Every triangle in four, new nodes pushed out to the unit sphere.
fn subdivided(mut points: Vec<Vector>, triangles: &[[u32; 3]]) -> (Vec<Vector>, Vec<[u32; 3]>) {
    let mut edges: Vec<[u32; 2]> =
        triangles.iter().flat_map(|&[a, b, c]| [(a, b), (b, c), (a, c)]).map(|(a, b)| [a.min(b), a.max(b)]).collect();
    edges.sort_unstable();
    edges.dedup();
    let first = points.len();
    for &[a, b] in &edges {
        points.push((points[a as usize] + points[b as usize]).normalize());
    }
    let middle = |a: u32, b: u32| (first + edges.partition_point(|e| *e < [a.min(b), a.max(b)])) as u32;
    let parts = triangles
        .iter()
        .flat_map(|&[a, b, c]| {
            let (ab, bc, ca) = (middle(a, b), middle(b, c), middle(c, a));
            [[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]
        })
        .collect();
    (points, parts)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_paper_grain_has_49_nodes_and_four_fifths_of_the_spheroid() {
        let exact = Spheroid { equatorial: 0.26, axial: 0.635 }.volume();
        let mesh = spheroid_mesh(0.26, 0.635, SpheroidMesh::PAPER, VolumeRule::Inscribed);
        assert_eq!((mesh.nodes.len(), mesh.tetrahedra.len()), (49, 112));
        assert_eq!(mesh.check(), Ok(()));
        assert!((mesh.volume() / exact - 0.798).abs() < 5e-4, "{}", mesh.volume() / exact);

        let mesh = spheroid_mesh(0.26, 0.635, SpheroidMesh { rings: 5, segments: 8 }, VolumeRule::Inscribed);
        assert_eq!(mesh.nodes.len(), 47);
        assert_eq!(mesh.check(), Ok(()));
        assert!((mesh.volume() / exact - 0.845).abs() < 6e-4, "{}", mesh.volume() / exact);
    }

    #[test]
    fn rings_lie_where_they_hold_most() {
        let seven = ring_positions(7);
        for (found, expected) in seven.iter().zip([-0.871, -0.625, -0.325, 0.0, 0.325, 0.625, 0.871]) {
            assert!((found - expected).abs() < 1e-3, "{seven:?}");
        }
        let five = ring_positions(5);
        assert!((five[3] - 0.431).abs() < 1e-3 && (five[4] - 0.801).abs() < 1e-3, "{five:?}");
    }

    #[test]
    fn preserve_holds_the_exact_volume_for_prolate_and_oblate() {
        for (a, c) in [(0.26, 0.635), (0.635, 0.26), (1.0, 1.0)] {
            for (rings, segments) in [(1, 3), (2, 4), (3, 6), (4, 5), (7, 6), (9, 12), (12, 24)] {
                let mesh = spheroid_mesh(a, c, SpheroidMesh { rings, segments }, VolumeRule::Preserve);
                assert_eq!(mesh.check(), Ok(()), "{a} {c} {rings} {segments}");
                let exact = Spheroid { equatorial: a, axial: c }.volume();
                assert!((mesh.volume() / exact - 1.0).abs() < 1e-13);
            }
        }
    }

    #[test]
    fn inscribed_nodes_lie_in_the_spheroid_and_the_volume_converges_at_second_order() {
        let exact = Spheroid { equatorial: 0.26, axial: 0.635 }.volume();
        let error =
            |n: usize| {
                let mesh =
                    spheroid_mesh(0.26, 0.635, SpheroidMesh { rings: n - 1, segments: 2 * n }, VolumeRule::Inscribed);
                assert!(mesh.nodes.iter().all(|p| {
                    (p.x / 0.635).powi(2) + (p.y.powi(2) + p.z.powi(2)) / 0.26_f64.powi(2) <= 1.0 + 1e-12
                }));
                1.0 - mesh.volume() / exact
            };
        let (coarse, fine) = (error(8), error(16));
        assert!((coarse / fine).log2() > 1.9, "{coarse} {fine}");
    }

    #[test]
    fn a_cylinder_keeps_its_length_and_converges_at_second_order() {
        for (radius, length) in [(0.26, 1.27), (0.5, 0.2)] {
            let cylinder = Cylinder { radius, length };
            let error = |segments: usize, rule: VolumeRule| {
                let mesh = cylinder_mesh(cylinder, segments, rule);
                assert_eq!(mesh.check(), Ok(()), "{segments}");
                assert_eq!(mesh.tetrahedra.len(), 3 * segments);
                assert!(mesh.nodes.iter().all(|p| p.x.abs() == 0.5 * length));
                (1.0 - mesh.volume() / cylinder.volume()).abs()
            };
            for segments in [3, 6, 24] {
                assert!(error(segments, VolumeRule::Preserve) < 1e-13);
            }
            let (coarse, fine) = (error(12, VolumeRule::Inscribed), error(24, VolumeRule::Inscribed));
            assert!((coarse / fine).log2() > 1.98, "{coarse} {fine}");
        }
    }

    #[test]
    fn the_subdivided_icosahedron_is_a_sphere() {
        for refinement in 0..4 {
            let mesh = sphere_mesh(0.5, refinement, VolumeRule::Inscribed);
            assert_eq!(mesh.tetrahedra.len(), 20 << (2 * refinement));
            assert_eq!(mesh.check(), Ok(()));
        }
        let mesh = sphere_mesh(0.5, 3, VolumeRule::Inscribed);
        assert!((mesh.volume() / 0.523_598_775_598_298_8 - 1.0).abs() < 0.01);
    }
}
