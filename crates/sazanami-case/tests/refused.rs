//! Values that can be written and that nobody can mean are refused, each by one clear finding.

use std::path::Path;

use sazanami_case::key::{DefaultDoc, KeyDoc};
use sazanami_case::meaning::GrainPlacement;
use sazanami_case::{Explained, Keys, explain};

const BASE: &str = include_str!("cases/refused-base.toml");

/// Titles and suggestions of what is wrong with the case when these values are laid over it.
fn findings(overrides: &[&str]) -> Vec<String> {
    findings_of(BASE, overrides)
}

fn findings_of(base: &str, overrides: &[&str]) -> Vec<String> {
    let overrides: Vec<String> = overrides.iter().map(|text| (*text).to_owned()).collect();
    match sazanami_case::parse(Path::new("c.toml"), base, &overrides) {
        Ok(_) => Vec::new(),
        Err(error) => {
            let records = error.diagnostics.records(&error.source);
            records.iter().map(|r| format!("{} | {}", r.message, r.suggestion.clone().unwrap_or_default())).collect()
        }
    }
}

fn refused(change: &str, words: &str) {
    let found = findings(&[change]);
    assert!(found.len() == 1 && found[0].contains(words), "{change}: {found:#?}");
}

/// Water of moving particles over spheres.
const TANK: &str = r#"
solver = "mps"
gravity = "0 m/s^2"
domain.size = ["8 mm", "8 mm", "8 mm"]
boundary.all = "periodic"
particles.spacing = "1 mm"
fluid.liquid = { density = "1000 kg/m^3", kinematic_viscosity = "1e-6 m^2/s" }
material.sand.density = "2650 kg/m^3"
contact.default.normal_stiffness = "400 N/m"
run.until = "1 ms"
[[liquid]]
region.box = { lower = ["0 mm", "0 mm", "0 mm"], upper = ["8 mm", "8 mm", "8 mm"] }
[[grains]]
shape.sphere.diameter = "1 mm"
placement.lattice = { counts = [5, 5, 5] }
"#;

#[test]
fn a_box_without_extent_is_refused_for_that_alone() {
    for base in [BASE, TANK] {
        assert!(findings_of(base, &[]).is_empty(), "{:#?}", findings_of(base, &[]));
        for size in [["8 mm", "8 mm", "-8 mm"], ["8 mm", "0 mm", "8 mm"]] {
            let found = findings_of(base, &[&format!("domain.size={size:?}")]);
            assert!(found.len() == 1 && found[0].contains("the box has no extent"), "{size:?}: {found:#?}");
        }
    }
}

#[test]
fn lengths_of_what_is_observed_are_bounded_by_the_box() {
    assert!(findings(&[]).is_empty(), "{:#?}", findings(&[]));
    refused("erosion.r_max=45 m", "`r_max` has to lie between");
    refused("erosion.r_max=1e9 m", "`r_max` has to lie between");
    refused("bed.height_radius=1 m", "`height_radius` has to lie between");
    assert!(findings(&["erosion.r_max=4.9 mm"]).is_empty());
    let axis = |x: &str, y: &str, shape: &str| {
        findings(&[&format!("heap.axis=[\"{x}\", \"{y}\"]"), &format!("heap.shape={shape}")])
    };
    let is_outside =
        |found: Vec<String>| found.len() == 1 && found[0].contains("the axis of the heap lies outside the box");
    assert!(is_outside(axis("11 mm", "5 mm", "cone")) && is_outside(axis("5 mm", "-1 mm", "cone")));
    assert!(is_outside(axis("-0.1 mm", "5 mm", "ridge")));
    refused("bed.axis=[\"11 mm\", \"5 mm\"]", "the axis of the bed lies outside the box");
    refused("erosion.axis=[\"5 mm\", \"-1 mm\"]", "the axis of the crater lies outside the box");
    assert!(findings(&["bed.axis=[\"0 mm\", \"10 mm\"]"]).is_empty());
    // A ridge stands along the whole of x2, and a heap may lean on a wall.
    assert!(axis("0 mm", "50 mm", "ridge").is_empty() && axis("10 mm", "0 mm", "cone").is_empty());
}

