//! Fields on the uniform grid: `.vti`.

use std::path::Path;

use sazanami_numerics::grid::Grid;

use super::appended::Appended;
use super::{DataArray, VtkError};

/// Cell fields of one instant.
#[derive(Clone, Copy, Debug)]
pub struct ImageFile<'a> {
    /// Cells of the fields: number, origin and spacing \[m].
    pub grid: &'a Grid,
    /// Time \[s].
    pub time: Option<f64>,
    /// Arrays over all cells without ghosts, x1 fastest, x3 slowest.
    pub cells: &'a [DataArray<'a>],
    /// Name of the array that ParaView colours by.
    pub scalars: Option<&'a str>,
    /// Frame of places and velocities, in a comment.
    pub frame: Option<&'a str>,
}

/// Writes cell fields to a `.vti` file, all at once.
///
/// # Errors
/// If an array does not fit the grid or the file system refuses.
pub fn write_image(path: &Path, image: &ImageFile) -> Result<(), VtkError> {
    let ImageFile { grid, time, cells, scalars, frame } = *image;
    for array in cells {
        let (expected, found) = (grid.len() * array.components, array.len());
        if expected != found {
            return Err(VtkError::WrongLength { name: array.name.clone(), expected, found });
        }
    }
    let [n1, n2, n3] = grid.cells;
    let extent = format!("0 {n1} 0 {n2} 0 {n3}");
    let (origin, spacing) = (grid.lower, grid.spacing);
    let mut file = Appended::new(
        "ImageData",
        &format!(
            " WholeExtent=\"{extent}\" Origin=\"{} {} {}\" Spacing=\"{} {} {}\"",
            origin.x, origin.y, origin.z, spacing.x, spacing.y, spacing.z
        ),
    );
    file.frame(frame);
    file.time(time);
    file.open(&format!("Piece Extent=\"{extent}\""));
    file.attributes("CellData", cells, scalars)?;
    file.close("Piece");
    file.write(path)
}
