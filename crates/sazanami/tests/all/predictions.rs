//! Predictions of `check`, held against the run: its first step, and its steps where bodies speed up.

use std::f64::consts::PI;
use std::path::{Path, PathBuf};

use sazanami::case::{self, LoadedCase};
use sazanami::check::{self, CheckReport};
use sazanami::progress::StepLine;
use sazanami::run::RunOptions;
use sazanami_dem::TangentialForce;
use sazanami_numerics::{Random, Real};

use crate::support::{On, Scratch, foretold, heard, load, owned, start};

/// The first step of a case.
fn first_step(loaded: &LoadedCase, folder: &Scratch) -> StepLine {
    let options = RunOptions { force: true, ..On::threads(2).steps(1).options(Some(&folder.join("run"))) };
    *heard(loaded, &options).lines.iter().find(|line| line.phase == "flow").expect("the flow has made a step")
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

/// All files of cases below `folder`.
fn cases_in(folder: &Path) -> Vec<PathBuf> {
    let entries = std::fs::read_dir(folder).expect("cases are shipped").flatten().map(|entry| entry.path());
    let (folders, files): (Vec<_>, Vec<_>) = entries.partition(|path| path.is_dir());
    let mut cases: Vec<_> =
        files.into_iter().filter(|path| path.extension().is_some_and(|ext| ext == "toml")).collect();
    cases.extend(folders.iter().flat_map(|folder| cases_in(folder)));
    cases.sort();
    cases
}

#[test]
fn the_first_step_of_shipped_cases_without_a_bed_is_that_of_check() {
    let folder = Scratch::new("first-step");
    let mut compared = Vec::new();
    for path in cases_in(&Path::new(env!("CARGO_MANIFEST_DIR")).join("../../cases")) {
        for solver in ["mics", "mps"] {
            let quiet = ["fields", "grains", "figures"].map(|kind| format!("output.{kind}={{ at = [] }}"));
            let overrides = [&quiet[..], &[format!("solver={solver}")]].concat();
            // Few cases are of both solvers.
            let Ok(loaded) = case::load(&path, &overrides) else { continue };
            // Beds are packed first: too long for a test.
            if loaded.case.has_bed() {
                continue;
            }
            let (report, step) = (foretold(&loaded.case), first_step(&loaded, &folder));
            let name = format!("{} {solver}", path.file_name().unwrap_or_default().display());
            assert!(agree(&report, &step), "{name}: {:?}, not {step:?}", described(&report));
            compared.push(name);
        }
    }
    println!("{compared:?}");
    assert!(compared.len() >= 5, "{compared:?}");
}

/// A grain in a box of water, on a grid.
const BASE: &str = include_str!("../cases/predictions-base.toml");

/// The same under a surface and of moving particles.
const PARTICLES: [&str; 8] = [
    "solver=mps",
    "domain.size=[\"8 mm\", \"8 mm\", \"12 mm\"]",
    "domain.cells=[8, 8, 12]",
    "particles.spacing=1 mm",
    "contact.default.restitution=0.5",
    "liquid.0.region={ box = { lower = [\"0 mm\", \"0 mm\", \"0 mm\"], upper = [\"8 mm\", \"8 mm\", \"8 mm\"] } }",
    "grains.0.shape.sphere.diameter=1 mm",
    "grains.0.placement.list.0.position=[\"4.1 mm\", \"4.2 mm\", \"6 mm\"]",
];

/// A case with values drawn by `random`: one of its limits rules the first step.
fn random_case(number: usize, random: &mut impl FnMut() -> Real) -> LoadedCase {
    let mut among = |low: Real, high: Real| low * (high / low).powf(random());
    let speed = among(0.1, 2.0);
    let on_grid = number.is_multiple_of(2);
    let key = if on_grid { "fluid" } else { "particles" };
    let mut overrides: Vec<String> = PARTICLES.iter().filter(|_| !on_grid).map(|text| (*text).to_owned()).collect();
    overrides.extend([
        format!("contact.default.normal_stiffness={:e} N/m", among(1e2, 1e5)),
        format!("contact.default.tangential_stiffness={:e} N/m", among(1e2, 1e5)),
        format!("material.sand.density={} kg/m^3", among(1500.0, 8000.0)),
        format!("gravity={} m/s^2", among(1.0, 50.0)),
    ]);
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
    load(BASE, &overrides.iter().map(String::as_str).collect::<Vec<_>>())
}

#[test]
fn the_first_step_of_random_cases_is_that_of_check() {
    let folder = Scratch::new("first-step-random");
    let mut numbers = Random::new(2015);
    let mut random = move || numbers.unit();
    let mut told_apart = 0;
    for number in 0..12 {
        let loaded = random_case(number, &mut random);
        let (report, step) = (foretold(&loaded.case), first_step(&loaded, &folder));
        assert!(agree(&report, &step), "case {number}: {:?}, not {step:?}", described(&report));
        // Negative control: a sphere that forces across the normal would not turn, of leverage 1 and not 3.5.
        let mass = report.populations[0].mass_kg.expect("a sphere has a mass");
        let [normal, tangential] = loaded.case.contacts[0].law.stiffness();
        let contact =
            TangentialForce::default().substep_factors()[1] * PI * (mass / (2.0 * normal.max(tangential))).sqrt();
        told_apart += usize::from((step.dt / contact).ceil() as usize != step.substeps);
    }
    assert!(told_apart >= 3, "{told_apart}");
}

/// Sub-steps are as long as the error that the case bears lets them be, and `check` says what error it gets.
#[test]
fn sub_steps_follow_the_allowed_error() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../cases/raindrop/quick.toml");
    let with = |overrides: &[&str]| {
        let loaded = case::load(&path, &owned(overrides)).unwrap_or_else(|error| panic!("{error}"));
        let report = foretold(&loaded.case);
        let errors = report.impact_errors.expect("grains move");
        (check::explain(&loaded.case, &report), report.dt_s / report.substeps as Real, errors)
    };
    let [usual, fine, rough] = [&[][..], &["dem.allowed_error=0.001"], &["dem.allowed_error=0.05"]].map(&with);
    let mean = |errors: &check::ImpactReport| errors.restitution.mean.max(errors.spin.mean);
    assert!(mean(&usual.2) < 0.025 && mean(&fine.2) < 0.001 && mean(&rough.2) < 0.05, "{usual:?} {fine:?} {rough:?}");
    assert!(usual.0.contains("error of an oblique impact of the lightest grains"), "{}", usual.0);
    assert!(fine.1 < 0.8 * usual.1 && (1.3..1.7).contains(&(rough.1 / usual.1)), "{usual:?} {fine:?} {rough:?}");
    // Damping, tension and contacts from the sub-step cost accuracy, and the error is that of the case.
    let [damped, pulls] =
        ["contact.\"sand/sand\".normal_damping=13e-3 N s/m", "dem.tension=true"].map(|change| with(&[change]).2);
    assert!(damped.restitution.mean > 5.0 * usual.2.restitution.mean, "{damped:?} {usual:?}");
    assert!(pulls.spin.mean > usual.2.spin.mean, "{pulls:?} {usual:?}");
    // Negative control: contacts from the sub-step keep their old one, and their error.
    assert!(with(&["dem.tangential_force=published"]).2.spin.mean > 0.025);
}