#[test]
fn numbers_at_the_edge_of_meaning_are_refused() {
    refused("run.until=-0.0 s", "`until` must not be negative");
    refused("grains.0.shape.sphere.diameter=1e-300 mm", "`diameter` has to lie between");
    assert!(findings(&["run.until=0 s"]).is_empty());
}

#[test]
fn names_of_probes_fit_into_names_of_files() {
    refused(&format!("probe.0.name={}", "x".repeat(300)), "`name` is too long for the name of a file");
    assert!(findings(&[&format!("probe.0.name={}", "x".repeat(100))]).is_empty());
}

#[test]
fn an_unknown_shape_is_one_error() {
    refused("grains.0.shape={ shpere = { diameter = \"1 mm\" } }", "unknown choice `shpere`");
    refused("grains.0.shape={}", "exactly one alternative");
}

#[test]
fn keys_and_words_of_earlier_versions_are_refused_with_what_took_their_place() {
    let found = findings(&["overlap.sphere_drag=dalla_valle"]);
    assert_eq!(found.len(), 1, "{found:#?}");
    assert!(
        found[0].starts_with("`sphere_drag` is no longer a key | ") && found[0].contains("di_felice"),
        "{found:#?}"
    );
    assert!(matches!(explain("overlap.sphere_drag"), Explained::Text(text) if text.contains("di_felice")));
    refused("coupling.friction=distance", "`friction` is no longer a key");
    refused("coupling.alpha=columns(8)", "`alpha` is no longer a key | covered volumes are those of n x n columns");
    refused("coupling.exchange=exact", "`exact` is no longer a choice");
    refused("fluid.carrying_flow={ rotation = {} }", "`rotation` is no longer a choice");
    refused("particles={ spacing = \"1 mm\", weight = \"c2\" }", "`weight` is no longer a key | the weight is");
    let stabilised = "particles={ spacing = \"1 mm\", projection = \"enhanced\", stabilisation = \"off\" }";
    refused(stabilised, "`stabilisation` is no longer a key | `projection = \"enhanced\"` is stabilised as published");
    refused("dem.rolling=constant_torque", "`rolling` is no longer a key | a `rolling_friction` above 0 resists");
    refused("dem.contact_start=sub_step", "`contact_start` is no longer a key | `tangential_force` chooses");
    refused("dem.damping=restitution", "`damping` is no longer a key | coefficients or the restitution");
    refused("contact.default.damping=restitution", "`damping` is no longer a key | coefficients");
    // What such a key says of the case without it is only warned of.
    assert!(
        findings(&["dem={ rolling = \"constant_torque\", rolling_friction = 0.1, history = \"length_kept\" }"])
            .is_empty()
    );
    refused("dem={ rolling = \"none\", rolling_friction = 0.1 }", "`rolling` is no longer a key");
    assert!(
        findings(&["dem.slip_direction=velocity", "preset=paper_literal"])
            .iter()
            .all(|f| !f.contains("slip_direction"))
    );
    refused("dem={ slip_direction = \"velocity\" }", "`slip_direction` is no longer a key");
    assert!(findings(&["contact.default={ damping = \"restitution\", restitution = 0.5 }"]).is_empty());
    refused("contact.default={ damping = \"literal\", restitution = 0.5 }", "`damping` is no longer a key");
    // Keys with another name now, likewise.
    let of = |overrides: &[&str], key: &str| findings(overrides).into_iter().filter(|f| f.contains(key)).count();
    assert_eq!(of(&["overlap.exchange=lagged"], "exchange"), 0);
    refused("overlap.exchange=implicit", "`exchange` is no longer a key | the key is `drag_integration`");
    refused("overlap={ exchange = \"lagged\", drag_integration = \"implicit\" }", "`exchange` is no longer a key");
    for (word, other) in [("full", "incremental"), ("incremental", "full")] {
        let [kept, gone] = [word, other].map(|word| format!("fluid.projection={word}"));
        let preset = if word == "full" { "recommended" } else { "paper_literal" };
        let preset = format!("preset={preset}");
        assert_eq!([of(&[&kept, &preset], "`projection`"), of(&[&gone, &preset], "`projection`")], [0, 1], "{preset}");
    }
    refused("fluid.projection=incremental", "`projection` is no longer a key | the key is `pressure_form`");
    refused("fluid.viscosity=crank_nicolson", "Crank-Nicolson with the full pressure");
    assert!(findings(&["fluid={ viscosity = \"crank_nicolson\", pressure_form = \"incremental\" }"]).is_empty());
    // Controls: a key and a word that never were.
    refused("overlap.sphere_dragg=dalla_valle", "unknown key `sphere_dragg`");
    refused("coupling.exchange=exactt", "`exactt` is not a choice for `exchange`");
}

