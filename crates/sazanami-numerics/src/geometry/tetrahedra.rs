//! Tetrahedral meshes: checks, quality, boundary.
//!
//! A mesh is sound when every tetrahedron has positive volume (its fourth node lies on the side to which
//! the right-hand normal of its first three points), neighbours meet in whole faces, nothing overlaps, and all
//! hangs together in one piece. Then its boundary is a closed surface and its volume the sum of its parts.

use super::SurfaceMesh;
use super::bounding_tree::{BoundingTree, Bounds};
use super::tetrahedron::{FACES, dihedral_range, longest_edge, overlap, radius_ratio, signed_volume};
use crate::{Real, Vector};

/// A solid as a set of tetrahedra.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct TetrahedralMesh {
    /// Positions of the nodes \[m].
    pub nodes: Vec<Vector>,
    /// Node indices of each tetrahedron, positively oriented.
    pub tetrahedra: Vec<[u32; 4]>,
}

/// Why a mesh is not a solid. Elements are held by index from zero and named by number from one.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum MeshError {
    /// There is nothing in it.
    #[error("the mesh holds no tetrahedra")]
    Empty,
    /// A node has a coordinate that is not a number.
    #[error("node {} of the mesh has a coordinate that is not finite", node + 1)]
    NotFinite {
        /// Index of the node.
        node: usize,
    },
    /// An element names a node that does not exist.
    #[error("tetrahedron {} names node {}, but the mesh has {nodes} nodes", tetrahedron + 1, node + 1)]
    NoSuchNode {
        /// Index of the tetrahedron.
        tetrahedron: usize,
        /// The missing node.
        node: usize,
        /// Number of nodes.
        nodes: usize,
    },
    /// A tetrahedron has next to no volume for its size.
    #[error("tetrahedron {} is degenerate: its four nodes lie in a plane (volume {volume:.3e} m^3)", tetrahedron + 1)]
    Degenerate {
        /// Index of the tetrahedron.
        tetrahedron: usize,
        /// Its volume [m^3].
        volume: Real,
    },
    /// A tetrahedron is turned inside out.
    #[error("tetrahedron {} is inverted (volume {volume:.3e} m^3; {count} of {total} are): reorder its nodes or \
             mend the mesh", tetrahedron + 1)]
    Inverted {
        /// Index of the first inverted tetrahedron.
        tetrahedron: usize,
        /// Its volume [m^3].
        volume: Real,
        /// Number of inverted tetrahedra.
        count: usize,
        /// Number of tetrahedra.
        total: usize,
    },
    /// Nodes belong to no tetrahedron.
    #[error("node {} belongs to no tetrahedron ({count} such nodes)", node + 1)]
    Unreferenced {
        /// Index of the first such node.
        node: usize,
        /// Number of such nodes.
        count: usize,
    },
    /// A face has three or more owners.
    #[error("tetrahedra {}, {} and {} share one face: a face has at most two owners",
            tetrahedra[0] + 1, tetrahedra[1] + 1, tetrahedra[2] + 1)]
    NonManifoldFace {
        /// Indices of three of the owners.
        tetrahedra: [usize; 3],
    },
    /// Two tetrahedra occupy the same space.
    #[error("tetrahedra {} and {} overlap", tetrahedra[0] + 1, tetrahedra[1] + 1)]
    Overlapping {
        /// Indices of the two.
        tetrahedra: [usize; 2],
    },
    /// The mesh falls into pieces.
    #[error("the mesh is in {pieces} pieces that share no face (tetrahedron {} is not joined to tetrahedron 1): a \
             grain is one piece; nodes may have been written twice where parts meet", tetrahedron + 1)]
    Disconnected {
        /// Number of pieces.
        pieces: usize,
        /// First tetrahedron outside the first piece.
        tetrahedron: usize,
    },
    /// More or fewer than two faces of the surface meet in an edge.
    #[error("the surface is not a closed manifold: {faces} faces meet in the edge between nodes {} and {} of the \
             surface (two must)", edge[0] + 1, edge[1] + 1)]
    NonManifoldEdge {
        /// Surface nodes of the edge.
        edge: [usize; 2],
        /// Number of faces that meet there.
        faces: usize,
    },
}

/// Quality of the tetrahedra.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MeshQuality {
    /// Smallest dihedral angle \[degree]; 70.5 in a regular tetrahedron.
    pub smallest_dihedral_angle: Real,
    /// Largest dihedral angle \[degree].
    pub largest_dihedral_angle: Real,
    /// Smallest of 3 (inscribed radius)/(circumscribed radius): 1 regular, 0 flat.
    pub smallest_radius_ratio: Real,
}

/// A tetrahedron is degenerate when its volume is below this share of its longest edge cubed.
const FLAT: Real = 1e-10;

