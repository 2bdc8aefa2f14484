//! Gates in whole runs: the water behind one is prepared at rest, runs on when it is raised, on ranks and after a restart, and what
//! cannot be is refused.

use std::path::Path;

use crate::support::{Left, On, Scratch, go_on, load, start};
use sazanami::case;
use sazanami::check::CostModel;
use sazanami::error::{CommandError, exit};
use sazanami::feasible;
use sazanami::machine::Machine;
use sazanami_numerics::Real;

/// A column of water behind a gate that rises from 2 ms on.
const DAM: &str = include_str!("../cases/gates-dam.toml");

/// The dam with a grain of 1 mm at `x1`, with `more` keys of it.
fn with_grain(x1: &str, more: &str) -> String {
    let grain = format!(
        "[material.sand]\ndensity = \"2650 kg/m^3\"\n[contact.default]\n[[grains]]\nshape.sphere = {{ diameter = \"1 mm\" }}\n\
         {more}placement.list = [{{ position = [\"{x1}\", \"3 mm\", \"2 mm\"] }}]\n[run]"
    );
    DAM.replace("[run]", &grain)
}

fn ran(folder: &Path, overrides: &[&str], on: On) -> Result<Left, Box<CommandError>> {
    start(&load(DAM, overrides), folder, on).map_err(Box::new)?;
    Ok(Left::in_folder(folder))
}

#[test]
fn a_dam_is_prepared_behind_its_gate_and_breaks_when_it_opens() {
    let scratch = Scratch::new("gates");
    let whole = ran(&scratch.join("whole"), &[], On::threads(1)).unwrap_or_else(|error| panic!("{error}"));
    let [times, speeds] = ["time", "largest_fluid_speed"].map(|column| whole.column(column));
    // What the same column keeps in a tank that ends where the gate stands.
    let (gate, water) = (DAM.find("[[gate]]").expect("a gate"), DAM.find("[[liquid]]").expect("water"));
    let text = format!("{}{}", &DAM[..gate], &DAM[water..]).replace("24 mm", "10 mm");
    let folder = scratch.join("short");
    start(&load(&text, &["particles.projection=conjugate"]), &folder, On::threads(1))
        .unwrap_or_else(|error| panic!("{error}"));
    let short = Left::in_folder(&folder).column("largest_fluid_speed");
    let still = 1.5 * short.into_iter().skip(1).fold(0.0, Real::max);
    assert!(still < 0.01 * Real::sqrt(9.81 * 10e-3), "{still}");
    // No speed is known before the first step.
    let closed = times.iter().zip(&speeds).skip(1).filter(|(time, _)| **time <= 2e-3 * (1.0 + 1e-9));
    assert!(closed.clone().count() >= 2 && closed.clone().all(|(_, &speed)| speed < still), "{speeds:?}");
    assert!(speeds.last().is_some_and(|&speed| speed > 10.0 * still), "{speeds:?}");
    // Broken off while it rises, the run comes to the same bits.
    let folder = scratch.join("parts");
    start(&load(DAM, &[]), &folder, On::threads(1).steps(14)).unwrap_or_else(|error| panic!("{error}"));
    go_on(&folder, On::threads(2)).0.expect("the run goes on");
    assert_eq!(Left::in_folder(&folder).hash(), whole.hash());
    // Two ranks see the same physics.
    let two = ran(&scratch.join("two"), &[], On::ranks(2, 1)).unwrap_or_else(|error| panic!("{error}"));
    let ends = [&whole, &two].map(|left| *left.column("largest_fluid_speed").last().expect("there are rows"));
    assert!((ends[0] / ends[1] - 1.0).abs() < 1e-3, "{ends:?}");
    // Negative control: with a gate above the water the column collapses in the preparation, and is refused.
    let over = ["gate.0.bottom=13 mm"];
    let error = ran(&scratch.join("free"), &over, On::threads(1)).err().expect("the water is not at rest");
    assert!(error.to_string().contains("did not come to rest"), "{error}");
}

