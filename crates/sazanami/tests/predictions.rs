//! What `check` foretells of a run, held against the run: its first step, and its steps where bodies speed up.

#[allow(dead_code, reason = "every test program uses a part of it")]
mod support;

use std::path::Path;

use sazanami::case::{self, LoadedCase};
use sazanami::check::{self, CheckReport, CostModel, Known};
use sazanami::machine::Machine;
use sazanami::progress::StepLine;
use sazanami::run;
use sazanami::stop::Stop;
use sazanami_numerics::Real;

use support::{Listener, On, Scratch, load, start};

fn foretold(loaded: &LoadedCase) -> CheckReport {
    check::check(&loaded.case, Known::default(), &Machine::this(), 1, &CostModel::default())
}

/// The first step of a case.
fn first_step(loaded: &LoadedCase, folder: &Scratch) -> StepLine {
    let (stop, mut listener) = (Stop::new(), Listener::default());
    let mut options = On::threads(2).steps(1).options(Some(&folder.join("run")));
    options.force = true;
    run::run(loaded, &options, &mut listener, &stop).unwrap_or_else(|error| panic!("{error}"));
    *listener.lines.iter().find(|line| line.phase == "flow").expect("the flow has made a step")
}

/// The length of the step, its limit and the sub-steps of the grains in it.
fn described(report: &CheckReport) -> (Real, &'static str, usize) {
    let name = report.limits.iter().find(|limit| limit.rules).map_or("", |limit| limit.name);
    (report.dt_s, name, report.substeps)
}

fn agree(report: &CheckReport, step: &StepLine) -> bool {
    let (dt, limit, substeps) = described(report);
    (step.dt / dt - 1.0).abs() < 1e-9 && step.limiter == limit && step.substeps == substeps
}

#[test]
fn the_first_step_of_shipped_cases_is_that_of_check() {
    let folder = Scratch::new("first-step");
    let quiet = ["output.fields={ at = [] }", "output.grains={ at = [] }", "output.figures={ at = [] }"];
    for (file, solver) in [
        ("both/dam-break.toml", Some("mics")),
        ("both/dam-break.toml", Some("mps")),
        ("both/settling-sphere.toml", Some("mics")),
        ("both/settling-sphere.toml", Some("mps")),
        ("templates/dam_break.toml", None),
    ] {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../cases").join(file);
        let mut overrides: Vec<String> = quiet.map(str::to_owned).into();
        overrides.extend(solver.map(|solver| format!("solver={solver}")));
        let loaded = case::load(&path, &overrides).unwrap_or_else(|error| panic!("{error}"));
        let (report, step) = (foretold(&loaded), first_step(&loaded, &folder));
        assert!(agree(&report, &step), "{file} {solver:?}: {:?}, not {step:?}", described(&report));
    }
}

const MICS: &str = r#"
solver = "mics"
gravity = "9.81 m/s^2"
[domain]
size = ["6 mm", "6 mm", "6 mm"]
cells = [12, 12, 12]
[boundary]
x1 = "periodic"
x2 = "periodic"
[dem]
substeps = "auto"
[material.sand]
density = "2650 kg/m^3"
[[liquid]]
region.half_space = { point = ["0 mm", "0 mm", "6 mm"], normal = [0, 0, 1] }
allow_touching_grains = true
[[grains]]
shape.sphere = { diameter = "1.5 mm" }
placement.list = [{ position = ["3 mm", "3 mm", "3 mm"], velocity = ["0 m/s", "0 m/s", "0 m/s"] }]
[output]
fields = { at = [] }
grains = { at = [] }
figures = { at = [] }
[run]
until = "1 s"
"#;

