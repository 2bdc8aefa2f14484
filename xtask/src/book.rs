//! The book: its table of contents from the pages of `docs/`, its links, and its build by mdBook; `tidy` follows the links.

mod links;

use std::fmt::Write as _;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use crate::{exit_code, root, succeeds};

pub use links::{dead, preprocess};

/// The page that the book opens with. mdBook copies the first page to the root of the book with its links as they are,
/// so it has to lie in `docs` itself.
const FIRST: &str = "README.md";

/// Parts of the book: title, folder within `docs/`, and the pages that come first.
const PARTS: [(&str, &str, &[&str]); 5] = [
    ("Guide", "guide", &["README.md", "getting-started.md", "commands.md", "your-own-case.md", "results.md"]),
    ("Theory", "theory", &["README.md", "mics.md", "dem.md", "mps.md"]),
    ("Results", "results", &["README.md"]),
    ("Reference", "", &["case-files.md"]),
    ("Decisions", "decisions", &["README.md"]),
];
/// Pages of the repository's root, which the book includes: title, page of the book, file.
const LAST: [(&str, &str, &str); 2] =
    [("Architecture", "book/architecture.md", "ARCHITECTURE.md"), ("Changelog", "book/changelog.md", "CHANGELOG.md")];

/// Builds the book; mdBook has to be installed.
pub fn run() -> u8 {
    if !succeeds(Command::new("mdbook").arg("--version")) {
        eprintln!("error: the book needs mdBook: `cargo install mdbook`");
        return 1;
    }
    exit_code(Command::new("mdbook").arg("build").current_dir(root()))
}

/// The table of contents of all pages in `docs`, with the headings of `fresh` for the pages that are about to be written:
/// paths below `root` and texts.
pub fn summary(root: &Path, fresh: &[(String, String)]) -> String {
    let docs = &root.join("docs");
    let text_of = |path: &Path| match fresh.iter().find(|(name, _)| root.join(name) == path) {
        Some((_, text)) => text.clone(),
        None => fs::read_to_string(path).unwrap_or_default(),
    };
    let mut text = format!("# Summary\n\n[{}]({FIRST})\n", heading(&text_of(&docs.join(FIRST))));
    for (title, folder, first) in PARTS {
        let mut found = pages(&docs.join(folder), !folder.is_empty());
        found.retain(|path| *path != docs.join(FIRST));
        found.sort_by_key(|path| {
            let name = path.strip_prefix(docs.join(folder)).unwrap_or(path);
            (first.iter().position(|known| Path::new(known) == name).unwrap_or(first.len()), path.clone())
        });
        if !found.is_empty() {
            let _ = writeln!(text, "\n# {title}\n");
        }
        for path in found {
            let name = path.strip_prefix(docs).unwrap_or(&path).to_string_lossy().replace('\\', "/");
            let _ = writeln!(text, "- [{}]({name})", heading(&text_of(&path)));
        }
    }
    text.push_str("\n# Development\n\n");
    for (title, name, _) in LAST {
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
fn heading(text: &str) -> String {
    let title = text.lines().find_map(|line| line.strip_prefix("# ")).unwrap_or("Untitled");
    title.replace('`', "").replace('[', "(").replace(']', ")")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_table_of_contents_names_pages_of_every_part() {
        let written = summary(&root(), &[]);
        // The first page lies in `docs` itself, and is named once.
        let pages: Vec<&str> = written.split("](").skip(1).filter_map(|rest| rest.split(')').next()).collect();
        assert_eq!((pages[0], pages.iter().filter(|&&page| page == FIRST).count()), (FIRST, 1));
        assert!(written.contains("](guide/README.md)") && written.contains("](decisions/0001-dependencies.md)"));
        assert!(!written.contains("New heading"));
        // What is about to be written gives its new heading, not that on disk.
        let fresh = ("docs/guide/columns.md".to_owned(), "# New heading\n".to_owned());
        assert!(summary(&root(), &[fresh]).contains("- [New heading](guide/columns.md)"));
    }
}
