//! Grains among moving particles of a liquid without viscosity.

use crate::support::{On, Scratch, ran};

/// A grain that is let go.
const GRAIN: &str = include_str!("../cases/inviscid-grain.toml");

#[test]
fn a_grain_at_rest_in_a_liquid_without_viscosity_begins_to_fall() {
    let scratch = Scratch::new("inviscid");
    // Velocity after 10 ms over that of a fall with the submerged weight.
    let fall = |name: &str, overrides: &[&str]| {
        let left = ran(GRAIN, overrides, &scratch.join(name), On::threads(1));
        let probe = left.probe("grain");
        -probe.last("velocity_3") / (0.6 * 9.81 * probe.last("time"))
    };
    for (n, key) in [
        "drag=blend",
        "drag=di_felice",
        "drag=beetstra",
        "drag_integration=implicit",
        "drag_integration=explicit",
        "lift=mei",
        "lift=saffman",
    ]
    .into_iter()
    .enumerate()
    {
        let found = fall(&n.to_string(), &[&format!("overlap.{key}")]);
        assert!((0.9..1.02).contains(&found), "{key}: {found}");
    }
    // With half of the mass of the liquid that it displaces to move it falls at 1/1.2 of that.
    let with_added_mass = fall("added", &["overlap.added_mass=zuber"]);
    assert!((0.75..0.87).contains(&with_added_mass), "{with_added_mass}");
    // Negative control: a viscous liquid holds it back.
    let viscous = fall("viscous", &["fluid.liquid.kinematic_viscosity=1e-4 m^2/s"]);
    assert!(viscous < 0.7, "{viscous}");
}
