//! Feasibility of a case that can be read, before it is run: beds, memory, counts beyond reason.

use sazanami_io::bed::{Bed, BedGrain, Recipe};
use sazanami_numerics::{Quaternion, Vector};
use sazanami_posing::check::{self, CostModel};
use sazanami_posing::feasible::{self, Feasible};
use sazanami_posing::machine::{Machine, MemoryLimit};

use super::*;

/// A machine with so much free memory \[bytes].
fn machine(memory: u64) -> Machine {
    Machine { cpu: "any".into(), cores: 2, memory_available: Some(memory), memory_limit: MemoryLimit::Machine }
}

/// Messages on a case that can be read, errors first; the findings if it can run.
fn feasibility(text: &str, overrides: &[&str], memory: u64) -> (Vec<String>, Option<Feasible>) {
    let loaded = read(text, overrides).unwrap_or_else(|error| panic!("{error}"));
    let reported = |d: &case::Diagnostics| {
        let of = |r: &case::DiagnosticRecord| {
            let place = r.line.unwrap_or(0);
            format!("{place} {} | {}", r.message, r.suggestion.clone().or(r.expected.clone()).unwrap_or_default())
        };
        d.records(&loaded.source).iter().map(of).collect()
    };
    match feasible::check(&loaded, &machine(memory), &CostModel::default()) {
        Ok(feasible) => (reported(&feasible.warnings), Some(feasible)),
        Err(error) => (reported(&error.diagnostics), None),
    }
}

const ENOUGH: u64 = 8 << 30;

#[test]
fn grains_too_light_to_act_by_their_surfaces_are_refused() {
    let cork = |density: u32| {
        format!(
            "{SMALL}[material.cork]\ndensity = \"{density} kg/m^3\"\n[[grains]]\nshape.sphere = {{ diameter = \"0.5 mm\" }}\nplacement.list = [{{ position = [\"0.5 mm\", \"0.5 mm\", \"1 mm\"] }}]\n[[liquid]]\nregion.half_space.point = [\"0 mm\", \"0 mm\", \"0.2 mm\"]\n"
        )
    };
    let [fine, coarse] = ["domain.cells=[10, 10, 20]", "domain.cells=[3, 3, 6]"];
    let refused = |density: u32, overrides: &[&str]| {
        let (found, feasible) = feasibility(&cork(density), overrides, ENOUGH);
        let told = found.iter().any(|f| f.contains("is too light"));
        assert!(feasible.is_none() && told, "{density} {overrides:?}: {found:#?}");
    };
    // One and a half cells wide, then two, then five.
    refused(250, &[fine]);
    refused(250, &[]);
    refused(250, &[coarse]);
    for (density, overrides) in [
        (350, &[coarse][..]),
        (1000, &[][..]),
        (350, &[fine][..]),
        (250, &[fine, "grains.0.motion=fixed"][..]),
        (250, &["coupling.exchange=stress"][..]),
        // There is nothing that is too heavy.
        (250, &["liquid=[]"][..]),
    ] {
        let (found, feasible) = feasibility(&cork(density), overrides, ENOUGH);
        assert!(feasible.is_some(), "{density} {overrides:?}: {found:#?}");
    }
}

/// Three spheres of 1 mm side by side on the floor of a box of 6 mm, two of the shape `a` and one of `b`.
fn made_bed(name: &str) -> PathBuf {
    let lying = |n: u32, shape: u32| BedGrain {
        shape,
        scale: 1.0,
        position: Vector::new(1e-3 + 2e-3 * f64::from(n), 3e-3, 0.5e-3),
        orientation: Quaternion::IDENTITY,
        held: false,
    };
    let bed = Bed {
        lower: Vector::ZERO,
        upper: Vector::splat(6e-3),
        recipe: Recipe { shapes: vec!["a".into(), "b".into()], ..Recipe::default() },
        grains: vec![lying(0, 0), lying(1, 1), lying(2, 0)],
    };
    let path = Path::new(env!("CARGO_TARGET_TMPDIR")).join(format!("{name}-{}.bed", std::process::id()));
    bed.write(&path).unwrap_or_else(|error| panic!("{error}"));
    path
}

