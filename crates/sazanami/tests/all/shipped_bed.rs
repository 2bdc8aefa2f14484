//! The bed that ships names the case that packs it.

use std::path::{Path, PathBuf};

use sazanami::bed_file::{Bed, hash_of};
use sazanami::case;

fn beds() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../../cases/raindrop")
}

#[test]
fn what_a_bed_is_made_of_is_in_its_hash_and_the_shipped_bed_has_one() {
    let path = beds().join("beds/paper.bed");
    let bed = Bed::read(&path).unwrap();
    let hash = |overrides: &[String]| hash_of(&case::load(&beds().join("bed.toml"), overrides).unwrap().case);
    // Where the bed goes, what the water does and what is observed does not matter; what it is made of does.
    for change in [
        "title=\"another\"",
        "output.bed=\"/tmp/any.bed\"",
        "output.grain_form=points",
        "fluid.tol_div=1e-7",
        "fluid.initial_velocity={taylor_green={speed=\"1 m/s\"}}",
        "coupling.columns=8",
        "bed.height_radius=3 mm",
    ] {
        assert_eq!(hash(&[]), hash(&[change.to_owned()]), "{change}");
    }
    for change in [
        "grains.0.seed=2",
        "gravity=9.7 m/s^2",
        "domain.cells=[10, 10, 10]",
        "contact.\"sand/sand\".friction=0.5",
        "material.sand.density=2651 kg/m^3",
        "dem.rolling_friction=0.1",
    ] {
        assert_ne!(hash(&[]), hash(&[change.to_owned()]), "{change}");
    }
    // It was packed when springs grew by whole sub-steps, which no case can have any more: its hash is that of no case of today.
    assert_eq!((bed.recipe.case.as_str(), bed.recipe.case_hash.as_str()), ("bed", "366cb41468b2013b"));
    assert_ne!(bed.recipe.case_hash, hash(&[]));
    assert_eq!(bed.grains.len(), 30_900);
}
