//! Small tanks: gates, rest, free fall, grains, threads, restarts, ranks; what a step allocates.

mod at_rest;
mod budget;
mod conjugate;
mod drag;
mod economy;
mod eddies;
mod equivalence;
mod forces;
mod gates;
mod grains;
mod support;
mod walls;

#[global_allocator]
static ALLOCATOR: sazanami_test_support::CountingAllocator = sazanami_test_support::CountingAllocator;
