//! Beds of like and unlike sizes, packed as case files ask for it: they come to rest in the work that `check` foretells.

use std::path::Path;

use sazanami::bed_file::Bed;
use sazanami::case::LoadedCase;
use sazanami::check::{self, CostModel, Known};
use sazanami::feasible;
use sazanami::machine::{Machine, MemoryLimit};
use sazanami_numerics::Real;

use crate::support::{Left, On, Scratch, before_run, findings, go_on, heard, interrupted, load, ran};

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

/// A levelled bed of beads in a box that is open on one side.
const OPEN: &str = include_str!("../cases/packing-open.toml");

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
    let listener = heard(loaded, &On::threads(2).options(Some(&folder.join("run"))));
    let substeps = listener.lines.iter().filter(|line| line.phase == "packing").map(|line| line.substeps).sum();
    let bed = Bed::read(&folder.join("run/packed.bed")).expect("the bed is written");
    // Overlaps on the soft springs of the packing are not those of the run.
    let [overlap, while_packed] = ["overlap_relative", "packing_overlap_relative"]
        .map(|key| Left::in_folder(&folder.join("run")).summary["worst"][key].as_f64().expect("a number"));
    assert!(overlap == 0.0 && while_packed > 1e-3, "{name}: {overlap}, {while_packed}");
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
fn a_bed_that_cannot_be_written_is_reported_before_it_is_packed() {
    let folder = Scratch::new("unwritable-bed");
    let refused = |path: &Path| {
        let loaded = load(&case_text("count = 3"), &[&format!("output.bed={}", path.display())]);
        let found = feasible::check(&loaded, &Machine::this(), &CostModel::default());
        found.err().map(|error| error.to_string()).unwrap_or_default()
    };
    assert_eq!(refused(&folder.join("made.bed")), "");
    assert!(refused(&folder.join("no such folder/made.bed")).contains("the bed cannot be written to"));
    assert!(refused(folder.path()).contains("add the name of a file"));
    let notes = folder.join("notes.txt");
    std::fs::write(&notes, "important").unwrap();
    assert!(refused(&notes).contains("there is something that is no bed"));
    assert_eq!(std::fs::read_to_string(&notes).unwrap(), "important");
    std::fs::remove_file(&notes).unwrap();
    assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 0, "the trial leaves nothing");
}

#[test]
fn sizes_of_which_the_coarse_press_the_fine_flat_are_refused() {
    let machine = Machine { memory_available: Some(8 << 30), memory_limit: MemoryLimit::Machine, ..Machine::this() };
    let refused = |text: &str| {
        let (runs, found) = before_run(&load(text, &[]), &machine);
        assert!(runs || found.iter().all(|title| title.contains("press the fine ones flat")), "{found:?}");
        !runs
    };
    let wide = case_text("count = 600\nsize.lognormal = { sigma = 1.0, upper = 8.0 }");
    assert!(refused(&wide.replace("500 N/m", "20 N/m")));
    assert!(!refused(&wide), "negative control: stiffer springs bear it");
    assert!(!refused(&case_text(PAIR)) && !refused(&case_text("count = 600").replace("500 N/m", "20 N/m")));
}

