//! Weights and potential energy of grains and water under what pulls at them.

use std::f64::consts::PI;

use crate::support::{Left, On, Scratch, ran};

/// A bead over a floor.
const TANK: &str = include_str!("../cases/dry-tank.toml");

const WATER: &str =
    "[[liquid]]\nregion.box = { lower = [\"0 mm\", \"0 mm\", \"0 mm\"], upper = [\"10 mm\", \"10 mm\", \"3 mm\"] }\n";
const LYING: &str = "grains.0.placement={ list = [{ position = [\"5 mm\", \"5 mm\", \"0.5 mm\"] }] }";

/// Mass of the bead \[kg].
const BEAD: f64 = 2650.0 * PI / 6.0 * 1e-9;

/// A run of the bead as it lies on the floor.
fn lying(name: &str, more: &str, overrides: &[&str]) -> Left {
    let folder = Scratch::new(name);
    ran(&format!("{TANK}{more}"), &[&[LYING], overrides].concat(), &folder.join("run"), On::threads(1))
}

/// Force of the floor over the weight, and potential energy, at the end.
fn at_rest(left: &Left) -> [f64; 2] {
    ["contact_force_over_submerged_weight", "potential_energy"].map(|name| left.last(name))
}

#[test]
fn grains_weigh_what_the_box_makes_them_weigh() {
    for (name, acceleration, gravity) in [("up", 4.905, 14.715), ("down", -4.905, 4.905)] {
        let lift = format!("frame.acceleration=[\"0 m/s^2\", \"0 m/s^2\", \"{acceleration} m/s^2\"]");
        let [ratio, energy] = at_rest(&lying(name, "", &[&lift, "run.until=60 ms"]));
        assert!((ratio - 1.0).abs() < 2e-3, "{name}: {ratio}");
        assert!((energy / (BEAD * gravity * 0.5e-3) - 1.0).abs() < 2e-3, "{name}: {energy}");
        // Negative control: by gravity alone they were off by a half.
        assert!((energy / (BEAD * 9.81 * 0.5e-3) - 1.0).abs() > 0.4, "{name}: {energy}");
    }
    // Half of it by gravity and half by the box is the same, under water too.
    let halves = ["gravity=4.905 m/s^2", "frame.acceleration=[\"0 m/s^2\", \"0 m/s^2\", \"4.905 m/s^2\"]"];
    let [whole, shared] = [&[][..], &halves].map(|overrides| lying("shared", WATER, overrides));
    for name in ["contact_force_over_submerged_weight", "potential_energy"] {
        let [a, b] = [&whole, &shared].map(|left| left.column(name));
        assert!(a.len() > 2 && a[1..].iter().zip(&b[1..]).all(|(a, b)| (a - b).abs() <= 1e-9 * a.abs()), "{a:?} {b:?}");
    }
    // What swings does not count: it is no part of the weight on the mean.
    let swing = "frame.oscillation={ amplitude = [\"0 m/s^2\", \"0 m/s^2\", \"1 m/s^2\"], frequency = \"100 Hz\" }";
    let energy = lying("swinging", "", &[swing, "run.until=2 ms"]).last("potential_energy");
    assert!((energy / (BEAD * 9.81 * 0.5e-3) - 1.0).abs() < 2e-3, "{energy}");
}

#[test]
fn a_constant_force_that_drives_by_mass_weighs() {
    let drive = "drive.acceleration=[\"0 m/s^2\", \"0 m/s^2\", \"-4.905 m/s^2\"]";
    let [ratio, driven] = at_rest(&lying("driven", "", &[drive, "run.until=60 ms"]));
    assert!((ratio - 1.0).abs() < 2e-3, "{ratio}");
    // Negative control: without it the potential energy is that of gravity.
    let [_, alone] = at_rest(&lying("alone", "", &["run.until=60 ms"]));
    assert!((driven / alone - 1.5).abs() < 5e-3, "{driven} {alone}");
}

#[test]
fn grains_that_no_step_has_looked_at_displace_the_liquid_in_which_they_lie() {
    let folder = Scratch::new("first-row");
    let energies = |name: &str, place: &str, text: &str| {
        let at = format!("grains.0.placement={{ list = [{{ position = [\"5 mm\", \"5 mm\", \"{place}\"] }}] }}");
        let places = if text.contains("[[grains]]") { vec![at.as_str()] } else { Vec::new() };
        let overrides = [&["run.until=1 ms", "output.series={ steps = 1 }"], &places[..]].concat();
        ran(text, &overrides, &folder.join(name), On::threads(1)).column("potential_energy")
    };
    let [head, tail] = ["[material.sand]", "[output]"].map(|at| TANK.split(at).collect::<Vec<_>>());
    let alone = format!("{}[preparation]\ncache = false\n[output]{}{WATER}", head[0], tail[1]);
    let water = energies("water", "", &alone)[0];
    let both = format!("{TANK}{WATER}");
    // A bead beside the water has its whole weight, before and after the first step.
    let above = energies("above", "8 mm", &both);
    assert!(((above[0] - water) / (BEAD * 9.81 * 8e-3) - 1.0).abs() < 0.1, "{above:?} {water}");
    assert!((above[1] / above[0] - 1.0).abs() < 2e-3, "{above:?}");
    // As if it were under water, the first row would be lower by this.
    assert!(BEAD / 2.65 * 9.81 * 8e-3 / above[0] > 5e-3);
    // One under water has not.
    let below = energies("below", "1.5 mm", &both);
    assert!((below[1] / below[0] - 1.0).abs() < 1e-3, "{below:?}");
}
