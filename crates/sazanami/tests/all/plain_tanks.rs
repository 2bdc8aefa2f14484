//! Tanks of moving particles in which there is little: no grains, walls of two kinds, water of any shape, no floor.

use std::path::Path;

use sazanami::machine::Machine;
use sazanami_numerics::Real;

use crate::support::{On, Scratch, before_run, findings, foretold, load, ran, summary};

const TANK: &str = r#"
solver = "mps"
gravity = "9.81 m/s^2"
[domain]
size = ["16 mm", "6 mm", "16 mm"]
[boundary]
all = "slip"
[particles]
spacing = "1 mm"
[[liquid]]
region.box = { lower = ["0 mm", "0 mm", "0 mm"], upper = ["16 mm", "6 mm", "10 mm"] }
[preparation]
cache = false
[output]
figures = { at = [] }
fields = { at = [] }
grains = { at = [] }
series = { steps = 1 }
[run]
until = "0.4 ms"
"#;

/// Fixed spheres of 1 mm on a lattice, five along x1 and x3 and four along x2.
const GRAINS: &str = r#"
[material.sand]
density = "2650 kg/m^3"
[contact.default]
[[grains]]
motion = "fixed"
shape.sphere = { diameter = "1 mm" }
placement.lattice = { lower = ["0 mm", "0 mm", "0 mm"], upper = ["16 mm", "6 mm", "10 mm"], counts = [5, 4, 5] }
[preparation]
relax_steps = 5
cache = false
must_rest = false
"#;

/// Particles of water that `check` foretells, and those of the run.
fn particles(folder: &Path, overrides: &[&str]) -> [Real; 2] {
    let report = foretold(&load(TANK, overrides).case);
    ran(TANK, overrides, folder, On::threads(1).steps(1));
    [report.particles.expect("moving particles").fluid as Real, poured(folder)]
}

/// Particles of water of a run.
fn poured(folder: &Path) -> Real {
    summary(folder)["counts"]["fluid_particles"].as_f64().expect("a number")
}

#[test]
fn water_of_any_shape_is_foretold() {
    let scratch = Scratch::new("shapes");
    let cut = "liquid.0.region={ half_space = { point = [\"0 mm\", \"0 mm\", \"12 mm\"], normal = [1, 0, 1] } }";
    let upright = "liquid.0.region={ half_space = { point = [\"6 mm\", \"0 mm\", \"0 mm\"], normal = [1, 0, 0] } }";
    let two = "liquid=[{ region.box = { lower = [\"0 mm\", \"0 mm\", \"0 mm\"], upper = [\"16 mm\", \"6 mm\", \"8 mm\"] } }, \
               { region.box = { lower = [\"0 mm\", \"0 mm\", \"4 mm\"], upper = [\"8 mm\", \"6 mm\", \"12 mm\"] } }]";
    let bubble = "liquid=[{ region.box = { lower = [\"0 mm\", \"0 mm\", \"0 mm\"], upper = [\"16 mm\", \"6 mm\", \"8 mm\"] } }, \
                  { fluid = \"gas\", region.half_space = { point = [\"8 mm\", \"0 mm\", \"0 mm\"], normal = [1, 0, 0] } }]";
    let ball = "liquid.0.region={ sphere = { centre = [\"0 mm\", \"3 mm\", \"0 mm\"], diameter = \"18 mm\" } }";
    for (n, change) in [cut, upright, two, bubble, ball].into_iter().enumerate() {
        let [foretold, poured] = particles(&scratch.join(&n.to_string()), &[change]);
        assert!((foretold / poured - 1.0).abs() < 0.08 && poured > 100.0, "{change}: {foretold}, {poured}");
    }
    // A bubble whose place is counted from the bed, takes its place in the water that reaches there.
    let volumes = |changes: &[&str]| -> [Real; 2] {
        let text = TANK.replace("[preparation]\ncache = false\n", &GRAINS.replace("motion = \"fixed\"", "count = 100"));
        let packed = ["grains.0.placement={ packed = {} }", "domain.size=[\"16 mm\",\"6 mm\",\"40 mm\"]"];
        let report = foretold(&load(&text, &[&packed[..], changes].concat()).case);
        [report.liquids[0].volume_m3.expect("a volume"), report.particles.expect("moving particles").fluid as Real]
    };
    let with = |place: &str| {
        format!(
            "liquid=[{{ region.box = {{ lower = [\"0 mm\", \"0 mm\", \"0 mm\"], upper = [\"16 mm\", \"6 mm\", \"14 mm\"] }} }}, \
             {{ fluid = \"gas\", region.sphere.diameter = \"5 mm\", above_bed = \"{place}\" }}]"
        )
    };
    let [[inside, fewer], [above, all]] = ["4 mm", "20 mm"].map(|place| volumes(&[&with(place)]));
    let ball = std::f64::consts::PI / 6.0 * 125e-9;
    assert!(((above - inside) / ball - 1.0).abs() < 0.1, "{above} {inside}");
    assert!(((all - fewer) / (1e9 * ball) - 1.0).abs() < 0.1, "{all} {fewer}");
    // Control: the box, whose volume has a formula, to the particle.
    let [foretold, poured] = particles(&scratch.join("box"), &[]);
    assert_eq!([foretold, poured], [960.0; 2]);
}

