//! The programs that pose the cases and measure.

pub mod moving_particles;
pub mod whole_run;