#[test]
fn a_levelled_bed_on_a_grid_is_flat_and_comes_to_rest_again() {
    const BED: &str = "solver = \"mics\"\ngravity = \"9.8 m/s^2\"\n[domain]\nsize = [\"5 mm\", \"5 mm\", \"6 mm\"]\ncells = [10, 10, 12]\n\
                       [material.sand]\ndensity = \"2650 kg/m^3\"\n[contact.default]\nnormal_stiffness = \"1e3 N/m\"\nrestitution = 0.4\n\
                       friction = 0.6\n[[grains]]\nname = \"sand\"\ncount = 300\nshape.spheroid = { diameter = \"0.52 mm\", length = \"1.27 mm\" }\n\
                       contact_spheres = \"axis(9)\"\nmaterial = \"sand\"\nplacement.packed = { lattice = \"low\" }\n\
                       [output]\nfigures = { at = [] }\nfields = { at = [] }\n[run]\nuntil = \"0.1 ms\"\n";
    const LEVEL: &str = "grains.0.placement.packed.level=\"2.4 mm\"";
    let scratch = Scratch::new("levelled");
    // Grains of the bed, the highest place of a contact sphere [mm] and the mean speed [m/s] as the run begins.
    let begun = |name: &str, changes: &[&str], on: On| {
        let left = ran(BED, changes, &scratch.join(name), on);
        // The bed is at rest as the flow begins: its weight presses the contacts less deep than soft springs let them be.
        let [overlap, while_packed] = ["overlap_relative", "packing_overlap_relative"]
            .map(|key| left.summary["worst"][key].as_f64().expect("a number"));
        assert!(overlap > 0.0 && while_packed > 3.0 * overlap, "{name}: {overlap}, {while_packed}");
        let bed = &left.summary["observables"]["bed"];
        let [height, speed] = ["height_mm", "mean_speed"].map(|name| bed[name].as_f64().expect("a number"));
        (left.summary["counts"]["grains"].as_u64().expect("a number"), height, speed)
    };
    let (grains, height, speed) = begun("level", &[LEVEL], On::threads(2));
    assert!((150..300).contains(&grains) && height < 2.45 && speed < 2e-3, "{grains} {height} {speed}");
    assert_eq!(begun("ranks", &[LEVEL], On::ranks(2, 1)).0, grains);
    // With a wave of its level it reaches higher.
    let wave = "grains.0.placement.packed.ripples={ wavelength = \"5 mm\", height = \"0.8 mm\" }";
    let (_, crest, _) = begun("wave", &[LEVEL, wave], On::threads(2));
    assert!(crest > height + 0.15, "{crest} {height}");
    // Negative control: as it was poured.
    let (all, poured, _) = begun("poured", &[], On::threads(2));
    assert!(all == 300 && poured > 2.6, "{all} {poured}");
    // What cannot be, and what does nothing, is told.
    let refused = findings(BED, &["grains.0.placement.packed.level=\"0.5 mm\""]);
    assert!(refused.len() == 1 && refused[0].contains("no grain lies below the level"), "{refused:#?}");
    let said = |number: &str| {
        let level = format!("grains.0.placement.packed.level=\"{number}\"");
        let folder = scratch.join(&format!("packed-{number}"));
        let options = On::threads(2).options(Some(&folder));
        heard(&load(BED, &[&level, "run.packing_only=true"]), &options).messages
    };
    let counts = |folder: &str| {
        let counts = Left::in_folder(&scratch.join(folder)).summary["counts"].clone();
        ["contacts", "contact_pairs"].map(|name| counts[name].as_u64().unwrap_or_default())
    };
    let tells = |messages: &[String], words: &str| messages.iter().any(|message| message.contains(words));
    let taken = said("2.4 mm");
    assert!(tells(&taken, "of 300 grains are taken away") && !tells(&taken, "takes nothing away"), "{taken:?}");
    assert!(tells(&said("5.5 mm"), "takes nothing away"));
    // Grains of a bed touch each other, which its summary says.
    assert!(
        counts("packed-5.5 mm").iter().all(|contacts| (300..3000).contains(contacts)),
        "{:?}",
        counts("packed-5.5 mm")
    );
    // Grains that still fall are with the rank in whose part they lie: none is lost between ranks.
    let falling = scratch.join("falling");
    let changes = [LEVEL, "grains.0.placement.packed.stop=time_only"];
    let said = heard(&load(BED, &changes), &On::ranks(4, 1).options(Some(&falling))).messages;
    let taken = said.iter().find_map(|message| message.strip_prefix("levelled: ")).expect("it is told");
    let taken: u64 = taken.split(' ').next().and_then(|number| number.parse().ok()).expect("a number");
    assert_eq!(Left::in_folder(&falling).summary["counts"]["grains"].as_u64(), Some(300 - taken));
    // Broken off while it comes to rest, it goes on to the same bits.
    let parts = scratch.join("parts");
    let options = On::threads(1).options(Some(&parts));
    interrupted(&load(BED, &[LEVEL]), &options, |line| line.phase == "relax" && line.step >= 20);
    go_on(&parts, On::threads(1)).0.expect("the run goes on");
    assert_eq!(Left::in_folder(&parts).hash(), Left::in_folder(&scratch.join("level")).hash());
}

#[test]
fn a_levelled_bed_comes_to_rest_behind_an_open_side_and_flows_out_in_the_run() {
    let scratch = Scratch::new("packing-open");
    let height = |left: &Left| left.summary["observables"]["bed"]["height_mm"].as_f64().expect("a bed");
    let departed = |left: &Left| left.column("departed_grains");
    let open = ran(OPEN, &[], &scratch.join("open"), On::threads(1));
    assert!((2.0..=4.0).contains(&height(&open)), "{}", height(&open));
    let gone = departed(&open);
    assert!(gone[0] == 0.0 && gone[gone.len() - 1] > 1.0, "{gone:?}");
    // Stopped while it comes to rest, and taken up again.
    let (folder, on) = (scratch.join("again"), On::threads(1));
    let ended =
        interrupted(&load(OPEN, &[]), &on.options(Some(&folder)), |line| line.phase == "relax" && line.step >= 100);
    assert_eq!(ended.steps, 0);
    go_on(&folder, on).0.unwrap_or_else(|error| panic!("{error}"));
    let again = Left::in_folder(&folder);
    assert_eq!((again.hash(), departed(&again)), (open.hash(), gone));
    // So does a bed from a file.
    let file = scratch.join("open").join("packed.bed");
    let read = format!(
        "grains.0={{ name = \"beads\", shape = {{ sphere = {{ diameter = \"2 mm\" }} }}, placement = {{ bed = {{ file = \"{}\", relax = true }} }} }}",
        file.display()
    );
    let relaxed = ran(OPEN, &[&read], &scratch.join("relaxed"), On::threads(1));
    let gone = departed(&relaxed);
    assert!((2.0..=4.0).contains(&height(&relaxed)), "{}", height(&relaxed));
    assert!(gone[0] == 0.0 && gone[gone.len() - 1] > 1.0, "{gone:?}");
    // Negative control: none leaves a closed box, whose bed comes to rest as high.
    let closed = ran(OPEN, &["boundary.x1_upper=no_slip"], &scratch.join("closed"), On::threads(1));
    assert_eq!((height(&closed), departed(&closed).last()), (height(&open), Some(&0.0)));
}

