//! Tanks of moving particles in which something stands, moves or leaves beside what a tank as a rule has: grains with a velocity while
//! the water comes to rest, walls that move from the start on, fast water, grains that leave the water, gates below a feed.

use sazanami::progress::StepLine;

use crate::support::{Left, On, Scratch, findings, go_on, heard, interrupted, load, ran};

/// Water 10 mm deep in which grains begin with a velocity.
const THROWN: &str = include_str!("../cases/odd-tanks-thrown.toml");

/// What the preparation says.
fn said(text: &str, overrides: &[&str], name: &str) -> (Vec<String>, Vec<StepLine>) {
    let scratch = Scratch::new(name);
    let listener = heard(&load(text, overrides), &On::threads(1).options(Some(&scratch.join("run"))));
    (listener.messages, listener.lines)
}

#[test]
fn held_grains_with_a_velocity_do_not_stir_the_water_that_comes_to_rest() {
    let at_rest = "grains.0.placement.lattice.velocity=[\"0 m/s\", \"0 m/s\", \"0 m/s\"]";
    let of = |name: &str, overrides: &[&str]| {
        let (messages, lines) = said(THROWN, overrides, name);
        let rest = messages.into_iter().find(|text| text.contains("the water is ")).expect("it is told");
        (rest, lines.into_iter().filter(|line| line.phase == "relax").map(|line| line.dt).collect::<Vec<_>>())
    };
    assert_eq!(of("thrown", &[]), of("laid", &[at_rest]));
    let scratch = Scratch::new("thrown-parts");
    let energy = |left: &Left| left.column("kinetic_energy_grains")[0];
    // In a liquid whose drag would limit the steps of free grains.
    let thick = "fluid.liquid={ density = \"1000 kg/m^3\", kinematic_viscosity = \"1e-4 m^2/s\" }";
    let whole = ran(THROWN, &[thick], &scratch.join("whole"), On::threads(1));
    let folder = scratch.join("parts");
    let after = |line: &StepLine| line.phase == "relax" && line.step == 3;
    interrupted(&load(THROWN, &[thick]), &On::threads(1).options(Some(&folder)), after);
    go_on(&folder, On::threads(1)).0.unwrap_or_else(|error| panic!("{error}"));
    assert_eq!(Left::in_folder(&folder).hash(), whole.hash());
    // The run begins with their velocity.
    assert!(energy(&whole) > 0.0);
    // Negative control.
    assert_eq!(energy(&ran(THROWN, &[at_rest], &scratch.join("laid"), On::threads(1))), 0.0);
}

/// Shallow water in a tray that swings.
const TRAY: &str = include_str!("../cases/moving-walls-tray.toml");

#[test]
fn what_stands_in_a_tank_that_begins_with_a_speed_has_that_speed_from_the_start() {
    let scratch = Scratch::new("tray-grains");
    let grain = |motion: &str| {
        format!(
            "{TRAY}[material.sand]\ndensity = \"2650 kg/m^3\"\n[contact.default]\n[[grains]]\nshape.sphere.diameter = \"2 mm\"\n\
             motion = \"{motion}\"\nplacement.list = [{{ position = [\"10 mm\", \"4 mm\", \"2 mm\"] }}]\n"
        )
    };
    let run = |motion: &str, walls: &str| {
        let walls = format!("frame.motion.walls={walls}");
        let name = scratch.join(&format!("{motion}-{walls}"));
        ran(&grain(motion), &[&walls, "run.until=20 ms"], &name, On::threads(1))
    };
    let [moving, frame] = ["moving", "at_rest"].map(|walls| run("fixed", walls));
    let energy = [&moving, &frame].map(|left| left.column("kinetic_energy_grains"));
    assert!(energy.iter().flatten().all(|energy| energy.abs() < 1e-18), "{energy:?}");
    let first = [&moving, &frame].map(|left| left.column("momentum_1")[0]);
    assert!((first[0] / first[1] - 1.0).abs() < 1e-6, "{first:?}");
    // Largest speeds are those against the tank.
    let speeds = |left: &Left, of: &str| left.column(of)[1..].to_vec();
    let [seen, other] = [&moving, &frame].map(|left| speeds(left, "largest_fluid_speed"));
    assert!(seen.iter().zip(&other).all(|(a, b)| (a / b - 1.0).abs() < 0.1 && *b > 0.1), "{seen:?} {other:?}");
    let held = speeds(&moving, "largest_grain_speed");
    assert!(held.iter().all(|speed| *speed < 1e-9), "{held:?}");
    // Negative control: a grain that is free begins with the speed of the tank against it.
    let free = run("free", "moving");
    assert!(free.column("kinetic_energy_grains")[0] > 1e-9 && speeds(&free, "largest_grain_speed")[0] > 0.1);
}

