//! The reference page of case files and the table of the preset `paper_literal`, written from the declarations.

use std::fmt::Write as _;

use crate::case::docs_in_order;
use crate::key::{DefaultDoc, KeyDoc, TableDoc, ValueDoc};

/// Text above the tables of the reference page.
const INTRODUCTION: &str = "\
# Case file reference

Generated from the declarations of the keys by `cargo xtask generate`; `sazanami explain KEY` prints the same for one key.

[Case files](../case-files.md) describes how values are written. A default in *italics* is the other one of
[`preset = \"paper_literal\"`](../paper-literal.md), where the two differ; \"required\" keys have none. `sazanami run` writes
all of them into OUT/case.toml as it used them. Addresses of the papers: [references](../references.md).

Kinds of values: a **length**, a **velocity**, ... are texts with a unit (`\"0.52 mm\"`); **number** and **count** are bare;
**vector** is a list of three; **word** is one of those listed; **file** is relative to the case file.
";

impl KeyDoc {
    /// The default in words, if there is one.
    #[must_use]
    pub fn default_text(&self) -> Option<String> {
        match &self.default {
            DefaultDoc::Required => None,
            DefaultDoc::None => Some("none".into()),
            DefaultDoc::Text(text) => Some(text.clone()),
        }
    }

    /// Kind of value, in words.
    #[must_use]
    pub fn kind(&self) -> String {
        let quantity = self.unit.map(|unit| {
            let name = unit.name;
            name.trim_start_matches("an ").trim_start_matches("a ").to_owned()
        });
        match (&self.value, quantity) {
            (ValueDoc::Leaf("number", _), Some(quantity)) => quantity,
            (ValueDoc::Leaf("two numbers", _), Some(quantity)) => format!("{quantity} in x1 and x2"),
            (ValueDoc::Leaf(kind, _), Some(quantity)) => format!("{kind} of {quantity}"),
            (ValueDoc::Leaf(kind, _), None) => (*kind).to_owned(),
            (ValueDoc::Words(_) | ValueDoc::Word, _) => "word".into(),
            (ValueDoc::Table(docs), _) if docs().is_choice => "one of".into(),
            (ValueDoc::Table(_), _) => "table".into(),
            (ValueDoc::Tables(_), _) => "list of tables".into(),
            (ValueDoc::Named(_), _) => "tables by name".into(),
        }
    }

    /// The range of its values in words, if there is one.
    #[must_use]
    pub fn range_text(&self) -> Option<String> {
        let unit = self.unit.map_or("", |unit| unit.unit);
        let counts = match self.count {
            [0, usize::MAX] => None,
            [least, usize::MAX] => Some(format!("{least} or more")),
            [least, most] => Some(format!("{least} to {most}")),
        };
        self.range.text(unit).or(counts)
    }
}

/// The page docs/guide/case-reference.md.
#[must_use]
pub fn page() -> String {
    let mut page = Page { text: INTRODUCTION.to_owned(), done: Vec::new() };
    let docs = docs_in_order();
    let (tables, top): (Vec<KeyDoc>, Vec<KeyDoc>) = docs
        .keys
        .into_iter()
        .partition(|key| matches!(key.value, ValueDoc::Table(_) | ValueDoc::Tables(_) | ValueDoc::Named(_)));
    page.heading("Top of the file", docs.about);
    page.table("", &top);
    for key in &tables {
        let header = match key.value {
            ValueDoc::Tables(_) => format!("`[[{}]]`", key.name),
            ValueDoc::Named(_) => format!("`[{}.NAME]`", key.name),
            _ => format!("`[{}]`", key.name),
        };
        page.heading(&header, key.about);
        page.nested(key.name, &key.nested_docs());
    }
    page.text
}

/// Names of types whose tables are described once, and where.
struct Page {
    text: String,
    done: Vec<(&'static str, String)>,
}

impl Page {
    fn heading(&mut self, title: &str, about: &str) {
        let _ = write!(self.text, "\n## {title}\n\n{about}\n");
    }

