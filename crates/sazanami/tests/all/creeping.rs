//! A grain that creeps through a viscous liquid takes up its terminal speed, whatever the step.

use std::path::Path;

use crate::support::{Left, On, Scratch, ran};
use sazanami_numerics::Real;

/// A sphere of 0.2 mm, three cells wide, in glycerine: Reynolds number 3e-6, taken up in some 6 us.
const SPHERE: &str = include_str!("../cases/creeping-sphere.toml");
/// Its speed in an infinite liquid [m/s].
const STOKES: Real = 2e-4 * 2e-4 * 9.81 * 1240.0 / (18.0 * 1.26);
/// A box without sides.
const PERIODIC: &str = "boundary.all=periodic";

/// Downward speeds after the steps [m/s].
fn speeds(folder: &Path, overrides: &[&str]) -> Vec<Real> {
    downwards(&ran(SPHERE, overrides, folder, On::threads(2)))
}

fn downwards(left: &Left) -> Vec<Real> {
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
    let without_walls = [PERIODIC, "drive.mean_velocity=[\"0 m/s\", \"0 m/s\", \"0 m/s\"]", "run.until=1 ms"];
    let adapted = speeds(&scratch.join("run"), &without_walls);
    let (fastest, steady) = (adapted.iter().copied().fold(0.0, Real::max), last(&adapted));
    // Its weight in a vacuum would give it four times as much in the first step.
    assert!(adapted[1] > 0.5 * steady && fastest < 1.1 * steady, "{adapted:?}");
    // The images on all sides take a good sixth to a quarter (Hasimoto 1959: 0.80 in a cube as wide).
    assert!((0.75..0.85).contains(&(steady / STOKES)), "{}", steady / STOKES);
    // Negative control: one as heavy as the liquid stays where it is.
    let weightless = without_walls.iter().copied().chain(["material.glass.density=1260 kg/m^3"]).collect::<Vec<_>>();
    let still = speeds(&scratch.join("still"), &weightless);
    assert!(still.iter().all(|speed| speed.abs() < 1e-6 * steady), "{still:?}");
}

#[test]
fn a_gradient_that_drives_a_liquid_pushes_a_sphere_in_the_first_step() {
    let scratch = Scratch::new("creeping-driven");
    let driven = [
        PERIODIC,
        "gravity=0 m/s^2",
        "drive.acceleration=[\"0 m/s^2\", \"0 m/s^2\", \"-9.81 m/s^2\"]",
        "drive.acts_by=volume",
        "fluid.liquid.kinematic_viscosity=1e-9 m^2/s",
        "fluid.dt_max=1 s",
        "run.until=20 ms",
        "run.steps=3",
        "output.series={ steps = 1 }",
    ];
    let left = ran(SPHERE, &driven, &scratch.join("run"), On::threads(2));
    assert!(left.summary["limiter"]["body_force"].as_u64() > Some(0), "{}", left.summary["limiter"]);
    let pushed = downwards(&left);
    // In a liquid without friction (1 + C)/(s + C) of its acceleration, C = 1/2 (Batchelor 1967, section 6.8).
    let dt = left.column("time")[1];
    let part = pushed[1] / (9.81 * dt);
    assert!((part / (1.5 / (2500.0 / 1260.0 + 0.5)) - 1.0).abs() < 0.1, "{part}");
    // Negative control: what acts by mass gives it all of it.
    let by_mass = driven.map(|key| if key == "drive.acts_by=volume" { "drive.acts_by=mass" } else { key });
    let pulled = speeds(&scratch.join("by-mass"), &by_mass);
    assert!((pulled[1] / (9.81 * dt) - 1.0).abs() < 0.02, "{}", pulled[1] / (9.81 * dt));
}
