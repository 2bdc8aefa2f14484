//! sazanami: grains of sand under moving water. Reads a case, runs it, and tells what came of it.
//!
//! The command line and every other front end use this crate and nothing below it.

pub mod bench;
pub mod case;
pub mod check;
pub mod clock;
pub mod error;
pub mod machine;
pub mod progress;
pub mod results;
pub mod run;
pub mod schedule;
pub mod verify;