const MPS: &str = r#"
solver = "mps"
gravity = "9.81 m/s^2"
[domain]
size = ["8 mm", "8 mm", "12 mm"]
[boundary]
x1 = "periodic"
x2 = "periodic"
[particles]
spacing = "1 mm"
[material.sand]
density = "2650 kg/m^3"
[contact.default]
restitution = 0.5
[[liquid]]
region.box = { lower = ["0 mm", "0 mm", "0 mm"], upper = ["8 mm", "8 mm", "8 mm"] }
allow_touching_grains = true
[[grains]]
shape.sphere = { diameter = "1 mm" }
placement.list = [{ position = ["4.1 mm", "4.2 mm", "6 mm"], velocity = ["0 m/s", "0 m/s", "0 m/s"] }]
[output]
fields = { at = [] }
grains = { at = [] }
figures = { at = [] }
[run]
until = "1 s"
"#;

/// A case with values drawn by `random`: one of its limits rules the first step.
fn random_case(number: usize, random: &mut impl FnMut() -> Real) -> LoadedCase {
    let mut among = |low: Real, high: Real| low * (high / low).powf(random());
    let speed = among(0.1, 2.0);
    let (base, key) = if number.is_multiple_of(2) { (MICS, "fluid") } else { (MPS, "particles") };
    let mut overrides = vec![
        format!("contact.default.normal_stiffness={:e} N/m", among(1e2, 1e5)),
        format!("contact.default.tangential_stiffness={:e} N/m", among(1e2, 1e5)),
        format!("material.sand.density={} kg/m^3", among(1500.0, 8000.0)),
        format!("gravity={} m/s^2", among(1.0, 50.0)),
    ];
    if number / 2 % 3 < 2 {
        overrides.push(format!("{key}.dt_max={:e} s", among(1e-5, 1e-2)));
    }
    overrides.extend(match number / 2 % 3 {
        0 => vec![format!(
            "grains.0.placement.list.0.velocity=[\"{speed} m/s\", \"{} m/s\", \"0 m/s\"]",
            among(0.1, 2.0)
        )],
        1 => vec![
            format!(
                "fluid.liquid={{ density = \"1000 kg/m^3\", kinematic_viscosity = \"{:e} m^2/s\" }}",
                among(1e-5, 1e-2)
            ),
            if key == "fluid" { "fluid.viscosity=explicit".into() } else { "particles.courant=0.1".into() },
        ],
        _ => vec![format!("{key}.dt={:e} s", among(1e-5, 2e-4))],
    });
    load(base, &overrides.iter().map(String::as_str).collect::<Vec<_>>())
}

#[test]
fn the_first_step_of_random_cases_is_that_of_check() {
    let folder = Scratch::new("first-step-random");
    let mut state = 2015_u64;
    let mut random = move || {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 11) as Real / (1_u64 << 53) as Real
    };
    for number in 0..12 {
        let loaded = random_case(number, &mut random);
        let (report, step) = (foretold(&loaded), first_step(&loaded, &folder));
        assert!(agree(&report, &step), "case {number}: {:?}, not {step:?}", described(&report));
        // Negative control: without the leverage of a sphere's edge, 3.5, the sub-steps are others.
        let contact = step.dt / step.substeps as Real;
        let [normal, tangential] = loaded.case.contacts[0].law.stiffness(0.0);
        if tangential > normal && step.substeps > 2 {
            let without = (step.dt / (contact * 3.5_f64.sqrt())).ceil() as usize;
            assert_ne!(without, step.substeps, "case {number}");
        }
    }
}

/// A liquid that fills a periodic box and moves, with a velocity on top; no grains.
const MOVING: &str = r#"
gravity = "0 m/s^2"
[domain]
size = ["6 mm", "5 mm", "4 mm"]
cells = [12, 10, 8]
[boundary]
x1 = "periodic"
x2 = "periodic"
x3 = "periodic"
[fluid]
dt_max = "10 s"
[[liquid]]
region.box = { lower = ["0 mm", "0 mm", "0 mm"], upper = ["6 mm", "5 mm", "4 mm"] }
velocity = ["1 m/s", "0 m/s", "-0.5 m/s"]
[output]
fields = { at = [] }
figures = { at = [] }
[run]
until = "1 s"
"#;

