//! Files that are generated from declarations in the code and from what was measured: one list, written by
//! `cargo xtask generate` and compared by `cargo xtask tidy`.

use std::path::Path;

use sazanami::case::{json_schema, reference};
use sazanami_verification::catalogue::CASES;
use sazanami_verification::page::{pages, put};

use crate::{book, result_charts, results};

/// Begin and end of the table of the preset `paper_literal` in its page.
const BEGIN: &str = "<!-- generated: keys -->\n";
const END: &str = "<!-- end -->";

/// Every generated file below `root`: its path and its text.
fn files(root: &Path) -> Result<Vec<(String, String)>, String> {
    let literal = "docs/paper-literal.md";
    let page = std::fs::read_to_string(root.join(literal)).map_err(|error| format!("{literal}: {error}"))?;
    let mut files = vec![
        ("cases/schema.json".to_owned(), json_schema()),
        ("docs/guide/case-reference.md".to_owned(), reference::page()),
        ("docs/guide/columns.md".to_owned(), sazanami::reference::columns()),
        (literal.to_owned(), with_table(&page).ok_or(format!("{literal} has no place for its table"))?),
    ];
    files.extend(pages(root, CASES)?);
    files.extend(results::pages(root)?);
    files.extend(result_charts::files(root)?);
    // The headings of the pages make the table of contents.
    files.push(("docs/SUMMARY.md".to_owned(), book::summary(root, &files)));
    Ok(files)
}

/// The page of the preset with its table anew.
fn with_table(page: &str) -> Option<String> {
    let (before, rest) = page.split_once(BEGIN)?;
    let (_, after) = rest.split_once(END)?;
    Some(format!("{before}{BEGIN}{}{END}{after}", reference::literal_table()))
}

/// Writes the files; returns the exit code.
pub fn write(root: &Path) -> u8 {
    let written = files(root).and_then(|files| {
        let changed: Vec<_> = files.iter().filter(|(path, text)| !is_fresh(root, path, text)).collect();
        for (path, text) in &changed {
            put(&root.join(path), text).map_err(|error| error.to_string())?;
        }
        Ok((files.len(), changed.len()))
    });
    match written {
        Ok((all, changed)) => {
            println!("{changed} of {all} generated files have changed");
            0
        }
        Err(problem) => {
            eprintln!("error: {problem}");
            1
        }
    }
}

/// Files below `root` that are not what would be generated.
pub fn stale(root: &Path) -> Vec<String> {
    match files(root) {
        Ok(files) => {
            let old = files.iter().filter(|(path, text)| !is_fresh(root, path, text));
            old.map(|(path, _)| format!("{path} is not what is generated: run `cargo xtask generate`")).collect()
        }
        Err(problem) => vec![problem],
    }
}

fn is_fresh(root: &Path, path: &str, text: &str) -> bool {
    std::fs::read(root.join(path)).is_ok_and(|found| found == text.as_bytes())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_changed_file_is_stale_until_it_is_written() {
        let root = std::env::temp_dir().join(format!("sazanami-generated-{}", std::process::id()));
        std::fs::create_dir_all(&root).unwrap();
        let page = format!("before\n{BEGIN}STALE ROW\n{END}\nafter\n");
        std::fs::write(root.join("page.md"), &page).unwrap();
        let fresh = with_table(&page).unwrap();
        assert!(!is_fresh(&root, "page.md", &fresh) && !is_fresh(&root, "absent.md", &fresh));
        std::fs::write(root.join("page.md"), &fresh).unwrap();
        assert!(is_fresh(&root, "page.md", &fresh));
        assert_eq!(with_table(&fresh).as_deref(), Some(&*fresh));
        assert!(fresh.starts_with("before\n") && fresh.ends_with("\nafter\n") && !fresh.contains("STALE ROW"));
        assert_eq!(with_table("no place"), None);
        std::fs::remove_dir_all(&root).unwrap();
    }
}
