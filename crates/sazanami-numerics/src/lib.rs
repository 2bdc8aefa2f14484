//! Discretisation without physics: the domain and its verbs, fields with ghost layers, geometry of
//! rigid shapes, linear solvers, and the named sections a checkpoint is made of.

pub mod choice;
pub mod domain;
pub mod geometry;
pub mod grid;
pub mod linear;
pub mod particles;
pub mod snapshot;
pub mod spline;

/// Floating-point type of every physical quantity.
pub type Real = f64;
/// Vector in three dimensions.
pub type Vector = glam::DVec3;
/// Unit quaternion: an orientation that takes body coordinates to laboratory coordinates.
pub type Quaternion = glam::DQuat;
/// 3 x 3 matrix.
pub type Matrix = glam::DMat3;
