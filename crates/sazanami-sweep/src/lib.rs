//! Sweeps: many runs of one case that differ in a few keys, posed by a plan in TOML.
//!
//! A [`Plan`] says which keys take which values; [`Sweep::pose`] makes a case of each point and checks all of them before
//! anything runs; [`Sweep::run`] runs them side by side, each in a process of its own. What came of them is in one table.
//! [`calibrate`] looks for the values with which given targets are found; a plan of trajectories says which keys matter.
//!
//! ```
//! use std::path::Path;
//!
//! let text = "case = \"drop.toml\"\n[keys]\n\"liquid.0.fall.speed\" = { from = \"1 m/s\", to = \"3 m/s\", count = 3 }\n";
//! let plan = sazanami_sweep::Plan::parse(Path::new("plan.toml"), text)?;
//! let values: Vec<String> = plan.points().iter().map(|point| point[0].shown()).collect();
//! assert_eq!(values, ["1 m/s", "2 m/s", "3 m/s"]);
//! # Ok::<(), Box<sazanami::case::CaseError>>(())
//! ```

mod calibration;
mod keys;
mod plan;
mod plane;
mod points;
mod pool;
mod posed;
mod sensitivity;
mod slurm;
mod state;
mod sweep;
mod table;
mod work;

pub use calibration::{Fit, FittedKey, FittedTarget, calibrate};
pub use keys::Setting;
pub use plan::Plan;
pub use pool::SideBySide;
pub use posed::{Needs, Run};
pub use sensitivity::SENSITIVITY;
pub use state::{Progressed, State};
pub use sweep::Sweep;
pub use table::TABLE;
pub use work::{Outcome, Sensitivity};
