//! Bodies that the grid resolves: beside one another, through a surface, and the force of the fluid on them.

use std::f64::consts::PI;

use crate::support::{Left, On, Scratch, ran};
use sazanami_numerics::Real;

fn run(name: &str, text: &str, overrides: &[&str]) -> Left {
    ran(text, overrides, &Scratch::new(&format!("bodies-{name}")).join("run"), On::threads(1))
}

/// Distance of the centres of block and plate: they all but touch \[m].
const APART: Real = 0.06001;

/// A block, three cells thick, on a fixed plate turned by `angle` \[degrees] in the grid, under g/2 along the plate.
fn block_on_plate(angle: Real, fill: &str) -> String {
    let (sin, cos) = (angle * PI / 180.0).sin_cos();
    let along = [4.905 * cos, -4.905 * sin];
    let block = [0.36 - 0.1 * cos + APART * sin, 0.2 + 0.1 * sin + APART * cos];
    format!(
        r#"
gravity = ["{} m/s^2", "0 m/s^2", "{} m/s^2"]
[domain]
size = ["0.84 m", "0.18 m", "0.48 m"]
cells = [42, 9, 24]
[boundary]
all = "slip"
{fill}
[material.rock]
density = "2600 kg/m^3"
[contact.default]
normal_stiffness = "1e5 N/m"
[[grains]]
name = "plate"
shape.box = {{ size = ["0.5 m", "0.16 m", "60 mm"] }}
contact_spheres = "shell(400)"
motion = "fixed"
placement.list = [{{ position = ["0.36 m", "90 mm", "0.2 m"], axis = [0, 1, 0], angle = "{angle} deg" }}]
[[grains]]
name = "block"
shape.box = {{ size = ["0.12 m", "0.12 m", "60 mm"] }}
contact_spheres = "shell(200)"
placement.list = [{{ position = ["{} m", "90 mm", "{} m"], axis = [0, 1, 0], angle = "{angle} deg" }}]
[output]
figures = {{ at = [] }}
fields = {{ at = [] }}
[run]
until = "0.1 s"
"#,
        along[0], along[1], block[0], block[1]
    )
}

const FULL: &str =
    "[[liquid]]\nregion.half_space = { point = [\"0 m\", \"0 m\", \"9 m\"] }\nallow_touching_grains = true";

#[test]
fn a_block_slides_along_a_plate_that_it_touches() {
    // Nothing but the fluid between them holds it: g/2 for 0.1 s in gas.
    let free = 4.905 * 0.1;
    for angle in [30.0, 17.0] {
        let name = format!("gas-{angle}");
        let left = run(&name, &block_on_plate(angle, ""), &[]);
        let speed = left.last("largest_grain_speed");
        assert!((speed / free - 1.0).abs() < 5e-3, "{name}: {speed} for {free}");
        let residual = left.summary["conservation"]["momentum_residual_relative"].as_f64();
        assert!(residual.is_some_and(|residual| residual < 1e-8), "{name}: {residual:?}");
    }
    // In liquid it displaces what it leaves: slower, and the same however the plate lies in the grid.
    let in_liquid =
        |angle: Real| run(&format!("liquid-{angle}"), &block_on_plate(angle, FULL), &[]).last("largest_grain_speed");
    let [level, inclined] = [0.0, 30.0].map(in_liquid);
    assert!((inclined / level - 1.0).abs() < 0.05, "{inclined} for {level}");
    // Negative control: the liquid is felt.
    assert!(level < 0.7 * free, "{level}");
}

/// A block that slides down a beach into water; both are as wide as a slice of five cells.
const SLIDE: &str = include_str!("../cases/bodies-slide.toml");

