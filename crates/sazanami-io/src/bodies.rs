//! Rigid bodies as the writers of this crate see them: surfaces in body coordinates, and poses.

use sazanami_numerics::{Matrix, Quaternion, Vector};

/// A closed surface in body coordinates.
#[derive(Clone, Copy, Debug)]
pub struct BodySurface<'a> {
    /// Corners \[m], from the body's centre of mass.
    pub nodes: &'a [Vector],
    /// Node numbers of each triangle, anticlockwise seen from outside.
    pub triangles: &'a [[u32; 3]],
}

/// Pose and surface of a body.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BodyPose {
    /// Index into the surfaces.
    pub surface: u32,
    /// Size over that of the surface.
    pub scale: f64,
    /// Centre of mass \[m].
    pub position: Vector,
    /// Orientation: takes body coordinates to laboratory coordinates.
    pub orientation: Quaternion,
}

/// Many bodies that share few surfaces.
#[derive(Clone, Copy, Debug)]
pub struct Bodies<'a> {
    /// Surfaces, each used by any number of bodies.
    pub surfaces: &'a [BodySurface<'a>],
    /// One pose per body.
    pub poses: &'a [BodyPose],
}

impl<'a> Bodies<'a> {
    /// No bodies at all.
    #[must_use]
    pub const fn none() -> Self {
        Self { surfaces: &[], poses: &[] }
    }

    /// Surface of body `index`.
    pub fn surface(&self, index: usize) -> BodySurface<'a> {
        self.surfaces[self.poses[index].surface as usize]
    }

    /// Calls `with` for every node of body `index`, in laboratory coordinates \[m].
    pub fn for_each_node(&self, index: usize, mut with: impl FnMut(Vector)) {
        let pose = &self.poses[index];
        let rotation = Matrix::from_quat(pose.orientation);
        for &node in self.surface(index).nodes {
            with(pose.position + rotation * (pose.scale * node));
        }
    }

    /// Radius of each body about its origin \[m].
    #[must_use]
    pub fn outer_radii(&self) -> Vec<f64> {
        let outer = |surface: &BodySurface| surface.nodes.iter().map(|node| node.length()).fold(0.0, f64::max);
        let of_surfaces: Vec<f64> = self.surfaces.iter().map(outer).collect();
        self.poses.iter().map(|pose| pose.scale * of_surfaces[pose.surface as usize]).collect()
    }

    /// Total numbers of nodes and triangles.
    pub(crate) fn count(&self) -> (usize, usize) {
        self.poses.iter().fold((0, 0), |(nodes, triangles), pose| {
            let surface = self.surfaces[pose.surface as usize];
            (nodes + surface.nodes.len(), triangles + surface.triangles.len())
        })
    }
}
