//! Case files: what is shipped can be read, resolved copies mean the same, and what is wrong is named.

mod defaults;
mod feasibility;

use std::path::{Path, PathBuf};

use sazanami_dem::TangentialForce;
use sazanami_posing::case::meaning::{
    BoundarySide, Case, Damping, Exchange, GrainPlacement, GrainShape, Placement, Preset, PressureForm, Region,
    StepChoice, Substeps, ViscosityScheme,
};
use sazanami_posing::case::resolved::{self, Paths};
use sazanami_posing::case::{self, CaseError, LoadedCase};

fn cases() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../../cases")
}

/// All shipped cases; plans of sweeps are none.
fn shipped() -> Vec<PathBuf> {
    let entries = |folder: &Path| -> Vec<PathBuf> {
        let entries = std::fs::read_dir(folder).expect("the cases are shipped");
        entries.map(|entry| entry.expect("a folder can be listed").path()).collect()
    };
    let folders = entries(&cases()).into_iter().filter(|path| path.is_dir() && !path.ends_with("sweeps"));
    let files = std::iter::once(cases()).chain(folders).flat_map(|folder| entries(&folder));
    files.filter(|path| path.extension().is_some_and(|extension| extension == "toml")).collect()
}

/// Reads a text as a case.
fn read(text: &str, overrides: &[&str]) -> Result<LoadedCase, Box<CaseError>> {
    let overrides: Vec<String> = overrides.iter().map(|text| (*text).to_owned()).collect();
    case::parse(Path::new("c.toml"), text, &overrides)
}

fn case_of(text: &str, overrides: &[&str]) -> Case {
    read(text, overrides).unwrap_or_else(|error| panic!("{error}")).case
}

/// Titles and labels of what is wrong with a text.
fn findings(text: &str, overrides: &[&str]) -> Vec<String> {
    match read(text, overrides) {
        Ok(_) => Vec::new(),
        Err(error) => error
            .diagnostics
            .records(&error.source)
            .iter()
            .map(|r| format!("{}:{} {}", r.file, r.line.unwrap_or(0), r.message))
            .collect(),
    }
}

const SMALL: &str = "[domain]\nsize = [\"1 mm\", \"1 mm\", \"2 mm\"]\ncells = [4, 4, 8]\n[run]\nuntil = \"1 ms\"\n";

/// A case that uses nearly everything there is.
const RICH: &str = include_str!("../../cases/case-files-rich.toml");

fn assert_same_when_resolved(case: &Case) {
    let text = resolved::write(case, Paths::Absolute);
    let path = Path::new("/somewhere/else/case.toml");
    let again = case::parse(path, &text, &[]).unwrap_or_else(|error| panic!("{error}\n{text}")).case;
    // Paths are made absolute in the copy: compare what they are made of.
    assert_eq!(resolved::write(&again, Paths::Absolute), text);
    assert_eq!(resolved::hash(&again), resolved::hash(case));
}

#[test]
fn resolved_copies_mean_the_same() {
    for text in [SMALL, RICH] {
        let case = case_of(text, &[]);
        assert_same_when_resolved(&case);
        let again = case_of(&resolved::write(&case, Paths::NameOnly), &[]);
        assert_eq!(again, case);
    }
    let literal = case_of(RICH, &["preset=paper_literal"]);
    assert_same_when_resolved(&literal);
}

#[test]
fn the_hash_sees_every_change() {
    let hash = |overrides: &[&str]| resolved::hash(&case_of(RICH, overrides));
    let base = hash(&[]);
    for change in
        ["title=other", "grains.0.seed=8", "fluid.cfl=0.31", "liquid.1.fall.speed=3.1 m/s", "checkpoint.keep=4"]
    {
        assert_ne!(hash(&[change]), base, "{change}");
    }
    assert_eq!(hash(&["domain.lower=[\"-1e-3 m\", \"0 m\", \"0 m\"]"]), base);
}

