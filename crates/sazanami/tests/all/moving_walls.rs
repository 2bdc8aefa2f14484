//! A tank whose walls move, periodic along its motion: its water is observed within the box.

use crate::support::{Left, On, Scratch, ran};

/// Shallow water over a floor with friction, in a tray that swings by a quarter of its length.
const TRAY: &str = include_str!("../cases/moving-walls-tray.toml");

#[test]
fn what_is_observed_in_a_periodic_tray_lies_in_the_tray() {
    let folder = Scratch::new("tray");
    let run = |name: &str, overrides: &[&str]| ran(TRAY, overrides, &folder.join(name), On::threads(1));
    let level = |left: &Left| left.probe("gauge").column("water_level");
    let moving = run("moving", &[]);
    let (front, level_seen) = (moving.column("front"), level(&moving));
    assert!(front.iter().all(|x| *x <= 20.5e-3), "{front:?}");
    assert!(level_seen.iter().all(|z| (5e-3..7e-3).contains(z)), "{level_seen:?}");
    // The same by the acceleration of the frame.
    let other = level(&run("frame", &["frame.motion.walls=at_rest"]));
    assert!(level_seen.iter().zip(&other).all(|(a, b)| (a - b).abs() < 0.5e-3), "{level_seen:?} {other:?}");
}

/// A ball that lies on a wall which moves in its own plane, in next to nothing.
const BELT: &str = r#"
gravity = "9.8 m/s^2"
domain = { size = ["60 mm", "20 mm", "20 mm"], cells = [12, 4, 4] }
boundary = { all = "slip", x3_lower = { moving = { velocity = ["0.1 m/s", "0 m/s", "0 m/s"] } } }
fluid = { viscosity = "off", dt_max = "1 ms", gas = { density = "0.001 kg/m^3", kinematic_viscosity = "1e-6 m^2/s" } }
dem.film_roughness = "none"
material.a.density = "2500 kg/m^3"
contact.default = { normal_stiffness = "1e4 N/m", restitution = 0.5, friction = 0.3 }
output = { fields = { at = [] }, figures = { at = [] }, grains = { at = [] }, series = { every = "10 ms" } }
run.until = "60 ms"

[[grains]]
material = "a"
shape.sphere.diameter = "6 mm"
placement.list = [{ position = ["20 mm", "10 mm", "3 mm"] }]

[[probe]]
name = "ball"
every = "10 ms"
body.index = 0
"#;

#[test]
fn a_wall_that_moves_takes_along_what_lies_on_it() {
    let folder = Scratch::new("belt");
    let end = |name: &str, overrides: &[&str]| {
        let left = ran(BELT, overrides, &folder.join(name), On::threads(1));
        ["velocity_1", "spin_2"].map(|column| left.probe("ball").last(column))
    };
    // Friction ends when the ball rolls: 2/7 of the velocity of the wall.
    let [velocity, spin] = end("from-rest", &[]);
    assert!((velocity - 0.1 * 2.0 / 7.0).abs() < 1e-4, "{velocity}");
    assert!((spin + 0.1 * 5.0 / 7.0 / 3e-3).abs() < 0.1, "{spin}");
    // Negative control: one that goes with the wall goes on with it.
    let carried = "grains.0.placement.list=[{ position = [\"20 mm\", \"10 mm\", \"3 mm\"], velocity = [\"0.1 m/s\", \"0 m/s\", \"0 m/s\"] }]";
    let [velocity, spin] = end("carried", &[carried]);
    assert!((velocity - 0.1).abs() < 1e-4 && spin.abs() < 0.05, "{velocity} {spin}");
}
