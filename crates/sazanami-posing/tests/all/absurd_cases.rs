//! Cases that can be read and that nobody can mean: refused or warned of before they run.

use std::path::Path;

use sazanami_posing::case::{self, Diagnostics, LoadedCase};
use sazanami_posing::check::{self, CheckReport, CostModel, Known};
use sazanami_posing::feasible;
use sazanami_posing::machine::{Machine, MemoryLimit};

/// The shipped tank, crater and column of water.
const RIPPLES: &str = "ripples/quick.toml";
const RAINDROP: &str = "raindrop/quick.toml";
const TUNNEL: &str = "ripples/tunnel.toml";
const DAM_BREAK: &str = "both/dam-break.toml";
/// A sphere that creeps through glycerine.
const CREEPING: &str = "../crates/sazanami/tests/cases/creeping-sphere.toml";

/// Findings on a shipped case with other values, each with its place, label and suggestion; whether it can run.
pub(crate) fn findings(case: &str, overrides: &[&str]) -> (bool, Vec<String>) {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../cases").join(case);
    let overrides: Vec<String> = overrides.iter().map(|text| (*text).to_owned()).collect();
    let machine =
        Machine { cpu: "any".into(), cores: 2, memory_available: Some(8 << 30), memory_limit: MemoryLimit::Machine };
    let loaded = case::load(&path, &overrides);
    let found = loaded.and_then(|loaded| {
        let source = loaded.source.clone();
        feasible::check(&loaded, &machine, &CostModel::default()).map(|feasible| (feasible.warnings, source))
    });
    let (fine, findings, source) = match found {
        Ok((warnings, source)) => (true, warnings, source),
        Err(error) => (false, error.diagnostics, error.source),
    };
    let texts = findings.records(&source).into_iter().map(|found| {
        let [label, help] = [found.expected, found.suggestion].map(Option::unwrap_or_default);
        let file = Path::new(&found.file).file_name().unwrap_or_default().display();
        format!("{file}:{} {} | {label} | {help}", found.column.unwrap_or(0), found.message)
    });
    (fine, texts.collect())
}

/// Asserts that changed cases are refused (or else warned of) in these words.
pub(crate) fn all_reported(fine: bool, changes: &[(&str, &str, &str)]) {
    for (case, change, words) in changes {
        let (runs, texts) = findings(case, &[change]);
        assert_eq!(runs, fine, "{change}: {texts:#?}");
        assert!(texts.iter().any(|text| text.contains(words)), "{change}: `{words}` is not in {texts:#?}");
        let numbers = texts.iter().flat_map(|text| text.split(' ')).filter(|word| word.len() > 60).collect::<Vec<_>>();
        assert!(numbers.is_empty(), "{change}: {numbers:?}");
    }
}

#[test]
fn runs_that_come_to_no_end_are_refused() {
    let scratch = std::env::temp_dir().join(format!("sazanami-absurd-{}.csv", std::process::id()));
    std::fs::write(&scratch, "t_s,x_m\n0,0\n1,5e300\n2,0\n3,1\n").unwrap();
    let record = format!("frame.motion={{file=\"{}\"}}", scratch.display());
    all_reported(
        false,
        &[
            (RIPPLES, "frame.motion.amplitude=[\"1e300 m\", \"0 m\", \"0 m\"]", "faster than sound"),
            (RIPPLES, &record, "faster than sound"),
            (RIPPLES, "frame.motion.frequency=1e9 Hz", "faster than sound"),
            (RIPPLES, "run.until=1e300 s", "about 2.500e303 steps"),
            (RAINDROP, "run={until=\"1e300 s\"}", "would not come to its end"),
            (RAINDROP, "run.until=1 s", "lies beyond `run.latest`"),
            (RIPPLES, "run.until=rest", "`until = \"rest\"` without a crater"),
            (RAINDROP, "output.series={every=\"2 ms\"}", "rows of the series too far apart"),
            (RIPPLES, "contact.default.normal_stiffness=1e30 N/m", "1.0e30 N/m ask for"),
            (RIPPLES, "dem.film_roughness=1e-20 m", "the film between grains asks for"),
            (
                RIPPLES,
                "dem.allowed_error=2e-6",
                "no length of the contact sub-steps keeps the error of impacts within 2e-6",
            ),
            (RAINDROP, "dem={allowed_error=0.01,substeps=20}", "`substeps` gives their number"),
            (
                RAINDROP,
                "dem={soften={from=\"20 ms\",stiffness=0.5},substeps=20}",
                "softer springs make sub-steps longer",
            ),
            (
                RAINDROP,
                "dem.soften={from=\"20 ms\",stiffness=0.001,largest_overlap=0.001}",
                "so soft springs let the weight of the grains alone press them too deep",
            ),
            (RAINDROP, "dem.soften={from=\"20 ms\",stiffness=2}", "stiffness"),
            (RIPPLES, "frame.acceleration=[\"1e9 m/s^2\", \"0 m/s^2\", \"0 m/s^2\"]", "this body force"),
            (RAINDROP, "gravity=1e9 m/s^2", "this body force"),
            (RAINDROP, "liquid.0.fall.speed=1e5 m/s", "faster than sound"),
        ],
    );
    std::fs::remove_file(&scratch).unwrap();
    assert!(findings(RIPPLES, &["run.until=7 s", "contact.default.normal_stiffness=1e5 N/m"]).0);
    assert!(findings(RAINDROP, &["dem.soften={from=\"20 ms\",stiffness=0.25}"]).0);
    assert!(findings(RIPPLES, &["dem.allowed_error=0.01"]).0 && findings(RAINDROP, &["dem.substeps=20"]).0);
}

