//! Beds of like and unlike sizes, packed as case files ask for it: they come to rest in the work that `check` foretells.

use sazanami::bed_file::Bed;
use sazanami::case::LoadedCase;
use sazanami::check::{self, CostModel, Known};
use sazanami::feasible;
use sazanami::machine::{Machine, MemoryLimit};
use sazanami::run;
use sazanami::stop::Stop;
use sazanami_numerics::Real;

use crate::support::{Listener, On, Scratch, load};

/// Balls of 0.5 mm in a box of 8 mm, with these keys of the population in addition.
fn case_text(keys: &str) -> String {
    format!(
        r#"
solver = "mics"
gravity = "9.8 m/s^2"
[domain]
size = ["8 mm", "8 mm", "30 mm"]
cells = [8, 8, 24]
[material.glass]
density = "2500 kg/m^3"
[contact.default]
normal_stiffness = "500 N/m"
restitution = 0.4
friction = 0.4
[[grains]]
name = "fine"
shape.sphere = {{ diameter = "0.5 mm" }}
material = "glass"
placement.packed = {{}}
{keys}
[run]
packing_only = true
"#
    )
}

const PAIR: &str = r#"count = 600
[[grains]]
name = "boulder"
shape.sphere = { diameter = "5 mm" }
count = 1
material = "glass"
placement.packed = {}"#;

/// Sub-steps of packing that `check` foretells.
fn foretold(loaded: &LoadedCase, grains: usize) -> Real {
    // A second for each sub-step.
    let model = CostModel { substep_grain: 1.0 / grains as Real, substep_sphere: 0.0, ..CostModel::default() };
    let report = check::check(&loaded.case, Known::default(), &Machine::this(), 1, &model);
    let packing = report.predicted_s.iter().find(|(part, _)| *part == "packing");
    packing.expect("the case packs").1
}

/// Sub-steps of a packing, and the number of its grains.
fn packed(loaded: &LoadedCase, name: &str) -> (usize, usize) {
    let folder = Scratch::new(name);
    let (stop, mut listener) = (Stop::new(), Listener::default());
    let options = On::threads(2).options(Some(&folder.join("run")));
    run::run(loaded, &options, &mut listener, &stop).unwrap_or_else(|error| panic!("{name}: {error}"));
    let substeps = listener.lines.iter().filter(|line| line.phase == "packing").map(|line| line.substeps).sum();
    let bed = Bed::read(&folder.join("run/packed.bed")).expect("the bed is written");
    (substeps, bed.grains.len())
}

#[test]
fn beds_of_unlike_sizes_come_to_rest_in_the_work_foretold() {
    let like = load(&case_text("count = 600"), &[]);
    let (of_like, _) = packed(&like, "like");
    let cases = [
        ("like", "count = 600", 600),
        ("pair", PAIR, 601),
        ("lognormal", "count = 600\nsize.lognormal = { sigma = 0.5, lower = 0.35, upper = 3.0 }", 600),
        ("wide", "count = 600\nsize.lognormal = { sigma = 1.0, lower = 0.3, upper = 3.0 }", 600),
    ];
    for (name, keys, grains) in cases {
        let loaded = load(&case_text(keys), &[]);
        let (substeps, bed) = packed(&loaded, name);
        assert_eq!(bed, grains);
        let ratio = foretold(&loaded, grains) / substeps as Real;
        assert!((0.5..=2.0).contains(&ratio), "{name}: foretold {ratio} of {substeps} sub-steps");
        let times = substeps as Real / of_like as Real;
        assert!(times <= 5.0, "{name}: {times} times the sub-steps of the bed of like sizes");
    }
}

#[test]
fn sizes_of_which_the_coarse_press_the_fine_flat_are_refused() {
    let machine = Machine { memory_available: Some(8 << 30), memory_limit: MemoryLimit::Machine, ..Machine::this() };
    let refused = |text: &str| match feasible::check(&load(text, &[]), &machine, &CostModel::default()) {
        Ok(_) => false,
        Err(error) => {
            let records = error.diagnostics.records(&error.source);
            assert!(records.iter().all(|record| record.message.contains("press the fine ones flat")), "{records:?}");
            true
        }
    };
    let wide = case_text("count = 600\nsize.lognormal = { sigma = 1.0, upper = 8.0 }");
    assert!(refused(&wide.replace("500 N/m", "20 N/m")));
    assert!(!refused(&wide), "negative control: stiffer springs bear it");
    assert!(!refused(&case_text(PAIR)) && !refused(&case_text("count = 600").replace("500 N/m", "20 N/m")));
}
