//! Beds come to an end, whatever lies on what.

use sazanami_dem::{
    Body, Damping, Grain, Interactions, LinearSpringDashpot, Packing, PackingSettings, Setup, Stage, WALL, Wall,
};
use sazanami_numerics::domain::Domain;
use sazanami_numerics::grid::Grid;
use sazanami_numerics::snapshot::Snapshot;
use sazanami_numerics::{Real, Vector};

const RADIUS: Real = 0.5e-3;
/// Stiffness of the springs, and of those that are to be softened [N/m].
const SOFT: Real = 100.0;
const STIFF: Real = 2000.0;

/// A packing: the bed, whether it rests, when gravity took its true value \[s], sub-steps, and the softest springs on the way over
/// their own.
struct Packed {
    packing: Packing,
    stage: Stage,
    switched: Real,
    substeps: usize,
    softest: Real,
}

/// Drops `count` spheres into a box with room for nine in a layer.
fn pack_with(count: u64, stiffness: Real, settings: PackingSettings) -> Packed {
    let upper = Vector::new(3.6e-3, 3.6e-3, 4e-3);
    let domain = Domain::solo(Grid::new([8, 8, 8], Vector::ZERO, upper), [false; 3]);
    let law = LinearSpringDashpot {
        normal_stiffness: stiffness,
        tangential_stiffness: stiffness,
        damping: Damping::Restitution(0.3),
        ..LinearSpringDashpot::SAND
    };
    let settings = PackingSettings { upper, ..settings };
    let grains = (0..count).map(|id| Grain::new(id, 2650.0, Vector::ZERO)).collect();
    let bodies = vec![Body::ball(RADIUS)];
    let mut packing =
        Packing::new(&domain, settings, bodies, Interactions::uniform(1, law), grains).expect("the case is sound");
    let (mut substeps, mut softest) = (0, Real::INFINITY);
    loop {
        softest = softest.min(springs(&packing) / stiffness);
        let report = packing.step(&domain).expect("nothing goes wrong");
        substeps += report.contacts.substeps;
        if matches!(report.stage, Stage::Done | Stage::GivenUp) {
            return Packed { packing, stage: report.stage, switched: report.switched, substeps, softest };
        }
    }
}

/// Stiffness of the springs [N/m].
fn springs(packing: &Packing) -> Real {
    packing.engine().interactions().law(0, 0).normal_stiffness
}