#[test]
fn a_run_goes_on_with_its_gate_half_open_where_a_grain_is_released() {
    let scratch = Scratch::new("gate-release");
    let case = load(&with_grain("8 mm", "release = \"3 ms\"\n"), &[]);
    let [whole, parts] = ["whole", "parts"].map(|name| scratch.join(name));
    start(&case, &whole, On::threads(1)).unwrap_or_else(|error| panic!("{error}"));
    start(&case, &parts, On::threads(1).steps(15)).unwrap_or_else(|error| panic!("{error}"));
    let time = *Left::in_folder(&parts).column("time").last().expect("there are rows");
    assert!((time / 3e-3 - 1.0).abs() < 1e-9, "it breaks off at {time}");
    go_on(&parts, On::threads(1)).0.expect("the run goes on");
    let [whole, parts] = [&whole, &parts].map(|folder| Left::in_folder(folder));
    assert_eq!((whole.hash(), &whole.series), (parts.hash(), &parts.series));
}

/// The message on a case that is wrong.
fn refused(change: &[&str]) -> String {
    let overrides: Vec<String> = change.iter().map(|text| (*text).to_owned()).collect();
    let error = case::parse(Path::new("dam.toml"), DAM, &overrides).expect_err("this is wrong");
    let error = CommandError::from(error);
    assert_eq!(error.exit_code(), exit::WRONG_INPUT);
    error.to_string()
}

#[test]
fn gates_that_cannot_be_are_refused_with_a_reason() {
    for (change, words) in [
        (&["gate.0.x1=30 mm"][..], &["outside the box", "x1"][..]),
        (&["gate.0.x2=3 mm"], &["has one of `x1` and `x2`"]),
        (&["gate.0.opens=-1 s"], &["opens"]),
        (&["gate.0.x1=2 mm"], &["too near to a wall", "5.2 mm"]),
        (&["gate.0.bottom=5 mm", "gate.0.top=5 mm"], &["has no height"]),
        (&["gate.0.top=20 mm"], &["reaches out of the box"]),
        (&["solver=mics", "domain.cells=[24, 8, 14]"], &["gates are for `solver = \"mps\"`"]),
        (&["preset=paper_literal"], &["gates are for `projection = \"conjugate\"`"]),
        (&["boundary.x1=periodic"], &["x1 is periodic"]),
        (&["gate.0.x1=10.5 mm"], &["stands within a layer of particles", "mm\""]),
        (&["boundary.x3_upper=slip"], &["open above"]),
    ] {
        let message = refused(change);
        assert!(words.iter().all(|word| message.contains(word)), "{change:?}: {message}");
    }
    let with = |more: &str| {
        let text = DAM.replace("[[liquid]]", &format!("{more}\n[[liquid]]"));
        case::parse(Path::new("dam.toml"), &text, &[]).map(|_| ()).map_err(|error| error.to_string())
    };
    let near = with("[[gate]]\nname = \"b\"\nx1 = \"14 mm\"").expect_err("too near");
    assert!(near.contains("`lock` and `b` are too near to each other"), "{near}");
    let across = with("[[gate]]\nx2 = \"3 mm\"").expect_err("across");
    assert!(across.contains("meet"), "{across}");
    let named = with("[[gate]]\nname = \"lock\"\nx1 = \"17 mm\"").expect_err("two of a name");
    assert!(named.contains("two gates are called `lock`"), "{named}");
    assert!(with("[[gate]]\nx1 = \"17 mm\"").is_ok());
}

