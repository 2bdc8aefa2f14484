//! Grains by themselves: contacts, conservation, packing, ranks and restarts.

mod bridges;
mod cloud;
mod collisions;
mod conservation;
mod drag;
mod equivalence;
mod faces;
mod films;
mod packing;
mod periodic_heights;
mod rolling;
mod spheres;
mod support;
