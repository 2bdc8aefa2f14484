//! sazanami: grains of sand under moving water. Reads a case, runs it, and reports what came of it.
//!
//! The command line and every other front end use this crate and nothing below it.
//!
//! A case is posed as text with units and checked before anything is allocated; [`run::run`] runs it into a folder, whose
//! tables [`analyse::Table`] reads:
//!
//! ```
//! use std::path::Path;
//!
//! use sazanami::analyse::Table;
//! use sazanami::case;
//! use sazanami::progress::Silent;
//! use sazanami::run::{RunOptions, run};
//! use sazanami::stop::Stop;
//!
//! # fn main() -> Result<(), Box<dyn std::error::Error>> {
//! let text = r#"
//!     [domain]
//!     size = ["8 mm", "8 mm", "8 mm"]
//!     cells = [12, 12, 12]
//!     [[liquid]]
//!     region.sphere = { diameter = "3 mm" }
//!     position = ["4 mm", "4 mm", "5 mm"]
//!     [output]
//!     series = { steps = 1 }
//!     [run]
//!     until = "1 ms"
//! "#;
//! // What is wrong is said with its line and a suggestion.
//! let error = case::parse(Path::new("drop.toml"), &text.replace("until", "untill"), &[]).unwrap_err();
//! assert!(error.to_string().contains("did you mean `until`?"));
//!
//! // Keys may be set as on the command line.
//! let loaded = case::parse(Path::new("drop.toml"), text, &["gravity=5 m/s^2".into()])?;
//! assert_eq!(loaded.case.domain.cells, [12, 12, 12]);
//!
//! let folder = std::env::temp_dir().join(format!("sazanami-drop-{}", std::process::id()));
//! let options = RunOptions { out: Some(folder.clone()), ..RunOptions::default() };
//! let summary = run(&loaded, &options, &mut Silent, &Stop::new())?;
//! assert_eq!(summary.time, 1e-3);
//!
//! let series = Table::read(&folder.join("series.csv"))?.ok_or("the run wrote a series")?;
//! let (time, change) = (series.column("time"), series.column("liquid_volume_relative_change"));
//! assert_eq!((time[0], time.last()), (0.0, Some(&1e-3)));
//! assert!(change.iter().all(|change| change.abs() < 1e-6));
//! # std::fs::remove_dir_all(folder)?;
//! # Ok(())
//! # }
//! ```
//!
//! `examples/settling_sphere.rs` adds grains, a listener that can end the run, and the fields of a checkpoint.

pub mod analyse;
pub mod artist;
pub mod bed_file;
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
mod naming;
pub mod progress;
mod recorder;
pub mod reference;
pub mod results;
pub mod run;
pub mod saved;
mod simulation;
pub mod state;
pub mod stop;
pub mod tanks;
pub mod templates;
pub mod volume_fractions;
mod water;
pub mod workers;

pub use sazanami_posing::{case, check, machine};
