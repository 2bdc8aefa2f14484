//! Relative links of the pages: each must point to a file that exists, and its anchor to a heading there.

use std::collections::HashSet;
use std::io;
use std::path::{Path, PathBuf};

/// Links of `README.md`, `ARCHITECTURE.md`, `docs` and `verification` below `root` whose target or anchor does not exist.
pub fn broken(root: &Path) -> io::Result<Vec<String>> {
    let mut pages: Vec<PathBuf> = ["README.md", "README.ja.md", "ARCHITECTURE.md"].map(|page| root.join(page)).into();
    for folder in ["docs", "verification"] {
        files_below(&root.join(folder), "md", &mut pages)?;
    }
    let mut broken = Vec::new();
    for page in pages {
        let text = std::fs::read_to_string(&page)?;
        let folder = page.parent().unwrap_or(root);
        for (file, anchor) in targets(&text) {
            let target = if file.is_empty() { page.clone() } else { folder.join(file) };
            if !target.exists() {
                broken.push(format!("{}: the link to `{file}` has no target", page.display()));
            } else if !anchor.is_empty() && target.extension().is_some_and(|kind| kind == "md") {
                let of_target = if file.is_empty() { text.clone() } else { std::fs::read_to_string(&target)? };
                if !anchors(&of_target).contains(anchor) {
                    broken.push(format!("{}: the link to `{file}#{anchor}` has no heading", page.display()));
                }
            }
        }
    }
    Ok(broken)
}

/// Adds the files with an extension in a folder and its folders, in the order of their names.
pub fn files_below(folder: &Path, ending: &str, files: &mut Vec<PathBuf>) -> io::Result<()> {
    if !folder.is_dir() {
        return Ok(());
    }
    let mut entries = std::fs::read_dir(folder)?.map(|entry| Ok(entry?.path())).collect::<io::Result<Vec<_>>>()?;
    entries.sort();
    for path in entries {
        if path.is_dir() {
            files_below(&path, ending, files)?;
        } else if path.extension().is_some_and(|extension| extension == ending) {
            files.push(path);
        }
    }
    Ok(())
}

/// Files and anchors that the Markdown links of a page name, without web addresses; a file is empty for the page itself.
pub fn targets(text: &str) -> impl Iterator<Item = (&str, &str)> {
    let links = text.split("](").skip(1).map(|rest| split_at_end(rest).0);
    links.filter(|link| is_local(link)).map(|link| link.split_once('#').unwrap_or((link, "")))
}

/// A page whose links that are no web addresses are what `replaced` makes of them.
pub fn rewritten(text: &str, replaced: impl Fn(&str) -> String) -> String {
    let mut parts = text.split("](");
    let mut page = parts.next().unwrap_or_default().to_owned();
    for rest in parts {
        let (link, after) = split_at_end(rest);
        page.push_str("](");
        page.push_str(&if is_local(link) { replaced(link) } else { link.to_owned() });
        page.push_str(after);
    }
    page
}

/// Whether a link is no web address.
fn is_local(link: &str) -> bool {
    !link.contains("://") && !link.starts_with("mailto:") && !link.is_empty()
}

/// A link and what follows it.
fn split_at_end(rest: &str) -> (&str, &str) {
    rest.split_at(rest.find([')', '\n', ' ']).unwrap_or(rest.len()))
}

/// Anchors of the headings of a page, as GitHub and mdBook make them.
fn anchors(text: &str) -> HashSet<String> {
    let mut anchors = HashSet::new();
    let mut is_code = false;
    for line in text.lines() {
        is_code ^= line.trim_start().starts_with("```");
        let Some(heading) = line.strip_prefix('#').filter(|_| !is_code) else { continue };
        let title = heading.trim_start_matches('#').trim().to_lowercase();
        let kept = title.chars().filter(|c| c.is_alphanumeric() || matches!(c, ' ' | '-' | '_'));
        let anchor: String = kept.map(|c| if c == ' ' { '-' } else { c }).collect();
        // Headings of the same text are numbered.
        let numbered = (1..).map(|n| format!("{anchor}-{n}"));
        let free = std::iter::once(anchor.clone()).chain(numbered).find(|name| !anchors.contains(name));
        anchors.extend(free);
    }
    anchors
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn links_and_headings_are_found_without_addresses_and_code() {
        let text = "[a](b.md#c), ![d](e/f.png) [g](#h) [i](https://j.k/l.md)";
        assert_eq!(targets(text).collect::<Vec<_>>(), [("b.md", "c"), ("e/f.png", ""), ("", "h")]);
        let found = anchors("# `a.b` and C\n## What, where?\n```\n# no heading\n```\n## What, where?\n");
        let expected = ["ab-and-c", "what-where", "what-where-1"];
        assert_eq!(found, expected.map(str::to_owned).into());
    }

    #[test]
    fn a_link_without_a_target_is_found() {
        let root = std::env::temp_dir().join(format!("sazanami-links-{}", std::process::id()));
        std::fs::create_dir_all(root.join("docs")).unwrap();
        std::fs::create_dir_all(root.join("verification")).unwrap();
        for page in ["README.md", "README.ja.md", "ARCHITECTURE.md"] {
            std::fs::write(root.join(page), "[there](docs/page.md)").unwrap();
        }
        let page = "# There\n[back](../README.md), [here](#there), [nowhere](absent.md), [no heading](page.md#here)";
        std::fs::write(root.join("docs/page.md"), page).unwrap();
        let found = broken(&root).unwrap();
        std::fs::remove_dir_all(&root).unwrap();
        assert!(found.len() == 2 && found[0].contains("absent.md") && found[1].contains("`page.md#here`"), "{found:?}");
    }
}
