//! Relative links of the pages: each must point to a file that exists.

use std::io;
use std::path::{Path, PathBuf};

/// Links of `README.md`, `ARCHITECTURE.md`, `docs` and `verification` below `root` whose target does not exist.
pub fn broken(root: &Path) -> io::Result<Vec<String>> {
    let mut pages: Vec<PathBuf> = ["README.md", "README.ja.md", "ARCHITECTURE.md"].map(|page| root.join(page)).into();
    for folder in ["docs", "verification"] {
        super::sources::files_below(&root.join(folder), "md", &mut pages)?;
    }
    let mut broken = Vec::new();
    for page in pages {
        let text = std::fs::read_to_string(&page)?;
        let folder = page.parent().unwrap_or(root);
        for target in targets(&text).filter(|target| !folder.join(target).exists()) {
            broken.push(format!("{}: the link to `{target}` has no target", page.display()));
        }
    }
    Ok(broken)
}

/// Files that the Markdown links of a page name, without anchors and web addresses.
fn targets(text: &str) -> impl Iterator<Item = &str> {
    let links = text.split("](").skip(1).filter_map(|rest| rest.split([')', '\n']).next());
    let files = links.filter(|link| !link.contains("://") && !link.starts_with("mailto:"));
    files.filter_map(|link| link.split(['#', ' ']).next()).filter(|file| !file.is_empty())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn files_of_links_are_found_without_anchors_and_addresses() {
        let text = "[a](b.md#c), ![d](e/f.png) [g](#h) [i](https://j.k/l.md)";
        assert_eq!(targets(text).collect::<Vec<_>>(), ["b.md", "e/f.png"]);
    }

    #[test]
    fn a_link_without_a_target_is_found() {
        let root = std::env::temp_dir().join(format!("sazanami-links-{}", std::process::id()));
        std::fs::create_dir_all(root.join("docs")).unwrap();
        std::fs::create_dir_all(root.join("verification")).unwrap();
        for page in ["README.md", "README.ja.md", "ARCHITECTURE.md"] {
            std::fs::write(root.join(page), "[there](docs/page.md)").unwrap();
        }
        std::fs::write(root.join("docs/page.md"), "[back](../README.md), [nowhere](absent.md)").unwrap();
        let found = broken(&root).unwrap();
        std::fs::remove_dir_all(&root).unwrap();
        assert!(found.len() == 1 && found[0].contains("absent.md"), "{found:?}");
    }
}