#[test]
fn velocity_fields_answer_for_their_own_speed() {
    let fields = [
        ("fluid.initial_velocity={uniform={velocity=[\"1e5 m/s\",\"0 m/s\",\"0 m/s\"]}}", "initial_velocity"),
        ("fluid.carrying_flow={reversed_vortex={speed=\"1e5 m/s\",period=\"1 s\"}}", "carrying_flow"),
    ];
    for (change, key) in fields {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../cases/both/dam-break.toml");
        let loaded = case::load(&path, &["solver=mics".to_owned(), change.to_owned()]).unwrap();
        let refused = feasible::check(&loaded, &Machine::this(), &CostModel::default()).unwrap_err();
        let records = refused.diagnostics.records(&refused.source);
        assert_eq!(records.len(), 1, "{refused}");
        assert!(records[0].message.contains("faster than sound"), "{refused}");
        let text = refused.to_string();
        assert!(text.contains(key) && !text.contains("frame.motion"), "{refused}");
    }
}

#[test]
fn a_laboratory_that_cannot_be_found_is_refused() {
    let laboratory = "output.frame=laboratory";
    let oscillation = "frame.oscillation={amplitude=[\"1 m/s^2\",\"0 m/s^2\",\"0 m/s^2\"],frequency=\"1 Hz\"}";
    let found = |changes: &[&str]| findings(RAINDROP, changes);
    let (runs, texts) = found(&[laboratory, oscillation]);
    assert!(
        !runs && texts.iter().any(|text| text.contains("the position of the box in the laboratory is not known")),
        "{texts:#?}"
    );
    assert!(found(&[oscillation]).0 && found(&[laboratory]).0);
}

#[test]
fn evaluations_that_find_nothing_are_refused() {
    let points = "probe=[{line={from=[\"0 mm\",\"1 mm\",\"1 mm\"],to=[\"1 mm\",\"1 mm\",\"1 mm\"],points=1000000000}}]";
    all_reported(
        false,
        &[
            (RIPPLES, points, "expected a whole number from 2 to 10000"),
            (RIPPLES, "ripples.grain_size=1 nm", "between 1e-4 m and 0.01 m"),
            (RIPPLES, "ripples.grain_size=1 m", "between 1e-4 m and 0.01 m"),
            (RIPPLES, "ripples.margin=60 mm", "between 0 m and 0.054 m"),
            (RIPPLES, "ripples.layer_length=1 m", "`layer_length` has to lie between"),
            (RIPPLES, "ripples.layer_thickness=1 m", "`layer_thickness` has to lie between"),
            (RAINDROP, "erosion.grain_size=1 nm", "`grain_size` has to lie between"),
            (RAINDROP, "erosion.dx=1 nm", "`dx` has to lie between"),
        ],
    );
}

#[test]
fn what_runs_and_does_not_serve_is_warned_of() {
    all_reported(
        true,
        &[
            (RIPPLES, "grains.0.placement.packed.glued=11 mm", "every grain of `sand` is glued"),
            (RIPPLES, "particles.dt=1 s", "longer than the limits allow | `advective` allows"),
            (RIPPLES, "particles.dt=0.2 s", "too long for this oscillation"),
            (RAINDROP, "fluid={dt=\"1 ms\"}", "the fluid makes 34 passes in each"),
            (CREEPING, "fluid.dt=1 ms", "`grain_friction` allows 2.962e-5 s"),
            (RIPPLES, "overlap.smoothing=2.4 mm", "`smoothing` is short"),
            (
                RIPPLES,
                "fluid.carrying_flow={reversed_vortex={speed=\"1 m/s\",period=\"1 s\"}}",
                "`fluid.carrying_flow` does nothing with `solver = \"mps\"`",
            ),
        ],
    );
    let quiet = |case, change: &str, words: &str| !findings(case, &[change]).1.iter().any(|text| text.contains(words));
    assert!(quiet(RIPPLES, "grains.0.placement.packed.glued=9 mm", "glued"));
    assert!(quiet(RIPPLES, "particles.dt=0.2 ms", "fixed step"));
    assert!(quiet(RAINDROP, "fluid={dt=\"50 us\"}", "fixed step"));
    assert!(quiet(RIPPLES, "overlap.smoothing=2.5 mm", "smoothing"));
    assert!(quiet(RIPPLES, "fluid.initial_velocity={taylor_green={speed=\"0.5 m/s\"}}", "does nothing"));
}

