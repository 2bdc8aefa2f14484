//! Discretisation without physics: the domain and its verbs, fields with ghost layers, geometry of
//! rigid shapes, linear solvers, and the named sections a checkpoint is made of.
//!
//! A sphere as a mesh of tetrahedra whose volume is that of the sphere:
//!
//! ```
//! use sazanami_numerics::geometry::{VolumeRule, sphere_mesh};
//!
//! let mesh = sphere_mesh(1e-3, 2, VolumeRule::Preserve);
//! let exact = 4.0 / 3.0 * std::f64::consts::PI * 1e-9;
//! assert!((mesh.volume() / exact - 1.0).abs() < 1e-12);
//! ```

pub mod choice;
pub mod domain;
pub mod geometry;
pub mod grid;
pub mod linear;
pub mod mean_flow;
mod named_vectors;
pub mod particles;
mod random;
pub mod snapshot;
pub mod spline;

pub use random::Random;

/// Floating-point type of every physical quantity.
pub type Real = f64;
/// Vector in three dimensions.
pub type Vector = glam::DVec3;
/// Unit quaternion: an orientation that takes body coordinates to laboratory coordinates.
pub type Quaternion = glam::DQuat;
/// 3 x 3 matrix.
pub type Matrix = glam::DMat3;
