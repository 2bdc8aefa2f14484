//! Moving particles that no wall bears, with grains in the box.

use crate::support::{Left, On, Scratch, ran};
use sazanami_numerics::Real;

/// A drop that falls, and a grain that it does not meet.
const DROP: &str = include_str!("../cases/free-water-drop.toml");
/// Grains that are carried from rank to rank.
const CARRIED: &str = include_str!("../cases/free-water-carried.toml");

#[test]
fn a_drop_falls_freely_whether_or_not_there_is_a_grain_elsewhere() {
    let scratch = Scratch::new("free-fall");
    // Upward velocity that the drop has kept beyond that of free fall [m/s], and the energy of its motion within itself [J/kg].
    let beyond = |name: &str, text: &str| {
        let left = ran(text, &[], &scratch.join(name), On::threads(2));
        let [m1, m3, energy] = ["momentum_1", "momentum_3", "kinetic_energy_fluid"].map(|column| left.column(column));
        let mass = m3[0] / 0.1;
        let (t, last) = (left.last("time"), m3.len() - 1);
        let moved = (m1[last] * m1[last] + m3[last] * m3[last]) / (2.0 * mass * mass);
        ((m3[last] - m3[0]) / mass + 9.81 * t, energy[last] / mass - moved)
    };
    // A held grain, even one that it does not meet, took a tenth of its fall where what only walls can answer acted on it.
    let alone = DROP.split("[[grains]]").next().expect("the case has a liquid before its grains");
    for (name, text) in [("alone", alone), ("beside", DROP)] {
        let (velocity, energy) = beyond(name, text);
        assert!(velocity.abs() < 1e-9 && energy.abs() < 1e-9, "{name}: {velocity} m/s, {energy} J/kg");
    }
    // Control: what is measured is the fall.
    let slower = beyond("slower", &DROP.replace("gravity = \"9.81", "gravity = \"9.80")).0;
    assert!((slower - 0.01 * 15e-3).abs() < 1e-9, "{slower}");
}

/// A slab of seven layers that falls on a floor between periodic sides, with a grain on the floor; in spacings of 1.5 mm.
const SLAB: [&str; 7] = [
    "domain.size=[\"12 mm\", \"12 mm\", \"30 mm\"]",
    "boundary={ all = \"periodic\", x3_lower = \"slip\", x3_upper = \"outflow\" }",
    "particles.spacing=1.5 mm",
    "liquid.0={ region = { box = { lower = [\"0 mm\", \"0 mm\", \"10.5 mm\"], upper = [\"12 mm\", \"12 mm\", \"21 mm\"] } } }",
    "grains.0.placement.list=[{ position = [\"6 mm\", \"6 mm\", \"1 mm\"] }]",
    "grains.0.shape.sphere.diameter=1.5 mm",
    "run.until=60 ms",
];

#[test]
fn a_slab_that_lands_does_not_swell() {
    let scratch = Scratch::new("free-slab");
    let left = ran(DROP, &SLAB, &scratch.join("run"), On::threads(2));
    let (t, momentum) = (left.column("time"), left.column("momentum_3"));
    // It falls freely up to the floor, 10.5 mm or 46 ms below,
    let falling: Vec<usize> = (1..t.len()).filter(|&n| t[n] < 0.036).collect();
    let rate = momentum[falling[0]] / t[falling[0]];
    assert!(falling.iter().all(|&n| (momentum[n] / (rate * t[n]) - 1.0).abs() < 1e-6), "{momentum:?}");
    // and is as dense as before 14 ms later: it swelled by 8 % where the pressure of the impact was taken for one that goes on.
    let swollen = -left.last("strain_mean");
    assert!((-0.01..0.04).contains(&swollen), "{swollen}");
}

#[test]
fn what_drag_gives_and_takes_is_the_same_where_grains_change_ranks() {
    let scratch = Scratch::new("free-grains");
    let residual = |left: &Left| -> [Real; 2] {
        let largest = |column: &str| left.column(column).into_iter().map(Real::abs).fold(0.0, Real::max);
        [largest("drag_exchange_residual"), largest("fluid_momentum_residual_1")]
    };
    let run = |name: &str, keys: &[&str], on: On| ran(CARRIED, keys, &scratch.join(name), on);
    let (one, two) = (run("one", &[], On::threads(1)), run("two", &[], On::ranks(2, 1)));
    // A gradient that acts on the grains from outside the water.
    let driven = ["drive={ acceleration = [\"1 m/s^2\", \"0 m/s^2\", \"0 m/s^2\"], acts_by = \"volume\" }"];
    let driven = run("driven", &driven, On::ranks(2, 1));
    // The momentum of the water is 5e-5 N s; what a grain gets in a step 1e-10.
    for left in [&one, &two, &driven] {
        assert!(residual(left).into_iter().all(|residual| residual < 1e-17), "{:?}", residual(left));
    }
    let momentum = |left: &Left| left.last("momentum_1");
    assert!((momentum(&one) / momentum(&two) - 1.0).abs() < 1e-12, "{} {}", momentum(&one), momentum(&two));
}