#[test]
fn the_void_fraction_is_smoothed_over_grains_and_within_the_tank() {
    all_reported(
        false,
        &[
            (RIPPLES, "overlap.smoothing=0.1 mm", "smaller than a grain"),
            (RIPPLES, "overlap.smoothing=1 m", "1000 mm, the edge 9 mm"),
        ],
    );
}

#[test]
fn findings_are_told_once_with_a_place_and_something_to_do() {
    let sayings = [
        (
            RAINDROP,
            "probe=[{ point = [\"1 m\", \"0 m\", \"0 m\"] }]",
            "--set:18 `probe 0` lies outside",
            "into the box",
        ),
        (RAINDROP, "probe=[{ body = { population = \"snd\" } }]", "no such population", "known here: `sand`"),
        (RAINDROP, "probe=[{ body = { index = 9999 } }]", "--set:27 `sand` has no grain 9999", "one of these numbers"),
        (RAINDROP, "output.fields={ at = [\"-1 s\"] }", "a run begins at time zero", "leave out the times"),
        (RAINDROP, "fluid.cfl=nan", "`cfl` is not finite", "write its digits"),
        (RAINDROP, "bed.porosity_upper=1 m", "--set:20 the slab of the porosity", "between 0 mm and 10.2 mm"),
        (RIPPLES, "particles.spacing=0 mm", "`spacing` has to be above zero", "for example \"0.52 mm\""),
        (RIPPLES, "overlap.blend=[0.5, 0.4]", "--set:15 `blend` is a lower and an upper", "for example"),
    ];
    for (case, change, title, help) in sayings {
        let (runs, texts) = findings(case, &[change]);
        let found: Vec<&String> = texts.iter().filter(|text| text.contains(title)).collect();
        assert!(!runs && found.len() == 1 && found[0].contains(help), "{change}: {texts:#?}");
    }
    let once =
        |change: &str, title: &str| findings(RIPPLES, &[change]).1.iter().filter(|t| t.contains(title)).count() == 1;
    assert!(once("contact.default.friction=-1", "`friction` has to lie between 0 and 10"));
    assert!(once("overlap.blend=[0.1, 0.2, 0.3]", "`blend`"));
    let error = case::parse(Path::new("case.toml"), "[run]\n", &[]).unwrap_err().to_string();
    assert!(error.contains("add `until = \"0.02 s\"`"), "{error}");
}

/// Report of `check` on a shipped case.
fn report(case: &str, overrides: &[&str]) -> (LoadedCase, CheckReport) {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../cases").join(case);
    let overrides: Vec<String> = overrides.iter().map(|text| (*text).to_owned()).collect();
    let loaded = case::load(&path, &overrides).unwrap_or_else(|error| panic!("{error}"));
    let report = check::check(&loaded.case, Known::default(), &Machine::this(), 2, &CostModel::default());
    (loaded, report)
}

#[test]
fn grains_above_the_level_and_water_within_grains_are_not_counted() {
    // Grains and particles of water that runs of these cases had.
    for (case, packed, grains, water) in
        [(RIPPLES, 14_439, 11_155, 11_066), ("ripples/paper.toml", 40_108, 30_965, 43_774)]
    {
        let (_, report) = report(case, &[]);
        let near = |found: usize, measured: usize| found.abs_diff(measured) * 200 < measured;
        assert_eq!(report.populations[0].grains, Some(packed));
        assert!(near(report.populations[0].levelled.unwrap(), grains) && near(report.grains, grains), "{case}");
        let particles = report.particles.unwrap();
        assert!(near(particles.fluid, water), "{case}");
        let volume = report.liquids[0].volume_m3.unwrap() / particles.spacing_m.powi(3);
        assert!((volume / water as f64 - 1.0).abs() < 0.005, "{case}: {volume} particles");
    }
    // Water that reaches out of the box is not in it.
    let wide = "liquid.0.region.box.lower=[\"-90 mm\", \"0 mm\", \"0 mm\"]";
    let volume = |overrides: &[&str]| report(RIPPLES, overrides).1.liquids[0].volume_m3;
    assert_eq!(volume(&[wide]), volume(&[]));
    let probe = |index: usize| findings(RIPPLES, &[&format!("probe=[{{ body = {{ index = {index} }} }}]")]).1;
    let is_warned = |texts: &[String]| texts.iter().any(|text| text.contains("may be taken away"));
    assert!(is_warned(&probe(12_000)) && !is_warned(&probe(100)));
}