#[test]
fn a_tank_without_grains_shows_its_water() {
    let scratch = Scratch::new("water-drawn");
    let drawn = |name: &str, text: &str| {
        let folder = scratch.join(name);
        ran(text, &["output.figures={ at = [\"0.4 ms\"] }"], &folder, On::threads(1));
        let mut found = std::fs::read_dir(folder.join("figures")).expect("a folder");
        std::fs::read_to_string(found.next().expect("a picture").expect("an entry").path()).expect("a text")
    };
    let water = drawn("water", TANK);
    assert!(water.contains("pressure p [Pa]") && water.contains("particles of water: middle"), "{:.200}", water);
    assert!(!water.contains("drag f_"), "{:.200}", water);
    // Control: grains are drawn where there are any.
    let grains = drawn("grains", &TANK.replace("[preparation]\ncache = false\n", GRAINS));
    assert!(grains.contains("drag f_{d,x}") && !grains.contains("pressure p [Pa]"), "{:.200}", grains);
}

#[test]
fn warnings_about_a_bed_need_one() {
    let shaken = "frame.motion={ amplitude = [\"1 mm\", \"0 mm\", \"0 mm\"], frequency = \"5 Hz\" }";
    let warned = |text: &str| {
        let loaded = load(text, &[shaken, "boundary.all=no_slip", "boundary.x3_upper=outflow"]);
        let (runs, found) = before_run(&loaded, &Machine::this());
        assert!(runs, "{found:?}");
        found.iter().any(|message| message.contains("the boundary layer on the bed"))
    };
    assert!(!warned(TANK));
    assert!(warned(&TANK.replace("[preparation]\ncache = false\n", GRAINS)));
}

#[test]
fn outputs_after_the_end_of_the_run_are_said() {
    let late = |change: &str| {
        let found = findings(TANK, &[change]);
        found.iter().find(|message| message.contains("after the end of the run")).cloned()
    };
    assert_eq!(late("output.fields.at=[\"0 s\", \"0.4 ms\"]"), None);
    let two = late("output.grains.at=[\"0.2 ms\", \"0.5 ms\", \"1 s\"]").expect("a warning");
    assert!(two.starts_with("2 of 3 times"), "{two}");
    let probe = "probe=[{ name = \"p\", gauge = [\"1 mm\", \"1 mm\"], at = [\"1 ms\"] }]";
    assert!(late(probe).is_some_and(|one| one.starts_with("1 of 1 times")));
}

#[test]
fn water_between_held_grains_without_a_floor_is_prepared_at_rest_and_then_falls() {
    let scratch = Scratch::new("no-floor");
    // The water has to rest at the end of the preparation: one that falls in it is refused.
    let text = TANK
        .replace("[preparation]\ncache = false\n", &GRAINS.replace("must_rest = false\n", ""))
        .replace("all = \"slip\"", "all = \"periodic\"");
    let full = [
        "domain.size=[\"16 mm\",\"8 mm\",\"10 mm\"]",
        "liquid.0.region.box.upper=[\"16 mm\",\"8 mm\",\"10 mm\"]",
        "particles.dt=0.1 ms",
    ];
    let folder = scratch.join("run");
    let left = ran(&text, &full, &folder, On::threads(1));
    let mass = 1e-6 * poured(&folder);
    assert_eq!(left.column("momentum_3")[0], 0.0, "it has not fallen while it was prepared");
    // Drag takes little in so short a time.
    let fallen = left.last("momentum_3") / (mass * 9.81 * left.last("time"));
    assert!((-1.0..-0.7).contains(&fallen), "{fallen}");
}