#[test]
fn values_mean_what_they_say() {
    let case = case_of(RICH, &[]);
    assert_eq!(case.domain.lower.x, -1e-3);
    assert_eq!(case.boundary[0], [BoundarySide::Periodic; 2]);
    assert_eq!(case.boundary[2][0], BoundarySide::NoSlip);
    assert_eq!(case.fluid.liquid.viscosity, 1.002e-3);
    assert_eq!(case.fluid.gas.viscosity, 1.2 * 1.5e-5);
    assert_eq!(case.fluid.step, StepChoice::Adaptive { longest: 1e-4, first: 1e-4, growth: 1.1 });
    assert_eq!(case.fluid.viscosity, ViscosityScheme::Explicit);
    assert_eq!(case.dem.substeps, Substeps::Fixed(40));
    assert_eq!(case.dem.grain_walls, [[false, false], [true, false], [true, false]]);
    let drop = &case.liquids[1];
    assert_eq!(drop.placement, Placement::AboveBed { height: 0.3e-3, to_bottom: true, offset: [1e-3, -1e-3] });
    assert!((drop.velocity.length() - 3.0).abs() < 1e-14 && drop.velocity.z < -2.8);
    let law = |a, b| *case.contact(a, b).unwrap_or_else(|| panic!("a spring and dashpot between {a} and {b}"));
    assert_eq!(law("oak wood", "sand").damping, Damping::Restitution(0.35));
    let wall = law("sand", "wall");
    assert_eq!((wall.normal_stiffness, wall.friction, wall.damping), (2e4, 0.3, Damping::Restitution(0.5)));
    assert_eq!(wall.tangential_force, TangentialForce::Published);
    assert_eq!(case.grains[2].count, Some(2));
    assert_eq!(case.grains[0].mass_override, None);
    assert!(case.grains[0].sizes().largest() > 1.3);
    assert_eq!(case.output.fields.at, [0.1e-3, 0.3e-3]);
    assert_eq!(case.erosion.as_ref().map(|e| (e.dx, e.grain_size)), Some((1e-3, 0.52e-3)));
    assert_eq!(case.checkpoint.every_wall, None);
    let still = case.effective_gravity([0.0; 2]);
    assert!((still.x - (-0.1 - 2.0 * 30_f64.to_radians().sin())).abs() < 1e-15);
}

#[test]
fn liquids_fall_as_they_are_told() {
    let text = format!(
        "{SMALL}[[liquid]]\nregion.sphere = {{ diameter = \"0.5 mm\" }}\nposition = [\"0.5 mm\", \"0.5 mm\", \"1 mm\"]\nfall.speed = \"9 m/s\"\n"
    );
    let velocity = |overrides: &[&str]| case_of(&text, overrides).liquids[0].velocity.to_array();
    assert_eq!(velocity(&[]), [0.0, 0.0, -9.0]);
    assert_eq!(velocity(&["liquid.0.fall.speed=2.25 m/s"]), [0.0, 0.0, -2.25]);
    let flat = case_of(
        &text,
        &["liquid.0.region={ spheroid = { horizontal_diameter = \"0.648 mm\", vertical_diameter = \"0.404 mm\" } }"],
    );
    assert!(matches!(flat.liquids[0].region, Region::Spheroid { horizontal_diameter: 0.648e-3, .. }));
}

#[test]
fn the_literal_preset_follows_the_letter() {
    let plain = SMALL.to_owned()
        + "[material.sand]\ndensity = \"2650 kg/m^3\"\n[[grains]]\ncount = 2\nshape.spheroid = { diameter = \"0.52 mm\", length = \"1.27 mm\" }\nplacement.packed = {}\n";
    let literal = case_of(&plain, &["preset=paper_literal"]);
    assert_eq!(literal.preset, Preset::PaperLiteral);
    assert_eq!(literal.coupling.exchange, Exchange::Stress);
    assert_eq!(literal.fluid.step, StepChoice::Fixed(1e-5));
    assert_eq!(
        (literal.fluid.pressure_form, literal.fluid.viscosity),
        (PressureForm::Incremental, ViscosityScheme::CrankNicolson)
    );
    assert_eq!(literal.dem.substeps, Substeps::Fixed(325));
    assert_eq!(literal.grains[0].mass_override, Some(1.93e-7));
    assert!(literal.contacts.iter().all(|pair| pair.law.tension));
    // What the case says itself stands above the preset.
    let mixed = case_of(
        &plain,
        &["preset=paper_literal", "coupling.exchange=surface", "fluid.convection=consistent", "fluid.dt_max=1 ms"],
    );
    assert_eq!(mixed.coupling.exchange, Exchange::Surface);
    assert!(matches!(mixed.fluid.step, StepChoice::Adaptive { .. }));
    let recommended = case_of(&plain, &[]);
    assert_eq!((recommended.coupling.exchange, recommended.grains[0].mass_override), (Exchange::Surface, None));
}