#[test]
fn the_first_step_with_given_velocities_is_that_of_check() {
    let folder = Scratch::new("first-step-given");
    let still = "liquid.0.velocity=[\"0 m/s\", \"0 m/s\", \"0 m/s\"]";
    let uniform = "fluid.initial_velocity={uniform={velocity=[\"2 m/s\", \"0.3 m/s\", \"0 m/s\"]}}";
    let turning = "fluid.carrying_flow={reversed_vortex={speed=\"1 m/s\",period=\"1 s\"}}";
    let deforming = "fluid.carrying_flow={deformation={speed=\"1 m/s\",period=\"1 s\"}}";
    // Explicit viscosity of honey limits no flow that is given.
    let honey = "fluid.liquid={density=\"1000 kg/m^3\",kinematic_viscosity=\"1 m^2/s\"}";
    for changes in [&[][..], &[uniform], &[turning], &[deforming], &[turning, honey, "fluid.viscosity=explicit"]] {
        let loaded = load(MOVING, changes);
        let (report, step) = (foretold(&loaded), first_step(&loaded, &folder));
        assert!(agree(&report, &step), "{changes:?}: {:?}, not {step:?}", described(&report));
        assert_eq!(step.limiter, "advective");
        // Negative control: without the velocity of the liquid the initial one alone allows a longer step, and that of a
        // flow that is given is not touched.
        let without = foretold(&load(MOVING, &[changes, &[still]].concat())).dt_s;
        let is_given = changes.iter().any(|change| change.contains("carrying"));
        assert!(if is_given { without == report.dt_s } else { without > 1.2 * report.dt_s }, "{changes:?} {without}");
    }
}

/// Steel spheres that settle in water, and boxes that fall through air into it: both speed up from rest.
const SETTLING: &str = r#"
solver = "mics"
[domain]
size = ["12 mm", "12 mm", "36 mm"]
cells = [24, 24, 72]
[run]
until = "0.07 s"
[dem]
substeps = "auto"
[material.steel]
density = "7800 kg/m^3"
[[liquid]]
region.half_space = { point = ["0 mm", "0 mm", "36 mm"], normal = [0, 0, 1] }
allow_touching_grains = true
[[grains]]
material = "steel"
shape.sphere = { diameter = "2 mm" }
placement.list = [{ position = ["4 mm", "4 mm", "33 mm"] }, { position = ["8 mm", "8 mm", "30 mm"] }]
[output]
fields = { at = [] }
grains = { at = [] }
figures = { at = [] }
"#;

#[test]
fn steps_of_a_run_in_which_bodies_speed_up_lie_within_the_range() {
    let falling = [
        "domain.size=[\"16 mm\", \"16 mm\", \"64 mm\"]",
        "domain.cells=[16, 16, 64]",
        "run.until=0.12 s",
        "liquid.0.region.half_space.point=[\"0 mm\", \"0 mm\", \"12 mm\"]",
        "grains.0.shape={ box = { size = [\"4 mm\", \"4 mm\", \"4 mm\"] } }",
        "grains.0.placement.list=[{ position = [\"5 mm\", \"5 mm\", \"60 mm\"] }, \
         { position = [\"11 mm\", \"11 mm\", \"56 mm\"] }]",
    ];
    let folder = Scratch::new("speeding-up");
    for (name, overrides) in [("settling", &[][..]), ("falling", &falling[..])] {
        let loaded = load(SETTLING, overrides);
        let report = foretold(&loaded);
        let steps = start(&loaded, &folder.join(name), On::threads(2)).unwrap_or_else(|error| panic!("{error}")).steps;
        println!("{name}: {} to {} steps foretold, {steps} made", report.steps, report.most_steps);
        assert!((report.steps..=report.most_steps).contains(&(steps as Real)), "{name}: {steps}");
        assert!(report.predicted_most_s >= report.predicted_total_s);
        // Negative control: the step at the start alone foretells far fewer.
        assert!(steps as Real > 1.5 * report.steps, "{name}: {steps}, {}", report.steps);
    }
}