#[test]
fn a_block_slides_into_water_without_gaining_energy() {
    let left = run("slide", SLIDE, &[]);
    let [time, dt, courant] = ["time", "dt", "courant"].map(|name| left.column(name));
    let [fluid, grains] = ["kinetic_energy_fluid", "kinetic_energy_grains"].map(|name| left.column(name));
    let falling = left.column("momentum_grains_3");
    let mut work = 0.0;
    for n in 1..time.len() {
        work -= 9.81 * (time[n] - time[n - 1]) * falling[n].min(falling[n - 1]);
        let gained = fluid[n] + grains[n] - grains[0];
        assert!(gained < work, "{} s: {gained} J by {work} J", time[n]);
        // Sum over the directions; a droplet of negative mass flew at 19 m/s.
        let speed = courant[n] / dt[n] * 20e-3;
        assert!(speed < 8.0, "{} s: {speed} m/s", time[n]);
    }
    let wet = fluid.last().is_some_and(|energy| *energy > 0.05);
    assert!(wet && left.last("largest_grain_speed") > 0.8, "it reaches the water");
    assert!(left.last("wet_liquid_volume_relative_change").abs() < 1e-7);
    assert!(left.last("momentum_residual_relative") < 1e-8);
    // Negative control: without what the beach takes of the block it would not close.
    assert!(left.last("impulse_held_grains_3").abs() > 0.02 * left.last("impulse_gravity_3").abs());
}

/// A sphere of 6 cells that spins in liquid, every step on record.
const SPINNING: &str = include_str!("../cases/bodies-spinning.toml");

#[test]
fn the_force_of_the_fluid_is_what_moves_a_body() {
    let step = 0.5e-3;
    let mass = 2500.0 * PI / 6.0 * Real::powi(6e-3, 3);
    for motion in ["free", "prescribed", "fixed"] {
        let name = format!("force-{motion}");
        let mut overrides = vec![format!("grains.0.motion={motion}")];
        if motion == "fixed" {
            overrides.push("grains.0.placement.list=[{ position = [\"7.4 mm\", \"7.7 mm\", \"12.2 mm\"] }]".into());
        }
        let overrides: Vec<&str> = overrides.iter().map(String::as_str).collect();
        let left = run(&name, SPINNING, &overrides);
        let probe = &left.probes[0].1;
        let vector = |name: &str| [1, 2, 3].map(|d| probe.column(&format!("{name}_{d}")));
        let impulse = |name: &str| vector(name).map(|force| step * force[1..].iter().sum::<Real>());
        let change = |name: &str| vector(name).map(|value| value[value.len() - 1] - value[0]);
        let ([fx, fy, fz], turn) = (impulse("fluid_force"), impulse("fluid_torque"));
        if motion == "free" {
            let [x, y, z] = change("velocity").map(|change| mass * change);
            let expected = [x, y, z + mass * 9.81 * 20e-3];
            for (found, expected) in [fx, fy, fz].into_iter().zip(expected) {
                assert!((found / expected - 1.0).abs() < 1e-6, "{name}: {found} for {expected}");
            }
            // Negative control: the weight is no small part of it.
            assert!((fz / z - 1.0).abs() > 0.1, "{name}");
            let spun = change("spin");
            let inertia = [0, 1, 2].map(|d| turn[d] / spun[d]);
            let of_ball = 0.1 * mass * Real::powi(6e-3, 2);
            for (d, found) in inertia.into_iter().enumerate() {
                assert!((found / of_ball - 1.0).abs() < 0.02, "{name} {d}: {found} for {of_ball}");
                assert!((found / inertia[0] - 1.0).abs() < 1e-5, "{name} {d}: {inertia:?}");
            }
        } else {
            // What holds it takes what the fluid gives it.
            let held = left.column("impulse_held_grains_3");
            let held = held[held.len() - 1] - held[0];
            assert!((fz / -held - 1.0).abs() < 1e-6, "{name}: {fz} for {held}");
        }
    }
}