#[test]
fn every_key_is_explained_and_misspelt_ones_lead_to_it() {
    let text = |path: &str| match explain(path) {
        Explained::Text(text) => text,
        unknown => panic!("{path}: {unknown:?}"),
    };
    let convection = text("fluid.convection");
    for words in ["velocity_form", "paper_literal", "written for the velocity"] {
        assert!(convection.contains(words), "{words} is not in {convection}");
    }
    assert!(text("grains.0.placement.packed.level").contains("above zero"));
    assert!(text("contact.sand/sand.friction").contains("0 to 10"));
    assert!(text("r_max").contains("erosion.r_max"));
    assert!(text("").contains("ripples"));
    assert!(text("contact.sand/sand.damping_ratio").contains("sqrt(K_t/K_n)"));
    let meant = |path: &str| match explain(path) {
        Explained::Unknown { meant, .. } => meant,
        known => panic!("{path}: {known:?}"),
    };
    assert_eq!(meant("fluid.viscosty"), Some("fluid.viscosity".into()));
    assert_eq!(meant("erosion.rmax"), Some("erosion.r_max".into()));
    assert_eq!(meant("zzzzzzzz"), None);
    // What stands for a name below a named table is one: a misspelt key is not.
    assert!(text("contact.default").contains("stiffness") && text("contact.NAME.friction").contains("0 to 10"));
    assert_eq!(meant("contact.stiffnes"), Some("contact.normal_stiffness".into()));
    assert_eq!(meant("contact.frictoin"), Some("contact.friction".into()));
    assert!(text("material.sand.density").contains("kg/m^3"));
    assert_eq!(meant("material.densty"), Some("material.density".into()));
}

#[test]
fn the_constants_that_contacts_are_said_to_have_are_those_they_have() {
    let case = |default: &str| {
        let text = BASE.replace("[[grains]]", &format!("[contact.default]\n{default}\n[[grains]]"));
        sazanami_case::parse(Path::new("c.toml"), &text, &[]).unwrap_or_else(|error| panic!("{error}")).case
    };
    let said = |key: &str| match sazanami_case::meaning::Contacts::docs().keys.into_iter().find(|doc| doc.name == key) {
        Some(KeyDoc { default: DefaultDoc::Text(text), unit: Some(_), .. }) => format!("{key} = \"{text}\""),
        Some(KeyDoc { default: DefaultDoc::Text(text), .. }) => format!("{key} = {text}"),
        other => panic!("{key}: {other:?}"),
    };
    let plain = case("");
    for key in ["normal_stiffness", "normal_damping", "friction"] {
        assert_eq!(case(&said(key)).contacts, plain.contacts, "{key}");
    }
    let restitution = "damping_ratio = 1.0\n";
    assert_eq!(case(&format!("{restitution}{}", said("restitution"))).contacts, case(restitution).contacts);
    // Negative control: another value makes another contact.
    assert_ne!(case("normal_stiffness = \"2e4 N/m\"").contacts, plain.contacts);
}

