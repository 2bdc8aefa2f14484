//! The pages that mdBook wrote: every link of them must lead to a file of the book, and to an anchor in it.

use std::collections::HashMap;
use std::io;
use std::path::{Path, PathBuf};

use crate::links::{files_below, is_local};

/// Pages that mdBook makes by itself, with links that are relative to the root of a site.
const OWN: [&str; 2] = ["404.html", "toc.html"];

/// Number of the links within the book in `folder`, and those that lead to nothing.
pub fn dead(folder: &Path) -> io::Result<(usize, Vec<String>)> {
    let mut paths = Vec::new();
    files_below(folder, "html", &mut paths)?;
    paths.retain(|path| !OWN.iter().any(|own| path.ends_with(own)));
    let texts = paths.into_iter().map(|path| Ok((path.clone(), std::fs::read_to_string(path)?)));
    let pages: HashMap<PathBuf, String> = texts.collect::<io::Result<_>>()?;
    let (mut links, mut dead) = (0, Vec::new());
    for (path, text) in &pages {
        for link in attributes(text, "href").chain(attributes(text, "src")).filter(|link| is_local(link)) {
            links += 1;
            if !leads_somewhere(&pages, path, link)? {
                dead.push(format!("{}: the link to `{link}` is dead", path.display()));
            }
        }
    }
    dead.sort();
    Ok((links, dead))
}

/// Values of an attribute of the elements of a page.
fn attributes<'a>(text: &'a str, name: &str) -> impl Iterator<Item = &'a str> {
    let begin = format!(" {name}=\"");
    let rests: Vec<&str> = text.split(begin.as_str()).skip(1).collect();
    rests.into_iter().filter_map(|rest| rest.split('"').next())
}

fn leads_somewhere(pages: &HashMap<PathBuf, String>, path: &Path, link: &str) -> io::Result<bool> {
    let (file, anchor) = link.split_once('#').unwrap_or((link, ""));
    let file = file.split('?').next().unwrap_or_default();
    let target = match file {
        "" => path.to_owned(),
        file => match path.parent().unwrap_or(path).join(file).canonicalize() {
            Ok(target) if target.is_dir() => target.join("index.html"),
            Ok(target) => target,
            Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(false),
            Err(error) => return Err(error),
        },
    };
    let is_there = |text: &String| text.contains(&format!("id=\"{anchor}\""));
    Ok(target.is_file() && (anchor.is_empty() || pages.get(&target).is_none_or(is_there)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn dead_links_and_anchors_of_written_pages_are_found() {
        let folder = std::env::temp_dir().join(format!("sazanami-book-{}", std::process::id()));
        std::fs::create_dir_all(folder.join("guide")).unwrap();
        let folder = folder.canonicalize().unwrap();
        let first =
            "<h1 id=\"a\"></h1> <a href=\"guide/page.html\"> <a href=\"#a\"> <img src=\"absent.png\"> <a href=\"#b\">";
        std::fs::write(folder.join("index.html"), first).unwrap();
        let page = "<a href=\"../index.html#a\"> <a href=\"../index.html#b\"> <a href=\"https://example.org\"> <a href=\"..\">";
        std::fs::write(folder.join("guide/page.html"), page).unwrap();
        let (links, dead) = dead(&folder).unwrap();
        std::fs::remove_dir_all(&folder).unwrap();
        assert_eq!((links, dead.len()), (7, 3), "{dead:?}");
    }
}