/// Springs softened to a quarter from a third of the run on take two thirds of the sub-steps.
#[test]
fn check_foretells_the_work_of_softer_springs() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../cases/raindrop/quick.toml");
    let grains = |change: &str| {
        let loaded = case::load(&path, &owned(&["run={ until = \"60 ms\" }", change])).unwrap();
        let report = foretold(&loaded.case);
        report.predicted_s.iter().find(|(part, _)| *part == "grains").expect("grains move").1
    };
    let own = grains("dem={}");
    let softened = grains("dem.soften={ from = \"20 ms\", stiffness = 0.25 }");
    assert!((softened / own - 2.0 / 3.0).abs() < 0.05, "{softened} {own}");
    // Negative control: after the end of the run there is nothing to soften.
    assert_eq!(grains("dem.soften={ from = \"70 ms\", stiffness = 0.25 }"), own);
}

/// A liquid that fills a periodic box and moves, with a velocity on top; no grains.
const MOVING: [&str; 8] = [
    "gravity=0 m/s^2",
    "grains=[]",
    "domain.size=[\"6 mm\", \"5 mm\", \"4 mm\"]",
    "domain.cells=[12, 10, 8]",
    "boundary.x3=periodic",
    "fluid.dt_max=10 s",
    "liquid.0.region={ box = { lower = [\"0 mm\", \"0 mm\", \"0 mm\"], upper = [\"6 mm\", \"5 mm\", \"4 mm\"] } }",
    "liquid.0.velocity=[\"1 m/s\", \"0 m/s\", \"-0.5 m/s\"]",
];

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
        let loaded = load(BASE, &[&MOVING, changes].concat());
        let (report, step) = (foretold(&loaded.case), first_step(&loaded, &folder));
        assert!(agree(&report, &step), "{changes:?}: {:?}, not {step:?}", described(&report));
        assert_eq!(step.limiter, "advective");
        // Negative control: without the velocity of the liquid the initial one alone allows a longer step, and that of a
        // flow that is given is not touched.
        let without = foretold(&load(BASE, &[&MOVING[..], changes, &[still]].concat()).case).dt_s;
        let is_given = changes.iter().any(|change| change.contains("carrying"));
        assert!(if is_given { without == report.dt_s } else { without > 1.2 * report.dt_s }, "{changes:?} {without}");
    }
}

