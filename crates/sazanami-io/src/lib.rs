//! Files: checkpoints, VTK series, tables, meshes, readings of experiments, pictures.
//!
//! Everything here takes plain slices and small structs, and knows no physics. A file that others
//! rely on is never seen half written: it is made aside, synced, and renamed into place.

mod blocks;
mod bodies;
pub mod checkpoint;
mod element;
mod measured_profile;
pub mod mesh;
pub mod picture;
pub mod readings;
mod replace;
pub mod table;
pub mod vtk;

pub use bodies::{Bodies, BodyPose, BodySurface};
pub use element::{Element, ElementType};
pub use measured_profile::MeasuredProfile;
pub use replace::{remove_unfinished, replace_file};