impl TetrahedralMesh {
    /// Corners of tetrahedron `t` \[m].
    #[must_use]
    pub fn corners(&self, t: usize) -> [Vector; 4] {
        self.tetrahedra[t].map(|n| self.nodes[n as usize])
    }

    /// Volume of tetrahedron `t` [m^3], negative when inverted.
    #[must_use]
    pub fn signed_volume(&self, t: usize) -> Real {
        signed_volume(&self.corners(t))
    }

    /// Sum of the volumes [m^3].
    #[must_use]
    pub fn volume(&self) -> Real {
        (0..self.tetrahedra.len()).map(|t| self.signed_volume(t)).sum()
    }

    /// The mesh with every node taken through `map`.
    #[must_use]
    pub fn mapped(&self, map: impl Fn(Vector) -> Vector) -> Self {
        Self { nodes: self.nodes.iter().map(|&p| map(p)).collect(), tetrahedra: self.tetrahedra.clone() }
    }

    /// Drops nodes that no tetrahedron uses and returns how many there were.
    pub fn drop_unreferenced_nodes(&mut self) -> usize {
        let mut new_index = vec![u32::MAX; self.nodes.len()];
        for &n in self.tetrahedra.iter().flatten() {
            new_index[n as usize] = 0;
        }
        let mut kept = 0_u32;
        let before = self.nodes.len();
        for (old, index) in new_index.iter_mut().enumerate() {
            if *index == 0 {
                *index = kept;
                self.nodes[kept as usize] = self.nodes[old];
                kept += 1;
            }
        }
        self.nodes.truncate(kept as usize);
        for n in self.tetrahedra.iter_mut().flatten() {
            *n = new_index[*n as usize];
        }
        before - self.nodes.len()
    }

    /// Checks that the mesh is one solid piece whose tetrahedra meet face to face without overlap.
    ///
    /// # Errors
    /// The first thing found wrong, as a [`MeshError`].
    pub fn check(&self) -> Result<(), MeshError> {
        self.check_elements()?;
        self.check_references()?;
        let faces = self.faces();
        check_face_owners(&faces)?;
        self.check_connected(&faces)?;
        self.check_overlap()?;
        self.boundary().check_closed()
    }

    /// Shape of the worst and best tetrahedra.
    #[must_use]
    pub fn quality(&self) -> MeshQuality {
        let mut quality =
            MeshQuality { smallest_dihedral_angle: 180.0, largest_dihedral_angle: 0.0, smallest_radius_ratio: 1.0 };
        for t in 0..self.tetrahedra.len() {
            let corners = self.corners(t);
            let [least, greatest] = dihedral_range(&corners);
            quality.smallest_dihedral_angle = quality.smallest_dihedral_angle.min(least);
            quality.largest_dihedral_angle = quality.largest_dihedral_angle.max(greatest);
            quality.smallest_radius_ratio = quality.smallest_radius_ratio.min(radius_ratio(&corners));
        }
        quality
    }

    /// The faces that belong to one tetrahedron only, normals outward, over their own nodes (in the order of
    /// the mesh's).
    #[must_use]
    pub fn boundary(&self) -> SurfaceMesh {
        let faces = self.faces();
        let mut triangles: Vec<(u32, [u32; 3])> = Vec::new();
        for group in faces.chunk_by(|a, b| a.key == b.key) {
            if let [face] = group {
                triangles.push((4 * face.tetrahedron + face.side, face.nodes));
            }
        }
        triangles.sort_unstable();
        let mut used: Vec<u32> = triangles.iter().flat_map(|(_, nodes)| *nodes).collect();
        used.sort_unstable();
        used.dedup();
        let index = |node: u32| used.partition_point(|&n| n < node) as u32;
        SurfaceMesh {
            nodes: used.iter().map(|&n| self.nodes[n as usize]).collect(),
            triangles: triangles.iter().map(|(_, nodes)| nodes.map(index)).collect(),
        }
    }

    /// All faces of all tetrahedra, equal ones beside each other.
    fn faces(&self) -> Vec<Face> {
        let mut faces: Vec<Face> = Vec::with_capacity(4 * self.tetrahedra.len());
        for (t, tetrahedron) in self.tetrahedra.iter().enumerate() {
            for (side, &[a, b, c, _]) in FACES.iter().enumerate() {
                let nodes = [tetrahedron[a], tetrahedron[b], tetrahedron[c]];
                let mut key = nodes;
                key.sort_unstable();
                faces.push(Face { key, tetrahedron: t as u32, side: side as u32, nodes });
            }
        }
        faces.sort_unstable_by_key(|f| (f.key, f.tetrahedron, f.side));
        faces
    }

