//! Cases with known results: programs that measure, beside references and bands.
//!
//! [`grid`] and [`particles`] are experiments on the two fluid solvers; [`cases`] measures them, and whole runs, and
//! [`verify`] judges what was measured.

pub mod cases;
pub mod catalogue;
pub mod grid;
pub mod measured;
pub mod particles;
pub mod verify;