#[test]
fn the_preset_is_explained_line_by_line() {
    let page = std::fs::read_to_string(cases().join("../docs/paper-literal.md")).expect("the page is there");
    let keys = case::reference::literal_keys();
    assert!(keys.len() >= 15, "{} keys", keys.len());
    for (path, key) in keys {
        let literal = key.literal.expect("the preset sets it");
        assert!(page.contains(&format!("| `{path}` |")) && page.contains(literal.reason), "{path} is not explained");
    }
}

#[test]
fn shipped_cases_can_be_read() {
    let shipped = shipped();
    for path in &shipped {
        match case::load(path, &[]) {
            Ok(loaded) => assert_same_when_resolved(&loaded.case),
            // A shipped bed may not have been made yet; the message then says how.
            Err(error) => {
                let records = error.diagnostics.records(&error.source);
                assert!(records.iter().all(|r| r.message.starts_with("there is no bed file")), "{error}");
                assert!(records.iter().all(|r| r.suggestion.as_ref().is_some_and(|s| s.contains("sazanami run"))));
            }
        }
    }
    assert!(shipped.len() >= 24, "{} cases", shipped.len());
}

#[test]
fn several_mistakes_are_told_together() {
    let text = "densty = 1\n[domain]\nsize = [\"1 mm\", \"1 mm\", 3]\ncells = [4, 0, 8]\n[fluid]\nviscosity = \"implicitt\"\ncfl = 0.7\n[fluid.gas]\ndensity = \"-1 kg/m^3\"\nkinematic_viscosity = \"1e-5 m/s\"\n[run]\nuntill = \"1 s\"\n";
    assert_eq!(
        findings(text, &["fluid.tol_div=1 mm", "nowhere.at.all=3"]),
        [
            "c.toml:1 unknown key `densty`",
            "c.toml:3 `size` needs a unit",
            "c.toml:4 `cells` has to be 1 or more",
            "c.toml:6 `implicitt` is not a choice for `viscosity`",
            "c.toml:7 `cfl` has to lie between 0.001 and 0.499",
            "c.toml:9 `density` has to be above zero",
            "c.toml:10 `kinematic_viscosity` has the wrong unit",
            "c.toml:12 unknown key `untill`",
            "--set:1 `tol_div` is not a number",
            "--set:1 unknown key `nowhere`",
        ]
    );
}

#[test]
fn wrong_tables_are_named_and_the_rest_is_still_read() {
    let text = "solver = 3\ngrains = 4\n[domain]\nsize = \"1 mm\"\ncells = [4, 4, 8]\n[[liquid]]\nregion = { sphere = { diameter = \"1 mm\" }, box = {} }\n[[liquid]]\nregion = { shpere = { diameter = \"1 mm\" } }\n[run]\nuntil = \"-1 s\"\n[boundary]\nx1_lower = \"slipp\"\n";
    let found = findings(text, &[]);
    for expected in [
        "c.toml:1 `solver` is not a word",
        "c.toml:2 `grains` cannot be read",
        "c.toml:4 `size` is not a list",
        "c.toml:7 exactly one alternative has to be chosen here",
        "c.toml:9 unknown choice `shpere`",
        "c.toml:11 `until` must not be negative",
        "c.toml:13 unknown choice `slipp`",
    ] {
        assert!(found.iter().any(|f| f == expected), "{expected} is not among {found:#?}");
    }
}

