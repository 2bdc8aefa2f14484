//! Runs of whole cases, and what is read, refused, kept and drawn of them.

mod analysis;
mod bodies;
mod bridges;
mod carrying_flow;
mod closed_water;
mod copies;
mod craters;
mod creeping;
mod displaced;
mod driven;
mod dry;
mod economy;
mod entry_pressure;
mod equivalence;
mod examples;
mod failures;
mod feeding;
mod films;
mod flat_faces;
mod free_water;
mod gates;
mod grain_files;
mod grain_sizes;
mod held;
mod inviscid;
mod moving_particles;
mod moving_walls;
mod odd_tanks;
mod open_sides;
mod packing;
mod plain_tanks;
mod poured;
mod predictions;
mod prepared;
mod reports;
mod restart;
mod shipped_bed;
mod sides_observed;
mod states;
mod support;
mod surface_tension;
mod thick_surface;
mod weights;

#[global_allocator]
static ALLOCATOR: sazanami_test_support::CountingAllocator = sazanami_test_support::CountingAllocator;