#[test]
fn cylinders_have_a_size_a_volume_and_contact_spheres() {
    let case = |spheres: &str| {
        let shape = "grains.0.shape={ cylinder = { diameter = \"0.5 mm\", length = \"1 mm\" } }";
        sazanami_case::parse(Path::new("c.toml"), BASE, &[shape.into(), format!("grains.0.contact_spheres={spheres}")])
    };
    let grain = case("axis(5)").expect("cylinders have an axis").case.grains.remove(0);
    assert_eq!(grain.shape.size(), Some(0.5e-3));
    let volume = std::f64::consts::PI * 0.25e-3_f64.powi(2) * 1e-3;
    assert!((grain.shape.volume().expect("a known volume") / volume - 1.0).abs() < 1e-14);
    assert!((grain.shape.extent().expect("a known extent") - 1.25_f64.sqrt() * 1e-3).abs() < 1e-15);
    assert!(case("shell(40)").is_ok() && case("single").is_err());
}

#[test]
fn parameters_of_another_drag_law_bring_a_warning() {
    let water = "particles.spacing=0.625 mm";
    let read = |changes: &[&str]| {
        let overrides: Vec<String> = changes.iter().chain(&[water]).map(|text| (*text).to_owned()).collect();
        sazanami_case::parse(Path::new("c.toml"), BASE, &overrides).expect("the case is complete")
    };
    let titles = |changes: &[&str]| {
        let loaded = read(changes);
        let records = loaded.warnings.records(&loaded.source);
        records.into_iter().map(|record| record.message).filter(|title| title.contains("no effect")).collect::<Vec<_>>()
    };
    assert!(titles(&["overlap.drag=di_felice"]).is_empty() && titles(&["overlap.kozeny=180"]).is_empty());
    let warned = titles(&["overlap.drag=di_felice", "overlap.kozeny=180"]);
    assert_eq!(warned, ["`kozeny` has no effect with `drag = \"di_felice\"`"]);
    let copy = sazanami_case::resolved::write(
        &read(&["overlap.drag=di_felice"]).case,
        sazanami_case::resolved::Paths::NameOnly,
    );
    assert!(copy.contains("drag = \"di_felice\"") && !copy.contains("kozeny"), "{copy}");
    refused("overlap.drag=stokes", "`drag`");
    let warned = titles(&["overlap.drag=beetstra", "overlap.kozeny=180"]);
    assert_eq!(warned, ["`kozeny` has no effect with `drag = \"beetstra\"`"]);
}

#[test]
fn films_are_for_spheres_and_end_above_the_roughness() {
    let base = BASE.replace("[erosion]\n", "");
    let with = |changes: &[&str]| findings_of(&base, &[&["solver=mps", "particles.spacing=0.5 mm"], changes].concat());
    assert!(with(&["dem.film_roughness=1 um"]).is_empty(), "{:?}", with(&["dem.film_roughness=1 um"]));
    let found = with(&["dem.film_roughness=30 um"]);
    assert!(found.len() == 1 && found[0].contains("the film ends within the roughness"), "{found:?}");
    assert!(
        with(&["dem.film_roughness=20 um"]).is_empty()
            && with(&["dem.film_roughness=30 um", "dem.film_reach=0.2"]).is_empty()
    );
    assert!(findings(&["dem.film_roughness=1 um"]).is_empty(), "{:?}", findings(&["dem.film_roughness=1 um"]));
    refused("dem.film_roughness=1 mm", "the film ends within the roughness");
    let found = with(&["dem.film_roughness=1 um", "dem.film_reach=2"]);
    assert!(found.len() == 1 && found[0].contains("`film_reach` has to lie between"), "{found:?}");
    let found = with(&["dem.film_roughness=0 m"]);
    assert!(found.len() == 1 && found[0].contains("`film_roughness`"), "{found:?}");
}