#[test]
fn a_bed_comes_to_rest_without_the_films_and_bridges_of_the_run() {
    let scratch = Scratch::new("packing-dry");
    let liquid = "liquid=[{ region.box = { lower = [\"0 mm\", \"0 mm\", \"18 mm\"], upper = [\"12 mm\", \"12 mm\", \"20 mm\"] } }]";
    let short = [liquid, "fluid.dt_max=0.1 ms", "run.until=0.1 ms"];
    let keys = |more: &[&'static str]| [&short[..], more].concat();
    let bed = |name: &str, more: &[&'static str]| {
        let left = ran(OPEN, &keys(more), &scratch.join(name), On::threads(1));
        let bed = &left.summary["observables"]["bed"];
        (["height_mm", "porosity"].map(|key| bed[key].as_f64().expect("a number")), left.hash().to_owned())
    };
    let dry = "dem.bridges={ surface_tension = \"72.8 mN/m\", damp = false }";
    // Behind an open side, where the run begins from contacts without memory, and in a closed box.
    for (name, sides) in [("open", "boundary.x1_upper=outflow"), ("closed", "boundary.x1_upper=no_slip")] {
        let (plain, _) = bed(&format!("{name}-plain"), &[sides, "dem.film_roughness=none"]);
        let (wet, hash) = bed(&format!("{name}-wet"), &[sides, dry]);
        assert_eq!(plain, wet, "{name}");
        // Broken off while it comes to rest, it goes on to the same bits.
        let parts = scratch.join(&format!("{name}-parts"));
        let options = On::threads(1).options(Some(&parts));
        interrupted(&load(OPEN, &keys(&[sides, dry])), &options, |line| line.phase == "relax" && line.step >= 20);
        go_on(&parts, On::threads(1)).0.expect("the run goes on");
        assert_eq!(Left::in_folder(&parts).hash(), hash, "{name}");
        // Negative control: bridges of damp grains hold them apart.
        let (damp, _) =
            bed(&format!("{name}-damp"), &[sides, "dem.bridges={ surface_tension = \"72.8 mN/m\", damp = true }"]);
        assert_ne!(damp, wet, "{name}");
    }
}

/// A bed of 1,400 beads in waves, which slide as it comes to rest behind an open side: one crosses the seam of two ranks by less than its skin.
const RIPPLED: &str = include_str!("../cases/packing-rippled.toml");

#[test]
fn no_grain_of_a_bed_that_is_taken_up_anew_is_lost_between_ranks() {
    let scratch = Scratch::new("packing-ranks");
    let grains = |ranks: usize| {
        let left = ran(RIPPLED, &[], &scratch.join(&ranks.to_string()), On::ranks(ranks, 1));
        left.summary["counts"]["grains"].as_u64().expect("a number")
    };
    let alone = grains(1);
    assert!(alone > 1000 && grains(2) == alone, "{alone}");
}

/// A column between sides without friction.
const COLUMN: &str = include_str!("../cases/packing-column.toml");
/// A ball that spins on such a side.
const SPINNING: &str = include_str!("../cases/frictionless-ball.toml");

#[test]
fn sides_without_friction_bear_no_weight_from_the_packing_on_and_brake_no_spin() {
    let scratch = Scratch::new("frictionless");
    let share = |name: &str, set: &[&str]| {
        let left = ran(COLUMN, set, &scratch.join(name), On::threads(1));
        let speeds = left.column("largest_grain_speed");
        speeds.iter().skip(1).copied().fold(0.0, Real::max) / speeds[0]
    };
    // A bed that is settled stays so; on springs that the run takes away it would begin to fall, at three times the speed.
    assert!(share("column", &[]) < 2.0, "{}", share("column", &[]));
    let spin =
        |name: &str, set: &[&str]| ran(SPINNING, set, &scratch.join(name), On::threads(1)).probe("ball").last("spin_2");
    assert!((spin("free", &[]) - 100.0).abs() < 1e-9);
    // Negative control: sides as the grains.
    assert!(spin("braked", &["dem.wall=as_grains"]) < 50.0);
}
