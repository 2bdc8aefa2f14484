//! VTK XML files that ParaView opens without a plug-in: fields on the grid, bodies in their true shape, time series.
//!
//! The data stand raw behind the XML, LZ4-compressed in blocks
//! (VTK User's Guide, "XML file formats"; <https://docs.vtk.org/en/latest/vtk_file_formats/vtkxml_file_format.html>).

mod appended;
mod array;
mod bodies;
mod image;
mod points;
mod read;
mod series;

pub use array::DataArray;
pub use bodies::{BodyFile, write_bodies};
pub use image::{ImageFile, write_image};
pub use points::{PointFile, write_points};
pub use read::{LIQUID, ReadError, Values, VtkFile};
pub use series::{PvdSeries, SeriesEntry, read_series};

use std::io;
use std::path::PathBuf;

use thiserror::Error;

/// Why a VTK file could not be written.
#[derive(Debug, Error)]
pub enum VtkError {
    /// The file system refused.
    #[error("cannot write {path}: {source}", path = path.display())]
    Write {
        /// File to be written.
        path: PathBuf,
        /// Refusal of the file system.
        source: io::Error,
    },
    /// An array does not fit the grid or the bodies.
    #[error("array `{name}` has {found} values where {expected} are needed")]
    WrongLength {
        /// Name of the array.
        name: String,
        /// Number of values needed.
        expected: usize,
        /// Number of values given.
        found: usize,
    },
    /// No array has the name of the active one.
    #[error("there is no array `{name}` to colour by")]
    NoSuchArray {
        /// Name asked for.
        name: String,
    },
    /// The bodies have more corners than the file can number.
    #[error("{nodes} corners of bodies are more than one file can number")]
    TooManyNodes {
        /// Number of corners.
        nodes: usize,
    },
}