#[test]
fn copies_of_cases_are_cases_of_the_same_meaning() {
    let same = |changes: &[&str]| {
        let overrides: Vec<String> = changes.iter().map(|text| (*text).to_owned()).collect();
        let text = BASE.replace("[erosion]\n", "");
        let case = sazanami_case::parse(Path::new("c.toml"), &text, &overrides).expect("the case is complete").case;
        let copy = sazanami_case::resolved::write(&case, sazanami_case::resolved::Paths::NameOnly);
        let again =
            sazanami_case::parse(Path::new("c.toml"), &copy, &[]).unwrap_or_else(|error| panic!("{error}")).case;
        assert_eq!(again, case, "{copy}");
    };
    same(&[]);
    same(&["output.grain_form=points", "output.grain_arrays=[\"id\", \"mass\"]", "output.grains.every=1 ms"]);
    same(&["grains.0.shape={ cylinder = { diameter = \"0.5 mm\", length = \"1 mm\", segments = 12 } }"]);
    same(&["fluid.initial_velocity={ taylor_green = { speed = \"1 m/s\" } }"]);
    same(&["fluid.initial_velocity={ uniform = { velocity = [\"1 m/s\", \"0 m/s\", \"0 m/s\"] } }"]);
    let flow = "fluid.carrying_flow={ deformation = { speed = \"1 m/s\", period = \"3 s\" } }";
    same(&["solver=mps", "particles.spacing=0.625 mm", flow]);
    same(&["overlap.drag=di_felice", "particles.spacing=0.625 mm"]);
}

#[test]
fn liquid_in_the_open_part_is_refused_beside_what_does_not_know_it() {
    let on_a_grid = |changes: &[&str]| findings(&[&["solver=mics"], changes].concat());
    let form = "fluid.convection=velocity_form";
    let found = on_a_grid(&[form]);
    assert!(
        found.len() == 1 && found[0].contains("`exchange = \"surface\"`") && found[0].contains("velocity_form"),
        "{found:?}"
    );
    // Controls: in whole cells, and with the other form.
    assert!(on_a_grid(&[form, "coupling.exchange=stress"]).is_empty() && on_a_grid(&[]).is_empty());
}

#[test]
fn an_empty_list_of_grains_is_one_error() {
    let text = BASE.replace("count = 10\n", "").replace("placement.packed = {}", "placement.list = []");
    let text = text.replace("point = [\"5 mm\", \"5 mm\", \"5 mm\"]", "body = { index = 0 }");
    let found = findings_of(&text, &[]);
    assert!(found.len() == 1 && found[0].contains("the list of grains is empty"), "{found:#?}");
}

#[test]
fn names_that_are_none_are_refused() {
    let long = format!("name={}", "n".repeat(300));
    for name in ["name=\"a\\nb\"", "name=\"..\"", "name=\".\"", "name=\" \"", "name=\"a \"", "name=\"a/b\"", &long] {
        refused(name, "`name` cannot be the name of a folder");
    }
    let found = findings(&["material.\"\".density=2000 kg/m^3"]);
    assert!(found.iter().any(|text| text.contains("a material has no name")), "{found:#?}");
    // Negative control.
    for name in ["name=\"a b.c\"", "name=n", "name=\"砂\""] {
        assert!(findings(&[name]).is_empty(), "{name}");
    }
}

