//! Rigid bodies in their true shape: `.vtp`.

use std::borrow::Cow;
use std::path::Path;

use sazanami_numerics::Vector;

use super::appended::Appended;
use super::{DataArray, VtkError};
use crate::Bodies;

/// Bodies of one instant.
#[derive(Clone, Copy, Debug)]
pub struct BodyFile<'a> {
    /// Surfaces and poses.
    pub bodies: Bodies<'a>,
    /// Time \[s].
    pub time: Option<f64>,
    /// Arrays with one scalar or vector per body; each corner of a body gets its body's value.
    pub arrays: &'a [DataArray<'a>],
    /// Name of the array that ParaView colours by.
    pub scalars: Option<&'a str>,
    /// Frame of places and velocities, in a comment.
    pub frame: Option<&'a str>,
}

/// Writes the surfaces of all bodies, posed, to a `.vtp` file, all at once.
///
/// # Errors
/// If an array does not fit the bodies or the file system refuses.
pub fn write_bodies(path: &Path, file: &BodyFile) -> Result<(), VtkError> {
    let BodyFile { bodies, time, arrays, scalars, frame } = *file;
    for array in arrays {
        let (expected, found) = (bodies.poses.len() * array.components, array.len());
        if expected != found {
            return Err(VtkError::WrongLength { name: array.name.clone(), expected, found });
        }
    }
    let (nodes, triangles) = bodies.count();
    if i32::try_from(nodes.max(3 * triangles)).is_err() {
        return Err(VtkError::TooManyNodes { nodes });
    }
    let mut file = Appended::new("PolyData", "");
    file.frame(frame);
    file.time(time);
    file.open(&format!("Piece NumberOfPoints=\"{nodes}\" NumberOfPolys=\"{triangles}\""));
    let arrays: Vec<_> = arrays.iter().map(|array| on_nodes(array, &bodies)).collect();
    file.attributes("PointData", &arrays, scalars)?;
    drop(arrays);
    file.open("Points");
    file.array(&DataArray::places(&points(&bodies, nodes), false), "");
    file.close("Points");
    file.open("Polys");
    file.array(&DataArray::owned("connectivity", 1, &connectivity(&bodies, triangles)), "");
    let offsets: Vec<i32> = (1..=triangles as i32).map(|triangle| 3 * triangle).collect();
    file.array(&DataArray::owned("offsets", 1, &offsets), "");
    file.close("Polys");
    file.close("Piece");
    file.write(path)
}

/// Spreads the value of each body over its nodes.
fn on_nodes<'a>(array: &DataArray<'a>, bodies: &Bodies) -> DataArray<'a> {
    let width = array.components * array.element.width();
    let mut bytes = Vec::with_capacity(bodies.count().0 * width);
    for (body, value) in array.bytes.chunks_exact(width).enumerate() {
        for _ in bodies.surface(body).nodes {
            bytes.extend_from_slice(value);
        }
    }
    DataArray { bytes: Cow::Owned(bytes), name: array.name.clone(), ..*array }
}

/// Nodes of all bodies in the laboratory \[m].
fn points(bodies: &Bodies, nodes: usize) -> Vec<Vector> {
    let mut points = Vec::with_capacity(nodes);
    for body in 0..bodies.poses.len() {
        bodies.for_each_node(body, |node| points.push(node));
    }
    points
}

/// Node numbers of all triangles.
fn connectivity(bodies: &Bodies, triangles: usize) -> Vec<i32> {
    let mut connectivity = Vec::with_capacity(3 * triangles);
    let mut first = 0;
    for body in 0..bodies.poses.len() {
        let surface = bodies.surface(body);
        connectivity.extend(surface.triangles.iter().flatten().map(|&node| first + node as i32));
        first += surface.nodes.len() as i32;
    }
    connectivity
}