#[test]
fn results_that_do_not_fit_onto_the_disk_are_warned_of() {
    let warnings = |change: &str, free: u64| {
        let (loaded, report) = report(RIPPLES, &[change]);
        let mut found = Diagnostics::default();
        check::warn_of_disk(&loaded, &report, Some(free), &mut found);
        found.records(&loaded.source).iter().map(|f| f.suggestion.clone().unwrap_or_default()).collect::<Vec<_>>()
    };
    assert_eq!(warnings("run.until=2 s", 50 << 30), Vec::<String>::new());
    assert!(warnings("output.fields={ every = \"1e-6 s\" }", 50 << 30)[0].contains("`output.fields` less often"));
    // The profiles of bed and water come with every row of the series.
    assert!(warnings("output.series={ every = \"1e-5 s\" }", 1 << 30)[0].contains("`output.series` less often"));
}

#[test]
fn grains_are_packed_onto_a_wall() {
    let upward = "gravity=[\"0 m/s^2\", \"0 m/s^2\", \"9.8 m/s^2\"]";
    let sideways = "gravity=[\"9.8 m/s^2\", \"0 m/s^2\", \"0 m/s^2\"]";
    let wet = "boundary.x3_upper={ fixed_pressure = { fluid = \"liquid\" } }";
    all_reported(
        false,
        &[
            (RIPPLES, "boundary.x3_lower=outflow", "`sand` has no floor below it"),
            (RAINDROP, "boundary.x3_lower=outflow", "`sand` has no floor below it"),
            (RIPPLES, upward, "does not press these grains"),
            (RAINDROP, upward, "does not press these grains"),
            (RAINDROP, sideways, "does not press these grains"),
            (RIPPLES, "boundary.x3_upper={ fixed_pressure = { pressure = \"1e5 Pa\" } }", "the side x3_upper"),
            (RIPPLES, wet, "the side x3_upper"),
        ],
    );
    assert!(findings(RIPPLES, &["boundary.x3_upper={ fixed_pressure = {} }"]).0);
    assert!(findings(RAINDROP, &["gravity=[\"3 m/s^2\", \"0 m/s^2\", \"-9.3 m/s^2\"]"]).0);
}

/// A population in the shipped crater's case, in which nothing else lies.
fn alone(population: &str) -> (bool, Vec<String>) {
    findings(RAINDROP, &[&format!("grains=[{{ {population} }}]"), "liquid=[]", "probe=[]"])
}

#[test]
fn surfaces_that_contact_spheres_leave_uncovered_are_warned_of() {
    let boxes = |spheres: &str| {
        let at = "placement.list = [{ position = [\"6 mm\", \"6 mm\", \"6 mm\"] }]";
        let (runs, texts) =
            alone(&format!("shape.box = {{ size = [\"0.4 mm\", \"0.6 mm\", \"0.8 mm\"] }}, {spheres} {at}"));
        assert!(runs, "{texts:#?}");
        texts.into_iter().find(|text| text.contains("uncovered"))
    };
    let warning = boxes("").unwrap_or_default();
    assert!(warning.contains("up to 62.18 um, 16 % of its size") && warning.contains("sphere_radius"), "{warning}");
    assert_eq!(boxes("contact_spheres = \"shell(300)\", sphere_radius = \"0.035 mm\","), None);
}

#[test]
fn a_shape_that_cannot_be_built_hides_no_other_faults() {
    let at = |x: &str| format!("placement.list = [{{ position = [\"{x}\", \"6 mm\", \"6 mm\"] }}]");
    let bad = format!(
        "{{ name = \"bad\", shape.box = {{ size = [\"1 mm\", \"1 mm\", \"1 mm\"] }}, contact_spheres = \"shell(9)\", sphere_radius = \"0.6 mm\", {} }}",
        at("6 mm")
    );
    let beyond = format!("{{ name = \"beyond\", shape.sphere = {{ diameter = \"1 mm\" }}, {} }}", at("0.1 mm"));
    let of = |populations: &[&str]| {
        findings(RAINDROP, &[&format!("grains=[{}]", populations.join(", ")), "liquid=[]", "probe=[]"])
    };
    let says =
        |texts: &[String], what: &str| texts.iter().filter(|text| text.contains(what)).cloned().collect::<Vec<_>>();
    let sticks_out = says(&of(&[&beyond]).1, "sticks out of the box");
    assert_eq!(sticks_out.len(), 1);
    let column = |text: &str| text.split(&[':', ' '][..]).nth(1).and_then(|column| column.parse::<usize>().ok());
    for (populations, later) in [([&bad, &beyond], bad.len() + 2), ([&beyond, &bad], 0)] {
        let (runs, texts) = of(&populations.map(String::as_str));
        assert!(!runs && says(&texts, "`bad` has no usable shape").len() == 1, "{texts:#?}");
        let found = says(&texts, "sticks out of the box");
        // Where it stands in the text.
        assert_eq!(found.len(), 1, "{texts:#?}");
        assert_eq!(column(&found[0]).unwrap(), column(&sticks_out[0]).unwrap() + later, "{texts:#?}");
    }
}

