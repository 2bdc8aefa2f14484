//! What the tests share.

use sazanami_dem::*;
use sazanami_numerics::Vector;
use sazanami_numerics::domain::Domain;
use sazanami_numerics::grid::Grid;
use sazanami_numerics::snapshot::Snapshot;

/// A box of 2 m about the origin, whose sides nothing reaches.
pub fn domain() -> Domain {
    Domain::solo(Grid::new([4, 4, 4], Vector::splat(-1.0), Vector::splat(1.0)), [false; 3])
}

/// Grains of one material that may go anywhere.
pub fn setup(bodies: Vec<Body>, law: LinearSpringDashpot, walls: Vec<Wall>) -> Setup {
    Setup {
        bodies,
        interactions: Interactions::uniform(1, law),
        walls,
        region: [Vector::splat(-1e3), Vector::splat(1e3)],
        ghost_margin: 0.0,
    }
}

/// A floor at the height of the origin.
pub fn floor() -> Vec<Wall> {
    vec![Wall::at_rest(Vector::ZERO, Vector::Z, 0)]
}

/// Grains and contacts of all ranks, on the first.
pub fn snapshot_of(domain: &Domain, engine: &mut Engine) -> Snapshot {
    let mut snapshot = Snapshot::default();
    engine.snapshot(domain, "dem/", &mut snapshot);
    snapshot
}
