//! Liquids of few particles: poured by their volume, warned of, or refused.

use sazanami::check::CostModel;
use sazanami::feasible;
use sazanami::machine::Machine;

use crate::support::{On, Scratch, heard, load};

/// A drop in a box of 20 mm, between the places of a lattice of particles of 2 mm.
fn drop(diameter: &str) -> String {
    format!(
        "solver = \"mps\"\ngravity = \"9.81 m/s^2\"\ndomain.size = [\"20 mm\", \"20 mm\", \"20 mm\"]\n\
         boundary.x3_upper = \"outflow\"\nparticles.spacing = \"2 mm\"\npreparation.cache = false\nrun.until = \"1 ms\"\n\
         output = {{ fields = {{ at = [] }}, figures = {{ at = [] }} }}\n[[liquid]]\nname = \"drop\"\n\
         region.sphere = {{ centre = [\"10 mm\", \"10 mm\", \"10 mm\"], diameter = \"{diameter}\" }}\n"
    )
}

/// What is told before a drop runs, and by its run if there is one.
fn told(text: &str) -> (Vec<String>, Option<Vec<String>>) {
    let loaded = load(text, &[]);
    let records = |found: &sazanami::case::Diagnostics| {
        let of = |record: &sazanami::case::DiagnosticRecord| {
            format!("{} | {}", record.message, record.suggestion.clone().unwrap_or_default())
        };
        found.records(&loaded.source).iter().map(of).collect::<Vec<_>>()
    };
    match feasible::check(&loaded, &Machine::this(), &CostModel::default()) {
        Err(error) => (records(&error.diagnostics), None),
        Ok(feasible) => {
            let folder = Scratch::new("poured");
            let said = heard(&loaded, &On::threads(1).steps(1).options(Some(&folder.join("run")))).messages;
            (records(&feasible.warnings), Some(said))
        }
    }
}

#[test]
fn drops_are_poured_by_their_volume_warned_of_or_refused() {
    // 0.22 particles.
    let (found, ran) = told(&drop("1.5 mm"));
    assert!(ran.is_none() && found.len() == 1, "{found:?}");
    assert!(found[0].contains("`drop` is less than half a particle") && found[0].contains("0.302"), "{found:?}");
    // 1.77 particles: two.
    let (found, ran) = told(&drop("3 mm"));
    assert!(found.len() == 1 && found[0].contains("with 13 % more volume than asked for"), "{found:?}");
    let ran = ran.unwrap();
    let says = |words: &str| ran.iter().any(|message| message.contains(words));
    assert!(says("poured 2 particles of water") && says("warning: 1.8 particles of water were asked for"), "{ran:?}");
    // 6.2 particles, of which the lattice has eight: six.
    let (found, ran) = told(&drop("4.55 mm"));
    let ran = ran.unwrap();
    assert!(found.is_empty() && ran.iter().any(|message| message.contains("poured 6 particles")), "{found:?} {ran:?}");
    assert!(!ran.iter().any(|message| message.contains("warning")), "{ran:?}");
}

#[test]
fn liquid_goes_on_through_periodic_sides() {
    let text = |centre: &str, sides: &str| {
        drop("8 mm")
            .replace("\"10 mm\", \"10 mm\", \"10 mm\"]", &format!("\"{centre}\", \"{centre}\", \"10 mm\"]"))
            .replace("boundary.x3", &format!("boundary.all = \"{sides}\"\nboundary.x3_lower = \"slip\"\nboundary.x3"))
    };
    let poured = |text: &str| {
        let ran = told(text).1.expect("it runs");
        let said = ran.iter().find(|message| message.contains("poured")).expect("it is told").clone();
        said.split(' ').nth(1).and_then(|count| count.parse::<usize>().ok()).expect("a number")
    };
    let [middle, corner] = ["10 mm", "0 mm"].map(|centre| poured(&text(centre, "periodic")));
    assert!(middle == corner && middle >= 32, "{middle} {corner}");
    // Negative control: beside planes of symmetry it is a quarter.
    assert!(poured(&text("0 mm", "slip")) < 12);
}

#[test]
fn films_thinner_than_a_particle_are_warned_of() {
    let film = |height: &str| {
        let text = drop("8 mm");
        let start = text.split("region.sphere").next().expect("it has a beginning").to_owned();
        start
            + &format!(
                "region.box = {{ lower = [\"0 mm\", \"0 mm\", \"0 mm\"], upper = [\"20 mm\", \"20 mm\", \"{height}\"] }}\n"
            )
    };
    let is_thin = |text: &str| told(text).0.iter().any(|found| found.contains("thinner than a particle"));
    let found = told(&film("0.8 mm")).0;
    assert!(
        found.iter().any(|found| found.contains("`drop` is thinner than a particle") && found.contains("0.4 mm")),
        "{found:?}"
    );
    // Negative controls: a layer of one particle, and a film on a wall that gravity does not press it on.
    assert!(!is_thin(&film("2 mm")));
    let layers = film("0.8 mm")
        + "[[liquid]]\nregion.box = { lower = [\"0 mm\", \"0 mm\", \"0.8 mm\"], upper = [\"20 mm\", \"20 mm\", \"4 mm\"] }\n";
    assert!(!is_thin(&layers));
    assert!(!is_thin(&film("0.8 mm").replace("\"9.81 m/s^2\"", "[\"9.81 m/s^2\", \"0 m/s^2\", \"0 m/s^2\"]")));
}