#[test]
fn a_drop_in_flight_may_halve_the_first_step() {
    let folder = Scratch::new("first-step-drop");
    let drop = [
        "grains=[]",
        "fluid.dt_max=10 s",
        "liquid.0.region={ sphere = { diameter = \"1.5 mm\" } }",
        "liquid.0.position=[\"3 mm\", \"3 mm\", \"3 mm\"]",
        "liquid.0.velocity=[\"0 m/s\", \"0 m/s\", \"-2 m/s\"]",
    ];
    let loaded = load(BASE, &drop);
    let (report, step) = (foretold(&loaded.case), first_step(&loaded, &folder));
    assert_eq!((step.limiter, described(&report).1), ("advective", "advective"));
    let of_predicted = step.dt / report.dt_s;
    println!("{of_predicted} of the step predicted");
    // Negative control: without what is said the step would be wrong by far.
    assert!((0.45..0.8).contains(&of_predicted), "{of_predicted}");
    let says = |report: &CheckReport| report.limits.iter().any(|limit| limit.rule.contains("about half of that once"));
    assert!(says(&report) && !says(&foretold(&load(BASE, &MOVING).case)));
}

/// Steel spheres that settle in water, and boxes that fall through air into it: both speed up from rest.
const SETTLING: [&str; 7] = [
    "domain.size=[\"12 mm\", \"12 mm\", \"36 mm\"]",
    "domain.cells=[24, 24, 72]",
    "boundary={}",
    "run.until=0.07 s",
    "material.sand.density=7800 kg/m^3",
    "liquid.0.region.half_space.point=[\"0 mm\", \"0 mm\", \"36 mm\"]",
    "grains.0={ shape = { sphere = { diameter = \"3 mm\" } }, \
     placement = { list = [{ position = [\"4 mm\", \"4 mm\", \"33 mm\"] }, { position = [\"8 mm\", \"8 mm\", \"30 mm\"] }] } }",
];

#[test]
fn steps_of_a_run_in_which_bodies_speed_up_lie_within_the_range() {
    let falling = [
        "domain.size=[\"16 mm\", \"16 mm\", \"64 mm\"]",
        "domain.cells=[16, 16, 64]",
        "run.until=0.12 s",
        // With surfaces the gas that the flat faces press out of their way shortens the steps beyond the range.
        "coupling.exchange=stress",
        "liquid.0.region.half_space.point=[\"0 mm\", \"0 mm\", \"12 mm\"]",
        "grains.0.shape={ box = { size = [\"4 mm\", \"4 mm\", \"4 mm\"] } }",
        "grains.0.placement.list=[{ position = [\"5 mm\", \"5 mm\", \"60 mm\"] }, \
         { position = [\"11 mm\", \"11 mm\", \"56 mm\"] }]",
    ];
    // A column of water that collapses and runs along the floor.
    let dam = [
        "grains=[]",
        "domain.size=[\"40 mm\", \"4 mm\", \"20 mm\"]",
        "domain.cells=[40, 4, 20]",
        "run.until=0.1 s",
        "liquid.0.region={ box = { lower = [\"0 mm\", \"0 mm\", \"0 mm\"], upper = [\"10 mm\", \"4 mm\", \"15 mm\"] } }",
    ];
    let folder = Scratch::new("speeding-up");
    for (name, overrides) in [("settling", &[][..]), ("falling", &falling[..]), ("dam", &dam[..])] {
        let loaded = load(BASE, &[&SETTLING, overrides].concat());
        let report = foretold(&loaded.case);
        let steps = start(&loaded, &folder.join(name), On::threads(2)).unwrap_or_else(|error| panic!("{error}")).steps;
        println!("{name}: {} to {} steps predicted, {steps} made", report.steps, report.most_steps);
        assert!((report.steps..=report.most_steps).contains(&(steps as Real)), "{name}: {steps}");
        assert!(report.predicted_most_s >= report.predicted_total_s);
        // Negative control: the step at the start alone predicts far fewer.
        assert!(steps as Real > 1.5 * report.steps, "{name}: {steps}, {}", report.steps);
    }
}

