//! Measures of beds and ripples.

mod gathering;
mod ripples;
mod sand_bed;
