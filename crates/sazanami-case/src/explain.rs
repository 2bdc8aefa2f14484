//! `sazanami explain KEY`: what the declaration of a key says, in the terminal.

use std::fmt::Write as _;

use sazanami_numerics::choice::Choice;

use crate::case::{Case, docs_in_order};
use crate::key::{DefaultDoc, KeyDoc, Keys, TableDoc, ValueDoc};
use crate::removed;
use crate::suggest::nearest;

/// Answer about a key.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Explained {
    /// Text on a key or a table, as the command prints it.
    Text(String),
    /// There is no such key; the nearest one, if one is near, and the tables or keys where the path is lost.
    Unknown {
        /// The nearest key.
        meant: Option<String>,
        /// Keys known where the path leaves them.
        known: Vec<String>,
    },
}

/// Explains the key with this path, such as `fluid.viscosity` or `grains.placement.packed.level`, or a key by its name alone;
/// without a path, the tables.
#[must_use]
pub fn explain(path: &str) -> Explained {
    let docs = docs_in_order();
    let path = path.trim().trim_matches(['[', ']']);
    if path.is_empty() {
        return Explained::Text(table_text("", &docs));
    }
    let names: Vec<&str> = path.split('.').filter(|name| name.parse::<usize>().is_err()).collect();
    if let Some((path, key)) = followed(&names, "", &docs) {
        return Explained::Text(key_text(&path, &key));
    }
    if let [name] = names[..] {
        let mut found = Vec::new();
        all_keys("", &docs, 0, &mut found);
        let texts: Vec<String> =
            found.iter().filter(|(_, key)| key.name == name).map(|(path, key)| key_text(path, key)).collect();
        if !texts.is_empty() {
            return Explained::Text(texts.join("\n"));
        }
    }
    match removed::instead_of(path, None) {
        Some(instead) => Explained::Text(format!("{path}\n  no longer a key: {instead}\n")),
        None => unknown(&names, &docs),
    }
}

/// Declaration of the key at the end of `names`, numbers of list elements left out.
pub(crate) fn declared(names: &[&str]) -> Option<KeyDoc> {
    followed(names, "", &Case::docs()).map(|(_, key)| key)
}

/// The key at the end of `names`, with its path.
fn followed(names: &[&str], path: &str, docs: &TableDoc) -> Option<(String, KeyDoc)> {
    let (name, rest) = names.split_first()?;
    let key = docs.keys.iter().find(|key| key.name == *name)?;
    let path = joined(path, name);
    let (path, rest) = match (&key.value, rest) {
        (ValueDoc::Named(_), [own, further @ ..]) if is_chosen_name(key, own, further) => {
            (format!("{path}.NAME"), further)
        }
        _ => (path, rest),
    };
    if rest.is_empty() { Some((path, key.clone())) } else { followed(rest, &path, &key.nested_docs()) }
}

/// Whether the first name below a table of named tables is one of the user's choice. Contacts go by pairs of materials;
/// elsewhere a name has keys behind it, so that a misspelt key is not taken for one.
fn is_chosen_name(table: &KeyDoc, name: &str, further: &[&str]) -> bool {
    let is_key = table.nested_docs().keys.iter().any(|key| key.name == name);
    let is_name = match table.name {
        "contact" => name == "default" || name.contains('/') || name == "NAME",
        _ => name == "NAME" || !further.is_empty(),
    };
    is_name && !is_key
}

fn joined(path: &str, name: &str) -> String {
    if path.is_empty() { name.to_owned() } else { format!("{path}.{name}") }
}

/// Levels of tables below the first one that are followed.
const DEEPEST: usize = 5;

/// Every key with its path; tables within tables of their own kind once.
fn all_keys(path: &str, docs: &TableDoc, depth: usize, found: &mut Vec<(String, KeyDoc)>) {
    for key in &docs.keys {
        let inner = joined(path, key.name);
        found.push((inner.clone(), key.clone()));
        if depth < DEEPEST {
            all_keys(&inner, &key.nested_docs(), depth + 1, found);
        }
    }
}

/// The paths that [`explain`] knows, in the order of the declaration.
#[must_use]
pub fn key_paths() -> Vec<String> {
    let mut found = Vec::new();
    all_keys("", &Case::docs(), 0, &mut found);
    found.into_iter().map(|(path, _)| path).collect()
}

