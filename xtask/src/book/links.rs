//! Links of the book's pages. In the repository they may lead anywhere; those that lead out of `docs` become web addresses in the book.

use std::collections::HashSet;
use std::io::{self, Read as _};
use std::path::{Component, Path, PathBuf};

use serde_json::Value;

use super::LAST;
use crate::links::{rewritten, targets};
use crate::root;

/// Address of files that the book does not have.
const REPOSITORY: &str = env!("CARGO_PKG_REPOSITORY");

/// The pages of the book.
struct Book<'a> {
    root: &'a Path,
    /// Paths below `docs`.
    pages: HashSet<String>,
}

impl<'a> Book<'a> {
    /// The book of the table of contents below `root`.
    fn read(root: &'a Path) -> io::Result<Self> {
        let summary = std::fs::read_to_string(root.join("docs/SUMMARY.md"))?;
        Ok(Self { root, pages: targets(&summary).map(|(page, _)| page.to_owned()).collect() })
    }

    /// A page with the links that the book can follow.
    fn page(&self, page: &str, text: &str) -> String {
        let source =
            LAST.iter().find(|last| last.1 == page).map_or_else(|| format!("docs/{page}"), |last| last.2.into());
        rewritten(text, |link| self.link(page, Path::new(&source), link))
    }

    /// A link of the file `source` as the page of the book has it.
    fn link(&self, page: &str, source: &Path, link: &str) -> String {
        let (file, anchor) = link.split_once('#').unwrap_or((link, ""));
        if file.is_empty() {
            return link.to_owned();
        }
        let target = joined(source, file);
        let included = LAST.iter().find(|last| last.2 == target).map(|last| last.1);
        let within = target.strip_prefix("docs/").unwrap_or(&target);
        let is_other_file = target != within && !target.ends_with(".md") && self.root.join(&target).is_file();
        let of_folder = format!("{within}/README.md");
        let place = match included {
            Some(place) => Some(place),
            None if target != within && self.pages.contains(&of_folder) => Some(of_folder.as_str()),
            None => Some(within).filter(|_| is_other_file || target != within && self.pages.contains(within)),
        };
        let address = match place {
            Some(place) => "../".repeat(page.matches('/').count()) + place,
            None if self.root.join(&target).is_dir() => format!("{REPOSITORY}/tree/main/{target}"),
            None => format!("{REPOSITORY}/blob/main/{target}"),
        };
        if anchor.is_empty() { address } else { format!("{address}#{anchor}") }
    }

    /// Links of a page as it stands in the book that lead to nothing in it.
    fn dead(&self, page: &str, text: &str) -> Vec<String> {
        let leads_somewhere = |file: &str| {
            let target = joined(Path::new(page), file);
            let is_outside = Path::new(&target).starts_with("..");
            self.pages.contains(&target) || !is_outside && !target.ends_with(".md") && self.docs(&target).is_file()
        };
        let dead = targets(text).filter(|(file, _)| !file.is_empty() && !leads_somewhere(file));
        dead.map(|(file, _)| format!("the book's page {page}: nothing in the book is at `{file}`")).collect()
    }

    fn docs(&self, path: &str) -> PathBuf {
        self.root.join("docs").join(path)
    }
}

/// The path that a link `file` in the page at `source` means, without `..` where that is possible.
fn joined(source: &Path, file: &str) -> String {
    let mut parts: Vec<String> = Vec::new();
    for part in source.parent().unwrap_or(source).join(file).components() {
        match part {
            Component::ParentDir if parts.last().is_some_and(|last| last != "..") => drop(parts.pop()),
            Component::CurDir => {}
            part => parts.push(part.as_os_str().to_string_lossy().into_owned()),
        }
    }
    parts.join("/")
}

/// Links of the book below `root` that lead to nothing, and pages that are not there.
pub fn dead(root: &Path) -> io::Result<Vec<String>> {
    let book = Book::read(root)?;
    let mut pages: Vec<&String> = book.pages.iter().collect();
    pages.sort();
    let mut dead = Vec::new();
    for page in pages {
        let included = LAST.iter().find(|last| last.1 == page);
        let path = included.map_or_else(|| book.docs(page), |last| root.join(last.2));
        match std::fs::read_to_string(&path) {
            Ok(text) => dead.extend(book.dead(page, &book.page(page, &text))),
            Err(error) => dead.push(format!("the book's page {}: {error}", path.display())),
        }
    }
    Ok(dead)
}

