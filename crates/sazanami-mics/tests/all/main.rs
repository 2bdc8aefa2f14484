//! Gas and liquid on a grid with grains: small boxes.

mod exchange;
mod flow;
mod flow_economy;
mod free_grains;
mod projection;
mod room;
mod steady;
mod support;
mod surface_tension;
mod transport;

#[global_allocator]
static ALLOCATOR: sazanami_test_support::CountingAllocator = sazanami_test_support::CountingAllocator;
