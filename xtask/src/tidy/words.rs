//! Words that choose a scheme: each is a default, a line of the preset `paper_literal`, or used by a shipped case or by verification.

use std::io;
use std::path::Path;

use sazanami::case::Case;
use sazanami::case::key::{KeyDoc, Keys, TableDoc, ValueDoc};

use crate::links::files_below;

/// Tables whose words choose among schemes.
const TABLES: [&str; 6] = ["contact", "coupling", "dem", "fluid", "overlap", "particles"];
/// A word of a key.
struct Word {
    path: String,
    key: &'static str,
    word: &'static str,
    /// All words of the key.
    all: Vec<&'static str>,
}

/// What is wrong with the words that nothing uses.
pub fn unused(root: &Path) -> io::Result<Vec<String>> {
    let sources = |folder: &str, kind: &str| -> io::Result<String> {
        let mut files = Vec::new();
        files_below(&root.join(folder), kind, &mut files)?;
        files.iter().map(std::fs::read_to_string).collect()
    };
    let programs = sources("crates/sazanami-verification/src", "rs")?;
    let uses = format!("{}{}{programs}", sources("cases", "toml")?, sources("verification", "toml")?);
    let declared = choices(&sources("crates", "rs")?);
    let unused = words().into_iter().filter(|word| !is_used(word, &declared, &uses));
    let problem = |Word { path, word, .. }: Word| {
        format!(
            "`{path} = \"{word}\"` is used by no shipped case and no row of verification: remove it \
             (sazanami-case/src/removed.rs)"
        )
    };
    Ok(unused.map(problem).collect())
}

/// The words that are neither defaults nor lines of the preset, of this key or of another one with the same words.
fn words() -> Vec<Word> {
    let mut keys = Vec::new();
    for table in Case::docs().keys.iter().filter(|key| TABLES.contains(&key.name)) {
        collect(table.name, &table.nested_docs(), &mut keys);
    }
    let mut found = Vec::new();
    for (path, key) in &keys {
        let all = words_of(key);
        for &word in &all {
            if !keys.iter().any(|(_, other)| words_of(other) == all && is_set(other, word)) {
                found.push(Word { path: path.clone(), key: key.name, word, all: all.clone() });
            }
        }
    }
    found
}

fn words_of(key: &KeyDoc) -> Vec<&'static str> {
    match &key.value {
        ValueDoc::Words(words) => words.iter().map(|(word, _)| *word).collect(),
        _ => Vec::new(),
    }
}

/// The keys of a table and of the tables in it, by their paths.
fn collect(path: &str, docs: &TableDoc, found: &mut Vec<(String, KeyDoc)>) {
    for key in &docs.keys {
        let path = format!("{path}.{}", key.name);
        collect(&path, &key.nested_docs(), found);
        found.push((path, key.clone()));
    }
}

/// Whether a word is the default of a key, in some case, or its value in the preset.
fn is_set(key: &KeyDoc, word: &str) -> bool {
    let literal = key.literal.as_ref().map(|literal| literal.value.as_str());
    let texts = key.default_text().into_iter().chain(literal.map(str::to_owned));
    texts
        .flat_map(|text| text.split(|c: char| !c.is_alphanumeric() && c != '_').map(str::to_owned).collect::<Vec<_>>())
        .any(|part| part == word)
}

/// Whether a case sets the word, or a program names its variant.
fn is_used(word: &Word, declared: &[Choices], uses: &str) -> bool {
    let Word { key, word, all, .. } = word;
    let of_key = declared.iter().filter(|choices| all.iter().all(|word| choices.variant(word).is_some()));
    let code = of_key.filter_map(|choices| Some(format!("{}::{}", choices.name, choices.variant(word)?)));
    [format!("{key} = \"{word}\""), format!("{key}={word}")].into_iter().chain(code).any(|text| uses.contains(&text))
}

/// An enumeration declared with words: its name, and its variants with their words.
struct Choices {
    name: String,
    variants: Vec<[String; 2]>,
}

impl Choices {
    fn variant(&self, word: &str) -> Option<&str> {
        self.variants.iter().find(|[_, of]| of == word).map(|[variant, _]| variant.as_str())
    }
}

/// The enumerations of all blocks of `choices!`.
fn choices(code: &str) -> Vec<Choices> {
    let mut found: Vec<Choices> = Vec::new();
    for block in code.split("choices! {").skip(1) {
        let lines = block.lines().take_while(|line| *line != "}").map(str::trim);
        for line in lines.filter(|line| !line.starts_with("//")) {
            if let Some((_, name)) = line.split_once("enum ") {
                let name = name.trim_end_matches(['{', ' ']).to_owned();
                found.push(Choices { name, variants: Vec::new() });
            } else if let (Some((variant, word)), Some(last)) = (line.split_once(" = \""), found.last_mut()) {
                last.variants.push([variant.to_owned(), word.trim_end_matches("\",").to_owned()]);
            }
        }
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;

    const CODE: &str = r#"
choices! {
    /// How water flows.
    #[derive(Default)]
    pub enum Flow {
        /// Down.
        #[default]
        Down = "down",
        /// Up.
        AgainstGravity = "up",
    }
}
"#;

    #[test]
    fn a_word_is_used_by_a_case_an_override_or_its_variant() {
        let declared = choices(CODE);
        assert_eq!((declared.len(), declared[0].variant("up")), (1, Some("AgainstGravity")));
        let word = Word { path: "fluid.flow".into(), key: "flow", word: "up", all: vec!["down", "up"] };
        for uses in ["flow = \"up\"", "\"fluid.flow=up\"", "let flow = Flow::AgainstGravity;"] {
            assert!(is_used(&word, &declared, uses), "{uses}");
        }
        for uses in ["flow = \"down\"", "Other::AgainstGravity", "up"] {
            assert!(!is_used(&word, &declared, uses), "{uses}");
        }
    }

    #[test]
    fn defaults_and_lines_of_the_preset_are_set() {
        let keys = Case::docs().keys;
        let fluid = keys.iter().find(|key| key.name == "fluid").unwrap().nested_docs();
        let key = |name: &str| fluid.keys.iter().find(|key| key.name == name).unwrap();
        assert!(is_set(key("vof"), "plic") && !is_set(key("vof"), "thinc_wlic"));
        assert!(is_set(key("convection"), "velocity_form") && is_set(key("viscosity"), "crank_nicolson"));
        assert!(words().iter().any(|word| word.path == "fluid.vof" && word.word == "thinc_wlic"));
    }
}