/// A case on that bed; lines 1 to 13, then each population on four lines of its own.
fn on_bed(bed: &Path, populations: &[&str]) -> String {
    let mut text = "[domain]\nsize = [\"6 mm\", \"6 mm\", \"6 mm\"]\ncells = [6, 6, 6]\n[run]\nuntil = \"1 ms\"\n\
                    [bed]\nheight_radius = \"1 mm\"\n[material.sand]\ndensity = \"2650 kg/m^3\"\n[[liquid]]\n\
                    name = \"drop\"\nregion.sphere = { diameter = \"1 mm\" }\nabove_bed = \"2 mm\"\n"
        .to_owned();
    for name in populations {
        text += &format!(
            "[[grains]]\nname = \"{name}\"\nshape.sphere = {{ diameter = \"1 mm\" }}\nplacement.bed = {{ file = \"{}\" }}\n",
            bed.display()
        );
    }
    text
}

#[test]
fn each_population_takes_its_shape_of_a_bed() {
    let path = made_bed("shapes");
    let counts = |names: &[&str]| {
        let (found, feasible) = feasibility(&on_bed(&path, names), &[], ENOUGH);
        let beds = feasible.unwrap_or_else(|| panic!("{found:#?}")).beds;
        beds.iter().map(|bed| bed.as_ref().map_or(0, |bed| bed.grains.len())).collect::<Vec<_>>()
    };
    assert_eq!(counts(&["a", "b"]), [2, 1]);
    assert_eq!(counts(&["b", "a"]), [1, 2]);
    assert_eq!(counts(&["fine", "coarse"]), [2, 1]);
    let refused = |names: &[&str], overrides: &[&str], expected: &str| {
        let (found, feasible) = feasibility(&on_bed(&path, names), overrides, ENOUGH);
        assert!(feasible.is_none() && found.iter().any(|f| f.contains(expected)), "{expected}: {found:#?}");
    };
    refused(&["a"], &[], "17 no population takes the shape `b` of the bed");
    refused(&["sand"], &[], "17 the bed has no shape `sand`");
    refused(&["a", "c"], &[], "the bed has no shape `c`");
    refused(&["a", "b"], &["grains.0.count=3"], "`count` says 3, the bed holds 2 grains of `a`");
    assert!(feasibility(&on_bed(&path, &["a", "b"]), &["grains.0.count=2"], ENOUGH).1.is_some());
    std::fs::remove_file(path).unwrap();
}

#[test]
fn bodies_that_close_the_way_of_the_fluid_are_refused() {
    let block = |size: &str, motion: &str, velocity: &str, more: &str| {
        format!(
            "{SMALL}[[liquid]]\nallow_touching_grains = true\nregion.box = {{ lower = [\"0 m\", \"0 m\", \"0 m\"], upper = [\"1 mm\", \"1 mm\", \"2 mm\"] }}\n\
             {more}\n[material.steel]\ndensity = \"7800 kg/m^3\"\n[[grains]]\nname = \"block\"\nshape.box.size = [\"{size} mm\", \"1 mm\", \"0.5 mm\"]\n\
             placement.list = [{{ position = [\"0.5 mm\", \"0.5 mm\", \"1 mm\"], motion = \"{motion}\", velocity = [\"0 m/s\", \"0 m/s\", \"{velocity} m/s\"] }}]\n"
        )
    };
    let walls = "boundary={ all = \"no_slip\" }";
    let along = "boundary={ all = \"no_slip\", x3 = \"periodic\" }";
    let held = "[drive]\nmean_velocity = [\"0 m/s\", \"0 m/s\", \"0.1 m/s\"]";
    let through = "boundary={ all = \"no_slip\", x3_lower = { inflow = { velocity = [\"0 m/s\", \"0 m/s\", \"0.1 m/s\"] } }, x3_upper = \"outflow\" }";
    let open = "boundary={ all = \"no_slip\", x1_upper = \"outflow\" }";
    let longer = "domain={ size = [\"1 mm\", \"1 mm\", \"3 mm\"], cells = [4, 4, 12] }";
    let refused = |text: &str, sides: &str, expected: &str| {
        let (found, feasible) = feasibility(text, &[sides, "gravity=0 m/s^2", longer], ENOUGH);
        assert!(feasible.is_none() && found.iter().any(|f| f.contains(expected)), "{expected}: {found:#?}");
    };
    for (size, motion, velocity, more, sides) in [
        ("1", "prescribed", "0.02", "", walls),
        ("0.8", "prescribed", "0.02", "", walls),
        ("1", "fixed", "0", held, along),
        ("1", "fixed", "0", "", through),
        ("1", "prescribed", "0.05", "", through),
    ] {
        refused(&block(size, motion, velocity, more), sides, "grain 0 of `block` fills the section normal to x3");
    }
    for (size, motion, velocity, more, sides) in [
        // A gap of a cell beside it, at rest, what goes round with a periodic duct or through with the stream, and an open top.
        ("0.7", "prescribed", "0.02", "", walls),
        ("1", "fixed", "0", "", walls),
        ("1", "prescribed", "0.02", "", along),
        ("1", "prescribed", "0.1", held, along),
        ("1", "prescribed", "0.1", "", through),
        ("0.7", "fixed", "0", held, along),
        ("1", "prescribed", "0.02", "", open),
    ] {
        let text = block(size, motion, velocity, more);
        let (found, feasible) = feasibility(&text, &[sides, "gravity=0 m/s^2", longer], ENOUGH);
        assert!(feasible.is_some(), "{sides}: {found:#?}\n{text}");
    }
}