#[test]
fn names_and_titles_that_cannot_be_shown_are_refused() {
    let drop = |name: &str| format!("{{ name = {name}, region.sphere.diameter = \"1 mm\", above_bed = \"2 mm\" }}");
    refused("title=\"a\\u001bb\"", "`title` has control characters");
    for name in ["\"\"", "\" \"", "\"a\\tb\""] {
        refused(&format!("grains.0.name={name}"), "has a name that cannot be shown");
        refused(&format!("liquid=[{}]", drop(name)), "has a name that cannot be shown");
    }
    let rain = drop("\"rain\"");
    let found = findings(&[&format!("liquid=[{rain}, {rain}, {}]", drop("\"hail\""))]);
    assert!(found.len() == 1 && found[0].contains("two liquids are called `rain`"), "{found:#?}");
    for text in ["title=\"a\\u202eb\"", "material={ \"gl\\u001bss\" = { density = \"2650 kg/m^3\" } }"] {
        let found = findings(&[text]);
        assert!(
            found.iter().any(|text| text.contains("control characters") || text.contains("cannot be shown")),
            "{found:#?}"
        );
    }
    // Negative control.
    assert!(findings(&["title=\"砂と水\"", "grains.0.name=\"砂\"", &format!("liquid=[{rain}]")]).is_empty());
}

#[test]
fn sizes_that_cannot_be_read_are_one_error_each() {
    for (size, words) in [
        ("{ sigma = 3 }", "`sigma` has to lie between 0 and 2"),
        ("{ sigma = \"0.3\" }", "`sigma` is not a number"),
        ("{ sigma = 0.3, median = \"1 mm\" }", "`median` is not a number"),
        ("{ sigma = 0.3, lower = 2, upper = 0.5 }", "`lower` lies above `upper`"),
        ("{ sigma = 0.3, upper = 0.1 }", "`lower` lies above `upper`"),
    ] {
        refused(&format!("grains.0.size={{ lognormal = {size} }}"), words);
    }
    assert!(findings(&["grains.0.size={ lognormal = { sigma = 0.3, lower = 0.5, upper = 2 } }"]).is_empty());
}

#[test]
fn a_fall_leads_downwards() {
    let falling = |angle: &str| {
        let fall = format!("fall = {{ speed = \"1 m/s\", angle = \"{angle}\" }}");
        format!("liquid=[{{ region.sphere.diameter = \"1 mm\", above_bed = \"2 mm\", {fall} }}]")
    };
    for angle in ["90 deg", "120 deg", "-179 deg", "1e10 rad"] {
        refused(&falling(angle), "a fall leads downwards");
    }
    assert!(findings(&[&falling("-89 deg")]).is_empty());
}

#[test]
fn a_decimal_comma_is_named() {
    refused("fluid.cfl=\"0,3\"", "and thousands have no mark: write 0.3");
    refused("fluid.cfl=\"1,000.5\"", "write 1000.5");
    let found = findings_of(&BASE.replace("[domain]", "[fluid]\ncfl = 0,3\n[domain]"), &[]);
    assert!(found.len() == 1 && found[0].contains("decimals follow a decimal point"), "{found:#?}");
    let found = findings_of(&BASE.replace("[20, 20, 20]", "20,20,20"), &[]);
    assert!(found[0].contains("lists in brackets with commas"), "{found:#?}");
    for text in ["\"fast\"", "\"0,\"", "\"a,b\"", "\"1,-3\""] {
        refused(&format!("fluid.cfl={text}"), "leave out quotes and unit");
    }
}

#[test]
fn an_exponent_without_its_caret_is_named_with_the_unit_that_is_meant() {
    for (unit, meant) in [("kg/m3", "kg/m^3"), ("kg m-3", "kg m^-3"), ("kg/m**3", "kg/m^3"), ("g/cm3", "g/cm^3")] {
        let density = |unit: &str| format!("material.sand.density=2 {unit}");
        refused(&density(unit), "`density` cannot be read: an exponent follows `^`");
        refused(&density(unit), &format!("write `{meant}`"));
        let taken = findings(&[&density(meant)]);
        assert!(!taken.iter().any(|text| text.contains("cannot be read")), "negative control: {taken:#?}");
    }
}