    fn check_elements(&self) -> Result<(), MeshError> {
        if self.tetrahedra.is_empty() {
            return Err(MeshError::Empty);
        }
        if let Some(node) = self.nodes.iter().position(|p| !p.is_finite()) {
            return Err(MeshError::NotFinite { node });
        }
        let mut inverted: Option<(usize, Real)> = None;
        let mut count = 0;
        for (tetrahedron, nodes) in self.tetrahedra.iter().enumerate() {
            if let Some(&node) = nodes.iter().find(|&&n| n as usize >= self.nodes.len()) {
                return Err(MeshError::NoSuchNode { tetrahedron, node: node as usize, nodes: self.nodes.len() });
            }
            let corners = self.corners(tetrahedron);
            let volume = signed_volume(&corners);
            if volume.abs() <= FLAT * longest_edge(&corners).powi(3) {
                return Err(MeshError::Degenerate { tetrahedron, volume });
            }
            if volume < 0.0 {
                inverted.get_or_insert((tetrahedron, volume));
                count += 1;
            }
        }
        match inverted {
            Some((tetrahedron, volume)) => {
                Err(MeshError::Inverted { tetrahedron, volume, count, total: self.tetrahedra.len() })
            }
            None => Ok(()),
        }
    }

    fn check_references(&self) -> Result<(), MeshError> {
        let mut used = vec![false; self.nodes.len()];
        for &n in self.tetrahedra.iter().flatten() {
            used[n as usize] = true;
        }
        let count = used.iter().filter(|&&u| !u).count();
        match used.iter().position(|&u| !u) {
            Some(node) => Err(MeshError::Unreferenced { node, count }),
            None => Ok(()),
        }
    }

    fn check_connected(&self, faces: &[Face]) -> Result<(), MeshError> {
        let mut root: Vec<usize> = (0..self.tetrahedra.len()).collect();
        for group in faces.chunk_by(|a, b| a.key == b.key) {
            if let [a, b] = group {
                let (a, b) = (find(&mut root, a.tetrahedron as usize), find(&mut root, b.tetrahedron as usize));
                root[a.max(b)] = a.min(b);
            }
        }
        let mut pieces = 0;
        let mut stray = None;
        for t in 0..root.len() {
            if find(&mut root, t) == t {
                pieces += 1;
                if pieces == 2 {
                    stray = Some(t);
                }
            }
        }
        match stray {
            Some(tetrahedron) => Err(MeshError::Disconnected { pieces, tetrahedron }),
            None => Ok(()),
        }
    }

    /// Looks for two tetrahedra that share more than their surfaces.
    fn check_overlap(&self) -> Result<(), MeshError> {
        let boxes: Vec<Bounds> = (0..self.tetrahedra.len()).map(|t| Bounds::around(self.corners(t))).collect();
        let tree = BoundingTree::new(boxes.clone());
        for (t, bounds) in boxes.iter().enumerate() {
            let corners = self.corners(t);
            let mut partner: Option<usize> = None;
            tree.for_each_overlap(bounds, |other| {
                if other > t && partner.is_none_or(|p| other < p) && overlap(&corners, &self.corners(other)) {
                    partner = Some(other);
                }
            });
            if let Some(other) = partner {
                return Err(MeshError::Overlapping { tetrahedra: [t, other] });
            }
        }
        Ok(())
    }
}

struct Face {
    key: [u32; 3],
    tetrahedron: u32,
    side: u32,
    nodes: [u32; 3],
}

fn check_face_owners(faces: &[Face]) -> Result<(), MeshError> {
    for group in faces.chunk_by(|a, b| a.key == b.key) {
        match group {
            [a, b, c, ..] => {
                let tetrahedra = [a, b, c].map(|f| f.tetrahedron as usize);
                return Err(MeshError::NonManifoldFace { tetrahedra });
            }
            // Seen from outside, two owners on opposite sides run round a face in opposite directions.
            [a, b] if same_sense(a.nodes, b.nodes) => {
                return Err(MeshError::Overlapping { tetrahedra: [a.tetrahedron as usize, b.tetrahedron as usize] });
            }
            _ => {}
        }
    }
    Ok(())
}

fn same_sense(a: [u32; 3], b: [u32; 3]) -> bool {
    (0..3).any(|shift| (0..3).all(|i| a[i] == b[(i + shift) % 3]))
}