#[test]
fn beds_are_looked_at_before_the_run() {
    let path = made_bed("places");
    let text = on_bed(&path, &["a", "b"]);
    let (found, feasible) = feasibility(&text, &[], ENOUGH);
    assert!(feasible.is_some() && found.is_empty(), "{found:#?}");
    let refused = |overrides: &[&str], expected: &str| {
        let (found, feasible) = feasibility(&text, overrides, ENOUGH);
        assert!(feasible.is_none() && found.iter().any(|f| f.contains(expected)), "{expected}: {found:#?}");
    };
    refused(&["domain.size=[\"5 mm\", \"6 mm\", \"6 mm\"]"], "grain 1 of `a` sticks out of the box");
    refused(&["domain.size=[\"6 mm\", \"6 mm\", \"0.9 mm\"]"], "of the bed of `a` stick out of the box");
    refused(
        &["grains.0.placement.bed.scale=2", "grains.1.placement.bed.scale=2"],
        "the bed was packed in a box of 12 mm x",
    );
    refused(&["grains.0.placement.bed.scale=0.25", "grains.1.placement.bed.scale=0.25"], "overlaps grain");
    // The highest grain near the axis ends 1 mm above the floor.
    refused(&["liquid.0.above_bed=4.6 mm"], "`drop` does not fit above the bed | lower it by 0.1");
    assert!(feasibility(&text, &["liquid.0.above_bed=4.45 mm"], ENOUGH).1.is_some());
    // A grain beside the axis counts for what the drop touches, not for the height of the bed.
    let wide = ["liquid.0.region.sphere.diameter=3 mm"];
    let pillar = |place: &str| {
        let grain = "[[grains]]\nname = \"pillar\"\nshape.sphere = { diameter = \"1 mm\" }\n";
        format!("{text}{grain}placement.list = [{{ position = [\"{place} mm\", \"3 mm\", \"3 mm\"] }}]\n")
    };
    let (found, feasible) = feasibility(&pillar("4.9"), &wide, ENOUGH);
    assert!(feasible.is_none() && found[0].contains("`drop` touches grains"), "{found:#?}");
    let (found, feasible) = feasibility(&pillar("5.3"), &wide, ENOUGH);
    assert!(feasible.is_some(), "{found:#?}");
    std::fs::write(&path, b"not a bed").unwrap();
    refused(&[], "is no bed file");
    std::fs::remove_file(path).unwrap();
}

/// A few grains to be packed.
const PACKED: &str = "[material.sand]\ndensity = \"2650 kg/m^3\"\n[[grains]]\ncount = 3\n\
                      shape.spheroid = { diameter = \"0.1 mm\", length = \"0.2 mm\" }\nplacement.packed = {}\n";

