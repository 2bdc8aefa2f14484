//! Rebounds of a bead in a liquid on the grid, with the film that its cells do not resolve.

use std::path::Path;

use sazanami_numerics::Real;

use crate::support::{Left, On, Scratch, load, ran, refusal};

/// A bead of 6 cells above the floor; its radius is 3 mm.
const BEAD: &str = r#"
gravity = "9.81 m/s^2"
[domain]
size = ["18 mm", "18 mm", "18 mm"]
cells = [18, 18, 18]
[boundary]
all = "no_slip"
[fluid]
liquid = { density = "1000 kg/m^3", kinematic_viscosity = "2e-5 m^2/s" }
[[liquid]]
region.half_space = { point = ["0 m", "0 m", "1 m"] }
allow_touching_grains = true
[material.g]
density = "7800 kg/m^3"
[contact.default]
normal_stiffness = "1e3 N/m"
restitution = 0.9
friction = 0.0
[[grains]]
name = "b"
shape.sphere = { diameter = "6 mm" }
material = "g"
placement.list = [{ position = ["9 mm", "9 mm", "5 mm"], velocity = ["0 m/s", "0 m/s", "-0.4 m/s"] }]
[[probe]]
name = "b"
body = { population = "b", index = 0 }
every = "0.1 ms"
[output]
fields = { at = [] }
figures = { at = [] }
grains = { at = [] }
series = { every = "1 ms" }
[run]
until = "15 ms"
"#;

/// Stokes number of the impact, and the speed at a fiftieth of a radius above the floor after it over 0.9 of that before.
fn rebound(folder: &Path, density: Real, overrides: &[&str]) -> [Real; 2] {
    let density_text = format!("material.g.density={density} kg/m^3");
    let left = ran(BEAD, &[&[density_text.as_str()], overrides].concat(), folder, On::threads(2));
    let [height, speed] = ["position_3", "velocity_3"].map(|column| left.probe("b").column(column));
    let gap: Vec<Real> = height.iter().map(|z| z - 3e-3).collect();
    let hit = (0..gap.len()).min_by(|&a, &b| gap[a].total_cmp(&gap[b])).expect("rows");
    let before = -speed[..=hit].iter().fold(0.0, |fastest: Real, v| fastest.min(*v));
    let after = (hit..gap.len()).find(|&n| gap[n] > 6e-5 && speed[n] > 0.0).map_or(0.0, |n| speed[n]);
    [density * 6e-3 * before / (9.0 * 0.02), after / (0.9 * before)]
}

/// Legendre et al. (2006), Chem. Eng. Sci. 61, 3543, through the measurements of Gondret et al. (2002), Phys. Fluids 14, 643, who
/// saw none below a Stokes number of 20.
#[test]
fn a_bead_rebounds_as_measured() {
    let scratch = Scratch::new("wet");
    let fitted = |stokes: Real| if stokes < 20.0 { 0.0 } else { (-35.0 / stokes).exp() };
    let slow = |speed: &str| format!("grains.0.placement.list.0.velocity=[\"0 m/s\", \"0 m/s\", \"-{speed} m/s\"]");
    for (name, density, speed) in [("fast", 7800.0, "0.4"), ("middle", 7800.0, "0.25"), ("slow", 1200.0, "0.06")] {
        let [stokes, found] = rebound(&scratch.join(name), density, &[&slow(speed), "run.until=25 ms"]);
        assert!((found - fitted(stokes)).abs() < 0.1, "St {stokes}: {found}, {}", fitted(stokes));
        assert!(found <= 1.0 && (name == "slow" || found > 0.4), "{name}: {found}");
    }
    // Control: without a film it rebounds too fast.
    let rough = [&slow("0.25"), "run.until=25 ms", "dem.film_roughness=none"];
    let [stokes, found] = rebound(&scratch.join("none"), 7800.0, &rough);
    assert!(found > fitted(stokes) + 0.15, "St {stokes}: {found}");
}

