//! Files: checkpoints, VTK series, tables, meshes, beds, readings of experiments.
//!
//! Everything here takes plain slices and small structs, and knows no physics. A file that others
//! rely on is never seen half written: it is made aside, synced, and renamed into place.
//!
//! A table with units, written row by row:
//!
//! ```
//! use sazanami_io::table::{Column, SeriesWriter, Value};
//!
//! let folder = tempfile::tempdir()?;
//! let path = folder.path().join("series.csv");
//! let mut series = SeriesWriter::create(&path, &[Column::new("time", "s")])?;
//! series.record(0, &[Value::Real(0.0)])?;
//! assert_eq!(std::fs::read_to_string(&path)?, "step,time [s]\n0,0\n");
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

pub mod bed;
mod blocks;
mod bodies;
pub mod checkpoint;
mod element;
pub mod input;
mod measured_profile;
pub mod mesh;
pub mod readings;
mod replace;
pub mod table;
pub mod vtk;
mod word;

pub use bodies::{Bodies, BodyPose, BodySurface};
pub use element::{Element, ElementType};
pub use measured_profile::MeasuredProfile;
pub use replace::{remove_unfinished, replace_file};
pub use word::as_word;