/// The paths of keys that hold one value and can be laid over a case, the first element where there is a list of tables;
/// keys below names of the user's choice are left out.
#[must_use]
pub fn value_paths() -> Vec<String> {
    fn below(path: &str, docs: &TableDoc, depth: usize, found: &mut Vec<String>) {
        for key in &docs.keys {
            let inner = joined(path, key.name);
            match &key.value {
                ValueDoc::Leaf(..) | ValueDoc::Words(_) | ValueDoc::Word => found.push(inner),
                ValueDoc::Table(docs) if depth > 0 => below(&inner, &docs(), depth - 1, found),
                ValueDoc::Tables(docs) if depth > 0 => below(&joined(&inner, "0"), &docs(), depth - 1, found),
                ValueDoc::Table(_) | ValueDoc::Tables(_) | ValueDoc::Named(_) => {}
            }
        }
    }
    let mut found = Vec::new();
    below("", &Case::docs(), DEEPEST, &mut found);
    // A word by itself and a table of the same name are alternatives.
    found.dedup();
    found
}

fn unknown(names: &[&str], docs: &TableDoc) -> Explained {
    let mut docs = docs.clone();
    let mut path = String::new();
    for (n, name) in names.iter().enumerate() {
        let Some(key) = docs.keys.iter().find(|key| key.name == *name) else {
            let known: Vec<String> = docs.keys.iter().map(|key| joined(&path, key.name)).collect();
            let here = nearest(name, docs.keys.iter().map(|key| key.name)).map(|meant| {
                let here = joined(&path, meant);
                let whole = names[n + 1..].iter().fold(here.clone(), |path, name| joined(&path, name));
                match explain(&whole) {
                    Explained::Text(_) => whole,
                    Explained::Unknown { meant, .. } => meant.filter(|meant| meant.starts_with(&here)).unwrap_or(here),
                }
            });
            let mut all = Vec::new();
            all_keys("", &Case::docs(), 0, &mut all);
            let anywhere = || {
                let meant = nearest(names.last()?, all.iter().map(|(_, key)| key.name))?;
                all.iter().find(|(_, key)| key.name == meant).map(|(path, _)| path.clone())
            };
            return Explained::Unknown { meant: here.or_else(anywhere), known };
        };
        path = joined(&path, name);
        docs = key.nested_docs();
    }
    Explained::Unknown { meant: None, known: Vec::new() }
}

/// The keys of a table, one a line.
fn table_text(path: &str, docs: &TableDoc) -> String {
    let width = docs.keys.iter().map(|key| key.name.len()).max().unwrap_or(0);
    let mut text = String::new();
    for key in &docs.keys {
        let first = key.about.split_inclusive(". ").next().unwrap_or_default().trim();
        let _ = writeln!(text, "  {:width$}  {first}", key.name);
    }
    if path.is_empty() {
        let _ = writeln!(text, "\n`sazanami explain KEY` says more, for example `sazanami explain fluid.viscosity`.");
    }
    text
}

fn key_text(path: &str, key: &KeyDoc) -> String {
    let mut text = format!("{path}\n  {}\n", key.about);
    let docs = key.nested_docs();
    let mut line = |label: &str, value: &str| {
        let _ = writeln!(text, "  {label:14} {value}");
    };
    line("kind", &key.kind());
    if let Some(unit) = key.unit {
        line(
            "unit",
            &format!("{} in OUT/case.toml; any unit of {}, such as \"{}\"", unit.unit, unit.name, unit.example),
        );
    }
    if let Some(range) = key.range_text() {
        line("range", &range);
    }
    match (&key.default, &key.value) {
        (DefaultDoc::Required, _) => line("default", "required"),
        (DefaultDoc::Text(default), _) => line("default", default),
        (DefaultDoc::None, ValueDoc::Leaf(..) | ValueDoc::Words(_)) => line("default", "none"),
        (DefaultDoc::None, _) => {}
    }
    if let Some(literal) = &key.literal {
        line("paper_literal", &format!("{} ({}): {}", literal.value, literal.paper.word(), literal.reason));
    }
    if let ValueDoc::Words(words) = &key.value {
        for (word, about) in words {
            line(&format!("`{word}`"), about);
        }
    }
    if !docs.keys.is_empty() {
        let _ = write!(text, "{}\n{}", if docs.is_choice { "  one of" } else { "  keys" }, table_text(path, &docs));
    }
    text
}
