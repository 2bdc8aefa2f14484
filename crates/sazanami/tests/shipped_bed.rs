//! The bed that ships names the case that packs it.

use std::path::{Path, PathBuf};

use sazanami::bed_file::{Bed, Recipe};
use sazanami::case;

fn beds() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../../cases/raindrop")
}

#[test]
fn the_shipped_bed_names_the_case_that_packs_it() {
    let path = beds().join("beds/paper.bed");
    let mut bed = Bed::read(&path).unwrap();
    let hash = |overrides: &[String]| Recipe::hash_of(&case::load(&beds().join("bed.toml"), overrides).unwrap().case);
    // Where the bed goes does not matter; what it is made of does.
    assert_eq!(hash(&[]), hash(&["output.bed=\"/tmp/any.bed\"".to_owned()]));
    assert_ne!(hash(&[]), hash(&["grains.0.seed=2".to_owned()]));
    if std::env::var_os("SAZANAMI_BLESS").is_some() {
        bed.recipe.case_hash = hash(&[]);
        bed.write(&path).unwrap();
    }
    assert_eq!(bed.recipe.case_hash, hash(&[]), "run with SAZANAMI_BLESS=1 if the case was changed in words only");
    assert_eq!(bed.grains.len(), 30_900);
}