/// A drop over two beads, for 2 ms.
const DROP: &str = include_str!("../cases/predictions-drop.toml");

#[test]
fn outputs_that_end_steps_are_in_the_forecast() {
    let folder = Scratch::new("cadence");
    let steps = |overrides: &[&str]| foretold(&load(DROP, overrides).case).steps;
    let plain = steps(&[]);
    let fine = load(DROP, &["output.series.every=10 us"]);
    let report = foretold(&fine.case);
    assert_eq!((report.steps, report.most_steps), (200.0, 200.0), "one each 10 us; {plain} without");
    assert!(agree(&report, &first_step(&fine, &folder)), "{:?}", described(&report));
    let summary = start(&fine, &folder.join("fine"), On::threads(1)).unwrap();
    assert_eq!(summary.steps as Real, report.steps);
    assert!(report.predicted_total_s > 4.0 * foretold(&load(DROP, &[]).case).predicted_total_s);
    // Listed times and checkpoints too; probes end no step. The negative control: a longer cadence than the step.
    assert!(plain < 20.0, "{plain}");
    assert_eq!(steps(&["checkpoint.every=20 us"]), 100.0);
    assert_eq!(steps(&["output.fields.at=[\"1 us\", \"2 us\"]"]), plain + 2.0);
    assert_eq!(steps(&["probe=[{ point = [\"1 mm\", \"1 mm\", \"1 mm\"], every = \"10 us\" }]"]), plain);
    assert!([plain, plain + 1.0].contains(&steps(&["output.series.every=1 ms"])));
    // More ends of steps than are counted one by one.
    assert_eq!(steps(&["output.series.every=10 us", "run.until=1 s"]), 100_000.0);
}

#[test]
fn surfaces_of_grains_take_the_disk_that_is_foretold() {
    const BALLS: &str = include_str!("../cases/predictions-disk.toml");
    let folder = Scratch::new("disk");
    let sets: [&[&str]; 3] = [
        &[],
        &["grains.0.shape.sphere.refinement=1", "output.grain_arrays=[]"],
        &["grains.0.shape={ spheroid = { diameter = \"0.6 mm\", length = \"1 mm\" } }"],
    ];
    let foretold = sets.map(|set| {
        let loaded = load(BALLS, set);
        let run = folder.join("run");
        let options = RunOptions { force: true, ..On::threads(1).options(Some(&run)) };
        heard(&loaded, &options);
        let files = std::fs::read_dir(run.join("grains")).expect("grains are written").flatten();
        let written: u64 = files.map(|file| file.metadata().expect("it is a file").len()).sum();
        let parts = foretold(&loaded.case).disk_parts;
        let (_, bytes) = parts.into_iter().find(|(name, _)| *name == "grains").expect("grains are a part");
        println!("{set:?}: {bytes} of {written} bytes are foretold");
        assert!((0.8..1.25).contains(&(bytes / written as Real)), "{set:?}: {bytes} of {written}");
        bytes
    });
    // Negative control: what holds one of them does not hold the others.
    assert!(foretold[0] > 3.0 * foretold[1], "{foretold:?}");
}

#[test]
fn profiles_of_the_water_take_the_disk_that_is_foretold() {
    let dam = include_str!("../../../../cases/both/dam-break.toml");
    let keys = ["solver=mps", "run.steps=40", "output.series={ steps = 1 }"];
    let folder = Scratch::new("disk-profiles");
    let run = folder.join("run");
    let loaded = load(dam, &keys);
    heard(&loaded, &On::threads(2).options(Some(&run)));
    let size = |name: &str| std::fs::metadata(run.join(name)).expect("it is a file").len() as Real;
    let (series, profiles) = (size("series.csv"), size("water.csv"));
    let (_, bytes) = foretold(&loaded.case).disk_parts.into_iter().find(|(name, _)| *name == "series").expect("a part");
    assert!((0.6..1.6).contains(&(bytes / (series + profiles))), "{bytes} for {series} and {profiles}");
    // Negative control: the rows of the series alone are a small part of it.
    assert!(series < 0.4 * bytes, "{series} of {bytes}");
}