    fn nested(&mut self, path: &str, docs: &TableDoc) {
        if let Some((_, elsewhere)) = self.done.iter().find(|(name, _)| *name == docs.name) {
            let _ = write!(self.text, "\nThe keys of `{path}` are those of `{elsewhere}`.\n");
            return;
        }
        self.done.push((docs.name, path.to_owned()));
        self.table(path, &docs.keys);
    }

    fn table(&mut self, path: &str, keys: &[KeyDoc]) {
        let _ = write!(self.text, "\n| key | kind | default | range | meaning |\n|---|---|---|---|---|\n");
        for key in keys {
            let default = match (&key.default, &key.literal) {
                (DefaultDoc::Required, _) => "required".to_owned(),
                (DefaultDoc::None, None) => "–".to_owned(),
                (_, Some(literal)) => {
                    format!("{}, *{}*", ticked(&key.default_text().unwrap_or_default()), ticked(&literal.value))
                }
                (DefaultDoc::Text(text), None) => ticked(text),
            };
            let range = key.range_text().unwrap_or_default();
            let about = escaped(&meaning(key));
            let _ = writeln!(self.text, "| `{}` | {} | {default} | {range} | {about} |", key.name, key.kind());
        }
        for key in keys {
            let docs = match key.value {
                ValueDoc::Table(docs) | ValueDoc::Tables(docs) if !path.is_empty() => docs(),
                _ => continue,
            };
            let inner = format!("{path}.{}", key.name);
            if docs.keys.is_empty() {
                continue;
            }
            if self.done.iter().all(|(name, _)| *name != docs.name) {
                let _ = write!(self.text, "\n### `{inner}`\n\n{}\n", docs.about);
            }
            self.nested(&inner, &docs);
        }
    }
}

/// Meaning of a key, with the words it can have.
fn meaning(key: &KeyDoc) -> String {
    let ValueDoc::Words(words) = &key.value else { return key.about.to_owned() };
    let words = words.iter().map(|(word, about)| format!("`{word}`: {}", about.trim_end_matches('.')));
    format!("{} {}.", key.about, words.collect::<Vec<_>>().join("; "))
}

fn escaped(text: &str) -> String {
    text.replace('|', "\\|")
}

/// A value in code style; words as they are.
fn ticked(text: &str) -> String {
    let is_words = text.contains('`')
        || (text.contains(' ') && !text.starts_with(|c: char| c.is_ascii_digit() || c == '['))
        || ["required", "none", "empty", "adaptive"].contains(&text)
        || text.contains("otherwise")
        || text.contains("at most");
    if is_words { text.to_owned() } else { format!("`{text}`") }
}

/// The keys that `paper_literal` sets, each with its path.
#[must_use]
pub fn literal_keys() -> Vec<(String, KeyDoc)> {
    let mut found = Vec::new();
    let docs = docs_in_order();
    collect_literal("", &docs, &mut Vec::new(), &mut found);
    found
}

fn collect_literal(path: &str, docs: &TableDoc, seen: &mut Vec<&'static str>, found: &mut Vec<(String, KeyDoc)>) {
    if seen.contains(&docs.name) {
        return;
    }
    seen.push(docs.name);
    for key in &docs.keys {
        let inner = if path.is_empty() { key.name.to_owned() } else { format!("{path}.{}", key.name) };
        collect_literal(&inner, &key.nested_docs(), seen, found);
        if key.literal.is_some() {
            found.push((inner, key.clone()));
        }
    }
}

/// The table of docs/paper-literal.md.
#[must_use]
pub fn literal_table() -> String {
    use sazanami_numerics::choice::Choice;
    let mut text = "| key | recommended | `paper_literal` | paper | reason |\n|---|---|---|---|---|\n".to_owned();
    for (path, key) in literal_keys() {
        let Some(literal) = &key.literal else { continue };
        let default = ticked(&key.default_text().unwrap_or_default());
        let (value, paper) = (ticked(&literal.value), literal.paper.word());
        let _ = writeln!(text, "| `{path}` | {default} | {value} | {paper} | {} |", escaped(literal.reason));
    }
    text
}
