//! Sizes of grains that a list gives, grains too long for their box, and contacts of fine grains.

use sazanami::machine::Machine;
use sazanami_numerics::Real;

use crate::support::{On, Scratch, before_run, findings, foretold, load, ran};

/// A sphere of 6 mm in water.
const SPHERE: &str = include_str!("../cases/grain-sizes-sphere.toml");

/// The sphere as one of another diameter and a factor.
fn given_as(diameter: &str, factor: &str) -> String {
    SPHERE.replace("DIAMETER", diameter).replace("FACTOR", factor)
}

/// What is found before a run of a case: whether it can run, and messages.
fn found(text: &str, overrides: &[&str]) -> (bool, Vec<String>) {
    before_run(&load(text, overrides), &Machine::this())
}

#[test]
fn a_sphere_is_the_same_by_its_diameter_and_by_a_factor() {
    let [whole, factored] = [given_as("6 mm", "1.0"), given_as("2 mm", "3.0")];
    let scratch = Scratch::new("factors");
    let run = |text: &str, name: &str| ran(text, &[], &scratch.join(name), On::threads(1)).probe("e").clone();
    let [a, b] = [run(&whole, "whole"), run(&factored, "factored")];
    for column in ["position_3", "velocity_3", "drag_3", "pressure_force_3", "void_fraction"] {
        let (a, b) = (a.column(column), b.column(column));
        let scale = a.iter().fold(0.0, |most: Real, x| most.max(x.abs()));
        assert!(a.iter().zip(&b).all(|(a, b)| (a - b).abs() <= 1e-9 * scale), "{column}: {a:?} {b:?}");
    }
    // Negative control: a sphere of 5 mm.
    let [other, a] = [&run(&given_as("5 mm", "1.0"), "smaller"), &a].map(|table| table.column("drag_3"));
    assert!((other[other.len() - 1] / a[a.len() - 1] - 1.0).abs() > 0.05, "{other:?} {a:?}");
    let report = |text: &str, overrides: &[&str]| {
        let case = load(text, overrides).case;
        let report = foretold(&case);
        let kind = &report.populations[0];
        let of_kind = [kind.size_m, kind.mass_kg].map(|value| format!("{:.9e}", value.unwrap_or(Real::NAN)));
        format!("{} {:.9e} {} {of_kind:?} {:?}", case.overlap.smoothing, report.dt_s, report.substeps, report.particles)
    };
    for overrides in [&[][..], &["overlap.drag_integration=explicit"], &["contact.default.normal_stiffness=1e5 N/m"]] {
        assert_eq!(report(&whole, overrides), report(&factored, overrides), "{overrides:?}");
    }
    let [of_ripples, factored_ripples] =
        [&whole, &factored].map(|text| load(&format!("{text}[ripples]\n"), &[]).case.ripples);
    assert_eq!(of_ripples, factored_ripples);
}

#[test]
fn large_factors_of_a_list_are_refused_and_warned_of_as_large_grains_are() {
    let [whole, factored] = [given_as("7 mm", "1.0"), given_as("2 mm", "3.5")];
    let refused = [&whole, &factored].map(|text| findings(text, &[]));
    assert_eq!(refused[0], refused[1]);
    assert!(refused[1].iter().any(|found| found.contains("too large for its tank")), "{refused:?}");
    let warned = |text: &str| {
        let short = [found(text, &["overlap.smoothing=12 mm"]), found(text, &[])];
        (short[0].1.clone(), short[1].1.clone())
    };
    let [whole, factored] = [given_as("6 mm", "1.0"), given_as("2 mm", "3.0")];
    assert_eq!(warned(&whole), warned(&factored));
    assert!(warned(&factored).0.iter().any(|found| found.contains("`smoothing` is short")), "{:?}", warned(&factored));
    // A distribution of sizes is for grains that are not listed.
    let found = found(&whole.replacen("name = \"e\"", "name = \"e\"\nsize.list = [{ factor = 0.5 }]", 1), &[]);
    assert!(found.0 && found.1.iter().any(|found| found.contains("`size` has no effect")), "{found:?}");
}

#[test]
fn grains_too_long_for_a_box_that_is_periodic_along_x3_are_refused() {
    let case = |diameter: &str| {
        format!(
            "gravity = \"0 m/s^2\"\ndomain = {{ size = [\"20 mm\", \"20 mm\", \"10 mm\"], cells = [10, 10, 5] }}\n\
             boundary.all = \"periodic\"\nrun.until = \"5 ms\"\nmaterial.a.density = \"2500 kg/m^3\"\n[[grains]]\n\
             shape.sphere.diameter = \"{diameter}\"\nplacement.list = [{{ position = [\"10 mm\", \"10 mm\", \"5 mm\"] }}]\n"
        )
    };
    let (runs, told) = found(&case("7 mm"), &[]);
    assert!(!runs && told.iter().any(|found| found.contains("too long for the periodic box")), "{told:?}");
    let (runs, told) = found(&case("4 mm"), &[]);
    assert!(runs, "{told:?}");
}

/// Two balls of 40 um that meet at 40 mm/s, with the dashpot of sand.
const FINE: &str = include_str!("../cases/grain-sizes-fine.toml");

#[test]
fn fine_grains_with_a_constant_dashpot_lose_energy() {
    let scratch = Scratch::new("fine");
    let after = |overrides: &[&str], name: &str| {
        ran(FINE, overrides, &scratch.join(name), On::threads(1)).column("kinetic_energy_grains")
    };
    let energy = after(&[], "constant");
    assert!(energy[energy.len() - 1] < 0.05 * energy[0], "{energy:?}");
    // Negative control: too few sub-steps by hand throw them apart, and that is warned of.
    let few = "dem.substeps=2500";
    let energy = after(&[few], "few");
    assert!(energy[energy.len() - 1] > 1.2 * energy[0], "{energy:?}");
    let warned = |overrides: &[&str], words: &str| {
        let (runs, told) = found(FINE, overrides);
        assert!(runs, "{told:?}");
        told.iter().any(|found| found.contains(words))
    };
    assert!(warned(&[few], "sub-steps are too long for the contacts") && !warned(&[], "sub-steps are too long"));
    // The spin is off by more than usual, which is told; a coefficient of restitution suits any mass.
    let damped = "a dashpot damps the lightest grains too much";
    assert!(warned(&[], damped));
    assert!(!warned(&["contact.default={ normal_stiffness = \"1e3 N/m\", restitution = 0.5 }"], damped));
    assert!(warned(
        &["contact.default={ normal_stiffness = \"1e3 N/m\", restitution = 0.5 }", "dem.substeps=1"],
        "sub-steps are too long for the contacts"
    ));
}

#[test]
fn keys_of_contacts_that_do_nothing_are_warned_of() {
    let text = given_as("6 mm", "1.0");
    let told = found(&text, &["grains.0.contact_spheres=shell(75)"]).1;
    assert!(told.iter().any(|found| found.contains("`contact_spheres` has no effect")), "{told:?}");
    let told = found(&text, &["dem.rolling_friction=0.1", "grains.0.contact_spheres=single"]).1;
    assert!(!told.iter().any(|found| found.contains("does nothing") || found.contains("no effect")), "{told:?}");
    let case = load(&text, &["grains.0.contact_spheres=shell(75)"]).case;
    assert_eq!(foretold(&case).contact_spheres, 1);
}