#[test]
fn grains_in_the_way_of_a_bed_that_is_packed_are_told_before_it_is() {
    let bed = made_bed("beside");
    let stone = "[[grains]]\nname = \"stone\"\nshape.sphere = { diameter = \"0.3 mm\" }\n";
    let with = |placement: &str| feasibility(&format!("{SMALL}{PACKED}{stone}{placement}\n"), &[], ENOUGH);
    let at =
        |height: &str| with(&format!("placement.list = [{{ position = [\"0.5 mm\", \"0.5 mm\", \"{height} mm\"] }}]"));
    let (found, feasible) = at("0.2");
    assert!(feasible.is_none() && found.len() == 1, "{found:#?}");
    assert!(
        found[0].contains("grain 0 of `stone` lies where other grains are packed | pack the bed first"),
        "{found:#?}"
    );
    let lattice = "placement.lattice = { upper = [\"1 mm\", \"1 mm\", \"1 mm\"], counts = [2, 2, 2] }";
    let (found, feasible) = with(lattice);
    assert!(feasible.is_none() && found[0].contains("lies where other grains are packed"), "{found:#?}");
    // Negative controls: above the bed, and without a bed that is packed.
    let (found, feasible) = at("0.7");
    assert!(feasible.is_some(), "{found:#?}");
    let alone = format!("{SMALL}[material.sand]\ndensity = \"2650 kg/m^3\"\n{stone}{lattice}\n");
    let (found, feasible) = feasibility(&alone, &[], ENOUGH);
    assert!(feasible.is_some(), "{found:#?}");
    // A bed that should come to rest first.
    let wide = on_bed(&bed, &["a", "b"]) + &PACKED.replace("[material.sand]\ndensity = \"2650 kg/m^3\"\n", "");
    let (found, feasible) = feasibility(&wide, &["grains.1.placement.bed.relax=true"], ENOUGH);
    assert!(feasible.is_none(), "{found:#?}");
    let reported =
        found.iter().filter(|text| text.contains("`b` cannot come to rest beside grains that are packed")).count();
    assert_eq!(reported, 1, "{found:#?}");
    std::fs::remove_file(bed).unwrap();
}

#[test]
fn what_no_bed_can_be_high_enough_for_is_told_before_one_is_packed() {
    let found = |height: &str, level: &str| {
        let packed = PACKED.replace("packed = {}", &format!("packed = {{ level = \"{level} mm\" }}"));
        let drop = format!("[[liquid]]\nregion.sphere.diameter = \"0.4 mm\"\nabove_bed = \"{height} mm\"\n");
        feasibility(&format!("{SMALL}{packed}{drop}"), &[], ENOUGH)
    };
    // The box is 2 mm high.
    let (refused, feasible) = found("1.9", "0.5");
    let told = ["does not fit above the bed | lower it by 0.1", " and the height of the bed"];
    assert!(feasible.is_none() && told.iter().all(|words| refused[0].contains(words)), "{refused:#?}");
    let (warned, feasible) = found("1.5", "5");
    let told = warned.iter().any(|text| text.contains("the level of this bed lies above the box"));
    assert!(feasible.is_some() && told, "{warned:#?}");
    // Negative control.
    let (none, feasible) = found("1.5", "0.5");
    assert!(feasible.is_some() && none.is_empty(), "{none:#?}");
}

#[test]
fn memory_is_refused_with_what_would_fit() {
    let text = format!("{SMALL}{PACKED}");
    let gibibyte = 1 << 30;
    let refused = |change: &str, expected: &str| {
        let (found, feasible) = feasibility(&text, &[change], gibibyte);
        assert!(feasible.is_none() && found.len() == 1 && found[0].contains(expected), "{expected}: {found:#?}");
        found[0].clone()
    };
    let box_ = refused("domain.cells=[4000, 4000, 8000]", "this box is too large for the memory of this machine");
    let fits = box_.split(" | ").last().unwrap().trim_end_matches(" fits").to_owned();
    let grains = refused("grains.0.count=1000000000", "`grains 0` is too large for the memory of this machine");
    let count = grains.split(" | ").last().unwrap().split(' ').next().unwrap().to_owned();
    // What is suggested does fit, and is not much less than what could.
    for (key, value) in [("domain.cells", fits), ("grains.0.count", count)] {
        let loaded = read(&text, &[&format!("{key}={value}")]).unwrap();
        let needed = check::memory(&loaded.case, &CostModel::default());
        assert!((0.8..=1.0).contains(&(needed / f64::from(gibibyte as u32))), "{key}={value}: {needed}");
    }
}

