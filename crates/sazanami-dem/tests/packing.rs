//! Beds come to an end, whatever lies on what.

use sazanami_dem::{Body, Damping, Grain, Interactions, LinearSpringDashpot, Packing, PackingSettings, Stage};
use sazanami_numerics::domain::Domain;
use sazanami_numerics::grid::Grid;
use sazanami_numerics::{Real, Vector};

const RADIUS: Real = 0.5e-3;
/// Stiffness of the springs, and of those that are to be softened [N/m].
const SOFT: Real = 100.0;
const STIFF: Real = 2000.0;

/// Drops `count` spheres into a box with room for nine in a layer, until they rest or `longest` \[s] is over.
fn pack(count: u64, longest: Real) -> (Packing, Stage, Real) {
    let (packing, stage, switched, _) = pack_softly(count, longest, [SOFT, 1.0], 1);
    (packing, stage, switched)
}

/// The same with springs of a stiffness [N/m] of which they have a part while the grains fall, and the sub-steps that it took.
fn pack_softly(
    count: u64,
    longest: Real,
    [stiffness, stiffness_scale]: [Real; 2],
    seed: u64,
) -> (Packing, Stage, Real, usize) {
    let upper = Vector::new(3.6e-3, 3.6e-3, 4e-3);
    let domain = Domain::solo(Grid::new([8, 8, 8], Vector::ZERO, upper), [false; 3]);
    let law = LinearSpringDashpot {
        normal_stiffness: stiffness,
        tangential_stiffness: stiffness,
        damping: Damping::Restitution(0.3),
        ..LinearSpringDashpot::SAND
    };
    let settings = PackingSettings { longest, stiffness_scale, seed, ..PackingSettings::new(Vector::ZERO, upper) };
    let grains = (0..count).map(|id| Grain::new(id, 2650.0, Vector::ZERO)).collect();
    let bodies = vec![Body::ball(RADIUS)];
    let mut packing =
        Packing::new(&domain, settings, bodies, Interactions::uniform(1, law), grains).expect("the case is sound");
    let mut substeps = 0;
    loop {
        let report = packing.step(&domain).expect("nothing goes wrong");
        substeps += report.contacts.substeps;
        if matches!(report.stage, Stage::Done | Stage::GivenUp) {
            return (packing, report.stage, report.switched, substeps);
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

#[test]
fn beds_of_softer_springs_are_the_same_beds_with_their_own_springs_at_the_end() {
    let mean = |packing: &Packing| {
        let bed = packing.bed();
        bed.iter().map(|grain| grain.position.z).sum::<Real>() / bed.len() as Real / RADIUS
    };
    let seeds = 1..=3;
    let beds = |scale: Real| -> Vec<(Real, usize)> {
        let of = |seed: u64| {
            let (packing, stage, _, substeps) = pack_softly(60, 1.0, [STIFF, scale], seed);
            assert_eq!(stage, Stage::Done);
            let springs = packing.engine().interactions().law(0, 0).stiffness(RADIUS)[0];
            assert_eq!(springs, STIFF, "they are stiff at the end");
            (mean(&packing), substeps)
        };
        seeds.clone().map(of).collect()
    };
    let (stiff, soft) = (beds(1.0), beds(0.05));
    let average = |beds: &[(Real, usize)]| beds.iter().map(|(height, _)| height).sum::<Real>() / beds.len() as Real;
    let spread = stiff.iter().map(|(height, _)| (height - average(&stiff)).abs()).fold(0.0, Real::max);
    let apart = (average(&soft) - average(&stiff)).abs();
    assert!(apart < 2.0 * spread.max(0.05), "{apart} radii apart, {spread} among seeds: {stiff:?} {soft:?}");
    let work = |beds: &[(Real, usize)]| beds.iter().map(|(_, substeps)| substeps).sum::<usize>();
    assert!(4 * work(&soft) < 3 * work(&stiff), "{} sub-steps for {}", work(&soft), work(&stiff));
}

#[test]
fn fine_grains_do_not_fall_from_a_lattice_of_the_largest() {
    let upper = Vector::new(20e-3, 20e-3, 60e-3);
    let settings = PackingSettings::new(Vector::ZERO, upper);
    let scaled = |id: u64, scale: Real| Grain { scale, ..Grain::new(id, 2650.0, Vector::ZERO) };
    let mut grains: Vec<Grain> = (0..3000).map(|id| scaled(id, if id % 1500 == 700 { 20.0 } else { 1.0 })).collect();
    let bodies = [Body::ball(0.25e-3)];
    settings.arrange(&bodies, &mut grains).expect("the box is wide enough");
    let radius = |grain: &Grain| 0.25e-3 * grain.scale;
    let top = grains.iter().map(|grain| grain.position.z + radius(grain)).fold(0.0, Real::max);
    assert!(top < 24e-3, "two layers of the large ones and three of the others, not {top} m");
    for (n, a) in grains.iter().enumerate() {
        assert!(radius(a) <= a.position.min_element() && a.position.x.max(a.position.y) + radius(a) <= upper.x);
        let apart = |b: &Grain| a.position.distance(b.position) >= radius(a) + radius(b);
        assert!(grains[..n].iter().all(apart), "grain {n} overlaps another");
    }
    // Negative control: as one lattice of the largest it would be as high as a house.
    let sizes: Vec<[Real; 2]> = grains.iter().map(|grain| [2.0 * radius(grain); 2]).collect();
    assert!((settings.lattice_height(&sizes).expect("wide enough") - top).abs() < 1e-3);
    assert!(settings.lattice_height(&vec![[10e-3; 2]; 3000]).expect("wide enough") > 30.0);
}
