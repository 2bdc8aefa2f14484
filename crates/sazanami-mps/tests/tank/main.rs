//! Small tanks: rest, free fall, grains, threads, restarts, ranks.

mod at_rest;
mod budget;
mod equivalence;
mod grains;
mod support;
