//! Gates in whole runs: the water behind one is prepared at rest, runs on when it is raised, on ranks and after a restart, and what
//! cannot be is refused.

use crate::support::{Left, On, Scratch, before_run, go_on, load, ran, refusal, start};
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

#[test]
fn a_dam_is_prepared_behind_its_gate_and_breaks_when_it_opens() {
    let scratch = Scratch::new("gates");
    let whole = ran(DAM, &[], &scratch.join("whole"), On::threads(1));
    let [times, speeds] = ["time", "largest_fluid_speed"].map(|column| whole.column(column));
    // What the same column keeps in a tank that ends where the gate stands.
    let (gate, water) = (DAM.find("[[gate]]").expect("a gate"), DAM.find("[[liquid]]").expect("water"));
    let text = format!("{}{}", &DAM[..gate], &DAM[water..]).replace("24 mm", "10 mm");
    let short = ran(&text, &["particles.projection=conjugate"], &scratch.join("short"), On::threads(1));
    let still = 1.5 * short.column("largest_fluid_speed").into_iter().skip(1).fold(0.0, Real::max);
    assert!(still < 0.01 * Real::sqrt(9.81 * 10e-3), "{still}");
    // No speed is known before the first step.
    let closed = times.iter().zip(&speeds).skip(1).filter(|(time, _)| **time <= 2e-3 * (1.0 + 1e-9));
    assert!(closed.clone().count() >= 2 && closed.clone().all(|(_, &speed)| speed < still), "{speeds:?}");
    assert!(speeds.last().is_some_and(|&speed| speed > 10.0 * still), "{speeds:?}");
    // Broken off while it rises, the run comes to the same bits.
    let folder = scratch.join("parts");
    ran(DAM, &[], &folder, On::threads(1).steps(14));
    go_on(&folder, On::threads(2)).0.expect("the run goes on");
    assert_eq!(Left::in_folder(&folder).hash(), whole.hash());
    // Two ranks see the same physics.
    let two = ran(DAM, &[], &scratch.join("two"), On::ranks(2, 1));
    let ends = [&whole, &two].map(|left| left.last("largest_fluid_speed"));
    assert!((ends[0] / ends[1] - 1.0).abs() < 1e-3, "{ends:?}");
    // Negative control: with a gate above the water the column collapses in the preparation, and is refused.
    let free = load(DAM, &["gate.0.bottom=13 mm"]);
    let error = start(&free, &scratch.join("free"), On::threads(1)).expect_err("the water is not at rest");
    assert!(error.to_string().contains("did not come to rest"), "{error}");
}

#[test]
fn a_run_goes_on_with_its_gate_half_open_where_a_grain_is_released() {
    let scratch = Scratch::new("gate-release");
    let text = with_grain("8 mm", "release = \"3 ms\"\n");
    let folder = scratch.join("parts");
    let whole = ran(&text, &[], &scratch.join("whole"), On::threads(1));
    let time = ran(&text, &[], &folder, On::threads(1).steps(15)).last("time");
    assert!((time / 3e-3 - 1.0).abs() < 1e-9, "it breaks off at {time}");
    go_on(&folder, On::threads(1)).0.expect("the run goes on");
    let parts = Left::in_folder(&folder);
    assert_eq!((whole.hash(), &whole.series), (parts.hash(), &parts.series));
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
        let message = refusal(DAM, change);
        assert!(words.iter().all(|word| message.contains(word)), "{change:?}: {message}");
    }
    let with = |more: &str| DAM.replace("[[liquid]]", &format!("{more}\n[[liquid]]"));
    for (gate, words) in [
        ("[[gate]]\nname = \"b\"\nx1 = \"14 mm\"", "`lock` and `b` are too near to each other"),
        ("[[gate]]\nx2 = \"3 mm\"", "meet"),
        ("[[gate]]\nname = \"lock\"\nx1 = \"17 mm\"", "two gates are called `lock`"),
    ] {
        let message = refusal(&with(gate), &[]);
        assert!(message.contains(words), "{gate}: {message}");
    }
    load(&with("[[gate]]\nx1 = \"17 mm\""), &[]);
}

#[test]
fn grains_in_a_gate_are_refused() {
    let scratch = Scratch::new("gate-grain");
    let case = load(&with_grain("10.4 mm", ""), &[]);
    let error = start(&case, &scratch.join("in"), On::threads(1)).expect_err("the grain is in the gate");
    assert!(error.to_string().contains("stands in the gate `lock`"), "{error}");
    // `check` knows the places of grains that the case puts, one by one or on a lattice.
    let foretold = |text: &str| before_run(&load(text, &[]), &Machine::this());
    let place = "placement.list = [{ position = [\"10.4 mm\", \"3 mm\", \"2 mm\"] }]";
    let lattice = "placement.lattice = { lower = [\"6 mm\", \"1 mm\", \"1 mm\"], upper = [\"14 mm\", \"7 mm\", \"7 mm\"], counts = [5, 3, 3] }";
    let listed = with_grain("10.4 mm", "");
    for text in [&listed, &listed.replace(place, lattice)] {
        let (runs, found) = foretold(text);
        assert!(!runs && found.iter().any(|title| title.contains("stands in the gate")), "{text}: {found:?}");
    }
    assert!(foretold(&with_grain("10.6 mm", "")).0);
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
        let left = ran(text, overrides, &scratch.join(name), On::threads(1));
        left.column("largest_fluid_speed").into_iter().skip(1).fold(0.0, Real::max)
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