#[test]
fn a_film_keeps_momentum_and_bits() {
    let scratch = Scratch::new("wet-bits");
    // Two beads that meet, one above the other.
    let pair = [
        "gravity=0 m/s^2",
        "grains.0.placement.list=[{ position = [\"9 mm\", \"9 mm\", \"5.5 mm\"], velocity = [\"0 m/s\", \"0 m/s\", \"0.4 m/s\"] }, \
         { position = [\"9 mm\", \"9 mm\", \"12.5 mm\"], velocity = [\"0 m/s\", \"0 m/s\", \"-0.1 m/s\"] }]",
        "run.until=8 ms",
    ];
    let one = ran(BEAD, &pair, &scratch.join("one"), On::threads(1));
    let two = ran(BEAD, &pair, &scratch.join("two"), On::threads(2));
    assert_eq!((one.hash(), &one.series), (two.hash(), &two.series));
    let energy = |left: &Left| left.last("kinetic_energy_grains");
    let ranks = ran(BEAD, &pair, &scratch.join("ranks"), On::ranks(2, 1));
    assert!((energy(&ranks) / energy(&one) - 1.0).abs() < 1e-6, "{} {}", energy(&ranks), energy(&one));
    let residual = one.column("momentum_residual_relative");
    assert!(residual.iter().all(|r| r.abs() < 1e-8), "{residual:?}");
    // Control: the film acts between them.
    let bare = [&pair[..], &["dem.film_roughness=none"]].concat();
    let without = ran(BEAD, &bare, &scratch.join("bare"), On::threads(1));
    assert!(energy(&one) < 0.95 * energy(&without), "{} {}", energy(&one), energy(&without));
}

#[test]
fn films_that_cannot_be_on_a_grid_are_refused() {
    for (change, words) in [
        ("dem.film_roughness=0.5 mm", "on a grid it ends at half a cell"),
        ("grains.0.shape={ box = { size = [\"6 mm\", \"6 mm\", \"6 mm\"] } }", "films are between spheres"),
        ("grains.0.contact_spheres=shell(50)", "films are between spheres"),
    ] {
        let error = refusal(BEAD, &["dem.film_roughness=0.3 um", change]);
        assert!(error.contains(words), "{change}: {error}");
    }
}

#[test]
fn films_are_where_spheres_meet_in_a_liquid() {
    let film = |changes: &[&str]| load(BEAD, changes).case.film_roughness();
    assert!((film(&[]).expect("a film") / 0.3e-6 - 1.0).abs() < 1e-9);
    // Of tiny grains a part of the radius.
    assert!((film(&["grains.0.shape.sphere.diameter=20 um"]).expect("a film") / 1e-7 - 1.0).abs() < 1e-9);
    for none in [
        &["dem.film_roughness=none"][..],
        &["preset=paper_literal"],
        &["grains.0.contact_spheres=shell(50)"],
        &["grains.0.shape={ box = { size = [\"6 mm\", \"6 mm\", \"6 mm\"] } }"],
        &["liquid=[]"],
        &[
            "grains.0.placement.list.0.motion=fixed",
            "grains.0.placement.list.0.velocity=[\"0 m/s\", \"0 m/s\", \"0 m/s\"]",
        ],
    ] {
        assert_eq!(film(none), None, "{none:?}");
    }
}

/// A bead that falls in the gas above a liquid that it does not reach has the gas as its film.
#[test]
fn dry_grains_have_no_film_of_the_liquid() {
    let scratch = Scratch::new("wet-dry");
    // Upside down: the liquid is the lower third, the bead flies to the lid.
    let dry = [
        "gravity=0 m/s^2",
        "liquid.0.region={ box = { lower = [\"0 mm\", \"0 mm\", \"0 mm\"], upper = [\"18 mm\", \"18 mm\", \"5 mm\"] } }",
        "grains.0.placement.list.0.position=[\"9 mm\", \"9 mm\", \"14 mm\"]",
        "grains.0.placement.list.0.velocity=[\"0 m/s\", \"0 m/s\", \"0.1 m/s\"]",
        "run.until=20 ms",
    ];
    let speed = |name: &str, changes: &[&str]| {
        let left = ran(BEAD, &[&dry[..], changes].concat(), &scratch.join(name), On::threads(2));
        -left.probe("b").last("velocity_3")
    };
    let (with, without) = (speed("with", &[]), speed("without", &["dem.film_roughness=none"]));
    assert!(without > 0.08 && (with / without - 1.0).abs() < 0.01, "{with} {without}");
    // Control: in the liquid the film takes more than that.
    let wet = ["liquid.0.region={ half_space = { point = [\"0 m\", \"0 m\", \"1 m\"] } }"];
    let (with, without) = (speed("wet", &wet), speed("bare", &[&wet[..], &["dem.film_roughness=none"]].concat()));
    assert!(with < 0.95 * without, "{with} {without}");
}
