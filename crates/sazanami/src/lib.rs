//! sazanami: grains of sand under moving water. Reads a case, runs it, and reports what came of it.
//!
//! The command line and every other front end use this crate and nothing below it.
//!
//! A case is posed as text with units and checked before anything is allocated; [`run::run`] runs it (`examples/`).
//!
//! ```
//! use std::path::Path;
//!
//! use sazanami::case;
//!
//! let text = r#"
//!     [domain]
//!     size = ["8 mm", "8 mm", "8 mm"]
//!     cells = [12, 12, 12]
//!     [[liquid]]
//!     region.sphere = { diameter = "3 mm" }
//!     position = ["4 mm", "4 mm", "5 mm"]
//!     [run]
//!     until = "1 ms"
//! "#;
//! let loaded = case::parse(Path::new("drop.toml"), text, &[]).unwrap();
//! assert_eq!(loaded.case.domain.cells, [12, 12, 12]);
//! // What is wrong is said with its line and a suggestion.
//! let error = case::parse(Path::new("drop.toml"), &text.replace("until", "untill"), &[]).unwrap_err();
//! assert!(error.to_string().contains("did you mean `until`?"));
//! ```

pub mod analyse;
pub mod artist;
pub mod assembly;
pub mod bed_file;
pub mod check;
mod checkpoints;
pub mod clock;
mod columns;
pub mod doctor;
pub mod error;
pub mod examine;
pub mod feasible;
pub mod finished;
pub mod followers;
mod job;
mod lock;
mod log;
pub mod machine;
mod naming;
pub mod progress;
mod recorder;
pub mod reference;
pub mod results;
pub mod run;
pub mod saved;
pub mod schedule;
mod simulation;
pub mod state;
pub mod stop;
pub mod tanks;
pub mod templates;
pub mod volume_fractions;
mod water;
pub mod workers;

pub use sazanami_case as case;