#[test]
fn water_as_fast_as_the_case_asks_for_is_not_told_to_be_unlikely() {
    let frame = TRAY.find("frame.motion").expect("it swings");
    let still = format!("{}{}", &TRAY[..frame], &TRAY[frame + TRAY[frame..].find('\n').expect("a line")..]);
    let unlikely = |name: &str, overrides: &[&str]| {
        let all = [
            &["boundary.x3_lower=slip", "run.until=20 ms", "preparation.relax_steps=0", "preparation.settle=0 s"],
            overrides,
        ]
        .concat();
        said(&still, &all, name).0.iter().any(|text| text.contains("water has reached"))
    };
    assert!(!unlikely("initial", &["fluid.initial_velocity.uniform.velocity=[\"2.5 m/s\", \"0 m/s\", \"0 m/s\"]"]));
    let held = "drive={ mean_velocity = [\"2.5 m/s\", \"0 m/s\", \"0 m/s\"], answer = \"2 ms\" }";
    assert!(!unlikely("held", &[held]));
    assert!(!unlikely("forced", &["drive.acceleration=[\"125 m/s^2\", \"0 m/s^2\", \"0 m/s^2\"]"]));
    // Negative control: as fast by a force that comes and goes.
    let swing = "drive.oscillation={ amplitude = [\"400 m/s^2\", \"0 m/s^2\", \"0 m/s^2\"], frequency = \"25 Hz\", phase = \"90 deg\" }";
    assert!(unlikely("swung", &[swing]));
}

/// Grains that are pulled out of water, and out of the box.
const PULLED: &str = include_str!("../cases/odd-tanks-pulled.toml");

#[test]
fn grains_that_leave_take_no_water_with_them() {
    let volume = |name: &str, overrides: &[&str]| {
        let told = said(PULLED, overrides, name).0;
        told.iter().any(|text| text.contains("the bulk volume of the water has changed"))
    };
    assert!(!volume("pulled", &[]));
    // Negative control: those that hang in the air have left the water, and not the box.
    assert!(volume("hanging", &["run.until=30 ms", "output.series.every=30 ms"]));
}

/// A column of water behind a gate that rises.
const DAM: &str = include_str!("../cases/gates-dam.toml");

#[test]
fn grains_are_fed_in_beside_gates_and_wait_where_one_stands() {
    let feed = |lower: &str, upper: &str| {
        format!(
            "{DAM}[material.sand]\ndensity = \"2650 kg/m^3\"\n[contact.default]\n[[grains]]\nname = \"rain\"\nshape.sphere.diameter = \"1 mm\"\n\
             [grains.placement.fed]\nside = \"x3_upper\"\nrate = \"2 kHz\"\nvelocity = [\"0.1 m/s\", \"0 m/s\", \"-0.5 m/s\"]\n\
             lower = [\"{lower}\", \"0 mm\", \"0 mm\"]\nupper = [\"{upper}\", \"8 mm\", \"0 mm\"]\n"
        )
    };
    let dry = ["liquid=[]", "preparation={ relax_steps = 0, settle = \"0 s\", cache = false }", "run.until=12 ms"];
    let scratch = Scratch::new("fed-gates");
    let run = |name: &str, text: &str, overrides: &[&str]| {
        ran(text, &[&dry[..], overrides].concat(), &scratch.join(name), On::threads(1))
    };
    // Half of their places are above the plate, which stands all through.
    let beside = run("beside", &feed("8.4 mm", "11.8 mm"), &["gate.0.opens=1 s"]);
    assert!(beside.last("fed_grains") > 10.0, "{}", beside.last("fed_grains"));
    // Where all are they wait: until it has risen out of the box, and until it is gone at once.
    let above = feed("9.3 mm", "10.9 mm");
    for (name, how) in [("risen", "gate.0.speed=4 m/s"), ("gone", "gate.0={ x1 = \"10 mm\", opens = \"5.5 ms\" }")] {
        let fed = run(name, &above, &[how]);
        let [time, count] = ["time", "fed_grains"].map(|column| fed.column(column));
        let first = time.iter().zip(&count).find(|(_, count)| **count > 0.0).map(|(time, _)| *time);
        assert!(first.is_some_and(|time| time > 5e-3), "{name}: {first:?}");
    }
    // Negative control: off the gate they come at once.
    let off = run("off", &feed("14 mm", "15.6 mm"), &[]);
    assert!(off.column("fed_grains")[1] > 0.0);
    // A gate that stands there until the run ends leaves no way in.
    let refused = |overrides: &[&str]| {
        let found = findings(&above, &[&dry[..], overrides].concat());
        found.iter().any(|title| title.contains("have no way in beside the gate"))
    };
    assert!(refused(&["gate.0.opens=1 s"]) && !refused(&[]) && !refused(&["gate.0.opens=1 s", "gate.0.top=7 mm"]));
}
