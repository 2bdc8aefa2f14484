//! The programs that pose the cases and measure.

pub mod arrays;
pub mod beds;
pub mod contact;
pub mod free_grains;
pub mod moving_particles;
pub mod pair;
pub mod random_bed;
pub mod reduced;
pub mod ripples;
pub mod shift;
pub mod single_phase;
pub mod tank;
pub mod transport;
pub mod volume_fractions;
pub mod whole_run;
