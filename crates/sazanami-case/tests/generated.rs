//! Pages and the schema that are generated from the declarations are those in the repository.
//!
//! `SAZANAMI_WRITE_PAGES=1 cargo test -p sazanami-case --test generated` (or `cargo xtask generate`) writes them anew.

use std::path::{Path, PathBuf};

use sazanami_case::{json_schema, reference};

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..")
}

fn compare(path: &str, text: &str) {
    let file = root().join(path);
    if std::env::var_os("SAZANAMI_WRITE_PAGES").is_some() {
        std::fs::write(&file, text).expect("generated files can be written");
    }
    let found = std::fs::read_to_string(&file).unwrap_or_default();
    assert!(found == text, "{path} is not what the declarations of the keys say: run `cargo xtask generate`");
}

#[test]
fn the_schema_is_fresh() {
    compare("cases/schema.json", &json_schema());
}

#[test]
fn the_reference_is_fresh() {
    compare("docs/guide/case-reference.md", &reference::page());
}

#[test]
fn the_table_of_the_literal_preset_is_fresh() {
    const BEGIN: &str = "<!-- generated: keys -->\n";
    const END: &str = "<!-- end -->";
    let page = std::fs::read_to_string(root().join("docs/paper-literal.md")).expect("the page is there");
    let (before, rest) = page.split_once(BEGIN).expect("the page has a place for the table");
    let (_, after) = rest.split_once(END).expect("the place for the table ends");
    compare("docs/paper-literal.md", &format!("{before}{BEGIN}{}{END}{after}", reference::literal_table()));
}
