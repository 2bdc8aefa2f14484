//! sazanami: grains of sand under moving water. Reads a case, runs it, and tells what came of it.
//!
//! The command line and every other front end use this crate and nothing below it.

pub mod analyse;
pub mod assembly;
pub mod bed_file;
pub mod case;
pub mod check;
pub mod clock;
mod columns;
pub mod doctor;
pub mod error;
pub mod feasible;
mod lock;
mod log;
pub mod machine;
pub mod progress;
mod recorder;
pub mod reference;
pub mod results;
pub mod run;
pub mod schedule;
mod simulation;
pub mod stop;
pub mod tanks;
