//! Moving particles that fill a box: nothing fixes the level of their pressure.

use crate::support::{On, Scratch, ran};
use sazanami_numerics::Real;

/// Vortices that viscosity slows down.
const VORTICES: &str = include_str!("../cases/closed-vortices.toml");
/// A sphere in a liquid that it moves at 20 um/s.
const CREEPING: &str = include_str!("../cases/closed-creeping.toml");
/// A held grain in a corner between them, where the liquid is at rest.
const GRAIN: &str = "[material.glass]\ndensity = \"2500 kg/m^3\"\n[contact.default]\n[[grains]]\nmotion = \"fixed\"\n\
                     shape.sphere.diameter = \"1 mm\"\nplacement.list = [{ position = [\"8 mm\", \"4 mm\", \"8 mm\"] }]\n";
/// Speed of the vortices \[m/s] and their wave number [1/m].
const SPEED: Real = 0.01;
const WAVE_NUMBER: Real = std::f64::consts::PI / 8e-3;

#[test]
fn vortices_lose_what_viscosity_takes() {
    let scratch = Scratch::new("closed-vortices");
    // The part of their energy that is left, and the largest pressure at eight points, over that of the flow.
    let left = |name: &str, text: &str, overrides: &[&str]| {
        let left = ran(text, overrides, &scratch.join(name), On::threads(2));
        let energy = left.column("kinetic_energy_fluid");
        let probe = left.probe("middle");
        // At the start no step has solved for a pressure.
        let pressures: Vec<Real> =
            (0..8).flat_map(|n| probe.column(&format!("pressure_at_{n}")).into_iter().skip(1)).collect();
        assert!(pressures.len() > 500 && pressures.iter().all(|p| p.is_finite()), "{name}: {pressures:?}");
        let largest = pressures.iter().fold(0.0, |most: Real, p| most.max(p.abs()));
        assert!(energy.windows(2).all(|pair| pair[1] <= pair[0] * (1.0 + 1e-9)), "{name}: {energy:?}");
        (energy.last().expect("rows") / energy[0], largest / (1000.0 * SPEED * SPEED))
    };
    let of = |viscosity: Real| (-4.0 * viscosity * WAVE_NUMBER * WAVE_NUMBER * 20e-3).exp();
    // Half of it was gone after 12 ms, a twelfth left between slip walls, at pressures of a million times those of the flow.
    let slip = ["boundary.x3=slip"];
    let closed = ["boundary.all=slip"];
    // About one held grain a quarter was gone within 60 ms where viscosity takes a twenty-fifth.
    let grain = &format!("{VORTICES}{GRAIN}")[..];
    for (name, text, overrides) in [
        ("periodic", VORTICES, &[][..]),
        ("slip", VORTICES, &slip),
        ("closed", VORTICES, &closed),
        ("grain", grain, &[]),
    ] {
        let (energy, pressure) = left(name, text, overrides);
        assert!((energy / of(1e-6) - 1.0).abs() < 0.005, "{name}: {energy} for {}", of(1e-6));
        assert!(pressure < 5.0, "{name}: {pressure}");
    }
    // Control: twenty times the viscosity takes twenty times as much.
    let (thick, _) = left("thick", VORTICES, &["fluid.liquid.kinematic_viscosity=2e-5 m^2/s"]);
    assert!((thick / of(2e-5) - 1.0).abs() < 0.03 && thick < 0.8, "{thick} for {}", of(2e-5));
}

#[test]
fn a_full_box_under_gravity_stays_at_rest() {
    let scratch = Scratch::new("closed-rest");
    let rest = ["gravity=9.81 m/s^2", "boundary.all=slip", "fluid.initial_velocity.taylor_green.speed=0 m/s"];
    let left = ran(VORTICES, &rest, &scratch.join("run"), On::threads(2));
    let energy = left.column("kinetic_energy_fluid").into_iter().fold(0.0, Real::max);
    // Its weight falling through a spacing would give 2e-5 J.
    assert!(energy < 1e-20, "{energy}");
    let probe = left.probe("middle");
    let at = |n: usize| *probe.column(&format!("pressure_at_{n}")).last().expect("a row");
    let gradient = (at(0) - at(7)) / 14e-3;
    assert!((gradient / 9810.0 - 1.0).abs() < 0.01, "{gradient}");
    // Its level is that of a mean of zero.
    assert!((at(3) + at(4)).abs() < 2.0, "{} {}", at(3), at(4));
}

#[test]
fn a_creeping_flow_is_as_free_of_divergence_as_a_fast_one() {
    let scratch = Scratch::new("closed-creeping");
    let drag = |name: &str, speed: &str| {
        let moved = format!("grains.0.placement.list.0.velocity=[\"{speed}\", \"0 m/s\", \"0 m/s\"]");
        let left = ran(CREEPING, &[&moved], &scratch.join(name), On::threads(2));
        -left.probe("sphere").column("drag_1").last().expect("a row")
    };
    let (slow, fast) = (drag("slow", "20 um/s"), drag("fast", "2 mm/s"));
    // In a linear flow it is in proportion: without iterations, all within 1e-6 of strain a step, it was 0.83 of that.
    assert!((100.0 * slow / fast - 1.0).abs() < 0.02, "{slow} {fast}");
    // Control: a liquid of half the viscosity takes half.
    let thin = "fluid.liquid.kinematic_viscosity=1e-4 m^2/s";
    let left = ran(CREEPING, &[thin], &scratch.join("thin"), On::threads(2));
    let thin = -left.probe("sphere").column("drag_1").last().expect("a row");
    assert!((0.4..0.6).contains(&(thin / slow)), "{thin} {slow}");
}