#[test]
fn an_array_that_is_asked_for_twice_is_refused() {
    refused("output.grain_arrays=[\"id\", \"id\", \"speed\"]", "`grain_arrays` has `id` twice");
    let found = findings(&["output.grain_arrays=[\"mass\", \"id\", \"mass\", \"id\"]"]);
    assert_eq!(found.len(), 2, "{found:#?}");
    assert!(findings(&["output.grain_arrays=[\"id\", \"speed\", \"mass\"]"]).is_empty());
}

#[test]
fn whole_numbers_that_are_too_large_and_dates_are_called_so() {
    refused("run.steps=9223372036854775808", "`steps` is larger than 9223372036854775807");
    refused("run.steps=0x8000000000000000", "`steps` is larger than 9223372036854775807");
    refused("run.steps=-9223372036854775809", "`steps` has to be 1 or more");
    refused("run.steps=1.5", "`steps` is not a whole number");
    assert!(findings(&["run.steps=9223372036854775807"]).is_empty());
    let said = |value: &str| {
        let overrides = [format!("run.until={value}")];
        sazanami_case::parse(Path::new("c.toml"), BASE, &overrides).expect_err("no time").to_string()
    };
    for (value, kind) in [("1979-05-27", "a date"), ("07:32:00", "a time of day"), ("{ s = 1 }", "a table")] {
        assert!(said(value).contains(&format!("{kind}; expected a time")), "{}", said(value));
    }
}

#[test]
fn orientations_do_not_hang_on_the_length_in_which_they_are_given() {
    let turned = |keys: &str| {
        let list = format!("{{ list = [{{ position = [\"4 mm\", \"4 mm\", \"4 mm\"], {keys} }}] }}");
        let overrides = [format!("grains.0.placement={list}")];
        let case =
            sazanami_case::parse(Path::new("c.toml"), TANK, &overrides).unwrap_or_else(|error| panic!("{error}"));
        match &case.case.grains[0].placement {
            GrainPlacement::List(list) => list[0].orientation,
            other => panic!("{other:?}"),
        }
    };
    let half = std::f64::consts::FRAC_1_SQRT_2;
    for size in ["1", "1e200", "1e-200", "1.7e308", "5e-324"] {
        let found = turned(&format!("quaternion = [{size}, -{size}, 0, 0]"));
        let off = [found.w - half, found.x + half, found.y, found.z];
        assert!(off.iter().all(|part| part.abs() < 1e-15), "{size}: {found}");
        let found = turned(&format!("axis = [-{size}, 0, 0], angle = \"90 deg\""));
        let off = [found.w - half, found.x + half, found.y, found.z];
        assert!(off.iter().all(|part| part.abs() < 1e-15), "{size}: {found}");
    }
    // Negative controls: what points nowhere.
    let refused = |keys: &str, words: &str| {
        let list = format!("{{ list = [{{ position = [\"4 mm\", \"4 mm\", \"4 mm\"], {keys} }}] }}");
        let found = findings_of(TANK, &[&format!("grains.0.placement={list}")]);
        assert!(found.len() == 1 && found[0].contains(words), "{found:#?}");
    };
    refused("quaternion = [0, 0, -0.0, 0]", "a quaternion must not be zero");
    refused("axis = [0, 0, 0], angle = \"90 deg\"", "an axis needs a direction");
}

#[test]
fn a_misspelt_file_is_found_beside_it() {
    let folder = std::env::temp_dir().join(format!("sazanami-misspelt-{}", std::process::id()));
    std::fs::create_dir_all(&folder).unwrap();
    std::fs::write(folder.join("quick.toml"), BASE).unwrap();
    let said = |name: &str| sazanami_case::load(&folder.join(name), &[]).unwrap_err().to_string();
    assert!(said("qiuck.toml").contains("quick.toml`?"), "{}", said("qiuck.toml"));
    assert!(said("other.toml").contains("sazanami new"), "{}", said("other.toml"));
    std::fs::remove_dir_all(folder).unwrap();
}