#[test]
fn a_sphere_lies_in_the_box_by_its_true_shape() {
    // The nodes of a mesh that keeps the volume of the sphere stand out of it.
    let sphere = |x: f64| {
        alone(&format!(
            "shape.sphere = {{ diameter = \"2 mm\", volume = \"preserve\" }}, \
             placement.list = [{{ position = [\"{x} mm\", \"6 mm\", \"6 mm\"] }}]"
        ))
    };
    assert!(sphere(1.0).0, "{:#?}", sphere(1.0).1);
    assert!(sphere(1.0001).0, "{:#?}", sphere(1.0001).1);
    let (runs, texts) = sphere(0.9999);
    assert!(!runs && texts[0].contains("sticks out of the box | 0.1 um beyond the side x1_lower"), "{texts:#?}");
}

#[test]
fn slips_of_units_are_found_soon() {
    // Ten times too long: every grain of the bed overlaps hundreds of others, and not all pairs are looked at.
    let (runs, texts) = findings("raindrop/paper.toml", &["grains.0.shape.spheroid.diameter=5.2 mm"]);
    assert!(!runs && texts.iter().any(|text| text.contains("; at least 31900 pairs of the bed")), "{texts:#?}");
    all_reported(
        false,
        &[
            (RAINDROP, "grains.0.shape.spheroid.length=20 mm", "too large to be packed into this box"),
            ("raindrop/paper.toml", "grains.0.shape.spheroid.diameter=0.52 m", "stick out of the box"),
        ],
    );
}

#[test]
fn threads_beyond_the_processors_make_nothing_faster() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../cases").join(RAINDROP);
    let loaded = case::load(&path, &[]).unwrap();
    let machine = Machine { cores: 2, ..Machine::this() };
    let on = |threads| check::check(&loaded.case, Known::default(), &machine, threads, &CostModel::default());
    assert_eq!(on(64).predicted_total_s, on(2).predicted_total_s);
    assert!(on(1).predicted_total_s > 1.5 * on(2).predicted_total_s);
    // What they reserve of a limited address space is warned of.
    let warnings = |free: u64, memory_limit: MemoryLimit| {
        let limited = Machine { memory_available: Some(free), memory_limit, ..machine.clone() };
        let report = check::check(&loaded.case, Known::default(), &limited, 8, &CostModel::default());
        let mut found = Diagnostics::default();
        check::warn_of_address_space(&report, &mut found);
        found.records(&loaded.source).len()
    };
    let address_space = MemoryLimit::AddressSpace;
    assert_eq!([warnings(1 << 30, address_space), warnings(3 << 30, address_space)], [1, 0]);
    assert_eq!(warnings(1 << 30, MemoryLimit::Machine), 0);
}

#[test]
fn predictions_are_numbers_and_bubbles_are_of_gas() {
    for case in [RAINDROP, RIPPLES] {
        let (_, report) = report(case, &["run.until=0 s"]);
        assert!(report.predicted_total_s.is_finite() && report.predicted_most_s.is_finite(), "{case}");
    }
    let (_, of_water) = report(RAINDROP, &[]);
    let (_, of_gas) = report(RAINDROP, &["liquid.0.fluid=gas"]);
    let mass = |report: &CheckReport| report.liquids[0].mass_kg.unwrap();
    assert_eq!([of_water.liquids[0].fluid, of_gas.liquids[0].fluid], ["liquid", "gas"]);
    assert!(mass(&of_gas) < 2e-3 * mass(&of_water), "{} {}", mass(&of_gas), mass(&of_water));
}

#[test]
fn the_bins_of_a_tank_are_foretold_where_water_can_be() {
    let memory = |changes: &[&str]| {
        let open = ["solver=mps", "boundary.x1=periodic", "boundary.x2=periodic", "boundary.x3_upper=outflow"];
        let (loaded, _) = report("both/dam-break.toml", &[&open[..], changes].concat());
        check::memory(&loaded.case, &CostModel::default())
    };
    let low = memory(&[]);
    // Nothing is above the water of a tall tank; a drop falls through all of it.
    let high = "domain.size.2=171.45 m";
    assert!(memory(&[high]) < 1.01 * low, "{low}");
    let above = "liquid.0.position=[\"0 mm\", \"0 mm\", \"171 m\"]";
    assert!(memory(&[high, above]) > 5.0 * low, "{low}");
}

