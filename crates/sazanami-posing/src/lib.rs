//! Posing: from a case as it was read to what its solver needs, and what can be said of it before it runs.
//!
//! [`feasible`] refuses what cannot run, and builds shapes and reads beds on the way; [`assembly`] makes engine, solver and initial
//! state of a case; [`check`] predicts steps, memory, disk and time. Files are read here and none is written: what a run writes,
//! its clock and its checkpoints are those of `sazanami`.
//!
//! A drop above the floor of its box, posed and stepped by hand:
//!
//! ```
//! use std::path::Path;
//!
//! use sazanami_dem::Engine;
//! use sazanami_parallel::Solo;
//! use sazanami_posing::assembly::{fluid, grains, shared};
//! use sazanami_posing::{case, feasible, check::CostModel, machine::Machine};
//!
//! let text = r#"
//!     [domain]
//!     size = ["8 mm", "8 mm", "8 mm"]
//!     cells = [8, 8, 8]
//!     [[liquid]]
//!     region.sphere = { diameter = "3 mm" }
//!     position = ["4 mm", "4 mm", "5 mm"]
//!     [run]
//!     until = "1 ms"
//! "#;
//! let loaded = case::parse(Path::new("drop.toml"), text, &[])?;
//! feasible::check(&loaded, &Machine::this(), &CostModel::default())?;
//! let case = &loaded.case;
//! let domain = shared::domain(case, Box::<Solo>::default())?;
//! let engine = Engine::new(&domain, grains::setup(case, &[]), &[])?;
//! let floor = case.domain.lower.z;
//! let mut solver = fluid::solver(case, fluid::boundary(case)?, domain, engine, [].into(), floor)?;
//! let step = solver.stable_step();
//! solver.step(step, step.dt, |_| ())?;
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

pub mod assembly;
mod bed_shapes;
pub mod check;
pub mod feasible;
pub mod machine;
pub mod schedule;
pub mod steps;

pub use sazanami_case as case;
