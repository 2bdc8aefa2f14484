//! Pages that are generated from the program are those in `docs/`.

use std::path::Path;

/// With `SAZANAMI_WRITE_PAGES` set the page is written instead of compared.
#[test]
fn the_page_of_columns_is_that_of_the_program() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../docs/guide/columns.md");
    let expected = sazanami::reference::columns();
    if std::env::var_os("SAZANAMI_WRITE_PAGES").is_some() {
        std::fs::write(&path, &expected).unwrap();
    }
    let found = std::fs::read_to_string(&path).unwrap_or_default();
    assert!(
        found == expected,
        "{} is not what the program has: SAZANAMI_WRITE_PAGES=1 cargo test --release -p sazanami --test reference_pages",
        path.display()
    );
    // Negative control: a column that the page does not name would be found.
    assert!(found.contains("| `erosion_volume` | m^3 |") && !found.contains("| `no_such_column` |"));
}