/// Two drops of 8 and 6 mm whose centres are 4 mm apart.
const TWO_DROPS: [&str; 4] = [
    "solver=mics",
    "grains=[]",
    "domain={ size = [\"20 mm\", \"20 mm\", \"20 mm\"], cells = [16, 16, 16] }",
    "liquid=[{ name = \"a\", region.sphere.diameter = \"8 mm\", position = [\"8 mm\", \"10 mm\", \"10 mm\"] }, \
     { name = \"b\", region.sphere.diameter = \"6 mm\", position = [\"12 mm\", \"10 mm\", \"10 mm\"] }]",
];

#[test]
fn liquids_that_overlap_are_counted_once_and_said() {
    let volumes = |changes: &[&str]| -> Vec<f64> {
        let (_, report) = report(DAM_BREAK, &[&TWO_DROPS[..], changes].concat());
        report.liquids.iter().map(|liquid| 1e9 * liquid.volume_m3.unwrap()).collect()
    };
    let warned = |changes: &[&str]| -> Vec<String> {
        let (fine, texts) = findings(DAM_BREAK, &[&TWO_DROPS[..], changes].concat());
        assert!(fine, "{texts:#?}");
        texts.into_iter().filter(|text| text.contains("lies where")).collect()
    };
    // The lens of two spheres of radii R, r at distance d (Weisstein, Sphere-Sphere Intersection).
    let (big, small, d) = (4.0_f64, 3.0_f64, 4.0_f64);
    let lens = std::f64::consts::PI
        * (big + small - d).powi(2)
        * (d * d + 2.0 * d * small - 3.0 * small * small + 2.0 * d * big + 6.0 * small * big - 3.0 * big * big)
        / (12.0 * d);
    let ball = |radius: f64| 4.0 / 3.0 * std::f64::consts::PI * radius.powi(3);
    let [a, b] = volumes(&[])[..] else { panic!() };
    assert!(
        (a - (ball(big) - lens)).abs() < 0.002 * ball(big) && (b - ball(small)).abs() < 1e-9,
        "{a} {b}, lens {lens}"
    );
    let texts = warned(&[]);
    assert!(
        texts.len() == 1 && texts[0].contains("`b` lies where `a` is") && texts[0].contains("of its 268.1 mm^3"),
        "{texts:#?}"
    );
    // Negative controls: apart, side by side, and a bubble, which is meant to lie in the liquid and takes its place there.
    let apart = "liquid.1.position=[\"15 mm\", \"10 mm\", \"10 mm\"]";
    assert!(warned(&[apart]).is_empty() && (volumes(&[apart])[0] - ball(big)).abs() < 1e-9);
    let bubble = "liquid.1.fluid=gas";
    assert!(warned(&[bubble]).is_empty() && (volumes(&[bubble])[0] - a).abs() < 1e-12);
    let halves = [
        "liquid.0.region={ box = { lower = [\"0 mm\", \"0 mm\", \"0 mm\"], upper = [\"5 mm\", \"5 mm\", \"5 mm\"] } }",
        "liquid.1.region={ box = { lower = [\"5 mm\", \"0 mm\", \"0 mm\"], upper = [\"9 mm\", \"5 mm\", \"5 mm\"] } }",
        "liquid.0.position=[\"0 mm\", \"0 mm\", \"0 mm\"]",
        "liquid.1.position=[\"0 mm\", \"0 mm\", \"0 mm\"]",
    ];
    assert!(warned(&halves).is_empty());
}

#[test]
fn densities_of_another_unit_and_peaks_of_records_are_said() {
    let written = |name: &str, peak: f64| {
        let file = std::env::temp_dir().join(format!("sazanami-{name}-{}.csv", std::process::id()));
        let row = |n: usize| {
            let t = 0.005 * n as f64;
            let x = 0.01 * (4.0 * std::f64::consts::PI * t).sin() + if n == 300 { peak } else { 0.0 };
            format!("{t},{x}\n")
        };
        let rows: String = (0..=1400).map(row).collect();
        std::fs::write(&file, format!("t_s,x_m\n{rows}")).unwrap();
        (format!("frame.motion={{file=\"{}\"}}", file.display()), file)
    };
    let ((smooth, first), (peaked, second)) = (written("smooth", 0.0), written("peaked", 1e-3));
    all_reported(
        true,
        &[
            (RIPPLES, "material.sand.density=2.65 kg/m^3", "a density of 2.65 kg/m^3 is lighter than foam"),
            (RAINDROP, "material.sand.density=2650000 kg/m^3", "heavier than osmium"),
            (
                RAINDROP,
                "fluid.liquid={ density = \"1 kg/m^3\", kinematic_viscosity = \"1e-6 m^2/s\" }",
                "lighter than foam",
            ),
            (RIPPLES, &peaked, "at 1.5 s, 1.58 m/s^2 in its strongest harmonic"),
        ],
    );
    let steps =
        |change: &str| report(RIPPLES, &[change]).1.limits.iter().find(|l| l.name == "body_force").unwrap().dt_s;
    assert!(
        steps(&peaked) < 0.5 * steps(&smooth),
        "the peak is in the forecast: {} {}",
        steps(&peaked),
        steps(&smooth)
    );
    // Nor is a run of less than a cycle of the record said to have a peak.
    let begins = findings(RIPPLES, &[&smooth, "run.until=0.2 s"]).1;
    assert!(!begins.iter().any(|text| text.contains("has a peak")), "{begins:#?}");
    for (case, change) in [(RIPPLES, &smooth[..]), (RIPPLES, "material.sand.density=19300 kg/m^3")] {
        let texts = findings(case, &[change]).1;
        assert!(!texts.iter().any(|text| text.contains("a density of") || text.contains("has a peak")), "{texts:#?}");
    }
    std::fs::remove_file(first).unwrap();
    std::fs::remove_file(second).unwrap();
}

