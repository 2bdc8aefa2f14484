//! From grains to ripples: what a bed of grains in disorder shows, and what a level one must not show.

use std::f64::consts::TAU;

use sazanami_numerics::{Random, Real, Vector};
use sazanami_observe::ripples::{
    BedFormSettings, BedForms, GrainView, ShiftLimits, Sides, SurfaceProfile, TankInside, Unmeasured, bed_surface,
    match_bed, relief,
};

const D: Real = 1e-3;
/// Grains every 0.95 diameters take up 0.61 of the space.
const SPACING: Real = 0.95 * D;

fn tank(width: Real) -> TankInside {
    TankInside {
        x: [-0.075, 0.075],
        y: [0.0, width],
        floor: 0.0,
        lid: None,
        ends: Sides::Walls,
        sides: Sides::Periodic,
        repeats: None,
    }
}

/// Grains below a surface; a place of the lattice that the surface cuts is taken with the chance of its part below.
fn grains(tank: &TankInside, seed: u64, surface: impl Fn(Real) -> Real) -> Vec<Vector> {
    let mut random = Random::new(seed);
    let count = |length: Real| (length / SPACING) as usize;
    let mut places = Vec::new();
    for i in 0..count(tank.length()) {
        for j in 0..count(tank.width()) {
            for k in 0..20 {
                let [x, y, z] = [i, j, k].map(|n| (n as Real + 0.5) * SPACING);
                let below = (surface(tank.x[0] + x) - z) / SPACING + 0.5;
                if random.unit() < below {
                    let shake = [x, y, z].map(|_| 0.1 * D * random.between(-1.0, 1.0));
                    places.push(Vector::new(tank.x[0] + x, tank.y[0] + y, z) + Vector::from_array(shake));
                }
            }
        }
    }
    places
}

fn surface(tank: &TankInside, position: &[Vector]) -> SurfaceProfile {
    let view = GrainView { position, diameter: &vec![D; position.len()], contacts: &vec![4; position.len()] };
    bed_surface(tank, &view, D).0
}

#[test]
fn a_level_bed_of_grains_in_disorder_has_no_ripples() {
    for width in [8e-3, 20e-3] {
        let tank = tank(width);
        let reach = tank.reach(10e-3);
        for seed in 1..=6 {
            // The top layer is half full: the roughest a level bed can be.
            let bed = surface(&tank, &grains(&tank, seed, |_| 10.5 * SPACING));
            let found = BedForms::of(&bed, reach, &BedFormSettings::of_grains(D)).ripples;
            assert!(matches!(found, Err(Unmeasured::TooFewCrests { .. })), "width {width}, seed {seed}: {found:?}");
            // Its roughness is there: without the least height of a crest there would be some.
            assert!(relief(&bed, reach).expect("a relief") > 0.1 * D * (D / width).sqrt());
        }
    }
}

#[test]
fn ripples_of_grains_in_disorder_have_their_length_and_height() {
    let tank = tank(20e-3);
    let bed = |x: Real| 0.010 + 1.25e-3 * (TAU * x / 22e-3).sin();
    let found = surface(&tank, &grains(&tank, 1, bed));
    let ripples = BedForms::of(&found, tank.reach(10e-3), &BedFormSettings::of_grains(D)).ripples;
    let ripples = ripples.expect("ripples");
    assert!((ripples.wavelength / 22e-3 - 1.0).abs() < 0.05, "{ripples:?}");
    assert!((ripples.height / 2.5e-3 - 1.0).abs() < 0.2, "{ripples:?}");
}

#[test]
fn a_bed_matches_readings_of_its_own_shape() {
    let tank = tank(20e-3);
    let bed =
        |height: Real| move |x: Real| 0.010 + 0.5 * height * ((TAU * x / 22e-3).sin() + 0.3 * (TAU * x / 37e-3).cos());
    let found = surface(&tank, &grains(&tank, 3, bed(2e-3)));
    let readings: Vec<[Real; 2]> = (0..90).map(|n| -0.07 + 1.5e-3 * f64::from(n)).map(|x| [x, bed(4e-3)(x)]).collect();
    let matched =
        match_bed(&found, &readings, ShiftLimits::default(), &BedFormSettings::of_grains(D)).expect("a match");
    assert!((matched.ratio(|found| found.height).expect("ripples") - 0.5).abs() < 0.1, "{matched:?}");
    assert!((matched.ratio(|found| found.wavelength).expect("ripples") - 1.0).abs() < 0.1, "{matched:?}");
    assert!(matched.profiles.correlation.expect("ripples") > 0.9 && matched.crests_agree == Some(1.0), "{matched:?}");
}