#[test]
fn the_forces_on_a_body_that_lands_are_what_moves_it() {
    let low = "grains.0.placement.list=[{ position = [\"7.4 mm\", \"7.7 mm\", \"3.5 mm\"], velocity = [\"50 mm/s\", \"20 mm/s\", \"-0.2 m/s\"] }]";
    let mass = 2500.0 * PI / 6.0 * Real::powi(6e-3, 3);
    let dry = SPINNING
        .replace(
            "size = [\"15 mm\", \"15 mm\", \"20 mm\"]\ncells = [15, 15, 20]\n",
            "size = [\"60 mm\", \"60 mm\", \"60 mm\"]\n",
        )
        .replace("dt = \"0.5 ms\"\n[fluid.liquid]", "[fluid.liquid]")
        .replace(
            "[[liquid]]\nregion.half_space = { point = [\"0 m\", \"0 m\", \"9 m\"] }\nallow_touching_grains = true\n",
            "",
        );
    let dry = format!("solver = \"mps\"\nparticles = {{ spacing = \"2 mm\", dt_max = \"0.5 ms\" }}\n{dry}");
    for (name, text, on) in
        [("one", SPINNING, On::threads(1)), ("ranks", SPINNING, On::ranks(2, 1)), ("dry", &*dry, On::threads(1))]
    {
        let left =
            ran(text, &[low, "probe.0.every=0.5 ms"], &Scratch::new(&format!("bodies-lands-{name}")).join("run"), on);
        let probe = &left.probes[0].1;
        let vector = |name: &str| [1, 2, 3].map(|d| probe.column(&format!("{name}_{d}")));
        let impulse = |name: &str| vector(name).map(|force| 0.5e-3 * force[1..].iter().sum::<Real>());
        let contact = impulse("contact_force");
        let fluid = if name == "dry" { [0.0; 3] } else { impulse("fluid_force") };
        let gained = vector("velocity").map(|v| mass * (v[v.len() - 1] - v[0]));
        for d in 0..3 {
            let weight = if d == 2 { -mass * 9.81 * 20e-3 } else { 0.0 };
            let given = fluid[d] + contact[d] + weight;
            assert!((given - gained[d]).abs() < 1e-8 * contact[2], "{name} {d}: {given} for {}", gained[d]);
        }
        // Negative control: it meets the floor, which gives it more than its weight does.
        assert!(contact[2] > 1.5 * mass * 9.81 * 20e-3, "{name}: {contact:?}");
    }
}

/// A sphere of 8 cells above a level of water.
const AT_SURFACE: &str = include_str!("../cases/bodies-at-surface.toml");

#[test]
fn a_body_passes_the_surface_of_liquid() {
    let out = "grains.0.placement.list=[{ position = [\"11.25 mm\", \"11.25 mm\", \"14 mm\"], velocity = [\"0 m/s\", \"0 m/s\", \"1 m/s\"] }]";
    let run_with = |name: &str, overrides: &[&str]| {
        let left = run(&format!("surface-{name}"), AT_SURFACE, overrides);
        (left.last("momentum_residual_relative"), left.last("wet_liquid_volume_relative_change").abs())
    };
    let held = "grains.0.motion=prescribed";
    for (name, overrides) in [("dropped", &[][..]), ("lowered", &[held]), ("pulled", &[held, out])] {
        let (residual, change) = run_with(name, overrides);
        assert!(residual < 1e-6 && change < 1e-8, "{name}: {residual} {change}");
    }
    // Negative control: as published liquid hides within the sphere, 5 % of it in all, and momentum is lost.
    let (residual, change) = run_with("whole", &["coupling.exchange=stress", held]);
    assert!(residual > 1e-2 && change > 5e-3, "{residual} {change}");
}

#[test]
fn a_sphere_that_touches_nothing_is_not_ended_by_its_contacts() {
    // Without gravity in water that hardly moves: energies of 1e-20 J, whose differences are rounding.
    let text = "gravity = \"0 m/s^2\"\ndomain = { size = [\"40 mm\", \"40 mm\", \"40 mm\"], cells = [16, 16, 16] }\n\
                boundary = { all = \"periodic\", x3_lower = \"no_slip\", x3_upper = { moving = { velocity = [\"20 mm/s\", \"0 m/s\", \"0 m/s\"] } } }\n\
                fluid.liquid = { density = \"1000 kg/m^3\", kinematic_viscosity = \"1e-5 m^2/s\" }\n\
                material.a.density = \"1000 kg/m^3\"\noutput = { fields = { at = [] }, figures = { at = [] }, grains = { at = [] } }\n\
                run.until = \"50 ms\"\n[[liquid]]\nregion.half_space.point = [\"0 m\", \"0 m\", \"50 mm\"]\n\
                allow_touching_grains = true\n[[grains]]\nname = \"s\"\nshape.sphere = { diameter = \"10 mm\" }\n\
                placement.list = [{ position = [\"20 mm\", \"20 mm\", \"20 mm\"] }]\n";
    assert_eq!(run("alone", text, &[]).summary["status"], "finished");
}