#[test]
fn magnitudes_that_nobody_means_are_said() {
    let periodic = "boundary.x1=periodic";
    let doubted: &[(&str, &[&str], &str)] = &[
        (RAINDROP, &["gravity=1e6 m/s^2"], "gravity of"),
        (RAINDROP, &["gravity=2e-8 m/s^2"], "less than that in orbit"),
        (RAINDROP, &["fluid.liquid.kinematic_viscosity=1e-13 m^2/s"], "a viscosity of 1e-10 Pa s"),
        (RAINDROP, &["fluid.gas.density=1e-9 kg/m^3"], "that of a vacuum"),
        (RAINDROP, &["fluid.gas.kinematic_viscosity=1e12 m^2/s"], "more than that of pitch"),
        (RAINDROP, &["grains.0.mass_override=1 kg"], "heavier than osmium"),
        (
            RAINDROP,
            &["drive.acceleration=[\"1e-12 m/s^2\", \"0 m/s^2\", \"0 m/s^2\"]", periodic],
            "too small to move anything",
        ),
        (RAINDROP, &["drive.mean_velocity=[\"1e-12 m/s\", \"0 m/s\", \"0 m/s\"]", periodic], "slower than creep"),
        (RAINDROP, &["boundary.x3_upper={ fixed_pressure = { pressure = \"1e13 Pa\" } }"], "more than any sea has"),
        (RIPPLES, &["frame.motion.amplitude=[\"1e-12 m\", \"0 m\", \"0 m\"]"], "less than a thousand atoms"),
        (RIPPLES, &["frame.motion.frequency=1e-9 Hz"], "slower than any tide"),
        (
            DAM_BREAK,
            &["solver=mics", "liquid=[]", "fluid.surface_tension=0.07 N/m"],
            "`fluid.surface_tension` does nothing",
        ),
        (
            DAM_BREAK,
            &["solver=mics", "liquid=[]", "drive.mean_velocity=[\"1 m/s\", \"0 m/s\", \"0 m/s\"]", periodic],
            "`drive.mean_velocity` does nothing",
        ),
        (DAM_BREAK, &["solver=mics", "dem.substeps=10"], "`dem.substeps` does nothing"),
        (TUNNEL, &["ripples.margin=5 mm"], "`ripples.margin` does nothing"),
    ];
    for (case, changes, words) in doubted {
        let (_, texts) = findings(case, changes);
        assert!(texts.iter().any(|text| text.contains(words)), "{changes:?}: {texts:#?}");
    }
    all_reported(
        false,
        &[
            (RAINDROP, "gravity=9.8e-12 m/s^2", "gravity of 9.8e-12 m/s^2"),
            (RAINDROP, "domain.size=[\"2e9 mm\", \"18 mm\", \"10 mm\"]", "larger than any lake of grains"),
            (DAM_BREAK, "domain.size=[\"1e-12 m\", \"1e-12 m\", \"1e-12 m\"]", "smaller than any grain"),
        ],
    );
    // Control: the cases as they are, and none of these quantities, are not doubted.
    // Defaults written out, as in the case of a run's folder, pass too.
    let usual =
        ["solver=mics", "dem.substeps=auto", "dem.film_roughness=auto", "dem.rolling_friction=0", "coupling={}"];
    for (case, changes) in [
        (RAINDROP, &[][..]),
        (RIPPLES, &[]),
        (DAM_BREAK, &["solver=mics"]),
        (DAM_BREAK, &usual),
        (RAINDROP, &["gravity=0 m/s^2"]),
    ] {
        let texts = findings(case, changes).1;
        let doubts = |text: &&String| text.contains("not doubted") || text.contains("does nothing");
        assert!(!texts.iter().any(|text| doubts(&text)), "{case} {changes:?}: {texts:#?}");
    }
}