fn find(root: &mut [usize], mut item: usize) -> usize {
    while root[item] != item {
        root[item] = root[root[item]];
        item = root[item];
    }
    item
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::{SpheroidMesh, VolumeRule, box_mesh, spheroid_mesh};

    fn unit() -> TetrahedralMesh {
        TetrahedralMesh { nodes: vec![Vector::ZERO, Vector::X, Vector::Y, Vector::Z], tetrahedra: vec![[0, 1, 2, 3]] }
    }

    #[test]
    fn sound_meshes_pass() {
        assert_eq!(unit().check(), Ok(()));
        assert_eq!(box_mesh(Vector::new(1.0, 2.0, 3.0)).check(), Ok(()));
        let grain = spheroid_mesh(0.26e-3, 0.635e-3, SpheroidMesh::PAPER, VolumeRule::Inscribed);
        assert_eq!(grain.check(), Ok(()));
    }

    #[test]
    fn the_boundary_points_outward_and_holds_the_volume() {
        let mesh = box_mesh(Vector::new(1.0, 2.0, 3.0));
        let surface = mesh.boundary();
        assert_eq!(surface.triangles.len(), 12);
        assert!((surface.volume() - 6.0).abs() < 1e-14);
        assert!((mesh.volume() - 6.0).abs() < 1e-14);
    }

    #[test]
    fn a_regular_tetrahedron_has_the_best_quality() {
        let s = 2.0_f64.sqrt();
        let regular = TetrahedralMesh {
            nodes: vec![
                Vector::new(1.0, 0.0, -1.0 / s),
                Vector::new(-1.0, 0.0, -1.0 / s),
                Vector::new(0.0, 1.0, 1.0 / s),
                Vector::new(0.0, -1.0, 1.0 / s),
            ],
            tetrahedra: vec![[0, 1, 3, 2]],
        };
        assert!(regular.signed_volume(0) > 0.0);
        let quality = regular.quality();
        assert!((quality.smallest_radius_ratio - 1.0).abs() < 1e-12);
        assert!((quality.smallest_dihedral_angle - 70.528_779_365_5).abs() < 1e-8);
        assert!((quality.largest_dihedral_angle - 70.528_779_365_5).abs() < 1e-8);
    }

    #[test]
    fn faults_are_named() {
        assert_eq!(TetrahedralMesh::default().check(), Err(MeshError::Empty));

        let mut mesh = unit();
        mesh.tetrahedra[0].swap(0, 1);
        assert!(matches!(mesh.check(), Err(MeshError::Inverted { tetrahedron: 0, count: 1, total: 1, .. })));

        let mut mesh = unit();
        mesh.nodes[3] = Vector::new(0.3, 0.3, 0.0);
        assert!(matches!(mesh.check(), Err(MeshError::Degenerate { tetrahedron: 0, .. })));

        let mut mesh = unit();
        mesh.nodes.push(Vector::ONE);
        assert_eq!(mesh.check(), Err(MeshError::Unreferenced { node: 4, count: 1 }));
        assert_eq!(mesh.drop_unreferenced_nodes(), 1);
        assert_eq!(mesh.check(), Ok(()));

        let mut mesh = unit();
        mesh.nodes[1].x = Real::NAN;
        assert_eq!(mesh.check(), Err(MeshError::NotFinite { node: 1 }));

        let mut mesh = unit();
        mesh.tetrahedra[0][2] = 9;
        assert_eq!(mesh.check(), Err(MeshError::NoSuchNode { tetrahedron: 0, node: 9, nodes: 4 }));
    }

    #[test]
    fn overlap_is_found_where_no_face_is_shared_and_where_one_is() {
        // A copy pushed into its neighbour: joined by a chain of faces, yet overlapping.
        let mut mesh = unit();
        mesh.nodes.push(Vector::new(0.3, 0.3, 0.3));
        mesh.tetrahedra.push([1, 3, 2, 4]);
        assert!(mesh.signed_volume(1) > 0.0);
        assert_eq!(mesh.check(), Err(MeshError::Overlapping { tetrahedra: [0, 1] }));
        // Negative control: outside the face it is sound.
        mesh.nodes[4] = Vector::ONE;
        mesh.tetrahedra[1] = [1, 2, 3, 4];
        assert_eq!(mesh.check(), Ok(()));
    }

    #[test]
    fn pieces_and_crowded_faces_are_found() {
        let mut mesh = unit();
        mesh.nodes.extend([5.0, 6.0, 7.0, 8.0].map(|s| Vector::new(s, s * s, s * s * s)));
        mesh.tetrahedra.push([4, 5, 6, 7]);
        if mesh.signed_volume(1) < 0.0 {
            mesh.tetrahedra[1].swap(0, 1);
        }
        assert_eq!(mesh.check(), Err(MeshError::Disconnected { pieces: 2, tetrahedron: 1 }));

        let mut mesh = unit();
        mesh.nodes.extend([Vector::ONE, 2.0 * Vector::ONE]);
        mesh.tetrahedra.extend([[1, 2, 3, 4], [1, 2, 3, 5]]);
        assert_eq!(mesh.check(), Err(MeshError::NonManifoldFace { tetrahedra: [0, 1, 2] }));
    }

    #[test]
    fn messages_count_from_one() {
        let error = MeshError::Degenerate { tetrahedron: 6, volume: 0.0 };
        assert!(error.to_string().starts_with("tetrahedron 7 is degenerate"));
    }
}