#[test]
fn grains_in_a_gate_are_refused() {
    let scratch = Scratch::new("gate-grain");
    let case = load(&with_grain("10.4 mm", ""), &[]);
    let error = start(&case, &scratch.join("in"), On::threads(1)).expect_err("the grain is in the gate");
    assert!(error.to_string().contains("stands in the gate `lock`"), "{error}");
    // `check` knows the places of grains that the case puts, one by one or on a lattice.
    let foretold = |text: &str| {
        let loaded = load(text, &[]);
        feasible::check(&loaded, &Machine::this(), &CostModel::default()).err().map(|error| format!("{error:?}"))
    };
    let place = "placement.list = [{ position = [\"10.4 mm\", \"3 mm\", \"2 mm\"] }]";
    let lattice = "placement.lattice = { lower = [\"6 mm\", \"1 mm\", \"1 mm\"], upper = [\"14 mm\", \"7 mm\", \"7 mm\"], counts = [5, 3, 3] }";
    let listed = with_grain("10.4 mm", "");
    for text in [&listed, &listed.replace(place, lattice)] {
        assert!(foretold(text).is_some_and(|error| error.contains("stands in the gate")), "{text}");
    }
    assert_eq!(foretold(&with_grain("10.6 mm", "")), None);
}

#[test]
fn no_water_is_poured_into_a_gate_behind_a_bed() {
    // Between these grains a layer by layer has a particle in the plane of the gate.
    let text = "solver = \"mps\"\ngravity = \"9.81 m/s^2\"\ndomain.size = [\"120 mm\", \"32 mm\", \"60 mm\"]\n\
                boundary = { all = \"slip\", x2 = \"periodic\", x3_upper = \"outflow\" }\nparticles.spacing = \"4 mm\"\n\
                material.sand.density = \"2650 kg/m^3\"\ncontact.default.normal_stiffness = \"400 N/m\"\n\
                preparation = { cache = false, must_rest = false, relax_steps = 100, settle = \"1 ms\" }\n\
                output = { fields = { at = [] }, grains = { at = [] }, figures = { at = [] } }\nrun.until = \"0.4 ms\"\n\
                [[gate]]\nx1 = \"60 mm\"\nopens = \"1 s\"\n[[liquid]]\n\
                region.box = { lower = [\"0 mm\", \"0 mm\", \"0 mm\"], upper = [\"60 mm\", \"32 mm\", \"36 mm\"] }\n\
                [[grains]]\nshape.sphere.diameter = \"4 mm\"\n\
                placement.lattice = { lower = [\"0 mm\", \"0 mm\", \"0 mm\"], upper = [\"56 mm\", \"32 mm\", \"8 mm\"], counts = [13, 7, 2] }\n";
    let scratch = Scratch::new("poured-at-a-gate");
    let fastest = |name: &str, overrides: &[&str]| {
        let folder = scratch.join(name);
        start(&load(text, overrides), &folder, On::threads(1)).unwrap_or_else(|error| panic!("{error}"));
        Left::in_folder(&folder).column("largest_fluid_speed").into_iter().skip(1).fold(0.0, Real::max)
    };
    let shut = fastest("shut", &[]);
    assert!(shut < 0.05, "{shut}");
    // Negative control: open at once the water runs.
    assert!(fastest("open", &["gate.0.opens=0 s", "run.until=20 ms"]) > 0.1);
    // Turned, with a second gate behind it.
    let turned = [
        "domain.size=[\"32 mm\", \"140 mm\", \"60 mm\"]",
        "boundary={ all = \"slip\", x1 = \"periodic\", x3_upper = \"outflow\" }",
        "gate=[{ x2 = \"60 mm\", opens = \"1 s\" }, { x2 = \"100 mm\", opens = \"1 s\" }]",
        "liquid.0.region.box.upper=[\"32 mm\", \"60 mm\", \"36 mm\"]",
        "grains.0.placement.lattice={ lower = [\"0 mm\", \"0 mm\", \"0 mm\"], upper = [\"32 mm\", \"56 mm\", \"8 mm\"], counts = [7, 13, 2] }",
    ];
    let turned = fastest("turned", &turned);
    assert!(turned < 0.05, "{turned}");
}
