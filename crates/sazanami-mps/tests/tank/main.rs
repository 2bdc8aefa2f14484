//! Small tanks: gates, rest, free fall, grains, threads, restarts, ranks.

mod at_rest;
mod budget;
mod conjugate;
mod drag;
mod eddies;
mod equivalence;
mod forces;
mod gates;
mod grains;
mod support;
