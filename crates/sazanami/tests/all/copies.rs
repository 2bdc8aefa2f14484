//! The case that a run writes into its folder is a case that `check` accepts and that means the same: of the shipped cases and
//! templates, and of some hundred changed ones.

use std::path::{Path, PathBuf};

use crate::support::{On, Scratch, go_on, start};
use sazanami::case::resolved::{self, Paths};
use sazanami::case::{self, LoadedCase};
use sazanami_numerics::Random;

/// The shipped cases and templates, those of sweeps left out.
fn shipped() -> Vec<PathBuf> {
    let cases = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../cases");
    let folders = ["", "both", "examples", "heap", "raindrop", "ripples", "templates"];
    let files = folders.iter().flat_map(|folder| std::fs::read_dir(cases.join(folder)).expect("a folder of cases"));
    let mut files: Vec<PathBuf> = files.map(|file| file.expect("it is readable").path()).collect();
    files.retain(|file| file.extension().is_some_and(|extension| extension == "toml"));
    files.sort();
    files
}

/// Titles of what is wrong with the copy of a case; nothing if it means the same.
fn wrong_with_copy(loaded: &LoadedCase) -> Vec<String> {
    let text = resolved::write(&loaded.case, Paths::Absolute);
    match case::parse(Path::new("/a run/case.toml"), &text, &[]) {
        Ok(again) if resolved::hash(&again.case) == resolved::hash(&loaded.case) => {
            let of = |loaded: &LoadedCase| {
                let records = loaded.warnings.records(&loaded.source);
                records.iter().map(|record| record.message.clone()).collect::<Vec<_>>()
            };
            let known = of(loaded);
            of(&again).into_iter().filter(|warning| !known.contains(warning)).collect()
        }
        Ok(_) => vec!["it means something else".to_owned()],
        Err(error) => error.diagnostics.records(&error.source).iter().map(|record| record.message.clone()).collect(),
    }
}

/// What may be changed; what does not fit a case is refused and left out.
const CHANGES: &[&str] = &[
    "domain.size=[\"0.5 mm\", \"0.5 mm\", \"0.5 mm\"]",
    "domain.size=[\"40 um\", \"40 um\", \"80 um\"]",
    "domain.size=[\"40 m\", \"20 m\", \"30 m\"]",
    "domain.size=[\"3 km\", \"2 km\", \"1 km\"]",
    "domain.size=[\"24 mm\", \"8 mm\", \"16 mm\"]",
    "domain.lower=[\"432000 m\", \"3921000 m\", \"12 m\"]",
    "domain.lower=[\"-1 mm\", \"-2 mm\", \"-3 mm\"]",
    "gravity=0 m/s^2",
    "gravity=1e-3 m/s^2",
    "gravity=[\"1 m/s^2\", \"0 m/s^2\", \"-9 m/s^2\"]",
    "boundary={ all = \"periodic\" }",
    "boundary={ all = \"slip\", x1 = \"periodic\", x3_upper = \"outflow\" }",
    "boundary={ all = \"no_slip\", x1_upper = { fixed_pressure = { fluid = \"liquid\", pressure = \"30 Pa\" } } }",
    "drive={ mean_velocity = [\"0 m/s\", \"0 m/s\", \"0 m/s\"] }",
    "drive={ mean_velocity = [\"1 cm/s\", \"0 m/s\", \"0 m/s\"], ramp = \"0 s\" }",
    "drive={ acceleration = [\"0 m/s^2\", \"0 m/s^2\", \"9.8 m/s^2\"], acts_by = \"volume\" }",
    "run.until=1 us",
    "run.until=1000 s",
    "run.steps=1",
    "fluid.liquid={ density = \"13500 kg/m^3\", kinematic_viscosity = \"1e-7 m^2/s\" }",
    "fluid.gas={ density = \"900 kg/m^3\", kinematic_viscosity = \"1e-3 m^2/s\" }",
    "fluid.dt_max=10 us",
    "fluid.pressure_form=incremental",
    "bed.porosity_lower=6 mm",
    "output.series={ every = \"3 us\" }",
    "output.fields={ at = [] }",
    "grains=[]",
    "liquid=[]",
    "erosion={}",
    "solver=mps",
    "solver=mics",
];

#[test]
fn copies_of_shipped_and_changed_cases_pass_the_check() {
    let mut random = Random::new(49);
    let mut next = |count: usize| random.bits() as usize % count;
    let mut accepted = 0;
    for file in shipped() {
        let text = std::fs::read_to_string(&file).expect("it is readable");
        let mut changed = vec![Vec::new()];
        changed.extend(CHANGES.iter().map(|change| vec![(*change).to_owned()]));
        changed.extend((0..40).map(|_| (0..1 + next(3)).map(|_| CHANGES[next(CHANGES.len())].to_owned()).collect()));
        for overrides in changed {
            match case::parse(&file, &text, &overrides) {
                Ok(loaded) => {
                    let wrong = wrong_with_copy(&loaded);
                    assert!(wrong.is_empty(), "{}, {overrides:?}: {wrong:#?}", file.display());
                    accepted += 1;
                }
                Err(_) => assert!(!overrides.is_empty(), "{} is not accepted", file.display()),
            }
        }
    }
    assert!(accepted > 300, "{accepted}");
}

#[test]
fn a_copy_that_is_wrong_is_found() {
    let text = "[domain]\nsize = [\"0.5 mm\", \"0.5 mm\", \"0.5 mm\"]\ncells = [5, 5, 5]\n[run]\nuntil = \"1 us\"\n";
    let loaded = case::parse(Path::new("case.toml"), text, &[]).unwrap_or_else(|error| panic!("{error}"));
    assert!(wrong_with_copy(&loaded).is_empty());
    // Negative control: a radius about the axis beyond the box, as it was once written by itself.
    let mut wrong = loaded;
    wrong.case.bed.height_radius = 1e-3;
    assert!(wrong_with_copy(&wrong)[0].contains("height_radius"), "{:?}", wrong_with_copy(&wrong));
}

#[test]
fn runs_in_boxes_of_any_size_go_on() {
    let scratch = Scratch::new("any-box");
    for (name, edge, until) in [("small", "40 um", "1 us"), ("half", "0.5 mm", "0.1 ms"), ("large", "2 km", "10 s")] {
        let text = format!(
            "[domain]\nsize = [\"{edge}\", \"{edge}\", \"{edge}\"]\ncells = [4, 4, 4]\n[[liquid]]\nregion.half_space = {{ point = [\"0 m\", \"0 m\", \"20 um\"] }}\n[run]\nuntil = \"{until}\"\n"
        );
        let loaded = case::parse(Path::new("case.toml"), &text, &[]).unwrap_or_else(|error| panic!("{error}"));
        let folder = scratch.join(name);
        start(&loaded, &folder, On::threads(1).steps(2)).unwrap_or_else(|error| panic!("{name}: {error}"));
        go_on(&folder, On::threads(1)).0.unwrap_or_else(|error| panic!("{name}: {error}"));
    }
}