#[test]
fn what_contradicts_itself_is_refused() {
    let refused = |extra: &str, expected: &str| {
        let found = findings(&format!("{SMALL}{extra}"), &[]);
        assert!(found.iter().any(|f| f.contains(expected)), "{expected} is not among {found:#?}");
    };
    refused("[boundary]\nx1_lower = \"periodic\"\n", "the side x1_lower is periodic, the opposite one is not");
    refused(
        "[boundary]\nx1_lower = { inflow = { velocity = [\"1 m/s\", \"0 m/s\", \"0 m/s\"] } }\n",
        "that it cannot leave",
    );
    refused(
        "[boundary]\nx3_lower = { moving = { velocity = [\"0 m/s\", \"0 m/s\", \"1 m/s\"] } }\n",
        "moves out of its plane",
    );
    refused("[fluid]\ndt = \"1 us\"\ndt_max = \"1 ms\"\n", "a fixed step has no limits of its own");
    refused(
        "[fluid.liquid]\ndensity = \"0.1 kg/m^3\"\nkinematic_viscosity = \"1 St\"\n",
        "the gas is heavier than the liquid",
    );
    refused(
        "[[liquid]]\nregion.sphere = { diameter = \"1 mm\" }\nabove_bed = \"1 mm\"\n",
        "there is no bed to be above",
    );
    refused(
        "[[liquid]]\nregion.sphere = { diameter = \"0.5 mm\" }\nposition = [\"5 mm\", \"5 mm\", \"5 mm\"]\n",
        "`liquid 0` lies outside the box",
    );
    refused("[material.sand]\ndensity = \"1 kg/m^3\"\n[contact.\"sand/snad\"]\n", "there is no material `snad`");
    let sand = "[material.sand]\ndensity = \"2650 kg/m^3\"\n[[grains]]\nshape.sphere = { diameter = \"0.2 mm\" }\n";
    refused(&format!("{sand}placement.packed = {{}}\n"), "`count` is missing");
    refused(&format!("{sand}placement.list = [{{ position = [\"0 mm\", \"0 mm\", \"3 mm\"] }}]\n"), "outside the box");
    refused(&format!("{sand}material = \"sond\"\nplacement.list = []\n"), "there is no material `sond`");
    refused(&format!("{sand}contact_spheres = \"axis(9)\"\nplacement.list = []\n"), "need a prolate spheroid");
    refused(
        &format!(
            "{sand}placement.packed = {{}}\ncount = 3\n[[liquid]]\nregion.sphere = {{ diameter = \"1 mm\" }}\nabove_bed = \"0.4 mm\"\n"
        ),
        "the liquid begins within the bed",
    );
    refused("[run2]\n", "unknown key `run2`");
    refused("[[probe]]\npoint = [\"1 m\", \"0 m\", \"0 m\"]\n", "lies outside the box");
    let probe = |name: &str| format!("[[probe]]\nname = \"{name}\"\npoint = [\"0 m\", \"0 m\", \"0 m\"]\n");
    refused(&probe("../../escaped"), "`name` cannot be the name of a file");
    refused(&(probe("same") + &probe("same")), "two probes have the name `same`");
}

#[test]
fn placements_and_shapes_are_read() {
    let case = case_of(RICH, &[]);
    assert!(matches!(case.grains[0].shape, GrainShape::Spheroid { rings: 7, segments: 6, .. }));
    let GrainPlacement::List(list) = &case.grains[2].placement else { panic!("the grains are listed") };
    assert!((list[1].orientation.length() - 1.0).abs() < 1e-15);
    assert!((list[0].orientation.to_axis_angle().1 - 10_f64.to_radians()).abs() < 1e-15);
    let GrainPlacement::Packed(packing) = &case.grains[0].placement else { panic!("the grains are packed") };
    assert_eq!((packing.fall_gravity, packing.settle_time), (4.0, 5e-3));
}

#[test]
fn texts_about_keys_have_no_links_of_the_code() {
    let page = sazanami_posing::case::reference::page();
    assert!(!page.contains("[`RESOLVED`]") && !page.contains("[`Self"), "links of rustdoc in the reference");
    let links =
        page.match_indices("[`").filter(|(at, _)| !page[*at..].split(']').nth(1).is_some_and(|t| t.starts_with('(')));
    assert_eq!(links.count(), 0, "links of rustdoc in the reference");
}