/// Drops spheres until they rest or `longest` \[s] is over.
fn pack(count: u64, longest: Real) -> (Packing, Stage, Real) {
    let settings = PackingSettings { longest, ..PackingSettings::new(Vector::ZERO, Vector::ZERO) };
    let Packed { packing, stage, switched, .. } = pack_with(count, SOFT, settings);
    (packing, stage, switched)
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
fn beds_packed_with_softer_springs_are_the_same_beds_with_their_own_springs_at_the_end() {
    let mean = |packing: &Packing| {
        let bed = packing.bed();
        bed.iter().map(|grain| grain.position.z).sum::<Real>() / bed.len() as Real / RADIUS
    };
    let beds = |settings: PackingSettings, softest: std::ops::RangeInclusive<Real>| -> Vec<(Real, Real)> {
        let of = |seed: u64| {
            let packed = pack_with(60, STIFF, PackingSettings { seed, ..settings.clone() });
            assert_eq!(packed.stage, Stage::Done);
            assert_eq!(springs(&packed.packing), STIFF, "they are stiff at the end");
            assert!(softest.contains(&packed.softest), "{}", packed.softest);
            let engine = packed.packing.engine();
            let saved = engine.time() / engine.contact_time_step() / packed.substeps as Real;
            (mean(&packed.packing), saved)
        };
        (1..=3).map(of).collect()
    };
    let settings = PackingSettings::new(Vector::ZERO, Vector::ZERO);
    // A bed that is taken after a time has its own springs throughout: here long after it has come to rest.
    let timed = PackingSettings { by_time_only: true, settling_time: 0.12, ..settings.clone() };
    let (stiff, soft) = (beds(timed, 1.0..=1.0), beds(settings.clone(), 0.0..=0.2));
    let average = |beds: &[(Real, Real)]| beds.iter().map(|(height, _)| height).sum::<Real>() / beds.len() as Real;
    let spread = stiff.iter().map(|(height, _)| (height - average(&stiff)).abs()).fold(0.0, Real::max);
    let apart = |beds: &[(Real, Real)]| (average(beds) - average(&stiff)).abs();
    let allowed = 2.0 * spread.max(0.05);
    assert!(apart(&soft) < allowed, "{} radii apart, {spread} among seeds: {stiff:?} {soft:?}", apart(&soft));
    let saved = |beds: &[(Real, Real)]| beds.iter().map(|(_, saved)| saved).sum::<Real>() / beds.len() as Real;
    assert!(saved(&soft) > 1.5 && saved(&stiff) < 1.0, "{soft:?} {stiff:?}");
    // Negative control: a bed that is another, without friction in the fall, is told from it.
    let slippery = beds(PackingSettings { fall_friction: 0.0, ..settings }, 0.0..=0.2);
    assert!(apart(&slippery) > 0.0 && apart(&slippery) > apart(&soft), "{slippery:?} {stiff:?} {soft:?}");
}

#[test]
fn a_bed_rests_without_being_slowed() {
    let settings = PackingSettings::new(Vector::ZERO, Vector::ZERO);
    let packed = pack_with(20, STIFF, settings.clone());
    assert_eq!(packed.stage, Stage::Done);
    let grains = packed.packing.engine().grains();
    let mean = (0..grains.owned()).map(|g| grains.velocity[g].length()).sum::<Real>() / grains.owned() as Real;
    assert!(mean < settings.rest_speed, "{mean} m/s");
    // Balls that are left to roll on a floor do so for ever: without slowing they are not at rest when the others long are.
    let timed = PackingSettings { by_time_only: true, settling_time: 0.05, ..settings };
    let packed = pack_with(14, STIFF, timed.clone());
    let grains = packed.packing.engine().grains();
    let mean = (0..grains.owned()).map(|g| grains.velocity[g].length()).sum::<Real>() / grains.owned() as Real;
    assert!(mean > timed.rest_speed, "negative control: {mean} m/s");
    assert_eq!(pack_with(14, STIFF, PackingSettings { by_time_only: false, ..timed }).stage, Stage::Done);
}

#[test]
fn the_memory_of_contacts_goes_to_the_walls_in_the_same_place() {
    let upper = Vector::new(3.6e-3, 3.6e-3, 4e-3);
    let domain = Domain::solo(Grid::new([8, 8, 8], Vector::ZERO, upper), [false; 3]);
    let settings = PackingSettings { longest: 0.02, ..PackingSettings::new(Vector::ZERO, Vector::ZERO) };
    // Lower identifier and displacement of the contacts with each wall, in the order of grains, by the number of the wall.
    type OfWalls = [Vec<(u64, [Real; 3])>; 5];
    let read = |snapshot: &Snapshot| {
        let [low, high] = ["contact.low", "contact.high"].map(|name| snapshot.u64(name).expect("it is written"));
        let displaced = snapshot.reals("contact.displacement").expect("it is written");
        let mut found = OfWalls::default();
        for (n, high) in high.iter().enumerate() {
            if let Some(wall) = high.checked_sub(WALL) {
                found[wall as usize].push((low[n], [0, 1, 2].map(|d| displaced[3 * n + d])));
            }
        }
        found
    };
    let between = |present: [[bool; 2]; 3]| {
        let mut packing = pack_with(27, SOFT, settings.clone()).packing;
        let mut snapshot = Snapshot::default();
        packing.snapshot(&domain, "", &mut snapshot);
        let before = read(&snapshot);
        let setup = Setup {
            bodies: packing.engine().bodies().to_vec(),
            interactions: packing.engine().interactions().clone(),
            walls: Wall::of_box(Vector::ZERO, upper, 0, present),
            region: [Vector::NEG_INFINITY, Vector::INFINITY],
            ghost_margin: 0.0,
        };
        let mut engine = packing.into_engine(&domain, setup).expect("they are the same grains");
        let mut snapshot = Snapshot::default();
        engine.snapshot(&domain, "", &mut snapshot);
        (before, read(&snapshot))
    };
    let (before, open) = between([[true, false], [true; 2], [true, false]]);
    // One wall goes, two change their numbers.
    assert!([1, 3, 4].iter().all(|&wall| !before[wall].is_empty()), "{before:?}");
    let [x, _, y, beyond, floor] = before.clone();
    assert_eq!(open, [x, y, beyond, floor, Vec::new()]);
    // Negative control: between the walls of the packing all stays.
    assert_eq!(between([[true; 2], [true; 2], [true, false]]), (before.clone(), before));
}

#[test]
fn grains_closer_than_their_extent_are_not_shaken() {
    // Ten along 9.2 mm and layers of 0.9 mm: places of balls of 1 mm.
    let places = |spacing: Real, jitter: Real| -> Vec<Vector> {
        let upper = Vector::new(9.2e-3, 9.2e-3, 1.0);
        let settings = PackingSettings { spacing, jitter, ..PackingSettings::new(Vector::ZERO, upper) };
        let mut grains: Vec<Grain> = (0..250).map(|id| Grain::new(id, 2650.0, Vector::ZERO)).collect();
        settings.arrange(&[Body::ball(0.5e-3)], &mut grains).expect("the box is wide enough");
        grains.iter().map(|grain| grain.position).collect()
    };
    let still = places(0.9, 0.0);
    for (slot, place) in still.iter().enumerate() {
        let at = Vector::new((slot % 10) as Real, (slot / 10 % 10) as Real, (slot / 100) as Real) + 0.5;
        assert!((*place - at * Vector::new(0.92e-3, 0.92e-3, 0.9e-3)).length() < 1e-15, "{slot}: {place}");
    }
    assert_eq!(places(0.9, 0.5), still);
    // Negative control: with room between them they are, up to half of it.
    let moved = |jitter: Real| {
        let largest = |(a, b): (&Vector, &Vector)| (*a - *b).abs().max_element();
        places(1.1, jitter).iter().zip(&places(1.1, 0.0)).map(largest).fold(0.0, Real::max)
    };
    assert!((0.02e-3..0.0231e-3).contains(&moved(0.02)) && (0.05e-3..0.0751e-3).contains(&moved(0.5)));
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
