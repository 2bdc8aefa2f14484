//! Discretisation.

mod linear;
mod volume_fractions;

#[global_allocator]
static ALLOCATOR: sazanami_test_support::CountingAllocator = sazanami_test_support::CountingAllocator;
