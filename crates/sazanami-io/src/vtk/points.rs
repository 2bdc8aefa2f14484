//! Points with values, such as spheres and particles: `.vtp`.

use std::path::Path;

use sazanami_numerics::Vector;

use super::appended::Appended;
use super::{DataArray, VtkError};

/// Points of one instant.
#[derive(Clone, Copy, Debug)]
pub struct PointFile<'a> {
    /// Places \[m].
    pub places: &'a [Vector],
    /// Whether their coordinates have eight bytes wherever they lie.
    pub double: bool,
    /// Time \[s].
    pub time: Option<f64>,
    /// Arrays with one scalar or vector per point.
    pub arrays: &'a [DataArray<'a>],
    /// Name of the array that ParaView colours by.
    pub scalars: Option<&'a str>,
    /// Frame of places and velocities, in a comment.
    pub frame: Option<&'a str>,
}

/// Writes points as vertices to a `.vtp` file, all at once; coordinates in four bytes, or in eight where [`PointFile::double`] asks for
/// them or they lie far from the origin.
///
/// # Errors
/// If an array does not fit the points or the file system refuses.
pub fn write_points(path: &Path, file: &PointFile) -> Result<(), VtkError> {
    let PointFile { places, double, time, arrays, scalars, frame } = *file;
    let count = places.len();
    for array in arrays {
        let (expected, found) = (count * array.components, array.len());
        if expected != found {
            return Err(VtkError::WrongLength { name: array.name.clone(), expected, found });
        }
    }
    if i32::try_from(count).is_err() {
        return Err(VtkError::TooManyNodes { nodes: count });
    }
    let mut file = Appended::new("PolyData", "");
    file.frame(frame);
    file.time(time);
    file.open(&format!("Piece NumberOfPoints=\"{count}\" NumberOfVerts=\"{count}\""));
    file.attributes("PointData", arrays, scalars)?;
    file.open("Points");
    file.array(&DataArray::places(places, double), "");
    file.close("Points");
    file.open("Verts");
    let numbers: Vec<i32> = (0..count as i32).collect();
    file.array(&DataArray::owned("connectivity", 1, &numbers), "");
    let offsets: Vec<i32> = (1..=count as i32).collect();
    file.array(&DataArray::owned("offsets", 1, &offsets), "");
    file.close("Verts");
    file.close("Piece");
    file.write(path)
}