#[test]
fn a_misspelt_table_keeps_the_rest_of_a_key() {
    for (path, meant) in
        [("flid.viscosity", "fluid.viscosity"), ("fluid.viscosty", "fluid.viscosity"), ("flid.abc", "fluid")]
    {
        let Explained::Unknown { meant: Some(found), .. } = explain(path) else { panic!("{path} is no key") };
        assert_eq!(found, meant);
    }
}

#[test]
fn keys_that_would_do_nothing_are_refused() {
    // Two tables for one pair, and none for walls.
    let twice = "contact={ \"sand/wall\" = { restitution = 0.5 }, \"wall/sand\" = { restitution = 0.9 } }";
    refused(twice, "is given twice");
    refused("contact={ \"wall/wall\" = { restitution = 0.5 } }", "walls do not touch walls");
    assert!(
        findings(&["contact={ \"sand/sand\" = { restitution = 0.5 }, \"wall/sand\" = { restitution = 0.9 } }"])
            .is_empty()
    );
    // A grain that is held has no velocity.
    let grain = |motion: &str, moves: &str| {
        format!(
            "grains.0.placement={{ list = [{{ position = [\"4 mm\", \"4 mm\", \"4 mm\"], motion = \"{motion}\", {moves} }}] }}"
        )
    };
    for moves in
        ["velocity = [\"0 m/s\", \"1 m/s\", \"0 m/s\"]", "angular_velocity = [\"0 rad/s\", \"1 rad/s\", \"0 rad/s\"]"]
    {
        let found = findings_of(TANK, &[&grain("fixed", moves)]);
        assert!(found.len() == 1 && found[0].contains("what is held has no velocity"), "{found:#?}");
        assert!(findings_of(TANK, &[&grain("prescribed", moves)]).is_empty());
    }
    let lattice = "grains.0.placement.lattice={ counts = [5, 5, 5], velocity = [\"0 m/s\", \"1 m/s\", \"0 m/s\"] }";
    let found = findings_of(TANK, &[lattice, "grains.0.motion=fixed"]);
    assert!(found.len() == 1 && found[0].contains("what is held has no velocity"), "{found:#?}");
    assert!(findings_of(TANK, &[lattice]).is_empty());
    // A motion by a formula has the direction of its amplitude.
    let motion = |more: &str| {
        format!("frame.motion={{ amplitude = [\"1 mm\", \"0 mm\", \"0 mm\"], frequency = \"2 Hz\"{more} }}")
    };
    let found = findings_of(TANK, &[&motion(", axis = \"x2\"")]);
    assert!(found.iter().any(|text| text.contains("a motion by a formula has no `axis`")), "{found:#?}");
    assert!(!findings_of(TANK, &[&motion("")]).iter().any(|text| text.contains("has no `axis`")));
}

#[test]
fn a_gap_above_a_bed_needs_a_lowest_point_and_a_bed_that_is_packed_moves() {
    let found = |region: &str| {
        findings(&[&format!("liquid=[{{ name = \"jet\", region.{region}, gap_above_bed = \"1 mm\" }}]")])
    };
    let jet = "cylinder = { axis = \"x3\", diameters = [\"2 mm\", \"2 mm\"] }";
    for region in [jet, "half_space = { point = [\"0 mm\", \"0 mm\", \"2 mm\"] }"] {
        let found = found(region);
        assert!(found.len() == 1 && found[0].contains("this region has no lowest point"), "{region}: {found:#?}");
    }
    // Negative control: a drop has one.
    assert!(found("sphere.diameter = \"2 mm\"").is_empty(), "{:#?}", found("sphere.diameter = \"2 mm\""));
    refused("grains.0.motion=fixed", "grains that are held cannot be packed");
}
