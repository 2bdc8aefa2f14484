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
