//! A tank whose walls move, periodic along its motion: its water is observed within the box.

use crate::support::{Left, On, Scratch, load, start};

/// Shallow water over a floor with friction, in a tray that swings by a quarter of its length.
const TRAY: &str = include_str!("../cases/moving-walls-tray.toml");

#[test]
fn what_is_observed_in_a_periodic_tray_lies_in_the_tray() {
    let folder = Scratch::new("tray");
    let run = |name: &str, overrides: &[&str]| {
        start(&load(TRAY, overrides), &folder.join(name), On::threads(1)).unwrap_or_else(|error| panic!("{error}"));
        Left::in_folder(&folder.join(name))
    };
    let seen = |left: &Left| {
        let gauge = &left.probes.iter().find(|(name, _)| name == "gauge.csv").expect("it is asked for").1;
        (left.column("front"), gauge.column("water_level"), left.column("grain_height"))
    };
    let (front, level, _) = seen(&run("moving", &[]));
    assert!(front.iter().all(|x| *x <= 20.5e-3), "{front:?}");
    assert!(level.iter().all(|z| (5e-3..7e-3).contains(z)), "{level:?}");
    // The same by the acceleration of the frame.
    let (_, other, _) = seen(&run("frame", &["frame.motion.walls=at_rest"]));
    assert!(level.iter().zip(&other).all(|(a, b)| (a - b).abs() < 0.5e-3), "{level:?} {other:?}");
}