#[test]
fn what_takes_the_memory_is_named() {
    let text = format!("{SMALL}{PACKED}");
    let refused = |changes: &[&str], available: u64| {
        let (found, feasible) = feasibility(&text, changes, available);
        assert!(feasible.is_none() && found.len() == 1, "{found:#?}");
        found[0].clone()
    };
    let pictures = "output.figures={ at = [\"0 s\"] }";
    let line = "probe=[{ name = \"l\", line = { from = [\"0.2 mm\", \"0.5 mm\", \"1 mm\"], to = [\"0.8 mm\", \"0.5 mm\", \"1 mm\"], points = 10000 }, steps = 1 }]";
    let none = "output.figures={ at = [] }";
    let found = refused(&[pictures, "grains.0.count=1"], 60 << 20);
    assert!(found.contains("`output.figures` is too large") && !found.contains("erosion"), "{found}");
    let found = refused(&[line, none, "grains.0.count=1"], 8 << 20);
    assert!(found.contains("`probe` is too large") && !found.contains("figures"), "{found}");
    // Beside a box that is too large by itself it is what leaves no room for a smaller one.
    let large = "domain.cells=[2000, 2000, 2000]";
    let found = refused(&[pictures, "grains.0.count=1", large], 60 << 20);
    assert!(found.contains("`output.figures` needs") && !found.contains("the grains need"), "{found}");
    // Negative control: grains that do so are named.
    let found = refused(&[none, "grains.0.count=100000", large], 10 << 20);
    assert!(found.contains("the grains need"), "{found}");
}

#[test]
fn memory_of_surfaces_is_counted() {
    let text = format!("{SMALL}{PACKED}");
    let memory = |changes: &[&str]| {
        let loaded = read(&text, changes).unwrap();
        let cells = loaded.case.domain.cells.iter().map(|&n| n as f64 + 4.0).product::<f64>();
        (check::memory(&loaded.case, &CostModel::default()), cells)
    };
    let large = "domain.cells=[400, 400, 400]";
    let ((surfaces, cells), (other, _)) = (memory(&[large]), memory(&[large, "coupling.exchange=stress"]));
    // Seven fields of the surfaces, sixteen of the room of the liquid, less three of the acceleration of implicit steps.
    assert!(((surfaces - other) / (160.0 * cells) - 1.0).abs() < 1e-9, "{surfaces} {other}");
}

#[test]
fn memory_of_the_smoothing_grid_is_counted_with_its_radius() {
    let text = format!("{SMALL}{PACKED}[erosion]\n[output]\nfigures = {{ at = [] }}\n");
    let wide = ["domain.size=[\"1 m\", \"1 m\", \"2 mm\"]", "erosion.dx=10 um", "erosion.dr=10 um"];
    let with = |radius: &str| format!("erosion.r_max={radius}");
    let memory = |radius: &str| {
        let loaded = read(&text, &[wide[0], wide[1], wide[2], &with(radius)]).unwrap();
        check::memory(&loaded.case, &CostModel::default())
    };
    // A mean of 16 bytes for each cell of a square of twice the radius.
    let grown = memory("450 mm") - memory("50 mm");
    let expected = 16.0 * (90_000.0_f64.powi(2) - 10_000.0_f64.powi(2));
    assert!((grown / expected - 1.0).abs() < 1e-3, "{grown} {expected}");
    let allowed = |radius: &str| feasibility(&text, &[wide[0], wide[1], wide[2], &with(radius)], ENOUGH);
    let (found, feasible) = allowed("450 mm");
    assert!(feasible.is_none() && found.len() == 2 && found[0].contains("`erosion.r_max`"), "{found:#?}");
    assert!(found[1].contains("times as long as wide"), "{found:#?}");
    // Negative control: a tenth of the radius fits.
    assert!(allowed("45 mm").1.is_some(), "{:#?}", allowed("45 mm").0);
    // A radius beyond the box is refused.
    let found = findings(&text, &["erosion.r_max=45 mm"]);
    assert!(found.len() == 1 && found[0].contains("`r_max` has to lie between"), "{found:#?}");
}

