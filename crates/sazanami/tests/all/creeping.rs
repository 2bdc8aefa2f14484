//! A grain that creeps through a viscous liquid takes up its terminal speed, whatever the step.

use std::path::Path;

use crate::support::{On, Scratch, ran};
use sazanami_numerics::Real;

/// A sphere of 0.2 mm, three cells wide, in glycerine: Reynolds number 3e-6, taken up in some 6 us.
const SPHERE: &str = include_str!("../cases/creeping-sphere.toml");
/// Its speed in an infinite liquid [m/s].
const STOKES: Real = 2e-4 * 2e-4 * 9.81 * 1240.0 / (18.0 * 1.26);
/// Liquid that fills the box.
const FULL: &str = "liquid.0.region.half_space.point=[\"0 m\", \"0 m\", \"3 m\"]";

/// Downward speeds after the steps [m/s].
fn speeds(folder: &Path, overrides: &[&str]) -> Vec<Real> {
    let left = ran(SPHERE, overrides, folder, On::threads(2));
    left.probe("sphere").column("velocity_3").into_iter().map(|speed| -speed).collect()
}

fn last(speeds: &[Real]) -> Real {
    *speeds.last().expect("there are steps")
}

#[test]
fn a_sphere_creeps_at_its_terminal_speed_with_steps_that_adapt() {
    let scratch = Scratch::new("creeping");
    let resolved = last(&speeds(&scratch.join("resolved"), &["fluid.dt_max=3 us", "run.until=0.15 ms"]));
    // The walls of the box take a good quarter (Haberman and Sayre 1958: a cylinder as wide 0.69).
    assert!((0.64..0.76).contains(&(resolved / STOKES)), "{}", resolved / STOKES);
    // The longest step that the case allows is 180 times the time in which the sphere takes up its speed.
    let adapted = speeds(&scratch.join("adapted"), &[]);
    let fastest = adapted.iter().copied().fold(0.0, Real::max);
    assert!(adapted.len() < 80, "{} steps", adapted.len());
    assert!(fastest < 1.15 * resolved, "{}", fastest / resolved);
    assert!((last(&adapted) / resolved - 1.0).abs() < 0.03, "{}", last(&adapted) / resolved);
    // Negative control: a tenth more viscosity is seen, and with a step of that length the speed swings.
    let thicker = ["fluid.dt_max=3 us", "run.until=0.15 ms", "fluid.liquid.kinematic_viscosity=1.1e-3 m^2/s"];
    let thicker = last(&speeds(&scratch.join("thicker"), &thicker));
    assert!((thicker / resolved - 1.0 / 1.1).abs() < 0.01, "{}", thicker / resolved);
    let long = ["fluid.dt=1 ms", "run.until=30 ms"];
    let swings = speeds(&scratch.join("long"), &long);
    assert!(swings.iter().any(|speed| speed.abs() > 3.0 * resolved), "{swings:?}");
}

#[test]
fn what_the_projection_leaves_is_small_beside_the_slowest_flow() {
    let scratch = Scratch::new("creeping-finely");
    // `tol_div` alone would allow 70 um/s in a step of 1 us, more than four times the terminal speed.
    let finely = speeds(&scratch.join("run"), &["fluid.dt_max=1 us", "run.until=60 us"]);
    assert!(finely.windows(2).all(|pair| pair[1] > 0.999 * pair[0]), "{finely:?}");
    assert!(last(&finely) > 0.6 * STOKES, "{}", last(&finely) / STOKES);
}

#[test]
fn a_sphere_that_sinks_without_a_net_flow_begins_with_its_weight_in_the_liquid() {
    let scratch = Scratch::new("creeping-periodic");
    let without_walls =
        ["boundary.all=periodic", "drive.mean_velocity=[\"0 m/s\", \"0 m/s\", \"0 m/s\"]", FULL, "run.until=1 ms"];
    let adapted = speeds(&scratch.join("run"), &without_walls);
    let (fastest, steady) = (adapted.iter().copied().fold(0.0, Real::max), last(&adapted));
    // Its weight in a vacuum would give it four times as much in the first step.
    assert!(adapted[1] > 0.5 * steady && fastest < 1.1 * steady, "{adapted:?}");
    // Negative control: one as heavy as the liquid stays where it is.
    let weightless = without_walls.iter().copied().chain(["material.glass.density=1260 kg/m^3"]).collect::<Vec<_>>();
    let still = speeds(&scratch.join("still"), &weightless);
    assert!(still.iter().all(|speed| speed.abs() < 1e-6 * steady), "{still:?}");
}
