//! Beds come to an end, whatever lies on what.

use sazanami_dem::{Body, Damping, Grain, Interactions, LinearSpringDashpot, Packing, PackingSettings, Stage};
use sazanami_numerics::domain::Domain;
use sazanami_numerics::grid::Grid;
use sazanami_numerics::{Real, Vector};

const RADIUS: Real = 0.5e-3;

/// Drops `count` spheres into a box with room for nine in a layer, until they rest or `longest` \[s] is over.
fn pack(count: u64, longest: Real) -> (Packing, Stage, Real) {
    let upper = Vector::new(3.6e-3, 3.6e-3, 4e-3);
    let domain = Domain::solo(Grid::new([8, 8, 8], Vector::ZERO, upper), [false; 3]);
    let law = LinearSpringDashpot {
        normal_stiffness: 100.0,
        tangential_stiffness: 100.0,
        damping: Damping::Restitution(0.3),
        ..LinearSpringDashpot::SAND
    };
    let settings = PackingSettings { longest, ..PackingSettings::new(Vector::ZERO, upper) };
    let grains = (0..count).map(|id| Grain::new(id, 2650.0, Vector::ZERO)).collect();
    let bodies = vec![Body::ball(RADIUS)];
    let mut packing =
        Packing::new(&domain, settings, bodies, Interactions::uniform(1, law), grains).expect("the case is sound");
    loop {
        let report = packing.step(&domain).expect("nothing goes wrong");
        if matches!(report.stage, Stage::Done | Stage::GivenUp) {
            return (packing, report.stage, report.switched);
        }
    }
}

#[test]
fn a_single_layer_on_the_floor_is_a_bed() {
    let (packing, stage, switched) = pack(9, 0.5);
    assert_eq!(stage, Stage::Done);
    assert!(switched > 0.0 && switched < 0.5, "gravity took its true value at {switched} s");
    assert!(packing.bed().iter().all(|grain| (grain.position.z / RADIUS - 1.0).abs() < 0.02));
    // Negative control: without the time to fall there is no bed, and the next layer lies on the first.
    assert_eq!(pack(9, 2e-4).1, Stage::GivenUp);
    let (packing, stage, _) = pack(18, 0.5);
    assert_eq!(stage, Stage::Done);
    assert!(packing.bed().iter().any(|grain| grain.position.z > 1.5 * RADIUS));
}
