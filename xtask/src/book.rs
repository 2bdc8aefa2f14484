//! The book: its table of contents from the pages of `docs/`, and its build by mdBook.

use std::fmt::Write as _;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use crate::{exit_code, root};

/// Parts of the book: title, folder within `docs/`, and the pages that come first.
const PARTS: [(&str, &str, &[&str]); 5] = [
    ("Guide", "guide", &["README.md", "getting-started.md", "commands.md", "your-own-case.md", "results.md"]),
    ("Theory", "theory", &["README.md", "mics.md", "dem.md", "mps.md"]),
    ("Results", "results", &["README.md"]),
    ("Reference", "", &["case-files.md"]),
    ("Decisions", "decisions", &["README.md"]),
];
/// Pages of the repository's root, which the book includes.
const LAST: [(&str, &str); 2] = [("Architecture", "book/architecture.md"), ("Changelog", "book/changelog.md")];

/// Builds the book where mdBook is installed.
pub fn run() -> u8 {
    if !Command::new("mdbook").arg("--version").output().is_ok_and(|output| output.status.success()) {
        println!("the book needs mdBook: `cargo install mdbook`");
        return 0;
    }
    exit_code(Command::new("mdbook").arg("build").current_dir(root()))
}

/// The table of contents of all pages in `docs`.
pub fn summary(docs: &Path) -> String {
    let mut text = String::from("# Summary\n");
    for (title, folder, first) in PARTS {
        let mut found = pages(&docs.join(folder), !folder.is_empty());
        found.sort_by_key(|path| {
            let name = path.strip_prefix(docs.join(folder)).unwrap_or(path);
            (first.iter().position(|known| Path::new(known) == name).unwrap_or(first.len()), path.clone())
        });
        if !found.is_empty() {
            let _ = writeln!(text, "\n# {title}\n");
        }
        for path in found {
            let name = path.strip_prefix(docs).unwrap_or(&path).to_string_lossy().replace('\\', "/");
            let _ = writeln!(text, "- [{}]({name})", heading(&path));
        }
    }
    text.push_str("\n# Development\n\n");
    for (title, name) in LAST {
        let _ = writeln!(text, "- [{title}]({name})");
    }
    text
}

/// Pages in a folder, and in those below it where `deep`.
fn pages(folder: &Path, deep: bool) -> Vec<PathBuf> {
    let entries = fs::read_dir(folder).into_iter().flatten().flatten().map(|entry| entry.path());
    let below = |path: PathBuf| match path.is_dir() {
        true if deep => pages(&path, true),
        false if path.extension().is_some_and(|kind| kind == "md") && !path.ends_with("SUMMARY.md") => vec![path],
        _ => Vec::new(),
    };
    entries.flat_map(below).collect()
}

/// First heading of a page, without marks of code.
fn heading(path: &Path) -> String {
    let text = fs::read_to_string(path).unwrap_or_default();
    let title = text.lines().find_map(|line| line.strip_prefix("# ")).unwrap_or("Untitled");
    title.replace('`', "").replace('[', "(").replace(']', ")")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_table_of_contents_names_pages_of_every_part() {
        let written = summary(&root().join("docs"));
        assert!(written.contains("](guide/README.md)") && written.contains("](decisions/0001-dependencies.md)"));
    }
}
