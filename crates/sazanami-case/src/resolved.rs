//! The copy of a case: a case file that says everything, in SI units, and is itself a case with the same meaning.

use std::path::Path;

use crate::case::Case;
use crate::key::Keys;
use crate::read::ORDER;
pub use crate::write::Paths;
use crate::write::{Written, quoted};

/// The case as text.
#[must_use]
pub fn write(case: &Case, paths: Paths) -> String {
    let mut text = "# The case as run: resolved, every default, SI units.\n".to_owned();
    if let Written::Table(mut entries) = Keys::write(case, paths) {
        entries.put_in_order(&ORDER);
        entries.render("", &mut text);
    }
    text
}

/// Hash of the meaning of a case: the same wherever it lies and however it was written.
#[must_use]
pub fn hash(case: &Case) -> u64 {
    xxhash_rust::xxh3::xxh3_64(write(case, Paths::NameOnly).as_bytes())
}

/// Hash of the meaning of the tables and keys `names` alone, in the form in which it is written.
#[must_use]
pub fn hash_of_tables(case: &Case, names: &[&str]) -> String {
    let mut text = String::new();
    if let Written::Table(mut entries) = Keys::write(case, Paths::NameOnly) {
        entries.keep(names);
        entries.put_in_order(&ORDER);
        entries.render("", &mut text);
    }
    hex(xxhash_rust::xxh3::xxh3_64(text.as_bytes()))
}

/// The same in the form in which it is written.
#[must_use]
pub fn hash_text(case: &Case) -> String {
    hex(hash(case))
}

fn hex(hash: u64) -> String {
    format!("{hash:016x}")
}

/// Keys whose value is the name of a file.
const FILES: [&str; 7] = ["file", "sphere_file", "recipe", "state", "bed", "water", "shape.mesh.file"];

/// Hash of the meaning that a resolved copy had for the program which wrote it, by its text alone: that of [`hash`],
/// whatever keys programs have come to know since.
#[must_use]
pub fn hash_of_copy(text: &str) -> u64 {
    let lines = text.lines().map(|line| name_only(line).unwrap_or_else(|| line.to_owned()) + "\n");
    xxhash_rust::xxh3::xxh3_64(lines.collect::<String>().as_bytes())
}

/// A line of a resolved copy that names a file, without its folder; `None` for another line.
fn name_only(line: &str) -> Option<String> {
    let (key, value) = line.split_once(" = ")?;
    match key {
        "region" => Some(format!("region = {}", names_only(value))),
        key if FILES.contains(&key) => Some(format!("{key} = {}", name_of(value)?)),
        _ => None,
    }
}

/// A file name as TOML, without its folder.
fn name_of(value: &str) -> Option<String> {
    let toml::Value::String(path) = value.parse().ok()? else { return None };
    Some(quoted(Path::new(&path).file_name()?.to_str()?))
}

/// A region on its line, with the files in it without their folders.
fn names_only(mut rest: &str) -> String {
    const FILE: &str = "{ file = ";
    let mut text = String::new();
    while let Some(begin) = rest.find(FILE).map(|place| place + FILE.len()) {
        text += &rest[..begin];
        rest = &rest[begin..];
        // The first mark of the end at which it is a text: a name may hold some.
        let marks = rest.char_indices().skip(1).filter(|(_, mark)| matches!(mark, '"' | '\''));
        let found = marks.map(|(n, _)| n + 1).find_map(|end| Some((end, name_of(&rest[..end])?)));
        if let Some((end, name)) = found {
            text += &name;
            rest = &rest[end..];
        }
    }
    text + rest
}

/// Whether the case of `loaded` is the one whose hash was written down as `hash`: by its meaning, or as the copy that
/// an older program wrote.
#[must_use]
pub fn has_hash(loaded: &crate::LoadedCase, hash: &str) -> bool {
    [self::hash(&loaded.case), hash_of_copy(loaded.source.text())].iter().any(|&own| hex(own) == hash)
}

/// Hash of a resolved copy without its table `[run]` and the single times of its output, of which the end may be one: the
/// same for runs that differ in their length alone.
fn hash_without_length(copy: &str) -> String {
    let mut table = "";
    let kept = copy.lines().filter(|line| {
        if line.starts_with('[') {
            table = line;
        }
        table != "[run]" && !line.starts_with("at = ")
    });
    hex(hash_of_copy(&kept.map(|line| line.to_owned() + "\n").collect::<String>()))
}

/// Hash of the meaning of a case whatever its end.
#[must_use]
pub fn hash_of_any_length(case: &Case) -> String {
    hash_without_length(&write(case, Paths::NameOnly))
}

/// The same whatever the end of the feeds that end with it.
#[must_use]
pub fn hash_of_any_feed(case: &Case) -> String {
    let mut endless = case.clone();
    endless.grains.iter_mut().for_each(|population| population.move_end(case.run.until, 0.0));
    hash_of_any_length(&endless)
}

/// Whether the case of `loaded` is, but for its end, the one whose [`hash_of_any_length`] was written down as `hash`.
#[must_use]
pub fn has_hash_of_any_length(loaded: &crate::LoadedCase, hash: &str) -> bool {
    hash_of_any_length(&loaded.case) == hash || hash_without_length(loaded.source.text()) == hash
}