#[test]
fn counts_beyond_reason_are_refused() {
    let text = format!("{SMALL}{PACKED}");
    for (change, expected) in [
        ("grains.0.contact_spheres=shell(1000000000)", "too many contact spheres"),
        ("grains.0.contact_spheres=axis(1001)", "too many contact spheres"),
        ("grains.0.shape.spheroid.rings=100000", "`rings` has to be 200 or less"),
        ("grains.0.shape.spheroid.segments=201", "`segments` has to be 200 or less"),
    ] {
        let found = findings(&text, &[change]);
        assert!(found.len() == 1 && found[0].contains(expected), "{change}: {found:#?}");
    }
    for change in [
        "grains.0.contact_spheres=shell(1000)",
        "grains.0.contact_spheres=axis(1000)",
        "grains.0.shape.spheroid.rings=200",
        "grains.0.shape.spheroid.segments=200",
    ] {
        assert!(findings(&text, &[change]).is_empty(), "{change}");
    }
}

#[test]
fn files_that_are_no_texts_are_named_and_not_read_without_end() {
    let folder = tempfile::tempdir().unwrap();
    let refused = |name: &str, bytes: &[u8]| {
        let path = folder.path().join(name);
        std::fs::write(&path, bytes).unwrap();
        case::load(&path, &[]).unwrap_err().to_string()
    };
    let latin = refused("latin.toml", b"title = \"sand\"\n# gr\xf6\xdfe\n[run]\n");
    assert!(latin.contains("line 2 is not UTF-8"), "{latin}");
    // As long as /dev/zero for who reads it to its end.
    let path = folder.path().join("endless.toml");
    std::fs::File::create(&path).unwrap().set_len(1 << 40).unwrap();
    let endless = case::load(&path, &[]).unwrap_err().to_string();
    assert!(endless.contains("longer than 64 MiB"), "{endless}");
}

#[test]
fn keys_of_other_contact_spheres_are_refused() {
    let text = |keys: &str| {
        format!(
            "{SMALL}[material.sand]\ndensity = \"2650 kg/m^3\"\n[[grains]]\nshape.box = {{ size = [\"0.3 mm\", \"0.3 mm\", \"0.3 mm\"] }}\n{keys}\nplacement.list = [{{ position = [\"0.5 mm\", \"0.5 mm\", \"0.5 mm\"] }}]\n"
        )
    };
    for (keys, key) in [
        ("sphere_file = \"none.txt\"", "sphere_file"),
        ("contact_spheres = \"shell(20)\"\nsphere_file_unit = \"1 mm\"", "sphere_file_unit"),
        ("contact_spheres = \"file\"\nsphere_file = \"none.txt\"\nsphere_radius = \"0.02 mm\"", "sphere_radius"),
    ] {
        let error = read(&text(keys), &[]).unwrap_err().to_string();
        assert!(error.contains(&format!("`{key}` does nothing with these contact spheres")), "{keys}: {error}");
    }
    // One error where the spheres are refused themselves.
    let error = read(&text("contact_spheres = \"shel(30)\"\nsphere_file = \"none.txt\""), &[]).unwrap_err().to_string();
    assert!(error.contains("no such builder") && !error.contains("does nothing"), "{error}");
    // Negative control: where it is meant.
    assert!(read(&text("sphere_radius = \"0.02 mm\""), &[]).is_ok());
}