/// Answers mdBook, which asks whether a renderer is supported, or hands over a book whose links are to be rewritten.
pub fn preprocess(arguments: &[String]) -> u8 {
    if arguments.first().is_some_and(|argument| argument == "supports") {
        return 0;
    }
    let mut text = String::new();
    let handed = io::stdin().read_to_string(&mut text).map_err(|error| error.to_string());
    let parsed = handed.and_then(|_| serde_json::from_str::<[Value; 2]>(&text).map_err(|error| error.to_string()));
    let root = root();
    match (parsed, Book::read(&root)) {
        (Ok([_, mut chapters]), Ok(book)) => {
            rewrite(&mut chapters, &book);
            println!("{chapters}");
            0
        }
        (Err(problem), _) => {
            eprintln!("error: this is run by mdBook, which hands over a book as JSON: {problem}");
            2
        }
        (_, Err(problem)) => {
            eprintln!("error: docs/SUMMARY.md: {problem}");
            1
        }
    }
}

/// Rewrites the links of every chapter in `value`.
fn rewrite(value: &mut Value, book: &Book<'_>) {
    match value {
        Value::Array(values) => values.iter_mut().for_each(|value| rewrite(value, book)),
        Value::Object(fields) => {
            if let (Some(Value::String(page)), Some(Value::String(text))) = (fields.get("path"), fields.get("content"))
            {
                let text = book.page(&page.replace('\\', "/"), text);
                fields.insert("content".to_owned(), text.into());
            }
            fields.values_mut().for_each(|value| rewrite(value, book));
        }
        _ => {}
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn links_that_leave_the_book_are_web_addresses_and_others_stay() {
        let root = root();
        let book = Book::read(&root).unwrap();
        let link = |page: &str, link: &str| book.page(page, &format!("[a]({link})"));
        let stays = |page: &str, text: &str| assert_eq!(link(page, text), format!("[a]({text})"));
        stays("guide/README.md", "#anchor");
        stays("guide/README.md", "https://example.org/a.md");
        stays("guide/README.md", "../theory/mics.md#a");
        stays("results/raindrop.md", "../pictures/paper-view-10ms.png");
        assert_eq!(link("guide/README.md", "../../README.md#a"), format!("[a]({REPOSITORY}/blob/main/README.md#a)"));
        assert_eq!(link("guide/README.md", "../../cases"), format!("[a]({REPOSITORY}/tree/main/cases)"));
        assert_eq!(link("README.md", "../ARCHITECTURE.md"), "[a](book/architecture.md)");
        assert_eq!(link("README.md", "guide"), "[a](guide/README.md)");
        // The page of the book lies elsewhere than the file that it includes.
        assert_eq!(link("book/changelog.md", "docs/guide/mpi.md"), "[a](../guide/mpi.md)");
    }

    #[test]
    fn a_dead_link_of_the_book_is_found() {
        let root = root();
        assert_eq!(dead(&root).unwrap(), Vec::<String>::new());
        let book = Book::read(&root).unwrap();
        let text =
            "[out](../../README.md), [no page](absent.md), [in](../theory/mics.md), [in](commands.md#a), [here](#a)";
        assert_eq!(book.dead("guide/README.md", text).len(), 2);
        assert_eq!(book.dead("guide/README.md", &book.page("guide/README.md", text)), Vec::<String>::new());
    }

    #[test]
    fn chapters_of_chapters_are_rewritten() {
        let root = root();
        let chapter = |page: &str, below: Value| serde_json::json!({ "Chapter": { "content": "[a](../../README.md)", "path": page, "sub_items": below } });
        let mut chapters = serde_json::json!({ "sections": [
            "Separator", chapter("guide/README.md", serde_json::json!([chapter("guide/mpi.md", Value::Null)])) ] });
        rewrite(&mut chapters, &Book::read(&root).unwrap());
        assert_eq!(chapters.to_string().matches(&format!("[a]({REPOSITORY}/blob/main/README.md)")).count(), 2);
    }
}