#[test]
fn records_that_end_on_the_way_and_gauges_across_gravity_are_warned_of() {
    let said = |change: &[&str], words: &str| {
        let (runs, texts) = findings(DAM_BREAK, &[&["solver=mics"], change].concat());
        assert!(runs, "{change:?}: {texts:#?}");
        texts.iter().any(|text| text.contains(words))
    };
    let written = |name: &str, last: f64| {
        let file = std::env::temp_dir().join(format!("sazanami-{name}-{}.csv", std::process::id()));
        let x = |n: usize| 0.001 * (20.0 * std::f64::consts::PI * (0.001 * n as f64).min(last)).cos();
        let rows: String = (0..=100).map(|n| format!("{},{}\n", 0.001 * n as f64, x(n))).collect();
        std::fs::write(&file, format!("t_s,x_m\n{rows}")).unwrap();
        (format!("frame.motion={{file=\"{}\"}}", file.display()), file)
    };
    // The box comes to rest after a period, or goes on in the middle of one.
    let ((resting, first), (moving, second)) = (written("resting", 0.05), written("moving", 0.075));
    let on_the_way =
        |motion: &str| said(&[motion, "run.until=\"0.2 s\""], "the motion of the tank ends before the run");
    let until = |motion: &str| said(&[motion, "run.until=\"0.07 s\""], "the motion of the tank ends before the run");
    assert!(!on_the_way(&resting) && !until(&moving));
    let short = std::fs::read_to_string(&second).unwrap().lines().take(77).collect::<Vec<_>>().join("\n");
    std::fs::write(&second, short).unwrap();
    assert!(on_the_way(&moving));
    std::fs::remove_file(first).unwrap();
    std::fs::remove_file(second).unwrap();

    let gauge = "probe=[{ name = \"p\", gauge = [\"1 mm\", \"1 mm\"] }]";
    let across = |gravity: &str| said(&[gauge, gravity], "a gauge measures along x3, and gravity points elsewhere");
    assert!(across("gravity=[\"9 m/s^2\", \"0 m/s^2\", \"-4 m/s^2\"]"));
    // Negative control: hardly tilted.
    assert!(!across("gravity=[\"1 m/s^2\", \"0 m/s^2\", \"-9.7 m/s^2\"]"));
    let fall = "liquid.0.fall={ speed = \"1 m/s\", angle = \"30 deg\" }";
    let across = |gravity: &str| said(&[fall, gravity], "a fall leads along -x3, and gravity points elsewhere");
    assert!(across("gravity=[\"-9.8 m/s^2\", \"0 m/s^2\", \"0 m/s^2\"]"));
    assert!(!across("gravity=\"9.8 m/s^2\"") && !across("gravity=\"0 m/s^2\""));

    for (table, what) in [("bed", "a bed is"), ("heap", "a heap is"), ("erosion", "a crater is")] {
        let (asked, warning) =
            (format!("{table}={{}}"), format!("{what} measured along x3, and gravity points elsewhere"));
        let across = |gravity: &str, keys: &[&str]| {
            let (_, texts) = findings(RAINDROP, &[&[gravity][..], keys].concat());
            texts.iter().any(|text| text.contains(&warning))
        };
        assert!(across("frame.acceleration=[\"20 m/s^2\", \"0 m/s^2\", \"0 m/s^2\"]", &[&asked]), "{table}");
        // Negative controls: grains that are packed across gravity, which is refused; hardly tilted, and none at all.
        assert!(!across("gravity=[\"9.8 m/s^2\", \"0 m/s^2\", \"0 m/s^2\"]", &[&asked]), "{table}");
        assert!(!across("gravity=[\"1 m/s^2\", \"0 m/s^2\", \"-9.7 m/s^2\"]", &[&asked]), "{table}");
        assert!(!across("gravity=\"0 m/s^2\"", &[&asked]), "{table}");
    }
    // Negative control: a tank without grains has no bed, whatever its copy says.
    assert!(!said(&["gravity=[\"9.8 m/s^2\", \"0 m/s^2\", \"0 m/s^2\"]", "bed={}"], "a bed is measured along x3"));
}

#[test]
fn liquids_that_the_grid_cannot_show_are_told() {
    let told = |size: &str, words: &str| {
        let changes = [
            "solver=mics",
            &format!(
                "liquid=[{{ region.sphere.diameter = \"{size}\", position = [\"0.15 m\", \"0.0125 m\", \"0.08 m\"] }}]"
            ),
        ];
        findings(DAM_BREAK, &changes).1.iter().filter(|text| text.contains(words)).count()
    };
    assert_eq!([told("1 um", "narrower than a cell"), told("1 um", "fills the box")], [1, 0]);
    assert_eq!([told("9 km", "narrower than a cell"), told("9 km", "fills the box")], [0, 1]);
    // Negative control: a drop of some cells.
    assert_eq!([told("20 mm", "narrower than a cell"), told("20 mm", "fills the box")], [0, 0]);
}