#[test]
fn sieve_curves_rise_from_nothing_to_all() {
    let text = |sieves: &str| {
        format!(
            "{SMALL}[material.sand]\ndensity = \"2650 kg/m^3\"\n[[grains]]\nshape.sphere = {{ diameter = \"0.1 mm\" }}\nsize.sieves = [{sieves}]\nplacement.lattice = {{ counts = [2, 2, 2] }}\n"
        )
    };
    let sieve = |factor: &str, passing: &str| format!("{{ factor = {factor}, passing = {passing} }}");
    let curve = |points: &[[&str; 2]]| points.iter().map(|[f, p]| sieve(f, p)).collect::<Vec<_>>().join(", ");
    for refused in [
        &[][..],
        &[["0.5", "0"]][..],
        &[["0.5", "0"], ["1", "0.6"]],
        &[["0.5", "0.1"], ["1", "1"]],
        &[["1", "0"], ["0.5", "1"]],
        &[["0.5", "0"], ["0.8", "0.7"], ["1", "0.6"], ["1.2", "1"]],
        &[["0.5", "0"], ["0.5", "1"]],
    ] {
        let error = read(&text(&curve(refused)), &[]).unwrap_err().to_string();
        assert!(error.contains("this is no sieve curve"), "{refused:?}: {error}");
    }
    // Sieves that nothing passes, or all, are no ends of it.
    let loaded =
        read(&text(&curve(&[["0.2", "0"], ["0.5", "0"], ["1", "0.6"], ["1.2", "1"], ["2", "1"]])), &[]).unwrap();
    let sizes = loaded.case.grains[0].sizes().into_owned();
    assert_eq!((sizes.smallest(), sizes.largest()), (0.5, 1.2));
}

#[test]
fn the_bed_is_measured_on_the_scale_of_its_grains() {
    // Grains of half a metre: their height about the axis and their porosity, with what the case leaves out.
    let text = "gravity = \"9.8 m/s^2\"\n[domain]\nsize = [\"5 m\", \"5 m\", \"8 m\"]\ncells = [10, 10, 16]\n[material.rock]\ndensity = \"2500 kg/m^3\"\n[contact.default]\nnormal_stiffness = \"1e8 N/m\"\n[[grains]]\nshape.sphere = { diameter = \"0.5 m\" }\nplacement.lattice = { lower = [\"0 m\", \"0 m\", \"0 m\"], upper = [\"5 m\", \"5 m\", \"1 m\"], counts = [9, 9, 2] }\n[run]\nuntil = \"1 s\"\n";
    let bed = read(text, &[]).unwrap().case.bed;
    // Ten grains of a thick bed, all but the uppermost of one of three, and all of a layer.
    assert_eq!(bed.height_radius, 1.0);
    assert_eq!([8.0, 1.5, 0.9, 0.4].map(|surface| bed.porosity_slab(surface)[1]), [5.0, 1.0, 0.9, 0.4]);
    // Negative control: what is given stands.
    assert_eq!(read(text, &["bed.height_radius=1 mm"]).unwrap().case.bed.height_radius, 1e-3);
    let given = read(text, &["bed.porosity_upper=3 m"]).unwrap().case.bed;
    assert_eq!([8.0, 1.5].map(|surface| given.porosity_slab(surface)[1]), [3.0, 1.5]);
}

#[cfg(unix)]
#[test]
fn files_that_a_case_names_are_regular() {
    let grains = |shape: &str, spheres: &str, placement: &str| {
        format!(
            "{SMALL}[material.sand]\ndensity = \"2650 kg/m^3\"\n[[grains]]\n{shape}\n{spheres}\nplacement.{placement}\n"
        )
    };
    let ball = "shape.sphere = { diameter = \"0.3 mm\" }";
    let place = "list = [{ position = [\"0.5 mm\", \"0.5 mm\", \"0.5 mm\"] }]";
    let zero = "/dev/zero";
    for text in [
        grains(
            &format!("shape.mesh = {{ file = \"{zero}\", unit = \"1 mm\" }}"),
            "contact_spheres = \"shell(20)\"",
            place,
        ),
        grains(ball, &format!("contact_spheres = \"file\"\nsphere_file = \"{zero}\""), place),
        grains(ball, "", &format!("bed = {{ file = \"{zero}\" }}")),
        format!("{SMALL}[frame.motion]\nfile = \"{zero}\"\naxis = \"x1\"\n"),
        format!("{SMALL}[[liquid]]\nregion.file = {{ file = \"{zero}\" }}\n"),
    ] {
        let refused = match read(&text, &[]) {
            Ok(loaded) => match feasible::check(&loaded, &machine(ENOUGH), &CostModel::default()) {
                Ok(_) => String::new(),
                Err(error) => error.to_string(),
            },
            Err(error) => error.to_string(),
        };
        assert!(refused.contains("no regular file"), "{text}\n{refused}");
    }
}
